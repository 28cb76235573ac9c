// SPDX-License-Identifier: Apache-2.0
// alpha.cpp - the alpha puzzle: two equal tubes, each swept along an alpha curve, hooked together.
//
//        tail \   / tail          seen along z. At X the strands cross, 14 mm apart in z between
//              \ /                their axes: 6 mm between surfaces, where the tube is 8 mm thick.
//               X   the gap       Taking the alphas apart needs both gaps at once, one through the
//              / \                other (their crossing segments, at right angles: axes then pass
//             |   |  loop         14 / sqrt(2) = 9.9 mm apart, more than 8 mm).
//              \_/
#include <algorithm>
#include <cmath>
#include <numbers>

#include "io/scenes/paper/alpha.h"
#include "io/scenes/scenes.h"
#include "io/scenes/shapes.h"

namespace h6::io {
namespace {

// The curve is c(t) = (a (t^2 - 1), b t (t^2 - 1), z t): a nodal cubic, lifted along z. Half a turn
// about the x axis maps c(t) to c(-t).
constexpr double kLoopLength = 55 * kMm;  // a
constexpr double kWidth = 45 * kMm;       // b
constexpr double kLift = 7 * kMm;         // z: half of the axes' distance at the crossing
constexpr double kEnd = 1.35;             // largest t: a * (kEnd^2 - 1) = 45 mm, 100 mm in all
constexpr double kTubeRadius = 4 * kMm;
constexpr int kSides = 12, kSegments = 41;  // 12 x 41 x 2 + 2 caps of 12 = 1,008 triangles

h6Vec3 tangent(double t) { return {kLoopLength * 2 * t, kWidth * (3 * t * t - 1), kLift}; }

// Returns pieces + 1 parameters that cut the curve into pieces of equal length.
std::vector<double> equal_lengths(int pieces) {
  constexpr int kSteps = 8192;
  std::vector<double> along(kSteps + 1, 0.0);
  const auto parameter = [](double step) { return kEnd * (2 * step / kSteps - 1); };
  for (int i = 1; i <= kSteps; ++i)
    along[i] = along[i - 1] + norm(alpha_point(parameter(i)) - alpha_point(parameter(i - 1)));
  std::vector<double> out;
  for (int k = 0; k <= pieces; ++k) {
    const double wanted = along.back() * k / pieces;
    const auto next = std::lower_bound(along.begin() + 1, along.end() - 1, wanted);
    const double fraction = (wanted - *(next - 1)) / (*next - *(next - 1));
    out.push_back(parameter(static_cast<double>(next - along.begin()) - 1 + fraction));
  }
  return out;
}

// Makes rings across the curve, joined by two triangles a side, and a fan at either end.
Mesh sweep_tube() {
  Mesh mesh;
  const std::vector<double> parameters = equal_lengths(kSegments);
  for (const double t : parameters) {
    const h6Vec3 along = unit(tangent(t));
    // The curve never runs along z, so `up`, the upright direction across it, does not jump. One
    // vertex of each ring lies along `up`, so the crossing strands face each other edge to edge.
    const h6Vec3 up = unit(h6Vec3{0, 0, 1} - along.z * along);
    const h6Vec3 left = cross(up, along);
    for (int i = 0; i < kSides; ++i) {
      const double angle = 2 * std::numbers::pi * i / kSides;
      const h6Vec3 p = alpha_point(t) + (kTubeRadius * std::cos(angle)) * up +
                       (kTubeRadius * std::sin(angle)) * left;
      mesh.vertices.push_back(p);
    }
  }
  const auto at = [](int ring, int side) {
    return static_cast<std::uint32_t>(ring * kSides + side % kSides);
  };
  for (int k = 0; k < kSegments; ++k)
    for (int i = 0; i < kSides; ++i) {
      mesh.triangles.push_back({at(k, i), at(k + 1, i), at(k + 1, i + 1)});
      mesh.triangles.push_back({at(k, i), at(k + 1, i + 1), at(k, i + 1)});
    }
  for (const int ring : {0, kSegments}) {
    const h6Vec3 centre = alpha_point(parameters[ring]);
    mesh.vertices.push_back(centre);
    const auto middle = static_cast<std::uint32_t>(mesh.vertices.size() - 1);
    for (int i = 0; i < kSides; ++i) {
      const std::uint32_t p = at(ring, i), q = at(ring, i + 1);
      mesh.triangles.push_back({middle, ring == 0 ? p : q, ring == 0 ? q : p});
    }
  }
  return mesh;
}

// Returns the triangles of one strand near the crossing and of its tail. 25 mm before the crossing
// the loop's two sides are still far apart, and the sign of z tells the strands apart from there.
Mesh strand(const Mesh& mesh, bool upper) {
  Mesh out;
  out.vertices = mesh.vertices;
  for (const auto& triangle : mesh.triangles) {
    double x = 0, z = 0;
    for (const std::uint32_t v : triangle) x += mesh.vertices[v].x / 3, z += mesh.vertices[v].z / 3;
    if (x > -25 * kMm && (z > 0) == upper) out.triangles.push_back(triangle);
  }
  return out;
}

}  // namespace

h6Vec3 alpha_point(double t) {
  return {kLoopLength * (t * t - 1), kWidth * t * (t * t - 1), kLift * t};
}

double alpha_end() { return kEnd; }

h6Vec3 alpha_outward() { return unit(h6Vec3{kLoopLength, -kWidth, 0}); }

h6Vec3 alpha_tip() {
  static const std::vector<double> parameters = equal_lengths(kSegments);
  return 0.5 *
         (alpha_point(parameters[kSegments / 2]) + alpha_point(parameters[kSegments / 2 + 1]));
}

AlphaShape make_alpha() {
  AlphaShape out{sweep_tube(), kTubeRadius, 0};
  out.gap = mesh_distance(strand(out.mesh, true), strand(out.mesh, false));
  return out;
}

Scene alpha_pair(const std::string& name, const std::string& about, const h6Pose& tool_pose) {
  const AlphaShape alpha = make_alpha();
  // The voxel is about 0.22 mm, so half a voxel at k = 5e4 N/m is 5.4 N. The paper (Fig. 8) pushes
  // with 20 N at its shortcut. So does this hand, because every method holds below about 15 N.
  Scene scene = common_scene(name, about);
  scene.contact.stiffness = 5e4;
  scene.coupling.max_force = 20;
  scene.coupling.max_torque = 0.25;  // 5 N x 50 mm, half the tool's length

  SceneBody fixed = obstacle("static", alpha.mesh, 0);
  fixed.field->bake.voxels = 512;
  scene.bodies.push_back(std::move(fixed));

  SceneBody tool;
  tool.name = "tool";
  tool.pose = tool_pose;
  tool.shell.emplace();
  tool.shell->mesh_data = alpha.mesh;
  tool.shell->bake.points = 25269;
  tool.shell->bake.levels = 7;
  scene.bodies.push_back(std::move(tool));
  return scene;
}

}  // namespace h6::io
