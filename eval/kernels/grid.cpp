// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "eval/kernels/grid.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <type_traits>

#include "eval/kernels/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "eval/kernels/grid.cpp"
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

/// Calls f for the constants 0 .. n - 1. Arrays whose indices are constants stay in registers;
/// those of loops go by way of memory.
template <int n, class F>
HWY_INLINE void unrolled(F&& f) {
    if constexpr (n > 0) {
        unrolled<n - 1>(f);
        f(std::integral_constant<int, n - 1>());
    }
}
/// The same for pairs of constants.
template <int n, int m, class F>
HWY_INLINE void unrolled_pairs(F&& f) {
    unrolled<n>([&](auto i)
                    OSDX_LAMBDA { unrolled<m>([&](auto j) OSDX_LAMBDA { f(i, j); }); });
}

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

    /// What comes next of a patch.
    struct Place {
        Index first_sample;
        int derivative;
        std::size_t sample;
        RowWriter<T> rows[kInterleaved ? 1 : 3];
    };
    HWY_INLINE void start(Index first_sample, Place& place) const {
        place.first_sample = first_sample;
        place.derivative = 0;
        start_derivative(place);
    }

    /// \param sums  a vector each of x, y, z; overwritten
    HWY_INLINE void operator()(T* sums, Place& place) const {
        const Tag<T> d;
        const Vec<T> x = hn::Load(d, sums), y = hn::Load(d, sums + N),
                     z = hn::Load(d, sums + 2 * N);
        const std::size_t count = place.sample < n_ ? std::min(N, n_ - place.sample) : 0;
        RowWriter<T>(&rows)[kStreams] = place.rows;
        if constexpr (kInterleaved) {
            if (in_chunks_)
                put_chunks(x, y, z, sums, count, rows[0]);
            else
                put_stream(x, y, z, sums, count, rows[0]);
        } else {
            rows[0].write(x, count);
            rows[1].write(y, count);
            rows[2].write(z, count);
        }
        place.sample += N;
        if (place.sample >= padded<T>(n_)) {
            ++place.derivative;
            start_derivative(place);
        }
    }

private:
    static constexpr int kStreams = kInterleaved ? 1 : 3;
    static constexpr std::size_t kSmall = 16 / sizeof(T);

    HWY_INLINE void start_derivative(Place& place) const {
        place.sample = 0;
        const int r = place.derivative;
        for (int c = 0; c < kStreams && r < n_derivatives_; ++c) {
            place.rows[c] = starts_[r][c];
            place.rows[c].move(place.first_sample * target_.sample_stride[r]);
        }
    }

    HWY_INLINE void put_chunks(Vec<T> x, Vec<T> y, Vec<T> z, const T* sums,
                               std::size_t count, RowWriter<T>& row) const {
        if constexpr ((kChunk<T>) > 0) {
            if (HWY_LIKELY(count == N)) {  // known to the compiler, so that it unrolls
                for (std::size_t k = 0; k < N; k += kChunk<T>)
                    interleaver_.store(x, y, z, k, row.next(3 * kChunk<T>));
                return;
            }
            for (std::size_t k = 0; k < count; k += kChunk<T>)
                interleaver_.store(x, y, z, k, row.next(3 * kChunk<T>));
        } else {
            const hn::CappedTag<T, kSmall> small;
            for (std::size_t k = 0; k < count; k += kSmall) {
                hn::StoreInterleaved3(
                    hn::Load(small, sums + k), hn::Load(small, sums + N + k),
                    hn::Load(small, sums + 2 * N + k), small, row.next(3 * kSmall));
            }
        }
    }
    HWY_INLINE void put_stream(Vec<T> x, Vec<T> y, Vec<T> z, T* sums, std::size_t count,
                               RowWriter<T>& row) const {
        const Tag<T> d;
        if (count == N && row.fits(3 * N))
            return hn::StoreInterleaved3(x, y, z, d, row.next(3 * N));
        hn::StoreInterleaved3(x, y, z, d, sums);
        for (std::size_t k = 0; k < 3; ++k) {
            if (3 * count > k * N)
                row.write(hn::Load(d, sums + k * N), std::min(N, 3 * count - k * N));
        }
    }

    std::size_t n_;  // samples
    int n_derivatives_;
    const Target<T>& target_;
    const Interleaver<T> interleaver_;
    bool in_chunks_;
    RowWriter<T> starts_[6][kStreams];  // as if all patches started at sample 0
};

/// n rows of a packed matrix, from row `first` on.
/// \param sums  vectors each of x, y, z
template <class T>
void put_packed(const Table<T>& table, const Target<T>& target, Index first_sample,
                std::size_t first, std::size_t n, const T* sums) {
    constexpr std::size_t N = kLanes<T>;
    const std::size_t n_samples = table.n_samples(),
                      n_rows = n_samples * table.n_derivatives(),
                      sample = first % n_samples, nx = static_cast<std::size_t>(table.nx);
    std::size_t r = first / n_samples, i = sample % nx, j = sample / nx;
    for (std::size_t k = 0; k < n && first + k < n_rows; ++k) {
        T* const to = target.data[r] +
                      (first_sample + std::ptrdiff_t(i)) * target.sample_stride[r] +
                      std::ptrdiff_t(j) * target.row_stride[r];
        const T* const from = sums + k / N * 3 * N + k % N;
        for (std::size_t c = 0; c < 3; ++c)
            to[std::ptrdiff_t(c) * target.channel_stride[r]] = from[c * N];
        if (++i == nx) {
            i = 0;
            ++j;
        }
        if (j * nx == n_samples) {
            j = 0;
            ++r;
        }
    }
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

// --------------------------------------------------------------------- products of low degree

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

// ------------------------------------------------------------------ products of high degree

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

template <bool kInterleaved, class T>
void any_table(const Table<T>& table, const Batch<T>& batch, const Target<T>& target) {
    if (table.product_degree == 0)
        return full<kInterleaved>(table, batch, target);
    if constexpr (kInterleaved) {
        if (table.product_degree < kHighDegree)
            return any_product<kMinDegree + 1, kHighDegree, true>(table, batch, target);
        if (table.order == 0)
            return high_product<0>(table, batch, target);
        if (table.order == 1)
            return high_product<1>(table, batch, target);
        return high_product<2>(table, batch, target);
    } else {
        any_product<4, 4, false>(table, batch, target);
    }
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

namespace {

/// Until a target is chosen, Highway's functions look for one with every call.
void choose_target() noexcept {
    hwy::ChosenTarget& chosen = hwy::GetChosenTarget();
    if (!chosen.IsInitialized())
        chosen.Update(hwy::SupportedTargets());
}

}  // namespace

template <>
Kernel<float> kernel() noexcept {
    choose_target();
    return HWY_DYNAMIC_DISPATCH(evaluate_float);
}
template <>
Kernel<double> kernel() noexcept {
    choose_target();
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
