// SPDX-License-Identifier: Apache-2.0
// Several hands, each with its own part: their shell bodies are weighed side by side, with the same
// bits.
#include <doctest/doctest.h>

#include <array>
#include <chrono>
#include <cstring>
#include <string>
#include <vector>

#include "tests/support/ball_in_bowl.h"

using namespace h6::test;

namespace {

constexpr std::size_t kHands = 3;
constexpr std::uint64_t kHelped = 3;  // frames

// Three balls in one bowl, held by three hands. Without `fields` they touch only the bowl, with it
// also one another, so that pairs share moving bodies.
struct ThreeBalls : BallInBowl {
  FieldArrays round = sample_analytic(
      [](double x, double y, double z) { return std::sqrt(x * x + y * y + z * z) - 20 * kMm; },
      {-32 * kMm, -32 * kMm, -32 * kMm}, kMm, 8, 8, 8);
  Model both{{def_of(field), def_of(round)}, {shell.def()}};
  std::array<h6BodyDef, kHands + 1> all{h6DefaultBodyDef(), h6DefaultBodyDef(), h6DefaultBodyDef(),
                                        h6DefaultBodyDef()};
  std::array<h6HandDef, kHands> hands{hand, hand, hand};

  ThreeBalls(unsigned threads, int points, bool fields) : BallInBowl(threads, points) {
    all[0] = bodies[0];
    for (std::size_t h = 0; h < kHands; ++h) {
      all[h + 1].shell = 0;
      if (fields) all[h + 1].field = 1;
      hands[h].body = static_cast<std::int32_t>(h + 1);
    }
    def.bodies = all.data(), def.body_count = all.size();
    def.hands = hands.data(), def.hand_count = kHands;
  }
  void open_both() {
    h6DestroySession(session);
    h6Error error{};
    session = h6CreateSession(both.handle, &def, &error);
    REQUIRE_MESSAGE(session, error.message);
  }
  std::array<h6DeviceSample, kHands> samples(int i) const {
    return {sample(i), sample(2 * i + 50), sample(3 * i + 99)};
  }
};

struct Seen {
  std::uint64_t helped = 0;  // frames in which the other thread worked
  std::uint32_t contacts = 0;
};

// Runs so many frames, and more until the other thread has worked in some of them, which takes a
// while on a busy machine.
Seen check_same(ThreeBalls& one, ThreeBalls& two, int frames, bool coarse = false) {
  one.open_both(), two.open_both();
  Seen seen;
  std::array<h6DeviceCommand, kHands> a{}, b{};
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  for (int i = 0; i < frames || seen.helped < kHelped; ++i) {
    if (i > frames && std::chrono::steady_clock::now() > give_up) break;
    const auto samples = one.samples(i % 1000);
    if (coarse && i % 3 == 0)
      for (const ThreeBalls* scene : {&one, &two})
        h6SetCoarse(scene->session, static_cast<std::uint32_t>(i / 3 % 4), 1u << i % 5 & 15u);
    h6Step(one.session, samples.data(), a.data());
    h6Step(two.session, samples.data(), b.data());
    const h6FrameReport r = h6GetFrame(one.session), s = h6GetFrame(two.session);
    REQUIRE(r.state_hash == s.state_hash);
    REQUIRE(r.contacts == s.contacts);
    REQUIRE(r.status == s.status);
    REQUIRE(r.coarse_pairs == s.coarse_pairs);
    REQUIRE(r.coarse_points == s.coarse_points);
    REQUIRE(r.max_depth == s.max_depth);
    REQUIRE(r.max_depth_voxels == s.max_depth_voxels);
    REQUIRE(r.missed_depth_voxels == s.missed_depth_voxels);
    REQUIRE(r.series_iterations == s.series_iterations);
    REQUIRE(std::memcmp(&a[2].wrench, &b[2].wrench, sizeof a[2].wrench) == 0);
    seen.helped += s.helper_slices > 0;
    seen.contacts = std::max(seen.contacts, s.contacts);
  }
  return seen;
}

}  // namespace

TEST_CASE("hands side by side on two threads: the same bits as one after the other on one") {
  std::uint64_t helped = 0;
  for (const h6Method method : {H6_METHOD_ROBUST, H6_METHOD_SERIES, H6_METHOD_CLUSTER})
    for (const bool fields : {false, true}) {
      CAPTURE(std::string(h6MethodName(method)));
      CAPTURE(fields);
      // Too few contacts each for one body's slices to be worth a helper.
      ThreeBalls one(1, 8000, fields), two(2, 8000, fields);
      for (ThreeBalls* scene : {&one, &two}) scene->def.contact.method = method;
      const Seen seen = check_same(one, two, 60);
      CHECK(seen.contacts > 150);
      helped += seen.helped;
    }
  CHECK(helped >= kHelped);
}

TEST_CASE("many contacts each, dropped contacts, coarse pairs: the same bits") {
  ThreeBalls one(1, 20000, true), two(2, 20000, true);
  const Seen seen = check_same(one, two, 60, true);
  CHECK(seen.contacts > 1000);
  ThreeBalls few(1, 20000, false), fewer(2, 20000, false);
  for (ThreeBalls* scene : {&few, &fewer}) scene->def.max_contacts = 100;
  CHECK(check_same(few, fewer, 60).contacts <= 3 * 100);
}

TEST_CASE("times of stages add up to no more than the frame, side by side too") {
  ThreeBalls two(2, 20000, false);
  two.open_both();
  for (int i = 0; i < 100; ++i) {
    const auto samples = two.samples(i);
    h6Step(two.session, samples.data(), nullptr);
    const h6FrameReport r = h6GetFrame(two.session);
    double sum = 0;
    for (const double us : r.stage_us) {
      REQUIRE(us >= 0);
      sum += us;
    }
    REQUIRE(sum <= r.frame_us + 1e-6);
    if (r.contacts > 0) REQUIRE(r.stage_us[H6_STAGE_WEIGHTS] > 0);
  }
}
