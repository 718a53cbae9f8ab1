// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <vector>

#include <osdx/place.h>
#include <osdx/types.h>

#include "eval/bases/jet.h"

namespace osdx::inline OSDX_ABI {

/// The regular n-gon with the vertices v_i = (cos 2 pi i/n, sin 2 pi i/n), the domain of
/// n-sided patches. Side k is the edge v_(k-1) v_k, and l_k is the distance to side k.
///
/// Sector i is the quad of the centre (a, b) = (0, 0), the middle of side i (1, 0), v_i (1, 1)
/// and the middle of side i+1 (0, 1), with the bilinear chart (a, b).
class Polygon {
public:
    explicit Polygon(int n);

    int n() const noexcept { return n_; }
    /// i modulo n. \pre -n <= i < 2 n
    int cyclic(int i) const noexcept { return i < 0 ? i + n_ : i >= n_ ? i - n_ : i; }

    /// l_k at v_i.
    double vertex_distance(int i, int k) const noexcept {
        return vertex_distance_[cyclic(cyclic(i) - k)];
    }
    /// l_k at the centre.
    double centre_distance() const noexcept { return centre_distance_; }
    /// The unit vector from the centre to side k.
    const Vec2<double>& normal(int k) const noexcept { return normals_[k]; }

    Vec2<double> sector_point(const DomainPoint& p) const noexcept;
    /// The sector that a point lies in.
    int sector_of(const Vec2<double>& xy) const noexcept;
    /// (a, b) of a point in a sector; points outside of it are moved to it.
    DomainPoint sector_place(int sector, const Vec2<double>& xy) const noexcept;

private:
    int n_;
    double centre_distance_;
    std::vector<double> vertex_distance_;  // m: of v_(k+m) to side k
    std::vector<Vec2<double>> normals_;
};

/// s_i and h_i of the sides of the n-gon at one point, as jets, from the distances to them:
///
///     s_i = l_(i-1) / (l_(i-1) + l_(i+1)),    h_i = sum of phi_j over j != i, i-1
///
/// with Wachspress' coordinates phi, both regular on the closed n-gon; but for n = 3 s_i has
/// no value at the corner across side i.
template <int Order, class Distances>
class PolygonSideParameters {
    using J = Jet<typename Distances::Scalar, Order>;

public:
    /// \param distances  distance(k) is l_k
    /// \param sector  that the point lies in
    PolygonSideParameters(const Distances& distances, int sector, int n) noexcept
        : distances_(distances), q_(sector), n_(n) {
        const J lq = distance(q_), lq1 = distance(q_ + 1);
        product_ = lq * lq1;
        J rest;
        for (int k = 2; k < n - 1; ++k)
            rest += wachspress(cyclic(q_ + k));
        const J before = wachspress(cyclic(q_ - 1)), after = wachspress(cyclic(q_ + 1));
        inverse_ = J(1.0) / (rest + before + J(1.0) + after);
        // Next to the sides at the corner h is a sum of positive terms, not 1 minus one.
        h_q_ = (rest + after) * inverse_;
        h_q1_ = (rest + before) * inverse_;
    }

    J distance(int k) const noexcept { return distances_.distance(cyclic(k)); }

    J s(int i) const noexcept {
        const J before = distance(i - 1);
        return before / (before + distance(i + 1));
    }

    J h(int i) const noexcept {
        if (i == q_)
            return h_q_;
        if (i == cyclic(q_ + 1))
            return h_q1_;
        return J(1.0) - (wachspress(i) + wachspress(cyclic(i - 1))) * inverse_;
    }

private:
    int cyclic(int i) const noexcept { return i < 0 ? i + n_ : i >= n_ ? i - n_ : i; }

    /// Weight i times l_q l_(q+1) / product of all l: no factor vanishes in the sector.
    J wachspress(int i) const noexcept {
        if (i == q_)
            return J(1.0);
        const int next = cyclic(i + 1);
        if (next == q_)
            return distance(q_ + 1) / distance(i);
        if (i == cyclic(q_ + 1))
            return distance(q_) / distance(next);
        return product_ / (distance(i) * distance(next));
    }

    const Distances& distances_;
    int q_, n_;
    J product_, inverse_, h_q_, h_q1_;
};

/// A point of the n-gon with the jets of the distances to its sides.
template <int Order, class T = double>
class PolygonDistances {
    using J = Jet<T, Order>;

public:
    using Scalar = T;

    /// At (a, b) as jets, which are asked for derivatives unless `plain` says that they are
    /// the variables themselves, or the chart is (x, y).
    PolygonDistances(const Polygon& polygon, int sector, const J& a, const J& b,
                     Chart chart, bool plain) noexcept
        : polygon_(polygon),
          sector_(sector),
          a_(a),
          b_(b),
          chart_(chart),
          plain_(plain || chart == Chart::Native) {}

    /// l_k, by its values at the corners of the sector's quad: exact 0 on side k.
    J distance(int k) const noexcept {
        const auto at = [&](int i) { return polygon_.vertex_distance(i, k); };
        const int q = sector_;
        const T centre = polygon_.centre_distance();
        const T left = 0.5 * (at(q - 1) + at(q)), corner = at(q),
                right = 0.5 * (at(q) + at(q + 1));
        if (!plain_) {
            const J one(1.0), ab = a_ * b_;
            return (one - a_ - b_ + ab) * centre + (a_ - ab) * left + ab * corner +
                   (b_ - ab) * right;
        }
        const T a = a_.c[0], b = b_.c[0];
        J l((1 - a) * (1 - b) * centre + a * (1 - b) * left + a * b * corner +
            (1 - a) * b * right);
        if constexpr (Order > 0) {
            if (chart_ == Chart::Native) {
                l.c[1] = -polygon_.normal(k).x;
                l.c[2] = -polygon_.normal(k).y;
            } else {
                l.c[1] = (1 - b) * (left - centre) + b * (corner - right);
                l.c[2] = (1 - a) * (right - centre) + a * (corner - left);
                if constexpr (Order > 1)
                    l.c[4] = centre - left + corner - right;
            }
        }
        return l;
    }

private:
    const Polygon& polygon_;
    int sector_;
    J a_, b_;
    Chart chart_;
    bool plain_;  // derivatives of a_ and b_ are known, or do not count
};

/// The same with s_i and h_i.
template <int Order, class T = double>
class PolygonPoint {
    using J = Jet<T, Order>;

public:
    /// At (a, b), in the chart of the sector or in (x, y).
    PolygonPoint(const Polygon& polygon, const DomainPointOf<T>& p, Chart chart) noexcept
        : PolygonPoint(polygon, p.sector, J(p.a), J(p.b), chart, true) {}

    /// See PolygonDistances.
    PolygonPoint(const Polygon& polygon, int sector, const J& a, const J& b, Chart chart,
                 bool plain) noexcept
        : distances_(polygon, sector, a, b, chart, plain),
          parameters_(distances_, sector, polygon.n()) {}
    PolygonPoint(const PolygonPoint&) = delete;
    PolygonPoint& operator=(const PolygonPoint&) = delete;

    J distance(int k) const noexcept { return distances_.distance(k); }
    J s(int i) const noexcept { return parameters_.s(i); }
    J h(int i) const noexcept { return parameters_.h(i); }

private:
    PolygonDistances<Order, T> distances_;
    PolygonSideParameters<Order, PolygonDistances<Order, T>> parameters_;
};

}  // namespace osdx::inline OSDX_ABI
