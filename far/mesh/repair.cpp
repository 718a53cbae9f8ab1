// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <compare>
#include <cstdint>
#include <numeric>
#include <span>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include <osdx/repair.h>

namespace osdx::inline OSDX_ABI {
namespace {

/// Each point's first one that is near.
class Welder {
public:
    Welder(std::span<const Vec3<double>> points, double distance)
        : points_(points), distance_(distance), cell_(2 * distance) {}

    std::vector<Index> run() {
        std::vector<Index> first(points_.size());
        next_.assign(points_.size(), kInvalidIndex);
        heads_.reserve(points_.size());
        for (Index v = 0; v < points_.size(); ++v) {
            first[v] = find(v);
            if (first[v] == v)
                add(v);
        }
        return first;
    }

private:
    using Cell = std::array<std::int64_t, 3>;
    struct Hash {
        std::size_t operator()(const Cell& cell) const noexcept {
            constexpr std::uint64_t kMix =
                0x9e3779b97f4a7c15u;  // 2^64 by the golden ratio
            std::uint64_t h = 0;
            for (const std::int64_t i : cell)
                h = (h ^ static_cast<std::uint64_t>(i)) * kMix + (h >> 29);
            return static_cast<std::size_t>(h ^ h >> 32);
        }
    };

    bool is_finite(Index v) const {
        const Vec3<double>& p = points_[v];
        return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
    }

    /// Cells are two distances wide, so that what is near lies in this one or in the next one
    /// on the nearer side. Without a distance they are the bits of the number.
    std::int64_t cell_of(double x) const {
        if (cell_ == 0)
            return std::bit_cast<std::int64_t>(x + 0.0);  // -0 is 0
        return static_cast<std::int64_t>(std::clamp(std::floor(x / cell_), -9e18, 9e18));
    }

    Index find(Index v) const {
        if (!is_finite(v))
            return v;
        const Vec3<double>& p = points_[v];
        std::array<std::array<std::int64_t, 2>, 3> cells;
        for (int k = 0; k < 3; ++k)
            cells[k] = {cell_of(p[k] - distance_), cell_of(p[k] + distance_)};
        Index best = v;
        for (int i = 0; i < 8; ++i) {
            Cell cell;
            bool is_twice = false;
            for (int k = 0; k < 3; ++k) {
                const int side = i >> k & 1;
                is_twice |= side == 1 && cells[k][0] == cells[k][1];
                cell[k] = cells[k][side];
            }
            const auto head = is_twice ? heads_.end() : heads_.find(cell);
            if (head == heads_.end())
                continue;
            for (Index u = head->second; u != kInvalidIndex; u = next_[u]) {
                if (glm::distance(points_[u], p) <= distance_)
                    best = std::min(best, u);
            }
        }
        return best;
    }

    void add(Index v) {
        if (!is_finite(v))
            return;
        const Vec3<double>& p = points_[v];
        const Cell cell = {cell_of(p.x), cell_of(p.y), cell_of(p.z)};
        const auto [head, is_new] = heads_.try_emplace(cell, v);
        if (!is_new)
            next_[v] = std::exchange(head->second, v);
    }

