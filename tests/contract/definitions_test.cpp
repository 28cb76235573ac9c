// SPDX-License-Identifier: Apache-2.0
// Definitions of both libraries: what their default functions give.
#include <doctest/doctest.h>

#include "hapsix/hapsix.hpp"
#include "hapsix/io.h"

namespace {

// A mesh, its field and its shell, as small as they can be.
struct Tetrahedron {
  const double at[12] = {0, 0, 0, 0.01, 0, 0, 0, 0.01, 0, 0, 0, 0.01};
  const std::uint32_t faces[12] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2};
  hapsix::Mesh mesh;
  hapsix::Field field;
  hapsix::Shell shell;
  Tetrahedron() {
    h6MeshDef def = h6DefaultMeshDef();
    def.vertices = at, def.vertex_count = 4, def.triangles = faces, def.triangle_count = 4;
    h6ShellBakeDef small = shell_bake();
    mesh = hapsix::Mesh::make([&](h6Error* e) { return h6CreateMesh(&def, e); });
    field = hapsix::Field::make([&](h6Error* e) { return h6BakeField(mesh, &small.field, e); });
    shell = hapsix::Shell::make([&](h6Error* e) { return h6BakeShell(mesh, &small, e); });
  }
  static h6ShellBakeDef shell_bake() {
    h6ShellBakeDef def = h6DefaultShellBakeDef();
    def.points = 10, def.levels = 2, def.field.voxels = 16;
    return def;
  }
};

}  // namespace

TEST_CASE(
    "the default of a hand's filter is that of a hand, and passes "
    "everything unchanged") {
  const h6HandFilterDef filter = h6DefaultHandFilterDef(), of_hand = h6DefaultHandDef().filter;
  CHECK((filter.motion_scale == 1 && filter.rotation_scale == 1 && filter.force_scale == 1));
  CHECK((filter.clutch_buttons == 0 && !filter.relative));
  for (const std::uint64_t word : filter.reserved) CHECK(word == 0);
  CHECK((of_hand.motion_scale == 1 && of_hand.rotation_scale == 1 && of_hand.force_scale == 1));
  CHECK((of_hand.clutch_buttons == 0 && !of_hand.relative));
  // Unlike zeros, it makes a session.
  const Tetrahedron made;
  h6ShellDef shell;
  h6GetShell(made.shell, &shell);
  const hapsix::Model model = hapsix::create_model({}, {&shell, 1});
  h6BodyDef body = h6DefaultBodyDef();
  h6HandDef hand = h6DefaultHandDef();
  body.shell = 0;
  hand.filter = filter;
  CHECK(hapsix::create_session(model, {&body, 1}, {&hand, 1}).get() != nullptr);
  hand.filter = {};
  CHECK_THROWS_AS(hapsix::create_session(model, {&body, 1}, {&hand, 1}), hapsix::Error);
}
