// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <optional>
#include <ostream>
#include <stdexcept>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <malloc.h>
#include <nlohmann/json.hpp>

#include <osdx/file.h>
#include <osdx/mesh_file.h>

#include "benchmarks/meshes.h"
#include "benchmarks/stages.h"
#include "benchmarks/suite.h"
#include "far/mesh/topology_edits.h"

namespace {

using namespace osdx;
using namespace osdx::bench;

constexpr const char* kUsage = R"(usage: benchmarks/run.sh [options] MESH...
Measures osdx beside its peers on each mesh, on itself and refined by Catmull-Clark, without
tags. Without a mesh it makes one.
  --json FILE      write the rows to FILE
  --markdown       print the table as Markdown
  --stages A,B     only these
  --threads 1,2    only these numbers of threads
  --faces N        no size above N faces (default 1700000)
  --repetitions N  of each measurement (default 7)
  --fresh          take all memory from the system anew; else the program keeps what was freed
  --smoke          the checks, and one run of everything on small meshes
)";

constexpr const char* kStages[] = {"evaluate_grid_cached",
                                   "evaluate_grid_buffer",
                                   "evaluate_grid_ev5",
                                   "evaluate_grid_gregory",
                                   "evaluate_point_regular",
                                   "evaluate_point_ev5",
                                   "evaluate_point_gregory",
                                   "evaluate_many_regular",
                                   "evaluate_many_ev5",
                                   "evaluate_many_gregory",
                                   "evaluate_scattered",
                                   "build",
                                   "update",
                                   "update_local",
                                   "subdivide",
                                   "tessellate",
                                   "tessellate_error",
                                   "degree",
                                   "threads",
                                   "size"};

std::vector<std::string> split(std::string_view text) {
    std::vector<std::string> parts(1);
    for (const char c : text) {
        if (c == ',')
            parts.emplace_back();
        else
            parts.back() += c;
    }
    return parts;
}

nlohmann::json to_json(std::span<const Row> rows) {
    nlohmann::json list = nlohmann::json::array();
    for (const Row& row : rows) {
        nlohmann::json j = {
            {"stage", row.what.stage},     {"mesh", row.what.mesh},
            {"faces", row.what.n_faces},   {"degree", row.what.degree},
            {"threads", row.what.threads}, {"ours", row.ours.rate},
            {"ours_name", row.ours.name},  {"unit", "M " + row.what.unit + "/s"}};
        const Row::Rate* peer = row.peer();
        j["peer"] = peer ? nlohmann::json(peer->rate) : nullptr;
        j["peer_name"] = peer ? nlohmann::json(peer->name) : nullptr;
        j["ratio"] = peer ? nlohmann::json(row.ours.rate / peer->rate) : nullptr;
        if (row.ours.bytes > 0)
            j["bytes_per_face"] = row.ours.bytes;
        if (peer && peer->bytes > 0)
            j["peer_bytes_per_face"] = peer->bytes;
        for (const Row::Rate& p : row.peers)
            j["peers"][p.name] = p.rate;
        list.push_back(std::move(j));
    }
    return list;
}

void print_table(std::span<const Row> rows, bool markdown) {
    const char* format =
        markdown ? "| {} | {} | {} | {} | {} | {} | {} | {} | {} |\n"
                 : "{:<22} {:<16} {:>2} {:>2} {:>10} {:>10}  {:<36} {:>7} {:>13}\n";
    const auto line = [&](const auto&... cells) {
        fmt::print(fmt::runtime(format), cells...);
    };
    line("stage", "mesh", "d", "t", "ours", "peer", "best peer", "ratio", "bytes/face");
    if (markdown)
        fmt::print("|---|---|--:|--:|--:|--:|---|--:|--:|\n");
    for (const Row& row : rows) {
        const Row::Rate* peer = row.peer();
        const auto bytes = [](const Row::Rate* r) {
            return r && r->bytes > 0 ? fmt::format("{:.0f}", r->bytes) : std::string("-");
        };
        line(row.what.stage, row.what.mesh, std::to_string(row.what.degree),
             std::to_string(row.what.threads), fmt::format("{:.3g}", row.ours.rate),
             peer ? fmt::format("{:.3g}", peer->rate) : "-", peer ? peer->name : "-",
             peer ? fmt::format("{:.3g}", row.ours.rate / peer->rate) : "-",
             bytes(&row.ours) + " / " + bytes(peer));
    }
    fmt::print(
        "{}Rates are millions a second: samples or points of evaluation, faces of the "
        "mesh for build, update and tessellate_error, vertices of the result for "
        "subdivide, facets for "
        "tessellate. Bytes: ours / peer.\n",
        markdown ? "\n" : "");
}

