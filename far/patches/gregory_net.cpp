// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "far/patches/gregory_net.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "far/refine/sharpness.h"

namespace osdx::inline OSDX_ABI {
namespace {

constexpr double kPi = std::numbers::pi;

/// Places in a FanMask.
struct FanIndex {
    int n_edges;
    int edge(int j) const { return 1 + j; }
    int face(int j) const { return 1 + n_edges + j; }
};

FanMask zero_mask(const FanShape& fan) {
    return FanMask(static_cast<std::size_t>(1 + fan.n_edges() + fan.n_faces), 0.0);
}

void add_middle(FanMask& mask, int j, double weight) {
    mask[0] += 0.5 * weight;
    mask[1 + j] += 0.5 * weight;
}

void add(FanMask& sum, const FanMask& mask, double weight) {
    for (std::size_t i = 0; i < sum.size(); ++i)
        sum[i] += weight * mask[i];
}

/// What the eigenvectors of a vertex of valence n are made of: lambda is the subdominant
/// eigenvalue, and q_i = (2/n) sum of (1 - sigma c) cos(j theta) m_(i+j) +
/// 2 sigma cos((j + 1/2) theta) c_(i+j), theta = 2 pi/n.
struct Eigen {
    double c, sigma, lambda, middle, face;

    explicit Eigen(int n) {
        const double cos_theta = std::cos(2 * kPi / n);
        c = std::cos(kPi / n);
        sigma = 1 / std::sqrt(4 + c * c);
        lambda = (5 + cos_theta + c * std::sqrt(18 + 2 * cos_theta)) / 16;
        middle = 2.0 / n * (1 - sigma * c);
        face = 4.0 / n * sigma;
    }

