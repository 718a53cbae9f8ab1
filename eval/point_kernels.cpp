// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

// Registers of unknown size do not go into arrays. Before any header of Highway.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)

#include "eval/point_kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "eval/point_kernels.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep

// After foreach_target.h.
#include "eval/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace osdx::HWY_NAMESPACE {

using detail::kLanes;
using detail::PointJet;
using detail::PointSum;
using detail::RingTables;
using detail::TaylorRows;

using Quad = Pack<double, 4>;
using P8 = Pack<double, kLanes>;

/// Ribbons in lanes pay where registers are wide enough; elsewhere PatchBasis goes over the
/// ribbons one by one.
constexpr bool kHasPolygons = P8::kParts <= 2;

// ------------------------------------------------------------------ sums over points

/// Up to four channels of a control point. Beyond those there may be anything.
template <class T>
HWY_INLINE Quad load_point(const PointSum<T>& sum, Index point) {
    const std::size_t at = std::size_t(point) * sum.stride;
    if (HWY_LIKELY(at + 4 <= sum.n_values))
        return Quad::load(sum.values + at);
    T last[4] = {};
    for (std::size_t k = at; k < sum.n_values; ++k)
        last[k - at] = sum.values[k];
    return Quad::load(last);
}

/// From Taylor coefficients in the kernel's variables to the derivatives that are asked for.
template <int kOrder, class T>
HWY_INLINE void finish(const PointSum<T>& sum, const LaneJet<Quad, kOrder>& jet,
                       PointJet& out) {
    jet.c[0].store(out.value[0]);
    if constexpr (kOrder > 0) {
        const auto& m = sum.map;
        const auto number = [](double x) OSDX_LAMBDA { return Quad(x); };
        const Quad &x = jet.c[1], &y = jet.c[2];
        mul_add(number(m.x_u), x, number(m.y_u) * y).store(out.value[1]);
        mul_add(number(m.x_v), x, number(m.y_v) * y).store(out.value[2]);
        if constexpr (kOrder > 1) {
            const Quad &xx = jet.c[3], &xy = jet.c[4], &yy = jet.c[5];
            const auto second = [&](double x_p, double y_p, double x_q,
                                    double y_q) OSDX_LAMBDA {
                return mul_add(number(2 * x_p * x_q), xx,
                               mul_add(number(x_p * y_q + y_p * x_q), xy,
                                       number(2 * y_p * y_q) * yy));
            };
            second(m.x_u, m.y_u, m.x_u, m.y_u).store(out.value[3]);
            mul_add(number(m.x_uv), x, second(m.x_u, m.y_u, m.x_v, m.y_v))
                .store(out.value[4]);
            second(m.x_v, m.y_v, m.x_v, m.y_v).store(out.value[5]);
        }
    }
}

// ------------------------------------------------------------------ regular patches

/// The basis at u: derivative r of function j over r! in out[r][j].
template <int kDegree, int kOrder>
HWY_INLINE void uniform_basis(const TaylorRows& taylor, int degree, double u,
                              double (*out)[16]) {
    const int d = kDegree > 0 ? kDegree : degree;
    const int stride = kDegree > 0 ? (kDegree + 4) / 4 * 4 : taylor.stride;
    const Quad v(u - 0.5);
    for (int j = 0; j < stride; j += 4) {
        const double* row = taylor.rows.data() + d * stride + j;
        Quad c0 = Quad::load(row), c1, c2;
        for (int r = d - 1; r >= 0; --r) {
            row -= stride;
            if constexpr (kOrder > 1)
                c2 = mul_add(c2, v, c1);
            if constexpr (kOrder > 0)
                c1 = mul_add(c1, v, c0);
            c0 = mul_add(c0, v, Quad::load(row));
        }
        c0.store(out[0] + j);
        if constexpr (kOrder > 0)
            c1.store(out[1] + j);
        if constexpr (kOrder > 1)
            c2.store(out[2] + j);
    }
}

