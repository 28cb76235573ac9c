// SPDX-License-Identifier: Apache-2.0
// Random sequences of calls of hapsix/io.h with any arguments, in any order: NULL, NaN, huge,
// negative, objects that are unfinished or of another run. Whatever comes: no crash, a refusal has
// its sentence, and numbers are finite. HAPSIX_SEQUENCES sets how many there are; 100000 take some
// five minutes.
//
// Cheap functions are called often, those that write or read files seldom. Every sequence may use a
// mesh, its field and its shell, scenes and a recording that are made once.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <fstream>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "hapsix/hapsix.hpp"
#include "hapsix/io.h"
#include "tests/io/private_cache.h"
#include "tests/support/random_sequences.h"
#include "tests/support/sanitized.h"

namespace {

std::string place(const char* name) { return (h6::test::private_cache.folder / name).string(); }

// The corners and faces of a tetrahedron.
constexpr double kCorners[12] = {0, 0, 0, 0.01, 0, 0, 0, 0.01, 0, 0, 0, 0.01};
constexpr std::uint32_t kFaces[12] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2};

// The objects that every sequence may read, and how often each function succeeded and failed.
struct Common {
  hapsix::Mesh mesh;
  hapsix::Field field;
  hapsix::Shell shell;
  hapsix::Scene scene = read("box-on-wall"), bending = read("clip-and-rod");
  hapsix::Recording recording;  // of the scene that bends
  std::size_t modes = 0;        // of its bodies
  struct Tally {
    long done = 0, failed = 0;
  };
  std::map<std::string, Tally> tally;

  Common() {
    h6MeshDef box = h6DefaultMeshDef();
    box.vertices = kCorners, box.vertex_count = 4, box.triangles = kFaces, box.triangle_count = 4;
    h6ShellBakeDef small = h6DefaultShellBakeDef();
    small.points = 20, small.levels = 3, small.field.voxels = 16, small.field.threads = 1;
    mesh = hapsix::Mesh::make([&](h6Error* e) { return h6CreateMesh(&box, e); });
    field = hapsix::Field::make([&](h6Error* e) { return h6BakeField(mesh, &small.field, e); });
    shell = hapsix::Shell::make([&](h6Error* e) { return h6BakeShell(mesh, &small, e); });
    REQUIRE(h6WriteField(field, place("any.vdb").c_str(), nullptr));
    REQUIRE(h6WriteShell(shell, place("any.ply").c_str(), nullptr));
    record();
  }
  static hapsix::Scene read(const char* name) {
    return hapsix::Scene::make([&](h6Error* e) { return h6ReadScene(name, nullptr, e); });
  }
  void record() {
    h6RecorderDef def = h6DefaultRecorderDef();
    def.scene = bending;
    const std::string file = place("bends.h5");
    const auto recorder =
        hapsix::Recorder::make([&](h6Error* e) { return h6CreateRecorder(file.c_str(), &def, e); });
    const h6FrameRecord rows[2]{};
    REQUIRE(h6RecordFrames(recorder, rows, 2, nullptr));
    REQUIRE(h6FinishRecorder(recorder, nullptr, nullptr));
    recording =
        hapsix::Recording::make([&](h6Error* e) { return h6ReadRecording(file.c_str(), e); });
    h6RecordingBend bend;
    for (std::size_t b = 0; h6GetRecordingBend(recording, b, &bend); ++b) modes += bend.modes;
    REQUIRE(modes > 0);
  }
};