    /// Such that the tangent is as long as OpenSubdiv's on the subdominant eigenvector.
    double tuned_length(int n) const {
        const double L = lambda;
        return 3 * c * c * (8 * L - 1) /
               (2 * L * L * (n + 5) *
                ((4 * L - 1) * (1 - sigma * c) / 2 + 4 * sigma * L * c));
    }
};

/// g(n). Those of n = 3, 5, 6 were chosen by the distance to the limit on small meshes.
double tuned_length(int n) {
    constexpr double kLengths[] = {1, 0.88, 1, 0.96, 0.90};
    return n < 7 ? kLengths[n - 2] : Eigen(n).tuned_length(n);
}

FanMask closed_tangent(const FanShape& fan, int edge, double length) {
    const int n = fan.n_faces;
    const FanIndex at{n};
    const Eigen eigen(n);
    const double scale = 2.0 / 3 * eigen.lambda * length, theta = 2 * kPi / n;
    FanMask t = zero_mask(fan);
    for (int j = 0; j < n; ++j) {
        add_middle(t, j, scale * eigen.middle * std::cos((j - edge) * theta));
        t[at.face(j)] += scale * eigen.face * std::cos((j - edge + 0.5) * theta);
    }
    return t;
}

/// T across the border of two faces: that of the B-spline.
FanMask regular_cross_tangent(const FanShape& fan) {
    FanMask t = zero_mask(fan);
    const FanIndex at{fan.n_edges()};
    t[0] = -2.0 / 9;
    for (int j = 0; j < 3; ++j)
        add_middle(t, j, (j == 1 ? 2 : -2) / 9.0);
    for (int j = 0; j < 2; ++j)
        t[at.face(j)] = 2.0 / 9;
    return t;
}

/// T across the border of k >= 3 faces: the left eigenvector for lambda of valence 2k.
///
/// Right eigenvectors are sin(i pi/k), as around a vertex of valence 2k, since the vertex and
/// the ends of the border stay 0. So the left one has the weights of that valence inside;
/// the vertex's, a, and those of both ends, b, follow from
///
///     (lambda - 1/2) b - a/8 = sin(theta)/16 + D sin(theta/2)/4,
///     (lambda - 3/4) a - b   = 3/8 sum of sin(j theta) + D/4 sum of sin((j + 1/2) theta)
///
/// where sin(j theta) and D sin((j + 1/2) theta) are the weights of edge and face neighbours
/// after one step, D = cos(theta/2) / (8 lambda - 2), theta = pi/k. The mask is that of the
/// points after one step, over lambda.
FanMask eigen_cross_tangent(const FanShape& fan, double length) {
    const int k = fan.n_faces;
    const FanIndex at{fan.n_edges()};
    const Eigen eigen(2 * k);
    const double theta = kPi / k, L = eigen.lambda, D = eigen.c / (8 * L - 2);
    double edges = 0, faces = 0;
    for (int j = 1; j < k; ++j)
        edges += std::sin(j * theta);
    for (int j = 0; j < k; ++j)
        faces += D * std::sin((j + 0.5) * theta);
    const double r1 = std::sin(theta) / 16 + D * std::sin(theta / 2) / 4,
                 r2 = 3.0 / 8 * edges + faces / 4;
    const double a = ((L - 0.5) * r2 + r1) / ((L - 0.75) * (L - 0.5) - 1.0 / 8),
                 b = (r1 + a / 8) / (L - 0.5);

    // Edge neighbours after one step: (v + e + c + c)/4 inside, (v + e)/2 at the ends; the
    // vertex: (6 v + e + e)/8. The scale gives 2 middle sin(j theta) / 2 inside.
    const double scale = 2.0 / 3 * L * length * 4 * eigen.middle;
    FanMask t = zero_mask(fan);
    t[0] = scale * (0.75 * a + b + edges / 4);
    t[at.edge(0)] = t[at.edge(k)] = scale * (a / 8 + b / 2);
    for (int j = 1; j < k; ++j)
        t[at.edge(j)] = scale * std::sin(j * theta) / 4;
    for (int j = 0; j < k; ++j) {
        const double sides = std::sin(j * theta) + std::sin((j + 1) * theta);
        t[at.face(j)] = scale * (D * std::sin((j + 0.5) * theta) + sides / 4);
    }
    return t;
}

/// T across the border after Biermann, Levin and Zorin, Piecewise smooth subdivision surfaces
/// with normal control (2000), with the length of OpenSubdiv.
FanMask biermann_cross_tangent(const FanShape& fan) {
    const int k = fan.n_faces;
    const FanIndex at{fan.n_edges()};
    const double h = kPi / k, ch = std::cos(h), scale = 1 / (3 * (3 * k + ch));
    FanMask t = zero_mask(fan);
    t[0] = -4 * std::sin(h) * scale;
    for (const int end : {0, k})
        t[at.edge(end)] = -(1 + 2 * ch) * std::sqrt((1 + ch) / (1 - ch)) * scale;
    for (int j = 1; j < k; ++j)
        t[at.edge(j)] = 4 * std::sin(j * h) * scale;
    for (int j = 0; j < k; ++j) {
        // The corner across a quad is 4 c - v - e_j - e_(j+1).
        const double w = (std::sin(j * h) + std::sin((j + 1) * h)) * scale;
        t[at.face(j)] += 4 * w;
        for (const int i : {0, at.edge(j), at.edge(j + 1)})
            t[i] -= w;
    }
    return t;
}

template <class CrossTangent>
FanMask tangent(const FanShape& fan, int edge, double length,
                CrossTangent&& cross_tangent) {
    assert(edge >= 0 && edge < fan.n_edges());
    const int k = fan.n_faces;
    if (!fan.sharp && !fan.open)
        return closed_tangent(fan, edge, length);
    FanMask t = zero_mask(fan);
    const FanIndex at{fan.n_edges()};
    if (fan.sharp) {
        t[0] = -1.0 / 3;
        t[at.edge(edge)] = 1.0 / 3;
        return t;
    }
    const bool inside = edge > 0 && edge < k;
    const double along = edge == 0 ? 1 : edge == k ? -1 : std::cos(edge * kPi / k);
    t[at.edge(0)] = along / 6;
    t[at.edge(k)] = -along / 6;
    if (inside)
        add(t, cross_tangent(), std::sin(edge * kPi / k));
    return t;
}

}  // namespace

double FanShape::cosine() const noexcept {
    return std::cos((open ? 1 : 2) * kPi / n_faces);
}

FanMask limit_mask(const FanShape& fan) {
    FanMask p = zero_mask(fan);
    const FanIndex at{fan.n_edges()};
    const double n = fan.n_faces;
    if (fan.sharp) {
        p[0] = 1;
    } else if (fan.open) {
        p[0] = 4.0 / 6;
        p[at.edge(0)] = p[at.edge(fan.n_faces)] = 1.0 / 6;
    } else {
        const double w = 4 / (n * (n + 5));
        p[0] = (n - 3) / (n + 5);
        for (int j = 0; j < fan.n_faces; ++j) {
            add_middle(p, j, w);
            p[at.face(j)] = w;
        }
    }
    return p;
}

FanMask paper_tangents(const FanShape& fan, int edge) {
    return tangent(fan, edge, 1, [&] {
        return fan.n_faces == 2 ? regular_cross_tangent(fan)
                                : eigen_cross_tangent(fan, 1);
    });
}

FanMask tuned_tangents(const FanShape& fan, int edge) {
    return tangent(fan, edge, fan.open ? 1 : tuned_length(fan.n_faces), [&] {
        return fan.n_faces == 2   ? regular_cross_tangent(fan)
               : fan.n_faces == 3 ? eigen_cross_tangent(fan, Eigen(6).tuned_length(6))
                                  : biermann_cross_tangent(fan);
    });
}

Status check_gregory(const MeshData& data, const Topology& t, const Features& f) {
    for (Index h = 0; h < t.n_halfedges(); ++h) {
        if (is_semi_sharp(f.edge(t.edge[h]))) {
            return fail(ErrorCode::InvalidOption,
                        fmt::format("edge {} of vertices {} and {} is semi-sharp, which "
                                    "Gregory patches do not take without refinement",
                                    t.edge[h], t.vertex[h], t.to_vertex(h)),
                        t.edge[h], data.view().line_of_vertex(t.vertex[h]));
        }
    }
    for (Index v = 0; v < t.n_vertices(); ++v) {
        if (is_semi_sharp(f.vertex(v))) {
            return fail(
                ErrorCode::InvalidOption,
                fmt::format("vertex {} is semi-sharp, which Gregory patches do not "
                            "take without refinement",
                            v),
                v, data.view().line_of_vertex(v));
        }
    }
    if (f.smooth_triangles) {
        const auto tag = std::ranges::find(data.tags, "smoothtriangles", &Tag::name);
        const auto i = static_cast<Index>(tag - data.tags.begin());
        return fail(ErrorCode::UnsupportedTag,
                    "smooth triangles have no rule for Gregory patches",
                    tag == data.tags.end() ? kInvalidIndex : i,
                    tag == data.tags.end() ? 0 : tag->line);
    }
    return ok();
}

namespace {

/// A linear form over the vertices, in no order.
class Row {
public:
    void add(Index vertex, double weight) { terms_.emplace_back(vertex, weight); }
    void add(const Row& row, double weight) {
        for (const auto& [v, w] : row.terms_)
            terms_.emplace_back(v, weight * w);
    }

