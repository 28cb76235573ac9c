// SPDX-License-Identifier: Apache-2.0
// Substeps: near a field no point jumps over an obstacle, and elsewhere nothing changes.
#include <doctest/doctest.h>

#include <cmath>
#include <random>
#include <vector>

#include "runtime/contact/traverse_pair.h"
#include "runtime/frame/session.h"
#include "tests/support/ball_in_bowl.h"
#include "tests/support/box_on_floor.h"
#include "tests/support/one_part.h"
#include "tests/support/sanitized.h"

using namespace h6::test;

namespace {

constexpr double kStep = 0.2 * mm;  // a fifth of a voxel of all scenes here

double moved(const h6BodyState& before, const h6BodyState& after) {
  return norm(after.pose.p - before.pose.p);
}

// A ball without a hand that flies along the floor, one voxel above it, and spins.
struct FlyingBall : BoxOnFloor {
  ShellArrays ball = sphere_points(5 * mm, 500);
  Model round{{def_of(field)}, {ball.def()}};
  explicit FlyingBall(double speed, unsigned substeps) {
    bodies[1].com = {};
    std::fill_n(bodies[1].inertia, 6, 0.0);
    for (int i = 0; i < 3; ++i) bodies[1].inertia[i] = 1e-6;
    bodies[1].pose = pose(-40 * mm, 0, 6 * mm);
    bodies[1].velocity = {{speed, 0, 0}, {0, 30, 40}};
    def.hand_count = 0;
    def.max_substeps = substeps;
    h6Error error{};
    session = h6CreateSession(round.handle, &def, &error);
    REQUIRE_MESSAGE(session, error.message);
  }
  h6FrameReport step() {
    h6Step(session, nullptr, nullptr);
    return h6GetFrame(session);
  }
};

// A hand that holds a box directly and moves it through a sheet, half a voxel thick.
struct Sweep : BoxOnFloor {
  FieldArrays sheet =
      sample_analytic([](double, double, double z) { return std::fabs(z) - 0.25 * mm; },
                      {-32 * mm, -32 * mm, -32 * mm}, mm, 8, 8, 8);
  Model thin{{def_of(sheet)}, {shell.def()}};
  explicit Sweep(unsigned substeps) {
    def.max_substeps = substeps;
    hand.coupling.mode = H6_COUPLING_DIRECT;
    h6Error error{};
    session = h6CreateSession(thin.handle, &def, &error);
    REQUIRE_MESSAGE(session, error.message);
  }
  h6FrameReport step(double z, h6DeviceCommand* command = nullptr) {
    const h6DeviceSample sample = hand_at(pose(0, 0, z + 5 * mm));  // z: of the points
    h6Step(session, &sample, command);
    return h6GetFrame(session);
  }
};

// All six faces of a box, with points on its edges and corners.
ShellArrays whole_box(double half, int n) {
  ShellArrays s;
  for (int axis = 0; axis < 3; ++axis)
    for (const int side : {-1, 1})
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
          double p[3], inward[3] = {};
          p[axis] = side * half, inward[axis] = -side;
          p[(axis + 1) % 3] = half * (2.0 * i / (n - 1) - 1);
          p[(axis + 2) % 3] = half * (2.0 * j / (n - 1) - 1);
          s.add(p[0], p[1], p[2], inward[0], inward[1], inward[2]);
        }
  return s;
}

// A tool that its hand drives at an obstacle in the plane z = 0 and 12 mm beyond, and holds there.
struct Thrust : OnePart {
  Thrust(const Distance& obstacle, ShellArrays tool, unsigned substeps, double depth)
      : OnePart(sample_analytic(obstacle, {-32 * mm, -32 * mm, -32 * mm}, mm, 8, 8, 8),
                std::move(tool)) {
    bodies[1].pose = pose(0, 0, 20 * mm);
    hand.coupling.max_depth_voxels = depth;
    def.max_substeps = substeps;
    def.contact.method = H6_METHOD_ROBUST;  // `firm` holds the balls without substeps
    open();
  }
  // Whether the tool, about 4 mm large around its centre, comes out on the other side.
  bool passes(const h6Pose& start, const h6Vec3& along, double speed) {
    const h6Velocity velocity{speed * along, {}};
    h6DeviceSample sample = hand_at(start);
    h6Step(session, &sample, nullptr);
    const h6BodyState state{start, velocity};
    h6SetBody(session, 1, &state);
    const double way = 22 * mm;
    const int frames = static_cast<int>(way / speed * 1e3) + 60;
    for (int i = 1; i <= frames; ++i) {
      const double gone = std::min(speed * i * 1e-3, way);
      sample.pose.p = start.p + gone * along;
      sample.velocity = gone < way ? velocity : h6Velocity{};
      h6Step(session, &sample, nullptr);
      if (h6GetBody(session, 1).pose.p.z < -7.5 * mm) return true;
    }
    return false;
  }
};

