// SPDX-License-Identifier: Apache-2.0
/* analytic_field.c - a field from a function: a bowl of radius 20 mm, baked by hand into bricks,
 * and a ring of points that slides down into it under its weight. */
#include <hapsix/hapsix.h>
#include <math.h>
#include <stdio.h>
enum { B = 7 };                                      /* bricks along each axis */
static const double voxel = 1e-3, low = -28e-3; /* of node (0,0,0) [m] */
/* Signed distance at a node: the obstacle is everything outside of the ball. */
static double at(int i, int j, int k) {
  const double x = low + voxel * i, y = low + voxel * j, z = low + voxel * k;
  return 20e-3 - sqrt(x * x + y * y + z * z);
}

int main(void) {
  static int32_t index[B * B * B];
  static float far_grid[(B + 1) * (B + 1) * (B + 1)];
  static float samples[512 * B * B * B];
  for (int b = 0; b < B * B * B; ++b) { /* every brick is kept: small fields may be dense */
    index[b] = b;
    for (int n = 0; n < 512; ++n)
      samples[512 * b + n] =
          (float)at(8 * (b % B) + n % 8, 8 * (b / B % B) + n / 8 % 8, 8 * (b / B / B) + n / 64);
  }
  for (int c = 0, i = 0; c <= B; ++c)
    for (int b = 0; b <= B; ++b)
      for (int a = 0; a <= B; ++a) far_grid[i++] = nextafterf((float)at(8 * a, 8 * b, 8 * c), 0);
  h6FieldDef bowl = h6DefaultFieldDef();
  bowl.origin.x = bowl.origin.y = bowl.origin.z = low, bowl.voxel_size = voxel,
  bowl.band = 8 * voxel;
  bowl.bricks[0] = bowl.bricks[1] = bowl.bricks[2] = B, bowl.brick_count = B * B * B;
  bowl.brick_index = index, bowl.samples = samples, bowl.far_grid = far_grid;
  enum { N = 32 }; /* a ring of 5 mm: one level, normals into it */
  float x[N], y[N], z[N], nx[N], ny[N], nz[N], radius[N];
  uint32_t first[2] = {0, N}, point[N], none[N];
  for (uint32_t i = 0; i < N; ++i) {
    const double t = 6.283185307179586 * i / N;
    nx[i] = -(float)cos(t), ny[i] = -(float)sin(t), nz[i] = z[i] = radius[i] = 0;
    x[i] = -5e-3f * nx[i], y[i] = -5e-3f * ny[i], point[i] = i, none[i] = 0;
  }
  h6ShellDef ring = h6DefaultShellDef();
  ring.point_count = N, ring.x = x, ring.y = y, ring.z = z, ring.nx = nx, ring.ny = ny, ring.nz = nz;
  ring.level_count = 1, ring.level_first = first, ring.node_point = point;
  ring.node_radius = radius, ring.node_first_child = ring.node_child_count = none;
  h6ModelDef parts = h6DefaultModelDef();
  parts.fields = &bowl, parts.field_count = 1, parts.shells = &ring, parts.shell_count = 1;
  h6Error error;
  h6Model* model = h6CreateModel(&parts, &error);
  h6BodyDef body[2] = {h6DefaultBodyDef(), h6DefaultBodyDef()};
  body[0].fixed = true, body[0].field = 0, body[1].shell = 0, body[1].pose.p.x = 8e-3;
  h6SessionDef def = h6DefaultSessionDef();
  def.bodies = body, def.body_count = 2, def.gravity.z = -9.81;
  h6Session* session = model ? h6CreateSession(model, &def, &error) : NULL;
  if (!session) return fprintf(stderr, "%s\n", error.message), 1;
  for (int i = 0; i < 5000; ++i) h6Step(session, NULL, NULL);
  const h6Vec3 p = h6GetBody(session, 1).pose.p; /* sqrt(20^2 - 5^2) = 19.36 mm off */
  const double off = sqrt(p.x * p.x + p.y * p.y + p.z * p.z);
  printf("the ring is %.2f mm from the middle of the bowl\n", 1e3 * off);
  return h6DestroySession(session), h6DestroyModel(model), 0;
}
