// SPDX-License-Identifier: Apache-2.0
// Random sequences of calls of hapsix/io.h with any arguments, in any order: NULL, NaN, huge,
// negative, objects that are unfinished or of another run. Whatever comes: no crash, a refusal has
// its sentence, and numbers are finite. HAPSIX_SEQUENCES sets how many there are.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "hapsix/io.h"
#include "tests/io/private_cache.h"
#include "tests/support/sanitized.h"

namespace {

// A scene and its session, which every sequence may read.
struct Common {
  h6Scene* scene = h6ReadScene("box-on-wall", nullptr, nullptr);
  h6SessionDef def{};
  Common() {
    REQUIRE(scene);
    h6GetSceneSession(scene, &def);
  }
  ~Common() { h6DestroyScene(scene); }
};

class Sequence {
 public:
  Sequence(std::uint64_t seed, const Common& common) : random_(seed), common_(common) {}
  ~Sequence() {
    h6DestroyMesh(mesh_), h6DestroyField(field_), h6DestroyShell(shell_);
    h6DestroyRecorder(recorder_), h6DestroyRecording(recording_);
  }
  void call() {
    switch (random_() % 16) {
      case 0:
      case 1:
        return make_mesh();
      case 2:
        return parse_mesh();
      case 3:
        return look_at_mesh();
      case 4:
        return bake_field();
      case 5:
        return bake_shell();
      case 6:
        return field_file();
      case 7:
        return shell_file();
      case 8:
        return check_field();
      case 9:
        return read_scene();
      case 10:
        return look_at_scene();
      case 11:
        return make_recorder();
      case 12:
      case 13:
        return record();
      case 14:
        return finish();
      default:
        return read_back();
    }
  }

 private:
  bool rarely() { return random_() % 16 == 0; }
  double number(double usual) {
    static const double odd[] = {0, -usual, 1e-300, 1e300, -1e300, NAN, INFINITY, -INFINITY};
    const std::size_t b = random_() % 64;
    return b < 56 ? usual * (0.5 + 0.02 * static_cast<double>(b)) : odd[b - 56];
  }
  std::int32_t index() {
    static constexpr std::int32_t odd[] = {0, 0, 1, -1, 99, INT32_MAX, INT32_MIN};
    return odd[random_() % 7];
  }
  // A count that a program may have meant, or one that cannot be: nothing is as large as it says.
  std::size_t count(std::size_t usual) {
    return rarely() ? (random_() % 2 ? 0 : SIZE_MAX / (1 + random_() % 64)) : usual;
  }
  static std::string place(const char* name) {
    return (h6::test::private_cache.folder / name).string();
  }
  // Each refusal says why, and what succeeds says nothing.
  static bool judged(bool done, const h6Error& error) {
    REQUIRE(done == (error.message[0] == 0));
    REQUIRE(done == (error.code == H6_NO_ERROR));
    return done;
  }
  template <class T, class Destroy>
  static void keep(T*& kept, T* made, const h6Error& error, Destroy destroy) {
    if (judged(made != nullptr, error)) destroy(kept), kept = made;
  }

