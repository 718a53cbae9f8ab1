// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>
#include <vector>

#include <osdx/place.h>
#include <osdx/types.h>

#include "eval/bases/mirrored_net.h"
#include "eval/bases/ribbon.h"
#include "eval/kernels/point_kernels.h"

namespace osdx::inline OSDX_ABI::detail {

/// Sums over patches at borders and spikes: by the kernels of the whole n-gon, whose points are
/// combinations of the patch' own (MirroredNet), and the formula of RibbonBorder.
class BorderKernel {
public:
    /// \pre not one sector at a border, which is no part of an n-gon
    explicit BorderKernel(const RibbonBasis& basis);

    /// Larger nets are summed ribbon by ribbon.
    bool fits() const noexcept { return net_indices_.size() <= kMostNetPoints; }

    /// \param tables, kernels  of the whole n-gon
    /// \pre fits(); not RibbonBasis::is_at_corner()
    template <class T>
    void sum(const KernelTables& tables, const PointKernels& kernels,
             const DomainPoint& p, Chart chart, int order, ChartTurn turn,
             const PointSum<T>& what, PointJet& out) const noexcept;

private:
    static constexpr std::size_t kMostNetPoints = 1024;

    /// The points of the net, four channels each.
    template <class T>
    void gather(const PointSum<T>& what, double* out) const noexcept;
    template <int kOrder>
    void sum_net(const KernelTables& tables, PointKernels::Sum<double> polygon,
                 const DomainPoint& p, Chart chart, ChartTurn turn,
                 std::span<const double> net, PointJet& out) const noexcept;

    RibbonBorder border_;
    int n_columns_;  // of a ribbon
    // Terms of the n-gon's points; then of each part's curve and, of two, of what stands for the
    // n-gon's points on the border; or of a spike's centre and S(0).
    std::vector<Index> net_offsets_;
    std::vector<MirroredNet::Term> net_terms_;
    std::vector<Index> net_indices_;  // 0, 1, ..
};

extern template void BorderKernel::sum(const KernelTables&, const PointKernels&,
                                       const DomainPoint&, Chart, int, ChartTurn,
                                       const PointSum<float>&, PointJet&) const noexcept;
extern template void BorderKernel::sum(const KernelTables&, const PointKernels&,
                                       const DomainPoint&, Chart, int, ChartTurn,
                                       const PointSum<double>&, PointJet&) const noexcept;

}  // namespace osdx::inline OSDX_ABI::detail
