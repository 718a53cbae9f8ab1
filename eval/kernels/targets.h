// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

// The instruction sets that kernels are compiled for. Before any header of Highway.
//
// Registers of unknown size do not go into arrays; and of sets that differ in nothing that the
// kernels use, one is enough.
#define HWY_DISABLED_TARGETS \
    (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV | HWY_SSSE3 | HWY_AVX3_DL)

// Lambdas do not take the instruction set from their surroundings.
#define OSDX_LAMBDA HWY_ATTR __attribute__((always_inline))