template <int kDegree, int kOrder, class T>
void regular(const TaylorRows& taylor, int degree, double s, double t,
             const PointSum<T>& sum, PointJet& out) {
    const int d = kDegree > 0 ? kDegree : degree;
    alignas(64) double along_s[kOrder + 1][16], along_t[kOrder + 1][16];
    uniform_basis<kDegree, kOrder>(taylor, degree, s, along_s);
    uniform_basis<kDegree, kOrder>(taylor, degree, t, along_t);
    LaneJet<Quad, kOrder> jet;
    const Index* point = sum.points;
    for (int k = 0; k <= d; ++k) {
        Quad row[kOrder + 1];
        for (int j = 0; j <= d; ++j) {
            const Quad p = load_point(sum, *point++);
            for (int r = 0; r <= kOrder; ++r)
                row[r] = mul_add(Quad(along_s[r][j]), p, row[r]);
        }
        for (int m = 0, c = 0; m <= kOrder; ++m) {
            for (int y = 0; y <= m; ++y, ++c)
                jet.c[c] = mul_add(Quad(along_t[y][k]), row[m - y], jet.c[c]);
        }
    }
    finish(sum, jet, out);
}

template <class T>
void regular_of_any(const TaylorRows& taylor, int degree, double s, double t,
                    const PointSum<T>& sum, PointJet& out) {
    if (degree == 3) {
        switch (sum.order) {
            case 0:
                return regular<3, 0, T>(taylor, degree, s, t, sum, out);
            case 1:
                return regular<3, 1>(taylor, degree, s, t, sum, out);
            default:
                return regular<3, 2>(taylor, degree, s, t, sum, out);
        }
    }
    switch (sum.order) {
        case 0:
            return regular<0, 0>(taylor, degree, s, t, sum, out);
        case 1:
            return regular<0, 1>(taylor, degree, s, t, sum, out);
        default:
            return regular<0, 2>(taylor, degree, s, t, sum, out);
    }
}

// ------------------------------------------------------------------ patches of n sides

/// Distances to sides k, k+1, ... as jets.
template <class V, int kOrder>
HWY_INLINE LaneJet<V, kOrder> distances(const RingTables& t, int k, double a, double b) {
    // Exact 0 on the side, and to relative precision near it.
    const V low = mul_add(V(b), load<V>(t.right.at(k)), V((1 - b) * t.centre)),
            high =
                mul_add(V(1 - b), load<V>(t.left.at(k)), V(b) * load<V>(t.corner.at(k)));
    LaneJet<V, kOrder> l(mul_add(V(1 - a), low, V(a) * high));
    if constexpr (kOrder > 0) {
        l.c[1] = -load<V>(t.normal_x.at(k));
        l.c[2] = -load<V>(t.normal_y.at(k));
    }
    return l;
}

template <int kOrder>
HWY_INLINE LaneJet<P8, kOrder> permute(const LaneJet<P8, kOrder>& x,
                                       const std::array<std::int64_t, kLanes>& index) {
    using J = LaneJet<P8, kOrder>;
    J r;
    repeat<J::kSize>(J::kSize,
                     [&](auto k) OSDX_LAMBDA { r.c[k] = permute(x.c[k], index.data()); });
    return r;
}

