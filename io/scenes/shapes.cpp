// SPDX-License-Identifier: Apache-2.0
#include "io/scenes/shapes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace h6::io {
namespace {

std::uint32_t add_vertex(Mesh& mesh, const h6Vec3& p) {
  mesh.vertices.push_back(p);
  return static_cast<std::uint32_t>(mesh.vertices.size() - 1);
}

void add_quad(Mesh& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  mesh.triangles.push_back({a, b, c});
  mesh.triangles.push_back({a, c, d});
}

void add_point(PointCloud& cloud, const h6Vec3& p, const h6Vec3& inward) {
  cloud.x.push_back(static_cast<float>(p.x));
  cloud.y.push_back(static_cast<float>(p.y));
  cloud.z.push_back(static_cast<float>(p.z));
  cloud.nx.push_back(static_cast<float>(inward.x));
  cloud.ny.push_back(static_cast<float>(inward.y));
  cloud.nz.push_back(static_cast<float>(inward.z));
}

}  // namespace

h6Quat from_axes(const h6Vec3& x, const h6Vec3& y, const h6Vec3& z) {
  // Divide by the largest of 4w^2, 4x^2, 4y^2 and 4z^2: at least one of them is 1 or more.
  const double squares[4] = {1 + x.x + y.y + z.z, 1 + x.x - y.y - z.z, 1 - x.x + y.y - z.z,
                             1 - x.x - y.y + z.z};
  const double a = y.z - z.y, b = z.x - x.z, c = x.y - y.x;
  const double d = y.x + x.y, e = z.x + x.z, f = z.y + y.z;
  const double rows[4][4] = {
      {squares[0], a, b, c}, {a, squares[1], d, e}, {b, d, squares[2], f}, {c, e, f, squares[3]}};
  const auto best = std::max_element(squares, squares + 4) - squares;
  const double* q = rows[best];
  const double s = 1 / std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  return {q[0] * s, q[1] * s, q[2] * s, q[3] * s};
}

Mesh box_mesh(const h6Vec3& low, const h6Vec3& high) {
  Mesh mesh;
  for (int corner = 0; corner < 8; ++corner)  // bit 0: x, bit 1: y, bit 2: z
    add_vertex(mesh, {corner & 1 ? high.x : low.x, corner & 2 ? high.y : low.y,
                      corner & 4 ? high.z : low.z});
  add_quad(mesh, 0, 2, 3, 1);
  add_quad(mesh, 4, 5, 7, 6);
  add_quad(mesh, 0, 1, 5, 4);
  add_quad(mesh, 2, 6, 7, 3);
  add_quad(mesh, 0, 4, 6, 2);
  add_quad(mesh, 1, 3, 7, 5);
  return mesh;
}

Mesh block_with_hole(double half_side, double height, double radius, double depth, int segments) {
  Mesh mesh;
  const double corner_radius = radius / std::cos(std::numbers::pi / segments);
  // There are four rings with one vertex for every segment: the hole's floor and rim, the block's
  // top and bottom edge. All use the same angles. The square's corners are at odd multiples of 45
  // degrees, which are among the angles because `segments` is a multiple of 8.
  const auto ring = [&](bool square, double z) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (int i = 0; i < segments; ++i) {
      const double angle = 2 * std::numbers::pi * i / segments;
      const double c = std::cos(angle), s = std::sin(angle);
      const double r = square ? half_side / std::max(std::abs(c), std::abs(s)) : corner_radius;
      add_vertex(mesh, {r * c, r * s, z});
    }
    return first;
  };
  const auto count = static_cast<std::uint32_t>(segments);
  const auto join = [&](std::uint32_t a, std::uint32_t b) {
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint32_t j = (i + 1) % count;
      add_quad(mesh, a + i, a + j, b + j, b + i);
    }
  };
  const std::uint32_t floor = ring(false, -depth), rim = ring(false, 0);
  const std::uint32_t top = ring(true, 0), bottom = ring(true, -height);
  join(rim, floor);
  join(top, rim);
  join(bottom, top);
  const std::uint32_t floor_centre = add_vertex(mesh, {0, 0, -depth});
  const std::uint32_t bottom_centre = add_vertex(mesh, {0, 0, -height});
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t j = (i + 1) % count;
    mesh.triangles.push_back({floor_centre, floor + i, floor + j});
    mesh.triangles.push_back({bottom_centre, bottom + j, bottom + i});
  }
  return mesh;
}

