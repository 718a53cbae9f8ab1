// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <string>

#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

enum class WarningCode : std::uint8_t {
    MissingTexcoords,  ///< corners have no texture coordinates, though others have
    InvalidTexcoords,  ///< corners name texture coordinates that are not there or not finite
    ExtraValues,       ///< a row has more values than were announced, which are left out
    MissingHeader,     ///< the format was told by what follows its header
    OutsideFace,       ///< an address lies outside of its face and was moved to it
};

/// What was taken although it is not as it should be, and how it was taken. Of a kind there is
/// one, which names the first place and says how many there are.
struct Warning {
    WarningCode code;
    std::string message;  ///< one sentence for a person; names the element
    Index line = 0;       ///< line of the input file, counted from 1; 0: none
};

}  // namespace osdx::inline OSDX_ABI
