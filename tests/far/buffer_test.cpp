// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <numeric>
#include <utility>

#include <gtest/gtest.h>

#include <osdx/buffer.h>

namespace osdx {
namespace {

using detail::BufferAllocator;

TEST(Buffer, KeepsItsValuesWhereItGrows) {
    Buffer<std::uint32_t> grown;
    constexpr std::uint32_t n = 100000;
    for (std::uint32_t i = 0; i < n; ++i)
        grown.push_back(i);
    Buffer<std::uint32_t> expected(n);
    std::iota(expected.begin(), expected.end(), 0u);
    EXPECT_TRUE(grown == expected);
    const Buffer<std::uint32_t> moved = std::move(grown);
    EXPECT_TRUE(moved == expected);
}

/// The bytes of an element that comes without a value.
TEST(Buffer, WritesNothingThatIsNotGiven) {
    alignas(double) unsigned char bytes[sizeof(double)];
    std::memset(bytes, 0x55, sizeof bytes);
    BufferAllocator<double>().construct(reinterpret_cast<double*>(bytes));
    EXPECT_TRUE(
        std::ranges::all_of(bytes, [](unsigned char byte) { return byte == 0x55; }));
}

TEST(Buffer, FillsWithAValueThatIsGiven) {
    Buffer<double> zeros(1000, 0.0);
    zeros.resize(2000, 1.0);
    EXPECT_EQ(std::accumulate(zeros.begin(), zeros.end(), 0.0), 1000.0);
}

}  // namespace
}  // namespace osdx
