// SPDX-License-Identifier: Apache-2.0
/* run_scene.c - what `hapsix run` does: a scene, generated or from a file, with its hands on their
 * paths. */
#include <hapsix/io.h>
#include <stdio.h>

int main(int argc, char** argv) {
  h6Error error;
  h6Scene* scene = h6ReadScene(argc > 1 ? argv[1] : "peg-in-hole", NULL, &error);
  if (!scene) return fprintf(stderr, "%s\n", error.message), 1;
  h6SessionDef def;
  h6GetSceneSession(scene, &def);
  h6Session* session = h6CreateSession(h6GetSceneModel(scene), &def, &error);
  if (!session) return fprintf(stderr, "%s\n", error.message), 1;
  double deepest = 0, force = 0;
  const int frames = (int)(h6GetSceneDuration(scene) * def.rate);
  for (int i = 0; i < frames; ++i) {
    h6DeviceSample in[H6_MAX_HANDS];
    h6DeviceCommand out[H6_MAX_HANDS];
    for (size_t h = 0; h < def.hand_count; ++h)
      h6SampleScenePath(scene, (int32_t)h, i / def.rate, &in[h]);
    h6Step(session, in, out);
    const double depth = h6GetFrame(session).max_depth_voxels, f = out[0].wrench.force.z;
    if (depth > deepest) deepest = depth;
    if (f > force) force = f;
  }
  printf("%d frames, at most %.2f voxels deep, up to %.1f N\n", frames, deepest, force);
  return h6DestroySession(session), h6DestroyScene(scene), 0;
}
