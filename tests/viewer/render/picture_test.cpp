// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include "viewer/render/picture.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <tuple>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>
#include <png.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <osdx/embree/ray_scene.h>
#include <osdx/patch_class.h>
#include <osdx/patch_table.h>
#include <osdx/resolved_features.h>
#include <osdx/topology.h>

#include "tests/support/test_meshes.h"

namespace osdx::render {
namespace {

namespace fs = std::filesystem;
using Vec = Vec3<double>;

bool has_embree() {
    const std::vector<Vec3<float>> points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    const std::vector<std::array<Index, 3>> triangle = {{0, 1, 2}};
    return RayScene::build(points, triangle).has_value();
}

/// A sphere over the faces of a cube, with exact derivatives: the cube's points over their
/// length.
struct Sphere {
    std::shared_ptr<const Topology> base;
    std::vector<Vec> corners;
    Vec centre{0};
    double radius = 1;

    explicit Sphere(Vec c = Vec(0), double r = 1) : centre(c), radius(r) {
        const MeshData cube = test::cube();
        base = std::make_shared<const Topology>(test::topology_of(cube));
        corners = cube.positions;
    }

    SurfaceJet<double> operator()(const QuarterPoint& at) const {
        const Address a = to_address(*base, at);
        const Index h = base->face_offsets[a.face];
        const Vec c0 = corners[base->vertex[h]], c1 = corners[base->vertex[h + 1]],
                  c3 = corners[base->vertex[h + 3]];
        const Vec u = c1 - c0, v = c3 - c0, c = c0 + a.u * u + a.v * v;
        const double r = glm::length(c);
        const Vec p = c / r;
        // Second derivative of c / |c| along s and t.
        const auto second = [&](const Vec& s, const Vec& t) {
            const double ps = glm::dot(p, s), pt = glm::dot(p, t);
            return radius * (3 * ps * pt * p - s * pt - t * ps - p * glm::dot(s, t)) /
                   (r * r);
        };
        return {centre + radius * p,
                radius * (u - p * glm::dot(p, u)) / r,
                radius * (v - p * glm::dot(p, v)) / r,
                second(u, u),
                second(u, v),
                second(v, v)};
    }

    PictureInput input() const {
        PictureInput result;
        result.base = base.get();
        result.surface = *this;
        return result;
    }
};

PictureOptions small(Shade shade) {
    PictureOptions o;
    o.width = 96;
    o.height = 72;
    o.shade = shade;
    o.samples = 1;
    o.legend = false;
    return o;
}

Image render(const PictureInput& input, const PictureOptions& options) {
    Result<Image> image = render_picture(input, options);
    EXPECT_TRUE(image) << image.error().message;
    return image ? *image : Image{1, 1, {{}}};
}

/// The largest difference of a channel.
int difference(const Color& a, const Color& b) {
    int most = 0;
    for (int c = 0; c < 3; ++c)
        most = std::max(most, std::abs(int(a[c]) - int(b[c])));
    return most;
}

void expect_color(const Color& color, const Color& expected, int tolerance) {
    EXPECT_LE(difference(color, expected), tolerance)
        << int(color.x) << " " << int(color.y) << " " << int(color.z) << " instead of "
        << int(expected.x) << " " << int(expected.y) << " " << int(expected.z);
}

/// The picture of a unit sphere at the origin, by hand: the camera is where the cone that
/// touches the sphere reaches 0.9 of the smaller half side, at 14 degrees.
struct SphereView {
    Vec eye, right, up, back;
    double pixel;
    int width, height;

    explicit SphereView(const PictureOptions& o) : width(o.width), height(o.height) {
        const double az = o.azimuth_deg * std::numbers::pi / 180,
                     el = o.elevation_deg * std::numbers::pi / 180;
        back = {std::cos(el) * std::cos(az), std::cos(el) * std::sin(az), std::sin(el)};
        right = {-std::sin(az), std::cos(az), 0};
        up = glm::cross(back, right);
        const double tan14 = std::tan(14 * std::numbers::pi / 180);
        pixel = 2 * tan14 / std::min(width, height);
        eye = back / std::sin(std::atan(0.9 * tan14));
    }

