// SPDX-License-Identifier: Apache-2.0
// studies_test.cpp - studies on few of their seeds: the random closed loops and the forced paths.
#include "io/experiments/studies.h"

#include <doctest/doctest.h>

#include <cmath>
#include <string>
#include <vector>

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

// On curved surfaces, shares change along the loop under both methods: on four loops of the ridge
// firm does more net work than robust (0.15 against 0.11), on thirty less.
TEST_CASE("closed loops touch every surface; on a plane firm does less net work than robust") {
  const Study study = study_loops(columns("robust,firm"), quiet(), 4);
  REQUIRE(study.json.size() == 3);
  for (const auto& [surface, methods] : study.json.items()) {
    CAPTURE(surface);
    const double firm = methods["firm"]["rms"];
    CHECK(firm > 0);  // 0 would mean that nothing touched
    CHECK(firm < 0.3);
    for (const auto& figures : methods) {
      CHECK(figures["most"] >= figures["rms"]);
      CHECK(figures["most"] < 1);
    }
  }
  const auto& plane = study.json["box on a plane"];
  CHECK(plane["firm"]["rms"] < plane["robust"]["rms"]);
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
  const Study study = study_forced_paths(columns("robust,firm"), quiet(), 2);
  const auto &robust = study.json["robust"], &firm = study.json["firm"];
  CHECK(firm["of"] == 2);
  CHECK(firm["failed"] == 0);
  CHECK(firm["through"] == 0);
  for (std::size_t i = 0; i < 2; ++i) {
    CAPTURE(i);
    const double depth = firm["runs"][i]["max_depth_voxels"];
    CHECK(firm["runs"][i]["contacts_max"] > 0);
    CHECK(depth > 0);
    CHECK(depth < robust["runs"][i]["max_depth_voxels"]);
  }
}
