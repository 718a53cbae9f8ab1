// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

#include <osdx/patch_class.h>
#include <osdx/types.h>

#include "eval/bases/gregory.h"
#include "eval/bases/jet.h"
#include "eval/bases/mirrored_net.h"
#include "eval/bases/polygon.h"
#include "eval/kernels/point_kernels.h"

namespace osdx {

/// The basis functions of a class of patches, with the tables that they need.
///
/// The domain of EV and EF patches is the n-gon of Polygon. Ribbon i is the tensor-product
/// B-spline along side i in
///
///     s_i = l_(i-1) / (l_(i-1) + l_(i+1)),    h_i = sum of phi_j over j != i, i-1
///
/// with Wachspress' coordinates phi (PolygonSideParameters). The patch is the sum of all ribbons, each column
/// weighted by alpha_i = h_(i-1)^d / (h_(i-1)^d + h_i^d) or beta_i = h_(i+1)^d / (h_(i+1)^d +
/// h_i^d) or both, over the sum f of all weights.
/// Source: Hettinga and Kosinka, Multisided B-spline patches over extraordinary regions
/// (2020); Hettinga, Arbitrary topology meshes in geometric design and vector graphics
/// (2021), ch. 5. Differs: s_i and h_i are written so that they are regular on the closed
/// n-gon for every n; columns are counted from 0.
///
/// At a border the sectors fill a part of the n-gon: half of 2k sides where the border runs
/// through (PatchBorder::Smooth), a quarter of 4k between two border curves (Pinned). The
/// points of the other sectors are mirror images, by the point reflection 2 P(foot) - P: the
/// foot of a sector next to the border is the border point that it sits over, of others the
/// centre. On an axis, the straight line through the centre that is a border, S then depends
/// on border points only. It is corrected to the uniform B-spline curve C of these:
///
///     S'(p) = S(p) + b(p) (C(tau(q)) - S(q)),   b = product of l_k^d / (l_k^d + (2 y)^d)
///
/// over the sides of the part that are not perpendicular to the axis, y the distance of p from
/// the axis and q its foot there, i and o the sides that the axis meets at its ends, L = d-1
/// for EV and d for EF, and
///
///     tau = L (m + (h_i + h_o - 1) (w_i m - w_o (1 - m))),   m = h_i / (h_i + h_o),
///     w_i = (h_o/d)^d / ((h_o/d)^d + h_i^d),   w_o = (h_i/d)^d / ((h_i/d)^d + h_o^d),
///
/// which is L h_i but for order d at side i, L (1 - h_o) at side o, and rises everywhere. (A
/// plain blend of these two goes back and forth from n = 10 on at d = 3, n = 6 at d = 5.)
/// That changes no derivative below d on any side.
///
/// One sector at a smooth border has the triangle (1,0), (0,1), (-1,0) for its domain, with
/// the border along y = 0, the second half of ribbon 0 and the first of ribbon 1, q on the line
/// through (0,1) and b = (1 - y)^(d+1). A spike is S(p) + b(p) (V - S(0)), with b the product
/// of (l_k(p) / l_k(0))^d over all sides.
///
/// In the sectors beside a border (a, b) is moved along it, so that tau is linear in (a, b): on
/// both sides of a crease, whatever patches lie there, and on borders modelled apart, equal
/// addresses are equal points. Source of all that is at borders: own.
///
/// Weights are formed in double whatever the points are: the blends cancel near corners,
/// and a valence of 360 leaves float no digits.
/// Threads: const members may run at the same time.
class PatchBasis {
public:
    /// \pre the degree is kMinDegree to kMaxDegree; n_sectors >= 3, but >= 1 at a border
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

    /// The point of the domain under (a, b) of a sector; (a, b) itself for regular patches.
    Vec2<double> to_native(const DomainPoint& p) const noexcept;
    /// The inverse; points outside of the n-gon are moved to it.
    DomainPoint from_native(Vec2<double> xy) const noexcept;

    /// s_i and h_i of every side, each n_sides long.
    struct SideParameters {
        std::vector<double> s, h;
    };
    SideParameters side_parameters(const DomainPoint& p) const;

    /// Derivatives up to an order of 0 to 2 of the sum of the control points' values times
    /// their weights, by vectorised kernels: the same as by for_each_weight() up to rounding. Of
    /// kSumChannels channels.
    /// \return false where there is no such kernel
    ///
    /// \param turn  from (a, b), or (x, y), to the variables of the derivatives
    template <class T>
    bool sum(const DomainPoint& p, Chart chart, int order, detail::ChartTurn turn,
             const detail::PointSum<T>& what, detail::PointJet& out) const noexcept;

    /// The weights themselves, likewise: derivative r of point i is out[r n_points + i].
    bool weights(const DomainPoint& p, Chart chart, int order, detail::ChartTurn turn,
                 std::span<double> out) const noexcept;

    /// Whether there is a kernel for some places at once: for the class, and for a place.
    bool has_many() const noexcept;
    bool is_of_many(const DomainPoint& p) const noexcept {
        return class_.is_square() || 2 - p.a - p.b >= kCorner;
    }
    /// The same as sum() at such places, of three channels; elsewhere there may be anything.
    /// \param net  x, y, z of the control points
    /// \pre has_many()
    void sum_many(std::span<const double> net, const detail::PointPlaces& at, Chart chart,
                  int order, detail::PointJets& out) const noexcept;

private:
    template <int Order>
    using J = Jet<double, Order>;
    template <int Order>
    class AxisDomain;
    template <int Order>
    class Triangle;

