// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <osdx/address.h>
#include <osdx/topology.h>

namespace osdx::inline OSDX_ABI::detail {

/// Counts what several threads see.
struct AddressCounts {
    std::atomic<std::size_t> n_clamped = 0, n_without = 0, first_without = SIZE_MAX;

    void add(std::size_t clamped, std::size_t without, std::size_t first) {
        n_clamped.fetch_add(clamped, std::memory_order_relaxed);
        n_without.fetch_add(without, std::memory_order_relaxed);
        std::size_t known = first_without.load(std::memory_order_relaxed);
        while (first < known && !first_without.compare_exchange_weak(
                                    known, first, std::memory_order_relaxed)) {
        }
    }
    AddressReport report() const {
        return {n_clamped.load(), n_without.load(), first_without.load()};
    }
};

/// Whether to_quarter() moved the point, by more than rounding does.
inline bool was_clamped(const Topology& base, const Address& at, const QuarterPoint& q) {
    constexpr double kRounding = 1e-12;
    if (base.face_size(at.face) == 4)
        return std::min(at.u, at.v) < -kRounding || std::max(at.u, at.v) > 1 + kRounding;
    const Address back = to_address(base, q);
    return !(std::abs(back.u - at.u) <= kRounding &&
             std::abs(back.v - at.v) <= kRounding);
}

}  // namespace osdx::inline OSDX_ABI::detail
