// SPDX-License-Identifier: Apache-2.0
// The reported net stiffness of a frame's contacts.
#include "runtime/contact/net_stiffness.h"

#include <doctest/doctest.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <utility>

#include "tests/support/analytic.h"
#include "tests/support/near.h"

using namespace h6;
using namespace h6::test;

namespace {

constexpr double mm = 1e-3, kStiffness = 1e4;

// Points of a shell half a millimetre in a floor z < 0, at rest, in their first frame.
struct Touching {
  FieldArrays field = sample_analytic([](double, double, double z) { return z; },
                                      {-32 * mm, -32 * mm, -32 * mm}, mm, 8, 8, 8);
  ShellArrays shell;
  h6SessionDef def = h6DefaultSessionDef();

  explicit Touching(ShellArrays s) : shell(std::move(s)) {
    def.contact.stiffness = kStiffness;
    def.contact.fit = H6_FIT_TIGHT;
    def.net_stiffness = true;
  }
  h6FrameReport report(double height = 4.5 * mm) {
    Model model({def_of(field)}, {shell.def()});
    std::array<h6BodyDef, 2> bodies{h6DefaultBodyDef(), h6DefaultBodyDef()};
    bodies[0].fixed = true, bodies[0].field = 0;
    bodies[1].shell = 0;
    bodies[1].pose = pose(0, 0, height);
    def.bodies = bodies.data(), def.body_count = 2;
    h6Error error;
    h6Session* s = h6CreateSession(model.handle, &def, &error);
    REQUIRE_MESSAGE(s, error.message);
    h6Step(s, nullptr, nullptr);
    const h6FrameReport r = h6GetFrame(s);
    h6DestroySession(s);
    return r;
  }
};

ShellArrays one_point(double x) {
  ShellArrays s;
  s.add(x, 0, -5 * mm, 0, 0, 1);
  return s;
}

}  // namespace

TEST_CASE("a lone contact through the centre of mass has stiffness k in one direction only") {
  for (const h6Method method :
       {H6_METHOD_NONE, H6_METHOD_GAUSS3, H6_METHOD_ROBUST, H6_METHOD_SERIES})
    for (const double beta : {0.0, 1e-3}) {
      Touching scene(one_point(0));
      scene.def.contact.method = method;
      scene.def.contact.damping = beta;
      const h6FrameReport r = scene.report();
      CAPTURE(h6MethodName(method));
      CHECK(r.contacts == 1);
      CHECK(r.net_stiffness_max == near(kStiffness).epsilon(1e-5));
      CHECK(std::fabs(r.net_stiffness_min) < 1e-6 * kStiffness);
    }
}

TEST_CASE("a lever adds its part: k (1 + (r/L)^2)") {
  Touching scene(one_point(3 * mm));
  scene.def.contact.method = H6_METHOD_NONE;
  const double L2 = 9 + 25;  // the point is the body's farthest
  CHECK(scene.report().net_stiffness_max == near(kStiffness * (1 + 9 / L2)).epsilon(1e-5));
}

TEST_CASE("a wall of n contacts is n k stiff unscaled and k stiff under gauss3") {
  for (const int n : {4, 12, 20}) {
    Touching scene(bottom_face(10 * mm, 10 * mm, 5 * mm, n, n));
    scene.def.contact.method = H6_METHOD_NONE;
    const double none = scene.report().net_stiffness_max;
    scene.def.contact.method = H6_METHOD_GAUSS3;
    const h6FrameReport gauss3 = scene.report();
    CHECK(gauss3.contacts == static_cast<std::uint32_t>(n * n));
    CHECK(none == near(n * n * kStiffness).epsilon(1e-4));
    CHECK(gauss3.net_stiffness_max == near(kStiffness).epsilon(1e-4));
    CHECK(std::fabs(gauss3.net_stiffness_min) < 1e-6 * kStiffness);
  }
}

TEST_CASE("series never exceeds c k at any sampling; other rules grow with it") {
  double none = 0;
  for (const int n : {100, 1000, 4000}) {
    Touching scene(sphere_points(10 * mm, n));
    scene.def.contact.method = H6_METHOD_SERIES;
    const h6FrameReport r = scene.report(5 * mm);
    CHECK(r.contacts > static_cast<std::uint32_t>(n / 10));
    CHECK(r.net_stiffness_max <= 4 * kStiffness * (1 + 1e-9));
    CHECK(r.net_stiffness_max > kStiffness);
    CHECK(r.net_stiffness_min >= -1e-6 * kStiffness);
    scene.def.contact.method = H6_METHOD_NONE;
    const double now = scene.report(5 * mm).net_stiffness_max;
    CHECK(now > 2 * none);
    none = now;
  }
}

TEST_CASE("the exact form reports the same value; without the option there is none") {
  Touching scene(bottom_face(10 * mm, 10 * mm, 5 * mm, 6, 6));
  const h6FrameReport symmetric = scene.report();
  scene.def.gradient = H6_EXACT;
  CHECK(scene.report().net_stiffness_max == near(symmetric.net_stiffness_max).epsilon(1e-9));
  scene.def.net_stiffness = false;
  CHECK(scene.report().net_stiffness_max == 0);
  scene.def.net_stiffness = true;
  CHECK(scene.report(20 * mm).net_stiffness_max == 0);  // nothing touches
}

TEST_CASE("the cost of the report is printed") {
  Mat6 B = Mat6::Random();
  B = B * B.transpose();
  double sum = 0;
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < 20000; ++i) {
    B(0, 0) += 1e-6;
    sum += stiffness_range(B, 0.1).most;
  }
  const std::chrono::duration<double, std::micro> time = std::chrono::steady_clock::now() - start;
  CHECK(sum > 0);
  MESSAGE("two eigenvalues of a 6x6: ", time.count() / 20000, " us");
}
