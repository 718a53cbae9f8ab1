// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>

#include <osdx/types.h>

#include "eval/bases/bernstein.h"
#include "eval/bases/jet.h"
#include "eval/bases/polygon.h"

namespace osdx::inline OSDX_ABI {

/// What makes the weights of an n-sided Bezier patch sum to one.
enum class CentrePoint : std::uint8_t {
    Given,  ///< one more control point, in the middle, has what the ribbons' weights lack
    None,   ///< the weights are divided by their sum f
};

/// The basis functions of n-sided patches that interpolate given Bezier ribbons.
///
/// A ribbon of degree d along side i of the n-gon (Polygon) is a Bezier tensor product with
/// d + 1 columns, from v_(i-1) to v_i, and l = floor((d+1)/2) rows, from the side to the
/// middle. In s_i and h_i of PolygonSideParameters the patch is
///
///     S = sum over i, k < l, j of  mu_ij B_j(s_i) B_k(h_i) b_ijk  +  (1 - f) C,
///
/// with B of degree d and f the sum of the weights of all b, where each column is weighted by
///
///     mu_ij = alpha_i = h_(i-1)^(l-1) / (h_(i-1)^(l-1) + h_i^(l-1))   for j < l,
///             beta_i  = h_(i+1)^(l-1) / (h_(i+1)^(l-1) + h_i^(l-1))   for j > d - l,
///
/// and 1 between them.
///
/// The points (i, d - a, b) and (i + 1, b, a) with a, b < l stand for the same place. Where
/// they are the same points the patch has the derivatives below l of its ribbons at their
/// sides, and with n = 4 it is the tensor product: for even d with C for its middle point,
/// for odd d without any. It takes l = 2 rows that differ in
/// (1, 1) alone, the twists of Gregory, just as well.
/// Source: Várady, Salvi and Karikó, A multi-sided Bézier patch with a simple control
/// structure (2016); Hettinga, Arbitrary topology meshes in geometric design and vector
/// graphics (2021), section 2.3.5. Differs: as printed rows, columns and the sum of weights
/// run over other ranges; the blends have the power l - 1 instead of 1, without which ribbons
/// of more than two rows would be met with first derivatives only.
///
/// Weights are formed in double whatever the points are.
/// Threads: const members may run at the same time.
class GeneralisedBezierBasis {
public:
    /// \pre n >= 3; kMinBezierDegree <= degree <= kMaxDegree
    GeneralisedBezierBasis(int n, int degree, CentrePoint centre = CentrePoint::Given);

    /// Below it a ribbon has one row, and nothing to say on the derivative across its side.
    static constexpr int kMinBezierDegree = 3;

    int n() const noexcept { return polygon_.n(); }
    int degree() const noexcept { return d_; }
    int n_rows() const noexcept { return l_; }
    CentrePoint centre() const noexcept { return centre_; }
    const Polygon& polygon() const noexcept { return polygon_; }

    /// Order of the control points: by ribbon, column, row; then the centre.
    Index ribbon_point(int i, int j, int k) const noexcept {
        return static_cast<Index>((i * (d_ + 1) + j) * l_ + k);
    }
    Index centre_index() const noexcept { return ribbon_point(n(), 0, 0); }
    Index n_points() const noexcept {
        return centre_index() + (centre_ == CentrePoint::Given);
    }

    /// Calls sink(i, w) once with the jet w of the weight of each control point that has one.
    /// \return f, by which the sums are to be divided: 1 if the centre is given.
    ///
    /// Next to a corner the blends turn ever faster. There it is put to use that the ribbons
    /// that meet have the same corner points, up to the first derivatives, so that rounding
    /// is not magnified; weights of single points are those of the formula then only up to
    /// terms that cancel. At the corner itself, where second derivatives depend on the
    /// direction, they are the limit along the bisector a = b, and higher ones are 0.
    /// \pre the point is in the domain; no allocation
    template <int Order, class T, class Sink>
    Jet<T, Order> for_each_weight(const DomainPointOf<T>& p, Chart chart,
                                  Sink&& sink) const noexcept;
    template <int Order, class Sink>
    Jet<double, Order> for_each_weight(const DomainPoint& p, Chart chart,
                                       Sink&& sink) const noexcept {
        return for_each_weight<Order, double>(p, chart, sink);
    }

    /// The point of the n-gon under (a, b) of a sector.
    Vec2<double> to_native(const DomainPoint& p) const noexcept {
        return polygon_.sector_point(p);
    }
    /// The inverse; points outside of the n-gon are moved to it.
    DomainPoint from_native(const Vec2<double>& xy) const noexcept {
        return polygon_.sector_place(polygon_.sector_of(xy), xy);
    }

private:
    template <int Order, class T>
    class Corner;
    /// mu, and its value where that of the jet is only good for derivatives.
    template <int Order, class T>
    struct Blend {
        Jet<T, Order> mu;
        T value;
    };

