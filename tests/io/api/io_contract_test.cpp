// SPDX-License-Identifier: Apache-2.0
// hapsix/io.h from outside: what the program does with files, and wrong arguments of every
// function.
#include <doctest/doctest.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include "hapsix/io.h"
#include "tests/io/private_cache.h"

namespace {

namespace fs = std::filesystem;

constexpr double kCorners[8][3] = {{-1, -1, -1}, {1, -1, -1}, {-1, 1, -1}, {1, 1, -1},
                                   {-1, -1, 1},  {1, -1, 1},  {-1, 1, 1},  {1, 1, 1}};
constexpr std::uint32_t kFaces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6},
                                         {0, 1, 4}, {1, 5, 4}, {2, 6, 3}, {3, 6, 7},
                                         {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};

struct Box {
  std::vector<double> vertices;
  h6MeshDef def = h6DefaultMeshDef();
  explicit Box(double half) {
    for (const auto& c : kCorners)
      for (const double x : c) vertices.push_back(half * x);
    def.vertices = vertices.data(), def.vertex_count = 8;
    def.triangles = kFaces[0], def.triangle_count = 12;
  }
};

// A mesh, and all that is made of it in these tests.
struct Made {
  h6Mesh* mesh = nullptr;
  h6Field* field = nullptr;
  h6Shell* shell = nullptr;
  ~Made() { h6DestroyMesh(mesh), h6DestroyField(field), h6DestroyShell(shell); }
};

h6FieldBakeDef coarse() {
  h6FieldBakeDef def = h6DefaultFieldBakeDef();
  def.voxels = 32;
  return def;
}

fs::path scratch(const char* name) { return h6::test::private_cache.folder / name; }

struct Log {
  std::vector<std::string> lines;
  Log() {
    h6SetLogHandler(
        [](void* user, h6LogLevel, const char* sentence) {
          static_cast<Log*>(user)->lines.push_back(sentence);
        },
        this);
  }
  ~Log() { h6SetLogHandler(nullptr, nullptr); }
};

// A box that is baked.
struct BakedBox : Made {
  BakedBox() {
    const Box box(0.01);
    h6ShellBakeDef few = h6DefaultShellBakeDef();
    few.points = 50, few.field = coarse();
    mesh = h6CreateMesh(&box.def, nullptr);
    field = h6BakeField(mesh, &few.field, nullptr);
    shell = h6BakeShell(mesh, &few, nullptr);
    REQUIRE((mesh && field && shell));
  }
};

// A scene, and a recording of a few of its frames.
struct Run {
  h6Scene* scene = h6ReadScene("box-on-wall", nullptr, nullptr);
  h6SessionDef def{};
  h6FrameRecord row{};
  h6Recording* recording = nullptr;
  h6RecordingInfo info{};
  Run() {
    REQUIRE(scene);
    h6GetSceneSession(scene, &def);
    h6Session* session = h6CreateSession(h6GetSceneModel(scene), &def, nullptr);
    REQUIRE(session);
    h6RecorderDef what = h6DefaultRecorderDef();
    what.scene = scene;
    h6Recorder* recorder = h6CreateRecorder(scratch("few.h5").c_str(), &what, nullptr);
    REQUIRE(recorder);
    for (int i = 0; i < 5; ++i) {
      h6DeviceSample in = h6DefaultDeviceSample();
      h6DeviceCommand out;
      h6Step(session, &in, &out);
      h6GetRecord(session, &in, &out, &row);
      REQUIRE(h6RecordFrames(recorder, &row, 1, nullptr));
    }
    REQUIRE(h6FinishRecorder(recorder, nullptr, nullptr));
    h6DestroyRecorder(recorder), h6DestroySession(session);
    recording = h6ReadRecording(scratch("few.h5").c_str(), nullptr);
    REQUIRE(recording);
    h6GetRecording(recording, &info);
  }
  ~Run() { h6DestroyRecording(recording), h6DestroyScene(scene); }
};

