// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

// Included once for each instruction set that is compiled (hwy/foreach_target.h).
#if defined(OSDX_EVAL_GRID_PRODUCT_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef OSDX_EVAL_GRID_PRODUCT_INL_H_
#undef OSDX_EVAL_GRID_PRODUCT_INL_H_
#else
#define OSDX_EVAL_GRID_PRODUCT_INL_H_
#endif

#include "eval/kernels/grid_layout-inl.h"
#include "eval/kernels/grid_store-inl.h"

// Products of low degree, and of any degree into planar layouts.

HWY_BEFORE_NAMESPACE();
namespace osdx::inline OSDX_ABI::grid::HWY_NAMESPACE {
namespace {

/// K = degree + 1, or 0 for whatever the table says.
template <int K, class T>
HWY_INLINE int n_columns(const Table<T>& table) {
    return K > 0 ? K : table.product_degree + 1;
}

/// From one gathered point to the next: each is written and read as one vector.
constexpr std::size_t kPointStride = 4;

/// x, y, z, x, ... of a control point in all lanes, or one of them.
template <bool kInterleaved, class T>
class Pattern {
    static constexpr std::size_t N = kLanes<T>;
    using D = Tag<T>;
    using Bytes = hn::Repartition<std::uint8_t, D>;
    using Int = hn::RebindToSigned<D>;

public:
    /// \param first  of the elements that run on from vector to vector, or the coordinate
    HWY_INLINE explicit Pattern(std::size_t first) : first_(first % 3) {
        if constexpr (kInterleaved && sizeof(T) == 4 && N >= 4) {
            static constexpr auto kIndex = constants<std::uint8_t, 4 * (N + 2)>(
                [](std::size_t b) { return b % 12; });
            index_ = hn::BitCast(D(), hn::LoadU(Bytes(), kIndex.data() + 4 * first_));
        } else if constexpr (kInterleaved && N >= 4) {
            static constexpr auto kIndex =
                constants<hn::TFromD<Int>, N + 2>([](std::size_t l) { return l % 3; });
            index_ = hn::BitCast(D(), hn::LoadU(Int(), kIndex.data() + first_));
        }
    }
    /// \param point  kPointStride elements
    HWY_INLINE Vec<T> operator()(const T* point) const {
        const D d;
        if constexpr (!kInterleaved) {
            return hn::Set(d, point[first_]);
        } else if constexpr (sizeof(T) == 4 && N >= 4) {
            return hn::BitCast(
                d, hn::TableLookupBytes(hn::BitCast(Bytes(), hn::LoadDup128(d, point)),
                                        hn::BitCast(Bytes(), index_)));
        } else if constexpr (N >= 4) {
            const auto index = hn::IndicesFromVec(d, hn::BitCast(Int(), index_));
            return hn::TableLookupLanes(
                hn::MaskedLoad(hn::FirstN(d, kPointStride), d, point), index);
        } else {
            HWY_ALIGN T lanes[N];
            for (std::size_t l = 0; l < N; ++l)
                lanes[l] = point[(first_ + l) % 3];
            return hn::Load(d, lanes);
        }
    }

private:
    std::size_t first_;
    Vec<T> index_{};
};

/// The samples of a row stand one after the other, values before derivatives along i, each with
/// all coordinates or one of them: a stream that is cut into vectors. This is one of these.
template <int kOrder, bool kInterleaved, class T>
struct ProductVector {
    const T* weights;  // along i
    Pattern<kInterleaved, T> pattern;
    // Where the lanes go, by derivative along i.
    SomeLanes<T> lanes[kOrder + 1];
    std::ptrdiff_t offset[kOrder + 1];  // of lane 0 from the first element

