// SPDX-License-Identifier: Apache-2.0
// stiffness.cpp - the net stiffness of the weighted contacts as a function of the sampling of flat
// and curved patches, and of the angle between two planes.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "io/experiments/probe.h"

namespace h6::cli {
namespace {

constexpr double kPi = std::numbers::pi;

// Largest eigenvalue of a symmetric 3 x 3 matrix: power iteration, shifted to be positive.
double largest_eigenvalue(const double (&A)[3][3]) {
  double shift = 0, v[3] = {0.48, 0.6, 0.64}, length = 0;
  for (const auto& row : A)
    for (const double a : row) shift += std::abs(a);
  if (shift == 0) return 0;
  for (int step = 0; step < 2000; ++step) {
    double w[3];
    for (int a = 0; a < 3; ++a)
      w[a] = A[a][0] * v[0] + A[a][1] * v[1] + A[a][2] * v[2] + shift * v[a];
    length = std::sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
    for (int a = 0; a < 3; ++a) v[a] = w[a] / length;
  }
  return length - shift;
}

struct Matrix3 {
  double m[3][3] = {};
};

// Sum of w N N^T: the stiffness that the implicit step assumes, in k.
Matrix3 frozen_stiffness(const h6Contacts& c) {
  Matrix3 out;
  for (std::size_t i = 0; i < c.count; ++i) {
    const double n[3] = {c.nx[i], c.ny[i], c.nz[i]};
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) out.m[a][b] += c.weight[i] * n[a] * n[b];
  }
  return out;
}

// The stiffness that a hand feels, in k: the symmetric part of -dF/dx, by central differences over
// 0.02 voxel.
Matrix3 felt_stiffness(Probe& probe, const h6Pose& pose) {
  constexpr double kStep = 0.01 * kProbeVoxel;
  double A[3][3];
  for (int b = 0; b < 3; ++b) {
    const h6Vec3 step = {b == 0 ? kStep : 0, b == 1 ? kStep : 0, b == 2 ? kStep : 0};
    const h6Vec3 more = elastic_wrench(probe.at({pose.p + step, pose.q}), 1).force;
    const h6Vec3 less = elastic_wrench(probe.at({pose.p - step, pose.q}), 1).force;
    const h6Vec3 d = (-0.5 / kStep) * (more - less);
    A[0][b] = d.x, A[1][b] = d.y, A[2][b] = d.z;
  }
  Matrix3 out;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) out.m[a][b] = 0.5 * (A[a][b] + A[b][a]);
  return out;
}

io::PointCloud uneven_bottom() {  // 700 points on one half, 100 on the other
  io::PointCloud cloud;
  const h6Vec3 v = {0, 10 * kMm, 0}, half = {5 * kMm, 0, 0}, in = {0, 0, 1};
  io::add_face(cloud, {-5 * kMm, 0, -5 * kMm}, half, v, 20, 35, in);
  io::add_face(cloud, {5 * kMm, 0, -5 * kMm}, half, v, 10, 10, in);
  return cloud;
}

io::Mesh bowl() {
  std::vector<io::Ring> rings;
  for (int i = 0; i < 24; ++i)
    rings.push_back(
        {10 * kMm * std::cos(kPi / 2 * i / 24), -10 * kMm * std::sin(kPi / 2 * i / 24)});
  return io::block_with_cavity(20 * kMm, 20 * kMm, rings, -10 * kMm, 96);
}

io::PointCloud half_ball(int count) {  // points along a spiral, with equal areas
  io::PointCloud cloud;
  const double turn = kPi * (3 - std::sqrt(5.0)), radius = 10 * kMm + kProbeDepth;
  for (int i = 0; i < count; ++i) {
    const double z = -(i + 0.5) / count, r = std::sqrt(1 - z * z);
    const h6Vec3 out = {r * std::cos(turn * i), r * std::sin(turn * i), z};
    io::add_shell_point(cloud, radius * out, -1.0 * out);
  }
  return cloud;
}

io::PointCloud cylinder(int around, int along) {
  io::PointCloud cloud;
  io::add_cylinder_side(cloud, 10 * kMm + kProbeDepth, 12 * kMm, around, along);
  return cloud;
}

