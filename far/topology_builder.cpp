// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

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

/// Each number becomes the sum of those up to it.
void add_up(std::span<Index> numbers) {
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

/// Copies the faces and finds the twins of their halfedges.
///
/// Halfedges are sorted by the lower one of their vertices, first into blocks of vertices, each
/// chunk of faces into places of its own, then each block for itself: no thread waits for
/// another, and what a block reads fits into the cache.
class Linker {
public:
    Linker(const MeshData& data, Topology& topology) : data_(data), t_(topology) {
        // Not above some number, for there are that many counters of each chunk and block.
        const std::size_t n_faces = data.face_sizes.size();
        chunk_ = std::max(n_faces / 256, detail::kSmallChunk);
        const std::size_t n_vertices = data.positions.size();
        while (n_vertices >> shift_ > 256)
            ++shift_;
        n_blocks_ = detail::n_chunks(n_vertices, std::size_t(1) << shift_);
    }

    Status copy_faces() {
        number_halfedges();
        const Index n_vertices = static_cast<Index>(data_.positions.size());
        for (auto* array : {&t_.vertex, &t_.face, &t_.twin})
            array->resize(data_.face_vertices.size());
        t_.vertex_halfedge = detail::filled(n_vertices, kInvalidIndex);
        places_.resize(detail::n_chunks(t_.n_faces(), chunk_) * n_blocks_);
        std::atomic<Index> first_bad = kInvalidIndex;
        detail::for_each_chunk(
            t_.n_faces(), chunk_,
            [&](std::size_t chunk, std::size_t begin, std::size_t end) {
                std::size_t* const counts = &places_[chunk * n_blocks_];
                for (auto f = static_cast<Index>(begin); f < end; ++f) {
                    const std::span<const Index> v = vertices(f);
                    if (!is_sound(v, n_vertices)) {
                        detail::lower(first_bad, f);
                        return;
                    }
                    Index h = t_.face_offsets[f], before = v.back();
                    for (const Index vertex : v) {
                        t_.vertex[h] = vertex;
                        t_.face[h] = f;
                        ++counts[std::min(before, vertex) >> shift_];
                        before = vertex;
                        // Any one will do.
                        std::atomic_ref(t_.vertex_halfedge[vertex])
                            .store(h++, std::memory_order_relaxed);
                    }
                }
            });
        return first_bad == kInvalidIndex
                   ? ok()
                   : check_face(data_, first_bad, vertices(first_bad));
    }

    /// An edge has at most two faces, which run along it in opposite directions.
    /// \pre copy_faces() was ok
    Status link_twins() {
        const std::vector<std::size_t> blocks = sort_into_blocks();
        std::vector<std::pair<Index, Index>> bad(n_blocks_, kNoEdge);
        detail::for_each_chunk(
            n_blocks_, 1, [&](std::size_t block, std::size_t, std::size_t) {
                bad[block] = link_block(block, blocks[block], blocks[block + 1]);
            });
        const auto first = std::ranges::min(bad);
        return first == kNoEdge ? ok() : refuse_edge(first);
    }

private:
    struct Side {
        Index low, high, halfedge;  // the lower and the higher vertex of its edge
    };
    struct End {
        Index high, halfedge;
        auto operator<=>(const End&) const = default;
    };
    static constexpr std::pair<Index, Index> kNoEdge{kInvalidIndex, kInvalidIndex};

    std::span<const Index> vertices(Index f) const {
        return std::span(data_.face_vertices)
            .subspan(t_.face_offsets[f], t_.face_size(f));
    }

    void number_halfedges() {
        const auto& sizes = data_.face_sizes;
        t_.face_offsets.resize(sizes.size() + 1);
        t_.face_offsets[0] = 0;
        detail::for_each_chunk(sizes.size(), detail::kChunk,
                               [&](std::size_t, std::size_t begin, std::size_t end) {
                                   std::copy(sizes.begin() + begin, sizes.begin() + end,
                                             t_.face_offsets.begin() + begin + 1);
                               });
        add_up(t_.face_offsets);
        t_.quads_only = has_only_quads(t_);
    }

    static bool is_sound(std::span<const Index> v, Index n_vertices) {
        // Small faces, which most are, without sorting.
        if (v.size() < 3)
            return false;
        bool bad = false;
        for (const Index i : v)
            bad |= i >= n_vertices;
        if (v.size() > 8) {
            std::vector<Index> sorted(v.begin(), v.end());
            std::ranges::sort(sorted);
            return !bad && std::ranges::adjacent_find(sorted) == sorted.end();
        }
        for (std::size_t i = 1; i < v.size(); ++i) {
            for (std::size_t j = 0; j < i; ++j)
                bad |= v[i] == v[j];
        }
        return !bad;
    }

    /// \return where each block begins, and the end
    std::vector<std::size_t> sort_into_blocks() {
        const std::size_t n_chunks = detail::n_chunks(t_.n_faces(), chunk_);
        std::vector<std::size_t> blocks(n_blocks_ + 1);
        std::size_t sum = 0;
        for (std::size_t block = 0; block < n_blocks_; ++block) {
            blocks[block] = sum;
            for (std::size_t chunk = 0; chunk < n_chunks; ++chunk)
                sum += std::exchange(places_[chunk * n_blocks_ + block], sum);
        }
        blocks[n_blocks_] = sum;
        sides_.resize(sum);
        detail::for_each_chunk(
            t_.n_faces(), chunk_,
            [&](std::size_t chunk, std::size_t begin, std::size_t end) {
                std::size_t* const places = &places_[chunk * n_blocks_];
                for (std::size_t f = begin; f < end; ++f) {
                    const Index first = t_.face_offsets[f];
                    Index to = t_.vertex[first];
                    for (Index h = t_.face_offsets[f + 1]; h-- > first;) {
                        const Index from = t_.vertex[h], low = std::min(from, to);
                        sides_[places[low >> shift_]++] = {low, std::max(from, to), h};
                        to = from;
                    }
                }
            });
        return blocks;
    }

    /// \return the first edge at fault
    std::pair<Index, Index> link_block(std::size_t block, std::size_t begin,
                                       std::size_t end) {
        const Index first = static_cast<Index>(block << shift_);
        const std::span<const Side> sides(&sides_[0] + begin, end - begin);
        std::vector<Index> ends(std::size_t(1)
                                << shift_);  // of the lists of the vertices
        for (const Side& s : sides)
            ++ends[s.low - first];
        std::inclusive_scan(ends.begin(), ends.end(), ends.begin());
        Buffer<End> lists(sides.size());
        for (const Side& s : sides)
            lists[--ends[s.low - first]] = {s.high, s.halfedge};
        // They are the beginnings by now.
        for (std::size_t i = 0; i < ends.size(); ++i) {
            const Index list_end =
                i + 1 < ends.size() ? ends[i + 1] : static_cast<Index>(lists.size());
            const std::span<End> list(lists.data() + ends[i], list_end - ends[i]);
            std::ranges::sort(list);
            for (std::size_t k = 0; k < list.size();) {
                const End a = list[k++];
                if (k == list.size() || list[k].high != a.high) {
                    t_.twin[a.halfedge] = kInvalidIndex;
                    continue;
                }
                const End b = list[k++];
                t_.twin[a.halfedge] = b.halfedge;
                t_.twin[b.halfedge] = a.halfedge;
                if (t_.vertex[a.halfedge] == t_.vertex[b.halfedge] ||
                    (k < list.size() && list[k].high == a.high))
                    return {first + static_cast<Index>(i), a.high};
            }
        }
        return kNoEdge;
    }

    Status refuse_edge(std::pair<Index, Index> edge) const {
        std::vector<Index> halfedges;
        for (const Side& s : sides_) {
            if (s.low == edge.first && s.high == edge.second)
                halfedges.push_back(s.halfedge);
        }
        std::ranges::sort(halfedges);
        if (halfedges.size() > 2) {
            const Index f = t_.face[halfedges[2]];
            return fail(
                ErrorCode::NonManifoldEdge,
                fmt::format("face {} is number 3 of {} at the edge of vertices {} "
                            "and {}",
                            f, halfedges.size(), edge.first, edge.second),
                f, line_of(data_.face_lines, f));
        }
        const Index a = halfedges[0], f = t_.face[halfedges[1]];
        return fail(
            ErrorCode::OppositeFaces,
            fmt::format("face {} and face {} have opposite orientations: both run "
                        "from vertex {} to {}",
                        f, t_.face[a], t_.vertex[a], t_.to_vertex(a)),
            f, line_of(data_.face_lines, f));
    }

    const MeshData& data_;
    Topology& t_;
    std::size_t chunk_, n_blocks_;     // faces in a chunk
    int shift_ = 8;                    // a block has 1 << shift_ vertices
    std::vector<std::size_t> places_;  // by chunk and block
    Buffer<Side> sides_;
};

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

/// Names the lowest halfedge of each vertex, or the border's, and checks that all others are in
/// the same fan.
/// \pre vertex_halfedge names any one
Status link_vertices(const MeshData& data, Topology& t) {
    std::atomic<std::size_t> n_halfedges = 0;
    detail::for_each_chunk(t.n_vertices(), detail::kSmallChunk,
                           [&](std::size_t, std::size_t begin, std::size_t end) {
                               std::size_t n = 0;
                               for (auto v = static_cast<Index>(begin); v < end; ++v) {
                                   const Index any = t.vertex_halfedge[v];
                                   if (any == kInvalidIndex)
                                       continue;
                                   Index first = any, h = any;
                                   do {
                                       ++n;
                                       first = std::min(first, h);
                                       h = t.ccw(h);
                                   } while (h != any && h != kInvalidIndex);
                                   if (h == kInvalidIndex) {
                                       for (first = any; !t.is_border(first); ++n)
                                           first = t.next(t.twin[first]);
                                   }
                                   t.vertex_halfedge[v] = first;
                               }
                               n_halfedges.fetch_add(n, std::memory_order_relaxed);
                           });
    if (n_halfedges == t.n_halfedges())
        return ok();
    std::vector<Index> n_outgoing(t.n_vertices());
    for (const Index v : t.vertex)
        ++n_outgoing[v];
    Index bad = 0;
    while (t.valence(bad) == n_outgoing[bad])
        ++bad;
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
    Linker linker(data, t);
    if (const Status s = linker.copy_faces(); !s)
        return s.error();
    if (const Status s = check_uvs(data); !s)
        return s.error();
    if (const Status s = linker.link_twins(); !s)
        return s.error();
    if (const Status s = link_vertices(data, t); !s)
        return s.error();
    number_edges(t);
    return t;
}

}  // namespace osdx
