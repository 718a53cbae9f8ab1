// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "eval/kernels/point_kernels.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <string>
#include <type_traits>
#include <vector>

#include <gtest/gtest.h>

#include <osdx/evaluator.h>
#include <osdx/patch_class.h>

#include "eval/bases/patch_basis.h"
#include "eval/kernels/patch_kernel.h"
#include "tests/support/instruction_sets.h"
#include "tests/support/patch_class_names.h"
#include "tests/support/thinned.h"

// The kernels of single points against the weights that PatchBasis::for_each_weight gives.

namespace osdx {

namespace {

using test::for_each_target;

/// Points of a sector: inside, on its sides and next to its corners.
std::vector<DomainPoint> domain_points(const PatchClass& c) {
    std::vector<DomainPoint> points;
    std::mt19937 engine(1);
    const auto random = [&] { return double(engine()) / 4294967296.0; };
    const int n = c.is_square() ? 1 : c.n_sectors;
    for (const int sector : {0, 1 % n, n / 2, n - 1}) {
        for (const double a : {0.0, 0.5, 1.0}) {
            for (const double b : {0.0, 0.5, 1.0})
                points.push_back({sector, a, b});
        }
        for (int i = 0; i < 8; ++i)
            points.push_back({sector, random(), random()});
        for (const double r : {1e-1, 1e-2, 1e-3}) {
            points.push_back({sector, 1 - r * random(), 1 - r * random()});
            points.push_back({sector, 1 - r, 1});
            points.push_back({sector, 1, 1 - r});
            points.push_back({sector, r * random(), r * random()});
        }
    }
    return test::thinned(points);
}

/// Values of the points of one patch that lie in an array in another order.
template <class T>
struct Net {
    int stride;
    std::vector<Index> points;
    std::vector<T> values;

