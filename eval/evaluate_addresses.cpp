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

#include "eval/address_counts.h"
#include "far/parallel.h"
#include "far/refine/stencil_rows.h"

namespace osdx::inline OSDX_ABI {
namespace {

using detail::AddressCounts, detail::was_clamped;

/// The addresses of a chunk in the order of their faces, roughly where there are many.
class FaceOrder {
public:
    explicit FaceOrder(Index n_faces)
        : n_keys_(std::min<std::uint64_t>(n_faces, kMostKeys)),
          keys_of_face_((n_keys_ << 32) / n_faces),
          next_(n_keys_) {}

    std::span<const std::size_t> sort(std::span<const Address> where, std::size_t begin,
                                      std::size_t end) {
        std::ranges::fill(next_, Index(0));
        for (std::size_t i = begin; i < end; ++i)
            ++next_[key(where[i])];
        Index sum = 0;
        for (Index& n : next_)
            sum += std::exchange(n, sum);
        order_.resize(end - begin);
        for (std::size_t i = begin; i < end; ++i)
            order_[next_[key(where[i])]++] = i;
        return order_;
    }

private:
    static constexpr std::uint64_t kMostKeys = std::uint64_t(1) << 14;

    std::size_t key(const Address& at) const {
        return std::min(at.face * keys_of_face_ >> 32, n_keys_ - 1);
    }

    std::uint64_t n_keys_, keys_of_face_;
    std::vector<Index> next_;
    std::vector<std::size_t> order_;
};

/// Asks in time for what is read or written next and may lie anywhere.
template <class T>
void prefetch(const T* begin, std::size_t n = 1) {
#if defined(__GNUC__)
    __builtin_prefetch(begin);
    __builtin_prefetch(reinterpret_cast<const char*>(begin + n) - 1);
#endif
}

/// Some addresses by patches. One for each thread, used again and again.
class Groups {
public:
    /// \param which  of the addresses
    void collect(const PatchTable& table, std::span<const Address> where,
                 std::span<const std::size_t> which, AddressCounts& counts) {
        places_.clear();
        groups_.clear();
        without_.clear();
        slots_.assign(std::bit_ceil(2 * which.size()), kInvalidIndex);
        std::size_t n_clamped = 0, first_without = SIZE_MAX;
        for (std::size_t k = 0; k < which.size(); ++k) {
            if (k + kAhead < which.size())
                prefetch(&where[which[k + kAhead]]);
            const std::size_t i = which[k];
            const Address& at = where[i];
            if (!table.has_point(at)) {
                without_.push_back(i);
                first_without = std::min(first_without, i);
                continue;
            }
            const QuarterPoint q = to_quarter(table.base(), at);
            n_clamped += was_clamped(table.base(), at, q);
            const PatchPoint point = table.locate(q);
            const Index g = group(point.patch);
            ++groups_[g].n;
            places_.push_back({point, i, g});
        }
        if (n_clamped > 0 || !without_.empty())
            counts.add(n_clamped, without_.size(), first_without);
        Index first = 0;
        for (Group& g : groups_) {
            g.next = first;
            first += g.n;
        }
        points_.resize(places_.size());
        addresses_.resize(places_.size());
        for (const Place& p : places_) {
            const Index k = groups_[p.group].next++;
            points_[k] = p.point;
            addresses_[k] = p.address;
        }
    }

    std::span<const std::size_t> without_point() const { return without_; }

    /// Calls f(places, their addresses) for each patch.
    template <class F>
    void for_each(F&& f) const {
        for (const Group& g : groups_)
            f(std::span(points_).subspan(g.next - g.n, g.n),
              std::span(addresses_).subspan(g.next - g.n, g.n));
    }

private:
    static constexpr std::size_t kAhead = 16;

    struct Place {
        PatchPoint point;
        std::size_t address;
        Index group;
    };
    struct Group {
        Index patch;
        Index n = 0, next = 0;
    };

    /// By open addressing.
    Index group(Index patch) {
        const std::size_t mask = slots_.size() - 1;
        std::size_t slot = (patch * std::uint32_t(0x9e3779b9u)) & mask;
        while (slots_[slot] != kInvalidIndex && groups_[slots_[slot]].patch != patch)
            slot = (slot + 1) & mask;
        if (slots_[slot] == kInvalidIndex) {
            slots_[slot] = static_cast<Index>(groups_.size());
            groups_.push_back({patch});
        }
        return slots_[slot];
    }

    std::vector<Place> places_;
    std::vector<Group> groups_;
    std::vector<Index> slots_;
    std::vector<std::size_t> without_, addresses_;
    std::vector<PatchPoint> points_;
};

}  // namespace

template <class T>
AddressReport evaluate_addresses(const Evaluator& evaluator, std::span<const T> values,
                                 int n_channels, std::span<const Address> where,
                                 int order, Chart chart, Channels<T> out) {
    assert(out.n == n_derivatives(order) * n_channels);
    // A chunk with its results may stay in the last cache, a part of it in the second.
    constexpr std::size_t kChunk = std::size_t(1) << 17, kPart = 2048;
    const PatchTable& table = evaluator.table();
    struct Thread {
        FaceOrder faces;
        Groups groups = {};
        std::vector<T*> targets = {};
    };
    detail::PerThread<Thread> threads(
        [&] { return Thread{FaceOrder(table.base().n_faces())}; });
    AddressCounts counts;
    detail::for_each_chunk(
        where.size(), kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
            Thread& thread = threads.local();
            Groups& groups = thread.groups;
            std::vector<T*>& targets = thread.targets;
            const std::span<const std::size_t> sorted =
                thread.faces.sort(where, begin, end);
            for (std::size_t first = 0; first < sorted.size(); first += kPart) {
                groups.collect(
                    table, where,
                    sorted.subspan(first, std::min(kPart, sorted.size() - first)),
                    counts);
                for (const std::size_t i : groups.without_point())
                    std::fill_n(out[i], out.n, std::numeric_limits<T>::quiet_NaN());
                groups.for_each([&](std::span<const PatchPoint> points,
                                    std::span<const std::size_t> addresses) {
                    targets.clear();
                    for (const std::size_t i : addresses)
                        targets.push_back(out[i]);
                    evaluator.evaluate_many_channels<T>(values, n_channels, points, order,
                                                        chart, targets);
                });
            }
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
