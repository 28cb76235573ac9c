// SPDX-License-Identifier: Apache-2.0
// bake_bench.cpp - times bakes from a mesh in memory to an asset in memory:
// bake/MESH/voxels:N/threads:T and bake/MESH/points:N/threads:T. bake/openvdb/... is OpenVDB's
// meshToLevelSet on the same mesh and voxel, in the same run. Meshes are generated;
// $HAPSIX_BENCH_MESHES (a list of files separated by colons) adds more, and HAPSIX_BENCH_SOUPS=1
// adds the engine bay and the landing gear.
//
// Before a time is reported, the field is checked: distances at nodes outside are compared with the
// distance from all triangles in double, and sides are compared if the generated input knows what
// is solid. peak_MB is the peak memory of the process during the first bake, with the mesh and the
// benchmark's own data. ms_STAGE is the wall time of a stage. Times exclude the cost of getting
// memory from the machine (0.13 ms per MB at best, more than 2 ms if a virtual machine has returned
// idle memory to its host): five untimed bakes come first, and the process keeps the memory that
// they free. ms_cold is the time of the first bake, which includes that cost. OpenVDB is timed in
// the same way.
//
// bake/scaling/MESH/voxels:N bakes with one thread and with two in turn, because machines change
// their speed. It reports the speedup of two threads, in all and by stage, as medians over the
// rounds. Both fields must have the same bits.
#include <benchmark/benchmark.h>

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "hapsix/vector.h"
#include "io/bake/bake_field.h"
#include "io/mesh/mesh_file.h"
#include "io/scenes/industrial/industrial.h"
#include "io/scenes/scenes.h"
#include "io/shell/bake_shell.h"
#include "kernels/bake/triangle_distance.h"
#include "level_set_peer.h"
#include "sched/clock.h"

namespace {

using namespace h6;

// Makes a closed ring with teeth, of two triangles per cell.
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

// Makes closed tubes of 1,888 triangles each that cross a ball in all directions and overlap.
io::Mesh tubes(int count) {
  constexpr std::uint32_t kAround = 16, kAlong = 60;
  std::mt19937_64 engine(7);
  const auto random = [&](double low, double high) {
    return low + (high - low) * 0x1p-53 * double(engine() >> 11);
  };
  io::Mesh mesh;
  for (int i = 0; i < count; ++i) {
    const double z = random(-1, 1), turn = random(0, 2 * M_PI), r = std::sqrt(1 - z * z);
    const h6Vec3 way{r * std::cos(turn), r * std::sin(turn), z};
    const h6Vec3 u = unit(cross(way, {-way.z, way.x, way.y})), v = cross(way, u);
    const h6Vec3 start = random(-0.07, 0.07) * u + random(-0.07, 0.07) * v;
    const double radius = random(0.0015, 0.0035);
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (std::uint32_t k = 0; k < kAlong; ++k)
      for (std::uint32_t j = 0; j < kAround; ++j) {
        const double a = 2 * M_PI * j / kAround, end = k == 0 || k + 1 == kAlong ? 0 : radius;
        mesh.vertices.push_back(start + (0.004 * k - 0.12) * way + end * std::cos(a) * u +
                                end * std::sin(a) * v);
      }
    for (std::uint32_t k = 0; k + 1 < kAlong; ++k)
      for (std::uint32_t j = 0; j < kAround; ++j) {
        const std::uint32_t a = first + k * kAround + j,
                            b = first + k * kAround + (j + 1) % kAround;
        mesh.triangles.push_back({a, b, b + kAround});
        mesh.triangles.push_back({a, b + kAround, a + kAround});
      }
  }
  return io::weld(mesh);
}

// On Linux these reset the peak, free memory that earlier benchmarks left, and read the peak [MB].
void forget_peak() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
  std::ofstream("/proc/self/clear_refs") << "5";
}
double peak_megabytes() {
  std::ifstream in("/proc/self/status");
  for (std::string word; in >> word;)
    if (word == "VmHWM:") {
      double kilobytes = 0;
      in >> kilobytes;
      return kilobytes / 1000;
    }
  return 0;
}

// While an object lives, the process keeps freed memory.
class KeepMemory {
 public:
  KeepMemory() { set(0, -1); }
  ~KeepMemory() {
    set(65536, 128 * 1024);
    forget_peak();
  }
  KeepMemory(const KeepMemory&) = delete;
  KeepMemory& operator=(const KeepMemory&) = delete;

