// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include <osdx/face_varying.h>
#include <osdx/resolved_features.h>

#include "far/parallel.h"

namespace osdx::inline OSDX_ABI {
namespace {

/// The faces at a vertex that have one value.
struct Span {
    Index value = 0;
    Index n_faces = 0;
    Index n_fans = 0;
    bool has_infinite_edge = false;  // between two of its faces
    std::vector<double> semi_sharp;  // edges between two of its faces
    double seam_sharpness = 0;       // greatest of the semi-sharp edges at the ends
};

/// The sharpness of a corner that lasts as long as those edges of a crease do, and ends with
/// the mean of what is left of the last of them.
double lasting_sharpness(const std::vector<double>& edges) {
    const double last = std::ceil(std::ranges::max(edges));
    double sum = 0;
    int n = 0;
    for (const double s : edges) {
        if (std::ceil(s) == last) {
            sum += s - (last - 1);
            ++n;
        }
    }
    return last - 1 + sum / n;
}

class Builder {
public:
    Builder(const Topology& mesh, const Features& features,
            std::span<const Index> corner_values, FaceVaryingRule rule)
        : mesh_(mesh), features_(resolve(mesh, features)), value_(corner_values) {
        out_.rule = rule;
    }

    Result<FaceVarying> build() {
        cut();
        number_vertices();
        copy_features();
        for (Index v = 0; v < mesh_.n_vertices(); ++v) {
            if (const Status s = apply_rule(v); !s)
                return s.error();
        }
        return std::move(out_);
    }

private:
    bool is_seam(Index h) const {
        const Index g = mesh_.twin[h];
        return g != kInvalidIndex &&
               (value_[h] != value_[mesh_.next(g)] || value_[mesh_.next(h)] != value_[g]);
    }

    /// The mesh without the twins at seams, the second sides of which get edges of their own.
    void cut() {
        Topology& t = out_.topology;
        t = mesh_.to_relink();
        for (Index h = 0; h < mesh_.n_halfedges(); ++h) {
            if (!is_seam(h))
                continue;
            t.twin[h] = kInvalidIndex;
            if (h > mesh_.twin[h])
                t.edge[h] = t.n_edges++;
        }
    }

    /// By vertices of the mesh, and about each by fans.
    void number_vertices() {
        Topology& t = out_.topology;
        t.vertex_halfedge.clear();
        const auto add = [&](Index first) {
            const Index v = t.n_vertices();
            t.vertex_halfedge.push_back(first);
            out_.values.push_back(value_[first]);
            t.for_each_outgoing(v, [&](Index h) { t.vertex[h] = v; });
        };
        for (Index v = 0; v < mesh_.n_vertices(); ++v) {
            bool is_cut = false;
            mesh_.for_each_outgoing(v, [&](Index h) {
                if (t.is_border(h)) {
                    is_cut = true;
                    add(h);
                }
            });
            if (!is_cut && mesh_.vertex_halfedge[v] != kInvalidIndex)
                add(mesh_.vertex_halfedge[v]);
        }
    }

    void copy_features() {
        const Topology& t = out_.topology;
        Features& f = out_.features;
        f.hole = features_.hole;
        f.creases = features_.creases;
        f.smooth_triangles = features_.smooth_triangles;
        if (!features_.edge_sharpness.empty()) {
            f.edge_sharpness.resize(t.n_edges);
            for (Index h = 0; h < t.n_halfedges(); ++h)
                f.edge_sharpness[t.edge[h]] = features_.edge_sharpness[mesh_.edge[h]];
        }
        f.vertex_sharpness.resize(t.n_vertices());
        for (Index h = 0; h < t.n_halfedges(); ++h)
            f.vertex_sharpness[t.vertex[h]] = features_.vertex(mesh_.vertex[h]);
    }

    /// The vertices of the result at a vertex of the mesh, as halfedges: counter-clockwise,
    /// first that of the mesh's vertex_halfedge.
    std::vector<Index> fans(Index v) const {
        const Topology& t = out_.topology;
        std::vector<Index> result;
        mesh_.for_each_outgoing(v, [&](Index h) {
            if (t.vertex_halfedge[t.vertex[h]] == h)
                result.push_back(h);
        });
        if (t.vertex[result.front()] != t.vertex[mesh_.vertex_halfedge[v]])
            std::rotate(result.begin(), result.end() - 1, result.end());
        return result;
    }

