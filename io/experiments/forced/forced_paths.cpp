// SPDX-License-Identifier: Apache-2.0
// forced_paths.cpp - parts forced through industrial assemblies on random paths.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "hapsix/vector.h"
#include "io/experiments/forced/way_out.h"
#include "io/experiments/grid.h"
#include "io/scenes/industrial/forced_path.h"
#include "io/scenes/scenes.h"

namespace h6::cli {
namespace {

struct Forced {
  const char* scene;
  const char* title;  // "... on N paths"
  const char* part;   // with its size
  io::Path (*way_in)();
  io::Pulls pulls;
};

const Forced& forced(const std::string& scene) {
  static const Forced kinds[] = {
      {"engine-bay",
       "The starter motor forced through the engine bay",
       "the starter motor of 56,823 points",
       io::starter_way_in,
       {5, 0.06, 0.5, 0.1}},
      {"landing-gear",
       "The actuator forced through the landing gear",
       "the actuator of 38,148 points",
       io::actuator_way_in,
       {5, 0.12, 0.4, 0.15}},
  };
  return scene == kinds[0].scene ? kinds[0] : kinds[1];
}

std::string about(const Forced& kind) {
  return std::string("The hand leads ") + kind.part +
         " part of the way in and then pulls it by up to " + number(1e3 * kind.pulls.reach, 0) +
         " mm to five random places, turning it by up to " + number(kind.pulls.turn, 1) +
         " rad, with the force of half a voxel. The table gives how many paths never touch, how "
         "many end with points that passed through a mesh, how many come to rest, how many go "
         "deeper than half a voxel, how many of these have no way out, how many could not run, and "
         "the least, median and greatest depth of their deepest contacts in voxels. A way out is "
         "a small motion that ends all contacts of the deepest frame; where the half-spaces of "
         "opposing contacts have no common interior there is none, and no rule can end the "
         "overlap. The angle is that between the push of the deepest contact and the slope of the "
         "field, in degrees: the median over the deeper paths, then over the others.";
}

// A run at the instant of its deepest contact.
struct DeepestInstant {
  double depth = 0, time = 0;    // [m], [s]
  std::optional<double> way{0};  // that ends all contacts (way_out) [m]
  double angle = 0;              // of the deepest contact's push against the field's slope [rad]

