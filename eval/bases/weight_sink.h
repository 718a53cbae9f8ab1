// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <osdx/types.h>

#include "eval/bases/jet.h"

namespace osdx::inline OSDX_ABI {

/// What takes the contributions to the weights of control points, known by its address: so
/// PatchBasis::for_each_weight() is compiled once and not for every caller.
/// \pre the callable outlives it
template <int Order>
class WeightSink {
public:
    using J = Jet<double, Order>;

    template <class Callable>
    static WeightSink of(Callable& callable) noexcept {
        return {&callable, [](const void* c, Index i, const J& w) {
                    (*static_cast<Callable*>(const_cast<void*>(c)))(i, w);
                }};
    }

    void operator()(Index i, const J& w) const { call_(callable_, i, w); }

private:
    using Call = void (*)(const void*, Index, const J&);
    WeightSink(const void* callable, Call call) : callable_(callable), call_(call) {}

    const void* callable_;
    Call call_;
};

}  // namespace osdx::inline OSDX_ABI