io::PointCloud cone(double spacing) {  // 20 mm high, tip down, in a seat of the same angle
  io::PointCloud cloud;
  const double radius = 10 * kMm, height = 20 * kMm;
  const h6Vec3 down = {0, 0, -kProbeDepth * std::hypot(radius, height) / radius};
  const int rows = static_cast<int>(std::lround(std::hypot(radius, height) / spacing));
  for (int i = 0; i < rows; ++i) {
    const double t = (i + 0.5) / rows, r = radius * t;
    const int count = std::max(1, static_cast<int>(std::lround(2 * kPi * r / spacing)));
    for (int j = 0; j < count; ++j) {
      const double angle = 2 * kPi * (j + 0.5 * (i % 2)) / count;
      const h6Vec3 out = {std::cos(angle), std::sin(angle), 0};
      const h6Vec3 normal = unit(height * out - radius * h6Vec3{0, 0, 1});
      io::add_shell_point(cloud, r * out + h6Vec3{0, 0, (t - 1) * height} + down, -1.0 * normal);
    }
  }
  return cloud;
}

}  // namespace

Study study_net_stiffness(const std::vector<MethodColumn>& columns, const Console& console) {
  Study out;
  out.title = "Net stiffness against sampling";
  out.about =
      "The translational stiffness of a whole patch in units of k, the stiffness of one "
      "contact, with all points about 0.2 voxel deep. First the largest eigenvalue of Σ w N Nᵀ "
      "with the engine's shares w, then that of the force's true derivative, by central "
      "differences. The shares of `series` are secants of a joint solve, so only the second "
      "shows the stiffness that the step uses; its bound is c = 4. Prototype, by shares: "
      "hemisphere gauss3 100 / 1000, robust 100 / 662; tight cylinder 139 / 229 and 83 / 100; "
      "series at most 4 everywhere. `series` shows 4.06 on the hemisphere with 3000 points, "
      "because the bound is on Σ κ J Jᵀ, which the symmetric step uses (3.95 there). The "
      "force's true derivative has the field's slope in the place of the second J. At the "
      "bowl's rim, which samples 1 mm apart round off, that slope is neither along N (N·g down "
      "to 0.33) nor of length 1 (0.56 to 1.22). Without the points within half a voxel of the "
      "rim it is 3.67, on exact distances 3.96, on a whole ball sampled at 1 mm 3.95. Neither "
      "the step of the differences nor contacts that come and go are the cause: over 0.01, "
      "0.001 and 0.0001 voxel, in double, the results agree to 0.1 %.";
  struct Patch {
    const char* name;
    io::Scene scene;
    h6Pose pose;
  };
  const h6Pose down = {{0, 0, 5 * kMm - kProbeDepth}, {1, 0, 0, 0}},
               here = {{0, 0, 0}, {1, 0, 0, 0}};
  const h6Pose in_hole = {{0, 0, -16 * kMm}, {1, 0, 0, 0}};
  const io::Mesh wall = plate(-40 * kMm, 40 * kMm);
  const io::Mesh hole = io::block_with_hole(20 * kMm, 40 * kMm, 10 * kMm, 32 * kMm, 128);
  const io::Mesh seat = io::block_with_cavity(20 * kMm, 30 * kMm,
                                              {{10 * kMm, 0}, {5 * kMm, -10 * kMm}}, -20 * kMm, 96);
  std::vector<Patch> patches;
  patches.push_back({"wall, 144", posed_scene("wall", wall, bottom(12, 12)), down});
  patches.push_back({"wall, 1600", posed_scene("wall", wall, bottom(40, 40)), down});
  patches.push_back({"wall, 800 uneven", posed_scene("wall", wall, uneven_bottom()), down});
  patches.push_back({"hemisphere, 300", posed_scene("bowl", bowl(), half_ball(300)), here});
  patches.push_back({"hemisphere, 3000", posed_scene("bowl", bowl(), half_ball(3000)), here});
  patches.push_back({"cylinder, 400", posed_scene("hole", hole, cylinder(20, 20)), in_hole});
  patches.push_back({"cylinder, 4000", posed_scene("hole", hole, cylinder(80, 50)), in_hole});
  patches.push_back({"cone seat, about 189", posed_scene("seat", seat, cone(1.95 * kMm)), here});
  patches.push_back({"cone seat, about 1437", posed_scene("seat", seat, cone(0.7 * kMm)), here});

  out.table = head("patch", columns);
  const std::vector<double> zeros(columns.size(), 0);
  std::vector<std::vector<double>> frozen(patches.size(), zeros), felt(patches.size(), zeros);
  std::vector<std::uint32_t> counts(patches.size(), 0);
  std::vector<std::function<void()>> jobs;
  for (std::size_t p = 0; p < patches.size(); ++p)
    jobs.push_back([&, p] {
      auto loaded = io::load_scene(patches[p].scene);
      if (!loaded) return;
      for (std::size_t m = 0; m < columns.size(); ++m)
        if (Probe probe(**loaded, columns[m]); probe) {
          frozen[p][m] = largest_eigenvalue(frozen_stiffness(probe.at(patches[p].pose)).m);
          counts[p] = std::max(counts[p], static_cast<std::uint32_t>(probe.report().contacts));
          felt[p][m] = largest_eigenvalue(felt_stiffness(probe, patches[p].pose).m);
        }
    });
  run_jobs(jobs, console, "net stiffness");
  for (std::size_t p = 0; p < patches.size(); ++p) {
    out.table.push_back(
        {std::string(patches[p].name) + " (" + std::to_string(counts[p]) + " touch)"});
    out.json[patches[p].name]["contacts"] = counts[p];
    for (std::size_t m = 0; m < columns.size(); ++m) {
      const double a = frozen[p][m], b = felt[p][m];
      out.table.back().push_back(number(a, a < 20 ? 2 : 0) + " / " +
                                 number(b, std::abs(b) < 20 ? 2 : 0));
      out.json[patches[p].name][columns[m].name] = {{"shares", a}, {"derivative", b}};
    }
  }
  return out;
}