    std::span<const Vec3<double>> points_;
    double distance_, cell_;
    std::unordered_map<Cell, Index, Hash> heads_;  // the last of the points in a cell
    std::vector<Index> next_;                      // the one before it there
};

/// Sets that are united.
class Sets {
public:
    explicit Sets(std::size_t n) : parent_(n) {
        std::iota(parent_.begin(), parent_.end(), 0);
    }
    Index root(Index i) {
        while (parent_[i] != i)
            i = parent_[i] = parent_[parent_[i]];
        return i;
    }
    /// The lowest of a set is its root.
    void unite(Index a, Index b) {
        a = root(a);
        b = root(b);
        parent_[std::max(a, b)] = std::min(a, b);
    }

private:
    std::vector<Index> parent_;
};

Status check_input(const MeshData& mesh) {
    std::uint64_t n = 0;
    for (const Index size : mesh.face_sizes)
        n += size;
    const auto fits = [&](std::size_t size) { return size == 0 || size == n; };
    if (n != mesh.face_vertices.size() || !fits(mesh.face_uvs.size()) ||
        n >= kInvalidIndex) {
        return fail(
            ErrorCode::SizeMismatch,
            fmt::format("the face sizes add up to {}, but there are {} face vertices", n,
                        mesh.face_vertices.size()));
    }
    std::size_t corner = 0;
    for (Index f = 0; f < mesh.face_sizes.size(); ++f) {
        for (Index k = 0; k < mesh.face_sizes[f]; ++k, ++corner) {
            if (mesh.face_vertices[corner] < mesh.positions.size())
                continue;
            return fail(ErrorCode::IndexOutOfRange,
                        fmt::format("face {} names vertex {}, but the mesh has {} "
                                    "vertices",
                                    f, mesh.face_vertices[corner], mesh.positions.size()),
                        f, mesh.view().line_of_face(f));
        }
    }
    for (const FaceVaryingChannels& c : mesh.face_varying) {
        if (c.corner_values.size() != n) {
            return fail(ErrorCode::SizeMismatch,
                        fmt::format("the channel {} has {} corners instead of {}", c.name,
                                    c.corner_values.size(), n));
        }
    }
    if (Status status =
            detail::check_channel_sizes(mesh.channels, mesh.view().n_vertices);
        !status)
        return status;
    return check_face_names(mesh);
}

class Repairer {
public:
    Repairer(const MeshData& mesh, const RepairOptions& options)
        : mesh_(mesh), options_(options) {}

    Result<RepairedMesh> run() {
        if (const Status status = check_input(mesh_); !status)
            return status.error();
        weld();
        clean_faces();
        sides_.assign(corners_.size(), kInvalidIndex);
        flipped_.assign(n_faces(), false);
        if (options_.faces) {
            find_normals();
            pair_sides();
            orient();
        }
        unite_corners();
        number_vertices();
        write_mesh();
        if (const Status status = write_tags(); !status)
            return status.error();
        return std::move(result_);
    }

private:
    RepairReport& report() { return result_.report; }
    Index n_faces() const { return static_cast<Index>(faces_.size()); }
    Index vertex(Index c) const { return first_[mesh_.face_vertices[corners_[c]]]; }
    Index next(Index c) const {
        const Index f = face_of_[c];
        return c + 1 == offsets_[f + 1] ? offsets_[f] : c + 1;
    }
    Index prev(Index c) const {
        const Index f = face_of_[c];
        return c == offsets_[f] ? offsets_[f + 1] - 1 : c - 1;
    }
    const Vec3<double>& point(Index c) const { return mesh_.positions[vertex(c)]; }

    void weld() {
        const double diagonal = bounding_diagonal(mesh_.positions);
        if (options_.weld >= 0 && std::isfinite(diagonal)) {
            first_ = Welder(mesh_.positions, options_.weld * diagonal).run();
        } else {
            first_.resize(mesh_.positions.size());
            std::iota(first_.begin(), first_.end(), 0);
        }
        for (Index v = 0; v < first_.size(); ++v)
            report().n_welded += first_[v] != v;
    }

    /// Leaves out corners that name the vertex of the one before, and both ways of edges that
    /// run there and back.
    void clean_face(std::vector<Index>& corners) const {
        const auto same = [&](Index a, Index b) {
            return first_[mesh_.face_vertices[a]] == first_[mesh_.face_vertices[b]];
        };
        std::vector<Index> kept;
        for (const Index c : corners) {
            if (!kept.empty() && same(kept.back(), c))
                continue;
            if (kept.size() > 1 && same(kept[kept.size() - 2], c))
                kept.pop_back();
            else
                kept.push_back(c);
        }
        // The same around the end.
        std::size_t begin = 0;
        while (kept.size() - begin > 1) {
            if (same(kept[begin], kept.back())) {
                kept.pop_back();
            } else if (kept.size() - begin > 2 &&
                       same(kept[begin], kept[kept.size() - 2])) {
                kept.resize(kept.size() - 2);
            } else if (kept.size() - begin > 2 && same(kept[begin + 1], kept.back())) {
                begin += 2;
            } else {
                break;
            }
        }
        corners.assign(kept.begin() + static_cast<std::ptrdiff_t>(begin), kept.end());
    }

