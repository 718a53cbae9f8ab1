// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "osd_ext/comparison.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "osd_ext/ray_scene.h"

namespace osdx {
namespace {

/// Derivatives in the (x, y) of a quarter from those in the (u, v) of its face.
SurfaceJet<double> to_quarter_chart(const SurfaceJet<double>& s, int turns) {
    // (u, v) turned by `turns` and doubled is (x, y): du/dx = .5 cos, dv/dx = -.5 sin ...
    const double c = turns % 2 == 0 ? 0.5 - turns * 0.5 : 0.0;
    const double n = turns % 2 == 1 ? 1.0 - turns * 0.5 : 0.0;
    SurfaceJet<double> r;
    r.p = s.p;
    r.du = c * s.du - n * s.dv;
    r.dv = n * s.du + c * s.dv;
    r.duu = c * c * s.duu - 2 * c * n * s.duv + n * n * s.dvv;
    r.duv = c * n * s.duu + (c * c - n * n) * s.duv - c * n * s.dvv;
    r.dvv = n * n * s.duu + 2 * c * n * s.duv + c * c * s.dvv;
    return r;
}

/// Newton's step for the squared distance; Gauss-Newton's where the first has no minimum.
Vec2<double> distance_step(const SurfaceJet<double>& s, const Vec3<double>& r) {
    const double gx = glm::dot(s.du, r), gy = glm::dot(s.dv, r);
    for (const double second : {1.0, 0.0}) {
        const double a = glm::dot(s.du, s.du) + second * glm::dot(s.duu, r);
        const double b = glm::dot(s.du, s.dv) + second * glm::dot(s.duv, r);
        const double c = glm::dot(s.dv, s.dv) + second * glm::dot(s.dvv, r);
        const double det = a * c - b * b;
        if (a > 0 && det > 1e-12 * a * c)
            return {-(c * gx - b * gy) / det, -(a * gy - b * gx) / det};
    }
    return {0, 0};
}

/// The same along a side of the quarter.
Vec2<double> step_along(const SurfaceJet<double>& s, const Vec3<double>& r, int side) {
    const bool is_x = side % 2 == 0;
    const Vec3<double>& d = is_x ? s.du : s.dv;
    const double speed = glm::dot(d, d),
                 second = speed + glm::dot(is_x ? s.duu : s.dvv, r);
    if (!(speed > 0))
        return {0, 0};
    const double step = -glm::dot(d, r) / (second > 1e-12 * speed ? second : speed);
    return is_x ? Vec2<double>(step, 0) : Vec2<double>(0, step);
}

/// One step inside the closed unit square. \return the side that it would leave by, or -1.
int advance(QuarterPoint& q, const Vec2<double>& step) {
    double t = 1;
    int side = -1;
    const auto clip = [&](double room, double speed, int s) {
        if (speed > 0 && room < t * speed) {
            t = std::max(0.0, room) / speed;
            side = s;
        }
    };
    clip(q.y, -step.y, 0);
    clip(1 - q.x, step.x, 1);
    clip(1 - q.y, step.y, 2);
    clip(q.x, -step.x, 3);
    q.x = side == 1 ? 1 : side == 3 ? 0 : std::clamp(q.x + t * step.x, 0.0, 1.0);
    q.y = side == 2 ? 1 : side == 0 ? 0 : std::clamp(q.y + t * step.y, 0.0, 1.0);
    return side;
}

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

bool is_hole(const Features& features, Index face) {
    return !features.hole.empty() && features.hole[face];
}

/// Per face: whether an infinitely sharp crease touches it. Borders are none.
std::vector<bool> faces_at_creases(const Topology& base, const Features& features) {
    std::vector<bool> faces(base.n_faces(), false);
    for (Index h = 0; h < base.n_halfedges(); ++h) {
        if (base.is_border(h) || features.edge(base.edge[h]) < kInfinitelySharp)
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

/// Samples (m + 1)^2 points of each quarter, with the weights of the trapezoidal rule.
Result<Sums> measure_one_way(const Topology& base, const Features& features,
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
        ClosestPoint best = closest(q, AtCrease::Cross);
        if (scene) {
            const auto hit = scene->rays().nearest(Vec3<float>(s.p));
            const QuarterPoint start = to_quarter(base, scene->address(*hit));
            const ClosestPoint other = closest(start, AtCrease::Cross);
            if (other.distance < best.distance)
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
    return tbb::parallel_deterministic_reduce(
        tbb::blocked_range<Index>(0, base.n_halfedges(), 16), Sums{},
        [&](const auto& range, Sums sums) {
            for (Index q = range.begin(); q < range.end(); ++q) {
                if (!is_hole(features, base.face(q)))
                    measure_quarter(q, sums);
            }
            return sums;
        },
        [](Sums a, const Sums& b) {
            a.merge(b);
            return a;
        });
}

/// 0 for no samples.
double root_mean(double squares, double area) {
    return area > 0 ? std::sqrt(squares / area) : 0;
}

}  // namespace

ClosestPoint closest_point(const Topology& base, const Features& features,
                           const SurfaceFunction& surface, const Vec3<double>& target,
                           const QuarterPoint& start, double tolerance,
                           AtCrease at_crease) {
    constexpr int kMaxSteps = 40;  // a few Newton steps and as many crossings
    const auto is_sharp = [&](Index quarter, int side) {
        const Index h = halfedge_of_side(base, quarter, side);
        return h != kInvalidIndex && features.edge(base.edge[h]) >= kInfinitelySharp;
    };
    const auto is_wall = [&](Index quarter, int side) {
        const Index h = halfedge_of_side(base, quarter, side);
        if (h == kInvalidIndex)
            return false;
        return base.is_border(h) || is_hole(features, base.face(base.twin[h])) ||
               (at_crease == AtCrease::Stop && is_sharp(quarter, side));
    };
    ClosestPoint best;
    best.distance = INFINITY;
    QuarterPoint q = start;
    Index came_from = kInvalidIndex;
    int along = -1;  // the side that the next step keeps to
    for (int n = 0; n < kMaxSteps; ++n) {
        const SurfaceJet<double> jet = surface(q);
        const Vec3<double> r = jet.p - target;
        const double distance = glm::length(r);
        if (distance < best.distance)
            best = {q, jet, distance};
        const SurfaceJet<double> local =
            to_quarter_chart(jet, quarter_turns(base, q.quarter));
        // A wall holds the point where the distance falls towards it.
        const bool held_x =
                       q.x == 0 && glm::dot(local.du, r) > 0 && is_wall(q.quarter, 3),
                   held_y =
                       q.y == 0 && glm::dot(local.dv, r) > 0 && is_wall(q.quarter, 0);
        if (held_x && held_y)
            break;
        if (held_x || held_y)
            along = held_x ? 3 : 0;
        Vec2<double> step =
            along < 0 ? distance_step(local, r) : step_along(local, r, along);
        along = -1;
        if (glm::length(step.x * local.du + step.y * local.dv) <= tolerance)
            break;
        const double length = glm::length(step);
        if (length > 1)
            step /= length;
        const Vec2<double> before(q.x, q.y);
        const int side = advance(q, step);
        if (side < 0)
            continue;
        if (is_wall(q.quarter, side)) {
            if (q.x == before.x && q.y == before.y)
                along =
                    side;  // Newton's step leads out though the distance falls inwards
            continue;
        }
        const QuarterPoint there = cross_side(base, q, side);
        if (there.quarter != came_from) {
            came_from = q.quarter;
            q = there;
            continue;
        }
        // Back and forth: the minimum is on this side; go along it.
        came_from = kInvalidIndex;
        if (is_sharp(q.quarter, side)) {
            along = side;
        } else {
            (side % 2 == 0 ? step.y : step.x) = 0;
            advance(q, step);
        }
    }
    return best;
}

Result<SurfaceDistance> measure_distance(const Topology& base, const Features& features,
                                         const SurfaceFunction& from,
                                         const SurfaceFunction& to, int rate,
                                         double unit) {
    const Result<Sums> there = measure_one_way(base, features, from, to, rate, unit);
    if (!there)
        return there.error();
    const Result<Sums> back = measure_one_way(base, features, to, from, rate, unit);
    if (!back)
        return back.error();
    constexpr double kDegrees = 180 / std::numbers::pi;
    SurfaceDistance d;
    d.distance_max = std::max(there->max, back->max) / unit;
    d.distance_rms = root_mean(there->squares, there->area) / unit;
    d.normal_deg_max = std::max(there->normal_max, back->normal_max) * kDegrees;
    d.normal_deg_rms = root_mean(there->normal_squares, there->normal_area) * kDegrees;
    d.n_samples = there->n + back->n;
    return d;
}

Result<double> isolation_error(const Topology& base, const Features& features,
                               std::span<const Vec3<double>> positions, int isolation,
                               double unit) {
    const Result<LimitSurface> a =
        LimitSurface::build(base, features, positions, isolation);
    if (!a)
        return a.error();
    const Result<LimitSurface> b =
        LimitSurface::build(base, features, positions, isolation + 2);
    if (!b)
        return b.error();
    const Features bordered = with_border(base, features);
    // Towards the corner and towards the face centre, past the isolation: elsewhere, and on
    // the points themselves, both are exact.
    double worst = 0;
    const SurfaceFunction coarse = surface_function(base, *a),
                          fine = surface_function(base, *b);
    const auto sample = [&](const QuarterPoint& q) {
        const ClosestPoint there =
            closest_point(base, bordered, fine, coarse(q).p, q, 1e-12 * unit);
        worst = std::max(worst, there.distance);
    };
    for (Index quarter = 0; quarter < base.n_halfedges(); ++quarter) {
        if (is_hole(bordered, base.face(quarter)))
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
    return worst / unit;
}

SurfaceFunction surface_function(const Topology& base, const LimitSurface& limit) {
    return [&base, &limit](const QuarterPoint& q) {
        return limit.evaluate(to_address(base, q));
    };
}

}  // namespace osdx
