// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>

#include <osdx/mesh_data.h>
#include <osdx/opensubdiv/limit_surface.h>
#include <osdx/surface.h>
#include <osdx/surface_function.h>
#include <osdx/tessellate.h>
#include <osdx/tessellation.h>
#include <osdx/texture.h>

#include "viewer/cli/commands.h"
#include "viewer/cli/report.h"

namespace osdx::cli {

/// The error with the file, and the line where there is one, before its message.
Error in_file(Error error, const std::filesystem::path& file);

/// A line on stderr, with the file before its message.
void warn(const Warning& warning, const std::filesystem::path& file);

/// The text of a report; what is not UTF-8 in names becomes U+FFFD.
std::string to_text(const Json& json, int indent);

/// The input of a subcommand, ready to evaluate.
struct Job {
    MeshData mesh;
    Surface surface;
    std::optional<LimitSurface> limit;  ///< for --patch catmark
    double seconds_build = 0;

    /// Of the patch family that was asked for; the limit knows no chart but (u, v).
    SurfaceFunction function(Chart chart = Chart::BaseUV) const;
    /// Watertight; with the normals of Chart::Native.
    Tessellation tessellate(const TessellationRates& rates) const;
    Result<Tessellation> tessellate(int rate, Progress& progress) const;
    /// The mesh's channels at the points of that.
    Status add_channels(Tessellation& t, int limit_isolation) const;
    double diagonal() const;
    /// With the features of the surface. \pre the surface outlives it
    Result<LimitSurface> build_limit(int isolation) const;
    /// With up to three channels, from the one of number `first` on, in the place of positions.
    Result<LimitSurface> build_limit(Channels<const double> channels, int first,
                                     int isolation) const;
};
/// The mesh of a subcommand, repaired where that is asked for; its warnings and what the repair
/// did go to stderr.
Result<MeshData> load_mesh(const CommandOptions& options);

/// A refused mesh: with the option that would help, where one would.
Error refused(Error error, const CommandOptions& options);

/// \param progress  null, or told how far the surface is
Result<Job> load_job(const CommandOptions& options, Progress* progress = nullptr);

/// The texture coordinates of a job's mesh, over the same faces as its surface.
Result<TextureSurface> load_texture(const Job& job, const CommandOptions& options);

/// A failed write, with the file before its message.
Status written(Status status, const std::filesystem::path& file);

/// Writes the report where --json asks for it.
Status write_report(const CommandOptions& options, const Json& report);

class Stopwatch {
public:
    /// Seconds since the last call, or since the start.
    double lap() {
        const auto now = std::chrono::steady_clock::now();
        const std::chrono::duration<double> d = now - last_;
        last_ = now;
        return d.count();
    }

private:
    std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace osdx::cli
