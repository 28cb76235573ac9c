// SPDX-License-Identifier: Apache-2.0
// Anytime mode: a frame that is short of time leaves points out and reports it, and its run can be
// repeated.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "hapsix/hapsix.h"
#include "runtime/frame/session.h"
#include "tests/support/ball_in_bowl.h"
#include "tests/support/reports.h"

using namespace h6::test;

namespace {

constexpr double mm = kMm;

// Depth of each point that touches.
std::map<std::uint32_t, float> depths(const h6Session* session) {
  const h6Contacts c = h6GetContacts(session, 1);
  std::map<std::uint32_t, float> out;
  for (std::size_t i = 0; i < c.count; ++i)
    if (c.depth[i] > 0) out[c.point[i]] = c.depth[i];
  return out;
}

// A pose in the bowl, pressed in by 0 to 1.5 mm, with any rotation.
h6BodyState somewhere(int i) {
  const double a = 0.7 * i, b = 1.3 * i, d = (0.2 + 0.0875 * (i % 16)) * mm;
  h6BodyState state{};
  state.pose = pose(d * std::cos(a) * std::cos(b), d * std::sin(a) * std::cos(b), d * std::sin(b));
  state.pose.q = {std::cos(a), std::sin(a) * std::cos(b), 0, std::sin(a) * std::sin(b)};
  return state;
}

void step_at(h6Session* session, const h6BodyState& state) {
  h6SetBody(session, 1, &state);
  const h6DeviceSample sample = hand_at(state.pose);
  h6Step(session, &sample, nullptr);
}

// Three bowls next to each other: three pairs.
struct ThreeBowls : BallInBowl {
  std::array<h6BodyDef, 4> four{h6DefaultBodyDef(), h6DefaultBodyDef(), h6DefaultBodyDef(),
                                h6DefaultBodyDef()};
  explicit ThreeBowls(unsigned threads) : BallInBowl(threads, 6000) {
    for (std::size_t i : {0u, 2u, 3u}) four[i].fixed = true, four[i].field = 0;
    four[1].shell = 0;
    four[2].pose = pose(0.1 * mm, 0, 0);
    four[3].pose = pose(0, 0.15 * mm, 0.05 * mm);
    def.bodies = four.data(), def.body_count = 4;
  }
};

}  // namespace

TEST_CASE("a coarse frame has some of the full frame's contacts and bounds all it left out") {
  BallInBowl full(1);
  full.def.contact.method = H6_METHOD_ROBUST;  // no margin, which coarse frames cannot bound
  full.open();
  std::map<int, double> bound;  // on points left out, less the deepest one [voxel]
  std::map<std::uint32_t, std::uint32_t> fewer[60];
  for (const std::uint32_t points : {1u, 2u, 4u, 8u}) {
    BallInBowl coarse(1);
    coarse.def.contact.method = H6_METHOD_ROBUST;
    coarse.open();
    double tightest = HUGE_VAL;
    for (int i = 0; i < 60; ++i) {
      CAPTURE(points);
      CAPTURE(i);
      h6SetCoarse(coarse.session, 1, points);
      step_at(full.session, somewhere(i));
      step_at(coarse.session, somewhere(i));
      const h6FrameReport f = h6GetFrame(full.session), c = h6GetFrame(coarse.session);
      CHECK((f.status & H6_COARSE) == 0);
      CHECK(f.coarse_pairs == 0);
      CHECK(f.coarse_points == 0);
      CHECK(f.missed_depth_voxels == 0);
      CHECK((c.status & H6_COARSE) != 0);
      CHECK(c.coarse_pairs == 1);
      CHECK(c.coarse_points == points);
      const auto all = depths(full.session), some = depths(coarse.session);
      REQUIRE(all.size() > 100);
      CHECK(some.size() * 16 < all.size() * 2 * points);
      CHECK(some.size() * 16 > all.size() * points / 2);
      for (const auto& [point, depth] : some) {
        REQUIRE(all.count(point) == 1);
        CHECK(all.at(point) == depth);
      }
      // More points find all that fewer points find.
      for (const auto& [point, count] : fewer[i]) REQUIRE(some.count(point) == 1);
      fewer[i].clear();
      for (const auto& [point, depth] : some) fewer[i][point] = 1;
      CHECK(f.max_depth_voxels <= c.missed_depth_voxels);
      tightest = std::min(tightest, c.missed_depth_voxels - f.max_depth_voxels);
    }
    bound[static_cast<int>(points)] = tightest;
  }
  CHECK(bound[1] < 4);  // voxels: a bound, not just any number
  CHECK(bound[2] < bound[1]);
  CHECK(bound[4] < bound[2]);
  CHECK(bound[8] < bound[4]);
}