    /// Within this distance 2 - a - b of a corner the ribbons that meet there come from their
    /// Taylor polynomials. What these leave out of derivative m is of order
    /// kNear^(5 + Order - m); outside of it rounding of derivative m is eps kNear^-m.
    static constexpr double kNear = 2e-3;
    /// Within this one, that of rounded places, a point has the derivatives of the corner, with
    /// the blends taken on the bisector kBisector away: the effect of either on derivatives
    /// is of their order. Powers of two, for 1 - a is exact.
    static constexpr double kCorner = 0x1p-45, kBisector = 0x1p-52;

    /// The polynomials B_0 .. B_d of a jet.
    template <int Order, class T>
    std::array<Jet<T, Order>, kMaxDegree + 1> bernstein(
        const Jet<T, Order>& x) const noexcept;

    /// x^(l-1) / (x^(l-1) + y^(l-1)), given x + y.
    template <class J>
    J sharpen(const J& x, const J& y, const J& sum) const noexcept {
        const J x1 = x / sum;
        if (l_ == 2)
            return x1;
        // Of parts of the sum, so that powers do not vanish.
        const J y1 = y / sum;
        J a = x1, b = y1;
        for (int m = 2; m < l_; ++m) {
            a = a * x1;
            b = b * y1;
        }
        return a / (a + b);
    }

    /// From the corner v_q to a point, in a chart.
    template <class T>
    std::array<T, 2> from_corner(const DomainPointOf<T>& p, Chart chart) const noexcept;

    Polygon polygon_;
    int d_, l_;
    CentrePoint centre_;
};

namespace detail {

/// A polynomial without its terms below degree 2, at (x, y) and with derivatives there.
template <int Order, class T, int Degree>
Jet<T, Order> second_order_part(const Jet<T, Degree>& p, const T& x,
                                const T& y) noexcept {
    using J = Jet<T, Order>;
    J jx(x), jy(y);
    if constexpr (Order > 0) {
        jx.c[1] = 1;
        jy.c[2] = 1;
    }
    // Horner's scheme in y for each power of x, and in x.
    J sum;
    for (int i = Degree; i >= 0; --i) {
        J row;
        for (int j = Degree - i; j >= 0; --j) {
            row = row * jy;
            if (i + j >= 2)
                row.c[0] += p.c[Jet<T, Degree>::index(i, j)];
        }
        sum = sum * jx + row;
    }
    return sum;
}

}  // namespace detail

template <class T>
std::array<T, 2> GeneralisedBezierBasis::from_corner(const DomainPointOf<T>& p,
                                                     Chart chart) const noexcept {
    const T a = 1 - p.a, b = 1 - p.b;
    if (chart == Chart::BaseUV)
        return {-a, -b};
    // Differences of the corners of the sector's quad: no cancellation.
    const Vec2<double> corner = polygon_.sector_point({p.sector, 1, 1}),
                       left = polygon_.sector_point({p.sector, 1, 0}),
                       right = polygon_.sector_point({p.sector, 0, 1});
    std::array<T, 2> r;
    for (int k = 0; k < 2; ++k)
        r[k] = p.a * b * (left[k] - corner[k]) + a * p.b * (right[k] - corner[k]) -
               a * b * corner[k];
    return r;
}

template <int Order, class T>
std::array<Jet<T, Order>, kMaxDegree + 1> GeneralisedBezierBasis::bernstein(
    const Jet<T, Order>& x) const noexcept {
    constexpr int kStride = Order + 1;
    std::array<T, (kMaxDegree + 1) * kStride> taylor;
    bernstein_basis<T>(
        d_, x.c[0], Order,
        std::span(taylor).first(static_cast<std::size_t>((d_ + 1) * kStride)));
    const JetPowers<T, Order> powers(x);
    std::array<Jet<T, Order>, kMaxDegree + 1> b;
    for (int j = 0; j <= d_; ++j)
        b[j] = powers.compose(taylor.data() + j * kStride);
    return b;
}

/// The two ribbons that meet at a corner, by their Taylor polynomials about it.
template <int Order, class T>
class GeneralisedBezierBasis::Corner {
    using J = Jet<T, Order>;

public:
    Corner(const GeneralisedBezierBasis& basis, const DomainPointOf<T>& p,
           Chart chart) noexcept
        : basis_(basis),
          is_close_(representative(2 - p.a - p.b) < kCorner),
          p_(is_close_ ? DomainPointOf<T>{p.sector, 1 - kBisector, 1 - kBisector} : p),
          x_(basis.from_corner<T>(p_, chart)),
          domain_(basis.polygon_, p_, chart) {
        const PolygonPoint<kTaylor, T> at(basis.polygon_, {p.sector, 1, 1}, chart);
        for (const int m : {0, 1}) {
            const int side = basis.polygon_.cyclic(p.sector + m);
            columns_[m] = basis.bernstein(at.s(side));
            rows_[m] = basis.bernstein(at.h(side));
        }
    }

