// SPDX-License-Identifier: Apache-2.0
// bridge_and_dinosaur.cpp - an elastic bridge, fixed at both ends, and a rigid dinosaur that a hand
// presses on it: the sizes of Fig. 14 of Xu & Barbic 2016, with shapes of our own.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "io/scenes/industrial/assembly.h"
#include "io/scenes/list.h"

namespace h6::io {
namespace {

using namespace industrial;

constexpr double kLength = 400, kWidth = 72;         // of the bridge, along x and y [mm]
constexpr double kCrown = 8, kEnd = 60, kRise = 25;  // thickness in the middle and at the ends [mm]
constexpr double kParapet = 12;                      // height above the roadway [mm]
constexpr int kAlong = 80, kAcross = 12, kThrough = 4;  // cells of the roadway
constexpr int kParapetCells = 2;
constexpr int kSplit = 3;  // parts of a cell's edge in the surface mesh: 59,000 triangles
constexpr double kYoung = 1e6, kPoisson = 0.4, kDensity = 1000;  // a soft rubber
constexpr double kVoxel = 0.75;                                  // of the dinosaur's field [mm]
constexpr double kRoadway = kEnd + kRise;                        // height of the crown [mm]

using Place = std::array<int, 3>;  // along, across, up

bool is_solid(const Place& cell) {
  const auto [i, j, k] = cell;
  if (i < 0 || i >= kAlong || j < 0 || j >= kAcross || k < 0 || k >= kThrough + kParapetCells)
    return false;
  return k < kThrough || j == 0 || j == kAcross - 1;
}

// A corner of the cells [m].
h6Vec3 corner(const Place& at) {
  const double u = 2.0 * at[0] / kAlong - 1;
  const double top = kEnd + kRise * (1 - u * u), thick = kCrown + (kEnd - kCrown) * u * u;
  const int layers = std::min(at[2], kThrough);
  const double z =
      top - thick * (kThrough - layers) / kThrough + kParapet * (at[2] - layers) / kParapetCells;
  return kMm * h6Vec3{0.5 * kLength * u, kWidth * (double(at[1]) / kAcross - 0.5), z};
}

template <class Do>
void each_cell(Do&& handle) {
  for (int k = 0; k < kThrough + kParapetCells; ++k)
    for (int j = 0; j < kAcross; ++j)
      for (int i = 0; i < kAlong; ++i)
        if (is_solid({i, j, k})) handle(Place{i, j, k});
}

// The cells as hexahedra, fixed at both ends.
SolidMesh bridge_solid() {
  SolidMesh out;
  out.materials.push_back({"rubber", kYoung, kPoisson, kDensity});
  std::map<Place, std::uint32_t> index;
  const auto vertex = [&](const Place& at) {
    const auto [found, fresh] = index.try_emplace(at, std::uint32_t(out.vertices.size()));
    if (fresh) out.vertices.push_back(corner(at));
    return found->second;
  };
  each_cell([&](const Place& c) {
    SolidElement hex{{}, 8, 0};
    constexpr int kX[] = {0, 1, 1, 0}, kY[] = {0, 0, 1, 1};
    for (int n = 0; n < 8; ++n)
      hex.corner[std::size_t(n)] = vertex({c[0] + kX[n % 4], c[1] + kY[n % 4], c[2] + n / 4});
    out.elements.push_back(hex);
  });
  for (const auto& [at, number] : index)
    if (at[0] == 0 || at[0] == kAlong) out.fixed.push_back(number);
  std::sort(out.fixed.begin(), out.fixed.end());
  return out;
}

// The skin of the cells. Every vertex of it lies on a face of a hexahedron, so the modes fit it.
class Skin {
 public:
  void add_faces(const Place& cell) {
    for (int axis = 0; axis < 3; ++axis)
      for (const int side : {0, 1}) {
        Place next = cell;
        next[std::size_t(axis)] += side ? 1 : -1;
        if (!is_solid(next)) add_face(cell, axis, side);
      }
  }
  Mesh mesh() && { return std::move(mesh_); }

