// realtime_bench.cpp - the haptic thread beside a plain sleeping thread, idle and under load:
//     realtime/alpha|socket/RATEHz/idle|loaded/threads:T/spin:US
//     realtime/arithmetic/RATEHz/idle|loaded
//
// The alpha's hand goes its way there and back. 60 s at 1 kHz, 20 s at 4 kHz; then the same frames
// for a sixth of that on a std::thread that sleeps until the next tick. HAPSIX_BENCH_SECONDS=3 in
// the environment: 3 s. Socket: 10,000 contacts on a part that follows the hand exactly, with a
// budget of 0.8 periods (anytime mode). Load, on both cores: a host that saturates TBB and a
// streamer of memory. Before times are reported the first frames are stepped again on one thread
// and must have the same hashes. HAPSIX_BENCH_LATE=1: each late frame is printed, stage by stage.
//
// Arithmetic: on the same thread a sum in registers that takes a coarse frame's time and touches no
// memory. It cannot be late by its own work, so what it counts as that is what the machine took
// from it and put on its CPU time; the rows above have that too.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "io/load_scene.h"
#include "io/scenes/scenes.h"
#include "sched/clock.h"
#include "sched/parallel_for.h"
#include "sched/periodic_thread.h"
#include "tests/support/frame_scenes.h"

namespace {

using namespace h6;
using Clock = std::chrono::steady_clock;

struct SessionDeleter {
  void operator()(h6Session* s) const { h6DestroySession(s); }
};
struct LoopDeleter {
  void operator()(h6Loop* l) const { h6DestroyLoop(l); }
};
using Session = std::unique_ptr<h6Session, SessionDeleter>;
using Loop = std::unique_ptr<h6Loop, LoopDeleter>;

double seconds_at(double rate) {
  const char* asked = std::getenv("HAPSIX_BENCH_SECONDS");
  const double seconds = asked ? std::atof(asked) : 0;
  return seconds > 0 ? seconds : rate > 1000 ? 20 : 60;
}

// ---- what is run: sessions of one scene, and a hand for it

class Scene {
 public:
  virtual ~Scene() = default;
  virtual Session session(double rate, unsigned threads, bool budget) = 0;
  virtual h6Device hand() = 0;
  virtual double least_contacts() const = 0;
};

class Alpha : public Scene {
 public:
  Alpha() : loaded_(io::load_scene(*io::make_scene("alpha-shortcut"))) {}
  Session session(double rate, unsigned threads, bool) override {
    h6SessionDef def = (*loaded_)->session_def();
    def.rate = rate, def.threads = threads;
    return Session(h6CreateSession((*loaded_)->model.get(), &def, nullptr));
  }
  h6Device hand() override {
    h6Device device{};
    device.self = this;
    device.read = [](void* self, double t, h6DeviceSample* out) {
      const io::LoadedScene& scene = **static_cast<Alpha*>(self)->loaded_;
      const io::Path& path = scene.scene.hands[0].path;
      const double whole = path.back().t, at = std::fmod(t, 2 * whole);
      *out = {};
      out->pose = io::sample_path(path, at < whole ? at : 2 * whole - at);
      return 0;
    };
    device.write = [](void*, double, const h6DeviceCommand*) { return 0; };
    return device;
  }
  double least_contacts() const override { return 10; }

