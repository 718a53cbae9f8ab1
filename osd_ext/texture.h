// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <osdx/build_patch_table.h>
#include <osdx/evaluator.h>
#include <osdx/face_varying.h>
#include <osdx/features.h>
#include <osdx/mesh_data.h>
#include <osdx/patch_table.h>
#include <osdx/tessellation.h>
#include <osdx/tessellation_rates.h>

namespace osdx::inline OSDX_ABI {

/// A texture coordinate and its derivatives in the (u, v) of the base face.
struct TextureJet {
    Vec2<double> p{0};
    Vec2<double> du{0}, dv{0};
};

/// The texture coordinates of a mesh at the addresses of its surface.
///
/// FaceVaryingRule::All interpolates linearly: bilinear in the (u, v) of a quad, and in each
/// quarter of another polygon between its corner, the middles of its edges and the centroid.
/// The other rules evaluate a surface of the same degree over the texture coordinates, by
/// patches on their own topology. So the texture follows the points of the surface as the
/// mesh's own coordinates would. Multisided patches go through the texture at a pace of their
/// own: those at pinned vertices of several faces (rule Boundaries: all vertices of seams) are
/// laid on the fourth level of refinement only, MultisidedOptions::isolate_corners.
///
/// Threads: const members may run at the same time.
class OSDX_API TextureSurface {
public:
    /// \param options  those of the Surface; all that counts is the degree
    /// \param rule  instead of that of the mesh's tags, or All
    /// \return NoTexcoords; what Surface::build, face_varying_rule and build_face_varying
    ///         return. No degree matters to the rule All.
    static Result<TextureSurface> build(const MeshData& mesh,
                                        const PatchTableOptions& options = {},
                                        const FeatureOptions& tags = {},
                                        std::optional<FaceVaryingRule> rule = {});

    const FaceVarying& channel() const noexcept { return *channel_; }

    /// \pre the point is on a face that is no hole
    TextureJet evaluate(const QuarterPoint& where) const noexcept;
    TextureJet evaluate(const Address& where) const noexcept {
        return evaluate(to_quarter(channel_->topology, where));
    }

    /// Fills texcoords and facet_texcoords.
    /// \pre the tessellation is one of the same mesh, with the same holes, at this rate
    void add_to(Tessellation& tessellation, int rate) const;
    /// \pre besides, `base` is the topology of the mesh and these are its rates
    void add_to(Tessellation& tessellation, const Topology& base,
                const TessellationRates& rates) const;

private:
    void add(Tessellation& tessellation, const TessellationRates& of_channel) const;
    TextureSurface() = default;
    TextureJet interpolate(const QuarterPoint& where) const noexcept;

    std::unique_ptr<const FaceVarying> channel_;
    /// Of the vertices of channel().topology, then of the refined points; u and v by turns.
    std::vector<double> values_;
    std::unique_ptr<const PatchTable> table_;  // null for All
    std::unique_ptr<const Evaluator> evaluator_;
};

}  // namespace osdx::inline OSDX_ABI
