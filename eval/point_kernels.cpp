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
#include "eval/ribbon_weights-inl.h"

HWY_BEFORE_NAMESPACE();
namespace osdx::HWY_NAMESPACE {

using detail::PointJet;
using detail::PointSum;
using detail::TaylorRows;

using Quad = Pack<4>;

/// Ribbons in lanes pay where registers are wide enough; elsewhere PatchBasis goes over the
/// ribbons one by one.
constexpr bool kHasPolygons = P8::kParts <= 2;

// ------------------------------------------------------------------ sums over points

/// Up to four channels of a control point. Beyond those there may be anything.
template <class T>
HWY_INLINE Quad load_point(PointSum<T> sum, Index point) {
    const std::size_t at = std::size_t(point) * sum.stride;
    if (HWY_LIKELY(at <= sum.n_values - 4))
        return Quad::load(sum.values + at);
    T last[4] = {};
    for (std::size_t k = at; k < sum.n_values; ++k)
        last[k - at] = sum.values[k];
    return Quad::load(last);
}

/// From Taylor coefficients in the kernel's variables to the derivatives that are asked for.
template <int kOrder>
HWY_INLINE void finish(const detail::ChartMap& m, LaneJet<Quad, kOrder> jet,
                       PointJet& out) {
    jet.c[0].store(out.value[0]);
    if constexpr (kOrder > 0) {
        const Quad x = jet.c[1], y = jet.c[2];
        mul_add(Quad::of(m.x_u), x, Quad::of(m.y_u) * y).store(out.value[1]);
        mul_add(Quad::of(m.x_v), x, Quad::of(m.y_v) * y).store(out.value[2]);
        if constexpr (kOrder > 1) {
            const auto second = [&](double x_p, double y_p, double x_q,
                                    double y_q) OSDX_LAMBDA {
                return mul_add(Quad::of(2 * x_p * x_q), jet.c[3],
                               mul_add(Quad::of(x_p * y_q + y_p * x_q), jet.c[4],
                                       Quad::of(2 * y_p * y_q) * jet.c[5]));
            };
            second(m.x_u, m.y_u, m.x_u, m.y_u).store(out.value[3]);
            mul_add(Quad::of(m.x_uv), x, second(m.x_u, m.y_u, m.x_v, m.y_v))
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
    const Quad v = Quad::of(u - 0.5);
    for (int j = 0; j < stride; j += 4) {
        const double* row = taylor.rows.data() + d * stride + j;
        Quad c0 = Quad::load(row), c1 = Quad::zero(), c2 = Quad::zero();
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
             const detail::ChartMap& map, const PointSum<T>& sum, PointJet& out) {
    const int d = kDegree > 0 ? kDegree : degree;
    alignas(64) double along_s[kOrder + 1][16], along_t[kOrder + 1][16];
    uniform_basis<kDegree, kOrder>(taylor, degree, s, along_s);
    uniform_basis<kDegree, kOrder>(taylor, degree, t, along_t);
    auto jet = LaneJet<Quad, kOrder>::zero();
    const Index* point = sum.points;
    for (int k = 0; k <= d; ++k) {
        Quad row[kOrder + 1];
        for (int r = 0; r <= kOrder; ++r)
            row[r] = Quad::zero();
        for (int j = 0; j <= d; ++j) {
            const Quad p = load_point(sum, *point++);
            for (int r = 0; r <= kOrder; ++r)
                row[r] = mul_add(Quad::of(along_s[r][j]), p, row[r]);
        }
        for (int m = 0, c = 0; m <= kOrder; ++m) {
            for (int y = 0; y <= m; ++y, ++c)
                jet.c[c] = mul_add(Quad::of(along_t[y][k]), row[m - y], jet.c[c]);
        }
    }
    finish<kOrder>(map, jet, out);
}

template <class T>
void regular_of_any(const TaylorRows& taylor, int degree, double s, double t, int order,
                    const detail::ChartMap& map, const PointSum<T>& sum, PointJet& out) {
    if (degree == 3) {
        switch (order) {
            case 0:
                return regular<3, 0, T>(taylor, degree, s, t, map, sum, out);
            case 1:
                return regular<3, 1>(taylor, degree, s, t, map, sum, out);
            default:
                return regular<3, 2>(taylor, degree, s, t, map, sum, out);
        }
    }
    switch (order) {
        case 0:
            return regular<0, 0>(taylor, degree, s, t, map, sum, out);
        case 1:
            return regular<0, 1>(taylor, degree, s, t, map, sum, out);
        default:
            return regular<0, 2>(taylor, degree, s, t, map, sum, out);
    }
}

// ------------------------------------------------------------------ patches of n sides

/// Takes weights straight to sums of up to three channels. The fourth is the sum of the
/// weights themselves, so that constants come out as such.
template <int kOrder, class T>
struct PolygonSum {
    using Jet = LaneJet<Quad, kOrder>;

    const PointSum<T>& sum;
    bool is_ev;
    Jet jet;

    static void take(const WeightSink& sink, const Weights& weights, int start) {
        auto& state = *static_cast<PolygonSum*>(sink.state);
        const RingTables& t = sink.tables;
        if (t.degree != 3)
            state.template add<0, 0>(t, weights, start);
        else if (state.is_ev)
            state.template add<4, 2>(t, weights, start);
        else
            state.template add<9, 0>(t, weights, start);
    }

private:
    /// \tparam kSector, kSpoke  points of each sector and spoke; or both are 0
    template <int kSector, int kSpoke>
    HWY_INLINE void add(const RingTables& t, const Weights& weights, int start) {
        const int d = t.degree,
                  n_spoke = kSector > 0 ? kSpoke
                            : is_ev     ? d - 1
                                        : 0,
                  n_sector = kSector > 0 ? kSector
                             : is_ev     ? n_spoke * n_spoke
                                         : d * d;
        const PointSum<T> what = sum;
        const double* w = weights.values;
        const Index* const points = what.points;
        // Four sums, so that additions need not wait for each other.
        Jet s0 = jet, s1 = Jet::zero(), s2 = s1, s3 = s1;
        if (is_ev)
            s1 = added(s1, what, points[0], weights.vertex, 1, 0);
        const int n_lanes = t.n_lanes(), first_of_sectors = is_ev ? 1 + t.n * n_spoke : 0;
        for (int m = 0, sector = start; m < n_lanes; ++m, ++w) {
            const Index* point = points + first_of_sectors + sector * n_sector;
            int k = 0;
            for (; k + 4 <= n_sector; k += 4) {
                s0 = added(s0, what, point[k], w, kLanes, k);
                s1 = added(s1, what, point[k + 1], w, kLanes, k + 1);
                s2 = added(s2, what, point[k + 2], w, kLanes, k + 2);
                s3 = added(s3, what, point[k + 3], w, kLanes, k + 3);
            }
            for (; k < n_sector; ++k)
                s0 = added(s0, what, point[k], w, kLanes, k);
            point = points + 1 + sector * n_spoke;
            for (k = 0; k + 2 <= n_spoke; k += 2) {
                s1 = added(s1, what, point[k], w, kLanes, n_sector + k);
                s2 = added(s2, what, point[k + 1], w, kLanes, n_sector + k + 1);
            }
            if (k < n_spoke)
                s3 = added(s3, what, point[k], w, kLanes, n_sector + k);
            sector = sector + 1 < t.n ? sector + 1 : 0;
        }
        jet = (s0 + s1) + (s2 + s3);
    }
    static HWY_INLINE Jet added(Jet to, PointSum<T> sum, Index point, const double* w,
                                int stride, int k) {
        const Quad p = with_last_one(load_point(sum, point));
        for (int r = 0; r < Jet::kSize; ++r)
            to.c[r] = mul_add(Quad::of(w[(k * Jet::kSize + r) * stride]), p, to.c[r]);
        return to;
    }
};

template <int kOrder, class T>
void polygon_sum(const RingTables& t, PatchKind kind, const DomainPoint& p,
                 const detail::ChartMap& map, const PointSum<T>& sum, PointJet& out) {
    using Sum = PolygonSum<kOrder, T>;
    Sum state{sum, kind == PatchKind::EV, Sum::Jet::zero()};
    polygon_weights<kOrder>(kind, p, {&Sum::take, t, &state});
    typename Sum::Jet f;
    for (int k = 0; k < f.kSize; ++k)
        f.c[k] = last_everywhere(state.jet.c[k]);
    finish<kOrder>(map, state.jet / f, out);
}

template <class T>
void polygon_sum_of_order(const RingTables& t, PatchKind kind, const DomainPoint& p,
                          int order, const detail::ChartMap& map, const PointSum<T>& sum,
                          PointJet& out) {
    switch (order) {
        case 0:
            return polygon_sum<0>(t, kind, p, map, sum, out);
        case 1:
            return polygon_sum<1>(t, kind, p, map, sum, out);
        default:
            return polygon_sum<2>(t, kind, p, map, sum, out);
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
