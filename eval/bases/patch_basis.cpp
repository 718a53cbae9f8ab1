// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "eval/bases/patch_basis.h"

namespace osdx::inline OSDX_ABI {
namespace {

PatchBasis::Basis make(const PatchClass& c) {
    switch (c.kind) {
        case PatchKind::Regular:
            return RegularBasis(c.degree);
        case PatchKind::Gregory:
            return GregoryBasis(c.n_sectors,
                                c.normalised ? CentrePoint::None : CentrePoint::Given);
        default:
            return RibbonBasis(c);
    }
}

}  // namespace

PatchBasis::PatchBasis(const PatchClass& patch_class)
    : class_(patch_class), basis_(make(patch_class)) {}

template Jet<double, 0> PatchBasis::sum_weights(const DomainPoint&, Chart,
                                                WeightSink<0>) const noexcept;
template Jet<double, 1> PatchBasis::sum_weights(const DomainPoint&, Chart,
                                                WeightSink<1>) const noexcept;
template Jet<double, 2> PatchBasis::sum_weights(const DomainPoint&, Chart,
                                                WeightSink<2>) const noexcept;

Vec2<double> PatchBasis::to_native(const DomainPoint& p) const noexcept {
    return std::visit([&](const auto& basis) { return basis.to_native(p); }, basis_);
}

DomainPoint PatchBasis::from_native(const Vec2<double>& xy) const noexcept {
    return std::visit([&](const auto& basis) { return basis.from_native(xy); }, basis_);
}

}  // namespace osdx::inline OSDX_ABI
