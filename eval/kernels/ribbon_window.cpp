// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>

#include "eval/kernels/point_kernels.h"
#include "eval/kernels/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "eval/kernels/ribbon_window.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep

// After foreach_target.h.
#include "eval/kernels/ribbon_one-inl.h"
#include "eval/kernels/ribbon_weights-inl.h"

HWY_BEFORE_NAMESPACE();
namespace osdx::inline OSDX_ABI::HWY_NAMESPACE {

template <int kOrder>
HWY_NOINLINE void window_weights(const RingTables& t, PatchKind kind,
                                 const DomainPoint& p, const WeightSink& sink) {
    Weights weights;
    const WindowH<kOrder> h(t, p.a, p.b);
    for (int i = 0; i < t.n; i += RingTables::kWindow) {
        const int first = i - RingTables::kFirstOfWindow;
        block_weights<kOrder>(t, kind, window_ribbons<kOrder>(t, p, h, first), weights);
        sink.take(sink, weights, (p.sector + first + t.n) % t.n);
    }
}

// Where registers are wide enough for kernels of ribbons.
#if HWY_MAX_BYTES >= 32
template void window_weights<0>(const RingTables&, PatchKind, const DomainPoint&,
                                const WeightSink&);
template void window_weights<1>(const RingTables&, PatchKind, const DomainPoint&,
                                const WeightSink&);
template void window_weights<2>(const RingTables&, PatchKind, const DomainPoint&,
                                const WeightSink&);
#endif

}  // namespace osdx::inline OSDX_ABI::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
