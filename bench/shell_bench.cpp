// SPDX-License-Identifier: Apache-2.0
// shell_bench.cpp - times bakes from a mesh in memory to a shell in memory.
// bake/shell/points:56823/threads:T uses the starter motor (18,580 triangles).
// bake/shell/MESH/points:N/threads:T uses other meshes: the actuator (25,191), a torus of one
// closed piece, and a soup of slit tori with points on the zero set of its field or on its
// triangles; with HAPSIX_BENCH_SOUPS=1 also the engine bay (505,276) and the landing gear
// (1,789,551).
//
// Each shell is checked before it is timed. Counters:
//   spacing      least over mean distance of neighbours, on the worst level of ten points or more
//   off_surface  largest distance of a point from its surface [voxel of a field of 256]
//   normal_deg   largest angle between a normal and the analytic one, on the torus
//   levels       number of levels; the check proves that every sphere holds all its descendants
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <memory>
#include <string>

#include "io/bake/plan.h"
#include "io/mesh/ray_scene.h"
#include "io/scenes/industrial/industrial.h"
#include "io/shell/bake_shell.h"
#include "tests/io/shell/shell_test_meshes.h"

namespace {

using namespace h6;
using Normal = std::function<io::Vec3(const io::Vec3&)>;

// Makes a mesh on first use and keeps it.
class Input {
 public:
  explicit Input(std::function<io::Mesh()> make, Normal inward = {})
      : inward(std::move(inward)), make_(std::move(make)) {}
  const io::Mesh& mesh() {
    if (mesh_.triangles.empty()) mesh_ = make_();
    return mesh_;
  }
  const Normal inward;  // empty: not known

 private:
  std::function<io::Mesh()> make_;
  io::Mesh mesh_;
};
using InputPtr = std::shared_ptr<Input>;

constexpr double kMajor = 0.03, kMinor = 0.01;  // [m]

io::Vec3 into_torus(const io::Vec3& p) {
  const double r = std::hypot(p.x, p.y), off = r - kMajor;
  const double length = std::hypot(off, p.z);
  return {-off * p.x / (r * length), -off * p.y / (r * length), -p.z / length};
}

// Makes tori of all sizes that pass through one another, each with a slit.
io::Mesh slit_tori(int count) {
  io::Mesh mesh;
  for (int k = 0; k < count; ++k) {
    io::Mesh one = shells::torus(kMajor, kMinor, 100, 50);
    one.triangles.erase(one.triangles.begin(), one.triangles.begin() + 50);
    const double s = 0.4 + 0.6 * (k + 1) / count, tilt = 0.7 * k;
    for (io::Vec3& v : one.vertices)
      v = {s * v.x + 0.004 * k, s * (std::cos(tilt) * v.y - std::sin(tilt) * v.z),
           s * (std::sin(tilt) * v.y + std::cos(tilt) * v.z)};
    shells::add(mesh, one);
  }
  return mesh;
}

// Sets the counters of a shell and returns what is wrong with it, or an empty string.
std::string judge(Input& input, const io::ShellData& shell, const io::ShellBake& options,
                  benchmark::State& state) {
  const io::Mesh& mesh = input.mesh();
  if (shell.size() != options.points) return "another number of points";
  if (const Outcome whole = io::check_shell(shell); !whole) return whole.error();
  if (const std::string broken = shells::broken_promise(shell); !broken.empty()) return broken;
  double worst = 1;
  for (const std::size_t count : shell.level_points) {
    if (count < 10 || count > 100000) continue;
    const shells::Spacing s = shells::spacing(shell, count, true);
    worst = std::min(worst, s.least / s.mean);
  }
  const auto plan = io::plan_field(mesh, io::audit(mesh), options.field);
  if (!plan) return plan.error();
  const double aim = options.surface == io::ShellSurface::field ? plan->offset : 0;
  const auto nearest = io::RayScene::make(mesh);
  if (!nearest) return nearest.error();
  double off = 0, turned = 0;
  for (std::size_t i = 0; i < shell.size(); i += 7) {
    const io::Vec3 p = shells::point(shell, i);
    off = std::max(off, std::abs((*nearest)->distance(p) - aim) / plan->voxel_size);
    if (!input.inward) continue;
    const double cosine = shells::dot(shells::normal(shell, i), input.inward(p));
    turned = std::max(turned, std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / shells::pi);
  }
  state.counters["triangles"] = static_cast<double>(mesh.triangles.size());
  state.counters["levels"] = static_cast<double>(shell.level_points.size());
  state.counters["spacing"] = worst;
  state.counters["off_surface"] = off;
  if (input.inward) state.counters["normal_deg"] = turned;
  if (worst < 0.6) return "neighbours nearer than 0.6 of the mean spacing";
  if (off > 0.05) return "a point more than 0.05 voxel off the surface";
  if (turned > 2) return "a normal more than 2 degrees off";
  return {};
}

void bake_shell(benchmark::State& state, const InputPtr& input, const io::ShellBake& options) {
  const auto made = io::bake_shell(input->mesh(), options, nullptr);
  const std::string wrong = made ? judge(*input, *made, options, state) : made.error();
  if (!wrong.empty()) return state.SkipWithError(wrong.c_str());
  for (auto _ : state) {
    auto shell = io::bake_shell(input->mesh(), options, nullptr);
    benchmark::DoNotOptimize(shell);
  }
}

void add(const std::string& name, const InputPtr& input, std::size_t points,
         io::ShellSurface surface = io::ShellSurface::automatic) {
  for (const unsigned threads : {1u, 2u}) {
    io::ShellBake options;
    options.points = points;
    options.surface = surface;
    options.threads = threads;
    benchmark::RegisterBenchmark(("bake/shell/" + name + "points:" + std::to_string(points) +
                                  "/threads:" + std::to_string(threads))
                                     .c_str(),
                                 bake_shell, input, options)
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime();
  }
}

[[maybe_unused]] const bool registered = [] {
  const auto input = [](std::function<io::Mesh()> make, Normal inward = {}) {
    return std::make_shared<Input>(std::move(make), std::move(inward));
  };
  add("", input(io::make_starter_motor), 56823);
  add("actuator/", input(io::make_actuator), 56823);
  const InputPtr torus = input([] { return shells::torus(kMajor, kMinor, 500, 100); }, into_torus);
  const InputPtr soup = input([] { return slit_tori(10); });
  add("torus100k/", torus, 56823);
  add("torus100k/", torus, 1'000'000);
  add("soup100k/field/", soup, 56823, io::ShellSurface::field);
  add("soup100k/", soup, 56823);
  // Large inputs take seconds to make and to check, so they are optional.
  if (const char* soups = std::getenv("HAPSIX_BENCH_SOUPS"); soups && *soups && *soups != '0') {
    add("soup500k/", input([] { return io::make_engine_bay().mesh; }), 56823);
    add("soup1800k/", input([] { return io::make_landing_gear().mesh; }), 56823);
  }
  return true;
}();

}  // namespace
