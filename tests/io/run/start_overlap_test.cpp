// SPDX-License-Identifier: Apache-2.0
// start_overlap_test.cpp - a run names the parts that overlap at its start, and refuses those whose
// depth the field does not know.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>

#include "hapsix/vector.h"
#include "io/experiments/run.h"
#include "io/run/run_setup.h"
#include "io/scenes/scenes.h"
#include "io/scenes/shapes.h"
#include "tests/io/load.h"

using namespace h6;
using namespace h6::cli;
using h6::test::load;
using io::kMm;

namespace {

namespace fs = std::filesystem;

using Loaded = std::unique_ptr<io::LoadedScene>;

// The peg in its hole of 10.3 mm, in voxels of 1 mm; its side overlaps the hole by `overlap`.
io::Scene tight_peg(double overlap) {
  io::Scene scene = *io::make_scene("peg-in-hole");
  scene.unit = io::Unit::mm;
  io::PointCloud& cloud = *scene.bodies[1].shell->points;
  const auto wider = static_cast<float>((10.3 * kMm + overlap) / (10 * kMm));
  for (std::size_t i = 0; i < cloud.x.size(); ++i) cloud.x[i] *= wider, cloud.y[i] *= wider;
  return scene;
}

std::size_t lines(const std::string& text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

}  // namespace

TEST_CASE("a peg that is too wide for its hole is named, with its depth and place") {
  const Loaded l = load(tight_peg(0.7 * kMm));
  RunSetup run(*l);
  REQUIRE(run.open());
  REQUIRE(run.overlaps.size() == 1);
  const PartOverlap& o = run.overlaps[0];
  CHECK((o.part == "peg" && o.with == "block"));
  CHECK(o.depth_voxels == doctest::Approx(0.7).epsilon(0.05));
  CHECK(o.depth == doctest::Approx(0.7 * kMm).epsilon(0.05));
  CHECK(std::hypot(o.place.x, o.place.y) == doctest::Approx(11 * kMm).epsilon(1e-5));
  CHECK(o.place.z < 0);               // in the hole
  CHECK(o.points > 60 * 40 * 2 / 3);  // 20 mm of its 30 mm are in the hole
  CHECK(o.relieved == o.points);
  CHECK(o.unknown == 0);
  CHECK(o.sentence.starts_with("'peg' overlaps 'block' at " + std::to_string(o.points) +
                               " points, 0.7"));
  CHECK(o.sentence.ends_with(" mm; relieved until free"));
  CHECK(lines(overlap_csv(*l, run.session.get())) == 1 + o.points);
}

TEST_CASE("a sentence says what the overlap does under `tight` and under play") {
  const Loaded l = load(tight_peg(0.7 * kMm));
  const auto said = [&](h6Fit fit, double offset) {
    RunSetup run(*l);
    run.def.contact.fit = fit, run.def.contact.fit_offset = offset;
    REQUIRE(run.open());
    REQUIRE(run.overlaps.size() == 1);
    const std::string& text = run.overlaps[0].sentence;
    return text.substr(text.find("; ") + 2);
  };
  CHECK(said(H6_FIT_RELIEVE, 0.3 * kMm) == "relieved until free");
  CHECK(said(H6_FIT_RELIEVE, 2 * kMm) == "within the play of fit_offset");
  CHECK(said(H6_FIT_TIGHT, 0) == "every depth pushes");
  CHECK(said(H6_FIT_TIGHT, 0.3 * kMm) == "every depth beyond fit_offset pushes");
  CHECK(said(H6_FIT_TIGHT, 2 * kMm) == "within the play of fit_offset");
}

TEST_CASE("a peg with clearance overlaps nothing") {
  const Loaded l = load(tight_peg(-0.1 * kMm));
  RunSetup run(*l);
  REQUIRE(run.open());
  CHECK(run.overlaps.empty());
  CHECK(lines(overlap_csv(*l, run.session.get())) == 1);
}

TEST_CASE("a start deeper than three voxels is refused by name, unless every depth shall push") {
  for (const double overlap : {2.8, 3.3, 5.0}) {
    CAPTURE(overlap);
    const Loaded l = load(tight_peg(overlap * kMm));
    RunSetup run(*l);
    run.record = (h6::test::private_cache.folder / "deep.h5").string();
    const Outcome opened = run.open();
    CHECK(static_cast<bool>(opened) == (overlap < H6_DEEPEST_FIT));
    if (opened) continue;
    CHECK(!run.recorder);
    CHECK(!fs::exists(run.record + ".part"));
    for (const char* word : {"'peg'", "'block'", " mm) deep at (", "\"fit\": \"tight\""}) {
      CAPTURE(word);
      CHECK(opened.error().find(word) != std::string::npos);
    }
    RunSetup tight(*l);
    tight.def.contact.fit = H6_FIT_TIGHT;
    REQUIRE(tight.open());
    REQUIRE(tight.overlaps.size() == 1);
    CHECK(tight.overlaps[0].depth_voxels > H6_DEEPEST_FIT);
    CHECK(tight.overlaps[0].relieved == 0);
  }
}

TEST_CASE("a peg that is pulled out of its tight hole has passed through nothing") {
  for (const double overlap : {0.2, 0.7, 1.6, 2.8}) {
    CAPTURE(overlap);
    const Loaded l = load(tight_peg(overlap * kMm));
    RunChange change;
    change.method = {"robust", "robust", 0};
    const h6Pose start = l->scene.hands[0].path[0].pose;
    const io::Path out_of_hole =
        io::HandPath(start).move_by({0, 0, 40 * kMm}, 40 * kMm).wait(0.2).rows();
    change.path = &out_of_hole;
    const RunFigures out = run_experiment(*l, change);
    CHECK(out.error == "");
    CHECK(!out.through.first);
    CHECK(out.verdict == io::Verdict::untouched);
    CHECK(out.final_pose.p.z > start.p.z + 39 * kMm);
  }
}

TEST_CASE("of several obstacles the one that the part overlaps is named, and which of its parts") {
  io::Scene scene = io::common_scene("three", "");
  io::Mesh posts = io::box_mesh({-20 * kMm, 0, 0}, {-10 * kMm, 10 * kMm, 10 * kMm});
  const io::Mesh right = io::box_mesh({20 * kMm, 0, 0}, {30 * kMm, 10 * kMm, 10 * kMm});
  const auto first = static_cast<std::uint32_t>(posts.vertices.size());
  posts.part.assign(posts.triangles.size(), 0);
  posts.vertices.insert(posts.vertices.end(), right.vertices.begin(), right.vertices.end());
  for (const auto& t : right.triangles) {
    posts.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    posts.part.push_back(1);
  }
  posts.part_names = {"left post", "right post"};
  scene.bodies.push_back(
      io::obstacle("floor", io::box_mesh({-0.05, -0.05, -0.05}, {0.05, 0.05, -0.01}), kMm));
  scene.bodies.push_back(io::obstacle("posts", posts, kMm));
  io::SceneBody tip;
  tip.name = "tip";
  tip.com = h6Vec3{0, 0, 0};
  tip.inertia = io::box_inertia(tip.mass, {kMm, kMm, kMm});
  tip.pose.p = {20.8 * kMm, 5 * kMm, 5 * kMm};
  tip.shell.emplace();
  io::add_face(tip.shell->points.emplace(), {0, 0, 0}, {0, kMm, 0}, {0, 0, kMm}, 2, 2, {-1, 0, 0});
  tip.shell->bake.levels = 1;
  scene.bodies.push_back(tip);
  const Loaded l = load(std::move(scene));
  RunSetup run(*l);
  REQUIRE(run.open());
  REQUIRE(run.overlaps.size() == 1);
  const PartOverlap& o = run.overlaps[0];
  CHECK((o.part == "tip" && o.with == "posts" && o.with_part == "right post"));
  CHECK(o.points == 4);
  CHECK(o.depth == doctest::Approx(0.8 * kMm).epsilon(1e-3));
  CHECK(o.sentence.find("in 'right post'") != std::string::npos);
  CHECK(overlap_csv(*l, run.session.get()).find("\n\"tip\",\"posts\",0,") != std::string::npos);
}
