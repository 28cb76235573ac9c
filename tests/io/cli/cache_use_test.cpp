// SPDX-License-Identifier: Apache-2.0
// A second run takes its baked assets from the cache, and no state of the cache stops a run.
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "tests/io/cli/program.h"

using namespace h6::test;

namespace {

const Args kRun{"run", "alpha-shortcut", "--virtual-time", "--duration", "1", "--json"};

std::vector<fs::path> cached(const Sandbox& box) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(box.cache()))
    files.push_back(entry.path());
  return files;
}

bool all_from_cache(const Json& run) {
  for (const Json& asset : run["assets"])
    if (asset["from_cache"] != true) return false;
  return !run["assets"].empty();
}
bool none_rebuilt(const Json& run) {
  for (const Json& asset : run["assets"])
    if (asset["rebuilt"] != false) return false;
  return !run["assets"].empty();
}
bool all_rebuilt(const Json& run) {
  for (const Json& asset : run["assets"])
    if (asset["rebuilt"] != true) return false;
  return !run["assets"].empty();
}
bool none_from_cache(const Json& run) {
  for (const Json& asset : run["assets"])
    if (asset["from_cache"] != false) return false;
  return !run["assets"].empty();
}

}  // namespace

TEST_CASE(
    "the second run takes everything from the cache, does less work and gives the same bits") {
  Sandbox box;
  const Ended first = run(box, kRun), second = run(box, kRun);
  const Json a = one_object(first), b = one_object(second);
  CHECK(none_from_cache(a));
  CHECK(all_from_cache(b));
  CHECK(none_rebuilt(a));
  CHECK(none_rebuilt(b));
  CHECK(second.cpu_seconds < first.cpu_seconds);
  CHECK(a["state_hash"] == b["state_hash"]);
  CHECK(cached(box).size() == 2);  // a field and a shell
  CHECK(second.err.find("warning") == std::string::npos);
}

TEST_CASE("a damaged file of the cache is baked again, with a warning") {
  Sandbox box;
  const Json good = one_object(run(box, kRun));
  const auto damage = [&](const std::function<void(std::string&)>& change) {
    for (const fs::path& file : cached(box)) {
      std::string bytes = slurp(file);
      change(bytes);
      spill(file, bytes);
    }
    const Ended ended = run(box, kRun);
    const Json again = one_object(ended);
    CHECK(ended.code == 0);
    for (const fs::path& file : cached(box)) {
      CAPTURE(file);
      const std::size_t at = ended.err.find(file.string());  // a warning names each file
      REQUIRE(at != std::string::npos);
      const std::string said = ended.err.substr(ended.err.rfind('\n', at) + 1, 300);
      CHECK(said.starts_with("warning: body '"));
      CHECK(said.find("is baked again") != std::string::npos);
    }
    CHECK(none_from_cache(again));
    CHECK(all_rebuilt(again));
    CHECK(again["state_hash"] == good["state_hash"]);
    const Ended healed = run(box, kRun);
    CHECK(all_from_cache(one_object(healed)));
    CHECK(none_rebuilt(one_object(healed)));
    CHECK(healed.err.find("warning") == std::string::npos);
  };
  SUBCASE("truncated") {
    damage([](std::string& b) { b.resize(b.size() / 2); });
  }
  SUBCASE("one bit flipped") {
    damage([](std::string& b) { b[b.size() / 2] ^= 4; });
  }
  SUBCASE("of an older format") {
    // Change the version number behind this name, as if an older program had written the file.
    damage([](std::string& b) {
      std::size_t at = b.find("hapsix cached field ");
      if (at == 0)
        b[20] = '0';
      else {  // a .ply file has it in a comment
        at = b.find("comment hapsix");
        REQUIRE(at != std::string::npos);
        at = b.find('1', at);
        REQUIRE(at < b.find("element"));
        b[at] = '0';
      }
    });
  }
  SUBCASE("a file of another kind") {
    damage([](std::string& b) { b = stl(box_facets(1)); });
  }
  SUBCASE("another's asset under this name") {
    // Valid files, but with the field of another scene and the shell of another mesh.
    Sandbox other;
    run(other, {"run", "peg-in-hole", "--virtual-time", "--duration", "0.01", "--json"});
    REQUIRE(cached(other).size() == 1);
    spill(other.file("ball.stl"), stl(sphere_facets(0.01f, 10)));
    result_of(other, {"bake", "shell", "ball.stl", "-o", "a.ply", "--points", "100"});
    const std::string field = slurp(cached(other)[0]), shell = slurp(other.file("a.ply"));
    REQUIRE_FALSE(field.empty());
    REQUIRE_FALSE(shell.empty());
    damage([&](std::string& b) { b = b.starts_with("ply") ? shell : field; });
  }
  SUBCASE("empty") {
    damage([](std::string& b) { b.clear(); });
  }
  SUBCASE("garbage") {
    damage([](std::string& b) {
      for (char& c : b) c = static_cast<char>(c * 31 + 7);
    });
  }
}

TEST_CASE("a cache that cannot be written is a warning, not a failure") {
  Sandbox box;
  spill(box.file("taken"), "a file where the folder should be");
  for (const std::string& place : {box.file("taken").string(), box.file("taken/deeper").string(),
                                   std::string("/proc/hapsix")}) {
    CAPTURE(place);
    const Ended ended = run(box, kRun, place);
    CHECK(ended.code == 0);
    CHECK(ended.err.find("warning") != std::string::npos);
    CHECK(none_from_cache(one_object(ended)));
  }
  CHECK(slurp(box.file("taken")) == "a file where the folder should be");
}

TEST_CASE("two programs that bake the same at once both succeed") {
  Sandbox box;
  Process one(box, kRun), two(box, kRun);
  const Ended a = one.wait(), b = two.wait();
  CHECK(a.code == 0);
  CHECK(b.code == 0);
  CHECK(one_object(a)["state_hash"] == one_object(b)["state_hash"]);
  CHECK(cached(box).size() == 2);  // and no unfinished file
  CHECK(all_from_cache(one_object(run(box, kRun))));

  // Two bakes may also write the same output file at the same time.
  spill(box.file("ball.stl"), stl(sphere_facets(0.1f, 30)));
  const Args bake{"bake", "field", "ball.stl", "-o", "ball.vdb", "--voxels", "128"};
  Process three(box, bake), four(box, bake);
  CHECK(three.wait().code == 0);
  CHECK(four.wait().code == 0);
  CHECK(result_of(box, {"info", "ball.vdb"})["kind"] == "field");
  CHECK(box.files() == std::set<std::string>{"ball.stl", "ball.vdb"});
}
