// SPDX-License-Identifier: Apache-2.0
// bend_bench.cpp - times whole frames of a rigid ball on a plate that bends:
// frame/bridge/METHOD/points:P/modes:R/contacts:C/threads:N, and frame/warped/... with turns and a
// linear force in place of the cubic one. The plate has the size of the bridge
// of Xu & Barbic 2016, Fig. 14, and modes that are made up.
//
// The hand presses until the ball has about the wanted contacts, then goes to and fro so slowly as
// a hand that holds. Before a time is reported, the contacts are compared with all points.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "hapsix/vector.h"
#include "tests/support/bridge.h"

namespace {

using namespace h6;
using namespace h6::test;

constexpr double kX = 0.03, kY = 5e-3;

struct Held {
  BallOnBridge scene;
  double down = 0;
  Held(h6Method method, bool warped, std::size_t points, std::size_t modes, unsigned threads)
      : scene(points, modes, 0.06, true, 20, 1e-4, warped) {
    scene.def.contact.method = method;
    scene.def.threads = threads;
    scene.hand.coupling.max_force = 20;
    scene.open();
  }
  h6DeviceSample sample(int frame) const {
    const double t = 1e-3 * frame;
    return hand_at(pose(kX + 1e-3 * std::sin(4 * t), kY, scene.top() - down));
  }
  void press(std::uint32_t contacts) {
    for (int i = 0; i < 20000 && h6GetFrame(scene.session).contacts < contacts; ++i) {
      down = 1e-6 * i;
      const h6DeviceSample in = sample(0);
      h6Step(scene.session, &in, nullptr);
    }
    for (int i = 0; i < 500; ++i) {
      const h6DeviceSample in = sample(i);
      h6Step(scene.session, &in, nullptr);
    }
  }
  // Whether the next frame's contacts are those of all points. A point within a thousandth of a
  // voxel of the surface may differ.
  bool right() {
    const std::vector<double> q = scene.q();
    const h6BodyState ball = h6GetBody(scene.session, 1);
    const ShellArrays& shell = scene.bridge.shell;
    std::vector<double> points, depth(shell.x.size());
    const h6Quat inverse{ball.pose.q.w, -ball.pose.q.x, -ball.pose.q.y, -ball.pose.q.z};
    for (std::size_t i = 0; i < shell.x.size(); ++i) {
      const auto sum = [&](const std::vector<float>& modes) {
        double v[3] = {};
        for (std::size_t j = 0; j < q.size(); ++j)
          for (std::size_t k = 0; k < 3; ++k)
            v[k] += q[j] * double(modes[(i * q.size() + j) * 3 + k]);
        return h6Vec3{v[0], v[1], v[2]};
      };
      h6Vec3 moved = sum(scene.bridge.modes), term = moved;
      const h6Vec3 turn = scene.bridge.bend.turn_modes ? sum(scene.bridge.turn_modes) : h6Vec3{};
      for (int k = 1; k < 12; ++k) {  // the mean of the rotations up to the turn
        term = (1.0 / (k + 1)) * h6::cross(turn, term);
        moved = moved + term;
      }
      const h6Vec3 rest{double(shell.x[i]), double(shell.y[i]), double(shell.z[i])};
      const h6Vec3 d = rest + moved - ball.pose.p;
      const h6Vec3 local = h6::place(h6Pose{{0, 0, 0}, inverse}, d);
      points.insert(points.end(), {local.x, local.y, local.z});
    }
    h6SampleField(scene.model.handle, 0, points.data(), depth.size(), depth.data(), nullptr,
                  nullptr);
    const h6DeviceSample in = sample(500);
    h6Step(scene.session, &in, nullptr);
    if (h6GetFrame(scene.session).substeps != 1) return false;
    const h6Contacts c = h6GetContacts(scene.session, 0);
    std::vector<bool> touching(depth.size());
    for (std::size_t i = 0; i < c.count; ++i)
      if (c.depth[i] > 0) touching[c.point[i]] = true;
    for (std::size_t i = 0; i < depth.size(); ++i)
      if (std::fabs(depth[i]) > 1e-6 && touching[i] != (depth[i] < 0)) return false;
    return true;
  }
};

void frame(benchmark::State& state, h6Method method, bool warped, std::size_t points,
           std::size_t modes, std::uint32_t contacts, unsigned threads) {
  Held held(method, warped, points, modes, threads);
  if (!held.scene.session) return state.SkipWithError("no session");
  held.press(contacts);
  if (!held.right()) return state.SkipWithError("contacts differ from brute force");
  std::vector<double> times;
  std::vector<double> stages(H6_STAGE_COUNT);
  double found = 0;
  int i = 500;
  for (auto _ : state) {
    const h6DeviceSample in = held.sample(i++);
    h6Step(held.scene.session, &in, nullptr);
    const h6FrameReport report = h6GetFrame(held.scene.session);
    state.SetIterationTime(1e-6 * report.frame_us);
    times.push_back(report.frame_us);
    found += report.contacts;
    for (std::size_t k = 0; k < stages.size(); ++k) stages[k] += report.stage_us[k];
  }
  std::sort(times.begin(), times.end());
  const double n = static_cast<double>(times.size());
  const auto at = [&](double p) { return times[static_cast<std::size_t>(p * (n - 1))]; };
  state.counters["contacts"] = found / n;
  state.counters["p50_us"] = at(0.5);
  state.counters["p99_us"] = at(0.99);
  for (std::size_t k = 0; k < stages.size(); ++k)
    state.counters[std::string(h6StageName(static_cast<h6Stage>(k))) + "_us"] = stages[k] / n;
}

void add(h6Method method, std::size_t points, std::size_t modes, std::uint32_t contacts,
         unsigned threads, bool warped = false) {
  const std::string name =
      (warped ? "frame/warped/" : "frame/bridge/") + std::string(h6MethodName(method)) +
      "/points:" + std::to_string(points) + "/modes:" + std::to_string(modes) +
      "/contacts:" + std::to_string(contacts) + "/threads:" + std::to_string(threads);
  benchmark::RegisterBenchmark(name.c_str(), frame, method, warped, points, modes, contacts,
                               threads)
      ->UseManualTime()
      ->Unit(benchmark::kMicrosecond)
      ->Iterations(3000);
}

[[maybe_unused]] const bool registered = [] {
  for (const unsigned threads : {1u, 2u}) {
    for (const h6Method method : {H6_METHOD_FIRM, H6_METHOD_ROBUST})
      add(method, 85018, 20, 300, threads);
    for (const std::size_t modes : {20u, 60u})
      add(H6_METHOD_FIRM, 85018, modes, 300, threads, true);
    for (const std::size_t modes : {10u, 40u, 60u}) add(H6_METHOD_FIRM, 85018, modes, 300, threads);
    add(H6_METHOD_FIRM, 20000, 20, 300, threads);
    add(H6_METHOD_FIRM, 85018, 20, 30, threads);
    add(H6_METHOD_FIRM, 85018, 20, 1000, threads);
  }
  return true;
}();

}  // namespace