    /// \param n_more  values that follow
    Net(int n_points, int n_channels, int n_more = 0)
        : stride(n_channels), points(n_points) {
        std::iota(points.begin(), points.end(), Index(0));
        std::mt19937 engine(2);
        std::ranges::shuffle(points, engine);
        for (int i = 0; i < n_points * stride + n_more; ++i)
            values.push_back(static_cast<T>(double(engine()) / 2147483648.0 - 1));
    }
    detail::PointSum<T> sum() const {
        return {values.data(), values.size(), stride, points.data()};
    }
};

/// The same by weights, one row for each derivative.
template <int Order, class T>
std::vector<std::vector<double>> by_weights(const PatchBasis& basis, const DomainPoint& p,
                                            Chart chart, const Net<T>& net) {
    using J = Jet<double, Order>;
    std::vector<J> sums(net.stride);
    const J f = basis.for_each_weight<Order>(p, chart, [&](Index i, const J& w) {
        for (int c = 0; c < net.stride; ++c)
            sums[c] += double(net.values[net.points[i] * net.stride + c]) * w;
    });
    std::vector<std::vector<double>> rows(J::kSize);
    for (int r = 0; r < J::kSize; ++r) {
        for (const J& x : sums)
            rows[r].push_back((x / f).c[r] * (r == 3 || r == 5 ? 2 : 1));
    }
    return rows;
}

/// The size of what is summed up in derivatives of order m, for values of size 1.
///
/// Weights are of size 1, and derivative m of size (2 d)^m, more in narrow sectors. At the
/// distance r of a corner derivatives m of the blends are of the order of r^-m, and cancel in
/// the sum over the ribbons.
double scale(const PatchClass& c, const DomainPoint& p, int m) {
    double size = std::pow(2.0 * c.degree * std::max(1.0, c.n_sectors / 3.0), m);
    if (!c.is_square())
        size *= std::max(1.0, std::pow(2 - p.a - p.b, -m));
    return size;
}

/// Second derivatives of quadratic patches jump at knots, which are there.
template <int Order>
bool jumps(const PatchClass& c, const DomainPoint& p) {
    const auto at_end = [](double x) { return x == 0 || x == 1; };
    return Order == 2 && c.degree == 2 && (at_end(p.a) || at_end(p.b) || p.a == p.b);
}

/// \param value  value(r, x): derivative r of channel x
template <int Order, class T, class Value>
void expect_as_by_weights(const PatchBasis& basis, const DomainPoint& p, Chart chart,
                          const Net<T>& net, Value&& value) {
    const PatchClass& c = basis.patch_class();
    const auto expected = by_weights<Order>(basis, p, chart, net);
    for (int r = 0; r < n_derivatives(Order); ++r) {
        // Some thirty operations round before the sums of (d+1)^2 products do.
        const int m = r > 2 ? 2 : r > 0;
        double size = scale(c, p, m);
        for (int k = 0; k < n_derivatives(Order); ++k) {
            for (const double x : expected[k]) {
                if ((k > 2 ? 2 : k > 0) == m)
                    size = std::max(size, std::abs(x));
            }
        }
        // At borders up to three surfaces and a curve are put together, at places that
        // are moved.
        const double tolerance = (c.border == PatchBorder::None ? 64 : 256) *
                                 std::numeric_limits<double>::epsilon() * size;
        for (int x = 0; x < std::min(detail::kSumChannels, net.stride); ++x)
            EXPECT_NEAR(value(r, x), expected[r][x], tolerance)
                << testing::PrintToString(c) << " sector " << p.sector << " (" << p.a
                << ", " << p.b << ") chart " << int(chart) << " derivative " << r;
    }
}

template <int Order, class T>
int check(const PatchBasis& basis, const Net<T>& net) {
    const PatchClass& c = basis.patch_class();
    const PatchKernel kernel(basis);
    int n_checked = 0;
    for (const DomainPoint& p : domain_points(c)) {
        if (jumps<Order>(c, p))
            continue;
        for (const Chart chart : {Chart::BaseUV, Chart::Native}) {
            detail::PointJet jet;
            if (!kernel.sum<T>(p, chart, Order, {}, net.sum(), jet))
                continue;
            ++n_checked;
            expect_as_by_weights<Order>(basis, p, chart, net,
                                        [&](int r, int x) { return jet.value[r][x]; });
        }
    }
    return n_checked;
}

template <class T>
int check_class(const PatchClass& c) {
    const PatchBasis basis(c);
    int n = 0;
    // Whether other channels or points follow the last one or not.
    n += check<0>(basis, Net<T>(c.n_points(), 3));
    n += check<1>(basis, Net<T>(c.n_points(), 1));
    n += check<1>(basis, Net<T>(c.n_points(), 3));
    n += check<1>(basis, Net<T>(c.n_points(), 3, 8));
    n += check<2>(basis, Net<T>(c.n_points(), 5));
    return n;
}

template <class T>
class PointKernels : public testing::Test {};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(PointKernels, Scalars);

TYPED_TEST(PointKernels, RegularPatchesEqualTheirWeights) {
    for_each_target([] {
        for (int d = kMinDegree; d <= kMaxDegree; ++d)
            EXPECT_GT(check_class<TypeParam>({PatchKind::Regular, d, 4}), 0);
    });
}

TYPED_TEST(PointKernels, GregoryQuadsEqualTheirWeights) {
    for_each_target([] {
        EXPECT_GT(check_class<TypeParam>({PatchKind::Gregory, 3, 4}), 0);
    });
}

TYPED_TEST(PointKernels, PatchesOfNSidesEqualTheirWeights) {
    int n_checked = 0;
    for_each_target([&] {
        for (const PatchKind kind : {PatchKind::EV, PatchKind::EF}) {
            for (const int n : {3, 4, 5, 6, 7, 8, 9, 12, 13, 40}) {
                for (const int d : {2, 3, 4, 7}) {
                    if (n < 10 || d < 4)
                        n_checked += check_class<TypeParam>({kind, d, n});
                }
            }
        }
    });
    // Machines with narrow registers have no such kernels.
    const bool wide = (hwy::SupportedTargets() & (HWY_AVX2 | HWY_AVX3)) != 0;
    EXPECT_EQ(n_checked > 0, wide);
}

/// All weights of a ring at once.
template <int Order>
int check_ring_weights(const PatchBasis& basis) {
    using J = Jet<double, Order>;
    const PatchClass& c = basis.patch_class();
    const PatchKernel kernel(basis);
    const std::size_t n = static_cast<std::size_t>(c.n_points());
    int n_checked = 0;
    for (const DomainPoint& p : domain_points(c)) {
        for (const Chart chart : {Chart::BaseUV, Chart::Native}) {
            std::vector<double> out(J::kSize * n, -1.0);
            if (jumps<Order>(c, p) || !kernel.weights(p, chart, Order, {}, out))
                continue;
            ++n_checked;
            std::vector<J> expected(n);
            const J f = basis.for_each_weight<Order>(
                p, chart, [&](Index i, const J& w) { expected[i] += w; });
            for (int r = 0; r < J::kSize; ++r) {
                const double tolerance = 64 * std::numeric_limits<double>::epsilon() *
                                         scale(c, p, r > 2 ? 2 : r > 0);
                double sum = 0;
                for (std::size_t i = 0; i < n; ++i) {
                    EXPECT_NEAR(out[r * n + i],
                                (expected[i] / f).c[r] * (r == 3 || r == 5 ? 2 : 1),
                                tolerance)
                        << testing::PrintToString(c) << " point " << i << " derivative "
                        << r;
                    sum += out[r * n + i];
                }
                EXPECT_NEAR(sum, r == 0, tolerance);
            }
        }
    }
    return n_checked;
}

TEST(RingWeights, EqualThoseOfEachPoint) {
    int n_checked = 0;
    for_each_target([&] {
        for (const PatchKind kind : {PatchKind::EV, PatchKind::EF}) {
            for (const int n : {3, 4, 5, 8}) {
                for (const int d : {2, 3, 5}) {
                    const PatchBasis basis({kind, d, n});
                    n_checked += check_ring_weights<0>(basis) +
                                 check_ring_weights<1>(basis) +
                                 check_ring_weights<2>(basis);
                }
            }
        }
    });
    const bool wide = (hwy::SupportedTargets() & (HWY_AVX2 | HWY_AVX3)) != 0;
    EXPECT_EQ(n_checked > 0, wide);
    // Elsewhere there is none.
    double out[1];
    const auto has_weights = [&](const PatchClass& c, const DomainPoint& p) {
        return PatchKernel(PatchBasis(c)).weights(p, Chart::BaseUV, 0, {}, out);
    };
    EXPECT_FALSE(has_weights({PatchKind::Regular, 3, 4}, {0, 0.5, 0.5}));
    EXPECT_FALSE(has_weights({PatchKind::EV, 3, 9}, {0, 0.5, 0.5}));
    EXPECT_FALSE(has_weights({PatchKind::EV, 3, 5}, {2, 1, 1}));
}

/// Places of any sectors at a time, the last few repeated.
template <int Order>
void check_many(const PatchBasis& basis, const Net<double>& net) {
    constexpr int kLanes = detail::kLanes;
    const PatchKernel kernel(basis);
    const PatchClass& c = basis.patch_class();
    std::vector<double> values;
    for (const Index i : net.points)
        values.insert(values.end(), &net.values[3 * i], &net.values[3 * i] + 3);
    std::vector<DomainPoint> points = domain_points(c);
    std::erase_if(points, [&](const DomainPoint& p) {
        return !kernel.takes(p) || jumps<Order>(c, p);
    });
    std::mt19937 engine(3);
    std::ranges::shuffle(points, engine);
    for (std::size_t first = 0; first < points.size(); first += kLanes) {
        const auto point = [&](int i) { return points[(first + i) % points.size()]; };
        detail::PointPlaces at{};
        for (int i = 0; i < kLanes; ++i) {
            at.sector[i] = point(i).sector;
            at.a[i] = point(i).a;
            at.b[i] = point(i).b;
            at.cos[i] = 1;
        }
        for (const Chart chart : {Chart::BaseUV, Chart::Native}) {
            detail::PointJets jets;
            kernel.sum_many(values, 3, at, chart, Order, jets);
            for (int i = 0; i < kLanes; ++i)
                expect_as_by_weights<Order>(
                    basis, point(i), chart, net,
                    [&](int r, int x) { return jets.value[r][x][i]; });
        }
    }
}

TEST(PointKernelsOfMany, EqualTheirWeights) {
    for_each_target([] {
        for (const PatchKind kind :
             {PatchKind::Regular, PatchKind::EV, PatchKind::EF, PatchKind::Gregory}) {
            for (const int n : {3, 4, 5, 6, 7, 8}) {
                for (const int d : {2, 3, 4, 7, kMaxDegree}) {
                    const bool is_regular = kind == PatchKind::Regular;
                    if (is_regular ? n != 4 : d > 7 && n != 5)
                        continue;
                    if (kind == PatchKind::Gregory && d != 3)
                        continue;
                    const PatchBasis basis({kind, d, n});
                    if (!PatchKernel(basis).has_many())
                        continue;
                    const Net<double> net(basis.patch_class().n_points(), 3);
                    check_many<0>(basis, net);
                    check_many<1>(basis, net);
                    check_many<2>(basis, net);
                }
            }
        }
    });
}

// Their (u, v) are turned, each by its own quarters; constants are constant.
TEST(PointKernelsOfMany, TurnDerivativesOfEachPlace) {
    for_each_target([] {
        for (const PatchClass& c : {PatchClass{PatchKind::Regular, 3, 4},
                                    {PatchKind::Gregory, 3, 4},
                                    {PatchKind::EV, 3, 5},
                                    {PatchKind::EF, 4, 6}}) {
            const PatchBasis basis(c);
            const PatchKernel kernel(basis);
            if (!kernel.has_many())
                continue;
            const Net<double> net(c.n_points(), 2);
            std::vector<double> values;
            for (const Index i : net.points)
                values.insert(values.end(),
                              {net.values[2 * i], net.values[2 * i + 1], 1.0});
            detail::PointPlaces at{};
            for (int i = 0; i < detail::kLanes; ++i) {
                at.sector[i] = c.is_square() ? 0 : i % c.n_sectors;
                at.a[i] = 0.1 * i;
                at.b[i] = 0.9 - 0.1 * i;
                const int quarters = i % 4;
                at.cos[i] = quarters % 2 == 0 ? 2 - 2 * quarters : 0;
                at.sin[i] = quarters % 2 == 1 ? 4 - 2 * quarters : 0;
            }
            for (const Chart chart : {Chart::BaseUV, Chart::Native}) {
                detail::PointJets jets;
                kernel.sum_many(values, 3, at, chart, 2, jets);
                for (int i = 0; i < detail::kLanes; ++i) {
                    const DomainPoint p{at.sector[i], at.a[i], at.b[i]};
                    detail::PointJet jet;
                    ASSERT_TRUE(kernel.sum<double>(p, chart, 2, {at.cos[i], at.sin[i]},
                                                   net.sum(), jet));
                    for (int r = 0; r < 6; ++r) {
                        const int m = r > 2 ? 2 : r > 0;
                        const double tolerance = 64 * std::pow(2, m) * scale(c, p, m) *
                                                 std::numeric_limits<double>::epsilon();
                        for (int x = 0; x < 2; ++x)
                            EXPECT_NEAR(jets.value[r][x][i], jet.value[r][x], tolerance);
                        EXPECT_NEAR(jets.value[r][2][i], r == 0, tolerance);
                    }
                }
            }
        }
    });
}

TYPED_TEST(PointKernels, BordersAndSpikesEqualTheirWeights) {
    std::vector<PatchClass> classes;
    for (const PatchKind kind : {PatchKind::EV, PatchKind::EF}) {
        for (const int d : {2, 3, 5}) {
            for (const int n : {2, 3, 4, 7})
                classes.push_back({kind, d, n, PatchBorder::Smooth});
            for (const int n : {1, 2, 3})
                classes.push_back({kind, d, n, PatchBorder::Pinned});
            for (const int n : {3, 5})
                classes.push_back({kind, d, n, PatchBorder::Spike});
        }
    }
    int n_checked = 0;
    for (const PatchClass& c : test::thinned(classes))
        n_checked += check_class<TypeParam>(c);
    const bool wide = (hwy::SupportedTargets() & (HWY_AVX2 | HWY_AVX3)) != 0;
    EXPECT_EQ(n_checked > 0, wide);
}

TYPED_TEST(PointKernels, LargeValencesAndDegreesEqualTheirWeights) {
    check_class<TypeParam>({PatchKind::EV, 3, 360});
    check_class<TypeParam>({PatchKind::EF, 2, 360});
    check_class<TypeParam>({PatchKind::EV, kMaxDegree, 5});
    check_class<TypeParam>({PatchKind::EF, kMaxDegree, 3});
}

// Weights sum to one, whatever rounding does to each: 31 and 16 terms.
TYPED_TEST(PointKernels, ConstantsAreReproduced) {
    using T = TypeParam;
    for_each_target([] {
        for (const PatchClass& c : {PatchClass{PatchKind::Regular, 3, 4},
                                    {PatchKind::Gregory, 3, 4},
                                    {PatchKind::EV, 3, 5},
                                    {PatchKind::EF, 3, 6},
                                    {PatchKind::EV, 3, 11}}) {
            Net<T> net(c.n_points(), 3);
            std::ranges::fill(net.values, T(1));
            const PatchKernel kernel{PatchBasis(c)};
            for (const DomainPoint& p : domain_points(c)) {
                detail::PointJet jet;
                if (!kernel.sum<T>(p, Chart::BaseUV, 1, {}, net.sum(), jet))
                    continue;
                for (int r = 0; r < 3; ++r)
                    EXPECT_NEAR(
                        jet.value[r][0], r == 0,
                        16 * std::numeric_limits<double>::epsilon() * scale(c, p, r > 0))
                        << testing::PrintToString(c);
            }
        }
    });
}

// Below this distance from a corner, where blends have no limit, there is no kernel.
TYPED_TEST(PointKernels, CornersAreLeftToTheWeights) {
    using T = TypeParam;
    const PatchClass c{PatchKind::EV, 3, 5};
    const PatchKernel kernel{PatchBasis(c)};
    const Net<T> net(c.n_points(), 3);
    detail::PointJet jet;
    EXPECT_FALSE(kernel.sum<T>({2, 1, 1}, Chart::BaseUV, 1, {}, net.sum(), jet));
    EXPECT_FALSE(kernel.sum<T>({2, 1 - 1e-9, 1}, Chart::BaseUV, 1, {}, net.sum(), jet));
}

}  // namespace
}  // namespace osdx
