// bake_bench.cpp - mesh in memory to asset in memory: bake/MESH/voxels:N/threads:T and
// bake/MESH/points:N/threads:T. Meshes are made here; the files of $HAPSIX_BENCH_MESHES (a list
// separated by colons) are baked too.
#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <sstream>
#include <string>

#include "io/bake_field.h"
#include "io/bake_shell.h"
#include "io/mesh_file.h"
#include "io/scenes/scenes.h"

namespace {

using namespace h6;
using MeshPtr = std::shared_ptr<const io::Mesh>;

// A ring with teeth, two triangles a cell: closed, of any size.
io::Mesh gear(int around, int across) {
  io::Mesh mesh;
  for (int i = 0; i < around; ++i)
    for (int j = 0; j < across; ++j) {
      const double t = 2 * M_PI * i / around, f = 2 * M_PI * j / across;
      const double r =
          0.01 * (1 + 0.2 * std::tanh(3 * std::sin(24 * t)) * (0.5 + 0.5 * std::cos(f)));
      mesh.vertices.push_back({(0.03 + r * std::cos(f)) * std::cos(t),
                               (0.03 + r * std::cos(f)) * std::sin(t), r * std::sin(f)});
    }
  const auto at = [&](int i, int j) {
    return static_cast<std::uint32_t>(i % around * across + j % across);
  };
  for (int i = 0; i < around; ++i)
    for (int j = 0; j < across; ++j) {
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return mesh;
}

void bake_field(benchmark::State& state, const MeshPtr& mesh, int voxels, unsigned threads) {
  io::FieldBake options;
  options.voxels = voxels;
  options.threads = threads;
  std::size_t bricks = 0;
  for (auto _ : state) {
    auto field = io::bake_field(*mesh, options, nullptr);
    if (!field) return state.SkipWithError(field.error().c_str());
    bricks = field->brick_count();
  }
  state.counters["bricks"] = static_cast<double>(bricks);
  state.counters["triangles"] = static_cast<double>(mesh->triangles.size());
}

void bake_shell(benchmark::State& state, const MeshPtr& mesh, std::size_t points,
                unsigned threads) {
  io::ShellBake options;
  options.points = points;
  options.threads = threads;
  for (auto _ : state) {
    auto shell = io::bake_shell(*mesh, options, nullptr);
    if (!shell || shell->size() != points)
      return state.SkipWithError(shell ? "another number of points" : shell.error().c_str());
  }
  state.counters["triangles"] = static_cast<double>(mesh->triangles.size());
}

void add(const std::string& name, const MeshPtr& mesh) {
  for (const unsigned threads : {1u, 2u}) {
    const std::string end = "/threads:" + std::to_string(threads);
    for (const int voxels : {256, 512})
      benchmark::RegisterBenchmark(
          ("bake/" + name + "/voxels:" + std::to_string(voxels) + end).c_str(), bake_field, mesh,
          voxels, threads)
          ->Unit(benchmark::kMillisecond)
          ->UseRealTime();
    for (const std::size_t points : {std::size_t{25269}, std::size_t{56823}})
      benchmark::RegisterBenchmark(
          ("bake/" + name + "/points:" + std::to_string(points) + end).c_str(), bake_shell, mesh,
          points, threads)
          ->Unit(benchmark::kMillisecond)
          ->UseRealTime();
  }
}

[[maybe_unused]] const bool registered = [] {
  add("alpha", std::make_shared<io::Mesh>(io::make_alpha().mesh));
  add("gear100k", std::make_shared<io::Mesh>(gear(1000, 50)));
  if (const char* list = std::getenv("HAPSIX_BENCH_MESHES")) {
    std::stringstream files(list);
    for (std::string file; std::getline(files, file, ':');)
      if (auto mesh = io::read_mesh(file))
        add(std::filesystem::path(file).stem().string(),
            std::make_shared<io::Mesh>(std::move(*mesh)));
  }
  return true;
}();

}  // namespace
