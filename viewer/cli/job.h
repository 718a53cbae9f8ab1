// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include <osdx/mesh_data.h>
#include <osdx/opensubdiv/limit_surface.h>
#include <osdx/surface.h>
#include <osdx/surface_function.h>
#include <osdx/tessellate.h>
#include <osdx/tessellation.h>
#include <osdx/texture.h>

#include "viewer/cli/commands.h"
#include "viewer/cli/progress.h"
#include "viewer/cli/report.h"

namespace osdx::cli {

/// The error with the file, and the line where there is one, before its message.
Error in_file(Error error, const std::filesystem::path& file);

/// With the file before its message.
void warn(const Warning& warning, const std::filesystem::path& file,
          ProgressBar& progress);

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
/// The mesh of options.input, of the format that its name tells or of --format; repaired where
/// that is asked for. Warned of is what the reader took as it is not, and what was repaired.
Result<MeshData> load_mesh(const CommandOptions& options, ProgressBar& progress);

/// A refused mesh: with the option that would help, where one would.
Error refused(Error error, const CommandOptions& options);

/// \param progress  null, or told how far the surface is
Result<Job> build_job(MeshData mesh, const CommandOptions& options,
                      Progress* progress = nullptr);
/// Both of them.
Result<Job> load_job(const CommandOptions& options, ProgressBar& progress);

/// The texture coordinates of a job's mesh, over the same faces as its surface.
Result<TextureSurface> load_texture(const Job& job, const CommandOptions& options);

/// A failed write, with the file before its message.
Status written(Status status, const std::filesystem::path& file);

/// The format of options.out, as an extension: that of --out-format, or that its name tells, or
/// that of --format.
std::string output_extension(const CommandOptions& options);

/// Whether an extension is that one, in any case of its letters.
bool is_extension(std::string_view extension, std::string_view lower);

/// Writes the report where --json asks for it, with the warnings until now.
Status write_report(const CommandOptions& options, Json report,
                    const ProgressBar& progress);

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
