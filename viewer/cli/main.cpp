// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <exception>
#include <filesystem>
#include <functional>
#include <iostream>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fcntl.h>
#include <fmt/format.h>

#include <osdx/file.h>
#include <osdx/opensubdiv/limit_surface.h>
#include <osdx/threads.h>
#include <osdx/types.h>
#include <osdx/version.h>

#include "viewer/cli/commands.h"
#include "viewer/cli/job.h"
#include "viewer/cli/pictures.h"
#include "viewer/render/picture.h"

namespace {

constexpr int kBadInput = 1;
constexpr int kBadUsage = 2;

namespace cli = osdx::cli;

using cli::CommandOptions;
using Command = osdx::Status (*)(const CommandOptions&);

/// Options that several subcommands share.
struct Parser {
    CLI::App app{"osdx: smooth surfaces over polygon meshes of any topology"};
    CommandOptions options;
    Command command = nullptr;
    int n_threads = 0;  ///< 0: as many as there are

    /// Options of the program and of each subcommand, so that they may stand before and after it.
    void common(CLI::App* to) {
        to->set_version_flag("--version",
                             fmt::format("osdx {}.{}.{}", OSDX_VERSION_MAJOR,
                                         OSDX_VERSION_MINOR, OSDX_VERSION_PATCH),
                             "print the version and exit");
        to->add_option("--threads", n_threads, "take no more than so many [all]")
            ->check(CLI::Range(1, 1 << 16))
            ->take_last();
        to->add_flag("--quiet", options.quiet,
                     "print nothing but errors: no report, no warnings, no progress");
    }
    CLI::App* add(const std::string& name, const std::string& help, Command run) {
        CLI::App* sub = app.add_subcommand(name, help);
        sub->add_option("--json", options.json,
                        "write the report to this file; -: to stdout")
            ->take_last();
        common(sub);
        sub->callback([this, run] { command = run; });
        return sub;
    }
    /// \param formats  of --format, for the mesh and for what is written in such formats
    void mesh(CLI::App* sub,
              const std::vector<std::string>& formats = {"obj", "off", "ply"}) {
        sub->add_option("--format", options.format,
                        "of stdin and stdout, and of files whose names do not tell")
            ->check(CLI::IsMember(formats))
            ->take_last();
        sub->add_option("MESH", options.input,
                        "an OBJ, OFF or PLY file; -: stdin, with --format")
            ->required();
        sub->add_flag("--ignore-tags", options.features.ignore_tags,
                      "take the mesh as if it had no tags (creases, corners, holes)");
        sub->add_flag(
            "--repair", options.repair,
            "make a mesh of what is none: near points become one, small faces "
            "go, orientations agree, edges and vertices of several sheets part");
        sub->add_option(
               "--weld", options.weld,
               "points so near become one; over the diagonal of the bounding box "
               "[1e-6 with --repair]")
            ->check(CLI::Range(0.0, 1.0));
        sub->add_option(
               "--crease-angle", options.crease_angle,
               "edges whose faces' normals differ by more degrees are infinitely "
               "sharp, beside the mesh's tags")
            ->check(CLI::Range(0.0, 180.0));
        static constexpr auto& rules = cli::kBoundaryRuleNames;
        sub->add_option_function<std::string>(
               "--boundary",
               [this](const std::string& name) {
                   const auto at = std::ranges::find(rules, name) - rules.begin();
                   options.features.boundary = static_cast<osdx::BoundaryRule>(at);
               },
               "none: no surface at the border; edge-only: border curves; "
               "edge-and-corner: pinned to corners too [the mesh's tag, or edge-only]")
            ->check(CLI::IsMember(std::vector<std::string>(rules.begin(), rules.end())));
    }
    void degree(CLI::App* sub) {
        sub->add_option("--degree", options.patches.degree, "of the B-splines")
            ->check(CLI::Range(osdx::kMinDegree, osdx::kMaxDegree))
            ->capture_default_str();
    }
    /// \param with_limit  catmark, too
    void patch(CLI::App* sub, bool with_limit) {
        std::vector<std::string> names = {"multisided", "gregory"};
        std::string text = "multisided, or gregory: one patch for each face, of degree 3";
        if (with_limit) {
            names.emplace_back("catmark");
            text += "; or catmark: the Catmull-Clark limit of OpenSubdiv";
        }
        sub->add_option("--patch", options.patch, text)
            ->check(CLI::IsMember(names))
            ->capture_default_str();
        sub->add_option("--levels", options.patches.gregory.levels,
                        "steps of refinement before Gregory patches")
            ->check(CLI::Range(0, 10))
            ->capture_default_str();
        sub->add_flag("--uniform", options.patches.gregory.uniform,
                      "refine everywhere for Gregory patches, not only where needed");
        sub->add_flag("--paper-tangents", options.patches.gregory.paper_tangents,
                      "Gregory patches with tangents of the eigenvectors' length");
        sub->add_flag("--normalised", options.patches.gregory.normalised,
                      "Gregory patches without centre points, divided by their weights");
    }
    void uv_rule(CLI::App* sub) {
        static constexpr std::array<std::string_view, 6> kNames = {
            "none",          "corners-only", "corners-plus1",
            "corners-plus2", "boundaries",   "all"};
        static constexpr std::array kRules = {
            osdx::FaceVaryingRule::None,         osdx::FaceVaryingRule::CornersOnly,
            osdx::FaceVaryingRule::CornersPlus1, osdx::FaceVaryingRule::CornersPlus2,
            osdx::FaceVaryingRule::Boundaries,   osdx::FaceVaryingRule::All};
        sub->add_option_function<std::string>(
               "--uv-rule",
               [this](const std::string& name) {
                   const auto at = std::ranges::find(kNames, name) - kNames.begin();
                   options.uv_rule = kRules[static_cast<std::size_t>(at)];
               },
               "where texture coordinates are linear, as OpenSubdiv's FVAR_LINEAR: none "
               "to all [the mesh's tag, or all]")
            ->check(
                CLI::IsMember(std::vector<std::string>(kNames.begin(), kNames.end())));
    }
    void out(CLI::App* sub, const std::string& help) {
        sub->add_option("--out", options.out, help + "; -: stdout")
            ->required()
            ->take_last();
    }
    /// \param names  of formats; without --out-format it is that of the name or of --format
    void out_format(CLI::App* sub, const std::vector<std::string>& names) {
        sub->add_option("--out-format", options.out_format, "of --out, whatever its name")
            ->check(CLI::IsMember(names))
            ->take_last();
    }
    CLI::Option* rate(CLI::App* sub, int least) {
        return sub->add_option("--rate", options.rate, "segments of each mesh edge")
            ->check(CLI::Range(least, 1024))
            ->capture_default_str();
    }
};

void define(Parser& p) {
    p.app.require_subcommand(1);
    p.common(&p.app);

    CLI::App* info =
        p.add("info", "what a mesh holds and which patches it takes", cli::info_command);
    p.mesh(info);
    p.degree(info);
    p.patch(info, false);

    CLI::App* subdivide =
        p.add("subdivide", "refine a mesh uniformly", cli::subdivide_command);
    p.mesh(subdivide);
    p.degree(subdivide);
    subdivide->add_option("--levels", p.options.levels, "refinement steps")
        ->check(CLI::Range(0, 12))
        ->capture_default_str();
    p.uv_rule(subdivide);
    p.out(subdivide,
          "the refined mesh: OBJ (with the tags that are left and, for odd degrees, the "
          "texture coordinates), OFF or PLY");
    p.out_format(subdivide, {"obj", "off", "ply"});

    CLI::App* patch = p.add("patch", "evaluate one patch from its control net or mesh",
                            cli::patch_command);
    patch
        ->add_option("NET", p.options.input,
                     "a JSON file: kind, n, d, control, samples; or mesh, paper, tuned; "
                     "-: stdin")
        ->required();
    p.out(patch, "the samples with their derivatives: JSON");

    CLI::App* eval = p.add("eval", "evaluate points of a surface", cli::eval_command);
    p.mesh(eval);
    p.degree(eval);
    p.patch(eval, true);
    eval->add_option("--at", p.options.at, "CSV with the header face,u,v; -: stdin")
        ->required();
    p.out(eval, "CSV: position, derivatives, normal, curvatures");

    CLI::App* tessellate =
        p.add("tessellate", "a watertight mesh of the surface", cli::tessellate_command);
    p.mesh(tessellate, {"obj", "off", "ply", "stl", "glb"});
    p.degree(tessellate);
    p.patch(tessellate, true);
    CLI::Option* rate = p.rate(tessellate, 1);
    const CLI::Validator positive(
        [](const std::string& text) {
            double x = 0;
            return CLI::detail::lexical_cast(text, x) && x > 0 && std::isfinite(x)
                       ? std::string()
                       : text + " is no positive number";
        },
        "POSITIVE");
    const auto measured = [&](const std::string& name, std::optional<double>& to,
                              const std::string& help) {
        return tessellate->add_option(name, to, help)->check(positive);
    };
    CLI::Option* length = measured("--edge-length", p.options.edge_length,
                                   "segments of about this length, instead of --rate; "
                                   "over the diagonal of the mesh's bounding box");
    measured("--error", p.options.error,
             "facets about so far from the surface, instead of --rate; over the diagonal "
             "of the mesh's bounding box")
        ->excludes(rate)
        ->excludes(length);
    length->excludes(rate);
    tessellate
        ->add_option("--max-rate", p.options.max_rate,
                     "no edge has more segments by --edge-length or --error")
        ->check(CLI::Range(1, 1024))
        ->capture_default_str();
    CLI::Option* displace = tessellate->add_option(
        "--displace", p.options.displace,
        "a PNG file of 8 or 16 bits: points move along their normals "
        "by its grey at their texture coordinates; black stays");
    tessellate
        ->add_option("--displace-scale", p.options.displace_scale,
                     "how far white moves, over the diagonal of the mesh's bounding box; "
                     "below 0: inwards")
        ->check([](const std::string& text) {
            double x = 0;
            return CLI::detail::lexical_cast(text, x) && std::isfinite(x)
                       ? std::string()
                       : text + " is no number";
        })
        ->needs(displace)
        ->capture_default_str();
    p.uv_rule(tessellate);
    p.out(tessellate, "OBJ, PLY, STL or GLB");
    p.out_format(tessellate, {"obj", "ply", "stl", "glb"});

    CLI::App* compare =
        p.add("compare", "distance to the Catmull-Clark limit, and continuity",
              cli::compare_command);
    p.mesh(compare);
    p.degree(compare);
    p.patch(compare, false);  // the limit surface is the other side of the comparison
    compare
        ->add_option(
            "--with", p.options.with,
            "a second family of patches, measured as well and against the first; "
            "or catmark: OpenSubdiv's patches at a low isolation")
        ->check(CLI::IsMember({"multisided", "gregory", "catmark"}));
    compare
        ->add_option("--with-isolation", p.options.with_isolation,
                     "refinement of OpenSubdiv's patches in --with catmark")
        ->check(CLI::Range(1, osdx::LimitSurface::kMaxIsolation))
        ->capture_default_str();
    p.rate(compare, 2);
    compare->add_option("--images", p.options.images, "a folder for pictures");
    compare
        ->add_option("--isolation", p.options.limit_isolation,
                     "refinement of the limit surface at irregular points")
        ->check(CLI::Range(1, osdx::LimitSurface::kMaxIsolation - 2))
        ->capture_default_str();

    CLI::App* render = p.add("render", "a picture traced by Embree", cli::render_command);
    p.mesh(render);
    p.degree(render);
    p.patch(render, true);
    p.uv_rule(render);
    p.out(render, "a PNG file");
    render
        ->add_option_function<std::vector<int>>(
            "--size",
            [&p](const std::vector<int>& wh) {
                p.options.width = wh[0];
                p.options.height = wh[1];
            },
            "width and height in pixels")
        ->expected(2)
        ->check(CLI::Range(16, 16384));
    render->add_option("--shade", p.options.shade, "what the colours show")
        ->check(CLI::IsMember(std::vector<std::string>(osdx::render::kShadeNames.begin(),
                                                       osdx::render::kShadeNames.end())))
        ->capture_default_str();
    render->add_option("--range", p.options.range,
                       "end of the colour scale for mean, gauss and distance");
    render->add_option("--azimuth", p.options.azimuth, "of the camera, in degrees")
        ->capture_default_str();
    render->add_option("--elevation", p.options.elevation, "of the camera, in degrees")
        ->capture_default_str();

    CLI::App* demo = p.add("demo", "the whole job on a bundled mesh, with pictures",
                           cli::demo_command);
    p.options.out = "demo";
    demo->add_option("--out", p.options.out, "the folder for its files")
        ->take_last()
        ->capture_default_str();
}

// ---- Inputs and outputs ----

constexpr const char* kStdin = "/dev/stdin";
constexpr const char* kStdout = "/dev/stdout";

/// The path of an output with the option that names it.
using Output = std::pair<std::string, std::filesystem::path>;

std::vector<Output> outputs(const Parser& p) {
    const CommandOptions& o = p.options;
    std::vector<Output> all;
    if (!o.json.empty())
        all.emplace_back("--json", o.json);
    const auto add = [&](const std::string& option,
                         const std::vector<std::filesystem::path>& files) {
        for (const std::filesystem::path& file : files)
            all.emplace_back(option, file);
    };
    if (p.command == cli::demo_command)
        add("--out", cli::demo_files(o.out));
    else if (!o.out.empty())
        all.emplace_back("--out", o.out);
    if (!o.images.empty())
        add("--images", cli::picture_files(o.images));
    return all;
}

/// Takes "-" as what it stands for. Throws CLI::ValidationError where the options do not go
/// together.
void resolve(Parser& p) {
    CommandOptions& o = p.options;
    int n_stdin = 0;
    for (std::filesystem::path* input : {&o.input, &o.at, &o.displace}) {
        if (*input == "-")
            *input = kStdin;
        n_stdin += *input == kStdin;
    }
    if (n_stdin > 1)
        throw CLI::ValidationError("-", "stdin can be read once only");
    if (o.json == "-")
        o.json = kStdout;
    if (o.out == "-" && p.command != cli::demo_command)
        o.out = kStdout;
    if (o.format.empty()) {
        if (o.input == kStdin && p.command != cli::patch_command)
            throw CLI::ValidationError("MESH", "stdin needs --format");
        const bool writes_mesh =
            p.command == cli::subdivide_command || p.command == cli::tessellate_command;
        if (o.out == kStdout && writes_mesh && o.out_format.empty())
            throw CLI::ValidationError("--out", "stdout needs --format or --out-format");
    }
    const std::vector<Output> all = outputs(p);
    for (std::size_t i = 0; i < all.size(); ++i) {
        o.report_on_stderr |= osdx::is_same_output(all[i].second, kStdout);
        for (std::size_t j = i + 1; j < all.size(); ++j) {
            if (osdx::is_same_output(all[i].second, all[j].second)) {
                throw CLI::ValidationError(
                    all[i].first, fmt::format("{} names the same file: {}", all[j].first,
                                              all[j].second.string()));
            }
        }
    }
}

/// Whether the outputs can be written, before there is work that would be lost.
osdx::Status try_outputs(const Parser& p) {
    for (const auto& [option, path] : outputs(p)) {
        // A folder that is not there will be made, but for --out and --json.
        std::filesystem::path file = path;
        std::error_code ignored;
        const bool makes_folder = option == "--images" || p.command == cli::demo_command;
        while (makes_folder && option != "--json" && file.has_parent_path() &&
               !std::filesystem::exists(file.parent_path(), ignored))
            file = file.parent_path();
        if (osdx::Status s = cli::written(osdx::check_writable(file), file); !s)
            return s;
    }
    return osdx::ok();
}

// ---- The process ----

/// Files get no number of a standard stream that is closed: what is printed would go into them.
void keep_standard_streams() {
    for (int n = 0; n <= 2; ++n) {
        if (fcntl(n, F_GETFD) == -1)  // the lowest number that is free is n
            (void)open("/dev/null", n == 0 ? O_WRONLY : O_RDONLY);
    }
}

extern "C" void end_by_signal(int number) {
    osdx::remove_unfinished_files();
    std::signal(number, SIG_DFL);
    std::raise(number);
}

/// What ends the program leaves no temporary files. What is ignored, as by nohup, stays so.
void handle_signals() {
    for (const int number :
         {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGPIPE, SIGXFSZ, SIGXCPU}) {
        struct sigaction action = {};
        if (sigaction(number, nullptr, &action) != 0 || action.sa_handler == SIG_IGN)
            continue;
        action = {};
        action.sa_handler = end_by_signal;
        sigaction(number, &action, nullptr);
    }
}

int complain(const std::string& message) {
    fmt::print(stderr, "osdx: {}\n", message);
    return kBadInput;
}

int exit_status(const Parser& parser, const CLI::ParseError& error) {
    const std::vector<std::string> others = parser.app.remaining();
    if (error.get_name() == "RequiredError" && parser.app.get_subcommands().empty() &&
        !others.empty()) {
        fmt::print(stderr,
                   "osdx: there is no subcommand '{}'\n"
                   "Run with --help for more information.\n",
                   others.front());
        return kBadUsage;
    }
    if (parser.app.exit(error) != 0)
        return kBadUsage;
    // Help, or the version.
    std::cout.flush();
    return std::cout ? 0 : complain("standard output: the text cannot be written");
}

}  // namespace

int main(int argc, char** argv) {
    keep_standard_streams();
    handle_signals();
    Parser parser;
    define(parser);
    try {
        parser.app.parse(argc, argv);
        resolve(parser);
    } catch (const CLI::ParseError& e) {
        return exit_status(parser, e);
    }
    try {
        osdx::Status status = try_outputs(parser);
        const auto run = [&] { status = parser.command(parser.options); };
        if (status && parser.n_threads > 0)
            osdx::with_threads(parser.n_threads, run);
        else if (status)
            run();
        if (!status)
            return complain(status.error().message);
    } catch (const std::exception& e) {  // out of memory, or a stdout that is full
        return complain(e.what());
    }
    return 0;
}
