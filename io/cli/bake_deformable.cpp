// SPDX-License-Identifier: Apache-2.0
// bake_deformable.cpp - hapsix bake deformable: a solid mesh, or a lattice in a surface, becomes a
// reduced model.
#include "io/cli/bake_deformable.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>

#include "io/cli/mesh_unit.h"
#include "io/console/checks.h"
#include "io/deform/deformable_file.h"
#include "io/deform/lattice.h"
#include "io/deform/reduce.h"
#include "io/deform/solid_file.h"
#include "io/deform/solid_surface.h"
#include "io/file/write_aside.h"
#include "io/view/pick.h"

namespace h6::cli {
namespace {

using Clock = std::chrono::steady_clock;
using nlohmann::ordered_json;

struct DeformableOptions {
  std::string model, out, units = "m";
  CLI::Option* units_option = nullptr;
  io::ReduceOptions reduce;
  std::vector<std::string> boxes;  // "X,Y,Z,X,Y,Z"
  std::vector<std::uint32_t> fixed;
  std::string fix_list, pick;  // text files of places
  unsigned port = 0;
  bool open = true;  // a browser
  std::vector<std::string> materials;
  double young = NAN, poisson = NAN, density = NAN, cell = 0;
};

// Exactly `count` numbers with commas between them.
bool parse_numbers(const std::string& text, std::size_t count, double* out) {
  std::istringstream numbers(text);
  std::string word;
  for (std::size_t i = 0; i < count; ++i)
    if (!std::getline(numbers, word, ',') || !parse(word, out[i])) return false;
  return !std::getline(numbers, word);
}

// "SET=E,NU,RHO"
Result<io::SolidMaterial> parse_material(const std::string& text, std::string& set) {
  const std::size_t equals = text.rfind('=');
  double value[3];
  if (equals == std::string::npos || equals == 0 ||
      !parse_numbers(text.substr(equals + 1), 3, value))
    return Failure{"--material takes SET=E,NU,RHO (Pa, 1, kg/m^3), not '" + text + "'"};
  set = text.substr(0, equals);
  return io::SolidMaterial{set, value[0], value[1], value[2]};
}

// A value that is given replaces that of every material of the file.
Outcome put_materials(const DeformableOptions& o, io::SolidMesh& mesh) {
  const bool all = std::isfinite(o.young) && std::isfinite(o.poisson) && std::isfinite(o.density);
  const bool lacking =
      std::any_of(mesh.elements.begin(), mesh.elements.end(),
                  [](const io::SolidElement& e) { return e.material == io::kNoMaterial; });
  if (lacking && !all && o.materials.empty())
    return Failure{o.model +
                   ": it gives no material; give --young, --poisson and --density (steel: 2e11, "
                   "0.3, 7850)"};
  if (lacking && all) {
    const auto number = static_cast<std::uint32_t>(mesh.materials.size());
    mesh.materials.push_back({"given", o.young, o.poisson, o.density});
    for (io::SolidElement& e : mesh.elements)
      if (e.material == io::kNoMaterial) e.material = number;
  }
  for (io::SolidMaterial& m : mesh.materials) {
    if (std::isfinite(o.young)) m.young = o.young;
    if (std::isfinite(o.poisson)) m.poisson = o.poisson;
    if (std::isfinite(o.density)) m.density = o.density;
  }
  for (const std::string& text : o.materials) {
    std::string set;
    const Result<io::SolidMaterial> material = parse_material(text, set);
    if (!material) return material.failure();
    if (Outcome given = io::give_material(mesh, set, *material); !given) return given;
  }
  return Done{};
}

// Places from 1, one a line or with blanks and commas between them; a line's rest after # is a
// remark.
Outcome read_list(const std::string& file, std::vector<std::uint32_t>& numbers) {
  std::ifstream in(file);
  if (!in) return Failure{"cannot read " + file + ": " + std::strerror(errno)};
  std::string line;
  for (std::size_t row = 1; std::getline(in, line); ++row) {
    line.resize(std::min(line.size(), line.find('#')));
    std::replace_if(
        line.begin(), line.end(), [](char c) { return c == ',' || c == '\r'; }, ' ');
    std::istringstream words(line);
    for (std::string word; words >> word;) {
      double number = 0;
      if (!parse(word, number) || !(number >= 1 && number <= 4e9) || number != std::floor(number))
        return Failure{file + ", line " + std::to_string(row) +
                       ": a place of a vertex is a whole number from 1, not '" + printable(word) +
                       "'"};
      numbers.push_back(static_cast<std::uint32_t>(number - 1));
    }
  }
  if (in.bad()) return Failure{"cannot read " + file + ": " + std::strerror(errno)};
  return Done{};
}

Outcome put_fixed(const DeformableOptions& o, double unit, io::SolidMesh& mesh) {
  for (const std::string& box : o.boxes) {
    double at[6];
    if (!parse_numbers(box, 6, at))
      return Failure{"--fix-box takes two corners as X,Y,Z,X,Y,Z, not '" + box + "'"};
    const h6Vec3 low = unit * h6Vec3{at[0], at[1], at[2]};
    const h6Vec3 high = unit * h6Vec3{at[3], at[4], at[5]};
    if (io::fix_box(mesh, min(low, high), max(low, high)) > 0) continue;
    h6Vec3 first = mesh.vertices[0], last = first;
    for (const h6Vec3& p : mesh.vertices) first = min(first, p), last = max(last, p);
    char text[200];
    std::snprintf(text, sizeof text,
                  "a box of --fix-box holds no vertex; the model reaches from (%.6g, %.6g, %.6g) "
                  "to (%.6g, %.6g, %.6g) %s",
                  first.x / unit, first.y / unit, first.z / unit, last.x / unit, last.y / unit,
                  last.z / unit, o.units.c_str());
    return Failure{text};
  }
  std::vector<std::uint32_t> numbers;
  for (const std::uint32_t number : o.fixed) numbers.push_back(number - 1);
  if (!o.fix_list.empty())
    if (Outcome read = read_list(o.fix_list, numbers); !read) return read;
  return io::fix_vertices(mesh, numbers);
}

// Lets the user mark vertices on a page, beside those that are fixed already, and writes all of
// them.
Outcome pick_fixed(const Console& console, const DeformableOptions& o, io::SolidMesh& mesh) {
  io::view::Pickable model;
  model.name = std::filesystem::path(o.model).filename().string();
  model.unit = o.units;
  model.metres = io::metres(*io::unit_from_name(o.units));
  model.vertices = mesh.vertices;
  model.triangles = io::surface_of(mesh);
  model.marked = mesh.fixed;
  io::view::PickOptions options;
  options.port = static_cast<std::uint16_t>(o.port);
  options.open = o.open;
  options.say = [&](const std::string& sentence) { console.log(sentence); };
  options.stop = [] { return interrupted.load(); };
  const Result<std::vector<std::uint32_t>> chosen = io::view::pick_vertices(model, options);
  if (!chosen) return Failure{o.model + ": " + chosen.error()};
  std::string list = "# fixed vertices of " + model.name + " by their place, from 1\n";
  for (const std::uint32_t vertex : *chosen) list += std::to_string(vertex + 1) + '\n';
  if (Outcome written = io::write_text_aside(o.pick, list); !written) return written;
  mesh.fixed.clear();
  return io::fix_vertices(mesh, *chosen);
}

Result<io::SolidMesh> read_model(const Console& console, DeformableOptions& o) {
  if (Outcome there = check_input(o.model); !there) return there.failure();
  std::error_code error;
  if (std::filesystem::equivalent(o.model, o.out, error))
    return Failure{"cannot write " + o.out + ": this is the model itself, choose another name"};
  for (const std::string& file : {o.out, o.pick})
    if (Outcome there = check_output(file); !file.empty() && !there) return there.failure();
  if (io::is_solid_name(o.model)) {
    if (o.cell > 0)
      return Failure{o.model + ": it has its own elements; --cell is for surface meshes"};
    return io::read_solid(o.model, *io::unit_from_name(o.units));
  }
  if (!io::is_mesh_name(o.model))
    return Failure{o.model +
                   ": give a solid mesh (.veg, .msh, .vtk) or a surface (.stl, .obj, "
                   ".ply, .glb, .dae)"};
  if (!(o.cell > 0))
    return Failure{o.model + ": a surface mesh is filled with cells; give their size by --cell"};
  const Result<io::Mesh> mesh =
      read_in_unit(console, o.model, o.units_option->count() > 0, o.units);
  if (!mesh) return mesh.failure();
  const double unit = io::metres(*io::unit_from_name(o.units));
  return io::make_lattice(*mesh, o.cell * unit, o.reduce.threads, console.progress());
}

std::string made_with(const DeformableOptions& o) {
  return ordered_json{
      {"program", "hapsix"},     {"model", std::filesystem::path(o.model).filename().string()},
      {"modes", o.reduce.modes}, {"linear_modes", o.reduce.linear_modes},
      {"warp", o.reduce.warp},   {"damping", o.reduce.damping},
      {"cell", o.cell},          {"units", o.units}}
      .dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

ordered_json facts_of(const DeformableOptions& o, const io::ReducedModel& model,
                      const io::ReduceReport& report) {
  ordered_json seconds;
  for (const auto& stage : report.stages) seconds[stage.name] = stage.seconds;
  return {{"file", o.out},
          {"seconds", seconds},
          {"file_bytes", std::filesystem::file_size(o.out)},
          {"modes", model.modes},
          {"warp", !model.turn.empty()},
          {"vertices", model.mesh.vertices.size()},
          {"elements", model.mesh.elements.size()},
          {"fixed", model.mesh.fixed.size()},
          {"parts", report.facts.parts},
          {"volume", report.facts.volume},
          {"mass", report.facts.mass},
          {"captured", report.captured},
          {"frequencies", model.frequency},
          {"mass_damping", model.mass_damping},
          {"stiffness_damping", model.stiffness_damping}};
}

int bake_deformable_command(const Console& console, DeformableOptions& o) {
  const auto start = Clock::now();
  Result<io::SolidMesh> mesh = read_model(console, o);
  if (!mesh) return console.fail(mesh.error());
  const double unit = io::metres(*io::unit_from_name(o.units));
  if (Outcome given = put_materials(o, *mesh); !given) return console.fail(given.error());
  if (Outcome held = put_fixed(o, unit, *mesh); !held) return console.fail(held.error());
  if (!o.pick.empty())
    if (Outcome held = pick_fixed(console, o, *mesh); !held) return console.fail(held.error());
  std::vector<std::string> warnings = mesh->remarks;
  io::ReduceReport report;
  Result<io::ReducedModel> model = io::reduce(*mesh, o.reduce, &report, console.progress());
  if (!model) return console.fail(o.model + ": " + model.error());
  model->made_with = made_with(o);
  if (report.facts.unused > 0)
    warnings.push_back(std::to_string(report.facts.unused) +
                       " vertices belong to no element; they do not move.");
  if (Outcome done = io::write_deformable(o.out, *model); !done) return console.fail(done.error());
  console.warn(warnings);
  ordered_json json = facts_of(o, *model, report);
  json["warnings"] = warnings;
  console.result(json);
  if (!console.json)
    std::printf(
        "%s: %zu modes from %.4g to %.4g Hz, %.1f MB\n"
        "  %zu elements, %zu vertices, %zu of them fixed; %.4g kg; took %.2f s\n",
        printable(o.out).c_str(), model->modes, model->frequency.front(), model->frequency.back(),
        1e-6 * static_cast<double>(std::filesystem::file_size(o.out)), model->mesh.elements.size(),
        model->mesh.vertices.size(), model->mesh.fixed.size(), report.facts.mass,
        std::chrono::duration<double>(Clock::now() - start).count());
  return kOk;
}

void add_materials(CLI::App* command, DeformableOptions& o) {
  command->add_option("--young", o.young, "Young's modulus of all materials [Pa]")
      ->option_text("E")
      ->check(number_above(0));
  command->add_option("--poisson", o.poisson, "Poisson's ratio of all materials")
      ->option_text("NU")
      ->check(number_within(-1, 0.5));
  command->add_option("--density", o.density, "Density of all materials [kg/m^3]")
      ->option_text("RHO")
      ->check(number_above(0));
  command
      ->add_option("--material", o.materials,
                   "A material for a set of elements that the model names; may be repeated")
      ->option_text("SET=E,NU,RHO")
      ->allow_extra_args(false);
}

void add_constraints(CLI::App* command, DeformableOptions& o) {
  command
      ->add_option("--fix-box", o.boxes,
                   "Fixes the vertices within a box, two corners in the model's unit; may be "
                   "repeated")
      ->option_text("X,Y,Z,X,Y,Z")
      ->allow_extra_args(false);
  command->add_option("--fix", o.fixed, "Fixes vertices by their place in the file, from 1")
      ->option_text("N,N,...")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(whole_within(1, 4000000000));
  command->add_option("--fix-list", o.fix_list, "Fixes the vertices whose places a text file has")
      ->option_text("FILE");
  command
      ->add_option(
          "--pick", o.pick,
          "Opens the model in a browser, where vertices to fix are marked by brush or box, "
          "and writes their places to a text file for --fix-list")
      ->option_text("FILE")
      ->check(ends_with(".txt"));
  command->add_option("--port", o.port, "Port of that page on 127.0.0.1; default: any free one")
      ->option_text("NUMBER")
      ->check(whole_within(0, 65535));
  command->add_flag_callback(
      "--no-browser", [&o] { o.open = false; }, "Only print the page's address");
  command->add_flag("--free", o.reduce.free,
                    "Nothing is fixed: the modes are those without rigid motion");
}

}  // namespace

void add_bake_deformable(CLI::App* bake, Program& program) {
  CLI::App* command = bake->add_subcommand(
      "deformable", "Modes of an elastic solid and its reduced internal force, as .h5");
  auto o = std::make_shared<DeformableOptions>();
  command
      ->add_option(
          "MODEL", o->model,
          "Tetrahedra or hexahedra (.veg, .msh, .vtk), or a closed surface mesh and --cell")
      ->required()
      ->option_text("FILE");
  command->add_option("-o,--output", o->out, "The .h5 to write")
      ->required()
      ->option_text("FILE")
      ->check(ends_with(".h5"));
  o->units_option =
      command
          ->add_option("--units", o->units,
                       "Unit of the model's coordinates and of lengths here: m, mm, cm or in; "
                       "default m. Materials are SI always")
          ->option_text("UNIT")
          ->check(one_of({"m", "mm", "cm", "in"}));
  command->add_option("--modes", o->reduce.modes, "Modes of the model, 1 to 60; default 20")
      ->option_text("R")
      ->check(whole_within(1, 60));
  command
      ->add_option("--linear-modes", o->reduce.linear_modes,
                   "Linear modes that the basis is made of with their derivatives, 1 to 60; "
                   "default: as many as modes, at most 20")
      ->option_text("K")
      ->check(whole_within(1, 60));
  command
      ->add_flag("--warp", o->reduce.warp,
                 "Linear modes alone, whose displacements are warped by the turns of their points, "
                 "and a linear force: cheap at any count of modes")
      ->excludes("--linear-modes");
  command
      ->add_option("--damping", o->reduce.damping,
                   "Share of the critical damping of the lowest mode, 0 to 1; default 0.05")
      ->option_text("SHARE")
      ->check(number_within(0, 1));
  command->add_option("--cell", o->cell, "Edge of the cells that fill a surface mesh")
      ->option_text("SIZE")
      ->check(number_above(0));
  add_materials(command, *o);
  add_constraints(command, *o);
  command->add_option("--threads", o->reduce.threads, "Default: all of the machine's")
      ->option_text("N")
      ->check(whole_within(0, 1024));
  command->callback([&program, o] {
    program.work = [&program, o] { return bake_deformable_command(program.console, *o); };
  });
}

}  // namespace h6::cli
