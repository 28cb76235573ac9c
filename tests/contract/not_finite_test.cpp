// SPDX-License-Identifier: Apache-2.0
// Numbers that are not finite, or that nothing can be, where no create function refuses them: each
// means what the headers say.
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "hapsix/hapsix.hpp"
#include "hapsix/io.h"
#include "runtime/examples/floor.h"
#include "tests/io/private_cache.h"

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
const double kNan = std::nan("");
constexpr double kStep = 1e-3;  // of the sessions here [s]

// A tip that its hand presses 1 mm into the floor.
struct Pressed {
  hapsix::Model model =
      hapsix::Model::make([](h6Error* e) { return floor_and_tip(h6DefaultModelDef(), e); });
  hapsix::Session session = hapsix::Session::make(
      [this](h6Error* e) { return hold_tip(model, h6DefaultSessionDef(), e); });
  h6DeviceCommand step() {
    h6DeviceSample in = h6DefaultDeviceSample();
    in.pose.p = {4e-3, 4e-3, 3e-3};
    h6DeviceCommand out;
    h6Step(session, &in, &out);
    return out;
  }
  // The last of so many steps that the output has risen.
  h6DeviceCommand rise() {
    for (int i = 0; i < 299; ++i) step();
    return step();
  }
};

bool finite(const h6DeviceCommand& c) {
  const h6Vec3 &f = c.wrench.force, &t = c.wrench.torque;
  return std::isfinite(f.x + f.y + f.z + t.x + t.y + t.z);
}

// The hand's command after 300 steps with this rating.
h6DeviceCommand rated(const h6DeviceCapabilities& rating) {
  Pressed pressed;
  h6SetRating(pressed.session, 0, &rating);
  return pressed.rise();
}

h6DeviceCapabilities usual() { return h6DefaultDevice().capabilities; }

bool same(const h6DeviceCommand& a, const h6DeviceCommand& b) {
  return std::memcmp(&a, &b, sizeof a) == 0;
}

}  // namespace

TEST_CASE("a place that is not finite is infinitely far from a field, and its neighbours are not") {
  const Pressed pressed;
  constexpr std::size_t count = 67;
  for (const double odd : {kNan, kInfinity, -kInfinity, 1e39, -1e300})
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::vector<double> points, distance(count, 7), gradient(3 * count, 7);
      std::vector<std::uint8_t> exact(count, 7);
      for (std::size_t i = 0; i < count; ++i) points.insert(points.end(), {4e-3, 4e-3, 5e-3});
      points[3 * 5 + axis] = points[3 * 66 + axis] = odd;
      REQUIRE(h6SampleField(pressed.model, 0, points.data(), count, distance.data(),
                            gradient.data(), exact.data()) == 0);
      for (std::size_t i = 0; i < count; ++i) {
        const bool spoilt = i == 5 || i == 66;
        CHECK((spoilt ? distance[i] == kInfinity : std::fabs(distance[i] - 1e-3) < 1e-9));
        CHECK((gradient[3 * i] == 0 && gradient[3 * i + 1] == 0));
        CHECK(gradient[3 * i + 2] == (spoilt ? 0 : 1));
        CHECK(exact[i] == !spoilt);
      }
    }
}

TEST_CASE("an interval that no clock gives is in time, or as late as can be") {
  Pressed pressed;
  pressed.rise();
  const auto overdue = [&](double seconds) {
    h6NoteInterval(pressed.session, seconds);
    CHECK(finite(pressed.step()));
    return h6GetSafetyInput(pressed.session, 0).overdue;
  };
  for (const double in_time : {kNan, -kInfinity, -1.0, 0.0, kStep, 2 * kStep})
    CHECK(overdue(in_time) == 0);
  CHECK(overdue(3 * kStep) == doctest::Approx(2 * kStep));
  for (const double late : {kInfinity, 1e300, 1e6}) CHECK(overdue(late) == 1e6 - kStep);
  pressed.step();
  CHECK(h6GetSafetyInput(pressed.session, 0).overdue == 0);  // for the next step only
}

