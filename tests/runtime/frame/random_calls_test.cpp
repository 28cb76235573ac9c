// SPDX-License-Identifier: Apache-2.0
// Random sequences of calls with any arguments, in any order: NULL, NaN, huge, negative, handles of
// another kind of session, calls while a loop runs. Whatever comes: no crash, outputs are finite, a
// refusal has its sentence. HAPSIX_SEQUENCES sets how many there are.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <random>
#include <vector>

#include "hapsix/batch.h"
#include "hapsix/hapsix.h"
#include "tests/support/analytic.h"
#include "tests/support/one_part.h"
#include "tests/support/sanitized.h"

using namespace h6::test;

namespace {

constexpr double mm = 1e-3;

class Sequence {
 public:
  Sequence(std::uint64_t seed, const h6Model* model) : random_(seed), model_(model) {
    h6WorkersDef def = h6DefaultWorkersDef();
    def.threads = 1;
    workers_ = h6CreateWorkers(&def, nullptr);
  }
  ~Sequence() {
    h6DestroyLoop(loop_);
    for (h6Session* s : sessions_) h6DestroySession(s);
    h6DestroyWorkers(workers_);
  }
  void call() {
    switch (random_() % 24) {
      case 0:
        return create();
      case 1:
        return destroy();
      case 2:
        return start_loop();
      case 3:
        h6DestroyLoop(loop_), loop_ = nullptr;
        return;
      case 4:
        return teleport();
      case 5:
        return h6Fault(any(), static_cast<h6Cause>(index()));
      case 6:
        return h6Arm(any());
      case 7:
        return h6Disarm(any());
      case 8:
        return h6LoseDevice(any(), index());
      case 9:
        return h6NoteInterval(any(), number(mm));
      case 10:
        return h6SetCoarse(any(), static_cast<std::uint32_t>(index()), word());
      case 11:
        return rate();
      case 12:
        (void)h6RestartFit(any(), nullptr);
        return;
      case 13:
        return take_over();
      case 14:
        return weigh();
      case 15:
        return sample_field();
      case 16:
        return look();
      case 17:
      case 18:
        return step_many();
      default:
        return step();
    }
  }

 private:
  std::uint32_t word() { return static_cast<std::uint32_t>(random_()); }
  std::int32_t index() {
    static constexpr std::int32_t odd[] = {-1, 2, 77, INT32_MAX, INT32_MIN};
    const std::uint32_t b = word() % 16;
    return b < 11 ? static_cast<std::int32_t>(b % 2) : odd[b - 11];
  }
  double number(double usual) {
    static const double odd[] = {0, -usual, 1e-300, 1e300, -1e300, NAN, INFINITY, -INFINITY};
    const std::uint32_t b = word() % 32;
    return b < 24 ? usual * (0.5 + 0.05 * b) : odd[b - 24];
  }
  h6Session* any() {
    const std::size_t i = random_() % (sessions_.size() + 1);
    return i < sessions_.size() ? sessions_[i] : nullptr;
  }
  h6Pose place() {
    return {{number(mm), number(mm), number(5 * mm)}, {1, number(0.1), number(0.1), 0}};
  }
  static void finite(const h6DeviceCommand& c) {
    const h6Vec3 &f = c.wrench.force, &t = c.wrench.torque, &p = c.pose.p;
    REQUIRE(std::isfinite(f.x + f.y + f.z + t.x + t.y + t.z + p.x + p.y + p.z));
    REQUIRE(std::hypot(f.x, f.y, f.z) <= 100.001);
  }

