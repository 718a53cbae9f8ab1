// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>

#include <osdx/channels.h>
#include <osdx/result.h>
#include <osdx/surface.h>
#include <osdx/tessellation.h>

namespace osdx::inline OSDX_ABI {

/// Appends channels of the base vertices to those of a tessellation: at its points they are what
/// positions with these values would be there. All of them in one pass over the addresses.
///
/// Threads: goes wide; the result does not depend on their number.
/// \param channels  of surface.base().n_vertices() vertices, such as MeshData::channels
/// \return what check_channels() returns, and then nothing has changed
/// \pre the tessellation is one of the same base mesh
OSDX_API Status add_channels(Tessellation& tessellation, const Surface& surface,
                             std::span<const NamedChannels> channels);

}  // namespace osdx::inline OSDX_ABI
