// SPDX-License-Identifier: Apache-2.0
// check_command.cpp - hapsix check: checks whether meshes are fit for fields, before a long bake,
// and whether a baked field agrees with its mesh.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "io/bake/plan.h"
#include "io/check/clearance.h"
#include "io/check/exact_check.h"
#include "io/check/push_walls.h"
#include "io/check/wall_thickness.h"
#include "io/cli/commands.h"
#include "io/cli/mesh_unit.h"
#include "io/console/checks.h"
#include "io/field/field_file.h"
#include "io/mesh/mesh_file.h"
#include "io/scene/load_scene.h"
#include "io/scene/scene_file.h"

namespace h6::cli {
namespace {

using nlohmann::ordered_json;

struct CheckOptions {
  std::vector<std::string> files;
  std::string units = "m", field;
  CLI::Option* units_option = nullptr;
  io::FieldBake bake;
  bool verify = false;
  double stiffness = 0;  // 0: the scene's, or 1e4
  io::ExactCheckOptions exact;
};

// One mesh and the options of its field.
struct Subject {
  std::string name;
  io::Mesh mesh;
  io::FieldBake bake;
  h6Pose pose = {{0, 0, 0}, {1, 0, 0, 0}};
};

ordered_json spread(const std::vector<double>& lengths, double voxel) {
  if (lengths.empty()) return nullptr;
  ordered_json out;
  for (const auto& [name, share] :
       {std::pair{"min", 0.0}, {"p1", 0.01}, {"p5", 0.05}, {"p25", 0.25}, {"median", 0.5}})
    out[name] = io::quantile(lengths, share) / voxel;
  out["below_1_voxel"] = io::share_below(lengths, voxel);
  out["below_2_voxels"] = io::share_below(lengths, 2 * voxel);
  return out;
}

ordered_json exact_json(const io::ExactCheck& c) {
  return {{"agrees", c.agrees()},
          {"nodes", c.nodes},
          {"node_error_max", c.worst_node},
          {"node_error_mean", c.mean_node},
          {"nodes_buried", c.buried},
          {"nodes_too_deep", c.deep},
          {"too_deep_max", c.worst_deep},
          {"nodes_sealed", c.nearer},
          {"between", c.between},
          {"between_error_max", c.worst_between},
          {"between_error_mean", c.mean_between},
          {"tolerance_places", c.asked},
          {"tolerance_error_max", c.worst_asked},
          {"tolerance_error_mean", c.mean_asked},
          {"tolerance_missed", c.missed},
          {"sides", c.voted},
          {"sides_doubtful", c.doubtful},
          {"sides_drained", c.drained},
          {"drains", c.drains()},
          {"sides_filled", c.filled},
          {"sides_enclosed", c.enclosed},
          {"far", c.far},
          {"far_above", c.far_wrong},
          {"far_excess_max", c.far_excess},
          {"far_gap_mean", c.far_gap},
          {"far_grid_gap_mean", c.corner_gap},
          {"far_outside", c.outside},
          {"far_inside", c.inside},
          {"far_inside_gap_mean", c.inside_gap}};
}

void print(const ordered_json& m, const Subject& s, const io::Walls& walls,
           const io::FieldPlan& p) {
  std::printf("%s: %zu triangles, %s; voxel %.4g mm", printable(s.name).c_str(),
              m["triangles"].get<std::size_t>(), m["closed"].get<bool>() ? "closed" : "a soup",
              1e3 * p.voxel_size);
  if (p.finest < p.voxel_size) std::printf(", cut down to %.4g mm", 1e3 * p.finest);
  if (p.offset > 0) std::printf(", moved out by %.4g mm", 1e3 * p.offset);
  std::printf(
      "\n  bake    %d x %d x %d nodes, about %zu bricks, %.0f MB, %.0f MB as the engine keeps "
      "them; "
      "about %.2g s\n",
      8 * p.bricks[0], 8 * p.bricks[1], 8 * p.bricks[2], p.brick_count, 1e-6 * double(p.bytes),
      1e-6 * double(p.engine_bytes), p.seconds);
  const auto line = [&](const char* what, const std::vector<double>& lengths) {
    if (lengths.empty()) return std::printf("  %-7s none found\n", what);
    return std::printf(
        "  %-7s %.3g voxels for a hundredth, %.3g for a twentieth, %.3g for half of them; %.2g %% "
        "below one voxel, %.2g %% below two\n",
        what, io::quantile(lengths, 0.01) / p.finest, io::quantile(lengths, 0.05) / p.finest,
        io::quantile(lengths, 0.5) / p.finest, 100 * io::share_below(lengths, p.finest),
        100 * io::share_below(lengths, 2 * p.finest));
  };
  line("walls", walls.thickness);
  line("gaps", walls.gap);
  if (walls.bowls > 0)
    std::printf("  open    %.3g %% of the area is on pieces with holes, measured as if closed\n",
                100 * walls.bowls);
  if (walls.sheets > 0)
    std::printf(
        "  sheets  %.3g %% of the area is on sheets, which hold nothing: %.3g voxels thick\n",
        100 * walls.sheets, 2 * p.offset / p.finest);
}

// The force that walls hold, with the stiffness of the contact [N/m], and what was found.
struct Force {
  double stiffness = 0;
  bool known = false;
  io::HeldForce held;
};

void print(const Force& f, double voxel) {
  if (!f.known) return;
  const io::WallPlace& w = f.held.weakest;
  if (f.held.force == 0) {
    std::printf("  force   none holds: a tool goes through at (%.4g, %.4g, %.4g) mm\n", 1e3 * w.p.x,
                1e3 * w.p.y, 1e3 * w.p.z);
    return;
  }
  std::printf(
      "  force   at %.4g N/m, %.3g N and less cannot push a point through: pushed at %zu places "
      "from "
      "both sides\n",
      f.stiffness, f.held.force, f.held.places);
  if (norm(w.in) > 0)
    std::printf("          weakest at (%.4g, %.4g, %.4g) mm, %.3g voxels thick there\n",
                1e3 * w.p.x, 1e3 * w.p.y, 1e3 * w.p.z, w.thickness / voxel);
}

// Says that a wall of the mesh is none in the field, and where.
std::string lost_sentence(const io::HeldForce& held, const io::FieldData& field) {
  const io::WallPlace& w = held.weakest;
  char text[320], advice[160];
  const bool thin = w.thickness > 0 && w.thickness < 2 * field.finest();
  if (thin)
    std::snprintf(advice, sizeof advice, "bake with --%s below %.3g mm, or with --offset %.3g mm",
                  field.tolerance > 0 ? "tolerance" : "voxel-size",
                  1e3 * w.thickness / (field.tolerance > 0 ? 2 * io::kFinest : 2),
                  1e3 * 0.9 * field.finest());
  else
    std::snprintf(advice, sizeof advice, "--verify compares the field with the mesh");
  std::snprintf(
      text, sizeof text,
      "the weakest wall holds nothing: a tool goes through at (%.4g, %.4g, %.4g) mm, where "
      "the wall is %.3g mm thick and a voxel %.3g mm (%zu of %zu places let the least "
      "force through); ",
      1e3 * w.p.x, 1e3 * w.p.y, 1e3 * w.p.z, 1e3 * w.thickness, 1e3 * field.finest(), held.through,
      held.places);
  return std::string(text) + advice;
}

// Describes how far the bounds of the far field lie below the distance, if any places could be
// compared.
std::string looseness(const io::ExactCheck& c) {
  char text[128];
  std::string all;
  if (c.outside > 0) {
    std::snprintf(text, sizeof text,
                  ", on average %.2g voxel below it outside (%.2g at the far grid)", c.far_gap,
                  c.corner_gap);
    all += text;
  }
  if (c.inside > 0) {
    std::snprintf(text, sizeof text, ", on average %.2g voxel below it inside", c.inside_gap);
    all += text;
  }
  return all;
}

void print(const io::ExactCheck& c) {
  std::printf(
      "  field   %s\n"
      "    distance  %zu nodes: %.2g voxel wrong at most; interpolated %.2g, %.2g on average\n"
      "    sides     %zu votes: %zu outside that should be inside, %zu inside that should be "
      "outside; %zu cavities, %zu doubtful\n"
      "    far       %zu places: %zu bounds above the distance%s\n",
      c.agrees() ? "agrees with the mesh" : "DISAGREES with the mesh", c.nodes, c.worst_node,
      c.worst_between, c.mean_between, c.voted, c.drained, c.filled, c.enclosed, c.doubtful, c.far,
      c.far_wrong, looseness(c).c_str());
  if (c.asked > 0)
    std::printf(
        "    tolerance %zu places within 9 tolerances of the mesh: wrong by %.2g tolerances at "
        "most, %.2g on average\n",
        c.asked, c.worst_asked, c.mean_asked);
}

// Returns a warning sentence for each bad finding.
std::vector<std::string> warnings_of(const Subject& s, const io::MeshAudit& a,
                                     const io::Walls& walls, const io::FieldPlan& p) {
  std::vector<std::string> out = s.mesh.remarks;
  if (std::string far = io::too_far_for_floats(a.low, a.high); !far.empty()) out.push_back(far);
  const auto percent = [](double share) { return number_text(std::round(1e3 * share) / 10); };
  if (const double thin = io::share_below(walls.thickness, 2 * p.finest); thin > 0.001)
    out.push_back(percent(thin) +
                  " % of the walls are thinner than two voxels: "
                  "penetration there ends after one; bake with more voxels");
  if (const double closed = io::share_below(walls.gap, 2 * p.offset); closed > 0.001)
    out.push_back(percent(closed) + " % of the gaps are narrower than " +
                  number_text(std::round(2e6 * p.offset) / 1e3) +
                  " mm, twice the offset, and will close; more voxels make this smaller");
  if (!a.closed && p.offset < 0.5 * p.finest)
    out.push_back(
        "the offset is below half a voxel and the mesh is open: the outside leaks in "
        "through every hole");
  return out;
}

// Says that the outside runs into the solid, and where.
std::string leak_sentence(const io::ExactCheck& c) {
  char text[256];
  std::snprintf(
      text, sizeof text,
      "the outside runs into the solid through its cracks or holes: of %zu places that "
      "rays find inside, the field has %zu outside, the deepest at (%.4g, %.4g, %.4g) mm; "
      "no force holds there. Close the mesh, or bake with --seal",
      c.solid, c.drained, 1e3 * c.leak.x, 1e3 * c.leak.y, 1e3 * c.leak.z);
  return text;
}

struct Verdict {
  bool asked = false;  // whether a field was compared with its mesh
  bool bad = false;    // that field is wrong
  bool lost = false;   // walls hold nothing
};

ordered_json facts(const Subject& s, const io::MeshAudit& a, const io::FieldPlan& p,
                   const io::Walls& walls) {
  return {{"name", s.name},
          {"triangles", a.triangles},
          {"closed", a.closed},
          {"odd_edges", a.odd_edges},
          {"duplicates", a.duplicates},
          {"components", a.components},
          {"low_m", {a.low.x, a.low.y, a.low.z}},
          {"high_m", {a.high.x, a.high.y, a.high.z}},
          {"voxel_size", p.voxel_size},
          {"finest_voxel", p.finest},
          {"offset", p.offset},
          {"dims", {8 * p.bricks[0], 8 * p.bricks[1], 8 * p.bricks[2]}},
          {"bricks_estimate", p.brick_count},
          {"field_bytes_estimate", p.bytes},
          {"engine_bytes_estimate", p.engine_bytes},
          {"bake_seconds_estimate", p.seconds},
          {"walls_voxels", spread(walls.thickness, p.finest)},
          {"gaps_voxels", spread(walls.gap, p.finest)},
          {"bowls_share", walls.bowls},
          {"sheets_share", walls.sheets},
          {"buried_share", walls.buried}};
}

// Compares the field with its mesh. Returns whether the outside runs into the solid.
Result<bool> compare(const Console& console, const CheckOptions& o, const Subject& s,
                     const io::FieldData& field, ordered_json& m, Verdict& verdict) {
  io::ExactCheckOptions exact = o.exact;
  exact.sealed = s.bake.seal > 0 || field.sign_mode == "winding";
  exact.threads = o.bake.threads;
  const Result<io::ExactCheck> c = io::check_exactly(s.mesh, field, exact, console.progress());
  if (!c) return c.failure();
  m["field"] = exact_json(*c);
  verdict.asked = true;
  verdict.bad |= !c->agrees();
  if (c->drains()) console.warn({leak_sentence(*c)});
  if (!console.json) print(*c);
  return c->drains();
}

// Pushes at the walls.
Outcome push(const Console& console, const CheckOptions& o, const Subject& s,
             const io::FieldData& field, const io::Walls& walls, double stiffness, ordered_json& m,
             Verdict& verdict) {
  const Result<io::HeldForce> held = io::find_held_force(s.mesh, field, walls.places, stiffness,
                                                         o.bake.threads, console.progress());
  if (!held) return held.failure();
  const Force force{stiffness, held->places > 0, *held};
  m["holding_force_N"] = force.known ? ordered_json(held->force) : ordered_json();
  m["pushed_places"] = held->places;
  if (!console.json) print(force, field.finest());
  if (!force.known || held->force > 0) return Done{};
  verdict.lost = true;
  console.warn({lost_sentence(*held, field)});
  return Done{};
}

Result<ordered_json> check_one(const Console& console, const CheckOptions& o, const Subject& s,
                               double stiffness, Verdict& verdict) {
  const auto named = [&](const std::string& why) { return Failure{s.name + ": " + why}; };
  const io::MeshAudit a = io::audit(s.mesh);
  Result<io::FieldData> field = Failure{""};
  io::FieldBake bake = s.bake;
  if (!o.field.empty()) {
    field = io::read_field(o.field);
    if (!field) return field.failure();
    bake.offset = field->offset;
    if (field->tolerance > 0)
      bake.tolerance = field->tolerance;
    else
      bake.voxel_size = field->voxel_size;
  }
  Result<io::FieldPlan> p = io::plan_field(s.mesh, a, bake);
  if (!p) return named(p.error());
  if (o.field.empty()) field = io::bake_field(s.mesh, s.bake, nullptr, console.progress());
  if (!field) return named(field.error());
  p->offset = field->offset;  // of a nearly closed mesh it is 0
  io::WallOptions wall_options;
  wall_options.threads = o.bake.threads;
  const Result<io::Walls> walls = io::measure_walls(s.mesh, wall_options);
  if (!walls) return named(walls.error());
  const std::vector<std::string> warnings = warnings_of(s, a, *walls, *p);
  console.warn(warnings);
  ordered_json m = facts(s, a, *p, *walls);
  m["warnings"] = warnings;
  if (!console.json) print(m, s, *walls, *p);

  m["holding_force_N"] = nullptr;
  if (o.verify || !o.field.empty()) {
    const Result<bool> drains = compare(console, o, s, *field, m, verdict);
    if (!drains) return named(drains.error());
    if (*drains) return m;
  }
  if (Outcome pushed = push(console, o, s, *field, *walls, stiffness, m, verdict); !pushed)
    return named(pushed.error());
  return m;
}

// The stiffness that a run of this scene has [N/m].
Result<double> stiffness_of(const Console& console, const io::Scene& scene) {
  if (scene.contact.stiffness > 0) return scene.contact.stiffness;
  const Result<std::unique_ptr<io::LoadedScene>> loaded = io::load_scene(scene, console.progress());
  if (!loaded) return loaded.failure();
  const h6SessionDef def = (*loaded)->session_def();
  return h6StiffnessFor((*loaded)->model.get(), &def);
}

// The mesh that a field or a shell is baked from; null for baked files and given points.
template <class Source>
Result<io::Mesh> mesh_of(const Source& source, const io::Scene& scene) {
  if (source.mesh_data) return *source.mesh_data;
  if (source.mesh.empty()) return io::Mesh{};
  return io::read_mesh(source.mesh, source.unit.value_or(scene.unit));
}

// The bodies of a scene that have a field.
Result<std::vector<Subject>> subjects_of_scene(const io::Scene& scene) {
  std::vector<Subject> out;
  for (const io::SceneBody& b : scene.bodies) {
    if (!b.field) continue;
    Result<io::Mesh> mesh = mesh_of(*b.field, scene);
    if (!mesh) return mesh.failure();
    if (mesh->triangles.empty()) continue;
    out.push_back({b.name, std::move(*mesh), b.field->bake, b.pose});
  }
  return out;
}

// The distance of every shell from a field at the start of the scene, minus the field's offset.
Result<ordered_json> clearances(const Console& console, const io::Scene& scene, const Subject& s,
                                const ordered_json& m, unsigned threads) {
  ordered_json list = ordered_json::array();
  for (const io::SceneBody& b : scene.bodies) {
    if (!b.shell || b.name == s.name) continue;
    const Result<io::Mesh> mesh = mesh_of(*b.shell, scene);
    if (!mesh) return mesh.failure();
    const Result<double> gap = io::clearance(*mesh, b.pose, s.mesh, s.pose, threads);
    if (!gap) return gap.failure();
    if (!std::isfinite(*gap)) continue;
    const double voxels = (*gap - m["offset"].get<double>()) / m["finest_voxel"].get<double>();
    list.push_back({{"shell", b.name}, {"distance_m", *gap}, {"voxels", voxels}});
    if (!console.json)
      std::printf("  start   %s is %.3g mm away: %.3g voxels from contact\n",
                  printable(b.name).c_str(), 1e3 * *gap, voxels);
  }
  return list;
}

int check_command(const Console& console, CheckOptions& o, bool outside) {
  if (!o.field.empty() && o.files.size() > 1)
    return console.fail("--field is the field of one mesh: name one", kUsage);
  if (!o.field.empty())
    if (Outcome there = check_input(o.field); !there) return console.fail(there.error());
  const EndsAtOnce asked(console, o.files.front() + ": cancelled");
  ordered_json list = ordered_json::array();
  Verdict verdict;
  for (const std::string& file : o.files) {
    if (Outcome there = check_input(file); !there) return console.fail(there.error());
    std::vector<Subject> subjects;
    double stiffness = o.stiffness > 0 ? o.stiffness : 1e4;
    std::optional<io::Scene> scene;
    if (file.ends_with(".json")) {
      Result<io::Scene> read = io::read_scene(file, outside);
      if (!read) return console.fail(read.error());
      scene = std::move(*read);
      Result<std::vector<Subject>> found = subjects_of_scene(*scene);
      if (!found) return console.fail(found.error());
      subjects = std::move(*found);
      if (o.stiffness == 0 && !subjects.empty()) {
        const Result<double> own = stiffness_of(console, *scene);
        if (!own) return console.fail(own.error());
        if (*own > 0) stiffness = *own;
      }
    } else {
      std::string units = o.units;
      Result<io::Mesh> mesh = read_in_unit(console, file, o.units_option->count() > 0, units);
      if (!mesh) return console.fail(mesh.error());
      subjects.push_back(
          {file, std::move(*mesh), in_metres(o.bake, units), {{0, 0, 0}, {1, 0, 0, 0}}});
    }
    for (const Subject& s : subjects) {
      Result<ordered_json> m = check_one(console, o, s, stiffness, verdict);
      if (!m) return console.fail(m.error());
      if (scene) {
        Result<ordered_json> start = clearances(console, *scene, s, *m, o.bake.threads);
        if (!start) return console.fail(start.error());
        (*m)["clearances"] = std::move(*start);
      }
      list.push_back(std::move(*m));
    }
  }
  console.result(
      {{"meshes", list}, {"agrees", verdict.asked ? ordered_json(!verdict.bad) : ordered_json()}});
  return verdict.bad || verdict.lost ? kFailed : kOk;
}

}  // namespace

void add_check(CLI::App& app, Program& program) {
  CLI::App* check = app.add_subcommand(
      "check", "Whether meshes suit their voxels: walls, gaps, force; whether a field is right");
  auto o = std::make_shared<CheckOptions>();
  check->add_option("FILE", o->files, "Meshes, or scenes whose fields are meshes")
      ->required()
      ->option_text("FILE...");
  o->units_option =
      check->add_option("--units", o->units, "Unit of the meshes and of lengths here; default m")
          ->option_text("UNIT")
          ->check(one_of({"m", "mm", "cm", "in"}));
  auto* voxels =
      check
          ->add_option("--voxels", o->bake.voxels,
                       "Cells of the intended field, on the longest padded side; default 256")
          ->option_text("N")
          ->check(whole_within(16, 2048));
  check->add_option("--voxel-size", o->bake.voxel_size, "Edge of a voxel, instead of --voxels")
      ->option_text("S")
      ->excludes(voxels)
      ->check(number_above(0));
  check
      ->add_option("--tolerance", o->bake.tolerance,
                   "As for 'hapsix bake field', instead of --voxels: --verify then compares places "
                   "between nodes with it")
      ->option_text("S")
      ->excludes(voxels)
      ->excludes("--voxel-size")
      ->check(number_above(0));
  check->add_option("--offset", o->bake.offset, "As for 'hapsix bake field'")
      ->option_text("S")
      ->check(number_within(0, 1e6));
  check
      ->add_option("--seal", o->bake.seal,
                   "As for 'hapsix bake field'; samples may then be nearer than the mesh")
      ->option_text("WIDTH")
      ->check(number_within(0, 1e6));
  check
      ->add_option("--stiffness", o->stiffness,
                   "Of the contact, for the force that walls withstand [N/m]; default 1e4, or the "
                   "scene's")
      ->option_text("K")
      ->check(number_above(0));
  auto* field = check->add_option("--field", o->field, "A baked .vdb of the mesh: compare the two")
                    ->option_text("FILE");
  check->add_flag("--verify", o->verify, "Bake a field, keep it nowhere, and compare it")
      ->excludes(field);
  check->add_option("--points", o->exact.points, "Places to compare at; default 20000")
      ->option_text("N")
      ->check(whole_within(1, 100000000));
  check
      ->add_option("--far-points", o->exact.far_points,
                   "Places far from the mesh to compare at; default 50000")
      ->option_text("N")
      ->check(whole_within(1, 100000000));
  check->add_option("--threads", o->bake.threads, "Default: all of the machine's")
      ->option_text("N")
      ->check(whole_within(0, 1024));
  check->callback([&program, o] {
    program.work = [&program, o] {
      return check_command(program.console, *o, program.allow_outside);
    };
  });
}

}  // namespace h6::cli
