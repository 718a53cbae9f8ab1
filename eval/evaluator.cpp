// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <cstring>
#include <type_traits>
#include <vector>

#include <osdx/evaluator.h>

#include "eval/bases/patch_basis.h"
#include "eval/kernels/patch_kernel.h"
#include "eval/turn.h"
#include "far/prefetch.h"

namespace osdx::inline OSDX_ABI {
namespace detail {

/// What evaluates the patches of a class.
struct ClassEvaluator {
    PatchBasis basis;
    PatchKernel kernel;

    explicit ClassEvaluator(const PatchClass& c) : basis(c), kernel(basis) {}
};

}  // namespace detail

namespace {

using detail::ClassEvaluator;

/// From the variables of a patch to (u, v).
detail::ChartTurn turn_of(const PatchPoint& where, Chart chart) noexcept {
    if (chart == Chart::Native)
        return {};
    return detail::ChartTurn::quarters(where.quarter_turns, where.scale);
}

DomainPoint domain_point(const PatchPoint& where) noexcept {
    return {static_cast<int>(where.sector), where.a, where.b};
}

/// From the Taylor coefficients of a jet to derivatives in (u, v).
template <int Order>
void to_derivatives(const PatchPoint& where, Chart chart,
                    std::array<double, n_derivatives(Order)>& d) noexcept {
    if constexpr (Order > 1) {
        d[3] *= 2;
        d[5] *= 2;
    }
    const detail::ChartTurn turn = turn_of(where, chart);
    detail::turn_derivatives<Order>(turn.cos, turn.sin, d.data());
}

/// By the fast kernels, if there is one for the place: up to kSumChannels channels.
template <class T>
inline bool fast(const PatchKernel& kernel, std::span<const Index> points,
                 std::span<const T> values, int n_channels, const PatchPoint& where,
                 int order, Chart chart, detail::PointJet& out) noexcept {
    return kernel.sum<T>(domain_point(where), chart, order, turn_of(where, chart),
                         {values.data(), values.size(), n_channels, points.data()}, out);
}

/// Derivatives of N values at a time: N jets are summed over the weights, then divided.
/// \param value  value(i, c): channel c of control point i of the patch
template <int Order, int N, class Value>
std::array<std::array<double, n_derivatives(Order)>, N> evaluate_block(
    const PatchBasis& basis, const PatchPoint& where, Chart chart,
    Value&& value) noexcept {
    using J = Jet<double, Order>;
    std::array<J, N> sums;
    const J f = basis.for_each_weight<Order>(domain_point(where), chart,
                                             [&](Index i, const J& w) {
                                                 for (int c = 0; c < N; ++c)
                                                     sums[c] += double(value(i, c)) * w;
                                             });
    const bool rational = basis.patch_class().kind != PatchKind::Regular;
    std::array<std::array<double, n_derivatives(Order)>, N> out;
    for (int c = 0; c < N; ++c) {
        out[c] = (rational ? sums[c] / f : sums[c]).c;
        to_derivatives<Order>(where, chart, out[c]);
    }
    return out;
}

template <int Order, class T, class Vector>
void fill(SurfaceJet<T>& jet, Vector&& vector) noexcept {
    jet.p = vector(0);
    if constexpr (Order > 0) {
        jet.du = vector(1);
        jet.dv = vector(2);
    }
    if constexpr (Order > 1) {
        jet.duu = vector(3);
        jet.duv = vector(4);
        jet.dvv = vector(5);
    }
}

/// The same of a sum. Each vector is written in one go, with one value more than it has, so that
/// it can be read in one at once; the next one follows, and zeros.
template <int Order, class T>
void put(const detail::PointJet& sums, SurfaceJet<T>& jet) noexcept {
    static_assert(sizeof(jet) == 18 * sizeof(T));
    constexpr int n = n_derivatives(Order);
    std::byte* const out = reinterpret_cast<std::byte*>(&jet);
    for (int r = 0; r < n; ++r) {
        T v[4];
        std::copy_n(sums.value[r], 4, v);
        std::memcpy(out + r * sizeof(Vec3<T>), v, (r < 5 ? 4 : 3) * sizeof(T));
    }
    std::memset(out + n * sizeof(Vec3<T>), 0, (6 - n) * sizeof(Vec3<T>));
}

template <int Order, class T>
void channels(const ClassEvaluator& c, std::span<const Index> points,
              std::span<const T> values, int n_channels, const PatchPoint& where,
              Chart chart, std::span<T> out) noexcept {
    const auto put = [&](int first, int n, auto&& value) {
        for (int r = 0; r < n_derivatives(Order); ++r) {
            for (int k = 0; k < n; ++k)
                out[r * n_channels + first + k] = static_cast<T>(value(r, k));
        }
    };
    constexpr int kBlock = detail::kSumChannels;
    detail::PointJet sums;
    int first = 0;
    for (; first < n_channels && fast<T>(c.kernel, points, values.subspan(first),
                                         n_channels, where, Order, chart, sums);
         first += kBlock)
        put(first, std::min(kBlock, n_channels - first),
            [&](int r, int k) { return sums.value[r][k]; });
    // Where weights cost more than sums: many of these at a time.
    const auto sum_block = [&](auto most) {
        constexpr int kMost = decltype(most)::value;
        const int n = std::min(kMost, n_channels - first);
        const auto block =
            evaluate_block<Order, kMost>(c.basis, where, chart, [&](Index i, int k) {
                return k < n ? values[std::size_t(points[i]) * n_channels + first + k]
                             : T(0);
            });
        put(first, n, [&](int r, int k) { return block[k][r]; });
        first += n;
    };
    while (first < n_channels) {
        if (n_channels - first <= kBlock)
            sum_block(std::integral_constant<int, kBlock>());
        else
            sum_block(std::integral_constant<int, detail::kManyChannels>());
    }
}

template <int Order>
void all_weights(const ClassEvaluator& c, const PatchPoint& where, Chart chart,
                 std::span<double> out) noexcept {
    using J = Jet<double, Order>;
    if (c.kernel.weights(domain_point(where), chart, Order, turn_of(where, chart), out))
        return;
    constexpr int kDerivatives = n_derivatives(Order);
    const std::size_t n = out.size() / kDerivatives;
    std::ranges::fill(out, 0.0);
    const J f = c.basis.for_each_weight<Order>(domain_point(where), chart,
                                               [&](Index i, const J& w) {
                                                   for (int r = 0; r < kDerivatives; ++r)
                                                       out[r * n + i] += w.c[r];
                                               });
    for (std::size_t i = 0; i < n; ++i) {
        J w;
        for (int r = 0; r < kDerivatives; ++r)
            w.c[r] = out[r * n + i];
        if (c.basis.patch_class().kind != PatchKind::Regular)
            w = w / f;
        to_derivatives<Order>(where, chart, w.c);
        for (int r = 0; r < kDerivatives; ++r)
            out[r * n + i] = w.c[r];
    }
}

}  // namespace

Evaluator::Evaluator(const PatchTable& table) : table_(&table) {
    classes_.reserve(table.classes().size());
    for (const PatchClass& c : table.classes())
        classes_.emplace_back(c);
}
Evaluator::Evaluator(Evaluator&&) noexcept = default;
Evaluator& Evaluator::operator=(Evaluator&&) noexcept = default;
Evaluator::~Evaluator() = default;

template <class T, int Order>
SurfaceJet<T> Evaluator::evaluate(std::span<const Vec3<T>> points,
                                  const PatchPoint& where, Chart chart) const noexcept {
    assert(points.size() == table_->n_points());
    const PatchRef patch = table_->patch(where.patch);
    SurfaceJet<T> jet;
    detail::PointJet sums;
    const ClassEvaluator& c = classes_[patch.patch_class];
    if (fast<T>(c.kernel, patch.points, std::span(&points.data()->x, 3 * points.size()),
                3, where, Order, chart, sums)) {
        put<Order>(sums, jet);
        return jet;
    }
    const auto block = evaluate_block<Order, 3>(
        c.basis, where, chart,
        [&](Index i, int k) { return points[patch.points[i]][k]; });
    const auto vector = [&](int r) {
        return Vec3<T>(Vec3<double>(block[0][r], block[1][r], block[2][r]));
    };
    fill<Order>(jet, vector);
    return jet;
}

namespace {

/// The values of a patch' control points, as the kernels of many places read them.
class Net {
public:
    /// \tparam kChannels  0 for any number
    template <int kChannels = 0, class T>
    std::span<const double> read(std::span<const Index> points, const T* values,
                                 int n_channels, int stride) noexcept {
        double* out = values_;
        for (const Index p : points) {
            const T* value = values + std::size_t(p) * stride;
            for (int c = 0; c < (kChannels > 0 ? kChannels : n_channels); ++c)
                *out++ = value[c];
        }
        return {values_, out};
    }

private:
    double values_[detail::kManyChannels * detail::kMostManyPoints];
};

}  // namespace

template <class T, int Order>
void Evaluator::evaluate_many(std::span<const Vec3<T>> points,
                              std::span<const PatchPoint> where, Chart chart,
                              std::span<SurfaceJet<T>> out) const noexcept {
    assert(out.size() == where.size());
    if (where.empty())
        return;
    const PatchRef patch = table_->patch(where[0].patch);
    const PatchKernel& kernel = classes_[patch.patch_class].kernel;
    constexpr std::size_t kMost = detail::kLanes, kFewest = 2;
    const bool has_many = kernel.has_many() && where.size() >= kFewest;
    Net net;
    std::span<const double> values;
    if (has_many)
        values = net.read<3>(patch.points, &points.data()->x, 3, 3);
    detail::PointPlaces at{};
    detail::PointJets jets;
    for (std::size_t first = 0; first < where.size(); first += kMost) {
        const std::size_t n = std::min(kMost, where.size() - first);
        const bool at_once = has_many && n >= kFewest;
        for (std::size_t k = 0; at_once && k < n; ++k) {
            const PatchPoint& p = where[first + k];
            assert(p.patch == where[0].patch);
            const detail::ChartTurn turn = turn_of(p, chart);
            at.sector[k] = static_cast<int>(p.sector);
            at.a[k] = p.a;
            at.b[k] = p.b;
            at.cos[k] = turn.cos;
            at.sin[k] = turn.sin;
        }
        if (at_once)
            kernel.sum_many(values, 3, at, chart, Order, jets);
        for (std::size_t k = 0; k < n; ++k) {
            const PatchPoint& p = where[first + k];
            if (!at_once || !kernel.takes({0, p.a, p.b})) {
                out[first + k] = evaluate<T, Order>(points, p, chart);
                continue;
            }
            fill<Order>(out[first + k], [&](int r) {
                const auto& v = jets.value[r];
                return Vec3<T>(Vec3<double>(v[0][k], v[1][k], v[2][k]));
            });
        }
    }
}

namespace {

/// Places of one leaf, whose results go to rows of an array.
/// \tparam kChannels  0 for any number
template <int kOrder, int kChannels, class T>
void channels_of_leaf(const ClassEvaluator& c, std::span<const Index> points,
                      std::span<const T> values, int n_channels, const PatchPlaces& where,
                      Chart chart, Channels<T> out,
                      std::span<const Index> rows) noexcept {
    const int stride = kChannels > 0 ? kChannels : n_channels;
    if (!c.kernel.has_many()) {
        for (std::size_t i = 0; i < rows.size(); ++i)
            channels<kOrder>(c, points, values, stride, where[i], chart,
                             {out[rows[i]], std::size_t(out.n)});
        return;
    }
    const detail::ChartTurn turn =
        turn_of({.quarter_turns = where.quarter_turns, .scale = where.scale}, chart);
    detail::PointPlaces at{};
    std::ranges::fill(at.sector, static_cast<int>(where.sector));
    std::ranges::fill(at.cos, turn.cos);
    std::ranges::fill(at.sin, turn.sin);
    Net net;
    detail::PointJets jets;
    for (int first = 0; first < stride; first += detail::kManyChannels) {
        const int n_at_once =
            kChannels > 0 ? kChannels : std::min(detail::kManyChannels, stride - first);
        const std::span<const double> of_patch =
            net.read<kChannels>(points, values.data() + first, n_at_once, stride);
        for (std::size_t begin = 0; begin < rows.size(); begin += detail::kLanes) {
            const std::size_t n =
                std::min<std::size_t>(detail::kLanes, rows.size() - begin);
            std::copy_n(&where.a[begin], n, at.a);
            std::copy_n(&where.b[begin], n, at.b);
            // While the kernel computes: all at once would wait for their pages.
            for (const Index row : rows.subspan(begin + n).first(
                     std::min<std::size_t>(detail::kLanes, rows.size() - begin - n)))
                detail::prefetch(out[row], out.n);
            c.kernel.sum_many(of_patch, n_at_once, at, chart, kOrder, jets);
            for (std::size_t lane = 0; lane < n; ++lane) {
                T* const row = out[rows[begin + lane]];
                if (!c.kernel.takes({0, at.a[lane], at.b[lane]})) {
                    if (first == 0)
                        channels<kOrder>(c, points, values, stride, where[begin + lane],
                                         chart, {row, std::size_t(out.n)});
                    continue;
                }
                for (int r = 0; r < n_derivatives(kOrder); ++r) {
                    for (int k = 0; k < n_at_once; ++k)
                        row[r * stride + first + k] =
                            static_cast<T>(jets.value[r][k][lane]);
                }
            }
        }
    }
}

}  // namespace

template <class T>
void Evaluator::evaluate_many_channels(std::span<const T> values, int n_channels,
                                       const PatchPlaces& where, int order, Chart chart,
                                       Channels<T> out,
                                       std::span<const Index> rows) const noexcept {
    assert(values.size() == std::size_t(table_->n_points()) * n_channels);
    assert(rows.size() == where.a.size() && rows.size() == where.b.size());
    assert(out.n == n_derivatives(order) * n_channels);
    const PatchRef patch = table_->patch(where.patch);
    const ClassEvaluator& c = classes_[patch.patch_class];
    detail::with_order(order, [&](auto k) {
        if (n_channels == 3)
            channels_of_leaf<k, 3>(c, patch.points, values, 3, where, chart, out, rows);
        else
            channels_of_leaf<k, 0>(c, patch.points, values, n_channels, where, chart, out,
                                   rows);
    });
}

template <class T>
void Evaluator::evaluate_channels(std::span<const T> values, int n_channels,
                                  const PatchPoint& where, int order, Chart chart,
                                  std::span<T> out) const noexcept {
    assert(values.size() == std::size_t(table_->n_points()) * n_channels);
    assert(out.size() == std::size_t(n_derivatives(order)) * n_channels);
    const PatchRef patch = table_->patch(where.patch);
    detail::with_order(order, [&](auto k) {
        channels<k>(classes_[patch.patch_class], patch.points, values, n_channels, where,
                    chart, out);
    });
}

void Evaluator::weights(const PatchPoint& where, int order, Chart chart,
                        std::span<double> out) const noexcept {
    assert(out.size() ==
           std::size_t(n_derivatives(order)) * table_->class_of(where.patch).n_points());
    const ClassEvaluator& c = classes_[table_->patch(where.patch).patch_class];
    detail::with_order(order, [&](auto k) { all_weights<k>(c, where, chart, out); });
}

#define OSDX_INSTANTIATE(T)                                                   \
    template SurfaceJet<T> Evaluator::evaluate<T, 0>(                         \
        std::span<const Vec3<T>>, const PatchPoint&, Chart) const noexcept;   \
    template SurfaceJet<T> Evaluator::evaluate<T, 1>(                         \
        std::span<const Vec3<T>>, const PatchPoint&, Chart) const noexcept;   \
    template SurfaceJet<T> Evaluator::evaluate<T, 2>(                         \
        std::span<const Vec3<T>>, const PatchPoint&, Chart) const noexcept;   \
    template void Evaluator::evaluate_many<T, 0>(                             \
        std::span<const Vec3<T>>, std::span<const PatchPoint>, Chart,         \
        std::span<SurfaceJet<T>>) const noexcept;                             \
    template void Evaluator::evaluate_many<T, 1>(                             \
        std::span<const Vec3<T>>, std::span<const PatchPoint>, Chart,         \
        std::span<SurfaceJet<T>>) const noexcept;                             \
    template void Evaluator::evaluate_many<T, 2>(                             \
        std::span<const Vec3<T>>, std::span<const PatchPoint>, Chart,         \
        std::span<SurfaceJet<T>>) const noexcept;                             \
    template void Evaluator::evaluate_channels<T>(                            \
        std::span<const T>, int, const PatchPoint&, int, Chart, std::span<T>) \
        const noexcept;                                                       \
    template void Evaluator::evaluate_many_channels<T>(                       \
        std::span<const T>, int, const PatchPlaces&, int, Chart, Channels<T>, \
        std::span<const Index>) const noexcept;
OSDX_INSTANTIATE(float)
OSDX_INSTANTIATE(double)
#undef OSDX_INSTANTIATE

}  // namespace osdx::inline OSDX_ABI
