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

/// Lanes first .. first + n of a vector, n <= kLanes - first. Touches nothing else.
template <class T>
HWY_INLINE void store_lanes(Vec<T> v, std::size_t first, std::size_t n, T* to) {
    const Tag<T> d;
#if HWY_TARGET <= HWY_AVX2
    const auto mask = hn::AndNot(hn::FirstN(d, first), hn::FirstN(d, first + n));
    hn::BlendedStore(v, mask, d, to - first);
#else
    HWY_ALIGN T lanes[kLanes<T>];
    hn::Store(v, d, lanes);
    std::copy_n(lanes + first, n, to);
#endif
}

// -------------------------------------------------------------------------- full tables

/// G vectors of rows, from row `first` on: x, y, z of each to `sums`.
template <std::size_t G, class T>
HWY_INLINE void full_group(const Table<T>& table, const T* HWY_RESTRICT points,
                           std::size_t first, T* HWY_RESTRICT sums) {
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
    for (std::size_t g = 0; g < G; ++g) {
        hn::Store(x[g], d, sums + 3 * N * g);
        hn::Store(y[g], d, sums + 3 * N * g + N);
        hn::Store(z[g], d, sums + 3 * N * g + 2 * N);
    }
}

/// full_group() for any number of vectors up to G.
template <std::size_t G, class T>
HWY_INLINE void full_groups(std::size_t n_vectors, const Table<T>& table, const T* points,
                            std::size_t first, T* sums) {
    if constexpr (G > 1) {
        if (n_vectors < G)
            return full_groups<G - 1>(n_vectors, table, points, first, sums);
    }
    full_group<G>(table, points, first, sums);
}

/// Writes a stream of elements to rows of equal length with gaps between them.
template <class T>
class RowWriter {
public:
    RowWriter() = default;
    HWY_INLINE RowWriter(T* row, std::size_t length, std::ptrdiff_t stride)
        : row_(row), length_(length), stride_(stride) {}

    /// Where the next n elements go, if no gap lies between them; else null.
    HWY_INLINE T* next(std::size_t n) {
        if (at_ + n > length_)
            return nullptr;
        T* to = row_ + at_;
        advance(n);
        return to;
    }

    /// The first n lanes.
    HWY_INLINE void write(Vec<T> v, std::size_t n) {
        const Tag<T> d;
        for (std::size_t lane = 0; lane < n;) {
            const std::size_t part = std::min(n - lane, length_ - at_);
            if (part == kLanes<T>)
                hn::StoreU(v, d, row_ + at_);
            else
                store_lanes<T>(v, lane, part, row_ + at_);
            lane += part;
            advance(part);
        }
    }

private:
    HWY_INLINE void advance(std::size_t n) {
        at_ += n;
        if (at_ == length_) {
            at_ = 0;
            row_ += stride_;
        }
    }

    T* row_ = nullptr;
    std::size_t length_ = 0, at_ = 0;
    std::ptrdiff_t stride_ = 0;
};

/// Takes the vectors of rows, in their order, to the samples.
template <class T, bool kInterleaved>
class PutSamples {
public:
    HWY_INLINE PutSamples(const Table<T>& table, const Target<T>& target, Index first)
        : table_(table), target_(target), first_(first) {
        start_derivative();
    }

