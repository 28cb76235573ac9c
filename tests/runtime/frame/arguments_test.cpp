// SPDX-License-Identifier: Apache-2.0
// Wrong arguments of the contract: NULL, -1, one past the end, wild counts, and values out of range
// give a status, NULL or a default, in every build, and change nothing.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
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

// Why a session of this definition is refused; empty when it is made.
std::string refusal(OnePart& scene) {
  h6Error error{};
  h6Session* session = h6CreateSession(scene.model.handle, &scene.def, &error);
  h6DestroySession(session);
  CHECK((session != nullptr) == (error.message[0] == 0));
  return error.message;
}

template <class T>
bool all_zero(const T& value) {
  const T zero{};
  return std::memcmp(&value, &zero, sizeof value) == 0;
}

}  // namespace

TEST_CASE("a session that is NULL gives defaults") {
  h6DeviceSample sample{};
  h6DeviceCommand command{};
  const h6BodyState state{pose(0, 0, 0), {}};
  const h6DeviceCapabilities rating{};
  const h6SafetyInput input{};
  CHECK(h6Step(nullptr, &sample, &command) == H6_OUTPUT_FAULT);
  CHECK(h6GetBody(nullptr, 0).pose.q.w == 1);
  CHECK(h6GetContacts(nullptr, 0).count == 0);
  double q = 1;
  CHECK(h6GetDeformation(nullptr, 0, &q, &q, 1) == 0);
  CHECK_FALSE(h6SetDeformation(nullptr, 0, &q, nullptr, 1));
  CHECK(q == 1);
  CHECK(h6GetFrame(nullptr).frame == 0);
  CHECK(h6GetCoupling(nullptr, 0).stiffness == 0);
  CHECK(h6GetVoxel(nullptr, 0) == 0);
  CHECK(h6GetSafetyInput(nullptr, 0).asked == 0);
  CHECK(all_zero(h6::test::safety_of(nullptr, 0)));
  CHECK(h6GetOverlaps(nullptr, nullptr, 5) == 0);
  CHECK(h6GetOverlapPoints(nullptr, nullptr, 5) == 0);
  CHECK_FALSE(h6RestartFit(nullptr, nullptr));
  CHECK_FALSE(h6TakeOver(nullptr, nullptr, nullptr));
  CHECK(h6ModelBytes(nullptr) == 0);
  CHECK(h6CreateModel(nullptr, nullptr) == nullptr);
  CHECK(h6CreateSession(nullptr, nullptr, nullptr) == nullptr);
  CHECK(h6StiffnessFor(nullptr, nullptr) == 0);
  h6SetCoarse(nullptr, 1, 1);
  h6SetBody(nullptr, 0, &state);
  h6SetRating(nullptr, 0, &rating);
  h6SetSafetyInput(nullptr, 0, &input);
  h6NameContacts(nullptr, 0, nullptr, nullptr);
  h6Fault(nullptr, H6_CAUSE_STOPPED), h6Arm(nullptr), h6Rearm(nullptr), h6Disarm(nullptr);
  h6LoseDevice(nullptr, 0), h6NoteInterval(nullptr, 1);
  h6DestroySession(nullptr), h6DestroyModel(nullptr);
}

TEST_CASE("a loop that is NULL gives defaults") {
  h6FrameRecord row;
  h6LoopView view;
  CHECK(h6StartLoop(nullptr, nullptr, nullptr, nullptr) == nullptr);
  CHECK(h6ReadRecords(nullptr, &row, 1) == 0);
  CHECK(h6ReadRecordsWithBends(nullptr, &row, nullptr, 1) == 0);
  CHECK_FALSE(h6ReadView(nullptr, &view));
  CHECK(h6ChangeSession(nullptr, nullptr, nullptr) == nullptr);
  CHECK_FALSE(h6LoopRunning(nullptr));
  CHECK(h6::test::joined(nullptr).frames == 0);
  h6SetPace(nullptr, 1);
  h6RequestStop(nullptr), h6ArmLoop(nullptr), h6DisarmLoop(nullptr), h6HaltLoop(nullptr);
  h6DestroyLoop(nullptr);
}

