// SPDX-License-Identifier: Apache-2.0
// scene_frame_bench.cpp - times whole frames on seeded scenes of 1024^3 voxels and 56,823 points:
//     frame/clutter|conforming/METHOD/contacts:N/threads:T/warm|cold/MOTION
//
// Clutter: most of the part's surface is free. Conforming: a socket with 0.25 voxel of clearance.
// The part moves in until it has about the wanted contacts, and then by MOTION:
//     rest       not at all
//     tremble    0.01 voxel a frame, to and fro, as a hand that holds something
//     slide:S    S voxels a frame, to and fro, across the direction in which it moved in
//     dwell:S    at the places of slide:S, at each of them trembling: as many contacts, slowly
//     turn       about its centre, its farthest point by 0.5 voxel a frame, to and fro
//     path       along a closed curve of 300 poses, by about 0.3 voxel a frame
//     random     the same poses in random order
//     anew       it was far outside the field in the frame before, so nothing can be reused
// Before a time is reported, the contacts of the timed poses are compared with a test of all
// points. The stepping thread is pinned to one core, like a haptic thread; the helper has the
// other. lines_kb: the cache lines of the field, each once, that hold the samples about the points
// in bricks at the last pose. A frame that looks at all of these points must read them.
//     memory/read/bytes:N
// reads a block of memory again and again: the bandwidth to compare lines_kb with.
//     field/memory/voxels:1024/bricks:N
// The time is that of h6CreateModel; resident_mb is the memory that it adds to this process.
#include <benchmark/benchmark.h>

#include <pthread.h>
#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <map>
#include <memory>
#include <numeric>
#include <string>

#include "hapsix/vector.h"
#include "runtime/model/model.h"
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

// ---- poses

// Directions in and across, of length 1 to three digits.
constexpr h6Vec3 kIn{0.7, 0.6, -0.387}, kAcross{0.651, -0.759, 0};

// The part at its start, moved by so many voxels in and across, and turned by a vector [rad].
h6Pose moved(double in, double across, const h6Vec3& turn = {}) {
  using namespace h6;
  return {kVoxel * (in * kIn + across * kAcross), h6::turn_by(turn)};
}

h6Pose beside(h6Pose pose, double in) {
  using namespace h6;
  pose.p = pose.p + kVoxel * in * kIn;
  return pose;
}

enum class Motion { rest, tremble, slide, dwell, turn, path, random, anew };
struct Moving {
  Motion motion;
  double step = 0;  // of `slide` and `dwell` [voxel]
};
std::string name_of(const Moving& m) {
  static const char* const names[] = {"rest", "tremble", "slide",  "dwell",
                                      "turn", "path",    "random", "anew"};
  const std::string name = names[static_cast<int>(m.motion)];
  if (m.step == 0) return name;
  char step[32];
  std::snprintf(step, sizeof step, ":%g", m.step);
  return name + step;
}

constexpr std::size_t kPoses = 300;  // of `path`

// A triangle wave of step 1: 0, 1, .. n, .. -n, .. 0 and so on.
double to_and_fro(std::size_t i, std::size_t n) {
  const auto at = static_cast<double>((i + n) % (4 * n)), half = static_cast<double>(2 * n);
  return (at <= half ? at : 2 * half - at) - static_cast<double>(n);
}

std::vector<h6Pose> poses_of(const Moving& moving, bool socket, double push) {
  std::vector<h6Pose> poses;
  switch (moving.motion) {
    case Motion::rest:
    case Motion::anew:
      return {moved(push, 0)};
    case Motion::tremble:
      for (std::size_t i = 0; i < 4; ++i) poses.push_back(moved(push + 0.01 * to_and_fro(i, 1), 0));
      return poses;
    case Motion::slide:
    case Motion::dwell: {
      // In the socket the walls are near: a quarter of a voxel, or a step, to each side.
      const double way = std::max((socket ? 1 : 2) * moving.step, 0.25);
      const auto n = static_cast<std::size_t>(std::lround(way / moving.step));
      for (std::size_t i = 0; i < 4 * n; ++i)
        poses.push_back(moved(push, moving.step * to_and_fro(i, n)));
      return poses;
    }
    case Motion::turn: {
      constexpr double kFarthest = 205;  // voxels
      const std::size_t n = socket ? 1 : 4;
      for (std::size_t i = 0; i < 4 * n; ++i)
        poses.push_back(moved(push, 0, {0, 0, 0.5 / kFarthest * to_and_fro(i, n)}));
      return poses;
    }
    case Motion::path:
    case Motion::random:
      for (std::size_t i = 0; i < kPoses; ++i) {
        const double t = 2 * M_PI * static_cast<double>(i) / kPoses;
        poses.push_back(moved(push + std::sin(3 * t), 6 * std::sin(t),
                              {0, 0.01 * std::sin(t), 0.02 * std::sin(2 * t)}));
      }
      break;
  }
  if (moving.motion == Motion::random) {
    Random random(5);
    for (std::size_t i = kPoses; i > 1; --i) {
      const auto k = static_cast<std::size_t>(random.uniform(0, static_cast<double>(i)));
      std::swap(poses[i - 1], poses[std::min(k, i - 1)]);
    }
  }
  return poses;
}

