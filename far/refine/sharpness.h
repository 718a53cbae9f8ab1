// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <osdx/features.h>

/// The rules of sharpness for all degrees: how it goes down from level to level, what it makes
/// of a vertex, and the mixture of rules where it ends.
namespace osdx::inline OSDX_ABI::detail {

/// What is left of a sharpness after a step.
inline double lowered(double s) {
    return is_infinitely_sharp(s) ? s : std::max(s - 1, 0.0);
}

/// The semi-sharp edges that meet at a vertex.
class Meeting {
public:
    void add(double s) {
        if (is_semi_sharp(s)) {
            sum_ += s;
            ++n_;
        }
    }
    /// What is left of one of them after a step, at its half beside the vertex.
    double lowered(double s, CreaseMethod method) const;

private:
    double sum_ = 0;
    int n_ = 0;
};

/// What a vertex is to the creases through it.
enum class VertexRule : std::uint8_t { Smooth, Crease, Corner };

VertexRule vertex_rule(double vertex_sharpness, std::size_t n_sharp_edges);

/// The surface is pinned to the vertex: it is a corner for ever.
bool is_pinned(double vertex_sharpness, std::size_t n_infinitely_sharp_edges);

/// What ends at a vertex on a step, of its own sharpness and that of its edges.
class EndOfSharpness {
public:
    void note(double before, double after) {
        if (before > 0 && after <= 0) {
            ++n_;
            sum_ += before;
        }
    }
    /// Of the rule before the step in the mixture with the one after it.
    double weight_before() const;

private:
    int n_ = 0;
    double sum_ = 0;
};

}  // namespace osdx::inline OSDX_ABI::detail
