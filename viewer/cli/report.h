// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include <osdx/features.h>
#include <osdx/patch_table.h>
#include <osdx/topology.h>

namespace osdx::cli {

using Json = nlohmann::ordered_json;

/// {"3": 8, "5": 16}: how often each number comes up.
Json histogram(const std::map<Index, Index>& counts);

/// A histogram as "8 x 3, 16 x 5", or "none".
std::string one_line(const Json& histogram);

/// {"vertices", "faces", "boundary_edges"}
Json mesh_report(const Topology& topology);
Json mesh_report(std::size_t n_vertices, std::size_t n_faces, std::size_t n_border_edges);

/// The same with "edges", "closed", "boundary_loops", "components", "euler" (without the
/// vertices that no face uses) and the histograms "valences" (of interior vertices),
/// "boundary_valences" (faces at the vertices of the border) and "face_sizes".
Json mesh_details(const Topology& topology);

/// {"creases", "corners", "holes", "boundary", "crease_method", "smooth_triangles"}, the first
/// two with "semi_sharp", "infinitely_sharp" and "largest_sharpness" of the semi-sharp ones.
/// \param features  as build_features() makes them: what the border becomes is no tag
Json feature_report(const Features& features);

/// One line each for creases, corners and holes that there are, for the rule of the border
/// where \p closed is false, and for the other rules where they are not the default ones.
std::string feature_lines(const Json& feature_report, bool closed);

/// {"regular": k, "ev": {"5": k, ...}, "ef": {...}, "gregory": {}}, by number of sectors; and,
/// where there are some, "ev_border", "ev_pinned", "ev_spike" and the same for "ef"; see
/// PatchBorder.
/// \param level  of refinement, or all of them
Json patch_counts(const PatchTable& table, std::optional<int> level = {});

/// "96 regular, 8 EV(3), 16 EV(5), 4 border EV(1)"
std::string patch_summary(const PatchTable& table, std::optional<int> level = {});

}  // namespace osdx::cli