 private:
  static void set([[maybe_unused]] int mapped_blocks, [[maybe_unused]] int trim_above) {
#ifdef __GLIBC__
    mallopt(M_MMAP_MAX, mapped_blocks);
    mallopt(M_TRIM_THRESHOLD, trim_above);
#endif
  }
};

struct Input {
  io::Mesh mesh;
  std::vector<io::IndustrialTruth::Probe> inside, outside;
};
using InputPtr = std::shared_ptr<const Input>;
// Makes the input when the first benchmark asks for it, and keeps it.
using Lazy = std::function<InputPtr()>;
Lazy once(Lazy make) {
  return [make, made = std::make_shared<InputPtr>()] {
    if (!*made) *made = make();
    return *made;
  };
}

double distance_to_all(const io::Mesh& mesh, const double (&p)[3]) {
  double least = 1e300;
  for (const auto& t : mesh.triangles) {
    double c[3][3];
    for (std::size_t i = 0; i < 3; ++i) {
      const io::Vec3& v = mesh.vertices[t[i]];
      c[i][0] = v.x, c[i][1] = v.y, c[i][2] = v.z;
    }
    least = std::min(least, kernels::point_triangle_squared(p, c[0], c[1], c[2]));
  }
  return std::sqrt(least);
}

// The worst distance error at some nodes of the band outside the solid [voxel].
double worst_error(const io::FieldData& f, const io::Mesh& mesh) {
  constexpr std::size_t kNodes = 24;
  double worst = 0;
  std::size_t checked = 0, cell = 0;
  for (std::size_t n = 0; checked < kNodes && n < 100 * kNodes; ++n) {
    cell = (cell + 7919 * f.brick_index.size() / 65536 + 1) % f.brick_index.size();
    while (f.brick_index[cell] < 0) cell = (cell + 1) % f.brick_index.size();
    const std::size_t node = n * 37 % 512, bx = std::size_t(f.bricks[0]),
                      by = std::size_t(f.bricks[1]);
    const double d = double(f.samples[std::size_t(f.brick_index[cell]) * 512 + node]);
    if (d <= 0 || d > f.band) continue;
    const double h = f.voxel_size;
    const double p[3] = {f.origin.x + h * double(8 * (cell % bx) + node % 8),
                         f.origin.y + h * double(8 * (cell / bx % by) + node / 8 % 8),
                         f.origin.z + h * double(8 * (cell / bx / by) + node / 64)};
    worst = std::max(worst, std::fabs(d + f.offset - distance_to_all(mesh, p)) / h);
    ++checked;
  }
  return checked > 0 ? worst : 1e9;
}

bool is_inside(const io::FieldData& f, const h6Vec3& p) {
  const double c[3] = {p.x - f.origin.x, p.y - f.origin.y, p.z - f.origin.z};
  std::size_t node[3], coarse[3];
  for (std::size_t k = 0; k < 3; ++k) {
    node[k] = std::size_t(std::clamp(std::round(c[k] / f.voxel_size), 0.0, 8.0 * f.bricks[k] - 1));
    coarse[k] = std::size_t(std::round(double(node[k]) / 8));
  }
  const std::size_t bx = std::size_t(f.bricks[0]), by = std::size_t(f.bricks[1]);
  const std::int32_t row = f.brick_index[(node[2] / 8 * by + node[1] / 8) * bx + node[0] / 8];
  if (row >= 0)
    return f.samples[std::size_t(row) * 512 + (node[2] % 8 * 8 + node[1] % 8) * 8 + node[0] % 8] <
           0;
  return f.far_grid[(coarse[2] * (by + 1) + coarse[1]) * (bx + 1) + coarse[0]] < 0;
}

// Counts wrong sides at probes that are too far from the surface for offset and voxel to matter.
std::size_t wrong_sides(const io::FieldData& f, const Input& input) {
  const double room = f.offset + 8 * f.voxel_size;
  std::size_t wrong = 0;
  for (const auto& probe : input.inside) wrong += probe.clearance > room && !is_inside(f, probe.p);
  for (const auto& probe : input.outside) wrong += probe.clearance > room && is_inside(f, probe.p);
  return wrong;
}

