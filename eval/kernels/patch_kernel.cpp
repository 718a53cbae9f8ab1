// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "eval/kernels/patch_kernel.h"

namespace osdx::inline OSDX_ABI {

PatchKernel::PatchKernel(const PatchBasis& basis)
    : is_square_(basis.patch_class().is_square()),
      tables_{basis.patch_class().kind, basis.patch_class().degree, {}, {}} {
    const PatchClass& c = basis.patch_class();
    const RibbonBasis* ribbons = basis.ribbons();
    if (c.kind == PatchKind::Regular) {
        tables_.taylor.emplace(c.degree);
        set_regular_kernels(tables_, kernels_);
    } else if (!ribbons) {
        if (is_square_)
            set_gregory_kernels(kernels_);
    } else if (!c.is_single()) {
        tables_.ring.emplace(PatchClass{c.kind, c.degree, c.n_polygon()},
                             ribbons->border().polygon());
        set_ribbon_sums_float_kernels(kernels_);
        set_ribbon_sums_double_kernels(kernels_);
        if (c.border == PatchBorder::None) {
            set_ribbon_weights_kernels(tables_, kernels_);
            set_ribbon_many_kernels(tables_, kernels_);
            set_ribbon_channels_kernels(tables_, kernels_);
            return;
        }
        border_.emplace(*ribbons);
        if (!border_->fits())
            kernels_ = {};
    }
}

}  // namespace osdx::inline OSDX_ABI
