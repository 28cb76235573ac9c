// SPDX-License-Identifier: Apache-2.0
// How each rule shares stiffness, seen in whole frames. METHOD.md, Sec. 3.
#include <doctest/doctest.h>
#include "tests/support/near.h"

#include <array>
#include <cmath>
#include <cstdint>

#include "hapsix/hapsix.h"
#include "tests/support/analytic.h"

using namespace h6::test;

namespace {

constexpr double mm = 1e-3;

// One frame of a shell at a pose against a field, with its contacts and weights.
struct Frame {
  h6Session* session = nullptr;
  h6Contacts contacts{};
  double net = 0;  // sum of weights: the stiffness of a flat wall in k

  Frame(Model& model, const h6Pose& where, const h6ContactDef& contact) {
    std::array<h6BodyDef, 2> bodies{h6DefaultBodyDef(), h6DefaultBodyDef()};
    bodies[0].fixed = true, bodies[0].field = 0;
    bodies[1].shell = 0;
    bodies[1].pose = where;
    h6SessionDef def = h6DefaultSessionDef();
    def.bodies = bodies.data(), def.body_count = 2;
    def.contact = contact;
    def.contact.fit = H6_FIT_TIGHT;
    h6Error error{};
    session = h6CreateSession(model.handle, &def, &error);
    REQUIRE_MESSAGE(session, error.message);
    h6Step(session, nullptr, nullptr);
    contacts = h6GetContacts(session, 1);
    for (std::size_t i = 0; i < contacts.count; ++i) net += contacts.weight[i];
  }
  ~Frame() { h6DestroySession(session); }
};

h6ContactDef method(h6Method m, std::uint32_t pieces = 0) {
  h6ContactDef c = h6DefaultContactDef();
  c.method = m;
  c.pieces = pieces;
  return c;
}

FieldArrays floor_field() {
  return sample_analytic([](double, double, double z) { return z; }, {-32 * mm, -32 * mm, -16 * mm},
                         mm, 8, 8, 4);
}
const h6Method gauss_methods[] = {H6_METHOD_GAUSS3, H6_METHOD_GAUSS6, H6_METHOD_ROBUST};

}  // namespace

TEST_CASE("a lone contact keeps the whole stiffness, but under `firm`") {
  FieldArrays field = floor_field();
  ShellArrays one;
  one.add(3 * mm, 2 * mm, -5 * mm, 0, 0, 1);
  one.add(3 * mm, 2 * mm, 5 * mm, 0, 0, -1);  // above the floor
  Model model({def_of(field)}, {one.def()});
  for (int m = 0; m < H6_METHOD_COUNT; ++m) {
    if (m == H6_METHOD_FIRM) continue;  // stiffer than k: firm_test.cpp
    Frame frame(model, pose(0, 0, 4.7 * mm), method(static_cast<h6Method>(m)));
    REQUIRE(frame.contacts.count == 1);
    CHECK(frame.contacts.weight[0] == h6::test::near(1).epsilon(1e-5));
    CHECK(frame.contacts.depth[0] == h6::test::near(0.3 * mm).epsilon(1e-3));
  }
}

TEST_CASE("coincident contacts together keep the stiffness of one") {
  FieldArrays field = floor_field();
  ShellArrays many;
  for (int i = 0; i < 50; ++i) many.add(3 * mm, 2 * mm, -5 * mm, 0, 0, 1);
  Model model({def_of(field)}, {many.def()});
  for (const h6Method m : gauss_methods) {
    Frame frame(model, pose(0, 0, 4.7 * mm), method(m));
    REQUIRE(frame.contacts.count == 50);
    CHECK(frame.net == h6::test::near(1).epsilon(1e-4));
  }
}

TEST_CASE("a flat wall of 144 spread points gives k, at most 2k, at most 5k") {
  FieldArrays field = floor_field();
  ShellArrays face = bottom_face(10 * mm, 10 * mm, 5 * mm, 12, 12);
  Model model({def_of(field)}, {face.def()});
  const double most[] = {1 + 1e-4, 2, 5};
  for (int i = 0; i < 3; ++i) {
    Frame frame(model, pose(0, 0, 4.7 * mm), method(gauss_methods[i]));
    REQUIRE(frame.contacts.count == 144);
    CHECK(frame.net <= most[i]);
    CHECK(frame.net >= 1 - 1e-4);
  }
  CHECK(Frame(model, pose(0, 0, 4.7 * mm), method(H6_METHOD_GAUSS3)).net ==
        h6::test::near(1).epsilon(1e-4));
  CHECK(Frame(model, pose(0, 0, 4.7 * mm), method(H6_METHOD_GLOBAL)).net == h6::test::near(10));
  CHECK(Frame(model, pose(0, 0, 4.7 * mm), method(H6_METHOD_NONE)).net == h6::test::near(144));
}

