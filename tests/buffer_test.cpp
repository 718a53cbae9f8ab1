// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/buffer.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <new>
#include <numeric>

namespace osdx {
namespace {

constexpr std::size_t kLargePage = std::size_t(2) << 20;

TEST(Buffer, KeepsItsValuesWhereItGrowsPastTheSmallSizes) {
    Buffer<std::uint32_t> grown;
    const std::uint32_t n = 3 << 20;  // 12 MiB
    for (std::uint32_t i = 0; i < n; ++i)
        grown.push_back(i);
    Buffer<std::uint32_t> expected(n);
    std::iota(expected.begin(), expected.end(), 0u);
    EXPECT_TRUE(grown == expected);
    const Buffer<std::uint32_t> moved = std::move(grown);
    EXPECT_TRUE(moved == expected);
}

TEST(Buffer, StartsAtALargePageWhereItIsLarge) {
    for (const std::size_t bytes : {2 * kLargePage, 2 * kLargePage + 1, 5 * kLargePage}) {
        const Buffer<char> large(bytes);
        EXPECT_EQ(reinterpret_cast<std::uintptr_t>(large.data()) % kLargePage, 0u);
    }
}

TEST(Buffer, FillsWithAValueThatIsGiven) {
    Buffer<double> zeros(1000, 0.0);
    zeros.resize(2000, 1.0);
    EXPECT_EQ(std::accumulate(zeros.begin(), zeros.end(), 0.0), 1000.0);
}

TEST(Buffer, RefusesMoreThanThereIs) {
    detail::BufferAllocator<double> allocator;
    EXPECT_THROW((void)allocator.allocate(std::size_t(-1) / 4),
                 std::bad_array_new_length);
    EXPECT_THROW(Buffer<double>(std::size_t(1) << 60), std::exception);
}

}  // namespace
}  // namespace osdx