TEST_CASE("an overdue that is not finite is none, or as much as can be") {
  Pressed pressed;
  pressed.rise();
  for (const std::uint32_t asked : {0u, std::uint32_t{H6_ASKED_SLOW}}) {
    const auto overdue = [&](double seconds) {
      const h6SafetyInput input{asked, seconds};
      h6SetSafetyInput(pressed.session, 0, &input);
      CHECK(finite(pressed.step()));
      return h6GetSafetyInput(pressed.session, 0).overdue;
    };
    for (const double none : {kNan, -kInfinity, -1.0}) CHECK(overdue(none) == 0);
    CHECK(overdue(2 * kStep) == 2 * kStep);
    for (const double most : {kInfinity, 1e300}) CHECK(overdue(most) == 1e6);
  }
}

TEST_CASE("of a force that is NaN nothing is rendered, and one without end is the engine's most") {
  h6DeviceCapabilities rating = usual();
  const h6DeviceCommand plain = rated(rating);
  REQUIRE(plain.wrench.force.z > 0.5);
  for (const double none : {kNan, -kInfinity, -1.0, 0.0}) {
    rating.max_force = none;
    CHECK(rated(rating).wrench.force.z == 0);
  }
  Pressed strong, unrated;
  rating.max_force = rating.max_torque = kInfinity;
  rating.max_force_rate = rating.max_torque_rate = kInfinity;
  h6SetRating(strong.session, 0, &rating);
  const h6DeviceCommand most = strong.rise();
  CHECK(same(most, unrated.rise()));  // 100 N and 10 N m
}

TEST_CASE("another number of a rating that is NaN is not known") {
  const h6DeviceCommand plain = rated(usual());
  for (double h6DeviceCapabilities::*number :
       {&h6DeviceCapabilities::max_force_rate, &h6DeviceCapabilities::max_torque_rate,
        &h6DeviceCapabilities::max_velocity, &h6DeviceCapabilities::rate,
        &h6DeviceCapabilities::freeze_time}) {
    h6DeviceCapabilities rating = usual();
    rating.*number = kNan;
    CHECK(same(rated(rating), plain));
  }
}

TEST_CASE("an axis of a workspace with NaN is not limited, and the others are") {
  const auto held_at = [](double low, double high) {
    Pressed pressed;
    h6BodyDef body = h6DefaultBodyDef();
    h6HandDef hand = h6DefaultHandDef();
    body.shell = 0, hand.mode = H6_ADMITTANCE;
    const hapsix::Session session = hapsix::create_session(pressed.model, {&body, 1}, {&hand, 1});
    h6DeviceCapabilities rating = usual();
    rating.workspace_min = {low, -1e-3, -1}, rating.workspace_max = {high, 1e-3, 1};
    h6SetRating(session, 0, &rating);
    h6DeviceSample in = h6DefaultDeviceSample();
    h6DeviceCommand out;
    in.wrench.force = {1, 1, 0};
    for (int i = 0; i < 200; ++i) h6Step(session, &in, &out), in.pose = out.pose;
    return out.pose.p;
  };
  const h6Vec3 limited = held_at(-1e-3, 1e-3);
  CHECK((limited.x == doctest::Approx(1e-3) && limited.y == doctest::Approx(1e-3)));
  for (const h6Vec3 open : {held_at(kNan, 1e-3), held_at(-1e-3, kNan), held_at(kNan, kNan)}) {
    CHECK((open.x > 2e-3 && std::isfinite(open.x)));
    CHECK(open.y == doctest::Approx(1e-3));
  }
}