TEST_CASE("an index that does not exist gives defaults, and the next frame is as without it") {
  OnePart scene = box_on_floor(), plain = box_on_floor();
  scene.bodies[1].pose = plain.bodies[1].pose = pose(0, 0, 5 * mm);
  scene.open(), plain.open();
  h6Session* s = scene.session;
  h6DeviceSample sample = hand_at(pose(0, 0, 4.5 * mm));
  h6DeviceCommand command{}, expected{};
  const h6BodyState away{pose(1, 1, 1), {}};
  h6DeviceCapabilities rating{};
  rating.max_force = 1e-3;
  const h6SafetyInput input{H6_ASKED_LOST, 1};
  for (int frame = 0; frame < 20; ++frame) {
    for (const std::int32_t i : {-1, 1, 2, 256, INT32_MAX, INT32_MIN}) {  // hands: only 0 exists
      CHECK(h6GetCoupling(s, i).stiffness == 0);
      CHECK(h6GetSafetyInput(s, i).asked == 0);
      CHECK(all_zero(h6::test::safety_of(s, i)));
      h6SetRating(s, i, &rating), h6SetSafetyInput(s, i, &input), h6LoseDevice(s, i);
      if (i == 1) continue;  // a body
      CHECK(h6GetBody(s, i).pose.q.w == 1);
      CHECK(h6GetVoxel(s, i) == 0);
      CHECK(h6GetContacts(s, i).count == 0);
      h6SetBody(s, i, &away), h6NameContacts(s, i, nullptr, nullptr);
    }
    // Right indices with nothing, or nonsense, behind them.
    h6SetRating(s, 0, nullptr), h6SetSafetyInput(s, 0, nullptr), h6SetBody(s, 1, nullptr);
    h6Fault(s, H6_CAUSE_COUNT), h6Fault(s, static_cast<h6Cause>(-1));
    for (const double wild : {std::nan(""), 1e7, -std::numeric_limits<double>::infinity()}) {
      const h6BodyState bad{pose(0, wild, 0), {}};
      h6SetBody(s, 1, &bad);
    }
    const h6BodyState turned{{{0, 0, 0}, {0, 0, 0, 0}}, {}};
    h6SetBody(s, 1, &turned);
    CHECK(h6Step(s, nullptr, &command) == H6_OUTPUT_FAULT);
    CHECK(all_zero(command));
    CHECK(h6GetOverlaps(s, nullptr, SIZE_MAX) == h6GetOverlaps(s, nullptr, 0));
    h6Step(s, &sample, &command);
    h6Step(plain.session, &sample, &expected);
    CHECK(std::memcmp(&command, &expected, sizeof command) == 0);
  }
}

TEST_CASE("counts that no memory can hold are refused at once") {
  h6Error error{};
  h6ModelDef model = h6DefaultModelDef();
  h6FieldDef field{};
  h6ShellDef shell{};
  model.fields = &field, model.shells = &shell;
  for (const std::size_t wild : {std::size_t{1} << 60, SIZE_MAX, std::size_t{1} << 32}) {
    model.field_count = wild, model.shell_count = 0;
    CHECK(h6CreateModel(&model, &error) == nullptr);
    model.field_count = 0, model.shell_count = wild;
    CHECK(h6CreateModel(&model, &error) == nullptr);
    shell.point_count = wild;
    model.shell_count = 1;
    CHECK(h6CreateModel(&model, &error) == nullptr);
    CHECK(h6WeighScratchBytes(wild) == 0);
    const h6ContactDef contact = h6DefaultContactDef();
    h6ContactArrays arrays{};
    arrays.count = wild;
    CHECK(h6WeighContacts(&contact, &arrays, 1e-3, 1, nullptr, nullptr, nullptr, nullptr, &error) ==
          -1);
  }
  CHECK(h6WeighScratchBytes(1000000) > 1000000);
  CHECK(h6WeighScratchBytes(1000001) == 0);
}

TEST_CASE("pairs beyond all that can exist, and one that is listed twice, are refused") {
  OnePart scene = box_on_floor();
  std::vector<h6PairDef> pairs(2, h6PairDef{1, 0, {}});
  scene.def.pairs = pairs.data(), scene.def.pair_count = 1;
  CHECK(refusal(scene) == "");
  scene.def.pair_count = 2;
  CHECK(refusal(scene) == "pair 1 is listed before");
  scene.def.pair_count = 10000000;  // nothing behind the second is read
  CHECK(refusal(scene).find("2 bodies have at most 2 pairs") != std::string::npos);
  scene.def.pairs = nullptr;
  CHECK(refusal(scene) != "");
}

TEST_CASE("a million contacts may be asked for and change nothing, one more is refused") {
  OnePart scene = box_on_floor(), plain = box_on_floor();
  scene.bodies[1].pose = plain.bodies[1].pose = pose(0, 0, 5 * mm);
  scene.def.max_contacts = 1000001;
  CHECK(refusal(scene).find("max_contacts") != std::string::npos);
  scene.def.max_contacts = 1000000;
  scene.open(), plain.open();
  for (int frame = 0; frame < 20; ++frame) {
    const h6DeviceSample sample = hand_at(pose(0, 0, 4.5 * mm));
    h6DeviceCommand command{}, expected{};
    h6Step(scene.session, &sample, &command);
    h6Step(plain.session, &sample, &expected);
    CHECK(std::memcmp(&command, &expected, sizeof command) == 0);
  }
}

