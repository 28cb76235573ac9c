// SPDX-License-Identifier: Apache-2.0
// Tests the whole program with a SpaceMouse that umockdev simulates: listing it, checking it, and
// a run at 1 kHz. The run takes two seconds with a box; HAPSIX_SOAK_SECONDS=30 runs alpha-shortcut
// for 30 seconds instead.
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <thread>

#include "tests/device/mock_hid.h"
#include "tests/io/cli/program.h"

using namespace h6::test;

namespace {

MockMachine& machine() {
  static MockMachine only;
  return only;
}
void pause_ms(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

}  // namespace

int main(int argc, char** argv) {
  if (const int skipped = enter_mock(argv)) return skipped;
  return doctest::Context(argc, argv).run();
}

TEST_CASE("devices lists a cap with its serial number; the check lights it and pushes nothing") {
  MockCap cap;
  REQUIRE(machine().plug(cap));
  Sandbox box;
  const Json json = result_of(box, {"devices"});
  if (json["trouble"].get<std::string>().find("without hidapi") != std::string::npos) {
    MESSAGE("skipped: built without hidapi");
    return;
  }
  REQUIRE(json["spacemice"].size() == 1);
  const Json& found = json["spacemice"][0];
  CHECK(found["device"] == "spacemouse?serial=A1");
  CHECK(found["product"] == "SpaceMouse Compact");
  CHECK(found["layout"] == "two reports");
  CHECK(found["usable"] == true);
  const Json seen =
      result_of(box, {"devices", "spacemouse?serial=A1", "--watch", "--duration", "0.5"});
  CHECK(seen["dof_out"] == 0);
  CHECK(seen["samples"]["failed"] == 0);
  Process check(box, {"devices", "spacemouse", "--test", "--json"});
  CHECK(machine().received(cap, 10000) == Bytes{4, 1});
  CHECK(machine().received(cap, 10000) == Bytes{4, 0});
  const Ended checked = check.wait();
  CHECK(checked.code == 0);
  const Json told = one_object(checked);
  CHECK(told["passed"] == true);
  CHECK(told["pushes"].empty());
  machine().unplug(cap);
  const Ended gone = run(box, {"devices", "spacemouse"});
  CHECK(gone.code == 1);
  CHECK(gone.err == "hapsix: no SpaceMouse is plugged in\n");
}

TEST_CASE("a run at 1 kHz in the hand of a cap that moves all the while") {
  const char* const soak = std::getenv("HAPSIX_SOAK_SECONDS");
  const std::string seconds = soak ? soak : "2", scene = soak ? "alpha-shortcut" : "box-on-wall";
  MockCap cap;
  REQUIRE(machine().plug(cap));
  Sandbox box;
  result_of(box, {"run", scene, "--virtual-time", "--duration", "0.01"});  // bakes
  Process process(box, {"run", scene, "--device", "spacemouse", "--duration", seconds, "--json"});
  // Push it to and fro as a hand would, with each half of a report every 8 ms, and watch its light.
  bool ended = false;
  std::size_t lit = 0, sent = 0;
  for (int i = 0; !ended && i < 60000; ++i) {
    const double t = 4e-3 * i;
    const int a = static_cast<int>(300 * std::sin(3 * t)),
              b = static_cast<int>(200 * std::cos(2 * t));
    sent += machine().send(cap, Bytes{static_cast<std::uint8_t>(1 + i % 2)} +
                                    (i % 2 ? int16s({0, b / 4, 0}) : int16s({a, b, a / 2})));
    pause_ms(4);
    lit += machine().received(cap, 0) == Bytes{4, 1};
    ended = process.ended();
  }
  const Ended left = process.wait();
  CHECK(left.code == 0);
  const Json json = one_object(left);
  MESSAGE(scene, ", ", json["frames"].get<int>(), " frames, ", sent, " reports, lit ", lit,
          " times; late by own work ", json["deadline"]["missed_compute"].get<int>(),
          ", by wake-up ", json["deadline"]["missed_wakeup"].get<int>(), ", stolen ",
          json["deadline"]["missed_stolen"].get<int>(), "; frame p50 ",
          json["frame_us"]["p50"].get<double>(), " us, p99 ", json["frame_us"]["p99"].get<double>(),
          " us, max ", json["frame_us"]["max"].get<double>(), " us");
  CHECK(json["frames"] == std::lround(1000 * std::stod(seconds)));
  // The device is not to blame if a busy machine held up the haptic thread.
  const std::string fault = json["fault"];
  CHECK_MESSAGE((fault == "none" || fault == "watchdog" || fault == "late"), fault);
  const Json still = result_of(box, {"run", scene, "--device", "spacemouse", "--duration", "0.05"});
  CHECK(json["hand_pose"] != still["hand_pose"]);
  machine().unplug(cap);
}
