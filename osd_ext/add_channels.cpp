// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>

#include <osdx/add_channels.h>
#include <osdx/mesh_data.h>
#include <osdx/topology.h>

namespace osdx::inline OSDX_ABI {

Status add_channels(Tessellation& t, const Surface& surface,
                    std::span<const NamedChannels> channels) {
    MeshView mesh;
    mesh.n_vertices = surface.base().n_vertices();
    if (Status status = check_channels(channels, mesh); !status)
        return status;
    int n = 0;
    for (const NamedChannels& c : channels)
        n += c.n;
    if (n == 0)
        return ok();
    const auto width = static_cast<std::size_t>(n);
    Buffer<double> vertices(width * mesh.n_vertices), points(width * t.addresses.size());
    const auto at_vertices = osdx::channels(vertices.data(), n);
    const auto at_points = osdx::channels(points.data(), n);
    int first = 0;
    for (const NamedChannels& c : channels) {
        for (Index v = 0; v < mesh.n_vertices; ++v)
            std::copy_n(c.view()[v], c.n, at_vertices[v] + first);
        first += c.n;
    }
    surface.evaluate(surface.values(at_vertices), n, t.addresses, 0, at_points);
    first = 0;
    for (const NamedChannels& c : channels) {
        NamedChannels& own = t.channels.emplace_back(NamedChannels{c.name, c.n, {}});
        own.values.resize(static_cast<std::size_t>(c.n) * t.addresses.size());
        const auto to = osdx::channels(own.values.data(), c.n);
        for (std::size_t i = 0; i < t.addresses.size(); ++i)
            std::copy_n(at_points[i] + first, c.n, to[i]);
        first += c.n;
    }
    return ok();
}

}  // namespace osdx::inline OSDX_ABI
