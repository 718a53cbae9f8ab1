// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "eval/grid_kernels.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

// Vectors whose length the compiler does not know cannot stand in arrays.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "eval/grid_kernels.cpp"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace osdx::grid::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

template <class T>
using Tag = hn::ScalableTag<T>;
template <class T>
using Vec = hn::VFromD<Tag<T>>;
template <class T>
constexpr std::size_t kLanes = hn::MaxLanes(Tag<T>());

/// What one vector of results of a full table keeps in registers: the sums of three
/// coordinates. Half of the registers hold sums and a few more.
constexpr std::size_t kMaxGroup = HWY_TARGET <= HWY_AVX3 ? 8 : 4;

/// The first n < kLanes lanes.
template <class T>
HWY_INLINE void store_some(Vec<T> v, std::size_t n, T* to) {
    const Tag<T> d;
#if HWY_TARGET <= HWY_AVX2
    hn::BlendedStore(v, hn::FirstN(d, n), d, to);  // touches nothing else
#else
    HWY_ALIGN T lanes[kLanes<T>];
    hn::Store(v, d, lanes);
    for (std::size_t l = 0; l < n; ++l)
        to[l] = lanes[l];
#endif
}

/// Reads up to a vector more than n elements.
template <class T>
HWY_INLINE void copy(const T* from, std::size_t n, T* to) {
    const Tag<T> d;
    constexpr std::size_t N = kLanes<T>;
    if (n < N)
        return store_some<T>(hn::LoadU(d, from), n, to);
    for (std::size_t i = 0; i + N < n; i += N)
        hn::StoreU(hn::LoadU(d, from + i), d, to + i);
    hn::StoreU(hn::LoadU(d, from + n - N), d, to + n - N);
}

// -------------------------------------------------------------------------- full tables

/// G vectors of rows, from row `first` on. Put(row, x, y, z) takes their values.
template <std::size_t G, class T, class Put>
HWY_INLINE void full_group(const Table<T>& table, const T* HWY_RESTRICT points,
                           std::size_t first, const Put& put) {
    const Tag<T> d;
    constexpr std::size_t N = kLanes<T>, kPerPanel = kPanel<T> / N;
    const std::size_t n = static_cast<std::size_t>(table.n_points);
    const std::size_t panel = kPanel<T> * n;
    const T* HWY_RESTRICT w =
        table.weights + first / kPanel<T> * panel + first % kPanel<T>;
    Vec<T> x[G], y[G], z[G];
    for (std::size_t g = 0; g < G; ++g)
        x[g] = y[g] = z[g] = hn::Zero(d);
    for (std::size_t k = 0; k < n; ++k, points += 3, w += kPanel<T>) {
        const Vec<T> px = hn::Set(d, points[0]), py = hn::Set(d, points[1]),
                     pz = hn::Set(d, points[2]);
        for (std::size_t g = 0; g < G; ++g) {
            const Vec<T> v = hn::Load(d, w + g / kPerPanel * panel + g % kPerPanel * N);
            x[g] = hn::MulAdd(v, px, x[g]);
            y[g] = hn::MulAdd(v, py, y[g]);
            z[g] = hn::MulAdd(v, pz, z[g]);
        }
    }
    for (std::size_t g = 0; g < G; ++g)
        put(first + g * N, x[g], y[g], z[g]);
}

/// full_group() for any number of vectors up to G.
template <std::size_t G, class T, class Put>
HWY_INLINE void full_groups(std::size_t n_vectors, const Table<T>& table, const T* points,
                            std::size_t first, const Put& put) {
    if constexpr (G > 1) {
        if (n_vectors < G)
            return full_groups<G - 1>(n_vectors, table, points, first, put);
    }
    full_group<G>(table, points, first, put);
}

/// Takes vectors of rows to their samples, each derivative's one after the other.
template <class T, bool kInterleaved>
struct PutSamples {
    std::size_t n, rows;  // samples, rows for each derivative
    std::array<T*, 6> to;
    std::array<std::ptrdiff_t, 6> channel_stride;  // unless interleaved
    bool overrun;                                  // there is room for a panel more
    T* spare;                                      // for a vector of samples

