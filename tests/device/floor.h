// SPDX-License-Identifier: Apache-2.0
// floor.h - a scene for devices that are pressed down: their forces, and what happens when they are
// lost.
#pragma once
#include <doctest/doctest.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

#include "hapsix/hapsix.h"
#include "hapsix/vector.h"

namespace h6::test {

// A floor at z = 0 and a part of one point, 5 mm above it, 1 kHz.
struct Floor {
  std::vector<float> d = std::vector<float>(512), far_grid = std::vector<float>(8);
  float zero = 0, up = 1;
  std::int32_t brick = 0;
  std::uint32_t rows[2] = {0, 1};
  h6Model* model = nullptr;
  h6Session* session = nullptr;
  h6BodyDef body[2] = {h6DefaultBodyDef(), h6DefaultBodyDef()};
  h6HandDef hand = h6DefaultHandDef();
  Floor() {
    for (int i = 0; i < 512; ++i) d[static_cast<std::size_t>(i)] = 5e-3f * (i / 64 - 4);
    for (std::size_t i = 0; i < 8; ++i) far_grid[i] = d[i < 4 ? 0 : 511];
    h6FieldDef field{};
    field.origin = {-0.02, -0.02, -0.02}, field.voxel_size = 5e-3;
    for (int& bricks : field.bricks) bricks = 1;
    field.brick_index = &brick, field.samples = d.data(), field.brick_count = 1;
    field.far_grid = far_grid.data(), field.band = 5e-3;
    const h6ShellDef tip{1, &zero, &zero, &zero, &zero, &zero, &up,     NULL,
                         1, rows,  rows,  &zero, rows,  rows,  nullptr, {}};
    h6ModelDef parts = h6DefaultModelDef();
    parts.fields = &field, parts.field_count = 1, parts.shells = &tip, parts.shell_count = 1;
    h6Error error{};
    model = h6CreateModel(&parts, &error);
    REQUIRE_MESSAGE(model, error.message);
    body[0].fixed = true, body[0].field = 0, body[1].shell = 0, body[1].pose.p.z = 5e-3;
    hand.body = 1;
    h6SessionDef def = h6DefaultSessionDef();
    def.bodies = body, def.body_count = 2, def.hands = &hand, def.hand_count = 1;
    session = h6CreateSession(model, &def, &error);
    REQUIRE_MESSAGE(session, error.message);
  }
  ~Floor() { h6DestroySession(session), h6DestroyModel(model); }
};

inline double force(const h6FrameRecord& r) { return norm(r.command[0].wrench.force); }

// A loop over the floor with one device; `rows` are its frames so far.
class FloorRun {
 public:
  FloorRun(const Floor& floor, const h6Device& device) : device_(device) {
    h6LoopDef def = h6DefaultLoopDef();
    def.ring_frames = 10000;
    h6Error error{};
    loop_ = h6StartLoop(floor.session, &device_, &def, &error);
    REQUIRE_MESSAGE(loop_, error.message);
  }
  ~FloorRun() {
    h6RequestStop(loop_);
    h6LoopReport report;
    h6JoinLoop(loop_, &report);
    h6DestroyLoop(loop_);
  }
  // Whether the newest frame satisfies it within five seconds.
  template <class Condition>
  bool until(Condition condition) {
    for (int i = 0; i < 1000; ++i) {
      read();
      if (!rows.empty() && condition(rows.back())) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
  }
  void read() {
    std::vector<h6FrameRecord> taken(256);
    while (const std::size_t n = h6ReadRecords(loop_, taken.data(), taken.size()))
      rows.insert(rows.end(), taken.begin(), taken.begin() + static_cast<long>(n));
  }
  h6Loop* loop() { return loop_; }

  // A device that is lost: zero force with its cause, in its state; there again it renders nothing
  // until it is armed by hand. `fail` breaks it, `mend` mends it.
  template <class Fail, class Mend>
  void check_loss(Fail fail, Mend mend) {
    REQUIRE(force_comes());
    fail();
    REQUIRE(until([](const h6FrameRecord& r) {
      return (r.report.status & H6_DEVICE_LOST) && force(r) == 0;
    }));
    const h6Cause cause = rows.back().command[0].cause;
    CHECK_MESSAGE((cause == H6_CAUSE_DEVICE_LOST || cause == H6_CAUSE_WATCHDOG ||
                   cause == H6_CAUSE_LATE || cause == H6_CAUSE_FROZEN),
                  std::string(h6CauseName(cause)));
    mend();
    REQUIRE(until([](const h6FrameRecord& r) { return !(r.report.status & H6_DEVICE_LOST); }));
    const std::size_t back = rows.size();
    REQUIRE(until([&](const h6FrameRecord&) { return rows.size() > back + 300; }));
    double most = 0;
    for (std::size_t i = back; i < rows.size(); ++i) most = std::max(most, force(rows[i]));
    CHECK(most == 0);
    CHECK(force_comes());
  }

  // Arms every half second until there is force: a busy machine may latch the output at any time.
  bool force_comes() {
    int looks = 0;
    return until([&](const h6FrameRecord& r) {
      if (force(r) > 0.5) return true;
      if (looks++ % 100 == 0) h6ArmLoop(loop_);
      return false;
    });
  }

  std::vector<h6FrameRecord> rows;

 private:
  h6Device device_;
  h6Loop* loop_ = nullptr;
};

}  // namespace h6::test
