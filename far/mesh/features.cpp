// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <span>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include <osdx/face_varying.h>
#include <osdx/features.h>
#include <osdx/resolved_features.h>
#include <osdx/topology.h>

#include "far/mesh/formats/scan.h"

namespace osdx::inline OSDX_ABI {
namespace {

/// Calls f(edge) for the edges of two vertices: faces that share two neighbouring edges may
/// have several. In time proportional to the smaller valence.
/// \return whether there is one
template <class F>
bool for_each_edge_of(const Topology& t, Index a, Index b, F&& f) {
    if (a >= t.n_vertices() || b >= t.n_vertices())
        return false;
    // As far as it is stored: counting about poles would be quadratic.
    const auto valence = [&](Index v) {
        return t.valences.empty() ? t.valence(v) : t.valences[v];
    };
    if (valence(b) < valence(a))
        std::swap(a, b);
    bool found = false;
    t.for_each_edge(a, [&](Index e, Index other) {
        if (other == b) {
            found = true;
            f(e);
        }
    });
    return found;
}

class TagReader {
public:
    TagReader(const MeshData& data, const Topology& topology)
        : data_(data), topology_(topology) {}

    Result<Features> read() {
        for (Index i = 0; i < data_.tags.size(); ++i) {
            if (const Status s = read(data_.tags[i], i); !s)
                return s.error();
        }
        return std::move(features_);
    }

private:
    Status refuse(Index number, const std::string& why,
                  ErrorCode code = ErrorCode::InvalidTag) const {
        const Tag& tag = data_.tags[number];
        return fail(
            code,
            fmt::format("tag {} is '{}' {}", number, detail::printable(tag.name), why),
            number, tag.line);
    }

    Status read(const Tag& tag, Index number) {
        if (tag.name == "crease")
            return read_crease(tag, number);
        if (tag.name == "corner")
            return read_corner(tag, number);
        if (tag.name == "hole")
            return read_hole(tag, number);
        if (tag.name == "interpolateboundary") {
            static constexpr BoundaryRule kRules[] = {
                BoundaryRule::None, BoundaryRule::EdgeAndCorner, BoundaryRule::EdgeOnly};
            if (tag.ints.size() != 1 || tag.ints[0] < 0 || tag.ints[0] > 2)
                return refuse(number, "and does not hold one number from 0 to 2");
            features_.boundary = kRules[tag.ints[0]];
            return ok();
        }
        if (tag.name == "creasemethod") {
            bool chaikin = false;
            if (const Status s = read_word(tag, number, "normal", "chaikin", chaikin); !s)
                return s;
            features_.creases = chaikin ? CreaseMethod::Chaikin : CreaseMethod::Uniform;
            return ok();
        }
        if (tag.name == "smoothtriangles") {
            return read_word(tag, number, "catmark", "smooth",
                             features_.smooth_triangles);
        }
        if (tag.name == "facevaryinginterpolateboundary" ||
            tag.name == "facevaryingpropagatecorners")
            return ok();
        return refuse(number, "which is not supported", ErrorCode::UnsupportedTag);
    }

    Status read_word(const Tag& tag, Index number, std::string_view off,
                     std::string_view on, bool& value) const {
        if (tag.text.size() != 1 || (tag.text[0] != off && tag.text[0] != on))
            return refuse(number, fmt::format("and names neither {} nor {}", off, on));
        value = tag.text[0] == on;
        return ok();
    }

    Status check_sharpness(const Tag& tag, Index number, std::size_t n) const {
        if (tag.floats.size() != 1 && tag.floats.size() != n) {
            return refuse(number, fmt::format("with {} sharpnesses for {} elements",
                                              tag.floats.size(), n));
        }
        if (std::ranges::any_of(tag.floats, [](double s) { return std::isnan(s); }))
            return refuse(number, "with a sharpness that is not a number");
        return ok();
    }

    Status read_crease(const Tag& tag, Index number) {
        if (tag.ints.size() != 2)
            return refuse(number, "and does not name the two vertices of one edge");
        if (const Status s = check_sharpness(tag, number, 1); !s)
            return s;
        features_.edge_sharpness.resize(topology_.n_edges);
        const bool found = for_each_edge_of(
            topology_, static_cast<Index>(tag.ints[0]), static_cast<Index>(tag.ints[1]),
            [&](Index e) { features_.edge_sharpness[e] = sharpness(tag, 0); });
        if (!found) {
            return refuse(number,
                          fmt::format("of vertices {} and {}, which share no edge",
                                      tag.ints[0], tag.ints[1]));
        }
        return ok();
    }

    Status read_corner(const Tag& tag, Index number) {
        if (const Status s = check_sharpness(tag, number, tag.ints.size()); !s)
            return s;
        features_.vertex_sharpness.resize(topology_.n_vertices());
        for (std::size_t i = 0; i < tag.ints.size(); ++i) {
            if (!in_range(tag.ints[i], topology_.n_vertices())) {
                return refuse(number, fmt::format("of vertex {}, but the mesh has {}",
                                                  tag.ints[i], topology_.n_vertices()));
            }
            features_.vertex_sharpness[tag.ints[i]] = sharpness(tag, i);
        }
        return ok();
    }