    HWY_INLINE void operator()(std::size_t row, Vec<T> x, Vec<T> y, Vec<T> z) const {
        const Tag<T> d;
        constexpr std::size_t N = kLanes<T>;
        const std::size_t r = row / rows, s = row % rows;
        const bool whole = overrun || s + N <= n;
        if (!whole && s >= n)
            return;
        if constexpr (kInterleaved) {
            hn::StoreInterleaved3(x, y, z, d, whole ? to[r] + 3 * s : spare);
            if (!whole)
                copy(spare, 3 * (n - s), to[r] + 3 * s);
        } else {
            const Vec<T> v[3] = {x, y, z};
            for (int c = 0; c < 3; ++c) {
                T* at = to[r] + c * channel_stride[r] + s;
                if (whole)
                    hn::StoreU(v[c], d, at);
                else
                    store_some<T>(v[c], n - s, at);
            }
        }
    }
};

template <bool kInterleaved, class T>
void full(const Table<T>& table, const T* points, T* scratch, const Target<T>& target) {
    const int n_derivatives = (table.order + 1) * (table.order + 2) / 2;
    const std::size_t n = table.n_samples(), rows = padded<T>(n);
    T* const spare = scratch;  // 3 panels
    T* const values = scratch + 3 * kPanel<T>;

    // Straight to the target where it has the samples without gaps.
    const bool direct =
        table.ny == 1 || target.row_stride[0] == table.nx * target.sample_stride[0];
    PutSamples<T, kInterleaved> put{n,       rows, target.data, target.channel_stride,
                                    !direct, spare};
    for (int r = 0; r < n_derivatives && !direct; ++r) {
        put.to[r] = values + 3 * rows * r;
        put.channel_stride[r] = static_cast<std::ptrdiff_t>(rows);
    }

    constexpr std::size_t N = kLanes<T>;
    const std::size_t n_vectors = n_derivatives * rows / N;
    const std::size_t n_groups = (n_vectors + kMaxGroup - 1) / kMaxGroup;
    // Groups of equal size, unless the vectors of a panel would be parted.
    std::size_t size =
        kLanes<T> == kPanel<T> ? (n_vectors + n_groups - 1) / n_groups : kMaxGroup;
    for (std::size_t first = 0; first < n_vectors; first += size)
        full_groups<kMaxGroup>(std::min(size, n_vectors - first), table, points,
                               first * N, put);
    if (direct)
        return;
    const std::size_t nx = static_cast<std::size_t>(table.nx);
    for (int r = 0; r < n_derivatives; ++r) {
        for (int j = 0; j < table.ny; ++j) {
            T* to = target.data[r] + j * target.row_stride[r];
            if (kInterleaved) {
                copy(put.to[r] + 3 * nx * j, 3 * nx, to);
            } else {
                for (int c = 0; c < 3; ++c)
                    copy(put.to[r] + c * rows + nx * j, nx,
                         to + c * target.channel_stride[r]);
            }
        }
    }
}

// ------------------------------------------------------------------------------- products

/// K = degree + 1, or 0 for whatever the table says.
template <int K, class T>
HWY_INLINE int n_columns(const Table<T>& table) {
    return K > 0 ? K : table.product_degree + 1;
}

/// Along i: `rows` gets for each row of control points the values and derivatives at all i,
/// x, y, z by turns or one after the other.
template <int K, bool kInterleaved, class T>
HWY_INLINE void product_rows(const Table<T>& table, const T* HWY_RESTRICT points,
                             T* HWY_RESTRICT rows) {
    const Tag<T> d;
    const int n = n_columns<K>(table);
    const std::size_t size = padded<T>(std::size_t(table.order + 1) * table.nx);
    const std::ptrdiff_t along_k = table.transposed ? 3 * n : 3,
                         along_row = table.transposed ? 3 : 3 * n;
    for (std::size_t v = 0; v < size; v += kLanes<T>) {
        for (int row = 0; row < n; ++row) {
            const T* p = points + row * along_row;
            const T* w = table.weights + v;
            Vec<T> x = hn::Zero(d), y = x, z = x;
            for (int k = 0; k < n; ++k, p += along_k, w += size) {
                const Vec<T> a = hn::Load(d, w);
                x = hn::MulAdd(a, hn::Set(d, p[0]), x);
                y = hn::MulAdd(a, hn::Set(d, p[1]), y);
                z = hn::MulAdd(a, hn::Set(d, p[2]), z);
            }
            T* to = rows + 3 * size * row;
            if constexpr (kInterleaved) {
                hn::StoreInterleaved3(x, y, z, d, to + 3 * v);
            } else {
                hn::Store(x, d, to + v);
                hn::Store(y, d, to + size + v);
                hn::Store(z, d, to + 2 * size + v);
            }
        }
    }
}

