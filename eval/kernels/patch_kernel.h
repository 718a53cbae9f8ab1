// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>
#include <span>

#include <osdx/patch_class.h>
#include <osdx/place.h>

#include "eval/bases/patch_basis.h"
#include "eval/kernels/border.h"
#include "eval/kernels/point_kernels.h"
#include "eval/turn.h"

namespace osdx::inline OSDX_ABI {

/// The vectorised kernels for a class of patches, chosen once for it: what they compute is what
/// PatchBasis::for_each_weight() gives, up to rounding. Where they have nothing, at the corners
/// of n-sided patches for instance, the basis has.
/// Threads: const members may run at the same time. No query allocates.
class PatchKernel {
public:
    explicit PatchKernel(const PatchBasis& basis);

    /// Derivatives up to an order of 0 to 2 of the sum of the control points' values times
    /// their weights, of kSumChannels channels.
    /// \param turn  from (a, b), or (x, y), to the variables of the derivatives
    /// \return false where there is no such kernel
    template <class T>
    bool sum(const DomainPoint& p, Chart chart, int order, detail::ChartTurn turn,
             const detail::PointSum<T>& what, detail::PointJet& out) const noexcept {
        const auto kernel = kernels_.sum<T>(order);
        if (!kernel || !takes(p))
            return false;
        if (border_)
            border_->sum(tables_, kernels_, p, chart, order, turn, what, out);
        else
            kernel(tables_, p, detail::frame_of(chart), turn, what, out);
        return true;
    }

    /// The weights themselves, likewise: derivative r of point i is out[r n_points + i].
    bool weights(const DomainPoint& p, Chart chart, int order, detail::ChartTurn turn,
                 std::span<double> out) const noexcept {
        if (!kernels_.weights[order] || !takes(p))
            return false;
        kernels_.weights[order](tables_, p, detail::frame_of(chart), turn, out.data());
        return true;
    }

    /// Whether there is a kernel for some places at once: for the class, and for a place.
    bool has_many() const noexcept { return kernels_.many[0]; }
    bool takes(const DomainPoint& p) const noexcept {
        return is_square_ || !RibbonBasis::is_at_corner(p);
    }
    /// The same as sum() at such places; elsewhere there may be anything.
    /// \param net  n_channels values of each control point
    /// \pre has_many(); n_channels <= kManyChannels
    void sum_many(std::span<const double> net, int n_channels,
                  const detail::PointPlaces& at, Chart chart, int order,
                  detail::PointJets& out) const noexcept {
        const auto& kernels = n_channels == 3 ? kernels_.many : kernels_.many_of_any;
        kernels[order](tables_, net.data(), n_channels, at, chart, out);
    }

private:
    bool is_square_;
    detail::KernelTables tables_;  // of the whole n-gon
    detail::PointKernels kernels_;
    std::optional<detail::BorderKernel> border_;
};

}  // namespace osdx::inline OSDX_ABI
