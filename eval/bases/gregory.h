// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <span>

#include <osdx/surface_jet.h>
#include <osdx/types.h>

#include "eval/bases/generalised_bezier.h"
#include "eval/bases/jet.h"
#include "eval/bases/polygon.h"

namespace osdx::inline OSDX_ABI {

/// The basis functions of Gregory patches of n sides.
///
/// Order of the control points: for each corner i the corner p_i; e_i+ and e_i-, next to it on
/// the sides to corner i+1 and i-1; f_i+ and f_i-, the inner points beside these. For n != 4
/// the centre follows, if there is one.
///
///     p_i    e_i+ -> corner i+1
///     e_i-   f_i+
///      |     f_i-
///      v corner i-1
///
/// n = 4: the bicubic Bezier patch on [0,1]^2, corners (0,0), (1,0), (1,1), (0,1), with the
/// inner points F_i = (x f_i+ + y f_i-) / (x + y), where x runs from corner i to the next and
/// y to the one before. The domain point is (a, b) = (u, v); there are no sectors.
/// n != 4: the generalised Bezier patch of degree 3 with the ribbons
/// p_(i-1), e_(i-1)+, e_i-, p_i and e_(i-1)-, f_(i-1)+, f_i-, e_i+; n = 4 of it is the above.
///
/// All derivatives are those of the surface, the blends included. At a corner position and
/// gradient are the limit; second derivatives have none unless f+ = f- (for n != 4 not even
/// then) and are those along the bisector, and higher ones are 0.
/// Source: Loop, Schaefer, Ni and Castaño, Approximating subdivision surfaces with Gregory
/// patches for hardware tessellation (2009); Hettinga and Kosinka, Multisided generalisations
/// of Gregory patches (2018). Differs: the centre point.
/// Threads: const members may run at the same time.
class GregoryBasis {
public:
    /// \pre n >= 3
    explicit GregoryBasis(int n, CentrePoint centre = CentrePoint::Given)
        : ribbons_(n, 3, centre) {}

    int n() const noexcept { return ribbons_.n(); }
    bool has_centre() const noexcept {
        return n() != 4 && ribbons_.centre() == CentrePoint::Given;
    }

    /// Places of the points of a corner in their order.
    enum Point : std::uint8_t { P, EPlus, EMinus, FPlus, FMinus, kPerCorner };

    Index point(int corner, Point kind) const noexcept {
        return static_cast<Index>(corner * kPerCorner + kind);
    }
    Index centre_index() const noexcept { return point(n(), P); }
    Index n_points() const noexcept { return centre_index() + has_centre(); }

    /// Calls sink(i, w) with the jet w of one contribution to the weight of control point i;
    /// a point may come several times. \return f, by which the sums are to be divided.
    /// \pre the point is in the domain; no allocation
    template <int Order, class T, class Sink>
    Jet<T, Order> for_each_weight(const DomainPointOf<T>& p, Chart chart,
                                  Sink&& sink) const noexcept {
        if (n() == 4)
            return quad_weights<Order, T>(p.a, p.b, sink);
        return ribbons_.for_each_weight<Order, T>(
            p, chart, [&](Index i, const Jet<T, Order>& w) {
                sink(i == ribbons_.centre_index() ? centre_index() : ribbon_point(i), w);
            });
    }
    template <int Order, class Sink>
    Jet<double, Order> for_each_weight(const DomainPoint& p, Chart chart,
                                       Sink&& sink) const noexcept {
        return for_each_weight<Order, double>(p, chart, sink);
    }

    /// The point of the domain under (a, b); (a, b) itself for n = 4.
    Vec2<double> to_native(const DomainPoint& p) const noexcept {
        return n() == 4 ? Vec2<double>(p.a, p.b) : ribbons_.to_native(p);
    }
    /// The inverse; points outside of the domain are moved to it.
    DomainPoint from_native(const Vec2<double>& xy) const noexcept;

    /// What the centre point is multiplied by at the centre of the domain: 1 - f there.
    double centre_weight() const noexcept { return 1 - 2.0 / n() * (3 - 4.0 / n()); }

