// SPDX-License-Identifier: Apache-2.0
// Random calls on a second thread while a loop runs: those that any thread may make, and those that
// a running loop must refuse, with any arguments. HAPSIX_SEQUENCES sets how many sequences there
// are.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "hapsix/batch.h"
#include "hapsix/hapsix.h"
#include "tests/support/analytic.h"
#include "tests/support/one_part.h"
#include "tests/support/sanitized.h"

using namespace h6::test;

namespace {

constexpr double mm = 1e-3;

// Calls of one thread. What it finds is kept for the thread that checks.
class Calls {
 public:
  Calls(std::uint64_t seed, const OnePart& scene, h6Loop* loop, h6Session* idle)
      : random_(seed), scene_(scene), loop_(loop), idle_(idle) {}

  void any_thread() {
    switch (random_() % 14) {
      case 0:
        return h6Fault(scene_.session, static_cast<h6Cause>(index()));
      case 1:
        return h6LoseDevice(scene_.session, index());
      case 2:
        return h6Disarm(scene_.session);
      case 3:
      case 4:
        return h6ArmLoop(loop_);
      case 5:
        return h6DisarmLoop(loop_);
      case 6:
        return h6SetPace(loop_, 1 + std::fabs(number(1)));  // a loop that is paused would never end
      case 7:
        return (void)h6LoopRunning(loop_);
      case 8:
        return sample_field();
      case 9:
        return weigh();
      case 10:
        return names();
      case 11:
        return make();
      case 12:
        return random_() % 16 ? void() : h6HaltLoop(loop_);
      default:
        return random_() % 16 ? void() : h6RequestStop(loop_);
    }
  }

  // Each must be refused, and change nothing.
  void refused() {
    h6Session* const s = scene_.session;
    h6Error error{};
    const h6DeviceSample in = h6DefaultDeviceSample();
    h6DeviceCommand out{};
    switch (random_() % 12) {
      case 0:
        expect(h6Step(s, random_() % 8 ? &in : nullptr, random_() % 8 ? &out : nullptr) ==
                   H6_OUTPUT_FAULT,
               "h6Step");
        return expect(out.wrench.force.z == 0, "h6Step's command");
      case 1: {
        const h6LoopDef def = h6DefaultLoopDef();
        return expect(!h6StartLoop(s, nullptr, &def, &error), "h6StartLoop");
      }
      case 2:
        return expect(!h6TakeOver(s, idle_, &error) && error.code == H6_ERROR_BUSY, "h6TakeOver");
      case 3:
        return expect(!h6TakeOver(idle_, s, &error) && error.code == H6_ERROR_BUSY,
                      "h6TakeOver from it");
      case 4:
        return expect(!h6RestartFit(s, &error) && error.code == H6_ERROR_BUSY, "h6RestartFit");
      case 5: {
        const double q[1] = {number(mm)};
        return expect(!h6SetDeformation(s, index(), q, nullptr, 1), "h6SetDeformation");
      }
      case 6: {
        const h6BodyState far{{{number(1), number(1), number(1)}, {1, 0, 0, 0}}, {}};
        return h6SetBody(s, index(), &far);
      }
      case 7:
        return h6Arm(s), h6Rearm(s);
      case 8:
        return h6SetCoarse(s, static_cast<std::uint32_t>(index()), 1),
               h6NoteInterval(s, number(mm));
      case 9: {
        h6DeviceCapabilities c{};
        c.max_force = number(100), c.max_torque = number(10);
        return h6SetRating(s, index(), &c);
      }
      case 10: {
        const h6SafetyInput input{H6_ASKED_ARM, number(mm)};
        return h6SetSafetyInput(s, index(), &input);
      }
      default: {
        h6Session* one[1] = {s};
        h6StepArrays a = h6DefaultStepArrays();
        h6Wrench felt[1]{};
        a.sessions = one, a.count = 1, a.command = felt;
        (void)h6StepMany(nullptr, &a);
        return expect(felt[0].force.z == 0, "h6StepMany");
      }
    }
  }
  const std::string& wrong() const { return wrong_; }

