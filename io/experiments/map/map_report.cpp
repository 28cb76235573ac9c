// SPDX-License-Identifier: Apache-2.0
#include "io/experiments/map/map_report.h"

#include <cstdio>
#include <map>

#include "io/file/csv.h"

namespace h6::cli {
namespace {

using nlohmann::ordered_json;

constexpr const char* kTableNames[kMapTables] = {"equal_stiffness", "equal_wall_stiffness"};
constexpr const char* kForceNames[kMapForces] = {"half_voxel", "scene", "push"};
constexpr const char* kGroupNames[kGroups] = {"half_voxel", "scene", "push_up_to_4",
                                              "push_above_4"};

std::string share_cell(std::size_t hits, std::size_t of) {
  if (of == 0) return "–";
  const Interval i = wilson(hits, of);
  const auto whole = [](double share) { return number(100 * share, 0); };
  return whole(static_cast<double>(hits) / static_cast<double>(of)) + " % [" + whole(i.low) + ", " +
         whole(i.high) + "]";
}

std::string depths(const std::vector<double>& sorted) {
  if (sorted.empty()) return "–";
  return number(quantile(sorted, 0.5), 2) + ", " + number(quantile(sorted, 0.95), 2) + ", " +
         number(sorted.back(), 2);
}

std::string ratios(const std::vector<double>& sorted) {
  if (sorted.empty()) return "–";
  const std::optional<Interval> i = median_interval(sorted);
  return number(quantile(sorted, 0.5), 2) +
         (i ? " [" + number(i->low, 2) + ", " + number(i->high, 2) + "]" : "");
}

// The cells of a method behind its name and its factor of k.
std::vector<std::string> cells(const std::vector<const MapScene*>& scenes, int table,
                               std::size_t method) {
  GroupFigures g[kGroups];
  for (int group = 0; group < kGroups; ++group)
    g[group] = group_figures(scenes, table, static_cast<MapGroup>(group), method);
  const GroupFigures &half = g[kAtHalfVoxelForce], &one = g[kAtSceneForce];
  std::vector<std::string> out = {share_cell(one.held, one.runs),
                                  depths(one.depths),
                                  std::to_string(one.chatters),
                                  std::to_string(one.through),
                                  share_cell(half.shallow, half.runs),
                                  share_cell(g[kGentlyPushed].held, g[kGentlyPushed].runs),
                                  share_cell(g[kHardPushed].held, g[kHardPushed].runs)};
  if (method == 0) return out.insert(out.end(), 2, "–"), out;
  const PairFigures pair = pair_figures(scenes, table, method);
  out.push_back(ratios(pair.depth_ratios));
  out.push_back(std::to_string(pair.better) + ", " + std::to_string(pair.worse));
  return out;
}

bool has_torque_noise(const std::vector<const MapScene*>& scenes, int table, std::size_t method) {
  for (int group = 0; group < kGroups; ++group)
    if (group_figures(scenes, table, static_cast<MapGroup>(group), method).torque_noise)
      return true;
  return false;
}

ordered_json interval_json(const Interval& i) { return ordered_json::array({i.low, i.high}); }

ordered_json group_json(const GroupFigures& g) {
  const auto share = [&](std::size_t hits) {
    return ordered_json{
        {"share", g.runs ? static_cast<double>(hits) / static_cast<double>(g.runs) : 0},
        {"interval", interval_json(wilson(hits, g.runs))}};
  };
  return {{"runs", g.runs},
          {"held", share(g.held)},
          {"held_within_half_a_voxel", share(g.shallow)},
          {"depth_voxels",
           {{"median", quantile(g.depths, 0.5)},
            {"p95", quantile(g.depths, 0.95)},
            {"most", quantile(g.depths, 1)}}},
          {"chatters", g.chatters},
          {"through", g.through},
          {"unstable", g.unstable},
          {"stuck", g.stuck},
          {"failed", g.failed},
          {"differs_by_processor", g.torque_noise}};
}

ordered_json pair_json(const PairFigures& p) {
  ordered_json out{
      {"variations", p.pairs},
      {"holds_more", p.holds_more},
      {"holds_fewer", p.holds_fewer},
      {"share_of_more", interval_json(exact_share(p.holds_more, p.holds_more + p.holds_fewer))},
      {"better", p.better},
      {"worse", p.worse}};
  if (!p.depth_ratios.empty()) {
    const std::optional<Interval> i = median_interval(p.depth_ratios);
    out["depth_ratio"] = {{"pairs", p.depth_ratios.size()},
                          {"median", quantile(p.depth_ratios, 0.5)},
                          {"interval", i ? interval_json(*i) : ordered_json(nullptr)}};
  }
  return out;
}

ordered_json figures_json(const std::vector<const MapScene*>& scenes, int table,
                          const std::vector<MethodColumn>& methods) {
  ordered_json out;
  for (std::size_t m = 0; m < methods.size(); ++m) {
    ordered_json& method = out[methods[m].name];
    if (scenes.size() == 1) method["stiffer"] = table == kEqualWall ? scenes[0]->stiffer[m] : 1.0;
    for (int group = 0; group < kGroups; ++group)
      method[kGroupNames[group]] =
          group_json(group_figures(scenes, table, static_cast<MapGroup>(group), m));
    if (m > 0) method["against_" + methods[0].name] = pair_json(pair_figures(scenes, table, m));
  }
  return out;
}

// The variations of a scene that a method does not hold, such as "scene chatters 3; push through 0
// 2 3".
std::string not_held(const MapScene& scene, int table, std::size_t method) {
  std::map<std::pair<int, std::string>, std::string> indices;
  for (const MapVariation& v : scene.variations)
    for (int force = 0; v.error.empty() && force < kMapForces; ++force)
      if (const MapRun& run = v.run(table, force, method); !run.held)
        indices[{force, run.error.empty() ? io::verdict_name(run.verdict) : run.error}] +=
            " " + std::to_string(v.index);
  std::string out;
  for (const auto& [how, list] : indices)
    out +=
        (out.empty() ? "" : "; ") + std::string(kForceNames[how.first]) + " " + how.second + list;
  return out;
}

std::string method_list(const std::vector<MethodColumn>& methods) {
  std::string out;
  for (const MethodColumn& m : methods) out += (out.empty() ? "" : ",") + m.name;
  return out;
}

std::string repeat_command(const MapOptions& o) {
  return "hapsix map --seed " + std::to_string(o.seed) + " --methods " + method_list(o.methods) +
         " --only SCENE:INDEX";
}

std::string change_text(const Variation& v) {
  char text[512];
  std::snprintf(text, sizeof text,
                "voxel %.3f, shift (%.3f, %.3f, %.3f) voxel, turn (%.3f, %.3f, %.3f, %.3f), "
                "density %.3f, jitter %.3f, mass %.3f, speed %.3f, step %.3f, push %.3f",
                v.voxel, v.shift.x, v.shift.y, v.shift.z, v.turn.w, v.turn.x, v.turn.y, v.turn.z,
                v.sampling.density, v.sampling.jitter, v.mass, v.speed, v.step, v.push);
  return text;
}

// Lists the runs of one variation.
TextTable one_variation(const MapVariation& v, const std::vector<MethodColumn>& methods) {
  TextTable out = {{"stiffness", "force", "[N]"}};
  for (const MethodColumn& m : methods) out[0].push_back(m.name);
  for (int table = 0; table < kMapTables; ++table)
    for (int force = 0; force < kMapForces; ++force) {
      out.push_back({table == kEqualStiffness ? "equal k" : "equal wall", kForceNames[force],
                     number(v.newtons[force], 2)});
      for (std::size_t m = 0; m < methods.size(); ++m) {
        const MapRun& run = v.run(table, force, m);
        out.back().push_back(run.error.empty() ? std::string(io::verdict_name(run.verdict)) + " " +
                                                     number(run.depth, 3)
                                               : run.error);
      }
    }
  return out;
}

constexpr const char* kAbout =
    "Every variation of a scene changes its voxels, the shift and turn of their lattice, the "
    "sampling of the shell, mass, speed and time step, all at once or one alone. Each method runs "
    "it under the scene's force (held, depth, chatters, through), under the force of half a voxel "
    "(≤ ½ voxel: held and never deeper than that; the largest torque, which a scene states for "
    "its own voxels, is scaled with them), and pushed 1.5 to 8 times as hard as the scene. "
    "Depths are median, 95th percentile and most of the runs' deepest points, in voxels. Shares "
    "have their 95 % interval (Wilson). The last two columns compare a method with the first one, "
    "variation by variation: the median ratio of depths where both hold the scene's force, with "
    "the interval of the sign test, and how often it is better (holds more of the three forces, or "
    "as many at a depth that is smaller by more than 1 %) and worse.";

}  // namespace

std::string MapReport::about() { return kAbout; }

std::string MapReport::first_error() const {
  for (const MapScene& scene : scenes)
    for (const MapVariation& v : scene.variations) {
      const std::string at = scene.name + ":" + std::to_string(v.index) + ": ";
      if (!v.error.empty()) return at + v.error;
      for (const MapRun& run : v.runs)
        if (!run.error.empty()) return at + run.error;
    }
  return "";
}

TextTable MapReport::table(int which) const {
  TextTable out = {{"scene", "method", "k ×", "held", "depth", "chatters", "through", "≤ ½ voxel",
                    "push ≤ 4×", "push > 4×", "depth / " + options.methods[0].name,
                    "better, worse"}};
  const std::vector<const MapScene*> all = run_scenes(scenes);
  const auto add = [&](const std::string& name, const std::vector<const MapScene*>& of) {
    for (std::size_t m = 0; m < options.methods.size(); ++m) {
      const std::string mark = has_torque_noise(of, which, m) ? " *" : "";
      const double stiffer = which == kEqualWall && of.size() == 1 ? of[0]->stiffer[m] : 1;
      out.push_back({m == 0 ? name : "", options.methods[m].name + mark,
                     which == kEqualWall && of.size() > 1 ? "" : number(stiffer, 2)});
      for (std::string& cell : cells(of, which, m)) out.back().push_back(std::move(cell));
    }
  };
  for (const MapScene* scene : all) add(scene->name, {scene});
  if (all.size() > 1) add("all", all);
  const std::vector<const MapScene*> implicit = implicit_scenes(all);
  if (implicit.size() > 1 && implicit.size() < all.size()) add("all, implicit steps", implicit);
  return out;
}

std::string MapReport::text(bool as_markdown) const {
  const auto drawn = [&](const TextTable& t) { return as_markdown ? markdown(t) : plain(t); };
  const std::string head = as_markdown ? "## " : "", item = as_markdown ? "- " : "  ";
  std::string out = as_markdown ? "# Robustness map\n\n" + about() + "\n\n" : "";
  if (options.only) {
    for (const MapScene* scene : run_scenes(scenes))
      for (const MapVariation& v : scene->variations)
        out += scene->name + ":" + std::to_string(v.index) + ": " + change_text(v.change) + "\n\n" +
               (v.error.empty() ? drawn(one_variation(v, options.methods)) : v.error + "\n");
    return out;
  }
  out += head + "Equal stiffness k\n\n" + drawn(table(kEqualStiffness)) + "\n";
  out += head + "Equal stiffness of a flat wall\n\n" + drawn(table(kEqualWall)) + "\n";
  bool noise = false;
  for (int t = 0; t < kMapTables; ++t)
    for (std::size_t m = 0; m < options.methods.size(); ++m)
      noise = noise || has_torque_noise(run_scenes(scenes), t, m);
  if (noise)
    out +=
        "* In some runs r is parallel to N and the torque direction is rounding noise: these "
        "figures differ from one processor to the next.\n\n";
  for (const MapScene& scene : scenes)
    if (!scene.left_out.empty()) out += "Left out: " + scene.name + ", " + scene.left_out + ".\n";
  std::string failures;
  for (const MapScene* scene : run_scenes(scenes)) {
    for (const MapVariation& v : scene->variations)
      if (!v.error.empty())
        failures += item + scene->name + ":" + std::to_string(v.index) + ": " + v.error + "\n";
    for (int t = 0; t < kMapTables; ++t)
      for (std::size_t m = 0; m < options.methods.size(); ++m)
        if (const std::string list = not_held(*scene, t, m);
            !list.empty() && !(t == kEqualWall && m == 0))
          failures += item + scene->name + ", " + options.methods[m].name +
                      (t == kEqualWall ? ", equal wall: " : ", equal k: ") + list + "\n";
  }
  if (!failures.empty())
    out += "\n" + head + "Variations that are not held; one alone: " + repeat_command(options) +
           "\n\n" + failures;
  const std::vector<std::string> sentences = map_conclusions(scenes, options.methods);
  if (!sentences.empty()) out += "\n" + head + "Conclusions\n\n";
  for (const std::string& sentence : sentences) out += item + sentence + "\n";
  return out;
}

ordered_json MapReport::json() const {
  ordered_json out{{"seed", options.seed},
                   {"variations", options.variations},
                   {"methods", ordered_json::array()},
                   {"compared_with", options.methods[0].name},
                   {"repeat", repeat_command(options)},
                   {"scenes", ordered_json::object()}};
  for (const MethodColumn& m : options.methods) out["methods"].push_back(m.name);
  for (const MapScene& scene : scenes) {
    ordered_json& at = out["scenes"][scene.name];
    if (!scene.left_out.empty()) {
      at["left_out"] = scene.left_out;
      continue;
    }
    for (int t = 0; t < kMapTables; ++t)
      at[kTableNames[t]] = figures_json({&scene}, t, options.methods);
    at["runs"] = ordered_json::array();
    for (const MapVariation& v : scene.variations) {
      ordered_json row{{"index", v.index}, {"change", change_text(v.change)}};
      if (!v.error.empty()) row["error"] = v.error;
      for (int t = 0; v.error.empty() && t < kMapTables; ++t)
        for (int f = 0; f < kMapForces; ++f)
          for (std::size_t m = 0; m < options.methods.size(); ++m) {
            const MapRun& run = v.run(t, f, m);
            ordered_json& to = row[kTableNames[t]][kForceNames[f]][options.methods[m].name];
            to = {{"verdict", io::verdict_name(run.verdict)}, {"depth_voxels", run.depth}};
            if (!run.error.empty()) to["error"] = run.error;
          }
      at["runs"].push_back(std::move(row));
    }
  }
  for (int t = 0; t < kMapTables; ++t)
    for (const auto& [name, of] : {std::pair{"all", run_scenes(scenes)},
                                   {"implicit_steps", implicit_scenes(run_scenes(scenes))}})
      out[name][kTableNames[t]] = figures_json(of, t, options.methods);
  if (const std::string error = first_error(); !error.empty()) out["error"] = error;
  out["conclusions"] = map_conclusions(scenes, options.methods);
  return out;
}

std::string MapReport::csv() const {
  std::string out =
      "scene,index,changes,voxel,shift_x,shift_y,shift_z,turn_w,turn_x,turn_y,turn_z,density,"
      "jitter,sampling_seed,mass,speed,step,push,table,force,newtons,method,stiffer,verdict,held,"
      "depth_voxels,late_speed,late_depth_swing_voxels,differs_by_processor,error\n";
  char text[512];
  for (const MapScene* scene : run_scenes(scenes))
    for (const MapVariation& v : scene->variations)
      for (int t = 0; v.error.empty() && t < kMapTables; ++t)
        for (int f = 0; f < kMapForces; ++f)
          for (std::size_t m = 0; m < options.methods.size(); ++m) {
            const Variation& c = v.change;
            const MapRun& run = v.run(t, f, m);
            std::snprintf(
                text, sizeof text,
                ",%zu,%s,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%llu,%.9g,%.9g,"
                "%.9g,%.9g,%s,%s,%.9g,",
                v.index, vary_name(kind_in_series(v.index)), c.voxel, c.shift.x, c.shift.y,
                c.shift.z, c.turn.w, c.turn.x, c.turn.y, c.turn.z, c.sampling.density,
                c.sampling.jitter, static_cast<unsigned long long>(c.sampling.seed), c.mass,
                c.speed, c.step, c.push, kTableNames[t], kForceNames[f], v.newtons[f]);
            out += scene->name + text + options.methods[m].name;
            std::snprintf(text, sizeof text, ",%.9g,%s,%d,%.9g,%.9g,%.9g,%d,",
                          t == kEqualWall ? scene->stiffer[m] : 1.0, io::verdict_name(run.verdict),
                          run.held, run.depth, run.late_speed, run.late_depth_swing,
                          run.torque_noise);
            out += text + (run.error.empty() ? "" : io::csv_quoted(run.error)) + "\n";
          }
  return out;
}

}  // namespace h6::cli