TEST_CASE("a frame without time even for these keeps the few deepest contacts") {
  BallInBowl coarse(1), few(1);
  coarse.def.contact.method = few.def.contact.method = H6_METHOD_ROBUST;
  coarse.open(), few.open();
  int cut = 0;
  for (int i = 0; i < 60; ++i) {
    CAPTURE(i);
    h6SetCoarse(coarse.session, 1, 1);
    h6SetCoarse(few.session, 1, 0);
    step_at(coarse.session, somewhere(i));
    step_at(few.session, somewhere(i));
    const h6FrameReport c = h6GetFrame(coarse.session), f = h6GetFrame(few.session);
    CHECK(f.coarse_pairs == 1);
    CHECK(f.coarse_points == 0);
    CHECK(f.max_depth == c.max_depth);
    const auto all = depths(coarse.session), some = depths(few.session);
    CHECK(some.size() == std::min(all.size(), std::size_t{64}));
    cut += all.size() > 64;
    float least = HUGE_VALF;
    for (const auto& [point, depth] : some) {
      REQUIRE(all.count(point) == 1);
      CHECK(all.at(point) == depth);
      least = std::min(least, depth);
    }
    for (const auto& [point, depth] : all)
      if (!some.count(point)) CHECK(depth <= least);
    CHECK(f.missed_depth_voxels >= c.missed_depth_voxels);
  }
  CHECK(cut > 20);
}

TEST_CASE("sampling finds only points that the shell has, for any number of points") {
  for (const int points : {1, 5, 16, 17, 100, 255, 257, 300}) {
    CAPTURE(points);
    BallInBowl full(1, points), coarse(1, points);
    full.def.contact.method = coarse.def.contact.method = H6_METHOD_ROBUST;
    full.open(), coarse.open();
    for (int i = 0; i < 40; ++i) {
      h6SetCoarse(coarse.session, 1, 1u << i % 4);
      step_at(full.session, somewhere(i));
      step_at(coarse.session, somewhere(i));
      const auto all = depths(full.session), some = depths(coarse.session);
      CHECK(some.size() == h6GetContacts(coarse.session, 1).count);  // each once
      for (const auto& [point, depth] : some) {
        REQUIRE(all.count(point) == 1);
        CHECK(all.at(point) == depth);
      }
      CHECK(h6GetFrame(full.session).max_depth_voxels <=
            std::max(h6GetFrame(coarse.session).missed_depth_voxels,
                     h6GetFrame(coarse.session).max_depth_voxels));
    }
  }
}

TEST_CASE("a coarse frame leaves no trace: the next full one is as if it had not happened") {
  for (const h6Method method : {H6_METHOD_ROBUST, H6_METHOD_SERIES}) {
    BallInBowl full(1, 6000), mixed(1, 6000);
    for (BallInBowl* scene : {&full, &mixed}) {
      scene->def.contact.method = method;
      scene->open();
    }
    for (int i = 0; i < 90; ++i) {
      // Slow and fast motion: some groups stay clear, some do not.
      const h6BodyState state = i < 60 ? h6BodyState{full.sample(i).pose, {}} : somewhere(i);
      if (i % 3) h6SetCoarse(mixed.session, 1, 1u << i % 4);
      step_at(full.session, state);
      step_at(mixed.session, state);
      CHECK((h6GetFrame(mixed.session).coarse_pairs == 1) == (i % 3 != 0));
      if (i % 3 == 0) CHECK(depths(mixed.session) == depths(full.session));
    }
  }
}

TEST_CASE("a frame without time is coarse, a frame with enough never is") {
  for (const double budget : {1e-3, 1e6}) {
    BallInBowl scene(1, 6000);
    scene.def.frame_budget_us = budget;
    scene.open();
    for (int i = 0; i < 30; ++i) {
      const h6DeviceSample sample = scene.sample(i);
      h6Step(scene.session, &sample, nullptr);
      CHECK((h6GetFrame(scene.session).coarse_pairs == 1) == (budget < 1));
    }
  }
  BallInBowl scene(1, 2000);
  for (const double wrong : {-1.0, 1e7, std::nan("")}) {
    scene.def.frame_budget_us = wrong;
    h6Error error;
    CHECK(h6CreateSession(scene.model.handle, &scene.def, &error) == nullptr);
    CHECK(std::string(error.message).find("frame_budget_us") != std::string::npos);
  }
}