    Vec direction(int x, int y) const {
        return glm::normalize(pixel * (x + 0.5 - 0.5 * width) * right +
                              pixel * (0.5 * height - y - 0.5) * up - back);
    }
    /// Distance from the centre of the picture over the radius of the circle.
    double radius(int x, int y) const {
        return std::hypot(x + 0.5 - 0.5 * width, y + 0.5 - 0.5 * height) /
               (0.45 * std::min(width, height));
    }
    /// Of the point that the pixel shows. \pre radius(x, y) < 1
    Vec normal(int x, int y) const {
        const Vec d = direction(x, y);
        const double b = glm::dot(eye, d);
        return eye + (-b - std::sqrt(b * b - glm::dot(eye, eye) + 1)) * d;
    }
};

class Picture : public testing::Test {
protected:
    void SetUp() override {
        if (!has_embree())
            GTEST_SKIP() << "built without Embree";
    }
};

TEST(PictureNames, ParseToTheirShades) {
    EXPECT_EQ(parse_shade("phong"), Shade::Phong);
    EXPECT_EQ(parse_shade("normals"), Shade::Normals);
    EXPECT_EQ(parse_shade("reflection"), Shade::Reflection);
    EXPECT_EQ(parse_shade("mean"), Shade::Mean);
    EXPECT_EQ(parse_shade("gauss"), Shade::Gauss);
    EXPECT_EQ(parse_shade("patches"), Shade::Patches);
    EXPECT_EQ(parse_shade("distance"), Shade::Distance);
    EXPECT_EQ(parse_shade("checker"), Shade::Checker);
    EXPECT_EQ(parse_shade("color"), Shade::Colors);
    for (const char* wrong : {"", "Phong", "phong ", "pho", "curvature"})
        EXPECT_EQ(parse_shade(wrong), std::nullopt) << wrong;
}

TEST(PictureWithoutEmbree, IsNotBuilt) {
    if (has_embree())
        GTEST_SKIP() << "built with Embree";
    const auto image = render_picture(Sphere().input(), small(Shade::Phong));
    ASSERT_FALSE(image);
    EXPECT_EQ(image.error().code, ErrorCode::NotBuilt);
}

// ---- Geometry ----

TEST_F(Picture, SphereFillsItsCircle) {
    const PictureOptions o = small(Shade::Normals);
    const Image image = render(Sphere().input(), o);
    const SphereView view(o);
    ASSERT_EQ(image.pixels.size(), 96u * 72u);
    int n_inside = 0;
    for (int y = 0; y < o.height; ++y) {
        for (int x = 0; x < o.width; ++x) {
            // The background is the same all along a row.
            const bool inside = image.at(x, y) != image.at(0, y);
            n_inside += inside;
            if (std::abs(view.radius(x, y) - 1) > 0.03) {
                EXPECT_EQ(inside, view.radius(x, y) < 1) << x << " " << y;
            }
        }
    }
    const double radius = 0.45 * 72;
    const double area = std::numbers::pi * radius * radius;
    EXPECT_NEAR(n_inside, area, 0.02 * area);
}

TEST_F(Picture, BackgroundIsLightAndNeutral) {
    const PictureOptions o = small(Shade::Mean);
    const Image image = render(Sphere().input(), o);
    for (int y = 0; y < o.height; ++y) {
        const Color& c = image.at(0, y);
        EXPECT_GT(std::min({c.x, c.y, c.z}), 215);
        EXPECT_LT(std::max({c.x, c.y, c.z}) - std::min({c.x, c.y, c.z}), 12);
        EXPECT_EQ(c, image.at(o.width - 1, y));
    }
    EXPECT_GT(image.at(0, 0).x, image.at(0, o.height - 1).x);
}

// Normals of facets instead of the surface would be off by ten levels.
TEST_F(Picture, NormalsAreThoseOfTheSurface) {
    PictureOptions o = small(Shade::Normals);
    for (const auto& [azimuth, elevation] :
         {std::pair(0.0, 0.0), {35.0, 25.0}, {-120.0, -60.0}, {10.0, 90.0}}) {
        SCOPED_TRACE(testing::Message() << azimuth << " " << elevation);
        o.azimuth_deg = azimuth;
        o.elevation_deg = elevation;
        const Image image = render(Sphere().input(), o);
        const SphereView view(o);
        int most = 0;
        for (int y = 0; y < o.height; ++y) {
            for (int x = 0; x < o.width; ++x) {
                if (view.radius(x, y) > 0.97)
                    continue;
                const Vec n = view.normal(x, y);
                const Color expected(std::lround(127.5 * (n.x + 1)),
                                     std::lround(127.5 * (n.y + 1)),
                                     std::lround(127.5 * (n.z + 1)));
                most = std::max(most, difference(image.at(x, y), expected));
            }
        }
        EXPECT_LE(most, 1);
    }
}

TEST_F(Picture, DoesNotDependOnPlaceAndSize) {
    for (const Shade shade : {Shade::Phong, Shade::Mean, Shade::Reflection}) {
        const Image unit = render(Sphere().input(), small(shade));
        const Image tiny =
            render(Sphere(Vec(500, -300, 200), 1e-3).input(), small(shade));
        int most = 0;
        for (std::size_t i = 0; i < unit.pixels.size(); ++i)
            most = std::max(most, difference(unit.pixels[i], tiny.pixels[i]));
        EXPECT_LE(most, 2) << kShadeNames[static_cast<std::size_t>(shade)];
    }
}

TEST_F(Picture, UpAxisTurnsTheCamera) {
    MeshData mesh = test::random_displaced(test::cube(), 7, 0.3);
    const auto z_up = Surface::build(mesh);
    for (Vec& p : mesh.positions)
        p = {p.z, p.x, p.y};
    const auto x_up = Surface::build(mesh);
    for (Vec& p : mesh.positions)
        p = {p.z, p.x, p.y};
    const auto y_up = Surface::build(mesh);
    ASSERT_TRUE(z_up && x_up && y_up);
    PictureOptions o = small(Shade::Mean);
    const Image expected = render(picture_input(*z_up), o);
    for (const UpAxis up : {UpAxis::X, UpAxis::Y}) {
        o.up = up;
        const Image image = render(picture_input(up == UpAxis::X ? *x_up : *y_up), o);
        int n_different = 0;
        for (std::size_t i = 0; i < image.pixels.size(); ++i)
            n_different += difference(image.pixels[i], expected.pixels[i]) > 2;
        EXPECT_LE(n_different, 5);  // a pixel at the silhouette may round differently
    }
}

// ---- Colours ----

double linear(int srgb) {
    const double s = srgb / 255.0;
    return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
}

TEST_F(Picture, MeanCurvatureOfASphereHasOneColour) {
    PictureOptions o = small(Shade::Mean);
    const Image image = render(Sphere().input(), o);
    const SphereView view(o);
    const Color& centre = image.at(48, 36);
    // Bent away from its normal: blue.
    EXPECT_GT(centre.z, centre.x + 60);
    for (int y = 0; y < o.height; ++y) {
        for (int x = 0; x < o.width; ++x) {
            if (view.radius(x, y) > 0.97)
                continue;
            // Shading darkens all channels alike.
            const Color& c = image.at(x, y);
            const double dark = linear(c.z) / linear(centre.z);
            EXPECT_LE(dark, 1.02);
            EXPECT_NEAR(linear(c.x), dark * linear(centre.x), 0.01) << x << " " << y;
            EXPECT_NEAR(linear(c.y), dark * linear(centre.y), 0.01) << x << " " << y;
        }
    }
}

// The diagonal of a sphere is 2 sqrt(3) radii: mean curvature -2 sqrt(3), Gauss curvature 12.
TEST_F(Picture, MapsShowValuesInTheirRange) {
    const Sphere sphere(Vec(1, 2, 3), 5);
    PictureOptions o = small(Shade::Mean);
    o.range = 4 * std::numbers::sqrt3;
    expect_color(render(sphere.input(), o).at(48, 36), {90, 141, 208}, 1);
    o.shade = Shade::Gauss;
    o.range = 24;
    expect_color(render(sphere.input(), o).at(48, 36), {220, 112, 95}, 1);

    o.shade = Shade::Distance;
    o.range = 0.5;
    PictureInput input = sphere.input();
    input.distance = [&](const SurfaceJet<double>& jet, const QuarterPoint& at) {
        // In units of the mesh, at the point of the jet.
        EXPECT_EQ(jet.p, sphere(at).p);
        return glm::length(jet.p - sphere.centre) / 20;
    };
    expect_color(render(input, o).at(48, 36), {58, 168, 142}, 1);
}

// Where the value is the same everywhere, so is the colour at the end of the scale.
TEST_F(Picture, RangeCoversTheVisibleValues) {
    PictureOptions o = small(Shade::Gauss);
    expect_color(render(Sphere().input(), o).at(48, 36), {128, 12, 38}, 1);  // 12 of 12
    o.shade = Shade::Mean;  // 3.46 of 3.6
    o.range = 3.6;
    const Image expected = render(Sphere().input(), o);
    o.range.reset();
    EXPECT_EQ(render(Sphere().input(), o), expected);
}

// A spot has ten times the curvature, and ten times the distance.
TEST_F(Picture, RangeForgivesSmallSpots) {
    const Sphere sphere;
    for (const auto& [part, mean, distance] :
         {std::tuple(0.02, 3.6, 0.2), {0.1, 36.0, 0.2}}) {
        PictureOptions o = small(Shade::Mean);
        const Vec back = SphereView(o).back;
        const auto factor = [&, least = std::sqrt(1 - part)](const Vec& p) {
            return glm::dot(p, back) > least ? 10.0 : 1.0;
        };
        PictureInput input = sphere.input();
        input.surface = [&](const QuarterPoint& at) {
            SurfaceJet<double> jet = sphere(at);
            for (Vec* second : {&jet.duu, &jet.duv, &jet.dvv})
                *second *= factor(jet.p);
            return jet;
        };
        input.distance = [&](const SurfaceJet<double>& jet, const QuarterPoint&) {
            return 0.02 * factor(jet.p);
        };
        for (const auto& [shade, range] :
             {std::pair(Shade::Mean, mean), {Shade::Distance, distance}}) {
            o.shade = shade;
            o.range = range;
            const Image expected = render(input, o);
            o.range.reset();
            EXPECT_EQ(render(input, o), expected) << range;
        }
    }
}

TEST_F(Picture, ReflectionShowsTheTubes) {
    PictureOptions o = small(Shade::Reflection);
    o.width = o.height = 200;
    const Image image = render(Sphere().input(), o);
    const SphereView view(o);
    int n_lit = 0, n_dark = 0;
    for (int y = 0; y < o.height; ++y) {
        for (int x = 0; x < o.width; ++x) {
            // Each tube has several pixels here.
            if (view.radius(x, y) > 0.75)
                continue;
            const Vec r = glm::reflect(view.direction(x, y), view.normal(x, y));
            const double halves =
                0.5 + 24 * std::acos(glm::dot(r, view.up)) / std::numbers::pi;
            if (std::abs(halves - std::round(halves)) < 0.4)
                continue;  // close to an edge
            if (static_cast<int>(halves) % 2 == 0) {
                EXPECT_GT(image.at(x, y).x, 170) << x << " " << y;
                ++n_lit;
            } else {
                EXPECT_LT(image.at(x, y).x, 60) << x << " " << y;
                ++n_dark;
            }
        }
    }
    EXPECT_GT(n_lit, 500);
    EXPECT_GT(n_dark, 500);
}

// Edges are filtered: without samples no pixel of a sharp edge would be grey.
TEST_F(Picture, ReflectionIsSymmetricAndSmooth) {
    PictureOptions o = small(Shade::Reflection);
    o.azimuth_deg = o.elevation_deg = 0;
    const Image image = render(Sphere().input(), o);
    const SphereView view(o);
    int most = 0, n_grey = 0;
    for (int y = 0; y < o.height; ++y) {
        for (int x = 0; x < o.width; ++x) {
            most =
                std::max(most, difference(image.at(x, y), image.at(o.width - 1 - x, y)));
            n_grey += view.radius(x, y) < 0.9 && std::abs(image.at(x, y).x - 128) < 60;
        }
    }
    EXPECT_LE(most, 2);
    EXPECT_GT(n_grey, 100);
}

// Lit from the upper left, darker below.
TEST_F(Picture, ClayShowsTheForm) {
    const Image image = render(Sphere().input(), small(Shade::Phong));
    EXPECT_GT(image.at(36, 22).y, image.at(48, 36).y);
    EXPECT_GT(image.at(48, 36).y, image.at(60, 58).y + 30);
    // The shadow on the ground.
    EXPECT_LT(image.at(70, 69).y + 3, image.at(0, 69).y);
    const Color& lit = image.at(36, 22);
    EXPECT_GT(lit.x, lit.z);
}

TEST_F(Picture, InsideOutLooksTheSame) {
    const Sphere sphere;
    PictureInput mirrored = sphere.input();
    mirrored.surface = [&](const QuarterPoint& at) {
        SurfaceJet<double> jet = sphere(at);
        for (Vec* v : {&jet.p, &jet.du, &jet.dv, &jet.duu, &jet.duv, &jet.dvv})
            v->x = -v->x;
        return jet;
    };
    for (const Shade shade : {Shade::Phong, Shade::Normals, Shade::Reflection}) {
        const PictureOptions o = small(shade);
        const Image expected = render(sphere.input(), o), image = render(mirrored, o);
        const SphereView view(o);
        int most = 0;
        for (int y = 0; y < o.height; ++y) {
            for (int x = 0; x < o.width; ++x) {
                if (std::abs(view.radius(x, y) - 1) > 0.03)
                    most = std::max(most, difference(image.at(x, y), expected.at(x, y)));
            }
        }
        // Other facets: points differ by a fiftieth of a pixel, which counts at sharp edges.
        EXPECT_LE(most, shade == Shade::Reflection ? 12 : 3)
            << kShadeNames[static_cast<std::size_t>(shade)];
    }
}

// The lower half of the sphere is cut away; the bowl that is left is seen into from below.
TEST_F(Picture, HolesShowTheInside) {
    const Sphere sphere;
    ResolvedFeatures features;
    features.hole.assign(6, false);
    int n_holes = 0;
    for (Index f = 0; f < 6; ++f) {
        const Vec centre = sphere(to_quarter(*sphere.base, {f, 0.5, 0.5})).p;
        features.hole[f] = centre.z < -0.9;
        n_holes += features.hole[f];
    }
    ASSERT_EQ(n_holes, 1);
    PictureInput input = sphere.input();
    input.features = &features;
    PictureInput turned = input;  // its normals point inwards
    turned.surface = [&](const QuarterPoint& at) {
        SurfaceJet<double> jet = sphere(at);
        for (Vec* v : {&jet.p, &jet.du, &jet.dv, &jet.duu, &jet.duv, &jet.dvv})
            v->x = -v->x;
        return jet;
    };
    PictureOptions o = small(Shade::Normals);
    o.azimuth_deg = 0;
    o.elevation_deg = -90;
    const Color middle = render(input, o).at(48, 36);
    expect_color(middle, {128, 128, 0}, 3);  // the ceiling, looking down
    o.shade = Shade::Phong;
    const Image closed = render(sphere.input(), o), open = render(input, o);
    EXPECT_LT(open.at(48, 36).y, closed.at(48, 36).y);  // the sky does not get there
    EXPECT_LE(difference(render(turned, o).at(48, 36), open.at(48, 36)), 3);
}

TEST_F(Picture, FacetsStandInWhereThereIsNoNormal) {
    const Sphere sphere;
    PictureInput input = sphere.input();
    const PictureOptions o = small(Shade::Normals);
    const Image expected = render(input, o);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const Vec& derivative : {Vec(0), Vec(nan)}) {
        input.surface = [&](const QuarterPoint& at) {
            SurfaceJet<double> jet = sphere(at);
            jet.du = jet.duu = jet.duv = derivative;
            return jet;
        };
        const Image image = render(input, o);
        const SphereView view(o);
        int most = 0;
        for (int y = 0; y < o.height; ++y) {
            for (int x = 0; x < o.width; ++x) {
                if (view.radius(x, y) < 0.9)
                    most = std::max(most, difference(image.at(x, y), expected.at(x, y)));
            }
        }
        EXPECT_LE(most, 20);
        for (const Shade shade : {Shade::Phong, Shade::Reflection, Shade::Mean})
            render(input, small(shade));  // no trap in the sanitizers' build
    }
}

// ---- Patches ----

TEST_F(Picture, PatchesHaveTheirColours) {
    // Regular only: greys.
    const auto torus = Surface::build(test::torus(8, 6));
    ASSERT_TRUE(torus);
    PictureOptions o = small(Shade::Patches);
    const Image grey = render(picture_input(*torus), o);
    for (const Color& c : grey.pixels)
        EXPECT_LT(std::max({c.x, c.y, c.z}) - std::min({c.x, c.y, c.z}), 14);

    // A cube has eight EV patches of three sides, which cover it at degree 3: yellow.
    const auto cube = Surface::build(test::cube());
    ASSERT_TRUE(cube);
    o.width = 192;
    o.height = 144;
    const Image yellow = render(picture_input(*cube), o);
    int n_yellow = 0, n_line = 0, n_surface = 0;
    for (int y = 0; y < o.height; ++y) {
        for (int x = 0; x < o.width; ++x) {
            const Color& c = yellow.at(x, y);
            if (c == yellow.at(0, y))
                continue;
            ++n_surface;
            n_yellow += c.x > c.z + 60;
            n_line += std::max({c.x, c.y, c.z}) < 130;
        }
    }
    EXPECT_GT(n_yellow, n_surface / 2);
    EXPECT_GT(n_line, 100);
    EXPECT_LT(n_line, n_surface / 4);
}

// To the left and right, or below and above, the same patch ends at to_edge and not before.
/// The sphere with x and y, times `scale`, as texture coordinates.
PictureInput projected_texture(const Sphere& sphere, double scale) {
    PictureInput input = sphere.input();
    input.texture = [&sphere, scale](const QuarterPoint& at) {
        const auto s = sphere(at);
        const auto uv = [&](const Vec& v) { return scale * Vec2<double>(v.x, v.y); };
        return TextureJet{uv(s.p), uv(s.du), uv(s.dv)};
    };
    return input;
}

// Seen from above, x and y are told by the pixel: cells of an even sum are light.
TEST_F(Picture, CheckerShowsTheTextureCoordinates) {
    const Sphere sphere;
    PictureOptions o = small(Shade::Checker);
    o.elevation_deg = 90;
    const Image image = render(projected_texture(sphere, 0.5), o);
    const SphereView view(o);
    int n_light = 0, n_dark = 0;
    for (int y = 0; y < o.height; ++y) {
        for (int x = 0; x < o.width; ++x) {
            if (view.radius(x, y) > 0.8)
                continue;
            const Vec n = view.normal(x, y);
            const double u = 4 * n.x, v = 4 * n.y;  // in cells
            const auto inside = [](double c) {
                return std::abs(c - std::floor(c) - 0.5) < 0.3;
            };
            if (!inside(u) || !inside(v))
                continue;
            const bool light = (int(std::floor(u)) + int(std::floor(v))) % 2 == 0;
            (light ? n_light : n_dark) += 1;
            const Color& c = image.at(x, y);
            EXPECT_EQ(std::max({c.x, c.y, c.z}) > 128, light) << x << " " << y;
        }
    }
    EXPECT_GT(n_light, 300);
    EXPECT_GT(n_dark, 300);
}

// Squares below the size of a pixel become an even grey-brown, not a moire.
TEST_F(Picture, FineCheckerIsEven) {
    const Sphere sphere;
    PictureOptions o = small(Shade::Checker);
    o.elevation_deg = 90;
    const Image image = render(projected_texture(sphere, 1000), o);
    for (int x = 30; x < 66; ++x)
        EXPECT_LE(difference(image.at(x, 36), image.at(x + 1, 36)), 10) << x;
}

// Red where x is positive, what is beyond 1 as 1; the light is white.
TEST_F(Picture, ColorShowsTheColoursOfTheMesh) {
    const Sphere sphere;
    PictureOptions o = small(Shade::Colors);
    o.elevation_deg = 90;
    PictureInput input = sphere.input();
    input.color = [&](const QuarterPoint& q) {
        return sphere(q).p.x > 0 ? Vec(3, 0, 0) : Vec(0, -1, 0.5);
    };
    const Image image = render(input, o);
    const SphereView view(o);
    int n_red = 0, n_blue = 0;
    for (int y = 0; y < o.height; ++y) {
        for (int x = 0; x < o.width; ++x) {
            if (view.radius(x, y) > 0.8 || std::abs(view.normal(x, y).x) < 0.05)
                continue;
            const Color& c = image.at(x, y);
            const bool red = view.normal(x, y).x > 0;
            (red ? n_red : n_blue) += 1;
            EXPECT_EQ(c.y, 0) << x << " " << y;
            EXPECT_EQ(red ? c.z : c.x, 0) << x << " " << y;
            EXPECT_GT(red ? c.x : c.z, red ? 150 : 75) << x << " " << y;
        }
    }
    EXPECT_GT(n_red, 500);
    EXPECT_GT(n_blue, 500);
}

TEST(PictureInput, KnowsTheDistanceToPatchEdges) {
    std::mt19937 random(42);
    std::uniform_real_distribution<double> uniform(0.01, 0.99);
    for (const int degree : {2, 3, 4}) {
        SCOPED_TRACE(degree);
        const auto surface = Surface::build(test::double_torus(), {.degree = degree});
        ASSERT_TRUE(surface);
        const PictureInput input = picture_input(*surface);
        const auto patch_at = [&](const Address& a) {
            return input.patch(to_quarter(surface->base(), a)).patch;
        };
        int n_crossed = 0;
        for (Index face = 0; face < surface->base().n_faces(); ++face) {
            const Address a{face, uniform(random), uniform(random)};
            const PatchLook look = input.patch(to_quarter(surface->base(), a));
            for (const Vec2<double>& step :
                 {Vec2<double>(look.to_edge.x, 0), Vec2<double>(0, look.to_edge.y)}) {
                const auto moved = [&](double s) {
                    return Address{face, a.u + s * step.x, a.v + s * step.y};
                };
                const auto inside = [&](double s) {
                    const Address m = moved(s);
                    return m.u > 0 && m.u < 1 && m.v > 0 && m.v < 1;
                };
                for (const double s : {-0.999, 0.999}) {
                    if (inside(s)) {
                        EXPECT_EQ(patch_at(moved(s)), look.patch);
                    }
                }
                if (inside(-1.001) && inside(1.001)) {
                    EXPECT_TRUE(patch_at(moved(-1.001)) != look.patch ||
                                patch_at(moved(1.001)) != look.patch);
                    ++n_crossed;
                }
            }
        }
        EXPECT_GT(n_crossed, 10);
    }
}

// No edge runs through the centre of a multisided patch: these cover quarters of a cube.
TEST(PictureInput, HasNoEdgesInsideOfMultisidedPatches) {
    const auto cube = Surface::build(test::cube());
    ASSERT_TRUE(cube);
    const PatchLook look = picture_input(*cube).patch({5, 0.1, 0.4});
    EXPECT_EQ(look.kind, PatchKind::EV);
    EXPECT_EQ(look.n_sectors, 3);
    const int turns = quarter_turns(cube->base(), 5);
    EXPECT_NEAR(turns % 2 == 0 ? look.to_edge.x : look.to_edge.y, 0.45, 1e-12);
    EXPECT_NEAR(turns % 2 == 0 ? look.to_edge.y : look.to_edge.x, 0.3, 1e-12);
}

TEST(PictureInput, GroupsAllPatches) {
    const auto surface = Surface::build(test::prism(5));
    ASSERT_TRUE(surface);
    const PatchTable& table = surface->patches();
    const PictureInput input = picture_input(*surface);
    Index sum = 0;
    bool has_pentagons = false, has_levels = false;
    for (const PatchGroup& g : input.patch_groups) {
        SCOPED_TRACE(testing::Message() << int(g.kind) << " " << g.n_sectors);
        Index expected = 0;
        for (Index i = 0; i < table.n_patches(); ++i) {
            const PatchClass& c = table.class_of(i);
            expected += c.kind == g.kind && c.border == g.border &&
                        c.n_sectors == g.n_sectors &&
                        (c.kind != PatchKind::Regular || table.patch(i).level == g.level);
        }
        EXPECT_EQ(g.n_patches, expected);
        sum += g.n_patches;
        has_pentagons |= g.kind != PatchKind::Regular && g.n_sectors == 5;
        has_levels |= g.kind == PatchKind::Regular && g.level > 0;
    }
    EXPECT_EQ(sum, table.n_patches());
    EXPECT_TRUE(has_pentagons);
    EXPECT_TRUE(has_levels);
}

// ---- Legend ----

TEST_F(Picture, LegendIsDrawn) {
    const Sphere sphere;
    PictureInput input = sphere.input();
    input.title = "sphere";
    PictureOptions o = small(Shade::Mean);
    o.legend = true;
    const Image image = render(input, o);
    const auto n_ink = [&](const Image& picture, int x0, int y0, int x1, int y1) {
        int n = 0;
        for (int y = y0; y < y1; ++y) {
            for (int x = x0; x < x1; ++x)
                n += difference(picture.at(x, y), {40, 42, 48}) == 0;
        }
        return n;
    };
    EXPECT_GT(n_ink(image, 6, 4, 44, 16), 30);   // the title
    EXPECT_GT(n_ink(image, 0, 59, 96, 72), 20);  // numbers
    expect_color(image.at(11, 53), {24, 48, 128}, 8);
    expect_color(image.at(48, 53), {246, 245, 242}, 8);
    expect_color(image.at(85, 53), {128, 12, 38}, 8);

    o.legend = false;
    const Image bare = render(input, o);
    EXPECT_EQ(n_ink(bare, 0, 0, 96, 72), 0);

    const auto cube = Surface::build(test::cube());
    ASSERT_TRUE(cube);
    o = small(Shade::Patches);
    o.legend = true;
    const Image patches = render(picture_input(*cube), o);
    EXPECT_GT(n_ink(patches, 16, 50, 96, 72), 20);
}

// ---- Determinism, errors ----

TEST_F(Picture, DoesNotDependOnThreads) {
    const auto surface = Surface::build(test::double_torus());
    ASSERT_TRUE(surface);
    const PictureInput input = picture_input(*surface);
    for (const Shade shade : {Shade::Phong, Shade::Reflection, Shade::Gauss}) {
        std::vector<Image> images;
        for (const std::size_t n : {1, 2}) {
            const tbb::global_control threads(
                tbb::global_control::max_allowed_parallelism, n);
            images.push_back(render(input, small(shade)));
        }
        EXPECT_EQ(images[0], images[1]);
    }
}

TEST(PictureErrors, NameTheReason) {
    const Sphere sphere;
    const auto expect_error = [&](const PictureInput& input, const PictureOptions& o,
                                  ErrorCode code) {
        const auto image = render_picture(input, o);
        ASSERT_FALSE(image);
        EXPECT_EQ(image.error().code, code) << image.error().message;
    };
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double inf = std::numeric_limits<double>::infinity();
    const PictureInput input = sphere.input();
    const auto with = [](auto change) {
        PictureOptions o = small(Shade::Mean);
        change(o);
        return o;
    };
    for (const PictureOptions& o : {
             with([](PictureOptions& p) { p.width = 0; }),
             with([](PictureOptions& p) { p.height = -1; }),
             with([](PictureOptions& p) { p.width = 16385; }),
             with([](PictureOptions& p) { p.samples = 0; }),
             with([](PictureOptions& p) { p.samples = 17; }),
             with([&](PictureOptions& p) { p.azimuth_deg = nan; }),
             with([&](PictureOptions& p) { p.elevation_deg = inf; }),
             with([](PictureOptions& p) { p.range = 0; }),
             with([](PictureOptions& p) { p.range = -1; }),
             with([&](PictureOptions& p) { p.range = nan; }),
             with([&](PictureOptions& p) { p.range = inf; }),
             with([](PictureOptions& p) { p.shade = Shade::Patches; }),
             with([](PictureOptions& p) { p.shade = Shade::Distance; }),
             with([](PictureOptions& p) { p.shade = Shade::Colors; }),
         })
        expect_error(input, o, ErrorCode::InvalidOption);
    expect_error(input, small(Shade::Checker), ErrorCode::NoTexcoords);

    const Topology empty;
    PictureInput nothing = input;
    nothing.base = &empty;
    expect_error(nothing, small(Shade::Mean), ErrorCode::EmptyMesh);

    PictureInput broken = input;
    broken.surface = [&](const QuarterPoint& at) {
        SurfaceJet<double> jet = sphere(at);
        // The centre only, so that no other face has the point too.
        if (sphere.base->face(at.quarter) == 2 && at.x == 1 && at.y == 1)
            jet.p.y = nan;
        return jet;
    };
    const auto image = render_picture(broken, small(Shade::Mean));
    ASSERT_FALSE(image);
    EXPECT_EQ(image.error().code, ErrorCode::NonFinitePoint);
    EXPECT_EQ(image.error().element, 2u);
}

// ---- Images ----

/// A folder of its own for each test.
class ImageFile : public testing::Test {
protected:
    void SetUp() override {
        const auto* test = testing::UnitTest::GetInstance()->current_test_info();
        folder_ = fs::path(testing::TempDir()) /
                  ("osdx_image_" + std::string(test->name()) + std::to_string(getpid()));
        fs::create_directories(folder_);
    }
    void TearDown() override { fs::remove_all(folder_); }

