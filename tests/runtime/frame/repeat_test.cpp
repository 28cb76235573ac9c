// SPDX-License-Identifier: Apache-2.0
// A loop's records repeat its run bit for bit: missed deadlines, faults, requests and changed
// settings included, also where the safety chain's output moves the body.
#include <doctest/doctest.h>

#include <atomic>
#include <chrono>
#include <cstring>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/box_on_floor.h"
#include "tests/support/reports.h"

using namespace h6::test;

namespace {

// An arm in real time that a person pushes about. Everything that goes wrong is recorded.
struct Arm {
  std::uint32_t mode = H6_ADMITTANCE;
  int stall_at = -1, stall_ms = 0, lost_at = -1, hangs_from = 1 << 30, nan_at = -1;
  int reads = 0;

  h6Device device() {
    h6Device d{};
    d.self = this;
    d.capabilities.max_force = 20, d.capabilities.max_torque = 2;
    d.capabilities.max_velocity = 0.1;
    d.capabilities.modes = mode;
    d.read = [](void* self, double t, h6DeviceSample* out) {
      auto& a = *static_cast<Arm*>(self);
      const int read = a.reads++;
      const double z = a.mode == H6_IMPEDANCE ? 4 * mm : 5.2 * mm;  // else it is pushed down
      *out = hand_at(pose(2 * mm * std::sin(20 * t), 0, z));
      out->velocity.linear.x = 40 * mm * std::cos(20 * t);
      out->wrench.force = {0.5 * std::sin(15 * t), 0, -2};
      out->sequence = static_cast<std::uint32_t>(std::min(read, a.hangs_from) + 1);
      if (read == a.nan_at) out->pose.p.y = NAN;
      if (read == a.stall_at) std::this_thread::sleep_for(std::chrono::milliseconds(a.stall_ms));
      return read == a.lost_at ? -1 : 0;
    };
    d.write = [](void*, double, const h6DeviceCommand*) { return 0; };
    d.stop = [](void*) {};
    return d;
  }
};

struct Run {
  std::vector<h6FrameRecord> rows;
  h6LoopReport report{};
};

// `act(loop, frames so far)` is called now and then, on this thread. 0 seconds: it ends the run.
Run run(BoxOnFloor& box, const h6Device& device, double seconds,
        const std::function<void(h6Loop*, std::size_t)>& act = {}) {
  h6LoopDef def = h6DefaultLoopDef();
  def.duration = seconds, def.realtime = false, def.ring_frames = 4096;
  h6Loop* loop = h6StartLoop(box.session, &device, &def, nullptr);
  REQUIRE(loop);
  Run run;
  std::vector<h6FrameRecord> some(256);
  for (bool more = true; more;) {
    more = h6LoopRunning(loop);
    while (const std::size_t n = h6ReadRecords(loop, some.data(), some.size()))
      run.rows.insert(run.rows.end(), some.begin(), some.begin() + static_cast<std::ptrdiff_t>(n));
    if (act) act(loop, run.rows.size());
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  h6JoinLoop(loop, &run.report);
  h6DestroyLoop(loop);
  REQUIRE(run.report.ring_overruns == 0);
  return run;
}

// The first row that differs; rows.size() if no row does.
std::size_t parts_at(
    BoxOnFloor& box, const h6Device& device, const std::vector<h6FrameRecord>& rows,
    bool with_inputs, const std::function<void(std::uint32_t)>& change = [](std::uint32_t) {}) {
  box.open();
  h6SetRating(box.session, 0, &device.capabilities);
  std::uint32_t settings = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const h6FrameRecord& row = rows[i];
    REQUIRE(row.report.frame == i);
    for (; settings < row.settings; ++settings) change(settings);
    if (with_inputs) h6SetSafetyInput(box.session, 0, &row.safety_input[0]);
    h6DeviceCommand command{};
    h6Step(box.session, row.hand, &command);
    if (h6GetFrame(box.session).state_hash != row.report.state_hash ||
        h6::test::safety_of(box.session, 0).state != row.state[0])
      return i;
    // After a stop or a trip of the watchdog the loop does not send the computed command.
    const std::uint32_t outside = 1u << H6_CAUSE_STOPPED | 1u << H6_CAUSE_WATCHDOG;
    if (((row.command[0].causes ^ command.causes) & ~outside) != 0) return i;
    if ((row.command[0].causes & outside) == 0 &&
        std::memcmp(&row.command[0].pose, &command.pose, sizeof command.pose) != 0)
      return i;
  }
  return rows.size();
}

bool ever(const std::vector<h6FrameRecord>& rows, h6Cause cause) {
  for (const h6FrameRecord& row : rows)
    if (row.command[0].causes >> cause & 1u) return true;
  return false;
}

}  // namespace

