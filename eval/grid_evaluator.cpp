// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <new>
#include <numeric>
#include <utility>
#include <vector>

#include <osdx/buffer.h>
#include <osdx/grid_evaluator.h>
#include <osdx/topology.h>

#include <hwy/cache_control.h>

#include "eval/bases/bspline.h"
#include "eval/bases/gregory.h"
#include "eval/grid_tiles.h"
#include "eval/kernels/grid.h"
#include "eval/turn.h"
#include "far/parallel.h"

namespace osdx::inline OSDX_ABI {
namespace {

using grid::Shape;
using grid::ShapeSet;
using grid::Tile;

/// Memory for vectors of any instruction set. Not initialised.
template <class T>
class AlignedArray {
public:
    explicit AlignedArray(std::size_t size = 0)
        : data_(size == 0 ? nullptr
                          : static_cast<T*>(::operator new(size * sizeof(T), kAlign))) {}
    T* data() const noexcept { return data_.get(); }

private:
    static constexpr std::align_val_t kAlign{grid::kPanelBytes};
    struct Delete {
        void operator()(T* p) const noexcept { ::operator delete(p, kAlign); }
    };
    std::unique_ptr<T, Delete> data_;
};

/// Control points that are turned with the sectors: sector k's are those of sector 0, k shift
/// places on in a ring.
struct Ring {
    int first = 0, size = 0, shift = 0;
};
std::array<Ring, 2> rings(const PatchClass& c) noexcept {
    const int n = c.n_sectors, d = c.degree;
    if (c.is_open() || c.is_square())
        return {};
    switch (c.kind) {
        case PatchKind::EV:
            return {{{1, n * (d - 1), d - 1},
                     {1 + n * (d - 1), n * (d - 1) * (d - 1), (d - 1) * (d - 1)}}};
        case PatchKind::EF:
            return {{{0, n * d * d, d * d}, {}}};
        default:
            return {{{0, GregoryBasis::kPerCorner * n, GregoryBasis::kPerCorner}, {}}};
    }
}

/// Weights far below the rounding of T become 0: denormal numbers are slow, and so would be
/// their products.
template <class T>
T to_weight(double w) noexcept {
    constexpr double eps = std::numeric_limits<T>::epsilon();
    return std::abs(w) < std::numeric_limits<T>::min() / (eps * eps) ? T(0)
                                                                     : static_cast<T>(w);
}

/// The control points of a patch as if `sector` were sector 0.
void turn_points(std::span<const Index> points, const std::array<Ring, 2>& rings,
                 Index sector, Index* out) noexcept {
    std::ranges::copy(points, out);
    for (const Ring& ring : rings) {
        const auto first = points.begin() + ring.first;
        std::rotate_copy(first, first + static_cast<int>(sector) * ring.shift,
                         first + ring.size, out + ring.first);
    }
}

}  // namespace

template <class T>
struct GridEvaluator<T>::Plan {
    const Evaluator* evaluator;
    GridOptions options;
    int rate = 1;
    std::vector<DomainPoint> domain_points;    // units are patches: all of their samples
    std::vector<std::size_t> first_sample{0};  // by unit
    // Blocks are whole units; their tiles are sorted by shape.
    std::vector<Index> first_unit{0}, first_tile{0};
    std::vector<Tile> tiles;
    Buffer<Index> turned_points;  // of tiles whose sector is not 0
    std::vector<Shape> shapes;
    // By shape. Without weights where there is no table.
    std::vector<grid::Table<T>> tables;
    AlignedArray<T> weights;
    std::size_t n_weights = 0;
    std::size_t n_single_samples = 0;
    // Elements of scratch memory: for a tile, a derivative in a block.
    std::size_t tile_space = 0, block_space = 0;

    const PatchTable& table() const noexcept { return evaluator->table(); }
    int n_values() const noexcept { return n_derivatives(options.order); }
    Chart chart(const PatchClass& c) const noexcept {
        return options.native_at_borders && c.is_open() ? Chart::Native : Chart::BaseUV;
    }

    /// A sample of a tile of this shape, as if its sector were that of the shape.
    PatchPoint place(const Shape& shape, Index patch, int i, int j) const noexcept {
        if (!domain_points.empty()) {
            const DomainPoint& p = domain_points[i];
            return {patch, static_cast<Index>(p.sector), p.a, p.b, 0, 1.0};
        }
        const double extent = table().classes()[shape.patch_class].extent();
        const auto at =
            shape.origin + shape.step * turn(Vec2<std::int64_t>(i, j), shape.turns);
        return {patch,
                shape.sector,
                double(at.x) / (rate * extent),
                double(at.y) / (rate * extent),
                shape.turns,
                double(shape.step) / extent};
    }

