// SPDX-License-Identifier: Apache-2.0
// Closed plates thinner than a voxel, baked to a tolerance, against a moving part.
#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "hapsix/hapsix.h"
#include "hapsix/vector.h"
#include "io/bake/bake_field.h"
#include "io/shell/bake_shell.h"
#include "tests/io/bake/field_check.h"

using namespace field_check;

namespace {

// Where a cube of 4 mm ends that a hand leads at `speed` [m/s] from `side` (1 or -1) through the
// plate to 3 mm behind it.
double end_of_push(const h6Model* model, double side, double speed) {
  h6BodyDef bodies[2] = {h6DefaultBodyDef(), h6DefaultBodyDef()};
  bodies[0].fixed = true, bodies[0].field = 0;
  bodies[1].shell = 0, bodies[1].mass = 0.05;
  bodies[1].pose.p = {0.0, 0.0, side * 4e-3};
  h6HandDef hand = h6DefaultHandDef();
  hand.body = 1;
  h6SessionDef def = h6DefaultSessionDef();
  def.bodies = bodies, def.body_count = 2, def.hands = &hand, def.hand_count = 1;
  h6Error error{};
  h6Session* session = h6CreateSession(model, &def, &error);
  REQUIRE_MESSAGE(session, error.message);
  const int way = int(8e-3 / speed * 1000), rest = 400;
  h6DeviceSample sample{};
  sample.pose.q.w = 1;
  h6DeviceCommand command{};
  for (int i = 0; i < way + rest; ++i) {
    sample.pose.p = {0, 0, side * (4e-3 - std::min(8e-3, 1e-3 * speed * i))};
    sample.velocity.linear.z = i < way ? -side * speed : 0;
    h6Step(session, &sample, &command);
  }
  const double end = side * h6GetBody(session, 1).pose.p.z;
  h6DestroySession(session);
  return end;
}

}  // namespace

TEST_CASE("closed plates thinner than a coarse voxel hold from both sides, slow and fast") {
  const h6::io::Mesh cube = box({-2e-3, -2e-3, -2e-3}, {2e-3, 2e-3, 2e-3});
  h6::io::ShellBake shell_bake;
  shell_bake.points = 600;
  const auto shell = h6::io::bake_shell(cube, shell_bake, nullptr);
  REQUIRE(shell);
  const h6ShellDef shell_def = shell->def();
  for (const double thickness : {1e-3, 0.4e-3, 0.2e-3, 0.1e-3}) {
    CAPTURE(thickness);
    h6::io::FieldBake bake;
    bake.tolerance = std::min(0.05e-3, thickness / 4);  // coarse voxels of 0.2 to 0.4 mm
    const auto field =
        bake_field(box({-8e-3, -7e-3, -thickness / 2}, {8e-3, 7e-3, thickness / 2}), bake, nullptr);
    REQUIRE_MESSAGE(field, field.error());
    const h6FieldDef field_def = field->def();
    h6ModelDef model_def = h6DefaultModelDef();
    model_def.fields = &field_def, model_def.field_count = 1;
    model_def.shells = &shell_def, model_def.shell_count = 1;
    h6Model* model = h6CreateModel(&model_def, nullptr);
    REQUIRE(model);
    for (const double side : {1.0, -1.0})
      for (const double speed : {0.1, 0.5, 2.0}) {
        CAPTURE(side);
        CAPTURE(speed);
        // The cube's face lies 2 mm before its middle, and half a fine voxel is let in.
        CHECK(end_of_push(model, side, speed) > 2e-3 + thickness / 2 - 1.1 * bake.tolerance);
      }
    h6DestroyModel(model);
  }
}

