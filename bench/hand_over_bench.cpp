// SPDX-License-Identifier: Apache-2.0
// hand_over_bench.cpp - measures the cost of sharing a frame's work with the resident helper:
//     sched/line                a cache line, from one core to another
//     sched/hand_over               an empty slice, from the caller to the helper and back
//     sched/sums/us:N               arithmetic in registers, in slices of 1 us
//     sched/columns/rows:N          sums of columns that the caller has just written; the caller
//                                   reads the results
//
// The caller is pinned to one core like a haptic thread. Before times are reported, the results are
// compared with the caller's own.
#include <benchmark/benchmark.h>

#include <sched.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

#include "sched/clock.h"
#include "sched/frame_team.h"
#include "sched/parallel_for.h"

namespace {

using h6::sched::FrameTeam;
using h6::sched::now_ns;

constexpr int kJobs = 8000;
constexpr int kWarmUp = 500;

class Pinned {
 public:
  Pinned() {
    sched_getaffinity(0, sizeof before_, &before_);
    cpu_set_t one;
    CPU_ZERO(&one);
    for (int core = CPU_SETSIZE - 1; core >= 0 && CPU_COUNT(&one) == 0; --core)
      if (CPU_ISSET(core, &before_)) CPU_SET(core, &one);
    sched_setaffinity(0, sizeof one, &one);
  }
  ~Pinned() { sched_setaffinity(0, sizeof before_, &before_); }

