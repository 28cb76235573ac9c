// SPDX-License-Identifier: Apache-2.0
#include "io/experiments/scenes.h"

#include <filesystem>
#include <mutex>

#include "io/scenes/scenes.h"

namespace h6::cli {

// The prototype's figures are for comparison and are not targets. It damped the coupling outside
// its bound, its contact damping could pull, and its Gauss columns all had the facing filter. The
// table is data, so it may be longer than a screen.
const std::vector<TableScene>& table_scenes() {
  static const std::vector<TableScene> scenes = {
      {"box-on-wall-explicit",
       "Fig. 2",
       "Integrated explicitly, the unscaled penalty is unstable where the scaled ones are stable.",
       "",
       false,
       {}},
      {"cone-in-gap",
       "Fig. 3",
       "Global scaling lets the cone slide in under the ceiling; the adaptive weights hold it.",
       "Without the facing filter the paper's two forms fail here: once the tip is under "
       "the ceiling's edge, contacts whose normals oppose the field's gradient get full "
       "weight and drag the cone on, past the hand (in the recordings it ends tens of "
       "millimetres ahead of it). The prototype's Gauss columns all had the filter; with "
       "it both hold.",
       true,
       {{"none", "held .21"},
        {"global", "through 1.99"},
        {"cluster", "held .21"},
        {"gauss3+facing", "held .87"},
        {"gauss6+facing", "held .49"},
        {"robust", "held .40"},
        {"series", "held .32"}}},
      {"box-on-plates",
       "Fig. 7",
       "The 6-DoF weights keep few contacts from being outvoted by many with the same normal.",
       "The small plate is one and a half voxels wide: only one row of samples lies inside it, "
       "half a voxel deep, so its interpolated depth ends at 0.50 where the true one goes to "
       "0.75. `cluster` is at its threshold: points stand half a voxel apart up to rounding, "
       "so chance decides which of them it merges. In the prototype it chattered; here it "
       "merges little and stays near the unscaled penalty, with the same depth and force "
       "jumps.",
       true,
       {{"none", "held .01"},
        {"global", "held .50"},
        {"cluster", "chatters"},
        {"gauss3+facing", "through"},
        {"gauss6+facing", "through"},
        {"robust", "held .24"},
        {"series", "held .15"}}},
      {"rod-between-tubes",
       "Fig. 8",
       "Forced with 20 N, global scaling goes through the gap; the adaptive weights do not.",
       "",
       true,
       {{"none", "held .06"},
        {"global", "through"},
        {"cluster", "held .09"},
        {"gauss3+facing", "held .14"},
        {"gauss6+facing", "held .12"},
        {"robust", "held .21"},
        {"series", "held .30"}}},
      {"peg-in-hole",
       "Fig. 10",
       "In a tight fit the penetration stays below half a voxel with adaptive weights.",
       "Stiff rules go deeper than in the prototype: along the wall `none` is 0.01 voxel deep "
       "and `robust` 0.04, but where the peg's edge comes into the corner between wall and "
       "floor, which samples one voxel apart round off, single contacts go to 0.1 and 0.16.",
       true,
       {{"none", "held .04"},
        {"global", "held 1.12"},
        {"cluster", "held .04"},
        {"gauss3+facing", "held .47"},
        {"gauss6+facing", "held .27"},
        {"robust", "held .09"},
        {"series", "held .16"}}},
      {"box-over-wire",
       "Fig. 12",
       "A thin wire stops the box although hundreds of contacts carry it on the plate.",
       "A wire of one voxel's radius is at the limit of what a field can hold: its axis lies "
       "midway between samples, so the interpolated depth never exceeds 1 - √½ = 0.29 voxel, "
       "whatever the true depth is. A rule that balances the pull only at a greater depth runs "
       "out of force, and chatters or pops. The study of finer fields shows it: from 0.5 mm on "
       "`gauss6+facing` holds as in the prototype, and `gauss3+facing`, which at 1 mm pops as "
       "the prototype's does, needs 0.65 mm to 0.8 mm.",
       true,
       {{"none", "held .04"},
        {"global", "held .37"},
        {"cluster", "through"},
        {"gauss3+facing", "through"},
        {"gauss6+facing", "held .44"},
        {"robust", "held .33"},
        {"series", "held .17"}}},
      {"box-over-fused-wire",
       "Fig. 12, one field",
       "As box-over-wire.",
       "Uniform voxels of 1 mm round off the corner between plate and wire (study of finer "
       "fields): the box's front edge comes to lie on that fillet, is lifted, and rides over the "
       "wire without ever being more than 0.3 voxel deep. There, the lowest row of points at the "
       "box's edge stands 0.16 mm deep by interpolation where the exact depth is 0.08 mm, and its "
       "gradient leans back by 22°. So the cause is the field and not the rule. The scene "
       "therefore has a field with a tolerance of a third of a millimetre, which takes 1.4 times "
       "the memory of voxels of 1 mm; its depths are counted in its finest spacing, 0.5 mm.",
       false,
       {}},
      {"box-over-post",
       "Fig. 12, upright",
       "The same with the wire as a post.",
       "As in box-over-wire, the field of a post of one voxel's radius is never deeper than "
       "0.29 voxel; the prototype's `gauss3+facing` held only 0.97 deep, its `gauss6+facing` "
       "0.54. From 0.5 mm on `gauss6+facing` holds here too. `global` does the same in every "
       "field. `gauss3+facing` chatters even at 0.25 mm: it needs points 0.85 mm deep to "
       "balance 5 N, and interpolation clips the field's ridge at 0.82 mm. On the ridge 100 "
       "contacts make 4.7 N. A row of points that crosses the ridge faces away and its share "
       "goes to the others, so the force jumps to 5.5 N from one frame to the next, around the "
       "5 N that it should be. With a pull of 4.75 N the box is calm, and with a field of "
       "0.125 mm it holds.",
       true,
       {{"none", "held .04"},
        {"global", "through"},
        {"cluster", "through"},
        {"gauss3+facing", "held .97"},
        {"gauss6+facing", "held .54"},
        {"robust", "held .30"},
        {"series", "held .17"}}},
      {"alpha-shortcut",
       "Fig. 8, the alpha puzzle",
       "Forced at the shortcut, the alpha never gets through with the adaptive weights.",
       "",
       false,
       {}},
      {"alpha-solution",
       "Fig. 8, the way that does go through",
       "The puzzle can be solved: led along a collision-free way, the alpha arrives.",
       "",
       false,
       {}},
  };
  return scenes;
}

const io::LoadedScene* SharedScene::get() {
  const std::lock_guard<std::mutex> hold(lock_);
  if (loaded_ || !error_.empty()) return loaded_.get();
  Result<io::Scene> scene = make_();
  if (!scene) {
    error_ = scene.error();
    return nullptr;
  }
  auto loaded = io::load_scene(std::move(*scene));
  if (!loaded)
    error_ = loaded.error();
  else
    loaded_ = std::move(*loaded);
  return loaded_.get();
}

std::vector<SceneRow> run_scene_table(const std::vector<const TableScene*>& scenes,
                                      const std::vector<MethodColumn>& columns,
                                      const std::string& folder, const Console& console) {
  std::vector<SceneRow> rows(scenes.size());
  std::vector<std::unique_ptr<SharedScene>> shared;
  std::vector<std::function<void()>> jobs;
  for (std::size_t s = scenes.size();
       s-- > 0;) {  // in reverse, because the last scene takes longest and should start first
    const TableScene* scene = scenes[s];
    rows[s] = {scene, std::vector<RunFigures>(columns.size()),
               std::vector<std::string>(columns.size())};
    shared.push_back(
        std::make_unique<SharedScene>([scene] { return io::make_scene(scene->name); }));
    for (std::size_t m = 0; m < columns.size(); ++m) {
      RunChange change;
      change.method = columns[m];
      if (!folder.empty()) {
        std::string file = std::string(scene->name) + "-" + columns[m].name + ".h5";
        for (char& c : file)
          if (c == '/') c = '-';
        rows[s].recordings[m] = file;
        change.record = (std::filesystem::path(folder) / file).string();
      }
      jobs.push_back([&row = rows[s], m, change, from = shared.back().get()] {
        if (const io::LoadedScene* loaded = from->get())
          row.runs[m] = run_experiment(*loaded, change);
        else
          row.runs[m].error = from->error();
      });
    }
  }
  run_jobs(jobs, console, "scenes");
  return rows;
}

std::string cell(const RunFigures& run) {
  if (!run.error.empty()) return "failed";
  if (run.verdict == io::Verdict::unstable) return "unstable";
  if (run.never_touched() && run.verdict != io::Verdict::untouched)
    return std::string(io::verdict_name(run.verdict)) + " untouched";
  return std::string(io::verdict_name(run.verdict)) + " " + number(run.max_depth_voxels, 2);
}

}  // namespace h6::cli
