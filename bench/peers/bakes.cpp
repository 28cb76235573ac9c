// SPDX-License-Identifier: Apache-2.0
#include "bench/peers/bakes.h"

#include <algorithm>
#include <cmath>

#include "bench/level_set_peer.h"
#include "hapsix/vector.h"
#include "io/bake/bake_field.h"
#include "io/mesh/ray_scene.h"
#include "io/scenes/scenes.h"
#include "sched/clock.h"

namespace h6::peers {
namespace {

constexpr int kRounds = 3;
constexpr double kSlow = 5000;  // [ms] so long that one round is enough
constexpr std::size_t kNodes = 2000;

template <class Work>
double milliseconds(const Work& work) {
  const std::int64_t begin = sched::now_ns();
  work();
  return 1e-6 * static_cast<double>(sched::now_ns() - begin);
}

// Nodes outside, spread evenly over the bricks.
double error_of(const io::FieldData& f, const io::RayScene& rays, std::size_t* asked) {
  double worst = 0;
  const std::size_t bx = std::size_t(f.bricks[0]), by = std::size_t(f.bricks[1]);
  const std::size_t step = std::max<std::size_t>(1, f.brick_count() / kNodes);
  for (std::size_t cell = 0; cell < f.brick_index.size(); ++cell) {
    if (f.brick_index[cell] < 0) continue;
    const auto row = static_cast<std::size_t>(f.brick_index[cell]);
    if (row % step != 0) continue;
    for (std::size_t node = row * 37 % 64; node < 512; node += 64) {
      const double d = double(f.samples[row * 512 + node]), h = f.voxel_size;
      if (d <= 0 || d > f.band) continue;
      const h6Vec3 p = f.origin + h * h6Vec3{double(8 * (cell % bx) + node % 8),
                                             double(8 * (cell / bx % by) + node / 8 % 8),
                                             double(8 * (cell / bx / by) + node / 64)};
      worst = std::max(worst, std::fabs(d + f.offset - rays.distance(p)) / h);
      ++*asked;
      break;
    }
  }
  return worst;
}

double error_of(const std::vector<bench::NodeDistance>& nodes, double voxel,
                const io::RayScene& rays) {
  double worst = 0;
  for (const bench::NodeDistance& node : nodes)
    worst = std::max(worst, std::fabs(node.distance - rays.distance(node.place)) / voxel);
  return worst;
}

double median(std::vector<double> v) {
  std::sort(v.begin(), v.end());
  return v[v.size() / 2];
}

}  // namespace

Result<BakeRow> compare_bakes(const std::string& name) {
  auto scene = io::make_scene(name);
  if (!scene) return scene.failure();
  const io::Mesh& mesh = *scene->bodies[0].field->mesh_data;
  io::FieldBake options = scene->bodies[0].field->bake;
  BakeRow out;
  out.mesh = name, out.triangles = mesh.triangles.size();
  std::vector<double> ours[2], theirs[2];
  io::FieldData field;
  int rounds = kRounds;
  for (int round = -1; round < rounds; ++round)
    for (unsigned threads : {1u, 2u}) {
      options.threads = threads;
      field = {};
      Result<io::FieldData> made = Failure{""};
      const double mine = milliseconds([&] { made = io::bake_field(mesh, options, nullptr); });
      if (!made) return made.failure();
      field = std::move(*made);
      const double other = milliseconds(
          [&] { out.openvdb_bricks = bench::mesh_to_level_set(mesh, field.voxel_size, threads); });
      if (other > kSlow) rounds = 1;
      if (round < 0) continue;
      ours[threads - 1].push_back(mine), theirs[threads - 1].push_back(other);
    }
  for (int i = 0; i < 2; ++i)
    out.ours_ms[i] = median(ours[i]), out.openvdb_ms[i] = median(theirs[i]);
  out.voxel = field.voxel_size;
  out.ours_bricks = field.brick_count();
  const auto rays = io::RayScene::make(mesh);
  if (!rays) return rays.failure();
  out.ours_error = error_of(field, **rays, &out.nodes);
  std::vector<bench::NodeDistance> nodes;
  bench::mesh_to_level_set(mesh, field.voxel_size, 2, &nodes);
  out.openvdb_error = error_of(nodes, field.voxel_size, **rays);
  if (out.nodes == 0 || !(out.ours_error < 1e-3))
    return Failure{name + ": a distance of our bake is wrong"};
  return out;
}

}  // namespace h6::peers
