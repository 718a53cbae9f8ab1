// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <span>
#include <vector>

#include <osdx/patch_class.h>
#include <osdx/place.h>
#include <osdx/types.h>

#include "eval/bases/border.h"
#include "eval/bases/jet.h"
#include "eval/bases/mirrored_net.h"
#include "eval/bases/polygon.h"

namespace osdx::inline OSDX_ABI {

/// The basis functions of EV and EF patches, with the tables that they need.
///
/// The domain is the n-gon of Polygon. Ribbon i is the tensor-product B-spline along side i in
///
///     s_i = l_(i-1) / (l_(i-1) + l_(i+1)),    h_i = sum of phi_j over j != i, i-1
///
/// with Wachspress' coordinates phi (PolygonSideParameters). The patch is the sum of all
/// ribbons, each column weighted by alpha_i = h_(i-1)^d / (h_(i-1)^d + h_i^d) or beta_i =
/// h_(i+1)^d / (h_(i+1)^d + h_i^d) or both, over the sum f of all weights.
/// Source: Hettinga and Kosinka, Multisided B-spline patches over extraordinary regions
/// (2020); Hettinga, Arbitrary topology meshes in geometric design and vector graphics
/// (2021), ch. 5. Differs: s_i and h_i are written so that they are regular on the closed
/// n-gon for every n; columns are counted from 0.
///
/// At a border the k sectors fill half of an n-gon of 2k sides, whether the border runs through
/// (PatchBorder::Smooth) or two border curves end there (Pinned). The points of the other
/// sectors are mirror images, by the point reflection 2 P(foot) - P: the foot of a sector next to
/// the border is the border point that it sits over, of others the centre (MirroredNet).
/// RibbonBorder says how the surface then keeps to the border's curves.
///
/// One sector at a border has the triangle (1,0), (0,1), (-1,0) for its domain, with the border
/// along y = 0, the second half of ribbon 0 and the first of ribbon 1, q on the line through
/// (0,1), x / (1 - y) in the place of x, and b = (1 - y)^(d+1). Source of all that is at borders:
/// own.
///
/// Weights are formed in double whatever the points are: the blends cancel near corners,
/// and a valence of 360 leaves float no digits.
/// Threads: const members may run at the same time.
class RibbonBasis {
public:
    /// \pre the degree is kMinDegree to kMaxDegree; n_sectors >= 3, but >= 1 at a border
    explicit RibbonBasis(const PatchClass& patch_class);

    const PatchClass& patch_class() const noexcept { return class_; }
    const RibbonBorder& border() const noexcept { return border_; }
    /// Of spikes: the weights at the centre, S(0).
    std::span<const double> centre_weights() const noexcept { return centre_weights_; }

    /// Closer to the corner of a sector than this, the second derivatives of the blends, which
    /// grow like the distance to the power -2, drown in rounding, and the ribbons differ by
    /// its square: the ribbon that starts there is taken alone.
    template <class T>
    static bool is_at_corner(const DomainPointOf<T>& p) noexcept {
        return representative(2 - p.a - p.b) < 1e-8;
    }

    /// See PatchBasis. \return f
    ///
    /// At a corner, where the blends have no limit, position and first derivatives are the
    /// limit, the second derivatives are those of one of the limits that depend on the
    /// direction, all with the same curvature.
    template <int Order, class T, class Sink>
    Jet<T, Order> for_each_weight(const DomainPointOf<T>& p, Chart chart,
                                  Sink&& sink) const noexcept;

    Vec2<double> to_native(const DomainPoint& p) const noexcept;
    /// Points outside of the n-gon, or beyond a border, are moved to it.
    DomainPoint from_native(const Vec2<double>& xy) const noexcept;

    /// s_i and h_i of every side, each n_sides long.
    struct SideParameters {
        std::vector<double> s, h;
    };
    SideParameters side_parameters(const DomainPoint& p) const;

private:
    template <int Order, class T>
    class Triangle;

    void build_tables();
    Vec2<double> quad_point(int sector, double a, double b) const noexcept;
    DomainPoint quad_place(const Vec2<double>& xy) const noexcept;

    /// A sink for the points of all ribbons, by column and row, that gives `sink` the control
    /// points they are made from.
    /// \param net  0: the patch' own; 1 + part: on the border
    template <class Sink>
    auto expanded(int net, Sink& sink) const noexcept;
    template <int Order, class T, class Sink>
    void ribbon_weights(int ribbon, const Jet<T, Order>& s, const Jet<T, Order>& h,
                        const Jet<T, Order>& alpha, const Jet<T, Order>& beta,
                        Jet<T, Order>& f, Sink&& sink) const noexcept;
    /// All ribbons of the n-gon at a PolygonPoint or AxisPoint. \return f
    template <int Order, class T, class D, class Sink>
    Jet<T, Order> polygon_weights(const D& domain, Sink&& sink) const noexcept;
    /// Both ribbons at a point of the triangle. \return f
    template <int Order, class T, class Sink>
    Jet<T, Order> triangle_weights(const Triangle<Order, T>& at,
                                   Sink&& sink) const noexcept;
    /// scale C(tau) of a part.
    template <int Order, class T, class Sink>
    void curve_weights(int part, const Jet<T, Order>& scale, const Jet<T, Order>& tau,
                       Sink&& sink) const noexcept;
    template <int Order, class T, class Sink>
    Jet<T, Order> single_sector_weights(const DomainPointOf<T>& p, Chart chart,
                                        Sink&& sink) const noexcept;

    /// Taylor coefficients of the rows of a ribbon at hbar = interval + u.
    template <class T>
    void row_basis(int interval, T u, int order, std::span<T> out) const noexcept;

    int cyclic(int i) const noexcept { return border_.polygon().cyclic(i); }

    PatchClass class_;
    RibbonBorder border_;
    int n_;            // sides of the n-gon
    int d_;            // degree
    int columns_;      // of a ribbon
    int n_parts_ = 0;  // of the border
    // By ribbon, column, row: of the net, then of each part's; then by part and point of
    // its curve.
    std::vector<Index> term_offsets_;
    std::vector<MirroredNet::Term> terms_;
    std::vector<double> centre_weights_;
    std::array<double, 2 * kMaxDegree> extended_{};  // Bezier coefficients of E_(d-1)
};

}  // namespace osdx::inline OSDX_ABI

#include "eval/bases/ribbon-inl.h"  // IWYU pragma: keep: the templates
