// SPDX-License-Identifier: Apache-2.0
// Random sequences of calls that make models, run loops, change the session of a loop and read
// bodies that bend, with any arguments, in any order. Whatever comes: no crash, numbers are finite,
// a refusal has its sentence, and a loop gives back the session that it ran. HAPSIX_SEQUENCES sets
// how many there are. The functions of a session alone are in runtime/frame/random_calls_test.cpp.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "hapsix/hapsix.hpp"
#include "tests/support/bridge.h"
#include "tests/support/random_sequences.h"
#include "tests/support/sanitized.h"

using namespace h6::test;

namespace {

constexpr std::size_t kModes = 2, kRows = 16;

// A plate of few points that bends, and a small ball on it.
struct Common {
  BallOnBridge scene{60, kModes, 5e-3};
  struct Tally {
    long done = 0, failed = 0;
  };
  std::map<std::string, Tally> tally;
};

class Sequence {
 public:
  Sequence(std::uint64_t seed, Common& common) : random_(seed), common_(common) {}
  void call() {
    const std::uint64_t what = random_() % 32;
    if (what < 4) return create_session();
    if (what < 7) return start_loop();
    if (what < 14) return change_session();
    if (what < 18) return read_records();
    if (what < 21) return get_deformation();
    if (what < 23) return set_deformation();
    if (what < 25) return take_over();
    if (what < 27) return safety_input();
    if (what < 28) return create_model();
    if (what < 29) return end_loop();
    if (what < 30 && rarely()) return let_go();
    step();
  }

 private:
  bool rarely() { return random_() % 16 == 0; }
  double number(double usual) {
    static const double odd[] = {0, -usual, 1e-300, 1e300, -1e300, NAN, INFINITY, -INFINITY};
    const std::size_t b = random_() % 64;
    return b < 56 ? usual * (0.5 + 0.02 * static_cast<double>(b)) : odd[b - 56];
  }
  std::int32_t index() {
    static constexpr std::int32_t odd[] = {-1, 2, 77, INT32_MAX, INT32_MIN};
    const std::size_t b = random_() % 16;
    return b < 11 ? static_cast<std::int32_t>(b % 2) : odd[b - 11];
  }
  // A count that no array has, which must be refused before anything is read.
  template <class T>
  T wild() {
    return random_() % 2 ? T{0} : static_cast<T>(std::numeric_limits<T>::max() - random_() % 64);
  }
  template <class T>
  void spoil(std::vector<T>& values, T odd) {
    values[random_() % values.size()] = odd;
  }
  h6Session* any() {
    return sessions_.empty() || rarely() ? nullptr : sessions_[random_() % sessions_.size()].get();
  }
  // A loop changes its session while this thread reads it.
  bool watched(const h6Session* s) const { return kThreadSanitized && loop_ && s == running_; }
  bool judged(const char* function, bool done, const h6Error& error) {
    CAPTURE(function);
    REQUIRE(done == (error.message[0] == 0));
    REQUIRE(done == (error.code == H6_NO_ERROR));
    return tallied(function, done);
  }
  bool tallied(const char* function, bool done) {
    ++(done ? common_.tally[function].done : common_.tally[function].failed);
    return done;
  }

