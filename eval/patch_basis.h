// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "eval/bspline_basis.h"
#include "eval/jet.h"
#include "far/patch_class.h"
#include "far/types.h"

namespace osdx {

/// The variables that derivatives are taken in.
enum class Chart : std::uint8_t {
    BaseUV,  ///< (u, v) of the base face; of the bilinear sector (a, b) for a PatchBasis
    Native,  ///< (x, y) of the regular n-gon; (s, t) of [0,1]^2 for regular patches
};

/// A point of the domain of a patch; see PatchPoint.
struct DomainPoint {
    int sector = 0;
    double a = 0, b = 0;
};

/// The basis functions of a class of patches, with the tables that they need.
///
/// The domain of EV and EF patches is the regular n-gon v_i = (cos 2 pi i/n, sin 2 pi i/n);
/// side i is the edge v_(i-1) v_i, and l_k is the distance to side k. Ribbon i is the
/// tensor-product B-spline along side i in
///
///     s_i = l_(i-1) / (l_(i-1) + l_(i+1)),    h_i = sum of phi_j over j != i, i-1
///
/// with Wachspress' coordinates phi. The patch is the sum of all ribbons, each column
/// weighted by alpha_i = h_(i-1)^d / (h_(i-1)^d + h_i^d) or beta_i = h_(i+1)^d / (h_(i+1)^d +
/// h_i^d) or both, over the sum f of all weights.
/// Source: Hettinga and Kosinka, Multisided B-spline patches over extraordinary regions
/// (2020); Hettinga, Arbitrary topology meshes in geometric design and vector graphics
/// (2021), ch. 5. Differs: s_i and h_i are written so that they are regular on the closed
/// n-gon for every n; columns are counted from 0.
///
/// Weights are formed in double whatever the points are: the blends cancel near corners,
/// and a valence of 360 leaves float no digits.
/// Threads: const members may run at the same time.
class PatchBasis {
public:
    /// \pre the degree is kMinDegree to kMaxDegree, n_sides >= 3
    explicit PatchBasis(const PatchClass& patch_class);

    const PatchClass& patch_class() const noexcept { return class_; }

    /// Calls sink(i, w) with the jet w of one contribution to the weight of control point i;
    /// a point may come several times. \return f, by which the sums are to be divided.
    ///
    /// At a corner, where the blends have no limit, the ribbon that starts there is taken
    /// alone: position and first derivatives are the limit, the second derivatives are those
    /// of one of the limits that depend on the direction, all with the same curvature.
    /// \pre the point is in the domain; no allocation
    template <int Order, class Sink>
    Jet<double, Order> for_each_weight(const DomainPoint& p, Chart chart,
                                       Sink&& sink) const noexcept;

    /// The point of the n-gon under (a, b) of a sector; (a, b) itself for regular patches.
    Vec2<double> to_native(const DomainPoint& p) const noexcept;
    /// The inverse; points outside of the n-gon are moved to it.
    DomainPoint from_native(Vec2<double> xy) const noexcept;

    /// s_i and h_i of every side, each n_sides long.
    struct SideParameters {
        std::vector<double> s, h;
    };
    SideParameters side_parameters(const DomainPoint& p) const;

private:
    template <int Order>
    class Domain;
    template <int Order>
    using J = Jet<double, Order>;

    template <int Order, class Sink>
    Jet<double, Order> regular_weights(double s, double t, Sink&& sink) const noexcept;
    template <int Order, class Sink>
    void ribbon_weights(int ribbon, const Jet<double, Order>& s,
                        const Jet<double, Order>& h, const Jet<double, Order>& alpha,
                        const Jet<double, Order>& beta, Jet<double, Order>& f,
                        Sink&& sink) const noexcept;

    /// Taylor coefficients of the rows of a ribbon at hbar = interval + u.
    void row_basis(int interval, double u, int order,
                   std::span<double> out) const noexcept;

    double centre_distance() const noexcept;

    int cyclic(int i) const noexcept { return i < 0 ? i + n_ : i >= n_ ? i - n_ : i; }

