// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <bit>
#include <cassert>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <osdx/buffer.h>
#include <osdx/evaluate_addresses.h>
#include <osdx/patch_table.h>
#include <osdx/topology.h>

#include "far/mesh/address_counts.h"
#include "far/parallel.h"
#include "far/patches/leaf_runs.h"
#include "far/prefetch.h"
#include "far/refine/stencil_rows.h"

namespace osdx::inline OSDX_ABI {
namespace {

using detail::AddressCounts, detail::counting_sort, detail::prefetch, detail::was_clamped;

struct NumberedAddress {
    Index face;
    Index number;  ///< counted from the beginning of a chunk
    double u, v;
};

/// Groups of addresses on neighbouring faces; where there are few faces, on slices of one. Enough
/// for threads to share, and so few that what is written stays in the nearer caches.
class FaceGroups {
public:
    /// \pre n_faces > 0
    explicit FaceGroups(Index n_faces)
        : last_face_(n_faces - 1),
          shift_(static_cast<int>(std::bit_width(last_face_ / kMost))),
          n_slices_(n_faces < kMost ? kMost / n_faces : 1) {}

    Index n_groups() const { return ((last_face_ >> shift_) + 1) * n_slices_; }
    /// \param at  anything
    Index group(const NumberedAddress& at) const {
        const Index g = face(at) >> shift_;
        return n_slices_ == 1 ? g : g * n_slices_ + slice(at.u);
    }
    Index n_faces() const { return Index(1) << shift_; }  ///< of a group
    Index face_in_group(const NumberedAddress& at) const {
        return face(at) & (n_faces() - 1);
    }

private:
    static constexpr Index kMost = 128;

    Index face(const NumberedAddress& at) const { return std::min(at.face, last_face_); }
    Index slice(double u) const {
        return u > 0 ? static_cast<Index>(std::min(u, 0.999) * n_slices_) : 0;
    }

    Index last_face_;
    int shift_;
    Index n_slices_;
};

/// What a thread evaluates.
template <class T>
class GroupEvaluator {
public:
    GroupEvaluator(const Evaluator& evaluator, const FaceGroups& groups,
                   std::span<const T> values, int n_channels, int order, Chart chart,
                   std::size_t n_addresses)
        : evaluator_(evaluator),
          groups_(groups),
          table_(evaluator.table()),
          values_(values),
          n_channels_(n_channels),
          order_(order),
          chart_(chart),
          runs_(table_, std::min(n_addresses, kMostRun)) {}

    /// \param n, each  of the addresses of a group, as counting_sort() takes them
    /// \param first  the number of address 0
    template <class Each>
    void evaluate(std::size_t n, Each&& each, std::size_t first, Channels<T> rows,
                  AddressCounts& counts) {
        n_clamped_ = n_without_ = 0;
        first_without_ = SIZE_MAX;
        // No more keys than a few for each address.
        int rough = 0;
        while ((groups_.n_faces() >> rough) > 8 * n)
            ++rough;
        ends_.resize(groups_.n_faces() >> rough);
        sorted_.resize(std::max(n, sorted_.size()));
        counting_sort(
            each, [&](const auto& at) { return groups_.face_in_group(at) >> rough; },
            ends_, sorted_.data());
        for (auto rest = std::span<const NumberedAddress>(sorted_).first(n);
             !rest.empty();) {
            rest = rest.subspan(take_face(rest, rows));
            evaluate_runs(rows);
        }
        if (n_clamped_ > 0 || n_without_ > 0)
            counts.add(n_clamped_, n_without_,
                       n_without_ > 0 ? first + first_without_ : SIZE_MAX);
    }

private:
    /// Those of the first one's face, as far as they follow one another and there is room.
    /// \return how many they are
    std::size_t take_face(std::span<const NumberedAddress> group, Channels<T> rows) {
        const Index face = group[0].face;
        runs_.start(face);
        const bool has_surface =
            face < table_.base().n_faces() && table_.has_surface(face);
        std::size_t n = 0;
        for (; n < group.size() && n < runs_.most(); ++n) {
            const NumberedAddress& at = group[n];
            if (at.face != face)
                break;
            T* const row = rows[at.number];
            if (!has_surface || std::isnan(at.u) || std::isnan(at.v)) {
                std::fill_n(row, rows.n, std::numeric_limits<T>::quiet_NaN());
                ++n_without_;
                first_without_ = std::min<std::size_t>(first_without_, at.number);
                continue;
            }
            n_clamped_ += runs_.add({face, at.u, at.v}, at.number);
        }
        return n;
    }