TEST_CASE("a replay leaves out what the clock left out, bit for bit, on one thread and on two") {
  ThreeBowls live(1), again(2);
  live.def.frame_budget_us =
      60;  // about what a frame takes, so that the clock may decide either way
  live.open();
  again.open();
  std::array<int, 4> seen{};
  for (int i = 0; i < 300; ++i) {
    const h6DeviceSample sample = live.sample(i);
    h6DeviceCommand a{}, b{};
    if (i % 2)
      h6SetCoarse(live.session, static_cast<std::uint32_t>(i / 2 % 4), 1u << i / 8 % 5 & 15u);
    h6Step(live.session, &sample, &a);
    const h6FrameReport l = h6GetFrame(live.session);
    h6SetCoarse(again.session, l.coarse_pairs, l.coarse_points);
    h6Step(again.session, &sample, &b);
    const h6FrameReport r = h6GetFrame(again.session);
    REQUIRE(l.coarse_pairs <= 3);
    REQUIRE(r.coarse_points == l.coarse_points);
    REQUIRE((l.coarse_points == 0 || l.coarse_pairs > 0));
    ++seen[l.coarse_pairs];
    REQUIRE(l.state_hash == r.state_hash);
    REQUIRE(l.contacts == r.contacts);
    REQUIRE(l.status == r.status);
    REQUIRE(a.wrench.force.x == b.wrench.force.x);
    REQUIRE(b.wrench.torque.z == a.wrench.torque.z);
  }
  for (const int n : seen) CHECK(n > 30);
}

TEST_CASE("virtual time has no deadline, and leaves nothing out") {
  BallInBowl scene(1, 2000);
  scene.def.frame_budget_us = 1e-3;
  scene.open();
  h6Device device{};
  device.read = [](void*, double, h6DeviceSample* out) {
    return *out = hand_at(pose(0.8 * mm, 0, 0)), 0;
  };
  device.write = [](void*, double, const h6DeviceCommand*) { return 0; };
  for (const bool virtual_time : {true, false}) {
    const h6BodyState pressed{pose(0.8 * mm, 0, 0), {}};
    h6SetBody(scene.session, 1, &pressed);
    h6LoopDef def = h6DefaultLoopDef();
    def.duration = 0.02;
    def.virtual_time = virtual_time;
    h6Loop* loop = h6StartLoop(scene.session, &device, &def, nullptr);
    REQUIRE(loop);
    const h6LoopReport report = h6::test::joined(loop);
    CHECK(report.frames == 20);
    CHECK(report.coarse_frames == (virtual_time ? 0 : 20));
    h6DestroyLoop(loop);
  }
}

namespace {

// The costs that the clock sees in a scene of `contacts`. A contact costs full_ns when all are
// present and few_ns when a sixteenth is. `stolen`: one in so many frames takes a millisecond more.
struct Costs {
  double contacts, full_ns, few_ns;
  int stolen = 0;
  double held_up_us = 0;  // delay of every hundredth frame while it samples
};
struct Decided {
  int late = 0, few = 0;
  std::map<std::uint32_t, int> frames;  // by how many points of sixteen they sampled
  int full() { return frames[16]; }
};

struct Clocked {
  h6::Anytime a;
  h6::Pair only;
  h6::Pair* list[1] = {&only};
  h6::PairSearch& pair = only.search;
  int frame = 0;
  static inline std::int64_t now = 0;
  Clocked() {
    h6::begin_traversal(a, h6::PairList(list), 1, true);
    a.clock = [] { return now; };
  }

  Decided decide(const Costs& c, int frames) {
    constexpr double kGroupNs = 20;
    Decided out;
    const auto groups = static_cast<std::size_t>(c.contacts / 4), blocks = groups / 16;
    const double period_us = 1e-3 * a.period_ns;
    const auto reported = [&] {
      h6FrameReport report{};
      h6::report_anytime(a, report);
      return report.coarse_points ? report.coarse_points : 16;
    };
    for (int i = 0; i < frames; ++i, ++frame) {
      a.budget_ns = 0.8 * a.period_ns;
      double us = 0;  // time in this frame
      const auto pass = [&](double more_us) {
        us += more_us;
        now += static_cast<std::int64_t>(1e3 * more_us);
      };
      h6::begin_anytime(a, now);
      bool coarse = h6::is_coarse_anyway(a, pair, 0, blocks);
      if (!coarse) pass(10), coarse = h6::must_be_coarse(a, pair, 0, blocks, groups);
      double found = 0;
      do {
        const double points = reported();
        const double sampled = points * static_cast<double>(points < 16 ? blocks : groups / 16);
        found = c.contacts * points / 16;
        pass(1e-3 * sampled * kGroupNs);
        if (frame % 100 == 99 && points < 16) pass(c.held_up_us);
        h6::learn_sampling(a, static_cast<std::size_t>(sampled), groups,
                           static_cast<std::size_t>(found),
                           now - static_cast<std::int64_t>(sampled * kGroupNs));
      } while (h6::must_be_coarser(a, pair, 0, static_cast<std::size_t>(found), blocks));
      const auto candidates = static_cast<std::size_t>(found);
      const bool cut = candidates > h6::Anytime::kFew && h6::must_be_few(a, pair, candidates);
      if (cut) found = h6::Anytime::kFew, ++out.few;
      const double few = c.contacts / 16;
      const double each = c.few_ns + (c.full_ns - c.few_ns) * (found - few) / (c.contacts - few);
      const bool robbed = c.stolen && frame % c.stolen == c.stolen - 1;
      double weighing = 1e-3 * found * each;
      out.late += us + weighing > period_us;
      if (robbed) weighing += 1000;
      pair.candidates = static_cast<std::size_t>(found);
      h6FrameReport report{};
      report.stage_us[H6_STAGE_WEIGHTS] = weighing;
      h6::learn_frame(a, report);
      ++out.frames[reported()];
    }
    return out;
  }
};

}  // namespace

