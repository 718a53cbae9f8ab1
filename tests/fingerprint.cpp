// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

// Prints hashes of all that the library computes for meshes, so that a change of the code can be
// shown to change no bit: run it before and after, and compare. scripts/fingerprint.sh does so
// for folders, with the program's files as well.
//
// Usage: fingerprint [--basis] [MESH...]. Prints a line for each mesh, configuration and thing;
// --basis is for the basis functions, without a mesh. What is refused has the number of its
// ErrorCode and the hash of its message. Lines do not depend on the number of threads, but on
// the instruction set, see GridEvaluator.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <optional>
#include <ranges>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <unistd.h>

#include <osdx/address.h>
#include <osdx/analysis/comparison.h>
#include <osdx/analysis/continuity.h>
#include <osdx/build_patch_table.h>
#include <osdx/build_topology.h>
#include <osdx/evaluator.h>
#include <osdx/face_varying.h>
#include <osdx/features.h>
#include <osdx/files/tessellation_file.h>
#include <osdx/grid_evaluator.h>
#include <osdx/mesh_data.h>
#include <osdx/mesh_file.h>
#include <osdx/openmesh.h>
#include <osdx/patch_class.h>
#include <osdx/patch_table.h>
#include <osdx/resolved_features.h>
#include <osdx/surface.h>
#include <osdx/surface_function.h>
#include <osdx/tessellate.h>
#include <osdx/tessellation.h>
#include <osdx/texture.h>
#include <osdx/topology.h>

#include "eval/bases/bernstein.h"
#include "eval/bases/bspline.h"
#include "eval/bases/generalised_bezier.h"
#include "eval/bases/patch_basis.h"
#include "far/mesh/topology_edits.h"
#include "far/patches/gregory_net.h"
#include "far/refine/grids/even_grids.h"
#include "far/refine/grids/odd_grids.h"
#include "far/refine/refinement.h"

namespace osdx {
namespace {

namespace fs = std::filesystem;

// What is skipped, so that large meshes stay cheap.
constexpr Index kMostFaces = 30000;         // but for degree 3
constexpr Index kMostFacesOfLevels = 5000;  // of the second level, and of fine samples
constexpr Index kMostFacesOfStencils = 2000;
constexpr Index kMostFacesOfDistances = 500;
constexpr Index kMostPatches = 5000;  // of continuity, moves and patches of one class
constexpr std::size_t kMostWeights = 1000000;  // of moves
constexpr double kMostFineEdges = 4000;        // of semi-sharp edges, but for degree 3
constexpr Index kSampledFaces = 40, kSampledPatches = 30;

// ---- Hashes

/// FNV-1a over words of 64 bits instead of bytes, with the high bits mixed back down.
class Hash {
public:
    void word(std::uint64_t w) noexcept {
        value_ = (value_ ^ w) * 0x9e3779b97f4a7c15;
        value_ ^= value_ >> 32;
    }
    std::uint64_t value() const noexcept { return value_; }

private:
    std::uint64_t value_ = 0xcbf29ce484222325;
};

/// Field by field, so that no padding counts; numbers by their bits.
template <class... T>
void put_all(Hash& h, const T&... values);

template <class T>
requires std::is_arithmetic_v<T> || std::is_enum_v<T>
void put(Hash& h, T x) {
    if constexpr (std::same_as<T, double>)
        h.word(std::bit_cast<std::uint64_t>(x));
    else if constexpr (std::same_as<T, float>)
        h.word(std::bit_cast<std::uint32_t>(x));
    else
        h.word(static_cast<std::uint64_t>(x));
}

template <class T>
void put(Hash& h, const Vec2<T>& v) {
    put_all(h, v.x, v.y);
}

template <class T>
void put(Hash& h, const Vec3<T>& v) {
    put_all(h, v.x, v.y, v.z);
}

template <std::ranges::input_range R>
void put(Hash& h, const R& range) {
    h.word(static_cast<std::uint64_t>(std::ranges::distance(range)));
    for (const auto& x : range)
        put(h, x);
}

void put(Hash& h, const Hash& other) {
    h.word(other.value());
}

void put(Hash& h, const Error& e) {
    put_all(h, e.code, e.message, e.element, e.line);
}

void put(Hash& h, const Tag& t) {
    put_all(h, t.name, t.ints, t.floats, t.text, t.line);
}

void put(Hash& h, const MeshData& m) {
    put_all(h, m.positions, m.face_sizes, m.face_vertices, m.uvs, m.face_uvs, m.tags,
            m.vertex_lines, m.face_lines);
}

/// What the topology says, not how it keeps it.
void put(Hash& h, const Topology& t) {
    put_all(h, t.face_offsets, t.vertex, t.twin, t.edge, t.vertex_halfedge, t.n_edges,
            t.quads_only);
    for (Index i = 0; i < t.n_halfedges(); ++i)
        put(h, t.face(i));
}

void put(Hash& h, const Features& f) {
    put_all(h, f.edge_sharpness, f.vertex_sharpness, f.hole, f.boundary, f.creases,
            f.smooth_triangles);
}

void put(Hash& h, const FaceVarying& f) {
    put_all(h, f.rule, f.topology, f.values, f.features);
}

void put(Hash& h, const StencilTable& t) {
    put_all(h, t.offsets, t.indices, t.weights);
}

void put(Hash& h, const Address& a) {
    put_all(h, a.face, a.u, a.v);
}

void put(Hash& h, const QuarterPoint& q) {
    put_all(h, q.quarter, q.x, q.y);
}

void put(Hash& h, const PatchClass& c) {
    put_all(h, c.kind, c.degree, c.n_sectors, c.border, c.normalised);
}

void put(Hash& h, const PatchRef& p) {
    put_all(h, p.patch_class, p.level, p.points);
}

void put(Hash& h, const PatchPoint& p) {
    put_all(h, p.patch, p.sector, p.a, p.b, p.quarter_turns, p.scale);
}

void put(Hash& h, const Cell& c) {
    put_all(h, c.quarter, c.patch, c.origin, c.x_axis, c.sector, c.chart_origin,
            c.chart_size, c.chart_turns);
}

void put(Hash& h, const Change& c) {
    put_all(h, c.points, c.patches, c.faces);
}

void put(Hash& h, const DomainPoint& p) {
    put_all(h, p.sector, p.a, p.b);
}

template <class T, int Order>
void put(Hash& h, const Jet<T, Order>& j) {
    put(h, j.c);
}

template <class T>
void put(Hash& h, const SurfaceJet<T>& s) {
    put_all(h, s.p, s.du, s.dv, s.duu, s.duv, s.dvv);
}

template <class T>
void put(Hash& h, const Curvature<T>& c) {
    put_all(h, c.mean, c.gauss);
}

void put(Hash& h, const TextureJet& t) {
    put_all(h, t.p, t.du, t.dv);
}

void put(Hash& h, const Tessellation& t) {
    put_all(h, t.positions, t.addresses, t.normals, t.facet_sizes, t.facet_faces,
            t.facet_points, t.facet_normals, t.facet_uvs, t.texcoords, t.facet_texcoords);
}

void put(Hash& h, const Continuity& c) {
    put_all(h, c.gap_max, c.normal_jump_deg_max, c.curvature_jump_max, c.curvature_max,
            c.sharp_normal_jump_deg_max, c.n_samples, c.n_sharp_samples, c.worst_gap,
            c.worst_normal, c.worst_curvature, c.worst_sharp_normal);
}

void put(Hash& h, const SurfaceDistance& d) {
    put_all(h, d.distance_max, d.distance_rms, d.normal_deg_max, d.normal_deg_rms,
            d.n_samples);
}

template <class... T>
void put_all(Hash& h, const T&... values) {
    (put(h, values), ...);
}

// ---- Lines

/// Prints lines that begin with the same words.
class Report {
public:
    explicit Report(std::string words) : words_(std::move(words)) {}

