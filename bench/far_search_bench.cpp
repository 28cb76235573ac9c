// SPDX-License-Identifier: Apache-2.0
// far_search_bench.cpp - bake/far/MESH/voxels:N: computes the distance of every node of a far grid
// by the bake's tree and by Embree's point query, in turn on one thread. The result decides which
// of the two the far field uses (io/bake/far.cpp). The mesh is a torus; with HAPSIX_BENCH_SOUPS=1
// also the engine bay and the landing gear.
//
// Both search the same nodes in the same order and get the previous node as a hint: the tree starts
// at its triangle, Embree at its distance plus the step. The counters are medians of five rounds:
//   build_tree, build_embree [ms]   build time; the tree uses one thread, Embree all
//   tree, embree             [us]   time of a search
//   worst                 [voxel]   largest difference of their distances
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <string>

#include "io/bake/tree.h"
#include "io/mesh/ray_scene.h"
#include "io/scenes/industrial/industrial.h"
#include "sched/clock.h"
#include "tests/io/shell/shell_test_meshes.h"

namespace {

using namespace h6;
using namespace h6::io::bake;

template <class Work>
double milliseconds(const Work& work) {
  const std::int64_t begin = sched::now_ns();
  work();
  return 1e-6 * double(sched::now_ns() - begin);
}

double median(std::vector<double>& times) {
  std::nth_element(times.begin(), times.begin() + 2, times.end());
  return times[2];
}

void far_search(benchmark::State& state, const std::function<io::Mesh()>& make, int voxels) {
  io::Mesh mesh = make();
  auto surface = prepare_surface(mesh, 0);
  if (!surface) return state.SkipWithError(surface.error().c_str());
  io::FieldBake options;
  options.voxels = voxels;
  const auto grid = choose_grid(*surface, options, true);
  if (!grid) return state.SkipWithError(grid.error().c_str());
  to_grid(*surface, *grid, 0);
  for (io::Vec3& v : mesh.vertices) v = grid->from_metres(v);
  std::unique_ptr<TriangleTree> tree;
  std::unique_ptr<io::RayScene> rays;
  const int nx = grid->bricks[0] + 1, ny = grid->bricks[1] + 1, nz = grid->bricks[2] + 1;
  std::vector<double> by_tree(std::size_t(nx) * std::size_t(ny) * std::size_t(nz)),
      by_embree(by_tree);
  // Nodes are searched row by row, as in the far field.
  const auto each = [&](const auto& search) {
    for (std::size_t i = 0; i < by_tree.size(); ++i) {
      const int a = int(i) % nx, b = int(i) / nx % ny, c = int(i) / nx / ny;
      search(i, io::Vec3{8.0 * a, 8.0 * b, 8.0 * c}, a > 0);
    }
  };
  const auto ask_tree = [&] {
    TriangleTree::Found found{};
    each([&](std::size_t i, const io::Vec3& p, bool hint) {
      const std::uint32_t start[1] = {found.place};
      found = {hint ? float(std::pow(by_tree[i - 1] + 8.1, 2)) : 1e10f, TriangleTree::kNone, 0};
      by_tree[i] = tree->search({p.x, p.y, p.z}, {start, hint ? 1u : 0u}, -1, found);
    });
  };
  const auto ask_embree = [&] {
    each([&](std::size_t i, const io::Vec3& p, bool hint) {
      by_embree[i] = hint ? rays->nearest(p, by_embree[i - 1] + 8.1).distance : rays->distance(p);
    });
  };
  std::vector<double> build[2], ask[2];
  for (auto _ : state)
    for (int round = 0; round < 5; ++round) {
      build[0].push_back(
          milliseconds([&] { tree = std::make_unique<TriangleTree>(*surface, *grid, 1); }));
      build[1].push_back(milliseconds([&] { rays = std::move(*io::RayScene::make(mesh)); }));
      ask[0].push_back(milliseconds(ask_tree));
      ask[1].push_back(milliseconds(ask_embree));
    }
  double worst = 0;
  for (std::size_t i = 0; i < by_tree.size(); ++i)
    worst = std::max(worst, std::fabs(by_tree[i] - by_embree[i]));
  if (worst > TriangleTree::kTight) return state.SkipWithError("the two disagree");
  state.counters["nodes"] = double(by_tree.size());
  state.counters["worst"] = worst;
  state.counters["build_tree"] = median(build[0]);
  state.counters["build_embree"] = median(build[1]);
  state.counters["tree"] = 1e3 * median(ask[0]) / double(by_tree.size());
  state.counters["embree"] = 1e3 * median(ask[1]) / double(by_tree.size());
}

void add(const std::string& name, int voxels, const std::function<io::Mesh()>& make) {
  benchmark::RegisterBenchmark(("bake/far/" + name + "/voxels:" + std::to_string(voxels)).c_str(),
                               far_search, make, voxels)
      ->Unit(benchmark::kMillisecond)
      ->Iterations(1)
      ->UseRealTime();
}

[[maybe_unused]] const bool registered = [] {
  add("torus100k", 512, [] { return shells::torus(0.03, 0.01, 500, 100); });
  if (const char* soups = std::getenv("HAPSIX_BENCH_SOUPS"); soups && *soups && *soups != '0') {
    add("soup500k", 1024, [] { return io::make_engine_bay().mesh; });
    add("soup1800k", 1024, [] { return io::make_landing_gear().mesh; });
  }
  return true;
}();

}  // namespace
