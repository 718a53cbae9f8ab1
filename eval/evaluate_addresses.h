// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include <osdx/address.h>
#include <osdx/channels.h>
#include <osdx/evaluator.h>
#include <osdx/stencil_table.h>
#include <osdx/surface_jet.h>

namespace osdx::inline OSDX_ABI {

/// Evaluates the surface at many addresses in any order: sorted by patches inside, so that each
/// patch is read once and several places are evaluated at a time.
///
/// Values are those of Evaluator::evaluate_channels() up to rounding. Addresses without a point
/// get NaN, in weights empty rows.
/// Threads: goes wide; the result does not depend on their number.
/// \param values  n_channels of each control point, evaluator.table().n_points() of them
/// \param order  of the derivatives: 0, 1 or 2
/// \param out  derivative r of channel c at address i goes to out[i][r * n_channels + c]
/// \pre out.n == n_derivatives(order) n_channels
template <class T>
AddressReport evaluate_addresses(const Evaluator& evaluator, std::span<const T> values,
                                 int n_channels, std::span<const Address> where,
                                 int order, Chart chart, Channels<T> out);
extern template OSDX_API AddressReport evaluate_addresses(const Evaluator&,
                                                          std::span<const float>, int,
                                                          std::span<const Address>, int,
                                                          Chart, Channels<float>);
extern template OSDX_API AddressReport evaluate_addresses(const Evaluator&,
                                                          std::span<const double>, int,
                                                          std::span<const Address>, int,
                                                          Chart, Channels<double>);

/// What the columns of weights are.
enum class WeightsOf : std::uint8_t {
    ControlPoints,  ///< of the patch table: short rows
    BaseVertices,   ///< as limit stencils are: what a vertex of the mesh does
};

struct WeightRows {
    /// Row i * n_derivatives(order) + r has the weights of derivative r at address i, in
    /// ascending order of their points. Rows of p sum to one, those of derivatives to zero.
    StencilTable rows;
    AddressReport report;
};

/// The weights of evaluate_addresses() as sparse rows, for those who apply them themselves. Of a
/// tessellation: at Tessellation::addresses.
/// \pre where.size() < kInvalidIndex
OSDX_API WeightRows weights_at(const Evaluator& evaluator, std::span<const Address> where,
                               int order, Chart chart = Chart::BaseUV,
                               WeightsOf of = WeightsOf::BaseVertices);

}  // namespace osdx::inline OSDX_ABI