    void append_to(StencilTable& table) {
        // Stable, so that equal sums are formed in the same order wherever they occur.
        std::ranges::stable_sort(terms_, {}, &Term::first);
        for (std::size_t i = 0; i < terms_.size();) {
            double sum = 0;
            std::size_t j = i;
            for (; j < terms_.size() && terms_[j].first == terms_[i].first; ++j)
                sum += terms_[j].second;
            if (sum != 0)
                table.add(terms_[i].first, sum);
            i = j;
        }
        table.end_row();
    }

private:
    using Term = std::pair<Index, double>;
    std::vector<Term> terms_;
};

class GregoryFace {
public:
    GregoryFace(const Topology& topology, const ResolvedFeatures& features, Index face,
                const GregoryRules& options)
        : t_(topology),
          features_(features),
          options_(options),
          first_(topology.face_offsets[face]),
          n_(static_cast<int>(topology.face_size(face))) {
        for (int i = 0; i < n_; ++i)
            corners_.push_back(make_corner(first_ + static_cast<Index>(i)));
    }

    StencilTable points() {
        StencilTable table;
        for (int i = 0; i < n_; ++i) {
            Corner& c = corners_[i];
            set_face_points(i);
            for (Row* row : {&c.p, &c.e_plus, &c.e_minus, &c.f_plus, &c.f_minus})
                row->append_to(table);
        }
        if (options_.centre && n_ != 4)
            centre().append_to(table);
        return table;
    }

private:
    struct Corner {
        FanShape fan;
        Row p, e_plus, e_minus, f_plus, f_minus;
    };
    struct Fan {
        FanShape shape;
        std::vector<Index> halfedges;  // counter-clockwise, one for each face
    };

