// SPDX-License-Identifier: Apache-2.0
// On a user's mistake the program ends soon with the right exit code and one sentence that says
// what is wrong and where. It leaves no file behind.
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "tests/io/cli/program.h"
#include "tests/support/sanitized.h"

using namespace h6::test;

namespace {

constexpr double kSlower = kSanitized ? 15 : 1;

// Checks what must hold for every mistake. The sentence must contain `words`.
void check_refusal(const Ended& ended, int code, const std::vector<std::string>& words) {
  CAPTURE(ended.err);
  REQUIRE(ended.in_time);
  CHECK(ended.code == code);
  CHECK(ended.cpu_seconds < 1 * kSlower);
  CHECK(ended.err.size() < 1000);
  CHECK(ended.err.find("hapsix: ") != std::string::npos);
  for (const std::string& word : words) {
    CAPTURE(word);
    CHECK(ended.err.find(word) != std::string::npos);
  }
}

// Checks one run without --json.
void refused(Sandbox& box, const Args& args, int code, const std::vector<std::string>& words) {
  CAPTURE(args.back());
  const std::set<std::string> before = box.files();
  const Ended ended = run(box, args);
  check_refusal(ended, code, words);
  CHECK(ended.out.empty());
  CHECK(box.files() == before);
}

// Checks a run without --json and one with it.
void mistake(Sandbox& box, Args args, int code, const std::vector<std::string>& words) {
  std::string line;
  for (const std::string& a : args) line += " " + a.substr(0, 60);
  CAPTURE(line);
  const std::set<std::string> before = box.files();
  Process plain(box, args);
  args.push_back("--json");
  Process with_json(box, args);
  Ended ended = plain.wait();
  check_refusal(ended, code, words);
  CHECK(ended.out.empty());
  ended = with_json.wait();
  check_refusal(ended, code, words);
  const Json object = one_object(ended);
  CHECK(object.size() == 1);
  const std::string sentence = object.value("error", "");
  CHECK(ended.err.find(sentence + "\n") != std::string::npos);
  CHECK(sentence.size() > 15);
  CHECK(sentence.back() != '.');
  CHECK(box.files() == before);
}

// Both bakes and info refuse a mesh for the same reason.
void bad_mesh(Sandbox& box, const std::string& file, std::vector<std::string> words) {
  words.push_back(file);
  mistake(box, {"bake", "field", file, "-o", "out.vdb", "--voxels", "32"}, 1, words);
  refused(box, {"bake", "shell", file, "-o", "out.ply", "--points", "100"}, 1, words);
  refused(box, {"info", file}, 1, words);
}

// The smallest scene that runs; `patch` is merged into it (RFC 7386).
Json small_scene(const Json& patch = Json::object()) {
  Json scene = Json::parse(R"({"hapsix": 1, "units": "mm",
    "bodies": [
      {"name": "block", "fixed": true, "field": {"mesh": "block.stl", "voxels": 32}},
      {"name": "tool", "mass": 0.1, "shell": {"mesh": "block.stl", "points": 100}}],
    "hands": [{"body": "tool", "device": "path", "path": "hand.csv"}]})");
  scene.merge_patch(patch);
  return scene;
}
const char* const kHand = "t,x,y,z,qw,qx,qy,qz\n0,0,0,50,1,0,0,0\n1,0,0,49,1,0,0,0\n";

std::string garbage(std::size_t bytes) {
  std::string text(bytes, '\0');
  std::uint64_t state = 1;
  for (std::size_t i = 0; i + 8 <= bytes; i += 8) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    std::memcpy(text.data() + i, &state, 8);
  }
  return text;
}

}  // namespace

