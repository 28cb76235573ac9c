// SPDX-License-Identifier: Apache-2.0
// Tests the safety chain as a user sees it: keys of a scene, events and counters of a run, and the
// effect of a signal on a run.
#include <string>

#include "tests/io/cli/program.h"
#include "tests/support/sanitized.h"

using namespace h6::test;

namespace {

// A small ball that follows a path down onto a larger one and jumps aside near the end.
void make_scene(Sandbox& box, const std::string& safety) {
  spill(box.file("large.stl"), stl(sphere_facets(20, 16)));
  spill(box.file("small.stl"), stl(sphere_facets(5, 10)));
  std::string path = "t,x,y,z,qw,qx,qy,qz\n";
  // The jump lies between two frames.
  path +=
      "0,0,0,25.1,1,0,0,0\n0.3,0,0,24,1,0,0,0\n0.6001,0,0,24,1,0,0,0\n0.6004,0,0,60,1,0,0,0\n"
      "0.8,0,0,60,1,0,0,0\n";
  spill(box.file("hand.csv"), path);
  spill(box.file("scene.json"), R"({"hapsix": 1, "units": "mm", "bodies": [
    {"name": "large", "fixed": true, "field": {"mesh": "large.stl", "voxels": 64}},
    {"name": "small", "mass": 0.1, "shell": {"mesh": "small.stl", "points": 500},
     "pose": {"p": [0, 0, 25.1], "q": [1, 0, 0, 0]}}],
    "hands": [{"body": "small", "device": "path", "path": "hand.csv", "safety": )" +
                                    safety + "}]}");
}

bool happened(const Json& events, const std::string& what) {
  for (const Json& event : events)
    if (event["what"] == what) return true;
  return false;
}

}  // namespace

TEST_CASE(
    "a run tells what the safety chain did: state, causes, how often; and so does its recording") {
  Sandbox box;
  make_scene(box, R"({"max_force": 0.4, "soft_start": 0.05})");
  const Json run = result_of(box, {"run", "scene.json", "--virtual-time", "--record", "run.h5"});
  const Json& hand = run["safety"][0];
  CAPTURE(hand.dump());
  CHECK(run["safety"].size() == 1);
  CHECK(hand["state"] == "active");
  CHECK(hand["fault"] == "none");
  CHECK(hand["causes"]["clamped"]["frames"] > 50);
  CHECK(hand["causes"]["pose jump"]["times"] == 1);
  CHECK(run["max_force"].get<double>() <= 0.4);
  CHECK(run["max_force"].get<double>() > 0.39);
  CHECK(run["watchdog_trips"] == 0);
  const Json info = result_of(box, {"info", "run.h5"});
  for (const Json* events : {&run["events"], &info["summary"]["events"]}) {
    CHECK(happened(*events, "clamped"));
    CHECK(happened(*events, "pose jump"));
  }
}

TEST_CASE(
    "what is above the device's rating is refused with a sentence, and unknown keys are named") {
  Sandbox box;
  make_scene(box, R"({"max_force": 1000})");
  Ended ended = run(box, {"run", "scene.json", "--virtual-time"});
  CHECK(ended.code == 1);
  CHECK(ended.err.find("max_force, 1000 N, is above") != std::string::npos);
  make_scene(box, R"({"decay_time": 0.1})");
  ended = run(box, {"run", "scene.json", "--virtual-time"});
  CHECK(ended.code == 1);
  CHECK(ended.err.find("hands[0].safety.decay_time") != std::string::npos);
  make_scene(box, R"({"deadman": 1})");
  ended = run(box, {"run", "scene.json", "--virtual-time"});
  CHECK(ended.code == 1);
  CHECK(ended.err.find("deadman") != std::string::npos);
  make_scene(box, R"({"pose_jump": 500})");
  ended = run(box, {"run", "scene.json", "--virtual-time"});
  CHECK(ended.code == 1);
  CHECK(ended.err.find("pose_jump") != std::string::npos);
}

TEST_CASE("without the dead-man button nothing is rendered") {
  Sandbox box;
  make_scene(box, R"({"dead_man_buttons": 1})");
  const Json run = result_of(box, {"run", "scene.json", "--virtual-time", "--duration", "0.5"});
  CHECK(run["contacts"]["max"] > 0);
  CHECK(run["max_force"] == 0);
  CHECK(run["safety"][0]["state"] == "armed");
  CHECK(happened(run["events"], "dead man"));
  CHECK(happened(run["events"], "device armed"));
}

TEST_CASE("a terminal that hangs up ends a run like Ctrl-C; a crash stays a crash") {
  for (const int number : {SIGHUP, SIGSEGV, SIGABRT}) {
    if (kSanitized && number == SIGSEGV) continue;  // the sanitizer handles it
    CAPTURE(number);
    Sandbox box;
    Process process(box, {"run", "peg-in-hole", "--duration", "60", "--record", "run.h5"});
    REQUIRE(soon([&] { return fs::exists(box.file("run.h5.part")); }));
    process.send(number);
    const Ended ended = process.wait();
    CHECK(ended.in_time);
    CHECK(ended.code == (number == SIGHUP ? 1 : -number));
    if (number == SIGHUP) CHECK(ended.err.find("interrupted after") != std::string::npos);
  }
}

TEST_CASE(
    "a simulated hand is armed again after each latch if --rearm asks, and a real one never") {
  Sandbox box;
  make_scene(box, "{}");
  const Args args{"run", "scene.json", "--duration",
                  "4",   "--device",   "bad-operator?seed=3&kinds=unplug&every=0.2"};
  const auto lost = [](const Json& told) {
    return told["safety"][0]["causes"]["device lost"]["times"].get<int>();
  };
  CHECK(lost(result_of(box, args)) == 1);  // the first latch is the end
  Args again = args;
  again.insert(again.end(), {"--rearm", "0.1", "--record", "run.h5"});
  const Json armed = result_of(box, again);
  CHECK(lost(armed) >= 3);
  CHECK(happened(armed["events"], "armed again"));
  CHECK(result_of(box, {"replay", "run.h5", "--verify"})["same"] == true);
  const Ended real = run(box, {"run", "scene.json", "--rearm", "1", "--device",
                               "plugin:" HAPSIX_PLUGIN_FOLDER "/template_device.so"});
  CHECK(real.code == 1);
  CHECK(real.err.find("leave out --rearm") != std::string::npos);
}