bool failed(const void* object) { return object == nullptr; }
bool failed(bool done) { return !done; }
bool failed(std::int64_t count) { return count == -1; }
// The code of a call that must fail, with a sentence, also without an error to fill; else 0.
template <class Call>
h6ErrorCode failure(Call&& call) {
  h6Error error{};
  if (!failed(call(&error)) || !failed(call(nullptr)) || !error.message[0]) return H6_NO_ERROR;
  return error.code;
}
const auto wrong = [](auto&& call) { return failure(call) == H6_ERROR_ARGUMENT; };
const auto out_of_range = [](auto&& call) { return failure(call) == H6_ERROR_RANGE; };
const auto no_file = [](auto&& call) { return failure(call) == H6_ERROR_FILE; };

constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

TEST_CASE("a mesh from memory is baked, written, read and checked") {
  Made made;
  h6Error error{};
  const Box box(0.01);
  made.mesh = h6CreateMesh(&box.def, &error);
  REQUIRE_MESSAGE(made.mesh, error.message);
  h6MeshInfo info;
  h6GetMesh(made.mesh, &info);
  CHECK((info.triangles == 12 && info.vertices == 8 && info.closed && info.parts == 1));
  CHECK(info.volume == doctest::Approx(8e-6));
  const h6FieldBakeDef def = coarse();
  made.field = h6BakeField(made.mesh, &def, &error);
  REQUIRE_MESSAGE(made.field, error.message);
  h6ShellBakeDef points = h6DefaultShellBakeDef();
  points.points = 500, points.field = def;
  made.shell = h6BakeShell(made.mesh, &points, &error);
  REQUIRE_MESSAGE(made.shell, error.message);

  Made again;
  CHECK(h6WriteField(made.field, scratch("box.vdb").c_str(), &error));
  CHECK(h6WriteShell(made.shell, scratch("box.ply").c_str(), &error));
  again.field = h6ReadField(scratch("box.vdb").c_str(), &error);
  REQUIRE_MESSAGE(again.field, error.message);
  again.shell = h6ReadShell(scratch("box.ply").c_str(), &error);
  REQUIRE_MESSAGE(again.shell, error.message);
  h6FieldDef a, b;
  h6GetField(made.field, &a), h6GetField(again.field, &b);
  REQUIRE(a.brick_count == b.brick_count);
  CHECK(std::memcmp(a.samples, b.samples, 512 * sizeof(float) * a.brick_count) == 0);
  h6ShellDef s;
  h6GetShell(again.shell, &s);
  CHECK(s.point_count == 500);

  h6CheckDef check = h6DefaultCheckDef();
  check.points = 2000;
  h6CheckReport report;
  REQUIRE_MESSAGE(h6CheckField(made.mesh, made.field, &check, &report, &error), error.message);
  CHECK((report.agrees && !report.drains));
  CHECK(report.worst_node < 1e-3);
  CHECK(report.wall_median == doctest::Approx(0.02).epsilon(0.01));
  CHECK((report.pushed > 0 && report.holding_force > 0));
}

TEST_CASE("progress rises on the caller's thread, and false cancels with a code") {
  Made made;
  const Box box(0.01);
  made.mesh = h6CreateMesh(&box.def, nullptr);
  struct Seen {
    double last = 0;
    int calls = 0, allowed = 1 << 30;
  } seen;
  h6FieldBakeDef def = coarse();
  def.voxels = 128, def.user = &seen;
  def.progress = [](void* user, const char* what, double done) {
    Seen& s = *static_cast<Seen*>(user);
    CHECK((what && done >= 0 && done <= 1));
    s.last = done;
    return ++s.calls <= s.allowed;
  };
  h6Error error{};
  made.field = h6BakeField(made.mesh, &def, &error);
  REQUIRE_MESSAGE(made.field, error.message);
  REQUIRE(seen.calls > 0);
  seen = Seen{0, 0, 0};
  CHECK(h6BakeField(made.mesh, &def, &error) == nullptr);
  CHECK(error.code == H6_ERROR_CANCELLED);
  h6SceneDef scene = h6DefaultSceneDef();
  scene.progress = [](void*, const char*, double) { return false; };
  CHECK(h6ReadScene("peg-in-hole", &scene, &error) == nullptr);
  CHECK(error.code == H6_ERROR_CANCELLED);
}

