// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <osdx/stencil_table.h>
#include <osdx/types.h>

#include "far/refine/stencil_rows.h"

namespace osdx::inline OSDX_ABI::detail {

/// From the points of the level above to those of a level, by factors that are applied one
/// after the other. Rows are made when they are asked for: of a part that is refined few are.
/// Threads: const members may run at the same time.
class LevelRows {
public:
    virtual ~LevelRows() = default;
    virtual int n_factors() const = 0;
    virtual Index n_rows(int factor) const = 0;
    /// Appends the entries of a row; none where the point is not known.
    /// \param sums  of the thread
    virtual void add(int factor, Index row, DenseRow& sums,
                     StencilTable& table) const = 0;
};

}  // namespace osdx::inline OSDX_ABI::detail