TEST_CASE(
    "a mesh that is missing, empty, renamed, truncated, not finite or without triangles is named") {
  Sandbox box;
  const std::string whole = stl(box_facets(0.1f));
  std::vector<Facet> broken = box_facets(0.1f);
  broken[3][1][2] = std::numeric_limits<float>::quiet_NaN();
  spill(box.file("empty.stl"), "");
  spill(box.file("letter.stl"), "Dear reader,\nthis is a letter.\n");
  spill(box.file("cut.stl"), whole.substr(0, 300));
  spill(box.file("nan.stl"), stl(broken));
  spill(box.file("none.stl"), stl({}));
  fs::create_directory(box.file("folder.stl"));
  REQUIRE(mkfifo(box.file("pipe.stl").c_str(), 0600) == 0);

  bad_mesh(box, "missing.stl", {"no such file"});
  bad_mesh(box, "empty.stl", {"empty"});
  bad_mesh(box, "letter.stl", {"text"});
  bad_mesh(box, "cut.stl", {"byte 300", "12 triangles"});
  bad_mesh(box, "nan.stl", {"triangle 4", "not finite"});
  bad_mesh(box, "none.stl", {"no triangle"});
  bad_mesh(box, "folder.stl", {"folder"});
  bad_mesh(box, "pipe.stl", {"not a regular file"});  // reading it would wait for ever
}

TEST_CASE("a hundred megabytes of garbage are refused under any name") {
  Sandbox box;
  spill(box.file("garbage.stl"), garbage(100'000'000));
  for (const char* ending : {"obj", "ply", "stl.gz", "vdb", "h5", "json", "csv"})
    fs::create_hard_link(box.file("garbage.stl"), box.file(std::string("garbage.") + ending));
  bad_mesh(box, "garbage.stl", {});
  for (const char* ending : {"obj", "ply", "stl.gz", "vdb", "h5", "json", "csv"})
    mistake(box, {"info", std::string("garbage.") + ending}, 1, {std::string("garbage.") + ending});
  mistake(box, {"run", "garbage.json"}, 1, {"garbage.json"});
}

TEST_CASE("options out of range are wrong usage, told before the mesh is read") {
  Sandbox box;
  spill(box.file("box.stl"), stl(box_facets(0.1f)));
  const Args field{"bake", "field", "missing.stl", "-o", "out.vdb"};
  const Args shell{"bake", "shell", "missing.stl", "-o", "out.ply"};
  const auto with = [](Args args, const std::string& option, const std::string& value) {
    args.push_back(option), args.push_back(value);
    return args;
  };
  for (const char* size : {"-1", "0", "nan", "large"})
    refused(box, with(field, "--voxel-size", size), 2, {"--voxel-size", size, "above 0"});
  for (const char* n : {"3", "100000", "64.5", "99999999999999999999"})
    refused(box, with(field, "--voxels", n), 2, {"--voxels", n, "16 to 2048"});
  refused(box, with(field, "--offset", "-1"), 2, {"--offset", "-1"});
  for (const char* n : {"0", "1e3"}) refused(box, with(shell, "--points", n), 2, {"--points", n});
  refused(box, with(shell, "--spacing", "0"), 2, {"--spacing", "above 0"});
  refused(box, with(shell, "--levels", "17"), 2, {"--levels", "1 to 16"});
  refused(box, with(field, "--units", "furlong"), 2, {"--units", "furlong", "m, mm, cm or in"});
  refused(box, with(field, "--sign", "maybe"), 2, {"--sign", "auto, flood or winding"});
  refused(box, with(field, "--threads", "-1"), 2, {"--threads"});
  refused(box, with(with(field, "--voxels", "64"), "--voxel-size", "1"), 2,
          {"--voxels", "--voxel-size"});
  for (const char* s : {"0", "nan", "1e300"})
    refused(box, {"run", "box-on-wall", "--duration", s}, 2, {"--duration", s});
  refused(box, {"run", "box-on-wall", "--threads", "65"}, 2, {"--threads", "1 to 64"});

  // Sizes in range that would take gigabytes for this mesh.
  mistake(box, {"bake", "field", "box.stl", "-o", "out.vdb", "--voxel-size", "1e-9"}, 1,
          {"box.stl", "2048"});
  mistake(box, {"bake", "shell", "box.stl", "-o", "out.ply", "--spacing", "1e-9"}, 1,
          {"box.stl", "spacing"});
}

