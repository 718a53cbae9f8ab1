// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "tests/support/test_meshes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <stdexcept>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <osdx/build_topology.h>
#include <osdx/resolved_features.h>

#include "tests/support/thinned.h"

namespace osdx::test {
namespace {

using Point = Vec3<double>;
using std::numbers::pi;

void add_face(MeshData& mesh, const std::vector<Index>& face) {
    mesh.face_sizes.push_back(static_cast<Index>(face.size()));
    mesh.face_vertices.insert(mesh.face_vertices.end(), face.begin(), face.end());
}

std::vector<std::vector<Index>> faces_of(const MeshData& mesh) {
    std::vector<std::vector<Index>> faces;
    auto first = mesh.face_vertices.begin();
    for (const Index n : mesh.face_sizes) {
        faces.emplace_back(first, first + n);
        first += n;
    }
    return faces;
}

/// For each vertex the faces around it, counter-clockwise.
std::vector<std::vector<Index>> rings_of(const MeshData& mesh) {
    const auto faces = faces_of(mesh);
    std::map<std::pair<Index, Index>, Index> left_face;
    for (Index f = 0; f < faces.size(); ++f) {
        for (std::size_t c = 0; c < faces[f].size(); ++c)
            left_face[{faces[f][c], faces[f][(c + 1) % faces[f].size()]}] = f;
    }
    std::vector<std::vector<Index>> rings(mesh.positions.size());
    for (const auto& [edge, first] : left_face) {
        const Index v = edge.first;
        if (!rings[v].empty())
            continue;
        Index f = first;
        do {
            rings[v].push_back(f);
            const auto& face = faces[f];
            const auto at = std::ranges::find(face, v) - face.begin();
            const Index before = face[(at + face.size() - 1) % face.size()];
            f = left_face.at({v, before});
        } while (f != first);
    }
    return rings;
}

/// At polar angle `polar` from the z axis.
Point on_sphere(double polar, double azimuth) {
    return {std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth),
            std::cos(polar)};
}

}  // namespace

MeshData tetrahedron() {
    MeshData mesh;
    mesh.positions = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    mesh.face_sizes = {3, 3, 3, 3};
    mesh.face_vertices = {0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2};
    return mesh;
}

