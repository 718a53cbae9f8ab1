// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <span>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include <osdx/features.h>
#include <osdx/resolved_features.h>

namespace osdx {
namespace {

/// The edges of a mesh by their vertices.
class EdgeFinder {
public:
    explicit EdgeFinder(const Topology& t) {
        edges_.reserve(t.n_edges);
        for (Index h = 0; h < t.n_halfedges(); ++h) {
            if (h < t.twin[h])
                edges_.push_back({std::minmax({t.vertex[h], t.to_vertex(h)}), t.edge[h]});
        }
        std::ranges::sort(edges_);
    }
    /// All edges of two vertices: faces that share two neighbouring edges may have several.
    std::span<const std::pair<std::pair<Index, Index>, Index>> find(Index a,
                                                                    Index b) const {
        const std::pair<Index, Index> vertices = std::minmax({a, b});
        const auto first = std::ranges::lower_bound(
            edges_, vertices, {}, [](const auto& e) { return e.first; });
        const auto last = std::find_if(
            first, edges_.end(), [&](const auto& e) { return e.first != vertices; });
        return {first, last};
    }

private:
    std::vector<std::pair<std::pair<Index, Index>, Index>> edges_;  // vertices, edge
};

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
        return fail(code, fmt::format("tag {} is '{}' {}", number, tag.name, why), number,
                    tag.line);
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
        if (!edges_)
            edges_.emplace(topology_);
        const auto found = edges_->find(static_cast<Index>(tag.ints[0]),
                                        static_cast<Index>(tag.ints[1]));
        if (found.empty()) {
            return refuse(number,
                          fmt::format("of vertices {} and {}, which share no edge",
                                      tag.ints[0], tag.ints[1]));
        }
        features_.edge_sharpness.resize(topology_.n_edges);
        for (const auto& [vertices, e] : found)
            features_.edge_sharpness[e] = sharpness(tag, 0);
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
    std::optional<EdgeFinder> edges_;
};

}  // namespace

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

Status refuse_valence_two(const MeshData& data, Index v) {
    return fail(ErrorCode::ValenceTwo,
                fmt::format("vertex {} is interior and has two faces only", v), v,
                data.line_of_vertex(v));
}

}  // namespace

Status check_refinement(const MeshData& data, const Topology& t, const Features& f,
                        int degree) {
    if (degree % 2 == 1)
        return ok();
    if (const Index v = next_fold(t); v != kInvalidIndex)
        return refuse_valence_two(data, v);
    if (!f.smooth_triangles)
        return ok();
    const auto tag = std::ranges::find(data.tags, "smoothtriangles", &Tag::name);
    const auto i = static_cast<Index>(tag - data.tags.begin());
    return fail(
        ErrorCode::UnsupportedTag,
        fmt::format("tag {} is '{}', which even degrees do not take", i, tag->name), i,
        tag->line);
}

Status check_surface(const MeshData& data, const Topology& t, const Features& features,
                     int degree) {
    Index v = next_fold(t);
    if (v != kInvalidIndex) {
        const ResolvedFeatures f = resolve(t, features);
        for (; v != kInvalidIndex; v = next_fold(t, v + 1)) {
            if (is_flat(t, f, v))
                return refuse_valence_two(data, v);
        }
    }
    return check_refinement(data, t, features, degree);
}

}  // namespace osdx
