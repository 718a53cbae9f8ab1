// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "tests/support/high_orders.h"

namespace osdx {

template Jet<double, 3> PatchBasis::sum_weights(const DomainPoint&, Chart,
                                                WeightSink<3>) const noexcept;
template Jet<double, 4> PatchBasis::sum_weights(const DomainPoint&, Chart,
                                                WeightSink<4>) const noexcept;
template Jet<double, 5> PatchBasis::sum_weights(const DomainPoint&, Chart,
                                                WeightSink<5>) const noexcept;
template Jet<double, 6> PatchBasis::sum_weights(const DomainPoint&, Chart,
                                                WeightSink<6>) const noexcept;

}  // namespace osdx