/// The sides' parameters h where all sides are in one register: see RingTables::quotient.
template <int kOrder>
HWY_INLINE LaneJet<P8, kOrder> ring_h(const RingTables& t, double a, double b,
                                      const LaneJet<P8, kOrder>& l) {
    using J = LaneJet<P8, kOrder>;
    using S = LaneJet<double, kOrder>;
    const double ab = a * b, x = t.centre * t.centre * (a + b - 2 * ab) + ab,
                 y = t.centre * t.sine * (b - a);
    S inverse;
    {
        // W and its derivatives by z = x^2 + y^2.
        const double z = x * x + y * y, c1 = t.total[1], c2 = t.total[2];
        S sum(t.total[0] + z * (c1 + z * c2));
        if constexpr (kOrder > 0) {
            const double slope = c1 + 2 * z * c2;
            sum.c[1] = 2 * x * slope;
            sum.c[2] = 2 * y * slope;
            if constexpr (kOrder > 1) {
                sum.c[3] = slope + 4 * x * x * c2;
                sum.c[4] = 8 * x * y * c2;
                sum.c[5] = slope + 4 * y * y * c2;
            }
        }
        inverse = S(1.0) / sum;
    }
    const P8 nx = P8::load(t.normal_x.at(0)), ny = P8::load(t.normal_y.at(0));
    const P8 xi = P8(t.centre) - l.c[0];
    const P8 eta = neg_mul_add(P8(x), ny, P8(y) * nx), e = eta * eta;
    const auto coefficient = [&](int p, int r)
                                 OSDX_LAMBDA { return P8(t.quotient[p][r]); };
    J q;  // in (xi, eta)
    if (t.n <= 5) {
        const P8 q2 = coefficient(2, 0) * xi;
        q.c[0] = mul_add(q2 + coefficient(1, 0), xi,
                         mul_add(e, coefficient(0, 1), coefficient(0, 0)));
        if constexpr (kOrder > 0) {
            q.c[1] = q2 + (q2 + coefficient(1, 0));
            q.c[2] = eta * P8(2 * t.quotient[0][1]);
        }
        if constexpr (kOrder > 1) {
            q.c[3] = coefficient(2, 0);
            q.c[5] = coefficient(0, 1);
        }
    } else {
        for (int p = t.n - 3; p >= 0; --p) {  // Horner's scheme in xi
            if constexpr (kOrder > 1) {
                q.c[3] = mul_add(q.c[3], xi, q.c[1]);
                q.c[4] = mul_add(q.c[4], xi, q.c[2]);
                q.c[5] = q.c[5] * xi;
            }
            if constexpr (kOrder > 0) {
                q.c[1] = mul_add(q.c[1], xi, q.c[0]);
                q.c[2] = q.c[2] * xi;
            }
            q.c[0] = mul_add(q.c[0], xi, coefficient(p, 0));
            if (p + 2 <= t.n - 3) {
                const P8 c1 = coefficient(p, 1), c2 = coefficient(p, 2),
                         slope = mul_add(c2 + c2, e, c1);
                q.c[0] = mul_add(mul_add(c2, e, c1), e, q.c[0]);
                if constexpr (kOrder > 0)
                    q.c[2] = mul_add(eta + eta, slope, q.c[2]);
                if constexpr (kOrder > 1)
                    q.c[5] = q.c[5] + mul_add(P8(4.0) * c2, e, slope);
            }
        }
    }
    // Times l = centre - xi, then from (xi, eta) to (x, y).
    J h;
    h.c[0] = l.c[0] * q.c[0];
    if constexpr (kOrder > 0) {
        const P8 h1 = mul_add(l.c[0], q.c[1], -q.c[0]), h2 = l.c[0] * q.c[2];
        h.c[1] = neg_mul_add(ny, h2, nx * h1);
        h.c[2] = mul_add(nx, h2, ny * h1);
        if constexpr (kOrder > 1) {
            const P8 h3 = mul_add(l.c[0], q.c[3], -q.c[1]),
                     h4 = mul_add(l.c[0], q.c[4], -q.c[2]), h5 = l.c[0] * q.c[5];
            const P8 xx = nx * nx, xy = nx * ny, yy = ny * ny;
            h.c[3] = mul_add(xx, h3, neg_mul_add(xy, h4, yy * h5));
            h.c[4] = mul_add(P8(2.0) * xy, h3 - h5, (xx - yy) * h4);
            h.c[5] = mul_add(yy, h3, mul_add(xy, h4, xx * h5));
        }
    }
    return h * J::same(inverse);
}

/// h where there are more sides, from Wachspress' weights of the corners, over the product
/// P = l_0 l_1 / product of all l: 1 for corner 0, l_0/l_2 and l_1/l_-1 beside it, and
/// P/(l_j l_(j+1)) for the others, which are far.
template <int kOrder>
class WindowH {
    using J = LaneJet<P8, kOrder>;
    using S = LaneJet<double, kOrder>;

public:
    HWY_INLINE WindowH(const RingTables& t, double a, double b) : t_(t) {
        S rest;
        for (int j = 0; j < t.n; j += kLanes) {
            const J w =
                far(j, t.far_weight_once.data() + j, distances<P8, kOrder>(t, j, a, b),
                    distances<P8, kOrder>(t, j + 1, a, b));
            for (int k = 0; k < S::kSize; ++k)
                rest.c[k] += sum_of_lanes(w.c[k]);
        }
        const S l0 = distances<double, kOrder>(t, 0, a, b),
                l1 = distances<double, kOrder>(t, 1, a, b);
        const S before = l1 / distances<double, kOrder>(t, -1, a, b),
                after = l0 / distances<double, kOrder>(t, 2, a, b);
        S product = l0 * l1;
        S sum = mul_add(product, rest, before + after);
        sum.c[0] += 1;
        const S inverse = S(1.0) / sum;
        product = product * inverse;
        near_[0] = J::same(before * inverse);
        near_[1] = J::same(inverse);
        near_[2] = J::same(after * inverse);
        rest_ = J::same(rest * product);
        product_ = J::same(product);
    }

