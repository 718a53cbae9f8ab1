// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <filesystem>
#include <string_view>
#include <utility>
#include <vector>

#include <osdx/opensubdiv/limit_surface.h>
#include <osdx/surface.h>

#include "viewer/cli/job.h"
#include "viewer/render/picture.h"

namespace osdx::cli {

/// The pictures that `compare` and `demo` make, with the names of their files.
inline constexpr std::array kPictures = {
    std::pair(render::Shade::Phong, std::string_view("phong")),
    std::pair(render::Shade::Reflection, std::string_view("reflection")),
    std::pair(render::Shade::Mean, std::string_view("mean")),
    std::pair(render::Shade::Gauss, std::string_view("gauss")),
    std::pair(render::Shade::Patches, std::string_view("patches")),
    std::pair(render::Shade::Normals, std::string_view("normals")),
    std::pair(render::Shade::Distance, std::string_view("distance")),
};

/// The files of them all.
std::vector<std::filesystem::path> picture_files(const std::filesystem::path& folder);

/// The picture input of a job. The limit surface has no patches of ours to show.
render::PictureInput job_picture(const Job& job);

/// Lets Shade::Distance show the distance to the limit surface, over the diagonal.
/// \pre surface and limit outlive the input
void show_distance(render::PictureInput& input, const Surface& surface,
                   const LimitSurface& limit, double diagonal);

/// Lets Shade::Colors show the colours of the mesh, if it has any, on the surface of the job.
/// \pre the job outlives the input
Status show_color(render::PictureInput& input, const Job& job, int limit_isolation);

/// A PNG file. \return what render_picture() and write_png() return, that with the file
Status write_picture(const render::PictureInput& input, render::PictureOptions options,
                     render::Shade shade, const std::filesystem::path& file);

/// The folder and those above it, where they are not there yet.
Status make_folder(const std::filesystem::path& folder);

}  // namespace osdx::cli
