// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

// What most tests include, for the precompiled header: tests name what they use all the same.

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <osdx/build_patch_table.h>
#include <osdx/build_topology.h>
#include <osdx/evaluator.h>
#include <osdx/surface.h>
