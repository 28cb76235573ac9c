// SPDX-License-Identifier: Apache-2.0
// settings_test.cpp - the rows cover a scene's structs, and runtime/SETTINGS.md is up to date.
#include "io/scene/scene_settings.h"

#include "tests/io/scene/scene_samples.h"
#include "tests/runtime/settings/cover.h"

using namespace h6;
using namespace h6::io;
using test::every_member_has_a_row;

TEST_CASE("every member of a scene's structs has its row") {
  // The numbers count members that no row points at: generated, file, unit_is_stated, bodies, hands,
  // verdict.
  every_member_has_a_row<Scene>(scene_settings(), 6);
  every_member_has_a_row<SceneBody>(scene_body_settings(), 2);  // field, shell
  every_member_has_a_row<SceneHand>(scene_hand_settings(), 2);  // path and its file
  every_member_has_a_row<SceneArm>(arm_settings(), 0);
  every_member_has_a_row<SceneVerdict>(target_settings(), 1);  // forbidden
  // mesh, file, unit, and the data of a generated scene: mesh_data or points, and keep.
  every_member_has_a_row<FieldSource>(field_source_settings(), 5);
  every_member_has_a_row<ShellSource>(shell_source_settings(), 7);  // and bends
  for (const Setting& row : field_source_settings())
    if (row.stands_among())
      every_member_has_a_row<FieldBake>(*row.inside, 4);  // threads, shift, grow_thin, free_memory
  for (const Setting& row : shell_source_settings())
    if (row.stands_among()) every_member_has_a_row<ShellBake>(*row.inside, 1);  // threads
}

TEST_CASE("defaults of rows are those of the structs") {
  const SceneArm arm;
  CHECK(is_default(arm_settings(), &arm));
  const FieldSource field;
  CHECK(is_default(field_source_settings(), &field));
  const ShellSource shell;
  CHECK(is_default(shell_source_settings(), &shell));
  const h6HandDef hand = default_scene_hand();
  CHECK(hand.driver_stiffness == 2000);
  CHECK(hand.driver_damping == 5);
  const Scene scene;
  CHECK(scene.rate == h6DefaultSessionDef().rate);
  CHECK(SceneBody{}.mass == h6DefaultBodyDef().mass);
}

TEST_CASE("runtime/SETTINGS.md is what 'hapsix info --settings' prints") {
  const bool same = text_of(fs::path(HAPSIX_SOURCE_DIR) / "runtime/SETTINGS.md") == settings_page();
  CHECK_MESSAGE(same, "write it anew: build/release/hapsix info --settings > runtime/SETTINGS.md");
}