 private:
  Result<std::unique_ptr<io::LoadedScene>> loaded_;
};

// A part in a socket that fits it, pushed in until 10,000 of its points touch, trembling by 0.02
// voxel.
class Socket : public Scene {
 public:
  Socket() : model_(bench::make_model(true)) {
    const Session probe = session(1000, 1, false);
    double low = 0, high = 8;
    for (int i = 0; i < 20; ++i) {
      push_ = 0.5 * (low + high);
      const h6DeviceSample sample = at(push_);
      h6Step(probe.get(), &sample, nullptr);
      (h6GetFrame(probe.get()).contacts < 10000 ? low : high) = push_;
    }
  }
  ~Socket() override { h6DestroyModel(model_); }
  Session session(double rate, unsigned threads, bool budget) override {
    h6BodyDef bodies[2] = {h6DefaultBodyDef(), h6DefaultBodyDef()};
    bodies[0].fixed = true, bodies[0].field = 0;
    bodies[1].shell = 0;
    h6HandDef hand = h6DefaultHandDef();
    hand.body = 1;
    hand.coupling.mode = H6_COUPLING_DIRECT;
    h6SessionDef def = h6DefaultSessionDef();
    def.bodies = bodies, def.body_count = 2;
    def.hands = &hand, def.hand_count = 1;
    def.rate = rate, def.threads = threads;
    def.frame_budget_us = budget ? 0.8e6 / rate : 0;
    return Session(h6CreateSession(model_, &def, nullptr));
  }
  h6Device hand() override {
    h6Device device{};
    device.self = this;
    device.read = [](void* self, double t, h6DeviceSample* out) {
      const Socket& s = *static_cast<Socket*>(self);
      return *out = s.at(s.push_ + 0.01 * std::sin(30 * t)), 0;
    };
    device.write = [](void*, double, const h6DeviceCommand*) { return 0; };
    return device;
  }
  double least_contacts() const override { return 500; }

