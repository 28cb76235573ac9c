// SPDX-License-Identifier: Apache-2.0
/* mesh_to_touch.c - from two meshes to a force: bake a block into a field and a plate into a shell,
 * push the plate onto the block, record it, and read the recording. */
#include <hapsix/io.h>
#include <stdio.h>

static const uint32_t faces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6},
                                      {0, 1, 4}, {1, 5, 4}, {2, 6, 3}, {3, 6, 7},
                                      {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};

static h6Mesh* box(double a, double b, double c, h6Error* error) {
  double v[8][3];
  for (int i = 0; i < 8; ++i)
    v[i][0] = i & 1 ? a : -a, v[i][1] = i & 2 ? b : -b, v[i][2] = i & 4 ? c : -c;
  h6MeshDef def = h6DefaultMeshDef();
  def.vertices = v[0], def.vertex_count = 8, def.triangles = faces[0], def.triangle_count = 12;
  return h6CreateMesh(&def, error);
}

int main(void) {
  h6Error error = {"", H6_NO_ERROR};
  h6FieldBakeDef coarse = h6DefaultFieldBakeDef();
  h6ShellBakeDef few = h6DefaultShellBakeDef();
  coarse.voxels = 64, few.points = 1000;
  h6Mesh *block = box(0.02, 0.02, 0.01, &error), *plate = box(0.01, 0.01, 0.002, &error);
  h6Field* field = h6BakeField(block, &coarse, &error);
  h6Shell* shell = h6BakeShell(plate, &few, &error);
  if (!field || !shell) return fprintf(stderr, "%s\n", error.message), 1;
  h6FieldDef f;
  h6ShellDef s;
  h6GetField(field, &f), h6GetShell(shell, &s);
  h6ModelDef parts = h6DefaultModelDef();
  parts.fields = &f, parts.field_count = 1, parts.shells = &s, parts.shell_count = 1;
  h6Model* model = h6CreateModel(&parts, &error);
  h6BodyDef body[2] = {h6DefaultBodyDef(), h6DefaultBodyDef()};
  body[0].fixed = true, body[0].field = 0, body[1].shell = 0, body[1].pose.p.z = 0.0125;
  h6HandDef hand = h6DefaultHandDef();
  h6SessionDef def = h6DefaultSessionDef();
  hand.body = 1, def.hands = &hand, def.hand_count = 1, def.bodies = body, def.body_count = 2;
  h6Session* session = h6CreateSession(model, &def, &error);
  h6RecorderDef what = h6DefaultRecorderDef();
  what.session = &def;
  h6Recorder* recorder = h6CreateRecorder("mesh_to_touch.h5", &what, &error);
  h6DeviceSample in = h6DefaultDeviceSample();
  in.pose.p.z = 0.0115; /* 0.5 mm into the block */
  h6DeviceCommand out;
  h6FrameRecord row;
  for (int i = 0; i < 500; ++i) {
    h6Step(session, &in, &out), h6GetRecord(session, &in, &out, &row);
    h6RecordFrames(recorder, &row, 1, &error);
  }
  if (!h6FinishRecorder(recorder, NULL, &error)) return fprintf(stderr, "%s\n", error.message), 1;
  h6Recording* recording = h6ReadRecording("mesh_to_touch.h5", &error);
  h6GetRecordingFrames(recording, 499, &row, 1, &error);
  const h6Wrench felt = row.command[0].wrench;
  printf("%u contacts, the hand feels %.2f N\n", row.report.contacts, felt.force.z);
  h6DestroyRecording(recording), h6DestroyRecorder(recorder);
  h6DestroySession(session), h6DestroyModel(model), h6DestroyShell(shell), h6DestroyField(field);
  return h6DestroyMesh(plate), h6DestroyMesh(block), 0;
}