    void clean_faces() {
        offsets_.push_back(0);
        Index c = 0;
        std::vector<Index> corners;
        for (Index f = 0; f < mesh_.face_sizes.size(); ++f) {
            const Index n = mesh_.face_sizes[f];
            corners.resize(n);
            std::iota(corners.begin(), corners.end(), c);
            c += n;
            if (options_.faces) {
                clean_face(corners);
                if (corners.size() < 3) {
                    ++report().n_dropped_faces;
                    continue;
                }
                report().n_shortened_faces += corners.size() < n;
            }
            corners_.insert(corners_.end(), corners.begin(), corners.end());
            face_of_.resize(corners_.size(), n_faces());
            faces_.push_back(f);
            offsets_.push_back(static_cast<Index>(corners_.size()));
        }
    }

    /// Twice the area of a face, as far as it is flat, along its normal.
    void find_normals() {
        normals_.assign(n_faces(), Vec3<double>(0));
        for (Index f = 0; f < n_faces(); ++f) {
            const Vec3<double>& origin = point(offsets_[f]);
            for (Index c = offsets_[f] + 1; c + 1 < offsets_[f + 1]; ++c)
                normals_[f] += glm::cross(point(c) - origin, point(c + 1) - origin);
        }
    }

    /// From the edge of a side into its face, of length one, whichever way the face runs.
    Vec3<double> inwards(Index side) const {
        const Vec3<double> d =
            glm::cross(normals_[face_of_[side]], point(next(side)) - point(side));
        const double length = glm::length(d);
        return length > 0 ? d / length : Vec3<double>(0);
    }

    void join(Index a, Index b) {
        sides_[a] = b;
        sides_[b] = a;
    }
    void part(Index side) {
        if (sides_[side] == kInvalidIndex)
            return;
        sides_[sides_[side]] = kInvalidIndex;
        sides_[side] = kInvalidIndex;
    }

    /// Joins two and two that bend least.
    void pair_many(std::span<const Index> sides) {
        struct Pair {
            double bend;
            Index a, b;
        };
        ++report().n_parted_edges;
        constexpr std::size_t kMost = 100;  // pairs are as many as its square
        if (sides.size() > kMost)
            return;
        std::vector<Vec3<double>> directions;
        for (const Index side : sides)
            directions.push_back(inwards(side));
        std::vector<Pair> pairs;
        for (std::size_t i = 0; i < sides.size(); ++i) {
            for (std::size_t j = i + 1; j < sides.size(); ++j) {
                if (face_of_[sides[i]] != face_of_[sides[j]])
                    pairs.push_back(
                        {glm::dot(directions[i], directions[j]), sides[i], sides[j]});
            }
        }
        std::ranges::sort(pairs, {},
                          [](const Pair& p) { return std::tuple(p.bend, p.a, p.b); });
        for (const Pair& p : pairs) {
            if (sides_[p.a] == kInvalidIndex && sides_[p.b] == kInvalidIndex)
                join(p.a, p.b);
        }
    }

    /// Calls f(the sides of an edge), by vertices, for all edges.
    template <class F>
    void for_each_edge(F&& f) {
        std::vector<Index> sides;
        for (std::size_t begin = 0, end; begin < all_sides_.size(); begin = end) {
            const Side& first = all_sides_[begin];
            sides.clear();
            for (end = begin;
                 end < all_sides_.size() && all_sides_[end].low == first.low &&
                 all_sides_[end].high == first.high;
                 ++end)
                sides.push_back(all_sides_[end].corner);
            f(std::span<const Index>(sides));
        }
    }

    void pair_sides() {
        all_sides_.reserve(corners_.size());
        for (Index c = 0; c < corners_.size(); ++c) {
            const Index from = vertex(c), to = vertex(next(c));
            all_sides_.push_back({std::min(from, to), std::max(from, to), c});
        }
        std::ranges::sort(all_sides_);
        for_each_edge([&](std::span<const Index> sides) {
            if (sides.size() > 2)
                pair_many(sides);
            else if (sides.size() == 2 && face_of_[sides[0]] != face_of_[sides[1]])
                join(sides[0], sides[1]);
        });
    }