/// Along j: sums of rows, `length` elements of each from rows[...] + start on; derivatives
/// along i stand `step` apart.
template <int K, int kOrder, class T>
HWY_INLINE void product_columns(const Table<T>& table, const T* HWY_RESTRICT rows,
                                std::size_t length, std::size_t step,
                                const std::array<T*, 6>& to,
                                const std::array<std::ptrdiff_t, 6>& row_stride) {
    const Tag<T> d;
    constexpr std::size_t N = kLanes<T>;
    const int n = n_columns<K>(table);
    const std::size_t size = padded<T>(std::size_t(table.order + 1) * table.nx);
    const T* HWY_RESTRICT weights = table.weights + n * size;
    for (std::size_t next = 0; next < length; next += N) {
        // The last vector overlaps the one before.
        const std::size_t e = length < N ? 0 : std::min(next, length - N);
        const auto row = [&](int q, int k) HWY_ATTR {
            return hn::LoadU(d, rows + 3 * size * k + q * step + e);
        };
        Vec<T> kept[kOrder + 1][K > 0 ? K : 1];
        if constexpr (K > 0) {
            for (int q = 0; q <= kOrder; ++q) {
                for (int k = 0; k < K; ++k)
                    kept[q][k] = row(q, k);
            }
        }
        for (int j = 0; j < table.ny; ++j) {
            int r = 0;
            for (int m = 0; m <= kOrder; ++m) {
                for (int q = 0; q <= m; ++q, ++r) {
                    // m - q times along i, q times along j
                    const T* w = weights + (q * table.ny + j) * n;
                    Vec<T> sum;
                    if constexpr (K > 0) {
                        sum = hn::Mul(hn::Set(d, w[0]), kept[m - q][0]);
                        for (int k = 1; k < K; ++k)
                            sum = hn::MulAdd(hn::Set(d, w[k]), kept[m - q][k], sum);
                    } else {
                        sum = hn::Mul(hn::Set(d, w[0]), row(m - q, 0));
                        for (int k = 1; k < n; ++k)
                            sum = hn::MulAdd(hn::Set(d, w[k]), row(m - q, k), sum);
                    }
                    T* at = to[r] + j * row_stride[r] + e;
                    if (length < N)
                        store_some<T>(sum, length, at);
                    else
                        hn::StoreU(sum, d, at);
                }
            }
        }
    }
}

template <int K, int kOrder, bool kInterleaved, class T>
HWY_NOINLINE void product(const Table<T>& table, const T* points, T* scratch,
                          const Target<T>& target) {
    product_rows<K, kInterleaved>(table, points, scratch);
    const std::size_t nx = static_cast<std::size_t>(table.nx);
    if constexpr (kInterleaved) {
        product_columns<K, kOrder>(table, scratch, 3 * nx, 3 * nx, target.data,
                                   target.row_stride);
    } else {
        const std::size_t size = padded<T>((table.order + 1) * nx);
        for (int c = 0; c < 3; ++c) {
            std::array<T*, 6> to = target.data;
            for (int r = 0; r < (kOrder + 1) * (kOrder + 2) / 2; ++r)
                to[r] += c * target.channel_stride[r];
            product_columns<K, kOrder>(table, scratch + c * size, nx, nx, to,
                                       target.row_stride);
        }
    }
}

template <int K, bool kInterleaved, class T>
void product_of_order(const Table<T>& table, const T* points, T* scratch,
                      const Target<T>& target) {
    switch (table.order) {
        case 0:
            return product<K, 0, kInterleaved>(table, points, scratch, target);
        case 1:
            return product<K, 1, kInterleaved>(table, points, scratch, target);
        default:
            return product<K, 2, kInterleaved>(table, points, scratch, target);
    }
}

template <bool kInterleaved, class T>
void any_table(const Table<T>& table, const T* points, T* scratch,
               const Target<T>& target) {
    switch (table.product_degree) {
        case 0:
            return full<kInterleaved>(table, points, scratch, target);
        case 3:
            return product_of_order<4, kInterleaved>(table, points, scratch, target);
        case 5:
            return product_of_order<6, kInterleaved>(table, points, scratch, target);
        case 7:
            return product_of_order<8, kInterleaved>(table, points, scratch, target);
        default:
            return product_of_order<0, kInterleaved>(table, points, scratch, target);
    }
}

