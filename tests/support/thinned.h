// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <tuple>
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

/// A list of cases; with sanitizers about every fifth of them, from the first on: each takes some
/// twenty times as long there, and faults of memory do not hide in one set of numbers. The steps
/// are uneven, so that products of short lists are not met in one of their factors only.
template <class T>
std::vector<T> thinned(std::vector<T> cases) {
    constexpr double kStep = 4.382;
    if (!kSanitized)
        return cases;
    std::vector<T> some;
    for (double i = 0; i < double(cases.size()); i += kStep)
        some.push_back(std::move(cases[static_cast<std::size_t>(i)]));
    return some;
}

/// All combinations of elements of some lists, the last one's fastest.
template <class T>
std::vector<std::tuple<T>> combinations(const std::vector<T>& list) {
    return {list.begin(), list.end()};
}
template <class T, class... Others>
std::vector<std::tuple<T, Others...>> combinations(const std::vector<T>& first,
                                                   const std::vector<Others>&... others) {
    std::vector<std::tuple<T, Others...>> all;
    for (const T& x : first) {
        for (const std::tuple<Others...>& rest : combinations(others...))
            all.push_back(std::tuple_cat(std::tuple<T>(x), rest));
    }
    return all;
}

/// How many of all cases a test wants to have met: with sanitizers one is enough.
constexpr int fewest(int n) {
    return kSanitized && n > 0 ? 1 : n;
}

}  // namespace osdx::test