TEST_CASE("the cache is used only on request") {
  Made one, two;
  const Box box(0.0123);
  one.mesh = h6CreateMesh(&box.def, nullptr);
  const auto kept = [] {
    std::size_t count = 0;
    for (const auto& entry : fs::directory_iterator(h6::test::private_cache.folder))
      count += entry.path().extension() == ".field";
    return count;
  };
  const std::size_t before = kept();
  h6FieldBakeDef def = coarse();
  one.field = h6BakeField(one.mesh, &def, nullptr);
  CHECK(kept() == before);
  def.cache = true;
  two.field = h6BakeField(one.mesh, &def, nullptr);
  CHECK(kept() == before + 1);
  h6FieldDef a, b;
  h6GetField(one.field, &a), h6GetField(two.field, &b);
  REQUIRE((a.brick_count > 0 && a.brick_count == b.brick_count));
  CHECK(std::memcmp(a.samples, b.samples, 512 * sizeof(float) * a.brick_count) == 0);
}

TEST_CASE("a generated scene runs, is recorded, and its rows are read back to the bit") {
  h6Error error{};
  h6Scene* scene = h6ReadScene("box-on-wall", nullptr, &error);
  REQUIRE_MESSAGE(scene, error.message);
  h6SessionDef def;
  h6GetSceneSession(scene, &def);
  h6Session* session = h6CreateSession(h6GetSceneModel(scene), &def, &error);
  REQUIRE_MESSAGE(session, error.message);
  CHECK(h6FindBody(scene, h6GetBodyName(scene, 0)) == 0);
  CHECK(h6GetSceneDuration(scene) > 0);
  h6RecorderDef what = h6DefaultRecorderDef();
  what.scene = scene, what.program = "a test";
  const std::string file = scratch("run.h5");
  h6Recorder* recorder = h6CreateRecorder(file.c_str(), &what, &error);
  REQUIRE_MESSAGE(recorder, error.message);
  std::vector<h6FrameRecord> rows;
  for (int i = 0; i < 400; ++i) {
    h6DeviceSample in;
    h6DeviceCommand out;
    REQUIRE(h6SampleScenePath(scene, 0, i / def.rate, &in));
    h6Step(session, &in, &out);
    h6FrameRecord row;
    h6GetRecord(session, &in, &out, &row);
    rows.push_back(row);
    CHECK(h6RecordFrames(recorder, &row, 1, &error));
  }
  REQUIRE_MESSAGE(h6FinishRecorder(recorder, "{\"verdict\": \"held\"}", &error), error.message);
  h6DestroyRecorder(recorder);
  h6Recording* recording = h6ReadRecording(file.c_str(), &error);
  REQUIRE_MESSAGE(recording, error.message);
  h6RecordingInfo info;
  h6GetRecording(recording, &info);
  CHECK((info.frames == 400 && info.hands == 1 && info.whole && info.rate == def.rate));
  CHECK(std::string(info.program) == "a test");
  CHECK(std::string(info.summary).find("held") != std::string::npos);
  CHECK(std::string(info.scene).find("\"bodies\"") != std::string::npos);
  std::vector<h6FrameRecord> read(10);
  CHECK(h6GetRecordingFrames(recording, 395, read.data(), read.size(), &error) == 5);
  for (int i = 0; i < 5; ++i) {
    CHECK(read[i].report.state_hash == rows[395 + i].report.state_hash);
    CHECK(read[i].command[0].wrench.force.z == rows[395 + i].command[0].wrench.force.z);
  }
  h6DestroyRecording(recording), h6DestroySession(session), h6DestroyScene(scene);
}