    HWY_INLINE ProductVector() : weights(nullptr), pattern(0), offset{} {}
    HWY_INLINE ProductVector(const Table<T>& table, std::size_t first,
                             std::size_t coordinate)
        : weights(table.weights + table.along_i(kInterleaved) + first),
          pattern(kInterleaved ? first : coordinate) {
        const std::size_t length = (kInterleaved ? 3 : 1) * std::size_t(table.nx);
        for (std::size_t q = 0; q <= kOrder; ++q) {
            const std::size_t end = first + kLanes<T>,
                              lo = std::clamp(q * length, first, end),
                              hi = std::clamp((q + 1) * length, first, end);
            lanes[q] = SomeLanes<T>(lo - first, hi - lo);
            offset[q] = std::ptrdiff_t(first) - std::ptrdiff_t(q * length);
        }
    }
};

/// Along j: y-th derivatives and, after them, higher ones, of V vectors of sums along i of all
/// rows of control points.
/// \param w   the basis along j
/// \param to  the first sample of the patch, by derivative
template <int K, int kOrder, int V, int y, bool kInterleaved, class T, std::size_t kRows>
HWY_INLINE void product_columns(const Table<T>& table, const T* HWY_RESTRICT w,
                                const Vec<T> (&sums)[V][kRows],
                                const ProductVector<kOrder, kInterleaved, T>* vectors,
                                const Target<T>& target, T* const* to) {
    const Tag<T> d;
    const int n = n_columns<K>(table), ny = table.ny;
    constexpr int kParts = kOrder + 1 - y;
    T* row[kParts];
    std::ptrdiff_t stride[kParts];
    SomeLanes<T> lanes[V][kParts];
    bool none[V], all_none = true;
    for (int q = 0; q < kParts; ++q) {
        const int r = (q + y) * (q + y + 1) / 2 + y;
        stride[q] = target.row_stride[r];
        row[q] = to[r] + vectors[0].offset[q];
    }
    for (int v = 0; v < V; ++v) {
        none[v] = true;
        for (int q = 0; q < kParts; ++q) {
            lanes[v][q] = vectors[v].lanes[q];
            none[v] = none[v] && lanes[v][q].none();
        }
        all_none = all_none && none[v];
    }
    const T* HWY_RESTRICT wj = w;
    for (int j = 0; j < ny && !all_none; ++j, wj += n) {
        for (int v = 0; v < V; ++v) {
            if (none[v])
                continue;
            Vec<T> sum = hn::Mul(hn::Set(d, wj[0]), sums[v][0]);
            for (int k = 1; k < n; ++k)
                sum = hn::MulAdd(hn::Set(d, wj[k]), sums[v][k], sum);
            for (int q = 0; q < kParts; ++q) {
                if (!lanes[v][q].none())
                    lanes[v][q].store(sum, row[q] + v * kLanes<T>);
            }
        }
        for (int q = 0; q < kParts; ++q)
            row[q] += stride[q];
    }
    if constexpr (y < kOrder)
        product_columns<K, kOrder, V, y + 1>(table, w + std::ptrdiff_t(ny) * n, sums,
                                             vectors, target, to);
}

template <class T>
HWY_INLINE void gather(const Batch<T>& batch, std::size_t patch, int n, T* out) {
    for (int i = 0; i < n; ++i, out += kPointStride) {
        const T* p = batch.points + 3 * std::size_t(batch.indices[patch][i]);
        if (HWY_LIKELY(p != batch.last_point))
            std::memcpy(out, p, 4 * sizeof(T));
        else
            std::memcpy(out, p, 3 * sizeof(T));
    }
}

/// V vectors of one patch.
template <int K, int kOrder, int V, bool kInterleaved, class T>
HWY_INLINE void product_of_patch(const Table<T>& table, std::size_t size,
                                 const T* HWY_RESTRICT along_j,
                                 const T* HWY_RESTRICT points,
                                 const ProductVector<kOrder, kInterleaved, T>* vectors,
                                 const Target<T>& target, T* const* to) {
    const Tag<T> d;
    const int n = n_columns<K>(table);
    constexpr auto kStride = std::ptrdiff_t(kPointStride);
    const std::ptrdiff_t along_k = table.transposed ? kStride * n : kStride,
                         along_row = table.transposed ? kStride : kStride * n;
    Vec<T> sums[V][K > 0 ? K : kMaxDegree + 1];
    for (int row = 0; row < n; ++row) {
        const T* p = points + row * along_row;
        for (int v = 0; v < V; ++v)
            sums[v][row] =
                hn::Mul(hn::Load(d, vectors[v].weights), vectors[v].pattern(p));
        for (int k = 1; k < n; ++k) {
            p += along_k;
            for (int v = 0; v < V; ++v)
                sums[v][row] = hn::MulAdd(hn::Load(d, vectors[v].weights + k * size),
                                          vectors[v].pattern(p), sums[v][row]);
        }
    }
    product_columns<K, kOrder, V, 0>(table, along_j, sums, vectors, target, to);
}

/// V vectors, from element `first` of the stream on, of all patches.
template <int K, int kOrder, int V, bool kInterleaved, class T>
HWY_INLINE void product_group(const Table<T>& table, const Batch<T>& batch,
                              const Target<T>& target, std::size_t first,
                              std::size_t coordinate) {
    constexpr int n = K > 0 ? K : kMaxDegree + 1;
    constexpr int kDerivatives = (kOrder + 1) * (kOrder + 2) / 2;
    const std::size_t size = table.padded_row(kInterleaved ? 3 : 1);
    const T* const along_j = table.weights + table.along_j();
    ProductVector<kOrder, kInterleaved, T> vectors[V];
    for (std::size_t v = 0; v < V; ++v)
        vectors[v] = {table, first + v * kLanes<T>, coordinate};
    HWY_ALIGN T points[kPointStride * n * n];
    for (std::size_t b = 0; b < batch.n; ++b) {
        gather(batch, b, table.n_points, points);
        T* to[kDerivatives];
        for (int r = 0; r < kDerivatives; ++r)
            to[r] = target.data[r] + batch.first_samples[b] * target.sample_stride[r] +
                    std::ptrdiff_t(coordinate) * target.channel_stride[r];
        product_of_patch<K, kOrder, V>(table, size, along_j, points, vectors, target, to);
    }
}

/// product_group() for any number of vectors up to V.
template <int K, int kOrder, int V, bool kInterleaved, class T>
HWY_INLINE void product_groups(std::size_t n_vectors, const Table<T>& table,
                               const Batch<T>& batch, const Target<T>& target,
                               std::size_t first, std::size_t coordinate) {
    if constexpr (V > 1) {
        if (n_vectors < V)
            return product_groups<K, kOrder, V - 1, kInterleaved>(
                n_vectors, table, batch, target, first, coordinate);
    }
    product_group<K, kOrder, V, kInterleaved>(table, batch, target, first, coordinate);
}

template <int K, int kOrder, bool kInterleaved, class T>
HWY_NOINLINE void product(const Table<T>& table, const Batch<T>& batch,
                          const Target<T>& target) {
    // As many as half of the registers hold the sums of, in the layout that is common.
    constexpr std::size_t N = kLanes<T>;
    constexpr bool kMany =
        HWY_TARGET <= HWY_AVX3 && kInterleaved && sizeof(T) == 4 && K > 0;
    constexpr int V = kMany ? std::clamp(16 / std::max(K, 1), 1, 3) : 1;
    const std::size_t length =
        (kInterleaved ? 3 : 1) * (kOrder + 1) * std::size_t(table.nx);
    for (std::size_t c = 0; c < (kInterleaved ? 1 : 3); ++c) {
        for (std::size_t first = 0; first < length; first += V * N)
            product_groups<K, kOrder, V, kInterleaved>((length - first + N - 1) / N,
                                                       table, batch, target, first, c);
    }
}

template <int K, bool kInterleaved, class T>
void product_of_order(const Table<T>& table, const Batch<T>& batch,
                      const Target<T>& target) {
    switch (table.order) {
        case 0:
            return product<K, 0, kInterleaved>(table, batch, target);
        case 1:
            return product<K, 1, kInterleaved>(table, batch, target);
        default:
            return product<K, 2, kInterleaved>(table, batch, target);
    }
}

/// With the number of columns known to the compiler from K up to kLast.
template <int K, int kLast, bool kInterleaved, class T>
void any_product(const Table<T>& table, const Batch<T>& batch, const Target<T>& target) {
    if (table.product_degree + 1 == K)
        return product_of_order<K, kInterleaved>(table, batch, target);
    if constexpr (K < kLast)
        return any_product<K + 1, kLast, kInterleaved>(table, batch, target);
    if constexpr (!kInterleaved)
        product_of_order<0, kInterleaved>(table, batch, target);
}

struct Any {
    template <bool kInterleaved, class T>
    static void run(const Table<T>& table, const Batch<T>& batch,
                    const Target<T>& target) {
        if constexpr (kInterleaved)
            any_product<kMinDegree + 1, kHighDegree, true>(table, batch, target);
        else
            any_product<4, 4, false>(table, batch, target);
    }
};

}  // namespace

}  // namespace osdx::inline OSDX_ABI::grid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // OSDX_EVAL_GRID_PRODUCT_INL_H_
