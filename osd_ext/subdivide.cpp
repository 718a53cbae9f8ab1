// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <osdx/buffer.h>
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

/// Number k of each vertex of one of several channels.
struct Source {
    std::size_t channels;
    int k;
};

/// As many as V has, or fewer.
template <class V>
void refine_some(std::span<const Source> some, std::span<const NamedChannels> channels,
                 const UniformRefinement& refinement, std::vector<NamedChannels>& fine) {
    std::vector<V> in(refinement.n_base_points());
    Buffer<V> out(refinement.n_vertices());
    for (int i = 0; i < static_cast<int>(some.size()); ++i) {
        const auto [c, k] = some[static_cast<std::size_t>(i)];
        for (std::size_t v = 0; v < in.size(); ++v)
            in[v][i] = channels[c].view()[v][k];
    }
    refinement.points(std::span<const V>(in), std::span<V>(out));
    for (int i = 0; i < static_cast<int>(some.size()); ++i) {
        const auto [c, k] = some[static_cast<std::size_t>(i)];
        const auto to = osdx::channels(fine[c].values.data(), fine[c].n);
        for (std::size_t v = 0; v < out.size(); ++v)
            to[v][k] = out[v][i];
    }
}

/// All channels by the rules of positions, three numbers of a vertex at a time.
std::vector<NamedChannels> refine_channels(std::span<const NamedChannels> channels,
                                           const UniformRefinement& refinement) {
    std::vector<NamedChannels> fine;
    std::vector<Source> all;
    for (std::size_t i = 0; i < channels.size(); ++i) {
        const NamedChannels& c = channels[i];
        fine.push_back({c.name, c.n, {}});
        fine.back().values.resize(static_cast<std::size_t>(c.n) *
                                  refinement.n_vertices());
        for (int k = 0; k < c.n; ++k)
            all.push_back({i, k});
    }
    for (std::size_t first = 0; first < all.size(); first += 3) {
        const auto some = std::span<const Source>(all).subspan(
            first, std::min<std::size_t>(3, all.size() - first));
        if (some.size() == 3)
            refine_some<Vec3<double>>(some, channels, refinement, fine);
        else
            refine_some<Vec2<double>>(some, channels, refinement, fine);
    }
    return fine;
}

/// Linear in each face.
/// \param fine  has the values of the vertices of the topology
void split_values(Topology topology, int levels, const UniformRefinement& refinement,
                  FaceVaryingChannels& fine) {
    for (int i = 0; i < levels; ++i) {
        const StencilTable rows = split_stencils(topology);
        const std::size_t n_before = fine.values.size();
        const Index first = topology.n_vertices();
        fine.values.resize(n_before +
                           std::size_t(rows.n_rows()) * static_cast<std::size_t>(fine.n));
        rows.extend<double>(first, fine.n, fine.values);
        fine.values.erase(fine.values.begin(),
                          fine.values.begin() + static_cast<std::ptrdiff_t>(n_before));
        topology = split(topology);
    }
    for (Index h = 0; h < topology.n_halfedges(); ++h)
        fine.corner_values[refinement.corner_of_split(h)] = topology.vertex[h];
}

/// By the rule of the channels.
/// \pre the degree is odd
Result<FaceVaryingChannels> refine_face_varying(const FaceVaryingChannels& coarse,
                                                const Topology& base,
                                                const Features& features,
                                                const SubdivideOptions& options) {
    Result<FaceVarying> channel =
        build_face_varying(base, features, coarse.corner_values, coarse.rule);
    if (!channel)
        return channel.error();
    FaceVaryingChannels fine;
    fine.name = coarse.name;
    fine.n = coarse.n;
    fine.rule = coarse.rule;
    for (const Index value : channel->values) {
        const double* of = coarse.view()[value];
        fine.values.insert(fine.values.end(), of, of + coarse.n);
    }
    const UniformRefinement refinement(channel->topology, options.degree, options.levels,
                                       channel->features);
    fine.corner_values.resize(refinement.n_halfedges());
    if (fine.rule == FaceVaryingRule::All) {
        split_values(std::move(channel->topology), options.levels, refinement, fine);
        return fine;
    }
    const NamedChannels* of_vertices = &fine;
    fine.values = std::move(refine_channels({of_vertices, 1}, refinement).front().values);
    std::vector<Index> sizes(refinement.n_faces());
    refinement.faces(sizes, fine.corner_values);
    return fine;
}

/// The texture coordinates by the rule that is asked for.
Result<FaceVaryingChannels> texture_channels(const MeshData& mesh,
                                             const SubdivideOptions& options) {
    const Result<FaceVaryingRule> rule =
        face_varying_rule(mesh, options.uv_rule, options.features.ignore_tags);
    if (!rule)
        return rule.error();
    FaceVaryingChannels texture;
    texture.n = 2;
    texture.rule = *rule;
    texture.corner_values = mesh.face_uvs;
    for (const Vec2<double>& uv : mesh.uvs)
        texture.values.insert(texture.values.end(), {uv.x, uv.y});
    return texture;
}

void set_texture(const FaceVaryingChannels& texture, MeshData& data) {
    for (Index i = 0; i < texture.n_values(); ++i)
        data.uvs.emplace_back(texture.view()[i][0], texture.view()[i][1]);
    data.face_uvs = texture.corner_values;
    data.tags.push_back(
        {"facevaryinginterpolateboundary", {static_cast<int>(texture.rule)}, {}, {}, 0});
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
    data.channels = refine_channels(mesh.channels, refinement);
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
    const bool odd = options.degree % 2 == 1;
    std::optional<FaceVaryingChannels> texture;
    std::vector<FaceVaryingChannels> face_varying;
    if (!mesh.face_uvs.empty() && odd) {
        const Result<FaceVaryingChannels> coarse = texture_channels(mesh, options);
        if (!coarse)
            return coarse.error();
        Result<FaceVaryingChannels> fine =
            refine_face_varying(*coarse, *base, *features, options);
        if (!fine)
            return fine.error();
        texture = std::move(*fine);
    }
    for (std::size_t i = 0; odd && i < mesh.face_varying.size(); ++i) {
        Result<FaceVaryingChannels> fine =
            refine_face_varying(mesh.face_varying[i], *base, *features, options);
        if (!fine)
            return fine.error();
        face_varying.push_back(std::move(*fine));
    }
    SubdividedMesh result = refine(mesh, std::move(*base), *features, options);
    result.data.face_varying = std::move(face_varying);
    if (texture)
        set_texture(*texture, result.data);
    return result;
}

}  // namespace

Result<SubdividedMesh> subdivide(const MeshData& mesh, const SubdivideOptions& options,
                                 Progress* progress) {
    return detail::cancellable(progress, [&] { return subdivide_now(mesh, options); });
}

}  // namespace osdx::inline OSDX_ABI