TEST_CASE("masses, inertias, scales, places and gravity out of range are refused by name") {
  const auto refused = [](auto change) {
    OnePart scene = box_on_floor();
    change(scene);
    return refusal(scene);
  };
  CHECK(refused([](OnePart&) {}) == "");
  for (const double mass : {1e-30, 1e-7, 1e7, 0.0, -1.0, std::nan("")}) {
    CHECK(refused([&](OnePart& s) { s.bodies[1].mass = mass; }).find("mass") != std::string::npos);
    CHECK(refused([&](OnePart& s) { s.hand.manipulandum_mass = mass; }) != "");
  }
  for (const double scale : {1e-9, 1e9, 0.0, std::nan("")}) {
    CHECK(refused([&](OnePart& s) { s.hand.filter.motion_scale = scale; }) != "");
    CHECK(refused([&](OnePart& s) { s.hand.filter.rotation_scale = scale; }) != "");
    CHECK(refused([&](OnePart& s) { s.hand.filter.force_scale = scale; }) != "");
  }
  for (const double inertia : {1e-20, 1e20})
    CHECK(refused([&](OnePart& s) {
            for (int k = 0; k < 3; ++k) s.bodies[1].inertia[k] = inertia;
          }).find("gyration") != std::string::npos);
  for (const double far : {1e7, -1e300, std::nan("")}) {
    CHECK(refused([&](OnePart& s) { s.bodies[1].pose.p.y = far; }) != "");
    CHECK(refused([&](OnePart& s) { s.bodies[1].com.z = far; }) != "");
    CHECK(refused([&](OnePart& s) { s.bodies[1].velocity.angular.x = far; }) != "");
    CHECK(refused([&](OnePart& s) { s.def.gravity.z = far; }) != "");
  }
}

TEST_CASE("the least mass and the largest scales still give finite commands inside the rating") {
  for (const double scale : {1e-6, 1e6})
    for (const double mass : {1e-6, 1e6})
      for (const std::uint32_t mode : {H6_IMPEDANCE, H6_ADMITTANCE, H6_PSEUDO_ADMITTANCE}) {
        OnePart scene = box_on_floor();
        scene.bodies[1].mass = mass, scene.hand.mode = mode;
        scene.bodies[1].pose = pose(0, 0, 6 * mm);
        scene.hand.filter.motion_scale = scene.hand.filter.force_scale = scale;
        scene.open();
        for (int i = 0; i < 200; ++i) {
          h6DeviceSample sample = hand_at(pose(0, 0, (6 - 0.02 * i) * mm));
          sample.wrench.force.z = i % 50 == 49 ? 1e6 : -1;
          h6DeviceCommand command{};
          h6Step(scene.session, &sample, &command);
          const h6Vec3 &p = command.pose.p, &f = command.wrench.force;
          CHECK(std::isfinite(p.x + p.y + p.z));
          CHECK(std::sqrt(f.x * f.x + f.y * f.y + f.z * f.z) <= 100.001);
        }
      }
}

TEST_CASE("samples out of range are bad samples: the force decays and nothing flies away") {
  OnePart scene = box_on_floor();
  scene.bodies[1].pose = pose(0, 0, 6 * mm);
  scene.open();
  h6DeviceCommand command{};
  h6DeviceSample sample = hand_at(pose(0, 0, 6 * mm));
  for (int i = 0; i < 50; ++i) h6Step(scene.session, &sample, &command);
  const h6Vec3 before = h6GetBody(scene.session, 1).pose.p;
  for (const double wild : {1e7, 1e30, 1e300, -1e308, std::nan("")}) {
    sample = hand_at(pose(wild, 0, 6 * mm));
    CHECK((h6Step(scene.session, &sample, &command) & H6_HAND_NOT_FINITE) != 0);
    sample = hand_at(pose(0, 0, 6 * mm));
    sample.velocity.angular.y = wild;
    CHECK((h6Step(scene.session, &sample, &command) & H6_HAND_NOT_FINITE) != 0);
  }
  const h6Vec3 after = h6GetBody(scene.session, 1).pose.p;
  CHECK(std::hypot(after.x - before.x, after.y - before.y, after.z - before.z) < 1 * mm);
}
