// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cmath>
#include <cstdint>

#include <glm/geometric.hpp>

#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

/// The variables that derivatives are taken in.
enum class Chart : std::uint8_t {
    BaseUV,  ///< (u, v) of the base face; of the bilinear sector (a, b) for n-sided patches
    Native,  ///< (x, y) of the regular n-gon; (s, t) of [0,1]^2 for patches of four sides
};

/// Number of values up to an order: 1, 3 or 6, in the order p, du, dv, duu, duv, dvv.
constexpr int n_derivatives(int order) noexcept {
    return (order + 1) * (order + 2) / 2;
}

/// Position and derivatives of a surface at a point, in the chart that was asked for.
/// Derivatives beyond the order that was asked for are zero.
template <class T>
struct SurfaceJet {
    Vec3<T> p{0};
    Vec3<T> du{0}, dv{0};
    Vec3<T> duu{0}, duv{0}, dvv{0};
};

/// Unit normal u x v; zero where u and v are parallel to rounding.
inline Vec3<double> unit_normal(const Vec3<double>& u, const Vec3<double>& v) noexcept {
    constexpr double kSine = 1e-14;  // below it is rounding
    const Vec3<double> n = glm::cross(u, v);
    const double uu = glm::dot(u, u), vv = glm::dot(v, v), nn = glm::dot(n, n);
    if (uu > 1e-50 && vv > 1e-50 && uu < 1e50 && vv < 1e50) [[likely]]
        return nn > kSine * kSine * uu * vv ? n * (1 / std::sqrt(nn)) : Vec3<double>(0);
    // Squares might underflow, of a tiny model's derivatives.
    const double u_length = glm::length(u), v_length = glm::length(v);
    if (!(u_length > 0 && v_length > 0))
        return Vec3<double>(0);
    return unit_normal(u / u_length, v / v_length);
}

/// Unit normal du x dv; zero where du and dv are parallel to rounding.
template <class T>
Vec3<T> normal(const SurfaceJet<T>& s) noexcept {
    return Vec3<T>(unit_normal(Vec3<double>(s.du), Vec3<double>(s.dv)));
}

/// Mean and Gauss curvature; positive mean curvature bends towards the normal. Zero where
/// there is no normal.
template <class T>
struct Curvature {
    T mean = 0, gauss = 0;
};

template <class T>
Curvature<T> curvature(const SurfaceJet<T>& s) noexcept {
    const Vec3<double> n(
        normal(SurfaceJet<double>{{}, Vec3<double>(s.du), Vec3<double>(s.dv)}));
    const Vec3<double> u(s.du), v(s.dv);
    const double E = glm::dot(u, u), F = glm::dot(u, v), G = glm::dot(v, v);
    const double L = glm::dot(n, Vec3<double>(s.duu)),
                 M = glm::dot(n, Vec3<double>(s.duv)),
                 N = glm::dot(n, Vec3<double>(s.dvv));
    const double det = E * G - F * F;
    if (n == Vec3<double>(0) || !(det > 0))
        return {};
    return {static_cast<T>((E * N - 2 * F * M + G * L) / (2 * det)),
            static_cast<T>((L * N - M * M) / det)};
}

}  // namespace osdx::inline OSDX_ABI
