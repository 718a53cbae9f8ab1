// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>
#include <utility>

#include <osdx/features.h>
#include <osdx/topology.h>
#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

/// The features of a mesh with its border as what it is for the surface: edges and corners
/// that are infinitely sharp, and holes for BoundaryRule::None.
///
/// A type of its own, so that nothing that reads the border there is handed features that do
/// not say it yet. Where plain ones are asked for these do as well: resolve() changes nothing
/// about them.
struct ResolvedFeatures : Features {
    ResolvedFeatures() = default;  ///< of a closed mesh without tags

    bool operator==(const ResolvedFeatures&) const = default;

private:
    explicit ResolvedFeatures(Features features) : Features(std::move(features)) {}
    friend ResolvedFeatures resolve(const Topology& topology, Features features,
                                    std::span<const Index> borders);
};

OSDX_API ResolvedFeatures resolve(const Topology& topology, Features features);
/// \param borders  border_halfedges() of the topology
OSDX_API ResolvedFeatures resolve(const Topology& topology, Features features,
                                  std::span<const Index> borders);

}  // namespace osdx::inline OSDX_ABI