MeshData cube() {
    MeshData mesh;
    mesh.positions = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                      {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
    mesh.face_sizes.assign(6, 4);
    mesh.face_vertices = {0, 3, 2, 1, 4, 5, 6, 7, 0, 1, 5, 4,
                          1, 2, 6, 5, 2, 3, 7, 6, 3, 0, 4, 7};
    return mesh;
}

MeshData octahedron() {
    return bipyramid(4);
}

MeshData icosahedron() {
    MeshData mesh;
    const double polar = std::atan(2.0);
    mesh.positions = {{0, 0, 1}, {0, 0, -1}};
    for (int i = 0; i < 5; ++i)
        mesh.positions.push_back(on_sphere(polar, 2 * pi * i / 5));
    for (int i = 0; i < 5; ++i)
        mesh.positions.push_back(on_sphere(pi - polar, 2 * pi * (i + 0.5) / 5));
    for (Index i = 0; i < 5; ++i) {
        const Index next = (i + 1) % 5;
        const Index upper = 2 + i, upper_next = 2 + next;
        const Index lower = 7 + i, lower_next = 7 + next;
        add_face(mesh, {0, upper, upper_next});
        add_face(mesh, {upper, lower, upper_next});
        add_face(mesh, {lower, lower_next, upper_next});
        add_face(mesh, {1, lower_next, lower});
    }
    return mesh;
}

MeshData dodecahedron() {
    return dual_mesh(icosahedron());
}

MeshData truncated_icosahedron() {
    const MeshData ico = icosahedron();
    const auto faces = faces_of(ico);
    MeshData mesh;
    std::map<std::pair<Index, Index>, Index> number;  // the cut of an edge near its start
    for (const auto& face : faces) {
        for (std::size_t c = 0; c < 3; ++c) {
            const Index a = face[c], b = face[(c + 1) % 3];
            number[{a, b}] = static_cast<Index>(mesh.positions.size());
            mesh.positions.push_back((2.0 * ico.positions[a] + ico.positions[b]) / 3.0);
        }
    }
    for (const auto& face : faces) {
        std::vector<Index> hexagon;
        for (std::size_t c = 0; c < 3; ++c) {
            const Index a = face[c], b = face[(c + 1) % 3];
            hexagon.push_back(number.at({a, b}));
            hexagon.push_back(number.at({b, a}));
        }
        add_face(mesh, hexagon);
    }
    const auto rings = rings_of(ico);
    for (Index v = 0; v < rings.size(); ++v) {
        std::vector<Index> pentagon;
        for (const Index f : rings[v]) {
            const auto at = std::ranges::find(faces[f], v) - faces[f].begin();
            pentagon.push_back(number.at({v, faces[f][(at + 1) % 3]}));
        }
        add_face(mesh, pentagon);
    }
    return mesh;
}

MeshData torus(Index m, Index n) {
    MeshData mesh;
    for (Index i = 0; i < m; ++i) {
        for (Index j = 0; j < n; ++j) {
            const double a = 2 * pi * i / m, b = 2 * pi * j / n;
            const double r = 1 + 0.4 * std::cos(b);
            mesh.positions.emplace_back(r * std::cos(a), r * std::sin(a),
                                        0.4 * std::sin(b));
        }
    }
    for (Index i = 0; i < m; ++i) {
        for (Index j = 0; j < n; ++j) {
            const Index i1 = (i + 1) % m, j1 = (j + 1) % n;
            add_face(mesh, {i * n + j, i1 * n + j, i1 * n + j1, i * n + j1});
        }
    }
    return mesh;
}

MeshData prism(Index n) {
    MeshData mesh;
    std::vector<Index> top, bottom;
    for (Index i = 0; i < n; ++i) {
        mesh.positions.push_back(on_sphere(pi / 4, 2 * pi * i / n));
        mesh.positions.push_back(on_sphere(3 * pi / 4, 2 * pi * i / n));
        top.push_back(2 * i);
        bottom.push_back(2 * (n - 1 - i) + 1);
    }
    add_face(mesh, top);
    add_face(mesh, bottom);
    for (Index i = 0; i < n; ++i) {
        const Index next = (i + 1) % n;
        add_face(mesh, {2 * i + 1, 2 * next + 1, 2 * next, 2 * i});
    }
    return mesh;
}

MeshData bipyramid(Index n) {
    MeshData mesh;
    mesh.positions = {{0, 0, 1}, {0, 0, -1}};
    for (Index i = 0; i < n; ++i)
        mesh.positions.push_back(on_sphere(pi / 2, 2 * pi * i / n));
    for (Index i = 0; i < n; ++i) {
        const Index a = 2 + i, b = 2 + (i + 1) % n;
        add_face(mesh, {0, a, b});
        add_face(mesh, {1, b, a});
    }
    return mesh;
}

MeshData pole(Index n, Index k, Index rings) {
    MeshData mesh;
    const double step = pi / (2.0 * k + rings);  // between parallels
    const Index cap_size = n * k * (k + 1);      // without the pole
    // Of the cap at pole 0 or 1: (a, b) lies a steps along spoke i and b along the next one.
    const auto cap_vertex = [&](Index cap, Index i, Index a, Index b) {
        if (a == 0 && b == 0)
            return cap;
        if (a == 0)
            return 2 + cap * cap_size + ((i + 1) % n * k + (b - 1)) * (k + 1);
        return 2 + cap * cap_size + (i * k + (a - 1)) * (k + 1) + b;
    };
    mesh.positions.resize(2 + 2 * cap_size);
    for (Index cap = 0; cap < 2; ++cap) {
        const double sign = cap == 0 ? 1 : -1;
        mesh.positions[cap] = {0, 0, sign};
        for (Index i = 0; i < n; ++i) {
            for (Index a = 1; a <= k; ++a) {
                for (Index b = 0; b <= k; ++b) {
                    const double m = std::max(a, b);
                    const double along = a >= b ? b : 2 * m - a;  // of 2m on the parallel
                    Point p = on_sphere(m * step, 2 * pi * (i + along / (2 * m)) / n);
                    p.z *= sign;
                    mesh.positions[cap_vertex(cap, i, a, b)] = p;
                }
            }
        }
    }
    // Parallels between the caps, the last ones included: 2k vertices per sector.
    const Index length = 2 * k * n;
    const auto ring_vertex = [&](Index ring, Index at) {
        at %= length;
        if (ring == 0 || ring == rings) {
            const Index i = at / (2 * k), along = at % (2 * k);
            return along <= k ? cap_vertex(ring == 0 ? 0 : 1, i, k, along)
                              : cap_vertex(ring == 0 ? 0 : 1, i, 2 * k - along, k);
        }
        return 2 + 2 * cap_size + (ring - 1) * length + at;
    };
    for (Index ring = 1; ring < rings; ++ring) {
        for (Index at = 0; at < length; ++at)
            mesh.positions.push_back(on_sphere((k + ring) * step, 2 * pi * at / length));
    }

    for (Index i = 0; i < n; ++i) {
        for (Index a = 0; a < k; ++a) {
            for (Index b = 0; b < k; ++b) {
                add_face(mesh,
                         {cap_vertex(0, i, a, b), cap_vertex(0, i, a + 1, b),
                          cap_vertex(0, i, a + 1, b + 1), cap_vertex(0, i, a, b + 1)});
                add_face(mesh,
                         {cap_vertex(1, i, a, b), cap_vertex(1, i, a, b + 1),
                          cap_vertex(1, i, a + 1, b + 1), cap_vertex(1, i, a + 1, b)});
            }
        }
    }
    for (Index ring = 0; ring < rings; ++ring) {
        for (Index at = 0; at < length; ++at) {
            add_face(mesh, {ring_vertex(ring + 1, at), ring_vertex(ring + 1, at + 1),
                            ring_vertex(ring, at + 1), ring_vertex(ring, at)});
        }
    }
    return mesh;
}

MeshData face_pole(Index n, Index k, Index rings) {
    return dual_mesh(pole(n, k, rings));
}

MeshData double_torus() {
    const auto is_solid = [](int x, int y, int z) {
        return x >= 0 && x < 5 && y >= 0 && y < 3 && z == 0 &&
               !(y == 1 && (x == 1 || x == 3));
    };
    MeshData mesh;
    std::map<std::array<int, 3>, Index> number;
    const auto vertex = [&](const std::array<int, 3>& p) {
        const auto [it, is_new] =
            number.try_emplace(p, static_cast<Index>(mesh.positions.size()));
        if (is_new)
            mesh.positions.emplace_back(0.4 * p[0] - 1, 0.4 * p[1] - 0.6, 0.4 * p[2]);
        return it->second;
    };
    for (int x = 0; x < 5; ++x) {
        for (int y = 0; y < 3; ++y) {
            for (int side = 0; side < 6 && is_solid(x, y, 0); ++side) {
                const int axis = side / 2, up = side % 2;
                std::array<int, 3> out = {x, y, 0};
                out[axis] += up ? 1 : -1;
                if (is_solid(out[0], out[1], out[2]))
                    continue;
                std::array<int, 3> corner = {x, y, 0};
                corner[axis] += up;
                // The two other axes, in the order that is counter-clockwise from outside.
                const int s = (axis + (up ? 1 : 2)) % 3, t = (axis + (up ? 2 : 1)) % 3;
                std::vector<Index> face = {vertex(corner)};
                ++corner[s];
                face.push_back(vertex(corner));
                ++corner[t];
                face.push_back(vertex(corner));
                --corner[s];
                face.push_back(vertex(corner));
                add_face(mesh, face);
            }
        }
    }
    return mesh;
}

MeshData dual_mesh(const MeshData& mesh) {
    MeshData dual;
    for (const auto& face : faces_of(mesh)) {
        Point sum(0.0);
        for (const Index v : face)
            sum += mesh.positions[v];
        dual.positions.push_back(sum / double(face.size()));
    }
    for (const auto& ring : rings_of(mesh))
        add_face(dual, ring);
    return dual;
}

MeshData random_displaced(MeshData mesh, unsigned seed, double amount) {
    std::mt19937 generator(seed);
    // The distributions of the standard library differ between platforms.
    const auto next = [&] {
        return amount * (2.0 * double(generator()) / 0xffffffffu - 1.0);
    };
    for (Point& p : mesh.positions) {
        p.x += next();
        p.y += next();
        p.z += next();
    }
    return mesh;
}

std::vector<NamedMesh> closed_meshes() {
    std::vector<NamedMesh> meshes = {
        {"tetrahedron", tetrahedron()},
        {"cube", cube()},
        {"octahedron", octahedron()},
        {"icosahedron", icosahedron()},
        {"dodecahedron", dodecahedron()},
        {"truncated icosahedron", truncated_icosahedron()},
        {"torus 3 x 5", torus(3, 5)},
        {"prism 3", prism(3)},
        {"prism 7", prism(7)},
        {"prism 12", prism(12)},
        {"bipyramid 3", bipyramid(3)},
        {"bipyramid 9", bipyramid(9)},
        {"pole 3", pole(3, 1, 1)},
        {"pole 5", pole(5, 3, 2)},
        {"pole 7", pole(7, 2, 1)},
        {"face pole 3", face_pole(3, 2, 1)},
        {"face pole 6", face_pole(6, 3, 3)},
        {"double torus", double_torus()},
    };
    for (std::size_t i = 0; i < meshes.size(); ++i)
        meshes[i].data = random_displaced(meshes[i].data, unsigned(i + 1), 0.05);
    return thinned(meshes);
}

MeshData grid(Index m, Index n) {
    MeshData mesh;
    for (Index i = 0; i <= m; ++i) {
        for (Index j = 0; j <= n; ++j)
            mesh.positions.emplace_back(i, j, 0);
    }
    for (Index i = 0; i < m; ++i) {
        for (Index j = 0; j < n; ++j) {
            const Index v = i * (n + 1) + j;
            mesh.face_sizes.push_back(4);
            mesh.face_vertices.insert(mesh.face_vertices.end(),
                                      {v, v + n + 1, v + n + 2, v + 1});
        }
    }
    return mesh;
}

MeshData border_fan(Index k) {
    MeshData mesh;
    mesh.positions.emplace_back(0, 0, 0);
    for (Index i = 0; i <= 2 * k; ++i) {
        const double angle = std::numbers::pi * i / (2 * k);
        const double radius = i % 2 == 0 ? 1 : 1.3;
        mesh.positions.emplace_back(radius * std::cos(angle), radius * std::sin(angle),
                                    0);
    }
    for (Index i = 0; i < k; ++i) {
        mesh.face_sizes.push_back(4);
        mesh.face_vertices.insert(mesh.face_vertices.end(),
                                  {0, 2 * i + 1, 2 * i + 2, 2 * i + 3});
    }
    return mesh;
}

MeshData without_faces(const MeshData& mesh, const std::vector<Index>& faces) {
    MeshData result;
    result.positions = mesh.positions;
    std::size_t first = 0;
    for (Index f = 0; f < mesh.face_sizes.size(); ++f) {
        const Index n = mesh.face_sizes[f];
        if (std::ranges::find(faces, f) == faces.end()) {
            result.face_sizes.push_back(n);
            const auto begin = mesh.face_vertices.begin() + std::ptrdiff_t(first);
            result.face_vertices.insert(result.face_vertices.end(), begin, begin + n);
        }
        first += n;
    }
    return result;
}

std::vector<NamedMesh> open_meshes() {
    std::vector<NamedMesh> meshes = {
        {"quad", grid(1, 1)},
        {"strip", grid(5, 1)},
        {"grid", grid(3, 4)},
        {"cube without a face", without_faces(cube(), {2})},
        {"dodecahedron without two faces", without_faces(dodecahedron(), {0, 7})},
        {"torus with two gaps", without_faces(torus(5, 6), {7, 20, 21})},
        {"icosahedron without a face", without_faces(icosahedron(), {3})},
        {"pole 64 without a cap", without_faces(pole(64, 1, 2), {0})},
        {"hexagon", without_faces(prism(6), {0, 1, 2, 3, 4, 5, 6})},
    };
    for (const Index k : {2u, 3u, 4u, 5u, 6u})
        meshes.push_back({"fan of " + std::to_string(k), border_fan(k)});
    for (std::size_t i = 0; i < meshes.size(); ++i)
        meshes[i].data = random_displaced(meshes[i].data, unsigned(i + 1), 0.05);
    return thinned(meshes);
}

namespace {

MeshData scaled(MeshData mesh, double factor) {
    for (Point& p : mesh.positions)
        p *= factor;
    return mesh;
}

/// A grid of 6 x 6 quads, about one wide.
MeshData unit_grid() {
    return scaled(grid(6, 6), 0.2);
}
Index grid_vertex(Index i, Index j) {
    return i * 7 + j;
}

/// The vertices on spoke i of pole(n, k) from the pole on.
std::vector<Index> pole_spoke(Index i, Index k) {
    std::vector<Index> path = {0};
    for (Index a = 1; a <= k; ++a)
        path.push_back(2 + (i * k + (a - 1)) * (k + 1));
    return path;
}

MeshData creased_pole(Index n, const std::vector<Index>& spokes, double sharpness) {
    MeshData mesh = pole(n, 3, 2);
    for (const Index i : spokes)
        add_crease(mesh, pole_spoke(i, 3), sharpness);
    return mesh;
}

std::vector<Index> grid_line(Index i0, Index j0, Index i1, Index j1) {
    std::vector<Index> path;
    for (Index i = i0; i <= i1; ++i) {
        for (Index j = j0; j <= j1; ++j)
            path.push_back(grid_vertex(i, j));
    }
    return path;
}

void set_boundary(MeshData& mesh, int rule) {
    mesh.tags.push_back({"interpolateboundary", {rule}, {}, {}, 0});
}

/// n quads around a vertex.
MeshData one_ring(Index n) {
    MeshData mesh;
    mesh.positions.emplace_back(0, 0, 0.2);
    for (Index i = 0; i < 2 * n; ++i) {
        const double angle = pi * i / n, radius = i % 2 == 0 ? 0.5 : 0.8;
        mesh.positions.emplace_back(radius * std::cos(angle), radius * std::sin(angle),
                                    0);
    }
    for (Index i = 0; i < n; ++i)
        add_face(mesh, {0, 2 * i + 1, 2 * i + 2, (2 * i + 2) % (2 * n) + 1});
    return mesh;
}

/// An n-gon in a ring of quads, one at each side and one at each corner.
MeshData ringed_face(Index n) {
    MeshData mesh;
    const auto ring = [&](double turns, double radius, double z) {
        mesh.positions.emplace_back(radius * std::cos(2 * pi * turns / n),
                                    radius * std::sin(2 * pi * turns / n), z);
    };
    std::vector<Index> face;
    for (Index i = 0; i < n; ++i) {
        face.push_back(4 * i);
        ring(i, 0.4, 0.2);
        ring(i - 0.25, 0.8, 0);  // across the side before the corner
        ring(i, 1, -0.1);
        ring(i + 0.25, 0.8, 0);
    }
    add_face(mesh, face);
    for (Index i = 0; i < n; ++i) {
        const Index c = 4 * i, next = 4 * ((i + 1) % n);
        add_face(mesh, {c, c + 1, c + 2, c + 3});
        add_face(mesh, {next, c, c + 3, next + 1});
    }
    return mesh;
}

std::vector<NamedMesh> sharp_meshes(double s) {
    std::vector<NamedMesh> meshes;
    const auto add = [&](std::string name, MeshData mesh) -> MeshData& {
        const auto seed = static_cast<unsigned>(meshes.size() + 1);
        meshes.push_back(
            {std::move(name), random_displaced(std::move(mesh), seed, 0.04)});
        return meshes.back().data;
    };
    {
        MeshData& mesh = add("cube with a sharp rim", cube());
        add_crease(mesh, {4, 5, 6, 7, 4}, s);
    }
    {
        MeshData& mesh = add("cube of sharp edges", cube());
        for (std::size_t h = 0; h < 24; ++h) {
            const std::size_t next = h % 4 == 3 ? h - 3 : h + 1;
            add_crease(mesh, {mesh.face_vertices[h], mesh.face_vertices[next]}, s);
        }
    }
    {
        MeshData& mesh = add("two darts", unit_grid());
        add_crease(mesh, grid_line(2, 3, 4, 3), s);
        set_boundary(mesh, 1);
    }
    {
        MeshData& mesh = add("crease from the border to a dart", unit_grid());
        add_crease(mesh, grid_line(0, 3, 3, 3), s);
    }
    {
        MeshData& mesh = add("T", unit_grid());
        add_crease(mesh, grid_line(0, 3, 6, 3), s);
        add_crease(mesh, grid_line(3, 3, 3, 6), s);
    }
    {
        MeshData& mesh = add("X", unit_grid());
        add_crease(mesh, grid_line(0, 3, 6, 3), s);
        add_crease(mesh, grid_line(3, 0, 3, 6), s);
        set_boundary(mesh, 1);
    }
    {
        MeshData& mesh = add("bent crease", unit_grid());  // one face and three
        add_crease(mesh, grid_line(0, 3, 3, 3), s);
        add_crease(mesh, grid_line(3, 3, 3, 6), s);
    }
    add("crease of 3 and 3 faces", creased_pole(6, {0, 3}, s));
    add("crease of 4 and 5 faces", creased_pole(9, {0, 4}, s));
    add("crease of 1 and 2 faces", creased_pole(3, {0, 1}, s));
    add("junction of 1, 1 and 3 faces", creased_pole(5, {0, 1, 2}, s));
    {
        MeshData& mesh = add("corner of 2 and 3 faces", creased_pole(5, {0, 2}, s));
        add_corner(mesh, 0, s);
    }
    {
        MeshData& mesh = add("spike of 5 faces", pole(5, 3, 2));
        add_corner(mesh, 0, s);
    }
    {
        MeshData& mesh = add("spike in a grid", unit_grid());
        add_corner(mesh, grid_vertex(3, 3), s);
        set_boundary(mesh, 0);
    }
    {
        MeshData& mesh = add("holes beside a crease", unit_grid());
        add_crease(mesh, grid_line(0, 3, 6, 3), s);
        mesh.tags.push_back({"hole", {2 * 6 + 2}, {}, {}, 0});
        mesh.tags.push_back({"hole", {2 * 6 + 3}, {}, {}, 0});
        mesh.tags.push_back({"hole", {4 * 6 + 3}, {}, {}, 0});
    }
    {
        MeshData& mesh = add("ring around a torus", torus(6, 7));
        add_crease(mesh, {0, 1, 2, 3, 4, 5, 6, 0}, s);
    }
    {
        MeshData& mesh = add("dodecahedron with a crease", dodecahedron());
        const auto& v = mesh.face_vertices;
        add_crease(mesh, {v[0], v[1], v[2], v[3]}, s);
    }
    {
        MeshData& mesh = add("rule none", unit_grid());
        set_boundary(mesh, 0);
    }
    {
        MeshData& mesh = add("ring of 5 quads", one_ring(5));
        set_boundary(mesh, 1);
    }
    {
        MeshData& mesh = add("pentagon in a ring of quads", ringed_face(5));
        set_boundary(mesh, 1);
    }
    {
        MeshData& mesh = add("strip with corners", scaled(grid(5, 1), 0.2));
        set_boundary(mesh, 1);
    }
    return thinned(meshes);
}

}  // namespace

void add_crease(MeshData& mesh, const std::vector<Index>& path, double sharpness) {
    for (std::size_t i = 0; i + 1 < path.size(); ++i) {
        mesh.tags.push_back({"crease",
                             {static_cast<int>(path[i]), static_cast<int>(path[i + 1])},
                             {sharpness},
                             {},
                             0});
    }
}

void add_corner(MeshData& mesh, Index vertex, double sharpness) {
    mesh.tags.push_back({"corner", {static_cast<int>(vertex)}, {sharpness}, {}, 0});
}

std::vector<NamedMesh> creased_meshes() {
    return sharp_meshes(10);
}

std::vector<NamedMesh> semi_sharp_meshes() {
    std::vector<NamedMesh> meshes;
    for (const double s : {0.5, 1.0, 2.5}) {
        for (auto& [name, mesh] : sharp_meshes(s)) {
            meshes.push_back({name + ", sharpness " + std::to_string(s).substr(0, 3),
                              std::move(mesh)});
        }
    }
    return meshes;
}

Topology topology_of(const MeshData& mesh) {
    Result<Topology> built = build_topology(mesh);
    if (!built)
        throw std::runtime_error(built.error().message);
    return std::move(*built);
}

Features features_of(const MeshData& mesh) {
    Result<Features> features = build_features(mesh, topology_of(mesh));
    if (!features)
        throw std::runtime_error(features.error().message);
    return *std::move(features);
}

std::vector<SharpCurve> sharp_curves(const MeshData& mesh) {
    const ResolvedFeatures f = resolve(topology_of(mesh), features_of(mesh));
    const Topology t = topology_of(mesh);
    const auto is_sharp = [&](Index h) { return f.edge(t.edge[h]) >= kInfinitelySharp; };
    const auto n_sharp = [&](Index v) {
        int n = 0;
        t.for_each_edge(v, [&](Index e, Index) { n += f.edge(e) >= kInfinitelySharp; });
        return n;
    };
    const auto is_pinned = [&](Index v) {
        return f.vertex(v) >= kInfinitelySharp || n_sharp(v) > 2;
    };
    // The next sharp halfedge with the same faces on the left.
    const auto onwards = [&](Index h) {
        for (h = t.next(h); !is_sharp(h);)
            h = t.next(t.twin[h]);
        return h;
    };
    std::vector<bool> done(t.n_halfedges(), false);
    std::vector<SharpCurve> curves;
    // From corners and darts first; what is left are rings.
    for (const bool from_ends : {true, false}) {
        for (Index first = 0; first < t.n_halfedges(); ++first) {
            const Index v = t.vertex[first];
            const bool is_end = is_pinned(v) || n_sharp(v) == 1;
            if (done[first] || !is_sharp(first) || (from_ends && !is_end))
                continue;
            SharpCurve c;
            c.polygon.is_closed = !from_ends;
            c.dart_at_start = from_ends && !is_pinned(v);
            c.polygon.points.push_back(mesh.positions[v]);
            for (Index h = first; !done[h]; h = onwards(h)) {
                done[h] = true;
                c.halfedges.push_back(h);
                const Index to = t.to_vertex(h);
                if (!from_ends && onwards(h) == first)
                    continue;
                c.polygon.points.push_back(mesh.positions[to]);
                if (is_pinned(to) || n_sharp(to) == 1) {
                    c.dart_at_end = !is_pinned(to);
                    break;
                }
            }
            curves.push_back(std::move(c));
        }
    }
    return curves;
}

double diagonal(const MeshData& mesh) {
    Point low = mesh.positions.front(), high = low;
    for (const Point& p : mesh.positions) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    return glm::length(high - low);
}

}  // namespace osdx::test
