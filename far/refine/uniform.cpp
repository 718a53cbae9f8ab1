// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/refine/uniform.h"

#include <algorithm>
#include <cassert>
#include <utility>
#include <variant>

#include "far/refine/grids/even_grids.h"
#include "far/refine/grids/odd_grids.h"
#include "far/refine/refinement.h"

namespace osdx::inline OSDX_ABI {
namespace {

/// The last level of Refinement; from level 1 on without the vertices that no face uses.
class LastLevel {
public:
    LastLevel(Topology base, int degree, int n_levels, const Features& features)
        : refinement_(std::move(base), degree, features) {
        for (int i = 0; i < n_levels; ++i)
            refinement_.add_level();
        number_.assign(topology().n_vertices(), n_levels > 0 ? kInvalidIndex : 0);
        for (const Index v : topology().vertex)
            number_[v] = 0;
        for (Index& number : number_) {
            if (number != kInvalidIndex)
                number = n_vertices_++;
        }
    }

    Index n_base_points() const noexcept { return refinement_.n_base_points(); }
    Index n_vertices() const noexcept { return n_vertices_; }
    Index n_faces() const noexcept { return topology().n_faces(); }
    Index n_halfedges() const noexcept { return topology().n_halfedges(); }
    Index n_border_edges() const {
        return static_cast<Index>(std::ranges::count(topology().twin, kInvalidIndex));
    }

    void faces(std::span<Index> sizes, std::span<Index> vertices) const {
        for (Index f = 0; f < n_faces(); ++f)
            sizes[f] = topology().face_size(f);
        for (Index h = 0; h < n_halfedges(); ++h)
            vertices[h] = number_[topology().vertex[h]];
    }

    std::vector<Tag> tags() const { return to_tags(topology(), level().features); }

    template <class V>
    void points(std::span<const V> base, std::span<V> out) const {
        std::vector<V> in(base.begin(), base.end()), next;
        if (const auto& even = refinement_.level(0).even) {
            const std::vector<Index>& origins = even->base_vertices;
            in.resize(origins.size());
            std::ranges::transform(origins, in.begin(), [&](Index v) { return base[v]; });
        }
        for (int l = 1; l < refinement_.n_levels(); ++l) {
            for (const StencilTable& factor : refinement_.factors(l)) {
                next.resize(factor.n_rows());
                factor.apply(std::span<const V>(in), std::span(next));
                in.swap(next);
            }
        }
        for (Index v = 0; v < in.size(); ++v) {
            if (number_[v] != kInvalidIndex)
                out[number_[v]] = in[v];
        }
    }

private:
    const RefinedLevel& level() const noexcept {
        return refinement_.level(refinement_.n_levels() - 1);
    }
    const Topology& topology() const noexcept { return level().topology; }

    Refinement refinement_;
    std::vector<Index> number_;  ///< by vertex of the level
    Index n_vertices_ = 0;
};

using AnyEngine = std::variant<OddGrids, EvenGrids, LastLevel>;

AnyEngine make_engine(Topology base, int degree, int n_levels, const Features& features) {
    if (degree % 2 == 1)
        return OddGrids(std::move(base), degree, n_levels, features);
    if (n_levels > 0 && EvenGrids::takes(features))
        return EvenGrids(std::move(base), degree, n_levels, features);
    return LastLevel(std::move(base), degree, n_levels, features);
}

}  // namespace

struct UniformRefinement::Engine {
    AnyEngine any;

    template <class F>
    auto visit(F&& f) const {
        return std::visit(std::forward<F>(f), any);
    }
};

UniformRefinement::UniformRefinement(Topology base, int degree, int n_levels,
                                     const Features& features)
    : engine_(std::make_unique<const Engine>(
          Engine{make_engine(std::move(base), degree, n_levels, features)})) {}

UniformRefinement::UniformRefinement(UniformRefinement&&) noexcept = default;
UniformRefinement& UniformRefinement::operator=(UniformRefinement&&) noexcept = default;
UniformRefinement::~UniformRefinement() = default;

Index UniformRefinement::n_base_points() const {
    return engine_->visit([](const auto& e) { return e.n_base_points(); });
}

Index UniformRefinement::n_vertices() const {
    return engine_->visit([](const auto& e) { return e.n_vertices(); });
}

Index UniformRefinement::n_faces() const {
    return engine_->visit([](const auto& e) { return e.n_faces(); });
}

Index UniformRefinement::n_halfedges() const {
    return engine_->visit([](const auto& e) { return e.n_halfedges(); });
}

Index UniformRefinement::n_border_edges() const {
    return engine_->visit([](const auto& e) { return e.n_border_edges(); });
}

void UniformRefinement::faces(std::span<Index> sizes, std::span<Index> vertices) const {
    assert(sizes.size() == n_faces() && vertices.size() == n_halfedges());
    engine_->visit([&](const auto& e) { e.faces(sizes, vertices); });
}

std::vector<Tag> UniformRefinement::tags() const {
    return engine_->visit([](const auto& e) { return e.tags(); });
}

Index UniformRefinement::corner_of_split(Index halfedge) const {
    return std::get<OddGrids>(engine_->any).from_split(halfedge);
}

void UniformRefinement::parents(std::span<Index> parents) const {
    std::get<OddGrids>(engine_->any).parents(parents);
}

template <class V>
void UniformRefinement::points(std::span<const V> base, std::span<V> out) const {
    assert(base.size() == n_base_points() && out.size() == n_vertices());
    engine_->visit([&](const auto& e) { e.points(base, out); });
}

template void UniformRefinement::points(std::span<const Vec2<float>>,
                                        std::span<Vec2<float>>) const;
template void UniformRefinement::points(std::span<const Vec3<float>>,
                                        std::span<Vec3<float>>) const;
template void UniformRefinement::points(std::span<const Vec2<double>>,
                                        std::span<Vec2<double>>) const;
template void UniformRefinement::points(std::span<const Vec3<double>>,
                                        std::span<Vec3<double>>) const;

}  // namespace osdx::inline OSDX_ABI
