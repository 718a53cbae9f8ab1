// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "eval/bases/ribbon.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

namespace osdx::inline OSDX_ABI {
namespace {

/// Bezier coefficients c_0 .. c_(2d-1) of the last piece of the extended function E_(d-1):
/// it continues N_(d-1) at d-2 with all derivatives below d and ends with a zero of order d.
/// c_i = sum of C(i,r) N^(r)(d-2) (2d-1-r)!/(2d-1)! over r <= i, for i < d.
std::array<double, 2 * kMaxDegree> extended_coefficients(int d) {
    std::array<double, 2 * kMaxDegree> c{};
    std::array<double, (kMaxDegree + 1) * kMaxDegree> taylor;
    // N_(d-1) at d-2: the function d-1-(d-2) = 1 of the interval that starts there.
    bspline_basis<double>(d, 0.0, d - 1,
                          std::span(taylor).first(static_cast<std::size_t>((d + 1) * d)));
    const double* n = taylor.data() + d;
    for (int i = 0; i < d; ++i) {
        double term = 1;  // C(i,r) r! (2d-1-r)!/(2d-1)!
        for (int r = 0; r <= i; ++r) {
            c[i] += term * n[r];
            term *= double(i - r) / double(2 * d - 1 - r);
        }
    }
    return c;
}

}  // namespace

RibbonBasis::RibbonBasis(const PatchClass& patch_class)
    : class_(patch_class),
      border_(patch_class),
      n_(patch_class.n_polygon()),
      d_(patch_class.degree) {
    const bool ev = class_.kind == PatchKind::EV;
    columns_ = ev ? 2 * d_ - 1 : 2 * d_;
    if (ev)
        extended_ = extended_coefficients(d_);
    build_tables();
    if (class_.border == PatchBorder::Spike) {
        std::vector<double> w(static_cast<std::size_t>(class_.n_points()), 0.0);
        const auto add = [&](Index i, const Jet<double, 0>& x) { w[i] += x.c[0]; };
        const Jet<double, 0> f = polygon_weights<0, double>(
            PolygonPoint<0>(border_.polygon(), {}, Chart::Native), expanded(0, add));
        for (double& x : w)
            x /= f.c[0];
        centre_weights_ = std::move(w);
    }
}

void RibbonBasis::build_tables() {
    const MirroredNet net(class_);
    const auto add = [&](const MirroredNet::Terms& terms) {
        term_offsets_.push_back(static_cast<Index>(terms_.size()));
        terms_.insert(terms_.end(), terms.begin(), terms.end());
    };
    n_parts_ = net.n_parts();
    for (int of = 0; of <= n_parts_; ++of) {
        for (int i = 0; i < n_; ++i) {
            for (int j = 0; j < columns_; ++j) {
                for (int k = 0; k < d_; ++k)
                    add(of == 0 ? net.ribbon_point(i, j, k)
                                : net.foot_point(of - 1, i, j, k));
            }
        }
    }
    for (int part = 0; part < n_parts_; ++part) {
        for (int j = 0; j < columns_; ++j)
            add(net.curve_point(part, j));
    }
    term_offsets_.push_back(static_cast<Index>(terms_.size()));
}

Vec2<double> RibbonBasis::quad_point(int sector, double a, double b) const noexcept {
    if (class_.is_single())
        return {a - b, a * b};
    return border_.polygon().sector_point({sector, a, b});
}

Vec2<double> RibbonBasis::to_native(const DomainPoint& p) const noexcept {
    const auto at = border_.place<0, double>(p);
    return quad_point(p.sector, at.a.c[0], at.b.c[0]);
}

/// The inverse of quad_point().
DomainPoint RibbonBasis::quad_place(const Vec2<double>& xy) const noexcept {
    if (class_.is_single()) {
        // (a - b, a b), so that a and -b are the roots of z^2 - x z - y.
        const double root = std::sqrt(std::max(0.0, xy.x * xy.x + 4 * xy.y));
        return {0, std::clamp((root + xy.x) / 2, 0.0, 1.0),
                std::clamp((root - xy.x) / 2, 0.0, 1.0)};
    }
    const Polygon& polygon = border_.polygon();
    const int sector = polygon.sector_of(xy);
    if (class_.is_open() && sector >= class_.n_sectors) {
        // Beyond a border: to the nearer of the two.
        const int k = class_.n_sectors;
        const double scale = 1 / polygon.centre_distance();
        const double first = glm::dot(xy, polygon.normal(0)) * scale,
                     last = glm::dot(xy, polygon.normal(k)) * scale;
        return first > last ? DomainPoint{0, std::clamp(first, 0.0, 1.0), 0}
                            : DomainPoint{k - 1, 0, std::clamp(last, 0.0, 1.0)};
    }
    return polygon.sector_place(sector, xy);
}

DomainPoint RibbonBasis::from_native(const Vec2<double>& xy) const noexcept {
    const DomainPoint goal = quad_place(xy);
    DomainPoint p = goal;
    // Beside a border (a, b) is moved: Newton's method for the point that moves there.
    for (int step = 0; class_.is_open() && step < 50; ++step) {
        const auto at = border_.place<1, double>(p);
        const double ea = goal.a - at.a.c[0], eb = goal.b - at.b.c[0];
        const double det = at.a.c[1] * at.b.c[2] - at.a.c[2] * at.b.c[1];
        const double da = (ea * at.b.c[2] - eb * at.a.c[2]) / det,
                     db = (eb * at.a.c[1] - ea * at.b.c[1]) / det;
        p.a = std::clamp(p.a + da, 0.0, 1.0);
        p.b = std::clamp(p.b + db, 0.0, 1.0);
        if (std::abs(da) + std::abs(db) < 1e-15)
            break;
    }
    return p;
}

RibbonBasis::SideParameters RibbonBasis::side_parameters(const DomainPoint& p) const {
    const auto at = border_.place<0, double>(p);
    const PolygonPoint<0> domain(border_.polygon(), p.sector, at.a, at.b, Chart::Native,
                                 true);
    SideParameters r;
    for (int i = 0; i < n_; ++i) {
        r.s.push_back(domain.s(i).c[0]);
        r.h.push_back(domain.h(i).c[0]);
    }
    return r;
}

}  // namespace osdx::inline OSDX_ABI
