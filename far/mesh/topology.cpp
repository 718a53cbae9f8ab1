// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cstring>

#include <osdx/topology.h>

#include "far/parallel.h"

namespace osdx::inline OSDX_ABI {

Index Topology::find_valence(Index n_faces, Index from) const noexcept {
    if (valences.empty()) {
        while (from < n_vertices() && valence(from) != n_faces)
            ++from;
        return from < n_vertices() ? from : kInvalidIndex;
    }
    const void* found = std::memchr(valences.data() + from, stored_valence(n_faces),
                                    valences.size() - from);
    return found ? static_cast<Index>(static_cast<const std::uint8_t*>(found) -
                                      valences.data())
                 : kInvalidIndex;
}

bool has_only_quads(const Topology& t) {
    return detail::first_index(t.n_faces(), [&](Index f) {
               return t.face_size(f) != 4;
           }) == kInvalidIndex;
}

std::vector<Index> border_halfedges(const Topology& t) {
    constexpr std::size_t kSize = 4 * detail::kChunk;
    std::vector<std::vector<Index>> chunks(detail::n_chunks(t.n_halfedges(), kSize));
    detail::for_each_chunk(t.n_halfedges(), kSize,
                           [&](std::size_t chunk, std::size_t begin, std::size_t end) {
                               // Mostly there are none, which is quickly seen.
                               auto n = std::count(t.twin.begin() + begin,
                                                   t.twin.begin() + end, kInvalidIndex);
                               for (std::size_t h = begin; n > 0; ++h) {
                                   if (t.twin[h] != kInvalidIndex)
                                       continue;
                                   chunks[chunk].push_back(static_cast<Index>(h));
                                   --n;
                               }
                           });
    std::vector<Index> borders;
    for (const auto& chunk : chunks)
        borders.insert(borders.end(), chunk.begin(), chunk.end());
    return borders;
}

}  // namespace osdx::inline OSDX_ABI
