// SPDX-License-Identifier: Apache-2.0
// These promises hold in every frame of any scene: no contact pulls, no force jumps, no bound
// breaks, and invalid samples do no harm.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "hapsix/hapsix.h"
#include "hapsix/vector.h"
#include "tests/support/analytic.h"
#include "tests/support/near.h"
#include "tests/support/one_part.h"

using namespace h6::test;

namespace {

constexpr double mm = 1e-3;

// The part stands where a test puts it.
struct Scene : OnePart {
  Scene(FieldArrays f, ShellArrays s) : OnePart(std::move(f), std::move(s)) { def.hand_count = 0; }
  h6Contacts at(const h6Pose& pose) {
    const h6BodyState state{pose, {}};
    h6SetBody(session, 1, &state);
    h6Step(session, nullptr, nullptr);
    return h6GetContacts(session, 1);
  }
};

FieldArrays floor_field() {
  return sample_analytic([](double, double, double z) { return z; }, {-32 * mm, -32 * mm, -16 * mm},
                         mm, 8, 8, 4);
}
// The floor ends at x = 0.
FieldArrays ledge_field() {
  return sample_analytic(
      [](double x, double, double z) { return x > 0 && z > 0 ? std::hypot(x, z) : std::max(x, z); },
      {-48 * mm, -24 * mm, -16 * mm}, mm, 12, 6, 4);
}
// A sheet 2 mm thick.
FieldArrays sheet_field() {
  return sample_analytic([](double, double, double z) { return std::fabs(z) - mm; },
                         {-24 * mm, -24 * mm, -16 * mm}, mm, 6, 6, 4);
}

double uniform(std::mt19937_64& random) {
  return std::ldexp(static_cast<double>(random() >> 11), -52) - 1;
}  // [-1, 1)

// Counts the contacts that press a body further into the field around it, over random poses of a
// ball that is stuck in a sheet thinner than itself.
int contacts_that_pull(h6Method method, std::uint32_t pieces, int* loaded) {
  Scene scene(sheet_field(), sphere_points(4 * mm, 500));
  scene.def.contact.method = method;
  scene.def.contact.pieces = pieces;
  scene.open();
  std::mt19937_64 random(17);
  int pulling = 0;
  for (int i = 0; i < 150; ++i) {
    h6Pose pose{{uniform(random) * mm, uniform(random) * mm, 5 * mm * uniform(random)}, {}};
    double q[4], length = 0;
    for (double& v : q) v = uniform(random), length += v * v;
    length = std::sqrt(length);
    pose.q = {q[0] / length, q[1] / length, q[2] / length, q[3] / length};
    const h6Contacts c = scene.at(pose);
    for (std::size_t k = 0; k < c.count; ++k) {
      // F . g: along the way out of the obstacle.
      const double out = c.load[k] * (c.nx[k] * c.gx[k] + c.ny[k] * c.gy[k] + c.nz[k] * c.gz[k]);
      pulling += out < 0;
      *loaded += out > 0;
    }
  }
  return pulling;
}

// Largest change of the contact force between frames as a box slides off the ledge at 50 mm/s,
// 0.4 mm deep, in k times a voxel.
double slide_off_jump(h6Method method, double rate) {
  Scene scene(ledge_field(), bottom_face(10 * mm, 10 * mm, 5 * mm, 20, 20));
  scene.def.contact.method = method;
  scene.def.rate = rate;
  scene.open();
  const int frames = static_cast<int>(0.5 * rate);
  double jump = 0, last[3] = {};
  for (int i = 0; i <= frames; ++i) {
    const h6Contacts c = scene.at(pose(-12.5 * mm + 50 * mm * i / rate, 0, 4.6 * mm));
    double f[3] = {};
    for (std::size_t k = 0; k < c.count; ++k)
      f[0] += c.load[k] * c.nx[k], f[1] += c.load[k] * c.ny[k], f[2] += c.load[k] * c.nz[k];
    double change = 0;
    for (int a = 0; a < 3; ++a) change += (f[a] - last[a]) * (f[a] - last[a]), last[a] = f[a];
    if (i > 0) jump = std::max(jump, std::sqrt(change) / mm);
  }
  CHECK(last[2] < 0.3 * mm);  // nearly everything has slid off
  return jump;
}

}  // namespace

