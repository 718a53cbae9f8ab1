// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>

#include "eval/kernels/point_kernels.h"
#include "eval/kernels/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "eval/kernels/regular.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep

// After foreach_target.h.
#include "eval/kernels/points-inl.h"

HWY_BEFORE_NAMESPACE();
namespace osdx::inline OSDX_ABI::HWY_NAMESPACE {

/// The basis at u: derivative r of function j over r! in out[r][j].
template <int kDegree, int kOrder>
HWY_INLINE void uniform_basis(const TaylorRows& taylor, int degree, double u,
                              double (*out)[16]) {
    const int d = kDegree > 0 ? kDegree : degree;
    const int stride = kDegree > 0 ? (kDegree + 4) / 4 * 4 : taylor.stride;
    const Quad v = Quad::of(u - 0.5);
    for (int j = 0; j < stride; j += 4) {
        const double* row = taylor.rows.data() + d * stride + j;
        Quad c0 = Quad::load(row), c1 = Quad::zero(), c2 = Quad::zero();
        for (int r = d - 1; r >= 0; --r) {
            row -= stride;
            if constexpr (kOrder > 1)
                c2 = mul_add(c2, v, c1);
            if constexpr (kOrder > 0)
                c1 = mul_add(c1, v, c0);
            c0 = mul_add(c0, v, Quad::load(row));
        }
        c0.store(out[0] + j);
        if constexpr (kOrder > 0)
            c1.store(out[1] + j);
        if constexpr (kOrder > 1)
            c2.store(out[2] + j);
    }
}

template <int kDegree, int kOrder, class T>
void regular(const KernelTables& tables, const DomainPoint& p, PointFrame, ChartTurn turn,
             const PointSum<T>& sum, PointJet& out) {
    const TaylorRows& taylor = *tables.taylor;
    const int degree = tables.degree, d = kDegree > 0 ? kDegree : degree;
    alignas(64) double along_s[kOrder + 1][16], along_t[kOrder + 1][16];
    uniform_basis<kDegree, kOrder>(taylor, degree, p.a, along_s);
    uniform_basis<kDegree, kOrder>(taylor, degree, p.b, along_t);
    auto jet = LaneJet<Quad, kOrder>::zero();
    const PointReader<Quad, T> read(sum);
    const Index* point = sum.points;
    for (int k = 0; k <= d; ++k) {
        Quad row[kOrder + 1];
        for (int r = 0; r <= kOrder; ++r)
            row[r] = Quad::zero();
        for (int j = 0; j <= d; ++j) {
            const Quad q = read(*point++);
            for (int r = 0; r <= kOrder; ++r)
                row[r] = mul_add(Quad::of(along_s[r][j]), q, row[r]);
        }
        for (int m = 0, c = 0; m <= kOrder; ++m) {
            for (int y = 0; y <= m; ++y, ++c)
                jet.c[c] = mul_add(Quad::of(along_t[y][k]), row[m - y], jet.c[c]);
        }
    }
    put(turned(Quad::of(turn.cos), Quad::of(turn.sin), derivatives(jet)), out);
}

/// The basis at kLanes places at once.
template <int kDegree, int kOrder>
HWY_INLINE void uniform_bases(const TaylorRows& taylor, int degree, P8 u,
                              P8 (*out)[kMaxDegree + 1]) {
    const int d = kDegree > 0 ? kDegree : degree;
    const P8 v = u - P8::of(0.5);
    for (int j = 0; j <= d; ++j) {
        const double* row = taylor.rows.data() + d * taylor.stride + j;
        P8 c0 = P8::of(*row), c1 = P8::zero(), c2 = P8::zero();
        for (int r = d - 1; r >= 0; --r) {
            row -= taylor.stride;
            if constexpr (kOrder > 1)
                c2 = mul_add(c2, v, c1);
            if constexpr (kOrder > 0)
                c1 = mul_add(c1, v, c0);
            c0 = mul_add(c0, v, P8::of(*row));
        }
        out[0][j] = c0;
        if constexpr (kOrder > 0)
            out[1][j] = c1;
        if constexpr (kOrder > 1)
            out[2][j] = c2 + c2;
    }
}

template <int kDegree, int kOrder>
void regular_points(const KernelTables& tables, const double* net, int n_channels,
                    const PointPlaces& at, Chart, PointJets& out) {
    const TaylorRows& taylor = *tables.taylor;
    const int degree = tables.degree, d = kDegree > 0 ? kDegree : degree;
    P8 along_s[kOrder + 1][kMaxDegree + 1], along_t[kOrder + 1][kMaxDegree + 1];
    uniform_bases<kDegree, kOrder>(taylor, degree, P8::load(at.a), along_s);
    uniform_bases<kDegree, kOrder>(taylor, degree, P8::load(at.b), along_t);
    const P8 cos = P8::load(at.cos), sin = P8::load(at.sin);
    for (int c = 0; c < n_channels; ++c, ++net) {
        auto jet = LaneJet<P8, kOrder>::zero();
        const double* p = net;
        for (int k = 0; k <= d; ++k) {
            P8 row[kOrder + 1];
            for (int r = 0; r <= kOrder; ++r)
                row[r] = P8::zero();
            for (int j = 0; j <= d; ++j, p += n_channels) {
                for (int r = 0; r <= kOrder; ++r)
                    row[r] = mul_add(along_s[r][j], P8::of(*p), row[r]);
            }
            for (int m = 0, r = 0; m <= kOrder; ++m) {
                for (int y = 0; y <= m; ++y, ++r)
                    jet.c[r] = mul_add(along_t[y][k], row[m - y], jet.c[r]);
            }
        }
        jet = turned(cos, sin, jet);
        for (int r = 0; r < jet.kSize; ++r)
            jet.c[r].store(out.value[r][c]);
    }
}

template <int kDegree>
void set_regular_of(PointKernels& kernels) {
    kernels.float_sum = {&regular<kDegree, 0, float>, &regular<kDegree, 1, float>,
                         &regular<kDegree, 2, float>};
    kernels.double_sum = {&regular<kDegree, 0, double>, &regular<kDegree, 1, double>,
                          &regular<kDegree, 2, double>};
    kernels.many = {&regular_points<kDegree, 0>, &regular_points<kDegree, 1>,
                    &regular_points<kDegree, 2>};
    kernels.many_of_any = kernels.many;
}

void set_regular(const KernelTables& tables, PointKernels& kernels) {
    tables.degree == 3 ? set_regular_of<3>(kernels) : set_regular_of<0>(kernels);
}

}  // namespace osdx::inline OSDX_ABI::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace osdx::inline OSDX_ABI {

HWY_EXPORT(set_regular);

namespace detail {

void set_regular_kernels(const KernelTables& tables, PointKernels& kernels) {
    HWY_DYNAMIC_DISPATCH(set_regular)(tables, kernels);
}

}  // namespace detail
}  // namespace osdx::inline OSDX_ABI
#endif  // HWY_ONCE