TEST_CASE("a scene's model and session take their memory from the program, and give it back") {
  struct Heap {
    std::size_t bytes = 0, calls = 0;
  } heap;
  h6SceneDef def = h6DefaultSceneDef();
  def.allocator.user = &heap;
  def.allocator.allocate = [](void* user, std::size_t bytes, std::size_t alignment) {
    static_cast<Heap*>(user)->bytes += bytes, ++static_cast<Heap*>(user)->calls;
    return std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
  };
  def.allocator.release = [](void* user, void* memory, std::size_t bytes) {
    static_cast<Heap*>(user)->bytes -= bytes;
    std::free(memory);
  };
  h6Scene* scene = h6ReadScene("box-on-wall", &def, nullptr);
  REQUIRE(scene);
  const std::size_t of_model = heap.bytes;
  CHECK(of_model >= h6ModelBytes(h6GetSceneModel(scene)));
  h6SessionDef with;
  h6GetSceneSession(scene, &with);
  h6Session* session = h6CreateSession(h6GetSceneModel(scene), &with, nullptr);
  REQUIRE(session);
  CHECK(heap.bytes > of_model);
  const std::size_t calls = heap.calls;
  h6DeviceSample sample = h6DefaultDeviceSample();
  h6DeviceCommand command;
  for (int i = 0; i < 100; ++i) h6Step(session, &sample, &command);
  CHECK(heap.calls == calls);
  h6DestroySession(session);
  CHECK(heap.bytes == of_model);
  h6DestroyScene(scene);
  CHECK(heap.bytes == 0);
}

TEST_CASE("what a bake repaired goes to the log, and nothing to the terminal") {
  const Log log;
  std::vector<std::uint32_t> open(kFaces[0], kFaces[0] + 30);  // a box without a side
  Box box(0.01);
  box.def.triangles = open.data(), box.def.triangle_count = 10;
  Made made;
  made.mesh = h6CreateMesh(&box.def, nullptr);
  const h6FieldBakeDef def = coarse();
  made.field = h6BakeField(made.mesh, &def, nullptr);
  CHECK(made.field != nullptr);
  CHECK(!log.lines.empty());
}

// ---- wrong arguments ----------------------------------------------------------------------------

