// SPDX-License-Identifier: Apache-2.0
// solid_mesh.h - a mesh of solid elements with materials and fixed vertices, and its faults.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "hapsix/result.h"
#include "hapsix/vector.h"

namespace h6::io {

// Isotropic and linear in the Green strain (St. Venant-Kirchhoff).
struct SolidMaterial {
  std::string name;
  double young = 0;    // E, above 0 and at most 1e13 [Pa]
  double poisson = 0;  // nu, within (-1, 0.5)
  double density = 0;  // above 0 and at most 1e5 [kg/m^3]
};

inline constexpr std::uint32_t kNoMaterial = 0xffffffff;

// A tetrahedron (4 corners) or a hexahedron (8). Seen from corner 3 of a tetrahedron, corners 0, 1,
// 2 run anticlockwise. A hexahedron's corners 0..3 run around one face and 4..7 stand opposite to
// them, as in VTK: at (0,0,0), (1,0,0), (1,1,0), (0,1,0), (0,0,1), (1,0,1), (1,1,1), (0,1,1) of the
// unit cube.
struct SolidElement {
  std::array<std::uint32_t, 8> corner{};  // indices into vertices
  std::uint32_t corners = 0;              // 4 or 8
  std::uint32_t material = 0;             // index into materials, or kNoMaterial
};

struct SolidMesh {
  std::vector<h6Vec3> vertices;  // [m]
  std::vector<SolidElement> elements;
  std::vector<SolidMaterial> materials;
  std::vector<std::uint32_t> fixed;  // vertices that do not move, rising, each once
  // Named lists of elements, rising: the regions of a file, to which materials can be given.
  struct Set {
    std::string name;
    std::vector<std::uint32_t> elements;
  };
  std::vector<Set> sets;
  std::vector<std::string> remarks;  // sentences about what was left out or seems wrong
};

// Adds the vertices within the box low..high [m], faces of the box included, to the fixed ones and
// returns how many lie in it.
std::size_t fix_box(SolidMesh& mesh, const h6Vec3& low, const h6Vec3& high);
// Adds these vertices; fails where one is not there.
Outcome fix_vertices(SolidMesh& mesh, const std::vector<std::uint32_t>& vertices);

// Gives all elements (empty `set`) or those of a set this material.
Outcome give_material(SolidMesh& mesh, const std::string& set, const SolidMaterial& material);

struct SolidFacts {
  double volume = 0, mass = 0;  // [m^3], [kg]
  std::size_t parts = 0;        // that no element joins
  std::size_t unused = 0;       // vertices of no element
};

// Whether a simulation can use the mesh: elements with a volume that is positive at every point of
// quadrature, materials in their ranges, and, unless `free`, three fixed vertices off one line in
// every part. A free mesh must be one part without fixed vertices. Each failure is a sentence that
// names the element, material or part. The indices must be in range.
Result<SolidFacts> check_solid(const SolidMesh& mesh, bool free);

}  // namespace h6::io
