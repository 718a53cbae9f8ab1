// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

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

namespace detail {

/// The largest coordinate.
inline double size(const Vec3<double>& v) noexcept {
    return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

/// In units of 2 to the power `exponent`.
inline Vec3<double> in_units(const Vec3<double>& v, int exponent) noexcept {
    if (exponent == 0)
        return v;
    return {std::ldexp(v.x, -exponent), std::ldexp(v.y, -exponent),
            std::ldexp(v.z, -exponent)};
}
inline SurfaceJet<double> in_units(SurfaceJet<double> s, int exponent) noexcept {
    for (Vec3<double>* d : {&s.p, &s.du, &s.dv, &s.duu, &s.duv, &s.dvv})
        *d = in_units(*d, exponent);
    return s;
}

}  // namespace detail

/// Unit normal u x v of the derivatives at p; zero where these are parallel to rounding, or
/// rounding of points as far from the origin as p.
inline Vec3<double> unit_normal(const Vec3<double>& p, const Vec3<double>& u,
                                const Vec3<double>& v) noexcept {
    // Sines of less are rounding: parallel derivatives of Gregory patches have up to 6e-14.
    constexpr double kSine = 2e-13;
    // Of p's coordinates; derivatives are differences of sums of a dozen points.
    constexpr double kRounding = 1e-14;
    const Vec3<double> n = glm::cross(u, v);
    const double uu = glm::dot(u, u), vv = glm::dot(v, v), nn = glm::dot(n, n);
    const double size = detail::size(p);
    if (uu > 1e-50 && vv > 1e-50 && uu < 1e50 && vv < 1e50 && size < 1e50) [[likely]] {
        const double off = kRounding * size;
        return nn > std::max(kSine * kSine * uu * vv, off * off * (uu + vv))
                   ? n * (1 / std::sqrt(nn))
                   : Vec3<double>(0);
    }
    // Squares might leave the range of numbers: of a tiny or a vast model.
    const double u_size = detail::size(u), v_size = detail::size(v);
    if (!(std::min(u_size, v_size) > kRounding * size) || !std::isfinite(u_size) ||
        !std::isfinite(v_size))
        return Vec3<double>(0);
    const Vec3<double> along_u = u / u_size, along_v = v / v_size;
    const double turned = kRounding * (size / u_size + size / v_size);
    const Vec3<double> m = glm::cross(along_u, along_v);
    const double sine = glm::length(m);
    return sine > std::max(3 * kSine, turned) ? m / sine : Vec3<double>(0);
}

/// Unit normal u x v; zero where u and v are parallel to rounding.
inline Vec3<double> unit_normal(const Vec3<double>& u, const Vec3<double>& v) noexcept {
    return unit_normal(Vec3<double>(0), u, v);
}

/// Unit normal du x dv; zero where du and dv are parallel, or zero, to rounding.
template <class T>
Vec3<T> normal(const SurfaceJet<T>& s) noexcept {
    return Vec3<T>(
        unit_normal(Vec3<double>(s.p), Vec3<double>(s.du), Vec3<double>(s.dv)));
}

/// Mean and Gauss curvature; positive mean curvature bends towards the normal. Zero where
/// there is no normal; the largest number where the curvature is larger.
template <class T>
struct Curvature {
    T mean = 0, gauss = 0;
};

template <class T>
Curvature<T> curvature(const SurfaceJet<T>& s) noexcept {
    const Vec3<double> n(normal(
        SurfaceJet<double>{Vec3<double>(s.p), Vec3<double>(s.du), Vec3<double>(s.dv)}));
    if (n == Vec3<double>(0))
        return {};
    // In units in which fourth powers of lengths are numbers; ordinary ones stay.
    const double size =
        std::max(detail::size(Vec3<double>(s.du)), detail::size(Vec3<double>(s.dv)));
    const int exponent = size > 1e-50 && size < 1e50 ? 0 : std::ilogb(size);
    const auto scaled = [exponent](const Vec3<T>& d) {
        return detail::in_units(Vec3<double>(d), exponent);
    };
    const Vec3<double> u = scaled(s.du), v = scaled(s.dv);
    const double E = glm::dot(u, u), F = glm::dot(u, v), G = glm::dot(v, v);
    const double L = glm::dot(n, scaled(s.duu)), M = glm::dot(n, scaled(s.duv)),
                 N = glm::dot(n, scaled(s.dvv));
    const double det = E * G - F * F;
    if (!(det > 0))
        return {};
    const auto out = [](double k, int power) {
        constexpr double kMax = std::numeric_limits<T>::max();
        return static_cast<T>(std::clamp(std::ldexp(k, power), -kMax, kMax));
    };
    return {out((E * N - 2 * F * M + G * L) / (2 * det), -exponent),
            out((L * N - M * M) / det, -2 * exponent)};
}

}  // namespace osdx::inline OSDX_ABI