    PatchClass class_;
    int n_;                                // sides
    int d_;                                // degree
    int intervals_;                        // of a ribbon in both directions
    int columns_;                          // of a ribbon
    std::vector<double> vertex_distance_;  // m: of v_(k+m) to side k
    std::vector<Vec2<double>> normals_;    // k: (cos, sin) of the direction to side k
    std::vector<Index> ribbon_points_;     // ribbon, column, row: control point
    std::array<double, 2 * kMaxDegree> extended_{};  // Bezier coefficients of E_(d-1)
};

// ---------------------------------------------------------------------------------------

/// Distances, side parameters and blends at one point, as jets.
template <int Order>
class PatchBasis::Domain {
public:
    Domain(const PatchBasis& basis, const DomainPoint& p, Chart chart) noexcept
        : basis_(basis), p_(p), chart_(chart) {
        const int q = p.sector;
        const J<Order> lq = distance(q), lq1 = distance(basis.cyclic(q + 1));
        product_ = lq * lq1;
        J<Order> rest;
        for (int k = 2; k < basis.n_ - 1; ++k)
            rest += wachspress(basis.cyclic(q + k));
        const J<Order> before = wachspress(basis.cyclic(q - 1));
        const J<Order> after = wachspress(basis.cyclic(q + 1));
        const J<Order> inverse = J<Order>(1.0) / (rest + before + J<Order>(1.0) + after);
        inverse_ = inverse;
        // Next to the sides at the corner h is a sum of positive terms, not 1 minus one.
        h_q_ = (rest + after) * inverse;
        h_q1_ = (rest + before) * inverse;
    }

    /// l_k, by its values at the corners of the sector's quad: exact 0 on side k.
    J<Order> distance(int k) const noexcept {
        const auto at = [&](int i) {
            return basis_.vertex_distance_[basis_.cyclic(basis_.cyclic(i) - k)];
        };
        const int q = p_.sector;
        const double centre = basis_.centre_distance();
        const double left = 0.5 * (at(q - 1) + at(q)), corner = at(q),
                     right = 0.5 * (at(q) + at(q + 1));
        const double a = p_.a, b = p_.b;
        J<Order> l((1 - a) * (1 - b) * centre + a * (1 - b) * left + a * b * corner +
                   (1 - a) * b * right);
        if constexpr (Order > 0) {
            if (chart_ == Chart::Native) {
                l.c[1] = -basis_.normals_[k].x;
                l.c[2] = -basis_.normals_[k].y;
            } else {
                l.c[1] = (1 - b) * (left - centre) + b * (corner - right);
                l.c[2] = (1 - a) * (right - centre) + a * (corner - left);
                if constexpr (Order > 1)
                    l.c[4] = centre - left + corner - right;
            }
        }
        return l;
    }

    J<Order> s(int i) const noexcept {
        const J<Order> before = distance(basis_.cyclic(i - 1));
        return before / (before + distance(basis_.cyclic(i + 1)));
    }

    J<Order> h(int i) const noexcept {
        if (i == p_.sector)
            return h_q_;
        if (i == basis_.cyclic(p_.sector + 1))
            return h_q1_;
        return J<Order>(1.0) -
               (wachspress(i) + wachspress(basis_.cyclic(i - 1))) * inverse_;
    }

    /// towards^d / (towards^d + from^d): the smaller one over the larger avoids underflow.
    J<Order> blend(const J<Order>& towards, const J<Order>& from) const noexcept {
        const bool small = from.c[0] <= towards.c[0];
        const J<Order> ratio = small ? from / towards : towards / from;
        J<Order> power = ratio;
        for (int k = 1; k < basis_.d_; ++k)
            power = power * ratio;
        const J<Order> one(1.0);
        return small ? one / (one + power) : power / (one + power);
    }

    bool at_corner() const noexcept { return 2 - p_.a - p_.b < kCorner; }

private:
    // Below this distance the second derivatives of the blends, which grow like the
    // distance to the power -2, drown in rounding, and the ribbons differ by its square.
    static constexpr double kCorner = 1e-8;

    /// Weight i times l_q l_(q+1) / product of all l: no factor vanishes in the sector.
    J<Order> wachspress(int i) const noexcept {
        const int q = p_.sector;
        if (i == q)
            return J<Order>(1.0);
        const int next = basis_.cyclic(i + 1);
        if (next == q)
            return distance(basis_.cyclic(q + 1)) / distance(i);
        if (i == basis_.cyclic(q + 1))
            return distance(q) / distance(next);
        return product_ / (distance(i) * distance(next));
    }

