// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "benchmarks/suite.h"

#include <algorithm>
#include <map>

#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <malloc.h>
#include <tbb/global_control.h>

namespace osdx::bench {
namespace {

/// Keeps the seconds of every repetition by the name of the benchmark.
class Collector : public benchmark::BenchmarkReporter {
public:
    bool ReportContext(const Context&) override { return true; }
    void ReportRuns(const std::vector<Run>& runs) override {
        for (const Run& run : runs) {
            if (run.run_type == Run::RT_Iteration)
                seconds_[run.run_name.function_name].push_back(
                    run.real_accumulated_time / static_cast<double>(run.iterations));
        }
    }

    double median(const std::string& name) {
        std::vector<double>& s = seconds_.at(name);
        const auto middle = s.begin() + s.size() / 2;
        std::ranges::nth_element(s, middle);
        return *middle;
    }

private:
    std::map<std::string, std::vector<double>> seconds_;
};

}  // namespace

Way on_one_thread(Way way) {
    way.run = [run = std::move(way.run)] {
        const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
        run();
    };
    return way;
}

const Row::Rate* Row::peer() const {
    const Rate* best = nullptr;
    for (const Rate& p : peers) {
        if (p.counts && (!best || p.rate > best->rate))
            best = &p;
    }
    return best;
}

Suite::Suite(SuiteOptions options) : options_(std::move(options)) {
    std::vector<std::string> flags = {"osdx",
                                      "--benchmark_enable_random_interleaving=true"};
    std::vector<char*> pointers;
    for (std::string& f : flags)
        pointers.push_back(f.data());
    int n = static_cast<int>(pointers.size());
    benchmark::Initialize(&n, pointers.data());
}

bool Suite::wants(const std::string& stage) const {
    return options_.stages.empty() ||
           std::ranges::find(options_.stages, stage) != options_.stages.end();
}

bool Suite::wants_any(std::initializer_list<const char*> stages) const {
    return std::ranges::any_of(stages, [&](const char* s) { return wants(s); });
}

void Suite::compare(const Case& what, const Way& ours, std::span<const Way> peers) {
    if (!wants(what.stage) ||
        std::ranges::find(options_.threads, what.threads) == options_.threads.end())
        return;
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(what.threads));
    const auto add = [&](const std::string& name, const std::function<void()>& run) {
        benchmark::internal::Benchmark* b =
            benchmark::RegisterBenchmark(name.c_str(), [&run](benchmark::State& state) {
                for (auto _ : state)
                    run();
            });
        b->UseRealTime();
        if (options_.smoke)
            b->Iterations(1);
        else
            b->Repetitions(options_.repetitions)->MinTime(options_.seconds);
    };
    add("ours", ours.run);
    for (std::size_t i = 0; i < peers.size(); ++i)
        add(fmt::format("peer{}", i), peers[i].run);
    Collector collector;
    benchmark::RunSpecifiedBenchmarks(&collector, ".");
    benchmark::ClearRegisteredBenchmarks();

    const auto rate = [&](const std::string& id, const Way& way) {
        return Row::Rate{
            way.name,
            (way.items > 0 ? way.items : what.items) / collector.median(id) * 1e-6,
            way.bytes / what.n_faces, way.counts};
    };
    const Row::Rate our_rate = rate("ours", ours);
    fmt::print(stderr, "{} {} d={} threads={}: {} {:.4g} M {}/s\n", what.stage, what.mesh,
               what.degree, what.threads, our_rate.name, our_rate.rate, what.unit);
    std::map<std::string, Row> rows;  // by library
    for (std::size_t i = 0; i < peers.size(); ++i) {
        const Row::Rate r = rate(fmt::format("peer{}", i), peers[i]);
        fmt::print(stderr, "    {} {}: {:.4g}, ratio {:.3g}{}\n", peers[i].library,
                   r.name, r.rate, our_rate.rate / r.rate, r.counts ? "" : " (beside)");
        Row& row =
            rows.try_emplace(peers[i].library, Row{what, our_rate, {}}).first->second;
        row.peers.push_back(r);
        row.peers.back().name = peers[i].library + " " + r.name;
    }
    if (rows.empty())
        rows_.push_back({what, our_rate, {}});
    for (auto& [library, row] : rows)
        rows_.push_back(std::move(row));
}

bool Suite::check(const std::string& what, double error, double tolerance) {
    const bool good = error <= tolerance;  // false for NaN
    fmt::print(stderr, "check: {}: {:.2g}, at most {:.2g}{}\n", what, error, tolerance,
               good ? "" : " FAILED");
    failed_ = failed_ || !good;
    return good;
}

double heap_bytes() {
    const struct mallinfo2 info = mallinfo2();
    return static_cast<double>(info.uordblks) + static_cast<double>(info.hblkhd);
}

}  // namespace osdx::bench
