// SPDX-License-Identifier: Apache-2.0
// The contract grows without breaking programs: words of `reserved` that this library does not know
// are refused, codes stand beside sentences, and a session has one owner at a time.
#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <string>
#include <thread>
#include <vector>

#include "hapsix/hapsix.h"
#include "tests/support/analytic.h"
#include "tests/support/one_part.h"
#include "tests/support/reports.h"

using namespace h6::test;

namespace {

constexpr double mm = 1e-3;

OnePart box_on_floor() {
  return OnePart(sample_analytic([](double, double, double z) { return z; },
                                 {-32 * mm, -32 * mm, -16 * mm}, mm, 8, 8, 4),
                 bottom_face(10 * mm, 10 * mm, 5 * mm, 12, 12));
}

// A device in the time of frames that takes every command. Tests give it a read.
h6Device simulated_device() {
  h6Device device = h6DefaultDevice();
  device.capabilities.frame_time = true;
  device.write = [](void*, double, const h6DeviceCommand*) { return 0; };
  device.stop = [](void*) {};
  return device;
}

// Why a session of this scene is refused.
h6Error refusal(OnePart& scene) {
  h6Error error{};
  h6DestroySession(h6CreateSession(scene.model.handle, &scene.def, &error));
  return error;
}

template <class Def>
bool all_zero(const Def& def) {
  const Def zero{};
  return std::memcmp(&def.reserved, &zero.reserved, sizeof zero.reserved) == 0;
}

}  // namespace

TEST_CASE("default functions leave every word of `reserved` at zero") {
  CHECK(all_zero(h6DefaultFieldDef()));
  CHECK(all_zero(h6DefaultShellDef()));
  CHECK(all_zero(h6DefaultModelDef()));
  CHECK(all_zero(h6DefaultBodyDef()));
  CHECK(all_zero(h6DefaultPairDef()));
  CHECK(all_zero(h6DefaultContactDef()));
  CHECK(all_zero(h6DefaultContactArrays()));
  CHECK(all_zero(h6DefaultCouplingDef()));
  CHECK(all_zero(h6DefaultSafetyDef()));
  const h6HandDef hand = h6DefaultHandDef();
  CHECK((all_zero(hand) && all_zero(hand.filter) && all_zero(hand.coupling)));
  CHECK(all_zero(h6DefaultSessionDef()));
  CHECK(all_zero(h6DefaultLoopDef()));
  CHECK((all_zero(h6DefaultDevice()) && all_zero(h6DefaultDevice().capabilities)));
  CHECK((all_zero(h6DefaultDeviceSample()) && h6DefaultDeviceSample().pose.q.w == 1));
}

TEST_CASE("a definition that asks for what only a later version knows is refused by name") {
  const auto refused = [](auto change) {
    OnePart scene = box_on_floor();
    change(scene);
    const h6Error error = refusal(scene);
    CHECK((error.code == H6_ERROR_ARGUMENT) == (error.message[0] != 0));
    return std::string(error.message);
  };
  CHECK(refused([](OnePart&) {}) == "");
  const auto last = [](auto& def) { def.reserved[std::size(def.reserved) - 1] = 1; };
  CHECK(refused([&](OnePart& s) { last(s.def); }).find("reserved") == 0);
  CHECK(refused([&](OnePart& s) { last(s.def.contact); }).find("contact reserved") == 0);
  CHECK(refused([&](OnePart& s) { last(s.bodies[1]); }).find("body 1: reserved") == 0);
  CHECK(refused([&](OnePart& s) { last(s.hand); }).find("hand 0: reserved") == 0);
  CHECK(refused([&](OnePart& s) { last(s.hand.filter); }).find("hand 0: reserved") == 0);
  CHECK(refused([&](OnePart& s) { last(s.hand.safety); }).find("hand 0: reserved") == 0);
  CHECK(refused([&](OnePart& s) { last(s.hand.coupling); }).find("hand 0: coupling reserved") == 0);
  h6PairDef pair{1, 0, {}};
  last(pair);
  CHECK(refused([&](OnePart& s) {
          s.def.pairs = &pair, s.def.pair_count = 1;
        }).find("pair 0: reserved") == 0);
  h6Error error{};
  h6ModelDef model = h6DefaultModelDef();
  last(model);
  CHECK(h6CreateModel(&model, &error) == nullptr);
  h6FieldDef field{};
  last(field);
  model = h6DefaultModelDef(), model.fields = &field, model.field_count = 1;
  CHECK(h6CreateModel(&model, &error) == nullptr);
  CHECK(std::string(error.message).find("field 0: reserved") == 0);
}

