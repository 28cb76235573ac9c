// SPDX-License-Identifier: Apache-2.0
// scheduling_bench.cpp - the same frames with their slices run in four ways, in turn:
//     sched/frame/one|many|large/paced|busy
//       alone     the calling thread
//       resident  helpers that stay, as the engine has them (sched/frame_team.h)
//       arena     tbb::parallel_for in a task_arena that the frame runs in
//       graph     a tbb::flow::graph with a node for each thread, in such an arena
//
// One: a ball rubs in a bowl. Many: 64 balls, each in a bowl of its own. Large: a box with 10,000
// contacts slides on a plane. Paced: a frame every millisecond, as in a haptic loop. Busy: one
// after the other. Before times are reported, all ways must have given the same bits.
#include <benchmark/benchmark.h>

#include <oneapi/tbb/flow_graph.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/partitioner.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "runtime/frame/session.h"
#include "sched/clock.h"
#include "tests/support/analytic.h"

namespace {

using namespace h6;
using namespace h6::test;
using sched::FrameTeam;

constexpr double mm = 1e-3;
constexpr unsigned kThreads = 2;

struct Destroy {
  void operator()(h6Session* s) const { h6DestroySession(s); }
};
using Session = std::unique_ptr<h6Session, Destroy>;

struct World {
  FieldArrays field;
  ShellArrays shell;
  Model model;
  std::vector<h6BodyDef> bodies;
  std::vector<h6HandDef> hands;
  h6SessionDef def = h6DefaultSessionDef();
  bool slides;

  World(FieldArrays f, ShellArrays s, bool slides_)
      : field(std::move(f)),
        shell(std::move(s)),
        model({def_of(field)}, {shell.def()}),
        slides(slides_) {
    def.contact.fit = H6_FIT_TIGHT;
  }
  // A fixed field and a part in it; a hand may hold the part.
  void add(double x, bool held) {
    h6BodyDef fixed = h6DefaultBodyDef(), part = h6DefaultBodyDef();
    fixed.fixed = true, fixed.field = 0, fixed.pose = pose(x, 0, 0);
    part.shell = 0, part.pose = pose(x, 0, 0);
    bodies.push_back(fixed), bodies.push_back(part);
    if (!held) return;
    h6HandDef hand = h6DefaultHandDef();
    hand.body = static_cast<std::int32_t>(bodies.size()) - 1;
    hand.coupling.max_depth_voxels = slides ? 0.5 : 3;
    hands.push_back(hand);
  }
  Session open(unsigned threads) {
    def.bodies = bodies.data(), def.body_count = bodies.size();
    def.hands = hands.data(), def.hand_count = hands.size();
    def.threads = threads;
    return Session(h6CreateSession(model.handle, &def, nullptr));
  }
  void step(h6Session* s, int i) const {
    const double way = 1.5 * mm * std::sin(0.05 / 1.5 * i);
    h6DeviceSample in =
        slides
            ? hand_at(pose(way, 0.3 * way, -4 * mm))
            : hand_at(pose(2 * mm * std::sin(1.2 + 0.02 * i), 1.5 * mm * std::cos(0.013 * i), 0));
    h6Step(s, &in, nullptr);
  }
};

std::unique_ptr<World> bowls(int count) {
  auto world = std::make_unique<World>(
      sample_analytic(
          [](double x, double y, double z) { return 20.2 * mm - std::sqrt(x * x + y * y + z * z); },
          {-32 * mm, -32 * mm, -32 * mm}, mm, 8, 8, 8),
      sphere_points(20 * mm, count > 1 ? 6000 : 30000), false);
  for (int i = 0; i < count; ++i) world->add(100 * mm * i, i == 0);
  // Gravity presses the balls that no hand holds.
  world->def.gravity = {0, 3, -9.81};
  return world;
}

std::unique_ptr<World> plane() {
  auto world =
      std::make_unique<World>(sample_analytic([](double, double, double z) { return z; },
                                              {-40 * mm, -40 * mm, -40 * mm}, mm, 10, 10, 10),
                              bottom_face(30 * mm, 30 * mm, 0, 100, 100), true);
  world->add(0, true);
  return world;
}

// A claim of slices, in order, by the threads of an arena.
struct Claims {
  std::atomic<std::size_t> next{0};
  std::size_t slices = 0;
  FrameTeam::Slice work = nullptr;
  void* context = nullptr;
  void take() {
    for (std::size_t i; (i = next.fetch_add(1, std::memory_order_relaxed)) < slices;)
      work(context, i);
  }
};

struct Arena2 {
  oneapi::tbb::task_arena arena{static_cast<int>(kThreads)};
  Claims claims;
  oneapi::tbb::flow::graph graph;
  using Node = oneapi::tbb::flow::continue_node<oneapi::tbb::flow::continue_msg>;
  std::vector<std::unique_ptr<Node>> nodes;
  oneapi::tbb::flow::broadcast_node<oneapi::tbb::flow::continue_msg> start{graph};

