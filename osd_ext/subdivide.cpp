// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <cmath>
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
