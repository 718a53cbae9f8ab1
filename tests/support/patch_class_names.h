// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <ostream>

#include <osdx/patch_class.h>

namespace osdx {

/// How GoogleTest names a class of patches: "EV d3 n5".
inline void PrintTo(const PatchClass& c, std::ostream* out) {
    *out << (c.kind == PatchKind::Regular ? "Regular"
             : c.kind == PatchKind::EV    ? "EV"
                                          : "EF")
         << " d" << c.degree << " n" << c.n_sectors;
}

}  // namespace osdx
