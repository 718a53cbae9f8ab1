// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>
#include <utility>

#include <osdx/address.h>
#include <osdx/buffer.h>
#include <osdx/face_varying_surface.h>
#include <osdx/features.h>
#include <osdx/mesh_data.h>
#include <osdx/result.h>
#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

/// A texture coordinate and its derivatives in the (u, v) of the base face.
struct TextureJet {
    Vec2<double> p{0};
    Vec2<double> du{0}, dv{0};
};

/// The texture coordinates of a mesh: a FaceVaryingSurface of two channels, with their values.
///
/// Threads: const members may run at the same time.
class OSDX_API TextureSurface {
public:
    /// \param surface  of the mesh; not referred to later
    /// \param tags  those of the surface; all that counts is whether tags are ignored
    /// \param rule  instead of that of the mesh's tags, or All
    /// \return NoTexcoords; what face_varying_rule and FaceVaryingSurface::build return
    static Result<TextureSurface> build(const Surface& surface, const MeshData& mesh,
                                        const FeatureOptions& tags = {},
                                        std::optional<FaceVaryingRule> rule = {});

    const FaceVarying& channel() const noexcept { return surface_.channel(); }

    /// \pre the point is on a face that is no hole
    TextureJet evaluate(const QuarterPoint& where) const noexcept;
    /// NaN at an address without a point.
    TextureJet evaluate(const Address& where) const noexcept;

    /// Fills texcoords and facet_texcoords.
    /// \pre as FaceVaryingSurface::add_to()
    void add_to(Tessellation& tessellation, int rate) const;
    void add_to(Tessellation& tessellation, const TessellationRates& rates) const;

private:
    TextureSurface(FaceVaryingSurface surface, Buffer<double> values)
        : surface_(std::move(surface)), values_(std::move(values)) {}

    FaceVaryingSurface surface_;
    Buffer<double> values_;
};

}  // namespace osdx::inline OSDX_ABI
