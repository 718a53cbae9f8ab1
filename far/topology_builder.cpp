// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>
#include <optional>
#include <span>
#include <vector>

#include "far/buffer.h"
#include "far/parallel.h"
#include "far/topology.h"

namespace osdx {
namespace {

Index line_of(const std::vector<Index>& lines, Index element) {
    return element < lines.size() ? lines[element] : 0;
}

Status check_sizes(const MeshData& data) {
    if (data.positions.empty())
        return fail(ErrorCode::EmptyMesh, "the mesh has no vertices");
    if (data.face_sizes.empty())
        return fail(ErrorCode::EmptyMesh, "the mesh has no faces");
    std::size_t sum = 0;
    for (const Index n : data.face_sizes)
        sum += n;
    if (sum != data.face_vertices.size()) {
        return fail(
            ErrorCode::SizeMismatch,
            fmt::format("the face sizes add up to {}, but there are {} face vertices",
                        sum, data.face_vertices.size()));
    }
    return ok();
}

Status check_positions(const MeshData& data) {
    const Index v = detail::first_index(data.positions.size(), [&](Index i) {
        const auto& p = data.positions[i];
        return !std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z);
    });
    if (v == kInvalidIndex)
        return ok();
    const auto& p = data.positions[v];
    return fail(ErrorCode::NonFinitePoint,
                fmt::format("vertex {} has the position ({}, {}, {})", v, p.x, p.y, p.z),
                v, line_of(data.vertex_lines, v));
}

Status check_face(const MeshData& data, Index face, std::span<const Index> vertices) {
    const Index line = line_of(data.face_lines, face);
    if (vertices.size() < 3) {
        return fail(ErrorCode::FaceTooSmall,
                    fmt::format("face {} has {} vertices", face, vertices.size()), face,
                    line);
    }
    std::vector<Index> sorted(vertices.begin(), vertices.end());
    std::ranges::sort(sorted);
    if (sorted.back() >= data.positions.size()) {
        return fail(ErrorCode::IndexOutOfRange,
                    fmt::format("face {} names vertex {}, but the mesh has {} vertices",
                                face, sorted.back(), data.positions.size()),
                    face, line);
    }
    const auto twice = std::ranges::adjacent_find(sorted);
    if (twice != sorted.end()) {
        return fail(ErrorCode::RepeatedVertex,
                    fmt::format("face {} names vertex {} twice", face, *twice), face,
                    line);
    }
    return ok();
}

Status check_faces(const MeshData& data, const Topology& t) {
    const Index n_vertices = static_cast<Index>(data.positions.size());
    const auto vertices = [&](Index f) {
        return std::span(t.vertex).subspan(t.face_offsets[f], t.face_size(f));
    };
    // Small faces, which most are, without sorting.
    const Index face = detail::first_index(t.n_faces(), [&](Index f) {
        const std::span<const Index> v = vertices(f);
        if (v.size() < 3 || v.size() > 8)
            return !check_face(data, f, v);
        bool bad = false;
        for (std::size_t i = 0; i < v.size(); ++i) {
            bad |= v[i] >= n_vertices;
            for (std::size_t j = 0; j < i; ++j)
                bad |= v[i] == v[j];
        }
        return bad;
    });
    return face == kInvalidIndex ? ok() : check_face(data, face, vertices(face));
}

/// Each number becomes the sum of those up to it.
void add_up(std::vector<Index>& numbers) {
    detail::for_each_numbered(
        numbers.size(), 8 * detail::kChunk,
        [&](std::size_t begin, std::size_t end) {
            return std::accumulate(numbers.begin() + begin, numbers.begin() + end,
                                   std::size_t(0));
        },
        [](std::size_t) {},
        [&](std::size_t sum, std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i)
                numbers[i] = static_cast<Index>(sum += numbers[i]);
        });
}

/// The halfedges by the vertex where they start, sorted by the vertex where they end.
class Outgoing {
public:
    struct Entry {
        Index to, halfedge;
        auto operator<=>(const Entry&) const = default;
    };