    /// The sum of all weights but i and i-1, over the sum of all, for the sides from `first`
    /// on but that in lane 0. Next to the sides at the corner, where h vanishes, every term
    /// is positive.
    HWY_INLINE J h(int first, const J& l, const J& l_next) const {
        const J w = far(first, t_.far_weight.at(first), l, l_next);
        J sum = rest_ - product_ * (w + permute(w, t_.previous));
        for (int i = 0; i < 3; ++i) {
            const P8 part = P8::load(t_.near_weight[i].at(first));
            for (int k = 0; k < J::kSize; ++k)
                sum.c[k] = mul_add(part, near_[i].c[k], sum.c[k]);
        }
        return sum;
    }

private:
    /// 1/(l_j l_(j+1)) for the corners that are far, else 0.
    HWY_INLINE J far(int j, const double* is_far, const J& l, const J& l_next) const {
        return J(P8::load(is_far)) / (masked(l, j) * masked(l_next, j + 1));
    }
    /// 1 for the sides at the corner, which no far weight has.
    HWY_INLINE J masked(const J& l, int side) const {
        const P8 far = P8::load(t_.is_far.at(side));
        J r = l * far;
        r.c[0] = r.c[0] + (P8(1.0) - far);
        return r;
    }

    const RingTables& t_;
    J near_[3], rest_, product_;
};

/// s_i, h_i, alpha_i and beta_i of ribbons, one a lane.
template <int kOrder>
struct Ribbons {
    using J = LaneJet<P8, kOrder>;
    J s, h, alpha, beta;
    P8 is_ribbon;
    HWY_INLINE Ribbons() {}  // an implicit one is not compiled for the instruction set
};

/// What follows from h, and l of the sides before.
template <int kExponent, int kOrder>
HWY_INLINE void blend(const RingTables& t, int first, int exponent,
                      const LaneJet<P8, kOrder>& l, Ribbons<kOrder>& r) {
    using J = LaneJet<P8, kOrder>;
    J before = permute(J(l.c[0]), t.previous), around;
    around.c[0] = mul_add(P8(t.sum_slope), l.c[0], P8(t.sum_value));
    if constexpr (kOrder > 0) {
        before.c[1] = -P8::load(t.normal_x.at(first - 1));
        before.c[2] = -P8::load(t.normal_y.at(first - 1));
        around.c[1] = P8(t.sum_slope) * l.c[1];
        around.c[2] = P8(t.sum_slope) * l.c[2];
    }
    r.s = before / around;

    // h^d
    const P8& h = r.h.c[0];
    P8 power[3];  // d - 2, d - 1, d
    power[0] = P8(1.0);
    repeat < kExponent == 0
        ? -1
        : kExponent<2 ? 0 : kExponent - 2>(
              exponent - 2, [&](auto) OSDX_LAMBDA { power[0] = power[0] * h; });
    power[1] = exponent > 1 ? power[0] * h : power[0];
    power[2] = power[1] * h;
    power[1] = power[1] * P8(double(exponent));
    if constexpr (kOrder > 1)
        power[0] = power[0] * P8(0.5 * exponent * (exponent - 1));
    const P8 taylor[3] = {power[2], power[1], power[0]};
    const J own = Inner<P8, kOrder>(r.h).compose(taylor),
            other = permute(own, t.previous), sum = own + other;
    const P8 inverse = P8(1.0) / sum.c[0];
    r.alpha = quotient(other, sum, inverse);
    J rest;  // 1 - alpha
    rest.c[0] = own.c[0] * inverse;
    repeat<J::kSize - 1>(J::kSize - 1,
                         [&](auto k) OSDX_LAMBDA { rest.c[k + 1] = -r.alpha.c[k + 1]; });
    r.beta = permute(rest, t.next);
}

/// Calls net(first, ribbons) for all blocks of ribbons, with ribbon first + m in lane m.
template <int kExponent, int kOrder, class Net>
HWY_INLINE void for_each_block(const RingTables& t, double a, double b, int exponent,
                               Net&& net) {
    Ribbons<kOrder> r;
    if (t.is_ring()) {
        const auto l = distances<P8, kOrder>(t, 0, a, b);
        r.h = ring_h<kOrder>(t, a, b, l);
        r.is_ribbon = P8::load(t.is_ribbon.data());
        blend<kExponent>(t, 0, exponent, l, r);
        return net(0, r);
    }
    const WindowH<kOrder> window(t, a, b);
    for (int i = 0; i < t.n; i += RingTables::kWindow) {
        const int first = i - RingTables::kFirstOfWindow;
        const auto l = distances<P8, kOrder>(t, first, a, b);
        r.h = window.h(first, l, distances<P8, kOrder>(t, first + 1, a, b));
        alignas(64) double is_ribbon[kLanes];
        for (int m = 0; m < kLanes; ++m)
            is_ribbon[m] = first + m < t.n ? t.is_ribbon[m] : 0.0;
        r.is_ribbon = P8::load(is_ribbon);
        blend<kExponent>(t, first, exponent, l, r);
        net(first, r);
    }
}

