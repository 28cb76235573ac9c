// SPDX-License-Identifier: Apache-2.0
// The loop of devices, session and clock: what it runs, counts and hands over.
#include <doctest/doctest.h>
#include "tests/support/near.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <string>
#include <thread>
#include <vector>

#include "hapsix/hapsix.h"
#include "tests/support/analytic.h"
#include "tests/support/reports.h"

using namespace h6::test;

namespace {

constexpr double mm = 1e-3;

// A device that sinks 3 mm into the floor within a tenth of a second.
struct Pusher {
  std::vector<h6DeviceCommand> written;
  std::atomic<int> stops{0};
  std::atomic<int> arms{0}, writes{0};
  std::atomic<bool> refuses{false};
  int fail_read_at = -1, fail_write_at = -1, nan_at = -1;
  int reads = 0;
  int hangs_at = -1;
  std::chrono::microseconds write_takes{0};
  double hung = 0;
  std::uint64_t counted = 0;

  h6Device device() {
    h6Device d{};
    d.self = this;
    d.capabilities.max_force = 20, d.capabilities.max_torque = 2;
    d.read = [](void* self, double t, h6DeviceSample* out) {
      auto& p = *static_cast<Pusher*>(self);
      if (p.hangs_at < 0 || p.reads < p.hangs_at) p.hung = t, ++p.counted;
      t = p.hung;
      *out = hand_at(pose(0, 0, (5.2 - 3 * std::min(1.0, 10 * t)) * mm));
      if (p.hangs_at >= 0) out->sequence = p.counted;
      if (p.reads == p.nan_at) out->pose.p.x = NAN;
      return p.reads++ == p.fail_read_at ? -1 : 0;
    };
    d.write = [](void* self, double, const h6DeviceCommand* c) {
      auto& p = *static_cast<Pusher*>(self);
      if (p.write_takes.count() > 0) std::this_thread::sleep_for(p.write_takes);
      p.written.push_back(*c);
      ++p.writes;
      return static_cast<int>(p.written.size()) - 1 == p.fail_write_at ? -1 : 0;
    };
    d.stop = [](void* self) { ++static_cast<Pusher*>(self)->stops; };
    d.arm = [](void* self) {
      ++static_cast<Pusher*>(self)->arms;
      return static_cast<Pusher*>(self)->refuses.load() ? -1 : 0;
    };
    return d;
  }
};

struct Scene {
  FieldArrays field = sample_analytic([](double, double, double z) { return z; },
                                      {-32 * mm, -32 * mm, -16 * mm}, mm, 8, 8, 4);
  ShellArrays shell = bottom_face(10 * mm, 10 * mm, 5 * mm, 12, 12);
  Model model{{def_of(field)}, {shell.def()}};
  h6Session* session = nullptr;
  Pusher pusher;

  Scene() {
    std::array<h6BodyDef, 2> bodies{h6DefaultBodyDef(), h6DefaultBodyDef()};
    bodies[0].fixed = true, bodies[0].field = 0;
    bodies[1].shell = 0, bodies[1].pose = pose(0, 0, 5.2 * mm);
    h6HandDef hand = h6DefaultHandDef();
    hand.body = 1;
    h6SessionDef def = h6DefaultSessionDef();
    def.bodies = bodies.data(), def.body_count = 2;
    def.hands = &hand, def.hand_count = 1;
    session = h6CreateSession(model.handle, &def, nullptr);
    REQUIRE(session);
  }
  ~Scene() { h6DestroySession(session); }