    explicit Outgoing(const Topology& t)
        : offsets_(t.n_vertices() + 1, 0), entries_(t.n_halfedges()) {
        const auto counter = [&](Index v) { return std::atomic_ref<Index>(offsets_[v]); };
        detail::for_each_index(t.n_halfedges(), [&](Index h) {
            counter(t.vertex[h]).fetch_add(1, std::memory_order_relaxed);
        });
        // Where the halfedges of each vertex end, then, counting down, where they begin.
        add_up(offsets_);
        detail::for_each_index(t.n_faces(), [&](Index f) {
            Index to = t.vertex[t.face_offsets[f]];
            for (Index h = t.face_offsets[f + 1]; h-- > t.face_offsets[f];) {
                const Index from = t.vertex[h];
                const Index place =
                    counter(from).fetch_sub(1, std::memory_order_relaxed) - 1;
                entries_[place] = {to, h};
                to = from;
            }
        });
        detail::for_each_index(t.n_vertices(), [&](Index v) {
            Entry* const begin = entries_.data() + offsets_[v];
            std::sort(begin, entries_.data() + offsets_[v + 1]);
        });
    }

    std::span<const Entry> of(Index vertex) const {
        return {entries_.data() + offsets_[vertex],
                offsets_[vertex + 1] - offsets_[vertex]};
    }

    /// The halfedge between two vertices, kInvalidIndex if there is none.
    Index find(Index from, Index to) const {
        const std::span<const Entry> all = of(from);
        const auto found = std::ranges::lower_bound(all, to, {}, &Entry::to);
        return found != all.end() && found->to == to ? found->halfedge : kInvalidIndex;
    }

private:
    std::vector<Index> offsets_;
    Buffer<Entry> entries_;
};

/// An edge has at most two faces, which run along it in opposite directions: so from one
/// vertex to another there is one halfedge at most.
Status check_edges(const MeshData& data, const Topology& t, const Outgoing& outgoing) {
    const auto same_end = [](const Outgoing::Entry& a, const Outgoing::Entry& b) {
        return a.to == b.to;
    };
    if (detail::first_index(t.n_vertices(), [&](Index v) {
            const auto all = outgoing.of(v);
            return std::ranges::adjacent_find(all, same_end) != all.end();
        }) == kInvalidIndex)
        return ok();

    // Of all edges at fault the first one by its vertices, the lower vertex before.
    std::pair<Index, Index> edge{kInvalidIndex, kInvalidIndex};
    for (Index v = 0; v < t.n_vertices(); ++v) {
        const auto all = outgoing.of(v);
        for (auto a = std::ranges::adjacent_find(all, same_end); a != all.end();
             a = std::adjacent_find(a + 1, all.end(), same_end))
            edge = std::min(edge, {std::min(v, a->to), std::max(v, a->to)});
    }
    std::vector<Index> halfedges;
    const auto collect = [&](Index from, Index to) {
        for (const Outgoing::Entry& e : outgoing.of(from)) {
            if (e.to == to)
                halfedges.push_back(e.halfedge);
        }
    };
    collect(edge.first, edge.second);
    collect(edge.second, edge.first);
    std::ranges::sort(halfedges);
    if (halfedges.size() > 2) {
        const Index f = t.face[halfedges[2]];
        return fail(ErrorCode::NonManifoldEdge,
                    fmt::format("face {} is number 3 of {} at the edge of vertices {} "
                                "and {}",
                                f, halfedges.size(), edge.first, edge.second),
                    f, line_of(data.face_lines, f));
    }
    const Index a = halfedges[0], f = t.face[halfedges[1]];
    return fail(ErrorCode::OppositeFaces,
                fmt::format("face {} and face {} have opposite orientations: both run "
                            "from vertex {} to {}",
                            f, t.face[a], t.vertex[a], t.to_vertex(a)),
                f, line_of(data.face_lines, f));
}

void link_twins(Topology& t, const Outgoing& outgoing) {
    t.twin.assign(t.n_halfedges(), kInvalidIndex);
    detail::for_each_index(t.n_vertices(), [&](Index v) {
        for (const auto [to, h] : outgoing.of(v)) {
            if (v > to)
                continue;
            const Index twin = outgoing.find(to, v);
            if (twin == kInvalidIndex)
                continue;
            t.twin[h] = twin;
            t.twin[twin] = h;
        }
    });
}

