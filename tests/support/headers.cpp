// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "tests/support/headers.h"
