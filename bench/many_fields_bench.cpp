// SPDX-License-Identifier: Apache-2.0
// many_fields_bench.cpp - times whole frames with many pairs, and with several hands:
// frame/many_fields/fields:N/threads:T/slow|fast
// frame/two_hands/contacts:N/threads:T/slow|fast
//
// A ball of 56,823 points touches one in eight of N smaller balls, each an obstacle of its own.
// Slow: it moves 0.01 voxel per frame. Fast: it was a metre away in the previous frame, so nothing
// can be reused. Two hands: each presses such a ball into one smaller ball, with N contacts each.
// Before a time is reported, one thread and two must give the same bits.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/analytic.h"

namespace {

using namespace h6;
constexpr double kMm = 1e-3;

struct SessionDeleter {
  void operator()(h6Session* s) const { h6DestroySession(s); }
};
using Session = std::unique_ptr<h6Session, SessionDeleter>;

struct Balls {
  test::FieldArrays small = test::sample_analytic(
      [](double x, double y, double z) { return std::sqrt(x * x + y * y + z * z) - 8 * kMm; },
      {-16 * kMm, -16 * kMm, -16 * kMm}, 0.5 * kMm, 8, 8, 8);
  test::ShellArrays large = test::sphere_points(20 * kMm, 56823);
  test::Model model{{test::def_of(small)}, {large.def()}};
};

Session open(const Balls& balls, int fields, unsigned threads) {
  std::vector<h6BodyDef> bodies(static_cast<std::size_t>(fields) + 1, h6DefaultBodyDef());
  bodies[0].shell = 0;
  const double golden = M_PI * (3 - std::sqrt(5.0));
  for (int i = 0; i < fields; ++i) {
    h6BodyDef& body = bodies[static_cast<std::size_t>(i) + 1];
    body.fixed = true, body.field = 0;
    const double away = (28 + (i % 8 ? 0.5 + i % 7 : -0.2)) * kMm;
    const double z = 1 - 2 * (i + 0.5) / fields, r = std::sqrt(1 - z * z);
    body.pose =
        test::pose(away * r * std::cos(golden * i), away * r * std::sin(golden * i), away * z);
  }
  h6HandDef hand = h6DefaultHandDef();
  hand.coupling.mode = H6_COUPLING_DIRECT;
  h6SessionDef def = h6DefaultSessionDef();
  def.bodies = bodies.data(), def.body_count = bodies.size();
  def.hands = &hand, def.hand_count = 1;
  def.threads = threads;
  return Session(h6CreateSession(balls.model.handle, &def, nullptr));
}

// Steps with the same sample for every hand.
void step(h6Session* session, int i, bool fast) {
  if (fast) {
    const h6DeviceSample away = test::hand_at(test::pose(1, 0, 0));
    const h6DeviceSample both[2] = {away, away};
    h6Step(session, both, nullptr);
  }
  const double x = 0.005 * kMm * (std::abs(i % 4 - 2) - 1);
  const h6DeviceSample sample = test::hand_at(test::pose(x, 0, 0)), both[2] = {sample, sample};
  h6Step(session, both, nullptr);
}

const Balls& balls() {
  static const Balls all;
  return all;
}

// Opens a session of two large balls. Each is pressed into a small ball of its own, to the depth
// `deep` [mm].
Session open_hands(double deep, unsigned threads) {
  h6BodyDef bodies[4] = {h6DefaultBodyDef(), h6DefaultBodyDef(), h6DefaultBodyDef(),
                         h6DefaultBodyDef()};
  h6HandDef hands[2] = {h6DefaultHandDef(), h6DefaultHandDef()};
  for (int h = 0; h < 2; ++h) {
    bodies[h].shell = 0;
    hands[h].body = h;
    hands[h].coupling.mode = H6_COUPLING_DIRECT;
    bodies[2 + h].fixed = true, bodies[2 + h].field = 0;
    bodies[2 + h].pose = test::pose(0, (h ? -1 : 1) * (28 - deep) * kMm, 0);
  }
  h6SessionDef def = h6DefaultSessionDef();
  def.bodies = bodies, def.body_count = 4;
  def.hands = hands, def.hand_count = 2;
  def.threads = threads;
  return Session(h6CreateSession(balls().model.handle, &def, nullptr));
}

// Finds the depth at which each hand has about `contacts` contacts [mm].
double depth_for(double contacts) {
  double low = 0, high = 8;
  for (int i = 0; i < 20; ++i) {
    const double deep = 0.5 * (low + high);
    const Session probe = open_hands(deep, 1);
    step(probe.get(), 0, false);
    (h6GetFrame(probe.get()).contacts < 2 * contacts ? low : high) = deep;
  }
  return high;
}

void measure(benchmark::State& state, const Session& one, const Session& session, bool fast) {
  if (!one || !session) return state.SkipWithError("no session");
  for (int i = 0; i < 100; ++i) {
    step(one.get(), i, fast), step(session.get(), i, fast);
    const h6FrameReport a = h6GetFrame(one.get()), b = h6GetFrame(session.get());
    if (a.state_hash != b.state_hash || a.contacts != b.contacts || a.max_depth != b.max_depth)
      return state.SkipWithError("two threads differ from one");
  }
  std::vector<double> frame, traverse;
  double contacts = 0, helped = 0;
  int i = 0;
  for (auto _ : state) {
    step(session.get(), i++, fast);
    const h6FrameReport report = h6GetFrame(session.get());
    state.SetIterationTime(1e-6 * report.frame_us);
    frame.push_back(report.frame_us);
    traverse.push_back(report.stage_us[H6_STAGE_TRAVERSE]);
    contacts += report.contacts;
    helped += report.helper_slices > 0;
  }
  const auto at = [](std::vector<double>& t, double p) {
    std::sort(t.begin(), t.end());
    return t[static_cast<std::size_t>(p * static_cast<double>(t.size() - 1))];
  };
  state.counters["contacts"] = contacts / static_cast<double>(frame.size());
  state.counters["helped"] = helped / static_cast<double>(frame.size());
  state.counters["p50_us"] = at(frame, 0.5);
  state.counters["p99_us"] = at(frame, 0.99);
  state.counters["traverse_us"] = at(traverse, 0.5);
}

void many_fields(benchmark::State& state, int fields, unsigned threads, bool fast) {
  measure(state, open(balls(), fields, 1), open(balls(), fields, threads), fast);
}

void two_hands(benchmark::State& state, int contacts, unsigned threads, bool fast) {
  const double deep = depth_for(contacts);
  measure(state, open_hands(deep, 1), open_hands(deep, threads), fast);
}

[[maybe_unused]] const bool registered = [] {
  for (const int contacts : {10, 30, 100, 300, 1000})
    for (const bool fast : {false, true})
      for (const unsigned threads : {1u, 2u})
        benchmark::RegisterBenchmark(
            ("frame/two_hands/contacts:" + std::to_string(contacts) +
             "/threads:" + std::to_string(threads) + (fast ? "/fast" : "/slow"))
                .c_str(),
            two_hands, contacts, threads, fast)
            ->UseManualTime()
            ->Unit(benchmark::kMicrosecond)
            ->Iterations(2000);
  for (const int fields : {2, 8, 40, 200})
    for (const bool fast : {false, true})
      for (const unsigned threads : {1u, 2u})
        benchmark::RegisterBenchmark(
            ("frame/many_fields/fields:" + std::to_string(fields) +
             "/threads:" + std::to_string(threads) + (fast ? "/fast" : "/slow"))
                .c_str(),
            many_fields, fields, threads, fast)
            ->UseManualTime()
            ->Unit(benchmark::kMicrosecond)
            ->Iterations(2000);
  return true;
}();

}  // namespace