  void create() {
    if (sessions_.size() >= 4) return;
    h6BodyDef bodies[2] = {h6DefaultBodyDef(), h6DefaultBodyDef()};
    bodies[0].fixed = true, bodies[0].field = 0;
    bodies[1].shell = 0, bodies[1].pose.p.z = number(5 * mm), bodies[1].mass = number(0.1);
    h6HandDef hand = h6DefaultHandDef();
    hand.body = word() % 8 ? 1 : index();
    h6SessionDef def = h6DefaultSessionDef();
    def.bodies = bodies, def.body_count = 2;
    def.hands = word() % 32 ? &hand : nullptr, def.hand_count = 1;
    def.contact.method = static_cast<h6Method>(word() % 9);
    def.contact.friction = word() % 2 ? number(0.3) : 0;
    def.max_contacts = word() % 16 ? 1 + word() % 64 : word();
    if (def.max_contacts > 1000000) def.max_contacts = SIZE_MAX;  // refused: no gigabytes here
    def.rate = word() % 8 ? 1000 : number(1000);
    if (word() % 3 == 0) def.workers = workers_;
    h6Error error{};
    h6Session* made =
        h6CreateSession(word() % 16 ? model_ : nullptr, word() % 16 ? &def : nullptr, &error);
    REQUIRE((made != nullptr) == (error.message[0] == 0));
    if (made) sessions_.push_back(made);
  }
  void destroy() {
    h6DestroyLoop(loop_), loop_ = nullptr;  // it may run this one
    if (sessions_.empty()) return h6DestroySession(nullptr);
    h6DestroySession(sessions_.back());
    sessions_.pop_back();
  }
  void start_loop() {
    h6Device device = h6DefaultDevice();
    device.capabilities.frame_time = true;
    device.read = [](void*, double, h6DeviceSample* out) {
      return *out = h6DefaultDeviceSample(), 0;
    };
    device.write = [](void*, double, const h6DeviceCommand*) { return 0; };
    h6LoopDef def = h6DefaultLoopDef();
    def.realtime = false, def.virtual_time = true, def.duration = number(0.01);
    if (word() % 4 == 0) def.ring_frames = word();
    if (def.ring_frames > 1000) def.ring_frames = SIZE_MAX;
    h6Error error{};
    h6Loop* made = h6StartLoop(any(), word() % 8 ? &device : nullptr, &def, &error);
    REQUIRE((made != nullptr) == (error.message[0] == 0));
    if (!made) return;
    if (loop_)
      h6DestroyLoop(made);
    else
      loop_ = made;
    h6ArmLoop(word() % 2 ? loop_ : nullptr);
    h6SetPace(loop_, number(1));
    if (word() % 2) h6RequestStop(loop_);
  }
  void teleport() {
    const h6BodyState to{place(), {{number(0.1), 0, 0}, {0, number(1), 0}}};
    h6SetBody(any(), index(), word() % 8 ? &to : nullptr);
  }
  void rate() {
    h6DeviceCapabilities c{};
    c.max_force = number(10), c.max_torque = number(1), c.max_force_rate = number(1000);
    h6SetRating(any(), index(), word() % 8 ? &c : nullptr);
  }
  void take_over() {
    h6Session *next = any(), *before = any();
    h6Error error{};
    if (!h6TakeOver(next, before, &error)) REQUIRE(error.message[0] != 0);
  }
  void weigh() {
    float normals[6] = {0, 0, 1, static_cast<float>(number(1)), 0, 1}, arms[6]{},
          depths[2] = {1, 1};
    h6ContactDef contact = h6DefaultContactDef();
    contact.stiffness = number(1e4);
    h6ContactArrays arrays = h6DefaultContactArrays();
    arrays.count = word() % 8 ? 2 : SIZE_MAX;
    arrays.normals = word() % 8 ? normals : nullptr, arrays.arms = arms, arrays.depths = depths;
    h6Wrench wrench{};
    h6Error error{};
    const int code = h6WeighContacts(&contact, &arrays, number(mm), number(0.1), nullptr, &wrench,
                                     nullptr, nullptr, &error);
    REQUIRE((code == 0) == (error.message[0] == 0));
    if (code == 0) REQUIRE(std::isfinite(wrench.force.z));
  }
  void sample_field() {
    const double at[3] = {number(mm), number(mm), number(mm)};
    double distance = 0, gradient[3];
    (void)h6SampleField(word() % 8 ? model_ : nullptr, index(), word() % 8 ? at : nullptr, 1,
                        &distance, word() % 2 ? gradient : nullptr, nullptr);
  }
  void look() {
    if (h6::test::kThreadSanitized && loop_) return;  // what a loop runs changes under our eyes
    h6Session* s = any();
    const std::int32_t i = index();
    const h6BodyState body = h6GetBody(s, i);
    REQUIRE(std::isfinite(body.pose.p.x + body.pose.p.y + body.pose.p.z));
    (void)h6GetContacts(s, i), (void)h6GetFrame(s), (void)h6GetCoupling(s, i);
    (void)h6GetVoxel(s, i), h6NameContacts(s, i, nullptr, nullptr);
    h6HandSafety safety;
    h6GetSafety(s, i, &safety);
    (void)h6GetOverlaps(s, nullptr, 0), (void)h6GetOverlapPoints(s, nullptr, 0);
    h6FrameRecord record;
    h6GetRecord(s, nullptr, nullptr, &record);
    h6LoopView view;
    (void)h6ReadView(loop_, &view), (void)h6ReadRecords(loop_, &record, word() % 2);
  }
  h6DeviceSample sample() {
    h6DeviceSample s = h6DefaultDeviceSample();
    s.pose = place(), s.velocity.linear.z = number(0.1), s.wrench.force.x = number(1);
    s.buttons = word();
    return s;
  }
  void step() {
    const h6DeviceSample in = sample();
    h6DeviceCommand out{};
    (void)h6Step(any(), word() % 16 ? &in : nullptr, word() % 16 ? &out : nullptr);
    finite(out);
  }
  void step_many() {
    h6Session* some[2] = {any(), any()};
    if (some[0] == some[1]) some[1] = nullptr;  // each of them once
    h6Pose pose[2] = {place(), place()};
    h6Wrench felt[2]{};
    h6StepArrays a = h6DefaultStepArrays();
    a.sessions = word() % 16 ? some : nullptr, a.count = 2, a.pose = word() % 16 ? pose : nullptr;
    a.command = felt;
    if (word() % 16 == 0) a.hands = word(), a.command = nullptr;
    if (word() % 16 == 0) a.reserved[0] = 1;
    a.steps = word() % 4;
    (void)h6StepMany(word() % 2 ? workers_ : nullptr, word() % 16 ? &a : nullptr);
    for (const h6Wrench& w : felt) REQUIRE(std::isfinite(w.force.x + w.force.y + w.force.z));
  }

