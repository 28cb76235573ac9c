// realtime_bench.cpp - the haptic thread against a plain sleeping thread: realtime/alpha/RATE,
// realtime/plain_thread/RATE. Five seconds each; wake-up and compute percentiles, late frames by
// cause.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "device/path_device.h"
#include "io/load_scene.h"
#include "io/scenes/scenes.h"

namespace {

using namespace h6;
using Clock = std::chrono::steady_clock;
constexpr double kSeconds = 5;

void report(benchmark::State& state, const char* what, std::vector<double>& us) {
  if (us.empty()) return;
  std::sort(us.begin(), us.end());
  const auto at = [&](double p) {
    return us[std::min(us.size() - 1,
                       static_cast<std::size_t>(p * static_cast<double>(us.size())))];
  };
  state.counters[std::string(what) + "_p50_us"] = at(0.5);
  state.counters[std::string(what) + "_p99_us"] = at(0.99);
  state.counters[std::string(what) + "_p999_us"] = at(0.999);
  state.counters[std::string(what) + "_max_us"] = us.back();
}

void haptic_thread(benchmark::State& state, double rate, double spin_us) {
  auto scene = io::make_scene("alpha-shortcut");
  auto loaded = io::load_scene(std::move(*scene));
  if (!loaded) return state.SkipWithError(loaded.error().c_str());
  h6SessionDef def = (*loaded)->session_def();
  def.rate = rate;
  device::HandPath path;
  for (const io::PathRow& row : (*loaded)->scene.hands[0].path)
    path.time.push_back(row.t), path.pose.push_back(row.pose);
  auto hand = device::PathDevice::open(path);
  for (auto _ : state) {
    h6Session* session = h6CreateSession((*loaded)->model.get(), &def, nullptr);
    h6LoopDef loop_def = h6DefaultLoopDef();
    loop_def.duration = kSeconds;
    loop_def.spin_us = spin_us;
    loop_def.ring_frames = static_cast<std::size_t>(kSeconds * rate) + 16;
    const h6Device device = (*hand)->device();
    h6Loop* loop = h6StartLoop(session, &device, &loop_def, nullptr);
    if (!loop) return state.SkipWithError("the loop did not start");
    const h6LoopReport result = h6JoinLoop(loop);
    std::vector<h6FrameRecord> rows(loop_def.ring_frames);
    rows.resize(h6ReadRecords(loop, rows.data(), rows.size()));
    std::vector<double> wakeup, compute;
    for (const h6FrameRecord& r : rows)
      wakeup.push_back(r.wakeup_us), compute.push_back(r.report.frame_us);
    report(state, "wakeup", wakeup);
    report(state, "compute", compute);
    state.counters["late_compute"] = static_cast<double>(result.late_compute);
    state.counters["late_stolen"] = static_cast<double>(result.late_stolen);
    state.counters["late_wakeup"] = static_cast<double>(result.late_wakeup);
    h6DestroyLoop(loop);
    h6DestroySession(session);
  }
}

// What one writes first: a thread that sleeps until the next tick.
void plain_thread(benchmark::State& state, double rate) {
  for (auto _ : state) {
    std::vector<double> wakeup;
    wakeup.reserve(static_cast<std::size_t>(kSeconds * rate));
    std::thread([&] {
      const auto period = std::chrono::nanoseconds(static_cast<long>(1e9 / rate));
      auto next = Clock::now() + period;
      for (int i = 0; i < static_cast<int>(kSeconds * rate); ++i, next += period) {
        std::this_thread::sleep_until(next);
        wakeup.push_back(std::chrono::duration<double, std::micro>(Clock::now() - next).count());
      }
    }).join();
    report(state, "wakeup", wakeup);
  }
}

[[maybe_unused]] const bool registered = [] {
  const auto one = [](auto* b) { b->Iterations(1)->UseRealTime()->Unit(benchmark::kSecond); };
  for (const int rate : {1000, 4000}) {
    const std::string hz = std::to_string(rate) + "Hz";
    one(benchmark::RegisterBenchmark(("realtime/alpha/" + hz).c_str(), haptic_thread, rate, 0.0));
    one(benchmark::RegisterBenchmark(("realtime/alpha/" + hz + "/spin:100us").c_str(),
                                     haptic_thread, rate, 100.0));
    one(benchmark::RegisterBenchmark(("realtime/plain_thread/" + hz).c_str(), plain_thread, rate));
  }
  return true;
}();

}  // namespace