    bool is_sharp(Index h) const {
        return is_infinitely_sharp(features_.edge(t_.edge[h]));
    }
    int next(int i) const { return i + 1 == n_ ? 0 : i + 1; }
    int before(int i) const { return i == 0 ? n_ - 1 : i - 1; }

    /// The fan of the face of h at the vertex where h starts, from a first face that does not
    /// depend on h.
    Fan make_fan(Index h) const {
        const Index v = t_.vertex[h];
        std::size_t n_sharp = 0;
        t_.for_each_edge(v, [&](Index e, Index) {
            n_sharp += is_infinitely_sharp(features_.edge(e));
        });
        Fan fan;
        fan.shape.sharp = detail::is_pinned(features_.vertex(v), n_sharp);
        fan.shape.open = n_sharp >= 2;
        Index start = t_.vertex_halfedge[v];
        if (fan.shape.open) {
            for (start = h; !is_sharp(start);)
                start = t_.next(t_.twin[start]);
        }
        h = start;
        do {
            fan.halfedges.push_back(h);
            if (fan.shape.open && is_sharp(t_.prev(h)))
                break;
            h = t_.ccw(h);
        } while (h != start);
        fan.shape.n_faces = static_cast<int>(fan.halfedges.size());
        return fan;
    }

    void add_centroid(Index face, double weight, Row& row) const {
        const double w = weight / t_.face_size(face);
        for (Index h = t_.face_offsets[face]; h < t_.face_offsets[face + 1]; ++h)
            row.add(t_.vertex[h], w);
    }

    Row expand(const Fan& fan, const FanMask& mask) const {
        Row row;
        const int n = fan.shape.n_faces, n_edges = fan.shape.n_edges();
        row.add(t_.vertex[fan.halfedges[0]], mask[0]);
        for (int j = 0; j < n_edges; ++j) {
            row.add(j < n ? t_.to_vertex(fan.halfedges[j])
                          : t_.vertex[t_.prev(fan.halfedges[n - 1])],
                    mask[1 + j]);
        }
        for (int j = 0; j < n; ++j) {
            const double w = mask[1 + n_edges + j];
            if (w != 0)
                add_centroid(t_.face(fan.halfedges[j]), w, row);
        }
        return row;
    }

    Corner make_corner(Index h) const {
        const Fan fan = make_fan(h);
        const int j =
            static_cast<int>(std::ranges::find(fan.halfedges, h) - fan.halfedges.begin());
        const FanMask p = limit_mask(fan.shape);
        const auto edge_point = [&](int edge) {
            FanMask e = options_.tangents(fan.shape, edge);
            add(e, p, 1);
            return expand(fan, e);
        };
        Corner c;
        c.fan = fan.shape;
        c.p = expand(fan, p);
        c.e_plus = edge_point(j);
        c.e_minus = edge_point(fan.shape.open ? j + 1 : (j + 1) % fan.shape.n_faces);
        return c;
    }

    /// r at the edge of h, which starts at the vertex, on the side of its face.
    void add_r(Index h, double weight, Row& row) const {
        const Index twin = t_.twin[h];
        row.add(t_.vertex[t_.prev(h)], weight / 6);
        row.add(t_.to_vertex(t_.next(twin)), -weight / 6);
        add_centroid(t_.face(h), 2 * weight / 3, row);
        add_centroid(t_.face(twin), -2 * weight / 3, row);
    }

