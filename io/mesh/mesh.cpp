// SPDX-License-Identifier: Apache-2.0
#include "io/mesh/mesh.h"

#include <cmath>
#include <cstdio>

#include "io/mesh/weld.h"

namespace h6::io {

Mesh weld(const Mesh& mesh) {
  const Welded welded = weld_points(mesh.vertices.size(), mesh.vertices.size(), [&](std::size_t i) {
    return without_minus_zero(mesh.vertices[i]);
  });

  // Vertices are numbered by first use, so that the result does not depend on the file's vertex
  // list.
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

std::string too_far_for_floats(const Vec3& low, const Vec3& high) {
  const double far = std::max({std::abs(low.x), std::abs(low.y), std::abs(low.z), std::abs(high.x),
                               std::abs(high.y), std::abs(high.z)});
  const double side = std::max({high.x - low.x, high.y - low.y, high.z - low.z});
  if (!(far > 0) || !std::isfinite(far)) return "";
  const double step = std::ldexp(1.0, std::ilogb(far) - 23);  // to the next float
  if (step <= 2e-4 * side) return "";
  char text[240];
  std::snprintf(text, sizeof text,
                "the mesh lies %.4g m from its origin, where numbers of single precision (of an "
                "STL file, of a shell) are %.3g mm apart; move it nearer to its origin",
                far, 1e3 * step);
  return text;
}

std::string too_far_for_floats(const Mesh& mesh) {
  if (mesh.vertices.empty()) return "";
  const MeshBounds box = bounds_of(mesh);
  return too_far_for_floats(box.low, box.high);
}

}  // namespace h6::io
