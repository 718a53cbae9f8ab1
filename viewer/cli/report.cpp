// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "viewer/cli/report.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <string_view>

#include <fmt/format.h>

#include <osdx/patch_class.h>

#include "viewer/cli/commands.h"
#include "viewer/render/patch_kind_name.h"

namespace osdx::cli {
namespace {

Index count_components(const Topology& t) {
    std::vector<bool> seen(t.n_faces(), false);
    std::vector<Index> stack;
    Index n = 0;
    for (Index start = 0; start < t.n_faces(); ++start) {
        if (seen[start])
            continue;
        ++n;
        seen[start] = true;
        stack.push_back(start);
        while (!stack.empty()) {
            const Index f = stack.back();
            stack.pop_back();
            for (Index h = t.face_offsets[f]; h < t.face_offsets[f + 1]; ++h) {
                if (t.is_border(h) || seen[t.face(t.twin[h])])
                    continue;
                seen[t.face(t.twin[h])] = true;
                stack.push_back(t.face(t.twin[h]));
            }
        }
    }
    return n;
}

Index count_boundary_loops(const Topology& t) {
    std::vector<bool> seen(t.n_halfedges(), false);
    Index n = 0;
    for (Index start = 0; start < t.n_halfedges(); ++start) {
        if (!t.is_border(start) || seen[start])
            continue;
        ++n;
        // A vertex of the border knows the border's halfedge that starts there.
        for (Index h = start; !seen[h]; h = t.vertex_halfedge[t.to_vertex(h)])
            seen[h] = true;
    }
    return n;
}

Json sharpness_report(const std::vector<double>& sharpness) {
    Index semi_sharp = 0, infinitely_sharp = 0;
    double largest = 0;
    for (const double s : sharpness) {
        if (is_infinitely_sharp(s)) {
            ++infinitely_sharp;
        } else if (s > 0) {
            ++semi_sharp;
            largest = std::max(largest, s);
        }
    }
    return {{"semi_sharp", semi_sharp},
            {"infinitely_sharp", infinitely_sharp},
            {"largest_sharpness", largest}};
}

/// "3 semi-sharp (up to 2.5), 1 infinitely sharp"; empty for none.
std::string one_line_of_sharpness(const Json& report) {
    std::string s;
    if (const auto n = report["semi_sharp"].get<Index>(); n > 0) {
        s = fmt::format("{} semi-sharp (up to {:g})", n,
                        report["largest_sharpness"].get<double>());
    }
    if (const auto n = report["infinitely_sharp"].get<Index>(); n > 0)
        s += fmt::format("{}{} infinitely sharp", s.empty() ? "" : ", ", n);
    return s;
}

/// By group and number of sectors, which is 0 where it is not told.
std::array<std::map<Index, Index>, render::kPatchKinds.size()> count_patches(
    const PatchTable& table, std::optional<int> level) {
    std::array<std::map<Index, Index>, render::kPatchKinds.size()> counts;
    for (Index i = 0; i < table.n_patches(); ++i) {
        if (level && table.patch(i).level != *level)
            continue;
        const PatchClass& c = table.class_of(i);
        const render::PatchKindName& group = render::name_of(c.kind, c.border);
        ++counts[&group - render::kPatchKinds.data()]
                [group.by_sectors() ? static_cast<Index>(c.n_sectors) : 0];
    }
    return counts;
}

}  // namespace

Json histogram(const std::map<Index, Index>& counts) {
    Json j = Json::object();
    for (const auto& [key, count] : counts)
        j[std::to_string(key)] = count;
    return j;
}

std::string one_line(const Json& histogram) {
    std::string s;
    for (const auto& [key, count] : histogram.items())
        s += fmt::format("{}{} x {}", s.empty() ? "" : ", ", count.get<Index>(), key);
    return s.empty() ? "none" : s;
}

Json mesh_report(std::size_t n_vertices, std::size_t n_faces,
                 std::size_t n_border_edges) {
    return {
        {"vertices", n_vertices}, {"faces", n_faces}, {"boundary_edges", n_border_edges}};
}

Json mesh_report(const Topology& t) {
    return mesh_report(
        t.n_vertices(), t.n_faces(),
        static_cast<std::size_t>(std::ranges::count(t.twin, kInvalidIndex)));
}

Json mesh_details(const Topology& t) {
    std::map<Index, Index> interior, border, sizes;
    Index n_used = 0;
    for (Index v = 0; v < t.n_vertices(); ++v) {
        const Index h = t.vertex_halfedge[v];
        if (h == kInvalidIndex)
            continue;
        ++n_used;
        ++(t.is_border(h) ? border : interior)[t.valence(v)];
    }
    for (Index f = 0; f < t.n_faces(); ++f)
        ++sizes[t.face_size(f)];
    Json report = mesh_report(t);
    report["edges"] = t.n_edges;
    report["closed"] = border.empty();
    report["boundary_loops"] = count_boundary_loops(t);
    report["components"] = count_components(t);
    report["euler"] = static_cast<long long>(n_used) - t.n_edges + t.n_faces();
    report["valences"] = histogram(interior);
    report["boundary_valences"] = histogram(border);
    report["face_sizes"] = histogram(sizes);
    return report;
}

Json feature_report(const Features& f) {
    return {{"creases", sharpness_report(f.edge_sharpness)},
            {"corners", sharpness_report(f.vertex_sharpness)},
            {"holes", std::ranges::count(f.hole, true)},
            {"boundary", kBoundaryRuleNames[static_cast<std::size_t>(f.boundary)]},
            {"crease_method", f.creases == CreaseMethod::Chaikin ? "chaikin" : "uniform"},
            {"smooth_triangles", f.smooth_triangles}};
}

std::string feature_lines(const Json& report, bool closed) {
    std::string lines;
    const auto add = [&](std::string_view name, const std::string& text) {
        if (!text.empty())
            lines += fmt::format("{:<11} {}\n", name, text);
    };
    add("creases:", one_line_of_sharpness(report["creases"]));
    add("corners:", one_line_of_sharpness(report["corners"]));
    if (const auto n = report["holes"].get<Index>(); n > 0)
        add("holes:", std::to_string(n));
    if (!closed)
        add("border:", report["boundary"].get<std::string>());
    if (report["crease_method"] != "uniform")
        add("method:", report["crease_method"].get<std::string>());
    if (report["smooth_triangles"].get<bool>())
        add("triangles:", "smooth");
    return lines;
}

Json patch_counts(const PatchTable& table, std::optional<int> level) {
    const auto counts = count_patches(table, level);
    Json report;
    for (std::size_t g = 0; g < render::kPatchKinds.size(); ++g) {
        if (counts[g].empty() && !render::kPatchKinds[g].always())
            continue;
        const std::string key(render::kPatchKinds[g].key);
        if (render::kPatchKinds[g].by_sectors())
            report[key] = histogram(counts[g]);
        else
            report[key] = counts[g].empty() ? 0 : counts[g].at(0);
    }
    return report;
}

std::string patch_summary(const PatchTable& table, std::optional<int> level) {
    const auto counts = count_patches(table, level);
    std::string s;
    for (std::size_t g = 0; g < render::kPatchKinds.size(); ++g) {
        for (const auto& [n_sectors, count] : counts[g]) {
            s += fmt::format("{}{} {}", s.empty() ? "" : ", ", count,
                             render::kPatchKinds[g].name);
            if (render::kPatchKinds[g].by_sectors())
                s += fmt::format("({})", n_sectors);
        }
    }
    return s.empty() ? "none" : s;
}

}  // namespace osdx::cli
