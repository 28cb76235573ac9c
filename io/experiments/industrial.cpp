// SPDX-License-Identifier: Apache-2.0
// industrial.cpp - one industrial scene under every method: verdict, contacts, times, forces, depth
// against half a voxel, and which triangle stopped which point.
#include <algorithm>

#include "hapsix/vector.h"
#include "io/experiments/grid.h"
#include "io/experiments/plot.h"
#include "io/scenes/scenes.h"

namespace h6::cli {
namespace {

constexpr double kHalfVoxel = 0.5;

// What the paper's Fig. 10 shows of a run, frame by frame.
struct Trace {
  std::vector<double> t, contacts, frame_us, force, torque, depth;
  void add(const h6FrameRecord& r) {
    t.push_back(r.time);
    contacts.push_back(r.report.contacts);
    frame_us.push_back(r.report.frame_us);
    force.push_back(norm(r.command[0].wrench.force));
    torque.push_back(norm(r.command[0].wrench.torque));
    depth.push_back(r.report.max_depth_voxels);
  }
};

// The 99th percentile of the slowest method's frames [us].
double longest_but_few(const std::vector<Trace>& traces) {
  double out = 0;
  for (const Trace& trace : traces) {
    std::vector<double> us = trace.frame_us;
    if (us.empty()) continue;
    const auto at = us.begin() + static_cast<std::ptrdiff_t>(us.size() * 99 / 100);
    std::nth_element(us.begin(), at, us.end());
    out = std::max(out, *at);
  }
  return out;
}

std::string picture(const std::string& title, const std::vector<MethodColumn>& columns,
                    const std::vector<Trace>& traces) {
  const auto panel = [&](const char* name, std::vector<double> Trace::*what, double line) {
    Panel out;
    out.title = name, out.line = line;
    for (std::size_t m = 0; m < columns.size(); ++m)
      out.curves.push_back({columns[m].name, traces[m].t, traces[m].*what});
    return out;
  };
  Panel frames = panel("frame [µs]", &Trace::frame_us, 0);
  frames.most = 1.5 * longest_but_few(traces);  // others that run on the machine make spikes
  std::vector<Panel> panels = {
      panel("contacts", &Trace::contacts, 0), frames, panel("force [N]", &Trace::force, 0),
      panel("torque [N m]", &Trace::torque, 0),
      panel("deepest contact [voxel], dashed: half a voxel", &Trace::depth, kHalfVoxel)};
  return plot_svg(title, panels);
}

std::string stages(const RunFigures& r) {
  std::string out;
  for (int s = 0; s <= H6_STAGE_INTEGRATE; ++s)
    out += (s ? " / " : "") + number(r.stage_us_p50[static_cast<std::size_t>(s)], 1);
  return out;
}

std::string stopped_by(const RunFigures& r) {
  if (!(r.deepest.depth > 0)) return "–";
  return std::to_string(r.deepest.point) + " by " + std::to_string(r.deepest.triangle) + " of " +
         (r.deepest.part.empty() ? r.deepest.obstacle : r.deepest.part);
}

std::string passed(const RunFigures& r) {
  if (!r.through.first) return "–";
  const PopThrough& p = *r.through.first;
  return std::to_string(p.point) + " through " + std::to_string(p.triangle) + " of " +
         (p.part.empty() ? p.obstacle : p.part) + " at " + number(p.time, 2) + " s";
}

nlohmann::ordered_json to_json(const RunFigures& r) {
  nlohmann::ordered_json out{{"verdict", io::verdict_name(r.verdict)},
                             {"max_depth_voxels", r.max_depth_voxels},
                             {"within_half_a_voxel", r.max_depth_voxels <= kHalfVoxel},
                             {"contacts_max", r.contacts_max},
                             {"contacts_mean", r.touching_contacts_mean},
                             {"max_force", r.max_force},
                             {"max_torque", r.max_torque},
                             {"frame_us", {{"p50", r.frame_us_p50}, {"p99", r.frame_us_p99}}}};
  for (int s = 0; s < H6_STAGE_COUNT; ++s)
    out["stage_us_p50"][h6StageName(static_cast<h6Stage>(s))] =
        r.stage_us_p50[static_cast<std::size_t>(s)];
  if (r.deepest.depth > 0)
    out["stopped"] = {{"point", r.deepest.point},
                      {"triangle", r.deepest.triangle},
                      {"obstacle", r.deepest.obstacle},
                      {"part", r.deepest.part}};
  if (r.through.first)
    out["through"] = {{"point", r.through.first->point},
                      {"triangle", r.through.first->triangle},
                      {"part", r.through.first->part},
                      {"time", r.through.first->time}};
  if (!r.error.empty()) out["error"] = r.error;
  return out;
}

}  // namespace

Study study_industrial(const std::string& name, const std::vector<MethodColumn>& columns,
                       const Console& console) {
  Study out;
  out.title = name;
  auto scene = io::make_scene(name);
  if (!scene) return out.after = scene.error(), out;
  out.about = scene->about +
              " The table gives verdict and deepest contact in voxels, contacts (most, mean where "
              "any), median and 99th percentile of a frame in µs, the medians of its stages "
              "(traverse / contacts / weights / wrench / coupling / integrate), the greatest force "
              "and torque of the hand, which point the deepest contact stopped by which triangle, "
              "and the first point that passed through one.";
  auto loaded = io::load_scene(std::move(*scene));
  if (!loaded) return out.after = loaded.error(), out;
  std::vector<RunFigures> runs(columns.size());
  std::vector<Trace> traces(columns.size());
  std::vector<std::function<void()>> jobs;
  for (std::size_t m = 0; m < columns.size(); ++m)
    jobs.push_back([&, m] {
      RunChange change;
      change.method = columns[m];
      change.each = [&trace = traces[m]](const h6FrameRecord& r, const h6Contacts&) { trace.add(r); };
      runs[m] = run_experiment(**loaded, change);
    });
  run_jobs(jobs, console, name);
  out.table = {{"method", "verdict, deepest", "contacts", "frame p50, p99", "stages", "force [N]",
                "torque [N m]", "stopped", "passed"}};
  for (std::size_t m = 0; m < columns.size(); ++m) {
    const RunFigures& r = runs[m];
    out.table.push_back(
        {columns[m].name, cell(r),
         std::to_string(r.contacts_max) + ", " + number(r.touching_contacts_mean, 0),
         number(r.frame_us_p50, 0) + ", " + number(r.frame_us_p99, 0), stages(r),
         number(r.max_force, 2), number(r.max_torque, 3), stopped_by(r), passed(r)});
    out.json[columns[m].name] = to_json(r);
  }
  out.picture = picture(name, columns, traces);
  return out;
}

}  // namespace h6::cli
