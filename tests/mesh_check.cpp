// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

// Builds the surfaces of one mesh at several degrees and measures how their patches join.
// scripts/check_meshes.sh runs it on folders.
//
// Usage: mesh_check MESH [DEGREE...]. Prints one row; status 0: all is well, 3: refused, 1: too large a
// jump or no number.

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <osdx/analysis/continuity.h>
#include <osdx/mesh_file.h>
#include <osdx/patch_table.h>
#include <osdx/surface.h>
#include <osdx/topology.h>

#include "tests/support/border_curve.h"

namespace osdx {
namespace {

constexpr int kRate = 4;

// Far above rounding and far below what a wrong control point does. A needle of a face may
// cost ten digits of a normal, and the curvature is relative to the largest of the mesh.
constexpr double kGapMax = 1e-9;         // of the diagonal
constexpr double kNormalJumpMax = 1e-4;  // degrees
constexpr double kCurvatureJumpMax = 1e-3;
constexpr double kBorderErrorMax = 1e-12;  // of the diagonal, from the B-spline curves

void print(const std::string& text) {
    std::fputs(text.c_str(), stdout);
    std::fflush(stdout);  // what comes next may crash
}

bool is_finite(const SurfaceJet<double>& s) {
    for (const auto& v : {s.p, s.du, s.dv, s.duu, s.duv, s.dvv}) {
        if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z))
            return false;
    }
    return true;
}

/// A quarter in which the surface has a value that is no number, if there is one.
std::optional<Index> find_not_finite(const Surface& s) {
    for (Index q = 0; q < s.base().n_halfedges(); ++q) {
        if (!s.patches().has_surface(s.base().face(q)))
            continue;
        for (const auto& [x, y] : {std::pair(0.0, 0.0), std::pair(0.3, 0.6),
                                   std::pair(1.0, 0.5), std::pair(1.0, 1.0)}) {
            if (!is_finite(s.evaluate(to_address(s.base(), {q, x, y}))))
                return q;
        }
    }
    return {};
}

/// Prints the cell of one degree. \return whether all is well
bool check(const Surface& s) {
    const Continuity c = measure_continuity(s, kRate);
    const bool has_curvature = s.patches().degree() >= 3;
    std::string cell = fmt::format("{} patches {:.0e} {:.0e}", s.patches().n_patches(),
                                   c.gap_max, c.normal_jump_deg_max);
    if (has_curvature)
        cell += fmt::format(" {:.0e}", c.curvature_jump_max);
    const test::BorderError border = test::border_error(s);
    if (border.n_samples > 0)
        cell += fmt::format(" border {:.0e}", border.max);
    // Comparisons that a value fails which is no number.
    std::string bad;
    if (!(c.gap_max <= kGapMax))
        bad += fmt::format(" gap at {},{},{}", c.worst_gap.quarter, c.worst_gap.x,
                           c.worst_gap.y);
    if (!(c.normal_jump_deg_max <= kNormalJumpMax))
        bad += fmt::format(" normal at {},{},{}", c.worst_normal.quarter,
                           c.worst_normal.x, c.worst_normal.y);
    if (has_curvature && !(c.curvature_jump_max <= kCurvatureJumpMax))
        bad += fmt::format(" curvature at {},{},{}", c.worst_curvature.quarter,
                           c.worst_curvature.x, c.worst_curvature.y);
    if (!(border.max <= kBorderErrorMax))
        bad += " border";
    if (const auto q = find_not_finite(s))
        bad += fmt::format(" no number in quarter {}", *q);
    print(bad.empty() ? cell : fmt::format("{} FAILED{}", cell, bad));
    return bad.empty();
}

int run(const std::filesystem::path& file, const std::vector<int>& degrees) {
    print(fmt::format("{:<34}", file.filename().string()));
    const Result<MeshData> mesh = read_mesh(file);
    if (!mesh) {
        print(fmt::format(" refused: {}\n", mesh.error().message));
        return 3;
    }
    bool well = true, refused = false;
    std::string last;  // degrees are refused for the same reason as a rule
    for (const int degree : degrees) {
        const auto surface = Surface::build(*mesh, {.degree = degree});
        print(fmt::format(" | d{} ", degree));
        if (surface) {
            well = check(*surface) && well;
            continue;
        }
        refused = true;
        print(surface.error().message == last ? "refused too"
                                              : "refused: " + surface.error().message);
        last = surface.error().message;
    }
    print("\n");
    return !well ? 1 : refused ? 3 : 0;
}

}  // namespace
}  // namespace osdx

int main(int argc, char** argv) {
    if (argc < 2) {
        std::fputs("usage: mesh_check MESH [DEGREE...]\n", stderr);
        return 2;
    }
    std::vector<int> degrees = {2, 3, 4, 5};
    if (argc > 2)
        degrees.clear();
    for (int i = 2; i < argc; ++i)
        degrees.push_back(std::atoi(argv[i]));
    return osdx::run(argv[1], degrees);
}
