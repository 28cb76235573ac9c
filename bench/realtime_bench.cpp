// SPDX-License-Identifier: Apache-2.0
// realtime_bench.cpp - compares the haptic thread with a plain sleeping thread, idle and under
// load:
//     realtime/alpha|socket/RATEHz/idle|loaded/threads:T/spin:US
//     realtime/arithmetic/RATEHz/idle|loaded
//
// Alpha: the hand follows its path there and back, 60 s at 1 kHz or 20 s at 4 kHz. Then the same
// frames run for a sixth of that time on a std::thread that sleeps until the next tick.
// HAPSIX_BENCH_SECONDS=3 sets the time to 3 s. Socket: 10,000 contacts on a part that follows the
// hand exactly, with a budget of 0.8 periods (anytime mode). Load: one thread saturates TBB and one
// streams memory, on both cores. Before times are reported, all frames are stepped again on one
// thread and must have the same hashes. HAPSIX_BENCH_LATE=1 prints each late frame stage by stage,
// with its page faults and the core's speed before and after it.
//
// late_compute counts frames whose CPU time exceeded the period. On a virtual machine the CPU clock
// also counts interrupts and time that the host stole without reporting it. So those frames are
// timed again when all are stepped again: late_compute_again counts the frames that exceed the
// period then too, and again_max_us is the longest. unstolen_wakeup covers the wake-ups of frames
// without a sign of stolen time: wall and CPU time agree and no stolen ticks were counted.
//
// Arithmetic: a sum in registers on the same thread, which takes a coarse frame's time and uses no
// memory. Its own work is never late, so its late_compute shows the time that the machine took and
// counted as CPU time; the other rows include as much.
#include <benchmark/benchmark.h>
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include "bench/realtime_scenes.h"
#include "sched/clock.h"
#include "sched/parallel_for.h"
#include "sched/periodic_thread.h"

