// SPDX-License-Identifier: Apache-2.0
// On Ctrl-C the program ends soon, leaves no half-written file and keeps its recording. It also
// keeps the log when it is killed, and shows its progress on a terminal.
#include <poll.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <set>
#include <string>
#include <thread>

#include "tests/io/cli/program.h"
#include "tests/support/sanitized.h"

using namespace h6::test;

namespace {

constexpr double kSlower = kSanitized ? 15 : 1;
const double kThreads = std::max(1u, std::thread::hardware_concurrency());

// Bake sizes that take long in every build.
const std::string kVoxels = kThreadSanitized ? "640" : "2048";
const std::string kPoints = kThreadSanitized ? "300000" : "2000000";
constexpr std::size_t kTriangles = repeated(2'000'000, 300'000);

void pause_seconds(double s) { std::this_thread::sleep_for(std::chrono::duration<double>(s)); }

// A pseudo terminal. Its text can be read when all its writers have closed it.
struct Terminal {
  int mine = posix_openpt(O_RDWR | O_NOCTTY), theirs = -1;
  Terminal() {
    if (mine >= 0 && grantpt(mine) == 0 && unlockpt(mine) == 0)
      theirs = open(ptsname(mine), O_RDWR | O_NOCTTY);
  }
  ~Terminal() {
    if (mine >= 0) close(mine);
    if (theirs >= 0) close(theirs);
  }
  std::string text;
  bool read_some() {
    char buffer[4096];
    const ssize_t n = read(mine, buffer, sizeof buffer);
    if (n > 0) text.append(buffer, static_cast<std::size_t>(n));
    return n > 0;
  }
  // Whether it says this within 100 s.
  bool says(const char* word) {
    return soon([&] {
      pollfd there{mine, POLLIN, 0};
      while (poll(&there, 1, 0) > 0 && read_some()) {
      }
      return text.find(word) != std::string::npos;
    });
  }
  void type(const std::string& line) const {
    CHECK(write(mine, line.data(), line.size()) == static_cast<ssize_t>(line.size()));
  }
  std::string read_all() {
    close(theirs);
    theirs = -1;
    while (read_some()) {
    }
    return text;
  }
};

std::size_t count(const std::string& text, const std::string& word) {
  std::size_t found = 0;
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1))
    ++found;
  return found;
}

}  // namespace

TEST_CASE("Ctrl-C ends a real-time run at once: devices stopped, recording finished, exit 1") {
  for (const int number : {SIGINT, SIGTERM})
    for (const bool json : {false, true}) {
      Sandbox box;
      Args args{"run", "peg-in-hole", "--duration", "60", "--record", "run.h5"};
      if (json) args.push_back("--json");
      Process process(box, args);
      REQUIRE(soon([&] { return records(box, "run.h5"); }));
      const double before = process.cpu_seconds();
      process.send(number);
      const Ended ended = process.wait();
      CHECK(ended.in_time);
      CHECK(ended.cpu_seconds - before < 1 * kSlower);  // some 0.03 s
      CHECK(ended.code == 1);
      CHECK(ended.err.find("interrupted after") != std::string::npos);
      if (json) {
        const Json result = one_object(ended);
        CHECK(result["interrupted"] == true);
        CHECK(result.value("error", "").find("interrupted after") == 0);
        CHECK(result["frames"] > kSomeFrames);
      }
      CHECK(box.files() == std::set<std::string>{"run.h5"});
      const Json info = result_of(box, {"info", "run.h5"});
      CHECK(info["whole"] == true);
      CHECK(info["frames"] > kSomeFrames);
      CHECK(info["frames"] == info["summary"]["frames"]);
      const Json& events = info["summary"]["events"];
      REQUIRE(!events.empty());
      CHECK(events.back()["what"] == "interrupted");
      CHECK(events.back().value("detail", "").find("stop") != std::string::npos);
    }
}

TEST_CASE("a killed run leaves a recording that opens and has what its log had") {
  Sandbox box;
  Process process(box, {"run", "peg-in-hole", "--duration", "60", "--record", "run.h5"});
  REQUIRE(soon([&] { return records(box, "run.h5"); }));
  process.send(SIGKILL);
  CHECK(process.wait().code == -SIGKILL);
  const Json info = result_of(box, {"info", "run.h5"});
  CHECK(info["kind"] == "recording");
  CHECK(info["frames"] > kSomeFrames);
  CHECK(info["whole"] == false);
  CHECK(!info.value("remark", "").empty());
}

