// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>

#include "eval/kernels/point_kernels.h"
#include "eval/kernels/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "eval/kernels/gregory.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep

// After foreach_target.h.
#include "eval/kernels/gregory_corner-inl.h"
#include "eval/kernels/points-inl.h"

HWY_BEFORE_NAMESPACE();
namespace osdx::inline OSDX_ABI::HWY_NAMESPACE {

template <int kOrder, class T>
void gregory(const KernelTables&, const DomainPoint& p, PointFrame, ChartTurn turn,
             const PointSum<T>& sum, PointJet& out) {
    using J = LaneJet<Quad, kOrder>;
    constexpr int kCorners = 4, kPoints = GregoryBasis::kPerCorner;
    // A corner in each lane.
    alignas(32) const double along[kCorners + 1] = {p.a, p.b, 1 - p.a, 1 - p.b, p.a};
    const GregoryCorner<Quad, kOrder> corner(Quad::load(along), Quad::load(along + 1));
    alignas(32) double weights[kPoints][J::kSize][kCorners];
    for (int k = 0; k < kPoints; ++k) {
        for (int r = 0; r < J::kSize; ++r)
            corner.weights[k].c[r].store(weights[k][r]);
    }
    const PointReader<Quad, T> read(sum);
    const Index* point = sum.points;
    J sums[kCorners];
    for (int i = 0; i < kCorners; ++i) {
        sums[i] = J::zero();
        for (int k = 0; k < kPoints; ++k) {
            const Quad q = read(*point++);
            for (int r = 0; r < J::kSize; ++r)
                sums[i].c[r] = mul_add(Quad::of(weights[k][r][i]), q, sums[i].c[r]);
        }
    }
    put(turned(Quad::of(turn.cos), Quad::of(turn.sin),
               derivatives(sum_of_corners<Quad, kOrder>(sums))),
        out);
}

/// At some places at once.
template <int kOrder>
void gregory_points(const KernelTables&, const double* net, int n_channels,
                    const PointPlaces& at, Chart, PointJets& out) {
    using J = LaneJet<P8, kOrder>;
    constexpr int kCorners = 4, kPoints = GregoryBasis::kPerCorner;
    const P8 a = P8::load(at.a), b = P8::load(at.b), one = P8::of(1);
    const P8 along[kCorners + 1] = {a, b, one - a, one - b, a};
    J sums[kManyChannels][kCorners];
    for (int i = 0; i < kCorners; ++i) {
        const GregoryCorner<P8, kOrder> corner(along[i], along[i + 1]);
        for (int c = 0; c < n_channels; ++c) {
            J sum = J::zero();
            for (int k = 0; k < kPoints; ++k) {
                const P8 p = P8::of(net[n_channels * (i * kPoints + k) + c]);
                for (int r = 0; r < J::kSize; ++r)
                    sum.c[r] = mul_add(corner.weights[k].c[r], p, sum.c[r]);
            }
            sums[c][i] = sum;
        }
    }
    const P8 cos = P8::load(at.cos), sin = P8::load(at.sin);
    for (int c = 0; c < n_channels; ++c) {
        const J jet = turned(cos, sin, derivatives(sum_of_corners<P8, kOrder>(sums[c])));
        for (int r = 0; r < jet.kSize; ++r)
            jet.c[r].store(out.value[r][c]);
    }
}

void set_gregory(PointKernels& kernels) {
    kernels.float_sum = {&gregory<0, float>, &gregory<1, float>, &gregory<2, float>};
    kernels.double_sum = {&gregory<0, double>, &gregory<1, double>, &gregory<2, double>};
    kernels.many = {&gregory_points<0>, &gregory_points<1>, &gregory_points<2>};
    kernels.many_of_any = kernels.many;
}

}  // namespace osdx::inline OSDX_ABI::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace osdx::inline OSDX_ABI {

HWY_EXPORT(set_gregory);

namespace detail {

void set_gregory_kernels(PointKernels& kernels) {
    HWY_DYNAMIC_DISPATCH(set_gregory)(kernels);
}

}  // namespace detail
}  // namespace osdx::inline OSDX_ABI
#endif  // HWY_ONCE