TEST_CASE("so are a loop, its devices, and contacts to be weighed") {
  OnePart scene = box_on_floor();
  h6Session* session = h6CreateSession(scene.model.handle, &scene.def, nullptr);
  REQUIRE(session);
  const auto refused = [&](auto change) {
    h6Device device = simulated_device();
    device.read = [](void*, double, h6DeviceSample*) { return 1; };
    device.write = [](void*, double, const h6DeviceCommand*) { return 0; };
    device.stop = [](void*) {};
    device.capabilities.modes = H6_IMPEDANCE;
    h6LoopDef loop = h6DefaultLoopDef();
    change(device, loop);
    h6Error error{};
    CHECK(h6StartLoop(session, &device, &loop, &error) == nullptr);
    return std::string(error.message);
  };
  CHECK(refused([](h6Device& d, h6LoopDef&) { d.reserved[3] = 1; }).find("device: reserved") == 0);
  CHECK(refused([](h6Device& d, h6LoopDef&) {
          d.capabilities.reserved[7] = 1;
        }).find("device: capabilities: reserved") == 0);
  CHECK(refused([](h6Device&, h6LoopDef& l) { l.reserved[0] = 1; }).find("loop: reserved") == 0);
  h6DestroySession(session);
  const h6ContactDef contact = h6DefaultContactDef();
  h6ContactArrays arrays = h6DefaultContactArrays();
  arrays.reserved[0] = 1;
  h6Error error{};
  CHECK(h6WeighContacts(&contact, &arrays, mm, 10 * mm, nullptr, nullptr, nullptr, nullptr,
                        &error) != 0);
  CHECK(std::string(error.message).find("contacts: reserved") == 0);
}

TEST_CASE("a code stands beside every sentence") {
  OnePart scene = box_on_floor();
  scene.bodies[1].mass = std::nan("");
  CHECK(refusal(scene).code == H6_ERROR_RANGE);
  scene.bodies[1].mass = 0.1;
  scene.bodies[1].shell = 7;
  CHECK(refusal(scene).code == H6_ERROR_ARGUMENT);
  scene.bodies[1].shell = 0;
  scene.def.allocator.allocate = [](void*, std::size_t, std::size_t) -> void* { return nullptr; };
  scene.def.allocator.release = [](void*, void*, std::size_t) {};
  CHECK(refusal(scene).code == H6_ERROR_MEMORY);
  h6Error error{};
  CHECK(h6CreateModel(nullptr, &error) == nullptr);
  CHECK(error.code == H6_ERROR_ARGUMENT);
}

TEST_CASE("the version that runs can be told from the one that was compiled with") {
  CHECK(h6Version() == 10000 * H6_VERSION_MAJOR + 100 * H6_VERSION_MINOR + H6_VERSION_PATCH);
  CHECK(std::string(h6BuildInfo()).find("hapsix ") == 0);
  CHECK(std::string(h6BuildInfo()).find(", SIMD ") != std::string::npos);
}

TEST_CASE("sentences that no call returns go to the log, and nowhere without one") {
  std::vector<std::string> lines;
  const auto keep = [](void* user, h6LogLevel, const char* sentence) {
    static_cast<std::vector<std::string>*>(user)->push_back(sentence);
  };
  OnePart scene = box_on_floor();
  scene.bodies[1].pose = pose(0, 0, 4 * mm);  // a voxel deep
  h6SetLogHandler(keep, &lines);
  scene.open();
  h6SetLogHandler(nullptr, nullptr);
  REQUIRE(lines.size() == 1);
  CHECK(lines[0].find("body 1 starts 1 voxels deep in body 0, with 144 points") == 0);
  scene.open();
  h6Log(H6_LOG_WARNING, "nobody hears this");
  h6Log(H6_LOG_WARNING, nullptr);
  CHECK(lines.size() == 1);
}

TEST_CASE("a program hears of a failed assertion and says whether it goes on") {
  static std::vector<std::string> heard;
  h6SetAssertHandler([](const char* condition, const char* file, int line) {
    heard.push_back(std::string(condition) + " " + file + ":" + std::to_string(line));
    return 0;
  });
  const int went_on = h6AssertFailed("1 < 0", "here.cpp", 7);
  h6SetAssertHandler([](const char*, const char*, int) { return 1; });
  const int stopped = h6AssertFailed("2 < 0", "here.cpp", 8);
  h6SetAssertHandler(nullptr);
  CHECK(went_on == 0);
  CHECK(stopped == 1);
  REQUIRE(heard.size() == 1);
  CHECK(heard[0] == "1 < 0 here.cpp:7");
}

