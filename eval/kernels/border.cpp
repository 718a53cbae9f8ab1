// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "eval/kernels/border.h"

#include <algorithm>
#include <array>

namespace osdx::inline OSDX_ABI::detail {

BorderKernel::BorderKernel(const RibbonBasis& basis) : border_(basis.border()) {
    const PatchClass& c = basis.patch_class();
    const int n = c.n_polygon();
    const MirroredNet net(c), whole_net({c.kind, c.degree, n});
    n_columns_ = net.n_columns();
    const auto n_net =
        static_cast<std::size_t>(PatchClass{c.kind, c.degree, n}.n_points());
    const auto for_each_net_point = [&](auto&& f) {
        for (int i = 0; i < n; ++i) {
            for (int j = 0; j < n_columns_; ++j) {
                for (int k = 0; k < c.degree; ++k)
                    f(whole_net.ribbon_point(i, j, k)[0].point, i, j, k);
            }
        }
    };
    std::vector<MirroredNet::Terms> points(n_net);
    for_each_net_point([&](Index point, int i, int j, int k) {
        points[point] = net.ribbon_point(i, j, k);
    });
    for (int part = 0; part < net.n_parts(); ++part) {
        for (int j = 0; j < n_columns_; ++j)
            points.push_back(net.curve_point(part, j));
        if (!border_.is_pinned())
            continue;  // the net itself
        const std::size_t first = points.size();
        points.resize(first + n_net);
        for_each_net_point([&](Index point, int i, int j, int k) {
            points[first + point] = net.foot_point(part, i, j, k);
        });
    }
    if (c.border == PatchBorder::Spike) {
        const bool ev = c.kind == PatchKind::EV;
        points.push_back({{static_cast<Index>(ev ? 0 : c.ef_centre()), 1.0}});
        points.emplace_back();
        for (Index i = 0; i < basis.centre_weights().size(); ++i)
            points.back().push_back({i, basis.centre_weights()[i]});
    }
    for (const MirroredNet::Terms& terms : points) {
        net_offsets_.push_back(static_cast<Index>(net_terms_.size()));
        net_indices_.push_back(static_cast<Index>(net_indices_.size()));
        net_terms_.insert(net_terms_.end(), terms.begin(), terms.end());
    }
    net_offsets_.push_back(static_cast<Index>(net_terms_.size()));
}

template <class T>
void BorderKernel::gather(const PointSum<T>& what, double* out) const noexcept {
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

template <int kOrder>
void BorderKernel::sum_net(const KernelTables& tables, PointKernels::Sum<double> polygon,
                           const DomainPoint& p, Chart chart, ChartTurn turn,
                           std::span<const double> net, PointJet& out) const noexcept {
    using J = Jet<double, kOrder>;
    using Channels = std::array<J, kSumChannels>;
    const RingTables& ring = *tables.ring;
    const PatchClass& c = border_.patch_class();
    // S without what is done at borders, at a place that moves by (x, y) of its sector.
    const auto surface = [&](std::size_t first, const DomainPoint& q, J x, J y) {
        PointJet s;
        polygon(tables, q, PointFrame::Sector, {},
                {net.data(), net.size(), 4, net_indices_.data() + first}, s);
        x.c[0] = y.c[0] = 0;
        const J xx = 0.5 * (x * x), xy = x * y, yy = 0.5 * (y * y);
        Channels r;
        for (int k = 0; k < kSumChannels; ++k) {
            r[k] = J(s.value[0][k]);
            if constexpr (kOrder > 0)
                r[k] += s.value[1][k] * x + s.value[2][k] * y;
            if constexpr (kOrder > 1)
                r[k] += s.value[3][k] * xx + s.value[4][k] * xy + s.value[5][k] * yy;
        }
        return r;
    };

    const auto at = border_.place<kOrder, double>(p);
    const PolygonDistances<kOrder> domain(border_.polygon(), p.sector, at.a, at.b, chart,
                                          !c.is_open());
    J x, y;
    if (chart == Chart::BaseUV) {
        x = ring.x_a * (at.a + at.b) + ring.x_ab * (at.a * at.b);
        y = ring.y_b * (at.b - at.a);
    } else if constexpr (kOrder > 0) {
        const Vec2<double> turned = ring.sector_turn[p.sector];
        x.c[1] = y.c[2] = turned.x;
        x.c[2] = turned.y;
        y.c[1] = -turned.y;
    }
    Channels r = surface(0, {p.sector, at.a.c[0], at.b.c[0]}, x, y);

    const auto n_net = static_cast<std::size_t>(ring.n_points);
    if (c.border == PatchBorder::Spike) {
        const double* const extra = net.data() + 4 * n_net;
        const J b = border_.spike_weight(domain, J(1.0));
        for (int k = 0; k < kSumChannels; ++k)
            r[k] += (extra[k] - extra[4 + k]) * b;
    }
    border_.for_each_part<kOrder, double>(
        domain, p.sector, [&](int part, const J& b, const auto& foot, const J& tau) {
            const std::size_t first = n_net + part * (n_columns_ + n_net);
            const Channels s = surface(border_.is_pinned() ? first + n_columns_ : 0,
                                       {foot.side(), foot.t().c[0], 0},
                                       ring.x_a * foot.t(), -ring.y_b * foot.t());
            Channels curve{};
            border_.curve(tau, [&](int j, const J& w) {
                const double* point = net.data() + 4 * (first + j);
                for (int k = 0; k < kSumChannels; ++k)
                    curve[k] += point[k] * w;
            });
            for (int k = 0; k < kSumChannels; ++k)
                r[k] += b * (curve[k] - s[k]);
        });

    for (int k = 0; k < kSumChannels; ++k) {
        auto& d = r[k].c;
        if constexpr (kOrder > 1) {
            d[3] *= 2;
            d[5] *= 2;
        }
        turn_derivatives<kOrder>(turn.cos, turn.sin, d.data());
        for (int i = 0; i < J::kSize; ++i)
            out.value[i][k] = d[i];
    }
}

template <class T>
void BorderKernel::sum(const KernelTables& tables, const PointKernels& kernels,
                       const DomainPoint& p, Chart chart, int order, ChartTurn turn,
                       const PointSum<T>& what, PointJet& out) const noexcept {
    out = {};
    double values[4 * kMostNetPoints];
    gather(what, values);
    const std::span<const double> net(values, 4 * net_indices_.size());
    with_order(order, [&](auto k) {
        sum_net<k>(tables, kernels.double_sum[k], p, chart, turn, net, out);
    });
}

template void BorderKernel::sum(const KernelTables&, const PointKernels&,
                                const DomainPoint&, Chart, int, ChartTurn,
                                const PointSum<float>&, PointJet&) const noexcept;
template void BorderKernel::sum(const KernelTables&, const PointKernels&,
                                const DomainPoint&, Chart, int, ChartTurn,
                                const PointSum<double>&, PointJet&) const noexcept;

}  // namespace osdx::inline OSDX_ABI::detail
