// SPDX-License-Identifier: Apache-2.0
// Contacts get the names that their field has for the brick they are in.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <random>
#include <vector>

#include "runtime/frame/session.h"
#include "tests/support/analytic.h"

using namespace h6::test;

namespace {

constexpr double mm = 1e-3;  // a voxel

// A field whose bricks are named after their cells, its rows in another order than its cells.
struct Named {
  FieldArrays field;
  std::vector<std::int32_t> part, triangle;

  explicit Named(const Distance& distance) {
    field = sample_analytic(distance, {-56 * mm, -56 * mm, -56 * mm}, mm, 14, 14, 14);
    const std::size_t rows = field.samples.size() / 512;
    std::vector<std::size_t> to(rows);
    std::iota(to.begin(), to.end(), std::size_t{0});
    std::shuffle(to.begin(), to.end(), std::mt19937_64(5));
    std::vector<float> samples(field.samples.size());
    for (std::size_t r = 0; r < rows; ++r)
      std::copy_n(&field.samples[512 * r], 512, &samples[512 * to[r]]);
    field.samples.swap(samples);
    part.resize(rows), triangle.resize(rows);
    for (std::size_t cell = 0; cell < field.index.size(); ++cell) {
      if (field.index[cell] < 0) continue;
      const std::size_t row = to[std::size_t(field.index[cell])];
      field.index[cell] = std::int32_t(row);
      part[row] = std::int32_t(cell % 14);
      triangle[row] = std::int32_t(cell);
    }
  }
  h6FieldDef def(bool with_part = true, bool with_triangle = true) {
    h6FieldDef d = def_of(field);
    d.part = with_part ? part.data() : nullptr;
    d.triangle = with_triangle ? triangle.data() : nullptr;
    return d;
  }
};

double floor_distance(double, double, double z) { return z + 15 * mm; }
double wall_distance(double x, double, double) { return x + 17 * mm; }

// A ball that stands in a floor and in a wall that is turned and moved.
struct Scene {
  Named ground{floor_distance}, wall{wall_distance};
  ShellArrays shell = sphere_points(20 * mm, 3001);
  std::vector<h6BodyDef> bodies = std::vector<h6BodyDef>(3, h6DefaultBodyDef());
  h6Model* model = nullptr;
  h6Session* session = nullptr;

  explicit Scene(h6Method method, bool with_part = true, bool with_triangle = true) {
    const h6FieldDef fields[2] = {ground.def(with_part, with_triangle), wall.def()};
    const h6ShellDef shells[1] = {shell.def()};
    h6ModelDef parts = h6DefaultModelDef();
    parts.fields = fields, parts.field_count = 2, parts.shells = shells, parts.shell_count = 1;
    model = h6CreateModel(&parts, nullptr);
    REQUIRE(model);
    bodies[0].fixed = true, bodies[0].field = 0;
    bodies[1].fixed = true, bodies[1].field = 1;
    const h6::Quat turn = h6::exp_rotation(h6::Vec3(0.1, -0.2, 0.3));
    bodies[1].pose = {{2 * mm, -mm, 3 * mm}, h6::to(turn)};
    bodies[2].shell = 0;
    bodies[2].com = {3 * mm, -2 * mm, mm};
    h6SessionDef def = h6DefaultSessionDef();
    def.bodies = bodies.data(), def.body_count = 3;
    def.contact.method = method;
    def.contact.fit = H6_FIT_TIGHT;
    session = h6CreateSession(model, &def, nullptr);
    REQUIRE(session);
  }
  ~Scene() { h6DestroySession(session), h6DestroyModel(model); }
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  // The cell of a contact's brick, from its arm at the pose the frame began with; -1 where rounding
  // may decide.
  std::int32_t cell(const h6BodyState& began, const h6Contacts& c, std::size_t i) const {
    const h6BodyDef& body = bodies[2];
    const h6::Vec3 p = h6::from(began.pose.p) + h6::from(began.pose.q) * h6::from(body.com) +
                       h6::Vec3(c.rx[i], c.ry[i], c.rz[i]);
    const h6Pose& field = bodies[std::size_t(c.field_body[i])].pose;
    const h6::Vec3 at =
        (h6::from(field.q).conjugate() * (p - h6::from(field.p)) / mm).array() + 56.0;
    std::int32_t n[3];
    for (int k = 0; k < 3; ++k) {
      n[k] = std::int32_t(at[k] / 8);
      if (std::fabs(at[k] / 8 - std::round(at[k] / 8)) < 1e-4) return -1;
    }
    return (n[2] * 14 + n[1]) * 14 + n[0];
  }
};

}  // namespace