TEST_CASE(
    "two clusters with equal normals and opposite torques carry equal stiffness under robust") {
  FieldArrays field = floor_field();
  ShellArrays clusters;
  for (int i = 0; i < 1000; ++i) clusters.add(15 * mm, 0, -5 * mm, 0, 0, 1);
  for (int i = 0; i < 14; ++i) clusters.add(-15 * mm, 0, -5 * mm, 0, 0, 1);
  Model model({def_of(field)}, {clusters.def()});
  Frame frame(model, pose(0, 0, 4.8 * mm), method(H6_METHOD_ROBUST));
  REQUIRE(frame.contacts.count == 1014);
  double large = 0, small = 0;
  for (std::size_t i = 0; i < frame.contacts.count; ++i)
    (frame.contacts.rx[i] > 0 ? large : small) += frame.contacts.weight[i];
  CHECK(large == h6::test::near(small).epsilon(0.05));
}

TEST_CASE("a contact whose normal opposes the field never pulls under the facing filter") {
  // A floor; the point's inward normal points down, as on the top of a thin part that sank through.
  FieldArrays field = floor_field();
  ShellArrays wrong;
  wrong.add(0, 0, -5 * mm, 0, 0, -1);
  Model model({def_of(field)}, {wrong.def()});
  CHECK(Frame(model, pose(0, 0, 4.7 * mm), method(H6_METHOD_ROBUST)).net == 0);
  CHECK(Frame(model, pose(0, 0, 4.7 * mm), method(H6_METHOD_GAUSS6, H6_PIECE_FACING)).net == 0);
  CHECK(Frame(model, pose(0, 0, 4.7 * mm), method(H6_METHOD_GAUSS6)).net == h6::test::near(1));
}

TEST_CASE("robust forces enter from zero: a contact that just touches weighs nothing") {
  FieldArrays field = floor_field();
  ShellArrays two;
  two.add(0, 0, -5 * mm, 0, 0, 1);
  two.add(0.2 * mm, 0, -4.701 * mm, 0, 0, 1);  // a micrometre deep when the first is 0.3 mm
  Model model({def_of(field)}, {two.def()});
  Frame frame(model, pose(0, 0, 4.7 * mm), method(H6_METHOD_ROBUST));
  REQUIRE(frame.contacts.count == 2);
  const std::size_t shallow = frame.contacts.depth[0] < frame.contacts.depth[1] ? 0 : 1;
  CHECK(frame.contacts.weight[shallow] < 0.01);
  CHECK(frame.contacts.weight[1 - shallow] > 0.99);
}

TEST_CASE("weights do not depend on the order of the points, nor on how the scene is turned") {
  FieldArrays field = sample_analytic(
      [](double x, double y, double z) { return 20.2 * mm - std::sqrt(x * x + y * y + z * z); },
      {-32 * mm, -32 * mm, -32 * mm}, mm, 8, 8, 8);
  ShellArrays ball = sphere_points(20 * mm, 3000), reversed;
  for (std::size_t i = ball.x.size(); i-- > 0;)
    reversed.add(ball.x[i], ball.y[i], ball.z[i], ball.nx[i], ball.ny[i], ball.nz[i]);
  Model straight({def_of(field)}, {ball.def()}), backwards({def_of(field)}, {reversed.def()});
  for (const h6Method m : gauss_methods) {
    h6ContactDef c = method(m);
    c.epsilon = 0.3;
    Frame a(straight, pose(0.9 * mm, 0, 0), c), b(backwards, pose(0.9 * mm, 0, 0), c);
    REQUIRE(a.contacts.count == b.contacts.count);
    REQUIRE(a.contacts.count > 100);
    CHECK(a.net == h6::test::near(b.net).epsilon(1e-5));
    // The shell turned under the (round) field, displaced the same way in its new frame.
    Frame turned(straight, {{0, 0.9 * mm, 0}, {std::sqrt(0.5), 0, 0, std::sqrt(0.5)}}, c);
    CHECK(turned.net == h6::test::near(a.net).epsilon(0.02));
  }
}
