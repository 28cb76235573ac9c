// SPDX-License-Identifier: Apache-2.0
// forced_paths.cpp - the starter motor forced through its engine bay on random paths.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "hapsix/vector.h"
#include "io/experiments/grid.h"
#include "io/scenes/scenes.h"
#include "io/scenes/shapes.h"

namespace h6::cli {
namespace {

constexpr int kPulls = 5;
constexpr double kReach = 0.06;  // longest pull [m]
constexpr double kTurn = 0.5;    // largest turn [rad]
constexpr double kSpeed = 0.1;   // [m/s]

// A point of the unit ball.
h6Vec3 in_ball(std::mt19937_64& engine) {
  const auto random = [&] { return static_cast<double>(engine() >> 11) * 0x1p-53; };  // [0, 1)
  const double z = 2 * random() - 1, angle = 2 * std::numbers::pi * random();
  const double r = std::sqrt(1 - z * z), size = std::cbrt(random());
  return size * h6Vec3{r * std::cos(angle), r * std::sin(angle), z};
}

// The hand follows the scene's path up to somewhere on the way in. From there it pulls and turns
// the part five times, each time from the same place.
io::Path forced_path(const io::Path& way_in, double arrival, std::size_t index) {
  std::mt19937_64 engine(index + 1);
  const double part = 0.4 + 0.6 * static_cast<double>(engine() >> 11) * 0x1p-53;
  io::HandPath hand(way_in.front().pose);
  for (int i = 1; i <= 40; ++i) {
    const h6Pose next = io::sample_path(way_in, part * arrival * i / 40);
    hand.go_to(next, std::max(0.01, h6::norm(next.p - hand.pose().p) / kSpeed));
  }
  const h6Pose here = hand.pose();
  for (int i = 0; i < kPulls; ++i) {
    const h6Vec3 pull = kReach * in_ball(engine), turn = kTurn * in_ball(engine);
    hand.go_to({here.p + pull, h6::product(h6::turn_by(turn), here.q)}, kReach / kSpeed);
    hand.wait(0.1);
  }
  hand.wait(0.75);
  return hand.rows();
}

// The time at which the path is deepest in the bay: half of its waits are there.
double arrival_of(const io::Path& path) { return 0.5 * path.back().t; }

}  // namespace

Study study_forced_paths(const std::vector<MethodColumn>& columns, const Console& console,
                         std::size_t count) {
  Study out;
  out.title =
      "The starter motor forced on " + std::to_string(count) + " paths through the engine bay";
  out.about =
      "The hand leads the starter motor of 56,823 points part of the way into the bay and then "
      "pulls it by up to 60 mm to five random places, turning it by up to 0.5 rad, with the force "
      "of half a voxel. The table gives how many paths end with points that passed through a "
      "mesh, how many come to rest, how many go deeper than half a voxel, how many could not run, "
      "and the least, median "
      "and greatest depth of their deepest contacts in voxels.";
  auto scene = io::make_scene("engine-bay");
  if (!scene) return out;
  auto loaded = io::load_scene(std::move(*scene));
  if (!loaded) return out;
  const io::Path& way_in = (*loaded)->scene.hands[0].path;
  std::vector<io::Path> paths;
  for (std::size_t i = 0; i < count; ++i)
    paths.push_back(forced_path(way_in, arrival_of(way_in), i));
  std::vector<RunFigures> runs(columns.size() * count);
  std::vector<std::function<void()>> jobs;
  for (std::size_t at = 0; at < runs.size(); ++at)
    jobs.push_back([&, at] {
      RunChange change;
      change.method = columns[at / count];
      change.path = &paths[at % count];
      runs[at] = run_experiment(**loaded, change);
    });
  run_jobs(jobs, console, "paths");

  out.table = {{"method", "through", "at rest", "deeper than 0.5", "failed", "depth",
                "frame p50, p99 [µs]"}};
  for (std::size_t m = 0; m < columns.size(); ++m) {
    int through = 0, held = 0, deep = 0, failed = 0;
    std::vector<double> depths, p50, p99;
    nlohmann::ordered_json each = nlohmann::ordered_json::array();
    for (std::size_t i = 0; i < count; ++i) {
      const RunFigures& run = runs[m * count + i];
      failed += !run.error.empty();
      through += run.verdict == io::Verdict::through;
      held += run.moved_on();
      deep += run.max_depth_voxels > 0.5;
      depths.push_back(run.max_depth_voxels);
      p50.push_back(run.frame_us_p50), p99.push_back(run.frame_us_p99);
      each.push_back({{"verdict", io::verdict_name(run.verdict)},
                      {"max_depth_voxels", run.max_depth_voxels},
                      {"contacts_max", run.contacts_max}});
    }
    std::sort(depths.begin(), depths.end());
    std::sort(p50.begin(), p50.end()), std::sort(p99.begin(), p99.end());
    const double median = 0.5 * (depths[(count - 1) / 2] + depths[count / 2]);
    out.table.push_back(
        {columns[m].name, std::to_string(through), std::to_string(held), std::to_string(deep),
         std::to_string(failed),
         number(depths.front(), 2) + ", " + number(median, 2) + ", " + number(depths.back(), 2),
         number(p50[count / 2], 0) + ", " + number(p99[count / 2], 0)});
    out.json[columns[m].name] = {{"through", through},
                                 {"at_rest", held},
                                 {"deeper_than_half_a_voxel", deep},
                                 {"failed", failed},
                                 {"of", count},
                                 {"least", depths.front()},
                                 {"median", median},
                                 {"greatest", depths.back()},
                                 {"runs", each}};
  }
  return out;
}

}  // namespace h6::cli
