// SPDX-License-Identifier: Apache-2.0
/* many_sessions.c - 64 pegs are pressed to the wall of 64 holes in one call a frame, each a little
 * farther than the one before. */
#include <hapsix/batch.h>
#include <hapsix/io.h>
#include <stdio.h>

enum { COUNT = 64 };

int main(void) {
  h6Error error;
  h6Scene* scene = h6ReadScene("peg-in-hole", NULL, &error);
  if (!scene) return fprintf(stderr, "%s\n", error.message), 1;
  h6Workers* workers = h6CreateWorkers(NULL, &error); /* one for each core */
  if (!workers) return fprintf(stderr, "%s\n", error.message), 1;
  h6SessionDef def;
  h6GetSceneSession(scene, &def);
  def.max_contacts = 500; /* most of a session's memory */
  def.workers = workers;  /* whose scratch the sessions share */
  static h6Session* sessions[COUNT];
  static h6Pose hand[COUNT];
  static h6Wrench felt[COUNT];
  for (int i = 0; i < COUNT; ++i) {
    sessions[i] = h6CreateSession(h6GetSceneModel(scene), &def, &error);
    if (!sessions[i]) return fprintf(stderr, "%s\n", error.message), 1;
    hand[i] = def.bodies[1].pose;
  }
  h6StepArrays arrays = h6DefaultStepArrays();
  arrays.sessions = sessions, arrays.count = COUNT;
  arrays.pose = hand, arrays.command = felt;
  for (int frame = 0; frame < 200; ++frame) { /* up to 4 mm sideways */
    for (int i = 0; i < COUNT; ++i) hand[i].p.x += 2e-5 * i / (COUNT - 1);
    h6StepMany(workers, &arrays);
  }
  printf("forces from %.2f to %.2f N\n", felt[0].force.x, felt[COUNT - 1].force.x);
  for (int i = 0; i < COUNT; ++i) h6DestroySession(sessions[i]);
  h6DestroyWorkers(workers);
  return h6DestroyScene(scene), 0;
}
