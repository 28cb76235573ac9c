// SPDX-License-Identifier: Apache-2.0
// hapsix bake deformable: which vertices are fixed, by place, by list and by box.
#include <string>

#include "tests/io/cli/program.h"

using namespace h6::test;

namespace {

// A bar of three cubes along x.
std::string bar() {
  std::string text = "*VERTICES\n16 3 0 0\n";
  int number = 0;
  for (int i = 0; i < 4; ++i)
    for (const char* corner : {" 0 0", " 1 0", " 1 1", " 0 1"})
      text += std::to_string(++number) + ' ' + std::to_string(i) + corner + '\n';
  text += "*ELEMENTS\nCUBIC\n3 8 0\n";
  for (int e = 0; e < 3; ++e) {
    text += std::to_string(e + 1);
    for (const int corner : {1, 5, 6, 2, 4, 8, 7, 3}) text += ' ' + std::to_string(4 * e + corner);
    text += '\n';
  }
  return text;
}

Ended bake(Sandbox& box, const Args& more) {
  Args args{"bake",      "deformable", "bar.veg", "--young", "1e6",    "--poisson", "0.4",
            "--density", "1000",       "--modes", "3",       "--json", "-o",        "bar.h5"};
  args.insert(args.end(), more.begin(), more.end());
  return run(box, args);
}

}  // namespace

TEST_CASE("a list fixes the same vertices as their places, and as the box around them") {
  Sandbox box;
  spill(box.file("bar.veg"), bar());
  spill(box.file("list.txt"), "# the end at x = 0\r\n1, 2\n3 4  # two more\n\n2\n");
  const Ended by_list = bake(box, {"--fix-list", "list.txt"});
  REQUIRE_MESSAGE(by_list.code == 0, by_list.err);
  const Json facts = Json::parse(by_list.out);
  CHECK(facts["fixed"] == 4);
  for (const Args& same : {Args{"--fix", "1,2,3,4"}, Args{"--fix-box=0,0,0,0,1,1"}})
    CHECK(Json::parse(bake(box, same).out)["frequencies"] == facts["frequencies"]);
  spill(box.file("list.txt"), "13 14 15 16\n");
  const Ended both = bake(box, {"--fix-list", "list.txt", "--fix", "1"});
  CHECK(Json::parse(both.out)["fixed"] == 5);
}

TEST_CASE("a list that is none is refused with its line, and nothing is written") {
  Sandbox box;
  spill(box.file("bar.veg"), bar());
  const auto refused = [&](const std::string& text, const std::string& word) {
    spill(box.file("list.txt"), text);
    const Ended ended = bake(box, {"--fix-list", "list.txt"});
    CHECK(ended.code == 1);
    CHECK_MESSAGE(ended.err.find(word) != std::string::npos, ended.err);
    CHECK_FALSE(fs::exists(box.file("bar.h5")));
  };
  refused("1 2\n0\n", "list.txt, line 2: a place of a vertex is a whole number from 1, not '0'");
  refused("-3", "line 1");
  refused("1.5", "line 1");
  refused("one", "'one'");
  refused("1e12", "line 1");
  refused("17", "17");
  const Ended gone = bake(box, {"--fix-list", "gone.txt"});
  CHECK(gone.code == 1);
  CHECK(gone.err.find("cannot read gone.txt") != std::string::npos);
}

TEST_CASE("a place for the list that cannot be written is refused before a page opens") {
  Sandbox box;
  spill(box.file("bar.veg"), bar());
  const Ended ended = bake(box, {"--pick", "no/list.txt", "--no-browser"});
  CHECK(ended.code == 1);
  CHECK(ended.err.find("http://") == std::string::npos);
  CHECK(bake(box, {"--pick", "list.csv", "--no-browser"}).code == 2);
  CHECK(bake(box, {"--pick", "list.txt", "--no-browser", "--port", "70000"}).code == 2);
}
