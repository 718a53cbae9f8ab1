// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <cmath>
#include <numbers>

#include <osdx/analysis/continuity.h>
#include <osdx/evaluator.h>
#include <osdx/patch_table.h>
#include <osdx/resolved_features.h>
#include <osdx/topology.h>

#include "far/parallel.h"

namespace osdx::inline OSDX_ABI {
namespace {

double principal(const Curvature<double>& c) {
    return std::abs(c.mean) + std::sqrt(std::max(0.0, c.mean * c.mean - c.gauss));
}

/// A half turn where one side alone has no normal.
double normal_angle(const Vec3<double>& a, const Vec3<double>& b) {
    const Vec3<double> none(0);
    if ((a == none) != (b == none))
        return std::numbers::pi;
    return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

/// Largest values first met; in lengths of the mesh until the end.
struct Jumps {
    double gap = 0, angle = 0, mean = 0, gauss = 0, principal = 0;
    double sharp_angle = 0;
    std::size_t n = 0, n_sharp = 0;
    QuarterPoint at_gap, at_angle, at_mean, at_gauss, at_sharp_angle;

    void add(const SurfaceJet<double>& a, const SurfaceJet<double>& b,
             const QuarterPoint& where, bool is_sharp) {
        ++n;
        raise(gap, glm::length(a.p - b.p), at_gap, where);
        const double phi = normal_angle(normal(a), normal(b));
        if (is_sharp) {
            ++n_sharp;
            raise(sharp_angle, phi, at_sharp_angle, where);
            return;
        }
        raise(angle, phi, at_angle, where);
        const auto ca = curvature(a), cb = curvature(b);
        raise(mean, std::abs(ca.mean - cb.mean), at_mean, where);
        raise(gauss, std::abs(ca.gauss - cb.gauss), at_gauss, where);
        principal = std::max({principal, osdx::principal(ca), osdx::principal(cb)});
    }
    void merge(const Jumps& o) {
        n += o.n;
        n_sharp += o.n_sharp;
        raise(sharp_angle, o.sharp_angle, at_sharp_angle, o.at_sharp_angle);
        raise(gap, o.gap, at_gap, o.at_gap);
        raise(angle, o.angle, at_angle, o.at_angle);
        raise(mean, o.mean, at_mean, o.at_mean);
        raise(gauss, o.gauss, at_gauss, o.at_gauss);
        principal = std::max(principal, o.principal);
    }
    // A value that is not a number counts as the worst.
    static void raise(double& max, double value, QuarterPoint& at,
                      const QuarterPoint& where) {
        if (value > max || std::isnan(value)) {
            max = value;
            at = where;
        }
    }
};

/// The point of a cell at (x, y) of its frame.
Vec2<double> cell_point(const Cell& cell, double x, double y) {
    return cell.origin + x * cell.x_axis + y * turn(cell.x_axis, 1);
}

/// \param exponent  lengths are measured in units of 2 to this power
void measure_cell(const Surface& surface, const Cell& cell, int rate, int exponent,
                  Jumps& jumps) {
    const PatchTable& table = surface.patches();
    const Topology& base = surface.base();
    const auto jet = [&](const PatchPoint& p) {
        return detail::in_units(
            surface.evaluator().evaluate<double>(surface.points(), p, Chart::Native),
            exponent);
    };
    for (int side = 0; side < 4; ++side) {
        const Vec2<double> from = square_corner<double>(side),
                           to = square_corner<double>((side + 1) & 3);
        const Vec2<double> along = turn(cell.x_axis, side), out = turn(along, 3);
        for (int i = 0; i <= rate; ++i) {
            const double t = double(i) / rate;
            const Vec2<double> q = cell_point(cell, from.x + t * (to.x - from.x),
                                              from.y + t * (to.y - from.y));
            const QuarterPoint here{cell.quarter, q.x, q.y};
            QuarterPoint there = here;
            // Beyond the side, and towards its middle where the side's ends touch others.
            const Vec2<double> inwards = (t < 0.5 ? 0.5 : -0.5) * along;
            Vec2<double> towards = out + inwards;
            int quarter_side = -1;
            if (out.y < 0 && q.y == 0)
                quarter_side = 0;
            else if (out.x > 0 && q.x == 1)
                quarter_side = 1;
            else if (out.y > 0 && q.y == 1)
                quarter_side = 2;
            else if (out.x < 0 && q.x == 0)
                quarter_side = 3;
            bool is_sharp = false;
            if (quarter_side >= 0) {
                there = cross_side(base, here, quarter_side);
                if (there.quarter == kInvalidIndex ||
                    !table.has_surface(base.face(there.quarter)))
                    break;
                const Index h = halfedge_of_side(base, here.quarter, quarter_side);
                is_sharp = h != kInvalidIndex &&
                           is_infinitely_sharp(surface.features().edge(base.edge[h]));
                // Crossing side 0 or 2 turns the frame by +90 degrees, 1 or 3 by -90.
                towards = turn(towards, quarter_side % 2 == 0 ? 1 : 3);
            }
            const PatchPoint a = table.locate(here, inwards - out),
                             b = table.locate(there, towards);
            if (a.patch == b.patch && quarter_side < 0)
                break;  // an inner side
            if (a.patch == b.patch)
                continue;
            jumps.add(jet(a), jet(b), here, is_sharp);
        }
    }
}

}  // namespace

Continuity measure_continuity(const Surface& surface, int rate) {
    // In units of a power of two near the diagonal: fourth powers of lengths are numbers then.
    const double length =
        bounding_diagonal(surface.points().first(surface.base().n_vertices()));
    const int exponent = length > 0 ? std::ilogb(length) : 0;
    const double diagonal = length > 0 ? std::ldexp(length, -exponent) : 1;
    const std::vector<Cell> cells = surface.patches().cells();
    detail::Steps steps(cells.size());
    const Jumps jumps = detail::sum_over<Jumps>(
        cells.size(), 64, [&](std::size_t begin, std::size_t end, Jumps& sums) {
            for (std::size_t i = begin; i < end; ++i) {
                if (surface.patches().has_surface(surface.base().face(cells[i].quarter)))
                    measure_cell(surface, cells[i], rate, exponent, sums);
            }
            steps.add(end - begin);
        });

    Continuity c;
    c.n_samples = jumps.n;
    c.n_sharp_samples = jumps.n_sharp;
    c.gap_max = jumps.gap / diagonal;
    c.sharp_normal_jump_deg_max = jumps.sharp_angle * 180 / std::numbers::pi;
    c.normal_jump_deg_max = jumps.angle * 180 / std::numbers::pi;
    c.curvature_max = jumps.principal * diagonal;
    c.worst_gap = jumps.at_gap;
    c.worst_normal = jumps.at_angle;
    c.worst_sharp_normal = jumps.at_sharp_angle;
    if (jumps.principal > 0) {
        // A radius of a million diagonals is flat: smaller curvatures are rounding.
        const double scale = std::max(jumps.principal, 1e-6 / diagonal);
        const double mean = jumps.mean / scale, gauss = jumps.gauss / (scale * scale);
        c.curvature_jump_max = std::max(mean, gauss);
        c.worst_curvature = mean > gauss ? jumps.at_mean : jumps.at_gauss;
    }
    return c;
}

Result<Continuity> measure_continuity(const Surface& surface, int rate,
                                      Progress& progress) {
    return detail::cancellable(&progress, [&]() -> Result<Continuity> {
        detail::at_stage("measuring continuity", 0, 1);
        return measure_continuity(surface, rate);
    });
}

}  // namespace osdx::inline OSDX_ABI
