// SPDX-License-Identifier: Apache-2.0
// odd_hands_test.cpp - hands with faults, hands that follow a script, hands that repeat a
// recording.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "device/bad_operator.h"
#include "device/device_spec.h"
#include "device/path_device.h"
#include "device/recorded_hand.h"
#include "device/scripted_hand.h"
#include "hapsix/vector.h"
#include "tests/support/near.h"

using namespace h6;
using namespace h6::device;
using h6::test::near;

namespace {

const h6Pose origin{{0, 0, 0}, {1, 0, 0, 0}};

// Moves slowly to x = 0.1 m in 100 s, so that no two samples are equal.
std::unique_ptr<PathDevice> drift() {
  return std::move(*PathDevice::open({{0, 100}, {origin, {{0.1, 0, 0}, {1, 0, 0, 0}}}}));
}

struct Seen {
  std::vector<h6DeviceSample> samples;
  std::vector<int> lost;
  std::array<std::uint64_t, kTroubles> times{};
};

Seen run_bad(BadOperatorFigures f, double seconds) {
  auto path = drift();
  Result<BadOperator> bad = BadOperator::open(path->device(), f);
  REQUIRE(bad);
  h6Device d = bad->device();
  Seen seen;
  const h6DeviceCommand command{};
  for (int i = 0; i < static_cast<int>(seconds * 1000); ++i) {
    h6DeviceSample s{};
    int lost = d.read(d.self, 1e-3 * i, &s);
    CHECK(d.write(d.self, 1e-3 * i, &command) == lost);
    seen.samples.push_back(s);
    seen.lost.push_back(lost);
  }
  seen.times = bad->times();
  return seen;
}

bool finite(const h6DeviceSample& s) {
  const h6Quat& q = s.pose.q;
  return std::isfinite(s.pose.p.x + s.pose.p.y + s.pose.p.z + q.w + q.x + q.y + q.z +
                       s.velocity.linear.x + s.velocity.linear.y + s.velocity.linear.z +
                       s.velocity.angular.x + s.wrench.force.x);
}
double off_path(const h6DeviceSample& s, double t) {
  return std::hypot(s.pose.p.x - 1e-3 * t, s.pose.p.y, s.pose.p.z);
}
BadOperatorFigures only(Trouble kind) {
  BadOperatorFigures f;
  f.kinds = 1u << static_cast<unsigned>(kind);
  f.every = 0.2;
  return f;
}

}  // namespace

TEST_CASE("a bad operator: the same seed gives the same trouble to the bit, another seed another") {
  BadOperatorFigures f;
  f.every = 0.1;
  const Seen a = run_bad(f, 30), b = run_bad(f, 30);
  CHECK(a.times == b.times);
  CHECK(a.lost == b.lost);
  CHECK(std::memcmp(a.samples.data(), b.samples.data(), a.samples.size() * sizeof a.samples[0]) ==
        0);
  for (const std::uint64_t n : a.times) CHECK(n > 3);  // each kind comes
  f.seed = 2;
  CHECK(run_bad(f, 30).lost != a.lost);
}

TEST_CASE("each kind of trouble does what its name says, and nothing else") {
  for (std::size_t k = 0; k < kTroubles; ++k) {
    const Trouble kind = static_cast<Trouble>(k);
    CAPTURE(std::string(trouble_name(kind)));
    const BadOperatorFigures f = only(kind);
    const Seen seen = run_bad(f, 20);
    double farthest = 0, largest_step = 0;
    std::size_t lost = 0, bad = 0, same = 0;
    for (std::size_t i = 1; i < seen.samples.size(); ++i) {
      lost += seen.lost[i] != 0;
      if (seen.lost[i]) continue;
      const h6DeviceSample &s = seen.samples[i], &before = seen.samples[i - 1];
      bad += !finite(s) || std::fabs(dot(s.pose.q, s.pose.q) - 1) > 1e-9;
      same +=
          off_path(s, 1e-3 * static_cast<double>(i)) < 1 && std::memcmp(&s, &before, sizeof s) == 0;
      if (!finite(s) || !finite(before) || seen.lost[i - 1]) continue;
      farthest = std::max(farthest, off_path(s, 1e-3 * static_cast<double>(i)));
      largest_step =
          std::max(largest_step, off_path(s, 1e-3 * static_cast<double>(i) - 1e-3) -
                                     off_path(before, 1e-3 * static_cast<double>(i) - 1e-3));
    }
    CHECK(seen.times[k] > 20);
    CHECK((lost > 0) == (kind == Trouble::unplug));
    CHECK((bad > 0) == (kind == Trouble::nan));
    CHECK((same > 0) == (kind == Trouble::freeze));
    if (kind == Trouble::shake) CHECK((farthest > 1e-3 && farthest <= f.shake));
    if (kind == Trouble::jerk) CHECK((farthest > 0.02 && farthest <= f.jerk));
    if (kind == Trouble::jump) CHECK((farthest > 0.1 && farthest <= f.jump && largest_step > 0.1));
    if (kind == Trouble::unplug) CHECK(farthest < 1e-12);
  }
}

TEST_CASE("a shaking hand reports its own velocity") {
  const Seen seen = run_bad(only(Trouble::shake), 20);
  double worst = 0, fastest = 0;
  for (std::size_t i = 1; i + 1 < seen.samples.size(); ++i) {
    const h6DeviceSample &a = seen.samples[i - 1], &s = seen.samples[i], &b = seen.samples[i + 1];
    const double v = (b.pose.p.z - a.pose.p.z) / 2e-3;
    if (off_path(a, 1e-3 * static_cast<double>(i - 1)) < 1e-9 ||
        off_path(b, 1e-3 * static_cast<double>(i + 1)) < 1e-9)
      continue;  // a fault begins or ends here
    worst = std::max(worst, std::fabs(v - s.velocity.linear.z));
    fastest = std::max(fastest, std::fabs(v));
  }
  CHECK(fastest > 0.1);
  CHECK(worst < 0.02 * fastest);
}

