// shell_bench.cpp - mesh in memory to shell in memory: bake/shell/points:56823/threads:T of the
// starter motor (18,580 triangles), and bake/shell/MESH/points:N/threads:T of other inputs: one
// closed piece, a soup with points where its field is zero, the same with points on its triangles.
// A shell is judged before it is timed.
#include <benchmark/benchmark.h>

#include <cmath>
#include <memory>
#include <string>

#include "io/bake_shell.h"
#include "io/nearest_triangle.h"
#include "io/scenes/industrial.h"

namespace {

using namespace h6;
using MeshPtr = std::shared_ptr<const io::Mesh>;

// A tube bent to a ring, two triangles a cell.
io::Mesh ring(int around, int across) {
  io::Mesh mesh;
  for (int i = 0; i < around; ++i)
    for (int j = 0; j < across; ++j) {
      const double t = 2 * M_PI * i / around, f = 2 * M_PI * j / across;
      const double r = 0.03 + 0.01 * std::cos(f);
      mesh.vertices.push_back({r * std::cos(t), r * std::sin(t), 0.01 * std::sin(f)});
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

// Rings of all sizes through one another, every one with a slit.
io::Mesh slit_rings(int count) {
  io::Mesh mesh;
  for (int k = 0; k < count; ++k) {
    const io::Mesh one = ring(100, 50);
    const double s = 0.4 + 0.6 * (k + 1) / count, tilt = 0.7 * k;
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const io::Vec3& v : one.vertices)
      mesh.vertices.push_back({s * v.x + 0.004 * k,
                               s * (std::cos(tilt) * v.y - std::sin(tilt) * v.z),
                               s * (std::sin(tilt) * v.y + std::cos(tilt) * v.z)});
    for (std::size_t t = 50; t < one.triangles.size(); ++t) {
      const auto& f = one.triangles[t];
      mesh.triangles.push_back({f[0] + first, f[1] + first, f[2] + first});
    }
  }
  return mesh;
}

// Exactly the number, all of it near the mesh, normals of one length; or what is wrong.
std::string judge(const io::Mesh& mesh, const io::ShellData& shell, std::size_t points) {
  if (shell.size() != points) return "another number of points";
  if (const Outcome whole = io::check_shell(shell); !whole) return whole.error();
  const io::NearestTriangle nearest(mesh, 0);
  double size = 0;
  for (const io::Vec3& v : mesh.vertices)
    size = std::max({size, std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  for (std::size_t i = 0; i < points; i += 97) {
    const double d = std::sqrt(nearest({shell.x[i], shell.y[i], shell.z[i]}).distance2);
    if (d > 0.02 * size) return "a point far from the mesh";
  }
  return {};
}

void bake_shell(benchmark::State& state, const MeshPtr& mesh, const io::ShellBake& options) {
  const auto made = io::bake_shell(*mesh, options, nullptr);
  const std::string wrong = made ? judge(*mesh, *made, options.points) : made.error();
  if (!wrong.empty()) return state.SkipWithError(wrong.c_str());
  for (auto _ : state) {
    auto shell = io::bake_shell(*mesh, options, nullptr);
    benchmark::DoNotOptimize(shell);
  }
  state.counters["triangles"] = static_cast<double>(mesh->triangles.size());
}

void add(const std::string& name, const MeshPtr& mesh, std::size_t points,
         io::ShellSurface surface = io::ShellSurface::automatic) {
  for (const unsigned threads : {1u, 2u}) {
    io::ShellBake options;
    options.points = points;
    options.surface = surface;
    options.threads = threads;
    benchmark::RegisterBenchmark(("bake/shell/" + name + "points:" + std::to_string(points) +
                                  "/threads:" + std::to_string(threads))
                                     .c_str(),
                                 bake_shell, mesh, options)
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime();
  }
}

[[maybe_unused]] const bool registered = [] {
  const auto shared = [](io::Mesh mesh) {
    return std::make_shared<const io::Mesh>(std::move(mesh));
  };
  add("", shared(io::make_starter_motor()), 56823);
  const MeshPtr one = shared(ring(500, 100)), soup = shared(slit_rings(10));
  add("ring100k/", one, 56823);
  add("ring100k/", one, 1'000'000);
  add("soup100k/field/", soup, 56823, io::ShellSurface::field);
  add("soup100k/", soup, 56823);
  return true;
}();

}  // namespace
