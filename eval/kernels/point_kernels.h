// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>

#include "eval/kernels/ribbon_tables.h"

namespace osdx::detail {

/// The variables of derivatives: (x, y) of the sector, x running to its corner, or what Chart says.
enum class PointFrame { Sector, Native, BaseUV };

/// From (a, b) of a patch to (u, v), which are turned and scaled:
/// d_u = cos d_a + sin d_b, d_v = cos d_b - sin d_a.
struct ChartTurn {
    double cos = 1, sin = 0;
};

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
/// value[r][c][i]: derivative r of channel c at place i.
struct PointJets {
    double value[6][3][kLanes];
};

/// The kernels for the instruction set of this machine, for points in float or double.
/// Weights and sums are formed in double.
template <class T>
struct PointKernels {
    PointKernels();

    /// At (s, t) of [0,1]^2, which are the variables, with derivatives up to an order of 0 to 2.
    void (*regular)(const TaylorRows& taylor, int degree, double s, double t, int order,
                    ChartTurn turn, const PointSum<T>& sum, PointJet& out);

    /// The same at some places at once.
    /// \param net  x, y, z of the control points
    void (*regular_points)(const TaylorRows& taylor, int degree, const double* net,
                           const PointPlaces& at, int order, PointJets& out);

    /// Gregory patches of four sides, at (a, b) of [0,1]^2, which are the variables.
    void (*gregory)(double a, double b, int order, ChartTurn turn, const PointSum<T>& sum,
                    PointJet& out);
    /// The same at some places at once, whose sectors are 0.
    /// \param net  x, y, z of the control points
    void (*gregory_points)(const double* net, const PointPlaces& at, int order,
                           PointJets& out);

    /// EV and EF patches inside. Null where the machine's registers are too narrow.
    /// \param turn  turns the variables of the frame
    void (*polygon)(const RingTables& tables, PatchKind kind, const DomainPoint& p,
                    int order, PointFrame frame, ChartTurn turn, const PointSum<T>& sum,
                    PointJet& out);

    /// The weights of such a patch that is a ring: derivative r of point i in
    /// out[r n_points + i]. Null where `polygon` is.
    void (*ring_weights)(const RingTables& tables, PatchKind kind, const DomainPoint& p,
                         int order, PointFrame frame, ChartTurn turn, double* out);

    /// The same as `polygon` at some places of a ring at once. Null where that is.
    /// \param net  x, y, z of the control points
    void (*ring_points)(const RingTables& tables, PatchKind kind, const double* net,
                        const PointPlaces& at, Chart chart, int order, PointJets& out);
};

}  // namespace osdx::detail
