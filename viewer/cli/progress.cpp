// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "viewer/cli/progress.h"

#include <cerrno>
#include <cstdio>
#include <system_error>

#include <fmt/format.h>
#include <unistd.h>

namespace osdx::cli {

ProgressBar::ProgressBar(const CommandOptions& options)
    : out_(options.report_on_stderr ? stderr : stdout),
      quiet_(options.quiet),
      start_(std::chrono::steady_clock::now()) {
    if (!quiet_ && isatty(STDERR_FILENO))
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
    if (quiet_)
        return;
    const std::lock_guard lock(mutex_);
    wipe();
    const bool printed = std::fwrite(text.data(), 1, text.size(), out_) == text.size() &&
                         std::fflush(out_) == 0;
    if (!printed && out_ == stdout)
        throw std::system_error(errno, std::generic_category(), "standard output");
}

void ProgressBar::warn(std::string_view code, const std::string& message) {
    warnings_.push_back({{"code", code}, {"message", message}});
    if (quiet_)
        return;
    const std::lock_guard lock(mutex_);
    wipe();
    fmt::print(stderr, "osdx: warning: {} [{}]\n", message, code);
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