    Report of(std::string_view more) const {
        return Report(fmt::format("{} {}", words_, more));
    }

    template <class... T>
    void line(std::string_view thing, const T&... values) const {
        Hash h;
        put_all(h, values...);
        fmt::print("{} {} {:016x}\n", words_, thing, h.value());
    }

    void error(std::string_view thing, const Error& e) const {
        line(fmt::format("{} error={}", thing, static_cast<int>(e.code)), e);
    }

    /// A line, or that of the error.
    template <class T>
    void result(std::string_view thing, const Result<T>& r) const {
        if (r)
            line(thing, *r);
        else
            error(thing, r.error());
    }

private:
    std::string words_;
};

void put(Hash&, const std::monostate&) {}

/// A file that a function writes, and nothing else of it: the folder has no part in the hash.
template <class Write>
void file_line(const Report& report, const std::string& extension, const fs::path& folder,
               Write&& write) {
    const fs::path path = folder / ("file." + extension);
    const Status status = write(path);
    if (!status)
        return report.error(extension, status.error());
    std::ifstream file(path, std::ios::binary);
    report.line(extension, std::string(std::istreambuf_iterator<char>(file), {}));
}

// ---- What is sampled

/// About `n` of the numbers below `size`.
std::vector<Index> spread(Index size, Index n) {
    std::vector<Index> all;
    for (Index i = 0; i < size; i += (size + n - 1) / n)
        all.push_back(i);
    return all;
}

Hash valences(const Topology& t) {
    Hash h;
    for (Index v = 0; v < t.n_vertices(); ++v)
        put(h, t.valence(v));
    return h;
}

/// Points of some faces that have a surface: corners, sides, centres and inside.
std::vector<QuarterPoint> sample_points(const PatchTable& table) {
    constexpr double kAt[][2] = {{0, 0}, {0.5, 0}, {0.3, 0.6}, {1, 0.25}, {1, 1}};
    const Topology& base = table.base();
    std::vector<QuarterPoint> all;
    Index corner = 0;
    for (const Index f : spread(base.n_faces(), kSampledFaces)) {
        if (!table.has_surface(f))
            continue;
        const Index quarter = base.face_offsets[f] + corner++ % base.face_size(f);
        for (const auto& [x, y] : kAt)
            all.push_back({quarter, x, y});
    }
    return all;
}

std::vector<PatchPoint> located(const PatchTable& table) {
    std::vector<PatchPoint> all;
    for (const QuarterPoint& q : sample_points(table))
        all.push_back(table.locate(q));
    return all;
}

std::vector<Index> patches_of_classes(const PatchTable& table) {
    std::vector<Index> n_of_class(table.classes().size());
    for (Index p = 0; p < table.n_patches(); ++p)
        ++n_of_class[table.patch(p).patch_class];
    return n_of_class;
}

/// The first two of each class, and others.
std::vector<Index> sample_patches(const PatchTable& table) {
    std::vector<Index> all = spread(table.n_patches(), kSampledPatches);
    std::vector<int> n_of_class(table.classes().size());
    for (Index p = 0; p < table.n_patches(); ++p) {
        if (n_of_class[table.patch(p).patch_class]++ < 2)
            all.push_back(p);
    }
    return all;
}

/// Inside a domain, on its sides and at its corners; more than kernels take at once.
std::vector<DomainPoint> domain_points(const PatchClass& c) {
    constexpr double kAt[][2] = {{0.2, 0.3},   {0.75, 0.5}, {1, 0.25},   {0, 0},
                                 {1, 1},       {0.5, 1},    {0.999, 1},  {0.4, 0},
                                 {0.125, 0.9}, {0.6, 0.6},  {0.97, 0.98}};
    std::vector<DomainPoint> all;
    int sector = 0;
    for (const auto& [a, b] : kAt)
        all.push_back({c.is_square() ? 0 : sector++ % c.n_sectors, a, b});
    return all;
}

std::vector<PatchPoint> patch_points(const PatchTable& table, Index patch) {
    std::vector<PatchPoint> all;
    for (const auto& [sector, a, b] : domain_points(table.class_of(patch))) {
        const int turns = static_cast<int>(all.size() % 4);
        all.push_back({patch, static_cast<Index>(sector), a, b, turns, 2});
    }
    return all;
}

/// Calls f(order, chart), the order as a constant.
template <class F>
void for_all_charts(F&& f) {
    for (const Chart chart : {Chart::BaseUV, Chart::Native}) {
        f(std::integral_constant<int, 0>(), chart);
        f(std::integral_constant<int, 1>(), chart);
        f(std::integral_constant<int, 2>(), chart);
    }
}

// ---- Patches and their points

void table_lines(const Report& report, const PatchTable& table) {
    Hash patches;
    for (Index p = 0; p < table.n_patches(); ++p)
        put(patches, table.patch(p));
    report.line("table", table.n_base_points(), table.n_points(), table.n_levels(),
                table.degree(), table.row_groups(), table.classes(), table.n_patches(),
                patches);
    report.line("base", table.base(), table.features());
    report.line("rows", table.refined_points());
    Hash whole;
    for (Index f = 0; f < table.base().n_faces(); ++f)
        put(whole, table.whole_patch(f));
    report.line("cells", table.cells(), whole);
}

void locate_line(const Report& report, const PatchTable& table) {
    Hash h;
    for (const QuarterPoint& q : sample_points(table)) {
        const Address a = to_address(table.base(), q);
        put_all(h, table.locate(q), table.locate(q, {2, 2}), table.locate(a),
                table.locate(Address{a.face, a.v, 1.25 * a.u}));
    }
    report.line("locate", h);
}

template <class T>
std::vector<Vec3<T>> points_as(const Surface& surface) {
    const PatchTable& table = surface.patches();
    std::vector<Vec3<T>> points(table.n_points());
    std::copy_n(surface.points().begin(), table.n_base_points(), points.begin());
    table.refresh_points<T>(points);
    return points;
}

constexpr int kChannels = 4;

template <class T>
std::vector<T> channels_as(const Surface& surface) {
    const PatchTable& table = surface.patches();
    std::vector<T> values;
    for (const Vec3<double>& p : surface.points().first(table.n_base_points())) {
        for (const double x : {p.x, p.y, p.z, 0.25 * p.x * p.y - p.z})
            values.push_back(static_cast<T>(x));
    }
    values.resize(std::size_t(kChannels) * table.n_points());
    table.refresh_channels<T>(kChannels, values);
    return values;
}

// ---- Evaluation

void weights_line(const Report& report, const Evaluator& evaluator) {
    const PatchTable& table = evaluator.table();
    std::vector<PatchPoint> places = located(table);
    for (const Index p : sample_patches(table)) {
        const std::vector<PatchPoint> in_patch = patch_points(table, p);
        places.push_back(in_patch[p % in_patch.size()]);
    }
    Hash h;
    std::vector<double> weights;
    for_all_charts([&](auto order, Chart chart) {
        for (const PatchPoint& p : places) {
            weights.resize(n_derivatives(order) * table.patch(p.patch).points.size());
            evaluator.weights(p, order, chart, weights);
            put(h, weights);
        }
    });
    report.line("weights", h);
}

template <class T>
Hash evaluated(const Evaluator& evaluator, std::span<const Vec3<T>> points) {
    Hash h;
    const std::vector<PatchPoint> places = located(evaluator.table());
    for_all_charts([&](auto order, Chart chart) {
        for (const PatchPoint& p : places) {
            const auto s = evaluator.evaluate<T, order()>(points, p, chart);
            put_all(h, s, normal(s), curvature(s));
        }
    });
    return h;
}

template <class T>
Hash evaluated_many(const Evaluator& evaluator, std::span<const Vec3<T>> points) {
    Hash h;
    for (const Index patch : sample_patches(evaluator.table())) {
        const std::vector<PatchPoint> places = patch_points(evaluator.table(), patch);
        std::vector<SurfaceJet<T>> jets(places.size());
        for_all_charts([&](auto order, Chart chart) {
            evaluator.evaluate_many<T, order()>(points, places, chart, jets);
            put(h, jets);
        });
    }
    return h;
}

template <class T>
Hash evaluated_channels(const Evaluator& evaluator, std::span<const T> values) {
    Hash h;
    const std::vector<PatchPoint> places = located(evaluator.table());
    for_all_charts([&](auto order, Chart chart) {
        std::vector<T> out(n_derivatives(order) * kChannels);
        for (const PatchPoint& p : places) {
            evaluator.evaluate_channels<T>(values, kChannels, p, order, chart, out);
            put(h, out);
        }
    });
    return h;
}

/// How buffers are laid out.
enum class Layout : std::uint8_t { Structures, Arrays, Gaps };

template <class T>
Hash evaluated_grid(const GridEvaluator<T>& grid, std::span<const Vec3<T>> points,
                    Layout layout) {
    const std::size_t n = grid.n_samples(),
                      n_values = layout == Layout::Gaps ? 5 * n : 3 * n;
    std::vector<std::vector<T>> values(n_derivatives(grid.order()));
    SampleBuffers<T> out;
    for (std::size_t r = 0; r < values.size(); ++r) {
        values[r].resize(n_values);
        out[r].data = values[r].data();
        out[r].sample_stride = layout == Layout::Structures ? 3
                               : layout == Layout::Arrays   ? 1
                                                            : 5;
        out[r].channel_stride =
            layout == Layout::Arrays ? static_cast<std::ptrdiff_t>(n) : 1;
    }
    grid.evaluate(points, out);
    Hash h;
    put_all(h, grid.n_units(), grid.first_sample(grid.n_units() / 2), n, values);
    return h;
}

template <class T>
Hash evaluated_blocks(const GridEvaluator<T>& grid, std::span<const Vec3<T>> points) {
    const std::size_t n = 3 * grid.n_samples();
    std::vector<std::vector<T>> values(n_derivatives(grid.order()), std::vector<T>(n));
    grid.for_each_block(points, [&](const SampleBlock<T>& block) {
        for (std::size_t r = 0; r < values.size(); ++r)
            std::copy_n(block.values[r], 3 * block.n_samples,
                        values[r].begin() + 3 * block.first_sample);
    });
    Hash h;
    put(h, values);
    return h;
}

/// All layouts and ways to the values: by tables, past the caches, point by point.
template <class T>
void grid_lines(const Report& report, const Evaluator& evaluator,
                std::span<const Vec3<T>> points) {
    const bool fine = evaluator.table().base().n_faces() <= kMostFacesOfLevels;
    const GridEvaluator<T> even(evaluator, fine ? 4 : 2, {.order = 2});
    report.line("grid even", evaluated_grid(even, points, Layout::Structures),
                evaluated_blocks(even, points));
    const GridEvaluator<T> odd(evaluator, fine ? 3 : 1, {.native_at_borders = true});
    report.line("grid odd", evaluated_grid(odd, points, Layout::Arrays));
    const GridEvaluator<T> streamed(evaluator, 2,
                                    {.min_table_uses = 3, .stream_bytes = 0});
    report.line("grid streamed", evaluated_grid(streamed, points, Layout::Structures));
    const GridEvaluator<T> single(evaluator, fine ? 2 : 1,
                                  {.order = 2, .max_table_bytes = 0});
    report.line("grid single", evaluated_grid(single, points, Layout::Gaps));
    Hash h;
    const auto classes = evaluator.table().classes();
    const std::vector<Index> n_of_class = patches_of_classes(evaluator.table());
    for (Index c = 0; c < classes.size(); ++c) {
        if (n_of_class[c] > kMostPatches)
            continue;
        const GridEvaluator<T> grid(evaluator, c, domain_points(classes[c]),
                                    {.order = 2});
        put(h, evaluated_grid(grid, points, Layout::Structures));
    }
    report.line("grid classes", h);
}

template <class T>
void evaluation_lines(const Report& report, const Surface& surface) {
    const Evaluator& evaluator = surface.evaluator();
    const std::vector<Vec3<T>> points = points_as<T>(surface);
    const std::vector<T> channels = channels_as<T>(surface);
    report.line("points", points);
    report.line("channels", channels);
    const std::span<const Vec3<T>> net(points);
    report.line("evaluate", evaluated<T>(evaluator, net));
    report.line("evaluate_many", evaluated_many<T>(evaluator, net));
    report.line("evaluate_channels", evaluated_channels<T>(evaluator, channels));
    grid_lines<T>(report, evaluator, net);
}

// ---- Surfaces

void base_weights_line(const Report& report, const Surface& surface) {
    Hash h;
    const std::vector<QuarterPoint> places = sample_points(surface.patches());
    for (const Index i : spread(static_cast<Index>(places.size()), 8)) {
        std::vector<double> weights(surface.base().n_vertices());
        surface.add_base_weights(to_address(surface.base(), places[i]),
                                 static_cast<int>(i % 6), 0.5, weights);
        put(h, weights);
    }
    report.line("base_weights", h);
}

void tessellation_lines(const Report& report, const Surface& surface) {
    const Topology& base = surface.base();
    const bool fine = base.n_faces() <= kMostFacesOfLevels;
    report.line("tessellate even", surface.tessellate(fine ? 4 : 2));
    report.line("tessellate odd", surface.tessellate(fine ? 3 : 1));
    report.line("tessellate uv", tessellate(base, surface.features(), fine ? 2 : 1,
                                            surface_function(surface)));
    const Tessellation native =
        tessellate(base, surface.features(), 1, surface_function(surface, Chart::Native));
    report.line("tessellate native", native, triangles(native));
}

/// Moves some vertices; the last thing to ask of a surface.
void move_lines(const Report& report, Surface& surface) {
    const PatchTable& table = surface.patches();
    if (table.n_patches() > kMostPatches ||
        table.refined_points().weights.size() > kMostWeights)
        return;
    const std::vector<Index> vertices = spread(surface.base().n_vertices(), 5);
    std::vector<Vec3<double>> positions;
    for (const Index v : vertices)
        positions.push_back(1.125 * surface.points()[v] + Vec3<double>(0.25, 0, -0.5));
    report.result("move", surface.move_vertices(vertices, positions));
    report.line("moved", surface.points());
}

constexpr FaceVaryingRule kRules[] = {
    FaceVaryingRule::None,         FaceVaryingRule::CornersOnly,
    FaceVaryingRule::CornersPlus1, FaceVaryingRule::CornersPlus2,
    FaceVaryingRule::Boundaries,   FaceVaryingRule::All};

/// Texture coordinates on the faces of a surface; by each rule for low degrees.
void texture_lines(const Report& report, const MeshData& mesh, const Surface& surface,
                   const FeatureOptions& features) {
    std::vector<std::optional<FaceVaryingRule>> rules = {std::nullopt};
    for (const FaceVaryingRule rule : kRules) {
        if (surface.patches().degree() <= 3 || rule == FaceVaryingRule::CornersPlus1)
            rules.emplace_back(rule);
    }
    Tessellation t = surface.tessellate(2);
    for (const auto& rule : rules) {
        const std::string thing =
            rule ? fmt::format("texture rule={}", static_cast<int>(*rule)) : "texture";
        const auto texture = TextureSurface::build(surface, mesh, features, rule);
        if (!texture) {
            report.error(thing, texture.error());
            continue;
        }
        Hash h;
        for (const QuarterPoint& q : sample_points(surface.patches()))
            put(h, texture->evaluate(q));
        texture->add_to(t, 2);
        report.line(thing, texture->channel(), h, t.texcoords, t.facet_texcoords);
    }
}

void surface_lines(const Report& report, const MeshData& mesh,
                   const PatchTableOptions& patches, const FeatureOptions& features) {
    Result<Surface> surface = Surface::build(mesh, patches, features);
    if (!surface)
        return report.error("surface", surface.error());
    table_lines(report, surface->patches());
    locate_line(report, surface->patches());
    report.line("points", surface->points(), surface->unused_vertices());
    weights_line(report, surface->evaluator());
    evaluation_lines<double>(report.of("double"), *surface);
    evaluation_lines<float>(report.of("float"), *surface);
    base_weights_line(report, *surface);
    tessellation_lines(report, *surface);
    if (surface->patches().n_patches() <= kMostPatches)
        report.line("continuity", measure_continuity(*surface, 2));
    if (!mesh.face_uvs.empty() && patches.family == PatchFamily::Multisided)
        texture_lines(report, mesh, *surface, features);
    move_lines(report, *surface);
}

/// The tessellation with texture coordinates, as files.
void export_lines(const Report& report, const MeshData& mesh, const fs::path& folder) {
    const Result<Surface> surface = Surface::build(mesh);
    if (!surface)
        return;
    Tessellation t = surface->tessellate(3);
    const auto write = [&](const Report& r) {
        for (const char* extension : {"obj", "ply", "stl", "glb"}) {
            file_line(r, extension, folder,
                      [&](const fs::path& path) { return write_tessellation(path, t); });
        }
    };
    write(report.of("write_tessellation"));
    const auto texture = TextureSurface::build(*surface, mesh);
    if (!texture)
        return;
    texture->add_to(t, 3);
    write(report.of("write_tessellation texcoords"));
}

/// Both families of degree 3 against each other.
void distance_line(const Report& report, const MeshData& mesh) {
    const auto a = Surface::build(mesh);
    const auto b = Surface::build(mesh, {.family = PatchFamily::Gregory});
    if (!a || !b || a->base().n_faces() > kMostFacesOfDistances)
        return;
    report.result("distance", measure_distance(a->base(), a->features(),
                                               surface_function(*a), surface_function(*b),
                                               2, bounding_diagonal(mesh.positions)));
}

// ---- Refinement

template <class V, class Refinement>
Hash refined_points(const Refinement& refinement, const MeshData& mesh,
                    Index n_vertices) {
    std::vector<V> base, out(n_vertices);
    for (const Vec3<double>& p : mesh.positions)
        base.push_back(V(p));
    refinement.points(std::span<const V>(base), std::span(out));
    Hash h;
    put(h, out);
    return h;
}

template <class Refinement>
void refined_points_line(const Report& report, const Refinement& refinement,
                         const MeshData& mesh, Index n_vertices) {
    report.line("points", refined_points<Vec3<double>>(refinement, mesh, n_vertices),
                refined_points<Vec3<float>>(refinement, mesh, n_vertices),
                refined_points<Vec2<double>>(refinement, mesh, n_vertices),
                refined_points<Vec2<float>>(refinement, mesh, n_vertices));
}

void uniform_lines(const Report& report, const MeshData& mesh, const Topology& base,
                   const Features& features, int degree, int levels) {
    const OddGrids refinement(base, degree, levels, features);
    const QuadGrids grids = refinement.grids();
    refined_points_line(report, refinement, mesh, grids.n_vertices());
    Hash places;
    for (const Index root : spread(grids.roots.n_faces(), kSampledFaces))
        put_all(places, refinement.address(root, 0.25, 0.75));
    for (const Index halfedge : spread(grids.n_halfedges(), kSampledFaces))
        put(places, refinement.from_split(halfedge));
    std::vector<Index> vertices(grids.n_halfedges());
    face_vertices(grids, vertices);
    report.line("topology", to_topology(grids), vertices, places);
    report.line("features", refinement.features());
}

void dual_lines(const Report& report, const MeshData& mesh, const Topology& base,
                const Features& features, int degree, int levels) {
    if (!EvenGrids::takes(features))
        return;
    const EvenGrids refinement(base, degree, levels, features);
    refined_points_line(report, refinement, mesh, refinement.n_vertices());
    std::vector<Index> sizes(refinement.n_faces()), vertices(refinement.n_halfedges());
    refinement.faces(sizes, vertices);
    report.line("topology", refinement.base(), sizes, vertices,
                refinement.n_border_edges());
    report.line("features", refinement.features());
}

void level_lines(const Report& report, const Refinement& refinement, int level) {
    const RefinedLevel& l = refinement.level(level);
    report.line("topology", l.topology, valences(l.topology), l.children,
                l.even ? l.even->corner_halfedges : std::vector<Index>());
    report.line("features", l.features);
    Hash factors;
    for (const StencilTable& t : refinement.factors(level))
        put(factors, t);
    report.line("factors", factors);
}

/// A part of the mesh, and a part of that.
void partial_lines(const Report& report, const Topology& base, const Features& features,
                   int degree) {
    Refinement refinement(base, degree, features);
    for (int level = 1; level <= 2; ++level) {
        Flags keep(refinement.topology(level - 1).n_faces());
        for (std::size_t f = 0; f < keep.size(); ++f)
            keep[f] = f % 5 != 0;
        refinement.add_level(keep);
        const RefinedLevel& l = refinement.level(level);
        level_lines(report.of(fmt::format("level={}", level)), refinement, level);
        report.line(fmt::format("level={} known", level), l.gap, l.known);
    }
}

void refinement_lines(const Report& report, const MeshData& mesh, const Topology& base,
                      const Features& features, int degree) {
    if (const Status s = check_refinement(mesh, base, features, degree); !s)
        return report.error("refinement", s.error());
    const int n_levels = base.n_faces() <= kMostFacesOfLevels ? 2 : 1;
    Refinement refinement(base, degree, features);
    for (int level = 1; level <= n_levels; ++level) {
        refinement.add_level();
        const std::string at = fmt::format("level={}", level);
        const Report r = report.of("refinement " + at);
        level_lines(r, refinement, level);
        r.line("points", refinement.points(mesh.positions));
        if (base.n_faces() * (level == 1 ? 1 : 8) <= kMostFacesOfStencils)
            r.line("stencils", refinement.stencils());
        if (degree % 2 == 1)
            uniform_lines(report.of("uniform " + at), mesh, base, features, degree,
                          level);
        else
            dual_lines(report.of("dual " + at), mesh, base, features, degree, level);
    }
    if (base.n_faces() <= kMostFacesOfDistances)
        partial_lines(report.of("partial"), base, features, degree);
}

// ---- Meshes

void write_lines(const Report& report, const MeshData& mesh, const fs::path& folder) {
    for (const std::string extension : {"obj", "off", "ply"}) {
        file_line(report, extension, folder,
                  [&](const fs::path& path) { return write_mesh(path, mesh); });
        report.result(extension + " read", read_mesh(folder / ("file." + extension)));
    }
}

void topology_lines(const Report& report, const MeshData& mesh, const Topology& t) {
    report.line("topology", t, valences(t), has_only_quads(t), border_halfedges(t));
    std::vector<Index> map;
    const Topology other = dual(t, &map);
    report.line("topology split", split(t), split_stencils(t));
    report.line("topology dual", other, map);
    Flags part(t.n_faces());
    for (const Index f : spread(t.n_faces(), 3))
        part[f] = 1;
    const Submesh sub = submesh(t, grown(t, part));
    report.line("topology submesh", sub.topology, sub.vertices, sub.halfedges, sub.edges,
                sub.faces);
    Hash places;
    for (const Index q : spread(t.n_halfedges(), kSampledFaces)) {
        const Address a = to_address(t, {q, 0.375, 0.75});
        put_all(places, a, to_quarter(t, a), quarter_turns(t, q),
                edge_point(t, q, 0.125));
        for (int side = 0; side < 4; ++side)
            put_all(places, cross_side(t, {q, 0.5, 0.25}, side),
                    halfedge_of_side(t, q, side));
    }
    report.line("topology places", places);
    const Result<Mesh> open_mesh = build_mesh(mesh);
    if (open_mesh)
        report.line("openmesh", *to_mesh_data(*open_mesh), build_topology(*open_mesh));
}

/// What makes a mesh one that is refused.
struct Damage {
    const char* name;
    void (*apply)(MeshData&);
};

constexpr Damage kDamages[] = {
    {"no number",
     [](MeshData& m) {
         m.positions.back().y = std::numeric_limits<double>::quiet_NaN();
     }},
    {"no vertex",
     [](MeshData& m) {
         m.face_vertices.back() = static_cast<Index>(m.positions.size());
     }},
    {"repeated vertex",
     [](MeshData& m) { m.face_vertices.back() = m.face_vertices.end()[-2]; }},
    {"sizes", [](MeshData& m) { ++m.face_sizes.back(); }},
    {"turned face",
     [](MeshData& m) {
         std::reverse(m.face_vertices.begin(), m.face_vertices.begin() + m.face_sizes[0]);
     }},
    {"doubled face",
     [](MeshData& m) {
         m.face_sizes.push_back(m.face_sizes[0]);
         for (Index i = 0; i < m.face_sizes[0]; ++i)
             m.face_vertices.push_back(m.face_vertices[i]);
         m.face_lines.clear();
     }},
    {"no texcoord", [](MeshData& m) { m.face_uvs.assign(1, 0); }},
    {"no edge",
     [](MeshData& m) {
         m.tags.push_back({"crease", {0, -1}, {2.0}, {}, 7});
     }},
    {"unknown tag",
     [](MeshData& m) {
         m.tags.push_back({"edgeedit", {}, {}, {}, 8});
     }},
};

void refusal_lines(const Report& report, const MeshData& mesh) {
    for (const Damage& damage : kDamages) {
        MeshData m = mesh;
        damage.apply(m);
        const auto surface = Surface::build(m);
        if (surface)
            report.line(damage.name, surface->points());
        else
            report.error(damage.name, surface.error());
    }
}

/// How the tags of a mesh are taken.
struct TagChoice {
    std::string name;
    bool ignore_tags = false;
    std::optional<BoundaryRule> boundary = {};
};

std::vector<TagChoice> tag_choices(const MeshData& mesh, const Topology& t) {
    std::vector<TagChoice> all = {{"tags=yes"}};
    if (!mesh.tags.empty())
        all.push_back({"tags=no", true});
    if (border_halfedges(t).empty())
        return all;
    all.push_back({"boundary=none", false, BoundaryRule::None});
    all.push_back({"boundary=edge-only", false, BoundaryRule::EdgeOnly});
    all.push_back({"boundary=edge-and-corner", false, BoundaryRule::EdgeAndCorner});
    return all;
}

void feature_lines(const Report& report, const MeshData& mesh, const Topology& t,
                   const Features& features) {
    const ResolvedFeatures whole = resolve(t, features);
    report.line("features", features, whole);
    report.line("tags", to_tags(t, features));
    report.result("check_gregory", check_gregory(mesh, t, whole));
    for (int d = kMinDegree; d <= 3; ++d)
        report.result(fmt::format("check d={}", d), check_surface(mesh, t, features, d));
    if (mesh.face_uvs.empty())
        return;
    for (const FaceVaryingRule rule : kRules) {
        report.result(fmt::format("face_varying rule={}", static_cast<int>(rule)),
                      build_face_varying(t, features, mesh.face_uvs, rule));
    }
}

struct GregoryChoice {
    const char* name;
    GregoryOptions options;
};

constexpr GregoryChoice kGregoryChoices[] = {
    {"levels=0", {}},
    {"levels=0 paper", {.paper_tangents = true}},
    {"levels=0 normalised", {.normalised = true}},
    {"levels=1", {.levels = 1}},
    {"levels=1 uniform", {.levels = 1, .uniform = true}},
    {"levels=1 paper normalised",
     {.levels = 1, .paper_tangents = true, .normalised = true}},
};

void gregory_lines(const Report& report, const MeshData& mesh, const TagChoice& tags,
                   std::span<const GregoryChoice> choices) {
    for (const GregoryChoice& c : choices) {
        surface_lines(report.of(fmt::format("d=3 gregory {} {}", c.name, tags.name)),
                      mesh, {.family = PatchFamily::Gregory, .gregory = c.options},
                      {tags.ignore_tags, tags.boundary});
    }
}

/// What semi-sharp edges become where their sharpness ends, which all are refined to.
double n_fine_edges(const Features& features) {
    double n = 0;
    for (const double s : features.edge_sharpness)
        n += is_semi_sharp(s) ? std::exp2(s) : 0;
    return n;
}

void choice_lines(const Report& report, const MeshData& mesh, const Topology& t,
                  const Features& features, const TagChoice& tags) {
    feature_lines(report.of(tags.name), mesh, t, features);
    const bool deep = n_fine_edges(features) > kMostFineEdges;
    for (int d = 2; d <= 7; ++d) {
        const std::string degree = fmt::format("d={}", d);
        if (d != 3 && t.n_faces() > kMostFaces)
            continue;
        refinement_lines(report.of(degree + " " + tags.name), mesh, t, features, d);
        if (d != 3 && deep)
            continue;
        surface_lines(report.of(degree + " multisided " + tags.name), mesh, {.degree = d},
                      {tags.ignore_tags, tags.boundary});
    }
    gregory_lines(
        report, mesh, tags,
        std::span(kGregoryChoices).first(deep ? 1 : std::size(kGregoryChoices)));
}

/// All ways to take the tags; nothing twice where two of them are the same.
void choices_lines(const Report& report, const MeshData& mesh, const Topology& t) {
    std::vector<Features> done;
    for (const TagChoice& tags : tag_choices(mesh, t)) {
        const Result<Features> features =
            build_features(mesh, t, {tags.ignore_tags, tags.boundary});
        report.result(tags.name, features);
        if (!features || std::ranges::find(done, *features) != done.end())
            continue;
        choice_lines(report, mesh, t, *features, tags);
        done.push_back(*features);
    }
}

void mesh_lines(const fs::path& file, const fs::path& folder) {
    const Report report(file.filename().string());
    const Result<MeshData> mesh = read_mesh(file);
    report.result("read", mesh);
    if (!mesh)
        return;
    write_lines(report.of("write_mesh"), *mesh, folder);
    refusal_lines(report.of("damage"), *mesh);
    report.result("face_varying_rule", face_varying_rule(*mesh));
    const Result<Topology> topology = build_topology(*mesh);
    if (!topology)
        return report.error("topology", topology.error());
    topology_lines(report, *mesh, *topology);
    choices_lines(report, *mesh, *topology);
    export_lines(report, *mesh, folder);
    distance_line(report, *mesh);
}

// ---- Basis functions

std::vector<PatchClass> patch_classes(int degree) {
    std::vector<PatchClass> all = {{PatchKind::Regular, degree}};
    for (const PatchKind kind : {PatchKind::EV, PatchKind::EF}) {
        for (const int n : {3, 5, 6, 8, 9, 12})
            all.push_back({kind, degree, n});
        for (const int n : {1, 2, 3, 4, 5}) {
            all.push_back({kind, degree, n, PatchBorder::Smooth});
            all.push_back({kind, degree, n, PatchBorder::Pinned});
        }
        for (const int n : {3, 4, 5})
            all.push_back({kind, degree, n, PatchBorder::Spike});
    }
    for (int n = 3; degree == 3 && n <= 9; ++n) {
        all.push_back({PatchKind::Gregory, degree, n});
        all.push_back({PatchKind::Gregory, degree, n, PatchBorder::None, true});
    }
    return all;
}

/// The weights of all points, as sums of their contributions.
template <int Order, class Basis>
Hash weights_of(const Basis& basis, int n_points, const DomainPoint& p, Chart chart) {
    std::vector<Jet<double, Order>> weights(n_points);
    const auto f = basis.template for_each_weight<Order>(
        p, chart, [&](Index i, const Jet<double, Order>& w) { weights[i] += w; });
    Hash h;
    put_all(h, weights, f);
    return h;
}

void class_line(const Report& report, const PatchClass& c) {
    const PatchBasis basis(c);
    Hash h;
    for (const DomainPoint& p : domain_points(c)) {
        const Vec2<double> xy = basis.to_native(p);
        put_all(h, xy, basis.from_native(xy));
        for_all_charts([&](auto order, Chart chart) {
            put(h, weights_of<order()>(basis, c.n_points(), p, chart));
        });
    }
    report.line(
        fmt::format("kind={} n={} border={} normalised={}", static_cast<int>(c.kind),
                    c.n_sectors, static_cast<int>(c.border), int(c.normalised)),
        h);
}

void generalised_line(const Report& report, int degree, int n, CentrePoint centre) {
    const GeneralisedBezierBasis basis(n, degree, centre);
    Hash h;
    for (const DomainPoint& p : domain_points({PatchKind::EV, degree, n})) {
        for_all_charts([&](auto order, Chart chart) {
            put(h,
                weights_of<order()>(basis, static_cast<int>(basis.n_points()), p, chart));
        });
    }
    report.line(fmt::format("generalised n={} centre={}", n, int(centre)), h);
}

template <class T>
void spline_line(const Report& report, std::string_view type, int degree) {
    Hash h;
    std::vector<T> values(3 * (degree + 1));
    for (const T u : {T(0), T(0.3), T(0.5), T(1)}) {
        bspline_basis<T>(degree, u, 2, values);
        put(h, values);
        bernstein_basis<T>(degree, u, 2, values);
        put(h, values);
    }
    report.line(type, h);
}

void basis_lines() {
    for (int d = kMinDegree; d <= kMaxDegree; ++d) {
        const Report report(fmt::format("basis d={}", d));
        spline_line<double>(report, "double", d);
        spline_line<float>(report, "float", d);
        for (const PatchClass& c : patch_classes(d))
            class_line(report, c);
        for (int n = 3; n <= 6; ++n) {
            generalised_line(report, d, n, CentrePoint::Given);
            generalised_line(report, d, n, CentrePoint::None);
        }
    }
}

/// A folder that goes when this does.
class TemporaryFolder {
public:
    TemporaryFolder()
        : path_(fs::temp_directory_path() /
                fmt::format("osdx_fingerprint_{}", getpid())) {
        fs::create_directories(path_);
    }
    ~TemporaryFolder() { fs::remove_all(path_); }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    const fs::path& path() const noexcept { return path_; }

private:
    fs::path path_;
};

}  // namespace
}  // namespace osdx

int main(int argc, char** argv) {
    if (argc < 2) {
        std::fputs("usage: fingerprint [--basis] [MESH...]\n", stderr);
        return 2;
    }
    const osdx::TemporaryFolder folder;
    for (int i = 1; i < argc; ++i) {
        if (std::string_view(argv[i]) == "--basis")
            osdx::basis_lines();
        else
            osdx::mesh_lines(argv[i], folder.path());
    }
    return 0;
}