// How many of `runs` thrusts at any angle pass through a sheet half a voxel thick.
int through_sheet(const ShellArrays& tool, unsigned substeps, int runs) {
  Thrust thrust([](double, double, double z) { return std::fabs(z) - 0.25 * mm; }, tool, substeps,
                0.1);
  std::mt19937 random(7);
  const auto any = [&](double from, double to) {
    return from + (to - from) * 0x1p-32 * static_cast<double>(random());
  };
  int passed = 0;
  for (int run = 0; run < runs; ++run) {
    const double speed = any(0.1, 2), tilt = any(0, 0.6), to = any(0, 2 * M_PI);
    const h6Vec3 along{std::sin(tilt) * std::cos(to), std::sin(tilt) * std::sin(to),
                       -std::cos(tilt)};
    h6Quat q{any(-1, 1), any(-1, 1), any(-1, 1), any(-1, 1)};
    const double n = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
    q = {q.w / n, q.x / n, q.y / n, q.z / n};
    if (run % 5 == 0) q = {1, 0, 0, 0};  // a face lands at once
    const h6Vec3 at{any(-3, 3) * mm, any(-3, 3) * mm, 0};
    passed += thrust.passes({at - any(8, 10) * mm * along, q}, along, speed);
  }
  return passed;
}

}  // namespace

TEST_CASE("no tool passes through a sheet half a voxel thick at up to 2 m/s") {
  const ShellArrays box = whole_box(4 * mm, 9), ball = sphere_points(4 * mm, 500);
  const int runs = repeated(5000, 200), without = repeated(1000, 300);
  CHECK(through_sheet(box, 16, runs) == 0);
  CHECK(through_sheet(ball, 16, runs) == 0);
  CHECK(through_sheet(box, 1, without) > without / 10);
  CHECK(through_sheet(ball, 1, without) > without / 100);
}

TEST_CASE("a wire of 1 mm holds a box at 1 m/s, and without substeps does not") {
  for (const unsigned substeps : {16u, 1u}) {
    CAPTURE(substeps);
    Thrust thrust([](double, double y, double z) { return std::hypot(y, z) - 0.5 * mm; },
                  whole_box(4 * mm, 15), substeps, 0.2);
    int passed = 0;
    for (int i = 0; i < 60; ++i)
      passed += thrust.passes(pose(0.1 * mm * i, (i - 30) * 0.03 * mm, (9 + 0.0137 * i) * mm),
                              {0, 0, -1}, 1);
    CHECK(passed == (substeps == 1 ? 60 : 0));
  }
}

TEST_CASE("far from everything, fast motion takes one step and has the bits of no substeps") {
  BoxOnFloor one, many;
  one.def.max_substeps = 1, many.def.max_substeps = 16;
  one.open(), many.open();
  for (int i = 0; i < 300; ++i) {
    h6DeviceSample sample = wild(i);
    sample.pose.p.z += 0.12;  // above the floor by more than the box and its way are long
    if (i == 0)
      for (BoxOnFloor* box : {&one, &many}) {
        const h6BodyState state{sample.pose, {{3, -2, 1}, {40, 0, 20}}};
        h6SetBody(box->session, 1, &state);
      }
    h6Step(one.session, &sample, nullptr);
    h6Step(many.session, &sample, nullptr);
    REQUIRE(h6GetFrame(many.session).substeps == 1);
    REQUIRE(h6GetFrame(one.session).state_hash == h6GetFrame(many.session).state_hash);
  }
  CHECK(norm(many.body().velocity.linear) > 0.1);
}

