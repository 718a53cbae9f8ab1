// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <type_traits>
#include <variant>

#include <osdx/patch_class.h>
#include <osdx/place.h>

#include "eval/bases/gregory.h"
#include "eval/bases/jet.h"
#include "eval/bases/regular.h"
#include "eval/bases/ribbon.h"
#include "eval/bases/weight_sink.h"

namespace osdx::inline OSDX_ABI {

/// The basis functions of a class of patches: one of three.
///
/// The scalar is that of the domain point: double; or a wider one; or, for patches that meet no
/// border, one that encloses (intervals), as long as it stays between knots.
/// Threads: const members may run at the same time.
class PatchBasis {
public:
    using Basis = std::variant<RegularBasis, RibbonBasis, GregoryBasis>;

    /// \pre the degree is kMinDegree to kMaxDegree; n_sectors >= 3, but >= 1 at a border
    explicit PatchBasis(const PatchClass& patch_class);

    const PatchClass& patch_class() const noexcept { return class_; }
    /// Null where the class is of another kind.
    const RibbonBasis* ribbons() const noexcept {
        return std::get_if<RibbonBasis>(&basis_);
    }

    /// Calls sink(i, w) with the jet w of one contribution to the weight of control point i;
    /// a point may come several times. \return f, by which the sums are to be divided.
    /// \pre the point is in the domain; no allocation
    template <int Order, class T, class Sink>
    Jet<T, Order> for_each_weight(const DomainPointOf<T>& p, Chart chart,
                                  Sink&& sink) const noexcept {
        if constexpr (std::is_same_v<T, double>)
            return sum_weights(p, chart, WeightSink<Order>::of(sink));
        else
            return visit_weights<Order>(p, chart, sink);
    }
    template <int Order, class Sink>
    Jet<double, Order> for_each_weight(const DomainPoint& p, Chart chart,
                                       Sink&& sink) const noexcept {
        return for_each_weight<Order, double>(p, chart, sink);
    }

    /// The point of the domain under (a, b) of a sector; (a, b) itself for square patches.
    Vec2<double> to_native(const DomainPoint& p) const noexcept;
    /// The inverse; points outside of the domain are moved to it.
    DomainPoint from_native(const Vec2<double>& xy) const noexcept;

private:
    template <int Order, class T, class Sink>
    Jet<T, Order> visit_weights(const DomainPointOf<T>& p, Chart chart,
                                Sink&& sink) const noexcept {
        return std::visit(
            [&](const auto& basis) {
                return basis.template for_each_weight<Order, T>(p, chart, sink);
            },
            basis_);
    }
    template <int Order>
    Jet<double, Order> sum_weights(const DomainPoint& p, Chart chart,
                                   WeightSink<Order> sink) const noexcept;

    PatchClass class_;
    Basis basis_;
};

template <int Order>
Jet<double, Order> PatchBasis::sum_weights(const DomainPoint& p, Chart chart,
                                           WeightSink<Order> sink) const noexcept {
    return visit_weights<Order, double>(p, chart, sink);
}
extern template Jet<double, 0> PatchBasis::sum_weights(const DomainPoint&, Chart,
                                                       WeightSink<0>) const noexcept;
extern template Jet<double, 1> PatchBasis::sum_weights(const DomainPoint&, Chart,
                                                       WeightSink<1>) const noexcept;
extern template Jet<double, 2> PatchBasis::sum_weights(const DomainPoint&, Chart,
                                                       WeightSink<2>) const noexcept;

}  // namespace osdx::inline OSDX_ABI
