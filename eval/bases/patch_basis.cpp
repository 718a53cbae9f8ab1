// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "eval/bases/patch_basis.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

namespace osdx {
namespace {

/// Bezier coefficients c_0 .. c_(2d-1) of the last piece of the extended function E_(d-1):
/// it continues N_(d-1) at d-2 with all derivatives below d and ends with a zero of order d.
/// c_i = sum of C(i,r) N^(r)(d-2) (2d-1-r)!/(2d-1)! over r <= i, for i < d.
std::array<double, 2 * kMaxDegree> extended_coefficients(int d) {
    std::array<double, 2 * kMaxDegree> c{};
    std::array<double, (kMaxDegree + 1) * kMaxDegree> taylor;
    // N_(d-1) at d-2: the function d-1-(d-2) = 1 of the interval that starts there.
    bspline_basis<double>(d, 0.0, d - 1,
                          std::span(taylor).first(static_cast<std::size_t>((d + 1) * d)));
    const double* n = taylor.data() + d;
    for (int i = 0; i < d; ++i) {
        double term = 1;  // C(i,r) r! (2d-1-r)!/(2d-1)!
        for (int r = 0; r <= i; ++r) {
            c[i] += term * n[r];
            term *= double(i - r) / double(2 * d - 1 - r);
        }
    }
    return c;
}

}  // namespace

PatchBasis::PatchBasis(const PatchClass& patch_class)
    : class_(patch_class),
      polygon_(patch_class.n_polygon()),
      n_(patch_class.n_polygon()),
      d_(patch_class.degree) {
    const bool ev = class_.kind == PatchKind::EV;
    intervals_ = ev ? d_ - 1 : d_;
    columns_ = ev ? 2 * d_ - 1 : 2 * d_;
    if (class_.kind == PatchKind::Regular) {
        taylor_.emplace(d_);
        return;
    }
    if (class_.kind == PatchKind::Gregory) {
        gregory_.emplace(class_.n_sectors,
                         class_.normalised ? CentrePoint::None : CentrePoint::Given);
        return;
    }

    if (ev)
        extended_ = extended_coefficients(d_);
    build_tables();
    if (!class_.is_single())
        ring_.emplace(PatchClass{class_.kind, d_, n_}, polygon_);
    if (class_.border == PatchBorder::Spike) {
        std::vector<double> w(static_cast<std::size_t>(class_.n_points()), 0.0);
        const Jet<double, 0> f =
            polygon_weights<0>(PolygonPoint<0>(polygon_, {}, Chart::Native),
                               [&](Index i, const Jet<double, 0>& x) { w[i] += x.c[0]; });
        for (double& x : w)
            x /= f.c[0];
        centre_weights_ = std::move(w);
    }
    if (ring_ && class_.border != PatchBorder::None)
        build_net();
}

void PatchBasis::build_tables() {
    const MirroredNet net(class_);
    const auto add = [&](const MirroredNet::Terms& terms) {
        term_offsets_.push_back(static_cast<Index>(terms_.size()));
        terms_.insert(terms_.end(), terms.begin(), terms.end());
    };
    for (int i = 0; i < n_; ++i) {
        for (int j = 0; j < columns_; ++j) {
            for (int k = 0; k < d_; ++k)
                add(net.ribbon_point(i, j, k));
        }
    }
    const int n_axes = class_.border == PatchBorder::Pinned ? 2 : int(class_.is_open());
    for (int axis = 0; axis < n_axes; ++axis) {
        for (int j = 0; j < columns_; ++j)
            add(net.axis_point(axis, j));
    }
    term_offsets_.push_back(static_cast<Index>(terms_.size()));
}

void PatchBasis::build_net() {
    const PatchClass whole{class_.kind, d_, n_};
    const MirroredNet net(class_), whole_net(whole);
    std::vector<MirroredNet::Terms> points(static_cast<std::size_t>(whole.n_points()));
    for (int i = 0; i < n_; ++i) {
        for (int j = 0; j < columns_; ++j) {
            for (int k = 0; k < d_; ++k)
                points[whole_net.ribbon_point(i, j, k)[0].point] =
                    net.ribbon_point(i, j, k);
        }
    }
    const int n_axes = class_.border == PatchBorder::Pinned ? 2 : int(class_.is_open());
    for (int axis = 0; axis < n_axes; ++axis) {
        for (int j = 0; j < columns_; ++j)
            points.push_back(net.axis_point(axis, j));
    }
    if (class_.border == PatchBorder::Spike) {
        const bool ev = class_.kind == PatchKind::EV;
        points.push_back({{static_cast<Index>(ev ? 0 : class_.ef_centre()), 1.0}});
        points.emplace_back();
        for (Index i = 0; i < centre_weights_.size(); ++i)
            points.back().push_back({i, centre_weights_[i]});
    }
    for (const MirroredNet::Terms& terms : points) {
        net_offsets_.push_back(static_cast<Index>(net_terms_.size()));
        net_indices_.push_back(static_cast<Index>(net_indices_.size()));
        net_terms_.insert(net_terms_.end(), terms.begin(), terms.end());
    }
    net_offsets_.push_back(static_cast<Index>(net_terms_.size()));
}

void PatchBasis::row_basis(int interval, double u, int order,
                           std::span<double> out) const noexcept {
    bspline_basis<double>(d_, u, order, out);
    if (class_.kind != PatchKind::EV || interval < intervals_ - 1)
        return;
    // Row d-1 on the last interval: de Casteljau for the Taylor coefficients of a Bezier
    // polynomial of degree 2d-1, C(2d-1, r) times the r-th differences.
    double* taylor = out.data() + (order + 1);
    const int degree = 2 * d_ - 1;
    double binomial = 1;
    for (int r = 0; r <= order; ++r) {
        std::array<double, 2 * kMaxDegree> c = extended_;
        for (int m = 0; m < r && m <= degree; ++m) {
            for (int i = 0; i < degree - m; ++i)
                c[i] = c[i + 1] - c[i];
        }
        for (int m = degree - r; m > 0; --m) {
            for (int i = 0; i < m; ++i)
                c[i] = (1 - u) * c[i] + u * c[i + 1];
        }
        taylor[r] = r <= degree ? binomial * c[0] : 0.0;
        binomial *= double(degree - r) / (r + 1);
    }
}

Vec2<double> PatchBasis::quad_point(int sector, double a, double b) const noexcept {
    if (class_.is_single())
        return {a - b, a * b};
    return polygon_.sector_point({sector, a, b});
}

Vec2<double> PatchBasis::to_native(const DomainPoint& p) const noexcept {
    if (class_.is_square())
        return {p.a, p.b};
    const Place<0> at = place<0>(p);
    return quad_point(p.sector, at.a.c[0], at.b.c[0]);
}

/// The inverse of quad_point().
DomainPoint PatchBasis::quad_place(Vec2<double> xy) const noexcept {
    if (class_.is_single()) {
        // (a - b, a b), so that a and -b are the roots of z^2 - x z - y.
        const double root = std::sqrt(std::max(0.0, xy.x * xy.x + 4 * xy.y));
        return {0, std::clamp((root + xy.x) / 2, 0.0, 1.0),
                std::clamp((root - xy.x) / 2, 0.0, 1.0)};
    }
    const int sector = polygon_.sector_of(xy);
    if (class_.is_open() && sector >= class_.n_sectors) {
        // Beyond a border: to the nearer of the two.
        const int k = class_.n_sectors;
        const double scale = 1 / polygon_.centre_distance();
        const double first = glm::dot(xy, polygon_.normal(0)) * scale,
                     last = glm::dot(xy, polygon_.normal(k)) * scale;
        return first > last ? DomainPoint{0, std::clamp(first, 0.0, 1.0), 0}
                            : DomainPoint{k - 1, 0, std::clamp(last, 0.0, 1.0)};
    }
    return polygon_.sector_place(sector, xy);
}

DomainPoint PatchBasis::from_native(Vec2<double> xy) const noexcept {
    if (class_.is_square())
        return {0, std::clamp(xy.x, 0.0, 1.0), std::clamp(xy.y, 0.0, 1.0)};
    const DomainPoint goal = quad_place(xy);
    DomainPoint p = goal;
    // Beside a border (a, b) is moved: Newton's method for the point that moves there.
    for (int step = 0; class_.is_open() && step < 50; ++step) {
        const Place<1> at = place<1>(p);
        const double ea = goal.a - at.a.c[0], eb = goal.b - at.b.c[0];
        const double det = at.a.c[1] * at.b.c[2] - at.a.c[2] * at.b.c[1];
        const double da = (ea * at.b.c[2] - eb * at.a.c[2]) / det,
                     db = (eb * at.a.c[1] - ea * at.b.c[1]) / det;
        p.a = std::clamp(p.a + da, 0.0, 1.0);
        p.b = std::clamp(p.b + db, 0.0, 1.0);
        if (std::abs(da) + std::abs(db) < 1e-15)
            break;
    }
    return p;
}

template <class T>
void PatchBasis::gather_net(const detail::PointSum<T>& what, double* out) const noexcept {
    for (std::size_t i = 0; i < net_indices_.size(); ++i, out += 4) {
        std::fill_n(out, 4, 0.0);
        for (Index t = net_offsets_[i]; t < net_offsets_[i + 1]; ++t) {
            const MirroredNet::Term& term = net_terms_[t];
            const std::size_t at = std::size_t(what.points[term.point]) * what.stride,
                              n = std::min<std::size_t>(4, what.n_values - at);
            for (std::size_t c = 0; c < n; ++c)
                out[c] += term.weight * double(what.values[at + c]);
        }
    }
}

template <int Order>
void PatchBasis::border_sum(const DomainPoint& p, Chart chart, detail::ChartTurn turn,
                            std::span<const double> net,
                            detail::PointJet& out) const noexcept {
    using Channels = std::array<J<Order>, detail::kSumChannels>;
    const detail::RingTables& ring = *ring_;
    // S without what is done at borders, at a place that moves by (x, y) of its sector.
    const auto surface = [&](const DomainPoint& q, J<Order> x, J<Order> y) {
        detail::PointJet s;
        std::get<detail::PointKernels<double>>(kernels_).polygon(
            ring, class_.kind, q, Order, detail::PointFrame::Sector, {},
            {net.data(), net.size(), 4, net_indices_.data()}, s);
        x.c[0] = y.c[0] = 0;
        const J<Order> xx = 0.5 * (x * x), xy = x * y, yy = 0.5 * (y * y);
        Channels r;
        for (int c = 0; c < detail::kSumChannels; ++c) {
            r[c] = J<Order>(s.value[0][c]);
            if constexpr (Order > 0)
                r[c] += s.value[1][c] * x + s.value[2][c] * y;
            if constexpr (Order > 1)
                r[c] += s.value[3][c] * xx + s.value[4][c] * xy + s.value[5][c] * yy;
        }
        return r;
    };

    const Place<Order> at = place<Order>(p);
    const PolygonDistances<Order> domain(polygon_, p.sector, at.a, at.b, chart,
                                         !class_.is_open());
    J<Order> x, y;
    if (chart == Chart::BaseUV) {
        x = ring.x_a * (at.a + at.b) + ring.x_ab * (at.a * at.b);
        y = ring.y_b * (at.b - at.a);
    } else if constexpr (Order > 0) {
        const Vec2<double> turned = ring.sector_turn[p.sector];
        x.c[1] = y.c[2] = turned.x;
        x.c[2] = turned.y;
        y.c[1] = -turned.y;
    }
    Channels r = surface({p.sector, at.a.c[0], at.b.c[0]}, x, y);

    const J<Order> one(1.0);
    const double inverse = 1 / polygon_.centre_distance();
    const double* const extra =
        net.data() + net.size() - 4 * (net_indices_.size() - std::size_t(ring.n_points));
    if (class_.border == PatchBorder::Spike) {
        J<Order> b = one;
        for (int k = 0; k < n_; ++k)
            b = b * power<Order>(domain.distance(k) * inverse);
        for (int c = 0; c < detail::kSumChannels; ++c)
            r[c] += (extra[c] - extra[4 + c]) * b;
    }
    const int n_axes = class_.border == PatchBorder::Pinned ? 2 : int(class_.is_open());
    for (int axis = 0; axis < n_axes; ++axis) {
        const AxisFoot<Order> foot = axis_foot<Order>(domain, axis);
        if (!foot.has_weight())
            continue;
        const Channels s =
            surface({foot.side, foot.t.c[0], 0}, ring.x_a * foot.t, -ring.y_b * foot.t);
        const AxisDomain<Order> on_axis(*this, foot.side, foot.t);
        Channels curve{};
        axis_curve<Order>(
            border_parameter<Order>(on_axis.h(axis * class_.n_sectors),
                                    on_axis.h(cyclic(axis * class_.n_sectors + n_ / 2))),
            [&](int j, const J<Order>& w) {
                const double* point = extra + 4 * (axis * columns_ + j);
                for (int c = 0; c < detail::kSumChannels; ++c)
                    curve[c] += point[c] * w;
            });
        for (int c = 0; c < detail::kSumChannels; ++c)
            r[c] += foot.weight * (curve[c] - s[c]);
    }

    const double u = turn.cos, v = turn.sin;
    for (int c = 0; c < detail::kSumChannels; ++c) {
        const auto& d = r[c].c;
        out.value[0][c] = d[0];
        if constexpr (Order > 0) {
            out.value[1][c] = u * d[1] + v * d[2];
            out.value[2][c] = u * d[2] - v * d[1];
        }
        if constexpr (Order > 1) {
            const double aa = 2 * d[3], ab = d[4], bb = 2 * d[5];
            out.value[3][c] = u * u * aa + 2 * u * v * ab + v * v * bb;
            out.value[4][c] = (u * u - v * v) * ab + u * v * (bb - aa);
            out.value[5][c] = u * u * bb - 2 * u * v * ab + v * v * aa;
        }
    }
}

template <class T>
bool PatchBasis::sum_at_border(const DomainPoint& p, Chart chart, int order,
                               detail::ChartTurn turn, const detail::PointSum<T>& what,
                               detail::PointJet& out) const noexcept {
    if (net_indices_.size() > kMostNetPoints)
        return false;
    out = {};
    double values[4 * kMostNetPoints];
    gather_net(what, values);
    const std::span<const double> net(values, 4 * net_indices_.size());
    switch (order) {
        case 0:
            border_sum<0>(p, chart, turn, net, out);
            break;
        case 1:
            border_sum<1>(p, chart, turn, net, out);
            break;
        default:
            border_sum<2>(p, chart, turn, net, out);
    }
    return true;
}

namespace {

detail::PointFrame frame_of(Chart chart) noexcept {
    return chart == Chart::Native ? detail::PointFrame::Native
                                  : detail::PointFrame::BaseUV;
}

}  // namespace

template <class T>
bool PatchBasis::sum(const DomainPoint& p, Chart chart, int order, detail::ChartTurn turn,
                     const detail::PointSum<T>& what,
                     detail::PointJet& out) const noexcept {
    const auto& kernels = std::get<detail::PointKernels<T>>(kernels_);
    if (taylor_) {
        kernels.regular(*taylor_, d_, p.a, p.b, order, turn, what, out);
        return true;
    }
    if (is_gregory_quad()) {
        kernels.gregory(p.a, p.b, order, turn, what, out);
        return true;
    }
    if (!ring_ || !kernels.polygon || 2 - p.a - p.b < kCorner)
        return false;
    if (class_.border != PatchBorder::None)
        return sum_at_border(p, chart, order, turn, what, out);
    kernels.polygon(*ring_, class_.kind, p, order, frame_of(chart), turn, what, out);
    return true;
}

template bool PatchBasis::sum<float>(const DomainPoint&, Chart, int, detail::ChartTurn,
                                     const detail::PointSum<float>&,
                                     detail::PointJet&) const noexcept;
template bool PatchBasis::sum<double>(const DomainPoint&, Chart, int, detail::ChartTurn,
                                      const detail::PointSum<double>&,
                                      detail::PointJet&) const noexcept;

bool PatchBasis::weights(const DomainPoint& p, Chart chart, int order,
                         detail::ChartTurn turn, std::span<double> out) const noexcept {
    const auto& kernels = std::get<detail::PointKernels<double>>(kernels_);
    if (!ring_ || !ring_->is_ring() || class_.border != PatchBorder::None ||
        !kernels.ring_weights || 2 - p.a - p.b < kCorner)
        return false;
    kernels.ring_weights(*ring_, class_.kind, p, order, frame_of(chart), turn,
                         out.data());
    return true;
}

bool PatchBasis::has_many() const noexcept {
    const auto& kernels = std::get<detail::PointKernels<double>>(kernels_);
    return class_.is_square() ||
           (ring_ && ring_->is_ring() && class_.border == PatchBorder::None &&
            kernels.ring_points);
}

void PatchBasis::sum_many(std::span<const double> net, const detail::PointPlaces& at,
                          Chart chart, int order, detail::PointJets& out) const noexcept {
    assert(has_many() && net.size() == 3 * std::size_t(class_.n_points()));
    const auto& kernels = std::get<detail::PointKernels<double>>(kernels_);
    if (taylor_)
        kernels.regular_points(*taylor_, d_, net.data(), at, order, out);
    else if (is_gregory_quad())
        kernels.gregory_points(net.data(), at, order, out);
    else
        kernels.ring_points(*ring_, class_.kind, net.data(), at, chart, order, out);
}

PatchBasis::SideParameters PatchBasis::side_parameters(const DomainPoint& p) const {
    const Place<0> at = place<0>(p);
    const PolygonPoint<0> domain(polygon_, p.sector, at.a, at.b, Chart::Native, true);
    SideParameters r;
    for (int i = 0; i < n_; ++i) {
        r.s.push_back(domain.s(i).c[0]);
        r.h.push_back(domain.h(i).c[0]);
    }
    return r;
}

}  // namespace osdx