/// Derivatives at u of the uniform B-splines of degree d over one interval, over r!: those
/// of function j in out[j].
template <int kDegree, int kOrder>
HWY_INLINE void uniform_basis(int degree, const P8& u, P8 (*out)[kOrder + 1]) {
    // Values by the recurrence of bspline_basis(), derivatives by differences.
    constexpr bool kKnown = kDegree > 0;
    constexpr int kMost = kKnown ? kDegree : kMaxDegree;
    const int d = kKnown ? kDegree : degree;
    const P8 u1 = P8(1.0) - u;
    if constexpr (kDegree == 3) {
        // The same in fewer steps: u^3/6 and 2/3 - u^2 (1 - u/2), and their mirror images.
        const P8 half(0.5), sixth(1.0 / 6), third(2.0 / 3);
        const P8 x[2] = {u1, u};
        repeat<2>(2, [&](auto i) OSDX_LAMBDA {
            const P8 &v = x[i], square = v * v;
            P8 *outer = out[3 * i], *inner = out[2 - i];
            outer[0] = square * (v * sixth);
            inner[0] = neg_mul_add(square, neg_mul_add(half, v, P8(1.0)), third);
            const double sign = i == 0 ? -1 : 1;
            if constexpr (kOrder > 0) {
                outer[1] = square * P8(0.5 * sign);
                inner[1] = v * mul_add(v, P8(1.5 * sign), P8(-2 * sign));
            }
            if constexpr (kOrder > 1) {
                outer[2] = half * v;
                inner[2] = mul_add(v, P8(1.5), P8(-1.0));
            }
        });
        return;
    }
    P8 b[kMost + 1];
    b[0] = u1;
    b[1] = u;
    repeat<kKnown ? kDegree : -1>(d, [&](auto previous) OSDX_LAMBDA {
        const int k = previous + 1;  // b is the basis of degree k
        if (k > 1) {
            const P8 inverse(1.0 / k);
            b[k] = u * inverse * b[k - 1];
            repeat<kKnown ? int(previous) : -1>(k - 1, [&](auto i) OSDX_LAMBDA {
                const int j = k - 1 - i;
                const P8 left = mul_add(u, inverse, P8(double(k - j) / k)),
                         right = mul_add(u1, inverse, P8(double(j) / k));
                b[j] = mul_add(left, b[j - 1], right * b[j]);
            });
            b[0] = u1 * inverse * b[0];
        }
        if (k == d) {
            repeat<kKnown ? kDegree + 1 : -1>(
                d + 1, [&](auto j) OSDX_LAMBDA { out[j][0] = b[j]; });
        }
        if constexpr (kOrder > 0) {
            if (k == d - 1) {
                out[0][1] = -b[0];
                repeat<kKnown ? kDegree - 1 : -1>(
                    d - 1, [&](auto j) OSDX_LAMBDA { out[j + 1][1] = b[j] - b[j + 1]; });
                out[d][1] = b[d - 1];
            }
        }
        if constexpr (kOrder > 1) {
            if (k == d - 2) {
                const P8 half(0.5);
                repeat<kKnown ? kDegree + 1 : -1>(d + 1, [&](auto j) OSDX_LAMBDA {
                    P8 sum;
                    if (j < d - 1)
                        sum = half * b[j];
                    if (j >= 1 && j < d)
                        sum = sum - b[j - 1];
                    if (j >= 2)
                        sum = mul_add(half, b[j - 2], sum);
                    out[j][2] = sum;
                });
            }
        }
    });
    if constexpr (kOrder > 1) {
        if (d == 2) {
            out[0][2] = out[2][2] = P8(0.5);
            out[1][2] = P8(-1.0);
        }
    }
}

