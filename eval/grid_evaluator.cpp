// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "eval/grid_evaluator.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <utility>
#include <vector>

namespace osdx {

template <class T>
struct GridEvaluator<T>::Plan {
    const Evaluator* evaluator;
    GridOptions options;
    std::vector<std::size_t> first_sample{0};
    std::vector<PatchPoint> samples;
};

template <class T>
GridEvaluator<T>::GridEvaluator(const Evaluator& evaluator, int rate,
                                const GridOptions& options) {
    assert(rate >= 1);
    auto plan = std::make_unique<Plan>(Plan{&evaluator, options, {0}, {}});
    const PatchTable& table = evaluator.table();
    const Topology& base = table.base();
    for (Index face = 0; face < base.n_faces(); ++face) {
        const Index n = base.face_size(face);
        if (table.has_surface(face) && n == 4) {
            for (int j = 0; j <= rate; ++j) {
                for (int i = 0; i <= rate; ++i)
                    plan->samples.push_back(
                        table.locate(Address{face, double(i) / rate, double(j) / rate}));
            }
        } else if (table.has_surface(face)) {
            for (Index h = base.face_offsets[face]; h < base.face_offsets[face + 1];
                 ++h) {
                for (int j = 0; j <= rate / 2; ++j) {
                    for (int i = 0; i <= rate / 2; ++i)
                        plan->samples.push_back(table.locate(
                            QuarterPoint{h, 2.0 * i / rate, 2.0 * j / rate}));
                }
            }
        }
        plan->first_sample.push_back(plan->samples.size());
    }
    plan_ = std::move(plan);
}

template <class T>
GridEvaluator<T>::GridEvaluator(const Evaluator& evaluator, Index patch_class,
                                std::span<const DomainPoint> points,
                                const GridOptions& options) {
    auto plan = std::make_unique<Plan>(Plan{&evaluator, options, {0}, {}});
    const PatchTable& table = evaluator.table();
    for (Index patch = 0; patch < table.n_patches(); ++patch) {
        if (table.patch(patch).patch_class != patch_class)
            continue;
        for (const DomainPoint& p : points)
            plan->samples.push_back(
                {patch, static_cast<Index>(p.sector), p.a, p.b, 0, 1.0});
        plan->first_sample.push_back(plan->samples.size());
    }
    plan_ = std::move(plan);
}

template <class T>
GridEvaluator<T>::GridEvaluator(GridEvaluator&&) noexcept = default;
template <class T>
GridEvaluator<T>& GridEvaluator<T>::operator=(GridEvaluator&&) noexcept = default;
template <class T>
GridEvaluator<T>::~GridEvaluator() = default;

template <class T>
const Evaluator& GridEvaluator<T>::evaluator() const noexcept {
    return *plan_->evaluator;
}
template <class T>
int GridEvaluator<T>::order() const noexcept {
    return plan_->options.order;
}
template <class T>
Index GridEvaluator<T>::n_units() const noexcept {
    return static_cast<Index>(plan_->first_sample.size() - 1);
}
template <class T>
std::size_t GridEvaluator<T>::n_samples() const noexcept {
    return plan_->samples.size();
}
template <class T>
std::size_t GridEvaluator<T>::first_sample(Index unit) const noexcept {
    return plan_->first_sample[unit];
}
template <class T>
std::size_t GridEvaluator<T>::table_bytes() const noexcept {
    return 0;
}
template <class T>
std::size_t GridEvaluator<T>::n_single_samples() const noexcept {
    return n_samples();
}

template <class T>
void GridEvaluator<T>::evaluate(std::span<const Vec3<T>> points,
                                const SampleBuffers<T>& out) const {
    const Plan& plan = *plan_;
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, n_samples(), 256), [&](const auto& range) {
            for (std::size_t s = range.begin(); s < range.end(); ++s) {
                const PatchPoint& p = plan.samples[s];
                const bool native =
                    plan.options.native_at_borders &&
                    plan.evaluator->basis(p.patch).patch_class().is_open();
                const auto jet = plan.evaluator->template evaluate<T>(
                    points, p, native ? Chart::Native : Chart::BaseUV);
                const Vec3<T> values[] = {jet.p,   jet.du,  jet.dv,
                                          jet.duu, jet.duv, jet.dvv};
                for (int r = 0; r < n_derivatives(plan.options.order); ++r) {
                    const auto at = static_cast<std::ptrdiff_t>(s) * out[r].sample_stride;
                    for (int c = 0; c < 3; ++c)
                        out[r].data[at + c * out[r].channel_stride] = values[r][c];
                }
            }
        });
}

template <class T>
void GridEvaluator<T>::for_each_block(
    std::span<const Vec3<T>> points,
    const std::function<void(const SampleBlock<T>&)>& f) const {
    std::array<std::vector<T>, 6> values;
    SampleBuffers<T> out;
    SampleBlock<T> block{0, n_units(), 0, n_samples(), {}};
    for (int r = 0; r < n_derivatives(order()); ++r) {
        values[r].resize(3 * n_samples());
        block.values[r] = out[r].data = values[r].data();
    }
    evaluate(points, out);
    f(block);
}

template class GridEvaluator<float>;
template class GridEvaluator<double>;

}  // namespace osdx
