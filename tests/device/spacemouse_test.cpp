// SPDX-License-Identifier: Apache-2.0
// spacemouse_test.cpp - the SpaceMouse's two threads with a simulated HID port: the newest report
// counts, old input is released; unplugging, LED, battery, permission.
#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <cstring>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "device/spacemouse.h"
#include "tests/device/spacemouse_samples.h"
#include "tests/support/near.h"

using namespace h6;
using namespace h6::device;
using h6::test::Bytes;
using h6::test::int16s;
using h6::test::operator+;

namespace {

const h6Pose origin{{0, 0, 0}, {1, 0, 0, 0}};

// One device that can be unplugged; it keeps what is written to it.
class Bench final : public HidPort {
 public:
  std::mutex lock;
  std::condition_variable more;
  std::deque<Bytes> queue;
  std::vector<Bytes> written;
  bool plugged = true, refused = false;
  std::vector<HidInterface> interfaces{interface("/dev/hidraw0", "A1")};

  static HidInterface interface(const char* path, const char* serial) {
    return {path,
            serial,
            "SpaceMouse Compact",
            0x256f,
            0xc635,
            1,
            8,
            h6::test::spacemouse_descriptor(false)};
  }
  std::vector<HidInterface> list() override {
    const std::lock_guard<std::mutex> guard(lock);
    return plugged ? interfaces : std::vector<HidInterface>{};
  }
  Result<std::unique_ptr<HidHandle>> open(const std::string& path) override {
    const std::lock_guard<std::mutex> guard(lock);
    if (refused) return Failure{path + ": you may not open this device"};
    opened = path;
    return std::unique_ptr<HidHandle>(new Handle(*this));
  }
  void send(const Bytes& report) {
    const std::lock_guard<std::mutex> guard(lock);
    queue.push_back(report);
    more.notify_all();
  }
  void plug(bool in) {
    const std::lock_guard<std::mutex> guard(lock);
    plugged = in;
    queue.clear();
    more.notify_all();
  }
  std::string opened;

 private:
  struct Handle final : HidHandle {
    explicit Handle(Bench& b) : bench(b) {}
    int read(std::span<std::uint8_t> report, int timeout_ms) override {
      std::unique_lock<std::mutex> guard(bench.lock);
      bench.more.wait_for(guard, std::chrono::milliseconds(timeout_ms),
                          [&] { return !bench.plugged || !bench.queue.empty(); });
      if (!bench.plugged) return -1;
      if (bench.queue.empty()) return 0;
      const Bytes got = bench.queue.front();
      bench.queue.pop_front();
      std::memcpy(report.data(), got.data(), std::min(report.size(), got.size()));
      return static_cast<int>(got.size());
    }
    bool write(std::span<const std::uint8_t> report) override {
      const std::lock_guard<std::mutex> guard(bench.lock);
      bench.written.emplace_back(report.begin(), report.end());
      return true;
    }
    Bench& bench;
  };
};

template <class Condition>
bool soon(Condition condition) {
  for (int i = 0; i < 5000; ++i) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return condition();
}

struct Opened {
  Bench bench;
  std::unique_ptr<SpaceMouse> mouse;
  h6Device device{};
  double time = 0;
  explicit Opened(SpaceMouseOptions options = {}) {
    options.rate.smoothing = 0;
    auto opened = SpaceMouse::open(bench, options, origin, {});
    REQUIRE(opened);
    mouse = std::move(*opened);
    device = mouse->device();
  }
  int read(h6DeviceSample& s) { return device.read(device.self, time += 1e-3, &s); }
  int feel(double newtons) {
    h6DeviceCommand c{};
    c.wrench.force.z = newtons;
    return device.write(device.self, time, &c);
  }
};

}  // namespace

TEST_CASE("a push moves the hand; only the newest of queued reports counts") {
  Opened o;
  h6DeviceSample s{};
  CHECK(o.read(s) == 0);
  CHECK(s.velocity.linear.x == 0);
  {
    const std::lock_guard<std::mutex> guard(o.bench.lock);
    for (int i = 0; i < 200; ++i) o.bench.queue.push_back(Bytes{1} + int16s({-350, 0, 0}));
    o.bench.queue.push_back(Bytes{1} + int16s({350, 0, 0}));
    o.bench.more.notify_all();
  }
  REQUIRE(soon([&] { return o.mouse->status().reports >= 201; }));
  CHECK(o.read(s) == 0);
  CHECK(s.velocity.linear.x == h6::test::near(0.1));
}