TEST_CASE("wrong arguments give NULL, false, -1 or zeros, a code, and no crash") {
  h6Error error{};
  const auto code = [&] {
    const h6ErrorCode found = error.code;
    error = {};
    return found;
  };
  Box box(0.01);
  CHECK((h6CreateMesh(nullptr, &error) == nullptr && code() == H6_ERROR_ARGUMENT));
  std::uint32_t wild[36];
  std::memcpy(wild, kFaces, sizeof wild);
  wild[7] = 8;
  box.def.triangles = wild;
  CHECK((h6CreateMesh(&box.def, &error) == nullptr && code() == H6_ERROR_ARGUMENT));
  box.def.triangles = kFaces[0];
  for (const double bad : {std::nan(""), 1e7, -std::numeric_limits<double>::infinity()}) {
    Box spoilt(0.01);
    spoilt.vertices[4] = bad;
    CHECK((h6CreateMesh(&spoilt.def, &error) == nullptr && code() == H6_ERROR_ARGUMENT));
  }
  box.def.triangle_count = SIZE_MAX;
  CHECK((h6CreateMesh(&box.def, &error) == nullptr && code() == H6_ERROR_ARGUMENT));
  box.def.triangle_count = 12, box.def.reserved[3] = 1;
  CHECK((h6CreateMesh(&box.def, &error) == nullptr && code() == H6_ERROR_ARGUMENT));
  box.def.reserved[3] = 0;
  CHECK((h6ReadMesh("/no/such.stl", H6_METRES, &error) == nullptr && code() == H6_ERROR_FILE));
  CHECK(wrong([](h6Error* e) { return h6ReadMesh("x.stl", static_cast<h6Unit>(9), e); }));
  CHECK((h6ParseMesh("solid", 5, "x.stl", H6_METRES, &error) == nullptr &&
         code() == H6_ERROR_CONTENT));
  std::ofstream(scratch("bad.vdb")) << "this is no field";
  CHECK((h6ReadField(scratch("bad.vdb").c_str(), &error) == nullptr && code() == H6_ERROR_CONTENT));
  CHECK((h6ReadShell("/no/such.ply", &error) == nullptr && code() == H6_ERROR_FILE));
  CHECK((h6ReadScene("no-such-scene", nullptr, &error) == nullptr && code() == H6_ERROR_FILE));
  CHECK((h6ReadRecording("/no/such.h5", &error) == nullptr && code() == H6_ERROR_FILE));

  Made made;
  made.mesh = h6CreateMesh(&box.def, &error);
  REQUIRE(made.mesh);
  const auto refused = [&](auto change) {
    h6FieldBakeDef def = coarse();
    change(def);
    h6Field* field = h6BakeField(made.mesh, &def, &error);
    h6DestroyField(field);
    return field == nullptr && code() == H6_ERROR_RANGE;
  };
  for (const double bad : {std::nan(""), -2.0, 1e300}) {
    CHECK(refused([&](h6FieldBakeDef& d) { d.voxel_size = bad; }));
    CHECK(refused([&](h6FieldBakeDef& d) { d.weld = bad; }));
    CHECK(refused([&](h6FieldBakeDef& d) { d.band_voxels = bad; }));
    CHECK(refused([&](h6FieldBakeDef& d) { d.seal = bad; }));
  }
  for (const std::int32_t bad : {0, -1, 15, 2049, INT32_MAX})
    CHECK(refused([&](h6FieldBakeDef& d) { d.voxels = bad; }));
  CHECK(refused([&](h6FieldBakeDef& d) { d.sign = static_cast<h6Sign>(7); }));
  CHECK((h6BakeField(nullptr, nullptr, &error) == nullptr && code() == H6_ERROR_ARGUMENT));
  CHECK((h6BakeShell(nullptr, nullptr, &error) == nullptr && code() == H6_ERROR_ARGUMENT));
  h6ShellBakeDef shell = h6DefaultShellBakeDef();
  shell.points = 0;
  CHECK((h6BakeShell(made.mesh, &shell, &error) == nullptr && code() == H6_ERROR_RANGE));
  CHECK((!h6WriteField(nullptr, "x.vdb", &error) && code() == H6_ERROR_ARGUMENT));
  h6FieldDef field;
  h6GetField(nullptr, &field), h6GetField(nullptr, nullptr);
  CHECK(field.brick_count == 0);
  h6DeviceSample sample;
  CHECK_FALSE(h6SampleScenePath(nullptr, 0, 0, &sample));
  CHECK(sample.pose.q.w == 1);
  CHECK(h6FindBody(nullptr, "x") == -1);
  const h6RecorderDef none = h6DefaultRecorderDef();
  CHECK((h6CreateRecorder("x.h5", &none, &error) == nullptr && code() == H6_ERROR_ARGUMENT));
  CHECK((!h6RecordFrames(nullptr, nullptr, 0, &error) && code() == H6_ERROR_ARGUMENT));
  CHECK((!h6FinishRecorder(nullptr, nullptr, &error) && code() == H6_ERROR_ARGUMENT));
  CHECK(h6GetRecordingFrames(nullptr, 0, nullptr, 0, &error) == -1);
  h6DestroyScene(nullptr), h6DestroyRecorder(nullptr), h6DestroyRecording(nullptr);
}

TEST_CASE("NULL instead of a name is a wrong argument") {
  const BakedBox made;
  CHECK(wrong([](h6Error* e) { return h6ReadMesh(nullptr, H6_METRES, e); }));
  CHECK(wrong([](h6Error* e) { return h6ParseMesh("solid", 5, nullptr, H6_METRES, e); }));
  CHECK(wrong([](h6Error* e) { return h6ParseMesh(nullptr, 5, "x.stl", H6_METRES, e); }));
  CHECK(wrong([](h6Error* e) { return h6ReadField(nullptr, e); }));
  CHECK(wrong([](h6Error* e) { return h6ReadShell(nullptr, e); }));
  CHECK(wrong([](h6Error* e) { return h6ReadScene(nullptr, nullptr, e); }));
  CHECK(wrong([](h6Error* e) { return h6ReadRecording(nullptr, e); }));
  CHECK(wrong([&](h6Error* e) { return h6WriteField(made.field, nullptr, e); }));
  CHECK(wrong([&](h6Error* e) { return h6WriteShell(made.shell, nullptr, e); }));
  CHECK(wrong([](h6Error* e) { return h6WriteShell(nullptr, "x.ply", e); }));
  const Run run;
  h6RecorderDef what = h6DefaultRecorderDef();
  what.scene = run.scene;
  CHECK(wrong([&](h6Error* e) { return h6CreateRecorder(nullptr, &what, e); }));
  CHECK(wrong([](h6Error* e) { return h6CreateRecorder("x.h5", nullptr, e); }));
  CHECK(h6FindBody(run.scene, nullptr) == -1);
  CHECK(h6FindBody(run.scene, "") == -1);
}

