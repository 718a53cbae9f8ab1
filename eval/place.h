// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <osdx/surface_jet.h>

namespace osdx::inline OSDX_ABI {

/// A point of the domain of a patch; see PatchPoint.
template <class T>
struct DomainPointOf {
    int sector = 0;
    T a = T(0), b = T(0);
};
using DomainPoint = DomainPointOf<double>;

}  // namespace osdx::inline OSDX_ABI
