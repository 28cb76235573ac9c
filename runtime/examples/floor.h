// SPDX-License-Identifier: Apache-2.0
// floor.h - what the examples share: a floor at z = 4 mm of 8 x 8 mm, and a part of one point.
#include <hapsix/hapsix.h>

static h6Model* floor_and_tip(h6ModelDef def, h6Error* error) {
  static float d[512], far_grid[8], zero = 0, up = 1;
  static int32_t brick = 0;
  static uint32_t row[2] = {0, 1};
  for (int i = 0; i < 512; ++i) d[i] = 1e-3f * (float)(i / 64 - 4);
  for (int i = 0; i < 8; ++i) far_grid[i] = d[i < 4 ? 0 : 511];
  h6FieldDef floor = h6DefaultFieldDef();
  floor.bricks[0] = floor.bricks[1] = floor.bricks[2] = 1, floor.voxel_size = floor.band = 1e-3;
  floor.brick_index = &brick, floor.samples = d, floor.brick_count = 1, floor.far_grid = far_grid;
  h6ShellDef tip = h6DefaultShellDef();
  tip.point_count = tip.level_count = 1, tip.level_first = tip.node_point = row;
  tip.x = tip.y = tip.z = tip.nx = tip.ny = tip.node_radius = &zero, tip.nz = &up;
  tip.node_first_child = tip.node_child_count = row;
  def.fields = &floor, def.field_count = 1, def.shells = &tip, def.shell_count = 1;
  return h6CreateModel(&def, error);
}

/* Body 0 is the floor; body 1 is the tip, 1 mm above it, in the only hand. */
static h6Session* hold_tip(const h6Model* model, h6SessionDef def, h6Error* error) {
  h6BodyDef body[2] = {h6DefaultBodyDef(), h6DefaultBodyDef()};
  body[0].fixed = true, body[0].field = 0;
  body[1].shell = 0, body[1].pose.p.x = body[1].pose.p.y = 4e-3, body[1].pose.p.z = 5e-3;
  h6HandDef hand = h6DefaultHandDef();
  hand.body = 1;
  def.bodies = body, def.body_count = 2, def.hands = &hand, def.hand_count = 1;
  return h6CreateSession(model, &def, error);
}
