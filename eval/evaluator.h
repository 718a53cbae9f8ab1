// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>
#include <vector>

#include <osdx/address.h>
#include <osdx/channels.h>
#include <osdx/patch_table.h>
#include <osdx/place.h>
#include <osdx/surface_jet.h>

namespace osdx::inline OSDX_ABI {

namespace detail {
struct ClassEvaluator;
}

/// Evaluates the surface of a patch table at single points.
///
/// Derivatives are exact up to rounding, those of the rational blends included. At a corner
/// of an EV or EF patch the second derivatives have no limit but the curvature does; see
/// RibbonBasis::for_each_weight of eval/bases/ribbon.h. Where several patches or sectors meet, (u, v) belongs to
/// the one that PatchTable::locate names, and derivatives in BaseUV are one-sided.
///
/// Weights and points are separate: the same weights serve positions, any other data at the
/// control points, and stencils.
///
/// Threads: const members may run at the same time. No query allocates.
class OSDX_API Evaluator {
public:
    /// \pre the table outlives the evaluator
    explicit Evaluator(const PatchTable& table);
    Evaluator(Evaluator&&) noexcept;
    Evaluator& operator=(Evaluator&&) noexcept;
    ~Evaluator();

    const PatchTable& table() const noexcept { return *table_; }

    /// Position and derivatives up to Order (0, 1 or 2).
    /// \param points  all control points, table().n_points() of them
    template <class T, int Order = 2>
    SurfaceJet<T> evaluate(std::span<const Vec3<T>> points, const PatchPoint& where,
                           Chart chart = Chart::BaseUV) const noexcept;
    template <class T, int Order = 2>
    SurfaceJet<T> evaluate(std::span<const Vec3<T>> points, const Address& where,
                           Chart chart = Chart::BaseUV) const noexcept {
        return evaluate<T, Order>(points, table_->locate(where), chart);
    }
    template <class T, int Order = 2>
    SurfaceJet<T> evaluate(std::span<const Vec3<T>> points, const QuarterPoint& where,
                           Chart chart = Chart::BaseUV) const noexcept {
        return evaluate<T, Order>(points, table_->locate(where), chart);
    }

    /// The same at several places of one patch, up to rounding: control points are read once,
    /// and patches inside of up to eight sides evaluate some places at a time.
    /// \pre all of `where` name the same patch; out.size() == where.size()
    template <class T, int Order = 2>
    void evaluate_many(std::span<const Vec3<T>> points, std::span<const PatchPoint> where,
                       Chart chart, std::span<SurfaceJet<T>> out) const noexcept;

    /// The same for values with any number of channels, stored one point after the other:
    /// derivative r of channel c is out[r * n_channels + c].
    /// \param order  0, 1 or 2
    /// \pre values.size() == table().n_points() n_channels;
    ///      out.size() == n_derivatives(order) n_channels
    template <class T>
    void evaluate_channels(std::span<const T> values, int n_channels,
                           const PatchPoint& where, int order, Chart chart,
                           std::span<T> out) const noexcept;

    /// The same at several places of one patch, as evaluate_many() does.
    /// The results at a place do not depend on the others.
    /// \param out  those of place i go to out[rows[i]]
    /// \pre rows.size() == where.a.size() == where.b.size();
    ///      out.n == n_derivatives(order) n_channels
    template <class T>
    void evaluate_many_channels(std::span<const T> values, int n_channels,
                                const PatchPlaces& where, int order, Chart chart,
                                Channels<T> out,
                                std::span<const Index> rows) const noexcept;

    /// The weights of the control points of the patch and their derivatives: derivative r
    /// of point i is out[r * n + i], n the number of control points.
    /// \param order  0, 1 or 2
    /// \pre out.size() == n_derivatives(order) n
    void weights(const PatchPoint& where, int order, Chart chart,
                 std::span<double> out) const noexcept;

private:
    const PatchTable* table_;
    std::vector<detail::ClassEvaluator> classes_;  // by patch class
};

}  // namespace osdx::inline OSDX_ABI
