// SPDX-License-Identifier: Apache-2.0
#include "io/deform/solid_surface.h"

#include <algorithm>
#include <array>
#include <limits>

namespace h6::io {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

struct Face {
  std::array<std::uint32_t, 4> key;     // the same vertices, rising
  std::array<std::uint32_t, 4> corner;  // in their turn; the last is kNone in a triangle
};

// Seen from outside, faces run anticlockwise (elements as in solid_mesh.h).
constexpr int kTetrahedron[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
constexpr int kHexahedron[6][4] = {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4},
                                   {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};

void add_face(const SolidElement& e, const int* corners, int count, std::vector<Face>& faces) {
  Face face{{kNone, kNone, kNone, kNone}, {kNone, kNone, kNone, kNone}};
  for (int i = 0; i < count; ++i)
    face.corner[static_cast<std::size_t>(i)] = e.corner[static_cast<std::size_t>(corners[i])];
  face.key = face.corner;
  std::sort(face.key.begin(), face.key.end());
  faces.push_back(face);
}

}  // namespace

std::vector<std::uint32_t> surface_of(const SolidMesh& mesh) {
  std::vector<Face> faces;
  for (const SolidElement& e : mesh.elements) {
    if (e.corners == 4)
      for (const auto& f : kTetrahedron) add_face(e, f, 3, faces);
    else
      for (const auto& f : kHexahedron) add_face(e, f, 4, faces);
  }
  std::sort(faces.begin(), faces.end(), [](const Face& a, const Face& b) { return a.key < b.key; });
  std::vector<std::uint32_t> triangles;
  for (std::size_t i = 0; i < faces.size();) {
    std::size_t end = i + 1;
    while (end < faces.size() && faces[end].key == faces[i].key) ++end;
    const auto& c = faces[i].corner;
    if (end == i + 1) {
      triangles.insert(triangles.end(), {c[0], c[1], c[2]});
      if (c[3] != kNone) triangles.insert(triangles.end(), {c[0], c[2], c[3]});
    }
    i = end;
  }
  return triangles;
}

}  // namespace h6::io