TEST_CASE("no contact ever pulls: forces point out of the obstacle in robust and series") {
  for (const h6Method m : {H6_METHOD_ROBUST, H6_METHOD_SERIES}) {
    int loaded = 0;
    CHECK(contacts_that_pull(m, 0, &loaded) == 0);
    CHECK(loaded > 1000);
  }
  int loaded = 0;
  CHECK(contacts_that_pull(H6_METHOD_GAUSS3, 0, &loaded) > 100);  // the filter prevents this
  CHECK(contacts_that_pull(H6_METHOD_GAUSS3, H6_PIECE_FACING, &loaded) == 0);
}

TEST_CASE(
    "robust: the largest jump of the force shrinks 5 times and more when h shrinks 10 times") {
  for (const h6Method m : {H6_METHOD_ROBUST, H6_METHOD_SERIES}) {
    CAPTURE(std::string(h6MethodName(m)));
    const double coarse = slide_off_jump(m, 1000), fine = slide_off_jump(m, 10000);
    CHECK(coarse > 0.01);  // there is something to shrink
    CHECK(fine < coarse / 5);
  }
  // Without depth in the weights, contacts that leave take their share with them at once.
  CHECK(slide_off_jump(H6_METHOD_GAUSS3, 10000) > 0.5 * slide_off_jump(H6_METHOD_GAUSS3, 1000));
}

namespace {

// A box of 0.98 N on the floor, pulled up and twisted by a hand that may only do `bound` [N].
void check_too_weak(h6CouplingMode mode, h6Gradient gradient, h6Method method, double bound) {
  Scene scene(floor_field(), bottom_face(10 * mm, 10 * mm, 5 * mm, 12, 12));
  scene.bodies[1].pose = pose(0, 0, 5 * mm);
  scene.def.gravity = {0, 0, -9.81};  // on 0.1 kg
  scene.def.gradient = gradient;
  scene.def.contact.method = method;
  scene.hand.coupling.mode = mode;
  scene.hand.coupling.max_force = bound;
  scene.hand.coupling.max_torque = 1e-2 * bound;
  scene.def.hand_count = 1;
  scene.open();
  CAPTURE(bound);
  CAPTURE(static_cast<int>(mode));
  CAPTURE(static_cast<int>(gradient));
  CAPTURE(std::string(h6MethodName(method)));
  const h6DeviceSample sample = hand_at({{0, 0, 40 * mm}, {std::cos(0.2), 0, 0, std::sin(0.2)}});
  h6DeviceCommand felt;
  h6BodyState settled{};
  int free = 0;
  for (int i = 0; i < 3000; ++i) {
    free += !(h6Step(scene.session, &sample, &felt) & H6_COUPLING_SATURATED);
    if (i == 1500) settled = h6GetBody(scene.session, 1);
  }
  CHECK(free == 0);
  const h6BodyState later = h6GetBody(scene.session, 1);
  // The bound is a ten-thousandth of a voxel in 1.5 s. Sideways the rounding of the 0.98 N to float
  // adds to it, because nothing else holds a part without friction.
  const double rounded = 0.5 * (0.98 * std::ldexp(1, -24) / 0.1) * 1.5 * 1.5;  // 0.66 um
  CHECK(std::fabs(later.pose.p.x - settled.pose.p.x) < 1e-4 * mm + rounded);
  CHECK(std::fabs(later.pose.p.y - settled.pose.p.y) < 1e-4 * mm + rounded);
  CHECK(std::fabs(later.pose.p.z - settled.pose.p.z) < 1e-4 * mm);
  CHECK(std::fabs(later.velocity.linear.z) < 1e-6);
  CHECK(std::fabs(later.pose.p.z - 5 * mm) < 0.5 * mm);
  CHECK(h6::norm(felt.wrench.force) <= bound * (1 + 1e-9));
  // The damper of the sideways motion tilts the force a little.
  CHECK(felt.wrench.force.z == near(-bound).epsilon(0.02));
}

}  // namespace

