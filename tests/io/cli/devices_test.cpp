// SPDX-License-Identifier: Apache-2.0
// Runs `hapsix devices`, and runs scenes with devices that are not simulated.
#include <chrono>
#include <cstdlib>
#include <set>
#include <string>
#include <thread>
#include <utility>

#include "tests/io/cli/program.h"
#include "tests/support/near.h"

using namespace h6::test;

namespace {

const std::string plugins = HAPSIX_PLUGIN_FOLDER "/";

// The process at the other end of the UDP plug-in. The destructor kills it.
struct ArmProcess {
  explicit ArmProcess(int at = 0) {
    int ends[2];
    REQUIRE(pipe(ends) == 0);
    const std::string number = std::to_string(at);
    pid = fork();
    if (pid == 0) {
      dup2(ends[1], STDOUT_FILENO);
      execl(HAPSIX_UDP_ARM, HAPSIX_UDP_ARM, "--port", number.c_str(), static_cast<char*>(nullptr));
      _exit(127);
    }
    close(ends[1]);
    char text[32] = "";
    CHECK(read(ends[0], text, sizeof text - 1) > 0);
    close(ends[0]);
    port = std::atoi(text);
  }
  ~ArmProcess() { end(); }
  void end() {
    if (pid <= 0) return;
    kill(pid, SIGKILL);
    waitpid(pid, nullptr, 0);
    pid = -1;
  }
  std::string device() const {
    return "plugin:" + plugins + "udp_arm.so?timeout=300&port=" + std::to_string(port);
  }
  pid_t pid = -1;
  int port = 0;
};

}  // namespace

TEST_CASE("devices lists every kind of hand, and what there is of hardware or why there is none") {
  Sandbox box;
  const Json json = result_of(box, {"devices"});
  std::set<std::string> names;
  for (const Json& kind : json["devices"]) names.insert(kind["name"]);
  for (const char* name :
       {"path", "simulated", "arm", "spacemouse", "plugin", "scripted", "replay", "bad-operator"})
    CHECK(names.count(name) == 1);
  CHECK(json["spacemice"].is_array());
  CHECK(json["trouble"].get<std::string>().empty() == !json["spacemice"].empty());
  const Ended text = run(box, {"devices"});
  CHECK(text.code == 0);
  CHECK(text.out.find("plugin:FILE") != std::string::npos);
  CHECK(run(box, {"devices", "--udev-rules"}).out.find("uaccess") != std::string::npos);
}

TEST_CASE(
    "a device that is wrong is one sentence: usage for a name or option, failure for the rest") {
  Sandbox box;
  spill(box.file("notes.txt"), "hello");
  const struct {
    std::string device;
    int code;
    const char* says;
  } cases[] = {
      {"phantom", 2, "no device is called 'phantom'"},
      {"spacemouse?sped=1", 2, "has no option 'sped'"},
      {"spacemouse?speed=-1", 2, "must be a number from 0 to 10"},
      {"bad-operator?kinds=shake,rage", 2, "not 'rage'"},
      {"plugin", 2, "needs a file"},
      {"path:x", 2, "takes nothing behind a colon"},
      {"plugin:absent.so", 1, "there is no such file"},
      {"plugin:notes.txt", 1, "cannot be loaded"},
      {"plugin:" + plugins + "bad_abi.so", 1, "is for version 7"},
      {"plugin:" + plugins + "bad_symbol.so", 1, "h6_device_plugin_v1"},
      {"plugin:" + plugins + "bad_crash.so", 1, "while it was opened"},
      {"plugin:" + plugins + "udp_arm.so?port=1", 1, "no arm answers at 127.0.0.1"},
      {"scripted:notes.txt", 1, "line 1"},
      {"replay:notes.txt", 1, "notes.txt"},
      {"spacemouse?serial=none", 1, ""},
  };
  for (const auto& c : cases) {
    CAPTURE(c.device);
    const Ended ended = run(box, {"devices", c.device});
    CHECK(ended.code == c.code);
    CHECK(ended.err.find(c.says) != std::string::npos);
    CHECK(std::count(ended.err.begin(), ended.err.end(), '\n') == 1);
    CHECK(ended.err.size() < 600);
  }
  // A run refuses the device too, before it bakes anything unless the device had to be opened.
  struct {
    std::string device;
    int code;
    bool baked;
  } runs[] = {{"plugin", 2, false},
              {"plugin:absent.so", 1, false},
              {"plugin:" + plugins + "bad_abi.so", 1, false},
              {"plugin:" + plugins + "bad_crash.so", 1, true}};
  for (const auto& r : runs) {
    CAPTURE(r.device);
    const Ended ended = run(box, {"run", "box-on-wall", "--device", r.device, "--json"});
    CHECK(ended.code == r.code);
    CHECK(one_object(ended).contains("error"));
    CHECK(fs::is_empty(box.cache()) == !r.baked);
  }
}