  std::mt19937_64 random_;
  const h6Model* model_;
  std::vector<h6Session*> sessions_;
  h6Workers* workers_ = nullptr;
  h6Loop* loop_ = nullptr;
};

}  // namespace

TEST_CASE("any sequence of calls with any arguments has a defined result") {
  const OnePart scene(sample_analytic([](double, double, double z) { return z; },
                                      {-16 * mm, -16 * mm, -8 * mm}, mm, 4, 4, 2),
                      bottom_face(5 * mm, 5 * mm, 2 * mm, 6, 6));
  const char* const asked = std::getenv("HAPSIX_SEQUENCES");
  const long count = asked ? std::atol(asked) : 100000;
  for (long i = 0; i < count; ++i) {
    CAPTURE(i);
    Sequence sequence(static_cast<std::uint64_t>(i), scene.model.handle);
    for (int k = 0; k < 40; ++k) sequence.call();
  }
  MESSAGE(count << " sequences of 40 calls");
}

TEST_CASE("odd names, records and reports have a defined result") {
  for (const int odd : {-1, 99, INT32_MAX, INT32_MIN}) {
    (void)h6CauseName(static_cast<h6Cause>(odd));
    CHECK(h6MethodName(static_cast<h6Method>(odd)) == nullptr);
    (void)h6DeviceStateName(static_cast<h6DeviceState>(odd));
    (void)h6StageName(static_cast<h6Stage>(odd));
  }
  CHECK(h6MethodFromName(nullptr, nullptr, nullptr) != 0);
  CHECK(h6MethodFromName("firmer", nullptr, nullptr) != 0);
  h6LoopReport report;
  h6JoinLoop(nullptr, &report);
  CHECK(report.frames == 0);
  h6JoinLoop(nullptr, nullptr);
  double distance = 7;
  CHECK(h6SampleField(nullptr, 0, &distance, 1, &distance, nullptr, nullptr) == -1);
}