TEST_CASE("input that stops without a release is released after a tenth of a second") {
  Opened o;
  h6DeviceSample s{};
  o.bench.send(Bytes{1} + int16s({350, 0, 0}));
  REQUIRE(soon([&] { return o.mouse->status().reports == 1; }));
  std::this_thread::sleep_for(std::chrono::milliseconds(110));
  CHECK(o.read(s) == 0);
  CHECK(s.velocity.linear.x == 0);
  o.bench.send(Bytes{1} + int16s({350, 0, 0}));  // and counts again with the next report
  CHECK(soon([&] { return o.read(s) == 0 && s.velocity.linear.x > 0; }));
}

TEST_CASE("unplugged it is lost, at rest; replugged it goes on from where the hand was") {
  Opened o;
  h6DeviceSample s{};
  o.bench.send(Bytes{1} + int16s({350, 0, 0}));
  REQUIRE(soon([&] { return o.read(s) == 0 && s.velocity.linear.x > 0; }));
  o.bench.plug(false);
  REQUIRE(soon([&] { return o.read(s) != 0; }));
  const h6Vec3 there = s.pose.p;
  CHECK(there.x > 0);
  CHECK(s.velocity.linear.x == 0);
  CHECK(o.feel(1) != 0);
  CHECK(!o.mouse->status().present);
  o.bench.interfaces = {Bench::interface("/dev/hidraw3", "B2"),
                        Bench::interface("/dev/hidraw7", "A1")};
  o.bench.plug(true);
  REQUIRE(soon([&] { return o.mouse->status().present; }));
  CHECK(o.bench.opened == "/dev/hidraw7");  // the same device at another node
  CHECK(o.mouse->status().replugs == 1);
  CHECK(o.read(s) == 0);
  CHECK(s.pose.p.x == there.x);
  CHECK(s.velocity.linear.x == 0);
  o.bench.send(Bytes{1} + int16s({-350, 0, 0}));
  CHECK(soon([&] { return o.read(s) == 0 && s.velocity.linear.x < 0; }));
}

TEST_CASE("another device of the same model does not take the place of the one that was lost") {
  Opened o;
  h6DeviceSample s{};
  o.bench.plug(false);
  REQUIRE(soon([&] { return o.read(s) != 0; }));
  o.bench.interfaces = {Bench::interface("/dev/hidraw3", "B2")};
  o.bench.plug(true);
  std::this_thread::sleep_for(std::chrono::milliseconds(600));
  CHECK(o.read(s) != 0);
}

TEST_CASE(
    "the light is on while a force is felt, off when it is gone and when the device is stopped") {
  Opened o;
  const auto written = [&] {
    const std::lock_guard<std::mutex> guard(o.bench.lock);
    return o.bench.written;
  };
  CHECK(o.feel(2) == 0);
  REQUIRE(soon([&] { return written().size() == 1; }));
  CHECK(o.feel(0.3) == 0);  // above half of the threshold: still lit
  std::this_thread::sleep_for(std::chrono::milliseconds(60));
  CHECK(written().size() == 1);
  o.feel(0);
  REQUIRE(soon([&] { return written().size() == 2; }));
  o.feel(2);
  REQUIRE(soon([&] { return written().size() == 3; }));
  o.device.stop(o.device.self);
  REQUIRE(soon([&] { return written().size() == 4; }));
  CHECK(written() == std::vector<Bytes>{{4, 1}, {4, 0}, {4, 1}, {4, 0}});
  CHECK(o.mouse->status().felt_force == 2);
}

TEST_CASE("battery and buttons are reported") {
  Opened o;
  o.bench.send({0x17, 64});
  o.bench.send({3, 2, 0});
  CHECK(soon([&] { return o.mouse->status().state.buttons == 2; }));
  CHECK(o.mouse->status().state.battery == 64);
  h6DeviceSample s{};
  CHECK(o.read(s) == 0);
  CHECK(s.buttons == 2);
}

TEST_CASE("none plugged in, another serial number, no permission: each is a sentence") {
  Bench bench;
  SpaceMouseOptions options;
  options.serial = "C3";
  CHECK(SpaceMouse::open(bench, options, origin, {}).error().find("C3") != std::string::npos);
  options.serial = "A1";
  CHECK(SpaceMouse::open(bench, options, origin, {}));
  bench.refused = true;
  CHECK(SpaceMouse::open(bench, options, origin, {}).error() ==
        "/dev/hidraw0: you may not open this device");
  bench.plugged = false;
  CHECK(SpaceMouse::open(bench, {}, origin, {}).error() == "no SpaceMouse is plugged in");
  options.rate.speed = -1;
  CHECK(SpaceMouse::open(bench, options, origin, {}).error().find("speed") != std::string::npos);
}