void bake_field(benchmark::State& state, const Lazy& make, int voxels, unsigned threads) {
  const InputPtr input = make();
  io::FieldBake options;
  options.voxels = voxels;
  options.threads = threads;
  io::FieldData last;
  std::map<std::string, double> stages;  // [s]
  forget_peak();
  const std::int64_t begin = sched::now_ns();
  if (const auto cold = io::bake_field(input->mesh, options, nullptr); !cold)
    return state.SkipWithError(cold.error().c_str());
  state.counters["ms_cold"] = 1e-6 * double(sched::now_ns() - begin);
  const double peak = peak_megabytes();
  const KeepMemory keep;
  // One bake does not warm up all memory, because the allocator uses several places for large
  // blocks. These bakes need no report.
  for (int i = 0; i < 4; ++i)
    if (auto field = io::bake_field(input->mesh, options, nullptr)) last = std::move(*field);
  for (auto _ : state) {
    io::FieldBakeReport report;
    auto field = io::bake_field(input->mesh, options, &report);
    state.PauseTiming();
    for (const auto& stage : report.stages) stages[stage.name] += stage.seconds;
    if (!field) return state.SkipWithError(field.error().c_str());
    last = {};
    last = std::move(*field);
    state.ResumeTiming();
  }
  const double error = worst_error(last, input->mesh);
  const std::size_t wrong = wrong_sides(last, *input);
  if (error > 1e-3) return state.SkipWithError("distances are wrong by more than 1e-3 voxel");
  if (wrong > 0) return state.SkipWithError("a place that is known is on the wrong side");
  state.counters["bricks"] = static_cast<double>(last.brick_count());
  state.counters["triangles"] = static_cast<double>(input->mesh.triangles.size());
  state.counters["peak_MB"] = peak;
  state.counters["worst_voxel"] = error;
  for (const auto& [name, seconds] : stages)
    state.counters["ms_" + name] =
        benchmark::Counter(1e3 * seconds, benchmark::Counter::kAvgIterations);
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

void bake_scaling(benchmark::State& state, const Lazy& make, int voxels) {
  constexpr int kRounds = 9, kWarmUp = 3;
  const InputPtr input = make();
  const KeepMemory keep;
  io::FieldData field[2];
  std::vector<double> seconds[2], faster;
  std::map<std::string, std::vector<double>> stages;
  for (auto _ : state)
    for (int round = -kWarmUp; round < kRounds; ++round) {
      std::map<std::string, double> stage[2];
      double took[2];
      for (unsigned i = 0; i < 2; ++i) {
        io::FieldBake options;
        options.voxels = voxels;
        options.threads = 1 + i;
        io::FieldBakeReport report;
        field[i] = {};
        const std::int64_t begin = sched::now_ns();
        auto made = io::bake_field(input->mesh, options, &report);
        took[i] = 1e-9 * double(sched::now_ns() - begin);
        if (!made) return state.SkipWithError(made.error().c_str());
        field[i] = std::move(*made);
        for (const auto& s : report.stages) stage[i][s.name] += s.seconds;
      }
      if (field[0].brick_index != field[1].brick_index || field[0].samples != field[1].samples ||
          field[0].far_grid != field[1].far_grid)
        return state.SkipWithError("fields with one thread and with two are not the same");
      if (round < 0) continue;
      for (int i = 0; i < 2; ++i) seconds[i].push_back(took[i]);
      faster.push_back(took[0] / took[1]);
      for (const auto& [name, s] : stage[0]) stages[name].push_back(s / stage[1][name]);
    }
  state.counters["ms_one"] = 1e3 * median(seconds[0]);
  state.counters["ms_two"] = 1e3 * median(seconds[1]);
  state.counters["times_faster"] = median(faster);
  for (const auto& [name, ratios] : stages) state.counters["times_" + name] = median(ratios);
}

void level_set(benchmark::State& state, const Lazy& make, int voxels, unsigned threads) {
  const InputPtr input = make();
  const double side = io::bounds_of(input->mesh).longest();
  std::size_t bricks = 0;
  forget_peak();
  const std::int64_t begin = sched::now_ns();
  bench::mesh_to_level_set(input->mesh, side / (voxels - 16), threads);
  state.counters["ms_cold"] = 1e-6 * double(sched::now_ns() - begin);
  const double peak = peak_megabytes();
  const KeepMemory keep;
  for (auto _ : state)
    bricks = bench::mesh_to_level_set(input->mesh, side / (voxels - 16), threads);
  state.counters["bricks"] = static_cast<double>(bricks);
  state.counters["triangles"] = static_cast<double>(input->mesh.triangles.size());
  state.counters["peak_MB"] = peak;
}

void bake_shell(benchmark::State& state, const Lazy& make, std::size_t points, unsigned threads) {
  const InputPtr input = make();
  const io::Mesh* mesh = &input->mesh;
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

void add_fields(const std::string& name, const Lazy& input, const std::vector<int>& sizes,
                bool peer) {
  for (const int voxels : sizes)
    for (const unsigned threads : {1u, 2u}) {
      const std::string end =
          name + "/voxels:" + std::to_string(voxels) + "/threads:" + std::to_string(threads);
      benchmark::RegisterBenchmark(("bake/" + end).c_str(), bake_field, input, voxels, threads)
          ->Unit(benchmark::kMillisecond)
          ->UseRealTime();
      if (peer)
        benchmark::RegisterBenchmark(("bake/openvdb/" + end).c_str(), level_set, input, voxels,
                                     threads)
            ->Unit(benchmark::kMillisecond)
            ->Iterations(1)
            ->UseRealTime();
    }
}

void add_shells(const std::string& name, const Lazy& input) {
  for (const unsigned threads : {1u, 2u})
    for (const std::size_t points : {std::size_t{25269}, std::size_t{56823}})
      benchmark::RegisterBenchmark(("bake/" + name + "/points:" + std::to_string(points) +
                                    "/threads:" + std::to_string(threads))
                                       .c_str(),
                                   bake_shell, input, points, threads)
          ->Unit(benchmark::kMillisecond)
          ->UseRealTime();
}

void add_scaling(const std::string& name, const Lazy& input, int voxels) {
  benchmark::RegisterBenchmark(
      ("bake/scaling/" + name + "/voxels:" + std::to_string(voxels)).c_str(), bake_scaling, input,
      voxels)
      ->Unit(benchmark::kMillisecond)
      ->Iterations(1)
      ->UseRealTime();
}

InputPtr plain(io::Mesh mesh) {
  auto input = std::make_shared<Input>();
  input->mesh = std::move(mesh);
  return input;
}
InputPtr industrial(io::IndustrialInput&& made) {
  auto input = std::make_shared<Input>();
  input->mesh = std::move(made.mesh);
  input->inside = std::move(made.truth.inside);
  input->outside = std::move(made.truth.outside);
  return input;
}

[[maybe_unused]] const bool registered = [] {
  const Lazy alpha = once([] { return plain(io::make_alpha().mesh); }),
             ring = once([] { return plain(gear(1000, 50)); });
  add_fields("alpha", alpha, {256, 512}, false);
  add_shells("alpha", alpha);
  add_fields("gear100k", ring, {256, 512}, true);
  add_shells("gear100k", ring);
  add_scaling("gear100k", ring, 512);
  // Closed solids that overlap, and the soup that they are without one triangle.
  const auto opened = [](io::Mesh mesh) {
    mesh.triangles.erase(mesh.triangles.begin() + 100);
    return plain(std::move(mesh));
  };
  const auto loom = [] { return *io::make_scene("wire-bundle")->bodies[0].field->mesh_data; };
  add_fields("loom", once([=] { return plain(loom()); }), {256, 512}, false);
  add_fields("loom/soup", once([=] { return opened(loom()); }), {256, 512}, false);
  add_fields("tubes", once([] { return plain(tubes(300)); }), {256, 512}, false);
  add_fields("tubes/soup", once([=] { return opened(tubes(300)); }), {256, 512}, false);
  // Large inputs take seconds to bake and OpenVDB takes minutes, so they are optional.
  const char* which = std::getenv("HAPSIX_BENCH_SOUPS");
  if (which != nullptr && *which != '\0' && *which != '0') {
    constexpr std::size_t kProbes = 400;
    const Lazy bay = once([] { return industrial(io::make_engine_bay(kProbes)); }),
               gear = once([] { return industrial(io::make_landing_gear(kProbes)); });
    add_fields("soup500k", bay, {512, 1024}, true);
    add_fields("soup1800k", gear, {1024}, true);
    for (const int voxels : {512, 1024}) add_scaling("soup500k", bay, voxels);
    add_scaling("soup1800k", gear, 1024);
  }
  if (const char* list = std::getenv("HAPSIX_BENCH_MESHES")) {
    std::stringstream files(list);
    for (std::string file; std::getline(files, file, ':');)
      if (auto mesh = io::read_mesh(file)) {
        const std::string name = std::filesystem::path(file).stem().string();
        const Lazy input = [made = plain(std::move(*mesh))] { return made; };
        add_fields(name, input, {256, 512, 1024}, true);
        add_shells(name, input);
      }
  }
  return true;
}();

}  // namespace
