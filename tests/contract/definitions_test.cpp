// SPDX-License-Identifier: Apache-2.0
// Definitions of both libraries: what their default functions give, and the refusal of words in
// `reserved` that only a later version knows. growth_test.cpp has those of sessions and loops.
#include <doctest/doctest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "hapsix/batch.h"
#include "hapsix/hapsix.hpp"
#include "hapsix/io.h"
#include "tests/io/private_cache.h"

namespace {

namespace fs = std::filesystem;

// A mesh, its field and its shell, as small as they can be.
struct Tetrahedron {
  const double at[12] = {0, 0, 0, 0.01, 0, 0, 0, 0.01, 0, 0, 0, 0.01};
  const std::uint32_t faces[12] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2};
  hapsix::Mesh mesh;
  hapsix::Field field;
  hapsix::Shell shell;
  Tetrahedron() {
    h6MeshDef def = h6DefaultMeshDef();
    def.vertices = at, def.vertex_count = 4, def.triangles = faces, def.triangle_count = 4;
    h6ShellBakeDef small = shell_bake();
    mesh = hapsix::Mesh::make([&](h6Error* e) { return h6CreateMesh(&def, e); });
    field = hapsix::Field::make([&](h6Error* e) { return h6BakeField(mesh, &small.field, e); });
    shell = hapsix::Shell::make([&](h6Error* e) { return h6BakeShell(mesh, &small, e); });
  }
  static h6ShellBakeDef shell_bake() {
    h6ShellBakeDef def = h6DefaultShellBakeDef();
    def.points = 10, def.levels = 2, def.field.voxels = 16;
    return def;
  }
};

// Whether make(&error) succeeds as `def` is, and refuses each word of `reserved` in it by name.
template <class Def, class Make>
bool refuses_words(Def& def, Make&& make) {
  h6Error error{};
  if (!make(&error)) return false;
  for (std::uint64_t& word : def.reserved) {
    word = 1, error = {};
    const bool made = make(&error);
    word = 0;
    if (made || error.code != H6_ERROR_ARGUMENT ||
        std::string(error.message).find("reserved") == std::string::npos)
      return false;
  }
  return make(nullptr);
}

}  // namespace

TEST_CASE("the default of a hand's filter is that of a hand, and passes everything unchanged") {
  const h6HandFilterDef filter = h6DefaultHandFilterDef(), of_hand = h6DefaultHandDef().filter;
  CHECK((filter.motion_scale == 1 && filter.rotation_scale == 1 && filter.force_scale == 1));
  CHECK((filter.clutch_buttons == 0 && !filter.relative));
  for (const std::uint64_t word : filter.reserved) CHECK(word == 0);
  CHECK((of_hand.motion_scale == 1 && of_hand.rotation_scale == 1 && of_hand.force_scale == 1));
  CHECK((of_hand.clutch_buttons == 0 && !of_hand.relative));
  // Unlike zeros, it makes a session.
  const Tetrahedron made;
  h6ShellDef shell;
  h6GetShell(made.shell, &shell);
  const hapsix::Model model = hapsix::create_model({}, {&shell, 1});
  h6BodyDef body = h6DefaultBodyDef();
  h6HandDef hand = h6DefaultHandDef();
  body.shell = 0;
  hand.filter = filter;
  CHECK(hapsix::create_session(model, {&body, 1}, {&hand, 1}).get() != nullptr);
  hand.filter = {};
  CHECK_THROWS_AS(hapsix::create_session(model, {&body, 1}, {&hand, 1}), hapsix::Error);
}

TEST_CASE("a word that only a later version knows is refused in a shell, and in how it bends") {
  const Tetrahedron made;
  h6ShellDef shell;
  h6GetShell(made.shell, &shell);
  h6ModelDef model = h6DefaultModelDef();
  model.shells = &shell, model.shell_count = 1;
  const auto create = [&](h6Error* error) {
    h6Model* const created = h6CreateModel(&model, error);
    h6DestroyModel(created);
    return created != nullptr;
  };
  CHECK(refuses_words(shell, create));
  const std::vector<float> modes(3 * shell.point_count, 0.1f);
  const double linear = 1e4;
  h6DeformableDef bend = h6DefaultDeformableDef();
  bend.mode_count = 1, bend.modes = modes.data(), bend.linear = &linear;
  shell.deformable = &bend;
  CHECK(refuses_words(bend, create));
}

TEST_CASE("so is one in a bake of a field or a shell, also of a shell's field, and in a check") {
  const Tetrahedron made;
  h6ShellBakeDef bake = Tetrahedron::shell_bake();
  const auto field = [&](h6Error* error) {
    return hapsix::Field(h6BakeField(made.mesh, &bake.field, error)).get() != nullptr;
  };
  const auto shell = [&](h6Error* error) {
    return hapsix::Shell(h6BakeShell(made.mesh, &bake, error)).get() != nullptr;
  };
  CHECK(refuses_words(bake.field, field));
  CHECK(refuses_words(bake, shell));
  CHECK(refuses_words(bake.field, shell));
  h6CheckDef check = h6DefaultCheckDef();
  check.points = 20, check.push = false;
  CHECK(refuses_words(check, [&](h6Error* error) {
    h6CheckReport report;
    return h6CheckField(made.mesh, made.field, &check, &report, error);
  }));
}

TEST_CASE("so is one for a scene, a recorder, its session and workers, and no file is left") {
  h6SceneDef of_scene = h6DefaultSceneDef();
  CHECK(refuses_words(of_scene, [&](h6Error* error) {
    return hapsix::Scene(h6ReadScene("box-on-wall", &of_scene, error)).get() != nullptr;
  }));
  const hapsix::Scene scene =
      hapsix::Scene::make([](h6Error* e) { return h6ReadScene("box-on-wall", nullptr, e); });
  h6SessionDef session;
  h6GetSceneSession(scene, &session);
  h6RecorderDef of_recorder = h6DefaultRecorderDef();
  of_recorder.scene = scene, of_recorder.session = &session;
  const fs::path file = h6::test::private_cache.folder / "words.h5";
  const auto record = [&](h6Error* error) {
    const bool made =
        hapsix::Recorder(h6CreateRecorder(file.c_str(), &of_recorder, error)).get() != nullptr;
    if (!made) CHECK_FALSE((fs::exists(file) || fs::exists(file.string() + ".part")));
    return made;
  };
  CHECK(refuses_words(of_recorder, record));
  CHECK(refuses_words(session, record));
  h6WorkersDef crew = h6DefaultWorkersDef();
  crew.threads = 1;
  CHECK(refuses_words(crew, [&](h6Error* error) {
    return hapsix::Workers(h6CreateWorkers(&crew, error)).get() != nullptr;
  }));
}