// ---- Fig. 4: two inclined planes ---------------------------------------------------------------

namespace {

constexpr int kSide = 8;  // 64 points on either plane

// A block whose bottom has two slanted faces, each parallel to the plane under it. The planes rise
// outward at `angle` [rad] on either side and push inward and up.
io::Scene two_planes(double angle) {
  io::Scene scene = io::common_scene("two-planes", "two-planes");
  io::SceneBody block;
  block.name = "body";
  block.com = h6Vec3{0, 0, 0};
  block.inertia = io::box_inertia(block.mass, {20 * kMm, 5 * kMm, 10 * kMm});
  block.pose = {{0, 0, 0}, {1, 0, 0, 0}};
  block.shell.emplace();
  block.shell->points.emplace();
  block.shell->bake.levels = 3;
  std::vector<io::SceneBody> planes;
  for (const double side : {-1.0, 1.0}) {
    const h6Quat turn = turn_by({0, -side * angle, 0});
    const h6Vec3 up = rotate(turn, {0, 0, 1}), along = rotate(turn, {1, 0, 0});
    const h6Vec3 middle = {side * 20 * kMm, 0, -5 * kMm};
    io::add_face(*block.shell->points, middle - kProbeDepth * up, 4 * kMm * along, {0, 4 * kMm, 0},
                 kSide, kSide, up);
    planes.push_back(io::obstacle(
        side < 0 ? "left" : "right",
        io::box_mesh({-8 * kMm, -8 * kMm, -12 * kMm}, {8 * kMm, 8 * kMm, 0}), kProbeVoxel));
    planes.back().pose = {middle, turn};
  }
  scene.bodies = {std::move(planes[0]), std::move(block), std::move(planes[1])};
  return scene;
}

// The eigenvalues in the xz plane of a symmetric matrix that does not couple y to x and z. The
// eigenvector of `x` is the one nearer to the x axis.
struct Eigenvalues {
  double x, z, rest;  // rest: the largest of the entries that should be zero
};
Eigenvalues eigenvalues(const Matrix3& K) {
  const double a = K.m[0][0], b = K.m[2][2], c = K.m[0][2];
  const double middle = 0.5 * (a + b), half = std::hypot(0.5 * (a - b), c);
  const double rest = std::max({std::abs(K.m[1][1]), std::abs(K.m[0][1]), std::abs(K.m[1][2])});
  return a >= b ? Eigenvalues{middle + half, middle - half, rest}
                : Eigenvalues{middle - half, middle + half, rest};
}

}  // namespace