TEST_CASE("a hand too weak to lift a part holds it still and says that it is saturated") {
  for (const h6Gradient gradient : {H6_SYMMETRIC, H6_EXACT})
    for (const h6Method method : {H6_METHOD_ROBUST, H6_METHOD_SERIES}) {
      for (const double bound : {0.5, 1e-3, 1e-9})
        check_too_weak(H6_COUPLING_DYNAMIC, gradient, method, bound);
      // Sideways only the hand holds a part without mass and friction. A hand weaker than the
      // rounding error of the contacts' 1 N cannot.
      for (const double bound : {0.5, 1e-3})
        check_too_weak(H6_COUPLING_STATIC, gradient, method, bound);
    }
}

TEST_CASE("under any samples the body stays finite and the last good pose counts") {
  const double nan = std::nan(""), huge = HUGE_VAL;
  const h6DeviceSample good = hand_at(pose(2 * mm, 0, 20 * mm));
  std::vector<h6DeviceSample> bad(9, good);
  bad[0].pose.p.x = nan;
  bad[1].pose.p.z = -huge;
  bad[2].pose.q.w = nan;
  bad[3].pose.q = {0, 0, 0, 0};
  bad[4].pose.q = {5, 0, 0, 0};
  bad[5].velocity.linear.y = nan;
  bad[6].velocity.angular.z = huge;
  bad[7].pose.q.x = huge;
  bad[8].velocity.linear.x = -huge;
  for (const h6DeviceSample& sample : bad) {
    Scene scene(floor_field(), bottom_face(10 * mm, 10 * mm, 5 * mm, 12, 12));
    scene.bodies[1].pose = pose(0, 0, 20 * mm);
    scene.def.hand_count = 1;
    scene.open();
    h6DeviceCommand felt;
    // Before the first good sample there is no hand.
    CHECK((h6Step(scene.session, &sample, &felt) & H6_HAND_NOT_FINITE) != 0);
    CHECK(felt.wrench.force.x == 0);
    CHECK(h6GetBody(scene.session, 1).pose.p.x == 0);
    CHECK((h6Step(scene.session, &good, &felt) & H6_HAND_NOT_FINITE) == 0);
    for (int i = 0; i < 2000; ++i) {
      CHECK((h6Step(scene.session, &sample, &felt) & H6_HAND_NOT_FINITE) != 0);
      REQUIRE(std::isfinite(felt.wrench.force.x));
      REQUIRE(std::isfinite(felt.wrench.torque.z));
    }
    CHECK((h6GetFrame(scene.session).status & H6_STATE_NOT_FINITE) == 0);
    CHECK(h6GetBody(scene.session, 1).pose.p.x == near(2 * mm).epsilon(1e-3));
  }
}

TEST_CASE("poses and velocities near the largest numbers leave the state finite") {
  for (const double far : {1e6, 1e150, 1e300}) {
    Scene scene(floor_field(), bottom_face(10 * mm, 10 * mm, 5 * mm, 12, 12));
    scene.bodies[1].pose = pose(0, 0, 20 * mm);
    scene.def.hand_count = 1;
    scene.open();
    CAPTURE(far);
    for (int i = 0; i < 50; ++i) {
      h6DeviceSample sample = hand_at(pose(far, -far, far));
      sample.velocity = {{far, 0, -far}, {-far, far, 0}};
      h6DeviceCommand felt;
      h6Step(scene.session, &sample, &felt);
      const h6Vec3 f = felt.wrench.force, t = felt.wrench.torque;
      CHECK(std::hypot(f.x, f.y, f.z) <= 5 * (1 + 1e-9));
      CHECK(std::isfinite(t.x + t.y + t.z));
      const h6BodyState state = h6GetBody(scene.session, 1);
      CHECK(std::isfinite(state.pose.p.x + state.pose.q.w + state.velocity.angular.x));
    }
  }
}