TEST_CASE("a tier that does not fit is never tried; the finest tier that fits is used") {
  // The period is 1 ms; a full frame takes 1.3 to 6 ms.
  struct {
    double full_ns, few_ns;
    std::uint32_t points;  // of sixteen; they surely fit into 0.8 ms
  } const scenes[] = {{130, 65, 8}, {130, 120, 4}, {200, 100, 4}, {600, 300, 1}, {600, 40, 4}};
  for (const auto& scene : scenes) {
    CAPTURE(scene.full_ns);
    CAPTURE(scene.few_ns);
    Clocked c;
    Decided all = c.decide({10000, scene.full_ns, scene.few_ns}, 20000);
    CHECK(all.late == 0);
    CHECK(all.full() == 0);
    CHECK(all.frames[scene.points] + all.frames[2 * scene.points] > 19000);
  }
  // A full frame that gets more contacts: the known cost of one contact is enough to decide.
  Clocked c;
  CHECK(c.decide({2000, 150, 120}, 500).full() > 400);
  CHECK(c.decide({10000, 150, 120}, 20000).late == 0);
  CHECK(c.decide({2000, 150, 120}, 500).full() > 350);
}

TEST_CASE("a coarse frame that the machine delayed is in time with few contacts") {
  // One point of sixteen takes 330 of 800 us; the machine takes 800 more, and only then.
  const Costs usual{10000, 600, 500};
  Costs disturbed = usual;
  disturbed.held_up_us = 800;
  Clocked c;
  CHECK(c.decide(usual, 2000).few == 0);
  Decided all = c.decide(disturbed, 20000);
  CHECK(all.late == 0);
  CHECK(all.few > 150);
  CHECK(all.few <= 200);
  // If even one point of sixteen always takes too long, it is tried now and then, and cut at once.
  Clocked slow;
  all = slow.decide({10000, 2600, 2500}, 20000);
  CHECK(all.few > 19900);
  CHECK(all.late < 40);
  CHECK(slow.decide(usual, 20000).few < 1100);
}

TEST_CASE("a frame that fits is full, at once or soon") {
  Clocked small;
  CHECK(small.decide({1000, 80, 60}, 1000).full() > 950);
  Clocked fits;
  Decided all = fits.decide({10000, 55, 35}, 20000);
  CHECK(all.late == 0);
  CHECK(all.full() > 15000);
  // Over the budget and within the period: half of the points are sampled.
  Clocked close;
  Decided some = close.decide({10000, 90, 75}, 20000);
  CHECK(some.late == 0);
  CHECK(some.frames[8] + some.full() > 19000);
}

TEST_CASE("a stolen millisecond now and then does not make all frames coarse") {
  Clocked c;
  (void)c.decide({6000, 100, 60}, 200);
  Decided all = c.decide({6000, 100, 60, 10}, 20000);
  CHECK(all.full() > 19000);
  CHECK(all.late == 0);
}

TEST_CASE("coarse frames notice a machine that becomes faster; a slow hour is forgotten") {
  Clocked c;
  CHECK(c.decide({10000, 160, 130}, 2000).full() == 0);
  CHECK(c.decide({10000, 50, 30}, 6000).full() > 3000);
  Clocked slow;
  (void)slow.decide({6000, 80, 45}, 100);
  CHECK(slow.decide({6000, 80, 45}, 100).full() > 90);
  CHECK(slow.decide({6000, 200, 160}, 50).full() < 10);
  CHECK(slow.decide({6000, 80, 45}, 20000).full() > 15000);
}