TEST_CASE("a script: moves, turns about the grip, comes home, holds, presses") {
  const h6Pose home{{0.01, 0, 0}, {1, 0, 0, 0}};
  const h6Vec3 grip{0.02, 0, 0};
  const auto script = read_hand_script(
      "# to the wall\nmove 0 0 -5 in 0.5\npress 2\nturn 0 0 90 in 1   # a quarter\n\nhold "
      "0.5\nrelease 2\nhome in 1\n",
      1e-3, home, grip);
  REQUIRE_MESSAGE(script, (script ? "" : script.error()));
  CHECK(script->path.duration() == near(3.0));
  CHECK(check_path(script->path));
  CHECK(script->path.at(0.5).pose.p.z == near(-5e-3));
  CHECK(script->path.at(0.25).pose.p.z == near(-2.5e-3));
  const h6DeviceSample turned = script->path.at(1.75);
  CHECK(turned.pose.q.z == near(std::sqrt(0.5)).epsilon(1e-9));
  // The grip stayed at x = 0.03, y = 0: the mesh frame hangs below it.
  CHECK(turned.pose.p.x == near(0.03).epsilon(1e-9));
  CHECK(turned.pose.p.y == near(-0.02).epsilon(1e-9));
  CHECK(script->path.at(3).pose.p.x == near(home.p.x).epsilon(1e-9));
  CHECK(std::fabs(script->path.at(3).pose.p.z) < 1e-12);
  auto path = PathDevice::open(script->path);
  ScriptedHand hand((*path)->device(), script->buttons);
  h6Device d = hand.device();
  h6DeviceSample s{};
  for (const auto& [t, buttons] : {std::pair{0.4, 0u}, {0.6, 4u}, {1.9, 4u}, {2.1, 0u}}) {
    CHECK(d.read(d.self, t, &s) == 0);
    CHECK(s.buttons == buttons);
  }
}

TEST_CASE("a sentence names the line of a script that is wrong") {
  for (const char* text :
       {"jump 1 2 3 in 1", "move 1 2 in 1", "move 1 2 3 in 0", "hold -1", "press 32",
        "move nan 0 0 in 1", "hold 1 2", "turn 1 2 3 for 1", "home", "hold 1e-300\nhold 1e-300"}) {
    const auto script = read_hand_script(std::string("hold 1\n") + text, 1, origin, {});
    CAPTURE(text);
    REQUIRE(!script);
    CHECK(script.error().find("line ") == 0);
  }
  CHECK(read_hand_script("", 1, origin, {}));
  CHECK(read_hand_script(std::string(20000, '\n'), 1, origin, {}).error().find("10000 lines") !=
        std::string::npos);
}

TEST_CASE("a recorded hand gives its samples to the bit, then stays where the last one was") {
  std::vector<h6DeviceSample> samples(50);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double u = static_cast<double>(i);
    samples[i] = {{{std::sin(u), u / 3, 0}, {1, 0, 0, 0}}, {{u, 0, 0}, {}}, 0, {}, 0, {}};
    samples[i].buttons = static_cast<std::uint32_t>(i);
  }
  auto hand = RecordedHand::open(samples, 1000);
  REQUIRE(hand);
  CHECK((*hand)->duration() == near(0.05));
  h6Device d = (*hand)->device();
  h6DeviceSample s{};
  for (std::size_t i = 0; i < samples.size(); ++i) {
    CHECK(d.read(d.self, static_cast<double>(i) * 1e-3, &s) == 0);
    CHECK(std::memcmp(&s.pose, &samples[i].pose, sizeof s.pose) == 0);
    CHECK(std::memcmp(&s.velocity, &samples[i].velocity, sizeof s.velocity) == 0);
    CHECK(s.buttons == samples[i].buttons);
  }
  CHECK(d.read(d.self, 1e6, &s) == 0);
  CHECK(s.pose.p.y == samples.back().pose.p.y);
  CHECK(s.velocity.linear.x == 0);
  CHECK(!RecordedHand::open({}, 1000));
}

TEST_CASE("the name of a device is parsed; an error in it is a sentence") {
  const auto spec = parse_device_spec("plugin:./a:b.so?host=10.0.0.7&empty=&x=a?b");
  REQUIRE(spec);
  CHECK(spec->name == "plugin");
  CHECK(spec->target == "./a:b.so");
  REQUIRE(spec->options.size() == 3);
  CHECK(spec->options[1].second.empty());
  CHECK(spec->options[2].second == "a?b");
  CHECK(parse_device_spec("spacemouse?speed").error().find("KEY=VALUE") != std::string::npos);
  CHECK(parse_device_spec("a?x=1&x=2").error().find("stands twice") != std::string::npos);
  CHECK(!parse_device_spec("a?"));
  double speed = 1;
  const auto read = [&](const char* text) {
    const DeviceSpec given = *parse_device_spec(text);
    OptionReader reader(given);
    reader.number("speed", 0, 10, speed);
    return reader.finish();
  };
  CHECK(read("a?speed=2.5"));
  CHECK(speed == 2.5);
  for (const char* wrong : {"a?speed=11", "a?speed=nan", "a?speed=", "a?speed=1x"})
    CHECK(read(wrong).error().find("a number from 0 to 10") != std::string::npos);
  CHECK(read("a?sped=1").error().find("it takes speed") != std::string::npos);
}
