// SPDX-License-Identifier: Apache-2.0
// Indexing and scaling: no motion is lost, no pose jumps, no error accumulates.
#include "runtime/hand/hand_filter.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>
#include <utility>

#include "tests/support/analytic.h"
#include "tests/support/near.h"

using namespace h6;

namespace {

const Vec3 kCom(0.02, -0.03, 0.05);
const h6Pose kElsewhere{{7, 8, 9}, {0, 1, 0, 0}};

double uniform(std::mt19937_64& random) {
  return std::ldexp(static_cast<double>(random() >> 11), -52) - 1;
}
Vec3 vector(std::mt19937_64& random) { return {uniform(random), uniform(random), uniform(random)}; }

h6DeviceSample sample_at(const Vec3& p, const Quat& q) {
  h6DeviceSample s{};
  s.pose = {to(p), to(q)};
  return s;
}

h6HandFilterDef scales(double motion, double rotation, double force = 1) {
  return {motion, rotation, force, 1u, false, {}};
}

bool same_bits(const void* a, const void* b, std::size_t n) { return std::memcmp(a, b, n) == 0; }
Vec3 com_of(const h6Pose& p) { return from(p.p) + from(p.q) * kCom; }
double angle(const h6Quat& a, const h6Quat& b) {
  return log_rotation(from(a) * from(b).conjugate()).norm();
}

struct Hand {
  HandFilter filter;
  bool clutched = false;
  explicit Hand(const h6HandFilterDef& def, bool admittance = false) {
    filter.set(def, kCom, admittance);
  }
  h6DeviceSample operator()(const h6DeviceSample& s, const h6Pose& scene = kElsewhere) {
    return filter.to_scene(s, scene, &clutched);
  }
};

}  // namespace

TEST_CASE("the default filter changes no bit, in either direction") {
  std::mt19937_64 random(1);
  h6HandFilterDef def = scales(1, 1);
  def.clutch_buttons = 0;
  Hand hand(def);
  for (int i = 0; i < 1000; ++i) {
    h6DeviceSample s = sample_at(vector(random), exp_rotation(3 * vector(random)));
    s.velocity = {to(vector(random)), to(vector(random))};
    s.wrench = {to(vector(random)), to(vector(random))};
    s.buttons = 0xffffffffu;
    const h6DeviceSample out = hand(s);
    CHECK(same_bits(&out.pose, &s.pose, sizeof s.pose));
    CHECK(same_bits(&out.velocity, &s.velocity, sizeof s.velocity));
    CHECK(same_bits(&out.wrench, &s.wrench, sizeof s.wrench));
    const h6BodyState state{s.pose, s.velocity}, back = hand.filter.to_device(state);
    CHECK(same_bits(&back, &state, sizeof state));
    const h6Wrench felt = hand.filter.to_device(s.wrench);
    CHECK(same_bits(&felt, &s.wrench, sizeof felt));
    CHECK_FALSE(hand.clutched);
  }
}

TEST_CASE("a turn of the device about the centre of mass turns the body about it, by its scale") {
  Hand hand(scales(3, 0.5));
  const Quat q0 = exp_rotation({0.3, -0.2, 0.9});
  const Vec3 c(0.1, 0.2, 0.3), axis = Vec3(1, 2, -2) / 3;
  hand(sample_at(c - q0 * kCom, q0));
  for (double a = 0; a <= 3; a += 0.1) {
    const Quat q = exp_rotation(a * axis) * q0;
    const h6DeviceSample out = hand(sample_at(c - q * kCom, q));
    CHECK((com_of(out.pose) - c).norm() < 1e-12);
    CHECK(angle(out.pose.q, to(Quat(exp_rotation(0.5 * a * axis) * q0))) < 1e-9);
  }
}