TEST_CASE("slow contact takes one step and has the bits of no substeps") {
  for (const h6CouplingMode mode : {H6_COUPLING_DYNAMIC, H6_COUPLING_STATIC, H6_COUPLING_DIRECT}) {
    CAPTURE(static_cast<int>(mode));
    BoxOnFloor one, many;
    for (BoxOnFloor* box : {&one, &many}) box->hand.coupling.mode = mode;
    one.def.max_substeps = 1, many.def.max_substeps = 16;
    one.open(), many.open();
    std::uint32_t contacts = 0;
    for (int i = 0; i < 500; ++i) {
      const h6DeviceSample sample = hand_at(
          {{2 * mm * std::sin(0.01 * i), 0, (5.2 - 0.004 * i) * mm}, about(1, 0, 0, 1e-4 * i)});
      h6Step(one.session, &sample, nullptr);
      h6Step(many.session, &sample, nullptr);
      REQUIRE(h6GetFrame(many.session).substeps == 1);
      REQUIRE(h6GetFrame(one.session).state_hash == h6GetFrame(many.session).state_hash);
      contacts = std::max(contacts, h6GetFrame(many.session).contacts);
    }
    CHECK(contacts > 10);
  }
}

TEST_CASE("free flight close to a wall ends where it ends without substeps") {
  FlyingBall one(1.9, 1), many(1.9, 16);
  for (int i = 0; i < 40; ++i) {
    one.step();
    const h6FrameReport r = many.step();
    REQUIRE(r.contacts == 0);
    REQUIRE(r.substeps > 1);
    REQUIRE((r.status & H6_SHORTENED) == 0);
  }
  const h6BodyState a = one.body(), b = many.body();
  CHECK(norm(a.pose.p - b.pose.p) < 1e-12);
  CHECK(norm(a.velocity.linear - b.velocity.linear) < 1e-12);
  CHECK(norm(a.velocity.angular - b.velocity.angular) < 1e-9);
  CHECK(angle_between(a.pose.q, b.pose.q) < 1e-9);
}

TEST_CASE("where a search begins does not change how far a body may go") {
  OnePart ball(sample_analytic([](double, double, double z) { return z; },
                               {-32 * mm, -32 * mm, -32 * mm}, mm, 8, 8, 8),
               sphere_points(5 * mm, 8000));
  ball.open();
  h6Session& s = *ball.session;
  constexpr double kEnough = 2, kLittle = 0.2;  // [voxel], and a voxel is 1 mm
  int touched = 0, close = 0, far = 0;
  for (double above = -0.5; above < 9; above += 0.11) {
    const h6BodyState at{pose(0.3 * mm, 0.2 * mm, (5 + above) * mm), {}};
    h6SetBody(ball.session, 1, &at);
    const auto may = [&](std::uint32_t hint) {
      const double clear = h6::clearance(s.settings, s.bodies[1], s.bodies[0], kEnough, kLittle,
                                         hint, s.lanes.scratch[0].traverse);
      return std::min(kEnough, std::max(clear, kLittle));
    };
    const double anywhere = may(UINT32_MAX);
    CAPTURE(above);
    for (std::uint32_t block = 0; block <= s.bodies[1].shell->blocks.count; ++block)
      REQUIRE(may(block) == anywhere);
    CHECK(anywhere <= std::max(above, kLittle) + 0.01);
    // Therefore a pair that touches need not be searched.
    if (above < -0.1) CHECK(anywhere == kLittle);
    touched += above <= 0, close += above > 0 && anywhere == kLittle, far += anywhere == kEnough;
  }
  CHECK(touched > 0);
  CHECK(close > 0);
  CHECK(far > 0);
}

TEST_CASE("near a field a body moves at most a fifth of a voxel a step, whatever the budget") {
  for (const unsigned budget : {2u, 4u, 64u})
    for (const double speed : {0.3, 0.7, 2.0, 9.0}) {
      CAPTURE(budget);
      CAPTURE(speed);
      FlyingBall ball(speed, budget);
      bool shortened = false;
      std::uint32_t most = 0;
      for (int i = 0; i < 30 && ball.body().pose.p.x < 40 * mm; ++i) {
        const h6BodyState before = ball.body();
        const h6FrameReport r = ball.step();
        REQUIRE(r.substeps <= budget);
        REQUIRE(moved(before, ball.body()) <= r.substeps * kStep * (1 + 1e-9));
        shortened = shortened || (r.status & H6_SHORTENED);
        most = std::max(most, r.substeps);
      }
      // A spinning point moves faster than the centre.
      const bool enough = (speed + 50 * 5 * mm) * 1e-3 <= budget * kStep;
      CHECK(shortened == !enough);
      if (!enough) CHECK(most == budget);
    }
}