    /// \param span_of  of each fan
    std::vector<Span> gather_spans(const std::vector<Index>& fans,
                                   std::vector<std::size_t>& span_of) const {
        const Topology& t = out_.topology;
        std::vector<Span> spans;
        for (const Index first : fans) {
            const Index value = value_[first];
            std::size_t i = 0;
            if (!span_of.empty() && spans[span_of.back()].value == value) {
                i = span_of.back();
            } else if (spans.size() == 2 && spans[0].value != value) {
                // Far 3.5 does not look whether it is the second value once more.
                i = 2;
            } else {
                while (i < spans.size() && spans[i].value != value)
                    ++i;
            }
            if (i == spans.size())
                spans.emplace_back().value = value;
            span_of.push_back(i);

            Span& span = spans[i];
            ++span.n_fans;
            const auto note_end = [&](Index h) {
                const double s = features_.edge(mesh_.edge[h]);
                if (is_semi_sharp(s))
                    span.seam_sharpness = std::max(span.seam_sharpness, s);
            };
            note_end(first);
            Index last = first;
            t.for_each_outgoing(t.vertex[first], [&](Index h) {
                ++span.n_faces;
                last = h;
                if (h == first)
                    return;
                const double s = features_.edge(mesh_.edge[h]);
                span.has_infinite_edge = span.has_infinite_edge || is_infinitely_sharp(s);
                if (is_semi_sharp(s))
                    span.semi_sharp.push_back(s);
            });
            note_end(t.prev(last));
        }
        return spans;
    }

    Status apply_rule(Index v) {
        const Topology& t = out_.topology;
        const FaceVaryingRule rule = out_.rule;
        if (mesh_.vertex_halfedge[v] == kInvalidIndex || rule == FaceVaryingRule::All)
            return ok();
        const std::vector<Index> all = fans(v);
        if (!t.is_border(all.front()))
            return ok();
        const auto pin = [&](Index h) {
            out_.features.vertex_sharpness[t.vertex[h]] = kInfinitelySharp;
        };
        const auto pin_all = [&] {
            std::ranges::for_each(all, pin);
            return ok();
        };
        std::vector<std::size_t> span_of;
        const std::vector<Span> spans = gather_spans(all, span_of);
        bool has_seam = false;
        mesh_.for_each_outgoing(
            v, [&](Index h) { has_seam = has_seam || t.twin[h] != mesh_.twin[h]; });
        if (has_seam) {
            if (const Status s = check_chaikin(v, spans); !s)
                return s;
        }
        if (rule == FaceVaryingRule::Boundaries)
            return pin_all();

        const bool plus2 = rule == FaceVaryingRule::CornersPlus2;
        const bool is_dependent = plus2 || rule == FaceVaryingRule::CornersPlus1;
        if (has_seam &&
            ((is_dependent && spans.size() > 2) || (plus2 && spans.size() == 1)))
            return pin_all();
        const bool depend = has_seam && is_dependent && spans.size() == 2;
        if (depend && std::ranges::any_of(spans, [&](const Span& s) {
                return s.n_fans > 1 || s.has_infinite_edge || (plus2 && s.n_faces == 1);
            }))
            return pin_all();
        for (std::size_t i = 0; i < all.size(); ++i) {
            const Span& span = spans[span_of[i]];
            if (span.n_fans > 1 || (span.n_faces == 1 && rule != FaceVaryingRule::None)) {
                pin(all[i]);
                continue;
            }
            if (!depend || features_.vertex(v) > 0 || !span.semi_sharp.empty())
                continue;
            const Span& other = spans[1 - span_of[i]];
            if (other.semi_sharp.empty())
                continue;
            if (features_.creases == CreaseMethod::Chaikin)
                return refuse_chaikin(v);
            out_.features.vertex_sharpness[t.vertex[all[i]]] = depending_sharpness(other);
        }
        return ok();
    }

    /// Of a value without semi-sharp edges beside one that has some: it is sharp as long as
    /// they are.
    static double depending_sharpness(const Span& other) {
        const double s = lasting_sharpness(other.semi_sharp);
        // Far 3.5 lets go of it one level later, all at once, if then the seam between the
        // two is still semi-sharp, which has no influence otherwise.
        const double last = std::ceil(s);
        if (std::ceil(other.seam_sharpness) > last)
            return std::nextafter(last, std::numeric_limits<double>::max());
        return s;
    }

    /// Chaikin's rule averages over all edges of a crease at the vertex. Those beyond a seam,
    /// and the seam itself, are not there for a vertex of ours.
    Status check_chaikin(Index v, const std::vector<Span>& spans) const {
        if (features_.creases != CreaseMethod::Chaikin)
            return ok();
        std::size_t n_all = 0;
        mesh_.for_each_edge(
            v, [&](Index e, Index) { n_all += is_semi_sharp(features_.edge(e)); });
        for (const Span& s : spans) {
            if (!s.semi_sharp.empty() && s.semi_sharp.size() != n_all)
                return refuse_chaikin(v);
        }
        return ok();
    }

