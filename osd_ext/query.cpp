// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include <osdx/query.h>
#include <osdx/surface_function.h>

#include "eval/turn.h"

namespace osdx::inline OSDX_ABI {
namespace {

/// Derivatives in the (x, y) of a quarter from those in the (u, v) of its face.
SurfaceJet<double> to_quarter_chart(const SurfaceJet<double>& s, int turns) {
    // (u, v) turned by `turns` and doubled is (x, y).
    const auto back = detail::ChartTurn::quarters(-turns, 0.5);
    Vec3<double> d[] = {s.p, s.du, s.dv, s.duu, s.duv, s.dvv};
    detail::turn_derivatives<2>(back.cos, back.sin, d);
    return {d[0], d[1], d[2], d[3], d[4], d[5]};
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

}  // namespace

ClosestPoint closest_point(const Topology& base, const ResolvedFeatures& features,
                           const SurfaceFunction& surface, const Vec3<double>& target,
                           const QuarterPoint& start, double tolerance,
                           AtCrease at_crease) {
    constexpr int kMaxSteps = 40;  // a few Newton steps and as many crossings
    const auto is_sharp = [&](Index quarter, int side) {
        const Index h = halfedge_of_side(base, quarter, side);
        return h != kInvalidIndex && is_infinitely_sharp(features.edge(base.edge[h]));
    };
    const auto is_wall = [&](Index quarter, int side) {
        const Index h = halfedge_of_side(base, quarter, side);
        if (h == kInvalidIndex)
            return false;
        return base.is_border(h) || features.is_hole(base.face(base.twin[h])) ||
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

RayPoint intersect_ray(const Topology& base, const SurfaceFunction& surface,
                       const Vec3<double>& origin, const Vec3<double>& direction,
                       const Address& start, double tolerance, int max_steps) {
    const auto offset = [&](const RayPoint& p) {
        return p.jet.p - origin - p.t * direction;
    };
    const auto evaluate = [&](const Address& a) {
        RayPoint p;
        p.at = to_quarter(base, a);
        p.jet = surface(p.at);
        p.t = glm::dot(p.jet.p - origin, direction);
        p.distance = glm::length(offset(p));
        return p;
    };
    Address at = start;
    RayPoint best = evaluate(at);
    for (int step = 0; step < max_steps && best.distance > tolerance; ++step) {
        // off + du a + dv b + direction c = 0.
        const Vec3<double>&u = best.jet.du, &v = best.jet.dv;
        const Vec3<double> off = offset(best);
        const double det = glm::dot(glm::cross(u, v), direction);
        at.u -= glm::dot(glm::cross(off, v), direction) / det;
        at.v -= glm::dot(glm::cross(u, off), direction) / det;
        if (!std::isfinite(at.u) || !std::isfinite(at.v))
            break;
        const RayPoint next = evaluate(at);
        if (!(next.distance < best.distance))
            break;
        best = next;
    }
    return best;
}

}  // namespace osdx::inline OSDX_ABI
