// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "benchmarks/samples.h"

#include <algorithm>
#include <memory>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace osdx::bench {
namespace {

// 512 places: nine floats each are 18 KiB, in the first cache of any machine.
constexpr std::size_t kCached = 8 * kGridSize;
// Of a thread at a time: enough to hide what a call costs.
constexpr std::size_t kGrain = 64 * kGridSize;

}  // namespace

std::vector<Place> grid_places(Index n_faces) {
    std::vector<Place> places;
    places.reserve(n_faces * kGridSize);
    for (Index f = 0; f < n_faces; ++f) {
        for (int j = 0; j < kGridSide; ++j) {
            for (int i = 0; i < kGridSide; ++i)
                places.push_back({f, grid_parameter(i), grid_parameter(j)});
        }
    }
    return places;
}

std::vector<SurfaceJet<float>> evaluate_all(const SampleWay& way, std::size_t n_places) {
    std::vector<SurfaceJet<float>> jets;
    jets.reserve(n_places);
    std::vector<float> out(way.stride * kGridSize);
    for (std::size_t first = 0; first < n_places; first += kGridSize) {
        const std::size_t n = std::min(kGridSize, n_places - first);
        way.evaluate(first, first + n, out.data());
        for (std::size_t i = 0; i < n; ++i) {
            if (way.read) {
                jets.push_back(way.read(out.data(), i, n));
            } else {
                const float* x = out.data() + i * way.stride;
                jets.push_back(
                    {{x[0], x[1], x[2]}, {x[3], x[4], x[5]}, {x[6], x[7], x[8]}});
            }
        }
    }
    return jets;
}

Way in_cache(const SampleWay& way, std::size_t n_places) {
    const auto out = std::make_shared<std::vector<float>>(way.stride * kCached);
    const auto run = [out, n_places, evaluate = way.evaluate] {
        for (std::size_t first = 0; first < n_places; first += kCached)
            evaluate(first, std::min(first + kCached, n_places), out->data());
    };
    return {way.library, way.name, run, way.bytes};
}

Way into_buffer(const SampleWay& way, std::size_t n_places, int threads) {
    const auto out = std::make_shared<std::vector<float>>(way.stride * n_places);
    const auto run = [out, n_places, threads, is_wide = way.is_wide, stride = way.stride,
                      evaluate = way.evaluate] {
        if (is_wide || threads == 1)
            return evaluate(0, n_places, out->data());
        const std::size_t n_parts = (n_places + kGrain - 1) / kGrain;
        tbb::parallel_for(std::size_t(0), n_parts, [&](std::size_t i) {
            const std::size_t first = i * kGrain;
            evaluate(first, std::min(first + kGrain, n_places),
                     out->data() + first * stride);
        });
    };
    return {way.library, way.name, run, way.bytes};
}

}  // namespace osdx::bench