    Status read_hole(const Tag& tag, Index number) {
        features_.hole.resize(topology_.n_faces());
        for (const int f : tag.ints) {
            if (!in_range(f, topology_.n_faces())) {
                return refuse(number, fmt::format("of face {}, but the mesh has {}", f,
                                                  topology_.n_faces()));
            }
            features_.hole[f] = true;
        }
        return ok();
    }

    static bool in_range(int i, Index n) { return i >= 0 && static_cast<Index>(i) < n; }

    static double sharpness(const Tag& tag, std::size_t i) {
        return std::clamp(tag.floats[tag.floats.size() > 1 ? i : 0], 0.0,
                          kInfinitelySharp);
    }

    const MeshData& data_;
    const Topology& topology_;
    Features features_;
};

/// The features of a view.
class ViewReader {
public:
    ViewReader(const MeshView& view, const Topology& topology)
        : view_(view), topology_(topology) {}

    Result<Features> read() {
        features_.boundary = view_.boundary;
        features_.creases = view_.crease_method;
        features_.smooth_triangles = view_.smooth_triangles;
        for (const Status& s : {read_creases(), read_corners(), read_holes()}) {
            if (!s)
                return s.error();
        }
        return std::move(features_);
    }

private:
    static Status refuse(std::string message, std::size_t place) {
        return fail(ErrorCode::InvalidFeature, std::move(message),
                    static_cast<Index>(place));
    }

    static Status check_sharpness(std::string_view what, std::span<const float> sharpness,
                                  std::size_t n) {
        if (sharpness.size() != n) {
            return fail(ErrorCode::SizeMismatch,
                        fmt::format("{} sharpnesses were given for {} {}s",
                                    sharpness.size(), n, what));
        }
        const auto nan = std::ranges::find_if(sharpness, [](float s) { return s != s; });
        if (nan == sharpness.end())
            return ok();
        const auto i = static_cast<std::size_t>(nan - sharpness.begin());
        return refuse(fmt::format("the sharpness of {} {} is not a number", what, i), i);
    }

    static double clamped(float sharpness) {
        return std::clamp<double>(sharpness, 0.0, kInfinitelySharp);
    }

    Status read_creases() {
        const std::size_t n = view_.creases.size() / 2;
        if (view_.creases.size() % 2 == 1) {
            return fail(ErrorCode::SizeMismatch,
                        fmt::format("{} vertices were given for creases, which have two",
                                    view_.creases.size()));
        }
        if (const Status s = check_sharpness("crease", view_.crease_sharpness, n); !s)
            return s;
        if (n == 0)
            return ok();
        features_.edge_sharpness.resize(topology_.n_edges);
        for (std::size_t i = 0; i < n; ++i) {
            const Index a = view_.creases[2 * i], b = view_.creases[2 * i + 1];
            const bool found = for_each_edge_of(topology_, a, b, [&](Index e) {
                features_.edge_sharpness[e] = clamped(view_.crease_sharpness[i]);
            });
            if (!found) {
                return refuse(
                    fmt::format("crease {} is of vertices {} and {}, which share no edge",
                                i, a, b),
                    i);
            }
        }
        return ok();
    }

    Status read_corners() {
        const std::size_t n = view_.corners.size();
        if (const Status s = check_sharpness("corner", view_.corner_sharpness, n); !s)
            return s;
        if (n > 0)
            features_.vertex_sharpness.resize(topology_.n_vertices());
        for (std::size_t i = 0; i < n; ++i) {
            const Index v = view_.corners[i];
            if (v >= topology_.n_vertices()) {
                return refuse(fmt::format("corner {} is vertex {}, but the mesh has {}",
                                          i, v, topology_.n_vertices()),
                              i);
            }
            features_.vertex_sharpness[v] = clamped(view_.corner_sharpness[i]);
        }
        return ok();
    }

    Status read_holes() {
        if (!view_.holes.empty())
            features_.hole.resize(topology_.n_faces());
        for (std::size_t i = 0; i < view_.holes.size(); ++i) {
            const Index f = view_.holes[i];
            if (f >= topology_.n_faces()) {
                return refuse(fmt::format("hole {} is face {}, but the mesh has {}", i, f,
                                          topology_.n_faces()),
                              i);
            }
            features_.hole[f] = true;
        }
        return ok();
    }