TEST_CASE("a check pushes along every axis with a tenth of the rating, and tells what moved") {
  Sandbox box;
  const Json json =
      result_of(box, {"devices", "plugin:" + plugins + "template_device.so", "--test"});
  CHECK(json["name"] == "a handle on a spring");
  CHECK(json["passed"] == true);
  REQUIRE(json["pushes"].size() == 6);  // forces only, as the device renders no torque
  for (const Json& push : json["pushes"]) {
    CHECK(push["applied"] == 1);  // [N], a tenth of the rating
    CHECK(push["moved"] > 1e-3);  // [m]; 1 N on 500 N/m moves 2 mm
  }
  CHECK(json["samples"]["failed"] == 0);
  CHECK(json["samples"]["frames"] >= 3500);  // more where the machine stood still
}

TEST_CASE("a check arms a device whose motors have no power before") {
  Sandbox box;
  for (const std::string name : {"dhd", "hdapi", "haption"}) {
    CAPTURE(name);
    const Json json = result_of(
        box,
        {"devices",
         "plugin:" + plugins + name + ".so?timeout=1000&library=" + plugins + name + "_standin.so",
         "--test"});
    CHECK(json["passed"] == true);
    REQUIRE(json["pushes"].size() >= 6);
    for (int i = 0; i < 6; ++i)
      CHECK(json["pushes"][i]["moved"] > 5e-5);  // [m]; a tenth of 1.5 to 5 N
  }
}

TEST_CASE("watching counts what comes, for as long as asked") {
  Sandbox box;
  const Json json = result_of(
      box, {"devices", "bad-operator?every=0.05&kinds=nan,unplug", "--watch", "--duration", "1"});
  CHECK(json["samples"]["frames"] > 900);
  CHECK(json["samples"]["failed"] > 0);
  CHECK(json["samples"]["unusable"] > 0);
  const Ended text = run(box, {"devices", "template", "--watch", "--duration", "0.1"});
  CHECK(text.code == 2);
}

TEST_CASE("a run with a plug-in in real time; virtual time is refused") {
  Sandbox box;
  ArmProcess arm;
  const Json json =
      result_of(box, {"run", "box-on-wall", "--device", arm.device(), "--duration", "1"});
  CHECK(json["frames"] == 1000);
  // The device is not to blame if a busy machine held up the haptic thread.
  const std::string fault = json["fault"];
  CHECK_MESSAGE((fault == "none" || fault == "watchdog" || fault == "late"), fault);
  const Ended refused =
      run(box, {"run", "box-on-wall", "--device", arm.device(), "--virtual-time"});
  CHECK(refused.code == 1);
  CHECK(refused.err.find("lives in real time") != std::string::npos);
}

TEST_CASE("the process behind a plug-in is killed in a run: no more force, lost, and a clean end") {
  Sandbox box;
  ArmProcess arm;
  Process process(box, {"run", "box-on-wall", "--device", arm.device(), "--duration", "6",
                        "--record", "run.h5", "--json"});
  REQUIRE(soon([&] { return fs::exists(box.file("run.h5.part")); }));
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  arm.end();
  const Ended ended = process.wait();
  CHECK(ended.in_time);
  CHECK(ended.code >= 0);  // it ended by itself
  const Json json = one_object(ended);
  CHECK(json["frames"] == 6000);
  // If a busy machine held up the haptic thread before, the output was at zero already.
  const std::string fault = json["fault"];
  CHECK_MESSAGE((fault == "device lost" || fault == "watchdog" || fault == "late"), fault);
  bool told = false;
  for (const Json& event : json["events"]) told = told || event["what"] == "device lost";
  CHECK(told);
  const Json info = result_of(box, {"info", "run.h5"});
  CHECK(info["frames"] == 6000);
}