struct Arguments {
    SuiteOptions suite;
    std::optional<std::filesystem::path> json;
    bool help = false, markdown = false, fresh = false;
    Index faces = 1'700'000;
    std::vector<std::filesystem::path> meshes;
};

std::optional<Arguments> parse(int argc, char** argv) {
    Arguments a;
    for (int i = 1; i < argc; ++i) {
        const std::string_view arg = argv[i];
        if (arg == "--help") {
            a.help = true;
        } else if (arg == "--markdown") {
            a.markdown = true;
        } else if (arg == "--fresh") {
            a.fresh = true;
        } else if (arg == "--smoke") {
            a.suite.smoke = true;
        } else if (!arg.starts_with("--")) {
            a.meshes.emplace_back(arg);
        } else if (++i == argc) {
            return {};
        } else if (arg == "--json") {
            a.json = argv[i];
        } else if (arg == "--stages") {
            a.suite.stages = split(argv[i]);
            for (const std::string& stage : a.suite.stages) {
                if (std::ranges::find(kStages, stage) == std::end(kStages))
                    return {};
            }
        } else if (arg == "--threads") {
            a.suite.threads.clear();
            for (const std::string& n : split(argv[i]))
                a.suite.threads.push_back(std::atoi(n.c_str()));
        } else if (arg == "--faces") {
            a.faces = static_cast<Index>(std::atol(argv[i]));
        } else if (arg == "--repetitions") {
            a.suite.repetitions = std::max(1, std::atoi(argv[i]));
        } else {
            return {};
        }
    }
    return a;
}

/// As of programs that build again and again. By default the C library gives large arrays back
/// at once, so that all libraries pay for new pages each time, some microsecond for 4 KiB.
void keep_memory() {
    mallopt(M_MMAP_MAX, 0);
    mallopt(M_TRIM_THRESHOLD, -1);
    mallopt(M_TOP_PAD, 64 << 20);
}

int run(const Arguments& a) {
    if (!a.fresh)
        keep_memory();
    Suite suite(a.suite);
    std::vector<std::vector<BenchMesh>> all;
    const Index largest = a.suite.smoke ? 0 : a.faces;
    for (const auto& path : a.meshes) {
        const auto mesh = read_mesh(path);
        if (!mesh)
            throw std::runtime_error(path.string() + ": " + mesh.error().message);
        all.push_back(mesh_sizes(path.stem().string(), *mesh, largest));
    }
    if (a.meshes.empty())
        all.push_back(
            mesh_sizes("slab", perforated_slab(a.suite.smoke ? 2 : 8), largest));
    for (const auto& meshes : all) {
        evaluate_grid_stage(suite, meshes);
        evaluate_points_stage(suite, meshes);
        build_stage(suite, meshes);
        update_stage(suite, meshes);
        subdivide_stage(suite, meshes);
        tessellate_stage(suite, meshes);
    }
    print_table(suite.rows(), a.markdown);
    if (a.json) {
        const Status written = write_file(*a.json, [&](std::ostream& out) {
            out << to_json(suite.rows()).dump(1) << '\n';
        });
        if (!written) {
            throw std::runtime_error(
                fmt::format("{}: {}", a.json->string(), written.error().message));
        }
    }
    if (suite.failed())
        fmt::print(stderr, "Results differ: see the checks that failed above.\n");
    return suite.failed() ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
    const auto arguments = parse(argc, argv);
    if (!arguments)
        return fmt::print(stderr, "{}Stages: {}\n", kUsage, fmt::join(kStages, " ")), 2;
    if (arguments->help)
        return fmt::print("{}", kUsage), 0;
    try {
        return run(*arguments);
    } catch (const std::exception& e) {
        fmt::print(stderr, "{}\n", e.what());
        return 1;
    }
}