    const MeshView& view_;
    const Topology& topology_;
    Features features_;
};

}  // namespace

Result<Features> build_features(const MeshView& view, const Topology& topology) {
    for (const FaceVaryingView& channel : view.face_varying) {
        if (const Status s = check_face_varying(channel, topology, view); !s)
            return s.error();
    }
    return ViewReader(view, topology).read();
}

Result<Features> build_features(const MeshData& data, const Topology& topology,
                                const FeatureOptions& options) {
    Features features;
    if (!options.ignore_tags) {
        Result<Features> read = TagReader(data, topology).read();
        if (!read)
            return read;
        features = std::move(*read);
    }
    if (options.boundary)
        features.boundary = *options.boundary;
    return features;
}

std::vector<Tag> to_tags(const Topology& t, const Features& f) {
    std::vector<Tag> tags;
    const auto add = [&](std::string name) -> Tag& {
        tags.emplace_back();
        tags.back().name = std::move(name);
        return tags.back();
    };
    bool open = false;
    for (Index h = 0; h < t.n_halfedges(); ++h) {
        open = open || t.is_border(h);
        if (t.is_border(h) || t.twin[h] < h || f.edge(t.edge[h]) <= 0)
            continue;
        Tag& tag = add("crease");
        tag.ints = {static_cast<int>(t.vertex[h]), static_cast<int>(t.to_vertex(h))};
        tag.floats = {f.edge(t.edge[h])};
    }
    for (Index v = 0; v < t.n_vertices(); ++v) {
        if (f.vertex(v) > 0) {
            Tag& tag = add("corner");
            tag.ints = {static_cast<int>(v)};
            tag.floats = {f.vertex(v)};
        }
    }
    for (Index face = 0; face < f.hole.size(); ++face) {
        if (f.hole[face])
            add("hole").ints = {static_cast<int>(face)};
    }
    // The holes at the border are named above: None would make more of them.
    if (open)
        add("interpolateboundary").ints = {f.boundary == BoundaryRule::EdgeAndCorner ? 1
                                                                                     : 2};
    if (f.creases == CreaseMethod::Chaikin)
        add("creasemethod").text = {"chaikin"};
    if (f.smooth_triangles)
        add("smoothtriangles").text = {"smooth"};
    return tags;
}

namespace {

/// The first interior vertex between two faces, from v on; kInvalidIndex if there is none.
Index next_fold(const Topology& t, Index v = 0) {
    for (v = t.find_valence(2, v); v != kInvalidIndex; v = t.find_valence(2, v + 1)) {
        if (!t.is_border(t.vertex_halfedge[v]))
            return v;
    }
    return kInvalidIndex;
}

/// Nothing sharp parts the faces around a vertex, and not all of them are holes.
bool is_flat(const Topology& t, const Features& f, Index v) {
    int n_sharp = 0;
    bool has_surface = false;
    t.for_each_outgoing(v, [&](Index h) {
        n_sharp += is_infinitely_sharp(f.edge(t.edge[h]));
        has_surface |= !f.is_hole(t.face(h));
    });
    return n_sharp < 2 && has_surface;
}

Status refuse_valence_two(const MeshView& view, Index v) {
    return fail(ErrorCode::ValenceTwo,
                fmt::format("vertex {} is interior and has two faces only", v), v,
                view.line_of_vertex(v));
}

/// Names the tag that asks for what is refused.
Status with_tag(const MeshData& data, Status refused) {
    if (refused || refused.error().code != ErrorCode::UnsupportedTag)
        return refused;
    const auto tag = std::ranges::find(data.tags, "smoothtriangles", &Tag::name);
    if (tag == data.tags.end())
        return refused;
    const auto i = static_cast<Index>(tag - data.tags.begin());
    return fail(
        ErrorCode::UnsupportedTag,
        fmt::format("tag {} is '{}', which even degrees do not take", i, tag->name), i,
        tag->line);
}

}  // namespace

Status check_refinement(const MeshView& view, const Topology& t, const Features& f,
                        int degree) {
    if (degree % 2 == 1)
        return ok();
    if (const Index v = next_fold(t); v != kInvalidIndex)
        return refuse_valence_two(view, v);
    if (!f.smooth_triangles)
        return ok();
    return fail(ErrorCode::UnsupportedTag,
                "triangles are to be smooth, which even degrees do not take");
}

Status check_refinement(const MeshData& data, const Topology& t, const Features& f,
                        int degree) {
    return with_tag(data, check_refinement(data.view(), t, f, degree));
}

Status check_surface(const MeshView& view, const Topology& t, const Features& features,
                     int degree) {
    Index v = next_fold(t);
    if (v != kInvalidIndex) {
        const ResolvedFeatures f = resolve(t, features);
        for (; v != kInvalidIndex; v = next_fold(t, v + 1)) {
            if (is_flat(t, f, v))
                return refuse_valence_two(view, v);
        }
    }
    return check_refinement(view, t, features, degree);
}

Status check_surface(const MeshData& data, const Topology& t, const Features& features,
                     int degree) {
    return with_tag(data, check_surface(data.view(), t, features, degree));
}

}  // namespace osdx::inline OSDX_ABI