class Sequence {
 public:
  Sequence(std::uint64_t seed, Common& common) : random_(seed), common_(common) {}
  // Each has as many of 1024 tickets as it is cheap.
  void call() {
    struct Kind {
      unsigned tickets;
      void (Sequence::*call)();
    };
    static constexpr Kind kinds[] = {
        {2, &Sequence::check_field},    {1, &Sequence::open_recording},
        {1, &Sequence::read_frames},    {1, &Sequence::read_bends},
        {4, &Sequence::finish},         {4, &Sequence::write_field},
        {4, &Sequence::write_shell},    {4, &Sequence::bake_shell},
        {6, &Sequence::read_scene},     {8, &Sequence::read_field},
        {12, &Sequence::bake_field},    {16, &Sequence::read_shell},
        {16, &Sequence::read_mesh},     {24, &Sequence::make_recorder},
        {80, &Sequence::let_go},        {120, &Sequence::look_at_scene},
        {120, &Sequence::make_mesh},    {120, &Sequence::parse_mesh},
        {120, &Sequence::look_at_mesh}, {120, &Sequence::look_at_recording},
        {120, &Sequence::record},       {121, &Sequence::record_bends}};
    unsigned ticket = random_() % 1024;
    for (const Kind& kind : kinds) {
      if (ticket < kind.tickets) return (this->*kind.call)();
      ticket -= kind.tickets;
    }
    FAIL("there are fewer than 1024 tickets");
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
  // Each refusal says why, and what succeeds says nothing.
  bool judged(const char* function, bool done, const h6Error& error) {
    CAPTURE(function);
    REQUIRE(done == (error.message[0] == 0));
    REQUIRE(done == (error.code == H6_NO_ERROR));
    ++(done ? common_.tally[function].done : common_.tally[function].failed);
    return done;
  }
  template <class Handle, class T>
  void keep(const char* function, Handle& kept, T* made, const h6Error& error) {
    if (judged(function, made != nullptr, error)) kept = Handle(made);
  }
  // An object of this sequence, which may be none, or one that all have.
  template <class Handle>
  auto* any(const Handle& own, const Handle& of_all) {
    return rarely() ? nullptr : random_() % 2 ? of_all.get() : own.get();
  }
  h6Mesh* any_mesh() { return any(mesh_, common_.mesh); }
  h6Field* any_field() { return any(field_, common_.field); }
  h6Shell* any_shell() { return any(shell_, common_.shell); }
  h6Recording* any_recording() { return any(recording_, common_.recording); }
  h6Scene* any_scene() { return any(scene_, random_() % 2 ? common_.scene : common_.bending); }

  void make_mesh() {
    std::vector<double> at(kCorners, kCorners + 12);
    at[random_() % 12] = number(0.01);
    std::vector<std::uint32_t> faces(kFaces, kFaces + 12);
    if (rarely()) faces[random_() % 12] = static_cast<std::uint32_t>(random_());
    const std::int32_t parts[4] = {0, 1, rarely() ? index() : 0, 1};
    h6MeshDef def = h6DefaultMeshDef();
    def.vertices = rarely() ? nullptr : at.data(), def.vertex_count = rarely() ? 0 : 4;
    def.triangles = rarely() ? nullptr : faces.data(), def.triangle_count = random_() % 5;
    def.part = random_() % 2 ? parts : nullptr;
    if (rarely()) def.reserved[0] = 1;
    h6Error error{};
    keep("h6CreateMesh", mesh_, h6CreateMesh(rarely() ? nullptr : &def, &error), error);
  }
  void parse_mesh() {
    std::string text = "v 0 0 0\nv 0.01 0 0\nv 0 0.01 0\nv 0 0 0.01\n";
    text += "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
    if (random_() % 2) text[random_() % text.size()] = static_cast<char>(random_());
    const char* names[] = {"a.obj", "a.obj", "a.stl", "a.ply", "a.glb", "a", "", nullptr};
    const std::size_t size = random_() % 2 ? text.size() : random_() % text.size();
    h6Error error{};
    keep("h6ParseMesh", mesh_,
         h6ParseMesh(rarely() ? nullptr : text.data(), size, names[random_() % 8],
                     static_cast<h6Unit>(index()), &error),
         error);
  }
  void look_at_mesh() {
    h6MeshInfo info;
    const h6Mesh* mesh = any_mesh();
    h6GetMesh(mesh, rarely() ? nullptr : &info);
    h6GetMesh(mesh, &info);
    REQUIRE(std::isfinite(info.volume + info.low.x + info.high.z));
    (void)h6GetPartName(mesh, index());
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
    keep("h6BakeField", field_, h6BakeField(any_mesh(), rarely() ? nullptr : &def, &error), error);
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
    keep("h6BakeShell", shell_, h6BakeShell(any_mesh(), rarely() ? nullptr : &def, &error), error);
    h6ShellDef out;
    h6GetShell(shell_, &out);
  }
  // A file of the right kind, of another kind, one that is not there, or a folder.
  std::string some_file(const char* right) {
    const char* names[] = {right,    right,      "any.vdb",  "any.ply",
                           "any.h5", "none.obj", "no/a.vdb", ""};
    return place(names[random_() % 8]);
  }
  void write_field() {
    h6Error error{};
    const std::string file = place("any.vdb");
    judged("h6WriteField", h6WriteField(any_field(), rarely() ? nullptr : file.c_str(), &error),
           error);
  }
  void write_shell() {
    h6Error error{};
    const std::string file = place("any.ply");
    judged("h6WriteShell", h6WriteShell(any_shell(), rarely() ? nullptr : file.c_str(), &error),
           error);
  }
  void read_field() {
    const std::string file = some_file("any.vdb");
    h6Error error{};
    keep("h6ReadField", field_, h6ReadField(rarely() ? nullptr : file.c_str(), &error), error);
  }
  void read_shell() {
    const std::string file = some_file("any.ply");
    h6Error error{};
    keep("h6ReadShell", shell_, h6ReadShell(rarely() ? nullptr : file.c_str(), &error), error);
  }
  // A shell's file is a mesh without triangles.
  void read_mesh() {
    const std::string file = some_file("any.obj");
    h6Error error{};
    keep("h6ReadMesh", mesh_,
         h6ReadMesh(rarely() ? nullptr : file.c_str(), static_cast<h6Unit>(index()), &error),
         error);
  }
  void check_field() {
    h6CheckDef def = h6DefaultCheckDef();
    def.points = rarely() ? count(50) : 50, def.push = false, def.threads = 1;
    def.stiffness = number(1e4);
    h6CheckReport report{};
    h6Error error{};
    const bool done = h6CheckField(any_mesh(), any_field(), rarely() ? nullptr : &def,
                                   rarely() ? nullptr : &report, &error);
    if (!judged("h6CheckField", done, error)) return;
    REQUIRE(std::isfinite(report.worst_node + report.worst_between + report.wall_median));
  }
  void read_scene() {
    const char* names[] = {"box-on-wall", "box-on-wall", "no-such-scene", "", "any.json", nullptr};
    h6SceneDef def = h6DefaultSceneDef();
    if (rarely()) def.reserved[0] = 1;
    if (rarely()) def.progress = [](void*, const char*, double) { return false; };
    def.outside = random_() % 2;
    h6Error error{};
    keep("h6ReadScene", scene_,
         h6ReadScene(names[random_() % 6], rarely() ? nullptr : &def, &error), error);
  }
  void look_at_scene() {
    const h6Scene* scene = any_scene();
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
    const h6Scene* const scene = any_scene();
    h6SessionDef session;
    h6GetSceneSession(random_() % 4 ? scene : nullptr, &session);
    def.scene = random_() % 4 ? scene : nullptr;
    if (rarely()) session.rate = number(1000);
    def.session = random_() % 4 ? nullptr : &session;
    def.virtual_time = random_() % 2, def.program = rarely() ? "odd \"\n\x01 name" : nullptr;
    if (rarely()) def.reserved[0] = 1;
    h6Error error{};
    keep("h6CreateRecorder", recorder_,
         h6CreateRecorder(rarely() ? nullptr : some_file("any.h5").c_str(),
                          rarely() ? nullptr : &def, &error),
         error);
  }
  std::vector<h6FrameRecord> some_rows() {
    std::vector<h6FrameRecord> rows(2);
    for (h6FrameRecord& row : rows) {
      row.time = number(0.001), row.report.frame = random_() % 8;
      row.hand[0] = h6DefaultDeviceSample(), row.hand[0].pose.p.x = number(1);
      row.command[0].wrench.force.z = number(1);
      row.command[0].cause = static_cast<h6Cause>(index());
      row.state[0] = static_cast<h6DeviceState>(index());
      row.inputs_only = rarely(), row.settings = rarely() ? 7 : 0;
    }
    return rows;
  }
  void record() {
    const std::vector<h6FrameRecord> rows = some_rows();
    h6Error error{};
    judged("h6RecordFrames",
           h6RecordFrames(rarely() ? nullptr : recorder_.get(), rarely() ? nullptr : rows.data(),
                          random_() % 3, &error),
           error);
  }
  void record_bends() {
    const std::vector<h6FrameRecord> rows = some_rows();
    std::vector<double> q(2 * common_.modes);
    for (double& value : q) value = number(1e-3);
    const std::size_t modes = random_() % 4 ? common_.modes : count(0);
    h6Error error{};
    judged("h6RecordFramesWithBends",
           h6RecordFramesWithBends(rarely() ? nullptr : recorder_.get(), rows.data(), random_() % 3,
                                   rarely() ? nullptr : q.data(), modes, &error),
           error);
  }
  void finish() {
    const char* summaries[] = {nullptr, "{}", "{\"a\": 1}", "[1]", "{", "\xff", ""};
    h6Error error{};
    judged("h6FinishRecorder",
           h6FinishRecorder(rarely() ? nullptr : recorder_.get(), summaries[random_() % 7], &error),
           error);
  }
  void open_recording() {
    const std::string file = some_file("any.h5");
    h6Error error{};
    keep("h6ReadRecording", recording_, h6ReadRecording(rarely() ? nullptr : file.c_str(), &error),
         error);
  }
  void look_at_recording() {
    const h6Recording* const recording = any_recording();
    h6RecordingInfo info{};
    h6GetRecording(recording, rarely() ? nullptr : &info);
    REQUIRE(std::isfinite(info.rate));
    h6RecordingEvent event{};
    (void)h6GetRecordingEvent(recording, rarely() ? SIZE_MAX : random_() % 3,
                              rarely() ? nullptr : &event);
    h6RecordingBend bend{};
    const std::size_t odd = rarely() ? SIZE_MAX : random_() % 3;
    if (h6GetRecordingBend(recording, odd, rarely() ? nullptr : &bend))
      REQUIRE((bend.name && bend.modes > 0 && bend.modes <= H6_MAX_MODES));
  }
  void read_frames() {
    h6FrameRecord rows[3];
    h6Error error{};
    const std::uint64_t first = rarely() ? random_() : random_() % 4;
    const std::int64_t n = h6GetRecordingFrames(any_recording(), first, rarely() ? nullptr : rows,
                                                random_() % 4, &error);
    REQUIRE((n >= -1 && n <= 3));
    judged("h6GetRecordingFrames", n >= 0, error);
  }
  void read_bends() {
    h6Recording* const recording = any_recording();
    std::size_t modes = 0;
    h6RecordingBend bend;
    for (std::size_t b = 0; h6GetRecordingBend(recording, b, &bend); ++b) modes += bend.modes;
    std::vector<double> q(3 * modes + 1);
    h6Error error{};
    const std::uint64_t first = rarely() ? random_() : random_() % 4;
    const std::int64_t n =
        h6GetRecordingBends(recording, first, rarely() ? nullptr : q.data(), random_() % 4, &error);
    REQUIRE((n >= -1 && n <= 3));
    judged("h6GetRecordingBends", n >= 0, error);
  }
  void let_go() {
    switch (random_() % 6) {
      case 0:
        return void(mesh_ = {});
      case 1:
        return void(field_ = {});
      case 2:
        return void(shell_ = {});
      case 3:
        return void(scene_ = {});
      case 4:
        return void(recorder_ = {});
      default:
        return void(recording_ = {});
    }
  }

  std::mt19937_64 random_;
  Common& common_;
  hapsix::Mesh mesh_;
  hapsix::Field field_;
  hapsix::Shell shell_;
  hapsix::Scene scene_;
  hapsix::Recorder recorder_;
  hapsix::Recording recording_;
};

}  // namespace

TEST_CASE("any sequence of calls of io.h with any arguments has a defined result") {
  Common common;
  std::ofstream(place("any.obj")) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  h6::test::run_sequences<Sequence>(common, h6::test::kSanitized ? 100 : 2000, 1000, 18);
}
