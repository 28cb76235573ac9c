// SPDX-License-Identifier: Apache-2.0
#include <hapsix/hapsix.h>
#include <stdio.h>

int main(void) { /* a floor at z = 4 mm in one brick of 1 mm cells; a part of one point */
  float d[512], far_grid[8], zero = 0, up = 1;
  int32_t brick = 0;
  uint32_t row[2] = {0, 1};
  for (int i = 0; i < 512; ++i) d[i] = 1e-3f * (float)(i / 64 - 4);
  for (int i = 0; i < 8; ++i) far_grid[i] = d[i < 4 ? 0 : 511];
  h6FieldDef floor = h6DefaultFieldDef();
  floor.bricks[0] = floor.bricks[1] = floor.bricks[2] = 1, floor.voxel_size = floor.band = 1e-3;
  floor.brick_index = &brick, floor.samples = d, floor.brick_count = 1, floor.far_grid = far_grid;
  h6ShellDef tip = h6DefaultShellDef();
  tip.point_count = tip.level_count = 1, tip.level_first = tip.node_point = row;
  tip.x = tip.y = tip.z = tip.nx = tip.ny = tip.node_radius = &zero, tip.nz = &up;
  tip.node_first_child = tip.node_child_count = row;
  h6ModelDef parts = h6DefaultModelDef();
  parts.fields = &floor, parts.field_count = 1, parts.shells = &tip, parts.shell_count = 1;
  h6Model* model = h6CreateModel(&parts, NULL);
  h6BodyDef body[2] = {h6DefaultBodyDef(), h6DefaultBodyDef()};
  body[0].fixed = true, body[0].field = 0, body[1].shell = 0, body[1].pose.p.z = 5e-3;
  h6HandDef hand = h6DefaultHandDef();
  hand.body = 1;
  h6SessionDef def = h6DefaultSessionDef();
  def.bodies = body, def.body_count = 2, def.hands = &hand, def.hand_count = 1;
  h6Session* session = h6CreateSession(model, &def, NULL);
  h6DeviceSample in = h6DefaultDeviceSample(); /* held 1 mm below the floor */
  in.pose.p.x = in.pose.p.y = 4e-3, in.pose.p.z = 3e-3;
  h6DeviceCommand out;
  for (int i = 0; i < 1000; ++i) h6Step(session, &in, &out); /* a second */
  printf("the hand feels %.3f N, the tip stands at %.3f mm\n", out.wrench.force.z,
         1e3 * h6GetBody(session, 1).pose.p.z);
  h6DestroySession(session), h6DestroyModel(model);
  return 0;
}
