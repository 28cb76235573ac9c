// SPDX-License-Identifier: Apache-2.0
// The headers promise this to two threads: callers of one loop take turns, and objects of io.h work
// at once where they differ, or where they are only read.
#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "hapsix/hapsix.hpp"
#include "hapsix/io.h"
#include "runtime/examples/floor.h"
#include "tests/io/private_cache.h"
#include "tests/support/sanitized.h"

namespace {

std::string place(const std::string& name) {
  return (h6::test::private_cache.folder / name).string();
}

// Runs work(0) and work(1) at once.
template <class Work>
void on_two(Work&& work) {
  std::thread second([&] { work(1); });
  work(0);
  second.join();
}

// A loop in the time of frames, and sessions that it may run.
struct Looped {
  hapsix::Model model =
      hapsix::Model::make([](h6Error* e) { return floor_and_tip(h6DefaultModelDef(), e); });
  hapsix::Session session[3];
  hapsix::Loop loop;
  Looped(double duration, std::size_t ring_frames) {
    for (hapsix::Session& s : session)
      s = hapsix::Session::make(
          [&](h6Error* e) { return hold_tip(model, h6DefaultSessionDef(), e); });
    h6Device device = h6DefaultDevice();
    device.capabilities.frame_time = true;
    device.read = [](void*, double, h6DeviceSample* out) {
      *out = h6DefaultDeviceSample();
      return 0;
    };
    device.write = [](void*, double, const h6DeviceCommand*) { return 0; };
    h6LoopDef def = h6DefaultLoopDef();
    def.realtime = false, def.virtual_time = true;
    def.duration = duration, def.ring_frames = ring_frames;
    loop = hapsix::start_loop(session[0], {&device, 1}, def);
  }
};

// All that is made of a box of this size, as bytes.
struct Made {
  std::vector<float> samples, points;
  h6MeshInfo mesh{};
  h6CheckReport check{};
  std::uint64_t frames = 0;
  double last = 0;
  bool operator==(const Made& other) const {
    return samples == other.samples && points == other.points && frames == other.frames &&
           mesh.volume == other.mesh.volume && check.agrees == other.check.agrees &&
           check.worst_node == other.check.worst_node && last == other.last;
  }
};

hapsix::Mesh box(double half) {
  std::vector<double> corners;
  for (int i = 0; i < 8; ++i)
    for (int k = 0; k < 3; ++k) corners.push_back(i >> k & 1 ? half : -half);
  const std::uint32_t faces[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                   2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
  h6MeshDef def = h6DefaultMeshDef();
  def.vertices = corners.data(), def.vertex_count = 8;
  def.triangles = faces, def.triangle_count = 12;
  return hapsix::Mesh::make([&](h6Error* e) { return h6CreateMesh(&def, e); });
}

h6ShellBakeDef small_bake() {
  h6ShellBakeDef def = h6DefaultShellBakeDef();
  def.points = 50, def.levels = 2, def.field.voxels = 24;
  return def;
}

void take_arrays(const hapsix::Field& field, const hapsix::Shell& shell, Made& made) {
  h6FieldDef f;
  h6ShellDef s;
  h6GetField(field, &f), h6GetShell(shell, &s);
  made.samples.assign(f.samples, f.samples + 512 * f.brick_count);
  made.points.assign(s.x, s.x + s.point_count);
}

// Makes, writes, reads and checks; `name` is of the files. With the same `cache` or without it the
// result is the same.
Made make_all(double half, const std::string& name, bool cache) {
  Made made;
  h6ShellBakeDef def = small_bake();
  def.field.cache = cache;
  const hapsix::Mesh mesh = box(half);
  h6GetMesh(mesh, &made.mesh);
  hapsix::Field field =
      hapsix::Field::make([&](h6Error* e) { return h6BakeField(mesh, &def.field, e); });
  hapsix::Shell shell = hapsix::Shell::make([&](h6Error* e) { return h6BakeShell(mesh, &def, e); });
  const std::string vdb = place(name + ".vdb"), ply = place(name + ".ply"),
                    h5 = place(name + ".h5");
  if (!h6WriteField(field, vdb.c_str(), nullptr) || !h6WriteShell(shell, ply.c_str(), nullptr))
    return {};
  field = hapsix::Field::make([&](h6Error* e) { return h6ReadField(vdb.c_str(), e); });
  shell = hapsix::Shell::make([&](h6Error* e) { return h6ReadShell(ply.c_str(), e); });
  take_arrays(field, shell, made);
  h6CheckDef check = h6DefaultCheckDef();
  check.points = 200, check.push = false;
  if (!h6CheckField(mesh, field, &check, &made.check, nullptr)) return {};

  const hapsix::Scene scene =
      hapsix::Scene::make([](h6Error* e) { return h6ReadScene("box-on-wall", nullptr, e); });
  h6RecorderDef of_run = h6DefaultRecorderDef();
  of_run.scene = scene;
  const hapsix::Recorder recorder =
      hapsix::Recorder::make([&](h6Error* e) { return h6CreateRecorder(h5.c_str(), &of_run, e); });
  std::vector<h6FrameRecord> rows(40);
  for (std::size_t i = 0; i < rows.size(); ++i)
    rows[i].time = half * static_cast<double>(i), rows[i].report.frame = i;
  for (const h6FrameRecord& row : rows)
    if (!h6RecordFrames(recorder, &row, 1, nullptr)) return {};
  if (!h6FinishRecorder(recorder, nullptr, nullptr)) return {};
  const hapsix::Recording recording =
      hapsix::Recording::make([&](h6Error* e) { return h6ReadRecording(h5.c_str(), e); });
  h6RecordingInfo info;
  h6GetRecording(recording, &info);
  made.frames = info.frames;
  if (h6GetRecordingFrames(recording, 39, rows.data(), 1, nullptr) == 1) made.last = rows[0].time;
  return made;
}

}  // namespace

TEST_CASE("two threads change a loop's session and a third steps all: each session has one owner") {
  constexpr int callers = 2;
  Looped all(0, 0);
  const h6DeviceSample in = h6DefaultDeviceSample();
  std::atomic<int> at_work{callers};
  std::atomic<long> stepped{0}, refused{0};
  // It steps whatever is free at the moment, and also what the loop runs.
  std::thread third([&] {
    h6DeviceCommand out;
    for (std::size_t i = 0; at_work > 0; ++i) {
      const bool ran = (h6Step(all.session[i % 3], &in, &out) & H6_OUTPUT_FAULT) == 0;
      ++(ran ? stepped : refused);
    }
  });
  h6Session* mine[callers] = {all.session[1], all.session[2]};
  int changed[callers] = {0, 0}, odd[callers] = {0, 0};
  on_two([&](int caller) {
    while (changed[caller] < h6::test::repeated(2000, 40) && odd[caller] == 0) {
      h6Error error{};
      h6Session* const before = h6ChangeSession(all.loop, mine[caller], &error);
      if (!before) {
        odd[caller] += error.code != H6_ERROR_BUSY;  // the third thread steps it: once more
        continue;
      }
      odd[caller] += before == mine[caller];
      mine[caller] = before, ++changed[caller];
      h6DeviceCommand out;
      h6Step(before, &in, &out);
    }
    --at_work;
  });
  third.join();
  CHECK((odd[0] == 0 && odd[1] == 0));
  CHECK((stepped > 0 && refused > 0));
  // The loop runs one of the three, and the callers own the others.
  h6DeviceCommand out;
  CHECK(mine[0] != mine[1]);
  for (const hapsix::Session& s : all.session) {
    const bool own = s == mine[0] || s == mine[1];
    CHECK(((h6Step(s, &in, &out) & H6_OUTPUT_FAULT) == 0) == own);
  }
}

TEST_CASE("a session is not changed by the haptic thread, nor when the loop has ended") {
  struct Asker {
    std::atomic<h6Loop*> loop{nullptr};
    h6Session* next = nullptr;
    std::atomic<int> code{0};
  } asker;
  Looped all(0, 0);  // of the other sessions
  asker.next = all.session[1];
  h6Device device = h6DefaultDevice();
  device.capabilities.frame_time = true;
  device.self = &asker;
  device.read = [](void* self, double, h6DeviceSample* sample) {
    Asker& a = *static_cast<Asker*>(self);
    *sample = h6DefaultDeviceSample();
    if (h6Loop* const loop = a.loop; loop && a.code == 0) {
      h6Error error{};
      if (!h6ChangeSession(loop, a.next, &error)) a.code = static_cast<int>(error.code);
    }
    return 0;
  };
  device.write = [](void*, double, const h6DeviceCommand*) { return 0; };
  h6LoopDef def = h6DefaultLoopDef();
  def.realtime = false, def.virtual_time = true;
  def.ring_frames = 0;  // it would wait for a reader
  const hapsix::Loop loop = hapsix::start_loop(all.session[2], {&device, 1}, def);
  asker.loop = loop.get();
  while (asker.code == 0) std::this_thread::yield();
  CHECK(asker.code == H6_ERROR_BUSY);
  h6RequestStop(loop), h6JoinLoop(loop, nullptr);
  all.session[2] = {};  // the loop that has ended looks at it no more
  h6Error error{};
  CHECK(h6ChangeSession(loop, all.session[1], &error) == nullptr);
  CHECK(std::string(error.message) == "the loop has ended");
}

TEST_CASE("of two readers of records that take turns each frame goes to one, and none is lost") {
  constexpr std::size_t frames = 3000;
  Looped all(1e-3 * frames, 16);
  std::mutex turn;
  std::vector<std::uint64_t> read[2];
  std::size_t taken = 0;
  on_two([&](int reader) {
    h6FrameRecord rows[7];
    for (bool more = true; more; std::this_thread::yield()) {
      const std::lock_guard<std::mutex> lock(turn);
      const bool ran = h6LoopRunning(all.loop);
      const std::size_t n = reader ? h6ReadRecordsWithBends(all.loop, rows, nullptr, 7)
                                   : h6ReadRecords(all.loop, rows, 3);
      for (std::size_t i = 0; i < n; ++i) read[reader].push_back(rows[i].report.frame);
      taken += n;
      more = n > 0 || ran;
    }
  });
  CHECK(taken == frames);
  std::set<std::uint64_t> all_frames;
  for (const auto& mine : read) {
    CHECK(std::is_sorted(mine.begin(), mine.end()));
    all_frames.insert(mine.begin(), mine.end());
  }
  CHECK(all_frames.size() == frames);
  h6LoopReport report;
  h6JoinLoop(all.loop, &report);
  CHECK((report.frames == frames && report.ring_overruns == 0));
}

TEST_CASE("objects of io.h that differ work on two threads at once as they do alone") {
  const Made alone[2] = {make_all(0.01, "alone0", false), make_all(0.013, "alone1", false)};
  REQUIRE((alone[0].frames == 40 && alone[1].frames == 40 && alone[0].check.agrees));
  REQUIRE_FALSE(alone[0] == alone[1]);
  for (int round = 0; round < 4; ++round) {
    Made at_once[2];
    on_two([&](int i) {
      at_once[i] = make_all(i ? 0.013 : 0.01, "beside" + std::to_string(i), round >= 2);
    });
    CHECK((at_once[0] == alone[0] && at_once[1] == alone[1]));
  }
}

TEST_CASE("two threads that want the same from an empty cache at once both get it") {
  const Made alone = make_all(0.0077, "same", false);
  Made at_once[2];
  on_two([&](int i) { at_once[i] = make_all(0.0077, "same" + std::to_string(i), true); });
  CHECK((at_once[0] == alone && at_once[1] == alone));
}

TEST_CASE("two threads read one mesh, field, shell and scene at once") {
  const hapsix::Mesh mesh = box(0.01);
  const h6ShellBakeDef def = small_bake();
  const hapsix::Field field =
      hapsix::Field::make([&](h6Error* e) { return h6BakeField(mesh, &def.field, e); });
  const hapsix::Shell shell =
      hapsix::Shell::make([&](h6Error* e) { return h6BakeShell(mesh, &def, e); });
  const hapsix::Scene scene =
      hapsix::Scene::make([](h6Error* e) { return h6ReadScene("box-on-wall", nullptr, e); });
  const auto look = [&](const std::string& name) {
    Made made;
    h6GetMesh(mesh, &made.mesh);
    take_arrays(field, shell, made);
    h6CheckDef check = h6DefaultCheckDef();
    check.points = 200, check.push = false;
    (void)h6CheckField(mesh, field, &check, &made.check, nullptr);
    const std::string vdb = place(name + ".vdb");
    if (h6WriteField(field, vdb.c_str(), nullptr)) ++made.frames;
    h6SessionDef session;
    h6GetSceneSession(scene, &session);
    const hapsix::Session stepped(h6CreateSession(h6GetSceneModel(scene), &session, nullptr));
    for (int i = 0; i < 200; ++i) {
      h6DeviceSample in;
      h6DeviceCommand out;
      if (h6SampleScenePath(scene, 0, i / session.rate, &in)) ++made.frames;
      h6Step(stepped, &in, &out);
      made.last += out.wrench.force.z;
    }
    return made;
  };
  const Made alone = look("one");
  REQUIRE((alone.frames == 201 && alone.check.agrees && alone.last != 0));
  Made at_once[2];
  on_two([&](int i) { at_once[i] = look("both" + std::to_string(i)); });
  CHECK((at_once[0] == alone && at_once[1] == alone));
}