/// Edges are numbered by the lower of their halfedges.
void number_edges(Topology& t) {
    t.edge.resize(t.n_halfedges());
    const auto is_first = [&](std::size_t h) { return h < t.twin[h]; };
    detail::for_each_numbered(
        t.n_halfedges(), detail::kChunk,
        [&](std::size_t begin, std::size_t end) {
            std::size_t n = 0;
            for (std::size_t h = begin; h < end; ++h)
                n += is_first(h);
            return n;
        },
        [&](std::size_t n) { t.n_edges = static_cast<Index>(n); },
        [&](std::size_t next, std::size_t begin, std::size_t end) {
            for (std::size_t h = begin; h < end; ++h) {
                if (!is_first(h))
                    continue;
                t.edge[h] = static_cast<Index>(next++);
                if (t.twin[h] != kInvalidIndex)
                    t.edge[t.twin[h]] = t.edge[h];
            }
        });
}

/// Names a halfedge for each vertex and checks that all others are in the same fan.
Status link_vertices(const MeshData& data, Topology& t, const Outgoing& outgoing) {
    const Index bad = detail::first_index(t.n_vertices(), [&](Index v) {
        const auto all = outgoing.of(v);
        Index first = kInvalidIndex;
        bool border = false;
        for (const auto [to, h] : all) {
            if (border == t.is_border(h) ? h < first : !border) {
                first = h;
                border = t.is_border(h);
            }
        }
        t.vertex_halfedge[v] = first;
        return t.valence(v) != all.size();
    });
    if (bad == kInvalidIndex)
        return ok();
    return fail(ErrorCode::NonManifoldVertex,
                fmt::format("vertex {} joins two separate fans of faces", bad), bad,
                line_of(data.vertex_lines, bad));
}

}  // namespace

Status check_uvs(const MeshData& mesh) {
    if (mesh.face_uvs.empty())
        return ok();
    if (mesh.face_uvs.size() != mesh.face_vertices.size()) {
        return fail(
            ErrorCode::SizeMismatch,
            fmt::format("there are texture coordinates for {} face corners, but {} are "
                        "there",
                        mesh.face_uvs.size(), mesh.face_vertices.size()));
    }
    const auto is_sound = [&](Index uv) {
        return uv < mesh.uvs.size() && std::isfinite(mesh.uvs[uv].x) &&
               std::isfinite(mesh.uvs[uv].y);
    };
    Index corner = detail::first_index(
        mesh.face_uvs.size(), [&](Index c) { return !is_sound(mesh.face_uvs[c]); });
    if (corner == kInvalidIndex)
        return ok();
    const Index i = mesh.face_uvs[corner];
    Index face = 0;
    while (corner >= mesh.face_sizes[face])
        corner -= mesh.face_sizes[face++];
    const Index line = line_of(mesh.face_lines, face);
    if (i >= mesh.uvs.size()) {
        return fail(
            ErrorCode::IndexOutOfRange,
            fmt::format("face {} names texture coordinate {}, but the mesh has {}", face,
                        i, mesh.uvs.size()),
            face, line);
    }
    return fail(ErrorCode::NonFinitePoint,
                fmt::format("face {} names texture coordinate {}, which is ({}, {})",
                            face, i, mesh.uvs[i].x, mesh.uvs[i].y),
                face, line);
}

Result<Topology> build_topology(const MeshData& data) {
    if (const Status s = check_sizes(data); !s)
        return s.error();
    if (const Status s = check_positions(data); !s)
        return s.error();
    Topology t;
    t.vertex = data.face_vertices;
    t.face_offsets.resize(data.face_sizes.size() + 1);
    std::ranges::copy(data.face_sizes, t.face_offsets.begin() + 1);
    add_up(t.face_offsets);
    if (const Status s = check_faces(data, t); !s)
        return s.error();
    if (const Status s = check_uvs(data); !s)
        return s.error();
    t.quads_only = has_only_quads(t);
    t.face.resize(t.vertex.size());
    detail::for_each_index(t.n_faces(), [&](Index f) {
        std::fill(t.face.begin() + t.face_offsets[f],
                  t.face.begin() + t.face_offsets[f + 1], f);
    });
    t.vertex_halfedge.resize(data.positions.size());
    const Outgoing outgoing(t);
    if (const Status s = check_edges(data, t, outgoing); !s)
        return s.error();
    link_twins(t, outgoing);
    if (const Status s = link_vertices(data, t, outgoing); !s)
        return s.error();
    number_edges(t);
    return t;
}

}  // namespace osdx
