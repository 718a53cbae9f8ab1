// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <string_view>

#include <osdx/patch_class.h>

namespace osdx::render {

/// Patches that pictures and reports name, and count, together: in one number, or by their
/// number of sectors.
struct PatchKindName {
    PatchKind kind;
    PatchBorder border;
    std::string_view key;   ///< in JSON
    std::string_view name;  ///< for people

    bool by_sectors() const { return kind != PatchKind::Regular; }
    /// Whether the report has it even where there are none.
    bool always() const { return border == PatchBorder::None; }
};
inline constexpr std::array kPatchKinds = {
    PatchKindName{PatchKind::Regular, PatchBorder::None, "regular", "regular"},
    PatchKindName{PatchKind::EV, PatchBorder::None, "ev", "EV"},
    PatchKindName{PatchKind::EV, PatchBorder::Smooth, "ev_border", "border EV"},
    PatchKindName{PatchKind::EV, PatchBorder::Pinned, "ev_pinned", "pinned EV"},
    PatchKindName{PatchKind::EV, PatchBorder::Spike, "ev_spike", "spiked EV"},
    PatchKindName{PatchKind::EF, PatchBorder::None, "ef", "EF"},
    PatchKindName{PatchKind::EF, PatchBorder::Smooth, "ef_border", "border EF"},
    PatchKindName{PatchKind::EF, PatchBorder::Pinned, "ef_pinned", "pinned EF"},
    PatchKindName{PatchKind::EF, PatchBorder::Spike, "ef_spike", "spiked EF"},
    PatchKindName{PatchKind::Gregory, PatchBorder::None, "gregory", "Gregory"},
};

inline const PatchKindName& name_of(PatchKind kind, PatchBorder border) {
    const auto group = std::ranges::find_if(kPatchKinds, [&](const PatchKindName& g) {
        return g.kind == kind && g.border == border;
    });
    assert(group != kPatchKinds.end());
    return *group;
}

}  // namespace osdx::render
