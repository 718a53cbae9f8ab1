// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "eval/bases/gregory.h"

#include <algorithm>

namespace osdx::inline OSDX_ABI {

DomainPoint GregoryBasis::from_native(const Vec2<double>& xy) const noexcept {
    if (n() == 4)
        return {0, std::clamp(xy.x, 0.0, 1.0), std::clamp(xy.y, 0.0, 1.0)};
    return ribbons_.from_native(xy);
}

}  // namespace osdx::inline OSDX_ABI
