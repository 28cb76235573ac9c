// SPDX-License-Identifier: Apache-2.0
// A run that is killed at any time leaves its log. `info` turns the log into a recording and says
// so, and its frames replay bit for bit.
#include <algorithm>
#include <memory>
#include <random>

#include "tests/io/cli/program.h"

using namespace h6::test;

TEST_CASE("runs killed at random instants: info makes a recording of each, and it replays") {
  Sandbox box;
  result_of(box, {"run", "peg-in-hole", "--virtual-time", "--duration", "0.01"});  // bakes
  std::mt19937_64 random(22);
  struct Victim {
    std::string file;
    std::unique_ptr<Process> process;
    std::chrono::milliseconds life;
  };
  std::vector<Victim> victims;
  for (int i = 0; i < 10; ++i) {
    const std::string file = "run" + std::to_string(i) + ".h5";
    const Args args{"run", "peg-in-hole", "--duration", "60", "--record", file};
    victims.push_back(
        {file, std::make_unique<Process>(box, args), std::chrono::milliseconds(random() % 900)});
  }
  const auto log_of = [&](const Victim& v) { return box.file(v.file + ".part"); };
  for (const Victim& v : victims)
    REQUIRE(soon([&] { return fs::exists(log_of(v)) && fs::file_size(log_of(v)) > 0; }));
  std::sort(victims.begin(), victims.end(),
            [](const Victim& a, const Victim& b) { return a.life < b.life; });
  const auto began = std::chrono::steady_clock::now();
  for (Victim& v : victims) {
    std::this_thread::sleep_until(began + v.life);
    v.process.reset();  // SIGKILL
  }
  std::uint64_t most = 0;
  for (const Victim& v : victims) {
    CAPTURE(v.file);
    CHECK(fs::exists(log_of(v)));
    CHECK_FALSE(fs::exists(box.file(v.file)));
    const Json info = result_of(box, {"info", v.file});
    CHECK(info["whole"] == false);
    CHECK(std::string(info["repaired"]).find(v.file + ".part") != std::string::npos);
    CHECK_FALSE(fs::exists(log_of(v)));
    CHECK(result_of(box, {"info", v.file})["repaired"] == "");  // the first `info` repaired it
    most = std::max(most, info["frames"].get<std::uint64_t>());
    if (info["frames"] == 0) continue;
    CHECK(info["event_counts"].is_object());
    const Json replay = result_of(box, {"replay", v.file, "--verify"});
    CHECK(replay["same"] == true);
    CHECK(replay["frames"] == info["frames"]);
  }
  CHECK(most > 0);
  MESSAGE("10 kills, up to " << most << " frames");
}