  void make_mesh() {
    std::vector<double> at = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    for (double& x : at) x *= 0.01;
    at[random_() % 12] = number(0.01);
    std::vector<std::uint32_t> faces = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2};
    if (rarely()) faces[random_() % 12] = static_cast<std::uint32_t>(random_());
    const std::int32_t parts[4] = {0, 1, rarely() ? index() : 0, 1};
    h6MeshDef def = h6DefaultMeshDef();
    def.vertices = rarely() ? nullptr : at.data(), def.vertex_count = rarely() ? 0 : 4;
    def.triangles = rarely() ? nullptr : faces.data(), def.triangle_count = random_() % 5;
    def.part = random_() % 2 ? parts : nullptr;
    if (rarely()) def.reserved[0] = 1;
    h6Error error{};
    keep(mesh_, h6CreateMesh(rarely() ? nullptr : &def, &error), error, h6DestroyMesh);
  }
  void parse_mesh() {
    std::string text = "v 0 0 0\nv 0.01 0 0\nv 0 0.01 0\nv 0 0 0.01\n";
    text += "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
    if (random_() % 2) text[random_() % text.size()] = static_cast<char>(random_());
    const char* names[] = {"a.obj", "a.obj", "a.stl", "a.ply", "a.glb", "a", "", nullptr};
    h6Error error{};
    keep(mesh_,
         h6ParseMesh(rarely() ? nullptr : text.data(), random_() % (text.size() + 1),
                     names[random_() % 8], static_cast<h6Unit>(index()), &error),
         error, h6DestroyMesh);
  }
  void look_at_mesh() {
    h6MeshInfo info;
    h6GetMesh(mesh_, rarely() ? nullptr : &info);
    h6GetMesh(mesh_, &info);
    REQUIRE(std::isfinite(info.volume + info.low.x + info.high.z));
    (void)h6GetPartName(rarely() ? nullptr : mesh_, index());
  }
  h6FieldBakeDef field_def() {
    h6FieldBakeDef def = h6DefaultFieldBakeDef();
    def.voxels = rarely() ? index() : 16, def.threads = 1;
    if (rarely()) def.voxel_size = number(1e-3);
    if (rarely()) def.tolerance = number(1e-3);
    if (rarely()) def.offset = number(1e-4);
    if (rarely()) def.seal = number(1e-3);
    if (rarely()) def.weld = number(0.5);
    if (rarely()) def.band_voxels = number(3);
    if (rarely()) def.sign = static_cast<h6Sign>(index());
    if (rarely()) def.reserved[0] = 1;
    def.hollow = random_() % 2;
    if (rarely()) def.progress = [](void*, const char*, double) { return false; };
    return def;
  }
  void bake_field() {
    const h6FieldBakeDef def = field_def();
    h6Error error{};
    keep(field_, h6BakeField(rarely() ? nullptr : mesh_, rarely() ? nullptr : &def, &error), error,
         h6DestroyField);
    h6FieldDef out;
    h6GetField(field_, &out);
  }
  void bake_shell() {
    h6ShellBakeDef def = h6DefaultShellBakeDef();
    def.points = count(20), def.field = field_def(), def.seed = random_();
    def.levels = rarely() ? index() : 3;
    if (rarely()) def.spacing = number(1e-3);
    if (rarely()) def.surface = static_cast<h6ShellFrom>(index());
    if (rarely()) def.normals = static_cast<h6ShellFrom>(index());
    h6Error error{};
    keep(shell_, h6BakeShell(rarely() ? nullptr : mesh_, rarely() ? nullptr : &def, &error), error,
         h6DestroyShell);
    h6ShellDef out;
    h6GetShell(shell_, &out);
  }
  // A file of the right kind, of another kind, one that is not there, or a folder.
  std::string some_file(const char* right) {
    const char* names[] = {right,    right,      "any.vdb",  "any.ply",
                           "any.h5", "none.obj", "no/a.vdb", ""};
    return place(names[random_() % 8]);
  }
  void field_file() {
    const std::string file = some_file("any.vdb");
    h6Error error{};
    if (random_() % 2)
      return (void)judged(
          h6WriteField(field_, rarely() ? nullptr : place("any.vdb").c_str(), &error), error);
    keep(field_, h6ReadField(rarely() ? nullptr : file.c_str(), &error), error, h6DestroyField);
  }
  void shell_file() {
    const std::string file = some_file("any.ply");
    h6Error error{};
    if (random_() % 2)
      return (void)judged(
          h6WriteShell(shell_, rarely() ? nullptr : place("any.ply").c_str(), &error), error);
    if (random_() % 2)
      keep(shell_, h6ReadShell(rarely() ? nullptr : file.c_str(), &error), error, h6DestroyShell);
    else
      keep(mesh_, h6ReadMesh(rarely() ? nullptr : file.c_str(), H6_METRES, &error), error,
           h6DestroyMesh);
  }
  void check_field() {
    h6CheckDef def = h6DefaultCheckDef();
    def.points = rarely() ? count(50) : 50, def.push = false, def.threads = 1;
    def.stiffness = number(1e4);
    h6CheckReport report{};
    h6Error error{};
    if (!judged(h6CheckField(mesh_, field_, rarely() ? nullptr : &def, rarely() ? nullptr : &report,
                             &error),
                error))
      return;
    REQUIRE(std::isfinite(report.worst_node + report.worst_between + report.wall_median));
  }
  void read_scene() {
    const char* names[] = {"no-such-scene", "", "any.json", "/", nullptr};
    h6SceneDef def = h6DefaultSceneDef();
    if (rarely()) def.reserved[0] = 1;
    h6Error error{};
    h6Scene* const made = h6ReadScene(names[random_() % 5], rarely() ? nullptr : &def, &error);
    REQUIRE(made == nullptr);
    (void)judged(false, error);
  }
  void look_at_scene() {
    const h6Scene* scene = rarely() ? nullptr : common_.scene;
    h6SessionDef def;
    h6GetSceneSession(scene, rarely() ? nullptr : &def);
    (void)h6GetSceneModel(scene), (void)h6GetBodyName(scene, index());
    (void)h6FindBody(scene, rarely() ? nullptr : "body");
    REQUIRE(std::isfinite(h6GetSceneDuration(scene)));
    h6DeviceSample in = h6DefaultDeviceSample();
    (void)h6SampleScenePath(scene, index(), number(1), rarely() ? nullptr : &in);
    REQUIRE(std::isfinite(in.pose.p.x + in.velocity.linear.z));
  }
  void make_recorder() {
    h6RecorderDef def = h6DefaultRecorderDef();
    def.scene = random_() % 4 ? common_.scene : nullptr;
    h6SessionDef session = common_.def;
    if (rarely()) session.rate = number(1000);
    def.session = random_() % 4 ? nullptr : &session;
    def.virtual_time = random_() % 2, def.program = rarely() ? "odd \"\n\x01 name" : nullptr;
    if (rarely()) def.reserved[0] = 1;
    h6Error error{};
    keep(recorder_,
         h6CreateRecorder(rarely() ? nullptr : some_file("any.h5").c_str(),
                          rarely() ? nullptr : &def, &error),
         error, h6DestroyRecorder);
  }
  void record() {
    std::vector<h6FrameRecord> rows(2);
    for (h6FrameRecord& row : rows) {
      row.time = number(0.001), row.report.frame = random_() % 8;
      row.hand[0] = h6DefaultDeviceSample(), row.hand[0].pose.p.x = number(1);
      row.command[0].wrench.force.z = number(1);
      row.command[0].cause = static_cast<h6Cause>(index());
      row.state[0] = static_cast<h6DeviceState>(index());
      row.inputs_only = rarely(), row.settings = rarely() ? 7 : 0;
    }
    h6Error error{};
    (void)judged(h6RecordFrames(rarely() ? nullptr : recorder_, rarely() ? nullptr : rows.data(),
                                random_() % 3, &error),
                 error);
  }
  void finish() {
    const char* summaries[] = {nullptr, "{}", "{\"a\": 1}", "[1]", "{", "\xff", ""};
    h6Error error{};
    (void)judged(h6FinishRecorder(recorder_, summaries[random_() % 7], &error), error);
    if (random_() % 2) h6DestroyRecorder(recorder_), recorder_ = nullptr;
  }
  void read_back() {
    h6Error error{};
    if (random_() % 4 == 0)
      keep(recording_, h6ReadRecording(rarely() ? nullptr : some_file("any.h5").c_str(), &error),
           error, h6DestroyRecording);
    h6RecordingInfo info{};
    h6GetRecording(recording_, &info);
    REQUIRE(std::isfinite(info.rate));
    h6FrameRecord rows[3];
    error = {};
    const std::uint64_t first = rarely() ? random_() : random_() % 4;
    const std::int64_t n =
        h6GetRecordingFrames(recording_, first, rarely() ? nullptr : rows, random_() % 4, &error);
    REQUIRE((n >= -1 && n <= 3));
    (void)judged(n >= 0, error);
    h6RecordingEvent event{};
    (void)h6GetRecordingEvent(recording_, rarely() ? SIZE_MAX : random_() % 3,
                              rarely() ? nullptr : &event);
  }

  std::mt19937_64 random_;
  const Common& common_;
  h6Mesh* mesh_ = nullptr;
  h6Field* field_ = nullptr;
  h6Shell* shell_ = nullptr;
  h6Recorder* recorder_ = nullptr;
  h6Recording* recording_ = nullptr;
};

}  // namespace

TEST_CASE("any sequence of calls of io.h with any arguments has a defined result") {
  const Common common;
  const char* const asked = std::getenv("HAPSIX_SEQUENCES");
  const long count = asked ? std::atol(asked) : h6::test::kSanitized ? 20 : 60;
  for (long i = 0; i < count; ++i) {
    CAPTURE(i);
    Sequence sequence(static_cast<std::uint64_t>(i), common);
    for (int k = 0; k < 40; ++k) sequence.call();
  }
  MESSAGE(count << " sequences of 40 calls");
}