    std::ptrdiff_t n_files() const {
        return std::distance(fs::directory_iterator(folder_), fs::directory_iterator());
    }

    fs::path folder_;
};

Image random_image(int width, int height) {
    std::mt19937 random(1);
    Image image{width, height, std::vector<Color>(width * height)};
    for (Color& c : image.pixels)
        c = {random() & 255, random() & 255, random() & 255};
    return image;
}

// Of 8 and 16 bits as they are in the file, whatever curve a reader of colours would take.
TEST_F(ImageFile, HeightsAreTheNumbersOfTheFile) {
    const fs::path path = folder_ / "heights.png";
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    png.width = 3;
    png.height = 2;
    const std::uint8_t bytes[] = {0, 51, 255, 102, 13, 204};
    png.format = PNG_FORMAT_GRAY;
    ASSERT_TRUE(png_image_write_to_file(&png, path.c_str(), 0, bytes, 0, nullptr));
    const auto narrow = render::read_heights(path);
    ASSERT_TRUE(narrow) << narrow.error().message;
    const std::uint16_t words[] = {0, 1, 65535, 30000, 777, 4096};
    png.format = PNG_FORMAT_LINEAR_Y;
    ASSERT_TRUE(png_image_write_to_file(&png, path.c_str(), 0, words, 0, nullptr));
    const auto wide = render::read_heights(path);
    ASSERT_TRUE(wide) << wide.error().message;
    ASSERT_EQ(narrow->values.size(), 6u);
    ASSERT_EQ(wide->values.size(), 6u);
    for (std::size_t i = 0; i < 6; ++i) {
        EXPECT_EQ(narrow->values[i], float(bytes[i]) / 255);
        EXPECT_EQ(wide->values[i], float(words[i]) / 65535);
    }
    // Grey pixels of colours are the same.
    Image image{2, 1, {Color(51), Color(200)}};
    ASSERT_TRUE(write_png(path, image));
    const auto grey = render::read_heights(path);
    ASSERT_TRUE(grey);
    EXPECT_EQ(grey->values, (std::vector<float>{51 / 255.f, 200 / 255.f}));
    EXPECT_FALSE(render::read_heights(folder_ / "missing.png"));
    EXPECT_FALSE(render::read_heights(folder_));
}

TEST(HeightMap, IsBilinearBetweenPixelsAndRepeats) {
    const render::HeightMap map{3, 2, {0, 0.2f, 1, 0.4f, 0.05f, 0.8f}};
    // The centres of pixels, the first row above.
    for (int j = 0; j < 2; ++j) {
        for (int i = 0; i < 3; ++i) {
            const Vec2<double> uv((i + 0.5) / 3, 1 - (j + 0.5) / 2);
            // Rounding of the place by some ulps, times a step below 1 a pixel.
            EXPECT_NEAR(map.at(uv), map.values[std::size_t(3 * j + i)], 1e-14);
            EXPECT_NEAR(map.at(uv + Vec2<double>(-2, 5)),
                        map.values[std::size_t(3 * j + i)], 1e-14);
        }
    }
    // Between four, and over both ends.
    EXPECT_NEAR(map.at({1.0 / 3, 0.5}), (0 + 0.2f + 0.4f + 0.05f) / 4, 1e-7);
    EXPECT_NEAR(map.at({0, 0}), (0 + 1 + 0.4f + 0.8f) / 4, 1e-7);
    EXPECT_NEAR(map.at({1, 1}), map.at({0, 0}), 1e-14);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_TRUE(std::isfinite(map.at({nan, 1e300})));
}

TEST_F(ImageFile, PngReadsBackEqual) {
    for (const auto& [width, height] : {std::pair(37, 23), {1, 1}, {1, 400}}) {
        const Image image = random_image(width, height);
        const fs::path path = folder_ / "image.png";
        const Status status = write_png(path, image);
        ASSERT_TRUE(status) << status.error().message;

        png_image png{};
        png.version = PNG_IMAGE_VERSION;
        ASSERT_TRUE(png_image_begin_read_from_file(&png, path.c_str()));
        EXPECT_EQ(png.format, static_cast<png_uint_32>(PNG_FORMAT_RGB));
        Image read{static_cast<int>(png.width), static_cast<int>(png.height), {}};
        read.pixels.resize(png.width * png.height);
        png.format = PNG_FORMAT_RGB;
        ASSERT_TRUE(png_image_finish_read(&png, nullptr, read.pixels.data(), 0, nullptr));
        EXPECT_EQ(read, image);
    }
    EXPECT_EQ(n_files(), 1);
}

TEST_F(ImageFile, RefusesWhatIsNoPicture) {
    Image image = random_image(4, 3);
    image.pixels.pop_back();
    for (const Image& wrong : {image, Image{}, Image{-1, -1, {{}}}}) {
        const Status status = write_png(folder_ / "image.png", wrong);
        ASSERT_FALSE(status);
        EXPECT_EQ(status.error().code, ErrorCode::SizeMismatch);
    }
    const Status status = write_png(folder_ / "missing" / "a.png", random_image(2, 2));
    ASSERT_FALSE(status);
    EXPECT_EQ(status.error().code, ErrorCode::WriteFailed);
    EXPECT_EQ(n_files(), 0);
}

constexpr Color kWhite{255, 255, 255}, kBlack{0, 0, 0};

Image white(int width, int height) {
    return {width, height, std::vector<Color>(width * height, kWhite)};
}

TEST(Drawing, BoxesCoverPixelsInPart) {
    Image image = white(4, 3);
    fill_box(image, {0.75, 1, 2.5, 2}, kBlack);
    const int expected[3][4] = {
        {255, 255, 255, 255}, {191, 0, 128, 255}, {255, 255, 255, 255}};
    for (int y = 0; y < 3; ++y) {
        for (int x = 0; x < 4; ++x)
            EXPECT_NEAR(image.at(x, y).x, expected[y][x], 1) << x << " " << y;
    }
    Image half = white(1, 1);
    fill_box(half, {-5, -5, 9, 9}, {255, 0, 0}, 0.5);
    expect_color(half.at(0, 0), {255, 128, 128}, 1);
    Image none = white(4, 3);
    fill_box(none, {5, 5, 9, 9}, kBlack);
    fill_box(none, {-9, 0, -5, 3}, kBlack);
    fill_box(none, {2, 2, 1, 1}, kBlack);
    EXPECT_EQ(none, white(4, 3));
}

TEST(Drawing, TextIsWhereItIsSaid) {
    for (const double scale : {1.0, 1.5, 2.0}) {
        Image image = white(300, 40);
        const std::string text = "0.5 x Diagonal^2, g";
        draw_text(image, 10, 5, text, scale, kBlack);
        int x0 = 300, x1 = 0, y0 = 40, y1 = 0, n_ink = 0;
        for (int y = 0; y < 40; ++y) {
            for (int x = 0; x < 300; ++x) {
                if (image.at(x, y) == kWhite)
                    continue;
                x0 = std::min(x0, x);
                x1 = std::max(x1, x + 1);
                y0 = std::min(y0, y);
                y1 = std::max(y1, y + 1);
                n_ink += image.at(x, y) == kBlack;
            }
        }
        const double width = text_width(text, scale);
        EXPECT_GE(x0, 10);
        EXPECT_NEAR(x1, 10 + width, 2 * scale + 1);
        EXPECT_GE(y0, 5);
        EXPECT_LE(y1, std::ceil(5 + scale * kLineHeight));
        EXPECT_GT(n_ink, 100);
    }
    // Twice as large: each pixel becomes four.
    Image one = white(40, 12), two = white(80, 24);
    draw_text(one, 1, 1, "Mean", 1, kBlack);
    draw_text(two, 2, 2, "Mean", 2, kBlack);
    EXPECT_NE(one, white(40, 12));
    for (int y = 0; y < 24; ++y) {
        for (int x = 0; x < 80; ++x)
            EXPECT_EQ(two.at(x, y), one.at(x / 2, y / 2)) << x << " " << y;
    }
}

TEST(Drawing, TextTakesAnyBytes) {
    Image expected = white(60, 12), image = expected;
    draw_text(expected, 0, 0, "a?b?c", 1, kBlack);
    draw_text(image, 0, 0,
              "a\xC3\xA9"
              "b\nc",
              1, kBlack);
    EXPECT_EQ(image, expected);
    std::string all;
    for (int c = 0; c < 256; ++c)
        all += static_cast<char>(c);
    draw_text(image, -200, -4, all, 1.3, kBlack);
    draw_text(image, 1e9, 1e9, "far away", 1, kBlack);
    draw_text(image, 0, 0, "", 1, kBlack);
    EXPECT_EQ(text_width("", 2), 0);
}

}  // namespace
}  // namespace osdx::render
