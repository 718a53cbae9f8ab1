// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <exception>
#include <functional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <osdx/opensubdiv/limit_surface.h>
#include <osdx/types.h>

#include "viewer/cli/commands.h"
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

    CLI::App* add(const std::string& name, const std::string& help, Command run) {
        CLI::App* sub = app.add_subcommand(name, help);
        sub->add_option("--json", options.json, "write the report to this file")
            ->take_last();
        sub->callback([this, run] { command = run; });
        return sub;
    }
    void mesh(CLI::App* sub) {
        sub->add_option("MESH", options.input, "an OBJ, OFF or PLY file")->required();
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
        using enum osdx::FaceVaryingRule;
        static const std::map<std::string, osdx::FaceVaryingRule> kRules{
            {"none", None},
            {"corners-only", CornersOnly},
            {"corners-plus1", CornersPlus1},
            {"corners-plus2", CornersPlus2},
            {"boundaries", Boundaries},
            {"all", All}};
        sub->add_option("--uv-rule", options.uv_rule,
                        "where texture coordinates are linear, as OpenSubdiv's "
                        "FVAR_LINEAR: none to all [the mesh's tag, or all]")
            ->transform(CLI::CheckedTransformer(kRules));
    }
    void out(CLI::App* sub, const std::string& help) {
        sub->add_option("--out", options.out, help)->required()->take_last();
    }
    CLI::Option* rate(CLI::App* sub, int least) {
        return sub->add_option("--rate", options.rate, "segments of each mesh edge")
            ->check(CLI::Range(least, 1024))
            ->capture_default_str();
    }
};

void define(Parser& p) {
    p.app.require_subcommand(1);

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

    CLI::App* patch = p.add("patch", "evaluate one patch from its control net or mesh",
                            cli::patch_command);
    patch
        ->add_option("NET", p.options.input,
                     "a JSON file: kind, n, d, control, samples; or mesh, paper, tuned")
        ->required();
    p.out(patch, "the samples with their derivatives: JSON");

    CLI::App* eval = p.add("eval", "evaluate points of a surface", cli::eval_command);
    p.mesh(eval);
    p.degree(eval);
    p.patch(eval, true);
    eval->add_option("--at", p.options.at, "CSV with the header face,u,v")->required();
    p.out(eval, "CSV: position, derivatives, normal, curvatures");

    CLI::App* tessellate =
        p.add("tessellate", "a watertight mesh of the surface", cli::tessellate_command);
    p.mesh(tessellate);
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

}  // namespace

int main(int argc, char** argv) {
    Parser parser;
    define(parser);
    try {
        parser.app.parse(argc, argv);
    } catch (const CLI::ParseError& e) {
        return parser.app.exit(e) == 0 ? 0 : kBadUsage;
    }
    try {
        const osdx::Status status = parser.command(parser.options);
        if (!status) {
            fmt::print(stderr, "osdx: {}\n", status.error().message);
            return kBadInput;
        }
    } catch (const std::exception& e) {  // out of memory, or a folder that is not there
        fmt::print(stderr, "osdx: {}\n", e.what());
        return kBadInput;
    }
    return 0;
}