    /// \param sums  a vector each of x, y, z; overwritten
    HWY_INLINE void operator()(T* sums) {
        const Tag<T> d;
        constexpr std::size_t N = kLanes<T>;
        const Vec<T> x = hn::Load(d, sums), y = hn::Load(d, sums + N),
                     z = hn::Load(d, sums + 2 * N);
        const std::size_t n = table_.n_samples();
        const std::size_t count = sample_ < n ? std::min(N, n - sample_) : 0;
        const hn::CappedTag<T, 16 / sizeof(T)> small;
        constexpr std::size_t kSmall = hn::MaxLanes(small);
        if (kInterleaved && in_small_parts_) {
            for (std::size_t k = 0; k < count; k += kSmall) {
                hn::StoreInterleaved3(
                    hn::Load(small, sums + k), hn::Load(small, sums + N + k),
                    hn::Load(small, sums + 2 * N + k), small, rows_[0].next(3 * kSmall));
            }
        } else if constexpr (kInterleaved) {
            T* to = count == N ? rows_[0].next(3 * N) : nullptr;
            hn::StoreInterleaved3(x, y, z, d, to ? to : sums);
            for (std::size_t k = 0; k < 3 && !to; ++k) {
                if (3 * count > k * N)
                    rows_[0].write(hn::Load(d, sums + k * N),
                                   std::min(N, 3 * count - k * N));
            }
        } else {
            rows_[0].write(x, count);
            rows_[1].write(y, count);
            rows_[2].write(z, count);
        }
        sample_ += N;
        if (sample_ >= padded<T>(n)) {
            ++derivative_;
            start_derivative();
        }
    }

private:
    HWY_INLINE void start_derivative() {
        sample_ = 0;
        const int r = derivative_;
        if (r == table_.n_derivatives())
            return;
        // All samples are one row where no gap lies between them.
        const std::ptrdiff_t stride = target_.row_stride[r],
                             length = table_.nx * target_.sample_stride[r];
        const bool gaps = table_.ny > 1 && stride != length;
        // Short rows that are made of small vectors, so that nothing need be cut.
        constexpr std::size_t kSmall = 16 / sizeof(T);
        in_small_parts_ = gaps && table_.nx % kSmall == 0 && kLanes<T> % kSmall == 0;
        for (int c = 0; c < (kInterleaved ? 1 : 3); ++c)
            rows_[c] = RowWriter<T>(
                target_.data[r] + first_ * target_.sample_stride[r] +
                    c * target_.channel_stride[r],
                static_cast<std::size_t>(gaps ? length : length * table_.ny), stride);
    }

