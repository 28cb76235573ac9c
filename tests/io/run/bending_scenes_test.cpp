// SPDX-License-Identifier: Apache-2.0
// bending_scenes_test.cpp - generated scenes with a body that bends: a clip and a hose.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "io/experiments/run.h"
#include "io/mesh/mesh.h"
#include "io/scenes/scenes.h"
#include "io/scenes/shapes.h"
#include "tests/io/load.h"

using namespace h6;
using namespace h6::cli;
using io::kMm;

namespace {

io::Scene made(const std::string& name) {
  Result<io::Scene> scene = io::make_scene(name);
  REQUIRE_MESSAGE(scene, scene.error());
  return std::move(*scene);
}

}  // namespace

TEST_CASE("what bends in a scene is closed, and has the volume of its elements' hull") {
  struct Case {
    const char* scene;
    double volume;  // of the shape that was meant [mm^3]
  };
  // A strip of 2 x 12 mm along arcs of 110 and 85 degrees; a tube of 24 sides.
  for (const Case& at : {Case{"clip-and-rod", 2 * 12 * 2 * (1.9199 * 11.1 + 1.4835 * 4)},
                         Case{"hose-in-bracket", 180 * 12 * 0.258819 * (36 - 16)}}) {
    CAPTURE(at.scene);
    const io::Scene scene = made(at.scene);
    const io::MeshAudit skin = io::audit(*scene.bodies[0].shell->mesh_data);
    CHECK(skin.closed);
    CHECK(skin.flipped_edges == 0);
    CHECK(skin.components == 1);
    CHECK(skin.volume * 1e9 == doctest::Approx(at.volume).epsilon(0.01));
    CHECK(io::audit(*scene.bodies[1].field->mesh_data).closed);
  }
}

TEST_CASE("a rod snaps into the clip, rests in it against a pull, and comes out") {
  const auto loaded = h6::test::load(made("clip-and-rod"));
  for (const h6Method method : {H6_METHOD_FIRM, H6_METHOD_SERIES, H6_METHOD_ROBUST}) {
    CAPTURE(std::string(h6MethodName(method)));
    RunChange change;
    change.method.method = change.method.name = h6MethodName(method);
    double resists = 0, farthest = 0, pulled = 0, left_behind = 0;
    change.each = [&](const h6FrameRecord& r, const h6Contacts&) {
      const double hand = r.hand[0].pose.p.z, rod = r.body[0].pose.p.z;
      const double lift = r.command[0].wrench.force.z;
      if (r.time < 0.45) resists = std::min(resists, lift);  // on the way in it is pushed down
      farthest = std::max(farthest, rod);
      // The hand rests 1 mm below the rod's seat.
      if (std::fabs(hand + 1 * kMm) < 1e-9 && r.hand[0].velocity.linear.z == 0)
        pulled = lift, left_behind = rod - hand;
    };
    const RunFigures run = run_experiment(*loaded, change);
    CHECK(run.error == "");
    CHECK(std::string(io::verdict_name(run.verdict)) == "arrived");
    CHECK(run.max_depth_voxels < 0.5);
    CHECK(resists < -0.5);
    CHECK(farthest < 1 * kMm);
    CHECK(pulled > 0.1);
    CHECK(left_behind > 0.1 * kMm);
  }
}

TEST_CASE("a hose is bent aside by its bracket, and rests there and straight again") {
  const auto loaded = h6::test::load(made("hose-in-bracket"));
  for (const h6Method method : {H6_METHOD_FIRM, H6_METHOD_SERIES, H6_METHOD_ROBUST}) {
    CAPTURE(std::string(h6MethodName(method)));
    RunChange change;
    change.method.method = change.method.name = h6MethodName(method);
    double aside = 0, back = 0;
    change.each = [&](const h6FrameRecord& r, const h6Contacts&) {
      aside = std::max(aside, r.body[0].pose.p.z);
      back = std::min(back, r.command[0].wrench.force.z);
    };
    const RunFigures run = run_experiment(*loaded, change);
    CHECK(run.error == "");
    CHECK(std::string(io::verdict_name(run.verdict)) == "arrived");
    CHECK(run.max_depth_voxels < 0.5);
    CHECK(aside > 8 * kMm);  // the eye alone has 0.4 mm of play
    CHECK(back < -0.5);
  }
}
