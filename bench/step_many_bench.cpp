// SPDX-License-Identifier: Apache-2.0
// step_many_bench.cpp - many sessions in one call: frame/many/peg/sessions:N/threads:T, steps a
// second.
//
// Each session is the scene peg-in-hole with room for 1,000 contacts. Its hand presses the peg, 9
// mm deep in its hole, sideways, each by another way, and then trembles: about 100 points touch.
// `bytes` is what an allocator gives for a session, with its share of the workers' scratch. Before
// a time is reported, the bits of three sessions are compared with those of the same sessions
// stepped alone. HAPSIX_BENCH_SESSIONS=16384 adds a row of so many.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "bench/realtime_scenes.h"
#include "hapsix/batch.h"
#include "sched/clock.h"

namespace {

using namespace h6;
using namespace h6::bench;

std::size_t allocated = 0;
h6Allocator counting() {
  return {[](void*, std::size_t bytes, std::size_t alignment) {
            allocated += bytes;
            return std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
          },
          [](void*, void* memory, std::size_t) { std::free(memory); }, nullptr};
}

const io::LoadedScene& peg() {
  static const auto loaded = io::load_scene(*io::make_scene("peg-in-hole"));
  return **loaded;
}
constexpr double kOut = 6e-3;  // the peg is 9 mm deep in its hole [m]
h6SessionDef peg_def() {
  h6SessionDef def = peg().session_def();
  static std::vector<h6BodyDef> bodies(def.bodies, def.bodies + def.body_count);
  bodies[1].pose.p.z = kOut;
  def.bodies = bodies.data();
  def.max_contacts = 1000;
  return def;
}
constexpr int kSettled = 400;  // frames, from which on the hand only trembles
// `share` in [0, 1) tells sessions apart.
h6Pose hand(double share, int frame) {
  const double y = 2e-5 * std::sin(0.03 * frame + 6 * share);
  return {{(7e-3 + 1e-3 * share) * std::min(1.0, frame / 200.0), y, kOut}, {1, 0, 0, 0}};
}

class Many {
 public:
  Many(std::size_t count, unsigned threads) {
    h6WorkersDef workers = h6DefaultWorkersDef();
    workers.threads = threads, workers.allocator = counting();
    workers_.reset(h6CreateWorkers(&workers, nullptr));
    h6SessionDef def = peg_def();
    def.workers = workers_.get();
    bytes = bytes_of_one(def, count);
    for (std::size_t i = 0; i < count; ++i) {
      sessions_.emplace_back(h6CreateSession(peg().model.get(), &def, nullptr));
      if (!sessions_.back()) std::abort();
      handles_.push_back(sessions_.back().get());
    }
    pose_.resize(count), wrench_.resize(count), body_.resize(count);
    contacts.resize(count), hash.resize(count);
    arrays_.sessions = handles_.data(), arrays_.count = count;
    arrays_.pose = pose_.data(), arrays_.command = wrench_.data(), arrays_.body = body_.data();
    arrays_.contacts = contacts.data(), arrays_.state_hash = hash.data();
    while (frame_ < kSettled) place(), step();
  }
  void place() {
    for (std::size_t i = 0; i < pose_.size(); ++i) pose_[i] = hand(share(i), frame_);
    ++frame_;
  }
  void step() { h6StepMany(workers_.get(), &arrays_); }
  // Steps session i alone for as many frames, and compares the bits of the last one.
  bool right(std::size_t i) const {
    const h6SessionDef def = peg_def();
    const bench::Session alone(h6CreateSession(peg().model.get(), &def, nullptr));
    h6DeviceSample sample = h6DefaultDeviceSample();
    for (int frame = 0; frame < frame_; ++frame) {
      sample.pose = hand(share(i), frame);
      h6Step(alone.get(), &sample, nullptr);
    }
    return h6GetFrame(alone.get()).state_hash == hash[i];
  }

  double bytes = 0;
  std::vector<std::uint32_t> contacts;
  std::vector<std::uint64_t> hash;

 private:
  struct DestroyWorkers {
    void operator()(h6Workers* w) const { h6DestroyWorkers(w); }
  };
  // With its share of the scratch, which the first session makes.
  static double bytes_of_one(h6SessionDef def, std::size_t count) {
    const auto made = [&] {
      const std::size_t before = allocated;
      const bench::Session session(h6CreateSession(peg().model.get(), &def, nullptr));
      if (!session) std::abort();
      return static_cast<double>(allocated - before);
    };
    def.allocator = counting();
    const double first = made(), other = made();
    return other + (first - other) / static_cast<double>(count);
  }
  double share(std::size_t i) const {
    return static_cast<double>(i) / static_cast<double>(pose_.size());
  }
  std::vector<h6Session*> handles_;
  std::unique_ptr<h6Workers, DestroyWorkers> workers_;
  std::vector<bench::Session> sessions_;  // they end before their workers
  std::vector<h6Pose> pose_;
  std::vector<h6Wrench> wrench_;
  std::vector<h6BodyState> body_;
  h6StepArrays arrays_ = h6DefaultStepArrays();
  int frame_ = 0;
};

void step_many(benchmark::State& state, std::size_t count, unsigned threads) {
  Many many(count, threads);
  double contacts = 0, seconds = 0, calls = 0;
  for (auto _ : state) {
    many.place();
    const std::int64_t start = sched::now_ns();
    many.step();
    const double took = 1e-9 * static_cast<double>(sched::now_ns() - start);
    state.SetIterationTime(took);
    seconds += took, ++calls;
    for (const std::uint32_t c : many.contacts) contacts += c;
  }
  for (const std::size_t i : {std::size_t{0}, count / 2, count - 1})
    if (!many.right(i)) return state.SkipWithError("a session has other bits than alone");
  state.counters["contacts"] = contacts / calls / static_cast<double>(count);
  state.counters["steps/s"] = calls * static_cast<double>(count) / seconds;
  state.counters["bytes"] = many.bytes;
}

[[maybe_unused]] const bool registered = [] {
  std::vector<std::size_t> counts{1, 64, 1024};
  if (const char* more = std::getenv("HAPSIX_BENCH_SESSIONS"))
    counts.push_back(std::strtoull(more, nullptr, 10));
  for (const std::size_t count : counts)
    for (const unsigned threads : {1u, 2u}) {
      const std::string name = "frame/many/peg/sessions:" + std::to_string(count) +
                               "/threads:" + std::to_string(threads);
      const auto calls =
          std::clamp<std::size_t>(100000 / std::max<std::size_t>(count, 1), 20, 5000);
      benchmark::RegisterBenchmark(name.c_str(), step_many, count, threads)
          ->UseManualTime()
          ->Unit(benchmark::kMicrosecond)
          ->Iterations(static_cast<benchmark::IterationCount>(calls));
    }
  return true;
}();

}  // namespace
