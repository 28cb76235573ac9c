// SPDX-License-Identifier: Apache-2.0
// scene_export_test.cpp - scenes written as files, and the schema of scene files.
#include <doctest/doctest.h>
#include "tests/support/near.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <string>
#include <vector>

#include "io/mesh/mesh_file.h"
#include "io/scenes/scenes.h"
#include "io/shell/shell_file.h"
#include "tests/io/scene/scene_samples.h"

using namespace h6;
using namespace h6::io;

// ---- export ------------------------------------------------------------------------------------

TEST_CASE("every generated scene, exported and read back, is the same scene") {
  for (const SceneName& entry : scene_names()) {
    // Their soups make files of 25 and 90 MB; industrial_scenes_test.cpp exports them.
    if (entry.name == "engine-bay" || entry.name == "landing-gear") continue;
    CAPTURE(entry.name);
    const Folder folder;
    const Scene made = *make_scene(entry.name);
    const Outcome done = export_scene(made, folder.path / "out");
    REQUIRE_MESSAGE(done, done.error());
    const Result<Scene> back = read_scene(folder.path / "out" / "scene.json");
    REQUIRE_MESSAGE(back, back.error());
    check_same(made, *back);
    for (std::size_t i = 0; i < made.bodies.size(); ++i) {
      const SceneBody &a = made.bodies[i], &b = back->bodies[i];
      if (a.field) {
        const Result<Mesh> mesh = read_mesh(b.field->mesh, b.field->unit.value_or(back->unit));
        REQUIRE_MESSAGE(mesh, mesh.error());
        const MeshAudit x = audit(*a.field->mesh_data), y = audit(*mesh);
        CHECK(x.triangles == y.triangles);
        CHECK(x.vertices == y.vertices);
        CHECK(y.closed);
        CHECK(x.volume == h6::test::near(y.volume).epsilon(1e-5));
        CHECK(x.high.z == h6::test::near(y.high.z).epsilon(1e-6));
      }
      if (a.shell && a.shell->points) {
        const Result<ShellData> shell = read_shell(b.shell->file);
        REQUIRE_MESSAGE(shell, shell.error());
        auto points = [](const auto& c) {
          std::vector<std::array<float, 6>> out;
          for (std::size_t k = 0; k < c.x.size(); ++k)
            out.push_back({c.x[k], c.y[k], c.z[k], c.nx[k], c.ny[k], c.nz[k]});
          std::sort(out.begin(), out.end());
          return out;
        };
        CHECK(points(*a.shell->points) == points(*shell));
      }
    }
  }
}

TEST_CASE(
    "a scene that was read from files, exported elsewhere, is the same scene with its files") {
  const Bench bench;
  const Result<Scene> scene = bench.read(full_scene());
  REQUIRE(scene);
  const fs::path out = bench.path / "a" / "b";
  const Outcome done = export_scene(*scene, out);
  REQUIRE_MESSAGE(done, done.error());
  const Result<Scene> back = read_scene(out / "scene.json");
  REQUIRE_MESSAGE(back, back.error());
  check_same(*scene, *back);
  CHECK(back->bodies[0].field->unit == Unit::in);
  CHECK(text_of(back->bodies[0].field->mesh) == "not read here");
  CHECK(back->bodies[0].field->mesh.parent_path() == out);
  // An export onto itself changes nothing.
  const std::string before = text_of(out / "scene.json");
  REQUIRE(export_scene(*back, out));
  CHECK(text_of(out / "scene.json") == before);
  CHECK(text_of(out / "bay.stl") == "not read here");
}

TEST_CASE("bodies with awkward or equal file names do not write over each other") {
  const Folder folder;
  Scene scene = *make_scene("box-on-wall");
  scene.bodies[0].name = "../a b";
  scene.bodies[1].name = "..!a?b";
  scene.hands[0].body = scene.bodies[1].name;
  SceneBody third = scene.bodies[0];
  third.name = "third";
  third.field->mesh_data->vertices[0].x -= 0.001;
  SceneBody fourth = scene.bodies[0];  // the same mesh, which must not be written twice
  fourth.name = "fourth";
  scene.bodies.push_back(third);
  scene.bodies.push_back(fourth);
  REQUIRE(export_scene(scene, folder.path / "out"));
  const Result<Scene> back = read_scene(folder.path / "out" / "scene.json");
  REQUIRE_MESSAGE(back, back.error());
  check_same(scene, *back);
  CHECK(back->bodies[0].field->mesh != back->bodies[2].field->mesh);
  CHECK(back->bodies[0].field->mesh == back->bodies[3].field->mesh);
  std::size_t files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder.path))
    files += entry.is_regular_file();
  CHECK(files == 5);  // scene.json, two meshes, one shell, one path, nothing outside
}

TEST_CASE("an export that cannot be written is one sentence and leaves no scene file") {
  const Folder folder;
  folder.write("taken", "a file");
  const Outcome done = export_scene(*make_scene("box-on-wall"), folder.path / "taken" / "in");
  REQUIRE(!done);
  CHECK(says(done.error(), "taken"));
  CHECK(text_of(folder.path / "taken") == "a file");
  Scene broken = *make_scene("box-on-wall");
  broken.bodies[1].shell->points->nx.pop_back();  // columns of unequal length
  const Outcome refused = export_scene(broken, folder.path / "out");
  CHECK(!refused);
  CHECK(!fs::exists(folder.path / "out" / "scene.json"));
}

