// SPDX-License-Identifier: Apache-2.0
// On a full disk the program prints one sentence that names the file, exits with 1 and leaves no
// half-written file.
#include <cstdlib>
#include <set>
#include <sstream>
#include <string>

#include "tests/io/cli/program.h"

using namespace h6::test;

namespace {

constexpr rlim_t kRoom = 20'000;  // [bytes], less than any file of these tests

Ended run_out_of_room(Sandbox& box, const Args& args) {
  return Process(box, args, "", -1, kRoom).wait();
}

std::size_t lines(const std::string& text, const std::string& start) {
  std::size_t found = 0;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) found += line.starts_with(start);
  return found;
}

bool cache_is_empty(const Sandbox& box) { return fs::is_empty(box.cache()); }

}  // namespace

TEST_CASE("a bake onto a full disk says so and leaves no file, and the older one as it was") {
  Sandbox box;
  spill(box.file("ball.stl"), stl(sphere_facets(0.1f, 10)));
  for (const Args& bake :
       {Args{"bake", "field", "ball.stl", "--voxels", "64", "-o", "ball.vdb"},
        Args{"bake", "field", "ball.stl", "--voxels", "64", "--no-compression", "-o", "ball.vdb"},
        Args{"bake", "shell", "ball.stl", "--points", "5000", "-o", "ball.ply"}}) {
    const std::string out = bake.back();
    CAPTURE(out);
    for (const bool there_before : {false, true}) {
      if (there_before) spill(box.file(out), "older");
      const std::set<std::string> before = box.files();
      const Ended ended = run_out_of_room(box, bake);
      CAPTURE(ended.err);
      CHECK(ended.code == 1);
      CHECK(lines(ended.err, "hapsix: ") == 1);
      CHECK(ended.err.find(out) != std::string::npos);
      CHECK(ended.err.find("unfinished") == std::string::npos);  // no name of a temporary file
      CHECK(ended.out.empty());
      CHECK(box.files() == before);
      if (there_before) CHECK(slurp(box.file(out)) == "older");
    }
  }
}

TEST_CASE("a run whose assets do not fit into the cache runs, warned, and leaves nothing there") {
  Sandbox box;
  const Ended ended =
      run_out_of_room(box, {"run", "peg-in-hole", "--virtual-time", "--duration", "0.1"});
  CAPTURE(ended.err);
  CHECK(ended.code == 0);
  CHECK(lines(ended.err, "warning: ") >= 1);
  CHECK(ended.err.find("not kept in the cache") != std::string::npos);
  CHECK(cache_is_empty(box));
}

TEST_CASE("a recording that outgrows the disk ends the run with a sentence, and still opens") {
  Sandbox box;
  const Ended ended =
      Process(box, {"run", "box-on-wall", "--virtual-time", "--record", "run.h5"}, "", -1, 200'000)
          .wait();
  CAPTURE(ended.err);
  CHECK(ended.code == 1);
  CHECK(lines(ended.err, "hapsix: ") == 1);
  CHECK(ended.err.find("run.h5") != std::string::npos);
  CHECK(box.files() == std::set<std::string>{"run.h5.part"});  // only the log had room
  const Json info = result_of(box, {"info", "run.h5"});
  CHECK(info["kind"] == "recording");
  CHECK(info["whole"] == false);
  CHECK(box.files() == std::set<std::string>{"run.h5"});
}

// Mounts a tiny file system in a mount namespace, so that it goes away with its process.
TEST_CASE("a real file system without room is told like any other full disk") {
  Sandbox box;
  const fs::path disk = box.file("disk");
  fs::create_directory(disk);
  const auto on_small_disk = [&](const std::string& command) {
    const std::string line = "unshare -m sh -c \"mount -t tmpfs -o size=64k none '" +
                             disk.string() + "' && " + command + "\" 2> '" +
                             box.file("err").string() + "'";
    return WEXITSTATUS(std::system(line.c_str()));
  };
  if (on_small_disk("true") != 0) {
    MESSAGE("skipped: no file system can be mounted here");
    return;
  }
  spill(box.file("ball.stl"), stl(sphere_facets(0.1f, 10)));
  const std::string bake = std::string("'") + HAPSIX_PROGRAM + "' bake ";
  const std::string mesh = " '" + box.file("ball.stl").string() + "' -o '" + disk.string();
  const std::string then = "; echo $? > '" + box.file("code").string() + "'; ls -A '" +
                           disk.string() + "' > '" + box.file("list").string() + "'";
  for (const std::string& command : {bake + "field --voxels 128" + mesh + "/ball.vdb'",
                                     bake + "shell --points 10000" + mesh + "/ball.ply'"}) {
    CAPTURE(command);
    std::string escaped = command + then;
    for (std::size_t at = 0; (at = escaped.find('$', at)) != std::string::npos; at += 2)
      escaped.insert(at, "\\");
    on_small_disk(escaped);
    const std::string err = slurp(box.file("err"));
    CAPTURE(err);
    CHECK(slurp(box.file("code")) == "1\n");
    CHECK(lines(err, "hapsix: ") == 1);
    CHECK(err.find("ball.") != std::string::npos);
    CHECK(slurp(box.file("list")).empty());
  }
}