TEST_CASE("a name that no file has or can have fails with a sentence") {
  const BakedBox made;
  const Run run;
  h6RecorderDef what = h6DefaultRecorderDef();
  what.scene = run.scene;
  // The last name holds the word that stands in the sentence of cancelled work.
  for (const std::string& name : {std::string(), scratch("").string(), std::string(5000, 'x'),
                                  std::string("/no/such/cancelled.stl")}) {
    const char* const file = name.c_str();
    const auto refused = [](auto&& call) {
      const h6ErrorCode code = failure(call);
      return code == H6_ERROR_FILE || code == H6_ERROR_CONTENT || code == H6_ERROR_ARGUMENT;
    };
    CAPTURE(name.substr(0, 100));
    CHECK(refused([&](h6Error* e) { return h6ReadMesh(file, H6_METRES, e); }));
    CHECK(refused([&](h6Error* e) { return h6ParseMesh("solid", 5, file, H6_METRES, e); }));
    CHECK(refused([&](h6Error* e) { return h6ReadField(file, e); }));
    CHECK(refused([&](h6Error* e) { return h6ReadShell(file, e); }));
    CHECK(refused([&](h6Error* e) { return h6ReadScene(file, nullptr, e); }));
    CHECK(refused([&](h6Error* e) { return h6ReadRecording(file, e); }));
    CHECK(refused([&](h6Error* e) { return h6WriteField(made.field, file, e); }));
    CHECK(refused([&](h6Error* e) { return h6WriteShell(made.shell, file, e); }));
    CHECK(refused([&](h6Error* e) { return h6CreateRecorder(file, &what, e); }));
  }
}

TEST_CASE("of NULL everything is zero or the default, and room that is NULL is not written") {
  const BakedBox made;
  h6MeshInfo info;
  h6GetMesh(made.mesh, &info), h6GetMesh(nullptr, &info);
  CHECK((info.triangles == 0 && info.parts == 0 && !info.closed && info.high.x == 0));
  h6ShellDef shell = h6DefaultShellDef();
  shell.point_count = 1;
  h6GetShell(nullptr, &shell);
  CHECK((shell.point_count == 0 && shell.x == nullptr));
  h6GetMesh(made.mesh, nullptr), h6GetMesh(nullptr, nullptr), h6GetShell(nullptr, nullptr);
  const Run run;
  h6RecordingInfo of_run = run.info;
  h6GetRecording(run.recording, nullptr), h6GetRecording(nullptr, nullptr);
  h6GetRecording(nullptr, &of_run);
  CHECK((of_run.frames == 0 && of_run.rate == 0 && of_run.scene == nullptr));
  h6SessionDef def = run.def;
  h6GetSceneSession(run.scene, nullptr), h6GetSceneSession(nullptr, nullptr);
  h6GetSceneSession(nullptr, &def);
  CHECK((def.body_count == 0 && def.bodies == nullptr && def.rate == h6DefaultSessionDef().rate));
  CHECK(h6GetSceneDuration(nullptr) == 0);
  CHECK(h6GetSceneModel(nullptr) == nullptr);
  CHECK_FALSE(h6SampleScenePath(run.scene, 0, 0, nullptr));
  h6RecordingEvent event{7, nullptr, nullptr};
  CHECK_FALSE(h6GetRecordingEvent(nullptr, 0, &event));
  CHECK_FALSE(h6GetRecordingEvent(run.recording, 0, nullptr));
  CHECK(event.time == 7);
  CHECK(wrong([&](h6Error* e) { return h6GetRecordingFrames(run.recording, 0, nullptr, 1, e); }));
  CHECK(h6GetRecordingFrames(run.recording, 0, nullptr, 0, nullptr) == 0);
  h6CheckReport report;
  CHECK(wrong([&](h6Error* e) { return h6CheckField(made.mesh, nullptr, nullptr, &report, e); }));
  CHECK(wrong([&](h6Error* e) { return h6CheckField(nullptr, nullptr, nullptr, nullptr, e); }));
  CHECK((!report.agrees && report.pushed == 0));
  h6DestroyMesh(nullptr), h6DestroyField(nullptr), h6DestroyShell(nullptr);
}

