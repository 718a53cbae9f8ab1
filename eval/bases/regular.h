// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <array>
#include <span>

#include <osdx/place.h>
#include <osdx/types.h>

#include "eval/bases/bspline.h"
#include "eval/bases/jet.h"

namespace osdx::inline OSDX_ABI {

/// The basis functions of regular patches: the uniform B-spline of bi-degree d on [0,1]^2, whose
/// (s, t) are the (a, b) of the domain point; there are no sectors.
class RegularBasis {
public:
    explicit RegularBasis(int degree) : d_(degree) {}

    /// See PatchBasis. \return 1
    template <int Order, class T, class Sink>
    Jet<T, Order> for_each_weight(const DomainPointOf<T>& p, Chart,
                                  Sink&& sink) const noexcept {
        constexpr int kStride = Order + 1;
        std::array<T, (kMaxDegree + 1) * kStride> along_s, along_t;
        const auto size = static_cast<std::size_t>((d_ + 1) * kStride);
        bspline_basis<T>(d_, p.a, Order, std::span(along_s).first(size));
        bspline_basis<T>(d_, p.b, Order, std::span(along_t).first(size));
        Index point = 0;
        for (int k = 0; k <= d_; ++k) {
            for (int j = 0; j <= d_; ++j, ++point) {
                Jet<T, Order> w;
                for (int m = 0; m <= Order; ++m) {
                    for (int y = 0; y <= m; ++y)
                        w.c[w.index(m - y, y)] =
                            along_s[j * kStride + m - y] * along_t[k * kStride + y];
                }
                sink(point, w);
            }
        }
        return Jet<T, Order>(1.0);
    }

    Vec2<double> to_native(const DomainPoint& p) const noexcept { return {p.a, p.b}; }
    DomainPoint from_native(const Vec2<double>& xy) const noexcept {
        return {0, std::clamp(xy.x, 0.0, 1.0), std::clamp(xy.y, 0.0, 1.0)};
    }

private:
    int d_;
};

}  // namespace osdx::inline OSDX_ABI
