// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <array>
#include <utility>

#include <osdx/face_varying.h>
#include <osdx/surface.h>
#include <osdx/tessellation_rates.h>
#include <osdx/texture.h>

namespace osdx::inline OSDX_ABI {
namespace {

/// \param where  Address or QuarterPoint
template <class Where>
TextureJet jet_at(const FaceVaryingSurface& surface, const Buffer<double>& values,
                  const Where& where) noexcept {
    std::array<double, 6> d;
    surface.evaluate(values, 2, where, 1, d);
    return {{d[0], d[1]}, {d[2], d[3]}, {d[4], d[5]}};
}

}  // namespace

Result<TextureSurface> TextureSurface::build(const Surface& surface, const MeshData& mesh,
                                             const FeatureOptions& tags,
                                             std::optional<FaceVaryingRule> rule) {
    if (mesh.face_uvs.empty())
        return fail(ErrorCode::NoTexcoords, "the mesh has no texture coordinates");
    const Result<FaceVaryingRule> used = face_varying_rule(mesh, rule, tags.ignore_tags);
    if (!used)
        return used.error();
    Result<FaceVaryingSurface> built =
        FaceVaryingSurface::build(surface, {"texture coordinates", mesh.face_uvs,
                                            static_cast<Index>(mesh.uvs.size()), *used});
    if (!built)
        return built.error();
    Buffer<double> values =
        built->values(Channels<const double>{&mesh.uvs.data()->x, 2, 2});
    return TextureSurface(std::move(*built), std::move(values));
}

TextureJet TextureSurface::evaluate(const QuarterPoint& where) const noexcept {
    return jet_at(surface_, values_, where);
}
TextureJet TextureSurface::evaluate(const Address& where) const noexcept {
    return jet_at(surface_, values_, where);
}

void TextureSurface::add_to(Tessellation& t, int rate) const {
    add_to(t, {.rate = rate});
}
void TextureSurface::add_to(Tessellation& t, const TessellationRates& rates) const {
    surface_.add_to(t, {}, values_, 2, rates);
    const FaceVaryingChannels own = std::move(t.face_varying.back());
    t.face_varying.pop_back();
    t.texcoords.resize(own.n_values());
    for (Index i = 0; i < own.n_values(); ++i)
        t.texcoords[i] = {own.view()[i][0], own.view()[i][1]};
    t.facet_texcoords.assign(own.corner_values.begin(), own.corner_values.end());
}

}  // namespace osdx::inline OSDX_ABI
