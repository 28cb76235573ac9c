// SPDX-License-Identifier: Apache-2.0
#include "io/mesh/mesh.h"

#include "io/mesh/weld.h"

namespace h6::io {

Mesh weld(const Mesh& mesh) {
  const Welded welded = weld_points(mesh.vertices.size(), mesh.vertices.size(), [&](std::size_t i) {
    return without_minus_zero(mesh.vertices[i]);
  });

  // Numbered anew by first use: the order is then that of the triangles, whatever the file's vertex
  // list looked like, and unused vertices fall out.
  constexpr std::uint32_t kUnused = ~std::uint32_t{0};
  std::vector<std::uint32_t> number(welded.vertices.size(), kUnused);
  Mesh out;
  out.part = mesh.part;
  out.part_names = mesh.part_names;
  out.remarks = mesh.remarks;
  out.vertices.reserve(welded.vertices.size());
  out.triangles.reserve(mesh.triangles.size());
  for (const auto& triangle : mesh.triangles) {
    std::array<std::uint32_t, 3> renumbered{};
    for (int corner = 0; corner < 3; ++corner) {
      const std::uint32_t vertex = welded.index[triangle[corner]];
      if (number[vertex] == kUnused) {
        number[vertex] = static_cast<std::uint32_t>(out.vertices.size());
        out.vertices.push_back(welded.vertices[vertex]);
      }
      renumbered[corner] = number[vertex];
    }
    out.triangles.push_back(renumbered);
  }
  return out;
}

Mesh moved(const Mesh& mesh, const h6Pose& pose) {
  Mesh out = mesh;
  for (Vec3& v : out.vertices) v = place(pose, v);
  return out;
}

MeshBounds bounds_of(const Mesh& mesh) {
  MeshBounds b{mesh.vertices.front(), mesh.vertices.front()};
  for (const Vec3& p : mesh.vertices) b.low = min(b.low, p), b.high = max(b.high, p);
  return b;
}

}  // namespace h6::io