    /// mu of ribbon i, towards another side.
    J blend(int side, int i) const noexcept {
        const J x = domain_.h(side), y = domain_.h(i), sum = x + y;
        return basis_.sharpen(x, y, sum);
    }

    /// The derivatives of a weight of the ribbon that ends (m = 0) or starts (m = 1) there,
    /// blended by mu. Terms below degree 2 are the same in both, so any blend will do.
    J weight(int m, int j, int k, const J& mu) const noexcept {
        const Jet<T, kTaylor> w = columns_[m][j] * rows_[m][k];
        J blended = mu * detail::second_order_part<Order, T>(w, x_[0], x_[1]);
        for (int c = 0; is_close_ && c < J::kSize; ++c) {
            if (c < 3 || c >= 6)
                blended.c[c] = 0;
        }
        if constexpr (Order > 0) {
            blended.c[1] += 0.5 * w.c[1];
            blended.c[2] += 0.5 * w.c[2];
        }
        return blended;
    }

private:
    static constexpr int kTaylor = Order + 4;

    const GeneralisedBezierBasis& basis_;
    bool is_close_;
    DomainPointOf<T> p_;  // where the blends are taken
    std::array<T, 2> x_;  // from the corner to there
    PolygonPoint<Order, T> domain_;
    std::array<Jet<T, kTaylor>, kMaxDegree + 1> columns_[2], rows_[2];
};

template <int Order, class T, class Sink>
Jet<T, Order> GeneralisedBezierBasis::for_each_weight(const DomainPointOf<T>& p,
                                                      Chart chart,
                                                      Sink&& sink) const noexcept {
    using J = Jet<T, Order>;
    const int n = polygon_.n(), q = p.sector;
    const double distance = representative(2 - p.a - p.b);
    std::optional<Corner<Order, T>> corner;
    if (Order > 0 && distance < kNear)
        corner.emplace(*this, p, chart);

    const PolygonPoint<Order, T> domain(polygon_, p, chart);
    J f, h_before = domain.h(n - 1), h = domain.h(0);
    for (int i = 0; i < n; ++i) {
        const J h_after = domain.h(polygon_.cyclic(i + 1));
        const J h_i = std::exchange(h, h_after);
        const J h_last = std::exchange(h_before, h_i);
        // Of the ribbon that ends (0) or starts (1) at the corner.
        const int m = i == q ? 0 : i == polygon_.cyclic(q + 1) ? 1 : -1;
        // The others are of order 3 at the corner, and s_i has no value there for n = 3.
        if (distance < kCorner && m < 0)
            continue;
        J s = domain.s(i);
        if (m == 0 && distance == 0)
            s.c[0] = 1;  // but for rounding
        const auto columns = bernstein(s), rows = bernstein(h_i);
        const auto blend = [&](int side, const J& towards, bool at_corner) {
            const J sum = towards + h_i;
            using J0 = Jet<T, 0>;
            const bool has_sum = representative(sum.c[0]) > 0;
            Blend<Order, T> r;
            r.value = has_sum ? sharpen(J0(towards.c[0]), J0(h_i.c[0]), J0(sum.c[0])).c[0]
                              : T(0.5);
            if (at_corner && corner)
                r.mu = corner->blend(side, i);
            else if (has_sum)
                r.mu = sharpen(towards, h_i, sum);
            return r;
        };
        const Blend<Order, T> alpha = blend(polygon_.cyclic(i - 1), h_last, m == 1),
                              beta = blend(polygon_.cyclic(i + 1), h_after, m == 0);
        for (int j = 0; j <= d_; ++j) {
            const bool first = j < l_, last = d_ - j < l_;
            for (int k = 0; k < l_; ++k) {
                J w = columns[j] * rows[k];
                if (first || last) {
                    const auto& [mu, mu_value] = first ? alpha : beta;
                    const T value = w.c[0] * mu_value;
                    if (corner && m == int(first))
                        w = corner->weight(m, j, k, mu);
                    else
                        w = w * mu;
                    w.c[0] = value;
                }
                f += w;
                sink(ribbon_point(i, j, k), w);
            }
        }
    }
    if (centre_ == CentrePoint::None)
        return f;
    const J one(1.0);
    sink(centre_index(), one - f);
    return one;
}

}  // namespace osdx::inline OSDX_ABI
