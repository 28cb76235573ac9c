// SPDX-License-Identifier: Apache-2.0
// friction_session_test.cpp - friction through the life of a session: coarse frames, take-over,
// replay.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "runtime/frame/session.h"
#include "tests/support/ball_in_bowl.h"
#include "tests/support/box_on_slope.h"

using namespace h6;
using namespace h6::test;

TEST_CASE("coarse frames and too few places for contacts let no box slip") {
  for (const std::size_t most : {std::size_t{16384}, std::size_t{20}})
    for (const int coarse : {0, 1}) {
      CAPTURE(most);
      CAPTURE(coarse);
      BoxOnSlope box(0.5, 0.8 * std::atan(0.5));
      box.def.max_contacts = most;
      box.open();
      box.run(2);
      const h6BodyState begin = box.body();
      h6Status seen = 0;
      for (int i = 0; i < 5000; ++i) {
        if (coarse && i % 3 == 0) h6SetCoarse(box.session, 1, 2);
        h6Step(box.session, nullptr, nullptr);
        seen |= h6GetFrame(box.session).status;
      }
      CHECK(((seen & H6_COARSE) != 0) == (coarse == 1));
      if (most == 20) CHECK((seen & H6_CONTACTS_DROPPED));
      CHECK(norm(box.body().pose.p - begin.pose.p) < 5e-5);  // of the 60 mm that it would slide
    }
}

TEST_CASE(
    "a session that takes over keeps the stretch, and a body that is put somewhere loses it") {
  BoxOnSlope box(0.5, 0.8 * std::atan(0.5));
  box.open();
  box.run(2);
  const h6BodyState rest = box.body();
  const double stretch = 0.1 * g * std::sin(0.8 * std::atan(0.5)) / 1e4;
  const auto slipped = [&] { return norm(box.body().pose.p - rest.pose.p); };
  const auto next = [&] {
    h6Session* made = h6CreateSession(box.model.handle, &box.def, nullptr);
    REQUIRE(made);
    return made;
  };
  h6Session* before = box.session;
  box.session = next();
  REQUIRE(h6TakeOver(box.session, before, nullptr));
  h6DestroySession(before);
  box.run(1);
  CHECK(slipped() < 1e-8);

  h6SetBody(box.session, 1, &rest);
  box.run(1);
  CHECK(slipped() > 0.9 * stretch);
  CHECK(slipped() < 1.5 * stretch);

  // A session without friction does not hold the box, and has nothing to hand on.
  box.def.contact.friction = 0, box.def.contact.method = H6_METHOD_SERIES;
  before = box.session;
  box.session = next();
  REQUIRE(h6TakeOver(box.session, before, nullptr));
  h6DestroySession(before);
  CHECK(box.session->frictions.empty());
  box.run(0.05);
  CHECK(box.body().velocity.linear.x > 0.1);
}

TEST_CASE("points with relief carry no load, so a restarted fit ends friction") {
  BoxOnSlope box(0.5, 0.8 * std::atan(0.5));
  box.open();
  box.run(1);
  const double before = box.session->frictions[0].f.norm();
  REQUIRE(h6RestartFit(box.session, nullptr));
  box.run(0.001);
  CHECK(before > 0.1);
  CHECK(box.session->frictions[0].f.norm() < 1e-3 * before);
}

TEST_CASE("without friction a session has no springs, and the setting has its range") {
  BoxOnFloor box;
  box.def.contact.method = H6_METHOD_SERIES;  // under firm pushes that lean rub
  box.open();
  const std::size_t bytes = box.session->memory_bytes;
  CHECK(box.session->frictions.empty());
  CHECK(box.session->near.pairs[0].friction == nullptr);
  box.def.contact.friction = 0.1;
  box.open();
  CHECK(box.session->memory_bytes > bytes);
  for (const double mu : {-0.1, 10.1, HUGE_VAL, std::nan("")}) {
    box.def.contact.friction = mu;
    h6Error error{};
    CHECK_FALSE(h6CreateSession(box.model.handle, &box.def, &error));
    CHECK(std::strstr(error.message, "friction") != nullptr);
  }
}

TEST_CASE("a run with friction and substeps repeats to the bit, with one thread and with two") {
  struct Rubbing : BallInBowl {
    explicit Rubbing(unsigned threads) : BallInBowl(threads, 6000) {
      def.contact.friction = 0.4;
      bodies[1].velocity = {{1, 1, 0}, {0, 40, 10}};
      open();
    }
  } first(1), again(1), two(2);
  std::uint32_t substeps = 0;
  double rubbed = 0;
  for (int i = 0; i < 1500; ++i) {
    const h6DeviceSample sample = first.sample(3 * i);
    for (BallInBowl* run : {static_cast<BallInBowl*>(&first), static_cast<BallInBowl*>(&again),
                            static_cast<BallInBowl*>(&two)})
      h6Step(run->session, &sample, nullptr);
    const h6FrameReport report = h6GetFrame(first.session);
    REQUIRE(report.state_hash == h6GetFrame(again.session).state_hash);
    REQUIRE(report.state_hash == h6GetFrame(two.session).state_hash);
    substeps = std::max(substeps, report.substeps);
    rubbed = std::max(rubbed, first.session->frictions[0].f.head<3>().norm());
  }
  CHECK(substeps > 1);
  CHECK(rubbed > 0.5);
}
