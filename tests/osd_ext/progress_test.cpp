// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <atomic>
#include <chrono>
#include <functional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <osdx/analysis/comparison.h>
#include <osdx/analysis/continuity.h>
#include <osdx/patch_table.h>
#include <osdx/progress.h>
#include <osdx/resolved_features.h>
#include <osdx/subdivide.h>
#include <osdx/surface.h>
#include <osdx/surface_function.h>
#include <osdx/threads.h>
#include <osdx/topology.h>

#include "far/parallel.h"
#include "tests/support/test_meshes.h"

namespace osdx::test {
namespace {

using Seconds = std::chrono::duration<double>;
using Clock = std::chrono::steady_clock;

/// Some ten thousand faces, extraordinary vertices and semi-sharp creases.
MeshData work() {
    MeshData mesh = random_displaced(double_torus(), 1, 0.02);
    add_crease(mesh, {mesh.face_vertices[0], mesh.face_vertices[1]}, 3.5);
    auto fine = subdivide(mesh, {.levels = 4});
    EXPECT_TRUE(fine);
    return fine->data;
}

/// Calls f at 20 moments of its work, cancelled there, and once in whole.
/// \param f  returns whether it was done, or the code of its error
void cancel_at_all_moments(const std::string& name,
                           const std::function<ErrorCode(Progress&)>& f) {
    SCOPED_TRACE(name);
    constexpr auto kDone = ErrorCode::FileUnreadable;  // of none of them
    Progress whole;
    const auto start = Clock::now();
    ASSERT_EQ(f(whole), kDone);
    const Seconds all = Clock::now() - start;
    EXPECT_EQ(whole.fraction(), 1);
    EXPECT_FALSE(whole.is_cancelled());

    std::mt19937 random(1);
    int n_cancelled = 0;
    for (int i = 0; i < 20; ++i) {
        const Seconds moment = all * (double(random()) / 0x1p32);
        Progress progress;
        std::thread other([&] {
            std::this_thread::sleep_for(moment);
            progress.cancel();
        });
        const ErrorCode code = f(progress);
        EXPECT_TRUE(code == kDone || code == ErrorCode::Cancelled);
        n_cancelled += code == ErrorCode::Cancelled;
        EXPECT_GE(progress.fraction(), 0);
        EXPECT_LE(progress.fraction(), 1);
        other.join();
        // Once it is cancelled all that comes after is.
        if (i == 0) {
            EXPECT_EQ(f(progress), ErrorCode::Cancelled);
        }
    }
    // How many is a matter of time, but the first moments are early ones.
    EXPECT_GT(n_cancelled, 0);
}

template <class R>
ErrorCode code_of(const R& result) {
    return result ? ErrorCode::FileUnreadable : result.error().code;
}

TEST(Progress, CancelsEveryCallAndLeavesAllAsItWas) {
    const MeshData mesh = work();
    const auto s = Surface::build(mesh);
    ASSERT_TRUE(s);
    const auto points = std::vector<Vec3<double>>(s->points().begin(), s->points().end());

    cancel_at_all_moments("build", [&](Progress& progress) {
        const auto built = Surface::build(mesh, {.degree = 5}, {}, &progress);
        return code_of(built);
    });
    cancel_at_all_moments("build from arrays", [&](Progress& progress) {
        return code_of(Surface::build(mesh.view(), channels(mesh.positions.data()),
                                      {.degree = 4}, &progress));
    });
    cancel_at_all_moments("subdivide", [&](Progress& progress) {
        return code_of(subdivide(mesh, {.degree = 3, .levels = 2}, &progress));
    });
    cancel_at_all_moments("tessellate", [&](Progress& progress) {
        return code_of(s->tessellate(6, progress));
    });
    const auto small = Surface::build(random_displaced(double_torus(), 1, 0.1));
    ASSERT_TRUE(small);
    cancel_at_all_moments("continuity", [&](Progress& progress) {
        return code_of(measure_continuity(*small, 4, progress));
    });
    cancel_at_all_moments("distance", [&](Progress& progress) {
        return code_of(measure_distance(small->base(), small->features(),
                                        surface_function(*small),
                                        surface_function(*small), 4, 1.0, &progress));
    });

    EXPECT_TRUE(std::ranges::equal(points, s->points()));
    const auto again = Surface::build(mesh);
    EXPECT_TRUE(again->patches() == s->patches());
}

TEST(Progress, NamesStagesAndGoesForward) {
    const MeshData mesh = work();
    Progress progress;
    std::atomic<bool> done = false;
    std::vector<std::string> stages;
    bool forward = true;
    std::thread watch([&] {
        double last = 0;
        while (!done) {
            const std::string stage = progress.stage();
            if (!stage.empty() && (stages.empty() || stages.back() != stage))
                stages.push_back(stage);
            const double now = progress.fraction();
            forward = forward && now >= last;
            last = now;
        }
    });
    const auto s = Surface::build(mesh, {.degree = 5}, {}, &progress);
    done = true;
    watch.join();
    ASSERT_TRUE(s);
    EXPECT_TRUE(forward);
    EXPECT_STREQ(progress.stage(), "done");
    EXPECT_NE(std::ranges::find(stages, "laying patches"), stages.end());
}

TEST(Progress, IsOfOneCallAlone) {
    const MeshData mesh = cube();
    Progress cancelled;
    cancelled.cancel();
    EXPECT_EQ(code_of(Surface::build(mesh, {}, {}, &cancelled)), ErrorCode::Cancelled);
    EXPECT_TRUE(Surface::build(mesh));
    Progress progress;
    EXPECT_TRUE(Surface::build(mesh, {}, {}, &progress));
    // What is refused says why.
    EXPECT_EQ(code_of(Surface::build(MeshData(), {}, {}, &progress)),
              ErrorCode::EmptyMesh);
    EXPECT_EQ(detail::current_progress(), nullptr);
}

TEST(Threads, AreNoMoreThanTheLimit) {
    for (const int n : {1, 2, 3}) {
        std::atomic<int> now = 0, most = 0;
        with_threads(n, [&] {
            detail::for_each_task(200, [&](int) {
                const int m = ++now;
                int known = most;
                while (known < m && !most.compare_exchange_weak(known, m)) {
                }
                std::this_thread::sleep_for(std::chrono::microseconds(50));
                --now;
            });
        });
        EXPECT_LE(most, n);
        EXPECT_GE(most, 1);
    }
    EXPECT_THROW(with_threads(1, [] { throw std::string("on to the caller"); }),
                 std::string);
    // Cancelled work is so inside of a limit as well.
    Progress progress;
    progress.cancel();
    const auto result = detail::cancellable(&progress, [&]() -> Status {
        with_threads(2, [] { detail::for_each_task(5, [](int) {}); });
        return ok();
    });
    EXPECT_EQ(code_of(result), ErrorCode::Cancelled);
}

}  // namespace
}  // namespace osdx::test
