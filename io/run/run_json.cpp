// SPDX-License-Identifier: Apache-2.0
// run_json.cpp - makes the object that `run --json` prints.
#include <cstdio>
#include <nlohmann/json.hpp>

#include "io/mesh/mesh_file.h"
#include "io/run/run_scene.h"
#include "kernels/targets.h"

namespace h6::cli {

using nlohmann::ordered_json;

namespace {

// Histograms of lateness, one for each cause, with a bin for each power of ten.
ordered_json late_json(const h6LoopReport& report) {
  const auto bins = [](const h6LateHistogram& h) {
    static const char* const names[H6_LATE_BINS] = {"10",    "100",    "1000",
                                                    "10000", "100000", "longer"};
    ordered_json out = ordered_json::object();
    for (int i = 0; i < H6_LATE_BINS; ++i) out[names[i]] = h.frames[i];
    return out;
  };
  return {{"compute", bins(report.late_us_compute)},
          {"wakeup", bins(report.late_us_wakeup)},
          {"stolen", bins(report.late_us_stolen)}};
}

// Late frames by what made them late, as far as their neighbours tell.
ordered_json judged_json(const RunSummary& s) {
  ordered_json out = ordered_json::object();
  for (std::size_t i = 0; i < s.late.size(); ++i)
    out[io::late_cause_name(static_cast<io::LateCause>(i))] = s.late[i];
  return out;
}

ordered_json grant_json(const h6Granted& g) {
  return {{"core", g.core < 0 ? ordered_json() : ordered_json(g.core)},
          {"fifo", g.fifo},
          {"locked", g.locked},
          {"isolated", g.isolated},
          {"governor", g.governor[0] ? ordered_json(g.governor) : ordered_json()}};
}

// The causes on which the safety chain acted, for each hand.
ordered_json safety_json(const h6LoopReport& loop, std::size_t hands) {
  ordered_json all = ordered_json::array();
  for (std::size_t h = 0; h < hands; ++h) {
    const h6HandSafety& s = loop.hand[h];
    ordered_json causes = ordered_json::object();
    for (int c = 1; c < H6_CAUSE_COUNT; ++c)
      if (s.times[c] > 0)
        causes[h6CauseName(static_cast<h6Cause>(c))] = {{"times", s.times[c]},
                                                        {"frames", s.frames[c]}};
    all.push_back({{"state", h6DeviceStateName(s.state)},
                   {"fault", h6CauseName(s.fault)},
                   {"causes", causes}});
  }
  return all;
}

ordered_json spread(const Histogram& h) {
  return {{"p50", h.percentile(50)},
          {"p99", h.percentile(99)},
          {"p999", h.percentile(99.9)},
          {"max", h.max()}};
}

ordered_json pose_json(const h6Pose& p, double scale) {
  return {{"p", {p.p.x * scale, p.p.y * scale, p.p.z * scale}},
          {"q", {p.q.w, p.q.x, p.q.y, p.q.z}}};
}

// Lengths in the scene's units.
ordered_json through_json(const PopThroughReport& r, double scale) {
  ordered_json out{{"computed", r.left_out.empty()}, {"first", nullptr}};
  if (r.interrupted) out["interrupted"] = true;
  if (const auto& p = r.first)
    out["first"] = {{"time", p->time},
                    {"frame", p->frame},
                    {"free_time", p->free_time},
                    {"body", p->body},
                    {"point", p->point},
                    {"obstacle", p->obstacle},
                    {"triangle", p->triangle},
                    {"part", p->part},
                    {"place", {p->place.x * scale, p->place.y * scale, p->place.z * scale}}};
  return out;
}

// The first time in a forbidden box; null: never.
ordered_json forbidden_json(const RunTotals& run, double scale) {
  if (!run.forbidden) return nullptr;
  const h6Vec3 p = scale * run.forbidden->place;
  return {{"time", run.forbidden->time}, {"place", {p.x, p.y, p.z}}};
}

// Lengths in the scene's units.
ordered_json overlaps_json(const std::vector<PartOverlap>& overlaps, double scale) {
  ordered_json all = ordered_json::array();
  for (const PartOverlap& o : overlaps)
    all.push_back({{"part", o.part},
                   {"with", o.with},
                   {"with_part", o.with_part},
                   {"points", o.points},
                   {"relieved", o.relieved},
                   {"depth", o.depth * scale},
                   {"depth_voxels", o.depth_voxels},
                   {"place", {o.place.x * scale, o.place.y * scale, o.place.z * scale}}});
  return all;
}

ordered_json stages_json(const RunSummary& s) {
  ordered_json stages = ordered_json::object();
  for (int i = 0; i < H6_STAGE_COUNT; ++i)
    stages[h6StageName(static_cast<h6Stage>(i))] = spread(s.stage_us[static_cast<std::size_t>(i)]);
  return stages;
}

ordered_json events_json(const RunSummary& s) {
  ordered_json events = ordered_json::array();
  for (const io::RecordingEvent& e : s.events)
    events.push_back({{"t", e.time}, {"what", e.what}, {"detail", e.detail}});
  return events;
}

ordered_json status_json(h6Status bits) {
  ordered_json status = ordered_json::array();
  for (h6Status bit = 1; h6StatusName(bit); bit <<= 1)
    if (bits & bit) status.push_back(h6StatusName(bit));
  return status;
}

ordered_json assets_json(const io::LoadedScene& loaded) {
  ordered_json assets = ordered_json::array();
  for (const io::LoadedAsset& a : loaded.assets) {
    ordered_json asset{{"body", a.body},
                       {"kind", a.is_field ? "field" : "shell"},
                       {"from_cache", a.from_cache},
                       {"rebuilt", a.rebuilt},
                       {"seconds", a.seconds},
                       {"hash", a.hash}};
    if (a.is_field)
      asset.update({{"voxel_size", a.voxel_size},
                    {"finest_voxel", a.finest},
                    {"tolerance", a.tolerance},
                    {"dims", a.nodes},
                    {"bricks", a.bricks}});
    else
      asset.update({{"points", a.points}, {"levels", a.levels}, {"modes", a.modes}});
    assets.push_back(asset);
  }
  return assets;
}

}  // namespace

std::vector<std::string> remarks(const RunTotals& run) {
  std::vector<std::string> all;
  if (run.through.first) all.push_back(sentence(*run.through.first));
  all.insert(all.end(), run.through.left_out.begin(), run.through.left_out.end());
  if (!run.left_behind.empty()) all.push_back(run.left_behind);
  if (run.never_touched() && run.verdict != io::Verdict::untouched)
    all.push_back("untouched: no point of the part ever touched anything");
  return all;
}

ordered_json to_json(const RunSummary& s, const io::LoadedScene& loaded, bool virtual_time) {
  const double scale = 1 / io::metres(loaded.scene.unit);
  char hash[20];
  std::snprintf(hash, sizeof hash, "%016llx", static_cast<unsigned long long>(s.state_hash));
  ordered_json json{
      {"scene", loaded.scene.name},
      {"method", s.method},
      {"units", io::unit_name(loaded.scene.unit)},
      {"virtual_time", virtual_time},
      {"start_overlap", overlaps_json(s.overlaps, scale)},
      {"frames", s.loop.frames},
      {"contacts", {{"mean", s.contacts_mean}, {"max", s.contacts_max}}},
      {"max_depth_voxels", s.max_depth_voxels},
      {"verdict", io::verdict_name(s.verdict)},
      {"pop_through", through_json(s.through, scale)},
      {"forbidden", forbidden_json(s, scale)},
      {"remarks", remarks(s)},
      {"frame_us", spread(s.frame_us)},
      {"stage_us", stages_json(s)},
      {"wakeup_us", spread(s.wakeup_us)},
      {"deadline",
       {{"missed_compute", s.loop.late_compute},
        {"missed_wakeup", s.loop.late_wakeup},
        {"missed_stolen", s.loop.late_stolen},
        {"late_us", late_json(s.loop)},
        {"judged", judged_json(s)},
        {"host_stole_ms", s.host_stole_ms < 0 ? ordered_json() : ordered_json(s.host_stole_ms)}}},
      {"coarse",
       {{"frames", s.loop.coarse_frames}, {"missed_depth_voxels", s.missed_depth_voxels}}},
      {"final_pose", pose_json(s.final_pose, scale)},
      {"hand_pose", pose_json(s.hand_pose, scale)},
      {"max_force", s.max_force},
      {"max_torque", s.max_torque},
      {"status_bits", s.loop.status},
      {"status", status_json(s.loop.status)},
      {"fault", h6CauseName(s.loop.fault)},
      {"safety", safety_json(s.loop, loaded.hands.size())},
      {"watchdog_trips", s.loop.watchdog_trips},
      {"state_hash", hash},
      {"records_lost", s.loop.ring_overruns},
      {"records_with_inputs_only", s.loop.inputs_only},
      {"simd_target", kernels::target_name()},
      {"realtime", s.loop.granted},
      {"granted", grant_json(s.loop.grant)},
      {"assets", assets_json(loaded)},
      {"events", events_json(s)},
      {"events_dropped", s.events_dropped},
      {"interrupted", s.interrupted}};
  if (loaded.scene.net_stiffness) json["net_stiffness"] = {{"max", s.net_stiffness_max}};
  if (!s.recording.empty()) json["recording"] = s.recording;
  return json;
}

}  // namespace h6::cli
