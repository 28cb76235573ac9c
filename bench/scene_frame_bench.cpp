// SPDX-License-Identifier: Apache-2.0
// scene_frame_bench.cpp - times whole frames on seeded scenes of 1024^3 voxels and 56,823 points:
//     frame/clutter|conforming/METHOD/contacts:N/threads:T/warm|cold/slow|fast
//
// Clutter: most of the part's surface is free. Conforming: a socket with 0.25 voxel of clearance.
// The part moves in until it has about the wanted contacts. Slow: it moves 0.01 voxel per frame.
// Fast: it was far outside the field in the previous frame, so nothing can be reused. Before a time
// is reported, the contacts of the timed poses are compared with a test of all points. The stepping
// thread is pinned to one core, like a haptic thread; the helper has the other.
//     field/memory/voxels:1024/bricks:N
// The time is that of h6CreateModel; resident_mb is the memory that it adds to this process.
#include <benchmark/benchmark.h>

#include <pthread.h>
#include <sched.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <fstream>
#include <map>
#include <memory>
#include <string>

#include "tests/support/frame_scenes.h"

namespace {

using namespace h6::bench;

struct ModelDeleter {
  void operator()(h6Model* m) const { h6DestroyModel(m); }
};
struct SessionDeleter {
  void operator()(h6Session* s) const { h6DestroySession(s); }
};

// Pins this thread, but not the threads it has started, to the last of its cores.
class OneCore {
 public:
  OneCore() {
    pthread_getaffinity_np(pthread_self(), sizeof before_, &before_);
    int core = CPU_SETSIZE - 1;
    while (core > 0 && !CPU_ISSET(core, &before_)) --core;
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(core, &one);
    pthread_setaffinity_np(pthread_self(), sizeof one, &one);
  }
  ~OneCore() { pthread_setaffinity_np(pthread_self(), sizeof before_, &before_); }
  OneCore(const OneCore&) = delete;
  OneCore& operator=(const OneCore&) = delete;

