// SPDX-License-Identifier: Apache-2.0
// wall_thickness.cpp - see wall_thickness.h.
#include "io/check/wall_thickness.h"

#include <algorithm>
#include <cmath>

#include "io/check/inner_faces.h"
#include "io/check/surface_places.h"
#include "io/mesh/inward_normals.h"
#include "io/mesh/ray_scene.h"
#include "sched/parallel_for.h"

namespace h6::io {
namespace {

constexpr double kFacing = 0.70710678;  // cosine of 45 degrees
constexpr double kAbut = 1e-6;          // faces this near, as a share of the mesh's size, coincide
constexpr double kMiddle = 0.45;        // of the thickness, from the middle of a wall to a face
constexpr std::size_t kPlaces = 96;

struct Found {
  SurfacePlaces::Place at{};
  double thickness = -1, gap = -1;  // < 0: none
  bool bowl = false, sheet = false, buried = false, grazes = false;
};

class Probe {
 public:
  // abut: faces this near coincide [m].
  Probe(const RayScene& rays, const FaceTable& faces, double abut)
      : rays_(rays), faces_(faces), abut_(abut) {}

  Found operator()(const SurfacePlaces::Place& at) const {
    Found found;
    found.at = at;
    found.sheet = flat(at.triangle);
    found.bowl = faces_.bowl[at.triangle];
    if (found.sheet) return found;
    const Vec3& in = faces_.inward[at.triangle];
    // In how many other solids the place lies: left minus entered on the way out to infinity.
    std::vector<Crossing> way;
    cross(at, -in, way);
    int around = 0;
    for (const Crossing& c : way) around += into(c, in) > 0 ? 1 : -1;
    const bool abuts = !way.empty() && way.front().t <= abut_ && into(way.front(), in) < -kFacing;
    if (around > 0 || abuts) {
      found.buried = true;
      return found;
    }
    if (!way.empty() && into(way.front(), in) < -kFacing) found.gap = way.front().t;
    cross(at, in, way);
    int depth = 1;
    for (std::size_t i = 0; i < way.size(); ++i) {
      const double enters = into(way[i], in);
      depth += enters > 0 ? 1 : -1;
      const bool next_abuts =
          i + 1 < way.size() && way[i + 1].t - way[i].t <= abut_ && into(way[i + 1], in) > 0;
      if (depth > 0 || next_abuts) continue;
      if (enters < -kFacing) found.thickness = way[i].t, found.grazes = grazes(at.p, in, way[i].t);
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
  // Whether a face that runs along the way is nearer to its middle than the wall's own faces: a
  // push there, close to an edge, slides out under that face and tells nothing of the wall.
  bool grazes(const Vec3& p, const Vec3& in, double thickness) const {
    const RayScene::Near near = rays_.nearest(p + thickness / 2 * in);
    return near.distance < kMiddle * thickness &&
           std::fabs(dot(faces_.inward[near.triangle], in)) < kFacing;
  }
  bool flat(std::uint32_t triangle) const {
    return faces_.sheet[triangle] && !faces_.bowl[triangle];
  }
  double into(const Crossing& c, const Vec3& in) const {
    return dot(faces_.inward[c.triangle], in);
  }

  const RayScene& rays_;
  const FaceTable& faces_;
  double abut_;
};

// Appends kPlaces of all[first .. end) at equal steps, or all if they are fewer.
void pick(const std::vector<WallPlace>& all, std::size_t first, std::size_t end,
          std::vector<WallPlace>& out) {
  const std::size_t n = end - first, count = std::min(kPlaces, n);
  for (std::size_t i = 0; i < count; ++i) out.push_back(all[first + n * i / count]);
}

std::vector<WallPlace> places_to_push(const std::vector<Found>& found, const FaceTable& faces) {
  std::vector<WallPlace> all, out;
  for (const Found& f : found)
    if (f.sheet || (f.thickness >= 0 && !f.grazes))
      all.push_back({f.at.p, faces.inward[f.at.triangle], std::max(f.thickness, 0.0)});
  std::stable_sort(all.begin(), all.end(), [](const WallPlace& a, const WallPlace& b) {
    return a.thickness < b.thickness;
  });
  const std::size_t n = all.size(), first = n / 100;
  const std::size_t tenth = std::clamp(n / 10, std::min(n, first + kPlaces), n);
  pick(all, first, tenth, out);
  pick(all, tenth, n, out);
  return out;
}

}  // namespace

Result<Walls> measure_walls(const Mesh& whole, const WallOptions& options) {
  const Mesh mesh = without_inner_faces(whole);
  const Result<std::unique_ptr<RayScene>> rays = RayScene::make(mesh);
  if (!rays) return rays.failure();
  const FaceTable faces = face_table(mesh);
  const SurfacePlaces places(mesh, faces.area);  // a triangle that is stored twice counts once
  Walls walls;
  if (!(places.area() > 0) || options.places == 0) return walls;
  const MeshBounds box = bounds_of(mesh);
  const Probe probe(**rays, faces, kAbut * norm(box.high - box.low));
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
  walls.places = places_to_push(found, faces);
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
