// SPDX-License-Identifier: Apache-2.0
// info_command.cpp - hapsix info FILE: describes a file and its defects.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>

#include "io/cli/commands.h"
#include "io/console/checks.h"
#include "io/deform/deformable_file.h"
#include "io/field/field_file.h"
#include "io/mesh/mesh_file.h"
#include "io/record/recording.h"
#include "io/run/recorded_run.h"
#include "io/scene/scene_file.h"
#include "io/shell/shell_file.h"

namespace h6::cli {
namespace {

using nlohmann::ordered_json;

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  return text;
}

// Formats a value as text: a list of plain values as one line, an object as its plain members.
std::string text_of(const ordered_json& value) {
  if (value.is_string())
    return value.get_ref<const std::string&>().empty() ? "-" : value.get<std::string>();
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  if (value.is_number_float()) {
    char text[32];
    std::snprintf(text, sizeof text, "%.6g", value.get<double>());
    return text;
  }
  if (!value.is_structured()) return value.is_null() ? "-" : value.dump();
  std::string out;
  for (const auto& [key, member] : value.items()) {
    if (value.is_object() && member.is_structured()) continue;
    out += (out.empty() ? "" : ", ") + (value.is_object() ? key + " " : "") + text_of(member);
  }
  return out.empty() ? "-" : out;
}

// Prints the facts of the JSON, one line for each key and for each object of a list.
void print(const ordered_json& object) {
  for (const auto& [key, value] : object.items()) {
    const bool list = value.is_array() && !value.empty() && value.front().is_object();
    if (!list)
      std::printf("%-18s %s\n", key.c_str(), printable(text_of(value)).c_str());
    else
      for (std::size_t i = 0; i < value.size(); ++i)
        std::printf("%-18s %s\n", i == 0 ? key.c_str() : "", printable(text_of(value[i])).c_str());
  }
}

int show(const Console& console, const ordered_json& object) {
  console.result(object);
  if (!console.json) print(object);
  return kOk;
}

ordered_json vec(const io::Vec3& v) { return {v.x, v.y, v.z}; }

// Lists every part and its number of triangles; empty for a mesh of one part.
ordered_json part_list(const io::Mesh& mesh) {
  std::vector<std::size_t> count(mesh.part_names.size());
  for (const std::int32_t part : mesh.part) ++count[static_cast<std::size_t>(part)];
  ordered_json list = ordered_json::array();
  for (std::size_t i = 0; !mesh.part.empty() && i < count.size(); ++i)
    list.push_back({{"name", mesh.part_names[i]}, {"triangles", count[i]}});
  return list;
}

Result<ordered_json> mesh_info(const Console& console, const std::string& file, io::Unit unit) {
  Result<io::Mesh> mesh = io::read_mesh(file, unit);
  if (!mesh) return mesh.failure();
  const io::MeshAudit a = io::audit(*mesh);
  if (const std::string far = io::too_far_for_floats(a.low, a.high); !far.empty())
    console.warn({far});
  return ordered_json{{"kind", "mesh"},
                      {"triangles", a.triangles},
                      {"vertices", a.vertices},
                      {"parts", std::max<std::size_t>(1, mesh->part_names.size())},
                      {"components", a.components},
                      {"closed", a.closed},
                      {"open_edges", a.open_edges},
                      {"nonmanifold_edges", a.nonmanifold_edges},
                      {"odd_edges", a.odd_edges},
                      {"flipped_edges", a.flipped_edges},
                      {"duplicates", a.duplicates},
                      {"degenerate", a.degenerate},
                      {"low_m", vec(a.low)},
                      {"high_m", vec(a.high)},
                      {"volume_m3", a.closed ? ordered_json(a.volume) : ordered_json()},
                      {"part_list", part_list(*mesh)},
                      {"remarks", mesh->remarks}};
}

Result<ordered_json> field_info(const std::string& file) {
  Result<io::FieldData> f = io::read_field(file);
  if (!f) return f.failure();
  return ordered_json{{"kind", "field"},
                      {"dims", {8 * f->bricks[0], 8 * f->bricks[1], 8 * f->bricks[2]}},
                      {"voxel_size_m", f->voxel_size},
                      {"origin_m", vec(f->origin)},
                      {"bricks", f->brick_count()},
                      {"band_m", f->band},
                      {"offset_m", f->offset},
                      {"sign_mode", f->sign_mode},
                      {"triangles", f->triangles},
                      {"parts", f->part_names},
                      {"input_hash", f->input_hash}};
}

Result<ordered_json> shell_info(const std::string& file) {
  Result<io::ShellData> s = io::read_shell(file);
  if (!s) return s.failure();
  return ordered_json{{"kind", "shell"},
                      {"points", s->size()},
                      {"levels", s->level_points.size()},
                      {"level_points", s->level_points},
                      {"input_hash", s->input_hash}};
}

// Counts each status bit from the frames: a killed run leaves no summary.
ordered_json event_counts(const std::vector<io::RecordingEvent>& events) {
  ordered_json counts = ordered_json::object();
  for (const io::RecordingEvent& e : events)
    counts[e.what] = counts.value(e.what, std::uint64_t{0}) + 1;
  return counts;
}

Result<ordered_json> recording_info(const Console& console, const std::string& file) {
  const Result<std::string> repaired = io::repair_recording(file);
  if (!repaired) return repaired.failure();
  if (!repaired->empty()) console.log("repaired: " + *repaired);
  io::FrameRange none;
  none.count = 0;
  Result<io::Recording> r = io::read_recording(file, none);
  if (!r) return r.failure();
  if (!r->remark.empty()) console.log(r->remark);
  ordered_json json{{"kind", "recording"},
                    {"frames", r->frame_count},
                    {"seconds", static_cast<double>(r->frame_count) / r->head.rate},
                    {"rate", r->head.rate},
                    {"hands", r->head.hands},
                    {"whole", r->whole},
                    {"remark", r->remark},
                    {"repaired", *repaired},
                    {"program", r->head.program},
                    {"simd_target", r->head.simd_target},
                    {"asset_hashes", r->head.asset_hashes},
                    {"events", r->events.size()},
                    {"event_counts", event_counts(r->events)},
                    {"columns", r->columns}};
  if (const Result<io::RecordedRun> run = io::recorded_run(r->head); run)
    json["run"] = {{"scene", run->generated.empty() ? run->scene_file.string() : run->generated},
                   {"threads", run->threads},
                   {"virtual_time", run->virtual_time},
                   {"frame_budget_us", run->frame_budget_us}};
  if (!r->summary_json.empty())
    json["summary"] = ordered_json::parse(r->summary_json, nullptr, false);
  if (json.contains("summary") && json["summary"].is_discarded()) json["summary"] = nullptr;
  return json;
}

Result<ordered_json> deformable_info(const std::string& file) {
  const Result<io::ReducedModel> m = io::read_deformable(file);
  if (!m) return m.failure();
  ordered_json materials = ordered_json::array();
  for (const io::SolidMaterial& each : m->mesh.materials)
    materials.push_back({{"name", each.name},
                         {"young", each.young},
                         {"poisson", each.poisson},
                         {"density", each.density}});
  return ordered_json{{"kind", "deformable"},
                      {"modes", m->modes},
                      {"warp", !m->turn.empty()},
                      {"vertices", m->mesh.vertices.size()},
                      {"elements", m->mesh.elements.size()},
                      {"fixed", m->mesh.fixed.size()},
                      {"free", m->free},
                      {"materials", materials},
                      {"lowest_hz", m->frequency.front()},
                      {"highest_hz", m->frequency.back()},
                      {"mass_damping", m->mass_damping},
                      {"stiffness_damping", m->stiffness_damping},
                      {"input_hash", m->input_hash},
                      {"made_with", ordered_json::parse(m->made_with, nullptr, false)}};
}

Result<ordered_json> scene_info(const std::string& file, bool outside) {
  Result<io::Scene> s = io::read_scene(file, outside);
  if (!s) return s.failure();
  ordered_json bodies = ordered_json::array(), hands = ordered_json::array();
  for (const io::SceneBody& b : s->bodies)
    bodies.push_back({{"name", b.name},
                      {"fixed", b.fixed},
                      {"mass", b.mass},
                      {"field", b.field.has_value()},
                      {"shell", b.shell.has_value()}});
  for (const io::SceneHand& h : s->hands)
    hands.push_back({{"body", h.body},
                     {"device", h.device},
                     {"rows", h.path.size()},
                     {"seconds", h.path.empty() ? 0.0 : h.path.back().t}});
  return ordered_json{{"kind", "scene"},
                      {"name", s->name},
                      {"about", s->about},
                      {"units", io::unit_name(s->unit)},
                      {"rate", s->rate},
                      {"method", h6MethodName(s->contact.method)},
                      {"bodies", bodies},
                      {"hands", hands},
                      {"forbidden", s->verdict.forbidden.size()}};
}

Result<ordered_json> path_info(const std::string& file, io::Unit unit) {
  Result<io::Path> p = io::read_path(file, unit);
  if (!p) return p.failure();
  return ordered_json{{"kind", "path"}, {"rows", p->size()}, {"seconds", p->back().t}};
}

// A PLY header names its elements within the first kilobytes.
bool has_faces(const std::string& file) {
  char head[4096] = {};
  std::ifstream(file, std::ios::binary).read(head, sizeof head - 1);
  return std::string(head).find("element face") != std::string::npos;
}

// A PLY file without faces counts as a shell.
Result<ordered_json> ply_info(const Console& console, const std::string& file, io::Unit unit) {
  return has_faces(file) ? mesh_info(console, file, unit) : shell_info(file);
}

int info_command(const Console& console, const std::string& file, const std::string& units,
                 bool outside) {
  Result<io::Unit> unit = io::unit_from_name(units);
  if (!unit) return console.fail(unit.error(), kUsage);
  if (Outcome there = check_recording(file); !there) return console.fail(there.error());
  const std::string ending = lower(std::filesystem::path(file).extension().string());
  const EndsAtOnce asked(console, file + ": cancelled");
  Result<ordered_json> facts = Failure{""};
  if (ending == ".vdb")
    facts = field_info(file);
  else if (ending == ".h5" && io::is_deformable(file))
    facts = deformable_info(file);
  else if (ending == ".h5" || ending == ".part")
    facts = recording_info(console, file);
  else if (ending == ".json")
    facts = scene_info(file, outside);
  else if (ending == ".csv")
    facts = path_info(file, *unit);
  else if (ending == ".ply")
    facts = ply_info(console, file, *unit);
  else
    facts = mesh_info(console, file, *unit);
  if (!facts) return console.fail(facts.error());
  ordered_json object{{"file", file}};
  object.update(*facts);
  return show(console, object);
}

}  // namespace