    bool run_alike(Index a, Index b) const { return vertex(a) == vertex(b); }

    /// Floods the component of a face.
    void orient(Index start, std::vector<bool>& seen) {
        std::vector<Index> component = {start};
        seen[start] = true;
        Index n_flipped = 0;
        for (std::size_t i = 0; i < component.size(); ++i) {
            const Index f = component[i];
            n_flipped += flipped_[f];
            for (Index a = offsets_[f]; a < offsets_[f + 1]; ++a) {
                const Index b = sides_[a];
                if (b == kInvalidIndex)
                    continue;
                const Index g = face_of_[b];
                const bool flipped = flipped_[f] != run_alike(a, b);
                if (!seen[g]) {
                    seen[g] = true;
                    flipped_[g] = flipped;
                    component.push_back(g);
                } else if (flipped_[g] != flipped) {
                    part(a);
                    ++report().n_cut_edges;
                }
            }
        }
        const bool turn = 2 * std::size_t{n_flipped} > component.size();
        for (const Index f : component) {
            flipped_[f] = flipped_[f] != turn;
            report().n_flipped_faces += flipped_[f];
        }
    }

    void orient() {
        std::vector<bool> seen(n_faces(), false);
        for (Index f = 0; f < n_faces(); ++f) {
            if (!seen[f])
                orient(f, seen);
        }
    }

    /// Corners in the same fan are one vertex.
    void unite_corners() {
        do {
            fans_ = Sets(corners_.size());
            if (!options_.faces)
                return;
            for (Index a = 0; a < corners_.size(); ++a) {
                const Index b = sides_[a];
                if (b == kInvalidIndex || b < a)
                    continue;
                const bool alike = run_alike(a, b);
                fans_.unite(a, alike ? b : next(b));
                fans_.unite(next(a), alike ? next(b) : b);
            }
        } while (part_repeated() || part_doubled());
    }

    /// Parts a face from its neighbours at corners where it comes by a fan again.
    /// \return whether there are any
    bool part_repeated() {
        bool any = false;
        std::vector<std::pair<Index, Index>> fans;
        for (Index f = 0; f < n_faces(); ++f) {
            fans.clear();
            for (Index c = offsets_[f]; c < offsets_[f + 1]; ++c)
                fans.emplace_back(fans_.root(c), c);
            std::ranges::sort(fans);
            for (std::size_t i = 1; i < fans.size(); ++i) {
                if (fans[i].first != fans[i - 1].first)
                    continue;
                any = true;
                part(fans[i].second);
                part(prev(fans[i].second));
            }
        }
        return any;
    }

    /// Parts faces from their other neighbours at the ends of an edge that is not theirs, but
    /// whose ends they share with the faces of it.
    /// \return whether there are any
    bool part_doubled() {
        bool any = false;
        std::vector<std::pair<Index, Index>> ends;  // of those that have an edge
        for_each_edge([&](std::span<const Index> sides) {
            if (sides.size() < 2 || (sides.size() == 2 && sides_[sides[0]] == sides[1]))
                return;
            ends.clear();
            const auto look_at = [&](Index a) {
                const Index b = sides_[a];
                const auto both = std::minmax({fans_.root(a), fans_.root(next(a))});
                if (std::ranges::find(ends, std::pair(both)) == ends.end()) {
                    ends.push_back(both);
                    return;
                }
                any = true;
                for (const Index side : {a, b}) {
                    if (side == kInvalidIndex)
                        continue;
                    part(prev(side));
                    part(next(side));
                }
            };
            for (const bool joined : {true, false}) {
                for (const Index a : sides) {
                    if (joined ? sides_[a] != kInvalidIndex && a < sides_[a]
                               : sides_[a] == kInvalidIndex)
                        look_at(a);
                }
            }
        });
        return any;
    }

