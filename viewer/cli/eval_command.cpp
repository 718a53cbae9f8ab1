// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <charconv>
#include <cmath>
#include <ostream>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <osdx/file.h>
#include <osdx/patch_table.h>
#include <osdx/surface_function.h>
#include <osdx/topology.h>

#include "viewer/cli/commands.h"
#include "viewer/cli/job.h"
#include "viewer/cli/progress.h"

namespace osdx::cli {
namespace {

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

/// Addresses that are beyond the domains of their faces.
class OutsideFaces {
public:
    explicit OutsideFaces(const Topology& base) : base_(base) {}

    void look_at(const Address& a, Index line) {
        const Address nearest = to_address(base_, to_quarter(base_, a));
        // Rounding of a text with six digits moves nothing that anybody sees.
        constexpr double kTolerance = 1e-6;
        if (std::max(std::abs(nearest.u - a.u), std::abs(nearest.v - a.v)) <= kTolerance)
            return;
        if (n_++ > 0)
            return;
        first_ = {WarningCode::OutsideFace,
                  fmt::format("({}, {}) is outside of face {} and taken as ({}, {})", a.u,
                              a.v, a.face, nearest.u, nearest.v),
                  line};
    }

    void tell(const std::filesystem::path& file, ProgressBar& progress) {
        if (n_ == 0)
            return;
        first_.message += fmt::format("; {} rows are so", n_);
        warn(first_, file, progress);
    }

private:
    const Topology& base_;
    std::size_t n_ = 0;
    Warning first_{};
};

Result<std::vector<Address>> read_addresses(const std::filesystem::path& file,
                                            const PatchTable& patches,
                                            ProgressBar& progress) {
    const Index n_faces = patches.base().n_faces();
    Result<std::string> content = read_file(file);
    if (!content)
        return in_file(content.error(), file);
    std::istringstream in(std::move(*content));
    std::vector<Address> addresses;
    OutsideFaces outside(patches.base());
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
        outside.look_at(a, line);
        addresses.push_back(a);
    }
    if (addresses.empty())
        return in_file(fail(ErrorCode::FileFormat, "the file has no points"), file);
    outside.tell(file, progress);
    return addresses;
}

}  // namespace

Status eval_command(const CommandOptions& options) {
    ProgressBar progress(options);
    progress.stage("laying patches");
    const Result<Job> job = load_job(options, progress);
    if (!job)
        return job.error();
    const Topology& base = job->surface.base();
    const Result<std::vector<Address>> at =
        read_addresses(options.at, job->surface.patches(), progress);
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
    return write_report(options, {{"points", at->size()}}, progress);
}

}  // namespace osdx::cli
