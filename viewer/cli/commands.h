// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <osdx/build_patch_table.h>
#include <osdx/face_varying.h>
#include <osdx/features.h>
#include <osdx/result.h>

namespace osdx::cli {

/// On the command line and in reports, in the order of BoundaryRule.
inline constexpr std::array<std::string_view, 3> kBoundaryRuleNames = {
    "none", "edge-only", "edge-and-corner"};

/// Options of the subcommands, as the command line gives them.
struct CommandOptions {
    std::filesystem::path input;
    std::filesystem::path out;
    std::string format;             ///< of files whose names do not tell: "obj"
    std::string out_format;         ///< of `out`, whatever its name
    bool quiet = false;             ///< no report to people, no warnings, no bar
    bool report_on_stderr = false;  ///< for people, as stdout carries data
    std::filesystem::path at;
    std::filesystem::path json;
    std::filesystem::path images;
    std::string patch = "multisided";
    std::string with;        ///< another family, to compare
    int with_isolation = 1;  ///< of OpenSubdiv's patches, where `with` is catmark
    std::string shade = "phong";
    PatchTableOptions patches;  ///< the family is that of `patch`; see load_job()
    FeatureOptions features;
    bool repair = false;
    std::optional<double> weld;          ///< over the diagonal; 1e-6 with `repair`
    std::optional<double> crease_angle;  ///< in degrees: sharper edges are creases
    int levels = 1;                      ///< of subdivision
    int rate = 8;
    std::optional<double> edge_length,
        error;                       ///< instead; over the bounding-box diagonal
    int max_rate = 64;               ///< where rates come from one of these
    std::filesystem::path displace;  ///< a height map
    double displace_scale = 0.02;    ///< of white; over the diagonal
    int limit_isolation = 8;         ///< of OpenSubdiv's limit surface
    int width = 960, height = 720;
    std::optional<FaceVaryingRule> uv_rule;  ///< instead of the mesh's tag
    std::optional<double> range;
    double azimuth = 35, elevation = 25;
};

/// Each prints its report to people and, where options.json is set, writes it as JSON.
/// The message of an Error names the file and the line.
Status info_command(const CommandOptions& options);
Status subdivide_command(const CommandOptions& options);
Status patch_command(const CommandOptions& options);
Status eval_command(const CommandOptions& options);
Status tessellate_command(const CommandOptions& options);
Status compare_command(const CommandOptions& options);
Status render_command(const CommandOptions& options);
Status demo_command(const CommandOptions& options);

/// The files that `demo` makes in its folder.
std::vector<std::filesystem::path> demo_files(const std::filesystem::path& folder);

}  // namespace osdx::cli
