// SPDX-License-Identifier: Apache-2.0
// A body that bends, as the page gets it.
#include <doctest/doctest.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "io/deform/reduce.h"
#include "io/scenes/scenes.h"
#include "io/view/scene_drawing.h"
#include "tests/io/deform/solids.h"

using namespace h6;
using namespace h6::io;

TEST_CASE("a drawing has the turns of a body that is warped, and of no other") {
  const Result<Scene> scene = make_scene("box-on-wall");
  REQUIRE_MESSAGE(scene, scene.error());
  auto loaded = load_scene(*scene);
  REQUIRE_MESSAGE(loaded, loaded.error());
  for (const bool warp : {true, false}) {
    CAPTURE(warp);
    SolidMesh solid = solids::block({0.2, 0.03, 0.01}, {4, 2, 2});
    fix_box(solid, {0, 0, 0}, {0, 0.03, 0.01});
    ReduceOptions options;
    options.modes = 4, options.warp = warp;
    Result<ReducedModel> model = reduce(solid, options);
    REQUIRE_MESSAGE(model, model.error());
    (*loaded)->bends[0] = std::make_unique<const ReducedModel>(std::move(*model));
    view::Envelope envelope;
    std::vector<std::string> remarks;
    const auto body = view::draw_scene(**loaded, {}, envelope, remarks)["bodies"][0];
    CHECK(body["modes"] == 4);
    CHECK(body["mode_step"].get<double>() > 0);
    CHECK(body.contains("turn_step") == warp);
    CHECK((envelope.pack({}).find("\"turns0\"") != std::string::npos) == warp);
  }
}
