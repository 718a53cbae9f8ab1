// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <osdx/types.h>

// The kernels of osdx/grid_evaluator.h.

namespace osdx::inline OSDX_ABI::grid {

/// Weights stand in panels of so many bytes, one vector of the widest instruction set: no
/// vector of any set is split between cache lines.
inline constexpr std::size_t kPanelBytes = 64;
template <class T>
inline constexpr std::size_t kPanel = kPanelBytes / sizeof(T);

template <class T>
constexpr std::size_t padded(std::size_t n) {
    return (n + kPanel<T> - 1) / kPanel<T> * kPanel<T>;
}

/// Products of this degree and higher ones are summed in a way of their own.
inline constexpr int kHighDegree = 5;

/// A rectangle of samples, and the weights of the control points at them.
///
/// Full: derivative r of sample s = j nx + i stands in row r derivative_rows() + s of a
/// matrix with n_points columns; where samples are few, those of all derivatives are packed.
/// Its panels, kPanel rows each, follow one another, and within a panel the columns.
/// Product (regular patches): first the basis along i, column k of derivative q at i in row
/// q nx + i of a matrix with degree + 1 columns, stored by columns, each padded(); then the same
/// with each row n_repeats() times over, for x, y, z, and for nothing if there is a fourth; then
/// the basis along j, column k of derivative q at j in (q ny + j) (degree + 1) + k.
template <class T>
struct Table {
    const T* weights;  ///< aligned to kPanelBytes
    int order;         ///< of the derivatives
    int nx, ny;
    int n_points;        ///< control points: for products (degree + 1)^2
    int product_degree;  ///< 0: full
    /// Products: i runs along t of the patch, so that the control points are transposed.
    bool transposed;

    std::size_t n_samples() const noexcept { return std::size_t(nx) * ny; }
    int n_derivatives() const noexcept { return (order + 1) * (order + 2) / 2; }

    // Of full matrices, which are padded to n_rows().
    bool packed() const noexcept { return n_samples() < kPanel<T>; }
    std::size_t derivative_rows() const noexcept {
        return packed() ? n_samples() : padded<T>(n_samples());
    }
    std::size_t n_rows() const noexcept {
        return padded<T>(n_derivatives() * derivative_rows());
    }

    int n_repeats() const noexcept { return product_degree < kHighDegree ? 3 : 4; }

    // Of products: where the parts of the weights start, and how many there are in all.
    std::size_t along_i(bool interleaved) const noexcept {
        return interleaved ? (product_degree + 1) * padded_row(1) : 0;
    }
    std::size_t along_j() const noexcept {
        return (product_degree + 1) * (padded_row(1) + padded_row(n_repeats()));
    }
    std::size_t n_product_weights() const noexcept {
        return along_j() + padded<T>(std::size_t(order + 1) * ny * (product_degree + 1));
    }
    /// A column of the basis along i.
    std::size_t padded_row(std::size_t n_coordinates) const noexcept {
        return padded<T>(n_coordinates * (order + 1) * nx);
    }
};

/// Elements of scratch memory that a kernel needs for a table.
template <class T>
std::size_t scratch_size(const Table<T>& table) noexcept;

enum class Layout : std::uint8_t {
    Interleaved,  ///< sample_stride 3, channel_stride 1
    Planar,       ///< sample_stride 1
    Any,
};

/// Where samples go, by derivative: coordinate c of sample (i, j) of a rectangle that starts at
/// sample s to data[r][s sample_stride[r] + j row_stride[r] + i sample_stride[r] +
/// c channel_stride[r]].
template <class T>
struct Target {
    Layout layout = Layout::Interleaved;
    std::array<T*, 6> data;
    std::array<std::ptrdiff_t, 6> row_stride, sample_stride, channel_stride;
};

/// Patches that share a table.
template <class T>
struct Batch {
    std::size_t n;
    const T* points;              ///< x, y, z of all control points
    const T* last_point;          ///< the last of these: nothing behind it is read
    const Index* const* indices;  ///< the control points of each patch
    const Index* first_samples;   ///< where the rectangle of each starts
};

/// Values and derivatives of patches at the samples of a table.
/// \param scratch  scratch_size() elements, aligned to kPanelBytes
template <class T>
using Kernel = void (*)(const Table<T>& table, const Batch<T>& batch,
                        const Target<T>& target, T* scratch);

/// For a table and a layout, with the widest vectors of this machine.
template <class T>
Kernel<T> kernel(const Table<T>& table, Layout layout) noexcept;

// One file for each: full tables; products of low degree, and all into planar layouts; those of
// high degree into the others.
template <class T>
Kernel<T> full_kernel() noexcept;
template <>
Kernel<float> full_kernel() noexcept;
template <>
Kernel<double> full_kernel() noexcept;
template <class T>
Kernel<T> product_kernel() noexcept;
template <>
Kernel<float> product_kernel() noexcept;
template <>
Kernel<double> product_kernel() noexcept;
template <class T>
Kernel<T> high_kernel() noexcept;
template <>
Kernel<float> high_kernel() noexcept;
template <>
Kernel<double> high_kernel() noexcept;

/// Copies past the caches, to memory that is not read soon. Other threads see it after the
/// next synchronisation.
template <class T>
void stream(const T* from, std::size_t n, T* to) noexcept;
template <>
void stream(const float* from, std::size_t n, float* to) noexcept;
template <>
void stream(const double* from, std::size_t n, double* to) noexcept;

}  // namespace osdx::inline OSDX_ABI::grid