 private:
  void add_face(const Place& cell, int axis, int side) {
    const std::size_t a = std::size_t(axis), b = (a + 1) % 3, c = (a + 2) % 3;
    Place low = cell;
    low[a] += side;
    const auto at = [&](int u, int v) {
      Place fine{kSplit * low[0], kSplit * low[1], kSplit * low[2]};
      fine[b] += u, fine[c] += v;
      const auto [found, fresh] = index_.try_emplace(fine, std::uint32_t(mesh_.vertices.size()));
      if (!fresh) return found->second;
      h6Vec3 p{};
      for (int n = 0; n < 4; ++n) {  // bilinear, as the face of a hexahedron is
        Place end = low;
        end[b] += n % 2, end[c] += n / 2;
        const double s = double(u) / kSplit, t = double(v) / kSplit;
        p = p + (n % 2 ? s : 1 - s) * (n / 2 ? t : 1 - t) * corner(end);
      }
      mesh_.vertices.push_back(p);
      return found->second;
    };
    for (int u = 0; u < kSplit; ++u)
      for (int v = 0; v < kSplit; ++v) {
        std::array<std::uint32_t, 4> q{at(u, v), at(u + 1, v), at(u + 1, v + 1), at(u, v + 1)};
        if (side == 0) std::swap(q[1], q[3]);  // seen from outside
        mesh_.triangles.push_back({q[0], q[1], q[2]});
        mesh_.triangles.push_back({q[0], q[2], q[3]});
      }
  }

  Mesh mesh_;
  std::map<Place, std::uint32_t> index_;
};

// Four legs on z = 0, a body with a tail and a long neck, a head.
Mesh dinosaur_mesh() {
  Assembly a(kMm * kVoxel, 1);
  const Line spine = smooth({{-95, 0, 34},
                             {-60, 0, 38},
                             {-30, 0, 44},
                             {0, 0, 47},
                             {26, 0, 46},
                             {44, 0, 58},
                             {56, 0, 80},
                             {66, 0, 100},
                             {76, 0, 106}},
                            2);
  const double length = line_length(spine);
  const auto thickness = [&](double s) {
    const double t = s / length;  // 0 at the tip of the tail, 1 at the head
    const double body = std::exp(-std::pow((t - 0.4) / 0.16, 2));
    return 1.5 + 3.5 * std::min(1.0, 3 * t) + 13 * body;
  };
  a.add("dinosaur", rod(spine, thickness, 96));
  a.add("dinosaur", rod(
                        smooth({{68, 0, 105}, {78, 0, 106}, {92, 0, 101}}, 2),
                        [](double s) { return 8 - 0.15 * s; }, 64));
  for (const double x : {-24.0, 24.0})
    for (const double y : {-13.0, 13.0})
      a.add("dinosaur",
            rod(
                smooth({{x, y, 0}, {0.95 * x, 0.95 * y, 14}, {0.85 * x, 0.7 * y, 42}}, 2),
                [](double s) { return 7.5 - 2 * std::exp(-std::pow(s / 12 - 1, 2)); }, 48));
  return a.sound(56192);
}

Path dinosaur_path(const h6Pose& start) {
  HandPath hand(start);
  hand.wait(0.1).move_by({0, 0, -16 * kMm}, 0.08).wait(0.6);
  hand.move_by({30 * kMm, 0, 0}, 0.06).move_by({-60 * kMm, 0, 0}, 0.06).wait(0.3);
  hand.go_to({hand.pose().p, from_axes({std::cos(0.5), std::sin(0.5), 0},
                                       {-std::sin(0.5), std::cos(0.5), 0}, {0, 0, 1})},
             0.4)
      .wait(0.3);
  return hand.move_by({0, 0, 26 * kMm}, 0.3).wait(1).rows();
}

}  // namespace

Scene bridge_and_dinosaur() {
  Scene scene = common_scene(
      "bridge-and-dinosaur",
      "A rigid dinosaur of 56,192 triangles is pressed on a rubber bridge that bends by 20 modes "
      "and carries the points, dragged along it, turned, and lifted off at once.");
  SceneBody bridge;
  bridge.name = "bridge";
  bridge.fixed = true;
  bridge.shell.emplace();
  Skin skin;
  each_cell([&](const Place& cell) { skin.add_faces(cell); });
  bridge.shell->mesh_data = std::move(skin).mesh();
  bridge.shell->bake.points = 85018;
  bridge.shell->bends.emplace();
  bridge.shell->bends->solid = bridge_solid();
  scene.bodies.push_back(std::move(bridge));
  SceneBody dinosaur = obstacle("dinosaur", dinosaur_mesh(), kMm * kVoxel);
  dinosaur.fixed = false;
  dinosaur.mass = 0.2;
  dinosaur.pose.p = {0, 0, (kRoadway + 4) * kMm};
  scene.hands.push_back(path_hand("dinosaur", dinosaur_path(dinosaur.pose)));
  scene.verdict.target = scene.hands.back().path.back().pose;
  scene.verdict.tolerance = kMm, scene.verdict.tolerance_angle = 0.05;
  scene.bodies.push_back(std::move(dinosaur));
  return scene;
}

}  // namespace h6::io
