// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <span>

#include <osdx/evaluator.h>
#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

/// Where the values of samples go: coordinate c of sample s to
/// data[s * sample_stride + c * channel_stride].
///
/// Fastest are arrays of structures, strides 3 and 1, and structures of arrays, strides 1 and
/// anything.
template <class T>
struct SampleBuffer {
    T* data = nullptr;
    std::ptrdiff_t sample_stride = 3;
    std::ptrdiff_t channel_stride = 1;
};

/// One for each derivative, in the order p, du, dv, duu, duv, dvv.
template <class T>
using SampleBuffers = std::array<SampleBuffer<T>, 6>;

/// Samples that were made together, still in the cache.
template <class T>
struct SampleBlock {
    Index first_unit, n_units;  ///< the faces or patches that they belong to
    std::size_t first_sample, n_samples;
    /// By derivative: coordinate c of sample first_sample + s is values[r][3 * s + c]; null
    /// for those beyond the order.
    std::array<const T*, 6> values;
};

struct GridOptions {
    int order = 1;  ///< of the derivatives: 0, 1 or 2
    /// Derivatives in the native chart of patches at borders and sharp edges, instead of
    /// (u, v), which is singular at smooth border vertices of one face: normals and curvatures
    /// hold everywhere then.
    bool native_at_borders = false;
    /// Bytes of all tables of weights together. What has no table is evaluated point by point.
    std::size_t max_table_bytes = std::size_t(64) << 20;
    /// A table is made for what comes at least that often. Making one takes as long as one
    /// evaluation point by point: 2 pays where the plan is used once.
    Index min_table_uses = 1;
    /// Of the values in a block for for_each_block().
    std::size_t block_bytes = std::size_t(256) << 10;
    /// Arrays of structures that together have at least so many bytes are written past the
    /// caches, which saves reading them first.
    std::size_t stream_bytes = std::size_t(128) << 20;
};

/// Evaluates the surface at many points that are known before the positions are: on a grid in
/// every base face, or at the same points of all patches of a class.
///
/// The weights of the control points at a point of the domain depend on the class of the patch
/// alone. So they are formed once for all patches of a class, and kept as T; evaluation is a
/// dense product, and at regular patches that of two bases of one variable. A table serves all
/// patches of its class with the same points in the same place; closed patches are turned, so
/// that their sectors share tables too.
///
/// Values are those of Evaluator up to the rounding of T, and so is the choice where patches or
/// sectors meet. They do not depend on the number of threads, but the last bits do depend on
/// the machine: the vector instructions are chosen at run time, some of them fused.
///
/// Plans need no positions: evaluate() may run any number of times.
/// Threads: goes wide; const members may run at the same time. Evaluation allocates scratch for
/// each task, none for a face or a patch.
template <class T>
class OSDX_API GridEvaluator {
public:
    /// Units are the base faces, also those without surface, which have no samples.
    /// A quad has samples at (i/rate, j/rate), 0 <= i, j <= rate; sample j (rate + 1) + i. Another
    /// face has (rate/2 + 1)^2 for each corner, in the order of the corners: at
    /// (2i/rate, 2j/rate) of its QuarterPoint, sample j (rate/2 + 1) + i.
    /// \pre rate >= 1; the evaluator outlives the plan
    GridEvaluator(const Evaluator& evaluator, int rate, const GridOptions& options = {});

    /// Units are the patches of a class, in the order of the table; samples are the points of
    /// each, derivatives are those in Chart::BaseUV of the patch: (a, b) of the sector, or (s, t);
    /// native_at_borders holds here as well.
    /// \pre patch_class < evaluator.table().classes().size(); the evaluator outlives the plan
    GridEvaluator(const Evaluator& evaluator, Index patch_class,
                  std::span<const DomainPoint> points, const GridOptions& options = {});

    GridEvaluator(GridEvaluator&&) noexcept;
    GridEvaluator& operator=(GridEvaluator&&) noexcept;
    ~GridEvaluator();

    const Evaluator& evaluator() const noexcept;
    int order() const noexcept;
    Index n_units() const noexcept;
    std::size_t n_samples() const noexcept;
    /// The samples of a unit are first_sample(unit) .. first_sample(unit + 1).
    /// \pre unit <= n_units()
    std::size_t first_sample(Index unit) const noexcept;
    std::size_t table_bytes() const noexcept;
    /// Samples that have no table.
    std::size_t n_single_samples() const noexcept;

    /// All samples into buffers; those beyond the order are not touched.
    /// \param points  all control points, evaluator().table().n_points() of them
    /// \pre the buffers up to the order have room for n_samples()
    void evaluate(std::span<const Vec3<T>> points, const SampleBuffers<T>& out) const;

    /// Calls f for blocks of whole units that together have all samples, from several threads
    /// at the same time and in any order. A block has at least one unit.
    void for_each_block(std::span<const Vec3<T>> points,
                        const std::function<void(const SampleBlock<T>&)>& f) const;

private:
    struct Plan;
    std::unique_ptr<const Plan> plan_;
};

extern template class OSDX_API GridEvaluator<float>;
extern template class OSDX_API GridEvaluator<double>;

}  // namespace osdx::inline OSDX_ABI
