// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace osdx {
namespace {

Index line_of(const std::vector<Index>& lines, Index element) {
    return element < lines.size() ? lines[element] : 0;
}

/// A corner of the input: the edge from its vertex to the next one of the face.
struct Corner {
    Index from, to;
    Index face;
};

std::vector<Corner> corners_of(const MeshData& data) {
    std::vector<Corner> corners;
    corners.reserve(data.face_vertices.size());
    const Index* v = data.face_vertices.data();
    for (Index f = 0; f < data.face_sizes.size(); ++f) {
        const Index n = data.face_sizes[f];
        for (Index c = 0; c < n; ++c)
            corners.push_back({v[c], v[(c + 1) % n], f});
        v += n;
    }
    return corners;
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
    for (Index v = 0; v < data.positions.size(); ++v) {
        const auto& p = data.positions[v];
        if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) {
            return fail(
                ErrorCode::NonFinitePoint,
                fmt::format("vertex {} has the position ({}, {}, {})", v, p.x, p.y, p.z),
                v, line_of(data.vertex_lines, v));
        }
    }
    return ok();
}

Status check_faces(const MeshData& data) {
    std::vector<Index> sorted;
    const Index* v = data.face_vertices.data();
    for (Index f = 0; f < data.face_sizes.size(); ++f) {
        const Index n = data.face_sizes[f];
        const Index line = line_of(data.face_lines, f);
        if (n < 3) {
            return fail(ErrorCode::FaceTooSmall,
                        fmt::format("face {} has {} vertices", f, n), f, line);
        }
        sorted.assign(v, v + n);
        std::ranges::sort(sorted);
        if (sorted.back() >= data.positions.size()) {
            return fail(
                ErrorCode::IndexOutOfRange,
                fmt::format("face {} names vertex {}, but the mesh has {} vertices", f,
                            sorted.back(), data.positions.size()),
                f, line);
        }
        const auto twice = std::ranges::adjacent_find(sorted);
        if (twice != sorted.end()) {
            return fail(ErrorCode::RepeatedVertex,
                        fmt::format("face {} names vertex {} twice", f, *twice), f, line);
        }
        v += n;
    }
    return ok();
}

/// The corner on the other side of each corner's edge, kInvalidIndex where there is none.
Result<std::vector<Index>> match_edges(const MeshData& data,
                                       const std::vector<Corner>& corners) {
    std::vector<Index> order(corners.size());
    for (Index i = 0; i < order.size(); ++i)
        order[i] = i;
    const auto key = [&](Index i) {
        const Corner& c = corners[i];
        return std::array{std::min(c.from, c.to), std::max(c.from, c.to), i};
    };
    std::ranges::sort(order, {}, key);

    std::vector<Index> twins(corners.size(), kInvalidIndex);
    for (std::size_t i = 0, end = 0; i < order.size(); i = end) {
        const auto first = key(order[i]);
        while (end < order.size() && key(order[end])[0] == first[0] &&
               key(order[end])[1] == first[1])
            ++end;
        const std::size_t n = end - i;
        if (n == 1)
            continue;
        const Corner& a = corners[order[i]];
        const Corner& b = corners[order[i + 1]];
        if (n > 2) {
            const Index f = corners[order[i + 2]].face;
            return fail(
                ErrorCode::NonManifoldEdge,
                fmt::format("face {} is number 3 of {} at the edge of vertices {} "
                            "and {}",
                            f, n, first[0], first[1]),
                f, line_of(data.face_lines, f));
        }
        if (a.from == b.from) {
            return fail(
                ErrorCode::OppositeFaces,
                fmt::format("face {} and face {} have opposite orientations: both "
                            "run from vertex {} to {}",
                            b.face, a.face, a.from, a.to),
                b.face, line_of(data.face_lines, b.face));
        }
        twins[order[i]] = order[i + 1];
        twins[order[i + 1]] = order[i];
    }
    return twins;
}

