// SPDX-License-Identifier: Apache-2.0
// shapes.h - parts of generated scenes: primitive meshes, point grids, hand paths. Metres.
#pragma once
#include "hapsix/vector.h"
#include "io/scene/scene.h"

namespace h6::io {

inline constexpr double kMm = 1e-3;

// The rotation that turns the axes of the world into x, y, z: right-handed, unit.
h6Quat from_axes(const h6Vec3& x, const h6Vec3& y, const h6Vec3& z);

// ---- closed meshes, wound outward --------------------------------------------------------------

Mesh box_mesh(const h6Vec3& low, const h6Vec3& high);
// A square block |x|, |y| <= half_side, -height <= z <= 0 with a blind hole around the z axis. The
// hole is a regular prism of `segments` sides (a multiple of 8). Its sides are at distance `radius`
// from the axis and its floor is at z = -depth.
Mesh block_with_hole(double half_side, double height, double radius, double depth, int segments);

// Smallest distance between the surfaces of two meshes, 0 when they cross. It tries all triangle
// pairs whose bounding spheres are near enough, so it is meant for checks of clearance only.
double mesh_distance(const Mesh& a, const Mesh& b);

// ---- explicit shells: grids of cell centres ----------------------------------------------------

// nu x nv points on the parallelogram centre +- u +- v.
void add_face(PointCloud& cloud, const h6Vec3& centre, const h6Vec3& u, const h6Vec3& v, int nu,
              int nv, const h6Vec3& inward);
// The side of a cylinder around the z axis.
void add_cylinder_side(PointCloud& cloud, double radius, double half_length, int around, int along);
// The points inside the circle at height z of a square grid that has a point on the z axis.
void add_disc(PointCloud& cloud, double radius, double z, double spacing, const h6Vec3& inward);

std::array<double, 6> box_inertia(double mass, const h6Vec3& half);
std::array<double, 6> cylinder_inertia(double mass, double radius, double half_length);

// ---- hand paths --------------------------------------------------------------------------------

class HandPath {
 public:
  explicit HandPath(const h6Pose& start) : rows_{{0, start}} {}
  HandPath& wait(double seconds);
  HandPath& move_by(const h6Vec3& offset, double speed);  // straight, [m/s]
  HandPath& go_to(const h6Pose& pose, double seconds);
  const h6Pose& pose() const { return rows_.back().pose; }
  double time() const { return rows_.back().t; }
  Path rows() const { return rows_; }

 private:
  Path rows_;
};

// A scene with the contact and coupling settings that the paper's experiments share: voxel 1 mm,
// contact stiffness 1e4 N/m, virtual coupling 1e3 N/m and 0.9 N m/rad, critically damped, its force
// bounded to half a voxel of penetration, its torque to 0.15 N m (5 N x 30 mm).
Scene common_scene(const std::string& name, const std::string& about);
// A fixed body with a field of `voxel_size` [m].
SceneBody obstacle(const std::string& name, Mesh mesh, double voxel_size);
// A hand that leads a body along a path.
SceneHand path_hand(const std::string& body, Path path);
// Frees an obstacle, which a hand then leads along a path; the scene's target is the path's end.
void add_led(Scene& scene, SceneBody part, double mass, Path path);

}  // namespace h6::io
