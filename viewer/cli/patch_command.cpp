// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <array>
#include <cmath>
#include <ostream>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <osdx/build_topology.h>
#include <osdx/features.h>
#include <osdx/file.h>
#include <osdx/patch_class.h>
#include <osdx/resolved_features.h>
#include <osdx/topology.h>

#include "eval/bases/gregory.h"
#include "eval/bases/patch_basis.h"
#include "far/patches/gregory_net.h"
#include "viewer/cli/commands.h"
#include "viewer/cli/job.h"
#include "viewer/cli/progress.h"

namespace osdx::cli {
namespace {

/// A control net file, checked.
struct Net {
    PatchClass patch_class;
    std::vector<Vec3<double>> control;
    std::vector<Vec2<double>> samples;
};

Error bad_net(const std::filesystem::path& file, const std::string& reason) {
    return in_file(fail(ErrorCode::FileFormat, reason), file);
}

template <int N>
bool read_numbers(const Json& j, double* out) {
    if (!j.is_array() || j.size() != N)
        return false;
    for (int i = 0; i < N; ++i) {
        if (!j[i].is_number())
            return false;
        out[i] = j[i].get<double>();
        if (!std::isfinite(out[i]))
            return false;
    }
    return true;
}

bool read_int(const Json& j, const char* key, int least, int most, int& out) {
    if (!j.contains(key) || !j[key].is_number_integer())
        return false;
    const auto value = j[key].get<std::int64_t>();
    out = static_cast<int>(value);
    return value >= least && value <= most;
}

/// No net nests deeper than some levels, but functions that call themselves for each would run
/// out of stack.
constexpr int kMostLevels = 100;

Result<Json> read_json(const std::filesystem::path& file) {
    const Result<std::string> text = read_file(file);
    if (!text)
        return in_file(text.error(), file);
    bool too_deep = false;
    const auto keep = [&](int depth, Json::parse_event_t, const Json&) {
        too_deep = too_deep || depth > kMostLevels;
        return !too_deep;
    };
    Json j = Json::parse(*text, keep, false);
    if (too_deep)
        return bad_net(file, fmt::format("the JSON nests deeper than {}", kMostLevels));
    if (j.is_discarded() || !j.is_object())
        return bad_net(file, "this is no JSON object");
    return j;
}

/// An array of N-tuples of finite numbers.
template <int N, class Point>
Status read_points(const Json& j, const std::string& name, std::vector<Point>& points) {
    if (!j.is_array())
        return fail(ErrorCode::FileFormat, fmt::format("'{}' is not an array", name));
    for (const Json& p : j) {
        double x[N];
        if (!read_numbers<N>(p, x)) {
            return fail(
                ErrorCode::FileFormat,
                fmt::format("'{}' {} is not {} finite numbers", name, points.size(), N));
        }
        Point& point = points.emplace_back();
        for (int i = 0; i < N; ++i)
            point[i] = x[i];
    }
    return ok();
}

Result<Net> read_net(const Json& j, const std::filesystem::path& file) {
    Net net;
    const std::string kind = j.contains("kind") && j["kind"].is_string()
                                 ? j["kind"].get<std::string>()
                                 : std::string();
    if (kind != "EV" && kind != "EF")
        return bad_net(file, "there is no 'mesh', and 'kind' is not \"EV\" or \"EF\"");
    net.patch_class.kind = kind == "EV" ? PatchKind::EV : PatchKind::EF;
    if (!read_int(j, "d", kMinDegree, kMaxDegree, net.patch_class.degree))
        return bad_net(
            file, fmt::format("'d' is no degree from {} to {}", kMinDegree, kMaxDegree));
    const std::string border = j.contains("border") && j["border"].is_string()
                                   ? j["border"].get<std::string>()
                                   : std::string();
    if (!border.empty()) {
        // The names say what of a polygon the sectors are.
        const bool smooth = border == "smooth";
        if (!smooth && border != "pinned, half" && border != "pinned, triangle")
            return bad_net(file,
                           "'border' is not \"smooth\", \"pinned, half\" or "
                           "\"pinned, triangle\"");
        net.patch_class.border = smooth ? PatchBorder::Smooth : PatchBorder::Pinned;
    }
    if (j.contains("shape") && j["shape"] != "thesis")
        return bad_net(file, "'shape' is not \"thesis\"");
    const char* const sectors = border.empty() ? "n" : "n_sectors";
    const int least = border.empty() ? 3 : 1;
    if (!read_int(j, sectors, least, 100000, net.patch_class.n_sectors))
        return bad_net(file, fmt::format("'{}' is no number of sides from {} to 100000",
                                         sectors, least));
    if (border == "pinned, triangle" && net.patch_class.n_sectors > 1)
        return bad_net(file, "only one sector has a triangle");
    const auto n_points = static_cast<std::size_t>(net.patch_class.n_points());
    if (!j.contains("control") || !j["control"].is_array() ||
        j["control"].size() != n_points)
        return bad_net(file,
                       fmt::format("'control' is not an array of {} points", n_points));
    for (const Json& p : j["control"]) {
        double x[3];
        if (!read_numbers<3>(p, x)) {
            return bad_net(file,
                           fmt::format("control point {} is not three finite numbers",
                                       net.control.size()));
        }
        net.control.emplace_back(x[0], x[1], x[2]);
    }
    if (!j.contains("samples") || !j["samples"].is_array())
        return bad_net(file, "'samples' is not an array");
    for (const Json& s : j["samples"]) {
        double x[2];
        if (!s.is_object() || !s.contains("xy") || !read_numbers<2>(s["xy"], x)) {
            return bad_net(file,
                           fmt::format("sample {} has no 'xy' of two finite numbers",
                                       net.samples.size()));
        }
        net.samples.emplace_back(x[0], x[1]);
    }
    return net;
}

/// A mesh whose face 0 becomes a Gregory patch, and where it is asked for.
struct GregoryNet {
    MeshData mesh;
    std::vector<Vec2<double>> paper, tuned;  ///< samples
};

Status read_index(const Json& j, const std::string& name, std::size_t end, Index& out) {
    if (!j.is_number_integer() || j.get<std::int64_t>() < 0 ||
        static_cast<std::size_t>(j.get<std::int64_t>()) >= end) {
        return fail(ErrorCode::IndexOutOfRange,
                    fmt::format("'{}' names vertex {}, but the mesh has {}", name,
                                j.dump(), end));
    }
    out = j.get<Index>();
    return ok();
}

Status read_small_mesh(const Json& j, MeshData& mesh) {
    if (!j.is_object() || !j.contains("vertices") || !j.contains("faces") ||
        !j["faces"].is_array())
        return fail(ErrorCode::FileFormat, "'mesh' has no vertices and faces");
    if (const Status s = read_points<3>(j["vertices"], "vertices", mesh.positions); !s)
        return s;
    const std::size_t n = mesh.positions.size();
    for (const Json& f : j["faces"]) {
        if (!f.is_array())
            return fail(ErrorCode::FileFormat, "a face is not an array of vertices");
        mesh.face_sizes.push_back(static_cast<Index>(f.size()));
        for (const Json& v : f) {
            if (const Status s =
                    read_index(v, "faces", n, mesh.face_vertices.emplace_back());
                !s)
                return s;
        }
    }
    if (!j.contains("inf_creases"))
        return ok();
    if (!j["inf_creases"].is_array())
        return fail(ErrorCode::FileFormat, "'inf_creases' is not an array");
    for (const Json& e : j["inf_creases"]) {
        if (!e.is_array() || e.size() != 2)
            return fail(ErrorCode::FileFormat, "a crease is not two vertices");
        Tag& tag = mesh.tags.emplace_back();
        tag.name = "crease";
        tag.floats = {kInfinitelySharp};
        for (const Json& v : e) {
            Index i = 0;
            if (const Status s = read_index(v, "inf_creases", n, i); !s)
                return s;
            tag.ints.push_back(static_cast<int>(i));
        }
    }
    return ok();
}

Result<GregoryNet> read_gregory_net(const Json& j) {
    GregoryNet net;
    if (const Status s = read_small_mesh(j["mesh"], net.mesh); !s)
        return s.error();
    for (const bool is_paper : {true, false}) {
        const std::string name = is_paper ? "paper" : "tuned";
        if (!j.contains(name) || !j[name].is_object() || !j[name].contains("domain"))
            return fail(ErrorCode::FileFormat, fmt::format("'{}' has no 'domain'", name));
        if (const Status s = read_points<2>(j[name]["domain"], name + ".domain",
                                            is_paper ? net.paper : net.tuned);
            !s)
            return s.error();
    }
    return net;
}

Json to_json(const Vec3<double>& p) {
    return {p.x, p.y, p.z};
}

using PointJet = std::array<Jet<double, 2>, 3>;

/// The surface with derivatives at a point of the native chart; f, if asked for, is the sum
/// of the weights.
template <class Basis>
PointJet evaluate(const Basis& basis, const std::vector<Vec3<double>>& control,
                  const Vec2<double>& xy, double* sum_of_weights = nullptr) {
    PointJet sums;
    const Jet<double, 2> f = basis.template for_each_weight<2>(
        basis.from_native(xy), Chart::Native, [&](Index i, const Jet<double, 2>& w) {
            for (int c = 0; c < 3; ++c)
                sums[c] += control[i][c] * w;
        });
    for (auto& s : sums)
        s = s / f;
    if (sum_of_weights)
        *sum_of_weights = f.c[0];
    return sums;
}

/// Derivative r of 0, x, y, xx, xy, yy.
Json derivative(const PointJet& jet, std::size_t r) {
    constexpr std::array kFactorials = {1, 1, 1, 2, 1, 2};
    Json j = Json::array();
    for (const auto& s : jet)
        j.push_back(kFactorials[r] * s.c[r]);
    return j;
}

Json evaluate_net(const Net& net) {
    const PatchBasis basis(net.patch_class);
    constexpr std::array kNames = {"pos", "dx", "dy", "dxx", "dxy", "dyy"};
    Json samples = Json::array();
    for (const Vec2<double>& xy : net.samples) {
        Json sample = {{"xy", {xy.x, xy.y}}};
        double f = 0;
        const PointJet jet = evaluate(basis, net.control, xy, &f);
        for (std::size_t r = 0; r < kNames.size(); ++r)
            sample[kNames[r]] = derivative(jet, r);
        sample["f"] = f;
        samples.push_back(std::move(sample));
    }
    return {{"kind", net.patch_class.kind == PatchKind::EV ? "EV" : "EF"},
            {"n", net.patch_class.n_sectors},
            {"d", net.patch_class.degree},
            {"samples", samples}};
}

Result<Json> evaluate_gregory(const GregoryNet& net) {
    const Result<Topology> built = build_topology(net.mesh);
    if (!built)
        return built.error();
    const Topology& topology = *built;
    const Result<Features> tagged = build_features(net.mesh, topology);
    if (!tagged)
        return tagged.error();
    const ResolvedFeatures features = resolve(topology, *tagged);
    if (const Status s = check_gregory(net.mesh, topology, features); !s)
        return s.error();
    const auto n = static_cast<int>(topology.face_size(0));
    const GregoryBasis basis(n);
    Json report = {{"face", 0}, {"n", n}};
    for (const bool is_paper : {true, false}) {
        const StencilTable rows =
            gregory_points(topology, features, 0,
                           {.tangents = is_paper ? paper_tangents : tuned_tangents});
        std::vector<Vec3<double>> control(rows.n_rows());
        rows.apply<Vec3<double>>(net.mesh.positions, control);

        Json& patch = report[is_paper ? "paper" : "tuned"];
        for (int i = 0; i < n; ++i) {
            for (int k = 0; k < GregoryBasis::kPerCorner; ++k)
                patch["control"][i].push_back(
                    to_json(control[i * GregoryBasis::kPerCorner + k]));
        }
        if (basis.has_centre())
            patch["centre_point"] = to_json(control.back());
        constexpr std::array kNames = {"pos", "d1", "d2", "d11", "d12", "d22"};
        for (const char* name : kNames)
            patch[name] = Json::array();
        patch["domain"] = Json::array();
        for (const Vec2<double>& xy : is_paper ? net.paper : net.tuned) {
            patch["domain"].push_back({xy.x, xy.y});
            const PointJet jet = evaluate(basis, control, xy);
            for (std::size_t r = 0; r < kNames.size(); ++r)
                patch[kNames[r]].push_back(derivative(jet, r));
        }
    }
    return report;
}

Result<Json> evaluate_patch_file(const std::filesystem::path& file) {
    const Result<Json> json = read_json(file);
    if (!json)
        return json.error();
    if (!json->contains("mesh")) {
        const Result<Net> net = read_net(*json, file);
        if (!net)
            return net.error();
        return evaluate_net(*net);
    }
    const Result<GregoryNet> net = read_gregory_net(*json);
    if (!net)
        return in_file(net.error(), file);
    Result<Json> report = evaluate_gregory(*net);
    if (!report)
        return in_file(report.error(), file);
    return report;
}

}  // namespace

Status patch_command(const CommandOptions& options) {
    const ProgressBar progress(options);
    const Result<Json> evaluated = evaluate_patch_file(options.input);
    if (!evaluated)
        return evaluated.error();
    const Json& report = *evaluated;
    const Status s = write_file(
        options.out, [&](std::ostream& out) { out << to_text(report, 1) << '\n'; });
    if (!s)
        return in_file(s.error(), options.out);
    return write_report(options, report, progress);
}

}  // namespace osdx::cli
