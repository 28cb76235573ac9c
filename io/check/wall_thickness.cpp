// SPDX-License-Identifier: Apache-2.0
// wall_thickness.cpp - see wall_thickness.h.
#include "io/check/wall_thickness.h"

#include <algorithm>
#include <cmath>

#include "io/check/surface_places.h"
#include "io/mesh/inward_normals.h"
#include "io/mesh/ray_scene.h"
#include "sched/parallel_for.h"

namespace h6::io {
namespace {

constexpr double kFacing = 0.70710678;  // cosine of 45 degrees

struct Found {
  double thickness = -1, gap = -1;  // < 0: none
  bool bowl = false, sheet = false, buried = false;
};

class Probe {
 public:
  Probe(const RayScene& rays, const FaceTable& faces) : rays_(rays), faces_(faces) {}

  Found operator()(const SurfacePlaces::Place& at) const {
    Found found;
    found.sheet = flat(at.triangle);
    found.bowl = faces_.bowl[at.triangle];
    if (found.sheet) return found;
    const Vec3& in = faces_.inward[at.triangle];
    // In how many other solids the place lies: left minus entered on the way out to infinity.
    std::vector<Crossing> way;
    cross(at, -in, way);
    int around = 0;
    for (const Crossing& c : way) around += into(c, in) > 0 ? 1 : -1;
    if (around > 0) {
      found.buried = true;
      return found;
    }
    if (!way.empty() && into(way.front(), in) < -kFacing) found.gap = way.front().t;
    cross(at, in, way);
    int depth = 1;
    for (const Crossing& c : way) {
      const double enters = into(c, in);
      depth += enters > 0 ? 1 : -1;
      if (depth > 0) continue;
      if (enters < -kFacing) found.thickness = c.t;
      break;
    }
    return found;
  }

 private:
  // Crossings without those of sheets and of the triangle that the ray starts on.
  void cross(const SurfacePlaces::Place& at, const Vec3& along, std::vector<Crossing>& way) const {
    rays_.crossings(at.p, along, way);
    std::erase_if(way,
                  [&](const Crossing& c) { return c.triangle == at.triangle || flat(c.triangle); });
  }
  bool flat(std::uint32_t triangle) const {
    return faces_.sheet[triangle] && !faces_.bowl[triangle];
  }
  double into(const Crossing& c, const Vec3& in) const {
    return dot(faces_.inward[c.triangle], in);
  }

  const RayScene& rays_;
  const FaceTable& faces_;
};

}  // namespace

Result<Walls> measure_walls(const Mesh& mesh, const WallOptions& options) {
  const Result<std::unique_ptr<RayScene>> rays = RayScene::make(mesh);
  if (!rays) return rays.failure();
  const FaceTable faces = face_table(mesh);
  const SurfacePlaces places(mesh, faces.area);  // a triangle that is stored twice counts once
  Walls walls;
  if (!(places.area() > 0) || options.places == 0) return walls;
  const Probe probe(**rays, faces);
  std::vector<Found> found(options.places);
  sched::parallel_for((found.size() + 255) / 256, options.threads, [&](std::size_t block) {
    for (std::size_t i = 256 * block; i < std::min(found.size(), 256 * (block + 1)); ++i) {
      Dice dice(options.seed, i);
      found[i] = probe(places(dice));
    }
  });
  std::size_t bowls = 0, sheets = 0, buried = 0;
  for (const Found& f : found) {
    if (f.thickness >= 0) walls.thickness.push_back(f.thickness);
    if (f.gap >= 0) walls.gap.push_back(f.gap);
    bowls += f.bowl, sheets += f.sheet, buried += f.buried;
  }
  std::sort(walls.thickness.begin(), walls.thickness.end());
  std::sort(walls.gap.begin(), walls.gap.end());
  walls.bowls = double(bowls) / double(found.size());
  walls.sheets = double(sheets) / double(found.size());
  walls.buried = double(buried) / double(found.size());
  return walls;
}

double quantile(const std::vector<double>& ascending, double share) {
  if (ascending.empty()) return 0;
  const auto last = double(ascending.size() - 1);
  return ascending[std::size_t(std::clamp(share, 0.0, 1.0) * last + 0.5)];
}

double share_below(const std::vector<double>& ascending, double length) {
  if (ascending.empty()) return 0;
  const auto below = std::lower_bound(ascending.begin(), ascending.end(), length);
  return double(below - ascending.begin()) / double(ascending.size());
}

}  // namespace h6::io