 private:
  void expect(bool good, const char* what) {
    if (!good && wrong_.empty()) wrong_ = what;
  }
  std::int32_t index() {
    static constexpr std::int32_t odd[] = {0, 1, -1, 2, INT32_MAX, INT32_MIN};
    return odd[random_() % 6];
  }
  double number(double usual) {
    static const double odd[] = {usual, -usual, 0, 1e300, -1e300, NAN, INFINITY, -INFINITY};
    return odd[random_() % 8];
  }
  void sample_field() {
    const double at[3] = {number(mm), number(mm), number(mm)};
    double distance = 0, gradient[3];
    (void)h6SampleField(scene_.model.handle, index(), at, 1, &distance, gradient, nullptr);
  }
  void weigh() {
    const float normals[3] = {0, 0, 1}, arms[3]{}, depths[1] = {static_cast<float>(number(mm))};
    const h6ContactDef contact = h6DefaultContactDef();
    h6ContactArrays arrays = h6DefaultContactArrays();
    arrays.count = 1, arrays.normals = normals, arrays.arms = arms, arrays.depths = depths;
    h6Wrench wrench{};
    h6Error error{};
    const int code = h6WeighContacts(&contact, &arrays, number(mm), number(0.1), nullptr, &wrench,
                                     nullptr, nullptr, &error);
    expect((code == 0) == (error.message[0] == 0), "h6WeighContacts");
    expect(code != 0 || std::isfinite(wrench.force.z), "h6WeighContacts' wrench");
  }
  void names() {
    expect(h6Version() && h6BuildInfo(), "h6Version");
    (void)h6CauseName(static_cast<h6Cause>(index()));
    (void)h6MethodName(static_cast<h6Method>(index()));
    (void)h6DefaultSessionDef();
    expect(h6StiffnessFor(scene_.model.handle, &scene_.def) > 0, "h6StiffnessFor");
  }
  void make() {  // of the model that the loop's session uses, too
    h6Session* const made = h6CreateSession(scene_.model.handle, &scene_.def, nullptr);
    expect(made, "h6CreateSession");
    h6DestroySession(made);
  }

  std::mt19937_64 random_;
  const OnePart& scene_;
  h6Loop* loop_;
  h6Session* idle_;
  std::string wrong_;
};

void run_sequence(std::uint64_t seed, OnePart& scene, h6Session* idle) {
  h6Device device = h6DefaultDevice();
  device.capabilities.frame_time = true;
  device.read = [](void*, double t, h6DeviceSample* out) {
    *out = h6DefaultDeviceSample();
    out->pose.p.z = (5 - std::min(1.0, 50 * t)) * mm;
    return 0;
  };
  device.write = [](void* self, double, const h6DeviceCommand* c) {
    const double sum = c->wrench.force.z + c->wrench.torque.x + c->pose.p.z;
    if (!std::isfinite(sum)) *static_cast<bool*>(self) = true;
    return 0;
  };
  bool odd = false;
  device.self = &odd;
  h6LoopDef def = h6DefaultLoopDef();
  def.realtime = false, def.virtual_time = true, def.duration = 0;
  def.ring_frames = 64, def.view_contacts = 16;
  h6Loop* const loop = h6StartLoop(scene.session, &device, &def, nullptr);
  REQUIRE(loop);
  Calls there(2 * seed, scene, loop, idle), here(2 * seed + 1, scene, loop, idle);
  std::thread second([&] {
    for (int k = 0; k < 40; ++k) k % 2 ? there.any_thread() : there.refused();
  });
  h6FrameRecord row;
  h6LoopView view;
  for (int k = 0; k < 20; ++k) {
    here.any_thread();
    (void)h6ReadRecords(loop, &row, 1), (void)h6ReadView(loop, &view);
  }
  second.join();
  h6RequestStop(loop);
  h6LoopReport report;
  h6JoinLoop(loop, &report);
  REQUIRE_MESSAGE(there.wrong().empty(), there.wrong());
  REQUIRE_MESSAGE(here.wrong().empty(), here.wrong());
  REQUIRE_FALSE(odd);
  const h6Vec3 at = h6GetBody(scene.session, 1).pose.p;
  REQUIRE(std::hypot(at.x, at.y, at.z) < 0.1);  // nobody else moved it
  h6DestroyLoop(loop);
}

}  // namespace

TEST_CASE("calls on a second thread beside a loop are taken or refused, whatever they are") {
  OnePart scene(sample_analytic([](double, double, double z) { return z; },
                                {-16 * mm, -16 * mm, -8 * mm}, mm, 4, 4, 2),
                bottom_face(5 * mm, 5 * mm, 2 * mm, 6, 6));
  scene.bodies[1].pose.p.z = 5 * mm;
  scene.open();
  h6Session* const idle = h6CreateSession(scene.model.handle, &scene.def, nullptr);
  REQUIRE(idle);
  const char* const asked = std::getenv("HAPSIX_SEQUENCES");
  const long count = asked ? std::atol(asked) : kSanitized ? 300 : 2000;
  for (long i = 0; i < count; ++i) {
    CAPTURE(i);
    run_sequence(static_cast<std::uint64_t>(i), scene, idle);
    scene.open();
  }
  h6DestroySession(idle);
  MESSAGE(count << " sequences of 60 calls on two threads");
}
