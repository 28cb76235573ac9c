// SPDX-License-Identifier: Apache-2.0
// plan_scene.cpp - units, up axis, voxels, points and stiffness of a proposed scene.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "io/bake/plan.h"
#include "io/propose/guess.h"
#include "io/propose/propose_scene.h"

namespace h6::io {
namespace {

namespace fs = std::filesystem;

constexpr double kBakeSeconds = 8;                 // of all fields together, as planned
constexpr double kBakeBytes = 1.5e9;               // the same
constexpr double kForce = 3;                       // [N] that contact should reach
constexpr double kSoftest = 1e4, kStiffest = 1e5;  // of a contact [N/m]

std::string line(const char* pattern, auto... values) {
  char text[300];
  std::snprintf(text, sizeof text, pattern, values...);
  return text;
}

Mesh joined(const std::vector<const Mesh*>& meshes) {
  Mesh all;
  for (const Mesh* mesh : meshes) {
    const auto first = static_cast<std::uint32_t>(all.vertices.size());
    all.vertices.insert(all.vertices.end(), mesh->vertices.begin(), mesh->vertices.end());
    for (const auto& t : mesh->triangles)
      all.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  return all;
}

double area_of(const Mesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles)
    sum += norm(cross(mesh.vertices[t[1]] - mesh.vertices[t[0]],
                      mesh.vertices[t[2]] - mesh.vertices[t[0]])) /
           2;
  return sum;
}

// A solid whose edges miss each other here and there: closed by its winding, its surface stays
// where it is, while an offset would eat the clearance.
bool nearly_closed(const MeshAudit& a) {
  return !a.closed && a.flipped_edges == 0 && a.volume != 0 &&
         static_cast<double>(a.odd_edges) < 0.03 * 1.5 * static_cast<double>(a.triangles);
}

struct Input {
  fs::path file;
  Mesh mesh;
  MeshAudit audit;
  Unit unit = Unit::m;
};

// Reads all meshes in the unit that is wanted or guessed.
class Planner {
 public:
  explicit Planner(const Wanted& wanted) : wanted_(wanted) {}

  Result<ScenePlan> plan() {
    if (Outcome read = read_all(); !read) return read.failure();
    choose_up();
    Result<std::unique_ptr<FreeWay>> way = free_way();
    if (!way) return way.failure();
    out_.way = std::move(*way);
    if (Outcome fields = choose_fields(); !fields) return fields.failure();
    choose_shell();
    choose_gains();
    return std::move(out_);
  }

 private:
  const Input& part() const { return inputs_.back(); }
  std::size_t others() const { return inputs_.size() - 1; }
  void say(const char* about, const std::string& text) { out_.choices.push_back({about, text}); }

  Outcome read_all() {
    std::vector<fs::path> files = wanted_.environment;
    files.push_back(wanted_.part);
    const bool all_state = std::all_of(files.begin(), files.end(),
                                       [](const fs::path& f) { return states_unit(f.string()); });
    double longest = 0;
    for (const fs::path& file : files) {
      Result<Mesh> mesh = read_mesh(file, wanted_.unit.value_or(all_state ? Unit::mm : Unit::m));
      if (!mesh) return mesh.failure();
      if (!states_unit(file.string())) longest = std::max(longest, bounds_of(*mesh).longest());
      inputs_.push_back({file, std::move(*mesh), {}, wanted_.unit.value_or(Unit::mm)});
    }
    Unit unit = wanted_.unit.value_or(Unit::mm);
    if (wanted_.unit) {
      say("units", line("%s, as given", unit_name(unit)));
    } else if (all_state) {
      say("units", "mm in the scene; the meshes state their own");
    } else {
      const UnitGuess guess = guess_unit(files, longest);
      unit = guess.unit;
      say("units", line("%s, guessed: ", unit_name(unit)) + guess.why + "; --units says otherwise");
      if (Outcome scaled = rescale(unit); !scaled) return scaled;
    }
    out_.scene.unit = unit;
    for (Input& input : inputs_) input.audit = audit(input.mesh);
    name_bodies();
    return sizes_fit();
  }

  // The meshes were read in metres. Where the others are in millimetres, a mesh that would then be
  // smaller than one is in metres all the same: its file is from elsewhere.
  Outcome rescale(Unit unit) {
    for (Input& input : inputs_) {
      const double own = bounds_of(input.mesh).longest();
      const bool states = states_unit(input.file.string());
      input.unit = !states && unit == Unit::mm && own < 1 ? Unit::m : unit;
      if (input.unit != unit)
        say("", "'" + input.file.filename().string() +
                    line("' is taken for metres: it would be %.3g mm long", own));
      if (input.unit == Unit::m) continue;
      if (!states) {
        for (Vec3& v : input.mesh.vertices) v = metres(input.unit) * v;
        continue;
      }
      Result<Mesh> again = read_mesh(input.file, input.unit);
      if (!again) return again.failure();
      input.mesh = std::move(*again);
    }
    return Done{};
  }

