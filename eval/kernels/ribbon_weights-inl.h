// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

// Included once for each instruction set that is compiled (hwy/foreach_target.h).
#if defined(OSDX_EVAL_RIBBON_WEIGHTS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef OSDX_EVAL_RIBBON_WEIGHTS_INL_H_
#undef OSDX_EVAL_RIBBON_WEIGHTS_INL_H_
#else
#define OSDX_EVAL_RIBBON_WEIGHTS_INL_H_
#endif

#include "eval/kernels/points-inl.h"
#include "eval/kernels/ribbons-inl.h"

// The weights of the control points of EV and EF patches inside, as ribbon_ring.cpp and
// ribbon_window.cpp make them: one function for each order, for sums of float and double.

HWY_BEFORE_NAMESPACE();
namespace osdx::inline OSDX_ABI::HWY_NAMESPACE {

/// Weights of one block of ribbons on their way to a sum: of points k = 0, 1, .. of every
/// sector, then of its first spoke for EV, as PatchClass orders them, and last for EV the part of
/// each ribbon in that of the vertex. Derivative r of point k in lane m is
/// values[(k n_derivatives + r) kLanes + m], m the sector start + m modulo n.
struct Weights {
    static constexpr int kMost = kMaxDegree * kMaxDegree;

    alignas(64) double values[kMost * 6 * kLanes];

    template <int kOrder>
    HWY_INLINE void put(int k, LaneJet<P8, kOrder> w) {
        for (int r = 0; r < w.kSize; ++r)
            w.c[r].store(values + (k * w.kSize + r) * kLanes);
    }
};

/// What takes the weights of a block, of a type that those who make them do not know.
struct WeightSink {
    void (*take)(const WeightSink& sink, const Weights& weights, int start);
    void* state;
};

/// From derivatives in (x, y) of the sector to those in other variables, turned.
template <class V, int kOrder>
HWY_INLINE LaneJet<V, kOrder> in_frame(const RingTables& t, const DomainPoint& p,
                                       PointFrame frame, ChartTurn turn,
                                       LaneJet<V, kOrder> jet) {
    if (frame == PointFrame::BaseUV) {
        jet = in_sector(t, V::of(p.a), V::of(p.b), jet);
    } else if (frame == PointFrame::Native) {
        const auto at = t.sector_turn[p.sector];
        jet = turned(V::of(at.x), V::of(-at.y), jet);
    }
    return turned(V::of(turn.cos), V::of(turn.sin), jet);
}

/// The weights of all points of a ring, from sector 0 on.
template <int kOrder>
void ring_weights(const RingTables& t, PatchKind kind, const DomainPoint& p,
                  Weights& weights);

/// Gives the weights of windows to a sink.
template <int kOrder>
void window_weights(const RingTables& t, PatchKind kind, const DomainPoint& p,
                    const WeightSink& sink);

}  // namespace osdx::inline OSDX_ABI::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // OSDX_EVAL_RIBBON_WEIGHTS_INL_H_