 private:
  cpu_set_t before_{};
};

double middle(std::vector<double>& us) {
  if (us.empty()) return 0;
  std::nth_element(us.begin(), us.begin() + static_cast<std::ptrdiff_t>(us.size() / 2), us.end());
  return us[us.size() / 2];
}

// Two threads write one line in turn. A virtual machine may move its cores between those of the
// host, so the time of a line can change within seconds, and with it the gain of a second thread:
// `least_ns` and `most_ns` are of a hundred blocks.
void line(benchmark::State& state) {
  constexpr int kBlocks = 100, kTurns = 2000;
  if (h6::sched::machine_threads() < 2) return state.SkipWithError("there is one core only");
  struct alignas(64) Line {  // nothing else lies on it
    std::atomic<int> ball{0};
  } line;
  std::atomic<int>& ball = line.ball;
  std::vector<double> ns;
  int caught = 0;
  for (auto _ : state) {
    ball = 0;
    std::thread other([&] {
      for (int turn = 0; turn < kBlocks * kTurns; ++turn, ++caught) {
        while (ball.load(std::memory_order_acquire) != 1) {
        }
        ball.store(0, std::memory_order_release);
      }
    });
    const Pinned pinned;
    for (int block = 0; block < kBlocks; ++block) {
      const std::int64_t start = now_ns();
      for (int turn = 0; turn < kTurns; ++turn) {
        ball.store(1, std::memory_order_release);
        while (ball.load(std::memory_order_acquire) != 0) {
        }
      }
      ns.push_back(static_cast<double>(now_ns() - start) / (2 * kTurns));
    }
    other.join();
  }
  if (caught != kBlocks * kTurns) return state.SkipWithError("a turn was lost");
  std::sort(ns.begin(), ns.end());
  state.counters["line_ns"] = ns[ns.size() / 2];
  state.counters["least_ns"] = ns.front();
  state.counters["most_ns"] = ns.back();
}

// The helper starts before the caller is pinned, or it would inherit the caller's core.
void hand_over(benchmark::State& state) {
  FrameTeam team(2);
  const Pinned pinned;
  std::vector<double> there, back, over;
  for (auto _ : state) {
    for (int job = 0; job < kJobs; ++job) {
      team.begin_frame(now_ns());
      std::atomic<std::int64_t> begun{0};
      std::int64_t seen = 0;
      const std::int64_t start = now_ns();
      team.for_slices(2, [&](std::size_t slice) {
        if (slice == 1) return begun.store(now_ns(), std::memory_order_release);
        while (begun.load(std::memory_order_acquire) == 0 && now_ns() < start + 200000) {
        }
        seen = now_ns();
      });
      const std::int64_t end = now_ns();
      const bool helped = team.helper_work().slices > 0;
      team.end_frame(end);
      if (job < kWarmUp || !helped) continue;
      there.push_back(1e-3 * static_cast<double>(begun - start));
      back.push_back(1e-3 * static_cast<double>(seen - begun));
      over.push_back(1e-3 * static_cast<double>(end - seen));
    }
  }
  state.counters["there_us"] = middle(there);
  state.counters["back_us"] = middle(back);
  state.counters["end_us"] = middle(over);
  state.counters["helped"] = static_cast<double>(there.size()) / (kJobs - kWarmUp);
}

// `job(team)` runs the work and returns whether the result is right; `before` is not timed.
template <class Before, class Job>
void compare(benchmark::State& state, const Before& before, const Job& job) {
  FrameTeam one(1), two(2);
  const Pinned pinned;
  std::vector<double> alone, shared;
  double slices = 0;
  for (auto _ : state) {
    for (int i = 0; i < 2 * kJobs; ++i) {
      // Each team runs a hundred in turn, so that changes of the machine's speed affect both.
      FrameTeam& team = i / 100 % 2 ? two : one;
      team.begin_frame(now_ns());
      before(i);
      const std::int64_t start = now_ns();
      const bool right = job(team, i);
      const std::int64_t end = now_ns();
      if (!right) return state.SkipWithError("the result is another one");
      if (i % 100 >= 20)
        (&team == &two ? shared : alone).push_back(1e-3 * static_cast<double>(end - start));
      if (i % 100 >= 20) slices += team.helper_work().slices;
      team.end_frame(end);
    }
  }
  state.counters["helper_slices"] = slices / static_cast<double>(shared.size());
  state.counters["alone_us"] = middle(alone);
  state.counters["shared_us"] = middle(shared);
}

std::uint32_t churn(std::uint32_t x) {
  for (int i = 0; i < 1000; ++i) {
    x = x * 1664525u + 1013904223u;
    benchmark::DoNotOptimize(x);
  }
  return x;
}

void sums(benchmark::State& state, std::size_t slices) {
  std::vector<std::uint32_t> out(16 * slices);
  compare(
      state, [](int) {},
      [&](FrameTeam& team, int i) {
        team.for_slices(slices, [&](std::size_t s) {
          out[16 * s] = churn(static_cast<std::uint32_t>(i + static_cast<int>(s)));
        });
        return i % 997 != 0 || out[16] == churn(static_cast<std::uint32_t>(i + 1));
      });
}

void columns(benchmark::State& state, std::size_t rows) {
  constexpr std::size_t kColumns = 6, kSlice = 128;
  std::vector<float> in(kColumns * rows), out(rows);
  float total = 0;
  const auto value = [](std::size_t row, std::size_t k, int i) {
    return static_cast<float>((row * 7 + k * 3 + static_cast<std::size_t>(i)) % 64);
  };
  compare(
      state,
      [&](int i) {
        for (std::size_t k = 0; k < kColumns; ++k)
          for (std::size_t row = 0; row < rows; ++row) in[k * rows + row] = value(row, k, i);
      },
      [&](FrameTeam& team, int i) {
        team.for_slices((rows + kSlice - 1) / kSlice, [&](std::size_t s) {
          for (std::size_t row = s * kSlice; row < std::min(rows, (s + 1) * kSlice); ++row) {
            float sum = 0;
            for (int again = 0; again < 4; ++again)
              for (std::size_t k = 0; k < kColumns; ++k)
                sum += in[k * rows + row] * in[k * rows + row];
            out[row] = sum;
          }
        });
        total = 0;
        for (const float x : out) total += x;
        benchmark::DoNotOptimize(total);
        float last = 0;
        for (std::size_t k = 0; k < kColumns; ++k)
          last += value(rows - 1, k, i) * value(rows - 1, k, i);
        return out[rows - 1] == 4 * last;
      });
}

[[maybe_unused]] const bool registered = [] {
  const auto once = [](benchmark::internal::Benchmark* b) { b->Iterations(1)->UseRealTime(); };
  once(benchmark::RegisterBenchmark("sched/line", line));
  once(benchmark::RegisterBenchmark("sched/hand_over", hand_over));
  for (const std::size_t us : {2, 4, 8, 16, 32})
    once(benchmark::RegisterBenchmark(("sched/sums/us:" + std::to_string(us)).c_str(), sums, us));
  for (const std::size_t rows : {512, 1024, 2048, 8192})
    once(benchmark::RegisterBenchmark(("sched/columns/rows:" + std::to_string(rows)).c_str(),
                                      columns, rows));
  return true;
}();

}  // namespace
