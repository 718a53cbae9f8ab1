// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <compare>
#include <cstdint>
#include <numeric>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <osdx/build_topology.h>
#include <osdx/face_varying.h>

#include "far/mesh/position_range.h"
#include "far/parallel.h"

namespace osdx::inline OSDX_ABI {
namespace {

Status check_sizes(const MeshView& data) {
    if (data.n_vertices == 0)
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
    if (std::max<std::size_t>(sum, data.face_sizes.size()) >= kInvalidIndex) {
        return fail(ErrorCode::IndexOutOfRange,
                    fmt::format("the mesh has {} face corners, more than {}", sum,
                                kInvalidIndex - 1));
    }
    return ok();
}

Status check_positions(const MeshData& data) {
    const MeshView view = data.view();
    return detail::check_range(
        channels(data.positions.data()), data.positions.size(), [](Index v) { return v; },
        [&](Index v) { return view.line_of_vertex(v); });
}

Status check_face(const MeshView& data, Index face, std::span<const Index> vertices) {
    const Index line = data.line_of_face(face);
    if (vertices.size() < 3) {
        return fail(ErrorCode::FaceTooSmall,
                    fmt::format("face {} has {} vertices", face, vertices.size()), face,
                    line);
    }
    std::vector<Index> sorted(vertices.begin(), vertices.end());
    std::ranges::sort(sorted);
    if (sorted.back() >= data.n_vertices) {
        return fail(ErrorCode::IndexOutOfRange,
                    fmt::format("face {} names vertex {}, but the mesh has {} vertices",
                                face, sorted.back(), data.n_vertices),
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

/// Halfedges by the two vertices of their edges, with open addressing: the first one of an edge
/// waits here for the second one.
class EdgeTable {
public:
    /// Empty again, with room for so many halfedges.
    void reset(std::size_t n) {
        // Mostly empty, so that hardly ever two edges ask for the same slot.
        const std::size_t n_slots = std::bit_ceil(8 * n);
        shift_ = 64 - std::countr_zero(n_slots);
        slots_.assign(n_slots, kInvalidIndex);
    }

    /// Writes the twins of a halfedge and of the one that it meets, if there is one.
    /// \return false for the third halfedge of an edge, and for one that runs as the first does
    template <bool kQuadsOnly>
    bool add(Index h, Topology& t) {
        const auto end_of = [&t](Index g) {
            return t.vertex[kQuadsOnly ? (g & ~Index(3)) | ((g + 1) & 3) : t.next(g)];
        };
        const Index from = t.vertex[h], to = end_of(h);
        const std::uint64_t edge =
            std::uint64_t(std::min(from, to)) << 32 | std::max(from, to);
        std::size_t slot = edge * kMix >> shift_;
        Index first;
        bool is_twin;
        while (true) {
            first = slots_[slot];
            const bool is_new = first == kInvalidIndex;
            first = is_new ? h : first;
            const Index a = t.vertex[first], b = end_of(first);
            // Half of the halfedges find a twin, which processors cannot foresee: no branch.
            is_twin = (a == to) & (b == from);
            if (is_new | is_twin)
                break;
            if (a == from && b == to)
                return false;
            slot = (slot + 1) & (slots_.size() - 1);
        }
        slots_[slot] = first;
        if (is_twin && t.twin[first] != kInvalidIndex)
            return false;
        t.twin[h] = is_twin ? first : kInvalidIndex;
        t.twin[first] = is_twin ? h : kInvalidIndex;
        return true;
    }

private:
    static constexpr std::uint64_t kMix =
        0x9e3779b97f4a7c15u;  // 2^64 over the golden ratio

    int shift_ = 0;
    std::vector<Index> slots_;
};

/// Copies the faces and finds the twins of their halfedges.
///
/// Faces next to each other in the mesh are mostly next to each other in the file, so that each
/// chunk of them pairs its own halfedges and links the vertices inside first, without leaving
/// the cache. What is left over, as a rule little, is sorted into blocks of vertices, and each
/// block pairs its own.
///
/// Edges of more than two sides are not found where chunks see two of them each. But then a fan
/// with faces of several chunks has the same edge twice, and such fans are looked at.
class Linker {
public:
    Linker(const MeshView& data, Topology& topology)
        : data_(data),
          t_(topology),
          chunk_(std::clamp<std::size_t>(data.face_sizes.size() / 32, 256, 2048)) {}

    Status copy_faces() {
        number_halfedges();
        const std::size_t n_halfedges = data_.face_vertices.size();
        t_.vertex.resize(n_halfedges);
        t_.twin.resize(n_halfedges);
        if (!t_.quads_only)
            t_.faces.resize(n_halfedges);
        t_.vertex_halfedge = detail::filled(data_.n_vertices, kInvalidIndex);
        t_.valences = detail::filled(data_.n_vertices, std::uint8_t(0));
        const Index bad = t_.quads_only ? copy<4>() : copy<0>();
        return bad == kInvalidIndex ? ok() : check_face(data_, bad, vertices(bad));
    }

    /// An edge has at most two faces, which run along it in opposite directions; the faces at a
    /// vertex are one fan.
    /// Edges are numbered by the lower of their halfedges.
    /// \pre copy_faces() was ok
    Status link() {
        if (pair_chunks() && pair_rest()) {
            bool sound;
            detail::in_parallel([&] { sound = link_vertices(); },
                                [&] { number_edges(); });
            if (sound)
                return ok();
        }
        const Status edges = check_edges();
        return edges ? check_vertices() : edges;
    }

private:
    std::span<const Index> vertices(Index f) const {
        return data_.face_vertices.subspan(t_.face_offsets[f], t_.face_size(f));
    }

    void number_halfedges() {
        const auto& sizes = data_.face_sizes;
        t_.quads_only = detail::first_index(sizes.size(), [&](Index f) {
                            return sizes[f] != 4;
                        }) == kInvalidIndex;
        t_.face_offsets.resize(sizes.size() + 1);
        t_.face_offsets[0] = 0;
        detail::for_each_index(sizes.size(), [&](Index f) {
            t_.face_offsets[f + 1] = t_.quads_only ? 4 * (f + 1) : sizes[f];
        });
        if (!t_.quads_only)
            add_up(t_.face_offsets);
    }

    /// \tparam kCorners  of all faces, or 0
    /// \return the first face that is not sound
    template <int kCorners>
    Index copy() {
        const Index n_vertices = data_.n_vertices;
        std::atomic<Index> first_bad = kInvalidIndex;
        detail::for_each_chunk(
            t_.n_faces(), chunk_, [&](std::size_t, std::size_t begin, std::size_t end) {
                for (auto f = static_cast<Index>(begin); f < end; ++f) {
                    const std::span<const Index> v = vertices(f);
                    const std::size_t n = kCorners > 0 ? kCorners : v.size();
                    if (!is_sound(v.first(n), n_vertices)) {
                        detail::lower(first_bad, f);
                        return;
                    }
                    Index h = t_.face_offsets[f];
                    for (std::size_t k = 0; k < n; ++k, ++h) {
                        t_.vertex[h] = v[k];
                        if (kCorners == 0)
                            t_.faces[h] = f;
                        // Any one will do.
                        std::atomic_ref(t_.vertex_halfedge[v[k]])
                            .store(h, std::memory_order_relaxed);
                    }
                }
            });
        return first_bad;
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

    /// \param at  at(i): one of n halfedges
    /// \return whether all of them are sound
    template <class At>
    bool add_all(EdgeTable& table, std::size_t n, At&& at) {
        bool all = true;
        if (t_.quads_only) {
            for (std::size_t i = 0; i < n; ++i)
                all &= table.add<true>(at(i), t_);
        } else {
            for (std::size_t i = 0; i < n; ++i)
                all &= table.add<false>(at(i), t_);
        }
        return all;
    }

    bool pair_chunks() {
        const std::size_t n_chunks = detail::n_chunks(t_.n_faces(), chunk_);
        left_over_.resize(n_chunks);
        std::atomic<bool> sound = true;
        struct Scratch {
            EdgeTable table;
            Buffer<Index> picked;
        };
        detail::PerThread<Scratch> scratch;
        detail::for_each_chunk(
            t_.n_faces(), chunk_,
            [&](std::size_t chunk, std::size_t begin, std::size_t end) {
                const Index first = t_.face_offsets[begin], last = t_.face_offsets[end];
                EdgeTable& table = scratch.local().table;
                Buffer<Index>& picked = scratch.local().picked;
                table.reset(last - first);
                picked.resize(last - first);
                const auto halfedge = [&](std::size_t i) {
                    return first + static_cast<Index>(i);
                };
                if (!add_all(table, last - first, halfedge)) {
                    sound.store(false, std::memory_order_relaxed);
                    return;
                }
                // Without branches, which processors could not foresee.
                const auto pick = [&](auto&& is) {
                    Index n = 0;
                    for (Index h = first; h < last; ++h) {
                        picked[n] = h;
                        n += is(h);
                    }
                    return std::span<const Index>(picked.data(), n);
                };
                auto& [halfedges, vertices] = left_over_[chunk];
                const auto unpaired = pick([&](Index h) { return t_.is_border(h); });
                halfedges.assign(unpaired.begin(), unpaired.end());
                std::size_t n_linked = 0;
                for (const Index h : pick([&](Index h) { return names_vertex(h); })) {
                    const Index n = link_closed_fan(h);
                    n_linked += n;
                    if (n == 0)
                        vertices.push_back(t_.vertex[h]);
                }
                n_linked_.fetch_add(n_linked, std::memory_order_relaxed);
            });
        detail::for_each_numbered(
            n_chunks, 64,
            [&](std::size_t begin, std::size_t end) {
                std::size_t n = 0;
                for (std::size_t c = begin; c < end; ++c)
                    n += left_over_[c].halfedges.size();
                return n;
            },
            [&](std::size_t n) { rest_.resize(n); },
            [&](std::size_t next, std::size_t begin, std::size_t end) {
                for (std::size_t c = begin; c < end; ++c) {
                    std::ranges::copy(left_over_[c].halfedges, rest_.begin() + next);
                    next += left_over_[c].halfedges.size();
                }
            });
        return sound;
    }

    bool pair_rest() {
        // Not above some number, for there are that many counters of each chunk and block.
        const std::size_t size = std::max(rest_.size() / 256, detail::kChunk),
                          n_chunks = detail::n_chunks(rest_.size(), size);
        const Index n_vertices = t_.n_vertices();
        const std::size_t n_blocks = std::clamp<std::size_t>(rest_.size() / 1024, 1, 256);
        const auto block_of = [&](Index h) {
            const Index low = std::min(t_.vertex[h], t_.to_vertex(h));
            return std::size_t(low) * n_blocks / n_vertices;
        };
        std::vector<std::size_t> places(n_chunks * n_blocks), ends(n_blocks);
        detail::for_each_chunk(
            rest_.size(), size,
            [&](std::size_t chunk, std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i)
                    ++places[chunk * n_blocks + block_of(rest_[i])];
            });
        std::size_t sum = 0;
        for (std::size_t block = 0; block < n_blocks; ++block) {
            for (std::size_t chunk = 0; chunk < n_chunks; ++chunk)
                sum += std::exchange(places[chunk * n_blocks + block], sum);
            ends[block] = sum;
        }
        Buffer<Index> sorted(rest_.size());
        detail::for_each_chunk(
            rest_.size(), size,
            [&](std::size_t chunk, std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i)
                    sorted[places[chunk * n_blocks + block_of(rest_[i])]++] = rest_[i];
            });
        std::atomic<bool> sound = true;
        detail::for_each_chunk(
            n_blocks, 1, [&](std::size_t block, std::size_t, std::size_t) {
                const std::size_t begin = block > 0 ? ends[block - 1] : 0;
                EdgeTable table;
                table.reset(ends[block] - begin);
                const auto halfedge = [&](std::size_t i) { return sorted[begin + i]; };
                if (!add_all(table, ends[block] - begin, halfedge))
                    sound.store(false, std::memory_order_relaxed);
            });
        return sound;
    }

    /// Edges are numbered by the lower of their halfedges.
    void number_edges() {
        t_.edge.resize(t_.n_halfedges());
        const auto is_first = [&](Index h) { return h < t_.twin[h]; };
        detail::for_each_numbered(
            t_.n_faces(), chunk_,
            [&](std::size_t begin, std::size_t end) {
                // Of those that chunks have paired every other one.
                const auto& rest = left_over_[begin / chunk_].halfedges;
                const std::size_t n_paired =
                    t_.face_offsets[end] - t_.face_offsets[begin] - rest.size();
                return n_paired / 2 + std::ranges::count_if(rest, is_first);
            },
            [&](std::size_t n) { t_.n_edges = static_cast<Index>(n); },
            [&](std::size_t next, std::size_t begin, std::size_t end) {
                for (Index h = t_.face_offsets[begin]; h < t_.face_offsets[end]; ++h) {
                    if (!is_first(h))
                        continue;
                    t_.edge[h] = static_cast<Index>(next++);
                    if (t_.twin[h] != kInvalidIndex)
                        t_.edge[t_.twin[h]] = t_.edge[h];
                }
            });
    }

    /// Whether it is the one that copy() left to its vertex.
    bool names_vertex(Index h) {
        // Other chunks may be at this vertex.
        return std::atomic_ref(t_.vertex_halfedge[t_.vertex[h]])
                   .load(std::memory_order_relaxed) == h;
    }
    void name_vertex(Index h, Index n_faces) {
        const Index v = t_.vertex[h];
        std::atomic_ref(t_.vertex_halfedge[v]).store(h, std::memory_order_relaxed);
        t_.valences[v] = Topology::stored_valence(n_faces);
    }

    /// Gives a vertex the lowest halfedge of the fan that h is in, if that is closed.
    /// \return the number of faces, or 0 if it is open
    Index link_closed_fan(Index h) {
        Index n = 0, lowest = h, at = h;
        do {
            ++n;
            lowest = std::min(lowest, at);
            at = t_.ccw(at);
            if (at == kInvalidIndex)
                return 0;
        } while (at != h);
        name_vertex(lowest, n);
        return n;
    }
    /// Gives it the border's, if the fan is open.
    Index link_open_fan(Index h) {
        while (!t_.is_border(h))
            h = t_.next(t_.twin[h]);
        Index n = 0;
        for (Index at = h; at != kInvalidIndex; at = t_.ccw(at))
            ++n;
        name_vertex(h, n);
        return n;
    }

    /// Links the vertices that chunks could not.
    /// \return whether all faces at a vertex are in the same fan, and no edge is there twice
    bool link_vertices() {
        std::atomic<bool> sound = true;
        detail::for_each_chunk(
            left_over_.size(), 1, [&](std::size_t chunk, std::size_t, std::size_t) {
                std::size_t n_linked = 0;
                bool twice = false;
                for (const Index v : left_over_[chunk].vertices) {
                    const Index h = t_.vertex_halfedge[v];
                    const Index n = link_closed_fan(h);
                    n_linked += n > 0 ? n : link_open_fan(h);
                    twice |= has_edge_twice(v);
                }
                n_linked_.fetch_add(n_linked, std::memory_order_relaxed);
                if (twice)
                    sound.store(false, std::memory_order_relaxed);
            });
        return sound && n_linked_ == t_.n_halfedges();
    }

    /// Two edges with the same other end. Edges have no numbers yet.
    bool has_edge_twice(Index vertex) const {
        const auto for_each_end = [&](auto&& f) {
            Index last = kInvalidIndex;
            t_.for_each_outgoing(vertex, [&](Index h) {
                f(t_.to_vertex(h));
                last = t_.prev(h);
            });
            if (t_.is_border(last))
                f(t_.vertex[last]);
        };
        // Four edges, which most vertices have, without sorting.
        Index r[4] = {~Index(1), ~Index(2), ~Index(3), ~Index(4)}, n = 0;
        for_each_end([&](Index v) { r[n++ & 3] = v; });
        if (n <= 4) {
            return (r[0] == r[1]) | (r[0] == r[2]) | (r[0] == r[3]) | (r[1] == r[2]) |
                   (r[1] == r[3]) | (r[2] == r[3]);
        }
        std::vector<Index> all;
        for_each_end([&](Index v) { all.push_back(v); });
        std::ranges::sort(all);
        return std::ranges::adjacent_find(all) != all.end();
    }

    // Where something is wrong: slowly, but by itself.

    Status check_edges() const {
        struct Side {
            Index low, high, halfedge;
            auto operator<=>(const Side&) const = default;
        };
        std::vector<Side> sides;
        for (Index h = 0; h < t_.n_halfedges(); ++h) {
            const Index from = t_.vertex[h], to = t_.to_vertex(h);
            sides.push_back({std::min(from, to), std::max(from, to), h});
        }
        std::ranges::sort(sides);
        for (std::size_t begin = 0, end; begin < sides.size(); begin = end) {
            const Side& s = sides[begin];
            for (end = begin + 1; end < sides.size() && sides[end].low == s.low &&
                                  sides[end].high == s.high;)
                ++end;
            if (end - begin > 2) {
                const Index f = t_.face(sides[begin + 2].halfedge);
                return fail(
                    ErrorCode::NonManifoldEdge,
                    fmt::format("face {} is number 3 of {} at the edge of vertices {} "
                                "and {}",
                                f, end - begin, s.low, s.high),
                    f, data_.line_of_face(f));
            }
            if (end - begin < 2)
                continue;
            const Index a = s.halfedge, b = sides[begin + 1].halfedge, f = t_.face(b);
            if (t_.vertex[a] == t_.vertex[b]) {
                return fail(
                    ErrorCode::OppositeFaces,
                    fmt::format(
                        "face {} and face {} have opposite orientations: both run "
                        "from vertex {} to {}",
                        f, t_.face(a), t_.vertex[a], t_.to_vertex(a)),
                    f, data_.line_of_face(f));
            }
        }
        return ok();
    }

    /// \pre check_edges() is ok
    Status check_vertices() const {
        std::vector<Index> n_outgoing(t_.n_vertices());
        for (const Index v : t_.vertex)
            ++n_outgoing[v];
        Index bad = 0;
        while (t_.valence(bad) == n_outgoing[bad])
            ++bad;
        return fail(ErrorCode::NonManifoldVertex,
                    fmt::format("vertex {} joins two separate fans of faces", bad), bad,
                    data_.line_of_vertex(bad));
    }

    const MeshView& data_;
    Topology& t_;
    std::size_t chunk_;  // faces in it
    /// Of a chunk: the halfedges without a twin there, and the vertices whose fans have such.
    struct LeftOver {
        std::vector<Index> halfedges, vertices;
    };
    std::vector<LeftOver> left_over_;
    Buffer<Index> rest_;                     // halfedges of all of them
    std::atomic<std::size_t> n_linked_ = 0;  // halfedges in fans that are linked
};

/// \param data  that the view is of, to check what a view does not have; or null
Result<Topology> build(const MeshView& mesh, const MeshData* data) {
    if (const Status s = check_sizes(mesh); !s)
        return s.error();
    Topology t;
    Linker linker(mesh, t);
    std::optional<Status> positions, faces;
    detail::in_parallel([&] { faces = linker.copy_faces(); },
                        [&] { positions = data ? check_positions(*data) : ok(); });
    for (const auto* s : {&positions, &faces}) {
        if (!**s)
            return (*s)->error();
    }
    if (data) {
        for (const Status& s : {check_uvs(*data), check_channels(data->channels, mesh),
                                check_face_names(*data)}) {
            if (!s)
                return s.error();
        }
    }
    if (const Status s = linker.link(); !s)
        return s.error();
    if (data) {
        if (const Status s = check_face_varying(*data, t); !s)
            return s.error();
    }
    return t;
}

}  // namespace

Result<Topology> build_topology(const MeshView& mesh) {
    return build(mesh, nullptr);
}

Result<Topology> build_topology(const MeshData& data) {
    return build(data.view(), &data);
}

MeshData to_mesh_data(const Topology& topology, std::vector<Vec3<double>> positions) {
    MeshData data;
    data.positions = std::move(positions);
    data.face_vertices.assign(topology.vertex.begin(), topology.vertex.end());
    for (Index f = 0; f < topology.n_faces(); ++f)
        data.face_sizes.push_back(topology.face_size(f));
    return data;
}

}  // namespace osdx::inline OSDX_ABI
