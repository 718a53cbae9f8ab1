// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <atomic>

#include <osdx/version.h>

namespace osdx::inline OSDX_ABI {

/// How far long work is, and the wish to end it. Handed to a function that takes it, and asked or
/// cancelled from other threads meanwhile; for one call after the other, of which all that come
/// after cancel() end at once.
///
/// Work that is cancelled returns ErrorCode::Cancelled within some thousandths of a second as a
/// rule, and has changed nothing.
class Progress {
public:
    Progress() = default;
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    void cancel() noexcept { cancelled_.store(true, std::memory_order_relaxed); }
    bool is_cancelled() const noexcept {
        return cancelled_.load(std::memory_order_relaxed);
    }

    /// Of the present call, from 0 to 1.
    double fraction() const noexcept { return fraction_.load(std::memory_order_relaxed); }
    /// What it is at: "laying patches". Lives as long as the program.
    const char* stage() const noexcept { return stage_.load(std::memory_order_relaxed); }

    /// For those who do the work: what comes now, and the part of the whole that it is. By the
    /// thread that began it.
    void set(const char* stage, double begin, double end) noexcept {
        begin_ = begin;
        end_ = end;
        stage_.store(stage, std::memory_order_relaxed);
        fraction_.store(begin, std::memory_order_relaxed);
    }
    /// How much of the stage is done, from 0 to 1. By any thread, in any order.
    void advance(double done) noexcept {
        const double now = begin_ + (end_ - begin_) * done;
        double before = fraction();
        while (before < now &&
               !fraction_.compare_exchange_weak(before, now, std::memory_order_relaxed)) {
        }
    }

private:
    std::atomic<bool> cancelled_ = false;
    std::atomic<double> fraction_ = 0;
    std::atomic<const char*> stage_ = "";
    double begin_ = 0, end_ = 1;
};

}  // namespace osdx::inline OSDX_ABI
