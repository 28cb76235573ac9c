// SPDX-License-Identifier: Apache-2.0
#include "io/deform/elements.h"

namespace h6::io::deform {
namespace {

// The local coordinates of a hexahedron's corners.
constexpr int kCube[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                             {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};

struct Shape {
  std::array<double, 8> value{};
  std::array<h6Vec3, 8> slope{};  // by the local coordinates
};

Shape shape_of(std::uint32_t corners, const h6Vec3& at) {
  Shape s;
  if (corners == 4) {
    s.value = {1 - at.x - at.y - at.z, at.x, at.y, at.z};
    s.slope = {h6Vec3{-1, -1, -1}, h6Vec3{1, 0, 0}, h6Vec3{0, 1, 0}, h6Vec3{0, 0, 1}};
    return s;
  }
  for (int a = 0; a < 8; ++a) {
    const double x = kCube[a][0] ? at.x : 1 - at.x, dx = kCube[a][0] ? 1 : -1;
    const double y = kCube[a][1] ? at.y : 1 - at.y, dy = kCube[a][1] ? 1 : -1;
    const double z = kCube[a][2] ? at.z : 1 - at.z, dz = kCube[a][2] ? 1 : -1;
    s.value[a] = x * y * z;
    s.slope[a] = {dx * y * z, x * dy * z, x * y * dz};
  }
  return s;
}

}  // namespace

QuadraturePoint at_local(const SolidMesh& mesh, const SolidElement& element, const h6Vec3& local) {
  const Shape shape = shape_of(element.corners, local);
  h6Vec3 dx{}, dy{}, dz{};  // dX/d(local), column by column
  for (std::uint32_t a = 0; a < element.corners; ++a) {
    const h6Vec3& p = mesh.vertices[element.corner[a]];
    dx = dx + shape.slope[a].x * p;
    dy = dy + shape.slope[a].y * p;
    dz = dz + shape.slope[a].z * p;
  }
  QuadraturePoint out;
  out.value = shape.value;
  out.weight = dot(dx, cross(dy, dz));
  // The rows of the inverse are the crossed columns over the determinant.
  const double one = 1 / out.weight;
  const h6Vec3 rx = one * cross(dy, dz), ry = one * cross(dz, dx), rz = one * cross(dx, dy);
  for (std::uint32_t a = 0; a < element.corners; ++a)
    out.gradient[a] = shape.slope[a].x * rx + shape.slope[a].y * ry + shape.slope[a].z * rz;
  return out;
}

Quadrature quadrature(const SolidMesh& mesh, const SolidElement& element) {
  Quadrature out;
  if (element.corners == 4) {
    out.point[0] = at_local(mesh, element, {0.25, 0.25, 0.25});
    out.point[0].weight /= 6;
    out.count = 1;
    return out;
  }
  constexpr double kLow = 0.21132486540518711775, kHigh = 0.78867513459481288225;
  for (int i = 0; i < 8; ++i) {
    out.point[i] =
        at_local(mesh, element, {i & 1 ? kHigh : kLow, i & 2 ? kHigh : kLow, i & 4 ? kHigh : kLow});
    out.point[i].weight /= 8;
  }
  out.count = 8;
  return out;
}

ShapeProducts shape_products(const SolidMesh& mesh, const SolidElement& element) {
  const Quadrature points = quadrature(mesh, element);
  ShapeProducts out{};
  if (element.corners == 4) {
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b) out[a][b] = points.point[0].weight * (a == b ? 0.1 : 0.05);
    return out;
  }
  for (const QuadraturePoint& p : points.point)
    for (int a = 0; a < 8; ++a)
      for (int b = 0; b < 8; ++b) out[a][b] += p.weight * p.value[a] * p.value[b];
  return out;
}

}  // namespace h6::io::deform