  Outcome sizes_fit() {
    out_.size = bounds_of(part().mesh).longest();
    if (!(out_.size > 0)) return Failure{part().file.string() + ": the mesh has no size"};
    double longest = 0;
    for (std::size_t i = 0; i < others(); ++i)
      longest = std::max(longest, bounds_of(inputs_[i].mesh).longest());
    const Unit unit = out_.scene.unit;
    const double ratio = std::max(longest / out_.size, out_.size / longest);
    if (ratio > 100)
      out_.warnings.push_back(
          line("the sizes of the meshes differ by a factor of %.3g (%s and %s): "
               "are they in one unit?",
               ratio, length_text(out_.size, unit).c_str(), length_text(longest, unit).c_str()));
    const std::string mover = out_.scene.bodies.back().name;
    say("moves",
        "'" + mover + "', " + length_text(out_.size, unit) + " long, against " +
            (others() == 1 ? "'" + out_.scene.bodies[0].name + "'" : line("%zu meshes", others())) +
            ", " + length_text(longest, unit) + " long" +
            (out_.size > 1.5 * longest ? "; to move the smaller one, name it first" : ""));
    return Done{};
  }

  void name_bodies() {
    for (std::size_t i = 0; i < inputs_.size(); ++i) {
      fs::path stem = inputs_[i].file.filename();
      while (stem.has_extension() && stem.stem() != stem) {
        const std::string ending = stem.extension().string();
        if (ending.size() > 8) break;
        stem = stem.stem();
      }
      const std::string wanted = stem.string();
      SceneBody body;
      body.name = wanted;
      const auto taken = [&] {
        return std::any_of(out_.scene.bodies.begin(), out_.scene.bodies.end(),
                           [&](const SceneBody& b) { return b.name == body.name; });
      };
      for (int n = 2; taken(); ++n) body.name = wanted + "-" + std::to_string(n);
      body.fixed = i + 1 < inputs_.size();
      out_.scene.bodies.push_back(body);
    }
    SceneHand hand;
    hand.body = out_.scene.bodies.back().name;
    out_.scene.hands.push_back(hand);
    out_.scene.name = out_.scene.bodies.back().name + " in " + out_.scene.bodies[0].name;
  }

  void choose_up() {
    const UpGuess guess = guess_up(inputs_[0].file, inputs_[0].mesh);
    out_.scene.up = wanted_.up.value_or(guess.up);
    const char* name = up_axis_name(out_.scene.up);
    say("up", wanted_.up ? line("%s, as given", name)
                         : line("%s, guessed: ", name) + guess.why + "; --up says otherwise");
  }

  Result<std::unique_ptr<FreeWay>> free_way() {
    std::vector<const Mesh*> all;
    for (std::size_t i = 0; i < others(); ++i) all.push_back(&inputs_[i].mesh);
    Result<std::unique_ptr<FreeWay>> way = FreeWay::make(part().mesh, joined(all), wanted_.threads);
    if (!way) return Failure{part().file.string() + ": " + way.error()};
    return way;
  }

  // Voxels: a 400th of the environment and a 64th of the part, fine enough for the clearance that
  // the parts have in their given place. Where voxels that fine would cost too much, a tolerance
  // samples finely only where it must.
  Outcome choose_fields() {
    double longest = 0;
    for (std::size_t i = 0; i < others(); ++i)
      longest = std::max(longest, bounds_of(inputs_[i].mesh).longest());
    double voxel = std::min(longest / 400, std::max(out_.size / 64, longest / 512));
    const FreeWay::Nearest given = out_.way->nearest({});
    const bool fits = given.distance > 1e-4 * out_.size && given.distance < 0.05 * out_.size &&
                      out_.way->inside({}) == 0;
    std::string why = "a 400th of the environment, a 64th of the part or finer";
    FieldBake bake;
    bake.threads = wanted_.threads;
    if (fits && given.distance < 2 * voxel) {
      why = "for the clearance of " + length_text(given.distance, out_.scene.unit) +
            " in the given place";
      if (given.distance / 2 >= longest / 512) {
        voxel = given.distance / 2;
      } else {  // a tolerance is an eighth of its coarse voxel
        bake.tolerance = std::max({given.distance / 4, voxel / 32, longest / 4096});
        voxel = 8 * bake.tolerance;
      }
    }
    return fit_budget(bake, voxel, why);
  }