/// The same of E_(d-1) in its last interval.
template <int kDegree, int kOrder>
HWY_INLINE void extended_function(const RingTables& t, const P8& u, P8* out) {
    const int d = kDegree > 0 ? kDegree : t.degree;
    P8 c0(t.extended[d - 1]), c1, c2;
    repeat<kDegree - 1>(d - 1, [&](auto i) OSDX_LAMBDA {
        if constexpr (kOrder > 1)
            c2 = mul_add(c2, u, c1);
        if constexpr (kOrder > 0)
            c1 = mul_add(c1, u, c0);
        c0 = mul_add(c0, u, P8(t.extended[d - 2 - i]));
    });
    const P8 v = P8(1.0) - u;
    P8 v2(1.0);  // v^(d-2)
    repeat<kDegree == 0 ? -1 : kDegree - 2>(d - 2,
                                            [&](auto) OSDX_LAMBDA { v2 = v2 * v; });
    const P8 v1 = v2 * v, v0 = v1 * v, slope = P8(-double(d)) * v1;
    out[0] = c0 * v0;
    if constexpr (kOrder > 0)
        out[1] = mul_add(c1, v0, c0 * slope);
    if constexpr (kOrder > 1)
        out[2] = mul_add(c2, v0, mul_add(c1, slope, P8(0.5 * d * (d - 1)) * v2 * c0));
}

template <int kN, int kBy, int kOrder>
HWY_INLINE void shift_by(P8 (*functions)[kOrder + 1], int n, P8& interval) {
    const P8 by{double(kBy)};
    repeat<kN>(n, [&](auto i) OSDX_LAMBDA {
        const int j = n - 1 - i;
        repeat<kOrder + 1>(kOrder + 1, [&](auto r) OSDX_LAMBDA {
            functions[j][r] = if_at_least(
                interval, by, j >= kBy ? functions[j - kBy][r] : P8(), functions[j][r]);
        });
    });
    interval = if_at_least(interval, by, interval - by, interval);
}

/// Moves n functions to the columns that they stand for: by the interval in each lane.
template <int kN, int kOrder>
HWY_INLINE void shift(P8 (*functions)[kOrder + 1], int n, int last_interval,
                      P8 interval) {
    if (last_interval >= 8)
        shift_by<kN, 8, kOrder>(functions, n, interval);
    if (last_interval >= 4)
        shift_by<kN, 4, kOrder>(functions, n, interval);
    if (last_interval >= 2)
        shift_by<kN, 2, kOrder>(functions, n, interval);
    if (last_interval >= 1)
        shift_by<kN, 1, kOrder>(functions, n, interval);
}

/// Weights of points on their way to a sum: of several classes, of one block of ribbons.
struct Weights {
    static constexpr int kMostClasses = 16;

    alignas(64) double values[kMostClasses * 6 * kLanes];
};

/// What takes the weights: of the classes from `first_class` on, derivative r of class c in
/// lane m at [(c * n_derivatives + r) * kLanes + m], m the sector or spoke start + m modulo n.
struct WeightSink {
    void (*take)(const WeightSink& sink, const Weights& weights, int first_class,
                 int n_classes, int start);
    /// The weights of the vertex.
    void (*take_vertex)(const WeightSink& sink, const double* weights);
    const RingTables& tables;
    const void* sum;  // PointSum
    void* jets;       // of kernels that sum
};