    /// (a, b) of a sector's quad, as jets in the (a, b) that was asked for.
    template <int Order>
    struct Place {
        J<Order> a, b;
    };
    template <int Order>
    Place<Order> place(const DomainPoint& p) const noexcept;
    Vec2<double> quad_point(int sector, double a, double b) const noexcept;
    DomainPoint quad_place(Vec2<double> xy) const noexcept;

    /// tau at t on an axis: 0 at t = 1, the side, and L/2 at t = 0, the centre.
    template <int Order>
    J<Order> axis_parameter(const J<Order>& t) const noexcept;
    /// The t at which tau is L/2 (1 - a).
    template <int Order>
    J<Order> axis_place(const J<Order>& a) const noexcept;
    template <int Order>
    J<Order> border_parameter(const J<Order>& h_i, const J<Order>& h_o) const noexcept;

    template <int Order, class Sink>
    J<Order> regular_weights(double s, double t, Sink&& sink) const noexcept;
    template <int Order, class Sink>
    void ribbon_weights(int ribbon, const J<Order>& s, const J<Order>& h,
                        const J<Order>& alpha, const J<Order>& beta, J<Order>& f,
                        Sink&& sink) const noexcept;
    /// All ribbons of the n-gon at a point of Domain or AxisDomain. \return f
    template <int Order, class D, class Sink>
    J<Order> polygon_weights(const D& domain, Sink&& sink) const noexcept;
    /// Both ribbons at a point of the triangle. \return f
    template <int Order, class Sink>
    J<Order> triangle_weights(const Triangle<Order>& at, Sink&& sink) const noexcept;
    /// The foot of a point on an axis, at t on the line to the middle of a side, and b.
    template <int Order>
    struct AxisFoot {
        int side;
        J<Order> t, weight;
        bool has_weight() const noexcept {
            return !std::ranges::all_of(weight.c, [](double x) { return x == 0; });
        }
    };
    template <int Order, class D>
    AxisFoot<Order> axis_foot(const D& domain, int axis) const noexcept;
    /// Calls sink(j, w) with the weights of the points of an axis' curve at tau.
    template <int Order, class Sink>
    void axis_curve(const J<Order>& tau, Sink&& sink) const noexcept;
    /// scale (C(tau) - S) on an axis, for the S that `weights` gives.
    template <int Order, class Weights, class Sink>
    void correct(int axis, const J<Order>& scale, const J<Order>& h_i,
                 const J<Order>& h_o, Weights&& weights, Sink&& sink) const noexcept;

    /// towards^d / (towards^d + from^d): the smaller one over the larger avoids underflow.
    template <int Order>
    J<Order> blend(const J<Order>& towards, const J<Order>& from) const noexcept;
    template <int Order>
    J<Order> power(const J<Order>& x) const noexcept;  // x^d

    /// Taylor coefficients of the rows of a ribbon at hbar = interval + u.
    void row_basis(int interval, double u, int order,
                   std::span<double> out) const noexcept;

    int cyclic(int i) const noexcept { return polygon_.cyclic(i); }
    bool is_gregory_quad() const noexcept { return gregory_ && class_.is_square(); }

    void build_tables();
    void build_net();

    /// The points of the net, four channels each.
    template <class T>
    void gather_net(const detail::PointSum<T>& what, double* out) const noexcept;
    /// sum() at borders and spikes.
    template <class T>
    [[gnu::noinline]] bool sum_at_border(const DomainPoint& p, Chart chart, int order,
                                         detail::ChartTurn turn,
                                         const detail::PointSum<T>& what,
                                         detail::PointJet& out) const noexcept;
    /// The same of the net's points.
    template <int Order>
    void border_sum(const DomainPoint& p, Chart chart, detail::ChartTurn turn,
                    std::span<const double> net, detail::PointJet& out) const noexcept;

    /// Larger nets are summed ribbon by ribbon.
    static constexpr std::size_t kMostNetPoints = 512;
    static constexpr double kCorner = 1e-8;  // see for_each_weight

    PatchClass class_;
    std::optional<GregoryBasis> gregory_;  // of patches of that kind, which need no more
    Polygon polygon_;
    int n_;          // sides of the n-gon
    int d_;          // degree
    int intervals_;  // of a ribbon in both directions
    int columns_;    // of a ribbon
    // By ribbon, column, row; then by axis and point of its curve.
    std::vector<Index> term_offsets_;
    std::vector<MirroredNet::Term> terms_;
    std::vector<double> centre_weights_;  // of spikes: S(0)
    // What sum() needs at borders and spikes: terms of the n-gon's points; then of those of
    // the axes' curves, or of a spike's centre and S(0).
    std::vector<Index> net_offsets_;
    std::vector<MirroredNet::Term> net_terms_;
    std::vector<Index> net_indices_;                 // 0, 1, ..
    std::array<double, 2 * kMaxDegree> extended_{};  // Bezier coefficients of E_(d-1)
    std::tuple<detail::PointKernels<float>, detail::PointKernels<double>> kernels_;
    std::optional<detail::TaylorRows> taylor_;  // of regular patches
    std::optional<detail::RingTables> ring_;  // of EV and EF patches, but single sectors
};

}  // namespace osdx

#include "eval/bases/patch_basis-inl.h"  // IWYU pragma: keep: the templates
