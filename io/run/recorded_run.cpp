// SPDX-License-Identifier: Apache-2.0
// recorded_run.cpp - writes the settings of a run as JSON and reads them back.
#include "io/run/recorded_run.h"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "io/file/json.h"
#include "io/scene/scene_file.h"
#include "io/scenes/scenes.h"

namespace h6::io {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

Json list(const h6Vec3& v) { return {v.x, v.y, v.z}; }
h6Vec3 vec3(const Json& v) {
  return {v.at(0).get<double>(), v.at(1).get<double>(), v.at(2).get<double>()};
}

// A whole number that fits. JSON's own reader makes some number of one that does not.
template <class Whole>
Whole whole(const Json& v) {
  if (!v.is_number_unsigned() || v.get<std::uint64_t>() > std::numeric_limits<Whole>::max())
    throw std::out_of_range("a whole number is out of range");
  return v.get<Whole>();
}

Json body_json(const h6BodyDef& b) {
  const h6Quat& q = b.pose.q;
  return {{"p", list(b.pose.p)},
          {"q", {q.w, q.x, q.y, q.z}},
          {"v", list(b.velocity.linear)},
          {"w", list(b.velocity.angular)},
          {"fixed", b.fixed},
          {"mass", b.mass},
          {"com", list(b.com)},
          {"inertia", b.inertia},
          {"translation_only", b.translation_only}};
}

h6BodyDef body_def(const Json& o) {
  h6BodyDef b = h6DefaultBodyDef();
  const Json& q = o.at("q");
  b.pose.p = vec3(o.at("p"));
  b.pose.q = {q.at(0).get<double>(), q.at(1).get<double>(), q.at(2).get<double>(),
              q.at(3).get<double>()};
  b.velocity = {vec3(o.at("v")), vec3(o.at("w"))};
  b.fixed = o.at("fixed").get<bool>();
  b.mass = o.at("mass").get<double>();
  b.com = vec3(o.at("com"));
  for (std::size_t i = 0; i < 6; ++i) b.inertia[i] = o.at("inertia").at(i).get<double>();
  b.translation_only = o.at("translation_only").get<bool>();
  return b;
}

Json rating_json(const h6DeviceCapabilities& c) {
  return {{"name", c.name},
          {"dof_in", c.dof_in},
          {"dof_out", c.dof_out},
          {"max_force", c.max_force},
          {"max_torque", c.max_torque},
          {"max_force_rate", c.max_force_rate},
          {"max_torque_rate", c.max_torque_rate},
          {"max_velocity", c.max_velocity},
          {"workspace_min", list(c.workspace_min)},
          {"workspace_max", list(c.workspace_max)},
          {"rate", c.rate},
          {"modes", c.modes},
          {"freeze_time", c.freeze_time},
          {"frame_time", c.frame_time}};
}

h6DeviceCapabilities rating(const Json& o) {
  h6DeviceCapabilities c{};
  std::snprintf(c.name, sizeof c.name, "%s", o.at("name").get<std::string>().c_str());
  c.dof_in = whole<std::uint32_t>(o.at("dof_in"));
  c.dof_out = whole<std::uint32_t>(o.at("dof_out"));
  c.max_force = o.at("max_force").get<double>();
  c.max_torque = o.at("max_torque").get<double>();
  c.max_force_rate = o.at("max_force_rate").get<double>();
  c.max_torque_rate = o.at("max_torque_rate").get<double>();
  c.max_velocity = o.at("max_velocity").get<double>();
  c.workspace_min = vec3(o.at("workspace_min"));
  c.workspace_max = vec3(o.at("workspace_max"));
  c.rate = o.at("rate").get<double>();
  c.modes = whole<std::uint32_t>(o.at("modes"));
  c.freeze_time = o.value("freeze_time", 0.0);  // older recordings lack these two keys
  c.frame_time = o.value("frame_time", false);
  return c;
}

// Where a part of the scene is now: in its old place or beside the recording. Empty if in neither.
fs::path find_part(const fs::path& was, const fs::path& recording) {
  const fs::path beside = recording.parent_path() / was.filename();
  for (const fs::path& place : {was, beside}) {
    std::error_code failed;
    if (fs::is_regular_file(place, failed)) return place;
  }
  return {};
}

Outcome find_file(fs::path& named, const std::string& body, const fs::path& recording) {
  const fs::path found = find_part(named, recording);
  if (found.empty())
    return Failure{"body '" + body + "': " + named.string() +
                   " is not there any more; put it back, or beside the recording"};
  named = found;
  return Done{};
}

// Generates the parts of a generated scene again.
Outcome take_parts(Scene& scene, const std::string& generated) {
  Result<Scene> made = make_scene(generated);
  if (!made) return made.failure();
  for (SceneBody& body : scene.bodies) {
    const auto same = std::find_if(made->bodies.begin(), made->bodies.end(),
                                   [&](const SceneBody& b) { return b.name == body.name; });
    if (same == made->bodies.end())
      return Failure{"the generated scene '" + generated + "' has no body '" + body.name +
                     "' any more: this is another version of the program"};
    body.field = std::move(same->field);
    body.shell = std::move(same->shell);
  }
  return Done{};
}

Outcome find_parts(Scene& scene, const RecordedRun& run, const fs::path& recording) {
  if (!run.generated.empty()) return take_parts(scene, run.generated);
  if (run.scene_file.empty())
    return Failure{
        "its scene was neither a file nor a generated one, so its parts cannot be found"};
  for (SceneBody& body : scene.bodies) {
    std::vector<fs::path*> files;
    if (body.field)
      files.push_back(body.field->mesh.empty() ? &body.field->file : &body.field->mesh);
    if (body.shell)
      files.push_back(body.shell->mesh.empty() ? &body.shell->file : &body.shell->mesh);
    if (body.shell && body.shell->bends) files.push_back(&body.shell->bends->file);
    for (fs::path* file : files)
      if (Outcome found = find_file(*file, body.name, recording); !found) return found;
  }
  return Done{};
}

Outcome same_assets(const LoadedScene& loaded, const RecordingHead& head) {
  if (loaded.assets.size() != head.asset_hashes.size())
    return Failure{"the scene has " + std::to_string(loaded.assets.size()) +
                   " different fields and shells now, " + std::to_string(head.asset_hashes.size()) +
                   " were recorded"};
  for (std::size_t i = 0; i < loaded.assets.size(); ++i) {
    const LoadedAsset& asset = loaded.assets[i];
    if (asset.hash == head.asset_hashes[i]) continue;
    return Failure{"the " + std::string(asset.is_field ? "field" : "shell") + " of body '" +
                   asset.body +
                   "' is not the one that was recorded: its file, or this program's way to bake "
                   "it, has changed since; use the old ones or record again"};
  }
  return Done{};
}

}  // namespace