Study study_two_planes(const std::vector<MethodColumn>& columns, const Console& console) {
  Study out;
  out.title = "Fig. 4: two inclined planes";
  out.about =
      "A block on two planes that rise at α to either side, with 64 points on each, all 0.2 "
      "voxel deep. The table gives the eigenvalues of the translational stiffness in k, along x "
      "/ along z, from the force's true derivative by central differences. If the contacts of "
      "one plane together have the stiffness s, they should be 2 s sin²α and 2 s cos²α; in the "
      "paper s is 1. The last rows give the mean of s over α, and the largest deviation of any "
      "eigenvalue from 2 s sin²α, 2 s cos²α or 0 with the s of its α, in shares of 2 s.";
  const std::vector<int> angles = {5, 15, 25, 35, 45, 55, 65, 75, 85};
  std::vector<std::vector<Eigenvalues>> found(angles.size(),
                                              std::vector<Eigenvalues>(columns.size()));
  std::vector<std::function<void()>> jobs;
  for (std::size_t i = 0; i < angles.size(); ++i)
    jobs.push_back([&, i] {
      auto loaded = io::load_scene(two_planes(angles[i] * kPi / 180));
      if (!loaded) return;
      for (std::size_t m = 0; m < columns.size(); ++m)
        if (Probe probe(**loaded, columns[m]); probe)
          found[i][m] = eigenvalues(felt_stiffness(probe, {{0, 0, 0}, {1, 0, 0, 0}}));
    });
  run_jobs(jobs, console, "two planes");

  out.table = head("α", columns);
  out.table[0].insert(out.table[0].begin() + 1, "2 sin²α / 2 cos²α");
  std::vector<double> mean(columns.size(), 0), off(columns.size(), 0);
  for (std::size_t i = 0; i < angles.size(); ++i) {
    const double sine = std::sin(angles[i] * kPi / 180), x = 2 * sine * sine, z = 2 - x;
    out.table.push_back({std::to_string(angles[i]) + "°", number(x, 3) + " / " + number(z, 3)});
    for (std::size_t m = 0; m < columns.size(); ++m) {
      const Eigenvalues& e = found[i][m];
      const double s = 0.5 * (e.x + e.z);
      mean[m] += s / static_cast<double>(angles.size());
      if (s > 0)
        off[m] = std::max(
            off[m], std::max({std::abs(e.x - s * x), std::abs(e.z - s * z), e.rest}) / (2 * s));
      out.table.back().push_back(number(e.x, e.x < 20 ? 3 : 0) + " / " +
                                 number(e.z, e.z < 20 ? 3 : 0));
      out.json["alpha"][std::to_string(angles[i])][columns[m].name] = {{"x", e.x}, {"z", e.z}};
    }
  }
  out.table.push_back({"s", "1"});
  out.table.push_back({"deviation", "0"});
  for (std::size_t m = 0; m < columns.size(); ++m) {
    out.table[out.table.size() - 2].push_back(number(mean[m], 3));
    out.table.back().push_back(number(100 * off[m], 2) + " %");
    out.json["per_plane"][columns[m].name] = mean[m];
    out.json["deviation"][columns[m].name] = off[m];
  }
  out.after =
      "Every rule that shares by density keeps the shape of the paper's formula. `robust` has "
      "an s of about 1 except near 76°, where the planes' normals pass through the centre of "
      "mass: the torque directions there point all ways round, and a product of hats takes "
      "contacts that differ in them for different contacts, as on a wall (4.5 in the study of "
      "net stiffness). `series` bounds each direction by itself, at 4, so its weaker direction "
      "is stiffer than the formula says.";
  return out;
}

}  // namespace h6::cli
