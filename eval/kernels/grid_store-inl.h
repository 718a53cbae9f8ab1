// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

// Included once for each instruction set that is compiled (hwy/foreach_target.h).
#if defined(OSDX_EVAL_GRID_STORE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef OSDX_EVAL_GRID_STORE_INL_H_
#undef OSDX_EVAL_GRID_STORE_INL_H_
#else
#define OSDX_EVAL_GRID_STORE_INL_H_
#endif

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <type_traits>

#include <hwy/highway.h>

#include "eval/kernels/grid.h"

// How the kernels of grids put samples where they are wanted.

HWY_BEFORE_NAMESPACE();
namespace osdx::inline OSDX_ABI::grid::HWY_NAMESPACE {
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

}  // namespace
}  // namespace osdx::inline OSDX_ABI::grid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // OSDX_EVAL_GRID_STORE_INL_H_