std::string run_text(const RecordedRun& run) {
  Json bodies = Json::array(), ratings = Json::array();
  for (const h6BodyDef& body : run.bodies) bodies.push_back(body_json(body));
  for (const h6DeviceCapabilities& c : run.ratings) ratings.push_back(rating_json(c));
  const Json all = {{"generated", run.generated},
                    {"scene_file", run.scene_file.string()},
                    {"units", unit_name(run.unit)},
                    {"threads", run.threads},
                    {"virtual_time", run.virtual_time},
                    {"max_contacts", run.max_contacts},
                    {"max_pairs", run.max_pairs},
                    {"frame_budget_us", run.frame_budget_us},
                    {"gravity", list(run.gravity)},
                    {"bodies", bodies},
                    {"ratings", ratings}};
  return all.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string settings_text(const h6ContactDef& contact, const h6CouplingDef& coupling) {
  const Json exact = {{"method", h6MethodName(contact.method)},
                      {"pieces", contact.pieces},
                      {"stiffness", contact.stiffness},
                      {"epsilon", contact.epsilon},
                      {"epsilon_normal", contact.epsilon_normal},
                      {"epsilon_torque", contact.epsilon_torque},
                      {"hand_stiffness", coupling.stiffness},
                      {"hand_rotational_stiffness", coupling.rotational_stiffness},
                      {"max_depth_voxels", coupling.max_depth_voxels},
                      {"max_force", coupling.max_force},
                      {"max_torque", coupling.max_torque}};
  char stiffness[40] = "from the scene", text[160];
  if (contact.stiffness > 0)
    std::snprintf(stiffness, sizeof stiffness, "%.0f N/m", contact.stiffness);
  std::snprintf(text, sizeof text, "method %s, stiffness %s, saturation %.2f voxels ",
                h6MethodName(contact.method), stiffness, coupling.max_depth_voxels);
  return text + exact.dump();
}

Outcome take_settings(const std::string& text, h6ContactDef& contact, h6CouplingDef& coupling) {
  const std::size_t braces = text.find('{');
  const Failure unreadable{"what they became cannot be read: " + text.substr(0, 80)};
  if (braces == std::string::npos) return unreadable;
  try {
    const Json o = Json::parse(text.substr(braces));
    h6ContactDef to = contact;
    h6CouplingDef held = coupling;
    if (h6MethodFromName(o.at("method").get<std::string>().c_str(), &to.method, &to.pieces) != 0)
      return unreadable;
    to.pieces = whole<std::uint32_t>(o.at("pieces"));
    for (const auto& [key, value] : {std::pair{"stiffness", &to.stiffness},
                                     {"epsilon", &to.epsilon},
                                     {"epsilon_normal", &to.epsilon_normal},
                                     {"epsilon_torque", &to.epsilon_torque},
                                     {"max_depth_voxels", &held.max_depth_voxels},
                                     {"max_force", &held.max_force},
                                     {"max_torque", &held.max_torque}})
      *value = o.at(key).get<double>();
    // Older recordings have none, since nobody could change them then.
    held.stiffness = o.value("hand_stiffness", held.stiffness);
    held.rotational_stiffness = o.value("hand_rotational_stiffness", held.rotational_stiffness);
    contact = to;
    coupling = held;
    return Done{};
  } catch (const std::exception&) {
    return unreadable;
  }
}

std::string recorded_scene_text(Scene scene) {
  const auto make_absolute = [](fs::path& file) {
    std::error_code failed;
    if (!file.empty()) file = fs::absolute(file, failed);
  };
  const auto settle = [&](auto& source) {
    if (!source) return;
    if (!source->unit) source->unit = scene.unit;  // the scene's own changes below
    make_absolute(source->mesh), make_absolute(source->file);
  };
  for (SceneBody& body : scene.bodies) {
    settle(body.field), settle(body.shell);
    if (body.shell && body.shell->bends) make_absolute(body.shell->bends->file);
  }
  scene.unit = Unit::m;
  return scene_text(scene);
}

Result<RecordedRun> recorded_run(const RecordingHead& head) {
  if (head.run_json.empty())
    return Failure{"it does not say how it was run (made by " +
                   (head.program.empty() ? "another program" : head.program) +
                   "): record again with this one"};
  if (const Outcome json = check_json_text(head.run_json, "what it says of its run"); !json)
    return json.failure();
  try {
    const Json all = Json::parse(head.run_json);
    RecordedRun run;
    run.generated = all.at("generated").get<std::string>();
    run.scene_file = all.at("scene_file").get<std::string>();
    if (const Result<Unit> unit = unit_from_name(all.at("units").get<std::string>()); unit)
      run.unit = *unit;
    run.threads = whole<std::uint32_t>(all.at("threads"));
    run.virtual_time = all.at("virtual_time").get<bool>();
    run.max_contacts = whole<std::size_t>(all.at("max_contacts"));
    if (all.contains("max_pairs")) run.max_pairs = whole<std::size_t>(all["max_pairs"]);
    run.frame_budget_us = all.value("frame_budget_us", 0.0);
    run.gravity = vec3(all.at("gravity"));
    for (const Json& body : all.at("bodies")) run.bodies.push_back(body_def(body));
    for (const Json& c : all.at("ratings")) run.ratings.push_back(rating(c));
    if (run.ratings.size() != head.hands) return Failure{"it has not one rating for each hand"};
    return run;
  } catch (const std::exception& problem) {
    return Failure{std::string("what it says of its run cannot be read (") + problem.what() + ")"};
  }
}

Result<std::unique_ptr<LoadedScene>> load_recorded(const RecordingHead& head,
                                                   const RecordedRun& run,
                                                   const fs::path& recording,
                                                   const Progress& progress) {
  Result<Scene> scene = read_scene_text(head.scene_json, "its scene");
  if (!scene) return scene.failure();
  if (run.bodies.size() != scene->bodies.size())
    return Failure{"what it says of its run is of another number of bodies than its scene"};
  if (Outcome found = find_parts(*scene, run, recording); !found) return found.failure();
  scene->generated = run.generated;
  scene->file = run.scene_file;
  Result<std::unique_ptr<LoadedScene>> loaded = load_scene(std::move(*scene), progress);
  if (!loaded) return loaded;
  if (Outcome same = same_assets(**loaded, head); !same) return same.failure();
  (*loaded)->scene.unit = run.unit;  // for output
  for (std::size_t i = 0; i < run.bodies.size(); ++i) {
    h6BodyDef& body = (*loaded)->bodies[i];
    const std::int32_t shell = body.shell, field = body.field;
    body = run.bodies[i];
    body.shell = shell, body.field = field;
  }
  return loaded;
}

}  // namespace h6::io