    const PatchBasis& basis_;
    DomainPoint p_;
    Chart chart_;
    J<Order> product_, inverse_, h_q_, h_q1_;
};

template <int Order, class Sink>
Jet<double, Order> PatchBasis::regular_weights(double s, double t,
                                               Sink&& sink) const noexcept {
    constexpr int kStride = Order + 1;
    std::array<double, (kMaxDegree + 1) * kStride> along_s, along_t;
    const auto size = static_cast<std::size_t>((d_ + 1) * kStride);
    bspline_basis<double>(d_, s, Order, std::span(along_s).first(size));
    bspline_basis<double>(d_, t, Order, std::span(along_t).first(size));
    Index point = 0;
    for (int k = 0; k <= d_; ++k) {
        for (int j = 0; j <= d_; ++j, ++point) {
            Jet<double, Order> w;
            for (int m = 0; m <= Order; ++m) {
                for (int y = 0; y <= m; ++y)
                    w.c[w.index(m - y, y)] =
                        along_s[j * kStride + m - y] * along_t[k * kStride + y];
            }
            sink(point, w);
        }
    }
    return Jet<double, Order>(1.0);
}

template <int Order, class Sink>
void PatchBasis::ribbon_weights(int ribbon, const Jet<double, Order>& s,
                                const Jet<double, Order>& h,
                                const Jet<double, Order>& alpha,
                                const Jet<double, Order>& beta, Jet<double, Order>& f,
                                Sink&& sink) const noexcept {
    constexpr int kStride = Order + 1;
    const auto interval = [&](double x) {
        return std::clamp(static_cast<int>(x), 0, intervals_ - 1);
    };
    const Jet<double, Order> sbar = double(intervals_) * s, hbar = double(intervals_) * h;
    const int column0 = interval(sbar.c[0]), row0 = interval(hbar.c[0]);
    const JetPowers<double, Order> s_powers(sbar), h_powers(hbar);

    std::array<double, (kMaxDegree + 1) * kStride> taylor;
    const std::span<double> basis(taylor.data(),
                                  static_cast<std::size_t>(d_ + 1) * kStride);
    row_basis(row0, hbar.c[0] - row0, Order, basis);
    std::array<Jet<double, Order>, kMaxDegree> rows;
    for (int k = row0; k < d_; ++k)
        rows[k] = h_powers.compose(taylor.data() + (k - row0) * kStride);

    bspline_basis<double>(d_, sbar.c[0] - column0, Order, basis);
    const int middle = class_.kind == PatchKind::EV ? d_ - 1 : columns_;
    for (int m = 0; m <= d_; ++m) {
        const int j = column0 + m;
        Jet<double, Order> column = s_powers.compose(taylor.data() + m * kStride);
        if (j < d_)
            column = column * alpha;
        if (j >= d_ || j == middle)
            column = column * beta;
        const Index* points = ribbon_points_.data() + (ribbon * columns_ + j) * d_;
        for (int k = row0; k < d_; ++k) {
            const Jet<double, Order> w = column * rows[k];
            f += w;
            sink(points[k], w);
        }
    }
}

template <int Order, class Sink>
Jet<double, Order> PatchBasis::for_each_weight(const DomainPoint& p, Chart chart,
                                               Sink&& sink) const noexcept {
    if (class_.kind == PatchKind::Regular)
        return regular_weights<Order>(p.a, p.b, sink);

    const Domain<Order> domain(*this, p, chart);
    Jet<double, Order> f;
    if (domain.at_corner()) {
        const int i = cyclic(p.sector + 1);  // starts at the corner
        const Jet<double, Order> one(1.0);
        ribbon_weights<Order>(i, domain.s(i), domain.h(i), one, one, f, sink);
        return f;
    }
    Jet<double, Order> h_before = domain.h(n_ - 1), h = domain.h(0);
    for (int i = 0; i < n_; ++i) {
        const Jet<double, Order> h_after = domain.h(cyclic(i + 1));
        ribbon_weights<Order>(i, domain.s(i), h, domain.blend(h_before, h),
                              domain.blend(h_after, h), f, sink);
        h_before = h;
        h = h_after;
    }
    return f;
}

}  // namespace osdx
