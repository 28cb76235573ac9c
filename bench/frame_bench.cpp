// SPDX-License-Identifier: Apache-2.0
// frame_bench.cpp - times whole frames on the alpha puzzle: frame/alpha/METHOD/threads:N/warm|cold,
// and frame/alpha/firm+friction.
//
// The hand pushes the tool into the gap until it has the wanted contacts and then holds it. Before
// a time is reported, the frame's contacts are compared with a brute-force test of all points.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "hapsix/vector.h"
#include "io/scene/load_scene.h"
#include "io/scenes/scenes.h"

namespace {

using namespace h6;

const io::LoadedScene* alpha() {
  static const auto loaded = [] {
    auto scene = io::make_scene("alpha-shortcut");
    return io::load_scene(std::move(*scene));
  }();
  return loaded ? loaded->get() : nullptr;
}

struct SessionDeleter {
  void operator()(h6Session* s) const { h6DestroySession(s); }
};
using Session = std::unique_ptr<h6Session, SessionDeleter>;

h6DeviceSample sample_at(double t) {
  const io::Path& path = alpha()->scene.hands[0].path;
  h6DeviceSample sample{};
  sample.pose = io::sample_path(path, t);
  sample.velocity = io::sample_path_velocity(path, t);
  return sample;
}

// Follows the scene's hand until the tool has `contacts` contacts, or to the end of the path.
Session pushed_in(h6Method method, double friction, unsigned threads, std::uint32_t contacts,
                  h6DeviceSample* held) {
  h6SessionDef def = alpha()->session_def();
  def.contact.method = method;
  def.contact.friction = friction;
  def.threads = threads;
  Session session(h6CreateSession(alpha()->model.get(), &def, nullptr));
  for (int i = 0; session && i < static_cast<int>(1000 * alpha()->duration()); ++i) {
    *held = sample_at(1e-3 * i);
    h6Step(session.get(), held, nullptr);
    if (h6GetFrame(session.get()).contacts >= contacts) break;
  }
  held->velocity = {};
  return session;
}

// Compares the next frame's contacts with a test of all points at the pose before that frame.
// Points within a thousandth of a voxel of the surface may differ, because this samples them by
// another code path.
bool contacts_are_right(h6Session* session, const h6DeviceSample& held) {
  const h6Pose pose = h6GetBody(session, 1).pose;
  std::vector<double> points, depth(alpha()->watched_points().size());
  for (const h6Vec3& p : alpha()->watched_points()) {
    const h6Vec3 q = place(pose, p);
    points.insert(points.end(), {q.x, q.y, q.z});
  }
  h6SampleField(alpha()->model.get(), alpha()->bodies[0].field, points.data(), depth.size(),
                depth.data(), nullptr, nullptr);
  h6Step(session, &held, nullptr);
  const h6Contacts found = h6GetContacts(session, 1);
  std::vector<bool> touching(depth.size());
  for (std::size_t i = 0; i < found.count; ++i)
    if (found.depth[i] > 0) touching[found.point[i]] = true;  // `series` has others, about to touch
  const bool merged = found.count < h6GetFrame(session).contacts;  // clusters name one point each
  const double doubt = 1e-3 * h6GetVoxel(session, 1);
  for (std::size_t i = 0; i < depth.size(); ++i)
    if (std::fabs(depth[i]) > doubt && touching[i] != (depth[i] < 0) && (touching[i] || !merged))
      return false;
  return true;
}

void flush_caches() {
  static std::vector<char> memory(96 << 20);
  for (std::size_t i = 0; i < memory.size(); i += 64) ++memory[i];
  benchmark::DoNotOptimize(memory.data());
}

void frame(benchmark::State& state, h6Method method, double friction, unsigned threads, bool cold) {
  if (!alpha()) return state.SkipWithError("the alpha could not be baked");
  h6DeviceSample held{};
  Session session = pushed_in(method, friction, threads, 100, &held);
  if (!session) return state.SkipWithError("no session");
  if (!contacts_are_right(session.get(), held))
    return state.SkipWithError("contacts differ from brute force");
  std::vector<double> times;
  std::map<int, double> stages;
  double contacts = 0;
  for (auto _ : state) {
    if (cold) flush_caches();
    h6Step(session.get(), &held, nullptr);
    const h6FrameReport report = h6GetFrame(session.get());
    state.SetIterationTime(1e-6 * report.frame_us);
    times.push_back(report.frame_us);
    contacts += report.contacts;
    for (int i = 0; i < H6_STAGE_COUNT; ++i) stages[i] += report.stage_us[i];
  }
  if (!contacts_are_right(session.get(), held))
    return state.SkipWithError("contacts differ from brute force");
  std::sort(times.begin(), times.end());
  const double n = static_cast<double>(times.size());
  const auto at = [&](double p) {
    return times[std::min(times.size() - 1, static_cast<std::size_t>(p * n))];
  };
  state.counters["contacts"] = contacts / n;
  state.counters["p50_us"] = at(0.5);
  state.counters["p99_us"] = at(0.99);
  state.counters["max_us"] = times.back();
  for (const auto& [stage, sum] : stages)
    state.counters[std::string(h6StageName(static_cast<h6Stage>(stage))) + "_us"] = sum / n;
}

void add(const std::string& rule, h6Method method, double friction, unsigned threads, bool cold) {
  const std::string name =
      "frame/alpha/" + rule + "/threads:" + std::to_string(threads) + (cold ? "/cold" : "/warm");
  benchmark::RegisterBenchmark(name.c_str(), frame, method, friction, threads, cold)
      ->UseManualTime()
      ->Unit(benchmark::kMicrosecond)
      ->Iterations(cold ? 300 : 5000);
}

[[maybe_unused]] const bool registered = [] {
  for (const bool cold : {false, true}) {
    for (int m = 0; m < H6_METHOD_COUNT; ++m)
      for (const unsigned threads : {1u, 2u})
        add(h6MethodName(static_cast<h6Method>(m)), static_cast<h6Method>(m), 0, threads, cold);
    add("firm+friction", H6_METHOD_FIRM, 0.3, 1, cold);
  }
  return true;
}();

}  // namespace
