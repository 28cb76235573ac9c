// SPDX-License-Identifier: Apache-2.0
// solid_file.h - reads a mesh of tetrahedra and hexahedra from a file.
//
//   .veg  Vega: *VERTICES, *ELEMENTS TET or CUBIC, *MATERIAL with ENU, *SET, *REGION
//   .msh  Gmsh 2.2 and 4.1, as text; physical groups become sets
//   .vtk  legacy VTK, an unstructured grid as text: tetra, hexahedron, voxel
//
// Each also as .gz. Points, lines and faces are left out; higher orders, wedges and pyramids are
// refused. Every failure is one sentence that begins with the file's name and gives the line.
#pragma once
#include <filesystem>
#include <string>

#include "hapsix/result.h"
#include "io/deform/solid_mesh.h"
#include "io/mesh/mesh_file.h"

namespace h6::io {

// Every index is in range and every vertex is finite and within 1e6 m. If all tetrahedra or all
// hexahedra of the file are wound the other way, they are turned, with a remark. Elements of no
// region have kNoMaterial. Moduli and densities are SI whatever the unit of length.
Result<SolidMesh> read_solid(const std::filesystem::path& file, Unit unit = Unit::m);
// The same from bytes; the name's ending decides about the format.
Result<SolidMesh> parse_solid(const std::string& bytes, const std::string& name,
                              Unit unit = Unit::m);
bool is_solid_name(const std::string& name);  // by its ending

}  // namespace h6::io