TEST_CASE("a displacement of the device moves the body by its scale, whatever the turn") {
  Hand hand(scales(2.5, 0.7));
  hand(sample_at({0, 0, 0}, Quat::Identity()));
  const Vec3 start = kCom;
  const Quat q = exp_rotation({0.4, 1.1, -0.3});
  const Vec3 way(0.01, -0.02, 0.03);
  const h6DeviceSample out = hand(sample_at(start + way - q * kCom, q));
  CHECK((com_of(out.pose) - (start + 2.5 * way)).norm() < 1e-12);
}

TEST_CASE("three turns of the device are one and a half of the body at scale a half, and back") {
  const Vec3 axis = Vec3(2, -1, 2) / 3;
  const Quat q0 = exp_rotation({0.5, 0.1, -0.7});
  for (const double scale : {0.5, 2.0, 0.3}) {
    Hand hand(scales(1, scale));
    const auto turned_to = [&](double a) {
      return hand(sample_at({0, 0, 0}, exp_rotation(a * axis) * q0));
    };
    const h6DeviceSample first = turned_to(0);
    const int steps = 3000;
    double turned = 0;  // sum of the body's turns
    h6Quat last = first.pose.q;
    h6DeviceSample out{};
    for (int i = 1; i <= steps; ++i) {
      out = turned_to(6 * M_PI * i / steps);
      const Vec3 step = log_rotation(from(out.pose.q) * from(last).conjugate());
      CHECK(step.norm() == h6::test::near(scale * 6 * M_PI / steps).epsilon(1e-6));
      turned += step.dot(axis);
      last = out.pose.q;
    }
    CHECK(turned == h6::test::near(scale * 6 * M_PI).epsilon(1e-9));
    for (int i = steps - 1; i >= 0; --i) out = turned_to(6 * M_PI * i / steps);
    CHECK(angle(out.pose.q, first.pose.q) < 1e-9);
    CHECK((from(out.pose.p) - from(first.pose.p)).norm() < 1e-9);
  }
}

TEST_CASE("after a long wobble of the hand the body is where it was") {
  // A sum of small scaled turns would drift, because closed paths enclose an area.
  Hand hand(scales(1, 0.5));
  const h6DeviceSample first = hand(sample_at({0, 0, 0}, Quat::Identity()));
  for (int i = 1; i <= 100000; ++i) {
    const double t = 0.01 * i;
    hand(sample_at({0, 0, 0}, exp_rotation({0.6 * std::sin(t), 0.5 * std::sin(t * M_SQRT2 + 1),
                                            0.7 * std::cos(t / M_SQRT2)})));
  }
  const h6DeviceSample last = hand(sample_at({0, 0, 0}, Quat::Identity()));
  CHECK(angle(last.pose.q, first.pose.q) < 1e-9);
}

TEST_CASE("a body never turns faster than the scale allows, however the hand tumbles") {
  std::mt19937_64 random(5);
  for (const double scale : {0.25, 0.5, 3.0}) {
    Hand hand(scales(1, scale));
    Quat q = Quat::Identity();
    h6Quat last = hand(sample_at({0, 0, 0}, q)).pose.q;
    for (int i = 0; i < 20000; ++i) {
      const Vec3 step = 0.02 * vector(random) + Vec3(0.01, 0.005, 0);
      q = (exp_rotation(step) * q).normalized();
      const h6Quat now = hand(sample_at({0, 0, 0}, q)).pose.q;
      // Perpendicular to the turn so far, half a turn's chord counts: sin(s a)/sin(a) at 1 rad.
      REQUIRE(angle(now, last) <= std::max(1.0, scale) * step.norm() * 1.01 + 1e-12);
      last = now;
    }
  }
}

