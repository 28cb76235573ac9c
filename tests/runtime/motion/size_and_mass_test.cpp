// SPDX-License-Identifier: Apache-2.0
// size_and_mass_test.cpp - the default settings hold parts of any size and mass, and leave what a
// definition sets.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "hapsix/vector.h"
#include "tests/support/analytic.h"
#include "tests/support/near.h"

using namespace h6::test;
using h6::norm;

namespace {

constexpr h6Method kMethods[] = {H6_METHOD_FIRM, H6_METHOD_SERIES, H6_METHOD_ROBUST};
constexpr double kSizes[] = {1e-3, 0.1, 10};  // of a part; a voxel is a hundredth [m]
constexpr double kMasses[] = {1e-5, 1e-3, 0.1, 10, 500};

// Distance to a box of these half lengths.
double to_box(double x, double y, double z, double hx, double hy, double hz) {
  const double a = std::fabs(x) - hx, b = std::fabs(y) - hy, c = std::fabs(z) - hz;
  const double out = std::hypot(std::hypot(std::max(a, 0.0), std::max(b, 0.0)), std::max(c, 0.0));
  return out + std::min(0.0, std::max(a, std::max(b, c)));
}

enum class Ground { floor, plates };

// The ground under a box, for voxels of this size. Plates: one under a third of it, and a small one
// under its far end.
FieldArrays ground(Ground kind, double v) {
  const h6Vec3 origin = {-64 * v, -64 * v, -32 * v};
  if (kind == Ground::floor)
    return sample_analytic([](double, double, double z) { return z; }, origin, v, 16, 16, 6);
  return sample_analytic(
      [v](double x, double y, double z) {
        return std::min(to_box(x + 14 * v, y, z + v, 6 * v, 11 * v, v),
                        to_box(x - 17.75 * v, y, z + v, 0.75 * v, 4.5 * v, v));
      },
      origin, v, 16, 16, 6);
}

// The bottom of a box of 40 x 20 x 10 voxels, with points one or two voxels apart.
ShellArrays box(double v, int apart) {
  return bottom_face(20 * v, 10 * v, 5 * v, 40 / apart, 20 / apart);
}

double inertia_of(double mass, double a, double b) { return mass / 3 * (a * a + b * b); }

struct Rest {
  double speed = 0;   // largest of a point, voxels in a frame
  double depth = 0;   // voxels
  double swing = 0;   // of the depth, voxels
  double ripple = 0;  // of the force, peak to peak in shares of the coupling's bound
};

enum class Case { pressed, pressed_hard, weight };

// A box held by a hand, or lying there by its weight. The last half second counts.
Rest settle(const h6Model* model, double v, double mass, h6Method method, Case what) {
  std::array<h6BodyDef, 2> bodies{h6DefaultBodyDef(), h6DefaultBodyDef()};
  h6HandDef hand = h6DefaultHandDef();
  h6SessionDef def = h6DefaultSessionDef();
  bodies[0].fixed = true, bodies[0].field = 0;
  bodies[1].shell = 0, bodies[1].mass = mass, bodies[1].pose = pose(0, 0, 5.1 * v);
  const double inertia[] = {inertia_of(mass, 10 * v, 5 * v), inertia_of(mass, 20 * v, 5 * v),
                            inertia_of(mass, 20 * v, 10 * v)};
  std::copy_n(inertia, 3, bodies[1].inertia);
  hand.body = 1;
  def.bodies = bodies.data(), def.body_count = 2;
  def.contact.method = method;
  if (what == Case::weight)
    def.gravity = {0, 0, -9.81};
  else
    def.hands = &hand, def.hand_count = 1;
  h6Error error;
  h6Session* s = h6CreateSession(model, &def, &error);
  REQUIRE_MESSAGE(s, error.message);
  double deep = 2 * v, most = 1;
  if (def.hand_count) {
    const h6CouplingDef c = h6GetCoupling(s, 0);
    most = c.max_force;
    if (what == Case::pressed_hard) deep = 1.5 * c.max_force / c.stiffness;
  }
  // 10 times heavier is three times slower on the same spring.
  const int frames = mass > 300 ? 5500 : mass > 50 ? 3000 : 1500;
  Rest out;
  double shallow = HUGE_VAL, weak = HUGE_VAL, strong = 0;
  for (int i = 0; i < frames; ++i) {
    const double way = std::min(1.0, i * 1e-3 / 0.3);
    h6DeviceSample sample = hand_at(pose(0, 0, 5.1 * v - way * (deep + 0.1 * v)));
    h6DeviceCommand command;
    h6Step(s, &sample, &command);
    if (i < frames - 500) continue;
    const h6BodyState at = h6GetBody(s, 1);
    const double depth = h6GetFrame(s).max_depth_voxels;
    const double radius = 23 * v;
    out.speed = std::max(
        out.speed, 1e-3 / v * (norm(at.velocity.linear) + radius * norm(at.velocity.angular)));
    out.depth = std::max(out.depth, depth), shallow = std::min(shallow, depth);
    weak = std::min(weak, norm(command.wrench.force));
    strong = std::max(strong, norm(command.wrench.force));
  }
  out.swing = out.depth - shallow;
  out.ripple = (strong - weak) / most;
  h6DestroySession(s);
  return out;
}

}  // namespace