// ---- the schema --------------------------------------------------------------------------------

namespace {

// Calls `visit` for every object of the schema, with a JSON pointer to its place in a scene.
template <class Visit>
void each_object(const Json& schema, const std::string& pointer, Visit&& visit) {
  if (schema.contains("properties")) {
    visit(schema, pointer);
    for (const auto& [name, child] : schema["properties"].items())
      each_object(child, pointer + "/" + name, visit);
  } else if (schema.contains("items") && schema["items"].contains("properties")) {
    each_object(schema["items"], pointer + "/0", visit);
  }
}

// Turns "/bodies/0/field" into "bodies[0].field".
std::string said_path(std::string pointer) {
  std::string out;
  for (std::size_t i = 1; i < pointer.size(); ++i) {
    if (pointer[i] == '/' && i + 1 < pointer.size() && std::isdigit(pointer[i + 1])) {
      out += std::string("[") + pointer[i + 1] + "]";
      ++i;
    } else {
      out += pointer[i] == '/' ? '.' : pointer[i];
    }
  }
  return out;
}

// Collects every key of a scene with its path, without list numbers.
void keys_of(const Json& json, const std::string& at, std::vector<std::string>& out) {
  if (json.is_object())
    for (const auto& [name, child] : json.items()) {
      out.push_back(at + "/" + name);
      keys_of(child, at + "/" + name, out);
    }
  if (json.is_array())
    for (const Json& child : json) keys_of(child, at, out);
}

}  // namespace

TEST_CASE("the reader knows every key of the schema, and no key beside them") {
  const Bench bench;
  const Json schema = Json::parse(scene_schema());
  std::size_t objects = 0, keys = 0;
  each_object(schema, "", [&](const Json& object, const std::string& pointer) {
    ++objects;
    CHECK(object["additionalProperties"] == false);
    for (const auto& [name, property] : object["properties"].items()) {
      ++keys;
      CHECK(!property["description"].get<std::string>().empty());
      // No key takes this value. A known key gives an error about the value, an unknown one about
      // the key.
      for (const std::string& key : {name, name + "q"}) {
        Json json = full_scene();
        Json& place = pointer.empty() ? json : json[Json::json_pointer(pointer)];
        if (!place.is_object()) place = Json::object();
        place[key] = Json::parse("[[[]]]");
        const std::string error = bench.error(json), path = said_path(pointer + "/" + key);
        INFO(error);
        CHECK(says(error, path));
        CHECK(says(error, "no such key") == (key != name));
      }
    }
  });
  CHECK(objects == 14);
  CHECK(keys > 100);
}

TEST_CASE("the schema's required keys are those the reader misses") {
  const Bench bench;
  each_object(Json::parse(scene_schema()), "", [&](const Json& object, const std::string& pointer) {
    if (!object.contains("required")) return;
    for (const Json& name : object["required"]) {
      Json json = full_scene();
      (pointer.empty() ? json : json[Json::json_pointer(pointer)]).erase(name.get<std::string>());
      CHECK(says(bench.error(json),
                 said_path(pointer + "/" + name.get<std::string>()) + ": is missing"));
    }
  });
}

TEST_CASE("the schema's limits are the reader's") {
  const Bench bench;
  std::size_t limits = 0;
  each_object(Json::parse(scene_schema()), "", [&](const Json& object, const std::string& pointer) {
    for (const auto& [name, property] : object["properties"].items()) {
      const auto refused = [&, &n = name](const Json& value) {
        Json json = full_scene();
        json[Json::json_pointer(pointer + "/" + n)] = value;
        return says(bench.error(json), said_path(pointer + "/" + n) + ": is ");
      };
      for (const char* limit : {"minimum", "exclusiveMinimum", "maximum"}) {
        if (!property.contains(limit)) continue;
        ++limits;
        const double at = property[limit].get<double>();
        const double step =
            std::max(1.0, std::abs(at)) * (std::string(limit) == "maximum" ? 1 : -1);
        INFO(pointer << "/" << name << " " << limit << " " << at);
        CHECK(refused(at + step));
        CHECK(refused(at) == (std::string(limit) == "exclusiveMinimum"));
      }
    }
  });
  CHECK(limits > 100);
}

TEST_CASE("an export writes keys of the schema, and between them all") {
  const Bench bench;
  REQUIRE(export_scene(*bench.read(full_scene()), bench.path / "out"));
  std::vector<std::string> written, known;
  keys_of(Json::parse(text_of(bench.path / "out" / "scene.json")), "", written);
  each_object(Json::parse(scene_schema()), "", [&](const Json& object, std::string pointer) {
    for (std::size_t at; (at = pointer.find("/0")) != std::string::npos;) pointer.erase(at, 2);
    for (const auto& [name, property] : object["properties"].items())
      if (name != "bends") known.push_back(pointer + "/" + name);  // bends_test.cpp
  });
  for (auto* list : {&written, &known}) {
    std::sort(list->begin(), list->end());
    list->erase(std::unique(list->begin(), list->end()), list->end());
  }
  CHECK(written == known);
}
