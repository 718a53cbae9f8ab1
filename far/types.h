// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <osdx/version.h>

/// Conventions that hold in every file.
///
/// Faces run counter-clockwise seen from outside; edge i of a face joins its corners i and
/// i + 1 modulo n. A halfedge is a corner of a face together with the edge that leaves it.
/// The domain of a quad is [0,1]^2 with corners (0,0), (1,0), (1,1), (0,1); the normal is
/// du x dv. Indices count from 0.
namespace osdx::inline OSDX_ABI {

using Index = std::uint32_t;
inline constexpr Index kInvalidIndex = std::numeric_limits<Index>::max();

/// 0 or 1 for each element; unlike those of vector<bool>, several threads may write them.
using Flags = std::vector<std::uint8_t>;

template <class T>
using Vec2 = glm::vec<2, T, glm::defaultp>;
template <class T>
using Vec3 = glm::vec<3, T, glm::defaultp>;

/// Degrees of the splines that the tables and kernels take.
inline constexpr int kMinDegree = 2;
inline constexpr int kMaxDegree = 15;

}  // namespace osdx::inline OSDX_ABI
