// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "eval/kernels/grid.h"
#include "eval/kernels/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "eval/kernels/grid_full.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep

// After foreach_target.h.
#include "eval/kernels/grid_layout-inl.h"
#include "eval/kernels/grid_store-inl.h"

// Full tables: a dense product of weights and control points.

HWY_BEFORE_NAMESPACE();
namespace osdx::inline OSDX_ABI::grid::HWY_NAMESPACE {
namespace {

/// G vectors of rows, from row `first` on, of P patches: x, y, z of each to `sums`, patch by
/// patch.
template <std::size_t G, std::size_t P, class T>
HWY_NOINLINE void full_group(const Table<T>& table, const T* HWY_RESTRICT points,
                             const Index* const* indices, std::size_t first,
                             T* HWY_RESTRICT sums) {
    const Tag<T> d;
    constexpr std::size_t N = kLanes<T>, kPerPanel = kPanel<T> / N;
    const std::size_t n = static_cast<std::size_t>(table.n_points);
    const std::size_t panel = kPanel<T> * n;
    const T* HWY_RESTRICT w =
        table.weights + first / kPanel<T> * panel + first % kPanel<T>;
    Vec<T> x[P][G], y[P][G], z[P][G];
    unrolled_pairs<P, G>([&](auto p, auto g)
                             OSDX_LAMBDA { x[p][g] = y[p][g] = z[p][g] = hn::Zero(d); });
    for (std::size_t k = 0; k < n; ++k, w += kPanel<T>) {
        Vec<T> weights[G];
        unrolled<G>([&](auto g) OSDX_LAMBDA {
            weights[g] = hn::Load(d, w + g / kPerPanel * panel + g % kPerPanel * N);
        });
        unrolled<P>([&](auto p) OSDX_LAMBDA {
            const T* at = points + 3 * std::size_t(indices[p][k]);
            const Vec<T> px = hn::Set(d, at[0]), py = hn::Set(d, at[1]),
                         pz = hn::Set(d, at[2]);
            unrolled<G>([&](auto g) OSDX_LAMBDA {
                x[p][g] = hn::MulAdd(weights[g], px, x[p][g]);
                y[p][g] = hn::MulAdd(weights[g], py, y[p][g]);
                z[p][g] = hn::MulAdd(weights[g], pz, z[p][g]);
            });
        });
    }
    unrolled_pairs<P, G>([&](auto p, auto g) OSDX_LAMBDA {
        T* const to = sums + (p * G + g) * 3 * N;
        hn::Store(x[p][g], d, to);
        hn::Store(y[p][g], d, to + N);
        hn::Store(z[p][g], d, to + 2 * N);
    });
}

/// full_group() for any number of vectors up to G.
template <std::size_t G, std::size_t P, class T>
HWY_INLINE void full_groups(std::size_t n_vectors, const Table<T>& table, const T* points,
                            const Index* const* indices, std::size_t first, T* sums) {
    if constexpr (G > 1) {
        if (n_vectors < G)
            return full_groups<G - 1, P>(n_vectors, table, points, indices, first, sums);
    }
    full_group<G, P>(table, points, indices, first, sums);
}

/// P patches at a time, from patch b on, as long as there are so many: they have the weights
/// in common, which are not all in the nearest cache.
template <std::size_t P, bool kInterleaved, class T>
HWY_INLINE void full_patches(const Table<T>& table, const Batch<T>& batch,
                             const Target<T>& target,
                             const PutSamples<T, kInterleaved>& put, std::size_t& b) {
    constexpr std::size_t N = kLanes<T>, G = kMaxGroup / P;
    const std::size_t n_vectors = table.n_rows() / N;
    const std::size_t n_groups = (n_vectors + G - 1) / G;
    // Groups of equal size, unless the vectors of a panel would be parted.
    const std::size_t size = N == kPanel<T> ? (n_vectors + n_groups - 1) / n_groups : G;
    HWY_ALIGN T sums[3 * kMaxGroup * N];
    for (; b + P <= batch.n; b += P) {
        typename PutSamples<T, kInterleaved>::Place places[P];
        for (std::size_t p = 0; p < P; ++p)
            put.start(batch.first_samples[b + p], places[p]);
        for (std::size_t first = 0; first < n_vectors; first += size) {
            const std::size_t n = std::min(size, n_vectors - first);
            full_groups<G, P>(n, table, batch.points, batch.indices + b, first * N, sums);
            for (std::size_t p = 0; p < P; ++p) {
                T* const own = sums + 3 * N * n * p;
                if (table.packed()) {
                    put_packed(table, target, batch.first_samples[b + p], first * N,
                               n * N, own);
                    continue;
                }
                for (std::size_t g = 0; g < n; ++g)
                    put(own + 3 * N * g, places[p]);
            }
        }
    }
}

template <bool kInterleaved, class T>
void full(const Table<T>& table, const Batch<T>& batch, const Target<T>& target) {
    const std::size_t n_vectors = table.n_rows() / kLanes<T>;
    const PutSamples<T, kInterleaved> put(table, target);
    std::size_t b = 0;
    // Not where groups of four patches would part what is one group of two.
    if (n_vectors <= kMaxGroup / 4 || n_vectors > kMaxGroup / 2)
        full_patches<4, kInterleaved>(table, batch, target, put, b);
    full_patches<2, kInterleaved>(table, batch, target, put, b);
    full_patches<1, kInterleaved>(table, batch, target, put, b);
}

struct Any {
    template <bool kInterleaved, class T>
    static void run(const Table<T>& table, const Batch<T>& batch,
                    const Target<T>& target) {
        full<kInterleaved>(table, batch, target);
    }
};

}  // namespace

void full_float(const Table<float>& table, const Batch<float>& batch,
                const Target<float>& target, float* scratch) {
    evaluate<Any>(table, batch, target, scratch);
}
void full_double(const Table<double>& table, const Batch<double>& batch,
                 const Target<double>& target, double* scratch) {
    evaluate<Any>(table, batch, target, scratch);
}

}  // namespace osdx::inline OSDX_ABI::grid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace osdx::inline OSDX_ABI::grid {

HWY_EXPORT(full_float);
HWY_EXPORT(full_double);

template <>
Kernel<float> full_kernel() noexcept {
    return HWY_DYNAMIC_DISPATCH(full_float);
}
template <>
Kernel<double> full_kernel() noexcept {
    return HWY_DYNAMIC_DISPATCH(full_double);
}

}  // namespace osdx::inline OSDX_ABI::grid
#endif  // HWY_ONCE
