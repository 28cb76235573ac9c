// SPDX-License-Identifier: Apache-2.0
/* own_loop.c - your simulation has a loop of its own: one h6Step in each of its steps, on its
 * thread. It says how long ago the last command was, so that the safety chain knows of its delays.
 */
#define _POSIX_C_SOURCE 200809L
#include <stdio.h>
#include <time.h>

#include "floor.h"

static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

int main(void) {
  h6Error error;
  h6Model* model = floor_and_tip(h6DefaultModelDef(), &error);
  h6SessionDef def = h6DefaultSessionDef();
  def.rate = 500;
  h6Session* session = model ? hold_tip(model, def, &error) : NULL;
  if (!session) return fprintf(stderr, "%s\n", error.message), 1;
  h6DeviceSample hand = h6DefaultDeviceSample();
  hand.pose.p.x = hand.pose.p.y = 4e-3;
  h6DeviceCommand felt;
  double last = 0, most = 0;
  for (int i = 0; i < 250; ++i) { /* half a second: down to 1 mm below the floor */
    const double start = now();
    hand.pose.p.z = 5e-3 - 2e-3 * (i < 125 ? i / 125.0 : 1);
    if (last > 0) h6NoteInterval(session, start - last);
    h6Step(session, &hand, &felt);
    last = now();
    if (felt.wrench.force.z > most) most = felt.wrench.force.z;
    const struct timespec rest = {0, 2000000 - (long)(1e9 * (now() - start)) % 2000000};
    nanosleep(&rest, NULL);
  }
  const h6FrameReport frame = h6GetFrame(session);
  printf("%llu frames, the hand felt up to %.2f N\n", (unsigned long long)frame.frame + 1, most);
  h6DestroySession(session), h6DestroyModel(model);
  return 0;
}
