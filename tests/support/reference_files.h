// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <nlohmann/json.hpp>

#include <osdx/types.h>

namespace osdx::test {

/// Three numbers of a file of reference vectors.
inline Vec3<double> vector(const nlohmann::json& j) {
    return {j.at(0).get<double>(), j.at(1).get<double>(), j.at(2).get<double>()};
}

}  // namespace osdx::test