TEST_CASE("of two threads that step one session, one steps and the other gets a fault") {
  OnePart scene = box_on_floor();
  scene.bodies[1].pose = pose(0, 0, 6 * mm);
  scene.open();
  std::atomic<long> stepped{0}, refused{0};
  const auto work = [&] {
    for (int i = 0; i < 20000; ++i) {
      h6DeviceSample sample = hand_at(pose(0, 0, 5 * mm));
      h6DeviceCommand command;
      const bool fault = h6Step(scene.session, &sample, &command) == H6_OUTPUT_FAULT;
      (fault ? refused : stepped).fetch_add(1);
      CHECK(std::isfinite(command.wrench.force.z));
    }
  };
  std::thread one(work), two(work);
  one.join(), two.join();
  CHECK(stepped + refused == 40000);
  CHECK(h6GetFrame(scene.session).frame + 1 == static_cast<std::uint64_t>(stepped));
}

TEST_CASE("while a loop runs a session, others are refused and change nothing") {
  OnePart scene = box_on_floor();
  scene.bodies[1].pose = pose(0, 0, 6 * mm);
  scene.open();
  h6Device device = simulated_device();
  device.read = [](void*, double, h6DeviceSample* out) {
    *out = hand_at(pose(0, 0, 6 * mm));
    return 0;
  };
  h6LoopDef def = h6DefaultLoopDef();
  def.realtime = false;
  h6Error error{};
  h6Loop* loop = h6StartLoop(scene.session, &device, &def, &error);
  REQUIRE_MESSAGE(loop, error.message);
  h6DeviceSample sample = hand_at(pose(0, 0, 6 * mm));
  h6DeviceCommand command{};
  CHECK(h6Step(scene.session, &sample, &command) == H6_OUTPUT_FAULT);
  CHECK(h6StartLoop(scene.session, &device, &def, &error) == nullptr);
  CHECK(error.code == H6_ERROR_BUSY);
  CHECK_FALSE(h6RestartFit(scene.session, &error));
  CHECK(error.code == H6_ERROR_BUSY);
  // Neither does it take over, nor is it taken over.
  h6Session* const idle = h6CreateSession(scene.model.handle, &scene.def, nullptr);
  REQUIRE(idle);
  for (const bool from : {false, true}) {
    error = {};
    CHECK_FALSE(h6TakeOver(from ? idle : scene.session, from ? scene.session : idle, &error));
    CHECK(error.code == H6_ERROR_BUSY);
    CHECK(error.message[0] != 0);
  }
  const h6BodyState away{pose(1, 1, 1), {}};
  h6SetBody(scene.session, 1, &away);
  CHECK(h6ChangeSession(loop, scene.session, &error) == nullptr);
  h6RequestStop(loop);
  h6JoinLoop(loop, nullptr);
  CHECK(h6GetBody(scene.session, 1).pose.p.x == 0);
  CHECK(h6RestartFit(scene.session, &error));
  CHECK(h6TakeOver(idle, scene.session, &error));
  h6DestroySession(idle);
  CHECK(h6Step(scene.session, &sample, &command) != H6_OUTPUT_FAULT);
  // An old loop that is destroyed does not take the session from a new one.
  h6Loop* next = h6StartLoop(scene.session, &device, &def, &error);
  REQUIRE_MESSAGE(next, error.message);
  h6HaltLoop(loop);
  h6DestroyLoop(loop);
  CHECK(h6Step(scene.session, &sample, &command) == H6_OUTPUT_FAULT);
  h6LoopReport report;
  h6RequestStop(next);
  h6JoinLoop(next, &report);
  CHECK(report.fault == H6_CAUSE_NONE);  // nor does it fault its outputs
  h6DestroyLoop(next);
}

