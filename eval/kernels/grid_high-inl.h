// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

// Included once for each instruction set that is compiled (hwy/foreach_target.h).
#if defined(OSDX_EVAL_GRID_HIGH_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef OSDX_EVAL_GRID_HIGH_INL_H_
#undef OSDX_EVAL_GRID_HIGH_INL_H_
#else
#define OSDX_EVAL_GRID_HIGH_INL_H_
#endif

#include "eval/kernels/grid_layout-inl.h"
#include "eval/kernels/grid_store-inl.h"

// Products of high degree, but into planar layouts.

HWY_BEFORE_NAMESPACE();
namespace osdx::inline OSDX_ABI::grid::HWY_NAMESPACE {
namespace {

// Of the layout that is common. First along i, for each row of control points, straight from
// where these are: x, y, z and a fourth element of no meaning, which is dropped when the row
// is done. Then along j. A weight is loaded for some rows at a time; their number and that of
// vectors are all that is known to the compiler, so that all degrees are one.

/// Vectors of a row: with the fourth elements, and without.
constexpr int kMaxSpread = 4, kMaxDense = 3;
/// Rows at a time: half of the registers hold their sums.
constexpr int kMaxRows = HWY_TARGET <= HWY_AVX3 ? 4 : 2;

/// From the sums of a row of control points to those of the next.
template <class T>
constexpr std::size_t kSumStride = kMaxDense* kLanes<T> + kPanel<T>;

/// Where the control points of patches are.
template <class T>
struct PointSource {
    const T* points;
    const T* last_point;
    std::ptrdiff_t along_row, along_k;  // in the list of indices
    int n;                              // degree + 1
};

/// Vector v of a row: x, y, z, something, ... of a point.
/// \tparam kLast  whether it may be the last one, behind which nothing is read
template <bool kLast, class T>
HWY_INLINE Vec<T> spread(const PointSource<T>& source, Index point, int v) {
    const Tag<T> d;
    constexpr std::size_t N = kLanes<T>;
    const T* p = source.points + 3 * std::size_t(point);
    HWY_ALIGN T copy[4];
    if (kLast && p == source.last_point) {
        std::copy_n(p, 3, copy);
        copy[3] = 0;
        p = copy;
    }
    if constexpr (N < 4) {
        return hn::LoadU(d, p + v % (4 / N) * N);
    } else if constexpr (N == 4) {
        return hn::LoadU(d, p);
    } else if constexpr (sizeof(T) == 4) {
        return hn::LoadDup128(d, p);
    } else {
        static constexpr auto kFrom =
            constants<hn::TFromD<hn::RebindToSigned<Tag<T>>>, N>(
                [](std::size_t l) { return l % 4; });
        return hn::TableLookupLanes(hn::MaskedLoad(hn::FirstN(d, 4), d, p),
                                    hn::SetTableIndices(d, kFrom.data()));
    }
}

/// Drops each fourth element of up to four vectors.
template <class T>
class Closer {
    static constexpr std::size_t N = kLanes<T>;
    static constexpr bool kByLookup = N > 4;
    using Int = hn::RebindToSigned<Tag<T>>;

public:
    HWY_INLINE Closer() {
        if constexpr (kByLookup) {
            const Tag<T> d;
            const Int ints;
            static constexpr auto kFrom = constants<hn::TFromD<Int>, kMaxDense * N>(
                [](std::size_t e) { return e / 3 * 4 + e % 3 - e / N * N; });
            for (std::size_t o = 0; o < kMaxDense; ++o) {
                const auto from = hn::LoadU(ints, kFrom.data() + o * N);
                const auto most = hn::Set(ints, static_cast<hn::TFromD<Int>>(N - 1));
                next_[o] = hn::RebindMask(d, hn::Gt(from, most));
                from_[o] = hn::And(from, most);
            }
        }
    }
    /// \param to  3 V N / 4 elements, and a few more
    template <int V>
    HWY_INLINE void store(const Vec<T> (&v)[V], T* to) const {
        const Tag<T> d;
        if constexpr (kByLookup) {
            unrolled<(3 * V + 3) / 4>([&](auto o) OSDX_LAMBDA {
                const auto from = hn::IndicesFromVec(d, from_[o]);
                Vec<T> all = hn::TableLookupLanes(v[o], from);
                if constexpr (o + 1 < V)
                    all = hn::IfThenElse(next_[o], hn::TableLookupLanes(v[o + 1], from),
                                         all);
                hn::Store(all, d, to + o * N);
            });
        } else {
            // The next vector overwrites it.
            unrolled<V>([&](auto k) OSDX_LAMBDA {
                hn::StoreU(v[k], d, to + 3 * (k * N / 4) + k * N % 4);
            });
        }
    }

private:
    hn::Vec<Int> from_[kMaxDense];
    hn::Mask<Tag<T>> next_[kMaxDense];
};

/// V vectors along i, of R rows of control points.
template <int V, int R, bool kLast, class T>
HWY_INLINE void sum_rows(const PointSource<T>& source, const Closer<T>& closer,
                         const Index* indices, const T* HWY_RESTRICT w, std::size_t size,
                         T* HWY_RESTRICT sums) {
    const Tag<T> d;
    constexpr std::size_t N = kLanes<T>;
    Vec<T> sum[R][V];
    const std::ptrdiff_t along_row = source.along_row;
    const auto point = [&](auto r, auto v) OSDX_LAMBDA {
        return spread<kLast>(source, indices[r * along_row], v);
    };
    unrolled_pairs<R, V>([&](auto r, auto v) OSDX_LAMBDA {
        sum[r][v] = hn::Mul(hn::Load(d, w + v * N), point(r, v));
    });
    for (int k = 1; k < source.n; ++k) {
        w += size;
        indices += source.along_k;
        unrolled_pairs<R, V>([&](auto r, auto v) OSDX_LAMBDA {
            sum[r][v] = hn::MulAdd(hn::Load(d, w + v * N), point(r, v), sum[r][v]);
        });
    }
    const Closer<T> local = closer;  // stays in registers
    unrolled<R>([&](auto r)
                    OSDX_LAMBDA { local.store(sum[r], sums + r * kSumStride<T>); });
}

/// All rows of control points.
template <int V, class T>
HWY_NOINLINE void sum_all_rows(const PointSource<T>& source, const Closer<T>& closer,
                               const Index* indices, const T* w, std::size_t size,
                               T* sums) {
    constexpr int R = kMaxRows;
    static_assert(kHighDegree + 1 >= (R - 1) * (R - 2));  // so that R and R - 1 will do
    const int n = source.n, blocks = (n + R - 1) / R, n_smaller = R * blocks - n;
    for (int b = 0; b < blocks; ++b) {
        const int rows = b < n_smaller ? R - 1 : R;
        if (rows == R)
            sum_rows<V, R, false>(source, closer, indices, w, size, sums);
        else
            sum_rows<V, R - 1, false>(source, closer, indices, w, size, sums);
        indices += rows * source.along_row;
        sums += rows * kSumStride<T>;
    }
}

/// If one of the points may be the last of all.
template <int V, class T>
HWY_NOINLINE void sum_last_rows(const PointSource<T>& source, const Closer<T>& closer,
                                const Index* indices, const T* w, std::size_t size,
                                T* sums) {
    for (int row = 0; row < source.n; ++row)
        sum_rows<V, 1, true>(source, closer, indices + row * source.along_row, w, size,
                             sums + row * kSumStride<T>);
}

/// Whether x is among n numbers, at least as many as a vector has.
HWY_INLINE bool contains(const Index* list, std::size_t n, Index x) {
    const hn::ScalableTag<Index> d;
    const std::size_t N = hn::Lanes(d);
    const auto all = hn::Set(d, x);
    auto found = hn::Zero(d);
    for (std::size_t i = 0; i < n; i += N) {
        const auto some = hn::LoadU(d, list + std::min(i, n - N));
        found = hn::Or(found, hn::VecFromMask(d, hn::Eq(some, all)));
    }
    return !hn::AllFalse(d, hn::Ne(found, hn::Zero(d)));
}

/// Where the lanes of the vectors of a row go, by derivative along i.
template <class T>
using HighLanes = SomeLanes<T>[kMaxDense][3];

/// Some vectors of the stream that ProductVector is one of.
template <int kOrder, class T>
struct HighVectors {
    // By the derivative along j: those that have something of it, which come first.
    int n[kOrder + 1];
    HighLanes<T> lanes;
    std::ptrdiff_t offset[kOrder + 1];  // of the first lane of all from the first element