TEST_CASE("velocities are the derivatives of the mapped poses") {
  const double h = 1e-5;
  for (const auto& [motion, rotation] : {std::pair{2.0, 0.5}, {0.3, 2.0}, {1.0, 0.4}}) {
    Hand hand(scales(motion, rotation));
    const auto at = [](double t) {
      return sample_at({0.1 * std::sin(t), 0.2 * std::cos(2 * t), 0.05 * t},
                       exp_rotation(Vec3(0.3, 0.8 * t, 0)) * exp_rotation(Vec3(t, 0, 0.2)));
    };
    hand(at(0));
    for (double t = 0.01; t < 4; t += 0.01) {
      const h6DeviceSample before = at(t - h), after = at(t + h);
      h6DeviceSample now = at(t);
      now.velocity.linear = to(Vec3((from(after.pose.p) - from(before.pose.p)) / (2 * h)));
      now.velocity.angular =
          to(Vec3(log_rotation(from(after.pose.q) * from(before.pose.q).conjugate()) / (2 * h)));
      HandFilter copy = hand.filter;
      bool clutched;
      const h6DeviceSample x = copy.to_scene(before, kElsewhere, &clutched);
      const h6DeviceSample out = hand(now);
      copy = hand.filter;
      const h6DeviceSample y = copy.to_scene(after, kElsewhere, &clutched);
      const Vec3 v = (from(y.pose.p) - from(x.pose.p)) / (2 * h);
      const Vec3 w = log_rotation(from(y.pose.q) * from(x.pose.q).conjugate()) / (2 * h);
      CHECK((from(out.velocity.linear) - v).norm() < 1e-4 * (1 + v.norm()));
      CHECK((from(out.velocity.angular) - w).norm() < 1e-4 * (1 + w.norm()));
    }
  }
}

TEST_CASE("force scaled like motion and rotation keeps power") {
  std::mt19937_64 random(8);
  Hand hand(scales(0.4, 0.4, 0.4));
  hand(sample_at({0, 0, 0}, Quat::Identity()));
  // At the anchor the whole angular velocity is scaled; away from it only its part along the turn.
  const Quat q = Quat::Identity();
  h6DeviceSample s = sample_at({0.01, 0.02, 0}, q);
  s.velocity = {to(vector(random)), to(vector(random))};
  const h6DeviceSample out = hand(s);
  const h6Wrench felt{to(vector(random)), to(vector(random))}, sent = hand.filter.to_device(felt);
  const auto power = [](const h6Wrench& f, const h6DeviceSample& x) {
    const Vec3 w = from(x.velocity.angular);
    const Vec3 v = from(x.velocity.linear) + w.cross(from(x.pose.q) * kCom);
    return from(f.force).dot(v) + from(f.torque).dot(w);
  };
  CHECK(power(sent, s) == h6::test::near(power(felt, out)).epsilon(1e-12));
}

TEST_CASE("the clutch holds the manipulandum, and its release changes no bit of the pose") {
  std::mt19937_64 random(3);
  for (const auto& [motion, rotation] : {std::pair{1.0, 1.0}, {2.0, 0.5}}) {
    Hand hand(scales(motion, rotation));
    hand(sample_at({0, 0, 0}, Quat::Identity()));
    h6DeviceSample s = sample_at(vector(random), exp_rotation(vector(random)));
    const h6DeviceSample before = hand(s);
    for (int i = 0; i < 10; ++i) {
      s = sample_at(vector(random), exp_rotation(vector(random)));
      s.velocity = {to(vector(random)), to(vector(random))};
      s.wrench = {to(vector(random)), to(vector(random))};
      s.buttons = 1;
      const h6DeviceSample held = hand(s);
      const h6Velocity none{};
      CHECK(hand.clutched);
      CHECK(same_bits(&held.pose, &before.pose, sizeof held.pose));
      CHECK(same_bits(&held.velocity, &none, sizeof none));
      CHECK(held.wrench.force.x == 0);
      const h6Wrench felt = hand.filter.to_device(h6Wrench{{1, 2, 3}, {4, 5, 6}});
      CHECK((felt.force.x == 0 && felt.torque.z == 0));
    }
    s.buttons = 0;
    for (int i = 0; i < 3; ++i) {
      const h6DeviceSample released = hand(s);
      CHECK_FALSE(hand.clutched);
      CHECK(same_bits(&released.pose, &before.pose, sizeof released.pose));
    }
    // Then it follows.
    s.pose.p.x += 0.01;
    CHECK(hand(s).pose.p.x == h6::test::near(before.pose.p.x + motion * 0.01).epsilon(1e-9));
  }
}

