// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include <osdx/patch_class.h>
#include <osdx/place.h>
#include <osdx/types.h>

#include "eval/kernels/ribbon_tables.h"
#include "eval/turn.h"

/// The kernels of single points, for the instruction set of this machine: a file for each kind
/// of patch. Weights and sums are formed in double.
namespace osdx::inline OSDX_ABI::detail {

/// The variables of derivatives: (x, y) of the sector, x running to its corner, or what Chart says.
enum class PointFrame { Sector, Native, BaseUV };

constexpr PointFrame frame_of(Chart chart) noexcept {
    return chart == Chart::Native ? PointFrame::Native : PointFrame::BaseUV;
}

/// A sum over the control points of one patch of their values times the weights at one
/// point of the domain.
template <class T>
struct PointSum {
    const T* values;       ///< of all points, `stride` apiece
    std::size_t n_values;  ///< where they end
    int stride;
    const Index* points;  ///< control points of the patch
};

/// The largest number of points of a patch that is evaluated at some places at once.
inline constexpr int kMostManyPoints = kLanes * kMaxDegree * kMaxDegree;

/// Channels that are summed at a time.
inline constexpr int kSumChannels = 3;

/// p, du, dv, duu, duv, dvv of kSumChannels channels. What follows them may be anything.
struct PointJet {
    double value[6][4];
};

/// kLanes places of a patch, and for each how the variables of its derivatives are turned.
struct PointPlaces {
    int sector[kLanes];
    double a[kLanes], b[kLanes], cos[kLanes], sin[kLanes];
};
/// Channels that are summed at some places at once.
inline constexpr int kManyChannels = 8;

/// value[r][c][i]: derivative r of channel c at place i.
struct PointJets {
    double value[6][kManyChannels][kLanes];
};

/// What the kernels of a class of patches read.
struct KernelTables {
    PatchKind kind;
    int degree;
    std::optional<TaylorRows> taylor;  ///< of regular patches
    std::optional<RingTables> ring;    ///< of EV and EF patches
};

/// The kernels of a class of patches, by the order of the derivatives. Null where there is none.
///
/// Regular patches and Gregory patches of four sides: at (a, b) of [0,1]^2, which are the
/// variables of the derivatives, whatever the frame.
struct PointKernels {
    /// \param turn  turns the variables of the frame
    template <class T>
    using Sum = void (*)(const KernelTables& tables, const DomainPoint& p,
                         PointFrame frame, ChartTurn turn, const PointSum<T>& sum,
                         PointJet& out);
    /// The same at some places at once.
    /// \param net  n_channels values of each control point
    /// \pre n_channels <= kManyChannels
    using Many = void (*)(const KernelTables& tables, const double* net, int n_channels,
                          const PointPlaces& at, Chart chart, PointJets& out);
    /// The weights: derivative r of point i in out[r n_points + i].
    using Weights = void (*)(const KernelTables& tables, const DomainPoint& p,
                             PointFrame frame, ChartTurn turn, double* out);

    std::array<Sum<float>, 3> float_sum{};
    std::array<Sum<double>, 3> double_sum{};
    std::array<Many, 3> many{};         ///< of three channels
    std::array<Many, 3> many_of_any{};  ///< of any number; null where `many` is
    std::array<Weights, 3> weights{};

    template <class T>
    Sum<T> sum(int order) const noexcept {
        if constexpr (sizeof(T) == sizeof(float))
            return float_sum[order];
        else
            return double_sum[order];
    }
};

/// Each sets the kernels that it has for a class.
void set_regular_kernels(const KernelTables& tables, PointKernels& kernels);
void set_gregory_kernels(PointKernels& kernels);  ///< of four sides
/// EV and EF patches inside. None where the machine's registers are too narrow.
void set_ribbon_sums_float_kernels(PointKernels& kernels);
void set_ribbon_sums_double_kernels(PointKernels& kernels);
void set_ribbon_weights_kernels(const KernelTables& tables, PointKernels& kernels);
/// Rings at some places at once.
void set_ribbon_many_kernels(const KernelTables& tables, PointKernels& kernels);
void set_ribbon_channels_kernels(const KernelTables& tables, PointKernels& kernels);

}  // namespace osdx::inline OSDX_ABI::detail