    std::size_t n_blocks() const noexcept { return first_unit.size() - 1; }

    /// Patches that go to a kernel at a time.
    static constexpr std::size_t kMaxBatch = 16;

    void make_tables();
    void turn_sectors();
    void make_full(const Shape& shape, const grid::Table<T>& t, Index patch,
                   T* out) const;
    void make_product(const Shape& shape, const grid::Table<T>& t, T* out) const;
    /// \param first_tile_of  by unit, whose tiles follow one another
    void make_blocks(const std::vector<Index>& first_tile_of);

    std::size_t block_size(std::size_t b) const noexcept {
        return first_sample[first_unit[b + 1]] - first_sample[first_unit[b]];
    }
    /// Of a thread: for the values of a tile and of a block.
    struct Scratch {
        AlignedArray<T> values, block;
    };
    SampleBuffers<T> block_buffers(const Scratch& local) const noexcept {
        SampleBuffers<T> buffers;
        for (int r = 0; r < n_values(); ++r)
            buffers[r].data = local.block.data() + r * block_space;
        return buffers;
    }
    grid::Layout layout(const SampleBuffers<T>& buffers) const noexcept {
        const auto all = std::span(buffers).first(n_values());
        if (std::ranges::all_of(all, [](const SampleBuffer<T>& b) {
                return b.sample_stride == 3 && b.channel_stride == 1;
            }))
            return grid::Layout::Interleaved;
        return std::ranges::all_of(
                   all, [](const SampleBuffer<T>& b) { return b.sample_stride == 1; })
                   ? grid::Layout::Planar
                   : grid::Layout::Any;
    }
    /// Calls f(scratch, block) for all blocks.
    template <class F>
    void for_each_local(bool with_block, F&& f) const {
        detail::PerThread<Scratch> scratch([&] {
            return Scratch{AlignedArray<T>(tile_space),
                           AlignedArray<T>(with_block ? block_space * n_values() : 0)};
        });
        detail::for_each_range(n_blocks(), 1, [&](std::size_t begin, std::size_t end) {
            const Scratch& local = scratch.local();
            for (std::size_t b = begin; b < end; ++b)
                f(local, b);
        });
    }
    /// \param out  of the first sample of the block on
    void evaluate_block(std::span<const Vec3<T>> points, std::size_t block,
                        const SampleBuffers<T>& out, const Scratch& scratch) const;
    void evaluate_single(std::span<const Vec3<T>> points, const Tile& tile,
                         const grid::Target<T>& target) const;
};

template <class T>
void GridEvaluator<T>::Plan::make_tables() {
    std::vector<Index> uses(shapes.size(), 0), patch(shapes.size());
    for (const Tile& tile : tiles) {
        ++uses[tile.shape];
        patch[tile.shape] = tile.patch;
    }
    tables.resize(shapes.size());
    std::vector<std::size_t> size(shapes.size());
    for (std::size_t s = 0; s < shapes.size(); ++s) {
        const Shape& shape = shapes[s];
        const PatchClass& c = table().classes()[shape.patch_class];
        const bool product = c.kind == PatchKind::Regular && domain_points.empty();
        grid::Table<T>& t = tables[s];
        t = {nullptr,
             options.order,
             shape.nx,
             shape.ny,
             c.n_points(),
             product ? c.degree : 0,
             product && shape.turns % 2 == 1};
        size[s] = product ? t.n_product_weights() : t.n_points * t.n_rows();
    }

    // What is used most goes first.
    std::vector<Index> sorted(shapes.size());
    std::iota(sorted.begin(), sorted.end(), Index(0));
    std::ranges::stable_sort(sorted, std::greater<>(), [&](Index s) { return uses[s]; });
    std::vector<std::pair<Index, std::size_t>> made;  // with its place
    for (const Index s : sorted) {
        const std::size_t end = n_weights + size[s];
        if (uses[s] < options.min_table_uses ||
            end * sizeof(T) > options.max_table_bytes) {
            n_single_samples += uses[s] * tables[s].n_samples();
            continue;
        }
        made.emplace_back(s, n_weights);
        n_weights = end;
        tile_space = std::max(tile_space, grid::scratch_size(tables[s]));
    }
    weights = AlignedArray<T>(n_weights);
    detail::for_each_task(made.size(), [&](std::size_t m) {
        const auto [s, place] = made[m];
        T* out = weights.data() + place;
        if (tables[s].product_degree > 0)
            make_product(shapes[s], tables[s], out);
        else
            make_full(shapes[s], tables[s], patch[s], out);
        tables[s].weights = out;
    });
}

/// Tables are those of sector 0: patches are turned to it.
template <class T>
void GridEvaluator<T>::Plan::turn_sectors() {
    std::vector<std::size_t> first(tiles.size() + 1, 0);
    const auto turns = [&](const Tile& tile) {
        const grid::Table<T>& t = tables[tile.shape];
        return tile.sector > 0 && t.weights && t.product_degree == 0 &&
               rings(table().classes()[shapes[tile.shape].patch_class])[0].size > 0;
    };
    for (std::size_t i = 0; i < tiles.size(); ++i)
        first[i + 1] = first[i] + (turns(tiles[i]) ? tables[tiles[i].shape].n_points : 0);
    turned_points.resize(first.back());
    detail::for_each_task(tiles.size(), [&](std::size_t i) {
        if (first[i] == first[i + 1])
            return;
        Tile& tile = tiles[i];
        Index* const out = turned_points.data() + first[i];
        turn_points(std::span(tile.points, first[i + 1] - first[i]),
                    rings(table().classes()[shapes[tile.shape].patch_class]), tile.sector,
                    out);
        tile.points = out;
    });
}

template <class T>
void GridEvaluator<T>::Plan::make_full(const Shape& shape, const grid::Table<T>& t,
                                       Index patch, T* out) const {
    const PatchClass& c = table().classes()[shape.patch_class];
    const std::size_t n = static_cast<std::size_t>(c.n_points());
    const std::size_t rows = t.derivative_rows();
    constexpr std::size_t kPanel = grid::kPanel<T>;
    std::fill_n(out, t.n_rows() * n, T(0));
    detail::for_each_task(shape.ny, [&](int j) {
        std::vector<double> w(n_values() * n);
        for (int i = 0; i < shape.nx; ++i) {
            evaluator->weights(place(shape, patch, i, j), options.order, chart(c), w);
            for (int r = 0; r < n_values(); ++r) {
                const std::size_t row = r * rows + std::size_t(j) * shape.nx + i;
                T* panel = out + row / kPanel * (kPanel * n) + row % kPanel;
                for (std::size_t k = 0; k < n; ++k)
                    panel[k * kPanel] = to_weight<T>(w[r * n + k]);
            }
        }
    });
}

template <class T>
void GridEvaluator<T>::Plan::make_product(const Shape& shape, const grid::Table<T>& t,
                                          T* out) const {
    const PatchClass& c = table().classes()[shape.patch_class];
    const int n = c.degree + 1, order = options.order;
    // i runs along one axis of the chart, up or down, j along the other.
    const Vec2<std::int64_t> along_i = turn(Vec2<std::int64_t>(1, 0), shape.turns),
                             along_j = turn(Vec2<std::int64_t>(0, 1), shape.turns);
    const bool swapped = along_i.x == 0;
    const double scale = double(shape.step) / c.extent();
    std::array<double, (kMaxDegree + 1) * 3> taylor;
    const std::span basis(taylor.data(), static_cast<std::size_t>(n * (order + 1)));
    /// put(derivative, control point, weight)
    const auto make = [&](int index, std::int64_t origin, std::int64_t direction,
                          auto&& put) {
        const double x =
            double(origin + shape.step * direction * index) / (rate * double(c.extent()));
        bspline_basis<double>(c.degree, x, order, basis);
        double factor = 1;  // from Taylor coefficients to derivatives
        for (int q = 0; q <= order; ++q) {
            for (int k = 0; k < n; ++k)
                put(q, k, to_weight<T>(factor * basis[k * (order + 1) + q]));
            factor *= double(direction) * scale * (q + 1);
        }
    };
    std::fill_n(out, t.n_product_weights(), T(0));
    for (int i = 0; i < shape.nx; ++i) {
        make(i, swapped ? shape.origin.y : shape.origin.x,
             swapped ? along_i.y : along_i.x, [&](int q, int k, T w) {
                 const std::size_t row = std::size_t(q) * shape.nx + i;
                 out[k * t.padded_row(1) + row] = w;
                 std::fill_n(out + t.along_i(true) + k * t.padded_row(t.n_repeats()) +
                                 t.n_repeats() * row,
                             t.n_repeats(), w);
             });
    }
    out += t.along_j();
    for (int j = 0; j < shape.ny; ++j) {
        make(j, swapped ? shape.origin.x : shape.origin.y,
             swapped ? along_j.x : along_j.y,
             [&](int q, int k, T w) { out[(q * shape.ny + j) * n + k] = w; });
    }
}

/// Whole units, as many as fit.
template <class T>
void GridEvaluator<T>::Plan::make_blocks(const std::vector<Index>& first_tile_of) {
    const std::size_t most =
        std::max<std::size_t>(1, options.block_bytes / (3 * sizeof(T) * n_values()));
    const Index n_units = static_cast<Index>(first_sample.size() - 1);
    for (Index unit = 0; unit < n_units; ++unit) {
        if (unit > first_unit.back() &&
            first_sample[unit + 1] - first_sample[first_unit.back()] > most)
            first_unit.push_back(unit);
    }
    if (n_units > 0)
        first_unit.push_back(n_units);
    for (const Index unit : std::span(first_unit).subspan(1))
        first_tile.push_back(first_tile_of[unit]);
    for (std::size_t b = 0; b < n_blocks(); ++b)
        block_space = std::max(block_space, grid::padded<T>(3 * block_size(b)));
    detail::for_each_task(n_blocks(), [&](std::size_t b) {
        for (Index unit = first_unit[b]; unit < first_unit[b + 1]; ++unit) {
            const auto offset =
                static_cast<Index>(first_sample[unit] - first_sample[first_unit[b]]);
            for (Index i = first_tile_of[unit]; i < first_tile_of[unit + 1]; ++i)
                tiles[i].first_sample += offset;
        }
        std::sort(tiles.begin() + first_tile[b], tiles.begin() + first_tile[b + 1],
                  [](const Tile& x, const Tile& y) {
                      return std::pair(x.shape, x.first_sample) <
                             std::pair(y.shape, y.first_sample);
                  });
    });
}

template <class T>
void GridEvaluator<T>::Plan::evaluate_block(std::span<const Vec3<T>> points,
                                            std::size_t block,
                                            const SampleBuffers<T>& out,
                                            const Scratch& local) const {
    grid::Target<T> target{};
    target.layout = layout(out);
    for (int r = 0; r < n_values(); ++r) {
        target.data[r] = out[r].data;
        target.sample_stride[r] = out[r].sample_stride;
        target.channel_stride[r] = out[r].channel_stride;
    }
    const Index last = first_tile[block + 1];
    for (Index i = first_tile[block]; i < last;) {
        const Index shape = tiles[i].shape;
        const grid::Table<T>& t = tables[shape];
        for (int r = 0; r < n_values(); ++r)
            target.row_stride[r] = shapes[shape].pitch * target.sample_stride[r];
        if (!t.weights) {
            evaluate_single(points, tiles[i++], target);
            continue;
        }
        const grid::Kernel<T> kernel = grid::kernel(t, target.layout);
        std::array<const Index*, kMaxBatch> indices;
        std::array<Index, kMaxBatch> first_samples;
        std::size_t n = 0;
        for (; n < kMaxBatch && i < last && tiles[i].shape == shape; ++i, ++n) {
            indices[n] = tiles[i].points;
            first_samples[n] = tiles[i].first_sample;
            // The lists of the next batch: these come in no order that the processor sees.
            if (i + kMaxBatch < last) {
                const Index* const next = tiles[i + kMaxBatch].points;
                for (int k = 0; k < t.n_points; k += 64 / sizeof(Index))
                    hwy::Prefetch(next + k);
            }
        }
        kernel(t,
               {n, &points[0].x, &points.back().x, indices.data(), first_samples.data()},
               target, local.values.data());
    }
}

template <class T>
void GridEvaluator<T>::Plan::evaluate_single(std::span<const Vec3<T>> points,
                                             const Tile& tile,
                                             const grid::Target<T>& target) const {
    const Shape& shape = shapes[tile.shape];
    const Chart c = chart(table().classes()[shape.patch_class]);
    // Some samples at a time, row by row.
    constexpr int kMost = 32;
    std::array<PatchPoint, kMost> where;
    std::array<SurfaceJet<T>, kMost> jets;
    const int n_samples = shape.nx * shape.ny;
    for (int first = 0; first < n_samples; first += kMost) {
        const auto n = static_cast<std::size_t>(std::min(kMost, n_samples - first));
        for (std::size_t k = 0; k < n; ++k) {
            const int s = first + static_cast<int>(k);
            where[k] = place(shape, tile.patch, s % shape.nx, s / shape.nx);
            if (domain_points.empty())
                where[k].sector = tile.sector;
        }
        const std::span<const PatchPoint> at(where.data(), n);
        const std::span<SurfaceJet<T>> out(jets.data(), n);
        detail::with_order(options.order, [&](auto k) {
            evaluator->evaluate_many<T, k>(points, at, c, out);
        });
        for (std::size_t k = 0; k < n; ++k) {
            const int s = first + static_cast<int>(k);
            const SurfaceJet<T>& jet = jets[k];
            const Vec3<T> values[] = {jet.p, jet.du, jet.dv, jet.duu, jet.duv, jet.dvv};
            for (int r = 0; r < n_values(); ++r) {
                T* to = target.data[r] + s / shape.nx * target.row_stride[r] +
                        (tile.first_sample + s % shape.nx) * target.sample_stride[r];
                for (int q = 0; q < 3; ++q)
                    to[q * target.channel_stride[r]] = values[r][q];
            }
        }
    }
}

template <class T>
GridEvaluator<T>::GridEvaluator(const Evaluator& evaluator, int rate,
                                const GridOptions& options) {
    assert(rate >= 1);
    auto plan = std::make_unique<Plan>();
    plan->evaluator = &evaluator;
    plan->options = options;
    plan->rate = rate;
    const PatchTable& table = evaluator.table();
    const Topology& base = table.base();
    const Index n_faces = base.n_faces();

    // Chunks of faces have shapes of their own; these are joined in the order of the chunks.
    struct Chunk {
        ShapeSet shapes;
        std::vector<Tile> tiles;
    };
    constexpr Index kChunk = 2048;
    std::vector<Chunk> chunks((n_faces + kChunk - 1) / kChunk);
    std::vector<Index> first_tile(n_faces + 1, 0);  // in the chunk, then of all
    plan->first_sample.resize(n_faces + 1);
    detail::for_each_task(chunks.size(), [&](std::size_t i) {
        grid::Tiler tiler(table, rate);
        const Index first = static_cast<Index>(i) * kChunk;
        for (Index f = first; f < std::min(n_faces, first + kChunk); ++f) {
            tiler.add_face(f, chunks[i].shapes, chunks[i].tiles);
            first_tile[f + 1] = static_cast<Index>(chunks[i].tiles.size());
        }
    });
    ShapeSet shapes;
    std::vector<std::vector<Index>> shape_of(chunks.size());
    std::vector<Index> offset(chunks.size() + 1, 0);
    for (std::size_t i = 0; i < chunks.size(); ++i) {
        for (const Shape& s : chunks[i].shapes.shapes())
            shape_of[i].push_back(shapes.add(s));
        offset[i + 1] = offset[i] + static_cast<Index>(chunks[i].tiles.size());
    }
    plan->shapes = shapes.shapes();
    plan->tiles.resize(offset.back());
    detail::for_each_task(chunks.size(), [&](std::size_t i) {
        const Index first = static_cast<Index>(i) * kChunk;
        for (Index f = first; f < std::min(n_faces, first + kChunk); ++f)
            first_tile[f + 1] += offset[i];
        Tile* out = plan->tiles.data() + offset[i];
        for (Tile tile : chunks[i].tiles) {
            tile.shape = shape_of[i][tile.shape];
            *out++ = tile;
        }
    });
    for (Index f = 0; f < n_faces; ++f) {
        const Index n = base.face_size(f);
        const std::size_t quad = std::size_t(rate + 1) * (rate + 1),
                          quarter = std::size_t(rate / 2 + 1) * (rate / 2 + 1);
        plan->first_sample[f + 1] = plan->first_sample[f] + (!table.has_surface(f) ? 0
                                                             : n == 4              ? quad
                                                                      : n * quarter);
    }
    plan->make_tables();
    plan->turn_sectors();
    plan->make_blocks(first_tile);
    plan_ = std::move(plan);
}

template <class T>
GridEvaluator<T>::GridEvaluator(const Evaluator& evaluator, Index patch_class,
                                std::span<const DomainPoint> points,
                                const GridOptions& options) {
    auto plan = std::make_unique<Plan>();
    plan->evaluator = &evaluator;
    plan->options = options;
    plan->domain_points.assign(points.begin(), points.end());
    const PatchTable& table = evaluator.table();
    const auto n = static_cast<std::int32_t>(points.size());
    for (Index patch = 0; patch < table.n_patches() && n > 0; ++patch) {
        const PatchRef ref = table.patch(patch);
        if (ref.patch_class != patch_class)
            continue;
        plan->tiles.push_back({0, patch, 0, 0, ref.points.data()});
        plan->first_sample.push_back(plan->first_sample.back() + points.size());
    }
    plan->shapes.push_back({patch_class, 0, {0, 0}, 0, 0, n, 1, n});
    plan->make_tables();
    plan->turn_sectors();
    std::vector<Index> first_tile(plan->tiles.size() + 1);
    std::iota(first_tile.begin(), first_tile.end(), Index(0));
    plan->make_blocks(first_tile);
    plan_ = std::move(plan);
}

template <class T>
GridEvaluator<T>::GridEvaluator(GridEvaluator&&) noexcept = default;
template <class T>
GridEvaluator<T>& GridEvaluator<T>::operator=(GridEvaluator&&) noexcept = default;
template <class T>
GridEvaluator<T>::~GridEvaluator() = default;

template <class T>
const Evaluator& GridEvaluator<T>::evaluator() const noexcept {
    return *plan_->evaluator;
}
template <class T>
int GridEvaluator<T>::order() const noexcept {
    return plan_->options.order;
}
template <class T>
Index GridEvaluator<T>::n_units() const noexcept {
    return static_cast<Index>(plan_->first_sample.size() - 1);
}
template <class T>
std::size_t GridEvaluator<T>::n_samples() const noexcept {
    return plan_->first_sample.back();
}
template <class T>
std::size_t GridEvaluator<T>::first_sample(Index unit) const noexcept {
    return plan_->first_sample[unit];
}
template <class T>
std::size_t GridEvaluator<T>::table_bytes() const noexcept {
    return plan_->n_weights * sizeof(T);
}
template <class T>
std::size_t GridEvaluator<T>::n_single_samples() const noexcept {
    return plan_->n_single_samples;
}

template <class T>
void GridEvaluator<T>::evaluate(std::span<const Vec3<T>> points,
                                const SampleBuffers<T>& out) const {
    const Plan& plan = *plan_;
    assert(points.size() == plan.table().n_points());
    // Much output goes past the caches, by way of a block that is in them.
    bool streams =
        n_samples() * plan.n_values() * 3 * sizeof(T) >= plan.options.stream_bytes;
    for (int r = 0; r < plan.n_values(); ++r)
        streams &= out[r].sample_stride == 3 && out[r].channel_stride == 1;
    plan.for_each_local(streams, [&](const auto& local, std::size_t b) {
        const auto first =
            static_cast<std::ptrdiff_t>(plan.first_sample[plan.first_unit[b]]);
        SampleBuffers<T> part = out;
        for (int r = 0; r < plan.n_values(); ++r)
            part[r].data += first * part[r].sample_stride;
        if (!streams)
            return plan.evaluate_block(points, b, part, local);
        const SampleBuffers<T> cached = plan.block_buffers(local);
        plan.evaluate_block(points, b, cached, local);
        for (int r = 0; r < plan.n_values(); ++r)
            grid::stream(cached[r].data, 3 * plan.block_size(b), part[r].data);
    });
}

template <class T>
void GridEvaluator<T>::for_each_block(
    std::span<const Vec3<T>> points,
    const std::function<void(const SampleBlock<T>&)>& f) const {
    const Plan& plan = *plan_;
    assert(points.size() == plan.table().n_points());
    detail::Steps steps(n_units());
    plan.for_each_local(true, [&](const auto& local, std::size_t b) {
        const Index first = plan.first_unit[b];
        SampleBlock<T> block{first,
                             plan.first_unit[b + 1] - first,
                             plan.first_sample[first],
                             plan.block_size(b),
                             {}};
        const SampleBuffers<T> values = plan.block_buffers(local);
        for (int r = 0; r < plan.n_values(); ++r)
            block.values[r] = values[r].data;
        plan.evaluate_block(points, b, values, local);
        f(block);
        steps.add(block.n_units);
    });
}

template class GridEvaluator<float>;
template class GridEvaluator<double>;

}  // namespace osdx::inline OSDX_ABI
