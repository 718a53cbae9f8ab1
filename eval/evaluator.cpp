// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <cstring>
#include <vector>

#include <osdx/evaluator.h>

#include "eval/bases/patch_basis.h"
#include "eval/kernels/patch_kernel.h"
#include "eval/turn.h"

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
    constexpr int kBlock = detail::kSumChannels;
    for (int first = 0; first < n_channels; first += kBlock) {
        const int n = std::min(kBlock, n_channels - first);
        detail::PointJet sums;
        if (fast<T>(c.kernel, points, values.subspan(first), n_channels, where, Order,
                    chart, sums)) {
            for (int r = 0; r < n_derivatives(Order); ++r)
                std::transform(sums.value[r], sums.value[r] + n,
                               &out[r * n_channels + first],
                               [](double x) { return static_cast<T>(x); });
            continue;
        }
        const auto block =
            evaluate_block<Order, kBlock>(c.basis, where, chart, [&](Index i, int k) {
                return k < n ? values[std::size_t(points[i]) * n_channels + first + k]
                             : T(0);
            });
        for (int k = 0; k < n; ++k) {
            for (int r = 0; r < n_derivatives(Order); ++r)
                out[r * n_channels + first + k] = static_cast<T>(block[k][r]);
        }
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

/// Places of one patch, kLanes at a time, as far as there is a kernel for it.
class Batches {
public:
    Batches(const PatchKernel& kernel, std::size_t n_places)
        : kernel_(kernel), has_many_(kernel.has_many() && n_places >= kFewest) {}

    /// Calls many(jets, i, k) for place i, which is lane k of jets, or one(i).
    /// \param value  value(i, c): channel c of control point i
    template <class Value, class Many, class One>
    void run(std::size_t n_points, int n_channels, std::span<const PatchPoint> where,
             int order, Chart chart, Value&& value, Many&& many, One&& one) const {
        if (!has_many_) {
            for (std::size_t i = 0; i < where.size(); ++i)
                one(i);
            return;
        }
        double net[detail::kManyChannels * detail::kMostManyPoints];
        std::size_t n_values = 0;
        for (std::size_t i = 0; i < n_points; ++i) {
            for (int c = 0; c < n_channels; ++c)
                net[n_values++] = value(i, c);
        }
        detail::PointPlaces at{};
        detail::PointJets jets;
        for (std::size_t first = 0; first < where.size(); first += kMost) {
            const std::size_t n = std::min(kMost, where.size() - first);
            const bool at_once = n >= kFewest;
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
                kernel_.sum_many({net, n_values}, n_channels, at, chart, order, jets);
            for (std::size_t k = 0; k < n; ++k) {
                const PatchPoint& p = where[first + k];
                if (at_once && kernel_.takes({0, p.a, p.b}))
                    many(jets, first + k, k);
                else
                    one(first + k);
            }
        }
    }

private:
    static constexpr std::size_t kMost = detail::kLanes, kFewest = kMost / 2;

    const PatchKernel& kernel_;
    bool has_many_;
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
    Batches(classes_[patch.patch_class].kernel, where.size())
        .run(
            patch.points.size(), 3, where, Order, chart,
            [&](std::size_t i, int c) { return points[patch.points[i]][c]; },
            [&](const detail::PointJets& jets, std::size_t i, std::size_t k) {
                fill<Order>(out[i], [&](int r) {
                    const auto& v = jets.value[r];
                    return Vec3<T>(Vec3<double>(v[0][k], v[1][k], v[2][k]));
                });
            },
            [&](std::size_t i) { out[i] = evaluate<T, Order>(points, where[i], chart); });
}

template <class T>
void Evaluator::evaluate_many_channels(std::span<const T> values, int n_channels,
                                       std::span<const PatchPoint> where, int order,
                                       Chart chart,
                                       std::span<T* const> out) const noexcept {
    assert(values.size() == std::size_t(table_->n_points()) * n_channels);
    assert(out.size() == where.size());
    if (where.empty())
        return;
    const PatchRef patch = table_->patch(where[0].patch);
    const ClassEvaluator& c = classes_[patch.patch_class];
    const Batches batches(c.kernel, where.size());
    const int n_results = n_derivatives(order);
    for (int first = 0; first < n_channels; first += detail::kManyChannels) {
        const int n = std::min(detail::kManyChannels, n_channels - first);
        batches.run(
            patch.points.size(), n, where, order, chart,
            [&](std::size_t i, int k) {
                return values[std::size_t(patch.points[i]) * n_channels + first + k];
            },
            [&](const detail::PointJets& jets, std::size_t i, std::size_t lane) {
                for (int r = 0; r < n_results; ++r) {
                    for (int k = 0; k < n; ++k)
                        out[i][r * n_channels + first + k] =
                            static_cast<T>(jets.value[r][k][lane]);
                }
            },
            [&](std::size_t i) {
                if (first == 0)  // all channels
                    evaluate_channels<T>(
                        values, n_channels, where[i], order, chart,
                        {out[i], std::size_t(n_results) * std::size_t(n_channels)});
            });
    }
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
        std::span<const T>, int, std::span<const PatchPoint>, int, Chart,     \
        std::span<T* const>) const noexcept;
OSDX_INSTANTIATE(float)
OSDX_INSTANTIATE(double)
#undef OSDX_INSTANTIATE

}  // namespace osdx::inline OSDX_ABI
