// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/patches/isolation_bound.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace osdx::inline OSDX_ABI::detail {

IsolationBound::IsolationBound(const PatchTableOptions& options) {
    const auto reach = static_cast<std::size_t>(options.degree + 1);
    last_level = std::max({static_cast<int>(kInfinitelySharp),
                           options.multisided.crease_end_level, options.gregory.levels}) +
                 static_cast<int>(std::bit_width(2 * reach));
    cells_of_corner = reach * reach;
    cells_of_edge = 2 * reach;
}

double IsolationBound::most_cells(int level, std::size_t n_corners,
                                  std::size_t n_semi_sharp) const {
    return static_cast<double>(cells_of_corner * n_corners) +
           std::ldexp(static_cast<double>(cells_of_edge * n_semi_sharp), level);
}

}  // namespace osdx::inline OSDX_ABI::detail