/// Counts the fans of each vertex: the orbits of its corners under rotation.
Status check_vertices(const MeshData& data, const std::vector<Corner>& corners,
                      const std::vector<Index>& twins) {
    std::vector<Index> next(corners.size()), previous(corners.size());
    Index first = 0;
    for (const Index n : data.face_sizes) {
        for (Index c = 0; c < n; ++c) {
            next[first + c] = first + (c + 1) % n;
            previous[first + (c + 1) % n] = first + c;
        }
        first += n;
    }
    const auto ccw = [&](Index c) { return twins[previous[c]]; };
    const auto cw = [&](Index c) {
        return twins[c] == kInvalidIndex ? kInvalidIndex : next[twins[c]];
    };

    std::vector<bool> has_fan(data.positions.size(), false);
    std::vector<bool> seen(corners.size(), false);
    for (Index start = 0; start < corners.size(); ++start) {
        if (seen[start])
            continue;
        const Index v = corners[start].from;
        if (has_fan[v]) {
            return fail(ErrorCode::NonManifoldVertex,
                        fmt::format("vertex {} joins two separate fans of faces", v), v,
                        line_of(data.vertex_lines, v));
        }
        has_fan[v] = true;

        Index begin = start;  // of the fan: the clockwise end, or any corner if closed
        for (Index c = cw(start); c != kInvalidIndex && c != start; c = cw(c))
            begin = c;
        Index c = begin;
        do {
            seen[c] = true;
            c = ccw(c);
        } while (c != kInvalidIndex && c != begin);
    }
    return ok();
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
    const Index* corner = mesh.face_uvs.data();
    for (Index f = 0; f < mesh.face_sizes.size(); ++f) {
        for (Index c = 0; c < mesh.face_sizes[f]; ++c, ++corner) {
            if (*corner >= mesh.uvs.size()) {
                return fail(
                    ErrorCode::IndexOutOfRange,
                    fmt::format(
                        "face {} names texture coordinate {}, but the mesh has {}", f,
                        *corner, mesh.uvs.size()),
                    f, line_of(mesh.face_lines, f));
            }
            const Vec2<double>& uv = mesh.uvs[*corner];
            if (!std::isfinite(uv.x) || !std::isfinite(uv.y)) {
                return fail(
                    ErrorCode::NonFinitePoint,
                    fmt::format("face {} names texture coordinate {}, which is ({}, {})",
                                f, *corner, uv.x, uv.y),
                    f, line_of(mesh.face_lines, f));
            }
        }
    }
    return ok();
}

Result<Mesh> build_mesh(const MeshData& data) {
    if (const Status s = check_sizes(data); !s)
        return s.error();
    if (const Status s = check_positions(data); !s)
        return s.error();
    if (const Status s = check_faces(data); !s)
        return s.error();
    if (const Status s = check_uvs(data); !s)
        return s.error();
    const std::vector<Corner> corners = corners_of(data);
    const Result<std::vector<Index>> twins = match_edges(data, corners);
    if (!twins)
        return twins.error();
    if (const Status s = check_vertices(data, corners, *twins); !s)
        return s.error();

    Mesh mesh;
    mesh.reserve(data.positions.size(), corners.size() / 2, data.face_sizes.size());
    for (const auto& p : data.positions)
        mesh.add_vertex({p.x, p.y, p.z});
    std::vector<Mesh::VertexHandle> face;
    const Index* v = data.face_vertices.data();
    for (Index f = 0; f < data.face_sizes.size(); ++f) {
        const Index n = data.face_sizes[f];
        face.clear();
        for (Index c = 0; c < n; ++c)
            face.emplace_back(static_cast<int>(v[c]));
        // OpenMesh refuses what it cannot link; the checks above leave nothing to refuse.
        const Mesh::FaceHandle handle = mesh.add_face(face);
        if (!handle.is_valid() || handle.idx() != static_cast<int>(f)) {
            return fail(ErrorCode::NonManifoldVertex,
                        fmt::format("face {} cannot be linked to its neighbours", f), f,
                        line_of(data.face_lines, f));
        }
        v += n;
    }
    return mesh;
}

}  // namespace osdx