// ---- what a frame must find

std::vector<double> world_points(const h6Pose& pose) {
  std::vector<double> points;
  for (const Point& p : part_points().at) {
    const auto at = [&](int k) { return double{static_cast<float>(kVoxel * p[k])}; };
    const h6Vec3 q = h6::place(pose, {at(0), at(1), at(2)});
    points.insert(points.end(), {q.x, q.y, q.z});
  }
  return points;
}

std::vector<double> depths(const h6Model* model, const h6Pose& pose) {
  std::vector<double> d(kPoints);
  h6SampleField(model, 0, world_points(pose).data(), kPoints, d.data(), nullptr, nullptr);
  return d;
}

// Finds how far the part must move in until `wanted` points touch [voxel].
double push_for(const h6Model* model, std::size_t wanted, double most) {
  double low = 0, high = most;
  for (int i = 0; i < 24; ++i) {
    const double middle = 0.5 * (low + high);
    const auto d = depths(model, moved(middle, 0));
    const auto touching = std::count_if(d.begin(), d.end(), [](double v) { return v < 0; });
    (static_cast<std::size_t>(touching) < wanted ? low : high) = middle;
  }
  return high;
}

// Points within a thousandth of a voxel of the surface may differ, because this samples them by
// another code path.
bool contacts_are_right(const h6Session* session, const h6Model* model, const h6Pose& pose) {
  const auto d = depths(model, pose);
  const h6Contacts found = h6GetContacts(session, 1);
  std::vector<int> touching(kPoints);
  for (std::size_t i = 0; i < found.count; ++i)
    if (found.depth[i] > 0) ++touching[found.point[i]];
  for (std::size_t i = 0; i < kPoints; ++i)
    if (touching[i] > 1 || (std::fabs(d[i]) > 1e-3 * kVoxel && touching[i] != (d[i] < 0)))
      return false;
  return true;
}

double lines_kb(const h6Model* model, const h6Pose& pose) {
  const h6::Field& field = model->fields[0];
  const h6::kernels::FieldView& view = field.view;
  const std::vector<double> points = world_points(pose);
  std::vector<std::uintptr_t> lines;
  for (std::size_t i = 0; i < kPoints; ++i) {
    int cell[3];
    bool inside = true;
    for (int k = 0; k < 3; ++k) {
      cell[k] = static_cast<int>(std::floor((points[3 * i + k] - field.origin[k]) / field.voxel));
      inside = inside && cell[k] >= 0 && cell[k] < 8 * view.size[k] - 1;
    }
    if (!inside) continue;
    const int brick = (cell[2] / 8 * view.size[1] + cell[1] / 8) * view.size[0] + cell[0] / 8;
    lines.push_back(reinterpret_cast<std::uintptr_t>(view.table + brick) / 64);
    if (view.table[brick] < 0) continue;
    const std::int16_t* const nodes = view.bricks + std::size_t{h6::kernels::kBrickStride} *
                                                        h6::kernels::row_of(view.table[brick]);
    for (int corner = 0; corner < 8; ++corner) {
      const int x = cell[0] % 8 + (corner & 1), y = cell[1] % 8 + (corner >> 1 & 1),
                z = cell[2] % 8 + (corner >> 2);
      lines.push_back(reinterpret_cast<std::uintptr_t>(nodes + (z * 9 + y) * 9 + x) / 64);
    }
  }
  std::sort(lines.begin(), lines.end());
  lines.erase(std::unique(lines.begin(), lines.end()), lines.end());
  return 64e-3 * static_cast<double>(lines.size());
}

void flush_caches() {
  static std::vector<char> memory(64 << 20);
  for (std::size_t i = 0; i < memory.size(); i += 64) ++memory[i];
  benchmark::DoNotOptimize(memory.data());
}

// ---- frames

using Session = std::unique_ptr<h6Session, SessionDeleter>;

Session make_session(const h6Model* model, h6Method method, unsigned threads, h6Error* error) {
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
  def.max_contacts = kPoints;
  return Session(h6CreateSession(model, &def, error));
}

void step(h6Session* session, const h6Pose& pose) {
  h6BodyState body{};
  body.pose = pose;
  h6DeviceSample sample{};
  sample.pose = pose;
  h6SetBody(session, 1, &body);
  h6Step(session, &sample, nullptr);
}

struct Times {
  std::map<int, std::vector<double>> stage;  // -1: the frame
  double contacts = 0, helped = 0;

  void add(const h6FrameReport& report) {
    contacts += report.contacts;
    helped += report.helper_slices > 0;
    stage[-1].push_back(report.frame_us);
    for (int k = 0; k < H6_STAGE_COUNT; ++k) stage[k].push_back(report.stage_us[k]);
  }
  double at(int k, double p) {
    std::vector<double>& t = stage[k];
    std::sort(t.begin(), t.end());
    return t[static_cast<std::size_t>(p * static_cast<double>(t.size() - 1))];
  }
  void report(benchmark::State& state, unsigned threads) {
    const auto frames = static_cast<double>(stage[-1].size());
    state.counters["contacts"] = contacts / frames;
    if (threads > 1) state.counters["helped"] = helped / frames;
    state.counters["p50_us"] = at(-1, 0.5);
    state.counters["p99_us"] = at(-1, 0.99);
    for (int k = 0; k < H6_STAGE_COUNT; ++k)
      state.counters[std::string(h6StageName(static_cast<h6Stage>(k))) + "_us"] = at(k, 0.5);
  }
};

