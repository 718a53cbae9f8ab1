// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include <fmt/format.h>

#include <osdx/analysis/comparison.h>
#include <osdx/embree/ray_scene.h>
#include <osdx/opensubdiv/limit_surface.h>
#include <osdx/query.h>
#include <osdx/surface_function.h>
#include <osdx/tessellate.h>

#include "far/parallel.h"

namespace osdx::inline OSDX_ABI {
namespace {

struct Sums {
    double max = 0, normal_max = 0;
    double area = 0, squares = 0, normal_area = 0, normal_squares = 0;
    std::size_t n = 0;

    void merge(const Sums& o) {
        max = std::max(max, o.max);
        normal_max = std::max(normal_max, o.normal_max);
        area += o.area;
        squares += o.squares;
        normal_area += o.normal_area;
        normal_squares += o.normal_squares;
        n += o.n;
    }
};

/// Per face: whether an infinitely sharp crease touches it. Borders are none.
std::vector<bool> faces_at_creases(const Topology& base,
                                   const ResolvedFeatures& features) {
    std::vector<bool> faces(base.n_faces(), false);
    for (Index h = 0; h < base.n_halfedges(); ++h) {
        if (base.is_border(h) || !is_infinitely_sharp(features.edge(base.edge[h])))
            continue;
        base.for_each_outgoing(base.vertex[h],
                               [&](Index out) { faces[base.face(out)] = true; });
    }
    return faces;
}

double angle(const Vec3<double>& a, const Vec3<double>& b) {
    return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

/// The normal; zero where rounding has a part in it, as at smooth corners of the border,
/// where du and dv are parallel.
Vec3<double> clear_normal(const SurfaceJet<double>& s) {
    const Vec3<double> n = glm::cross(s.du, s.dv);
    // Derivatives are right to some 100 ulps: the angle then to 1e-5.
    if (!(glm::length(n) > 1e-9 * glm::length(s.du) * glm::length(s.dv)))
        return Vec3<double>(0);
    return normal(s);
}

/// Whether the normals say that these are points of two sheets of the surface that lie close by
/// each other.
bool look_apart(const SurfaceJet<double>& a, const SurfaceJet<double>& b) {
    return glm::dot(clear_normal(a), clear_normal(b)) < 0;
}

/// In units of a power of two, so that squares of lengths are numbers and all that is measured
/// is the same to the bit.
SurfaceFunction in_units(const SurfaceFunction& surface, int exponent) {
    return [&surface, exponent](const QuarterPoint& q) {
        return detail::in_units(surface(q), exponent);
    };
}

/// Samples (m + 1)^2 points of each quarter, with the weights of the trapezoidal rule.
Result<Sums> measure_one_way(const Topology& base, const ResolvedFeatures& features,
                             const SurfaceFunction& from, const SurfaceFunction& to,
                             int rate, double unit) {
    std::optional<TessellatedScene> scene;
    Result<TessellatedScene> built =
        TessellatedScene::build(tessellate(base, features, rate, to));
    if (built)
        scene.emplace(std::move(*built));
    else if (built.error().code != ErrorCode::NotBuilt)
        return built.error();

    const int m = rate / 2;
    const double tolerance = 1e-12 * unit;
    const std::vector<bool> at_crease = faces_at_creases(base, features);
    const auto measure_sample = [&](const QuarterPoint& q, double share, Sums& sums) {
        const SurfaceJet<double> s = from(q);
        const auto closest = [&](const QuarterPoint& start, AtCrease rule) {
            return closest_point(base, features, to, s.p, start, tolerance, rule);
        };
        const ClosestPoint same = closest(q, AtCrease::Cross);
        ClosestPoint best = same;
        const auto hit = scene ? scene->rays().nearest(s.p) : std::nullopt;
        if (hit) {
            const QuarterPoint start = to_quarter(base, scene->address(*hit));
            const ClosestPoint other = closest(start, AtCrease::Cross);
            if (other.distance < best.distance && !look_apart(s, other.jet))
                best = other;
        }
        const double weight = share * glm::length(glm::cross(s.du, s.dv));
        sums.max = std::max(sums.max, best.distance);
        sums.area += weight;
        sums.squares += weight * best.distance * best.distance;
        ++sums.n;

        const bool one_side = at_crease[base.face(q.quarter)];
        const Vec3<double> none(0),
            a = clear_normal(s),
            b = clear_normal(one_side ? closest(q, AtCrease::Stop).jet : best.jet);
        if (a == none || b == none)
            return;
        const double phi = angle(a, b);
        sums.normal_max = std::max(sums.normal_max, phi);
        sums.normal_area += weight;
        sums.normal_squares += weight * phi * phi;
    };
    const auto measure_quarter = [&](Index quarter, Sums& sums) {
        for (int j = 0; j <= m; ++j) {
            for (int i = 0; i <= m; ++i) {
                const double share = (i % m == 0 ? 0.5 : 1.0) * (j % m == 0 ? 0.5 : 1.0);
                measure_sample({quarter, double(i) / m, double(j) / m}, share, sums);
            }
        }
    };
    detail::Steps steps(base.n_halfedges());
    return detail::sum_over<Sums>(base.n_halfedges(), 16,
                                  [&](Index begin, Index end, Sums& sums) {
                                      for (Index q = begin; q < end; ++q) {
                                          if (!features.is_hole(base.face(q)))
                                              measure_quarter(q, sums);
                                      }
                                      steps.add(end - begin);
                                  });
}

/// 0 for no samples.
double root_mean(double squares, double area) {
    return area > 0 ? std::sqrt(squares / area) : 0;
}

}  // namespace

Result<SurfaceDistance> measure_distance(const Topology& base,
                                         const ResolvedFeatures& features,
                                         const SurfaceFunction& from,
                                         const SurfaceFunction& to, int rate, double unit,
                                         Progress* progress) {
    if (!(unit >= 0) || !std::isfinite(unit)) {
        return fail(ErrorCode::InvalidOption,
                    fmt::format("distances were to be measured in units of {}", unit));
    }
    return detail::cancellable(progress, [&]() -> Result<SurfaceDistance> {
        const int exponent = unit > 0 ? std::ilogb(unit) : 0;
        // Of a mesh without size all distances are those of rounding, in lengths of the mesh.
        const double scaled_unit = unit > 0 ? std::ldexp(unit, -exponent) : 1;
        const SurfaceFunction a = in_units(from, exponent), b = in_units(to, exponent);
        detail::at_stage("measuring distances", 0, 0.5);
        const Result<Sums> there =
            measure_one_way(base, features, a, b, rate, scaled_unit);
        if (!there)
            return there.error();
        detail::at_stage("measuring distances back", 0.5, 1);
        const Result<Sums> back =
            measure_one_way(base, features, b, a, rate, scaled_unit);
        if (!back)
            return back.error();
        constexpr double kDegrees = 180 / std::numbers::pi;
        SurfaceDistance d;
        d.distance_max = std::max(there->max, back->max) / scaled_unit;
        d.distance_rms = root_mean(there->squares, there->area) / scaled_unit;
        d.normal_deg_max = std::max(there->normal_max, back->normal_max) * kDegrees;
        d.normal_deg_rms =
            root_mean(there->normal_squares, there->normal_area) * kDegrees;
        d.n_samples = there->n + back->n;
        return d;
    });
}

Result<double> isolation_error(const Topology& base, const Features& features,
                               std::span<const Vec3<double>> positions, int isolation,
                               double unit) {
    const int exponent = unit > 0 ? std::ilogb(unit) : 0;
    const double scaled_unit = unit > 0 ? std::ldexp(unit, -exponent) : 1;
    const Result<LimitSurface> a =
        LimitSurface::build(base, features, positions, isolation);
    if (!a)
        return a.error();
    const Result<LimitSurface> b =
        LimitSurface::build(base, features, positions, isolation + 2);
    if (!b)
        return b.error();
    const ResolvedFeatures resolved = resolve(base, features);
    // Towards the corner and towards the face centre, past the isolation: elsewhere, and on
    // the points themselves, both are exact.
    double worst = 0;
    const SurfaceFunction coarse_mesh = surface_function(base, *a),
                          fine_mesh = surface_function(base, *b),
                          coarse = in_units(coarse_mesh, exponent),
                          fine = in_units(fine_mesh, exponent);
    const auto sample = [&](const QuarterPoint& q) {
        const ClosestPoint there =
            closest_point(base, resolved, fine, coarse(q).p, q, 1e-12 * scaled_unit);
        worst = std::max(worst, there.distance);
    };
    for (Index quarter = 0; quarter < base.n_halfedges(); ++quarter) {
        if (resolved.is_hole(base.face(quarter)))
            continue;
        double r = 1;
        for (int k = 0; k < isolation + 4; ++k, r /= 2) {
            for (const Vec2<double>& d : {Vec2<double>(r, r), Vec2<double>(r, 0.4 * r),
                                          Vec2<double>(0.4 * r, r)}) {
                sample({quarter, d.x, d.y});
                sample({quarter, 1 - d.x, 1 - d.y});
            }
        }
    }
    return worst / scaled_unit;
}

}  // namespace osdx::inline OSDX_ABI