/// Columns, with their blends, and rows of the ribbons of EV and EF patches, and their
/// products. kEV counts if the degree is known.
template <bool kEV, int kDegree, int kOrder>
HWY_INLINE void spline_ribbons(const RingTables& t, bool is_ev, int start,
                               const Ribbons<kOrder>& ribbons, const WeightSink& sink,
                               Weights& weights, LaneJet<double, kOrder>& f) {
    using J = LaneJet<P8, kOrder>;
    constexpr bool kKnown = kDegree > 0;
    constexpr int kMost = kKnown ? kDegree : kMaxDegree;
    constexpr int kColumns = kKnown ? 2 * kDegree - kEV : -1;
    constexpr int kD = kKnown ? kDegree : -1;
    const int d = kKnown ? kDegree : t.degree, m = d - 1;
    const bool ev = kKnown ? kEV : is_ev;
    const int n_columns = 2 * d - ev, n_intervals = d - ev;
    const P8 last{double(n_intervals - 1)};
    P8 functions[2 * kMost][kOrder + 1];
    J columns[2 * kMost], rows[kMost];

    {
        const J x = ribbons.h * P8(double(n_intervals));
        const P8 interval = clamp(floor(x.c[0]), P8(), last);
        const P8 u = x.c[0] - interval;
        uniform_basis<kDegree, kOrder>(d, u, functions);
        if (ev) {
            P8 extended[kOrder + 1];
            extended_function<kDegree, kOrder>(t, u, extended);
            for (int r = 0; r <= kOrder; ++r)
                functions[1][r] =
                    if_at_least(interval, last, extended[r], functions[1][r]);
        }
        shift<kD, kOrder>(functions, d, n_intervals - 1, interval);
        const Inner<P8, kOrder> of_h(x);
        repeat<kD>(d, [&](auto k) OSDX_LAMBDA { rows[k] = of_h.compose(functions[k]); });
    }
    {
        const J x = ribbons.s * P8(double(n_intervals));
        const P8 interval = clamp(floor(x.c[0]), P8(), last);
        uniform_basis<kDegree, kOrder>(d, x.c[0] - interval, functions);
        repeat<kKnown ? kColumns - kDegree - 1 : -1>(
            n_columns - d - 1, [&](auto i) OSDX_LAMBDA {
                for (int r = 0; r <= kOrder; ++r)
                    functions[d + 1 + i][r] = P8();
            });
        shift<kColumns, kOrder>(functions, n_columns, n_intervals - 1, interval);
        const Inner<P8, kOrder> of_s(x);
        const J alpha = ribbons.alpha * ribbons.is_ribbon,
                beta = ribbons.beta * ribbons.is_ribbon;
        repeat<kColumns>(n_columns, [&](auto j) OSDX_LAMBDA {
            const J column = of_s.compose(functions[j]);
            columns[j] = column * (j < d ? alpha : beta);
            if (ev && j == m)
                columns[j] = columns[j] * ribbons.beta;
        });
    }

    // f is the sum of the very weights, so that constants come out as such.
    J total;
    int first_class = 0, n_classes = 0;
    const auto add = [&](const J& w) OSDX_LAMBDA {
        total = total + w;
        const int at = n_classes * J::kSize * kLanes;
        repeat<J::kSize>(J::kSize, [&](auto k) OSDX_LAMBDA {
            w.c[k].store(weights.values + at + k * kLanes);
        });
        ++n_classes;
        if (!kKnown && n_classes == Weights::kMostClasses) {
            sink.take(sink, weights, first_class, n_classes, start);
            first_class += n_classes;
            n_classes = 0;
        }
    };
    J next_columns[kMost], next_rows[kMost];
    repeat<kD>(d, [&](auto k) OSDX_LAMBDA {
        next_columns[k] = permute(columns[k], t.next);
        next_rows[k] = permute(rows[k], t.next);
    });
    // The point a steps from side i and b from side i+1 lies in ribbons i and i+1.
    repeat<kKnown ? kDegree - kEV : -1>(d - ev, [&](auto i) OSDX_LAMBDA {
        const int a = i + ev;
        repeat<kKnown ? kDegree - kEV : -1>(d - ev, [&](auto j) OSDX_LAMBDA {
            const int b = j + ev;
            add(mul_add(columns[d - ev + b], rows[m - a],
                        next_columns[m - a] * next_rows[m - b]));
        });
    });
    if (ev) {
        // Points of a spoke lie in three.
        repeat<kKnown ? kDegree - 1 : -1>(m, [&](auto i) OSDX_LAMBDA {
            const int b = i + 1;
            const J two =
                mul_add(columns[m], rows[m - b], next_columns[m - b] * next_rows[m]);
            add(two + permute(columns[m + b] * rows[m], t.previous));
        });
    }
    const J vertex = ev ? columns[m] * rows[m] : J();
    const P8 is_slot = P8::load(t.is_slot.data());
    double of_vertex[J::kSize];
    repeat<J::kSize>(J::kSize, [&](auto k) OSDX_LAMBDA {
        double sum[2];
        sum_lanes_of_two(total.c[k] * is_slot, vertex.c[k], sum);
        f.c[k] += sum[0] + sum[1];
        of_vertex[k] = sum[1];
    });
    if (ev)
        sink.take_vertex(sink, of_vertex);
    if (n_classes > 0)
        sink.take(sink, weights, first_class, n_classes, start);
}

/// Gives the weights of all points to a sink. \return f, by which sums are to be divided
template <bool kEV, int kDegree, int kOrder>
LaneJet<double, kOrder> polygon_weights(bool is_ev, const DomainPoint& point,
                                        const WeightSink& sink) {
    const RingTables& t = sink.tables;
    LaneJet<double, kOrder> f;
    Weights weights;
    for_each_block<kDegree, kOrder>(
        t, point.a, point.b, t.degree,
        [&](int first, const Ribbons<kOrder>& ribbons) OSDX_LAMBDA {
            spline_ribbons<kEV, kDegree, kOrder>(
                t, is_ev, (point.sector + first + t.n) % t.n, ribbons, sink, weights, f);
        });
    return f;
}

