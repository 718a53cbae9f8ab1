// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

// The instruction sets that kernels are compiled for. Before any header of Highway.
//
// Registers of unknown size do not go into arrays; and of sets that differ in nothing that the
// kernels use, one is enough. With sanitizers, which make each take minutes, so are the plainest
// and AVX2.
#define OSDX_UNUSED_TARGETS \
    (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV | HWY_SSSE3 | HWY_AVX3_DL)
#ifdef OSDX_FEWER_TARGETS
#define HWY_DISABLED_TARGETS (OSDX_UNUSED_TARGETS | HWY_SSE4 | HWY_AVX3)
#else
#define HWY_DISABLED_TARGETS OSDX_UNUSED_TARGETS
#endif

// Lambdas do not take the instruction set from their surroundings.
#define OSDX_LAMBDA HWY_ATTR __attribute__((always_inline))