  void create_model() {
    FieldArrays field = common_.scene.field;
    BridgeArrays bridge(12, kModes);
    h6ShellDef shell = bridge.def();
    h6DeformableDef& bend = bridge.bend;
    switch (random_() % 16) {
      case 0:
        spoil(field.samples, static_cast<float>(number(1)));
        break;
      case 1:
        spoil(field.far, static_cast<float>(number(1)));
        break;
      case 2:
        spoil(field.index, index());
        break;
      case 3:
        spoil(bridge.shell.x, static_cast<float>(number(1)));
        break;
      case 4:
        spoil(bridge.shell.nz, static_cast<float>(number(1)));
        break;
      case 5:
        spoil(bridge.shell.first_child, static_cast<std::uint32_t>(index()));
        break;
      case 6:
        spoil(bridge.shell.radius, static_cast<float>(number(1)));
        break;
      case 7:
        spoil(bridge.modes, static_cast<float>(number(1)));
        break;
      case 8:
        spoil(bridge.linear, number(1));
        break;
      case 9:
        bend.mode_count = random_() % 2 ? 0 : H6_MAX_MODES + 1;
        break;
      case 10:
        bend.alpha = number(1), bend.beta = number(1e-3);
        break;
      case 11:
        shell.point_count = wild<std::size_t>();
        break;
      case 12:
        shell.level_count = wild<std::uint32_t>();
        break;
      default:
        break;
    }
    h6FieldDef field_def = def_of(field);
    if (rarely()) field_def.voxel_size = number(1e-3);
    if (rarely()) field_def.band = number(3e-3);
    if (rarely()) field_def.brick_count = random_() % (field_def.brick_count + 1);
    if (rarely()) field_def.bricks[random_() % 3] = wild<std::int32_t>();
    h6ModelDef def = h6DefaultModelDef();
    def.fields = rarely() ? nullptr : &field_def, def.field_count = 1;
    def.shells = rarely() ? nullptr : &shell, def.shell_count = 1;
    if (rarely()) def.field_count = wild<std::size_t>();
    if (rarely()) def.reserved[0] = 1;
    h6Error error{};
    h6Model* const made = h6CreateModel(rarely() ? nullptr : &def, &error);
    if (!judged("h6CreateModel", made != nullptr, error)) return;
    REQUIRE(h6ModelBytes(made) > 0);
    models_.emplace_back(made);
  }
  void create_session() {
    if (sessions_.size() >= 3) return;
    const BallOnBridge& scene = common_.scene;
    h6SessionDef def = scene.def;
    h6BodyDef bodies[2] = {scene.bodies[0], scene.bodies[1]};
    bodies[1].mass = number(0.1);
    if (rarely()) bodies[0].shell = index();
    if (rarely()) bodies[1].field = index();
    def.bodies = bodies, def.max_contacts = 1 + random_() % 64;
    if (rarely()) def.hand_count = 0;
    if (rarely()) def.rate = number(1000);
    const h6Model* const model =
        models_.empty() || random_() % 4 ? scene.model.handle : models_.back().get();
    h6Error error{};
    h6Session* const made =
        h6CreateSession(rarely() ? nullptr : model, rarely() ? nullptr : &def, &error);
    if (judged("h6CreateSession", made != nullptr, error)) sessions_.emplace_back(made);
  }
  void let_go() {
    end_loop();  // it may run one of these
    sessions_.clear(), models_.clear();
  }

  void start_loop() {
    h6Device device = h6DefaultDevice();
    device.capabilities.frame_time = true;
    device.read = [](void*, double t, h6DeviceSample* out) {
      *out = hand_at(pose(0.01 * std::sin(30 * t), 0, 9e-3));
      return 0;
    };
    device.write = [](void*, double, const h6DeviceCommand*) { return 0; };
    h6LoopDef def = h6DefaultLoopDef();
    def.realtime = false, def.virtual_time = true;
    // A loop without end goes on after its session was changed, if it waits for no reader.
    const bool endless = random_() % 4;
    def.duration = endless ? 0 : 0.01;
    def.ring_frames = endless && random_() % 4 ? 0 : kRows;
    if (rarely()) def.duration = number(0.01);
    if (rarely()) def.ring_inputs = random_() % 4;
    if (rarely()) def.ring_frames = SIZE_MAX;
    h6Session* const session = any();
    h6Error error{};
    h6Loop* const made = h6StartLoop(session, rarely() ? nullptr : &device, &def, &error);
    if (!judged("h6StartLoop", made != nullptr, error)) return;
    h6ArmLoop(made);
    if (loop_) return h6DestroyLoop(made);
    loop_ = hapsix::Loop(made), running_ = session, waits_ = def.ring_frames > 0;
  }
  void end_loop() {
    h6RequestStop(loop_);
    h6LoopReport report;
    h6JoinLoop(loop_, &report);
    REQUIRE(std::isfinite(report.wakeup_us_max));
    loop_ = {}, running_ = nullptr;
  }
  void change_session() {
    h6Session* const next = any();
    // One that waits for its reader would let the call wait for 2 s.
    if (waits_ && h6LoopRunning(loop_) && next && next != running_) return;
    h6Error error{};
    h6Session* const before = h6ChangeSession(rarely() ? nullptr : loop_.get(), next, &error);
    if (!judged("h6ChangeSession", before != nullptr, error)) return;
    REQUIRE(before == running_);
    running_ = next;
  }
  void take_over() {
    h6Error error{};
    h6Session *const next = any(), *const before = any();
    const bool done = h6TakeOver(next, before, &error);
    if (judged("h6TakeOver", done, error)) REQUIRE((next && before && next != before));
  }

