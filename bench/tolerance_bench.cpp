// SPDX-License-Identifier: Apache-2.0
// tolerance_bench.cpp - fields baked to a tolerance beside uniform grids of the same worst error.
//
// bake/tolerance/MESH/longest_side_over:N bakes to a tolerance of an N-th of the mesh's longest
// side, and searches for the uniform voxel whose worst error at as many places is the same (to a
// twentieth). Both are baked in turn. The places are random, within 9 tolerances of the mesh and
// between nodes; io/check measures the error, which shares no code with the bake. A field that
// misses its tolerance anywhere is an error, not a time. HAPSIX_BENCH_MESHES may name folders.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <sstream>
#include <string>
#include <vector>

#include "io/bake/bake_field.h"
#include "io/check/exact_check.h"
#include "io/mesh/mesh_file.h"
#include "io/scenes/scenes.h"
#include "kernels/field/field_layout.h"
#include "sched/clock.h"

namespace {

using namespace h6;

constexpr std::size_t kPlaces = 100000;

// In the engine.
double megabytes(const io::FieldData& f) {
  return 1e-6 * double(kernels::field_layout_size(f.def()).bytes());
}

struct Made {
  io::FieldData field;
  double seconds = 0;
};

// The places where the error counts are those of this tolerance, whatever the field was baked to.
Result<Made> bake_one(const io::Mesh& mesh, const io::FieldBake& options, double tolerance) {
  const std::int64_t begin = sched::now_ns();
  Result<io::FieldData> field = io::bake_field(mesh, options, nullptr);
  if (!field) return field.failure();
  Made made{std::move(*field), 1e-9 * double(sched::now_ns() - begin)};
  made.field.tolerance = tolerance;
  return made;
}

Result<io::ExactCheck> error_of(const io::Mesh& mesh, const io::FieldData& field,
                                std::size_t points) {
  io::ExactCheckOptions options;
  options.points = points;
  options.far_points = 1000;
  options.sealed = field.sign_mode == "winding";
  return io::check_exactly(mesh, field, options);
}

// The uniform voxel whose worst error is that of the refined field. Its band reaches as far as the
// tolerance is promised here; what is timed and counted later has the usual band.
Result<double> same_error(const io::Mesh& mesh, io::FieldBake options, double tolerance,
                          double worst) {
  const double least = 0.5 * tolerance * worst;
  double voxel = io::kFinest * tolerance;
  for (int i = 0; i < 4; ++i) {
    options.voxel_size = voxel;
    options.band_voxels = std::min(io::kWidestBand, std::max(3.0, 9 * tolerance / voxel + 1));
    const Result<Made> made = bake_one(mesh, options, tolerance);
    if (!made) return made.failure();
    const Result<io::ExactCheck> found = error_of(mesh, made->field, kPlaces);
    if (!found) return found.failure();
    const double ratio = worst / std::max(1e-3, found->worst_asked);
    if (std::fabs(ratio - 1) < 0.05) break;
    voxel = std::max(least, voxel * std::clamp(ratio, 0.5, 2.0));
  }
  return voxel;
}

double middle_of(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

void to_tolerance(benchmark::State& state, const io::Mesh& mesh, int share) {
  const double tolerance = io::bounds_of(mesh).longest() / share;
  io::FieldBake refined;
  refined.tolerance = tolerance;
  const Result<Made> first = bake_one(mesh, refined, tolerance);
  if (!first) return state.SkipWithError(first.error().c_str());
  const Result<io::ExactCheck> found = error_of(mesh, first->field, kPlaces);
  if (!found) return state.SkipWithError(found.error().c_str());
  io::FieldBake uniform;
  const Result<double> voxel = same_error(mesh, uniform, tolerance, found->worst_asked);
  if (!voxel) return state.SkipWithError(voxel.error().c_str());
  uniform.voxel_size = *voxel;
  Made last[2];
  std::vector<double> seconds[2];
  for (auto _ : state)
    for (int round = 0; round < 4; ++round)  // the first is not counted
      for (int k = 0; k < 2; ++k) {
        last[k] = {};
        Result<Made> made = bake_one(mesh, k == 0 ? refined : uniform, tolerance);
        if (!made) return state.SkipWithError(made.error().c_str());
        last[k] = std::move(*made);
        if (round > 0) seconds[k].push_back(last[k].seconds);
      }
  state.counters["triangles"] = double(mesh.triangles.size());
  state.counters["places"] = double(found->asked);
  state.counters["missed"] = double(found->missed);
  state.counters["worst"] = found->worst_asked;
  state.counters["mean"] = found->mean_asked;
  state.counters["voxel_tolerances"] = *voxel / tolerance;
  state.counters["MB"] = megabytes(last[0].field);
  state.counters["MB_uniform"] = megabytes(last[1].field);
  state.counters["less"] = megabytes(last[1].field) / megabytes(last[0].field);
  state.counters["ms"] = 1e3 * middle_of(seconds[0]);
  state.counters["ms_uniform"] = 1e3 * middle_of(seconds[1]);
  if (found->missed == 0) return;
  char text[120];
  std::snprintf(text, sizeof text, "%zu of %zu places miss the tolerance, by %.3g at most",
                found->missed, found->asked, found->worst_asked);
  state.SkipWithError(text);
}

// The file, or all meshes in the folder and below it.
std::vector<std::string> meshes_at(const std::string& place) {
  namespace fs = std::filesystem;
  if (!fs::is_directory(place)) return {place};
  std::vector<std::string> out;
  for (const auto& entry : fs::recursive_directory_iterator(place)) {
    std::string end = entry.path().extension().string();
    if (end == ".gz") end = entry.path().stem().extension().string();
    std::transform(end.begin(), end.end(), end.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    for (const char* known : {".stl", ".obj", ".ply"})
      if (end == known) out.push_back(entry.path().string());
  }
  std::sort(out.begin(), out.end());
  return out;
}

void add_mesh(const std::string& name, const std::function<io::Mesh()>& make) {
  for (const int share : {500, 1000, 2000})
    benchmark::RegisterBenchmark(
        ("bake/tolerance/" + name + "/longest_side_over:" + std::to_string(share)).c_str(),
        [make, share](benchmark::State& state) { to_tolerance(state, make(), share); })
        ->Unit(benchmark::kMillisecond)
        ->Iterations(1)
        ->UseRealTime();
}

[[maybe_unused]] const bool registered = [] {
  add_mesh("alpha", [] { return io::make_alpha().mesh; });
  if (const char* list = std::getenv("HAPSIX_BENCH_MESHES")) {
    std::stringstream files(list);
    for (std::string file; std::getline(files, file, ':');)
      for (const std::string& one : meshes_at(file))
        add_mesh(std::filesystem::path(one).stem().string(), [one] {
          auto mesh = io::read_mesh(one);
          return mesh ? *mesh : io::Mesh{};
        });
  }
  return true;
}();

}  // namespace
