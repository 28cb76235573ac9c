// SPDX-License-Identifier: Apache-2.0
// hid_mock_test.cpp - the path through hidapi with devices that umockdev simulates: they are found,
// opened, read, lit, unplugged and plugged in again.
#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <thread>
#include <utility>
#include <vector>

#include "device/spacemouse.h"
#include "tests/device/mock_hid.h"

using namespace h6;
using namespace h6::device;
using h6::test::Bytes;
using h6::test::int16s;
using h6::test::MockCap;
using h6::test::operator+;

namespace {

h6::test::MockMachine& machine() {
  static h6::test::MockMachine only;
  return only;
}

const h6Pose origin{{0, 0, 0}, {1, 0, 0, 0}};

template <class Condition>
bool soon(Condition condition) {
  for (int i = 0; i < 3000; ++i) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return condition();
}

void settle() { std::this_thread::sleep_for(std::chrono::milliseconds(10)); }

MockCap joint_cap() {
  MockCap cap{"B2", "SpaceMouse Pro Wireless", 0xc632};
  cap.descriptor = h6::test::spacemouse_descriptor(true);
  return cap;
}

}  // namespace

int main(int argc, char** argv) {
  if (!built_with_hidapi()) {
    std::printf("skipped: built without hidapi\n");
    return 77;
  }
  if (const int skipped = h6::test::enter_mock(argv)) return skipped;
  return doctest::Context(argc, argv).run();
}

TEST_CASE(
    "caps are found by their descriptor, with name, serial number and layout; a mouse is not") {
  MockCap split, joint = joint_cap();
  for (MockCap* cap : {&split, &joint}) REQUIRE(machine().plug(*cap));
  std::vector<SpaceMouseInfo> found = list_spacemice(system_hid());
  REQUIRE(found.size() == 2);
  if (found[0].hid.serial != "A1") std::swap(found[0], found[1]);
  CHECK(found[0].hid.path == "/dev/" + split.node);
  CHECK(found[0].hid.product == "SpaceMouse Compact");
  CHECK(found[0].layout == ReportLayout::split);
  CHECK(found[1].hid.serial == "B2");
  CHECK(found[1].layout == ReportLayout::joint);
  CHECK(found[1].hid.usage == 8);
  for (const MockCap& cap : {split, joint}) machine().unplug(cap);
  CHECK(list_spacemice(system_hid()).empty());
}

TEST_CASE("both layouts move a hand, buttons and battery are reported, the LED follows the force") {
  for (const bool joint : {false, true}) {
    CAPTURE(joint);
    MockCap cap = joint ? joint_cap() : MockCap{};
    REQUIRE(machine().plug(cap));
    SpaceMouseOptions options;
    options.serial = cap.serial;
    options.rate.smoothing = 0;
    auto mouse = SpaceMouse::open(system_hid(), options, origin, {});
    REQUIRE_MESSAGE(mouse, (mouse ? "" : mouse.error()));
    h6Device device = (*mouse)->device();
    double time = 0;
    h6DeviceSample s{};
    const auto read = [&] { return device.read(device.self, time += 1e-3, &s); };
    CHECK(read() == 0);
    REQUIRE(machine().send(
        cap, joint ? Bytes{1} + int16s({350, 0, 0, 0, 0, -350}) : Bytes{1} + int16s({350, 0, 0})));
    CHECK(soon([&] { return read() == 0 && s.velocity.linear.x > 0.09; }));
    if (!joint) REQUIRE(machine().send(cap, Bytes{2} + int16s({0, 0, -350})));
    CHECK(soon([&] { return read() == 0 && s.velocity.angular.z > 0.9; }));
    settle();
    REQUIRE(machine().send(cap, {3, 2, 0}));
    CHECK(soon([&] { return read() == 0 && s.buttons == 2; }));
    settle();
    REQUIRE(machine().send(cap, {0x17, 81, 0}));
    CHECK(soon([&] { return (*mouse)->status().state.battery == 81; }));
    h6DeviceCommand felt{};
    felt.wrench.force.z = 3;
    CHECK(device.write(device.self, time, &felt) == 0);
    CHECK(machine().received(cap, 2000) == Bytes{4, 1});
    device.stop(device.self);
    CHECK(machine().received(cap, 2000) == Bytes{4, 0});
    mouse->reset();
    machine().unplug(cap);
  }
}

