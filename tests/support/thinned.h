// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace osdx::test {

#if defined(__SANITIZE_ADDRESS__)
inline constexpr bool kSanitized = true;
#elif defined(__has_feature)
inline constexpr bool kSanitized = __has_feature(address_sanitizer);
#else
inline constexpr bool kSanitized = false;
#endif

/// A list of cases; with sanitizers every fifth of them, from the first on: each takes some
/// twenty times as long there, and faults of memory do not hide in one set of numbers.
template <class T>
std::vector<T> thinned(std::vector<T> cases) {
    constexpr std::size_t kStep = 5;
    if (!kSanitized)
        return cases;
    std::vector<T> some;
    for (std::size_t i = 0; i < cases.size(); i += kStep)
        some.push_back(std::move(cases[i]));
    return some;
}

/// How many of all cases a test wants to have met: with sanitizers one is enough.
constexpr int fewest(int n) {
    return kSanitized && n > 0 ? 1 : n;
}

}  // namespace osdx::test
