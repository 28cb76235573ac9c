// SPDX-License-Identifier: Apache-2.0
// studies_test.cpp - studies on few of their seeds: the random closed loops and the forced paths.
#include "io/experiments/studies.h"

#include <doctest/doctest.h>

#include <cmath>
#include <string>
#include <vector>

#include "io/run/run_scene.h"

using namespace h6;
using namespace h6::cli;

namespace {

Console quiet() {
  Console console;
  console.json = true;
  return console;
}

std::vector<MethodColumn> columns(const std::string& names) {
  Result<std::vector<MethodColumn>> found = columns_named(names);
  REQUIRE_MESSAGE(found, found.error());
  return *found;
}

}  // namespace

TEST_CASE("closed loops touch every surface, and firm makes less work on them than robust") {
  const Study study = study_loops(columns("robust,firm"), quiet(), 4);
  REQUIRE(study.json.size() == 3);
  for (const auto& [surface, methods] : study.json.items()) {
    CAPTURE(surface);
    const auto &firm = methods["firm"], &robust = methods["robust"];
    CHECK(firm["rms"] > 0);  // 0 would mean that nothing touched
    CHECK(firm["made"] < 0.15);
    CHECK(firm["made"].get<double>() < 0.6 * robust["made"].get<double>());
    for (const auto& figures : methods) {
      CHECK(figures["most"] >= figures["rms"]);
      CHECK(figures["most"] < 1);
    }
  }
}

TEST_CASE("the first loops stay the same when more are asked for") {
  const std::vector<MethodColumn> firm = columns("firm");
  const Study one = study_loops(firm, quiet(), 1), two = study_loops(firm, quiet(), 2);
  for (const auto& [surface, methods] : two.json.items()) {
    CAPTURE(surface);
    const double first = one.json[surface]["firm"]["most"], rms = methods["firm"]["rms"],
                 most = methods["firm"]["most"];
    const double second = std::sqrt(2 * rms * rms - first * first);
    CHECK(std::abs(std::fmax(first, second) - most) < 1e-9);
  }
}

TEST_CASE("on forced paths firm holds the starter motor, less deep than robust") {
  const Study study = study_forced_paths("engine-bay", columns("robust,firm"), quiet(), 2);
  const auto &robust = study.json["robust"], &firm = study.json["firm"];
  CHECK(firm["of"] == 2);
  CHECK(firm["failed"] == 0);
  CHECK(firm["through"] == 0);
  for (std::size_t i = 0; i < 2; ++i) {
    CAPTURE(i);
    const double depth = firm["runs"][i]["max_depth_voxels"];
    CHECK(firm["runs"][i]["contacts_max"] > 0);
    const auto& way = firm["runs"][i]["way_out"];  // the starter is never wedged between walls here
    CHECK(way.is_number());
    CHECK(way > 0);
    CHECK(firm["runs"][i]["deepest_at"] > 0);
    CHECK(depth > 0);
    CHECK(depth < robust["runs"][i]["max_depth_voxels"]);
  }
}

TEST_CASE("an industrial scene names what stopped its part, and has its curves") {
  const Study study = study_industrial("spline-hub-1k", columns("global,firm"), quiet());
  REQUIRE(study.table.size() == 3);
  const auto& firm = study.json["firm"];
  CHECK(firm["verdict"] == "arrived");
  CHECK(firm["contacts_max"] > 20);
  CHECK(study.json["global"]["contacts_max"] > 500);
  CHECK(firm["max_depth_voxels"] > 0);
  CHECK(firm["max_force"] > 0);
  CHECK(firm["stopped"]["obstacle"] == "hub");
  CHECK(firm["stopped"]["triangle"] < 24000);
  CHECK(!firm.contains("through"));
  CHECK(study.picture.find(">firm<") != std::string::npos);
}

TEST_CASE("a run that never touched says untouched beside any verdict") {
  RunFigures run;
  run.verdict = io::Verdict::arrived;
  CHECK(cell(run) == "arrived untouched");
  REQUIRE(remarks(run).size() == 1);
  CHECK(remarks(run)[0].rfind("untouched", 0) == 0);
  run.contacts_max = 1, run.max_depth_voxels = 0.25;
  CHECK(cell(run) == "arrived 0.25");
  CHECK(remarks(run).empty());
  run.verdict = io::Verdict::untouched, run.contacts_max = 0, run.max_depth_voxels = 0;
  CHECK(cell(run) == "untouched 0.00");
  CHECK(remarks(run).empty());
}
