// SPDX-License-Identifier: Apache-2.0
#include "io/experiments/map/figures.h"

#include <algorithm>

namespace h6::cli {
namespace {

MapForce force_of(MapGroup group) {
  if (group == kAtHalfVoxelForce) return kHalfVoxelForce;
  return group == kAtSceneForce ? kSceneForce : kPushForce;
}

bool belongs(const MapVariation& v, MapGroup group) {
  if (!v.error.empty()) return false;
  if (force_of(group) != kPushForce) return true;
  return (v.change.push <= kGentlePush) == (group == kGentlyPushed);
}

void count(const MapRun& run, GroupFigures& out) {
  ++out.runs;
  out.torque_noise = out.torque_noise || run.torque_noise;
  if (!run.error.empty()) return void(++out.failed);
  out.held += run.held;
  out.shallow += run.held && run.depth <= 0.5;
  out.chatters += run.verdict == io::Verdict::chatters;
  out.through += run.verdict == io::Verdict::through;
  out.unstable += run.verdict == io::Verdict::unstable;
  out.stuck += run.verdict == io::Verdict::stuck;
  out.depths.push_back(run.depth);
}

void compare(const MapVariation& v, int table, std::size_t method, PairFigures& out) {
  int more = 0;
  for (int force = 0; force < kMapForces; ++force)
    more += v.run(table, force, method).held - v.run(table, force, 0).held;
  ++out.pairs;
  out.holds_more += more > 0, out.holds_fewer += more < 0;
  out.better += more > 0, out.worse += more < 0;
  const MapRun &a = v.run(table, kSceneForce, method), &b = v.run(table, kSceneForce, 0);
  if (!a.held || !b.held || b.depth <= 0) return;
  const double ratio = a.depth / b.depth;
  out.depth_ratios.push_back(ratio);
  if (more == 0) out.better += ratio<0.99, out.worse += ratio> 1.01;
}

const char* table_words(int table) {
  return table == kEqualStiffness ? "At equal stiffness" : "At equal wall stiffness";
}

std::string percent(double share) { return number(100 * share, 1) + " %"; }

std::string of_scenes(const std::vector<std::string>& names, std::size_t all) {
  std::string out = std::to_string(names.size()) + " of " + std::to_string(all) + " scenes (";
  for (std::size_t i = 0; i < names.size(); ++i) out += (i ? ", " : "") + names[i];
  return out + ")";
}

// The names of the scenes in which `sign` is the one asked for; no sentence when there are none.
void add_scenes(const std::vector<const MapScene*>& scenes, Sign wanted, const std::string& before,
                const std::string& after, const std::function<Sign(const MapScene*)>& sign,
                std::vector<std::string>& out) {
  std::vector<std::string> names;
  for (const MapScene* scene : scenes)
    if (sign(scene) == wanted) names.push_back(scene->name);
  if (!names.empty()) out.push_back(before + of_scenes(names, scenes.size()) + after);
}

void compare_with_first(const std::vector<const MapScene*>& scenes,
                        const std::vector<MethodColumn>& methods, int table, std::size_t m,
                        std::vector<std::string>& out) {
  const std::string name = "`" + methods[m].name + "`", first = "`" + methods[0].name + "`";
  const std::string begin = std::string(table_words(table)) + " " + name;
  const auto holds = [&](const MapScene* scene) {
    const PairFigures p = pair_figures({scene}, table, m);
    return sign_of(p.holds_more, p.holds_fewer);
  };
  const auto depth = [&](const MapScene* scene) {
    return sign_of_ratio(pair_figures({scene}, table, m).depth_ratios);
  };
  const std::string than = " than " + first + ".";
  add_scenes(scenes, Sign::more, begin + " holds more in ", than, holds, out);
  add_scenes(scenes, Sign::fewer, begin + " holds fewer in ", than, holds, out);
  add_scenes(scenes, Sign::fewer, begin + " is shallower in ", than, depth, out);
  add_scenes(scenes, Sign::more, begin + " is deeper in ", than, depth, out);

  const PairFigures all = pair_figures(scenes, table, m);
  if (const Sign sign = sign_of(all.holds_more, all.holds_fewer); sign != Sign::open) {
    const std::size_t differ = all.holds_more + all.holds_fewer;
    const Interval i = exact_share(all.holds_more, differ);
    out.push_back(begin + " holds " + (sign == Sign::more ? "more" : "fewer") + than + " Of " +
                  std::to_string(differ) +
                  " variations in which the two differ, it holds more in " +
                  std::to_string(all.holds_more) + " (" +
                  percent(static_cast<double>(all.holds_more) / static_cast<double>(differ)) +
                  ", interval " + percent(i.low) + " to " + percent(i.high) + ").");
  }
  if (const Sign sign = sign_of_ratio(all.depth_ratios); sign != Sign::open) {
    const Interval i = *median_interval(all.depth_ratios);
    out.push_back(begin + " is " + (sign == Sign::more ? "deeper" : "shallower") + than +
                  " The median ratio of depths is " + number(quantile(all.depth_ratios, 0.5), 3) +
                  " (interval " + number(i.low, 3) + " to " + number(i.high, 3) + ").");
  }
}

// Whether a goal is reached, missed, or not decided by so few runs.
void judge_goal(const GroupFigures& g, double goal, const std::string& begin,
                std::vector<std::string>& out) {
  if (g.runs == 0) return;
  const Interval i = wilson(g.held, g.runs);
  const char* verdict = i.low >= goal ? "reached" : i.high < goal ? "missed" : "not decided";
  out.push_back(begin + percent(static_cast<double>(g.held) / static_cast<double>(g.runs)) +
                " (interval " + percent(i.low) + " to " + percent(i.high) + "); the goal of " +
                number(100 * goal, 0) + " % is " + verdict + ".");
}

// Whether runs at the force of half a voxel stay that shallow.
void judge_depth(const GroupFigures& g, const std::string& begin, std::vector<std::string>& out) {
  if (g.depths.empty()) return;
  const auto deeper = g.depths.end() - std::upper_bound(g.depths.begin(), g.depths.end(), 0.5);
  out.push_back(begin + "is at most " + number(g.depths.back(), 2) +
                " voxels deep, and deeper than "
                "half a voxel in " +
                std::to_string(deeper) + " of " + std::to_string(g.depths.size()) +
                " runs; the goal of half a voxel is " + (deeper ? "missed." : "reached."));
}

// The goals, for all scenes or for those with implicit steps.
void judge_goals(const std::vector<const MapScene*>& scenes, int table, std::size_t m,
                 const std::string& begin, const std::string& where,
                 std::vector<std::string>& out) {
  judge_goal(group_figures(scenes, table, kAtSceneForce, m), 0.99,
             begin + "holds the scene's force" + where + " in ", out);
  judge_goal(
      group_figures(scenes, table, kGentlyPushed, m), 0.8,
      begin + "holds pushes up to " + number(kGentlePush, 0) + " times the force" + where + " in ",
      out);
  judge_depth(group_figures(scenes, table, kAtHalfVoxelForce, m),
              begin + "with the force of half a voxel" + where + " ", out);
}

}  // namespace

std::vector<const MapScene*> run_scenes(const std::vector<MapScene>& scenes) {
  std::vector<const MapScene*> out;
  for (const MapScene& scene : scenes)
    if (scene.left_out.empty()) out.push_back(&scene);
  return out;
}

std::vector<const MapScene*> implicit_scenes(const std::vector<const MapScene*>& scenes) {
  std::vector<const MapScene*> out;
  for (const MapScene* scene : scenes)
    if (!scene->explicit_steps) out.push_back(scene);
  return out;
}

GroupFigures group_figures(const std::vector<const MapScene*>& scenes, int table, MapGroup group,
                           std::size_t method) {
  GroupFigures out;
  for (const MapScene* scene : scenes)
    for (const MapVariation& v : scene->variations)
      if (belongs(v, group)) count(v.run(table, force_of(group), method), out);
  std::sort(out.depths.begin(), out.depths.end());
  return out;
}

PairFigures pair_figures(const std::vector<const MapScene*>& scenes, int table,
                         std::size_t method) {
  PairFigures out;
  for (const MapScene* scene : scenes)
    for (const MapVariation& v : scene->variations)
      if (v.error.empty()) compare(v, table, method, out);
  std::sort(out.depth_ratios.begin(), out.depth_ratios.end());
  return out;
}

Sign sign_of(std::size_t more, std::size_t fewer) {
  const Interval i = exact_share(more, more + fewer);
  return i.low > 0.5 ? Sign::more : i.high < 0.5 ? Sign::fewer : Sign::open;
}

Sign sign_of_ratio(const std::vector<double>& ratios) {
  const std::optional<Interval> i = median_interval(ratios);
  return !i ? Sign::open : i->low > 1 ? Sign::more : i->high < 1 ? Sign::fewer : Sign::open;
}

std::vector<std::string> map_conclusions(const std::vector<MapScene>& all,
                                         const std::vector<MethodColumn>& methods) {
  const std::vector<const MapScene*> scenes = run_scenes(all);
  const std::vector<const MapScene*> implicit = implicit_scenes(scenes);
  std::vector<std::string> out;
  for (int table = 0; table < kMapTables; ++table)
    for (std::size_t m = 0; m < methods.size(); ++m) {
      if (table == kEqualWall && m == 0) continue;  // its runs are those of the other table
      const std::string begin = std::string(table_words(table)) + " `" + methods[m].name + "` ";
      if (m > 0) compare_with_first(scenes, methods, table, m, out);
      judge_goals(scenes, table, m, begin, "", out);
      if (implicit.size() < scenes.size())
        judge_goals(implicit, table, m, begin, " with implicit steps", out);
    }
  return out;
}

}  // namespace h6::cli
