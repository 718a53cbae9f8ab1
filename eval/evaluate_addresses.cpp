// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <bit>
#include <cassert>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <osdx/evaluate_addresses.h>
#include <osdx/patch_table.h>
#include <osdx/topology.h>

#include "far/mesh/address_counts.h"
#include "far/parallel.h"
#include "far/patches/leaf_runs.h"
#include "far/refine/stencil_rows.h"

namespace osdx::inline OSDX_ABI {
namespace {

using detail::AddressCounts, detail::was_clamped;

struct NumberedAddress {
    Index face;
    Index number;  ///< counted from the beginning of a chunk
    double u, v;
};

/// Addresses in the order of keys below n_keys.
class CountingSort {
public:
    /// \param key  key(i) of address i
    /// \param address  address(i, out): puts address i
    template <class Key, class NumberedAt>
    void sort(std::size_t n, std::size_t n_keys, Key&& key, NumberedAt&& address) {
        ends_.assign(n_keys, 0);
        for (std::size_t i = 0; i < n; ++i)
            ++ends_[key(i)];
        Index sum = 0;
        for (Index& e : ends_)
            sum += std::exchange(e, sum);
        sorted_.resize(std::max(n, sorted_.size()));
        for (std::size_t i = 0; i < n; ++i)
            address(i, sorted_[ends_[key(i)]++]);
    }

    std::span<const NumberedAddress> of_key(std::size_t k) const {
        const Index begin = k > 0 ? ends_[k - 1] : 0;
        return std::span(sorted_).subspan(begin, ends_[k] - begin);
    }
    std::span<const NumberedAddress> all() const {
        return std::span(sorted_).first(ends_.back());
    }

private:
    std::vector<Index> ends_;
    std::vector<NumberedAddress> sorted_;
};

/// The addresses of a chunk in the order of their faces, roughly where there are very many: by
/// groups of faces first, so that a group and what is written stay in the nearer caches.
class FaceOrder {
public:
    explicit FaceOrder(Index n_faces)
        : last_face_(n_faces - 1),
          shift_(n_faces <= kFewFaces
                     ? 0
                     : static_cast<int>(std::bit_width(last_face_ / kMostGroups))),
          n_groups_((last_face_ >> shift_) + 1) {}

    /// Calls f(addresses) for each group.
    template <class F>
    void for_each_group(std::span<const Address> chunk, F&& f) {
        const auto face = [&](const auto& at) { return std::min(at.face, last_face_); };
        groups_.sort(
            chunk.size(), n_groups_,
            [&](std::size_t i) { return face(chunk[i]) >> shift_; },
            [&](std::size_t i, NumberedAddress& out) {
                out.face = chunk[i].face;
                out.number = static_cast<Index>(i);
                out.u = chunk[i].u;
                out.v = chunk[i].v;
            });
        if (shift_ == 0)
            return f(groups_.all());
        for (Index g = 0; g < n_groups_; ++g) {
            const auto group = groups_.of_key(g);
            if (group.empty())
                continue;
            // No more keys than a few for each address.
            int rough = 0;
            while ((std::size_t(1) << (shift_ - rough)) > 8 * group.size())
                ++rough;
            const Index in_group = (Index(1) << shift_) - 1;
            faces_.sort(
                group.size(), std::size_t(1) << (shift_ - rough),
                [&](std::size_t i) { return (face(group[i]) & in_group) >> rough; },
                [&](std::size_t i, NumberedAddress& out) { out = group[i]; });
            f(faces_.all());
        }
    }

private:
    static constexpr Index kFewFaces = 4096, kMostGroups = 128;

    Index last_face_;
    int shift_;  // 2^shift_ faces are a group
    Index n_groups_;
    CountingSort groups_, faces_;
};

/// Asks in time for what is read or written next and may lie anywhere.
template <class T>
void prefetch(const T* begin, std::size_t n = 1) {
#if defined(__GNUC__)
    __builtin_prefetch(begin);
    __builtin_prefetch(reinterpret_cast<const char*>(begin + n) - 1);
#endif
}

}  // namespace

template <class T>
AddressReport evaluate_addresses(const Evaluator& evaluator, std::span<const T> values,
                                 int n_channels, std::span<const Address> where,
                                 int order, Chart chart, Channels<T> out) {
    assert(out.n == n_derivatives(order) * n_channels);
    // A chunk with its results may stay in the last cache; some for each thread, no more than
    // that, so that patches have many addresses. Results do not depend on what is evaluated
    // at once.
    constexpr std::size_t kLeast = std::size_t(1) << 12, kMost = std::size_t(1) << 20;
    const std::size_t n_threads = detail::n_threads();
    const std::size_t chunk = std::clamp(
        where.size() / (n_threads == 1 ? 1 : 2 * n_threads) + 1, kLeast, kMost);
    const PatchTable& table = evaluator.table();
    struct Thread {
        FaceOrder faces;
        detail::LeafRuns runs;
    };
    detail::PerThread<Thread> threads([&] {
        return Thread{FaceOrder(table.base().n_faces()), detail::LeafRuns(table)};
    });
    AddressCounts counts;
    detail::for_each_chunk(
        where.size(), chunk, [&](std::size_t, std::size_t begin, std::size_t end) {
            Thread& thread = threads.local();
            const Channels<T> rows{out[begin], out.stride, out.n};
            std::size_t n_clamped = 0, n_without = 0, first_without = SIZE_MAX;
            const auto evaluate = [&](std::span<const NumberedAddress> sorted) {
                for (std::size_t k = 0; k < sorted.size();) {
                    const Index face = sorted[k].face;
                    const bool has_surface =
                        face < table.base().n_faces() && table.has_surface(face);
                    if (has_surface)
                        thread.runs.start(face);
                    std::size_t n = 0;
                    for (; k < sorted.size() && n < detail::LeafRuns::kMost; ++k) {
                        const NumberedAddress& at = sorted[k];
                        if (at.face != face)
                            break;
                        if (!has_surface || std::isnan(at.u) || std::isnan(at.v)) {
                            std::fill_n(rows[at.number], out.n,
                                        std::numeric_limits<T>::quiet_NaN());
                            ++n_without;
                            first_without =
                                std::min<std::size_t>(first_without, begin + at.number);
                            continue;
                        }
                        prefetch(rows[at.number], out.n);
                        n_clamped += thread.runs.add({face, at.u, at.v}, at.number);
                        ++n;
                    }
                    if (n == 0)
                        continue;
                    const auto runs = thread.runs.runs();
                    const auto points = [&](std::size_t r) {
                        return table.patch(runs[r].places.patch).points;
                    };
                    for (std::size_t r = 0; r < runs.size(); ++r) {
                        if (r + 2 < runs.size())
                            prefetch(points(r + 2).data(), points(r + 2).size());
                        if (r + 1 < runs.size()) {
                            for (const Index p : points(r + 1))
                                prefetch(&values[std::size_t(p) * n_channels],
                                         n_channels);
                        }
                        evaluator.evaluate_many_channels<T>(values, n_channels,
                                                            runs[r].places, order, chart,
                                                            rows, runs[r].numbers);
                    }
                }
            };
            thread.faces.for_each_group(where.subspan(begin, end - begin), evaluate);
            counts.add(n_clamped, n_without, first_without);
        });
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
