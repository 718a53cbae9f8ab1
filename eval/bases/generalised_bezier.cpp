// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "eval/bases/generalised_bezier.h"

#include <cassert>

namespace osdx::inline OSDX_ABI {

GeneralisedBezierBasis::GeneralisedBezierBasis(int n, int degree, CentrePoint centre)
    : polygon_(n), d_(degree), l_((degree + 1) / 2), centre_(centre) {
    assert(n >= 3 && degree >= kMinBezierDegree && degree <= kMaxDegree);
}

}  // namespace osdx::inline OSDX_ABI