    const Table<T>& table_;
    const Target<T>& target_;
    Index first_;
    int derivative_ = 0;
    std::size_t sample_ = 0;
    bool in_small_parts_ = false;
    RowWriter<T> rows_[3];
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
    HWY_ALIGN T sums[3 * kMaxGroup * N];
    for (std::size_t b = 0; b < batch.n; ++b) {
        const T* points = batch.points + b * 3 * table.n_points;
        PutSamples<T, kInterleaved> put(table, target, batch.first_samples[b]);
        for (std::size_t first = 0; first < n_vectors; first += size) {
            const std::size_t n = std::min(size, n_vectors - first);
            full_groups<kMaxGroup>(n, table, points, first * N, sums);
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

/// Along j: sums of rows, `length` elements of each; derivatives along i stand `step` apart.
/// \param kWhole  length >= a vector
template <int K, int kOrder, bool kWhole, class T>
HWY_INLINE void product_columns(const Table<T>& table, const T* HWY_RESTRICT rows,
                                std::size_t length, std::size_t step,
                                const std::array<T*, 6>& to,
                                const std::array<std::ptrdiff_t, 6>& row_stride) {
    const Tag<T> d;
    constexpr std::size_t N = kLanes<T>;
    constexpr int kDerivatives = (kOrder + 1) * (kOrder + 2) / 2;
    const int n = n_columns<K>(table), ny = table.ny;
    const std::size_t size = padded<T>(std::size_t(kOrder + 1) * table.nx);
    const T* HWY_RESTRICT weights = table.weights + n * size;
    for (std::size_t next = 0; next < length; next += N) {
        // The last vector overlaps the one before.
        const std::size_t e = kWhole ? std::min(next, length - N) : 0;
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
        T* at[kDerivatives];
        std::ptrdiff_t stride[kDerivatives];
        for (int r = 0; r < kDerivatives; ++r) {
            at[r] = to[r] + e;
            stride[r] = row_stride[r];
        }
        const T* HWY_RESTRICT w = weights;
        for (int j = 0; j < ny; ++j, w += n) {
            int r = 0;
            for (int m = 0; m <= kOrder; ++m) {
                for (int q = 0; q <= m; ++q, ++r) {
                    // m - q times along i, q times along j
                    const T* HWY_RESTRICT wq = w + std::ptrdiff_t(q) * ny * n;
                    Vec<T> sum;
                    if constexpr (K > 0) {
                        sum = hn::Mul(hn::Set(d, wq[0]), kept[m - q][0]);
                        for (int k = 1; k < K; ++k)
                            sum = hn::MulAdd(hn::Set(d, wq[k]), kept[m - q][k], sum);
                    } else {
                        sum = hn::Mul(hn::Set(d, wq[0]), row(m - q, 0));
                        for (int k = 1; k < n; ++k)
                            sum = hn::MulAdd(hn::Set(d, wq[k]), row(m - q, k), sum);
                    }
                    if (kWhole)
                        hn::StoreU(sum, d, at[r]);
                    else
                        store_lanes<T>(sum, 0, length, at[r]);
                    at[r] += stride[r];
                }
            }
        }
    }
}

template <int K, int kOrder, class T>
HWY_INLINE void any_product_columns(const Table<T>& table, const T* rows,
                                    std::size_t length, std::size_t step,
                                    const std::array<T*, 6>& to,
                                    const std::array<std::ptrdiff_t, 6>& row_stride) {
    if (length < kLanes<T>)
        product_columns<K, kOrder, false>(table, rows, length, step, to, row_stride);
    else
        product_columns<K, kOrder, true>(table, rows, length, step, to, row_stride);
}

template <int K, int kOrder, bool kInterleaved, class T>
HWY_NOINLINE void product(const Table<T>& table, const Batch<T>& batch,
                          const Target<T>& target, T* scratch) {
    constexpr int kDerivatives = (kOrder + 1) * (kOrder + 2) / 2;
    const std::size_t nx = static_cast<std::size_t>(table.nx);
    const std::size_t size = padded<T>((kOrder + 1) * nx);
    for (std::size_t b = 0; b < batch.n; ++b) {
        product_rows<K, kInterleaved>(table, batch.points + b * 3 * table.n_points,
                                      scratch);
        std::array<T*, 6> to;
        for (int r = 0; r < kDerivatives; ++r)
            to[r] = target.data[r] + batch.first_samples[b] * target.sample_stride[r];
        if constexpr (kInterleaved) {
            any_product_columns<K, kOrder>(table, scratch, 3 * nx, 3 * nx, to,
                                           target.row_stride);
            continue;
        }
        for (int c = 0; c < 3; ++c) {
            any_product_columns<K, kOrder>(table, scratch + c * size, nx, nx, to,
                                           target.row_stride);
            for (int r = 0; r < kDerivatives; ++r)
                to[r] += target.channel_stride[r];
        }
    }
}

template <int K, bool kInterleaved, class T>
void product_of_order(const Table<T>& table, const Batch<T>& batch,
                      const Target<T>& target, T* scratch) {
    switch (table.order) {
        case 0:
            return product<K, 0, kInterleaved>(table, batch, target, scratch);
        case 1:
            return product<K, 1, kInterleaved>(table, batch, target, scratch);
        default:
            return product<K, 2, kInterleaved>(table, batch, target, scratch);
    }
}

/// With the number of columns known to the compiler up to kMaxColumns.
constexpr int kMaxColumns = 8;

template <int K, bool kInterleaved, class T>
void any_product(const Table<T>& table, const Batch<T>& batch, const Target<T>& target,
                 T* scratch) {
    if (table.product_degree + 1 == K)
        return product_of_order<K, kInterleaved>(table, batch, target, scratch);
    if constexpr (K < kMaxColumns)
        any_product<K + 1, kInterleaved>(table, batch, target, scratch);
    else
        product_of_order<0, kInterleaved>(table, batch, target, scratch);
}

template <bool kInterleaved, class T>
void any_table(const Table<T>& table, const Batch<T>& batch, const Target<T>& target,
               T* scratch) {
    if (table.product_degree == 0)
        return full<kInterleaved>(table, batch, target);
    any_product<kMinDegree + 1, kInterleaved>(table, batch, target, scratch);
}

// --------------------------------------------------------------------------------- layouts

template <class T>
void evaluate(const Table<T>& table, const Batch<T>& batch, const Target<T>& target,
              T* scratch) {
    if (target.layout == Layout::Interleaved)
        return any_table<true>(table, batch, target, scratch);
    if (target.layout == Layout::Planar)
        return any_table<false>(table, batch, target, scratch);
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
        any_table<true>(table, {1, batch.points + b * 3 * table.n_points, &kFirst},
                        packed, scratch + size * table.n_derivatives());
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
    const std::size_t values = 3 * padded<T>(table.n_samples()) * table.n_derivatives();
    const std::size_t rows = 3 * padded<T>(std::size_t(table.order + 1) * table.nx) *
                             (table.product_degree + 1);
    // For other layouts; for rows of products, which are read up to a vector too far.
    return values + rows + 4 * kPanel<T>;
}
template std::size_t scratch_size(const Table<float>&) noexcept;
template std::size_t scratch_size(const Table<double>&) noexcept;

}  // namespace osdx::grid
#endif
