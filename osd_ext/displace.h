// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <functional>

#include <osdx/address.h>
#include <osdx/tessellation.h>
#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

/// How far a point moves along its normal, in units of the mesh: called once for each point,
/// from several threads at the same time.
using HeightFunction = std::function<double(
    const Address& where, const Vec3<double>& position, const Vec3<double>& normal)>;

enum class DisplacedNormals : std::uint8_t {
    FromFacets,  ///< set_facet_normals(): light shows the relief
    Keep,        ///< those of the surface, for small heights or a normal map
};

/// Moves each point of a tessellation along its unit normal. Closed and watertight as before:
/// a point is stored once and moves once. Where it has several normals, at sharp edges, it moves
/// along their mean, each side once, made a unit; points without a normal stay.
///
/// A texture that has a seam through a point is asked on the side of Tessellation::addresses.
OSDX_API void displace(Tessellation& tessellation, const HeightFunction& height,
                       DisplacedNormals normals = DisplacedNormals::FromFacets);

/// Normals of the facets instead of those of the surface: the mean by area over the facets on
/// each side of sharp edges; zero where they have no area.
OSDX_API void set_facet_normals(Tessellation& tessellation);

}  // namespace osdx::inline OSDX_ABI