    /// First the vertices of the input that are left, each with its first fan, then copies.
    void number_vertices() {
        std::vector<Index> places(first_.size(), kInvalidIndex);
        for (Index v = 0; v < first_.size(); ++v) {
            if (first_[v] != v)
                continue;
            places[v] = static_cast<Index>(report().vertices.size());
            report().vertices.push_back(v);
        }
        new_vertices_.resize(corners_.size());
        std::vector<bool> used(first_.size(), false);
        for (Index c = 0; c < corners_.size(); ++c) {
            const Index v = vertex(c);
            const Index root = options_.faces ? fans_.root(c) : c;
            if (root != c) {
                new_vertices_[c] = new_vertices_[root];
            } else if (!options_.faces || !used[v]) {
                used[v] = true;
                new_vertices_[c] = places[v];
            } else {
                new_vertices_[c] = static_cast<Index>(report().vertices.size());
                report().vertices.push_back(v);
                ++report().n_added_vertices;
            }
        }
    }

    /// Of vertices or faces, what their array has for them.
    template <class T>
    static std::vector<T> picked(const std::vector<T>& from, std::span<const Index> at) {
        std::vector<T> to;
        if (from.empty())
            return to;
        to.reserve(at.size());
        for (const Index i : at)
            to.push_back(from[i]);
        return to;
    }

    void write_mesh() {
        MeshData& to = result_.mesh;
        report().faces = faces_;
        std::vector<Index> order;  // of corners
        order.reserve(corners_.size());
        for (Index f = 0; f < n_faces(); ++f) {
            const auto first = static_cast<std::ptrdiff_t>(order.size());
            for (Index c = offsets_[f]; c < offsets_[f + 1]; ++c)
                order.push_back(c);
            if (flipped_[f])
                std::reverse(order.begin() + first + 1, order.end());
            to.face_sizes.push_back(offsets_[f + 1] - offsets_[f]);
        }
        to.face_vertices = picked(new_vertices_, order);
        for (Index& c : order)
            c = corners_[c];
        to.face_uvs = picked(mesh_.face_uvs, order);
        to.uvs = mesh_.uvs;
        to.face_varying = mesh_.face_varying;
        for (FaceVaryingChannels& c : to.face_varying)
            c.corner_values = picked(c.corner_values, order);
        to.positions = picked(mesh_.positions, report().vertices);
        to.vertex_lines = picked(mesh_.vertex_lines, report().vertices);
        for (const NamedChannels& from : mesh_.channels) {
            to.channels.push_back({from.name, from.n, {}});
            NamedChannels& c = to.channels.back();
            for (const Index v : report().vertices) {
                const double* values = from.view()[v];
                c.values.insert(c.values.end(), values, values + from.n);
            }
        }
        to.face_lines = picked(mesh_.face_lines, faces_);
        to.material_files = mesh_.material_files;
        to.warnings = mesh_.warnings;
        for (const auto names :
             {&MeshData::groups, &MeshData::objects, &MeshData::materials})
            to.*names = {(mesh_.*names).names, picked((mesh_.*names).faces, faces_)};
    }

    /// The edges of the mesh as it is now, by the vertices of the input that they had.
    void find_edges() {
        for (Index c = 0; c < corners_.size(); ++c) {
            const Index a = new_vertices_[c], b = new_vertices_[next(c)];
            edges_.push_back(
                {std::minmax(vertex(c), vertex(next(c))), std::minmax(a, b)});
        }
        std::ranges::sort(edges_);
        edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
    }

    Status write_tags() {
        const auto has_crease = [](const Tag& tag) { return tag.name == "crease"; };
        if (std::ranges::any_of(mesh_.tags, has_crease))
            find_edges();
        for (Index i = 0; i < mesh_.tags.size(); ++i) {
            const Tag& tag = mesh_.tags[i];
            const bool of_faces = tag.name == "hole";
            if (!of_faces && !has_crease(tag) && tag.name != "corner") {
                result_.mesh.tags.push_back(tag);
                continue;
            }
            const std::size_t n =
                of_faces ? mesh_.face_sizes.size() : mesh_.positions.size();
            for (const int element : tag.ints) {
                if (element < 0 || std::cmp_greater_equal(element, n)) {
                    return fail(ErrorCode::InvalidTag,
                                fmt::format("tag {} is a {} of {}, but the mesh has {} "
                                            "of its kind",
                                            i, tag.name, element, n),
                                i, tag.line);
                }
            }
            if (of_faces)
                write_hole(tag);
            else if (tag.name == "corner")
                write_corner(tag);
            else
                write_crease(tag);
        }
        return ok();
    }

