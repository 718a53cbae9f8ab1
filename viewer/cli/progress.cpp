// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "viewer/cli/progress.h"

#include <cstdio>

#include <fmt/format.h>
#include <unistd.h>

namespace osdx::cli {

Progress::Progress() : start_(std::chrono::steady_clock::now()) {
    if (isatty(STDERR_FILENO))
        thread_ = std::thread([this] { run(); });
}

Progress::~Progress() {
    {
        const std::lock_guard lock(mutex_);
        done_ = true;
    }
    wake_.notify_all();
    if (thread_.joinable())
        thread_.join();
}

void Progress::stage(std::string name) {
    const std::lock_guard lock(mutex_);
    name_ = std::move(name);
}

void Progress::print(const std::string& text) {
    const std::lock_guard lock(mutex_);
    wipe();
    std::fwrite(text.data(), 1, text.size(), stdout);
    std::fflush(stdout);
}

void Progress::run() {
    using namespace std::chrono_literals;
    std::unique_lock lock(mutex_);
    if (wake_.wait_for(lock, 2s, [this] { return done_; }))
        return;
    while (!done_) {
        const std::chrono::duration<double> elapsed =
            std::chrono::steady_clock::now() - start_;
        fmt::print(stderr, "\r\x1b[K{} ... {:.1f} s", name_, elapsed.count());
        std::fflush(stderr);
        shown_ = true;
        wake_.wait_for(lock, 200ms, [this] { return done_; });
    }
    wipe();
}

void Progress::wipe() {
    if (shown_) {
        fmt::print(stderr, "\r\x1b[K");
        std::fflush(stderr);
    }
    shown_ = false;
}

}  // namespace osdx::cli