TEST_CASE("a part of any size and mass that is pressed on a wall or lies there is at rest") {
  double fastest = 0, deepest = 0, roughest = 0, widest = 0;
  for (const double size : kSizes) {
    const double v = size / 100;
    for (const Ground kind : {Ground::floor, Ground::plates}) {
      FieldArrays field = ground(kind, v);
      ShellArrays shell = box(v, kind == Ground::floor ? 2 : 1);
      Model model({def_of(field)}, {shell.def()});
      for (const double mass : kMasses)
        for (const h6Method method : kMethods)
          for (const Case what : {Case::pressed, Case::pressed_hard, Case::weight}) {
            if (what != Case::pressed_hard && kind == Ground::plates) continue;
            // Lighter than air: its depth at rest is less than a float resolves.
            if (what == Case::weight && mass < 1.2 * 8000 * v * v * v) continue;
            CAPTURE(size);
            CAPTURE(mass);
            CAPTURE(static_cast<int>(kind));
            CAPTURE(static_cast<int>(what));
            CAPTURE(std::string(h6MethodName(method)));
            const Rest rest = settle(model.handle, v, mass, method, what);
            CHECK(rest.speed < 1e-3);
            CHECK(rest.swing < 1e-3);
            CHECK(rest.ripple < 2e-3);
            CHECK(rest.depth < 0.5);
            CHECK(rest.depth > 0);
            fastest = std::max(fastest, rest.speed), deepest = std::max(deepest, rest.depth);
            roughest = std::max(roughest, rest.ripple), widest = std::max(widest, rest.swing);
          }
    }
  }
  MESSAGE("fastest point ", fastest, " voxels in a frame, deepest ", deepest, ", depth swings by ",
          widest, " voxels, force by ", roughest, " of its bound");
}

namespace {

// A session that derives its zeros: a part on a floor with voxels of 1 mm, in a hand.
struct InUse {
  double contact;
  h6CouplingDef coupling;
};
InUse in_use(double mass, double gravity, double contact = 0, double largest = 20e-3) {
  const double v = 1e-3;
  FieldArrays field = ground(Ground::floor, v);
  ShellArrays shell = bottom_face(largest, largest, 5 * v, 10, 10);
  Model model({def_of(field)}, {shell.def()});
  std::array<h6BodyDef, 2> bodies{h6DefaultBodyDef(), h6DefaultBodyDef()};
  h6HandDef hand = h6DefaultHandDef();
  h6SessionDef def = h6DefaultSessionDef();
  bodies[0].fixed = true, bodies[0].field = 0;
  bodies[1].shell = 0, bodies[1].mass = mass, bodies[1].pose = pose(0, 0, 6 * v);
  hand.body = 1;
  def.bodies = bodies.data(), def.body_count = 2;
  def.hands = &hand, def.hand_count = 1;
  def.gravity = {0, -gravity, 0};
  def.contact.stiffness = contact;
  h6Session* s = h6CreateSession(model.handle, &def, nullptr);
  REQUIRE(s);
  const InUse out{h6StiffnessFor(model.handle, &def), h6GetCoupling(s, 0)};
  h6DestroySession(s);
  return out;
}

}  // namespace

TEST_CASE(
    "default contacts are stiff enough for mass and weight, and the hand no stronger for mass") {
  CHECK(in_use(0.1, 0).contact == 1e4);
  CHECK(in_use(1e-5, 9.81).contact == 1e4);
  // Under any mass the contact swings at 100 rad/s or faster; the force stays that of half a voxel.
  CHECK(std::sqrt(in_use(500, 0).contact / 500) == near(100));
  CHECK(in_use(500, 0).coupling.max_force == in_use(0.1, 0).coupling.max_force);
  // The weight sinks a quarter of a voxel, and the hand can lift it.
  CHECK(in_use(500, 9.81).contact * 0.25e-3 == near(500 * 9.81));
  CHECK(in_use(500, 9.81).coupling.max_force == near(2 * 500 * 9.81));
  // A value that is set stays.
  for (const double mass : {1e-4, 0.1, 500.0}) {
    CHECK(in_use(mass, 9.81, 2e3).contact == 2e3);
    CHECK(in_use(mass, 9.81, 2e3).coupling.max_force == near(2e3 * 0.5e-3));
    CHECK(in_use(mass, 9.81, 2e3).coupling.stiffness == 1e3);
  }
  // A part turns as fast as it moves, however large it is; a small one as under 30 voxels.
  CHECK(in_use(0.1, 0).coupling.rotational_stiffness == near(1e3 * 900e-6));
  const double lever2 = in_use(0.1, 0, 0, 0.5).coupling.rotational_stiffness / 1e3;
  CHECK(lever2 > 0.5 * 0.5 / 4);
  CHECK(lever2 < 0.5 * 0.5);
  // Only light parts get more damping than was asked for.
  CHECK(in_use(0.05, 0).coupling.damping_ratio == 1);
  const InUse light = in_use(1e-4, 0);
  CHECK(2 * light.coupling.damping_ratio * std::sqrt(light.coupling.stiffness * 1e-4) == near(10));
  CHECK(in_use(1e-4, 0, 3e3).coupling.damping_ratio == near(0.3 * light.coupling.damping_ratio));
}
