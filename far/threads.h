// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <functional>

#include <osdx/version.h>

namespace osdx::inline OSDX_ABI {

/// Calls f so that all that it calls here takes no more than so many threads, its own among them,
/// however many there are else. Other threads of the program are not limited. Exceptions of f go
/// on to the caller.
/// \pre n_threads >= 1
OSDX_API void with_threads(int n_threads, const std::function<void()>& f);

}  // namespace osdx::inline OSDX_ABI