    void add_tag(const Tag& tag, std::vector<int> ints, std::vector<double> floats) {
        result_.mesh.tags.push_back(
            {tag.name, std::move(ints), std::move(floats), tag.text, tag.line});
    }

    void write_crease(const Tag& tag) {
        if (tag.ints.size() != 2) {
            add_tag(tag, tag.ints, tag.floats);
            return;
        }
        const auto ends = std::minmax(first_[static_cast<std::size_t>(tag.ints[0])],
                                      first_[static_cast<std::size_t>(tag.ints[1])]);
        const Edge least{ends, {0, 0}};
        auto edge = std::ranges::lower_bound(edges_, least);
        if (edge == edges_.end() || edge->first != least.first)
            ++report().n_dropped_tags;
        for (; edge != edges_.end() && edge->first == least.first; ++edge) {
            add_tag(tag,
                    {static_cast<int>(edge->second.first),
                     static_cast<int>(edge->second.second)},
                    tag.floats);
        }
    }

    void write_corner(const Tag& tag) {
        if (copies_.empty()) {
            copies_.resize(first_.size());
            for (Index v = 0; v < report().vertices.size(); ++v)
                copies_[report().vertices[v]].push_back(v);
        }
        std::vector<int> ints;
        std::vector<double> floats;
        const bool has_each = tag.floats.size() == tag.ints.size();
        for (std::size_t i = 0; i < tag.ints.size(); ++i) {
            for (const Index v : copies_[first_[static_cast<std::size_t>(tag.ints[i])]]) {
                ints.push_back(static_cast<int>(v));
                if (has_each)
                    floats.push_back(tag.floats[i]);
            }
        }
        add_tag(tag, std::move(ints), has_each ? std::move(floats) : tag.floats);
    }

    void write_hole(const Tag& tag) {
        std::vector<int> ints;
        for (const int f : tag.ints) {
            const auto at = std::ranges::lower_bound(faces_, static_cast<Index>(f));
            if (at != faces_.end() && *at == static_cast<Index>(f))
                ints.push_back(static_cast<int>(at - faces_.begin()));
        }
        if (ints.empty() && !tag.ints.empty())
            ++report().n_dropped_tags;
        else
            add_tag(tag, std::move(ints), tag.floats);
    }

    struct Side {
        Index low, high, corner;
        auto operator<=>(const Side&) const = default;
    };
    /// The ends in the input, after welding, and those that they are now.
    using Edge = std::pair<std::pair<Index, Index>, std::pair<Index, Index>>;

    const MeshData& mesh_;
    const RepairOptions& options_;
    RepairedMesh result_;
    std::vector<Index> first_;    // of each vertex the one that it becomes
    std::vector<Index> faces_;    // of the input, those that are left
    std::vector<Index> offsets_;  // of their corners
    std::vector<Index> corners_;  // of the input, those that are left
    std::vector<Index> face_of_;  // of each of them, in faces_
    std::vector<Index> sides_;  // from a corner to the next one: the side across, if any
    std::vector<Side> all_sides_;  // by edges
    std::vector<bool> flipped_;    // faces
    std::vector<Vec3<double>> normals_;
    Sets fans_{0};
    std::vector<Index> new_vertices_;  // of corners
    std::vector<Edge> edges_;
    std::vector<std::vector<Index>> copies_;  // of vertices
};

}  // namespace

Result<RepairedMesh> repair(const MeshData& mesh, const RepairOptions& options) {
    return Repairer(mesh, options).run();
}

}  // namespace osdx::inline OSDX_ABI