    static Error refuse_chaikin(Index v) {
        return fail(
            ErrorCode::UnsupportedTag,
            fmt::format("at vertex {} a seam of face-varying data meets edges of a "
                        "semi-sharp crease by Chaikin's rule, which is not supported",
                        v),
            v);
    }

    const Topology& mesh_;
    ResolvedFeatures features_;
    std::span<const Index> value_;
    FaceVarying out_;
};

}  // namespace

Result<FaceVaryingRule> face_varying_rule(const MeshData& data) {
    FaceVaryingRule rule = FaceVaryingRule::All;
    Index propagating = kInvalidIndex;  // the tag
    for (Index i = 0; i < data.tags.size(); ++i) {
        const Tag& tag = data.tags[i];
        const bool is_rule = tag.name == "facevaryinginterpolateboundary";
        if (!is_rule && tag.name != "facevaryingpropagatecorners")
            continue;
        const int most = is_rule ? 5 : 1;
        if (tag.ints.size() != 1 || tag.ints[0] < 0 || tag.ints[0] > most) {
            return fail(
                ErrorCode::InvalidTag,
                fmt::format("tag {} is '{}' and does not hold one number from 0 to {}", i,
                            tag.name, most),
                i, tag.line);
        }
        if (is_rule)
            rule = static_cast<FaceVaryingRule>(tag.ints[0]);
        else
            propagating = tag.ints[0] == 1 ? i : kInvalidIndex;
    }
    if (propagating == kInvalidIndex)
        return rule;
    if (rule == FaceVaryingRule::CornersPlus1 || rule == FaceVaryingRule::CornersPlus2)
        return FaceVaryingRule::CornersPlus2;
    const Tag& tag = data.tags[propagating];
    return fail(ErrorCode::UnsupportedTag,
                fmt::format("tag {} is '{}', which is supported only where "
                            "facevaryinginterpolateboundary is 2 or 3",
                            propagating, tag.name),
                propagating, tag.line);
}

Result<FaceVaryingRule> face_varying_rule(const MeshData& data,
                                          std::optional<FaceVaryingRule> given,
                                          bool ignore_tags) {
    if (given)
        return *given;
    if (ignore_tags)
        return FaceVaryingRule::All;
    return face_varying_rule(data);
}

Status check_face_varying(const FaceVaryingView& channel, const Topology& topology,
                          const MeshView& view) {
    const std::span<const Index> values = channel.corner_values;
    if (values.size() != topology.n_halfedges()) {
        return fail(ErrorCode::SizeMismatch,
                    fmt::format("the face-varying channel {} has values for {} face "
                                "corners, but {} are there",
                                channel.name, values.size(), topology.n_halfedges()));
    }
    const Index corner = detail::first_index(
        values.size(), [&](Index c) { return values[c] >= channel.n_values; });
    if (corner == kInvalidIndex)
        return ok();
    const Index face = topology.face(corner);
    return fail(
        ErrorCode::IndexOutOfRange,
        fmt::format("face {} names value {} of the face-varying channel {}, which "
                    "has {}",
                    face, values[corner], channel.name, channel.n_values),
        face, view.line_of_face(face));
}

Status check_face_varying(const MeshData& data, const Topology& topology) {
    for (const FaceVaryingChannels& c : data.face_varying) {
        if (c.n < 1 || c.values.size() % static_cast<std::size_t>(c.n) != 0) {
            return fail(
                ErrorCode::SizeMismatch,
                fmt::format("the face-varying channel {} has {} numbers, which are "
                            "not {} each",
                            c.name, c.values.size(), c.n));
        }
        if (Status s = check_face_varying(c.corners(), topology, data.view()); !s)
            return s;
        const auto bad =
            std::ranges::find_if_not(c.values, [](double x) { return std::isfinite(x); });
        if (bad == c.values.end())
            continue;
        const auto i = static_cast<Index>((bad - c.values.begin()) / c.n);
        return fail(
            ErrorCode::NonFinitePoint,
            fmt::format("value {} of the face-varying channel {} is {}", i, c.name, *bad),
            i);
    }
    return ok();
}

Result<FaceVarying> build_face_varying(const Topology& mesh, const Features& features,
                                       std::span<const Index> corner_values,
                                       FaceVaryingRule rule) {
    if (corner_values.size() != mesh.n_halfedges()) {
        return fail(ErrorCode::SizeMismatch,
                    fmt::format("{} face corners have values, but the mesh has {}",
                                corner_values.size(), mesh.n_halfedges()));
    }
    return Builder(mesh, features, corner_values, rule).build();
}

}  // namespace osdx::inline OSDX_ABI
