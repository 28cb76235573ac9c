// SPDX-License-Identifier: Apache-2.0
// light_parts_test.cpp - parts of 10 mg to 10 g come to rest in the paper's scenes.
//
// Their hold hangs on a few contacts that come and go; only inertia or the coupling's
// damper keeps a part from jumping then (METHOD.md, Sec. 4).
#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "io/experiments/run.h"
#include "io/scenes/scenes.h"
#include "tests/io/load.h"

using namespace h6;
using namespace h6::cli;

namespace {

RunFigures run(const io::LoadedScene& loaded, h6Method method, double mass) {
  std::vector<h6BodyDef> bodies = loaded.bodies;
  RunChange change;
  change.method.method = change.method.name = h6MethodName(method);
  change.also = [&](h6SessionDef& def, h6HandDef&) {
    for (h6BodyDef& body : bodies) {
      for (double& entry : body.inertia) entry *= mass / body.mass;
      body.mass = mass;
    }
    def.bodies = bodies.data();
  };
  return run_experiment(loaded, change);
}

}  // namespace

TEST_CASE("the paper's parts are held at rest when they weigh 10 mg to 10 g") {
  for (const char* name : {"box-on-plates", "box-over-wire", "cone-in-gap", "peg-in-hole"}) {
    Result<io::Scene> scene = io::make_scene(name);
    REQUIRE(scene);
    const auto loaded = h6::test::load(std::move(*scene));
    for (const h6Method method : {H6_METHOD_FIRM, H6_METHOD_SERIES, H6_METHOD_ROBUST})
      for (const double mass : {1e-5, 1e-4, 1e-3, 1e-2}) {
        CAPTURE(name);
        CAPTURE(std::string(h6MethodName(method)));
        CAPTURE(mass);
        const RunFigures run = ::run(*loaded, method, mass);
        CHECK(run.error == "");
        CHECK(std::string(io::verdict_name(run.verdict)) == "held");
        CHECK(run.max_depth_voxels < 0.5);
      }
  }
}