TEST_CASE("a part of sixty metres is not baked before somebody states its unit") {
  Sandbox box;
  spill(box.file("large.stl"), stl(box_facets(60)));
  const Args field{"bake", "field", "large.stl", "--voxels", "32", "-o", "out.vdb"};
  mistake(box, field, 1, {"large.stl", "60 m across", "--units mm", "--units m"});
  mistake(box, {"bake", "shell", "large.stl", "--points", "100", "-o", "out.ply"}, 1,
          {"60 m across", "--units m"});
  mistake(box, {"check", "large.stl"}, 1, {"60 m across", "--units m"});
  for (const char* unit : {"mm", "m"}) {
    Args stated = field;
    stated.push_back("--units"), stated.push_back(unit);
    result_of(box, stated);
  }
  Json scene = Json::parse(R"({"hapsix": 1, "bodies": [{"name": "part", "fixed": true,
      "field": {"mesh": "large.stl", "voxels": 32}}]})");
  spill(box.file("scene.json"), scene.dump());
  mistake(box, {"run", "scene.json", "--virtual-time", "--duration", "0.01"}, 1,
          {"60 m across", "units"});
  scene["units"] = "m";
  spill(box.file("scene.json"), scene.dump());
  CHECK(run(box, {"run", "scene.json", "--virtual-time", "--duration", "0.01"}).code == 0);
}

TEST_CASE("a file that cannot be written is told before the bake, and no input is overwritten") {
  Sandbox box;
  spill(box.file("box.stl"), stl(box_facets(0.1f)));
  fs::create_directories(box.file("folder.vdb"));
  fs::create_directories(box.file("folder.h5"));
  spill(box.file("note.h5"), "not a recording");
  const Args field{"bake", "field", "box.stl", "--voxels", "32", "-o"};
  const auto to = [](Args args, const char* out) {
    args.push_back(out);
    return args;
  };
  mistake(box, to(field, "nowhere/out.vdb"), 1, {"nowhere", "does not exist"});
  mistake(box, to(field, "folder.vdb"), 1, {"folder.vdb", "folder"});
  mistake(box, to(field, "box.stl"), 2, {"box.stl", ".vdb"});
  mistake(box, to(field, ".vdb"), 2, {".vdb"});
  mistake(box, to({"run", "box-on-wall", "--virtual-time", "--record"}, "nowhere/r.h5"), 1,
          {"nowhere"});
  mistake(box, to({"run", "box-on-wall", "--virtual-time", "--record"}, "folder.h5"), 1,
          {"folder.h5"});
  mistake(box, to({"run", "box-on-wall", "--virtual-time", "--record"}, "box.stl"), 2, {".h5"});
  mistake(box, to({"run", "box-on-wall", "--virtual-time", "--record"}, "note.h5"), 1, {"note.h5"});
  CHECK(slurp(box.file("note.h5")) == "not a recording");
  mistake(box, {"scene", "export", "box-on-wall", "box.stl"}, 1, {"box.stl"});
  mistake(box, {"demo", "--virtual-time", "-o", "box.stl"}, 1, {"box.stl"});

  // The shell must not overwrite its own mesh.
  spill(box.file("mesh.ply"),
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
        "float z\n"
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 "
        "0\n3 0 1 2\n");
  const std::string mesh = slurp(box.file("mesh.ply"));
  mistake(box, {"bake", "shell", "mesh.ply", "-o", "./mesh.ply"}, 1,
          {"mesh.ply", "the mesh itself"});
  CHECK(slurp(box.file("mesh.ply")) == mesh);
}

TEST_CASE(
    "words that are no command, option, method, device or scene are named, with what is near") {
  Sandbox box;
  mistake(box, {}, 2, {"bake", "run", "info"});
  mistake(box, {"bake"}, 2, {"field, shell or deformable"});
  refused(box, {"scene"}, 2, {"list or export"});
  mistake(box, {"bok"}, 2, {"'bok'", "'bake'"});
  refused(box, {"bake", "feld"}, 2, {"'feld'", "'field'"});
  refused(box, {"--frobnicate"}, 2, {"'--frobnicate'"});
  refused(box, {"run", "--frobnicate"}, 2, {"'--frobnicate'", "hapsix run --help"});
  mistake(box, {"run", "box-on-wall", "--metod", "robust"}, 2, {"'--metod'", "'--method'"});
  mistake(box, {"run"}, 2, {"SCENE", "hapsix run --help"});
  refused(box, {"bake", "field", "box.stl"}, 2, {"--output"});
  refused(box, {"run", "box-on-wall", "peg-in-hole"}, 2, {"'peg-in-hole'", "too many"});
  refused(box, {"info"}, 2, {"FILE"});
  mistake(box, {"run", "box-on-wall", "--method", "gauss7"}, 2, {"'gauss7'", "gauss6"});
  refused(box, {"run", "box-on-wall", "--device", "falcon"}, 2, {"'falcon'", "path"});
  mistake(box, {"run", "box-on-wal"}, 2, {"'box-on-wal'", "'box-on-wall'"});
  mistake(box, {"scene", "export", "teapot", "folder"}, 2, {"teapot", "box-on-wall"});
  refused(box, {"demo", "--scene", "teapot"}, 2, {"teapot"});
}