    void evaluate_runs(Channels<T> rows) {
        const auto runs = runs_.runs();
        const auto points = [&](std::size_t r) {
            return table_.patch(runs[r].places.patch).points;
        };
        for (std::size_t r = 0; r < runs.size(); ++r) {
            if (r + 2 < runs.size())
                prefetch(points(r + 2).data(), points(r + 2).size());
            if (r + 1 < runs.size()) {
                for (const Index p : points(r + 1))
                    prefetch(&values_[std::size_t(p) * n_channels_], n_channels_);
                const auto numbers = runs[r + 1].numbers;
                for (const Index number :
                     numbers.first(std::min(kAtOnce, numbers.size())))
                    prefetch(rows[number], rows.n);
            }
            evaluator_.evaluate_many_channels<T>(values_, n_channels_, runs[r].places,
                                                 order_, chart_, rows, runs[r].numbers);
        }
    }

    static constexpr std::size_t kAtOnce = 8;  // that the kernels take
    /// Points of a face at a time, which with what is made of them stay in the second cache.
    static constexpr std::size_t kMostRun = 1024;

    const Evaluator& evaluator_;
    const FaceGroups& groups_;
    const PatchTable& table_;
    std::span<const T> values_;
    int n_channels_, order_;
    Chart chart_;
    detail::LeafRuns runs_;
    std::vector<Index> ends_;
    std::vector<NumberedAddress> sorted_;
    std::size_t n_clamped_ = 0, n_without_ = 0, first_without_ = SIZE_MAX;
};

}  // namespace

template <class T>
AddressReport evaluate_addresses(const Evaluator& evaluator, std::span<const T> values,
                                 int n_channels, std::span<const Address> where,
                                 int order, Chart chart, Channels<T> out) {
    assert(out.n == n_derivatives(order) * n_channels);
    // So many at a time, by groups first: in parts of them at the same time, then group by group.
    // Results do not depend on what is evaluated at once.
    constexpr std::size_t kMost = std::size_t(1) << 20, kLeastPart = 4096;
    const FaceGroups groups(std::max<Index>(1, evaluator.table().base().n_faces()));
    const Index n_groups = groups.n_groups();
    detail::PerThread<GroupEvaluator<T>> threads([&] {
        return GroupEvaluator<T>(evaluator, groups, values, n_channels, order, chart,
                                 where.size());
    });
    Buffer<NumberedAddress> sorted(std::min(where.size(), kMost));
    std::vector<Index> ends;  // of each part its groups
    AddressCounts counts;
    for (std::size_t first = 0; first < where.size(); first += kMost) {
        const auto chunk = where.subspan(first, std::min(kMost, where.size() - first));
        const Channels<T> rows{out[first], out.stride, out.n};
        const std::size_t part =
            std::max(kLeastPart, chunk.size() / (2 * detail::n_threads()) + 1);
        const std::size_t n_parts = detail::n_chunks(chunk.size(), part);
        ends.resize(n_parts * n_groups);
        const auto ends_of = [&](std::size_t p) {
            return std::span(ends).subspan(p * n_groups, n_groups);
        };
        detail::for_each_chunk(
            chunk.size(), part, [&](std::size_t p, std::size_t begin, std::size_t end) {
                const auto each = [&](auto&& f) {
                    for (std::size_t i = begin; i < end; ++i)
                        f(NumberedAddress{chunk[i].face, static_cast<Index>(i),
                                          chunk[i].u, chunk[i].v});
                };
                counting_sort(
                    each, [&](const auto& at) { return groups.group(at); }, ends_of(p),
                    sorted.data() + begin);
            });
        detail::for_each_chunk(
            n_groups, n_parts == 1 ? n_groups : 1,
            [&](std::size_t, std::size_t begin, std::size_t end) {
                for (std::size_t g = begin; g < end; ++g) {
                    const auto of_part = [&](std::size_t p) {
                        const auto e = ends_of(p);
                        const Index from = g > 0 ? e[g - 1] : 0;
                        return std::span(sorted).subspan(p * part + from, e[g] - from);
                    };
                    std::size_t n = 0;
                    for (std::size_t p = 0; p < n_parts; ++p)
                        n += of_part(p).size();
                    if (n == 0)
                        continue;
                    const auto each = [&](auto&& f) {
                        for (std::size_t p = 0; p < n_parts; ++p) {
                            for (const NumberedAddress& at : of_part(p))
                                f(at);
                        }
                    };
                    threads.local().evaluate(n, each, first, rows, counts);
                }
            });
    }
    return counts.report();
}
template OSDX_API AddressReport evaluate_addresses(const Evaluator&,
                                                   std::span<const float>, int,
                                                   std::span<const Address>, int, Chart,
                                                   Channels<float>);
template OSDX_API AddressReport evaluate_addresses(const Evaluator&,
                                                   std::span<const double>, int,
                                                   std::span<const Address>, int, Chart,
                                                   Channels<double>);

namespace {

using detail::DenseRow;
using Row = std::vector<std::pair<Index, double>>;

/// The rows of refined points over the base vertices, of those that are asked for and what
/// these are made from.
class BaseRows {
public:
    /// \param wanted  of all points
    BaseRows(const PatchTable& table, Flags wanted)
        : table_(table), rows_(table.refined_points().n_rows()) {
        const StencilTable& stencils = table.refined_points();
        const Index n_base = table.n_base_points();
        for (Index r = stencils.n_rows(); r-- > 0;) {
            if (!wanted[n_base + r])
                continue;
            for (std::size_t k = stencils.offsets[r]; k < stencils.offsets[r + 1]; ++k)
                wanted[stencils.indices[k]] = 1;
        }
        detail::PerThread<DenseRow> sums;
        const auto groups = table.row_groups();
        for (std::size_t g = 0; g + 1 < groups.size(); ++g) {
            detail::for_each_chunk(
                groups[g + 1] - groups[g], detail::kSmallChunk,
                [&](std::size_t, std::size_t begin, std::size_t end) {
                    DenseRow& sum = sums.local();
                    sum.fit(n_base);
                    for (std::size_t i = begin; i < end; ++i) {
                        const Index r = groups[g] + static_cast<Index>(i);
                        if (!wanted[n_base + r])
                            continue;
                        for (std::size_t k = stencils.offsets[r];
                             k < stencils.offsets[r + 1]; ++k)
                            add(stencils.indices[k], stencils.weights[k], sum);
                        sum.take([&](Index c, double w) { rows_[r].emplace_back(c, w); });
                    }
                });
        }
    }

