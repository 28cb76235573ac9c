// many_fields_bench.cpp - whole frames with many pairs:
// frame/many_fields/fields:N/threads:T/slow|fast
//
// A ball of 56,823 points among N smaller balls, each an obstacle of its own; one in eight touches.
// Slow: 0.01 voxel a frame; fast: the frame before stood a metre away, so nothing is remembered.
// One thread and two must give the same bits before a time is reported.
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

void step(h6Session* session, int i, bool fast) {
  if (fast) {
    const h6DeviceSample away = test::hand_at(test::pose(1, 0, 0));
    h6Step(session, &away, nullptr);
  }
  const double x = 0.005 * kMm * (std::abs(i % 4 - 2) - 1);
  const h6DeviceSample sample = test::hand_at(test::pose(x, 0, 0));
  h6Step(session, &sample, nullptr);
}

void many_fields(benchmark::State& state, int fields, unsigned threads, bool fast) {
  static const Balls balls;
  const Session one = open(balls, fields, 1), session = open(balls, fields, threads);
  if (!one || !session) return state.SkipWithError("no session");
  for (int i = 0; i < 100; ++i) {
    step(one.get(), i, fast), step(session.get(), i, fast);
    const h6FrameReport a = h6GetFrame(one.get()), b = h6GetFrame(session.get());
    if (a.state_hash != b.state_hash || a.contacts != b.contacts || a.max_depth != b.max_depth)
      return state.SkipWithError("two threads differ from one");
  }
  std::vector<double> frame, traverse;
  double contacts = 0;
  int i = 0;
  for (auto _ : state) {
    step(session.get(), i++, fast);
    const h6FrameReport report = h6GetFrame(session.get());
    state.SetIterationTime(1e-6 * report.frame_us);
    frame.push_back(report.frame_us);
    traverse.push_back(report.stage_us[H6_STAGE_TRAVERSE]);
    contacts += report.contacts;
  }
  const auto at = [](std::vector<double>& t, double p) {
    std::sort(t.begin(), t.end());
    return t[static_cast<std::size_t>(p * static_cast<double>(t.size() - 1))];
  };
  state.counters["contacts"] = contacts / static_cast<double>(frame.size());
  state.counters["p50_us"] = at(frame, 0.5);
  state.counters["p99_us"] = at(frame, 0.99);
  state.counters["traverse_us"] = at(traverse, 0.5);
}

[[maybe_unused]] const bool registered = [] {
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
