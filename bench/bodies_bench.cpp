// SPDX-License-Identifier: Apache-2.0
// bodies_bench.cpp - times whole frames of many bodies:
//     frame/bodies/placed:N     a hand rubs one of N fixed parts that share 200 fields
//     frame/bodies/flying:N     N balls, each shell and field, fly about and nothing is near
//     frame/bodies/heap:N       N balls rest and roll in a bowl under gravity
// Before a time is reported, the bits are compared with those of a session in which no pair ever
// sleeps.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "runtime/frame/near_pairs.h"
#include "runtime/frame/session.h"
#include "tests/support/analytic.h"

namespace {

using namespace h6;
using namespace h6::test;

constexpr double mm = 1e-3;

struct Destroy {
  void operator()(h6Session* s) const { h6DestroySession(s); }
};
using Session = std::unique_ptr<h6Session, Destroy>;

struct World {
  FieldArrays ball = sample_analytic(
      [](double x, double y, double z) { return std::sqrt(x * x + y * y + z * z) - 8 * mm; },
      {-16 * mm, -16 * mm, -16 * mm}, 0.5 * mm, 8, 8, 8);
  FieldArrays bowl = sample_analytic(
      [](double x, double y, double z) {
        return 80 * mm - std::sqrt(x * x + y * y + std::min(z, 0.0) * std::min(z, 0.0));
      },
      {-96 * mm, -96 * mm, -96 * mm}, mm, 24, 24, 24);
  ShellArrays shell = sphere_points(8 * mm, 600);
  std::unique_ptr<Model> model;
  std::vector<h6BodyDef> bodies;
  h6HandDef hand = h6DefaultHandDef();
  h6SessionDef def = h6DefaultSessionDef();