    /// Adds a point's row times a weight.
    void add(Index point, double weight, DenseRow& sum) const {
        if (point < table_.n_base_points())
            return sum.add(point, weight);
        for (const auto& [c, w] : rows_[point - table_.n_base_points()])
            sum.add(c, weight * w);
    }

private:
    const PatchTable& table_;
    std::vector<Row> rows_;
};

}  // namespace

WeightRows weights_at(const Evaluator& evaluator, std::span<const Address> where,
                      int order, Chart chart, WeightsOf of) {
    const PatchTable& table = evaluator.table();
    const int n_rows = n_derivatives(order);
    std::optional<BaseRows> base;
    if (of == WeightsOf::BaseVertices) {
        Flags wanted(table.n_points());
        detail::for_each_index(where.size(), [&](Index i) {
            if (!table.has_point(where[i]))
                return;
            for (const Index p : table.patch(table.locate(where[i]).patch).points)
                detail::set_flag(wanted[p]);
        });
        base.emplace(table, std::move(wanted));
    }
    const Index n_columns = base ? table.n_base_points() : table.n_points();
    struct Thread {
        DenseRow row;
        std::vector<double> weights;
    };
    detail::PerThread<Thread> threads;
    AddressCounts counts;
    const auto n_addresses = static_cast<Index>(where.size());
    StencilTable rows = detail::make_row_chunks(
        n_addresses, [&](Index begin, Index end, StencilTable& out) {
            auto& thread = threads.local();
            thread.row.fit(n_columns);
            std::size_t n_clamped = 0, n_without = 0, first_without = SIZE_MAX;
            for (Index i = begin; i < end; ++i) {
                const Address& at = where[i];
                if (!table.has_point(at)) {
                    for (int r = 0; r < n_rows; ++r)
                        out.end_row();
                    ++n_without;
                    first_without = std::min<std::size_t>(first_without, i);
                    continue;
                }
                const QuarterPoint q = to_quarter(table.base(), at);
                n_clamped += was_clamped(table.base(), at, q);
                const PatchPoint point = table.locate(q);
                const auto points = table.patch(point.patch).points;
                thread.weights.resize(n_rows * points.size());
                evaluator.weights(point, order, chart, thread.weights);
                for (int r = 0; r < n_rows; ++r) {
                    for (std::size_t k = 0; k < points.size(); ++k) {
                        const double w = thread.weights[r * points.size() + k];
                        if (base)
                            base->add(points[k], w, thread.row);
                        else
                            thread.row.add(points[k], w);
                    }
                    thread.row.take([&](Index c, double w) { out.add(c, w); });
                    out.end_row();
                }
            }
            counts.add(n_clamped, n_without, first_without);
        });
    return {std::move(rows), counts.report()};
}

}  // namespace osdx::inline OSDX_ABI
