// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "eval/grid_kernels.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

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

/// Lanes first .. first + n of a vector, n <= kLanes - first.
template <class T>
class SomeLanes {
public:
    HWY_INLINE SomeLanes() : SomeLanes(0, 0) {}
    HWY_INLINE SomeLanes(std::size_t first, std::size_t n) : first_(first), n_(n) {
        const Tag<T> d;
        mask_ = hn::AndNot(hn::FirstN(d, first), hn::FirstN(d, first + n));
    }
    HWY_INLINE bool none() const { return n_ == 0; }
    /// `to` gets lane 0, or would. Touches nothing else.
    HWY_INLINE void store(Vec<T> v, T* to) const {
        const Tag<T> d;
        if (HWY_TARGET <= HWY_AVX3) {
            hn::BlendedStore(v, mask_, d, to);
        } else if (n_ == kLanes<T>) {
            hn::StoreU(v, d, to);
        } else if (HWY_TARGET <= HWY_AVX2) {
            hn::BlendedStore(v, mask_, d, to);
        } else {
            HWY_ALIGN T lanes[kLanes<T>];
            hn::Store(v, d, lanes);
            std::copy_n(lanes + first_, n_, to + first_);
        }
    }

private:
    std::size_t first_, n_;
    hn::Mask<Tag<T>> mask_;
};

// -------------------------------------------------------------------------- full tables

