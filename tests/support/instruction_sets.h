// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include <hwy/targets.h>

namespace osdx::test {

/// Runs a test once for each instruction set that this machine has, the best one last.
template <class F>
void for_each_target(F&& f) {
    std::vector<std::int64_t> targets = hwy::SupportedAndGeneratedTargets();
    std::ranges::reverse(targets);
    for (const std::int64_t target : targets) {
        SCOPED_TRACE(hwy::TargetName(target));
        hwy::SetSupportedTargetsForTest(target);
        hwy::GetChosenTarget().Update(hwy::SupportedTargets());
        f();
    }
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

}  // namespace osdx::test
