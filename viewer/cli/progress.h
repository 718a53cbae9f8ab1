// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

namespace osdx::cli {

/// Shows on a terminal what the program is doing, once it has been at it for two seconds.
/// Silent where stderr is no terminal. The line is wiped at the end.
class Progress {
public:
    Progress();
    ~Progress();
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    /// The next stage, in the form "measuring distances".
    void stage(std::string name);

    /// Prints on stdout, above the line.
    void print(const std::string& text);

private:
    void run();
    void wipe();

    std::chrono::steady_clock::time_point start_;
    std::mutex mutex_;
    std::condition_variable wake_;
    std::string name_ = "starting";
    bool done_ = false;
    bool shown_ = false;  ///< the line is on the terminal now
    std::thread thread_;  // last: it uses the others
};

}  // namespace osdx::cli