TEST_CASE("a part, body, hand, event or frame that does not exist is not given") {
  const std::int32_t part[12] = {0, 0, 0, 0, 7, 7, 7, 7, 7, 7, 7, 7};
  Made made;
  Box box(0.01);
  box.def.part = part;
  made.mesh = h6CreateMesh(&box.def, nullptr);
  const Run run;
  const auto bodies = static_cast<std::int32_t>(run.def.body_count);
  const auto hands = static_cast<std::int32_t>(run.def.hand_count);
  h6DeviceSample sample;
  REQUIRE((h6GetPartName(made.mesh, 1) && h6GetBodyName(run.scene, bodies - 1)));
  REQUIRE(h6SampleScenePath(run.scene, 0, 0, &sample));
  for (const std::int32_t odd : {-1, INT32_MIN, INT32_MAX}) {
    CHECK((h6GetPartName(made.mesh, odd) == nullptr && h6GetPartName(nullptr, odd) == nullptr));
    CHECK(h6GetBodyName(run.scene, odd) == nullptr);
    CHECK_FALSE(h6SampleScenePath(run.scene, odd, 0, &sample));
  }
  CHECK(h6GetPartName(made.mesh, 2) == nullptr);
  CHECK(h6GetBodyName(run.scene, bodies) == nullptr);
  CHECK(h6GetBodyName(nullptr, 0) == nullptr);
  CHECK_FALSE(h6SampleScenePath(run.scene, hands, 0, &sample));
  CHECK((sample.pose.q.w == 1 && sample.pose.p.x == 0));
  h6RecordingEvent event{7, nullptr, nullptr};
  for (const std::size_t odd : {run.info.events, SIZE_MAX})
    CHECK_FALSE(h6GetRecordingEvent(run.recording, odd, &event));
  CHECK(event.time == 7);
  h6FrameRecord row{};
  row.time = 7;
  for (const std::uint64_t first : {std::uint64_t{5}, UINT64_MAX})
    CHECK(h6GetRecordingFrames(run.recording, first, &row, 1, nullptr) == 0);
  CHECK(row.time == 7);
  std::vector<h6FrameRecord> room(5);  // all that there are
  CHECK(h6GetRecordingFrames(run.recording, 0, room.data(), SIZE_MAX, nullptr) == 5);
}

TEST_CASE("a count that cannot be is a wrong argument") {
  const auto refused = [](auto change) {
    Box box(0.01);
    change(box.def);
    return wrong([&](h6Error* e) { return h6CreateMesh(&box.def, e); });
  };
  CHECK(refused([](h6MeshDef& d) { d.vertex_count = 0; }));
  CHECK(refused([](h6MeshDef& d) { d.vertex_count = SIZE_MAX; }));
  CHECK(refused([](h6MeshDef& d) { d.triangle_count = 0; }));
  CHECK(refused([](h6MeshDef& d) { d.vertices = nullptr; }));
  CHECK(refused([](h6MeshDef& d) { d.triangles = nullptr; }));
  const std::int32_t part[12] = {0, -1};
  CHECK(refused([&](h6MeshDef& d) { d.part = part; }));
  CHECK(wrong([](h6Error* e) { return h6ParseMesh("x", SIZE_MAX, "x.stl", H6_METRES, e); }));
  CHECK(H6_ERROR_CONTENT ==
        failure([](h6Error* e) { return h6ParseMesh("", 0, "x.stl", H6_METRES, e); }));
  const Run run;
  h6RecorderDef what = h6DefaultRecorderDef();
  const std::string file = scratch("counts.h5");
  for (const std::size_t bad : {std::size_t{0}, std::size_t{9}, SIZE_MAX}) {
    h6SessionDef def = run.def;
    what.session = &def, def.hand_count = bad;
    CHECK(wrong([&](h6Error* e) { return h6CreateRecorder(file.c_str(), &what, e); }));
  }
  what.session = &run.def;
  h6Recorder* recorder = h6CreateRecorder(file.c_str(), &what, nullptr);
  REQUIRE(recorder);
  CHECK(wrong([&](h6Error* e) { return h6RecordFrames(recorder, nullptr, 1, e); }));
  CHECK(wrong([&](h6Error* e) { return h6RecordFrames(recorder, &run.row, SIZE_MAX, e); }));
  CHECK(h6RecordFrames(recorder, nullptr, 0, nullptr));
  CHECK(no_file([&](h6Error* e) { return h6FinishRecorder(recorder, "no JSON", e); }));
  CHECK(h6FinishRecorder(recorder, nullptr, nullptr));
  CHECK(no_file([&](h6Error* e) { return h6FinishRecorder(recorder, nullptr, e); }));
  CHECK(no_file([&](h6Error* e) { return h6RecordFrames(recorder, &run.row, 1, e); }));
  h6DestroyRecorder(recorder);
}