void frame(benchmark::State& state, bool socket, h6Method method, std::size_t wanted,
           unsigned threads, bool cold, const Moving& moving) {
  h6Model* model = model_of(socket);
  if (!model) return state.SkipWithError("no model");
  h6Error error{};
  const Session session = make_session(model, method, threads, &error);
  if (!session) return state.SkipWithError(error.message);
  const std::vector<h6Pose> poses =
      poses_of(moving, socket, push_for(model, wanted, socket ? 8 : 60));
  const bool anew = moving.motion == Motion::anew;
  const h6Pose outside = moved(1500, 0);
  std::size_t i = 0;
  const auto next = [&]() -> const h6Pose& {
    if (anew) step(session.get(), outside);
    const h6Pose& pose = poses[i++ % poses.size()];
    // It trembles until the engine knows the place. The frame back to the pose is timed.
    for (int k = 0; moving.motion == Motion::dwell && k < 9; ++k)
      step(session.get(), beside(pose, k % 2 == 0 ? 0.01 : 0));
    return pose;
  };
  for (int checked = 0; checked < 45; ++checked) {
    const h6Pose& pose = next();
    step(session.get(), pose);
    if (!contacts_are_right(session.get(), model, pose))
      return state.SkipWithError("contacts differ from brute force");
  }
  Times times;
  const OneCore here;
  // The helper has to wake up and move to the other core.
  const auto begun = std::chrono::steady_clock::now();
  while (std::chrono::steady_clock::now() - begun < std::chrono::milliseconds(150))
    step(session.get(), next());
  for (auto _ : state) {
    const h6Pose& pose = next();
    if (cold) flush_caches();
    step(session.get(), pose);
    const h6FrameReport report = h6GetFrame(session.get());
    state.SetIterationTime(1e-6 * report.frame_us);
    times.add(report);
  }
  times.report(state, threads);
  state.counters["lines_kb"] = lines_kb(model, poses[0]);
}

void read_memory(benchmark::State& state) {
  const std::vector<std::uint64_t> block(static_cast<std::size_t>(state.range(0)) / 8, 1);
  for (auto _ : state) {
    std::uint64_t sum[8] = {};
    for (std::size_t i = 0; i + 8 <= block.size(); i += 8)
      for (std::size_t k = 0; k < 8; ++k) sum[k] += block[i + k];
    benchmark::DoNotOptimize(std::accumulate(sum, sum + 8, std::uint64_t{0}));
  }
  state.SetBytesProcessed(state.iterations() * state.range(0));
}
BENCHMARK(read_memory)->Name("memory/read/bytes")->Arg(1 << 19)->Arg(1 << 23)->Arg(1 << 28);

// ---- memory of a field

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

// ---- names

void add(bool socket, h6Method method, std::size_t contacts, unsigned threads, bool cold,
         const Moving& moving) {
  const std::string name = std::string("frame/") + (socket ? "conforming/" : "clutter/") +
                           h6MethodName(method) + "/contacts:" + std::to_string(contacts) +
                           "/threads:" + std::to_string(threads) + (cold ? "/cold/" : "/warm/") +
                           name_of(moving);
  benchmark::RegisterBenchmark(name.c_str(), frame, socket, method, contacts, threads, cold, moving)
      ->UseManualTime()
      ->Unit(benchmark::kMicrosecond)
      ->Iterations(cold              ? 100
                   : contacts > 1000 ? 300
                                     : 1000);
}

[[maybe_unused]] const bool registered = [] {
  const Moving all[] = {{Motion::rest},       {Motion::tremble},  {Motion::slide, 0.05},
                        {Motion::slide, 0.5}, {Motion::slide, 2}, {Motion::dwell, 2},
                        {Motion::turn},       {Motion::path},     {Motion::random},
                        {Motion::anew}};
  for (const bool socket : {false, true})
    for (const h6Method method :
         {H6_METHOD_GAUSS6, H6_METHOD_ROBUST, H6_METHOD_SERIES, H6_METHOD_FIRM})
      for (const std::size_t contacts : {50, 120, 430, 1000, 10000, 30000})
        for (const unsigned threads : {1u, 2u})
          for (const bool cold : {false, true})
            for (const Moving& moving : all) {
              if (!socket && contacts > 1000) continue;  // clutter: most of the surface is free
              const bool along = moving.motion == Motion::path || moving.motion == Motion::random;
              if (socket && along) continue;  // the curve leaves the socket
              if (cold && (along || moving.motion == Motion::rest)) continue;
              add(socket, method, contacts, threads, cold, moving);
            }
  return true;
}();

}  // namespace
