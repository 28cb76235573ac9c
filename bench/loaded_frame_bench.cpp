// SPDX-License-Identifier: Apache-2.0
// loaded_frame_bench.cpp - times whole frames in which nearly every contact carries load:
//     frame/loaded/flat|piston/METHOD/points:N/threads:T
//
// Flat: the bottom of a box on a plane. Piston: a piston 0.3 voxel thicker than its bore, with
// fit = tight. A hand presses the part and slides it to and fro, by up to 0.05 voxel a frame.
// Before a time is reported, the number of contacts is compared with a test of all points.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "hapsix/vector.h"
#include "tests/support/analytic.h"
#include "tests/support/part_on_field.h"

namespace {

using namespace h6::test;

constexpr double kVoxel = 1e-3;  // [m]
constexpr double kRadius = 24 * kVoxel;
constexpr double kAmplitude = 1.5 * kVoxel;

ShellArrays piston(std::size_t points) {
  ShellArrays shell;
  const double length = 40 * kVoxel, r = kRadius + 0.3 * kVoxel;
  const double n = static_cast<double>(points);
  const int around = static_cast<int>(std::sqrt(n * 2 * M_PI * r / length));
  const int along = static_cast<int>(n) / around;
  for (int i = 0; i < along; ++i)
    for (int k = 0; k < around; ++k) {
      const double t = 2 * M_PI * (k + 0.5 * (i % 2)) / around, c = std::cos(t), s = std::sin(t);
      shell.add(r * c, r * s, length * ((i + 0.5) / along - 0.5), -c, -s, 0);
    }
  return shell;
}

struct Loaded : PartOnField {
  bool flat;

  Loaded(bool is_flat, std::size_t points)
      : PartOnField(sample_analytic(
                        [is_flat](double x, double y, double z) {
                          return is_flat ? z : kRadius - std::hypot(x, y);
                        },
                        {-40 * kVoxel, -40 * kVoxel, -40 * kVoxel}, kVoxel, 10, 10, 10),
                    is_flat ? bottom_face(30 * kVoxel, 30 * kVoxel, 0, side(points), side(points))
                            : piston(points)),
        flat(is_flat) {
    def.contact.fit = H6_FIT_TIGHT;
  }
  static int side(std::size_t points) {
    return static_cast<int>(std::lround(std::sqrt(static_cast<double>(points))));
  }
  // The hand leans 4 voxels into the plane, or to the side of the bore.
  void step(int i) {
    const double way = kAmplitude * std::sin(0.05 * kVoxel / kAmplitude * i);
    const double lean = -4 * kVoxel * std::min(1.0, 1e-2 * i);
    const h6DeviceSample sample = hand_at(flat ? pose(way, 0.3 * way, lean) : pose(lean, 0, way));
    h6Step(session, &sample, nullptr);
  }
  // Whether the next frame finds the points that are inside at the pose before it; points within a
  // thousandth of a voxel of the surface may differ.
  bool finds_all(int i) {
    const h6Pose at = h6GetBody(session, 1).pose;
    std::vector<double> points, depth(shell.x.size());
    for (std::size_t k = 0; k < depth.size(); ++k) {
      const h6Vec3 p = h6::place(at, {shell.x[k], shell.y[k], shell.z[k]});
      points.insert(points.end(), {p.x, p.y, p.z});
    }
    h6SampleField(model.handle, 0, points.data(), depth.size(), depth.data(), nullptr, nullptr);
    step(i);
    const auto inside = std::count_if(depth.begin(), depth.end(), [](double d) { return d < 0; });
    const auto doubtful = std::count_if(depth.begin(), depth.end(),
                                        [](double d) { return std::fabs(d) < 1e-3 * kVoxel; });
    return std::abs(inside - static_cast<std::ptrdiff_t>(h6GetFrame(session).contacts)) <= doubtful;
  }
};

void frame(benchmark::State& state, bool flat, h6Method method, std::size_t points,
           unsigned threads) {
  Loaded scene(flat, points);
  scene.def.contact.method = method;
  scene.def.threads = threads;
  scene.session = h6CreateSession(scene.model.handle, &scene.def, nullptr);
  if (!scene.session) return state.SkipWithError("no session");
  int i = 0;
  while (i < 600) scene.step(i++);
  if (!scene.finds_all(i++)) return state.SkipWithError("contacts differ from brute force");
  std::vector<double> times;
  std::array<std::vector<double>, H6_STAGE_COUNT> stages;
  double contacts = 0, deepest = 0, late = 0;
  for (auto _ : state) {
    scene.step(i++);
    const h6FrameReport report = h6GetFrame(scene.session);
    state.SetIterationTime(1e-6 * report.frame_us);
    times.push_back(report.frame_us);
    for (std::size_t k = 0; k < H6_STAGE_COUNT; ++k) stages[k].push_back(report.stage_us[k]);
    contacts += report.contacts;
    deepest = std::max(deepest, report.max_depth_voxels);
    late += report.frame_us > 1000;
  }
  if (!scene.finds_all(i++)) return state.SkipWithError("contacts differ from brute force");
  const auto at = [](std::vector<double>& t, double p) {
    std::sort(t.begin(), t.end());
    return t[static_cast<std::size_t>(p * static_cast<double>(t.size() - 1))];
  };
  state.counters["contacts"] = contacts / static_cast<double>(times.size());
  state.counters["deepest_voxels"] = deepest;
  state.counters["over_1ms"] = late;
  state.counters["p50_us"] = at(times, 0.5);
  state.counters["p99_us"] = at(times, 0.99);
  for (std::size_t k = 0; k < H6_STAGE_COUNT; ++k)
    state.counters[std::string(h6StageName(static_cast<h6Stage>(k))) + "_us"] = at(stages[k], 0.5);
}

[[maybe_unused]] const bool registered = [] {
  for (const bool flat : {true, false})
    for (const h6Method method :
         {H6_METHOD_GAUSS6, H6_METHOD_ROBUST, H6_METHOD_SERIES, H6_METHOD_FIRM})
      for (const std::size_t points : {1000, 8000, 16000})
        for (const unsigned threads : {1u, 2u}) {
          const std::string name = std::string("frame/loaded/") + (flat ? "flat/" : "piston/") +
                                   h6MethodName(method) + "/points:" + std::to_string(points) +
                                   "/threads:" + std::to_string(threads);
          benchmark::RegisterBenchmark(name.c_str(), frame, flat, method, points, threads)
              ->UseManualTime()
              ->Unit(benchmark::kMicrosecond)
              ->Iterations(1000);
        }
  return true;
}();

}  // namespace