/// G vectors of rows, from row `first` on, of P patches: x, y, z of each to `sums`, patch by
/// patch.
template <std::size_t G, std::size_t P, class T>
HWY_INLINE void full_group(const Table<T>& table, const T* HWY_RESTRICT points,
                           const Index* const* indices, std::size_t first,
                           T* HWY_RESTRICT sums) {
    const Tag<T> d;
    constexpr std::size_t N = kLanes<T>, kPerPanel = kPanel<T> / N;
    const std::size_t n = static_cast<std::size_t>(table.n_points);
    const std::size_t panel = kPanel<T> * n;
    const T* HWY_RESTRICT w =
        table.weights + first / kPanel<T> * panel + first % kPanel<T>;
    Vec<T> x[P][G], y[P][G], z[P][G];
    for (std::size_t p = 0; p < P; ++p) {
        for (std::size_t g = 0; g < G; ++g)
            x[p][g] = y[p][g] = z[p][g] = hn::Zero(d);
    }
    for (std::size_t k = 0; k < n; ++k, w += kPanel<T>) {
        Vec<T> weights[G];
        for (std::size_t g = 0; g < G; ++g)
            weights[g] = hn::Load(d, w + g / kPerPanel * panel + g % kPerPanel * N);
        for (std::size_t p = 0; p < P; ++p) {
            const T* at = points + 3 * std::size_t(indices[p][k]);
            const Vec<T> px = hn::Set(d, at[0]), py = hn::Set(d, at[1]),
                         pz = hn::Set(d, at[2]);
            for (std::size_t g = 0; g < G; ++g) {
                x[p][g] = hn::MulAdd(weights[g], px, x[p][g]);
                y[p][g] = hn::MulAdd(weights[g], py, y[p][g]);
                z[p][g] = hn::MulAdd(weights[g], pz, z[p][g]);
            }
        }
    }
    for (std::size_t p = 0; p < P; ++p) {
        for (std::size_t g = 0; g < G; ++g, sums += 3 * N) {
            hn::Store(x[p][g], d, sums);
            hn::Store(y[p][g], d, sums + N);
            hn::Store(z[p][g], d, sums + 2 * N);
        }
    }
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

/// element(i) for i in [0, n), to be loaded from any place.
template <class I, std::size_t n, class F>
constexpr std::array<I, n> constants(F element) {
    std::array<I, n> all{};
    for (std::size_t i = 0; i < n; ++i)
        all[i] = static_cast<I>(element(i));
    return all;
}

/// Samples that fill three quarters of a vector with their coordinates. Wide vectors only:
/// narrow ones have StoreInterleaved3() for less.
template <class T>
constexpr std::size_t kChunk = HWY_TARGET <= HWY_AVX3 ? kLanes<T> / 4 : 0;

/// Puts the coordinates of a chunk of samples together.
template <class T>
class Interleaver {
    using Int = hn::RebindToSigned<Tag<T>>;
    using Mask = hn::Mask<Tag<T>>;

public:
    HWY_INLINE Interleaver() {
        const Tag<T> d;
        const Int ints;
        constexpr std::size_t n = kLanes<T>;
        static constexpr auto kSample =
            constants<hn::TFromD<Int>, n>([](std::size_t l) { return l / 3; });
        static constexpr auto kCoordinate =
            constants<hn::TFromD<Int>, n>([](std::size_t l) { return l % 3; });
        sample_ = hn::LoadU(ints, kSample.data());
        const auto coordinate = hn::LoadU(ints, kCoordinate.data());
        is_y_ = hn::RebindMask(d, hn::Eq(coordinate, hn::Set(ints, 1)));
        is_z_ = hn::RebindMask(d, hn::Eq(coordinate, hn::Set(ints, 2)));
        whole_ = hn::FirstN(d, 3 * kChunk<T>);
    }
    /// The chunk from lane `first` on.
    HWY_INLINE void store(Vec<T> x, Vec<T> y, Vec<T> z, std::size_t first, T* to) const {
        const Tag<T> d;
        const auto index = hn::IndicesFromVec(
            d, hn::Add(sample_, hn::Set(Int(), static_cast<hn::TFromD<Int>>(first))));
        auto v = hn::TableLookupLanes(x, index);
        v = hn::IfThenElse(is_y_, hn::TableLookupLanes(y, index), v);
        v = hn::IfThenElse(is_z_, hn::TableLookupLanes(z, index), v);
        hn::BlendedStore(v, whole_, d, to);
    }

private:
    hn::Vec<Int> sample_;
    Mask is_y_, is_z_, whole_;
};

/// Writes a stream of elements to rows of equal length with gaps between them.
template <class T>
class RowWriter {
public:
    RowWriter() = default;
    HWY_INLINE RowWriter(T* row, std::size_t length, std::ptrdiff_t stride)
        : row_(row), length_(length), stride_(stride) {}

    HWY_INLINE void move(std::ptrdiff_t by) { row_ += by; }

    /// Where the next n elements go. \pre fits(n)
    HWY_INLINE T* next(std::size_t n) {
        T* to = row_ + at_;
        at_ += n;
        if (at_ == length_) {
            at_ = 0;
            row_ += stride_;
        }
        return to;
    }
    /// Whether no gap lies between the next n elements.
    HWY_INLINE bool fits(std::size_t n) const { return at_ + n <= length_; }

    /// The first n lanes.
    HWY_INLINE void write(Vec<T> v, std::size_t n) {
        for (std::size_t lane = 0; lane < n;) {
            const std::size_t part = std::min(n - lane, length_ - at_);
            SomeLanes<T>(lane, part).store(v, next(part) - lane);
            lane += part;
        }
    }

private:
    T* row_ = nullptr;
    std::size_t length_ = 0, at_ = 0;
    std::ptrdiff_t stride_ = 0;
};

/// Takes the vectors of rows of the matrix, in their order, to the samples.
template <class T, bool kInterleaved>
class PutSamples {
    static constexpr std::size_t N = kLanes<T>;

public:
    HWY_INLINE PutSamples(const Table<T>& table, const Target<T>& target)
        : n_(table.n_samples()), n_derivatives_(table.n_derivatives()), target_(target) {
        const std::size_t nx = static_cast<std::size_t>(table.nx);
        bool gaps = false;
        for (int r = 0; r < n_derivatives_; ++r) {
            // All samples are one row where no gap lies between them.
            const std::ptrdiff_t stride = target.row_stride[r],
                                 length = table.nx * target.sample_stride[r];
            gaps = table.ny > 1 && stride != length;
            for (int c = 0; c < kStreams; ++c)
                starts_[r][c] = RowWriter<T>(
                    target.data[r] + c * target.channel_stride[r],
                    static_cast<std::size_t>(gaps ? length : length * table.ny), stride);
        }
        // Where nothing need be cut.
        in_chunks_ = kChunk<T> > 0
                         ? (gaps ? nx : n_) % std::max<std::size_t>(1, kChunk<T>) == 0
                         : gaps && nx % kSmall == 0 && N % kSmall == 0;
    }

    /// \param first  the first sample of the patch
    HWY_INLINE void start(Index first) {
        first_ = first;
        derivative_ = 0;
        start_derivative();
    }

    /// \param sums  a vector each of x, y, z; overwritten
    HWY_INLINE void operator()(T* sums) {
        const Tag<T> d;
        const Vec<T> x = hn::Load(d, sums), y = hn::Load(d, sums + N),
                     z = hn::Load(d, sums + 2 * N);
        const std::size_t count = sample_ < n_ ? std::min(N, n_ - sample_) : 0;
        if constexpr (kInterleaved) {
            if (in_chunks_)
                put_chunks(x, y, z, sums, count);
            else
                put_stream(x, y, z, sums, count);
        } else {
            rows_[0].write(x, count);
            rows_[1].write(y, count);
            rows_[2].write(z, count);
        }
        sample_ += N;
        if (sample_ >= padded<T>(n_)) {
            ++derivative_;
            start_derivative();
        }
    }

private:
    static constexpr int kStreams = kInterleaved ? 1 : 3;
    static constexpr std::size_t kSmall = 16 / sizeof(T);

    HWY_INLINE void start_derivative() {
        sample_ = 0;
        const int r = derivative_;
        for (int c = 0; c < kStreams && r < n_derivatives_; ++c) {
            rows_[c] = starts_[r][c];
            rows_[c].move(first_ * target_.sample_stride[r]);
        }
    }

    HWY_INLINE void put_chunks(Vec<T> x, Vec<T> y, Vec<T> z, const T* sums,
                               std::size_t count) {
        if constexpr ((kChunk<T>) > 0) {
            if (HWY_LIKELY(count == N)) {  // known to the compiler, so that it unrolls
                for (std::size_t k = 0; k < N; k += kChunk<T>)
                    interleaver_.store(x, y, z, k, rows_[0].next(3 * kChunk<T>));
                return;
            }
            for (std::size_t k = 0; k < count; k += kChunk<T>)
                interleaver_.store(x, y, z, k, rows_[0].next(3 * kChunk<T>));
        } else {
            const hn::CappedTag<T, kSmall> small;
            for (std::size_t k = 0; k < count; k += kSmall) {
                hn::StoreInterleaved3(
                    hn::Load(small, sums + k), hn::Load(small, sums + N + k),
                    hn::Load(small, sums + 2 * N + k), small, rows_[0].next(3 * kSmall));
            }
        }
    }
    HWY_INLINE void put_stream(Vec<T> x, Vec<T> y, Vec<T> z, T* sums, std::size_t count) {
        const Tag<T> d;
        if (count == N && rows_[0].fits(3 * N))
            return hn::StoreInterleaved3(x, y, z, d, rows_[0].next(3 * N));
        hn::StoreInterleaved3(x, y, z, d, sums);
        for (std::size_t k = 0; k < 3; ++k) {
            if (3 * count > k * N)
                rows_[0].write(hn::Load(d, sums + k * N), std::min(N, 3 * count - k * N));
        }
    }

    std::size_t n_;  // samples
    int n_derivatives_;
    const Target<T>& target_;
    const Interleaver<T> interleaver_;
    bool in_chunks_;
    RowWriter<T> starts_[6][kStreams];  // as if all patches started at sample 0
    Index first_ = 0;
    int derivative_ = 0;
    std::size_t sample_ = 0;
    RowWriter<T> rows_[kStreams];
};

template <bool kInterleaved, class T>
void full(const Table<T>& table, const Batch<T>& batch, const Target<T>& target) {
    constexpr std::size_t N = kLanes<T>;
    const std::size_t n_vectors =
        table.n_derivatives() * padded<T>(table.n_samples()) / N;
    const std::size_t n_groups = (n_vectors + kMaxGroup - 1) / kMaxGroup;
    // Groups of equal size, unless the vectors of a panel would be parted.
    const std::size_t size =
        N == kPanel<T> ? (n_vectors + n_groups - 1) / n_groups : kMaxGroup;
    PutSamples<T, kInterleaved> put(table, target);
    HWY_ALIGN T sums[3 * kMaxGroup * N];
    std::size_t b = 0;
    // Two patches at a time, where a group is small: it would wait for its own sums.
    for (; 2 * n_vectors <= kMaxGroup && b + 2 <= batch.n; b += 2) {
        full_groups<kMaxGroup / 2, 2>(n_vectors, table, batch.points, batch.indices + b,
                                      0, sums);
        T* next = sums;
        for (const std::size_t patch : {b, b + 1}) {
            put.start(batch.first_samples[patch]);
            for (std::size_t g = 0; g < n_vectors; ++g, next += 3 * N)
                put(next);
        }
    }
    for (; b < batch.n; ++b) {
        put.start(batch.first_samples[b]);
        for (std::size_t first = 0; first < n_vectors; first += size) {
            const std::size_t n = std::min(size, n_vectors - first);
            full_groups<kMaxGroup, 1>(n, table, batch.points, batch.indices + b,
                                      first * N, sums);
            for (std::size_t g = 0; g < n; ++g)
                put(sums + 3 * N * g);
        }
    }
}

// ------------------------------------------------------------------------------- products

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

/// Along j: y-th derivatives and, after them, higher ones, of sums along i of all rows of
/// control points.
/// \param w   the basis along j
/// \param to  the first sample of the patch, by derivative
template <int K, int kOrder, int y, bool kInterleaved, class T>
HWY_INLINE void product_columns(const Table<T>& table, const T* HWY_RESTRICT w,
                                const Vec<T>* sums,
                                const ProductVector<kOrder, kInterleaved, T>& vector,
                                const Target<T>& target, T* const* to) {
    const Tag<T> d;
    const int n = n_columns<K>(table), ny = table.ny;
    constexpr int kParts = kOrder + 1 - y;
    T* row[kParts];
    std::ptrdiff_t stride[kParts];
    SomeLanes<T> lanes[kParts];
    bool none = true;
    for (int q = 0; q < kParts; ++q) {
        const int r = (q + y) * (q + y + 1) / 2 + y;
        lanes[q] = vector.lanes[q];
        stride[q] = target.row_stride[r];
        row[q] = to[r] + vector.offset[q];
        none = none && lanes[q].none();
    }
    if (!none) {
        const T* HWY_RESTRICT wj = w;
#pragma GCC unroll 4
        for (int j = 0; j < ny; ++j, wj += n) {
            Vec<T> sum = hn::Mul(hn::Set(d, wj[0]), sums[0]);
            for (int k = 1; k < n; ++k)
                sum = hn::MulAdd(hn::Set(d, wj[k]), sums[k], sum);
            for (int q = 0; q < kParts; ++q) {
                if (!lanes[q].none())
                    lanes[q].store(sum, row[q]);
                row[q] += stride[q];
            }
        }
    }
    if constexpr (y < kOrder)
        product_columns<K, kOrder, y + 1>(table, w + std::ptrdiff_t(ny) * n, sums, vector,
                                          target, to);
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

template <int K, int kOrder, bool kInterleaved, class T>
HWY_INLINE void product_of_patch(const Table<T>& table, std::size_t size,
                                 const T* HWY_RESTRICT along_j,
                                 const T* HWY_RESTRICT points,
                                 const ProductVector<kOrder, kInterleaved, T>& vector,
                                 const Target<T>& target, T* const* to) {
    const Tag<T> d;
    const int n = n_columns<K>(table);
    constexpr auto kStride = std::ptrdiff_t(kPointStride);
    const std::ptrdiff_t along_k = table.transposed ? kStride * n : kStride,
                         along_row = table.transposed ? kStride : kStride * n;
    const T* HWY_RESTRICT weights = vector.weights;
    const Pattern<kInterleaved, T> pattern = vector.pattern;
    Vec<T> sums[K > 0 ? K : kMaxDegree + 1];
    for (int row = 0; row < n; ++row) {
        const T* p = points + row * along_row;
        Vec<T> sum = hn::Mul(hn::Load(d, weights), pattern(p));
        for (int k = 1; k < n; ++k)
            sum = hn::MulAdd(hn::Load(d, weights + k * size), pattern(p + k * along_k),
                             sum);
        sums[row] = sum;
    }
    product_columns<K, kOrder, 0>(table, along_j, sums, vector, target, to);
}

template <int K, int kOrder, bool kInterleaved, class T>
HWY_NOINLINE void product(const Table<T>& table, const Batch<T>& batch,
                          const Target<T>& target) {
    // Some vectors at a time, of all patches.
    constexpr std::size_t N = kLanes<T>, kGroup = 4;
    constexpr int n = K > 0 ? K : kMaxDegree + 1;
    constexpr int kDerivatives = (kOrder + 1) * (kOrder + 2) / 2;
    const std::size_t size = table.padded_row(kInterleaved ? 3 : 1);
    const T* const along_j = table.weights + table.along_j();
    const std::size_t length =
        (kInterleaved ? 3 : 1) * (kOrder + 1) * std::size_t(table.nx);
    HWY_ALIGN T points[kPointStride * n * n];
    for (std::size_t c = 0; c < (kInterleaved ? 1 : 3); ++c) {
        for (std::size_t first = 0; first < length; first += kGroup * N) {
            const ProductVector<kOrder, kInterleaved, T> vectors[kGroup] = {
                {table, first, c},
                {table, first + N, c},
                {table, first + 2 * N, c},
                {table, first + 3 * N, c}};
            for (std::size_t b = 0; b < batch.n; ++b) {
                gather(batch, b, table.n_points, points);
                T* to[kDerivatives];
                for (int r = 0; r < kDerivatives; ++r)
                    to[r] = target.data[r] +
                            batch.first_samples[b] * target.sample_stride[r] +
                            std::ptrdiff_t(c) * target.channel_stride[r];
                for (std::size_t v = 0; v < kGroup && first + v * N < length; ++v)
                    product_of_patch<K, kOrder, kInterleaved>(
                        table, size, along_j, points, vectors[v], target, to);
            }
        }
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

/// With the number of columns known to the compiler up to kMaxColumns.
constexpr int kMaxColumns = 8;

template <int K, bool kInterleaved, class T>
void any_product(const Table<T>& table, const Batch<T>& batch, const Target<T>& target) {
    if (table.product_degree + 1 == K)
        return product_of_order<K, kInterleaved>(table, batch, target);
    if constexpr (K < kMaxColumns)
        any_product<K + 1, kInterleaved>(table, batch, target);
    else
        product_of_order<0, kInterleaved>(table, batch, target);
}

template <bool kInterleaved, class T>
void any_table(const Table<T>& table, const Batch<T>& batch, const Target<T>& target) {
    if (table.product_degree == 0)
        return full<kInterleaved>(table, batch, target);
    any_product<kMinDegree + 1, kInterleaved>(table, batch, target);
}

// --------------------------------------------------------------------------------- layouts

template <class T>
void evaluate(const Table<T>& table, const Batch<T>& batch, const Target<T>& target,
              T* scratch) {
    if (target.layout == Layout::Interleaved)
        return any_table<true>(table, batch, target);
    if (target.layout == Layout::Planar)
        return any_table<false>(table, batch, target);
    // By way of scratch memory.
    const std::size_t size = 3 * padded<T>(table.n_samples());
    Target<T> packed;
    for (int r = 0; r < table.n_derivatives(); ++r) {
        packed.data[r] = scratch + size * r;
        packed.row_stride[r] = 3 * table.nx;
        packed.sample_stride[r] = 3;
        packed.channel_stride[r] = 1;
    }
    constexpr Index kFirst = 0;
    for (std::size_t b = 0; b < batch.n; ++b) {
        any_table<true>(table,
                        {1, batch.points, batch.last_point, batch.indices + b, &kFirst},
                        packed);
        for (int r = 0; r < table.n_derivatives(); ++r) {
            const T* from = packed.data[r];
            const std::ptrdiff_t stride = target.sample_stride[r];
            for (int j = 0; j < table.ny; ++j) {
                T* to = target.data[r] + batch.first_samples[b] * stride +
                        j * target.row_stride[r];
                for (int i = 0; i < table.nx; ++i, from += 3, to += stride) {
                    for (int c = 0; c < 3; ++c)
                        to[c * target.channel_stride[r]] = from[c];
                }
            }
        }
    }
}

void evaluate_float(const Table<float>& table, const Batch<float>& batch,
                    const Target<float>& target, float* scratch) {
    evaluate(table, batch, target, scratch);
}
void evaluate_double(const Table<double>& table, const Batch<double>& batch,
                     const Target<double>& target, double* scratch) {
    evaluate(table, batch, target, scratch);
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
    // For other layouts; a vector may reach a little beyond.
    return 3 * padded<T>(table.n_samples()) * table.n_derivatives() + kPanel<T>;
}
template std::size_t scratch_size(const Table<float>&) noexcept;
template std::size_t scratch_size(const Table<double>&) noexcept;

}  // namespace osdx::grid
#endif