    void set_face_points(int i) {
        Corner& c = corners_[i];
        const Index out = first_ + static_cast<Index>(i), in = t_.prev(out);
        const bool out_is_sharp = is_sharp(out), in_is_sharp = is_sharp(in);
        const auto inner = [&](const Row& e, const Corner& other, const Row& other_e) {
            const double c0 = c.fan.cosine(), c1 = other.fan.cosine();
            Row f;
            f.add(c.p, c1 / 3);
            f.add(e, (3 - 2 * c0 - c1) / 3);
            f.add(other_e, 2 * c0 / 3);
            return f;
        };
        if (!out_is_sharp) {
            const Corner& other = corners_[next(i)];
            c.f_plus = inner(c.e_plus, other, other.e_minus);
            add_r(out, 1.0 / 3, c.f_plus);
        }
        if (!in_is_sharp) {
            const Corner& other = corners_[before(i)];
            c.f_minus = inner(c.e_minus, other, other.e_plus);
            add_r(t_.twin[in], -1.0 / 3, c.f_minus);
        }
        if (out_is_sharp && in_is_sharp) {
            // That of the B-spline.
            c.f_plus.add(t_.vertex[out], 3.0 / 9);
            c.f_plus.add(t_.to_vertex(out), 1.0 / 9);
            c.f_plus.add(t_.vertex[in], 1.0 / 9);
            add_centroid(t_.face(out), 4.0 / 9, c.f_plus);
            c.f_minus = c.f_plus;
        } else if (out_is_sharp) {
            c.f_plus = c.f_minus;
        } else if (in_is_sharp) {
            c.f_minus = c.f_plus;
        }
    }

    /// The vertex point of one step of Catmull-Clark.
    Row vertex_point(Index h) const {
        const Fan fan = make_fan(h);
        FanMask mask = limit_mask(fan.shape);
        const int n = fan.shape.n_faces, n_edges = fan.shape.n_edges();
        if (!fan.shape.sharp && fan.shape.open) {
            mask[0] = 6.0 / 8;
            mask[1] = mask[n_edges] = 1.0 / 8;
        } else if (!fan.shape.sharp) {
            const double w = 1.0 / (n * n);
            mask[0] = (n - 2) * n * w;
            for (std::size_t i = 1; i < mask.size(); ++i)
                mask[i] = w;
        }
        return expand(fan, mask);
    }

    /// C = (L - W) / w: L the limit point of the middle of the face, W what the other control
    /// points give there, and w what that lacks.
    Row centre() const {
        const double n = n_, w = 1 - 2 / n * (3 - 4 / n), scale = 1 / w;
        Row row;
        // n/(n+5) centroid + 4/(n(n+5)) edge points + 1/(n(n+5)) vertex points.
        add_centroid(t_.face(first_), scale * n / (n + 5), row);
        const double vertex = scale / (n * (n + 5)), edge = 4 * vertex;
        for (int i = 0; i < n_; ++i) {
            const Index h = first_ + static_cast<Index>(i);
            row.add(vertex_point(h), vertex);
            const double end = is_sharp(h) ? edge / 2 : edge / 4;
            row.add(t_.vertex[h], end);
            row.add(t_.to_vertex(h), end);
            if (!is_sharp(h)) {
                add_centroid(t_.face(h), edge / 4, row);
                add_centroid(t_.face(t_.twin[h]), edge / 4, row);
            }
        }
        // At s = 1/2, h = 1 - 2/n, blends 1/2.
        const double h = 1 - 2 / n, b0 = (1 - h) * (1 - h) * (1 - h),
                     b1 = 3 * h * (1 - h) * (1 - h);
        for (const Corner& c : corners_) {
            row.add(c.p, -scale * b0 / 8);
            row.add(c.e_plus, -scale * (3 * b0 + b1) / 16);
            row.add(c.e_minus, -scale * (3 * b0 + b1) / 16);
            row.add(c.f_plus, -scale * 3 * b1 / 16);
            row.add(c.f_minus, -scale * 3 * b1 / 16);
        }
        return row;
    }

    const Topology& t_;
    const ResolvedFeatures& features_;
    const GregoryRules& options_;
    Index first_;
    int n_;
    std::vector<Corner> corners_;
};

}  // namespace

StencilTable gregory_points(const Topology& topology, const ResolvedFeatures& features,
                            Index face, const GregoryRules& options) {
    return GregoryFace(topology, features, face, options).points();
}

}  // namespace osdx::inline OSDX_ABI