TEST_CASE("a relative hand holds the body where it is; an absolute one moves it to the hand") {
  h6HandFilterDef def = scales(2, 2);
  def.relative = true;
  const h6DeviceSample s = sample_at({1, 2, 3}, exp_rotation({1, 0, 0}));
  const h6Pose body{{-1, 0, 4}, to(exp_rotation({0, 0.5, 0}))};
  Hand relative(def);
  const h6DeviceSample taken = relative(s, body);
  CHECK(same_bits(&taken.pose, &body, sizeof body));
  def.relative = false;
  Hand other(def);
  const h6DeviceSample brought = other(s, body);
  CHECK(same_bits(&brought.pose, &s.pose, sizeof s.pose));
}

TEST_CASE("a pose mapped to an admittance device and back is the same pose") {
  std::mt19937_64 random(4);
  h6HandFilterDef def = scales(0.5, 2, 4);
  def.relative = true;
  Hand hand(def, true);
  const h6Pose body{{-1, 0, 4}, to(exp_rotation({0, 0.5, 0}))};
  h6DeviceSample s = sample_at({1, 2, 3}, exp_rotation({1, 0, 0}));
  s.wrench.force.x = 8;
  const h6DeviceSample in = hand(s, body);
  CHECK(in.wrench.force.x == 2);  // 4 N at the device are 1 N in the scene
  const h6BodyState here = hand.filter.to_device(h6BodyState{body, {}});
  CHECK(same_bits(&here.pose, &s.pose, sizeof here.pose));
  for (int i = 0; i < 100; ++i) {
    const Quat q = exp_rotation(vector(random)) * from(body.q);
    const Vec3 p = from(body.p) + vector(random);
    const h6BodyState out = hand.filter.to_device(h6BodyState{{to(p), to(q)}, {}});
    const h6DeviceSample again = hand(sample_at(from(out.pose.p), from(out.pose.q)), body);
    CHECK((from(again.pose.p) - p).norm() < 1e-9);
    CHECK(angle(again.pose.q, to(q)) < 1e-9);
  }
}

TEST_CASE(
    "an admittance device under the clutch is told what it does, and then goes on from there") {
  Hand hand(scales(0.5, 1), true);
  const h6Pose body{{0, 0, 1}, {1, 0, 0, 0}};
  hand(sample_at({0, 0, 0}, Quat::Identity()), body);
  h6DeviceSample s = sample_at({0.3, 0.2, 0.1}, exp_rotation({0, 0, 1}));
  s.buttons = 1;
  hand(s, body);
  const h6BodyState echoed = hand.filter.to_device(h6BodyState{body, {{1, 1, 1}, {}}});
  CHECK(same_bits(&echoed.pose, &s.pose, sizeof s.pose));
  CHECK(echoed.velocity.linear.x == 0);
  s.buttons = 0;
  hand(s, body);
  const h6BodyState next = hand.filter.to_device(h6BodyState{body, {}});
  CHECK(same_bits(&next.pose, &s.pose, sizeof s.pose));
}

namespace {

constexpr double mm = 1e-3;

// A box on a floor, held by a hand with this filter; the hand presses it in.
struct Pressing {
  test::FieldArrays field = test::sample_analytic([](double, double, double z) { return z; },
                                                  {-32 * mm, -32 * mm, -32 * mm}, mm, 8, 8, 8);
  test::ShellArrays shell = test::bottom_face(10 * mm, 10 * mm, 5 * mm, 8, 8);
  test::Model model{{test::def_of(field)}, {shell.def()}};
  h6BodyDef bodies[2] = {h6DefaultBodyDef(), h6DefaultBodyDef()};
  h6HandDef hand = h6DefaultHandDef();
  h6SessionDef def = h6DefaultSessionDef();
  h6Session* session = nullptr;
  h6DeviceSample sample = sample_at({0, 0, 2 * mm}, Quat::Identity());
  h6DeviceCommand told{};