  struct Run {
    h6LoopReport report;
    std::vector<h6FrameRecord> records;
  };
  Run run(double seconds, bool virtual_time) {
    h6LoopDef def = h6DefaultLoopDef();
    def.duration = seconds;
    def.virtual_time = virtual_time;
    const h6Device device = pusher.device();
    h6Error error{};
    h6Loop* loop = h6StartLoop(session, &device, &def, &error);
    REQUIRE_MESSAGE(loop, error.message);
    Run run;
    std::array<h6FrameRecord, 64> some;
    const auto drain = [&] {
      while (const std::size_t n = h6ReadRecords(loop, some.data(), some.size()))
        run.records.insert(run.records.end(), some.begin(),
                           some.begin() + static_cast<std::ptrdiff_t>(n));
    };
    while (h6LoopRunning(loop)) {
      drain();
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    h6JoinLoop(loop, &run.report);
    drain();
    h6DestroyLoop(loop);
    return run;
  }
};

}  // namespace

TEST_CASE("virtual time runs every frame, loses no record and stops the device") {
  Scene scene;
  const Scene::Run run = scene.run(3, true);
  CHECK(run.report.frames == 3000);
  REQUIRE(run.records.size() == 3000);
  CHECK(run.report.ring_overruns == 0);
  CHECK(scene.pusher.stops >= 1);
  for (std::size_t i = 0; i < run.records.size(); ++i) {
    REQUIRE(run.records[i].report.frame == i);
    REQUIRE(run.records[i].time == h6::test::near(1e-3 * static_cast<double>(i)));
  }
  CHECK(run.records.back().report.contacts == 144);
  CHECK(scene.pusher.written.back().wrench.force.z > 0.5);
  CHECK(run.report.fault == H6_CAUSE_NONE);
}

TEST_CASE("real time and virtual time give the same bits") {
  Scene a, b;
  const Scene::Run virt = a.run(0.4, true), real = b.run(0.4, false);
  REQUIRE(virt.records.size() == 400);
  REQUIRE(real.records.size() + real.report.ring_overruns == 400);
  for (const h6FrameRecord& r : real.records)
    REQUIRE(r.report.state_hash == virt.records[r.report.frame].report.state_hash);
}

TEST_CASE("a run in real time takes its duration, and reports what was granted") {
  Scene scene;
  const auto start = std::chrono::steady_clock::now();
  const Scene::Run run = scene.run(0.3, false);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  CHECK(run.report.frames == 300);
  CHECK(took.count() >= 0.299);
  CHECK(std::string(run.report.granted).size() > 20);
  // Each late frame has exactly one cause.
  for (const h6FrameRecord& r : run.records) CHECK((r.late & (r.late - 1)) == 0);
  CHECK(run.report.late_compute + run.report.late_stolen + run.report.late_wakeup <=
        run.report.frames);
}

TEST_CASE("a device that fails gets zero force from then on, with the cause") {
  for (const bool reading : {true, false}) {
    Scene scene;
    (reading ? scene.pusher.fail_read_at : scene.pusher.fail_write_at) = 500;
    const Scene::Run run = scene.run(1, true);
    CHECK(run.report.frames == 1000);
    CHECK(run.report.fault == H6_CAUSE_DEVICE_LOST);
    CHECK((run.report.status & H6_DEVICE_LOST) != 0);
    CHECK(scene.pusher.written[499].wrench.force.z > 0.1);
    for (std::size_t i = 501; i < scene.pusher.written.size(); ++i) {
      REQUIRE(scene.pusher.written[i].wrench.force.z == 0);
      REQUIRE(scene.pusher.written[i].cause == H6_CAUSE_DEVICE_LOST);
    }
  }
}

TEST_CASE("slow frames: a device that hangs loses its force by the clock on the wall") {
  Scene scene;
  // Each write takes 2.2 ms, and from the 100th reading on the sample is the same.
  scene.pusher.write_takes = std::chrono::microseconds(2200);
  scene.pusher.hangs_at = 100;
  const Scene::Run run = scene.run(0.4, false);
  std::size_t frozen = 0, slow = 0, zero = 0;
  for (const h6FrameRecord& row : run.records) {
    const bool pushes = row.command[0].wrench.force.z > 0;
    slow += (row.safety_input[0].asked & H6_ASKED_SLOW) != 0;
    if (row.report.frame > 100 && pushes) ++frozen;
    if (row.report.frame > 100 && !pushes) ++zero;
  }
  CHECK(slow > 50);
  CHECK(zero > 0);
  CHECK(frozen < 40);  // 70 at one millisecond a frame
  // With the same input of the chain, the frames come out the same to the bit.
  Scene again;
  const h6Device device = again.pusher.device();
  h6SetRating(again.session, 0, &device.capabilities);
  for (const h6FrameRecord& row : run.records) {
    h6SetSafetyInput(again.session, 0, &row.safety_input[0]);
    h6DeviceCommand command;
    h6Step(again.session, &row.hand[0], &command);
    REQUIRE(command.wrench.force.z == row.command[0].wrench.force.z);
  }
}

TEST_CASE("after one NaN from a hand the last good pose is used") {
  Scene scene;
  scene.pusher.nan_at = 400;
  const Scene::Run run = scene.run(1, true);
  CHECK(run.report.fault == H6_CAUSE_NONE);
  CHECK((run.records[400].report.status & H6_HAND_NOT_FINITE) != 0);
  CHECK((run.records[401].report.status & H6_HAND_NOT_FINITE) == 0);
  CHECK(std::isfinite(run.records.back().body[0].pose.p.x));
  CHECK(run.records.back().report.contacts == 144);
}

TEST_CASE("stopping from another thread ends an endless loop") {
  Scene scene;
  h6LoopDef def = h6DefaultLoopDef();
  const h6Device device = scene.pusher.device();
  h6Loop* loop = h6StartLoop(scene.session, &device, &def, nullptr);
  REQUIRE(loop);
  h6FrameRecord record;
  for (int seen = 0; seen < 5;) {
    seen += static_cast<int>(h6ReadRecords(loop, &record, 1));
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  CHECK(h6LoopRunning(loop));
  h6RequestStop(loop);
  const h6LoopReport report = h6::test::joined(loop);
  CHECK(report.frames >= 5);
  CHECK(!h6LoopRunning(loop));
  h6DestroyLoop(loop);
}

TEST_CASE("a loop that cannot run is refused with a sentence") {
  Scene scene;
  h6Error error{};
  h6LoopDef def = h6DefaultLoopDef();
  CHECK(h6StartLoop(scene.session, nullptr, &def, &error) == nullptr);
  CHECK(std::string(error.message).find("device") != std::string::npos);
  h6Device device = scene.pusher.device();
  device.read = nullptr;
  CHECK(h6StartLoop(scene.session, &device, &def, &error) == nullptr);
  device = scene.pusher.device();
  def.duration = NAN;
  CHECK(h6StartLoop(scene.session, &device, &def, &error) == nullptr);
  CHECK(std::string(error.message).find("duration") != std::string::npos);
}

namespace {

double most_force(const Pusher& pusher, std::size_t from = 0) {
  double most = 0;
  for (std::size_t i = from; i < pusher.written.size(); ++i)
    most = std::max(most, std::fabs(pusher.written[i].wrench.force.z));
  return most;
}

void wait_for_writes(const Pusher& pusher, int more) {
  for (const int then = pusher.writes + more; pusher.writes < then;)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

// The loop runs in real time and the devices in the time of frames, so nothing is late on a slow
// machine.
struct Live {
  Scene scene;
  h6Device device;
  h6LoopDef def = h6DefaultLoopDef();
  h6Loop* loop = nullptr;
  explicit Live(bool disarmed = false, bool refuses = false) : device(scene.pusher.device()) {
    device.capabilities.frame_time = true;
    scene.pusher.refuses = refuses;
    def.disarmed = disarmed;
    def.realtime = false;
    loop = h6StartLoop(scene.session, &device, &def, nullptr);
    REQUIRE(loop);
  }
  ~Live() { h6DestroyLoop(loop); }
  h6LoopReport end() {
    h6RequestStop(loop);
    return h6::test::joined(loop);
  }
};

}  // namespace

TEST_CASE("a loop arms its devices when it starts, and again on request") {
  Live live;
  wait_for_writes(live.scene.pusher, 300);
  CHECK(live.scene.pusher.arms == 1);
  h6ArmLoop(live.loop);
  wait_for_writes(live.scene.pusher, 3);
  CHECK(live.scene.pusher.arms == 2);
  const h6LoopReport report = live.end();
  CHECK(most_force(live.scene.pusher) > 0.5);
  CHECK(report.hand[0].state == H6_ACTIVE);
  CHECK(report.hand[0].times[H6_CAUSE_SOFT_START] == 1);
  CHECK(report.watchdog_trips == 0);
}

TEST_CASE("a loop that starts disarmed sends zero until it is armed, then rises softly") {
  Live live(true);
  wait_for_writes(live.scene.pusher, 300);
  CHECK(live.scene.pusher.arms == 0);
  h6ArmLoop(live.loop);
  wait_for_writes(live.scene.pusher, 200);
  h6DisarmLoop(live.loop);
  wait_for_writes(live.scene.pusher, 100);
  const h6LoopReport report = live.end();
  const std::vector<h6DeviceCommand>& written = live.scene.pusher.written;
  std::size_t first = 0;
  while (first < written.size() && written[first].wrench.force.z == 0) ++first;
  CHECK(first >= 300);
  REQUIRE(first < written.size());
  CHECK(written[first].wrench.force.z < 0.2);
  CHECK(most_force(live.scene.pusher) > 0.5);
  CHECK(written.back().wrench.force.z == 0);
  CHECK(written.back().cause == H6_CAUSE_DISARMED);
  CHECK(report.hand[0].state == H6_READY);
}

TEST_CASE("a device that refuses to be armed gets nothing") {
  Live live(false, true);
  wait_for_writes(live.scene.pusher, 200);
  h6ArmLoop(live.loop);
  wait_for_writes(live.scene.pusher, 100);
  live.end();
  CHECK(live.scene.pusher.arms == 2);
  CHECK(most_force(live.scene.pusher) == 0);
}

TEST_CASE(
    "halting stops the devices at once; nothing is written later, the loop ends, the cause is "
    "kept") {
  for (const bool all : {false, true}) {
    Live live;
    wait_for_writes(live.scene.pusher, 200);
    if (all)
      h6HaltAll();
    else
      h6HaltLoop(live.loop);
    CHECK(live.scene.pusher.stops >= 1);
    const int writes = live.scene.pusher.writes;
    const h6LoopReport report = h6::test::joined(live.loop);
    CHECK(live.scene.pusher.writes == writes);
    CHECK(report.fault == H6_CAUSE_STOPPED);
  }
}

TEST_CASE("limits above a device's rating are refused; limits below it hold") {
  Scene scene;
  h6SessionDef def = h6DefaultSessionDef();
  std::array<h6BodyDef, 2> bodies{h6DefaultBodyDef(), h6DefaultBodyDef()};
  bodies[0].fixed = true, bodies[0].field = 0;
  bodies[1].shell = 0, bodies[1].pose = pose(0, 0, 5.2 * mm);
  h6HandDef hand = h6DefaultHandDef();
  hand.body = 1;
  def.bodies = bodies.data(), def.body_count = 2;
  def.hands = &hand, def.hand_count = 1;
  const h6Device device = scene.pusher.device();
  h6LoopDef loop_def = h6DefaultLoopDef();
  loop_def.virtual_time = true;
  loop_def.duration = 0.5;
  h6Error error{};
  for (const double most : {25.0, 0.3}) {
    hand.safety.max_force = most;
    h6DestroySession(scene.session);
    scene.session = h6CreateSession(scene.model.handle, &def, &error);
    REQUIRE(scene.session);
    h6Loop* loop = h6StartLoop(scene.session, &device, &loop_def, &error);
    CHECK((loop != nullptr) == (most < 20));
    if (loop) {
      h6LoopReport report{};
      for (h6FrameRecord record; h6LoopRunning(loop);) (void)h6ReadRecords(loop, &record, 1);
      h6JoinLoop(loop, &report);
      CHECK(report.hand[0].frames[H6_CAUSE_CLAMPED] > 100);
      CHECK(most_force(scene.pusher) == h6::test::near(0.3));
      h6DestroyLoop(loop);
    } else {
      CHECK(std::string(error.message).find("max_force, 25 N, is above") != std::string::npos);
    }
  }
  hand.safety.decay_time = 0.05;
  CHECK(h6CreateSession(scene.model.handle, &def, &error) == nullptr);
  CHECK(std::string(error.message).find("decay_time") != std::string::npos);
}
