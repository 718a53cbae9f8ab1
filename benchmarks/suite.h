// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include <osdx/types.h>

namespace osdx::bench {

inline constexpr const char* kOurs = "osdx";

/// A way to do the work of a case once.
struct Way {
    std::string library, name;
    std::function<void()> run;
    double bytes = 0;  ///< held to be able to do it; 0: not measured
    double items = 0;  ///< done by one run; 0: what the case says
    /// False: shown beside the contest, but not among those of which the best counts.
    bool counts = true;
};

/// The same on one thread, whatever the case says.
Way on_one_thread(Way way);

/// What is compared.
struct Case {
    std::string stage, mesh;
    Index n_faces = 0;  ///< of the mesh
    int degree = 3, threads = 1;
    double items = 0;  ///< done by one run
    std::string unit;  ///< of the items
};

/// What was measured for one case and one library. Rates are millions of items a second, medians
/// over the repetitions.
struct Row {
    struct Rate {
        std::string name;
        double rate, bytes;  ///< bytes per base face; 0: not measured
        bool counts;
    };
    Case what;
    Rate ours;
    std::vector<Rate> peers;  ///< all ways of the library

    /// The best of those that count; null: none.
    const Rate* peer() const;
};

struct SuiteOptions {
    int repetitions = 7;
    double seconds = 0.1;  ///< of each repetition, at least
    /// The checks and one run of everything, to see that it works.
    bool smoke = false;
    std::vector<std::string> stages;  ///< empty: all
    std::vector<int> threads = {1, 2};
};

/// Runs the ways of a case in turns, so that whatever else the machine does meets all of them
/// alike, and keeps the medians.
///
/// Each way runs with TBB limited to the threads of its case.
class Suite {
public:
    explicit Suite(SuiteOptions options);

    const SuiteOptions& options() const noexcept { return options_; }
    bool wants(const std::string& stage) const;
    bool wants_any(std::initializer_list<const char*> stages) const;

    /// Adds a row for each library among the peers, or one without a peer.
    void compare(const Case& what, const Way& ours, std::span<const Way> peers);

    /// Reports how far a way is from what it should give, relative to the size of the model.
    /// \return false, and the whole run fails, if `error` is not within `tolerance`.
    bool check(const std::string& what, double error, double tolerance);
    bool failed() const noexcept { return failed_; }

    std::span<const Row> rows() const noexcept { return rows_; }

private:
    SuiteOptions options_;
    std::vector<Row> rows_;
    bool failed_ = false;
};

/// Of the heap that is in use.
double heap_bytes();

/// What make() returns, and the bytes of the heap that it holds.
template <class F>
auto measured(F&& make, double& bytes) {
    const double before = heap_bytes();
    auto made = make();
    bytes = heap_bytes() - before;
    return made;
}

}  // namespace osdx::bench
