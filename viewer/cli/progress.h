// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

#include <osdx/progress.h>

#include "viewer/cli/commands.h"
#include "viewer/cli/report.h"

namespace osdx::cli {

/// What a subcommand tells people. Shows on a terminal what the program is doing, once it has been
/// at it for two seconds: how much of it is done, and about how long it will take, where that is
/// known.
/// The line is not shown where stderr is no terminal, and wiped at the end. With
/// options.quiet nothing is shown or printed.
class ProgressBar {
public:
    explicit ProgressBar(const CommandOptions& options);
    ~ProgressBar();
    ProgressBar(const ProgressBar&) = delete;
    ProgressBar& operator=(const ProgressBar&) = delete;

    /// The next stage, in the form "measuring distances".
    void stage(std::string name);
    /// To be handed to the call that does it.
    Progress* work() noexcept { return &work_; }

    /// Prints on stdout, or on stderr where stdout carries data, above the line. Throws
    /// std::system_error where stdout does not take it.
    void print(const std::string& text);
    /// Prints on stderr, above the line: that the result is not all that one may expect.
    /// \param code  for programs, and of theirs: "uvs-dropped"
    void warn(std::string_view code, const std::string& message);
    /// All of them, for the report: [{"code", "message"}].
    const Json& warnings() const noexcept { return warnings_; }

private:
    void run();
    std::string line() const;
    void wipe();

    std::FILE* out_;
    bool quiet_;
    Json warnings_ = Json::array();
    std::chrono::steady_clock::time_point start_;
    std::mutex mutex_;
    std::condition_variable wake_;
    std::string name_ = "starting";
    std::chrono::steady_clock::time_point stage_start_ = start_;
    Progress work_;
    bool done_ = false;
    bool shown_ = false;  ///< the line is on the terminal now
    std::thread thread_;  // last: it uses the others
};

}  // namespace osdx::cli