  World() {
    std::vector<h6FieldDef> fields(200, def_of(ball));
    fields.push_back(def_of(bowl));
    model = std::make_unique<Model>(fields, std::vector{shell.def()});
    def.max_contacts = 4096;
  }
  h6BodyDef& add(bool fixed, int shell_index, int field, const h6Pose& at) {
    h6BodyDef body = h6DefaultBodyDef();
    body.fixed = fixed, body.shell = shell_index, body.field = field, body.pose = at;
    body.mass = 0.01;
    for (int k = 0; k < 3; ++k) body.inertia[k] = 2.6e-7;
    bodies.push_back(body);
    return bodies.back();
  }
  Session open(unsigned threads) {
    def.bodies = bodies.data(), def.body_count = bodies.size();
    def.threads = threads;
    return Session(h6CreateSession(model->handle, &def, nullptr));
  }
};

double at(std::vector<double>& t, double p) {
  std::sort(t.begin(), t.end());
  return t[static_cast<std::size_t>(p * static_cast<double>(t.size() - 1))];
}

// `sample(i)` of frame i. `check`: frames whose bits are compared.
template <class F>
void measure(benchmark::State& state, World& world, unsigned threads, int check, int settle,
             const F& sample) {
  {
    const Session some = world.open(threads), all = world.open(1);
    if (!some || !all) return state.SkipWithError("no session");
    keep_all_awake(*all);
    for (int i = 0; i < check; ++i) {
      const h6DeviceSample in = sample(i);
      h6Step(some.get(), &in, nullptr), h6Step(all.get(), &in, nullptr);
      if (h6GetFrame(some.get()).state_hash != h6GetFrame(all.get()).state_hash)
        return state.SkipWithError("the bits differ from those of all pairs");
    }
  }
  const Session session = world.open(threads);
  int i = 0;
  for (; i < settle; ++i) {
    const h6DeviceSample in = sample(i);
    h6Step(session.get(), &in, nullptr);
  }
  std::vector<double> frame;
  std::array<std::vector<double>, H6_STAGE_COUNT> stages;
  double contacts = 0, near = 0, awake = 0, deepest = 0;
  for (auto _ : state) {
    const h6DeviceSample in = sample(i++);
    h6Step(session.get(), &in, nullptr);
    const h6FrameReport r = h6GetFrame(session.get());
    state.SetIterationTime(1e-6 * r.frame_us);
    frame.push_back(r.frame_us);
    for (std::size_t k = 0; k < H6_STAGE_COUNT; ++k) stages[k].push_back(r.stage_us[k]);
    contacts += r.contacts, deepest = std::max(deepest, r.max_depth_voxels);
    near += static_cast<double>(session->near.near_count);
    awake += static_cast<double>(session->near.awake_count);
  }
  const double n = static_cast<double>(frame.size());
  state.counters["contacts"] = contacts / n;
  state.counters["near"] = near / n;
  state.counters["awake"] = awake / n;
  state.counters["deepest_voxels"] = deepest;
  state.counters["session_MB"] = 1e-6 * static_cast<double>(session->memory_bytes);
  state.counters["p50_us"] = at(frame, 0.5);
  state.counters["p99_us"] = at(frame, 0.99);
  for (std::size_t k = 0; k < H6_STAGE_COUNT; ++k)
    state.counters[std::string(h6StageName(static_cast<h6Stage>(k))) + "_us"] = at(stages[k], 0.5);
}

// A grid of parts on a plane; the hand's ball presses one of them and slides to and fro on it.
void placed(benchmark::State& state, int parts, unsigned threads) {
  World world;
  const int side = static_cast<int>(std::ceil(std::sqrt(parts)));
  for (int i = 0; i < parts; ++i)
    world.add(true, -1, i % 200, pose(i % side * 40 * mm, i / side * 40 * mm, 0));
  const int there = side / 2 * side + std::min(side / 2, parts - 1 - side / 2 * side);
  const double x = there % side * 40 * mm, y = there / side * 40 * mm;
  world.add(false, 0, -1, pose(x, y, 16.5 * mm));
  world.hand.body = parts;
  world.def.hands = &world.hand, world.def.hand_count = 1;
  measure(state, world, threads, parts > 1000 ? 20 : 200, 1000,
          [&](int i) { return hand_at(pose(x + 0.5 * mm * std::sin(0.01 * i), y, 15 * mm)); });
}

// Balls on a cubic lattice that swing about their places.
void flying(benchmark::State& state, int balls, unsigned threads) {
  World world;
  const int side = static_cast<int>(std::ceil(std::cbrt(balls)));
  for (int i = 0; i < balls; ++i) {
    h6BodyDef& body =
        world.add(false, 0, i % 200,
                  pose(i % side * 60 * mm, i / side % side * 60 * mm, i / side / side * 60 * mm));
    body.velocity = {{0.02 * std::sin(i), 0.02 * std::cos(i), 0}, {1, 2, 0.1 * i}};
  }
  measure(state, world, threads, 50, 100, [](int) { return h6DeviceSample{}; });
}

void heap(benchmark::State& state, int balls, unsigned threads) {
  World world;
  world.add(true, -1, 200, pose(0, 0, 0));
  for (int i = 0; i < balls; ++i)
    world.add(false, 0, i % 200,
              pose((i % 4 - 1.5) * 18 * mm + 0.1 * mm * (i % 7), (i / 4 % 4 - 1.5) * 18 * mm,
                   (i / 16 * 18 - 40) * mm));
  world.def.gravity = {0, 0, -9.81};
  measure(state, world, threads, 300, 2000, [](int) { return h6DeviceSample{}; });
}

[[maybe_unused]] const bool registered = [] {
  const auto add = [](const char* name, int n, auto run) {
    for (const unsigned threads : {1u, 2u})
      benchmark::RegisterBenchmark(("frame/bodies/" + std::string(name) + ":" + std::to_string(n) +
                                    "/threads:" + std::to_string(threads))
                                       .c_str(),
                                   run, n, threads)
          ->UseManualTime()
          ->Unit(benchmark::kMicrosecond)
          ->Iterations(3000);
  };
  for (const int n : {10, 200, 10000}) add("placed", n, placed);
  for (const int n : {50, 200, 1000}) add("flying", n, flying);
  for (const int n : {10, 50}) add("heap", n, heap);
  return true;
}();

}  // namespace