  // Coarser, until the plan of the bake is short and small enough.
  Outcome fit_budget(FieldBake bake, double voxel, std::string why) {
    const Unit unit = out_.scene.unit;
    for (bool coarser = false;; coarser = true, voxel *= 1.25) {
      const double size = rounded(voxel / metres(unit), 2) * metres(unit);
      double seconds = 0, bytes = 0, widest = 0;
      bool fits = true;
      for (std::size_t i = 0; i < others(); ++i) {
        FieldBake own = bake;
        if (bake.tolerance > 0)
          own.tolerance = rounded(voxel / 8 / metres(unit), 2) * metres(unit);
        else
          own.voxel_size = size;
        if (nearly_closed(inputs_[i].audit)) own.sign = SignMode::winding;
        const Result<FieldPlan> plan = plan_field(inputs_[i].mesh, inputs_[i].audit, own);
        if (!plan && voxel > 0.2 * out_.size)
          return Failure{inputs_[i].file.string() + ": " + plan.error()};
        fits = fits && plan;
        if (plan) {
          seconds += plan->seconds, bytes += static_cast<double>(plan->engine_bytes);
          widest = std::max(widest, plan->voxel_size);
        }
        FieldSource source;
        source.mesh = inputs_[i].file, source.bake = own, source.unit = inputs_[i].unit;
        out_.scene.bodies[i].field = source;
      }
      if (!fits || ((seconds > kBakeSeconds || bytes > kBakeBytes) && voxel < 0.05 * out_.size))
        continue;
      out_.voxel = widest;
      if (coarser) why += ", coarser so that the bake stays short";
      say("fields",
          (bake.tolerance > 0
               ? "to an error of " + length_text(out_.scene.bodies[0].field->bake.tolerance, unit)
               : "voxels of " + length_text(size, unit)) +
              ": " + why + (seconds >= 1 ? line("; about %.0f s to bake", seconds) : ""));
      for (std::size_t i = 0; i < others(); ++i)
        if (out_.scene.bodies[i].field->bake.sign == SignMode::winding)
          say("", "'" + out_.scene.bodies[i].name +
                      line("' has %zu open edges: closed by its winding, where it stands",
                           inputs_[i].audit.odd_edges));
      return Done{};
    }
  }

  void choose_shell() {
    ShellSource shell;
    shell.mesh = part().file, shell.unit = part().unit;
    const double spacing = 2.5 * out_.voxel;
    const double points = area_of(part().mesh) / (spacing * spacing);
    shell.bake.points = static_cast<std::size_t>(rounded(std::clamp(points, 2000.0, 30000.0), 2));
    shell.bake.threads = wanted_.threads;
    out_.scene.bodies.back().shell = shell;
    say("shell", line("%zu points on the part", shell.bake.points));
  }

  // Half a voxel of depth should bear kForce, and the hand should have to lead by a twentieth of
  // the part for it.
  void choose_gains() {
    out_.stiffness = rounded(std::clamp(2 * kForce / out_.voxel, kSoftest, kStiffest), 2);
    const double force = out_.stiffness * out_.voxel / 2;
    out_.coupling = rounded(
        std::clamp(force / (0.05 * out_.size), out_.stiffness / 100, out_.stiffness / 10), 2);
    out_.scene.contact.stiffness = out_.stiffness;
    out_.scene.coupling.stiffness = out_.coupling;
    say("gains", line("%.3g N/m in contact and %.3g N/m in the coupling: the hand feels up to %.2g "
                      "N (stiffness times half a voxel); mass %.3g kg",
                      out_.stiffness, out_.coupling, force, out_.scene.bodies.back().mass));
  }

  const Wanted& wanted_;
  std::vector<Input> inputs_;  // the environment, then the part
  ScenePlan out_;
};

}  // namespace

std::string length_text(double metres_long, Unit unit) {
  const Unit shown = unit == Unit::m ? Unit::mm : unit;
  return line("%.3g %s", metres_long / metres(shown), unit_name(shown));
}

double rounded(double value, int digits) {
  char text[40];
  std::snprintf(text, sizeof text, "%.*e", digits - 1, value);
  return std::strtod(text, nullptr);
}

Result<ScenePlan> plan_scene(const Wanted& wanted) { return Planner(wanted).plan(); }

}  // namespace h6::io