  void look(const h6FrameRecord& record, const h6Contacts& c, double lever) {
    const float* most = std::max_element(c.depth, c.depth + c.count);
    if (c.count == 0 || *most <= depth) return;
    const auto i = most - c.depth;
    depth = double{*most}, time = record.time, way = way_out(c, lever);
    const h6Vec3 push{c.nx[i], c.ny[i], c.nz[i]}, slope{c.gx[i], c.gy[i], c.gz[i]};
    const double cosine = dot(push, slope);
    angle = std::acos(std::clamp(cosine, -1.0, 1.0));
  }
};

nlohmann::ordered_json to_json(const RunFigures& run, const DeepestInstant& at) {
  nlohmann::ordered_json out{{"verdict", io::verdict_name(run.verdict)},
                             {"max_depth_voxels", run.max_depth_voxels},
                             {"contacts_max", run.contacts_max},
                             {"max_force", run.max_force},
                             {"max_torque", run.max_torque},
                             {"stopped",
                              {{"point", run.deepest.point},
                               {"triangle", run.deepest.triangle},
                               {"part", run.deepest.part}}},
                             {"deepest_at", at.time},
                             {"way_out", at.way ? nlohmann::ordered_json(*at.way) : nullptr},
                             {"push_against_slope_degrees", at.angle * 180 / std::numbers::pi}};
  if (run.through.first)
    out["through"] = {{"point", run.through.first->point},
                      {"triangle", run.through.first->triangle},
                      {"part", run.through.first->part},
                      {"time", run.through.first->time}};
  if (!run.error.empty()) out["error"] = run.error;
  return out;
}

std::string median_of(std::vector<double>& all) {
  if (all.empty()) return "–";
  std::sort(all.begin(), all.end());
  return number(all[all.size() / 2], 0);
}

// The runs of one method.
void add_method(const std::string& name, const RunFigures* runs, const DeepestInstant* deepest,
                std::size_t count, Study& out) {
  int untouched = 0, through = 0, held = 0, deep = 0, stuck = 0, failed = 0;
  std::vector<double> depths, p50, p99, angles[2];
  nlohmann::ordered_json each = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < count; ++i) {
    const RunFigures& run = runs[i];
    failed += !run.error.empty();
    untouched += run.error.empty() && run.never_touched();
    through += run.verdict == io::Verdict::through;
    held += run.moved_on();
    const bool deeper = run.max_depth_voxels > 0.5;
    deep += deeper, stuck += deeper && !deepest[i].way;
    angles[deeper].push_back(deepest[i].angle * 180 / std::numbers::pi);
    depths.push_back(run.max_depth_voxels);
    p50.push_back(run.frame_us_p50), p99.push_back(run.frame_us_p99);
    each.push_back(to_json(run, deepest[i]));
  }
  std::sort(depths.begin(), depths.end());
  std::sort(p50.begin(), p50.end()), std::sort(p99.begin(), p99.end());
  const double median = 0.5 * (depths[(count - 1) / 2] + depths[count / 2]);
  out.table.push_back(
      {name, std::to_string(untouched), std::to_string(through), std::to_string(held),
       std::to_string(deep), std::to_string(stuck), std::to_string(failed),
       number(depths.front(), 2) + ", " + number(median, 2) + ", " + number(depths.back(), 2),
       median_of(angles[1]) + ", " + median_of(angles[0]),
       number(p50[count / 2], 0) + ", " + number(p99[count / 2], 0)});
  out.json[name] = {{"untouched", untouched},    {"through", through},
                    {"at_rest", held},           {"deeper_than_half_a_voxel", deep},
                    {"of_these_without_a_way_out", stuck},
                    {"failed", failed},          {"of", count},
                    {"least", depths.front()},   {"median", median},
                    {"greatest", depths.back()}, {"runs", each}};
}

// The largest distance of a shell's points from its body's centre of mass [m].
double radius_of(const io::LoadedScene& loaded) {
  const h6BodyDef& body = loaded.bodies[static_cast<std::size_t>(loaded.hands[0].body)];
  double most = 0;
  for (const h6Vec3& p : loaded.watched_points()) most = std::max(most, norm(p - body.com));
  return most;
}

}  // namespace

Study study_forced_paths(const std::string& scene_name, const std::vector<MethodColumn>& columns,
                         const Console& console, std::size_t count) {
  const Forced& kind = forced(scene_name);
  Study out;
  out.title = std::string(kind.title) + " on " + std::to_string(count) + " paths";
  out.about = about(kind);
  auto scene = io::make_scene(kind.scene);
  if (!scene) return out;
  auto loaded = io::load_scene(std::move(*scene));
  if (!loaded) return out;
  std::vector<io::Path> paths;
  for (std::size_t i = 0; i < count; ++i)
    paths.push_back(io::forced_path(kind.way_in(), i, kind.pulls));
  std::vector<RunFigures> runs(columns.size() * count);
  std::vector<DeepestInstant> deepest(runs.size());
  const double lever = radius_of(**loaded);
  std::vector<std::function<void()>> jobs;
  for (std::size_t at = 0; at < runs.size(); ++at)
    jobs.push_back([&, at] {
      RunChange change;
      change.method = columns[at / count];
      change.path = &paths[at % count];
      change.each = [&look = deepest[at], lever](const h6FrameRecord& r, const h6Contacts& c) {
        look.look(r, c, lever);
      };
      runs[at] = run_experiment(**loaded, change);
    });
  run_jobs(jobs, console, "paths");
  out.table = {{"method", "untouched", "through", "at rest", "deeper than 0.5",
                "of these no way out", "failed", "depth", "angle [°]", "frame p50, p99 [µs]"}};
  for (std::size_t m = 0; m < columns.size(); ++m)
    add_method(columns[m].name, &runs[m * count], &deepest[m * count], count, out);
  return out;
}

}  // namespace h6::cli