TEST_CASE("a number that is not finite or out of range is refused, and a time has the path's end") {
  const BakedBox made;
  const auto bad_shell = [&](auto change) {
    h6ShellBakeDef def = h6DefaultShellBakeDef();
    change(def);
    return out_of_range([&](h6Error* e) { return h6BakeShell(made.mesh, &def, e); });
  };
  h6CheckReport report;
  const auto bad_check = [&](auto change) {
    h6CheckDef def = h6DefaultCheckDef();
    change(def);
    return out_of_range(
        [&](h6Error* e) { return h6CheckField(made.mesh, made.field, &def, &report, e); });
  };
  const Run run;
  const auto bad_recorder = [&](auto change) {
    h6SessionDef def = run.def;
    change(def);
    h6RecorderDef what = h6DefaultRecorderDef();
    what.scene = run.scene, what.session = &def;
    const std::string file = scratch("bad.h5");
    return out_of_range([&](h6Error* e) { return h6CreateRecorder(file.c_str(), &what, e); });
  };
  for (const double bad : {std::nan(""), kInfinity, -kInfinity, -1.0}) {
    CHECK(bad_shell([&](h6ShellBakeDef& d) { d.spacing = bad; }));
    CHECK(bad_shell([&](h6ShellBakeDef& d) { d.field.tolerance = bad; }));
    CHECK(bad_check([&](h6CheckDef& d) { d.stiffness = bad; }));
    CHECK(bad_recorder([&](h6SessionDef& d) { d.contact.damping = bad; }));
    CHECK(bad_recorder([&](h6SessionDef& d) { d.rate = bad; }));
    if (bad == -1.0) continue;
    CHECK(bad_shell([&](h6ShellBakeDef& d) { d.field.offset = bad; }));
    h6DeviceSample sample;
    CHECK(h6SampleScenePath(run.scene, 0, bad, &sample) == !std::isnan(bad));
    CHECK(std::isfinite(sample.pose.p.x + sample.pose.q.w + sample.velocity.linear.x));
  }
  for (const std::int32_t bad : {0, -1, 17})
    CHECK(bad_shell([&](h6ShellBakeDef& d) { d.levels = bad; }));
  for (const std::size_t bad : {std::size_t{0}, SIZE_MAX}) {
    CHECK(bad_shell([&](h6ShellBakeDef& d) { d.points = bad; }));
    CHECK(bad_check([&](h6CheckDef& d) { d.points = bad; }));
  }
  CHECK(bad_shell([](h6ShellBakeDef& d) { d.normals = static_cast<h6ShellFrom>(-1); }));
  CHECK(bad_recorder([](h6SessionDef& d) { d.contact.method = static_cast<h6Method>(99); }));
  CHECK_FALSE(fs::exists(scratch("bad.h5")));
  CHECK_FALSE(fs::exists(scratch("bad.h5.part")));
  // More threads than cores are as many as cores.
  h6FieldBakeDef def = coarse();
  h6CheckDef check = h6DefaultCheckDef();
  def.threads = check.threads = UINT32_MAX, check.points = 100, check.push = false;
  h6Field* field = h6BakeField(made.mesh, &def, nullptr);
  CHECK(h6CheckField(made.mesh, field, &check, &report, nullptr));
  h6DestroyField(field);
}