TEST_CASE("pulled out it is lost; plugged in again at another node it goes on, at rest") {
  MockCap cap;
  REQUIRE(machine().plug(cap));
  auto mouse = SpaceMouse::open(system_hid(), {}, origin, {});
  REQUIRE(mouse);
  h6Device device = (*mouse)->device();
  double time = 0;
  h6DeviceSample s{};
  const auto read = [&] { return device.read(device.self, time += 1e-3, &s); };
  REQUIRE(machine().send(cap, Bytes{1} + int16s({0, 0, -350})));
  REQUIRE(soon([&] { return read() == 0 && s.velocity.linear.z > 0.05; }));
  machine().unplug(cap);
  REQUIRE(soon([&] { return read() != 0; }));
  const double there = s.pose.p.z;
  CHECK(s.velocity.linear.z == 0);
  REQUIRE(machine().plug(cap));
  REQUIRE(soon([&] { return read() == 0; }));
  CHECK(s.pose.p.z == there);
  CHECK((*mouse)->status().replugs == 1);
  REQUIRE(machine().send(cap, Bytes{1} + int16s({0, 0, -350})));
  CHECK(soon([&] { return read() == 0 && s.pose.p.z > there; }));
  mouse->reset();
  machine().unplug(cap);
}

TEST_CASE(
    "from a report to the hand that a frame at 1 kHz reads: every one arrives; the time is "
    "printed") {
  MockCap cap;
  REQUIRE(machine().plug(cap));
  SpaceMouseOptions options;
  options.rate.smoothing = 0;
  auto mouse = SpaceMouse::open(system_hid(), options, origin, {});
  REQUIRE(mouse);
  h6Device device = (*mouse)->device();
  using Clock = std::chrono::steady_clock;
  std::atomic<bool> ending{false};
  std::atomic<std::int64_t> seen_ns[2] = {0, 0};  // first motion of the hand in each direction
  std::thread frames([&] {
    auto deadline = Clock::now();
    double time = 0;
    int before = 0;
    while (!ending.load()) {
      std::this_thread::sleep_until(deadline += std::chrono::milliseconds(1));
      h6DeviceSample s{};
      (void)device.read(device.self, time += 1e-3, &s);
      const int now = s.velocity.linear.x > 0 ? 1 : s.velocity.linear.x < 0 ? -1 : 0;
      if (now != 0 && now != before)
        seen_ns[now > 0].store(Clock::now().time_since_epoch().count());
      before = now;
    }
  });
  std::vector<double> us;
  for (int i = 0; i < 100; ++i) {
    const int way = i % 2 ? 350 : -350;
    std::this_thread::sleep_for(std::chrono::microseconds(9000 + 137 * (i % 17)));  // any phase
    const auto sent = Clock::now();
    REQUIRE(machine().send(cap, Bytes{1} + int16s({way, 0, 0})));
    auto& seen = seen_ns[way > 0];
    if (soon([&] { return seen.load() >= sent.time_since_epoch().count(); }))
      us.push_back(1e-3 * static_cast<double>(seen.load() - sent.time_since_epoch().count()));
  }
  ending.store(true);
  frames.join();
  CHECK(us.size() == 100);
  std::sort(us.begin(), us.end());
  MESSAGE("report to hand pose: p50 ", us[us.size() / 2], " us, p95 ", us[us.size() * 95 / 100],
          " us, max ", us.back(), " us");
  mouse->reset();
  machine().unplug(cap);
}
