// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string_view>

namespace osdx::cli {

/// The bundled mesh, assets/valve_body.obj, as text.
std::string_view demo_mesh_obj();

}  // namespace osdx::cli
