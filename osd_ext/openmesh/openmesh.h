// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/Mesh/Traits.hh>

#include <osdx/build_topology.h>
#include <osdx/mesh_data.h>
#include <osdx/openmesh_arrays.h>
#include <osdx/openmesh_channels.h>
#include <osdx/openmesh_data.h>
#include <osdx/openmesh_fill.h>
#include <osdx/openmesh_surface.h>
#include <osdx/result.h>
#include <osdx/topology.h>

namespace osdx::inline OSDX_ABI {

struct MeshTraits : OpenMesh::DefaultTraits {
    using Point = OpenMesh::Vec3d;
};

/// A mesh of OpenMesh for whoever has no type of their own: polygons of any size with double
/// positions. All else here takes any: read_openmesh(), OpenMeshSurface, fill_openmesh().
using Mesh = OpenMesh::PolyMesh_ArrayKernelT<MeshTraits>;

/// Gives the arrays to OpenMesh, vertex i to vertex i and face i to face i, as far as
/// build_topology() of osdx/build_topology.h takes them.
/// \return what build_topology() returns
OSDX_API Result<Mesh> build_mesh(const MeshData& data);

/// Flattens a mesh that build_mesh made: the same as from its arrays.
OSDX_API Topology build_topology(const Mesh& mesh);

}  // namespace osdx::inline OSDX_ABI