namespace {

using namespace h6;
using namespace h6::bench;
using Clock = std::chrono::steady_clock;

double seconds_at(double rate) {
  const char* asked = std::getenv("HAPSIX_BENCH_SECONDS");
  const double seconds = asked ? std::atof(asked) : 0;
  return seconds > 0 ? seconds : rate > 1000 ? 20 : 60;
}

// ---- Load on both cores while an object lives.

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
    threads_.emplace_back([this] {  // flushes the caches again and again
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

// ---- Measurement.

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

bool asked_for_late() {
  static const bool asked = std::getenv("HAPSIX_BENCH_LATE") != nullptr;
  return asked;
}

// The ticks of 10 ms that the host has stolen from all cores together, if the machine reports them.
long stolen_ticks() {
  long cpu[8] = {};
  if (std::FILE* file = std::fopen("/proc/stat", "r")) {
    const int got = std::fscanf(file, "cpu %ld %ld %ld %ld %ld %ld %ld %ld", &cpu[0], &cpu[1],
                                &cpu[2], &cpu[3], &cpu[4], &cpu[5], &cpu[6], &cpu[7]);
    if (got != 8) cpu[7] = 0;
    std::fclose(file);
  }
  return cpu[7];
}

// A hand that notes possible causes of long frames at the beginning of each frame: page faults
// since the previous frame, and the core's speed in registers.
struct NotingHand {
  struct Note {
    long faults = 0;
    double speed_us = 0;
  };
  h6Device inner{};
  double rate = 0;
  std::vector<Note> notes;  // room for all frames

  h6Device device() {
    h6Device device = inner;
    device.self = this;
    device.read = [](void* self, double time, h6DeviceSample* out) {
      auto& hand = *static_cast<NotingHand*>(self);
      const auto frame = static_cast<std::size_t>(time * hand.rate + 0.5);
      if (frame < hand.notes.size()) hand.notes[frame] = take();
      return hand.inner.read(hand.inner.self, time, out);
    };
    device.write = [](void*, double, const h6DeviceCommand*) { return 0; };
    return device;
  }
  static Note take() {
    rusage usage{};
    getrusage(RUSAGE_THREAD, &usage);
    const std::int64_t start = sched::now_ns();
    std::uint32_t x = 1;
    for (int i = 0; i < 500; ++i) {
      x = x * 1664525u + 1013904223u;
      benchmark::DoNotOptimize(x);
    }
    return {usage.ru_minflt + usage.ru_majflt, 1e-3 * static_cast<double>(sched::now_ns() - start)};
  }
};

// The data of a frame that is needed to step it again.
struct Stepped {
  h6DeviceSample hand;
  std::uint64_t hash;
  std::uint32_t pairs, points;
  bool own;  // the frame counted as late by its own work
  double again_us = 0;
};

// Steps all frames again on one thread in virtual time and compares their bits. Frames that were
// late by their CPU time are timed again by the same clock, with cold caches. The time that they
// take now is their own work; the machine took the rest.
bool same_again(Scene& scene, double rate, std::vector<Stepped>& frames) {
  const Session session = scene.session(rate, 1, false);
  for (Stepped& frame : frames) {
    const std::int64_t before = sched::thread_cpu_ns();
    h6SetCoarse(session.get(), frame.pairs, frame.points);
    h6Step(session.get(), &frame.hand, nullptr);
    frame.again_us = 1e-3 * static_cast<double>(sched::thread_cpu_ns() - before);
    if (h6GetFrame(session.get()).state_hash != frame.hash) return false;
  }
  return !frames.empty();
}

void print_late(const h6FrameRecord& row, const NotingHand& hand, double again_us) {
  const h6FrameReport& r = row.report;
  const char* why = row.late & H6_LATE_COMPUTE  ? "own"
                    : row.late & H6_LATE_STOLEN ? "stolen"
                                                : "wake-up";
  std::fprintf(stderr,
               "frame %llu late by %.0f us (%s): wake-up %.0f wall %.0f cpu %.0f us, %u contacts "
               "of %u in 16 points;",
               static_cast<unsigned long long>(r.frame), row.late_us, why, row.wakeup_us,
               r.frame_us, row.cpu_us, r.contacts, r.coarse_pairs ? r.coarse_points : 16u);
  for (int i = 0; i < H6_STAGE_COUNT; ++i)
    std::fprintf(stderr, " %s %.0f", h6StageName(static_cast<h6Stage>(i)), r.stage_us[i]);
  std::fprintf(stderr, "; helper %.0f us in %u slices;", r.helper_us, r.helper_slices);
  const std::size_t n = r.frame;
  if (n + 1 < hand.notes.size())
    std::fprintf(stderr, " %ld page faults, arithmetic %.2f and %.2f us;",
                 hand.notes[n + 1].faults - hand.notes[n].faults, hand.notes[n].speed_us,
                 hand.notes[n + 1].speed_us);
  std::fprintf(stderr, " again %.0f us\n", again_us);
}

// The naive loop: a thread that sleeps until the next tick.
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
    const auto last = next + std::chrono::nanoseconds(static_cast<long>(1e9 * seconds));
    for (int i = 0; next < last; ++i, next += period) {
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

void tell_again(benchmark::State& state, const std::vector<Stepped>& stepped, double period_us) {
  double again_us = 0, late_again = 0;
  for (const Stepped& frame : stepped)
    if (frame.own) {
      again_us = std::max(again_us, frame.again_us);
      late_again += frame.again_us > period_us;
    }
  state.counters["late_compute_again"] = late_again;
  state.counters["again_max_us"] = again_us;
}

void tell(benchmark::State& state, const h6LoopReport& result) {
  state.counters["frames"] = static_cast<double>(result.frames);
  state.counters["late_compute"] = static_cast<double>(result.late_compute);
  state.counters["late_stolen"] = static_cast<double>(result.late_stolen);
  state.counters["late_wakeup"] = static_cast<double>(result.late_wakeup);
  state.counters["coarse"] = static_cast<double>(result.coarse_frames);
  state.counters["records_lost"] = static_cast<double>(result.ring_overruns);
  state.SetLabel(result.grant.fifo ? "FIFO" : "no FIFO");
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
    NotingHand noting{scene.hand(), rate, {}};
    if (asked_for_late()) noting.notes.resize(static_cast<std::size_t>(seconds * rate) + 1);
    const h6Device device = asked_for_late() ? noting.device() : noting.inner;
    h6Error error{};
    const Loop loop(h6StartLoop(session.get(), &device, &def, &error));
    if (!loop) return state.SkipWithError(error.message);
    Times times;
    double contacts = 0, missed = 0;
    std::vector<h6FrameRecord> rows(256), late;
    std::vector<Stepped> stepped;
    std::vector<bool> robbed;  // (frames) whether time was stolen in or around the frame
    std::uint64_t few = 0;
    long ticks = stolen_ticks();
    bool had_stolen = false;
    for (bool more = true; more;) {
      more = h6LoopRunning(loop.get());
      const long now = stolen_ticks();
      const bool stolen = now != ticks;
      ticks = now;
      while (const std::size_t n = h6ReadRecords(loop.get(), rows.data(), rows.size()))
        for (std::size_t i = 0; i < n; ++i) {
          const h6FrameRecord& row = rows[i];
          const h6FrameReport& r = row.report;
          times.add(row.wakeup_us, r.frame_us);
          robbed.push_back(stolen || had_stolen || r.frame_us > row.cpu_us + 2);
          if (row.late != 0 && asked_for_late()) late.push_back(row);
          contacts += r.contacts;
          few += r.coarse_pairs > 0 && r.coarse_points == 0;
          missed = std::max(missed, r.missed_depth_voxels);
          stepped.push_back({row.hand[0], r.state_hash, r.coarse_pairs, r.coarse_points,
                             (row.late & H6_LATE_COMPUTE) != 0});
        }
      had_stolen = stolen;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    h6LoopReport result;
  h6JoinLoop(loop.get(), &result);
    Times plain;
    const std::uint64_t plain_late = plain_thread(scene, rate, seconds / 6, plain);
    contacts /= static_cast<double>(times.total.size());
    if (result.ring_overruns == 0 && !same_again(scene, rate, stepped))
      return state.SkipWithError("bits differ the second time");
    for (const h6FrameRecord& row : late)
      print_late(row, noting, stepped[std::min(row.report.frame, stepped.size() - 1)].again_us);
    // In the first seconds the alpha's hand is still free.
    if (seconds >= 10 && contacts < scene.least_contacts())
      return state.SkipWithError("too few contacts");
    std::vector<double> kept;
    for (std::size_t i = 0; i < robbed.size(); ++i)
      if (!robbed[i]) kept.push_back(times.wakeup[i]);
    state.counters["unstolen_frames"] = static_cast<double>(kept.size());
    report(state, "unstolen_wakeup", kept);
    tell_again(state, stepped, 1e6 / rate);
    state.counters["few"] = static_cast<double>(few);
    state.counters["missed_voxels"] = missed;
    times.tell(state, "");
    plain.tell(state, "plain_");
    state.counters["contacts"] = contacts;
    tell(state, result);
    state.counters["plain_frames"] = static_cast<double>(plain.total.size());
    state.counters["plain_late"] = static_cast<double>(plain_late);
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
            // Without spinning, other scenes and threads wake in the same way.
            if (spin == 0 && (scene != "alpha" || threads > 1)) continue;
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