 private:
  cpu_set_t before_;
};

// Keeps one model at a time, because a field takes hundreds of megabytes.
h6Model* model_of(bool socket) {
  static std::unique_ptr<h6Model, ModelDeleter> model;
  static int held = -1;
  if (held != socket) {
    model.reset();
    model.reset(make_model(socket));
    held = socket;
  }
  return model.get();
}

std::vector<double> depths(const h6Model* model, const h6Vec3& shift) {
  std::vector<double> points, d(kPoints);
  for (const Point& p : part_points().at)
    points.insert(points.end(), {static_cast<float>(kVoxel * p[0]) + shift.x,
                                 static_cast<float>(kVoxel * p[1]) + shift.y,
                                 static_cast<float>(kVoxel * p[2]) + shift.z});
  h6SampleField(model, 0, points.data(), kPoints, d.data(), nullptr, nullptr);
  return d;
}

h6Vec3 along(double t) { return {kVoxel * t * 0.7, kVoxel * t * 0.6, kVoxel * t * -0.387}; }

// Finds how far the part must move along a fixed direction until `wanted` points touch [voxel].
double push_for(const h6Model* model, std::size_t wanted, double most) {
  double low = 0, high = most;
  for (int i = 0; i < 24; ++i) {
    const double middle = 0.5 * (low + high);
    const auto d = depths(model, along(middle));
    const auto touching = std::count_if(d.begin(), d.end(), [](double v) { return v < 0; });
    (static_cast<std::size_t>(touching) < wanted ? low : high) = middle;
  }
  return high;
}

// Points within a thousandth of a voxel of the surface may differ, because this samples them by
// another code path.
bool contacts_are_right(const h6Session* session, const h6Model* model, const h6Vec3& shift) {
  const auto d = depths(model, shift);
  const h6Contacts found = h6GetContacts(session, 1);
  std::vector<int> touching(kPoints);
  for (std::size_t i = 0; i < found.count; ++i)
    if (found.depth[i] > 0) ++touching[found.point[i]];
  for (std::size_t i = 0; i < kPoints; ++i)
    if (touching[i] > 1 || (std::fabs(d[i]) > 1e-3 * kVoxel && touching[i] != (d[i] < 0)))
      return false;
  return true;
}

void flush_caches() {
  static std::vector<char> memory(64 << 20);
  for (std::size_t i = 0; i < memory.size(); i += 64) ++memory[i];
  benchmark::DoNotOptimize(memory.data());
}

void frame(benchmark::State& state, bool socket, h6Method method, std::size_t wanted,
           unsigned threads, bool cold, bool fast) {
  h6Model* model = model_of(socket);
  if (!model) return state.SkipWithError("no model");
  h6BodyDef bodies[2] = {h6DefaultBodyDef(), h6DefaultBodyDef()};
  bodies[0].fixed = true, bodies[0].field = 0;
  bodies[1].fixed = false, bodies[1].shell = 0;
  h6HandDef hand = h6DefaultHandDef();
  hand.body = 1;
  h6SessionDef def = h6DefaultSessionDef();
  def.bodies = bodies, def.body_count = 2;
  def.hands = &hand, def.hand_count = 1;
  def.contact.method = method;
  def.threads = threads;
  h6Error error{};
  std::unique_ptr<h6Session, SessionDeleter> session(h6CreateSession(model, &def, &error));
  if (!session) return state.SkipWithError(error.message);

  const double push = push_for(model, wanted, socket ? 8 : 60);
  h6DeviceSample sample{};
  sample.pose.q.w = 1;
  const auto step = [&](double t) {
    const h6Vec3 p = along(t);
    h6BodyState body{};
    body.pose.p = p, body.pose.q.w = 1;
    sample.pose = body.pose;
    h6SetBody(session.get(), 1, &body);
    h6Step(session.get(), &sample, nullptr);
    return p;
  };
  // The part moves to and fro about the pose, by 0.01 voxel per frame.
  const auto slow = [&](int i) { return push + 0.01 * (std::abs(i % 4 - 2) - 1); };
  for (int i = 0; i < 45; ++i) {
    if (fast) step(1500);
    if (!contacts_are_right(session.get(), model, step(fast ? push : slow(i))))
      return state.SkipWithError("contacts differ from brute force");
  }
  std::map<int, std::vector<double>> times;
  double contacts = 0, helped = 0;
  int i = 0;
  const OneCore here;
  // The helper has to wake up and move to the other core.
  const auto begun = std::chrono::steady_clock::now();
  for (int warm = 0; std::chrono::steady_clock::now() - begun < std::chrono::milliseconds(150);)
    step(fast ? push : slow(warm++));
  for (auto _ : state) {
    if (fast) step(1500);
    if (cold) flush_caches();
    step(fast ? push : slow(i++));
    const h6FrameReport report = h6GetFrame(session.get());
    state.SetIterationTime(1e-6 * report.frame_us);
    contacts += report.contacts;
    helped += report.helper_slices > 0;
    times[-1].push_back(report.frame_us);
    for (int k = 0; k < H6_STAGE_COUNT; ++k) times[k].push_back(report.stage_us[k]);
  }
  const auto median = [&](int k, double p) {
    std::vector<double>& t = times[k];
    std::sort(t.begin(), t.end());
    return t[static_cast<std::size_t>(p * static_cast<double>(t.size() - 1))];
  };
  state.counters["contacts"] = contacts / static_cast<double>(times[-1].size());
  if (threads > 1) state.counters["helped"] = helped / static_cast<double>(times[-1].size());
  state.counters["p50_us"] = median(-1, 0.5);
  state.counters["p99_us"] = median(-1, 0.99);
  for (int k = 0; k < H6_STAGE_COUNT; ++k)
    state.counters[std::string(h6StageName(static_cast<h6Stage>(k))) + "_us"] = median(k, 0.5);
}

double resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  double all = 0, resident = 0;
  statm >> all >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

// Measures the memory of a field; bricks take as much whatever they hold.
void memory(benchmark::State& state) {
  const auto bricks = static_cast<std::size_t>(state.range(0));
  for (auto _ : state) {
    FieldArrays field;
    field.samples.assign(512 * bricks, static_cast<float>(kVoxel));
    field.index.assign(std::size_t(kBricks) * kBricks * kBricks, -1);
    for (std::size_t i = 0; i < bricks; ++i) field.index[7 * i] = static_cast<std::int32_t>(i);
    field.far.assign(std::size_t(kBricks + 1) * (kBricks + 1) * (kBricks + 1),
                     static_cast<float>(20 * kVoxel));
    h6FieldDef& def = field.def;
    def.voxel_size = kVoxel, def.band = kBand * kVoxel;
    for (int& count : def.bricks) count = kBricks;
    def.brick_index = field.index.data(), def.samples = field.samples.data();
    def.brick_count = bricks, def.far_grid = field.far.data();
    h6ModelDef model_def = h6DefaultModelDef();
    model_def.fields = &def, model_def.field_count = 1;
    const double before = resident_bytes();
    const auto start = std::chrono::steady_clock::now();
    std::unique_ptr<h6Model, ModelDeleter> model(h6CreateModel(&model_def, nullptr));
    state.SetIterationTime(
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    if (!model) return state.SkipWithError("no model");
    state.counters["resident_mb"] = 1e-6 * (resident_bytes() - before);
  }
}
BENCHMARK(memory)
    ->Name("field/memory/voxels:1024/bricks")
    ->Arg(270000)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond)
    ->Iterations(1);

[[maybe_unused]] const bool registered = [] {
  for (const bool socket : {false, true})
    for (const h6Method method :
         {H6_METHOD_GAUSS6, H6_METHOD_ROBUST, H6_METHOD_SERIES, H6_METHOD_FIRM})
      for (const std::size_t contacts : {50, 120, 430, 1000, 10000})
        for (const unsigned threads : {1u, 2u})
          for (const bool cold : {false, true})
            for (const bool fast : {false, true}) {
              if (!socket && contacts > 1000) continue;  // clutter: most of the surface is free
              const std::string name =
                  std::string("frame/") + (socket ? "conforming/" : "clutter/") +
                  h6MethodName(method) + "/contacts:" + std::to_string(contacts) +
                  "/threads:" + std::to_string(threads) + (cold ? "/cold" : "/warm") +
                  (fast ? "/fast" : "/slow");
              benchmark::RegisterBenchmark(name.c_str(), frame, socket, method, contacts, threads,
                                           cold, fast)
                  ->UseManualTime()
                  ->Unit(benchmark::kMicrosecond)
                  ->Iterations(cold              ? 100
                               : contacts > 1000 ? 300
                                                 : 1000);
            }
  return true;
}();

}  // namespace