  static void number() {
    FrameTeam::be(static_cast<unsigned>(oneapi::tbb::this_task_arena::current_thread_index()));
  }
  static void run_for(void*, std::size_t slices, FrameTeam::Slice work, void* context) {
    oneapi::tbb::parallel_for(
        std::size_t{0}, slices,
        [&](std::size_t i) {
          number();
          work(context, i);
        },
        oneapi::tbb::simple_partitioner());
  }
  static void run_graph(void* self, std::size_t slices, FrameTeam::Slice work, void* context) {
    Arena2& a = *static_cast<Arena2*>(self);
    a.claims.slices = slices, a.claims.work = work, a.claims.context = context;
    a.claims.next.store(0, std::memory_order_relaxed);
    a.start.try_put({});
    a.graph.wait_for_all();
  }
  // The nodes must belong to this arena.
  void build_graph() {
    arena.execute([&] {
      graph.reset();
      for (unsigned i = 0; i < kThreads; ++i) {
        nodes.push_back(
            std::make_unique<Node>(graph, [this](const oneapi::tbb::flow::continue_msg&) {
              number();
              claims.take();
            }));
        oneapi::tbb::flow::make_edge(start, *nodes.back());
      }
    });
  }
};

double at(std::vector<double>& t, double p) {
  std::sort(t.begin(), t.end());
  return t[static_cast<std::size_t>(p * static_cast<double>(t.size() - 1))];
}

void compare(benchmark::State& state, std::unique_ptr<World> world, bool paced) {
  constexpr int kWays = 4, kBlock = 50, kBlocks = 24, kWarm = 10;
  const char* const names[kWays] = {"alone", "resident", "arena", "graph"};
  // The resident helper keeps one worker of TBB for itself, so the arenas need another one.
  const oneapi::tbb::global_control allowance(oneapi::tbb::global_control::max_allowed_parallelism,
                                              kThreads + 1);
  Arena2 tasks[2];
  tasks[1].build_graph();
  Session sessions[kWays];
  for (int way = 0; way < kWays; ++way) {
    sessions[way] = world->open(way == 0 ? 1 : kThreads);
    if (!sessions[way]) return state.SkipWithError("no session");
  }
  for (int way : {2, 3}) {
    // The session's lanes are laid out for two threads; the team is another one.
    delete sessions[way]->team;
    sessions[way]->team = new FrameTeam(1);
    sessions[way]->team->replace_helpers(way == 2 ? Arena2::run_for : Arena2::run_graph,
                                         &tasks[way - 2], kThreads);
    sessions[way]->lanes.whole.team = sessions[way]->team;
  }
  std::vector<double> times[kWays];
  std::uint64_t hash[kWays] = {};
  double contacts = 0;
  for (auto _ : state)
    for (int block = 0; block < kBlocks; ++block)
      for (int way = 0; way < kWays; ++way) {
        h6Session* const s = sessions[way].get();
        std::int64_t next = sched::now_ns();
        for (int i = 0; i < kBlock; ++i) {
          if (paced) sched::sleep_until_ns(next += 1000000);
          const std::int64_t since = sched::now_ns();
          const auto frame = [&] { world->step(s, block * kBlock + i); };
          if (way < 2)
            frame();
          else
            tasks[way - 2].arena.execute(frame);
          const std::int64_t end = sched::now_ns();
          if (i >= kWarm) times[way].push_back(1e-3 * static_cast<double>(end - since));
        }
        hash[way] = h6GetFrame(s).state_hash;
        contacts = h6GetFrame(s).contacts;
        if (way > 0 && hash[way] != hash[0]) return state.SkipWithError("the bits differ");
      }
  state.counters["contacts"] = contacts;
  for (int way = 0; way < kWays; ++way) {
    state.counters[std::string(names[way]) + "_p50_us"] = at(times[way], 0.5);
    state.counters[std::string(names[way]) + "_p99_us"] = at(times[way], 0.99);
  }
}

[[maybe_unused]] const bool registered = [] {
  for (const bool paced : {true, false})
    for (const char* name : {"one", "many", "large"})
      benchmark::RegisterBenchmark(
          (std::string("sched/frame/") + name + (paced ? "/paced" : "/busy")).c_str(),
          [=](benchmark::State& state) {
            const std::string scene = name;
            compare(state, scene == "large" ? plane() : bowls(scene == "one" ? 1 : 64), paced);
          })
          ->Iterations(1)
          ->UseRealTime();
  return true;
}();

}  // namespace
