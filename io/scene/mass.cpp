// SPDX-License-Identifier: Apache-2.0
// mass.cpp - mass properties from volume integrals of a triangle mesh.
//
// Each triangle and a reference point span a signed tetrahedron. The integral of x_i x_j over a
// tetrahedron with corners 0, a, b, c is det/120 * (s s^T + a a^T + b b^T + c c^T), where
// s = a + b + c.
#include "io/scene/mass.h"

#include <cmath>

namespace h6::io {
namespace {

// Turns second moments (xx yy zz xy xz yz) into the inertia about the same origin.
std::array<double, 6> inertia_of(const std::array<double, 6>& m) {
  return {m[1] + m[2], m[0] + m[2], m[0] + m[1], -m[3], -m[4], -m[5]};
}

std::array<double, 6> outer(double x, double y, double z) {
  return {x * x, y * y, z * z, x * y, x * z, y * z};
}

}  // namespace

std::optional<MassProperties> solid_mass(const Mesh& mesh, double mass) {
  const MeshAudit found = audit(mesh);
  if (!found.closed || found.flipped_edges > 0 || found.duplicates > 0) return std::nullopt;
  // Integrate about the middle of the bounding box, so that a part far from its origin loses no
  // digits.
  const Vec3 o{(found.low.x + found.high.x) / 2, (found.low.y + found.high.y) / 2,
               (found.low.z + found.high.z) / 2};
  double volume = 0;
  Vec3 first{0, 0, 0};
  std::array<double, 6> second{};
  for (const auto& t : mesh.triangles) {
    double p[3][3];
    for (int k = 0; k < 3; ++k) {
      const Vec3& v = mesh.vertices[t[k]];
      p[k][0] = v.x - o.x, p[k][1] = v.y - o.y, p[k][2] = v.z - o.z;
    }
    const double det = p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) -
                       p[0][1] * (p[1][0] * p[2][2] - p[1][2] * p[2][0]) +
                       p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0]);
    const double s[3] = {p[0][0] + p[1][0] + p[2][0], p[0][1] + p[1][1] + p[2][1],
                         p[0][2] + p[1][2] + p[2][2]};
    volume += det / 6;
    first.x += det / 24 * s[0], first.y += det / 24 * s[1], first.z += det / 24 * s[2];
    const auto sum = outer(s[0], s[1], s[2]);
    for (int i = 0; i < 6; ++i) {
      double moment = sum[i];
      for (const auto& corner : p) moment += outer(corner[0], corner[1], corner[2])[i];
      second[i] += det / 120 * moment;
    }
  }
  const double diagonal = std::hypot(found.high.x - found.low.x, found.high.y - found.low.y,
                                     found.high.z - found.low.z);
  // A sheet that is folded onto itself is closed too, but encloses nothing.
  if (!(std::fabs(volume) > 1e-9 * diagonal * diagonal * diagonal)) return std::nullopt;
  const double density = mass / volume;  // if wound inside out, both signs flip and cancel
  const Vec3 c{first.x / volume, first.y / volume, first.z / volume};
  const auto shift = outer(c.x, c.y, c.z);
  for (int i = 0; i < 6; ++i) second[i] = density * second[i] - mass * shift[i];
  return MassProperties{{o.x + c.x, o.y + c.y, o.z + c.z}, inertia_of(second)};
}

MassProperties shell_mass(const ShellData& shell, double mass) {
  const double n = static_cast<double>(shell.size());
  Vec3 c{0, 0, 0};
  for (std::size_t i = 0; i < shell.size(); ++i)
    c.x += shell.x[i] / n, c.y += shell.y[i] / n, c.z += shell.z[i] / n;
  std::array<double, 6> second{};
  for (std::size_t i = 0; i < shell.size(); ++i) {
    const auto m = outer(shell.x[i] - c.x, shell.y[i] - c.y, shell.z[i] - c.z);
    for (int k = 0; k < 6; ++k) second[k] += mass / n * m[k];
  }
  return {c, inertia_of(second)};
}

}  // namespace h6::io