TEST_CASE("with a budget of one step nothing is bounded") {
  FlyingBall ball(9, 1);
  const h6BodyState before = ball.body();
  const h6FrameReport r = ball.step();
  CHECK(r.substeps == 1);
  CHECK((r.status & H6_SHORTENED) == 0);
  CHECK(moved(before, ball.body()) == doctest::Approx(9 * mm));
}

TEST_CASE(
    "a box that its hand holds directly meets the sheet that it jumps over without substeps") {
  Sweep one(1), many(16);
  h6DeviceCommand jumped{}, swept{};
  one.step(1.5 * mm), many.step(1.5 * mm);
  CHECK(one.step(-1.5 * mm, &jumped).max_depth == 0);
  const h6FrameReport r = many.step(-1.5 * mm, &swept);
  CHECK(r.substeps >= 15);
  CHECK(r.max_depth > 0.01 * mm);
  CHECK((r.status & H6_SHORTENED) == 0);
  CHECK(jumped.wrench.force.z == 0);
  CHECK(std::fabs(swept.wrench.force.z) > 0);
  CHECK(same_bits(one.body().pose.q, many.body().pose.q));
  CHECK(one.body().pose.p.z == many.body().pose.p.z);
}

TEST_CASE("a box that its hand holds directly stays behind when the budget ends, and catches up") {
  Sweep few(2);
  few.step(2 * mm);
  double before = few.body().pose.p.z;
  int late = 0;
  for (int i = 0; i < 12; ++i) {
    const h6FrameReport r = few.step(-2 * mm);
    const double z = few.body().pose.p.z;
    CHECK(before - z <= 2 * kStep * (1 + 1e-9));
    late += (r.status & H6_SHORTENED) != 0;
    before = z;
  }
  CHECK(late >= 8);
  CHECK((h6GetFrame(few.session).status & H6_SHORTENED) == 0);
  CHECK(few.body().pose.p.z == 3 * mm);
}

TEST_CASE("an impact takes energy and gives none, with either integrator") {
  for (const h6Integrator integrator : {H6_IMPLICIT, H6_EXPLICIT}) {
    CAPTURE(static_cast<int>(integrator));
    BoxOnFloor box;
    box.def.hand_count = 0;
    box.def.integrator = integrator;
    box.def.max_substeps = 16;
    box.bodies[1].pose.p.z = 10 * mm;
    box.bodies[1].velocity = {{0.2, 0, -1}, {}};
    box.open();
    double most = 0;
    std::uint32_t contacts = 0;
    for (int i = 0; i < 60; ++i) {
      h6Step(box.session, nullptr, nullptr);
      most = std::max(most, norm(box.body().velocity.linear));
      contacts = std::max(contacts, h6GetFrame(box.session).contacts);
    }
    CHECK(contacts > 100);
    CHECK(most < std::hypot(0.2, 1) * (1 + 1e-9));
    CHECK(norm(box.body().velocity.linear) < 1);
  }
}

// A box of this mass under a hand that presses it on the floor, in explicit steps.
struct PressedBox : BoxOnFloor {
  PressedBox(double mass, h6Method method, std::uint32_t most_steps) {
    bodies[1].mass = mass;
    for (int i = 0; i < 3; ++i) bodies[1].inertia[i] = mass * 5e-5;
    def.integrator = H6_EXPLICIT;
    def.contact.method = method;
    def.max_substeps = most_steps;
    open();
  }
  // The largest speed after a second.
  double press() {
    const h6DeviceSample down = hand_at(pose(0, 0, 4 * mm));
    double fastest = 0;
    for (int i = 0; i < 1500; ++i) {
      h6Step(session, &down, nullptr);
      if (i > 1000) fastest = std::max(fastest, norm(body().velocity.linear));
    }
    return fastest;
  }
  std::uint32_t steps() const { return h6GetFrame(session).substeps; }
};

TEST_CASE("an explicit frame takes the steps that its hand and one wall of stiffness k need") {
  std::uint32_t before = 1;
  for (const double mass : {1e-2, 1e-3, 1e-4}) {  // the lighter, the shorter the step
    CAPTURE(mass);
    PressedBox many(mass, H6_METHOD_GAUSS3, 64), one(mass, H6_METHOD_GAUSS3, 1);
    CHECK(many.press() < 1e-4);
    CHECK(many.steps() > before);
    before = many.steps();
    const double unsteady = one.press();
    CHECK(one.steps() == 1);
    if (mass < 5e-3) CHECK(unsteady > 0.01);
    PressedBox stiffer(mass, H6_METHOD_NONE, 64);  // the rule does not enter
    stiffer.press();
    CHECK(stiffer.steps() == before);
  }
  PressedBox heavy(100, H6_METHOD_GAUSS3, 64);
  heavy.press();
  CHECK(heavy.steps() == 1);
}

