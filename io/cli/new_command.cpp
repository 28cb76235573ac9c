// SPDX-License-Identifier: Apache-2.0
// new_command.cpp - hapsix new PART ENVIRONMENT...: a scene from meshes, ready to touch.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <fstream>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>

#include "io/cli/commands.h"
#include "io/cli/tables.h"
#include "io/cli/view_run.h"
#include "io/console/checks.h"
#include "io/file/write_aside.h"
#include "io/propose/doubt.h"
#include "io/propose/propose_scene.h"
#include "io/run/try_run.h"
#include "io/scene/scene_file.h"
#include "io/view/page.h"

namespace h6::cli {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using nlohmann::ordered_json;

struct NewOptions {
  std::string part, out = "scene.json", units, up;
  std::vector<std::string> environment;
  bool force = false, no_view = false;
  ViewOptions view;
};

// The files of a scene lie below its folder, so meshes from elsewhere are copied beside it.
struct Files {
  std::vector<std::string> names;                     // of the meshes, as the scene names them
  std::vector<std::pair<fs::path, fs::path>> copies;  // from, to
};

bool same_bytes(const fs::path& a, const fs::path& b) {
  std::error_code error;
  if (fs::file_size(a, error) != fs::file_size(b, error) || error) return false;
  std::ifstream x(a, std::ios::binary), y(b, std::ios::binary);
  return std::equal(std::istreambuf_iterator<char>(x), {}, std::istreambuf_iterator<char>(y));
}

Result<Files> place_files(const std::vector<fs::path>& meshes, const fs::path& scene) {
  const fs::path folder = scene.has_parent_path() ? scene.parent_path() : ".";
  Files out;
  for (const fs::path& mesh : meshes) {
    std::error_code error;
    if (io::lies_below(mesh, scene)) {
      out.names.push_back(fs::relative(mesh, folder, error).generic_string());
      continue;
    }
    if (mesh.extension() == ".gltf")
      return Failure{mesh.string() +
                     ": a .gltf names files beside it, so it is not copied to the "
                     "scene: write the scene above it with -o, or export a .glb"};
    const fs::path to = folder / mesh.filename();
    for (const auto& [from, taken] : out.copies)
      if (taken == to && !fs::equivalent(from, mesh, error))
        return Failure{mesh.string() + ": another mesh has the same name; rename one of them"};
    if (fs::exists(to, error) && !same_bytes(mesh, to))
      return Failure{to.string() + " is there already and is another file than " + mesh.string() +
                     ": write the scene to another folder with -o"};
    out.copies.emplace_back(mesh, to);
    out.names.push_back(mesh.filename().string());
  }
  return out;
}

Outcome copy_files(const Files& files) {
  for (const auto& [from, to] : files.copies) {
    std::error_code error;
    if (fs::exists(to, error)) continue;
    Outcome copied = io::write_aside(to, [&](const fs::path& aside) -> Outcome {
      std::error_code failed;
      fs::copy_file(from, aside, fs::copy_options::overwrite_existing, failed);
      if (failed) return Failure{from.string() + ": cannot be copied: " + failed.message()};
      return Done{};
    });
    if (!copied) return copied;
  }
  return Done{};
}

std::string slurp(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

// A scene that someone changed by hand is not overwritten.
Outcome write_scene(const NewOptions& o, bool over, const std::string& text, const io::Scene& scene,
                    const fs::path& path_file) {
  std::error_code error;
  if (!over && fs::exists(o.out, error) && slurp(o.out) != text)
    return Failure{o.out +
                   " is there already and is another scene: choose a name with -o, or "
                   "overwrite it with --force"};
  const std::string rows = io::path_text(scene.hands[0].path, scene.unit);
  if (Outcome written = io::write_text_aside(path_file, rows); !written) return written;
  return io::write_text_aside(o.out, text);
}

Outcome check_arguments(const NewOptions& o) {
  for (const std::string& mesh : o.environment)
    if (Outcome there = check_input(mesh); !there) return there;
  if (Outcome there = check_input(o.part); !there) return there;
  return check_output(o.out);
}

io::Wanted wanted_of(const NewOptions& o) {
  io::Wanted wanted;
  wanted.part = o.part;
  wanted.environment.assign(o.environment.begin(), o.environment.end());
  if (!o.units.empty()) wanted.unit = *io::unit_from_name(o.units);
  if (!o.up.empty())
    wanted.up = o.up == "x" ? io::UpAxis::x : o.up == "y" ? io::UpAxis::y : io::UpAxis::z;
  return wanted;
}

std::string trial_sentence(const Trial& t) {
  char text[240];
  const std::string when =
      t.first_contact ? "first contact at " + number(*t.first_contact, 2) + " s" : "no contact";
  std::snprintf(text, sizeof text,
                "%.3g s in virtual time: %s, up to %u contacts, %.2f voxel deep, %.2g N; %s",
                t.seconds, when.c_str(), t.totals.contacts_max, t.totals.max_depth_voxels,
                t.totals.max_force, io::verdict_name(t.totals.verdict));
  return text;
}

struct Made {
  std::unique_ptr<io::LoadedScene> loaded;
  Trial trial;
  ordered_json json;
};

class NewScene {
 public:
  NewScene(const Console& console, const NewOptions& options)
      : console_(console), o_(options), begun_(Clock::now()) {}

  Result<Made> make() {
    if (Outcome good = check_arguments(o_); !good) return good.failure();
    const io::Wanted wanted = wanted_of(o_);
    std::vector<fs::path> meshes = wanted.environment;
    meshes.push_back(wanted.part);
    const Result<Files> files = place_files(meshes, o_.out);
    if (!files) return files.failure();
    Result<io::ScenePlan> plan = io::plan_scene(wanted);
    if (!plan) return plan.failure();
    console_.warn(plan->warnings);
    tell(plan->choices);
    auto loaded = io::load_scene(plan->scene, console_.progress());
    if (!loaded) return loaded.failure();
    console_.warn((*loaded)->warnings);
    if (!console_.json) console_.log(assets(**loaded));
    Result<io::StartPlace> start = io::find_start(*plan, **loaded);
    if (!start) return start.failure();
    Result<Trial> trial = attempt(*start, *files, **loaded);
    if (!trial) return trial.failure();
    if (start->overlaps && io::doubt_of(trial->totals.verdict)) {
      // Where the overlap is no fit, the way out of it leads through a wall.
      Result<io::StartPlace> other = io::find_start(*plan, **loaded, true);
      if (other) {
        start = std::move(other);
        trial = attempt(*start, *files, **loaded);
        if (!trial) return trial.failure();
      }
    }
    Made made{std::move(*loaded), *trial, std::move(json_)};
    fill(made, *start);
    return made;
  }

 private:
  void tell(const std::vector<io::Chosen>& choices) {
    for (const io::Chosen& c : choices) {
      char about[16];
      std::snprintf(about, sizeof about, "%-7s ", c.about.c_str());
      if (!console_.json) console_.log("  " + std::string(about) + c.text);
      json_["choices"].push_back({{"about", c.about}, {"text", c.text}});
    }
  }

  // Tells of a start, writes the scene with it, and tries it.
  Result<Trial> attempt(const io::StartPlace& start, const Files& files, io::LoadedScene& loaded) {
    tell(start.choices);
    if (Outcome written = write(files, loaded); !written) return written.failure();
    written_ = true;
    Result<Trial> trial = try_run(loaded);
    if (trial) tell({{"tried", trial_sentence(*trial)}});
    return trial;
  }

  // Writes the files, and reads the scene again as `run` will.
  Outcome write(const Files& files, io::LoadedScene& loaded) {
    if (Outcome copied = copy_files(files); !copied) return copied;
    const fs::path path_file = fs::path(o_.out).replace_extension(".csv");
    loaded.scene.about =
        "made by 'hapsix new' of " + std::to_string(files.names.size()) + " meshes";
    const std::string text =
        io::proposal_text(loaded.scene, files.names, path_file.filename().string());
    if (Outcome written = write_scene(o_, o_.force || written_, text, loaded.scene, path_file);
        !written)
      return written;
    Result<io::Scene> read = io::read_scene(o_.out);
    if (!read) return read.failure();
    loaded.scene = std::move(*read);
    for (std::size_t i = 0; i < loaded.bodies.size(); ++i)
      loaded.bodies[i].pose = loaded.scene.bodies[i].pose;
    return Done{};
  }

  void fill(Made& made, const io::StartPlace& start) const {
    const io::LoadedScene& l = *made.loaded;
    const double scale = 1 / io::metres(l.scene.unit);
    const char* const doubt = io::doubt_of(made.trial.totals.verdict);
    ordered_json choices = std::move(made.json["choices"]);
    made.json = {
        {"scene", o_.out},
        {"path", fs::path(o_.out).replace_extension(".csv").string()},
        {"units", io::unit_name(l.scene.unit)},
        {"up", io::up_axis_name(l.scene.up)},
        {"moves", l.scene.hands[0].body},
        {"start",
         {{"kept", start.kept},
          {"overlaps", start.overlaps},
          {"shift", {start.shift.x * scale, start.shift.y * scale, start.shift.z * scale}},
          {"gap", start.gap * scale}}},
        {"trial",
         {{"seconds", made.trial.seconds},
          {"first_contact",
           made.trial.first_contact ? ordered_json(*made.trial.first_contact) : ordered_json()},
          {"contacts_max", made.trial.totals.contacts_max},
          {"max_depth_voxels", made.trial.totals.max_depth_voxels},
          {"verdict", io::verdict_name(made.trial.totals.verdict)}}},
        {"doubt", doubt ? ordered_json(doubt) : ordered_json()},
        {"seconds", std::chrono::duration<double>(Clock::now() - begun_).count()},
        {"choices", std::move(choices)}};
  }

  const Console& console_;
  const NewOptions& o_;
  Clock::time_point begun_;
  ordered_json json_{{"choices", ordered_json::array()}};
  bool written_ = false;  // the scene there is this command's own
};

// The view opens where someone sits at a terminal, or when it is asked for.
bool wants_view(const Console& console, const NewOptions& o) {
  if (o.view.on) return true;
  return !o.no_view && !console.json && isatty(STDOUT_FILENO) != 0 &&
         !io::view::live_page().empty();
}

int new_command(const Console& console, const NewOptions& o) {
  Result<Made> made = Failure{""};
  {
    const EndsAtOnce asked(console, "cancelled");
    made = NewScene(console, o).make();
  }
  if (!made) return console.fail(made.error());
  const std::string file = printable(o.out);
  if (!console.json) std::printf("scene: %s\n", file.c_str());
  if (const char* doubt = io::doubt_of(made->trial.totals.verdict)) console.warn({doubt});
  if (!wants_view(console, o)) {
    if (!console.json) std::printf("see it: hapsix run %s --view\n", file.c_str());
    console.result(made->json);
    return kOk;
  }
  std::fflush(stdout);
  const Outcome viewed = view_scene(*made->loaded, {}, o.view, console, [](const RunSummary&) {});
  if (!viewed) return console.fail(viewed.error());
  console.result(made->json);
  return kOk;
}

}  // namespace

void add_new(CLI::App& app, Program& program) {
  CLI::App* command =
      app.add_subcommand("new", "A scene from meshes: a part, what it touches, and a hand");
  auto o = std::make_shared<NewOptions>();
  command->add_option("PART", o->part, "The mesh that moves: STL, OBJ, PLY, glTF or COLLADA")
      ->required()
      ->option_text("FILE");
  command->add_option("ENVIRONMENT", o->environment, "The meshes that it touches")
      ->required()
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->option_text("FILE...");
  command->add_option("-o,--output", o->out, "The scene to write; default scene.json")
      ->option_text("FILE.json")
      ->check(ends_with(".json"));
  command->add_option("--units", o->units, "Unit of the mesh files: m, mm, cm or in; else guessed")
      ->option_text("UNIT")
      ->check(one_of({"m", "mm", "cm", "in"}));
  command->add_option("--up", o->up, "The axis that points up: x, y or z; else guessed")
      ->option_text("AXIS")
      ->check(one_of({"x", "y", "z"}));
  command->add_flag("--force", o->force, "Overwrite another scene of that name");
  command->add_flag("--no-view", o->no_view,
                    "Only write the scene; without a terminal nothing else happens");
  add_view_options(*command, o->view);
  command->callback(
      [&program, o] { program.work = [&program, o] { return new_command(program.console, *o); }; });
}

}  // namespace h6::cli
