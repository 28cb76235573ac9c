// SPDX-License-Identifier: Apache-2.0
// io_host.cpp - bakes, records and steps with hapsix's libraries, and prints in hexadecimal what
// comes of it. With HOST_EIGEN it also does so with an Eigen of its own.
#include <hapsix/io.h>

#include <cmath>
#include <cstdint>
#include <cstdio>

#include "host_eigen.h"

#define NEED(condition) \
  if (!(condition)) return std::printf("%s: %s\n", #condition, error.message), 1

static void print(const char* what, const float* values, std::size_t count) {
  std::uint64_t hash = 1469598103934665603u;  // FNV-1a over the bits
  const auto* bytes = reinterpret_cast<const unsigned char*>(values);
  for (std::size_t i = 0; i < count * sizeof(float); ++i) hash = (hash ^ bytes[i]) * 1099511628211u;
  std::printf("%s %zu %016llx\n", what, count, static_cast<unsigned long long>(hash));
}

int main(int argc, char** argv) {
  if (argc < 2 || !(std::fabs(host()) > 0)) return 1;
  h6Error error = {"", H6_NO_ERROR};
  // A body that bends: its modes are Eigen's work.
  h6Scene* scene = h6ReadScene("clip-and-rod", nullptr, &error);
  NEED(scene);
  h6SessionDef def;
  h6GetSceneSession(scene, &def);
  h6Session* session = h6CreateSession(h6GetSceneModel(scene), &def, &error);
  NEED(session);
  h6RecorderDef of_run = h6DefaultRecorderDef();
  of_run.scene = scene;
  h6Recorder* recorder = h6CreateRecorder(argv[1], &of_run, &error);
  NEED(recorder);
  std::uint32_t most = 0;
  for (int i = 0; i < 900; ++i) {
    h6DeviceSample in;
    h6DeviceCommand out;
    h6FrameRecord row;
    NEED(h6SampleScenePath(scene, 0, i / def.rate, &in));
    h6Step(session, &in, &out), h6GetRecord(session, &in, &out, &row);
    NEED(h6RecordFrames(recorder, &row, 1, &error));
    if (row.report.contacts > most) most = row.report.contacts;
    if (i % 100 == 99)
      std::printf("%016llx %a %a\n", static_cast<unsigned long long>(row.report.state_hash),
                  out.wrench.force.x, out.wrench.torque.y);
  }
  std::printf("up to %u contacts\n", most);
  NEED(h6FinishRecorder(recorder, nullptr, &error));
  h6Recording* recording = h6ReadRecording(argv[1], &error);
  NEED(recording);
  h6FrameRecord last;
  NEED(h6GetRecordingFrames(recording, 899, &last, 1, &error) == 1);
  std::printf("%016llx\n", static_cast<unsigned long long>(last.report.state_hash));

  // A mesh of the program's own.
  const std::uint32_t faces[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                   2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
  double corners[24];
  for (int i = 0; i < 24; ++i) corners[i] = (i / 3 >> i % 3 & 1 ? 0.01 : -0.01) * (1 + i % 3);
  h6MeshDef mesh_def = h6DefaultMeshDef();
  mesh_def.vertices = corners, mesh_def.vertex_count = 8;
  mesh_def.triangles = faces, mesh_def.triangle_count = 12;
  h6Mesh* mesh = h6CreateMesh(&mesh_def, &error);
  NEED(mesh);
  h6ShellBakeDef bake = h6DefaultShellBakeDef();
  bake.points = 500, bake.field.voxels = 48;
  h6Field* field = h6BakeField(mesh, &bake.field, &error);
  h6Shell* shell = h6BakeShell(mesh, &bake, &error);
  NEED(field && shell);
  h6FieldDef f;
  h6ShellDef s;
  h6GetField(field, &f), h6GetShell(shell, &s);
  print("samples", f.samples, 512 * f.brick_count), print("points", s.x, s.point_count);
  h6CheckDef check = h6DefaultCheckDef();
  check.points = 500;
  h6CheckReport report{};
  NEED(h6CheckField(mesh, field, &check, &report, &error));
  std::printf("%d %a %a\n", report.agrees, report.worst_between, report.holding_force);
  h6DestroyShell(shell), h6DestroyField(field), h6DestroyMesh(mesh);
  h6DestroyRecording(recording), h6DestroyRecorder(recorder);
  h6DestroySession(session), h6DestroyScene(scene);
  return 0;
}