    HWY_INLINE HighVectors(std::size_t first, std::size_t length) {
        constexpr std::size_t N = kLanes<T>;
        for (std::size_t q = 0; q <= kOrder; ++q) {
            for (std::size_t v = 0; v < kMaxDense; ++v) {
                const std::size_t begin = first + v * N, end = begin + N,
                                  lo = std::clamp(q * length, begin, end),
                                  hi = std::clamp((q + 1) * length, begin, end);
                lanes[v][q] = SomeLanes<T>(lo - begin, hi - lo);
            }
            offset[q] = std::ptrdiff_t(first) - std::ptrdiff_t(q * length);
            const std::size_t end = std::max(first, (kOrder + 1 - q) * length);
            n[q] = std::min(kMaxDense, static_cast<int>((end - first + N - 1) / N));
        }
    }
};

/// Along j: R rows of samples, of which each vector is sent to P places.
template <int V, int R, int P, class T>
HWY_INLINE void sum_columns(const T* HWY_RESTRICT w, int n, const T* HWY_RESTRICT sums,
                            const HighLanes<T>& lanes, T* const* to,
                            const std::ptrdiff_t* stride) {
    const Tag<T> d;
    constexpr std::size_t N = kLanes<T>;
    Vec<T> sum[R][V];
    unrolled_pairs<R, V>([&](auto r, auto v) OSDX_LAMBDA {
        sum[r][v] = hn::Mul(hn::Set(d, w[r * n]), hn::Load(d, sums + v * N));
    });
    for (int k = 1; k < n; ++k) {
        ++w;
        sums += kSumStride<T>;
        unrolled_pairs<R, V>([&](auto r, auto v) OSDX_LAMBDA {
            sum[r][v] =
                hn::MulAdd(hn::Set(d, w[r * n]), hn::Load(d, sums + v * N), sum[r][v]);
        });
    }
    unrolled<P>([&](auto q) OSDX_LAMBDA {
        T* const first = to[q];
        const std::ptrdiff_t row = stride[q];
        unrolled<V>([&](auto v) OSDX_LAMBDA {
            const SomeLanes<T> some = lanes[v][q];
            if (some.none())
                return;
            unrolled<R>([&](auto r) OSDX_LAMBDA {
                some.store(sum[r][v], first + r * row + v * N);
            });
        });
    });
}

/// All rows of samples.
template <int V, int P, class T>
HWY_NOINLINE void sum_all_columns(const T* w, int n, int ny, const T* sums,
                                  const HighLanes<T>& lanes, T** to,
                                  const std::ptrdiff_t* stride) {
    const auto some = [&](auto r) OSDX_LAMBDA {
        sum_columns<V, r, P>(w, n, sums, lanes, to, stride);
        w += r * n;
        for (int q = 0; q < P; ++q)
            to[q] += r * stride[q];
        ny -= r;
    };
    while (ny >= kMaxRows)
        some(std::integral_constant<int, kMaxRows>());
    if (kMaxRows > 2 && ny >= 2)
        some(std::integral_constant<int, 2>());
    while (ny > 0)
        some(std::integral_constant<int, 1>());
}

/// All rows of samples of y-th derivatives along j, and after them those of higher ones.
/// \param to  the first sample of the patch, by derivative
template <int kOrder, int y, class T>
HWY_INLINE void high_columns(const Table<T>& table, const T* w, const T* sums,
                             const HighVectors<kOrder, T>& vectors,
                             const Target<T>& target, Index sample) {
    constexpr int P = kOrder + 1 - y;
    const int n = table.product_degree + 1;
    T* row[P];
    std::ptrdiff_t stride[P];
    for (int q = 0; q < P; ++q) {
        const int r = (q + y) * (q + y + 1) / 2 + y;
        stride[q] = target.row_stride[r];
        row[q] = target.data[r] + sample * target.sample_stride[r] + vectors.offset[q];
    }
    switch (vectors.n[y]) {
        case 0:
            return;
        case 1:
            sum_all_columns<1, P>(w, n, table.ny, sums, vectors.lanes, row, stride);
            break;
        case 2:
            sum_all_columns<2, P>(w, n, table.ny, sums, vectors.lanes, row, stride);
            break;
        default:
            sum_all_columns<3, P>(w, n, table.ny, sums, vectors.lanes, row, stride);
    }
    if constexpr (y < kOrder)
        high_columns<kOrder, y + 1>(table, w + std::ptrdiff_t(table.ny) * n, sums,
                                    vectors, target, sample);
}

/// V vectors along i, from the `first` on, of all patches.
template <int V, int kOrder, class T>
HWY_NOINLINE void high_group(const Table<T>& table, const Batch<T>& batch,
                             const Target<T>& target, std::size_t first) {
    constexpr std::size_t N = kLanes<T>;
    const int n = table.product_degree + 1;
    const PointSource<T> source{batch.points, batch.last_point, table.transposed ? 1 : n,
                                table.transposed ? n : 1, n};
    const auto last = static_cast<Index>((batch.last_point - batch.points) / 3);
    const std::size_t size = table.padded_row(4);
    const T* const w = table.weights + table.along_i(true) + first * N;
    const HighVectors<kOrder, T> vectors(3 * first * N / 4, 3 * std::size_t(table.nx));
    const Closer<T> closer;
    HWY_ALIGN T sums[(kMaxDegree + 1) * kSumStride<T>];
    if constexpr (N <= 4)
        std::fill_n(sums, std::size(sums), T(0));  // some lanes are written by none
    for (std::size_t b = 0; b < batch.n; ++b) {
        const Index* const indices = batch.indices[b];
        if (contains(indices, std::size_t(table.n_points), last))
            sum_last_rows<V>(source, closer, indices, w, size, sums);
        else
            sum_all_rows<V>(source, closer, indices, w, size, sums);
        high_columns<kOrder, 0>(table, table.weights + table.along_j(), sums, vectors,
                                target, batch.first_samples[b]);
    }
}

/// high_group() for any number of vectors up to V.
template <int V, int kOrder, class T>
HWY_INLINE void high_groups(std::size_t n_vectors, const Table<T>& table,
                            const Batch<T>& batch, const Target<T>& target,
                            std::size_t first) {
    if constexpr (V > 1) {
        if (n_vectors < V)
            return high_groups<V - 1, kOrder>(n_vectors, table, batch, target, first);
    }
    high_group<V, kOrder>(table, batch, target, first);
}

template <int kOrder, class T>
void high_product(const Table<T>& table, const Batch<T>& batch, const Target<T>& target) {
    constexpr std::size_t N = kLanes<T>;
    const std::size_t n = (4 * (kOrder + 1) * std::size_t(table.nx) + N - 1) / N;
    for (std::size_t first = 0; first < n; first += kMaxSpread)
        high_groups<kMaxSpread, kOrder>(n - first, table, batch, target, first);
}

struct Any {
    template <bool kInterleaved, class T>
    static void run(const Table<T>& table, const Batch<T>& batch,
                    const Target<T>& target) {
        if constexpr (kInterleaved) {
            if (table.order == 0)
                return high_product<0>(table, batch, target);
            if (table.order == 1)
                return high_product<1>(table, batch, target);
            high_product<2>(table, batch, target);
        }
    }
};

}  // namespace

}  // namespace osdx::inline OSDX_ABI::grid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // OSDX_EVAL_GRID_HIGH_INL_H_
