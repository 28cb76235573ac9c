// alpha.cpp - the alpha puzzle: two equal tubes, each swept along an alpha curve, hooked together.
//
//        tail \   / tail          seen along z. At X the strands cross, 14 mm apart in z between
//              \ /                their axes: 6 mm between surfaces, where the tube is 8 mm thick.
//               X   the gap       Taking the alphas apart needs both gaps at once, one through the
//              / \                other (their crossing segments, at right angles: axes then pass
//             |   |  loop         14 / sqrt(2) = 9.9 mm apart, more than 8).
//              \_/
//
// alpha-shortcut: the tool's loop hangs around the lower strand of the static alpha, and the hand
// slides it along that strand like a ring, out of the loop, through the gap, off the tail's free
// end. The way is free everywhere but in the gap; tubes 6 mm thick would pass.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "io/scenes/alpha.h"
#include "io/scenes/list.h"
#include "io/scenes/scenes.h"
#include "io/scenes/shapes.h"

namespace h6::io {
namespace {

// c(t) = (a (t^2 - 1), b t (t^2 - 1), z t): nodal cubic, lifted. t and -t are mirrored by half a
// turn about the x axis.
constexpr double kLoopLength = 55 * kMm;  // a
constexpr double kWidth = 45 * kMm;       // b
constexpr double kLift = 7 * kMm;         // z: half of the axes' distance at the crossing
constexpr double kEnd = 1.35;             // largest t: a * (kEnd^2 - 1) = 45 mm, 100 mm in all
constexpr double kTubeRadius = 4 * kMm;
constexpr int kSides = 12, kSegments = 41;  // 12 x 41 x 2 + 2 caps of 12 = 1,008 triangles

h6Vec3 tangent(double t) { return {kLoopLength * 2 * t, kWidth * (3 * t * t - 1), kLift}; }

// Parameters that cut the curve into pieces of equal length.
std::vector<double> equal_lengths(int pieces) {
  constexpr int kSteps = 8192;
  std::vector<double> along(kSteps + 1, 0.0);
  const auto parameter = [](double step) { return kEnd * (2 * step / kSteps - 1); };
  for (int i = 1; i <= kSteps; ++i)
    along[i] = along[i - 1] + length(alpha_point(parameter(i)) - alpha_point(parameter(i - 1)));
  std::vector<double> out;
  for (int k = 0; k <= pieces; ++k) {
    const double wanted = along.back() * k / pieces;
    const auto next = std::lower_bound(along.begin() + 1, along.end() - 1, wanted);
    const double fraction = (wanted - *(next - 1)) / (*next - *(next - 1));
    out.push_back(parameter(static_cast<double>(next - along.begin()) - 1 + fraction));
  }
  return out;
}

// Rings across the curve, joined by two triangles a side, and a fan at either end.
Mesh sweep_tube() {
  Mesh mesh;
  const std::vector<double> parameters = equal_lengths(kSegments);
  for (const double t : parameters) {
    const h6Vec3 along = unit(tangent(t));
    // The curve never runs along z, so "as upright as possible" is a frame without twist jumps; a
    // vertex of the ring points along it, so the crossing strands face each other edge to edge.
    const h6Vec3 up = unit(h6Vec3{0, 0, 1} - along.z * along);
    const h6Vec3 left = cross(up, along);
    for (int i = 0; i < kSides; ++i) {
      const double angle = 2 * std::numbers::pi * i / kSides;
      const h6Vec3 p = alpha_point(t) + (kTubeRadius * std::cos(angle)) * up +
                       (kTubeRadius * std::sin(angle)) * left;
      mesh.vertices.push_back({p.x, p.y, p.z});
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
    mesh.vertices.push_back({centre.x, centre.y, centre.z});
    const auto middle = static_cast<std::uint32_t>(mesh.vertices.size() - 1);
    for (int i = 0; i < kSides; ++i) {
      const std::uint32_t p = at(ring, i), q = at(ring, i + 1);
      mesh.triangles.push_back({middle, ring == 0 ? p : q, ring == 0 ? q : p});
    }
  }
  return mesh;
}

// The triangles of one strand near the crossing and of its tail: the loop's two sides are still far
// from each other 25 mm before the crossing, and there z already tells them apart.
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

std::string millimetres(double metres) {
  const auto hundredths = std::lround(metres / kMm * 100);
  const auto cents = hundredths % 100;
  return std::to_string(hundredths / 100) + "." + (cents < 10 ? "0" : "") + std::to_string(cents) +
         " mm";
}

// ---- the shortcut ------------------------------------------------------------------------------

// The static alpha's lower strand runs from the loop (t = -0.8) through the crossing (t = -1) to
// its tail's end (t = -kEnd). The tool stands across it: its tip above the strand, its own crossing
// and tails hanging below.
constexpr double kStart = 0.8;
constexpr double kSpeed = 50 * kMm;  // [m/s]

// The strand's direction in the xy view where it crosses: outward.
h6Vec3 outward() { return unit({kLoopLength, -kWidth, 0}); }

h6Quat tool_orientation() {
  const h6Vec3 u = outward(), down = {0, 0, -1};
  // Tool axes in the world: x (tip to tails) down, z along the strand, y across it.
  return from_axes(down, cross(u, down), u);
}

// The tip is the middle of a straight piece of tube, a little inside of the curve.
h6Vec3 tip_of_tube() {
  static const std::vector<double> parameters = equal_lengths(kSegments);
  return 0.5 *
         (alpha_point(parameters[kSegments / 2]) + alpha_point(parameters[kSegments / 2 + 1]));
}

h6Pose tool_with_tip_at(const h6Vec3& tip) {
  const h6Quat q = tool_orientation();
  return {tip - rotate(q, tip_of_tube()), q};
}

// Where the tip's axis is when the tool has come to t: midway between the strands at the crossing,
// where it needs all the room there is, clear of the lower strand before and behind it.
h6Vec3 tip_over_strand(double t) {
  const double clear = 9.3 * kMm;
  const double away = std::clamp(std::abs(t - 1) / 0.15, 0.0, 1.0);
  return alpha_point(-t) + h6Vec3{0, 0, kLift + (clear - kLift) * away};
}

Path shortcut_path() {
  HandPath hand(tool_with_tip_at(tip_over_strand(kStart)));
  hand.wait(0.3);
  h6Vec3 tip = tip_over_strand(kStart);
  const auto slide_to = [&](const h6Vec3& next) {
    hand.go_to(tool_with_tip_at(next), length(next - tip) / kSpeed);
    tip = next;
  };
  constexpr int kSteps = 55;
  for (int i = 1; i <= kSteps; ++i)
    slide_to(tip_over_strand(kStart + (kEnd - kStart) * i / kSteps));
  slide_to(tip + 88 * kMm * unit({1, -1, 0}));

  // Twisting while it pulls: about each axis in turn.
  const h6Pose end = hand.pose();
  constexpr int kTwists = 150;
  for (int i = 1; i <= kTwists; ++i) {
    const double phase = 2 * std::numbers::pi * 3 * i / kTwists;
    const double swing = 0.1 * std::sin(phase);
    const int axis = (i - 1) / (kTwists / 3);
    const h6Vec3 turn = {axis == 0 ? swing : 0, axis == 1 ? swing : 0, axis == 2 ? swing : 0};
    hand.go_to({end.p, product(turn_by(turn), end.q)}, 0.01);
  }
  // Pulled with a constant force along a frictionless strand the tool swings like a pendulum; only
  // the contacts damp it, with a time constant of two thirds of a second. Long enough to settle.
  hand.wait(2.4);
  return hand.rows();
}

}  // namespace

h6Vec3 alpha_point(double t) {
  return {kLoopLength * (t * t - 1), kWidth * t * (t * t - 1), kLift * t};
}

double alpha_end() { return kEnd; }

AlphaShape make_alpha() {
  AlphaShape out{sweep_tube(), kTubeRadius, 0};
  out.gap = mesh_distance(strand(out.mesh, true), strand(out.mesh, false));
  return out;
}

Scene alpha_pair(const std::string& name, const std::string& about, const h6Pose& tool_pose) {
  const AlphaShape alpha = make_alpha();
  // The voxel is about 0.22 mm: half a voxel at k = 5e4 N/m is 5.4 N. The paper forces its shortcut
  // (Fig. 8) harder than that, with 20 N, and so does this hand: below about 15 N every rule holds.
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

Scene alpha_shortcut() {
  const AlphaShape alpha = make_alpha();
  Scene scene = alpha_pair(
      "alpha-shortcut",
      "Two alphas of 1,008 triangles, tube " + millimetres(2 * alpha.tube_radius) +
          " thick, hooked together. The hand slides the tool's loop along a strand of the other, "
          "through the gap between its crossing strands, which is only " +
          millimetres(alpha.gap) +
          " wide, then twists and pulls with 20 N, 3.7 times the force for which half a voxel is "
          "promised. Forbidden: a region that no point of the tool reaches while the loops are "
          "linked.",
      tool_with_tip_at(tip_over_strand(kStart)));
  scene.hands.push_back(path_hand("tool", shortcut_path()));

  // Call the loops, closed by the straight segment across their gaps, rings. Linked rings: the
  // static ring crosses the convex hull of the tool's ring, so every point of the tool is within
  // 117 mm (its greatest distance from a point of its own ring) of a point of the static ring. No
  // point of the static ring is within 120 mm of this box: a tool that touches it is no longer
  // linked.
  scene.verdict.forbidden.push_back(
      {{88 * kMm, -300 * kMm, -300 * kMm}, {300 * kMm, -88 * kMm, 300 * kMm}});
  return scene;
}

}  // namespace h6::io