  void safety_input() {
    h6Session* const s = any();
    if (watched(s)) return;
    const h6SafetyInput last = h6GetSafetyInput(s, index());
    REQUIRE((last.overdue >= 0 && last.overdue <= 1e6));
    const h6SafetyInput next{random_() % 2 ? last.asked : static_cast<std::uint32_t>(random_()),
                             number(1e-3)};
    h6SetSafetyInput(s, index(), rarely() ? nullptr : &next);
  }
  void get_deformation() {
    h6Session* const s = any();
    if (watched(s)) return;
    double q[kModes + 1], velocity[kModes + 1];
    for (std::size_t j = 0; j <= kModes; ++j) q[j] = velocity[j] = 7;
    const std::size_t room = random_() % (kModes + 2);
    const std::size_t modes =
        h6GetDeformation(s, index(), rarely() ? nullptr : q, rarely() ? nullptr : velocity, room);
    tallied("h6GetDeformation", modes > 0);
    REQUIRE((modes == 0 || modes == kModes));
    for (std::size_t j = 0; j <= kModes; ++j) {
      REQUIRE((std::isfinite(q[j]) && std::isfinite(velocity[j])));
      if (j >= modes || j >= room) REQUIRE((q[j] == 7 && velocity[j] == 7));
    }
  }
  void set_deformation() {
    const double q[2] = {number(1e-4), number(1e-4)}, velocity[2] = {number(1e-3), number(1e-3)};
    tallied("h6SetDeformation",
            h6SetDeformation(any(), index(), rarely() ? nullptr : q,
                             random_() % 2 ? nullptr : velocity, rarely() ? 1 : kModes));
  }
  void read_records() {
    std::vector<h6FrameRecord> rows(kRows);
    std::vector<double> bends(kRows * kModes, 7);
    const bool with_bends = random_() % 4;
    h6Loop* const loop = rarely() ? nullptr : loop_.get();
    h6FrameRecord* const out = rarely() ? nullptr : rows.data();
    const std::size_t room = random_() % (kRows + 1);
    const auto read = [&] {
      return h6ReadRecordsWithBends(loop, out, with_bends ? bends.data() : nullptr, room);
    };
    // A loop that waits for its reader has a frame sooner or later, however busy the machine is.
    std::size_t n = read();
    while (n == 0 && waits_ && loop && out && room > 0 && h6LoopRunning(loop)) {
      std::this_thread::yield();
      n = read();
    }
    tallied("h6ReadRecordsWithBends", n > 0);
    REQUIRE(n <= kRows);
    for (std::size_t i = 0; i < n; ++i) {
      if (i > 0) REQUIRE(rows[i].report.frame > rows[i - 1].report.frame);
      for (std::size_t j = 0; with_bends && j < kModes; ++j)
        REQUIRE(std::isfinite(bends[i * kModes + j]) == !rows[i].inputs_only);
    }
    for (std::size_t k = n * kModes; k < bends.size(); ++k) REQUIRE(bends[k] == 7);
  }
  void step() {
    h6DeviceSample in = hand_at(pose(number(1e-3), 0, number(9e-3)));
    in.velocity.linear.z = number(1e-3);
    h6DeviceCommand out{};
    const h6Status status = h6Step(any(), rarely() ? nullptr : &in, rarely() ? nullptr : &out);
    tallied("h6Step", !(status & H6_OUTPUT_FAULT));
    const h6Vec3& f = out.wrench.force;
    REQUIRE(std::hypot(f.x, f.y, f.z) <= 100.001);
  }

  std::mt19937_64 random_;
  Common& common_;
  std::vector<hapsix::Model> models_;
  std::vector<hapsix::Session> sessions_;
  hapsix::Loop loop_;
  h6Session* running_ = nullptr;  // by the loop
  bool waits_ = false;            // for a reader of its records
};

}  // namespace

TEST_CASE("any sequence of models, loops and changed sessions has a defined result") {
  Common common;
  h6::test::run_sequences<Sequence>(common, kSanitized ? 500 : 10000, 500, 9);
}
