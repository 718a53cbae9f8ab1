// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <optional>
#include <vector>

#include <osdx/address.h>
#include <osdx/embree/ray_scene.h>
#include <osdx/resolved_features.h>
#include <osdx/result.h>
#include <osdx/surface_jet.h>
#include <osdx/tessellation.h>
#include <osdx/types.h>

#include "viewer/render/camera.h"
#include "viewer/render/picture.h"

namespace osdx::render {

/// Moves the centre of the bounding box to the origin and makes its diagonal 1, so that no
/// tolerance depends on the size of the model, nor float rays on its place.
struct UnitFrame {
    Vec3<double> centre{0};
    double diagonal = 1;

    Vec3<double> point(const Vec3<double>& p) const noexcept {
        return (p - centre) / diagonal;
    }
    SurfaceJet<double> jet(const SurfaceJet<double>& s) const noexcept {
        return {point(s.p),       s.du / diagonal,  s.dv / diagonal,
                s.duu / diagonal, s.duv / diagonal, s.dvv / diagonal};
    }
};

/// Where a ray meets the surface.
struct Hit {
    QuarterPoint at;
    SurfaceJet<double> jet;     ///< in units of the diagonal
    Vec3<double> direction{0};  ///< of the ray, unit
    double t = 0;               ///< distance from the eye
    Vec3<double> normal{0};     ///< unit, towards the eye; of the facet if there is none
    bool regular = false;       ///< the surface has a normal
    double open = 1;            ///< openness(); for Shade::Phong
};

/// The surface of a picture as the rays of its camera meet it, in units of the diagonal.
class Scene {
public:
    /// With facets as small as the picture asks for.
    /// \pre the input outlives it
    /// \return EmptyMesh; NonFinitePoint (with the face); what TessellatedScene::build returns
    static Result<Scene> build(const PictureInput& input, const PictureOptions& options,
                               const Margins& margins);

    const Camera& camera() const noexcept { return camera_; }
    const RayScene& rays() const noexcept { return scene_->rays(); }
    std::span<const Vec3<double>> points() const noexcept {
        return tessellation_.positions;
    }

    /// What is seen at the point (x, y) of the picture.
    std::optional<Hit> find(double x, double y) const;

private:
    explicit Scene(const PictureInput& input) : input_(&input) {}

    const ResolvedFeatures& features() const noexcept;
    const Vec3<double>& corner(Index c) const noexcept {
        return tessellation_.positions[tessellation_.facet_points[c]];
    }
    double signed_volume() const;
    void look_at_sky();
    Hit on_ray(const Address& start, const Vec3<double>& direction, double t) const;

    const PictureInput* input_;
    Tessellation tessellation_;                    // in units of the diagonal
    std::vector<std::array<Index, 3>> triangles_;  // of facet corners
    UnitFrame frame_;
    std::optional<TessellatedScene> scene_;
    Camera camera_{};
    std::vector<double> open_;  // per normal; empty: not asked for
};

}  // namespace osdx::render
