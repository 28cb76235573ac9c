// SPDX-License-Identifier: Apache-2.0
// bake_command.cpp - hapsix bake field|shell: bakes a mesh into an asset for other programs, too.
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "io/bake/plan.h"
#include "io/cli/bake_deformable.h"
#include "io/cli/commands.h"
#include "io/cli/mesh_unit.h"
#include "io/console/checks.h"
#include "io/field/field_file.h"
#include "io/file/free_memory.h"
#include "io/scene/asset_key.h"
#include "io/shell/bake_shell.h"
#include "io/shell/shell_file.h"
#include "kernels/field/field_layout.h"

namespace h6::cli {
namespace {

using Clock = std::chrono::steady_clock;
using nlohmann::ordered_json;

double since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// The peak memory of this process so far.
std::size_t peak_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::size_t>(usage.ru_maxrss) * 1024;
}

struct Common {
  std::string mesh, out, units = "m";
  CLI::Option* units_option = nullptr;
  unsigned threads = 0;
};

void add_common(CLI::App* command, Common& c, const char* ending) {
  command->add_option("MESH", c.mesh, "STL, OBJ, PLY, glTF or COLLADA, also .gz")
      ->required()
      ->option_text("FILE");
  command->add_option("-o,--output", c.out, std::string("The ") + ending + " to write")
      ->required()
      ->option_text("FILE")
      ->check(ends_with(ending));
  c.units_option =
      command
          ->add_option(
              "--units", c.units,
              "Unit of the mesh file (glTF and COLLADA have their own) and of lengths here: "
              "m, mm, cm or in; default m")
          ->option_text("UNIT")
          ->check(one_of({"m", "mm", "cm", "in"}));
  command->add_option("--threads", c.threads, "Default: all of the machine's")
      ->option_text("N")
      ->check(whole_within(0, 1024));
}

// Checks the file names before the bake, which may take minutes.
Outcome check_files(const Common& c) {
  if (Outcome there = check_input(c.mesh); !there) return there;
  std::error_code error;
  if (std::filesystem::equivalent(c.mesh, c.out, error))
    return Failure{"cannot write " + c.out + ": this is the mesh itself, choose another name"};
  return check_output(c.out);
}

struct Input {
  io::Mesh mesh;
  io::MeshAudit audit;
  double seconds;
};
// The unit is asked for if the mesh is far too large without a stated one.
Result<Input> read_input(const Console& console, Common& c) {
  if (Outcome checked = check_files(c); !checked) return checked.failure();
  const auto start = Clock::now();
  Result<io::Mesh> mesh = read_in_unit(console, c.mesh, c.units_option->count() > 0, c.units);
  if (!mesh) return mesh.failure();
  Input input{std::move(*mesh), {}, 0};
  input.audit = io::audit(input.mesh);
  input.seconds = since(start);
  return input;
}

void add_unless_empty(std::vector<std::string>& all, std::string sentence) {
  if (!sentence.empty()) all.push_back(std::move(sentence));
}

// Reports why a bake failed, and whether the mesh lies too far from the origin.
int bake_failed(const Console& console, const Common& c, const Input& input, std::string why) {
  const std::string far = io::too_far_for_floats(input.audit.low, input.audit.high);
  if (!far.empty() && why.ends_with('.')) why.pop_back();
  return console.fail(c.mesh + ": " + why + (far.empty() ? "" : "; " + far));
}

ordered_json timings(double read, double bake, double write) {
  return {{"read", read}, {"bake", bake}, {"write", write}};
}

struct FieldOptions {
  Common common;
  io::FieldBake bake;
  std::string sign = "auto", cavities = "solid";
  bool no_compression = false;
};

// The widest of them, with places and widths in metres.
ordered_json holes_json(const std::vector<io::FieldBakeReport::Hole>& holes) {
  constexpr std::size_t kMost = 100;
  ordered_json places = ordered_json::array();
  for (std::size_t i = 0; i < std::min(holes.size(), kMost); ++i)
    places.push_back({{"place", {holes[i].place.x, holes[i].place.y, holes[i].place.z}},
                      {"width", holes[i].width}});
  return {{"count", holes.size()}, {"widest", places}};
}

int bake_field_command(const Console& console, FieldOptions& o) {
  o.bake.sign = o.sign == "flood"     ? io::SignMode::flood
                : o.sign == "winding" ? io::SignMode::winding
                                      : io::SignMode::automatic;
  o.bake.cavities = o.cavities == "hollow" ? io::Cavities::hollow : io::Cavities::solid;
  o.bake.threads = o.common.threads;
  const EndsAtOnce asked(console, o.common.mesh + ": cancelled");
  Result<Input> input = read_input(console, o.common);
  if (!input) return console.fail(input.error());
  o.bake = in_metres(o.bake, o.common.units);
  console.warn(input->mesh.remarks);
  const Result<io::FieldPlan> plan = io::plan_field(input->mesh, input->audit, o.bake);
  if (!plan) return bake_failed(console, o.common, *input, plan.error());
  const Result<std::string> needs =
      io::needs_of(*plan, io::free_memory().value_or(std::uint64_t(-1)));
  if (!needs) return bake_failed(console, o.common, *input, needs.error());
  console.log("this bake takes " + *needs);
  auto start = Clock::now();
  io::FieldBakeReport report;
  Result<io::FieldData> field = io::bake_field(input->mesh, o.bake, &report, console.progress());
  if (!field) return bake_failed(console, o.common, *input, field.error());
  // A field far from the origin is as good as any, but STL stores floats, which lose the shape
  // there.
  if (const std::string name = o.common.mesh;
      name.ends_with("stl") || name.ends_with("STL") || name.ends_with("stl.gz"))
    add_unless_empty(report.warnings, io::too_far_for_floats(input->audit.low, input->audit.high));
  field->input_hash = io::asset_key(io::HashedMesh(input->mesh), o.bake);
  const double baked = since(start);
  start = Clock::now();
  const auto compression = o.no_compression ? io::Compression::none : io::Compression::blosc;
  if (Outcome done = io::write_field(o.common.out, *field, compression); !done)
    return console.fail(done.error());
  const double written = since(start);
  console.warn(report.warnings);
  const std::size_t bytes = std::filesystem::file_size(o.common.out);
  ordered_json json{{"file", o.common.out},
                    {"seconds", timings(input->seconds, baked, written)},
                    {"peak_bytes", peak_bytes()},
                    {"peak_bytes_estimate", plan->peak_bytes},
                    {"seconds_estimate", plan->seconds},
                    {"file_bytes", bytes},
                    {"engine_bytes", kernels::field_layout_size(field->def()).bytes()},
                    {"voxel_size", field->voxel_size},
                    {"dims", {8 * field->bricks[0], 8 * field->bricks[1], 8 * field->bricks[2]}},
                    {"bricks", field->brick_count()},
                    {"fine_cells", {field->half_count(), field->quarter_count()}},
                    {"triangles", input->audit.triangles},
                    {"closed", report.closed},
                    {"sign_mode", field->sign_mode},
                    {"offset", field->offset},
                    {"sealed_area", report.sealed_area},
                    {"sealed", holes_json(report.sealed)},
                    {"leaks", holes_json(report.leaks)},
                    {"welded", report.welded},
                    {"weld_widest", report.weld_widest},
                    {"thin_walls",
                     {{"area", report.thin.area},
                      {"thickness", report.thin.thickness},
                      {"place", {report.thin.place.x, report.thin.place.y, report.thin.place.z}},
                      {"grown", report.thin.area > 0 ? report.thin.grow : 0}}},
                    {"warnings", report.warnings}};
  console.result(json);
  if (!console.json) {
    const double unit_m = io::metres(*io::unit_from_name(o.common.units));
    std::printf(
        "%s: %d x %d x %d nodes, voxel %.4g %s, %zu bricks, %.1f MB\n"
        "  %zu triangles, %s; sign mode %s, offset %.4g %s; read %.2f s, baked %.2f s, wrote %.2f "
        "s\n",
        printable(o.common.out).c_str(), 8 * field->bricks[0], 8 * field->bricks[1],
        8 * field->bricks[2], field->voxel_size / unit_m, o.common.units.c_str(),
        field->brick_count(), 1e-6 * static_cast<double>(bytes), input->audit.triangles,
        report.closed ? "closed" : "not closed", field->sign_mode.c_str(), field->offset / unit_m,
        o.common.units.c_str(), input->seconds, baked, written);
  }
  return kOk;
}

struct ShellOptions {
  Common common;
  io::ShellBake bake;
  std::string surface = "auto", normals = "auto";
};

int bake_shell_command(const Console& console, ShellOptions& o) {
  o.bake.threads = o.common.threads;
  o.bake.surface = *io::surface_from_name(o.surface);  // checked by the parser
  o.bake.normals = *io::normals_from_name(o.normals);
  const EndsAtOnce asked(console, o.common.mesh + ": cancelled");
  Result<Input> input = read_input(console, o.common);
  if (!input) return console.fail(input.error());
  const Result<io::Unit> unit = io::unit_from_name(o.common.units);
  o.bake.spacing *= io::metres(*unit);
  o.bake.tolerance *= io::metres(*unit);
  o.bake.field = in_metres(o.bake.field, o.common.units);
  console.warn(input->mesh.remarks);
  auto start = Clock::now();
  std::vector<std::string> warnings;
  Result<io::ShellData> shell = io::bake_shell(input->mesh, o.bake, &warnings, console.progress());
  if (!shell) return bake_failed(console, o.common, *input, shell.error());
  add_unless_empty(warnings, io::too_far_for_floats(input->audit.low, input->audit.high));
  shell->input_hash = io::asset_key(io::HashedMesh(input->mesh), o.bake);
  const double baked = since(start);
  start = Clock::now();
  if (Outcome done = io::write_shell(o.common.out, *shell); !done)
    return console.fail(done.error());
  const double written = since(start);
  console.warn(warnings);
  const std::size_t bytes = std::filesystem::file_size(o.common.out);
  ordered_json json{{"file", o.common.out},
                    {"seconds", timings(input->seconds, baked, written)},
                    {"peak_bytes", peak_bytes()},
                    {"file_bytes", bytes},
                    {"points", shell->size()},
                    {"levels", shell->level_points.size()},
                    {"level_points", shell->level_points},
                    {"triangles", input->audit.triangles},
                    {"closed", input->audit.closed},
                    {"warnings", warnings}};
  console.result(json);
  if (!console.json)
    std::printf(
        "%s: %zu points on %zu levels, %.1f MB\n"
        "  %zu triangles, %s; read %.2f s, baked %.2f s, wrote %.2f s\n",
        printable(o.common.out).c_str(), shell->size(), shell->level_points.size(),
        1e-6 * static_cast<double>(bytes), input->audit.triangles,
        input->audit.closed ? "closed" : "not closed", input->seconds, baked, written);
  return kOk;
}

void add_field(CLI::App* bake, Program& program) {
  CLI::App* field = bake->add_subcommand("field", "Signed distance in sparse bricks, as .vdb");
  auto f = std::make_shared<FieldOptions>();
  add_common(field, f->common, ".vdb");
  auto* voxels = field
                     ->add_option("--voxels", f->bake.voxels,
                                  "Cells on the longest padded side, 16 to 2048; default 256")
                     ->option_text("N")
                     ->check(whole_within(16, 2048));
  field->add_option("--voxel-size", f->bake.voxel_size, "Edge of a voxel, instead of --voxels")
      ->option_text("S")
      ->excludes(voxels)
      ->check(number_above(0));
  field
      ->add_option("--tolerance", f->bake.tolerance,
                   "Largest error of the distance near the surface, instead of --voxels: voxels of "
                   "6 tolerances, cut into 2 or 4 where they would miss it")
      ->option_text("S")
      ->excludes(voxels)
      ->excludes("--voxel-size")
      ->check(number_above(0));
  field
      ->add_option("--offset", f->bake.offset,
                   "How far the surface is pushed out; default: 0 when closed, else 0.9 voxel")
      ->option_text("S")
      ->check(number_within(0, 1e6));
  field
      ->add_option("--sign", f->sign,
                   "How the inside is found: flood (all that the outside cannot reach), winding (a "
                   "solid with cracks and holes is closed across them) or auto (default; flood "
                   "with an offset where the mesh is open)")
      ->option_text("MODE")
      ->check(one_of({"auto", "flood", "winding"}));
  field->add_option("--cavities", f->cavities, "Enclosed hollows: solid (default) or hollow")
      ->option_text("MODE")
      ->check(one_of({"solid", "hollow"}));
  field
      ->add_option("--seal", f->bake.seal,
                   "Closes holes of an open mesh up to this width; default 0: none")
      ->option_text("WIDTH")
      ->check(number_within(0, 1e6));
  field
      ->add_option("--band", f->bake.band_voxels,
                   "Voxels on each side of the surface that get samples, 1 to 8; default 3. Deeper "
                   "than this, force does not grow with depth")
      ->option_text("VOXELS")
      ->check(number_within(1, io::kWidestBand));
  auto* weld =
      field
          ->add_option(
              "--weld", f->bake.weld,
              "Welds vertices of open edges this near to each other, if this closes the mesh: "
              "a share of the voxel, 0 to 1; default 0.01")
          ->option_text("SHARE")
          ->check(number_within(0, 1));
  field->add_option("--weld-length", f->bake.weld_length, "The same as a length, at most a voxel")
      ->option_text("S")
      ->excludes(weld)
      ->check(number_above(0));
  field->add_flag("--no-compression", f->no_compression, "Larger file, faster to load");
  field->callback([&program, f] {
    program.work = [&program, f] { return bake_field_command(program.console, *f); };
  });
}

void add_shell(CLI::App* bake, Program& program) {
  CLI::App* shell =
      bake->add_subcommand("shell", "Points with inward normals on nested levels, as .ply");
  auto s = std::make_shared<ShellOptions>();
  add_common(shell, s->common, ".ply");
  auto* points =
      shell->add_option("--points", s->bake.points, "Points on the finest level; default 10000")
          ->option_text("N")
          ->check(whole_within(1, 20000000));
  shell
      ->add_option("--spacing", s->bake.spacing,
                   "Least distance between points, instead of --points")
      ->option_text("S")
      ->excludes(points)
      ->check(number_above(0));
  shell
      ->add_option("--tolerance", s->bake.tolerance,
                   "No flat obstacle enters farther between points, instead of --points: edges, "
                   "corners and curved places get more; --spacing then bounds how far apart points "
                   "are, default 16 tolerances")
      ->option_text("S")
      ->excludes(points)
      ->check(number_above(0));
  shell->add_option("--levels", s->bake.levels, "Nested levels, 1 to 16; default 7")
      ->option_text("N")
      ->check(whole_within(1, 16));
  shell
      ->add_option("--surface", s->surface,
                   "Where points lie: triangles, field (where the mesh's field is zero: in a soup "
                   "that is the offset outside of its triangles) or auto (default; triangles)")
      ->option_text("MODE")
      ->check(one_of({"auto", "triangles", "field"}));
  shell
      ->add_option("--normals", s->normals,
                   "Normals of the triangles, of the field (they turn evenly over edges) or auto "
                   "(default; as the points)")
      ->option_text("MODE")
      ->check(one_of({"auto", "triangles", "field"}));
  auto* outside = shell
                      ->add_option("--voxels", s->bake.field.voxels,
                                   "Cells of the field that tells what the outside reaches, on the "
                                   "longest padded side, 16 to 2048; default 256")
                      ->option_text("N")
                      ->check(whole_within(16, 2048));
  shell
      ->add_option("--voxel-size", s->bake.field.voxel_size, "Edge of a voxel, instead of --voxels")
      ->option_text("S")
      ->excludes(outside)
      ->check(number_above(0));
  shell
      ->add_option("--offset", s->bake.field.offset,
                   "How far that field's surface is pushed out; default: 0 when closed, else 0.9 "
                   "voxel")
      ->option_text("S")
      ->check(number_within(0, 1e6));
  shell
      ->add_option("--seal", s->bake.field.seal,
                   "Holes of an open mesh up to this width lead nowhere; default 0: all do")
      ->option_text("WIDTH")
      ->check(number_within(0, 1e6));
  shell->callback([&program, s] {
    program.work = [&program, s] { return bake_shell_command(program.console, *s); };
  });
}

}  // namespace

void add_bake(CLI::App& app, Program& program) {
  CLI::App* bake = app.add_subcommand(
      "bake", "Bake a mesh into a field (.vdb), a shell (.ply) or a reduced deformable (.h5)");
  bake->require_subcommand(1);
  add_field(bake, program);
  add_shell(bake, program);
  add_bake_deformable(bake, program);
}

}  // namespace h6::cli