TEST_CASE("closed plates of 0.05 to 1 mm hold from both sides at voxels of 0.4 mm") {
  const h6::io::Mesh cube = box({-2e-3, -2e-3, -2e-3}, {2e-3, 2e-3, 2e-3});
  h6::io::ShellBake shell_bake;
  shell_bake.points = 600;
  const auto shell = h6::io::bake_shell(cube, shell_bake, nullptr);
  REQUIRE(shell);
  const h6ShellDef shell_def = shell->def();
  for (const double thickness : {1e-3, 0.6e-3, 0.4e-3, 0.2e-3, 0.1e-3, 0.05e-3})
    for (const double shift : {0.0, 0.25, 0.5}) {
      CAPTURE(thickness);
      CAPTURE(shift);
      h6::io::FieldBake bake;
      bake.voxel_size = 0.4e-3;
      bake.shift = {0, 0, shift};
      const auto field = bake_field(
          box({-8e-3, -7e-3, -thickness / 2}, {8e-3, 7e-3, thickness / 2}), bake, nullptr);
      REQUIRE_MESSAGE(field, field.error());
      const h6FieldDef field_def = field->def();
      h6ModelDef model_def = h6DefaultModelDef();
      model_def.fields = &field_def, model_def.field_count = 1;
      model_def.shells = &shell_def, model_def.shell_count = 1;
      h6Model* model = h6CreateModel(&model_def, nullptr);
      REQUIRE(model);
      for (const double side : {1.0, -1.0})
        for (const double speed : {0.1, 0.5, 2.0}) {
          CAPTURE(side);
          CAPTURE(speed);
          CHECK(end_of_push(model, side, speed) > 2e-3);
        }
      h6DestroyModel(model);
    }
}

TEST_CASE("a shell touches finer samples at every point that lies inside, and at no other") {
  const h6::io::Mesh cube = box({-2e-3, -2e-3, -2e-3}, {2e-3, 2e-3, 2e-3});
  h6::io::ShellBake shell_bake;
  shell_bake.points = 3000;
  const auto shell = h6::io::bake_shell(cube, shell_bake, nullptr);
  REQUIRE(shell);
  const h6ShellDef shell_def = shell->def();
  h6::io::FieldBake bake;
  bake.tolerance = 5e-5;
  const auto field = bake_field(turned(l_shape(4e-3), 0.2, 1.1), bake, nullptr);
  REQUIRE(field);
  REQUIRE(field->quarter_count() > 100);
  const h6FieldDef field_def = field->def();
  h6ModelDef model_def = h6DefaultModelDef();
  model_def.fields = &field_def, model_def.field_count = 1;
  model_def.shells = &shell_def, model_def.shell_count = 1;
  h6Model* model = h6CreateModel(&model_def, nullptr);
  REQUIRE(model);
  h6BodyDef bodies[2] = {h6DefaultBodyDef(), h6DefaultBodyDef()};
  bodies[0].fixed = true, bodies[0].field = 0;
  bodies[1].shell = 0;
  h6SessionDef def = h6DefaultSessionDef();
  def.bodies = bodies, def.body_count = 2;
  def.contact.method = H6_METHOD_GLOBAL;
  def.contact.fit = H6_FIT_TIGHT;
  def.max_substeps = 1;
  h6Session* session = h6CreateSession(model, &def, nullptr);
  REQUIRE(session);
  Random random(9);
  std::size_t touching = 0;
  std::vector<double> p(3 * shell->size()), d(shell->size());
  for (int pose = 0; pose < 400; ++pose) {
    h6BodyState state = h6GetBody(session, 1);
    const double w = random(-1, 1), x = random(-1, 1), y = random(-1, 1), z = random(-1, 1);
    const double n = std::sqrt(w * w + x * x + y * y + z * z);
    state.pose.q = {w / n, x / n, y / n, z / n};
    state.pose.p = {random(-3e-3, 9e-3), random(-3e-3, 9e-3), random(-3e-3, 9e-3)};
    state.velocity = {};
    h6SetBody(session, 1, &state);
    h6Step(session, nullptr, nullptr);
    for (std::size_t i = 0; i < shell->size(); ++i) {
      const Vec3 at = h6::place(state.pose, {shell_def.x[i], shell_def.y[i], shell_def.z[i]});
      p[3 * i] = at.x, p[3 * i + 1] = at.y, p[3 * i + 2] = at.z;
    }
    h6SampleField(model, 0, p.data(), shell->size(), d.data(), nullptr, nullptr);
    std::size_t sure = 0, most = 0;  // floats of either way differ by rounding
    for (const double v : d) sure += v < -2e-7, most += v < 2e-7;
    const std::size_t found = h6GetFrame(session).contacts;
    CHECK(found >= sure);
    CHECK(found <= most);
    touching += found;
  }
  CHECK(touching > 20000);
  h6DestroySession(session);
  h6DestroyModel(model);
}
