// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

#include <osdx/progress.h>

namespace osdx::cli {

/// Shows on a terminal what the program is doing, once it has been at it for two seconds: how
/// much of it is done, and about how long it will take, where that is known.
/// Silent where stderr is no terminal. The line is wiped at the end.
class ProgressBar {
public:
    ProgressBar();
    ~ProgressBar();
    ProgressBar(const ProgressBar&) = delete;
    ProgressBar& operator=(const ProgressBar&) = delete;

    /// The next stage, in the form "measuring distances".
    void stage(std::string name);
    /// To be handed to the call that does it.
    Progress* work() noexcept { return &work_; }

    /// Prints on stdout, above the line.
    void print(const std::string& text);

private:
    void run();
    std::string line() const;
    void wipe();

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