TEST_CASE("Ctrl-C during a long bake leaves nothing behind") {
  Sandbox box;
  spill(box.file("ball.stl"), stl(sphere_facets(0.1f, 100)));
  const std::set<std::string> before = box.files();
  for (const double seconds : {0.3, 1.2}) {
    Process process(box,
                    {"bake", "field", "ball.stl", "-o", "ball.vdb", "--voxels", kVoxels, "--json"});
    REQUIRE(soon([&] { return process.handles(SIGINT); }));
    pause_seconds(seconds);
    process.send(SIGINT);
    const Ended ended = process.wait();
    CHECK(ended.in_time);
    CHECK(ended.code == 1);
    CHECK(one_object(ended).value("error", "").find("cancelled") != std::string::npos);
    CHECK(box.files() == before);
  }
  // The same bake, now for the cache.
  spill(box.file("scene.json"), R"({"hapsix": 1, "units": "m", "bodies": [
    {"name": "ball", "fixed": true, "field": {"mesh": "ball.stl", "voxels": )" +
                                    kVoxels + "}}]}");
  Process process(box, {"run", "scene.json"});
  REQUIRE(soon([&] { return process.handles(SIGINT); }));
  pause_seconds(1);
  process.send(SIGINT);
  const Ended ended = process.wait();
  CHECK(ended.in_time);
  CHECK(ended.code == 1);
  CHECK(fs::is_empty(box.cache()));
}

namespace {

// Starts the program, interrupts it after `after` seconds, and checks that it ends after half a
// second of each thread's work at most, with one sentence, and leaves no file.
void check_interrupted(Sandbox& box, const Args& args, double after) {
  CAPTURE(args[1]);
  CAPTURE(after);
  const std::set<std::string> before = box.files();
  Process process(box, args);
  REQUIRE(soon([&] { return process.handles(SIGINT); }));
  pause_seconds(after);
  const double spent = process.cpu_seconds();
  process.send(SIGINT);
  const Ended ended = process.wait();
  CHECK(ended.in_time);
  CHECK(ended.cpu_seconds - spent < 0.5 * kSlower * kThreads);
  CHECK(ended.code == 1);
  CHECK(ended.err.ends_with("hapsix: " + args.back() + ": cancelled\n"));
  CHECK(ended.out.empty());
  CHECK(box.files() == before);
}

}  // namespace

TEST_CASE("Ctrl-C ends bakes of fields and of millions of points within half a second") {
  Sandbox box;
  spill(box.file("ball.stl"), stl(sphere_facets(0.1f, 100)));
  for (const double after : {0.2, 0.9}) {
    check_interrupted(box, {"bake", "field", "-o", "ball.vdb", "--voxels", kVoxels, "ball.stl"},
                      after);
    check_interrupted(box, {"bake", "shell", "-o", "ball.ply", "--points", kPoints, "ball.stl"},
                      after);
  }
}

TEST_CASE("Ctrl-C ends the reading of a large mesh within half a second") {
  Sandbox box;
  // No two corners are equal.
  std::string bytes(80, '\0');
  const auto count = static_cast<std::uint32_t>(kTriangles);
  bytes.append(reinterpret_cast<const char*>(&count), 4);
  bytes.resize(84 + 50 * std::size_t{count});
  for (std::size_t t = 0; t < count; ++t)
    for (std::size_t k = 0; k < 9; ++k) {
      // Below 20 m, since else the program asks for the unit once it has read the mesh.
      const float value = 1e-5f * static_cast<float>((t * 9 + k) * 2654435761u % 999983);
      std::memcpy(&bytes[84 + 50 * t + 12 + 4 * k], &value, 4);
    }
  spill(box.file("large.stl"), bytes);
  bytes = {};
  for (const double after : {0.02, 0.25}) {
    check_interrupted(box, {"info", "large.stl"}, after);
    check_interrupted(box, {"bake", "shell", "-o", "large.ply", "large.stl"}, after);
  }
}

TEST_CASE("a second Ctrl-C does not wait") {
  Sandbox box;
  spill(box.file("ball.stl"), stl(sphere_facets(0.1f, 100)));
  const std::set<std::string> before = box.files();
  Process process(box, {"bake", "shell", "ball.stl", "-o", "ball.ply", "--points", kPoints});
  pause_seconds(0.7);
  process.send(SIGINT);
  pause_seconds(0.05);
  process.send(SIGINT);
  const Ended ended = process.wait();
  CHECK(ended.in_time);
  CHECK(ended.code != 0);
  CHECK(box.files() == before);
}

TEST_CASE("on a terminal the unit of a part of sixty metres is asked for, and the answer counts") {
  for (const auto& [answer, longest] :
       {std::pair<const char*, double>{"mm\n", 0.06}, {"in\n", 1.524}, {"ells\n", 0}}) {
    CAPTURE(answer);
    Sandbox box;
    spill(box.file("large.stl"), stl(box_facets(60)));
    Terminal terminal;
    if (terminal.theirs < 0) {
      MESSAGE("skipped: this machine gives no pseudo-terminal");
      return;
    }
    Process process(box, {"bake", "field", "large.stl", "-o", "large.vdb", "--voxels", "32"}, "",
                    dup(terminal.theirs));
    CHECK(terminal.says("In which unit is it"));
    terminal.type(answer);
    CHECK(process.wait().code == (longest > 0 ? 0 : 1));
    CHECK(fs::exists(box.file("large.vdb")) == (longest > 0));
    if (longest == 0) continue;
    const Json info = result_of(box, {"info", "large.vdb"});
    CHECK(info["voxel_size_m"].get<double>() == doctest::Approx(longest / 30).epsilon(0.05));
  }
}

TEST_CASE("a bar shows progress on a terminal, for long work only, and is wiped away") {
  Sandbox box;
  {
    Terminal terminal;
    if (terminal.theirs < 0) {
      MESSAGE("skipped: this machine gives no pseudo-terminal");
      return;
    }
    Process process(box, {"run", "box-on-wall", "--duration", "6"}, "", dup(terminal.theirs));
    CHECK(terminal.says(" s left"));  // the estimate appears after one second
    CHECK(process.wait().code == 0);
    const std::string seen = terminal.read_all();
    CHECK(count(seen, "running box-on-wall") >= 3);
    CHECK(count(seen, "%") >= 3);
    // The program wipes each bar before the next line, so that nothing of it stays on the screen.
    const std::string wipe = "\r\033[K";
    CHECK(seen.rfind(wipe) > seen.rfind('%'));
    for (std::size_t at = seen.find('%'); at != std::string::npos; at = seen.find('%', at + 1)) {
      const std::size_t end = seen.find(wipe, at);
      REQUIRE(end != std::string::npos);
      CHECK(seen.find('\n', at) > end);
      CHECK(end - seen.rfind(wipe, at) - wipe.size() <= 80);  // a longer line would wrap
    }
  }
  {
    // A bake shows a share that only grows, and an estimate too.
    Terminal terminal;
    spill(box.file("ball.stl"), stl(sphere_facets(0.1f, 100)));
    Process process(box, {"bake", "field", "ball.stl", "-o", "ball.vdb", "--voxels", kVoxels}, "",
                    dup(terminal.theirs));
    CHECK(terminal.says(" left"));
    process.send(SIGINT);
    CHECK(process.wait().code == 1);
    const std::string seen = terminal.read_all();
    CAPTURE(seen);
    int share = 0;
    for (std::size_t at = seen.find('%'); at != std::string::npos; at = seen.find('%', at + 1)) {
      const int now = std::atoi(seen.c_str() + at - 4);
      CHECK(now >= share);
      share = now;
    }
    CHECK(share > 0);
    CHECK(seen.ends_with("\r\033[Khapsix: ball.stl: cancelled\r\n"));
  }
  {
    Terminal terminal;
    Process process(box, {"run", "box-on-wall", "--virtual-time", "--duration", "0.1"}, "",
                    dup(terminal.theirs));
    const Ended ended = process.wait();
    CHECK(ended.code == 0);
    // A full machine may make a second of it, and then there is a bar.
    if (ended.wall_seconds < 0.5) CHECK(terminal.read_all().find('%') == std::string::npos);
  }
  const Ended piped = run(box, {"run", "box-on-wall", "--duration", "1.2"});
  CHECK(piped.code == 0);
  CHECK(piped.err.find('%') == std::string::npos);
  CHECK(piped.err.find('\r') == std::string::npos);
}
