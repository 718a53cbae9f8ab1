// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

/// n numbers for each of a row of elements, vertices for instance, in an array of others:
/// channel c of element i is data[i * stride + c]. Positions are three channels; colours, weights,
/// velocities are others.
template <class T>
struct Channels {
    T* data = nullptr;
    std::ptrdiff_t stride = 0;  ///< in numbers, from element to element
    int n = 0;

    T* operator[](std::size_t i) const noexcept {
        return data + static_cast<std::ptrdiff_t>(i) * stride;
    }
    operator Channels<const T>() const noexcept { return {data, stride, n}; }
};

/// One after the other.
template <class T>
Channels<T> channels(T* data, int n) noexcept {
    return {data, n, n};
}
template <class T>
Channels<T> channels(Vec3<T>* data) noexcept {
    return {&data->x, 3, 3};
}
template <class T>
Channels<const T> channels(const Vec3<T>* data) noexcept {
    return {&data->x, 3, 3};
}

/// Channels with a name that own their values. "color" has red, green, blue and perhaps alpha,
/// from 0 to 1 as a rule, in no colour space of ours.
struct NamedChannels {
    std::string name;
    int n = 1;                   ///< 3 or 4 of "color"
    std::vector<double> values;  ///< n of each element, one element after the other

    Channels<const double> view() const noexcept { return {values.data(), n, n}; }
};

inline constexpr std::string_view kColorName = "color";

/// Null where there is none.
inline const NamedChannels* find_channels(std::span<const NamedChannels> all,
                                          std::string_view name) noexcept {
    for (const NamedChannels& c : all) {
        if (c.name == name)
            return &c;
    }
    return nullptr;
}

}  // namespace osdx::inline OSDX_ABI