TEST_CASE("other threads can take force away from a loop's session, and give none") {
  OnePart scene = box_on_floor();
  scene.bodies[1].pose = pose(0, 0, 6 * mm);
  scene.open();
  h6Device device = simulated_device();
  device.capabilities.max_force = 0.2;
  device.read = [](void*, double t, h6DeviceSample* out) {  // pressed down
    *out = hand_at(pose(0, 0, (6 - 3 * std::min(1.0, 5 * t)) * mm));
    return 0;
  };
  h6LoopDef def = h6DefaultLoopDef();
  def.realtime = false, def.duration = 0, def.ring_frames = 20000;
  h6Error error{};
  h6Loop* loop = h6StartLoop(scene.session, &device, &def, &error);
  REQUIRE_MESSAGE(loop, error.message);
  std::vector<h6FrameRecord> rows(20000);
  double most = 0;
  h6FrameRecord newest{};
  const auto force = [](const h6FrameRecord& r) { return r.command[0].wrench.force.z; };
  const auto frames = [&](int count) {  // whole frames that begin after this call
    const std::uint64_t end = newest.report.frame + static_cast<std::uint64_t>(count);
    for (int i = 0; i < 30000 && newest.report.frame < end; ++i) {
      const std::size_t n = h6ReadRecords(loop, rows.data(), rows.size());
      for (std::size_t k = 0; k < n; ++k) most = std::max(most, force(rows[k]));
      if (n > 0) newest = rows[n - 1];
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  };
  frames(600);
  CHECK(force(newest) > 0.19);
  h6DeviceCapabilities strong{};
  strong.max_force = 50;
  h6SetRating(scene.session, 0, &strong);
  frames(300);
  CHECK(most <= 0.2 + 1e-9);

  h6Fault(scene.session, H6_CAUSE_OVERSPEED);
  frames(20);
  CHECK(force(newest) == 0);
  CHECK(newest.command[0].cause == H6_CAUSE_OVERSPEED);
  h6Arm(scene.session), h6Rearm(scene.session);
  const h6SafetyInput armed{H6_ASKED_ARM, 0};
  h6SetSafetyInput(scene.session, 0, &armed);
  h6NoteInterval(scene.session, 10);
  h6SetCoarse(scene.session, 1, 1);
  most = 0;
  frames(300);
  CHECK(most == 0);
  CHECK(newest.report.coarse_pairs == 0);
  h6ArmLoop(loop);
  frames(600);
  CHECK(force(newest) > 0.19);

  h6Disarm(scene.session);
  frames(300);
  CHECK(force(newest) == 0);
  h6ArmLoop(loop);
  frames(600);
  CHECK(force(newest) > 0.19);
  h6LoseDevice(scene.session, 0);
  frames(20);
  CHECK(force(newest) == 0);
  CHECK(newest.command[0].cause == H6_CAUSE_DEVICE_LOST);
  h6Fault(scene.session, H6_CAUSE_OVERSPEED);  // perhaps too late for a frame
  h6DestroyLoop(loop);
  CHECK(safety_of(scene.session, 0).fault != H6_CAUSE_NONE);
}

TEST_CASE("a device that ends its own loop asks for the end, and the program joins") {
  OnePart scene = box_on_floor();
  scene.open();
  struct Ends {
    std::atomic<h6Loop*> loop{nullptr};
    std::atomic<int> reads{0};
  } ends;
  h6Device device = simulated_device();
  device.self = &ends;
  device.read = [](void* self, double, h6DeviceSample* out) {
    auto& e = *static_cast<Ends*>(self);
    *out = hand_at(pose(0, 0, 6 * mm));
    h6LoopReport report;
    std::memset(&report, 0xff, sizeof report);
    if (++e.reads != 50) return 0;
    while (!e.loop) std::this_thread::yield();  // h6StartLoop has not returned yet
    h6JoinLoop(e.loop, &report);
    const int bad = report.frames != 0;
    h6DestroyLoop(e.loop);
    return bad;
  };
  h6LoopDef def = h6DefaultLoopDef();
  def.realtime = false, def.duration = 0;
  ends.loop = h6StartLoop(scene.session, &device, &def, nullptr);
  REQUIRE(ends.loop);
  h6LoopReport report;
  h6JoinLoop(ends.loop, &report);
  CHECK(report.frames == 50);
  CHECK((report.status & H6_DEVICE_LOST) == 0);
  h6DestroyLoop(ends.loop);
}

TEST_CASE("a program that steps by itself gets the rows that a loop would give") {
  OnePart scene = box_on_floor();
  scene.bodies[1].pose = pose(0, 0, 6 * mm);
  scene.open();
  h6DeviceSample sample = hand_at(pose(0, 0, 4.5 * mm));
  h6DeviceCommand command{};
  for (int i = 0; i < 50; ++i) h6Step(scene.session, &sample, &command);
  h6FrameRecord row;
  h6GetRecord(scene.session, &sample, &command, &row);
  CHECK(row.report.frame == 49);
  CHECK(row.time == doctest::Approx(0.049));
  CHECK(row.report.state_hash == h6GetFrame(scene.session).state_hash);
  CHECK(row.command[0].wrench.force.z == command.wrench.force.z);
  CHECK(row.body[0].pose.p.z == h6GetBody(scene.session, 1).pose.p.z);
  CHECK(row.state[0] == safety_of(scene.session, 0).state);
  for (const bool whole : {false, true}) {
    h6GetRecord(whole ? nullptr : scene.session, nullptr, &command, &row);
    CHECK(row.report.state_hash == 0);
  }
  h6GetRecord(scene.session, &sample, &command, nullptr);
}
