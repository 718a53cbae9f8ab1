// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <osdx/build_topology.h>
#include <osdx/stencil_table.h>
#include <osdx/subdivide.h>
#include <osdx/topology.h>
#include <osdx/types.h>

#include "far/mesh/topology_edits.h"
#include "far/parallel.h"
#include "far/refine/refinement.h"
#include "far/refine/uniform.h"

namespace osdx::inline OSDX_ABI {
namespace {

Status check(const SubdivideOptions& options) {
    if (options.degree < kMinDegree || options.degree > kMaxDegree) {
        return fail(ErrorCode::InvalidOption,
                    fmt::format("degree {} is not in {}..{}", options.degree, kMinDegree,
                                kMaxDegree));
    }
    if (options.levels < 0) {
        return fail(ErrorCode::InvalidOption,
                    fmt::format("{} levels are less than none", options.levels));
    }
    return ok();
}

/// Every level has four times the corners of the one before.
Status check_size(const Topology& base, int levels) {
    const double n_corners = base.n_halfedges() * std::pow(4.0, levels);
    if (n_corners < double(kInvalidIndex))
        return ok();
    return fail(ErrorCode::InvalidOption,
                fmt::format("{} levels give {:.0f} face corners, more than {}", levels,
                            n_corners, kInvalidIndex - 1));
}

/// Texture coordinates on the last level, and which of them its corners have.
struct Texture {
    FaceVaryingRule rule = FaceVaryingRule::All;
    std::vector<Vec2<double>> uvs;
    std::vector<Index> face_uvs;
};

/// Linear in each face.
void split_texture(Topology topology, int levels, const UniformRefinement& refinement,
                   Texture& texture) {
    for (int i = 0; i < levels; ++i) {
        const StencilTable rows = split_stencils(topology);
        std::vector<Vec2<double>> next(rows.n_rows());
        rows.apply(std::span<const Vec2<double>>(texture.uvs), std::span(next));
        texture.uvs = std::move(next);
        topology = split(topology);
    }
    for (Index h = 0; h < topology.n_halfedges(); ++h)
        texture.face_uvs[refinement.corner_of_split(h)] = topology.vertex[h];
}

/// \pre the degree is odd
Result<Texture> refine_texture(const MeshData& mesh, const Topology& base,
                               const Features& features,
                               const SubdivideOptions& options) {
    const Result<FaceVaryingRule> rule =
        face_varying_rule(mesh, options.uv_rule, options.features.ignore_tags);
    if (!rule)
        return rule.error();
    Result<FaceVarying> channel =
        build_face_varying(base, features, mesh.face_uvs, *rule);
    if (!channel)
        return channel.error();
    Texture texture{channel->rule, {}, {}};
    for (const Index value : channel->values)
        texture.uvs.push_back(mesh.uvs[value]);
    const UniformRefinement refinement(channel->topology, options.degree, options.levels,
                                       channel->features);
    texture.face_uvs.resize(refinement.n_halfedges());
    if (channel->rule == FaceVaryingRule::All) {
        split_texture(std::move(channel->topology), options.levels, refinement, texture);
        return texture;
    }
    std::vector<Vec2<double>> uvs(refinement.n_vertices());
    refinement.points(std::span<const Vec2<double>>(texture.uvs), std::span(uvs));
    texture.uvs = std::move(uvs);
    std::vector<Index> sizes(refinement.n_faces());
    refinement.faces(sizes, texture.face_uvs);
    return texture;
}

/// All channels by the rules of positions, three numbers of a vertex at a time.
void refine_channels(const std::vector<NamedChannels>& channels,
                     const UniformRefinement& refinement,
                     std::vector<NamedChannels>& fine) {
    struct Source {
        std::size_t channels;
        int k;
    };
    std::vector<Source> all;
    for (std::size_t i = 0; i < channels.size(); ++i) {
        const NamedChannels& c = channels[i];
        fine.push_back({c.name, c.n, {}});
        fine.back().values.resize(static_cast<std::size_t>(c.n) *
                                  refinement.n_vertices());
        for (int k = 0; k < c.n; ++k)
            all.push_back({i, k});
    }
    if (all.empty())
        return;
    std::vector<Vec3<double>> in(refinement.n_base_points()),
        out(refinement.n_vertices());
    for (std::size_t first = 0; first < all.size(); first += 3) {
        const int n = static_cast<int>(std::min<std::size_t>(3, all.size() - first));
        for (int i = 0; i < n; ++i) {
            const auto [c, k] = all[first + static_cast<std::size_t>(i)];
            for (std::size_t v = 0; v < in.size(); ++v)
                in[v][i] = channels[c].view()[v][k];
        }
        refinement.points(std::span<const Vec3<double>>(in), std::span(out));
        for (int i = 0; i < n; ++i) {
            const auto [c, k] = all[first + static_cast<std::size_t>(i)];
            const auto to = osdx::channels(fine[c].values.data(), fine[c].n);
            for (std::size_t v = 0; v < out.size(); ++v)
                to[v][k] = out[v][i];
        }
    }
}

/// The names of the faces that they lie in.
FaceNames refine_names(const FaceNames& names, std::span<const Index> parents) {
    FaceNames fine;
    if (names.faces.empty())
        return fine;
    fine.names = names.names;
    fine.faces.reserve(parents.size());
    for (const Index f : parents)
        fine.faces.push_back(names.faces[f]);
    return fine;
}

void refine_all_names(const MeshData& mesh, const UniformRefinement& refinement,
                      MeshData& fine) {
    if (mesh.groups.faces.empty() && mesh.objects.faces.empty() &&
        mesh.materials.faces.empty())
        return;
    std::vector<Index> parents(refinement.n_faces());
    refinement.parents(parents);
    fine.groups = refine_names(mesh.groups, parents);
    fine.objects = refine_names(mesh.objects, parents);
    fine.materials = refine_names(mesh.materials, parents);
    fine.material_files = mesh.material_files;
}

SubdividedMesh refine(const MeshData& mesh, Topology base, const Features& features,
                      const SubdivideOptions& options) {
    const UniformRefinement refinement(std::move(base), options.degree, options.levels,
                                       features);
    SubdividedMesh result;
    MeshData& data = result.data;
    data.positions.resize(refinement.n_vertices());
    refinement.points(std::span<const Vec3<double>>(mesh.positions),
                      std::span(data.positions));
    data.face_sizes.resize(refinement.n_faces());
    data.face_vertices.resize(refinement.n_halfedges());
    refinement.faces(data.face_sizes, data.face_vertices);
    data.tags = refinement.tags();
    refine_channels(mesh.channels, refinement, data.channels);
    if (options.degree % 2 == 1)
        refine_all_names(mesh, refinement, data);
    result.n_border_edges = refinement.n_border_edges();
    return result;
}

Result<SubdividedMesh> subdivide_now(const MeshData& mesh,
                                     const SubdivideOptions& options) {
    if (const Status s = check(options); !s)
        return s.error();
    detail::at_stage("linking faces", 0, 0.1);
    Result<Topology> base = build_topology(mesh);
    if (!base)
        return base.error();
    const Result<Features> features = build_features(mesh, *base, options.features);
    if (!features)
        return features.error();
    if (const Status s = check_refinement(mesh, *base, *features, options.degree); !s)
        return s.error();
    if (const Status s = check_size(*base, options.levels); !s)
        return s.error();

    detail::at_stage("refining", 0.1, 1);
    std::optional<Texture> texture;
    if (!mesh.face_uvs.empty() && options.degree % 2 == 1) {
        Result<Texture> refined = refine_texture(mesh, *base, *features, options);
        if (!refined)
            return refined.error();
        texture = std::move(*refined);
    }
    SubdividedMesh result = refine(mesh, std::move(*base), *features, options);
    if (texture) {
        result.data.uvs = std::move(texture->uvs);
        result.data.face_uvs = std::move(texture->face_uvs);
        result.data.tags.push_back({"facevaryinginterpolateboundary",
                                    {static_cast<int>(texture->rule)},
                                    {},
                                    {},
                                    0});
    }
    return result;
}

}  // namespace

Result<SubdividedMesh> subdivide(const MeshData& mesh, const SubdivideOptions& options,
                                 Progress* progress) {
    return detail::cancellable(progress, [&] { return subdivide_now(mesh, options); });
}

}  // namespace osdx::inline OSDX_ABI
