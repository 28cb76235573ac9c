// SPDX-License-Identifier: Apache-2.0
// dropped_contacts_test.cpp - more points touch than max_contacts: no place and no direction is
// lost. METHOD.md, Sec. 6.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "tests/support/box_on_floor.h"

using namespace h6::test;

namespace {

// A part in a corner of floor and wall: 4,900 points on its bottom, 100 on its side. The hand
// presses it hard onto the floor and lightly against the wall, so all the points of the floor are
// deeper than those of the wall.
struct Corner : BoxOnFloor {
  static constexpr std::size_t kBottom = 70, kSide = 10;
  std::optional<Model> corner;
  Corner(h6Method method, std::size_t most) {
    field = sample_analytic([](double x, double, double z) { return std::min(x + 40 * mm, z); },
                            {-64 * mm, -64 * mm, -32 * mm}, mm, 16, 16, 8);
    shell = bottom_face(10 * mm, 10 * mm, 5 * mm, kBottom, kBottom);
    for (std::size_t i = 0; i < kSide; ++i)
      for (std::size_t k = 0; k < kSide; ++k)
        shell.add(-10 * mm, (2.0 * double(i) - 9) * mm, (0.8 * double(k) - 3) * mm, 1, 0, 0);
    corner.emplace(std::vector{def_of(field)}, std::vector{shell.def()});
    std::swap(model.handle, corner->handle);
    bodies[1].com = {};
    bodies[1].pose = pose(-29.8 * mm, 0, 5.2 * mm);
    bodies[1].translation_only = true;
    def.contact.method = method;
    def.max_contacts = most;
    open();
  }
  // Presses until the part rests. Under firm the points in the corner lean and rub a little.
  h6Vec3 rest() {
    hold(pose(-31 * mm, 0, -20 * mm), 1500);
    return body().pose.p;
  }
};

}  // namespace

TEST_CASE("contacts dropped: a wall that few shallow points touch holds beside a floor") {
  for (const h6Method method : {H6_METHOD_FIRM, H6_METHOD_SERIES, H6_METHOD_ROBUST}) {
    CAPTURE(h6MethodName(method));
    Corner all(method, 10000), few(method, 600);
    const h6Vec3 want = all.rest(), got = few.rest();
    const double depth = (-30 * mm - want.x) / mm, floor_depth = (5 * mm - want.z) / mm;
    REQUIRE(h6GetFrame(all.session).contacts == 5000);
    REQUIRE(depth > 0.0005);
    REQUIRE(depth < 0.5 * floor_depth);  // every point of the wall is shallower
    CHECK((h6GetFrame(few.session).status & H6_CONTACTS_DROPPED) != 0);
    const h6Contacts kept = h6GetContacts(few.session, 1);
    CHECK(kept.count == 600);
    std::size_t wall = 0;
    for (std::size_t i = 0; i < kept.count; ++i) wall += kept.nx[i] > 0.9f;
    CHECK(wall >= 4);
    CHECK(std::fabs(got.x - want.x) < 0.03 * mm);
    CHECK(std::fabs(got.z - want.z) < 0.03 * mm);
  }
}

TEST_CASE("contacts dropped: every part of a face that is too large keeps some of its contacts") {
  Corner few(H6_METHOD_FIRM, 300);
  few.rest();
  // Tilted by half a degree, one edge is deeper than all the rest.
  h6BodyState state = few.body();
  state.pose.q = about(0, 1, 0, 0.01);
  state.pose.p.z = 4.7 * mm;
  h6SetBody(few.session, 1, &state);
  const h6DeviceSample sample = hand_at(state.pose);
  h6Step(few.session, &sample, nullptr);
  const h6Contacts kept = h6GetContacts(few.session, 1);
  REQUIRE(kept.count == 300);
  int places[3][3] = {};
  for (std::size_t i = 0; i < kept.count; ++i) {
    const std::uint32_t p = kept.point[i];
    if (p >= Corner::kBottom * Corner::kBottom) continue;
    const auto at = [](float v) { return std::clamp(int((v + 0.01f) * 150), 0, 2); };
    ++places[at(few.shell.x[p])][at(few.shell.y[p])];
  }
  for (const auto& row : places)
    for (const int count : row) CHECK(count > 0);
}
