// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <fstream>
#include <ostream>

#include "eval/patch_basis.h"
#include "osd_ext/export.h"
#include "viewer/commands.h"
#include "viewer/job.h"
#include "viewer/progress.h"

namespace osdx {
namespace {

// ------------------------------------------------------------------ patch

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

Result<Net> read_net(const std::filesystem::path& file) {
    std::ifstream in(file);
    if (!in)
        return in_file(fail(ErrorCode::FileUnreadable, "the file cannot be opened"),
                       file);
    const Json j = Json::parse(in, nullptr, false);
    if (j.is_discarded() || !j.is_object())
        return bad_net(file, "this is no JSON object");
    Net net;
    const std::string kind = j.contains("kind") && j["kind"].is_string()
                                 ? j["kind"].get<std::string>()
                                 : std::string();
    if (kind != "EV" && kind != "EF")
        return bad_net(file, "'kind' is not \"EV\" or \"EF\"");
    net.patch_class.kind = kind == "EV" ? PatchKind::EV : PatchKind::EF;
    if (!read_int(j, "d", kMinDegree, kMaxDegree, net.patch_class.degree))
        return bad_net(
            file, fmt::format("'d' is no degree from {} to {}", kMinDegree, kMaxDegree));
    if (!read_int(j, "n", 3, 100000, net.patch_class.n_sectors))
        return bad_net(file, "'n' is no number of sides from 3 to 100000");
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

Json evaluate_sample(const PatchBasis& basis, const Net& net, const Vec2<double>& xy) {
    std::array<Jet<double, 2>, 3> sums;
    const Jet<double, 2> f = basis.for_each_weight<2>(
        basis.from_native(xy), Chart::Native, [&](Index i, const Jet<double, 2>& w) {
            for (int c = 0; c < 3; ++c)
                sums[c] += net.control[i][c] * w;
        });
    Json sample = {{"xy", {xy.x, xy.y}}};
    constexpr std::array kNames = {"pos", "dx", "dy", "dxx", "dxy", "dyy"};
    constexpr std::array kFactorials = {1, 1, 1, 2, 1, 2};
    for (auto& s : sums)
        s = s / f;
    for (std::size_t r = 0; r < kNames.size(); ++r) {
        for (const auto& s : sums)
            sample[kNames[r]].push_back(kFactorials[r] * s.c[r]);
    }
    sample["f"] = f.c[0];
    return sample;
}

// ------------------------------------------------------------------ eval

template <class T>
bool parse_field(std::string_view& line, char end, T& value) {
    while (!line.empty() && line.front() == ' ')
        line.remove_prefix(1);
    const auto [next, error] =
        std::from_chars(line.data(), line.data() + line.size(), value);
    if (error != std::errc())
        return false;
    line.remove_prefix(static_cast<std::size_t>(next - line.data()));
    while (!line.empty() && (line.front() == ' ' || line.front() == '\r'))
        line.remove_prefix(1);
    if (end == 0)
        return line.empty();
    if (line.empty() || line.front() != end)
        return false;
    line.remove_prefix(1);
    return true;
}

Result<std::vector<Address>> read_addresses(const std::filesystem::path& file,
                                            const PatchTable& patches) {
    const Index n_faces = patches.base().n_faces();
    std::ifstream in(file);
    if (!in)
        return in_file(fail(ErrorCode::FileUnreadable, "the file cannot be opened"),
                       file);
    std::vector<Address> addresses;
    std::string text;
    for (Index line = 1; std::getline(in, text); ++line) {
        std::string_view rest = text;
        if (!rest.empty() && rest.back() == '\r')
            rest.remove_suffix(1);
        if (line == 1) {
            if (rest != "face,u,v") {
                return in_file(fail(ErrorCode::FileFormat, "the header is not 'face,u,v'",
                                    kInvalidIndex, line),
                               file);
            }
            continue;
        }
        if (rest.empty())
            continue;
        Address a;
        if (!parse_field(rest, ',', a.face) || !parse_field(rest, ',', a.u) ||
            !parse_field(rest, 0, a.v) || !std::isfinite(a.u) || !std::isfinite(a.v)) {
            return in_file(
                fail(ErrorCode::FileFormat,
                     fmt::format("'{}' is no face number with finite u and v", text),
                     kInvalidIndex, line),
                file);
        }
        if (a.face >= n_faces) {
            return in_file(
                fail(ErrorCode::IndexOutOfRange,
                     fmt::format("there is no face {}: the mesh has {}", a.face, n_faces),
                     a.face, line),
                file);
        }
        if (!patches.has_surface(a.face)) {
            return in_file(
                fail(ErrorCode::IndexOutOfRange,
                     fmt::format("face {} is a hole: there is no surface", a.face),
                     a.face, line),
                file);
        }
        addresses.push_back(a);
    }
    if (addresses.empty())
        return in_file(fail(ErrorCode::FileFormat, "the file has no points"), file);
    return addresses;
}

}  // namespace

Status patch_command(const CommandOptions& options) {
    const Result<Net> net = read_net(options.input);
    if (!net)
        return net.error();
    const PatchBasis basis(net->patch_class);
    Json samples = Json::array();
    for (const Vec2<double>& xy : net->samples)
        samples.push_back(evaluate_sample(basis, *net, xy));
    const Json report = {{"kind", net->patch_class.kind == PatchKind::EV ? "EV" : "EF"},
                         {"n", net->patch_class.n_sectors},
                         {"d", net->patch_class.degree},
                         {"samples", samples}};
    const Status s = write_file(
        options.out, [&](std::ostream& out) { out << report.dump(1) << '\n'; });
    if (!s)
        return in_file(s.error(), options.out);
    return write_report(options, report);
}

Status eval_command(const CommandOptions& options) {
    Progress progress;
    progress.stage("laying patches");
    const Result<Job> job = load_job(options);
    if (!job)
        return job.error();
    const Topology& base = job->surface.base();
    const Result<std::vector<Address>> at =
        read_addresses(options.at, job->surface.patches());
    if (!at)
        return at.error();
    progress.stage("evaluating");
    const SurfaceFunction surface = job->function(),
                          native = job->function(Chart::Native);
    const Status s = write_file(options.out, [&](std::ostream& out) {
        out << "face,u,v,x,y,z,dux,duy,duz,dvx,dvy,dvz,duux,duuy,duuz,duvx,duvy,duvz,"
               "dvvx,dvvy,dvvz,nx,ny,nz,mean,gauss\n";
        for (const Address& a : *at) {
            const QuarterPoint q = to_quarter(base, a);
            const SurfaceJet<double> jet = surface(q), in_chart = native(q);
            const Vec3<double> n = normal(in_chart);
            const Curvature<double> c = curvature(in_chart);
            out << fmt::format("{},{:.17g},{:.17g}", a.face, a.u, a.v);
            for (const auto& v : {jet.p, jet.du, jet.dv, jet.duu, jet.duv, jet.dvv, n})
                out << fmt::format(",{:.17g},{:.17g},{:.17g}", v.x, v.y, v.z);
            out << fmt::format(",{:.17g},{:.17g}\n", c.mean, c.gauss);
        }
    });
    if (!s)
        return in_file(s.error(), options.out);
    return write_report(options, {{"points", at->size()}});
}

}  // namespace osdx
