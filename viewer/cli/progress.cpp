// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "viewer/cli/progress.h"

#include <cstdio>

#include <fmt/format.h>
#include <unistd.h>

namespace osdx::cli {

ProgressBar::ProgressBar() : start_(std::chrono::steady_clock::now()) {
    if (isatty(STDERR_FILENO))
        thread_ = std::thread([this] { run(); });
}

ProgressBar::~ProgressBar() {
    {
        const std::lock_guard lock(mutex_);
        done_ = true;
    }
    wake_.notify_all();
    if (thread_.joinable())
        thread_.join();
}

void ProgressBar::stage(std::string name) {
    const std::lock_guard lock(mutex_);
    name_ = std::move(name);
    stage_start_ = std::chrono::steady_clock::now();
    work_.set("", 0, 0);
}

void ProgressBar::print(const std::string& text) {
    const std::lock_guard lock(mutex_);
    wipe();
    std::fwrite(text.data(), 1, text.size(), stdout);
    std::fflush(stdout);
}

void ProgressBar::run() {
    using namespace std::chrono_literals;
    std::unique_lock lock(mutex_);
    if (wake_.wait_for(lock, 2s, [this] { return done_; }))
        return;
    while (!done_) {
        fmt::print(stderr, "\r\x1b[K{}", line());
        std::fflush(stderr);
        shown_ = true;
        wake_.wait_for(lock, 200ms, [this] { return done_; });
    }
    wipe();
}

std::string ProgressBar::line() const {
    const auto now = std::chrono::steady_clock::now();
    const std::chrono::duration<double> elapsed = now - start_,
                                        at_stage = now - stage_start_;
    const double done = work_.fraction();
    std::string text = fmt::format("{} ... {:.1f} s", name_, elapsed.count());
    if (done > 0 && done < 1)
        text += fmt::format(", {:.0f} %, {:.0f} s left", 100 * done,
                            at_stage.count() * (1 - done) / done);
    return text;
}

void ProgressBar::wipe() {
    if (shown_) {
        fmt::print(stderr, "\r\x1b[K");
        std::fflush(stderr);
    }
    shown_ = false;
}

}  // namespace osdx::cli
