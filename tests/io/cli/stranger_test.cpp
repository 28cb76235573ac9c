// SPDX-License-Identifier: Apache-2.0
// Files from strangers and machines without room: what the program shows, reads and says.
#include "tests/io/cli/program.h"

using namespace h6::test;

namespace {

Json scene() {
  return Json::parse(R"({"hapsix": 1, "units": "mm",
    "bodies": [
      {"name": "block", "fixed": true, "field": {"mesh": "block.stl", "voxels": 32}},
      {"name": "tool", "mass": 0.1, "shell": {"mesh": "tool.stl", "points": 200},
       "pose": {"p": [0, 0, 30]}}],
    "hands": [{"body": "tool", "path": "hand.csv"}]})");
}

void meshes(const fs::path& folder) {
  spill(folder / "block.stl", stl(box_facets(20)));
  spill(folder / "tool.stl", stl(sphere_facets(5, 8)));
  spill(folder / "hand.csv", "0,0,0,30,1,0,0,0\n0.05,0,0,30,1,0,0,0\n");
}

bool obeyed_by_a_terminal(const std::string& text) {
  for (const char c : text)
    if ((static_cast<unsigned char>(c) < 0x20 && c != '\n' && c != '\t') || c == 0x7f) return true;
  return text.find("\xc2\x9b") != text.npos || text.find("\xe2\x80\xae") != text.npos;
}

}  // namespace

TEST_CASE("control characters in names are shown escaped") {
  Sandbox box;
  meshes(box.folder());
  const std::string evil =
      "\x1b]0;owned\x07\x1b[2J\r\xc2\x9b"
      "31m\xe2\x80\xae"
      "x\x7f";
  Json file = scene();
  file["name"] = evil;
  file["bodies"][0]["name"] = evil;
  spill(box.file("scene.json"), file.dump());
  file["hands"][0]["body"] = evil + "else";
  spill(box.file("wrong.json"), file.dump());
  file["bodies"][0]["field"]["mesh"] = evil + ".stl";
  spill(box.file("gone.json"), file.dump());
  for (const Args& args : {Args{"info", "scene.json"}, Args{"check", "scene.json"},
                           Args{"run", "scene.json", "--virtual-time"}, Args{"run", "wrong.json"},
                           Args{"run", "gone.json"}, Args{"run", evil}, Args{"info", evil + ".stl"},
                           Args{"run", "--" + evil}}) {
    const Ended ended = run(box, args);
    CAPTURE(args[0] + " " + args[1]);
    CHECK_FALSE(obeyed_by_a_terminal(ended.out));
    CHECK_FALSE(obeyed_by_a_terminal(ended.err));
    // Scenes with such names are refused, so only what the user typed is quoted.
    if (args[1].find(evil) != std::string::npos)
      CHECK((ended.out + ended.err).find("\\x1b]0;owned\\x07") != std::string::npos);
  }
}

TEST_CASE("letters of every script are shown as they are") {
  Sandbox box;
  const Ended ended = run(box, {"run", "Größe-部品-деталь-🔧.json"});
  CHECK(ended.err.find("Größe-部品-деталь-🔧") != std::string::npos);
}