void add_info(CLI::App& app, Program& program) {
  CLI::App* info = app.add_subcommand(
      "info", "What a file is: mesh, field, shell, deformable, scene, path or recording");
  auto file = std::make_shared<std::string>(), units = std::make_shared<std::string>("m");
  auto schema = std::make_shared<bool>(false), settings = std::make_shared<bool>(false);
  auto* option =
      info->add_option("FILE", *file,
                       "STL, OBJ, PLY, glTF, COLLADA (also .gz), .vdb, .json, .csv or .h5")
          ->option_text("FILE");
  info->add_option("--units", *units, "Unit of a mesh or path: m, mm, cm or in; default m")
      ->option_text("UNIT")
      ->check(one_of({"m", "mm", "cm", "in"}));
  info->add_flag("--schema", *schema, "Print the JSON schema of scene files, every key explained")
      ->excludes(option);
  info->add_flag("--settings", *settings, "Print the page runtime/SETTINGS.md: every setting")
      ->excludes(option);
  info->callback([&program, file, units, schema, settings] {
    program.work = [&program, file, units, schema, settings] {
      if (*schema) {
        std::printf("%s\n", io::scene_schema().c_str());
        return kOk;
      }
      if (*settings) {
        std::printf("%s", io::settings_page().c_str());
        return kOk;
      }
      if (file->empty())
        return program.console.fail(
            "info needs a FILE, --schema or --settings; 'hapsix info --help' tells more", kUsage);
      return info_command(program.console, *file, *units, program.allow_outside);
    };
  });
}

}  // namespace h6::cli
