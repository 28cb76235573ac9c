// SPDX-License-Identifier: Apache-2.0
// Tests `hapsix map` from outside: its files, one variation alone, and mistakes.
#include <algorithm>
#include <memory>
#include <random>
#include <string>

#include "tests/io/cli/program.h"

using namespace h6::test;

TEST_CASE("map writes a row for each run, a report, and the same figures as JSON") {
  Sandbox box;
  const Json map =
      result_of(box, {"map", "--scenes", "box-over-wire,cone-in-gap", "--methods", "gauss3,robust",
                      "--variations", "2", "--csv", "runs.csv", "-o", "map.md"});
  CHECK(map["methods"] == Json::parse(R"(["robust", "gauss3"])"));
  CHECK(map["scenes"].size() == 2);
  const Json& wire = map["scenes"]["box-over-wire"];
  CHECK(wire["equal_wall_stiffness"]["gauss3"]["stiffer"].get<double>() > 4);  // METHOD.md: 4.5
  CHECK(wire["equal_stiffness"]["gauss3"]["scene"]["runs"] == 2);
  CHECK(wire["runs"].size() == 2);
  // 2 scenes, 2 variations, 2 tables, 3 forces, 2 methods, and the head.
  const std::string rows = slurp(box.file("runs.csv"));
  CHECK(std::count(rows.begin(), rows.end(), '\n') == 1 + 2 * 2 * 2 * 3 * 2);
  const std::string report = slurp(box.file("map.md"));
  for (const char* words : {"| box-over-wire | robust |", "## Conclusions", "--only SCENE:INDEX"})
    CHECK_MESSAGE(report.find(words) != std::string::npos, words);

  CHECK(run(box, {"map", "--scenes", "box-on-wall", "--methods", "robust", "--variations", "1",
                  "-o", "map.html"})
            .code == 0);
  CHECK(slurp(box.file("map.html")).find("<svg") != std::string::npos);

  const Ended alone = run(box, {"map", "--methods", "gauss3", "--only", "cone-in-gap:1"});
  CHECK(alone.code == 0);
  CHECK(alone.out.rfind("cone-in-gap:1: voxel ", 0) == 0);
  const Json again = result_of(box, {"map", "--methods", "gauss3", "--only", "cone-in-gap:1"});
  CHECK(again["scenes"]["cone-in-gap"]["runs"][0] == map["scenes"]["cone-in-gap"]["runs"][1]);
}

TEST_CASE("a map that is killed again and again ends with the same figures") {
  Sandbox box;
  const Args map = {"map", "--scenes", "cone-in-gap", "--methods", "global", "--variations", "4"};
  const auto with = [&](const Args& more) {
    Args all = map;
    all.insert(all.end(), more.begin(), more.end());
    return all;
  };
  const Json whole = result_of(box, with({"--csv", "whole.csv", "-o", "whole.md"}));
  const Args kept = with({"--keep", "kept", "--csv", "kept.csv", "-o", "kept.md"});
  const auto rows = [&](const char* name) {
    const std::string text = slurp(box.file(name));
    return std::count(text.begin(), text.end(), '\n');
  };
  std::mt19937_64 random(7);
  int kills = 0;
  unsigned longest = 1000;  // [ms]
  long most = 0, resumed = 0;
  for (; !fs::exists(box.file("kept/runs.csv")) && kills < 40; ++kills) {
    auto process = std::make_unique<Process>(box, kept);
    // The first kill comes with the first row, so that the next run has something to go on with.
    // On a quick machine the map may end before a random kill, on a busy one a row takes seconds.
    const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(120);
    while (kills == 0 && rows("kept/runs.csv.part") < 2 && !fs::exists(box.file("kept/runs.csv")) &&
           std::chrono::steady_clock::now() < give_up)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    if (kills > 0) std::this_thread::sleep_for(std::chrono::milliseconds(50 + random() % longest));
    process.reset();  // SIGKILL
    const long now = rows("kept/runs.csv.part");
    CHECK((now >= most || fs::exists(box.file("kept/runs.csv"))));  // nothing is lost
    resumed += most > 1;
    if (now <= most) longest += 500;
    most = std::max(most, now);
  }
  CHECK(resumed > 0);
  if (fs::exists(box.file("kept/runs.csv.part")))  // a torn row, as a loss of power leaves it
    std::ofstream(box.file("kept/runs.csv.part"), std::ios::app) << "3,cone-in-gap,3,\"{";
  CHECK(result_of(box, kept) == whole);
  CHECK(slurp(box.file("kept.csv")) == slurp(box.file("whole.csv")));
  CHECK(slurp(box.file("kept.md")) == slurp(box.file("whole.md")));
  CHECK(rows("kept/runs.csv") == 1 + 4);
  CHECK(rows("kept/times.csv") == 1 + 4);
  // A map that is done runs nothing again, also when only its files are gone.
  fs::remove(box.file("kept.csv"));
  const Ended again = run(box, kept);
  CHECK(again.err.find("4 of 4 variations are done already") != std::string::npos);
  CHECK(slurp(box.file("kept.csv")) == slurp(box.file("whole.csv")));
  // Another map does not get into the folder.
  const Ended other = run(box, {"map", "--scenes", "cone-in-gap", "--keep", "kept", "--seed", "2"});
  CHECK(other.code == 1);
  CHECK_MESSAGE(other.err.find("another study, map") != std::string::npos, other.err);
  MESSAGE(kills << " kills, " << resumed << " of them of a map that had gone on");
}

TEST_CASE("map says what is wrong with its arguments before it runs") {
  Sandbox box;
  const auto told = [&](const Args& args, int code, const std::string& words) {
    const Ended ended = run(box, args);
    CHECK(ended.code == code);
    CHECK_MESSAGE(ended.err.find(words) != std::string::npos, ended.err);
  };
  told({"map", "--methods", "robst"}, 2, "did you mean 'robust'?");
  told({"map", "--scenes", "cone-in-gab"}, 2, "did you mean 'cone-in-gap'?");
  told({"map", "--only", "cone-in-gap"}, 2, "SCENE:INDEX");
  told({"map", "--only", "cone-in-gap:x"}, 2, "SCENE:INDEX");
  told({"map", "--variations", "0"}, 2, "must be a whole number");
  told({"map", "--csv", "runs.txt"}, 2, ".csv");
  told({"map", "-o", "map.txt"}, 2, ".md or .html");
  told({"map", "--scenes", "box-on-wall", "--csv", "no/folder/runs.csv"}, 1, "does not exist");
  CHECK(box.files().empty());
}