TEST_CASE("a mistake in a scene names file and place") {
  Sandbox box;
  spill(box.file("block.stl"), stl(box_facets(10)));
  spill(box.file("hand.csv"), kHand);
  const auto scene = [&](const Json& json, const std::vector<std::string>& words, int code = 1) {
    spill(box.file("scene.json"), json.dump(1));
    std::vector<std::string> all = words;
    all.push_back("scene.json");
    mistake(box, {"run", "scene.json", "--virtual-time"}, code, all);
  };
  spill(box.file("scene.json"), small_scene().dump());
  REQUIRE(run(box, {"run", "scene.json", "--virtual-time"}).code == 0);  // the scene itself is good

  scene(small_scene({{"contact", {{"stifness", 1}}}}), {"contact.stifness", "stiffness"});
  Json deep = small_scene();
  deep["bodies"][1]["shell"]["point"] = 3;
  scene(deep, {"bodies[1].shell.point", "points"});
  deep = small_scene();
  deep["bodies"][0]["field"]["mesh"] = "gone.stl";
  scene(deep, {"gone.stl"});
  deep = small_scene();
  deep["hands"][0]["body"] = "nobody";
  scene(deep, {"hands[0].body", "nobody"});
  deep = small_scene();
  deep["hands"][0]["device"] = "falcon";
  scene(deep, {"falcon", "tool"});
  scene(small_scene({{"contact", {{"method", "gauss7"}}}}), {"contact.method", "gauss7"});
  scene(small_scene({{"rate", "fast"}}), {"rate"});

  spill(box.file("hand.csv"), "t,x,y,z,qw,qx,qy,qz\n0,0,0,50,1,0,0,0\n1,0,0,50,1,0,zero,0\n");
  spill(box.file("scene.json"), small_scene().dump());
  mistake(box, {"run", "scene.json"}, 1, {"hand.csv:3"});
  mistake(box, {"info", "hand.csv"}, 1, {"hand.csv:3"});

  spill(box.file("scene.json"), "{\n \"hapsix\": 1,\n \"units\": mm\n}");
  mistake(box, {"run", "scene.json"}, 1, {"scene.json", "line 3"});
  spill(box.file("scene.json"), std::string(5'000'000, '['));
  mistake(box, {"run", "scene.json"}, 1, {"scene.json", "nested"});
  std::string objects;
  for (int i = 0; i < 1'000'000; ++i) objects += "{\"a\":";
  spill(box.file("scene.json"), objects);
  mistake(box, {"info", "scene.json"}, 1, {"scene.json", "nested"});
  mistake(box, {"run", "gone.json"}, 1, {"gone.json", "no such file"});
  mistake(box, {"run", "."}, 1, {"folder"});
}

TEST_CASE("a folder that has the name of a generated scene does not hide the scene") {
  Sandbox box;
  fs::create_directories(box.file("box-on-wall"));
  const Ended ended = run(box, {"run", "box-on-wall", "--virtual-time", "--duration", "0.01"});
  CAPTURE(ended.err);
  CHECK(ended.code == 0);
}

TEST_CASE("a result that cannot be written is a failure") {
  Sandbox box;
  if (!fs::exists("/dev/full")) {
    MESSAGE("skipped: no /dev/full");
    return;
  }
  // The shell must redirect stdout, because Process sends it to a file of its own.
  const std::string command =
      std::string("'") + HAPSIX_PROGRAM + "' scene list > /dev/full 2> " + box.file("err").string();
  const int status = std::system(command.c_str());
  CHECK(WEXITSTATUS(status) == 1);
  CHECK(slurp(box.file("err")).find("cannot be written") != std::string::npos);
}