    /// The unit normal at a corner: that of the tangents or, where they are opposite, as at a
    /// smooth corner of the border with one face, the limit of the normals nearby,
    ///
    ///     (e+ - p) x (9 (f - p) + 6 (p - 2 e+ + e_next-)).
    ///
    /// 0 where that vanishes too.
    /// \pre points.size() == n_points()
    template <class T>
    Vec3<T> corner_normal(std::span<const Vec3<T>> points, int corner) const noexcept;

private:
    /// The control point of a point of the ribbons.
    Index ribbon_point(Index i) const noexcept {
        constexpr Point kPoints[4][2] = {
            {P, EMinus}, {EPlus, FPlus}, {EMinus, FMinus}, {P, EPlus}};
        const int ribbon = static_cast<int>(i / 8), j = static_cast<int>(i / 2 % 4);
        return point(j < 2 ? ribbons_.polygon().cyclic(ribbon - 1) : ribbon,
                     kPoints[j][i % 2]);
    }

    template <int Order, class T, class Sink>
    Jet<T, Order> quad_weights(const T& u, const T& v, Sink&& sink) const noexcept;

    /// x^2 y / (x + y) for x and y linear in the variables of the jets.
    template <int Order, class T>
    static Jet<T, Order> blended(Jet<T, Order> x, Jet<T, Order> y) noexcept;

    GeneralisedBezierBasis ribbons_;
};

template <class T>
Vec3<T> GregoryBasis::corner_normal(std::span<const Vec3<T>> points,
                                    int corner) const noexcept {
    const auto at = [&](int i, Point kind) {
        return Vec3<double>(points[point(i, kind)]);
    };
    const Vec3<double> p = at(corner, P), plus = at(corner, EPlus) - p,
                       next = at(ribbons_.polygon().cyclic(corner + 1), EMinus) - p;
    SurfaceJet<T> jet;
    jet.du = Vec3<T>(plus);
    jet.dv = Vec3<T>(at(corner, EMinus) - p);
    const Vec3<T> n = normal(jet);
    if (n != Vec3<T>(0))
        return n;
    jet.dv = Vec3<T>(9.0 * (at(corner, FPlus) - p) + 6.0 * (next - 2.0 * plus));
    return normal(jet);
}

template <int Order, class T>
Jet<T, Order> GregoryBasis::blended(Jet<T, Order> x, Jet<T, Order> y) noexcept {
    // Homogeneous of degree 2: at a point scaled by 1/r derivative m is r^(m-2) times as
    // large. So nothing under- or overflows near the corner, and at it the direction is that
    // of the bisector.
    const T r = x.c[0] + y.c[0];
    const bool at_corner = representative(r) < 1e-100;
    x.c[0] = at_corner ? T(0.5) : x.c[0] / r;
    y.c[0] = at_corner ? T(0.5) : y.c[0] / r;
    Jet<T, Order> b = x * x * y / (x + y);
    T scale = r * r;  // r^(2-m)
    for (int m = 0, k = 0; m <= Order; ++m) {
        for (const int end = k + m; k <= end; ++k)
            b.c[k] *= scale;
        scale = m == 0 ? r : m == 1 ? T(1.0) : at_corner ? T(0.0) : scale / r;
    }
    return b;
}

template <int Order, class T, class Sink>
Jet<T, Order> GregoryBasis::quad_weights(const T& u, const T& v,
                                         Sink&& sink) const noexcept {
    using J = Jet<T, Order>;
    const J one(1.0);
    J along[4];  // from corner i to the next
    along[0] = J(u);
    along[1] = J(v);
    if constexpr (Order > 0) {
        along[0].c[1] = 1;
        along[1].c[2] = 1;
    }
    along[2] = one - along[0];
    along[3] = one - along[1];
    for (int i = 0; i < 4; ++i) {
        const J &x = along[i], &y = along[(i + 1) % 4];
        const J x1 = one - x, y1 = one - y, x2 = x1 * x1, y2 = y1 * y1;
        const J b0 = x2 * x1, b1 = 3.0 * x * x2, c0 = y2 * y1, c1 = 3.0 * y * y2;
        sink(point(i, P), b0 * c0);
        sink(point(i, EPlus), b1 * c0);
        sink(point(i, EMinus), b0 * c1);
        const J rest = 9.0 * x2 * y2;
        sink(point(i, FPlus), blended(x, y) * rest);
        sink(point(i, FMinus), blended(y, x) * rest);
    }
    return one;
}

}  // namespace osdx::inline OSDX_ABI