TEST_CASE("contacts are named after the bricks they are in, in any of several fields") {
  for (const h6Method method : {H6_METHOD_ROBUST, H6_METHOD_SERIES, H6_METHOD_CLUSTER}) {
    CAPTURE(method);
    Scene scene(method);
    std::mt19937_64 random(2);
    std::uniform_real_distribution<double> some(-1, 1);
    std::size_t seen[2] = {}, wrong = 0;
    for (int frame = 0; frame < 50; ++frame) {
      h6BodyState began{};
      began.pose.p = {some(random) * 2 * mm, some(random) * 20 * mm, some(random) * 2 * mm};
      began.pose.q = h6::to(h6::exp_rotation(h6::Vec3(some(random), some(random), some(random))));
      h6SetBody(scene.session, 2, &began);
      h6Step(scene.session, nullptr, nullptr);
      const h6Contacts c = h6GetContacts(scene.session, 2);
      std::vector<std::int32_t> part(c.count + 1, -7), triangle(c.count + 1, -7);
      h6NameContacts(scene.session, 2, part.data(), triangle.data());
      CHECK(part[c.count] == -7);
      CHECK(triangle[c.count] == -7);
      for (std::size_t i = 0; i < c.count; ++i) {
        const std::int32_t cell = scene.cell(began, c, i);
        if (cell < 0) continue;
        const Named& field = c.field_body[i] == 0 ? scene.ground : scene.wall;
        const bool named = field.field.index[std::size_t(cell)] >= 0;
        if (named) ++seen[c.field_body[i]];
        wrong += triangle[i] != (named ? cell : -1) || part[i] != (named ? cell % 14 : -1);
      }
    }
    CHECK(seen[0] > 50);
    CHECK(seen[1] > 50);
    CHECK(wrong == 0);
  }
}

TEST_CASE("a field without names gives -1, and either array may be left out") {
  Scene scene(H6_METHOD_ROBUST, true, false);
  h6Step(scene.session, nullptr, nullptr);
  const h6Contacts c = h6GetContacts(scene.session, 2);
  REQUIRE(c.count > 20);
  std::vector<std::int32_t> part(c.count, -7), triangle(c.count, -7);
  h6NameContacts(scene.session, 2, nullptr, triangle.data());
  h6NameContacts(scene.session, 2, part.data(), nullptr);
  std::size_t with_ground = 0;
  for (std::size_t i = 0; i < c.count; ++i) {
    CHECK((triangle[i] == -1) == (c.field_body[i] == 0));
    CHECK(part[i] >= 0);
    with_ground += c.field_body[i] == 0;
  }
  CHECK(with_ground > 10);
}

TEST_CASE("a contact deeper than all bricks has no name") {
  Scene scene(H6_METHOD_ROBUST);
  h6BodyState deep{};
  deep.pose.p = {20 * mm, 0, -32 * mm};  // its lowest points are 37 voxels below the floor
  deep.pose.q = {1, 0, 0, 0};
  h6SetBody(scene.session, 2, &deep);
  h6Step(scene.session, nullptr, nullptr);
  const h6Contacts c = h6GetContacts(scene.session, 2);
  std::vector<std::int32_t> triangle(c.count);
  h6NameContacts(scene.session, 2, nullptr, triangle.data());
  std::size_t named = 0, nameless = 0;
  for (std::size_t i = 0; i < c.count; ++i) {
    if (c.field_body[i] != 0) continue;
    (triangle[i] < 0 ? nameless : named)++;
    if (c.depth[i] > 12 * mm) CHECK(triangle[i] == -1);
  }
  CHECK(named > 0);
  CHECK(nameless > 0);
}