  Pressing() {
    bodies[0].fixed = true, bodies[0].field = 0;
    bodies[1].shell = 0;
    bodies[1].pose = test::pose(0, 0, 5 * mm);
    hand.body = 1;
    hand.safety.soft_start = 0;  // other tests cover it
    def.bodies = bodies, def.body_count = 2;
    def.hands = &hand, def.hand_count = 1;
  }
  ~Pressing() { h6DestroySession(session); }
  void open() {
    h6Error error;
    session = h6CreateSession(model.handle, &def, &error);
    REQUIRE_MESSAGE(session, error.message);
  }
  h6Status step(int frames = 1) {
    h6Status status = 0;
    for (int i = 0; i < frames; ++i) status = h6Step(session, &sample, &told);
    return status;
  }
};

}  // namespace

TEST_CASE(
    "under the clutch the hand feels nothing and the part stays pressed; then the force returns") {
  Pressing scene;
  scene.hand.filter.clutch_buttons = 2;
  scene.open();
  h6DeviceCapabilities slow{};
  slow.max_force = 10, slow.max_torque = 1, slow.max_force_rate = 500,
  slow.frame_time = true;  // half a newton a frame
  h6SetRating(scene.session, 0, &slow);
  scene.step(3000);
  const double pressed = scene.told.wrench.force.z, height = h6GetBody(scene.session, 1).pose.p.z;
  CHECK(pressed > 2);
  scene.sample.buttons = 2;
  CHECK((scene.step() & H6_OUTPUT_SLEWED) != 0);
  CHECK(scene.told.wrench.force.z == test::near(pressed - 0.5));  // not at once
  CHECK(scene.told.cause == H6_CAUSE_CLUTCHED);
  scene.sample.pose.p = {0.1, 0.2, 0.3};  // the device moves alone
  scene.sample.velocity.linear = {1, 1, 1};
  scene.step(500);
  CHECK(from(scene.told.wrench.force).norm() == 0);
  CHECK(scene.told.cause == H6_CAUSE_CLUTCHED);
  CHECK(h6GetBody(scene.session, 1).pose.p.z == test::near(height).epsilon(1e-6));
  scene.sample.velocity = {};
  scene.sample.buttons = 0;
  scene.step(500);
  CHECK(scene.told.cause == H6_CAUSE_NONE);
  CHECK(scene.told.wrench.force.z == test::near(pressed).epsilon(1e-4));
  CHECK(h6GetBody(scene.session, 1).pose.p.z == test::near(height).epsilon(1e-6));
}

TEST_CASE("a relative hand begins without a pull, wherever its device is") {
  for (const bool relative : {false, true}) {
    Pressing scene;
    scene.bodies[1].pose = test::pose(0, 0, 20 * mm);
    scene.hand.filter.relative = relative;
    scene.sample = sample_at({0.3, 0.2, 0.1}, exp_rotation({1, 0, 0}));
    scene.open();
    scene.step(20);
    CHECK((from(scene.told.wrench.force).norm() < 1e-12) == relative);
    CHECK((h6GetBody(scene.session, 1).pose.p.x == 0) == relative);
  }
}

TEST_CASE("a session scales a hand's motion on the way in and its force on the way out") {
  Pressing scene;
  scene.hand.filter = scales(0.1, 1, 3);
  scene.hand.filter.relative = true;
  scene.open();
  scene.step();
  scene.sample.pose.p.z -= 20 * mm;  // 2 mm in the scene
  scene.step(3000);
  const double z = h6GetBody(scene.session, 1).pose.p.z;
  CHECK(scene.told.wrench.force.z == test::near(3 * 1e3 * (z - 3 * mm)).epsilon(1e-4));
}