TEST_CASE("a body is not put where nothing can be") {
  Pressed pressed;
  pressed.rise();
  const h6BodyState here = h6GetBody(pressed.session, 1);
  const auto stays = [&](auto change) {
    h6BodyState state{{{4e-3, 4e-3, 6e-3}, {1, 0, 0, 0}}, {}};
    change(state);
    h6SetBody(pressed.session, 1, &state);
    const h6BodyState now = h6GetBody(pressed.session, 1);
    return std::memcmp(&now, &here, sizeof here) == 0;
  };
  for (const double odd : {kNan, kInfinity, -kInfinity, 1.1e6, -1.1e6}) {
    CHECK(stays([&](h6BodyState& s) { s.pose.p.y = odd; }));
    CHECK(stays([&](h6BodyState& s) { s.velocity.linear.x = odd; }));
    CHECK(stays([&](h6BodyState& s) { s.velocity.angular.z = odd; }));
  }
  for (const double length : {kNan, kInfinity, 0.0, 0.49, 2.01})
    CHECK(stays([&](h6BodyState& s) { s.pose.q = {0, length, 0, 0}; }));
  CHECK_FALSE(stays([&](h6BodyState& s) { s.pose.q = {0, 1.99, 0, 0}; }));
}

TEST_CASE("rows that are not finite are recorded as they are, and a path has an end at infinity") {
  const hapsix::Scene scene =
      hapsix::Scene::make([](h6Error* e) { return h6ReadScene("box-on-wall", nullptr, e); });
  const std::string file = h6::test::private_cache.folder / "odd.h5";
  h6RecorderDef def = h6DefaultRecorderDef();
  def.scene = scene;
  const hapsix::Recorder recorder =
      hapsix::Recorder::make([&](h6Error* e) { return h6CreateRecorder(file.c_str(), &def, e); });
  const std::array<double, 5> odd{kNan, kInfinity, -kInfinity, 1e300, 5e-324};
  std::vector<h6FrameRecord> rows(odd.size());
  for (std::size_t i = 0; i < odd.size(); ++i) {
    rows[i].time = rows[i].hand[0].pose.p.x = rows[i].body[0].velocity.angular.y = odd[i];
    rows[i].command[0].wrench.torque.z = rows[i].report.max_depth = odd[i];
    rows[i].safety_input[0].overdue = odd[i], rows[i].report.frame = i;
  }
  REQUIRE(h6RecordFrames(recorder, rows.data(), rows.size(), nullptr));
  REQUIRE(h6FinishRecorder(recorder, nullptr, nullptr));
  const hapsix::Recording recording =
      hapsix::Recording::make([&](h6Error* e) { return h6ReadRecording(file.c_str(), e); });
  std::vector<h6FrameRecord> read(odd.size());
  REQUIRE(h6GetRecordingFrames(recording, 0, read.data(), read.size(), nullptr) == 5);
  const auto bits = [](double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; };
  for (std::size_t i = 0; i < odd.size(); ++i) {
    CHECK(bits(read[i].time, odd[i]));
    CHECK(bits(read[i].hand[0].pose.p.x, odd[i]));
    CHECK(bits(read[i].body[0].velocity.angular.y, odd[i]));
    CHECK(bits(read[i].command[0].wrench.torque.z, odd[i]));
    CHECK(bits(read[i].report.max_depth, odd[i]));
    CHECK(bits(read[i].safety_input[0].overdue, odd[i]));
  }
  h6DeviceSample at_end, at_infinity, at_start, before;
  REQUIRE(h6SampleScenePath(scene, 0, h6GetSceneDuration(scene) + 1, &at_end));
  REQUIRE(h6SampleScenePath(scene, 0, kInfinity, &at_infinity));
  REQUIRE(h6SampleScenePath(scene, 0, 0, &at_start));
  REQUIRE(h6SampleScenePath(scene, 0, -kInfinity, &before));
  CHECK(std::memcmp(&at_end.pose, &at_infinity.pose, sizeof at_end.pose) == 0);
  CHECK(std::memcmp(&at_start.pose, &before.pose, sizeof before.pose) == 0);
  CHECK_FALSE(h6SampleScenePath(scene, 0, kNan, &before));
}