// --------------------------------------------------------------------------------- layouts

template <class T>
void evaluate(const Table<T>& table, const T* points, T* scratch,
              const Target<T>& target) {
    const int n_derivatives = (table.order + 1) * (table.order + 2) / 2;
    bool interleaved = true, planar = true, same = true;
    for (int r = 0; r < n_derivatives; ++r) {
        interleaved &= target.sample_stride[r] == 3 && target.channel_stride[r] == 1;
        planar &= target.sample_stride[r] == 1;
        same &= target.row_stride[r] == target.row_stride[0];
    }
    if (interleaved && same)
        return any_table<true>(table, points, scratch, target);
    if (planar && same)
        return any_table<false>(table, points, scratch, target);
    // Any other layout by way of scratch memory.
    const std::size_t n = table.n_samples();
    Target<T> packed;
    for (int r = 0; r < n_derivatives; ++r) {
        packed.data[r] = scratch + 3 * padded<T>(n) * r;
        packed.row_stride[r] = 3 * table.nx;
        packed.sample_stride[r] = 3;
        packed.channel_stride[r] = 1;
    }
    any_table<true>(table, points, scratch + 3 * padded<T>(n) * n_derivatives, packed);
    for (int r = 0; r < n_derivatives; ++r) {
        const T* from = packed.data[r];
        for (int j = 0; j < table.ny; ++j) {
            T* to = target.data[r] + j * target.row_stride[r];
            for (int i = 0; i < table.nx; ++i, from += 3, to += target.sample_stride[r]) {
                for (int c = 0; c < 3; ++c)
                    to[c * target.channel_stride[r]] = from[c];
            }
        }
    }
}

void evaluate_float(const Table<float>& table, const float* points, float* scratch,
                    const Target<float>& target) {
    evaluate(table, points, scratch, target);
}
void evaluate_double(const Table<double>& table, const double* points, double* scratch,
                     const Target<double>& target) {
    evaluate(table, points, scratch, target);
}

template <class T>
void stream(const T* from, std::size_t n, T* to) {
    const Tag<T> d;
    constexpr std::size_t N = kLanes<T>;
    std::size_t i = 0;
    for (; i < n && reinterpret_cast<std::uintptr_t>(to + i) % (N * sizeof(T)) != 0; ++i)
        to[i] = from[i];
    for (; i + N <= n; i += N)
        hn::Stream(hn::LoadU(d, from + i), d, to + i);
    for (; i < n; ++i)
        to[i] = from[i];
    hwy::FlushStream();
}
void stream_float(const float* from, std::size_t n, float* to) {
    stream(from, n, to);
}
void stream_double(const double* from, std::size_t n, double* to) {
    stream(from, n, to);
}

}  // namespace
}  // namespace osdx::grid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace osdx::grid {

HWY_EXPORT(evaluate_float);
HWY_EXPORT(evaluate_double);
HWY_EXPORT(stream_float);
HWY_EXPORT(stream_double);

template <>
Kernel<float> kernel() noexcept {
    return HWY_DYNAMIC_DISPATCH(evaluate_float);
}
template <>
Kernel<double> kernel() noexcept {
    return HWY_DYNAMIC_DISPATCH(evaluate_double);
}

template <>
void stream(const float* from, std::size_t n, float* to) noexcept {
    HWY_DYNAMIC_DISPATCH(stream_float)(from, n, to);
}
template <>
void stream(const double* from, std::size_t n, double* to) noexcept {
    HWY_DYNAMIC_DISPATCH(stream_double)(from, n, to);
}

template <class T>
std::size_t scratch_size(const Table<T>& table) noexcept {
    const std::size_t n_derivatives = (table.order + 1) * (table.order + 2) / 2;
    // Twice all values: for other layouts, and for rows with gaps between them.
    const std::size_t values = 3 * padded<T>(table.n_samples()) * n_derivatives;
    const std::size_t rows = 3 * padded<T>(std::size_t(table.order + 1) * table.nx) *
                             (table.product_degree + 1);
    return values + 4 * kPanel<T> + std::max(values, rows);
}
template std::size_t scratch_size(const Table<float>&) noexcept;
template std::size_t scratch_size(const Table<double>&) noexcept;

}  // namespace osdx::grid
#endif