TEST_CASE("a hand that holds its body arrives although another body needs more explicit steps") {
  BoxOnFloor scene;
  std::array<h6BodyDef, 3> bodies{scene.bodies[0], scene.bodies[1], scene.bodies[1]};
  std::array<h6HandDef, 2> hands{scene.hand, scene.hand};
  bodies[1].mass = 1e-5;
  for (int i = 0; i < 3; ++i) bodies[1].inertia[i] = 1e-10;
  bodies[2].pose = pose(0, 0, 20 * mm);
  hands[1].body = 2;
  hands[1].coupling.mode = H6_COUPLING_DIRECT;
  scene.def.bodies = bodies.data(), scene.def.body_count = 3;
  scene.def.hands = hands.data(), scene.def.hand_count = 2;
  scene.def.integrator = H6_EXPLICIT;
  scene.def.max_substeps = 2;
  scene.open();
  std::array<h6DeviceSample, 2> samples{hand_at(bodies[1].pose), hand_at(bodies[2].pose)};
  h6Step(scene.session, samples.data(), nullptr);
  samples[1].pose.p.z += 1 * mm;
  const h6Status status = h6Step(scene.session, samples.data(), nullptr);
  CHECK(h6GetFrame(scene.session).substeps == 2);
  CHECK((status & H6_SHORTENED) == 0);
  CHECK(h6GetBody(scene.session, 2).pose.p.z == samples[1].pose.p.z);
}

TEST_CASE("a body that is put somewhere else does not remember the speed that it gained") {
  BoxOnFloor fallen, fresh;
  for (BoxOnFloor* box : {&fallen, &fresh}) {
    box->def.hand_count = 0;
    box->def.gravity = {0, 0, -300};
    box->def.max_substeps = 16;
    box->open();
  }
  h6Step(fallen.session, nullptr, nullptr);
  const h6BodyState state{pose(0, 0, 5.5 * mm), {}};
  for (BoxOnFloor* box : {&fallen, &fresh}) {
    h6SetBody(box->session, 1, &state);
    h6Step(box->session, nullptr, nullptr);
    CHECK(h6GetFrame(box->session).substeps == 1);
  }
  CHECK(h6GetFrame(fallen.session).state_hash == h6GetFrame(fresh.session).state_hash);
}

TEST_CASE("fast motion against a wall has the same bits on one thread and on two, and twice") {
  std::vector<std::uint64_t> hashes[3];
  int several = 0;
  for (int run = 0; run < 3; ++run) {
    BallInBowl scene(run == 1 ? 2 : 1, 6000);
    scene.def.max_substeps = 8;
    scene.bodies[1].velocity = {{2, 1, -1}, {0, 20, 0}};
    scene.open();
    for (int i = 0; i < 60; ++i) {
      h6DeviceSample sample = scene.sample(7 * i);
      sample.pose.p.x += 3 * mm * std::sin(0.9 * i);
      h6Step(scene.session, &sample, nullptr);
      hashes[run].push_back(h6GetFrame(scene.session).state_hash);
      several += h6GetFrame(scene.session).substeps > 1;
    }
  }
  CHECK(several > 10);
  CHECK(hashes[0] == hashes[1]);
  CHECK(hashes[0] == hashes[2]);
}

TEST_CASE("sixty thousand frames of wild motion run again to the bit") {
  BoxOnFloor one, again;
  one.def.max_substeps = again.def.max_substeps = 8;
  one.open(), again.open();
  long several = 0;
  for (int i = 0; i < 60000; ++i) {
    const h6DeviceSample sample = wild(i);
    h6Step(one.session, &sample, nullptr);
    h6Step(again.session, &sample, nullptr);
    const h6FrameReport a = h6GetFrame(one.session), b = h6GetFrame(again.session);
    several += a.substeps > 1;
    if (a.state_hash == b.state_hash && a.substeps == b.substeps && a.status == b.status) continue;
    CAPTURE(i);
    REQUIRE(a.state_hash == b.state_hash);
    REQUIRE(a.substeps == b.substeps);
  }
  CHECK(several > 1000);
}
