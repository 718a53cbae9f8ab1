// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "benchmarks/meshes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <stdexcept>
#include <unordered_map>

#include <glm/geometric.hpp>

#include <osdx/build_topology.h>
#include <osdx/features.h>
#include <osdx/topology.h>

#include "far/refine/refinement.h"

namespace osdx::bench {
namespace {

template <class T>
T value_or_throw(Result<T> result) {
    if (!result)
        throw std::runtime_error(result.error().message);
    return *std::move(result);
}

std::uint64_t cell_key(std::int64_t x, std::int64_t y, std::int64_t z) {
    // Any mixing will do: a wrong hit costs one more comparison.
    return static_cast<std::uint64_t>(x) * 0x9e3779b97f4a7c15u ^
           static_cast<std::uint64_t>(y) * 0xc2b2ae3d27d4eb4fu ^
           static_cast<std::uint64_t>(z) * 0x165667b19e3779f9u;
}

double one_sided(std::span<const Vec3<double>> from, std::span<const Vec3<double>> to,
                 double reach) {
    std::unordered_multimap<std::uint64_t, Index> cells;
    cells.reserve(to.size());
    const auto cell = [&](double x) {
        return static_cast<std::int64_t>(std::floor(x / reach));
    };
    for (Index i = 0; i < to.size(); ++i)
        cells.emplace(cell_key(cell(to[i].x), cell(to[i].y), cell(to[i].z)), i);
    double largest = 0;
    for (const Vec3<double>& p : from) {
        double nearest = std::numeric_limits<double>::infinity();
        for (int k = 0; k < 27; ++k) {
            const auto [first, last] = cells.equal_range(cell_key(
                cell(p.x) + k % 3 - 1, cell(p.y) + k / 3 % 3 - 1, cell(p.z) + k / 9 - 1));
            for (auto it = first; it != last; ++it)
                nearest = std::min(nearest, glm::length(p - to[it->second]));
        }
        largest = std::max(largest, nearest);
    }
    return largest;
}

}  // namespace

MeshData refined(const MeshData& mesh, int levels) {
    Topology base = value_or_throw(build_topology(mesh));
    Features features = value_or_throw(build_features(mesh, base, kNoTags));
    Refinement refinement(std::move(base), 3, std::move(features));
    for (int i = 0; i < levels; ++i)
        refinement.add_level();
    MeshData result;
    result.positions = refinement.points(mesh.positions);
    const Topology& last = refinement.topology(levels);
    for (Index f = 0; f < last.n_faces(); ++f)
        result.face_sizes.push_back(last.face_size(f));
    result.face_vertices.assign(last.vertex.begin(), last.vertex.end());
    return result;
}

std::vector<BenchMesh> mesh_sizes(const std::string& name, const MeshData& mesh,
                                  Index largest) {
    const bool quads =
        std::ranges::all_of(mesh.face_sizes, [](Index n) { return n == 4; });
    std::vector<BenchMesh> meshes;
    meshes.push_back({name, refined(mesh, quads ? 0 : 1)});
    for (const Index size : kSizes) {
        const BenchMesh& last = meshes.back();
        int levels = 0;
        for (Index n = last.n_faces(); n < size; n *= 4)
            ++levels;
        if (size > largest || levels == 0)
            continue;
        const auto n = static_cast<std::size_t>(last.n_faces()) << (2 * levels);
        meshes.push_back(
            {name + "@" + std::to_string(n / 1000) + "k", refined(last.data, levels)});
    }
    return meshes;
}

const BenchMesh* base_of_size(std::span<const BenchMesh> meshes) {
    for (const BenchMesh& mesh : meshes) {
        if (mesh.n_faces() >= kSizes[0])
            return &mesh == &meshes.back() ? nullptr : &mesh;
    }
    return nullptr;
}

MeshData perforated_slab(Index n) {
    // Voxels of two layers; a hole in the middle of each 3 x 3 of them.
    const int side = static_cast<int>(3 * n), layers = 2;
    const auto solid = [&](int x, int y, int z) {
        return x >= 0 && y >= 0 && z >= 0 && x < side && y < side && z < layers &&
               !(x % 3 == 1 && y % 3 == 1);
    };
    MeshData mesh;
    std::map<std::array<int, 3>, Index> vertices;
    const auto vertex = [&](const std::array<int, 3>& p) {
        const auto [it, is_new] =
            vertices.emplace(p, static_cast<Index>(mesh.positions.size()));
        if (is_new) {
            mesh.positions.emplace_back(
                p[0], p[1], p[2] + std::sin(0.3 * p[0]) * std::cos(0.4 * p[1]));
        }
        return it->second;
    };
    for (int z = 0; z < layers; ++z) {
        for (int y = 0; y < side; ++y) {
            for (int x = 0; x < side; ++x) {
                if (!solid(x, y, z))
                    continue;
                for (int axis = 0; axis < 3; ++axis) {
                    for (int step = 0; step < 2; ++step) {
                        std::array<int, 3> beyond = {x, y, z};
                        beyond[axis] += 2 * step - 1;
                        if (solid(beyond[0], beyond[1], beyond[2]))
                            continue;
                        std::array<int, 3> corner = {x, y, z};
                        corner[axis] += step;
                        // Counter-clockwise seen along the axis, turned on its near side.
                        const int a = (axis + 1) % 3, b = (axis + 2) % 3;
                        std::array<std::array<int, 3>, 4> corners = {corner, corner,
                                                                     corner, corner};
                        ++corners[1][step ? a : b];
                        ++corners[2][a], ++corners[2][b];
                        ++corners[3][step ? b : a];
                        for (const auto& c : corners)
                            mesh.face_vertices.push_back(vertex(c));
                        mesh.face_sizes.push_back(4);
                    }
                }
            }
        }
    }
    return mesh;
}

double diagonal(const MeshData& mesh) {
    Vec3<double> low = mesh.positions.front(), high = low;
    for (const Vec3<double>& p : mesh.positions) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    return glm::length(high - low);
}

double set_distance(std::span<const Vec3<double>> a, std::span<const Vec3<double>> b,
                    double reach) {
    if (a.size() != b.size())
        return std::numeric_limits<double>::infinity();
    return std::max(one_sided(a, b, reach), one_sided(b, a, reach));
}

}  // namespace osdx::bench
