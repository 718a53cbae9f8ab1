// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/refine/sharpness.h"

#include <algorithm>

namespace osdx::inline OSDX_ABI::detail {

double Meeting::lowered(double s, CreaseMethod method) const {
    if (method == CreaseMethod::Chaikin && is_semi_sharp(s) && n_ > 1)
        s = 0.75 * s + 0.25 * (sum_ - s) / (n_ - 1);
    return detail::lowered(s);
}

VertexRule vertex_rule(double vertex_sharpness, std::size_t n_sharp_edges) {
    if (vertex_sharpness > 0 || n_sharp_edges > 2)
        return VertexRule::Corner;
    return n_sharp_edges == 2 ? VertexRule::Crease : VertexRule::Smooth;
}

bool is_pinned(double vertex_sharpness, std::size_t n_infinitely_sharp_edges) {
    return is_infinitely_sharp(vertex_sharpness) || n_infinitely_sharp_edges > 2;
}

double EndOfSharpness::weight_before() const {
    return n_ == 0 ? 1 : std::min(1.0, sum_ / n_);
}

}  // namespace osdx::inline OSDX_ABI::detail
