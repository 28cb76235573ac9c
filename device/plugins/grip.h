// SPDX-License-Identifier: Apache-2.0
/* grip.h - what a plug-in makes of its handle: a sample of the mesh frame of the body in hand.
 *
 * The body begins at home, and moves as the grip has moved since the device was opened. The grip is
 * the body's centre of mass, so turning the handle turns the body about it. */
#ifndef HAPSIX_GRIP_H
#define HAPSIX_GRIP_H

#include <math.h>

#include "hapsix/device_plugin.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Of the grip since the device was opened, world frame [m], [m/s], [rad/s]; turned: (w, x, y, z). */
typedef struct Grip {
  double moved[3], turned[4], linear[3], angular[3];
} Grip;

static inline void h6_rotate(const double q[4], const double v[3], double out[3]) {
  const double t[3] = {2 * (q[2] * v[2] - q[3] * v[1]), 2 * (q[3] * v[0] - q[1] * v[2]),
                       2 * (q[1] * v[1] - q[2] * v[0])};
  out[0] = v[0] + q[0] * t[0] + q[2] * t[2] - q[3] * t[1];
  out[1] = v[1] + q[0] * t[1] + q[3] * t[0] - q[1] * t[2];
  out[2] = v[2] + q[0] * t[2] + q[1] * t[1] - q[2] * t[0];
}

static inline void h6_multiply(const double a[4], const double b[4], double q[4]) {
  q[0] = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3];
  q[1] = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2];
  q[2] = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1];
  q[3] = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0];
}

/* The turn from `first` to `now`, both as the device has them. */
static inline void h6_turned(const double now[4], const double first[4], double out[4]) {
  const double back[4] = {first[0], -first[1], -first[2], -first[3]};
  h6_multiply(now, back, out);
}

/* A rotation matrix, rows first, as a unit quaternion with w >= 0 (Shepperd's method). */
static inline void h6_quaternion(const double m[3][3], double q[4]) {
  const double square[4] = {1 + m[0][0] + m[1][1] + m[2][2], 1 + m[0][0] - m[1][1] - m[2][2],
                            1 - m[0][0] + m[1][1] - m[2][2], 1 - m[0][0] - m[1][1] + m[2][2]};
  const double off[4][4] = {{0, m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]},
                            {m[2][1] - m[1][2], 0, m[1][0] + m[0][1], m[0][2] + m[2][0]},
                            {m[0][2] - m[2][0], m[1][0] + m[0][1], 0, m[2][1] + m[1][2]},
                            {m[1][0] - m[0][1], m[0][2] + m[2][0], m[2][1] + m[1][2], 0}};
  int large = 0;
  for (int i = 1; i < 4; ++i)
    if (square[i] > square[large]) large = i;
  double length = 0;
  for (int i = 0; i < 4; ++i) {
    q[i] = i == large ? square[i] : off[large][i];
    length += q[i] * q[i];
  }
  length = q[0] < 0 ? -sqrt(length) : sqrt(length);
  for (int i = 0; i < 4; ++i) q[i] /= length;
}

static inline void h6_sample_of_grip(const h6PluginStart* start, const Grip* grip,
                                     h6PluginSample* out) {
  double at_home[3], lever[3];
  h6_multiply(grip->turned, start->home_orientation, out->orientation);
  h6_rotate(start->home_orientation, start->grip, at_home);
  h6_rotate(out->orientation, start->grip, lever);
  const double *w = grip->angular, *l = lever;
  const double swing[3] = {w[1] * l[2] - w[2] * l[1], w[2] * l[0] - w[0] * l[2],
                           w[0] * l[1] - w[1] * l[0]};
  for (int i = 0; i < 3; ++i) {
    out->position[i] = start->home_position[i] + at_home[i] + grip->moved[i] - lever[i];
    out->linear[i] = grip->linear[i] - swing[i];
    out->angular[i] = grip->angular[i];
  }
}

#ifdef __cplusplus
}
#endif
#endif