TEST_CASE("an arm that was late, was disarmed and armed again moves the body the same way twice") {
  for (const std::uint32_t mode : {H6_ADMITTANCE, H6_PSEUDO_ADMITTANCE, H6_IMPEDANCE}) {
    CAPTURE(mode);
    bool seen = false;
    // A loaded machine may trip the watchdog first, which latches the output. Then try again.
    for (int attempt = 0; attempt < 8 && !seen; ++attempt) {
      BoxOnFloor box;
      box.hand.mode = mode;
      box.hand.safety.soft_start = 0.05;
      box.open();
      Arm arm;
      arm.mode = mode, arm.stall_at = 100, arm.stall_ms = 8;
      const h6Device device = arm.device();
      int asked = 0;
      std::size_t disarmed_at = 0;  // this thread may be starved: count from the frame it has seen
      const Run first = run(box, device, 0.6, [&](h6Loop* loop, std::size_t frames) {
        if (asked == 1 && frames > disarmed_at + 60) h6ArmLoop(loop), ++asked;
        if (asked == 0 && frames > 200) h6DisarmLoop(loop), disarmed_at = frames, ++asked;
      });
      seen = ever(first.rows, H6_CAUSE_LATE) && ever(first.rows, H6_CAUSE_DISARMED);
      if (!seen) continue;
      CHECK(parts_at(box, device, first.rows, true) == first.rows.size());
      // Without the events from outside the run differs.
      CHECK(parts_at(box, device, first.rows, false) < first.rows.size());
    }
    REQUIRE(seen);
  }
}

TEST_CASE(
    "faults, a lost device and the watchdog latch in the same frame twice, until it is armed") {
  struct Trouble {
    int stall_ms, lost_at, hangs_from, nan_at;
    h6Cause cause;
  };
  const int never = 1 << 30;
  for (const Trouble& t :
       {Trouble{150, -1, never, -1, H6_CAUSE_WATCHDOG},
        Trouble{0, 120, never, -1, H6_CAUSE_DEVICE_LOST}, Trouble{0, -1, 120, -1, H6_CAUSE_FROZEN},
        Trouble{0, -1, never, 120, H6_CAUSE_BAD_SAMPLE}}) {
    CAPTURE(std::string(h6CauseName(t.cause)));
    bool seen = false;
    // A machine that stalls latches the output; later events then have no effect.
    for (int attempt = 0; attempt < 8 && !seen; ++attempt) {
      BoxOnFloor box;
      box.hand.mode = H6_ADMITTANCE;
      box.open();
      Arm arm;
      if (t.stall_ms) arm.stall_at = 120;
      arm.stall_ms = t.stall_ms, arm.lost_at = t.lost_at, arm.hangs_from = t.hangs_from;
      arm.nan_at = t.nan_at;
      const h6Device device = arm.device();
      bool armed = false;
      const Run first = run(box, device, 0.5, [&](h6Loop* loop, std::size_t frames) {
        if (frames > 300 && !armed) h6ArmLoop(loop), armed = true;
      });
      seen = ever(first.rows, t.cause);
      CHECK(parts_at(box, device, first.rows, true) == first.rows.size());
    }
    CHECK(seen);
  }
}

TEST_CASE("a replay changes settings before the same frame as the run") {
  BoxOnFloor box;
  box.open();
  Arm arm;
  arm.mode = H6_IMPEDANCE;
  const h6Device device = arm.device();
  const std::vector<double> stiffness{2e3, 5e4, 1e4};
  std::size_t changed = 0;
  const auto softer = [&](double k) {
    h6SessionDef def = box.def;
    def.contact.stiffness = k;
    return h6CreateSession(box.model.handle, &def, nullptr);
  };
  // Frames are counted, and the run has no end of its own: this thread may be starved.
  const Run first = run(box, device, 0, [&](h6Loop* loop, std::size_t frames) {
    if (frames < 100 * (changed + 1)) return;
    if (changed == stiffness.size()) return h6RequestStop(loop);
    h6Session* next = softer(stiffness[changed++]);
    h6Session* before = h6ChangeSession(loop, next, nullptr);
    REQUIRE(before == box.session);
    h6DestroySession(before);
    box.session = next;
  });
  REQUIRE(first.rows.back().settings == stiffness.size());
  const auto again = [&](std::uint32_t number) {
    h6Session* next = softer(stiffness[number]);
    REQUIRE(h6TakeOver(next, box.session, nullptr));
    h6DestroySession(box.session);
    box.session = next;
  };
  CHECK(parts_at(box, device, first.rows, true, again) == first.rows.size());
  CHECK(parts_at(box, device, first.rows, true) < first.rows.size());
}

TEST_CASE("a session takes over only from one of the same bodies") {
  BoxOnFloor box, other;
  box.open(), other.open();
  h6Error error{};
  CHECK_FALSE(h6TakeOver(other.session, box.session, &error));
  CHECK(std::strstr(error.message, "same model") != nullptr);
  CHECK_FALSE(h6TakeOver(box.session, box.session, nullptr));
  CHECK_FALSE(h6TakeOver(box.session, nullptr, nullptr));
}
