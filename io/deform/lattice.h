// SPDX-License-Identifier: Apache-2.0
// lattice.h - cubes that fill a closed surface, as a coarse solid mesh of it.
#pragma once
#include "hapsix/result.h"
#include "io/deform/solid_mesh.h"
#include "io/file/progress.h"
#include "io/mesh/mesh.h"

namespace h6::io {

inline constexpr std::size_t kMostCells = 200000;

// Cubes of edge `cell` [m] whose middle or any corner lies inside the mesh, which must be closed;
// the sign comes from its baked field. So the lattice covers the surface, and is somewhat larger
// and stiffer than the part: a remark gives both volumes. The elements have no material, and
// nothing is fixed. Fails where the mesh is open or no cell is inside, and above kMostCells.
Result<SolidMesh> make_lattice(const Mesh& mesh, double cell, unsigned threads = 0,
                               const Progress& progress = {});

}  // namespace h6::io
