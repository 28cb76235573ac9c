// SPDX-License-Identifier: Apache-2.0
// solids.h - bars and blocks of hexahedra or tetrahedra.
#pragma once
#include <array>
#include <cstdint>

#include "io/deform/solid_mesh.h"

namespace h6::solids {

inline constexpr io::SolidMaterial kRubber{"rubber", 1e7, 0.4, 1000};

// A box from the origin to `size` [m] with cells[i] cells along each axis; nothing is fixed.
inline io::SolidMesh block(const h6Vec3& size, const std::array<int, 3>& cells,
                           const io::SolidMaterial& material = kRubber) {
  io::SolidMesh mesh;
  mesh.materials = {material};
  const auto at = [&](int i, int j, int k) {
    return static_cast<std::uint32_t>((i * (cells[1] + 1) + j) * (cells[2] + 1) + k);
  };
  for (int i = 0; i <= cells[0]; ++i)
    for (int j = 0; j <= cells[1]; ++j)
      for (int k = 0; k <= cells[2]; ++k)
        mesh.vertices.push_back(
            {size.x * i / cells[0], size.y * j / cells[1], size.z * k / cells[2]});
  for (int i = 0; i < cells[0]; ++i)
    for (int j = 0; j < cells[1]; ++j)
      for (int k = 0; k < cells[2]; ++k)
        mesh.elements.push_back(
            {{at(i, j, k), at(i + 1, j, k), at(i + 1, j + 1, k), at(i, j + 1, k), at(i, j, k + 1),
              at(i + 1, j, k + 1), at(i + 1, j + 1, k + 1), at(i, j + 1, k + 1)},
             8,
             0});
  return mesh;
}

// The same with each hexahedron cut into six tetrahedra around its diagonal 0-6.
inline io::SolidMesh tetrahedra(const io::SolidMesh& from) {
  static constexpr int kCuts[6][4] = {{0, 1, 2, 6}, {0, 2, 3, 6}, {0, 3, 7, 6},
                                      {0, 7, 4, 6}, {0, 4, 5, 6}, {0, 5, 1, 6}};
  io::SolidMesh mesh = from;
  mesh.elements.clear();
  for (const io::SolidElement& e : from.elements)
    for (const auto& cut : kCuts)
      mesh.elements.push_back(
          {{e.corner[cut[0]], e.corner[cut[1]], e.corner[cut[2]], e.corner[cut[3]]},
           4,
           e.material});
  return mesh;
}

// A number in [-1, 1) that follows from the two before it only.
inline double noise(std::uint64_t seed, std::uint64_t n) {
  std::uint64_t x = seed * 0x9e3779b97f4a7c15u + n * 0xbf58476d1ce4e5b9u + 1;
  x ^= x >> 30, x *= 0xbf58476d1ce4e5b9u, x ^= x >> 27, x *= 0x94d049bb133111ebu, x ^= x >> 31;
  return static_cast<double>(x >> 11) * 0x1p-52 - 1;
}

// Moves every vertex by up to `most` [m], so that no element is regular.
inline io::SolidMesh shaken(io::SolidMesh mesh, double most) {
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    mesh.vertices[v] =
        mesh.vertices[v] + most * h6Vec3{noise(7, 3 * v), noise(7, 3 * v + 1), noise(7, 3 * v + 2)};
  return mesh;
}

}  // namespace h6::solids
