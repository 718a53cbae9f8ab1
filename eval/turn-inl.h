// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

// The formula of eval/turn.h, which is included in the namespace of each instruction set as
// well: it has no guard, and OSDX_TURN says how its functions are compiled.

/// Derivatives d, in the order p, du, dv, duu, duv, dvv, in variables that are turned and scaled
/// against those before: d_u = cos d_a + sin d_b, d_v = cos d_b - sin d_a. For numbers, vectors
/// and registers alike.
template <int kOrder, class S, class D>
OSDX_TURN void turn_derivatives(S cos, S sin, D* d) {
    if constexpr (kOrder > 0) {
        const D a = d[1], b = d[2];
        d[1] = mul_add(cos, a, sin * b);
        d[2] = mul_sub(cos, b, sin * a);
    }
    if constexpr (kOrder > 1) {
        const S cc = cos * cos, ss = sin * sin, cs = cos * sin;
        const D aa = d[3], ab = d[4], bb = d[5], twice = (cs + cs) * ab;
        d[3] = mul_add(cc, aa, mul_add(ss, bb, twice));
        d[4] = mul_add(cc - ss, ab, cs * (bb - aa));
        d[5] = mul_add(ss, aa, mul_sub(cc, bb, twice));
    }
}
