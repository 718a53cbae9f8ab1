// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/refine/grids/odd_grids.h"

#include <algorithm>
#include <cassert>
#include <utility>

#include <osdx/buffer.h>

#include "far/mesh/topology_edits.h"
#include "far/refine/grids/grid_steps.h"

namespace osdx::inline OSDX_ABI {
namespace {

bool is_of_quads(const Topology& t) {
    for (Index f = 0; f < t.n_faces(); ++f) {
        if (t.face_size(f) != 4)
            return false;
    }
    return true;
}

}  // namespace

OddGrids::OddGrids(Topology base, int degree, int n_levels, const Features& features)
    : degree_(degree),
      n_levels_(n_levels),
      roots_(std::move(base)),
      features_(resolve(roots_, features)),
      sharpness_(roots_, features_) {
    assert(degree % 2 == 1 && degree >= kMinDegree && degree <= kMaxDegree);
    for (int l = 0; l < n_levels; ++l) {
        rules_.push_back(sharpness_.step(grids()));
        if (l > 0 || is_of_quads(roots_)) {
            size_ *= 2;
            continue;
        }
        polygons_ = std::move(roots_);
        roots_ = split(*polygons_);
        rules_after_polygons_ = detail::rules_after_split(rules_[0], *polygons_);
        sharpness_.split_edges(*polygons_, roots_);
        if (!features_.hole.empty()) {
            std::vector<bool> hole;
            for (Index h = 0; h < polygons_->n_halfedges(); ++h)
                hole.push_back(features_.hole[polygons_->face(h)]);
            features_.hole = std::move(hole);
        }
    }
    features_.edge_sharpness.clear();
    features_.vertex_sharpness.clear();
}

ResolvedFeatures OddGrids::features() const {
    ResolvedFeatures f = features_;
    sharpness_.write(grids(), f);
    if (!f.hole.empty()) {
        f.hole.clear();
        for (Index face = 0; face < grids().n_faces(); ++face)
            f.hole.push_back(features_.hole[grids().root_of_face(face)]);
    }
    return f;
}

std::vector<Tag> OddGrids::tags() const {
    return to_tags(to_topology(grids()), features());
}

Index OddGrids::n_border_edges() const {
    return size_ * static_cast<Index>(std::ranges::count(roots_.twin, kInvalidIndex));
}

void OddGrids::faces(std::span<Index> sizes, std::span<Index> vertices) const {
    assert(sizes.size() == n_faces());
    for (Index f = 0; f < n_faces(); ++f)
        sizes[f] = size_ == 1 ? roots_.face_size(f) : 4;
    face_vertices(grids(), vertices);
}

void OddGrids::parents(std::span<Index> parents) const {
    assert(parents.size() == n_faces());
    const Index n = size_ * size_;  // of each root
    for (Index f = 0; f < n_faces(); ++f)
        parents[f] = polygons_ ? polygons_->face(f / n) : f / n;
}

Address OddGrids::address(Index root, double x, double y) const noexcept {
    if (polygons_)
        return to_address(*polygons_, {root, x, y});
    return {root, x, y};
}

template <class V>
void OddGrids::points(std::span<const V> base, std::span<V> out) const {
    using T = typename V::value_type;
    constexpr int C = V::length();
    static_assert(sizeof(V) == C * sizeof(T));
    assert(base.size() == n_base_points() && out.size() == n_vertices());
    if (n_levels_ == 0 || out.empty()) {
        std::ranges::copy(base, out.begin());
        return;
    }
    // Passes write in turns to `out` and to another array, to `out` at last.
    const int n_smoothings = (degree_ - 3) / 2;
    int passes_left = n_levels_ * (1 + n_smoothings);
    std::size_t n_other = 0;
    if (n_smoothings > 0)
        n_other = grids().n_vertices();
    else if (n_levels_ > 1)
        n_other = QuadGrids{roots_, size_ / 2}.n_vertices();
    Buffer<T> other(C * n_other);
    const T* from = &base.data()->x;
    const auto target = [&] {
        return --passes_left % 2 == 0 ? &out.data()->x : other.data();
    };
    QuadGrids level = {roots_, 1};
    for (int l = 0; l < n_levels_; ++l) {
        T* to = target();
        const bool of_polygons = l == 0 && polygons_;
        if (of_polygons) {
            detail::refine_grids<T, C>({*polygons_, 1}, rules_[l], from, to);
        } else {
            detail::refine_grids<T, C>(level, rules_[l], from, to);
            level.size *= 2;
        }
        from = to;
        for (int i = 0; i < n_smoothings; ++i) {
            to = target();
            detail::smooth_grids<T, C>(
                level, of_polygons ? rules_after_polygons_ : rules_[l], from, to);
            from = to;
        }
    }
}

template void OddGrids::points(std::span<const Vec2<float>>,
                               std::span<Vec2<float>>) const;
template void OddGrids::points(std::span<const Vec3<float>>,
                               std::span<Vec3<float>>) const;
template void OddGrids::points(std::span<const Vec2<double>>,
                               std::span<Vec2<double>>) const;
template void OddGrids::points(std::span<const Vec3<double>>,
                               std::span<Vec3<double>>) const;

}  // namespace osdx::inline OSDX_ABI