template <int kOrder>
LaneJet<double, kOrder> polygon_weights_of_any(bool is_ev, const DomainPoint& p,
                                               const WeightSink& sink) {
    if (sink.tables.degree != 3)
        return polygon_weights<false, 0, kOrder>(is_ev, p, sink);
    if (is_ev)
        return polygon_weights<true, 3, kOrder>(is_ev, p, sink);
    return polygon_weights<false, 3, kOrder>(is_ev, p, sink);
}

/// Weights go straight to sums of points.
template <int kOrder, class T>
struct SumSink {
    using Jet = LaneJet<Quad, kOrder>;

    static HWY_INLINE void add(Jet& jet, const double* weights, int stride,
                               const Quad& p) {
        repeat<Jet::kSize>(Jet::kSize, [&](auto k) OSDX_LAMBDA {
            jet.c[k] = mul_add(Quad(weights[k * stride]), p, jet.c[k]);
        });
    }
    static void take(const WeightSink& sink, const Weights& weights, int first_class,
                     int n_classes, int start) {
        const RingTables& t = sink.tables;
        const PointSum<T> sum = *static_cast<const PointSum<T>*>(sink.sum);
        const double* w = weights.values;
        const Index* slot = t.slot_points.data() + first_class * (t.n + kLanes) + start;
        const int n = t.n_lanes();
        // Two sums at a time, so that additions need not wait for each other.
        Jet even, odd;
        for (int c = 0; c < n_classes; ++c) {
            int i = 0;
            for (; i + 1 < n; i += 2) {
                add(even, w + i, kLanes, load_point(sum, sum.points[slot[i]]));
                add(odd, w + i + 1, kLanes, load_point(sum, sum.points[slot[i + 1]]));
            }
            if (i < n)
                add(even, w + i, kLanes, load_point(sum, sum.points[slot[i]]));
            w += Jet::kSize * kLanes;
            slot += t.n + kLanes;
        }
        Jet& jet = *static_cast<Jet*>(sink.jets);
        for (int k = 0; k < Jet::kSize; ++k)
            jet.c[k] = jet.c[k] + (even.c[k] + odd.c[k]);
    }
    static void take_vertex(const WeightSink& sink, const double* weights) {
        const auto& sum = *static_cast<const PointSum<T>*>(sink.sum);
        add(*static_cast<Jet*>(sink.jets), weights, 1, load_point(sum, sum.points[0]));
    }
};

template <int kOrder, class T>
void polygon_sum(const RingTables& t, PatchKind kind, const DomainPoint& p,
                 const PointSum<T>& sum, PointJet& out) {
    using Sink = SumSink<kOrder, T>;
    typename Sink::Jet jet;
    const WeightSink sink{&Sink::take, &Sink::take_vertex, t, &sum, &jet};
    const LaneJet<double, kOrder> f =
        polygon_weights_of_any<kOrder>(kind == PatchKind::EV, p, sink);
    typename Sink::Jet divisor;
    for (int k = 0; k < f.kSize; ++k)
        divisor.c[k] = Quad(f.c[k]);
    finish(sum, quotient(jet, divisor, Quad(1 / f.c[0])), out);
}

template <class T>
void polygon_sum_of_order(const RingTables& t, PatchKind kind, const DomainPoint& p,
                          const PointSum<T>& sum, PointJet& out) {
    switch (sum.order) {
        case 0:
            return polygon_sum<0>(t, kind, p, sum, out);
        case 1:
            return polygon_sum<1>(t, kind, p, sum, out);
        default:
            return polygon_sum<2>(t, kind, p, sum, out);
    }
}

template <class T>
void set_kernels(detail::PointKernels<T>& kernels) {
    kernels.regular = &regular_of_any<T>;
    kernels.polygon = nullptr;
    if constexpr (kHasPolygons)
        kernels.polygon = &polygon_sum_of_order<T>;
}
void set_float_kernels(detail::PointKernels<float>& kernels) {
    set_kernels(kernels);
}
void set_double_kernels(detail::PointKernels<double>& kernels) {
    set_kernels(kernels);
}

}  // namespace osdx::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace osdx {

HWY_EXPORT(set_float_kernels);
HWY_EXPORT(set_double_kernels);

namespace detail {

template <>
PointKernels<float>::PointKernels() {
    HWY_DYNAMIC_DISPATCH(set_float_kernels)(*this);
}
template <>
PointKernels<double>::PointKernels() {
    HWY_DYNAMIC_DISPATCH(set_double_kernels)(*this);
}

}  // namespace detail
}  // namespace osdx
#endif  // HWY_ONCE
