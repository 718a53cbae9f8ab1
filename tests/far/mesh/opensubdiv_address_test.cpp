// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

// Addresses against the parameterisation of OpenSubdiv's Bfr.

#include <gtest/gtest.h>
#include <opensubdiv/bfr/parameterization.h>

#include <osdx/address.h>
#include <osdx/topology.h>

#include "tests/support/test_meshes.h"

namespace osdx {
namespace {

using OpenSubdiv::Bfr::Parameterization;

// Both sides add an integer below 32 and a fraction.
constexpr double kTol = 32 * 2.3e-16;

template <class F>
void for_each_face_size(F&& f) {
    for (const Index n :
         {3u, 4u, 5u, 6u, 7u, 8u, 9u, 10u, 16u, 17u, 25u, 26u, 64u, 360u}) {
        SCOPED_TRACE(n);
        const Parameterization theirs(OpenSubdiv::Sdc::SCHEME_CATMARK, int(n));
        ASSERT_TRUE(theirs.IsValid());
        ASSERT_EQ(theirs.HasSubFaces(), n != 4);
        const Topology t = test::topology_of(test::prism(n));  // face 0 has n sides
        f(t, theirs, n);
    }
}

TEST(OpenSubdivAddress, VerticesAndCentre) {
    for_each_face_size([](const Topology& t, const Parameterization& theirs, Index n) {
        for (Index i = 0; i < n; ++i) {
            double uv[2];
            theirs.GetVertexCoord(int(i), uv);
            const Address a = to_address(t, {t.face_offsets[0] + i, 0, 0});
            EXPECT_EQ(a.u, uv[0]);
            EXPECT_EQ(a.v, uv[1]);
        }
        double uv[2];
        theirs.GetCenterCoord(uv);
        const QuarterPoint centre = to_quarter(t, {0, uv[0], uv[1]});
        EXPECT_EQ(centre.x, 1.0);
        EXPECT_EQ(centre.y, 1.0);
    });
}

TEST(OpenSubdivAddress, Edges) {
    for_each_face_size([](const Topology& t, const Parameterization& theirs, Index n) {
        for (Index i = 0; i < n; ++i) {
            for (int k = 0; k <= 16; ++k) {
                if (k == 8)
                    continue;  // the middle has an address in each of two sub-faces
                double uv[2];
                theirs.GetEdgeCoord(int(i), k / 16.0, uv);
                const Address a =
                    to_address(t, edge_point(t, t.face_offsets[0] + i, k / 16.0));
                EXPECT_NEAR(a.u, uv[0], kTol) << "edge " << i << " at " << k << "/16";
                EXPECT_NEAR(a.v, uv[1], kTol) << "edge " << i << " at " << k << "/16";
            }
        }
    });
}

TEST(OpenSubdivAddress, SubFaces) {
    for_each_face_size([](const Topology& t, const Parameterization& theirs, Index n) {
        if (n == 4)
            return;
        for (Index i = 0; i < n; ++i) {
            for (int k = 0; k < 64; ++k) {
                const double local[2] = {(k % 8 + 0.5) / 8, (k / 8 + 0.25) / 8};
                double uv[2], back[2];
                theirs.ConvertNormalizedSubFaceToCoord(int(i), local, uv);
                const Address a =
                    to_address(t, {t.face_offsets[0] + i, local[0], local[1]});
                EXPECT_NEAR(a.u, uv[0], kTol);
                EXPECT_NEAR(a.v, uv[1], kTol);
                const QuarterPoint q = to_quarter(t, {0, uv[0], uv[1]});
                ASSERT_EQ(theirs.ConvertCoordToNormalizedSubFace(uv, back), int(i));
                EXPECT_EQ(q.quarter - t.face_offsets[0], i);
                EXPECT_NEAR(q.x, back[0], kTol);
                EXPECT_NEAR(q.y, back[1], kTol);
            }
        }
    });
}

}  // namespace
}  // namespace osdx