void add_face(PointCloud& cloud, const h6Vec3& centre, const h6Vec3& u, const h6Vec3& v, int nu,
              int nv, const h6Vec3& inward) {
  for (int i = 0; i < nu; ++i)
    for (int j = 0; j < nv; ++j)
      add_point(cloud, centre + ((2 * i + 1.0) / nu - 1) * u + ((2 * j + 1.0) / nv - 1) * v,
                inward);
}

void add_cylinder_side(PointCloud& cloud, double radius, double half_length, int around,
                       int along) {
  for (int i = 0; i < around; ++i)
    for (int j = 0; j < along; ++j) {
      const double angle = 2 * std::numbers::pi * (i + 0.5) / around;
      const h6Vec3 out = {std::cos(angle), std::sin(angle), 0};
      const double z = half_length * ((2 * j + 1.0) / along - 1);
      add_point(cloud, radius * out + h6Vec3{0, 0, z}, -1.0 * out);
    }
}

void add_disc(PointCloud& cloud, double radius, double z, double spacing, const h6Vec3& inward) {
  const int reach = static_cast<int>(std::ceil(radius / spacing));
  for (int i = -reach; i <= reach; ++i)
    for (int j = -reach; j <= reach; ++j)
      if (std::hypot(i * spacing, j * spacing) < radius)
        add_point(cloud, {i * spacing, j * spacing, z}, inward);
}

std::array<double, 6> box_inertia(double mass, const h6Vec3& half) {
  const double xx = half.x * half.x, yy = half.y * half.y, zz = half.z * half.z;
  return {mass / 3 * (yy + zz), mass / 3 * (xx + zz), mass / 3 * (xx + yy), 0, 0, 0};
}

std::array<double, 6> cylinder_inertia(double mass, double radius, double half_length) {
  const double across = mass * (radius * radius / 4 + half_length * half_length / 3);
  return {across, across, mass * radius * radius / 2, 0, 0, 0};
}

HandPath& HandPath::wait(double seconds) { return go_to(pose(), seconds); }

HandPath& HandPath::move_by(const h6Vec3& offset, double speed) {
  return go_to({pose().p + offset, pose().q}, norm(offset) / speed);
}

HandPath& HandPath::go_to(const h6Pose& pose, double seconds) {
  rows_.push_back({time() + seconds, pose});
  return *this;
}

Scene common_scene(const std::string& name, const std::string& about) {
  Scene scene;
  scene.name = name;
  scene.about = about;
  scene.unit = Unit::mm;
  scene.contact = h6DefaultContactDef();
  scene.contact.stiffness = 1e4;
  scene.contact.damping = 1e-3;
  scene.coupling = h6DefaultCouplingDef();
  scene.coupling.stiffness = 1e3;
  scene.coupling.rotational_stiffness = 0.9;  // k_VC (30 mm)^2
  scene.coupling.damping_ratio = 1;
  scene.coupling.max_depth_voxels = 0.5;
  scene.coupling.max_torque = 0.15;  // 5 N x 30 mm
  return scene;
}

SceneBody obstacle(const std::string& name, Mesh mesh, double voxel_size) {
  SceneBody body;
  body.name = name;
  body.fixed = true;
  body.pose = {{0, 0, 0}, {1, 0, 0, 0}};
  body.field.emplace();
  body.field->mesh_data = std::move(mesh);
  body.field->bake.voxel_size = voxel_size;
  return body;
}

SceneHand path_hand(const std::string& body, Path path) {
  SceneHand hand;
  hand.body = body;
  hand.path = std::move(path);
  return hand;
}

void add_led(Scene& scene, SceneBody part, double mass, Path path) {
  part.fixed = false;
  part.mass = mass;
  part.pose = path.front().pose;
  scene.verdict.target = path.back().pose;
  scene.verdict.tolerance = kMm, scene.verdict.tolerance_angle = 0.05;
  scene.hands.push_back(path_hand(part.name, std::move(path)));
  scene.bodies.push_back(std::move(part));
}

}  // namespace h6::io