TEST_CASE("a scene does not load a plug-in by itself: it may come from someone else") {
  Sandbox box;
  REQUIRE(run(box, {"scene", "export", "box-on-wall", "."}).code == 0);
  Json scene = Json::parse(slurp(box.file("scene.json")));
  scene["hands"][0]["device"] = "plugin:" + plugins + "template_device.so";
  spill(box.file("scene.json"), scene.dump());
  const Ended ended = run(box, {"run", "scene.json", "--duration", "0.1"});
  CHECK(ended.code == 1);
  CHECK(ended.err.find("with --device") != std::string::npos);
  const Json given = result_of(box, {"run", "scene.json", "--duration", "0.1", "--device",
                                     "plugin:" + plugins + "template_device.so"});
  CHECK(given["frames"] == 100);
}

TEST_CASE("what was recorded of a hand can be the hand of another run, bit by bit") {
  Sandbox box;
  const Json first = result_of(
      box, {"run", "box-on-wall", "--virtual-time", "--duration", "1", "--record", "one.h5"});
  const Json second = result_of(box, {"run", "box-on-wall", "--virtual-time", "--duration", "1",
                                      "--device", "replay:one.h5"});
  CHECK(first["hand_pose"] == second["hand_pose"]);
  CHECK(first["state_hash"] == second["state_hash"]);
}

TEST_CASE("a script moves the hand of a scene, in the scene's units") {
  Sandbox box;
  spill(box.file("up.txt"), "move 0 0 4 in 0.5\nhold 1\n");
  const Json still = result_of(box, {"run", "box-on-wall", "--virtual-time", "--duration", "0.001",
                                     "--device", "scripted:up.txt?hand=path"});
  const Json moved = result_of(box, {"run", "box-on-wall", "--virtual-time", "--duration", "1",
                                     "--device", "scripted:up.txt?hand=path"});
  const double rise =
      moved["hand_pose"]["p"][2].get<double>() - still["hand_pose"]["p"][2].get<double>();
  CHECK(rise == near(4.0).epsilon(1e-9));
}

TEST_CASE("whatever a bad operator does, a run ends by itself and sends finite, rated forces") {
  Sandbox box;
  for (const int seed : {1, 2, 3}) {
    const Json json =
        result_of(box, {"run", "box-on-wall", "--virtual-time", "--duration", "5", "--device",
                        "bad-operator?every=0.1&seed=" + std::to_string(seed)});
    CHECK(json["frames"] == 5000);
    CHECK(json["max_force"].is_number());
    CHECK(json["max_force"] <= 30);
    CHECK(json["fault"] != "none");
  }
}

TEST_CASE("a plug-in that hangs in a read or in its close does not hang the run") {
  Sandbox box;
  const Ended stuck = run(box, {"run", "box-on-wall", "--device",
                                "plugin:" + plugins + "bad_stuck.so", "--record", "a.h5"});
  CHECK(stuck.in_time);
  CHECK(stuck.code == 1);
  CHECK(stuck.err.find("has not answered for 10 s") != std::string::npos);
  // The last read did not come back, so its frame is missing.
  const Json kept = result_of(box, {"info", "a.h5"});
  CHECK(kept["whole"] == false);
  CHECK(kept["frames"] == 49);

  for (const char* name : {"bad_closes.so", "bad_ends.so"}) {
    const Ended ended = run(
        box, {"run", "box-on-wall", "--duration", "0.2", "--device", "plugin:" + plugins + name});
    CHECK_MESSAGE(ended.in_time, name);
    CHECK_MESSAGE(ended.code == 0, name);
  }
}

TEST_CASE("a plug-in that hangs in a read hangs neither the view nor the check of devices") {
  Sandbox box, view_box, watch_box;
  const std::string stuck = "plugin:" + plugins + "bad_stuck.so";
  Process view(view_box, {"run", "box-on-wall", "--view", "--no-browser", "--device", stuck}),
      watch(watch_box, {"devices", stuck, "--watch"}), test(box, {"devices", stuck, "--test"});
  for (Process* process : {&view, &watch, &test}) {
    const Ended ended = process->wait();
    INFO("stderr: ", ended.err);
    CHECK(ended.in_time);
    CHECK(ended.code == 1);
    const bool no_page = process == &view && ended.err.find("node") != std::string::npos;
    CHECK((no_page || ended.err.find("has not answered for 10 s") != std::string::npos));
  }
}