 private:
  h6DeviceSample at(double push) const {
    h6DeviceSample sample{};
    const double v = bench::kVoxel * push;
    sample.pose = {{0.7 * v, 0.6 * v, -0.387 * v}, {1, 0, 0, 0}};
    return sample;
  }
  h6Model* model_;
  double push_ = 0;
};

// One at a time: the socket's field is hundreds of megabytes.
Scene& scene_named(const std::string& name) {
  static std::unique_ptr<Scene> scene;
  static std::string held;
  if (held != name) {
    scene.reset();
    if (name == "alpha")
      scene = std::make_unique<Alpha>();
    else
      scene = std::make_unique<Socket>();
    held = name;
  }
  return *scene;
}

// ---- load on both cores, while in scope

class Load {
 public:
  explicit Load(bool on) {
    if (!on) return;
    threads_.emplace_back([this] {  // a host program whose TBB work never ends
      while (!stop_)
        sched::parallel_for(64, 0, [](std::size_t i) {
          double x = 1.0 + 1e-9 * static_cast<double>(i);
          for (int k = 0; k < 20000; ++k) x = x * 1.0000001 + 1e-9;
          benchmark::DoNotOptimize(x);
        });
    });
    threads_.emplace_back([this] {  // what is in the caches does not stay there
      std::vector<double> memory(32 << 20);
      while (!stop_)
        for (std::size_t i = 0; i < memory.size() && !stop_; i += 8) memory[i] += 1;
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
  }
  ~Load() {
    stop_ = true;
    for (std::thread& thread : threads_) thread.join();
  }

 private:
  std::atomic<bool> stop_{false};
  std::vector<std::thread> threads_;
};

// ---- measuring

void report(benchmark::State& state, const std::string& what, std::vector<double>& us) {
  if (us.empty()) return;
  std::sort(us.begin(), us.end());
  const auto at = [&](double p) {
    return us[std::min(us.size() - 1,
                       static_cast<std::size_t>(p * static_cast<double>(us.size())))];
  };
  state.counters[what + "_p50_us"] = at(0.5);
  state.counters[what + "_p99_us"] = at(0.99);
  state.counters[what + "_p999_us"] = at(0.999);
  state.counters[what + "_max_us"] = us.back();
}

struct Times {
  std::vector<double> wakeup, compute, total;
  void add(double wakeup_us, double compute_us) {
    wakeup.push_back(wakeup_us);
    compute.push_back(compute_us);
    total.push_back(wakeup_us + compute_us);
  }
  void tell(benchmark::State& state, const std::string& who) {
    report(state, who + "wakeup", wakeup);
    report(state, who + "compute", compute);
    report(state, who + "total", total);
  }
};

void print_late(const h6FrameRecord& row) {
  static const bool asked = std::getenv("HAPSIX_BENCH_LATE") != nullptr;
  if (!asked || row.late == 0) return;
  const h6FrameReport& r = row.report;
  const char* why = row.late & H6_LATE_COMPUTE  ? "own"
                    : row.late & H6_LATE_STOLEN ? "stolen"
                                                : "wake-up";
  std::fprintf(stderr,
               "frame %llu late by %.0f us (%s): wake-up %.0f wall %.0f cpu %.0f us, %u contacts "
               "of %u in 16 points;",
               static_cast<unsigned long long>(r.frame), row.late_us, why, row.wakeup_us,
               r.frame_us, row.cpu_us, r.contacts, r.coarse_points ? r.coarse_points : 16u);
  for (int i = 0; i < H6_STAGE_COUNT; ++i)
    std::fprintf(stderr, " %s %.0f", h6StageName(static_cast<h6Stage>(i)), r.stage_us[i]);
  std::fprintf(stderr, "; helper %.0f us in %u slices\n", r.helper_us, r.helper_slices);
}

// The first frames once more, on one thread, in virtual time.
bool same_again(Scene& scene, double rate, const std::vector<h6FrameRecord>& rows) {
  const Session session = scene.session(rate, 1, false);
  for (const h6FrameRecord& row : rows) {
    h6SetCoarse(session.get(), row.report.coarse_pairs, row.report.coarse_points);
    h6Step(session.get(), row.hand, nullptr);
    if (h6GetFrame(session.get()).state_hash != row.report.state_hash) return false;
  }
  return !rows.empty();
}

// What one writes first: a thread that sleeps until the next tick.
std::uint64_t plain_thread(Scene& scene, double rate, double seconds, Times& times) {
  const Session session = scene.session(rate, 1, false);
  const h6Device hand = scene.hand();
  std::uint64_t late = 0;
  std::thread([&] {
    const auto us = [](Clock::duration d) {
      return std::chrono::duration<double, std::micro>(d).count();
    };
    const auto period = std::chrono::nanoseconds(static_cast<long>(1e9 / rate));
    auto next = Clock::now() + period;
    for (int i = 0; i < static_cast<int>(seconds * rate); ++i, next += period) {
      std::this_thread::sleep_until(next);
      const auto start = Clock::now();
      h6DeviceSample sample{};
      hand.read(hand.self, i / rate, &sample);
      h6Step(session.get(), &sample, nullptr);
      const auto end = Clock::now();
      times.add(us(start - next), us(end - start));
      late += end > next + period;
      if (end > next + 2 * period) next = end;
    }
  }).join();
  return late;
}

void realtime(benchmark::State& state, const std::string& name, double rate, bool loaded,
              unsigned threads, double spin_us) {
  Scene& scene = scene_named(name);
  const double seconds = seconds_at(rate);
  for (auto _ : state) {
    const Load load(loaded);
    const Session session = scene.session(rate, threads, true);
    h6LoopDef def = h6DefaultLoopDef();
    def.duration = seconds, def.spin_us = spin_us;
    def.ring_frames = 4096;
    const h6Device device = scene.hand();
    h6Error error{};
    const Loop loop(h6StartLoop(session.get(), &device, &def, &error));
    if (!loop) return state.SkipWithError(error.message);
    Times times;
    double contacts = 0;
    std::vector<h6FrameRecord> rows(256), first;
    for (bool more = true; more;) {
      more = h6LoopRunning(loop.get());
      while (const std::size_t n = h6ReadRecords(loop.get(), rows.data(), rows.size()))
        for (std::size_t i = 0; i < n; ++i) {
          times.add(rows[i].wakeup_us, rows[i].report.frame_us);
          print_late(rows[i]);
          contacts += rows[i].report.contacts;
          if (rows[i].report.frame == first.size() && first.size() < 1000) first.push_back(rows[i]);
        }
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    const h6LoopReport result = h6JoinLoop(loop.get());
    Times plain;
    const std::uint64_t plain_late = plain_thread(scene, rate, seconds / 6, plain);
    contacts /= static_cast<double>(times.total.size());
    if (!same_again(scene, rate, first)) return state.SkipWithError("bits differ the second time");
    // In the first seconds the alpha's hand is still free.
    if (seconds >= 10 && contacts < scene.least_contacts())
      return state.SkipWithError("too few contacts");
    times.tell(state, "");
    plain.tell(state, "plain_");
    state.counters["contacts"] = contacts;
    state.counters["frames"] = static_cast<double>(result.frames);
    state.counters["late_compute"] = static_cast<double>(result.late_compute);
    state.counters["late_stolen"] = static_cast<double>(result.late_stolen);
    state.counters["late_wakeup"] = static_cast<double>(result.late_wakeup);
    state.counters["coarse"] = static_cast<double>(result.coarse_frames);
    state.counters["records_lost"] = static_cast<double>(result.ring_overruns);
    state.counters["plain_frames"] = static_cast<double>(plain.total.size());
    state.counters["plain_late"] = static_cast<double>(plain_late);
    state.SetLabel(result.grant.fifo ? "FIFO" : "no FIFO");
  }
}

void arithmetic(benchmark::State& state, double rate, bool loaded) {
  const double seconds = seconds_at(rate);
  for (auto _ : state) {
    const Load load(loaded);
    Times times;
    std::uint64_t late[4] = {};
    std::uint32_t x = 1;
    double took = 0;
    sched::PeriodicThreadOptions options;
    options.rate = rate, options.spin_us = 100;
    const auto frames = static_cast<std::uint64_t>(seconds * rate);
    times.wakeup.reserve(frames), times.compute.reserve(frames), times.total.reserve(frames);
    sched::PeriodicThread thread(options,
                                 {nullptr,
                                  [&](std::uint64_t frame, const sched::TickTiming&, double) {
                                    const std::int64_t start = sched::now_ns();
                                    for (int i = 0; i < 35000; ++i) {
                                      x = x * 1664525u + 1013904223u;
                                      benchmark::DoNotOptimize(x);
                                    }
                                    took = 1e-3 * static_cast<double>(sched::now_ns() - start);
                                    return frame + 1 < frames;
                                  },
                                  [&](std::uint64_t, const sched::TickTiming& timing) {
                                    times.add(timing.wakeup_us, took);
                                    ++late[static_cast<int>(timing.late)];
                                  }});
    thread.join();
    times.tell(state, "");
    state.counters["frames"] = static_cast<double>(times.total.size());
    state.counters["late_compute"] = static_cast<double>(late[int(sched::Late::compute)]);
    state.counters["late_stolen"] = static_cast<double>(late[int(sched::Late::stolen)]);
    state.counters["late_wakeup"] = static_cast<double>(late[int(sched::Late::wakeup)]);
  }
}

[[maybe_unused]] const bool registered = [] {
  for (const std::string scene : {"alpha", "socket"})
    for (const int rate : {1000, 4000})
      for (const bool loaded : {false, true})
        for (const unsigned threads : {1u, 2u})
          for (const int spin : {100, 0}) {
            if (spin == 0 && (scene != "alpha" || threads > 1)) continue;  // waking is the same
            const std::string name = "realtime/" + scene + "/" + std::to_string(rate) + "Hz/" +
                                     (loaded ? "loaded" : "idle") +
                                     "/threads:" + std::to_string(threads) +
                                     "/spin:" + std::to_string(spin) + "us";
            benchmark::RegisterBenchmark(name.c_str(), realtime, scene, rate, loaded, threads, spin)
                ->Iterations(1)
                ->UseRealTime()
                ->Unit(benchmark::kSecond);
          }
  for (const int rate : {1000, 4000})
    for (const bool loaded : {false, true})
      benchmark::RegisterBenchmark(
          ("realtime/arithmetic/" + std::to_string(rate) + "Hz/" + (loaded ? "loaded" : "idle"))
              .c_str(),
          arithmetic, rate, loaded)
          ->Iterations(1)
          ->UseRealTime()
          ->Unit(benchmark::kSecond);
  return true;
}();

}  // namespace