TEST_CASE("a scene reads no file outside its folder unless it is trusted") {
  Sandbox box;
  fs::create_directory(box.file("scene"));
  meshes(box.file("scene")), meshes(box.folder());
  fs::create_symlink(box.file("block.stl"), box.file("scene") / "link.stl");
  fs::create_directory(box.file("scene") / "sub");
  fs::copy_file(box.file("block.stl"), box.file("scene") / "sub" / "block.stl");
  const std::string there = box.file("scene") / "scene.json";
  spill(box.file("secret.txt"), "hold 0.05\n");
  const auto with = [&](const char* where, const std::string& name) {
    Json file = scene();
    file[Json::json_pointer(where)] = name;
    spill(there, file.dump());
  };
  const char* const mesh = "/bodies/0/field/mesh";
  for (const std::string& name :
       {std::string("block.stl"), std::string("sub/../block.stl"), std::string("sub/block.stl"),
        (box.file("scene") / "block.stl").string()}) {
    with(mesh, name);
    CHECK_MESSAGE(run(box, {"run", there, "--virtual-time"}).code == 0, name);
  }
  struct Case {
    const char* where;
    std::string name;
    bool works;  // once it is trusted
  };
  for (const Case& c :
       {Case{mesh, "../block.stl", true}, Case{mesh, box.file("block.stl"), true},
        Case{mesh, "link.stl", true}, Case{mesh, "/etc/passwd", false},
        Case{"/bodies/1/shell/mesh", "../tool.stl", true},
        Case{"/hands/0/path", "../hand.csv", true}, Case{"/hands/0/path", "/etc/passwd", false},
        Case{"/hands/0/device", "scripted:" + box.file("secret.txt").string(), true},
        Case{"/hands/0/device", "scripted:/etc/passwd", false},
        Case{"/hands/0/device", "replay:/etc/passwd", false}}) {
    CAPTURE(c.name);
    with(c.where, c.name);
    const Ended refused = run(box, {"run", there, "--virtual-time"});
    CHECK(refused.code == 1);
    CHECK(refused.err.find("lies outside the folder of the scene file") != std::string::npos);
    CHECK(refused.err.find("--allow-outside") != std::string::npos);
    const Ended trusted = run(box, {"run", there, "--virtual-time", "--allow-outside"});
    CHECK_MESSAGE((trusted.code == 0) == c.works, trusted.err);
    CHECK(trusted.err.find("lies outside") == std::string::npos);
  }
  with(mesh, "../block.stl");
  CHECK(run(box, {"info", there}).code == 1);
  CHECK(run(box, {"check", there}).code == 1);
  CHECK(run(box, {"info", there, "--allow-outside"}).code == 0);
}

TEST_CASE("without a thread to be had the program says so") {
  if (kSanitized) return;
  Sandbox box;
  setenv("LD_PRELOAD", HAPSIX_NO_THREADS, 1);
  const Ended version = run(box, {"--version"});
  const Ended json = run(box, {"run", "box-on-wall", "--duration", "0.1", "--json"});
  unsetenv("LD_PRELOAD");
  for (const Ended& ended : {version, json}) {
    if (&ended == &version && ended.code == 0) continue;  // nothing wanted a thread
    CHECK(ended.code == 1);
    CHECK(ended.err.find("no thread") != std::string::npos);
    CHECK(std::count(ended.err.begin(), ended.err.end(), '\n') == 1);
  }
  CHECK(one_object(json)["error"].get<std::string>().find("no thread") != std::string::npos);
}

TEST_CASE("with too little memory the program ends with one sentence") {
  if (kSanitized) return;
  Sandbox box;
  rlimit before{};
  REQUIRE(getrlimit(RLIMIT_AS, &before) == 0);
  int refused = 0, ran = 0;
  for (const rlim_t megabytes : {60, 100, 130, 150, 170, 190, 220, 260, 1000}) {
    CAPTURE(megabytes);
    const rlimit less{megabytes << 20, before.rlim_max};
    REQUIRE(setrlimit(RLIMIT_AS, &less) == 0);
    const Ended version = run(box, {"--version"});
    const Ended scene = run(box, {"run", "box-on-wall", "--virtual-time", "--duration", "0.01"});
    REQUIRE(setrlimit(RLIMIT_AS, &before) == 0);
    for (const Ended& ended : {version, scene}) {
      ++(ended.code == 0 ? ran : refused);
      if (ended.code == 0) continue;
      CHECK((ended.code == 1 || ended.code == 127));  // 127: the system's loader, before us
      CHECK(ended.err.size() > 20);
    }
  }
  CHECK(ran > 0);
  CHECK(refused > 0);
}
