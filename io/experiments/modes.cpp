// SPDX-License-Identifier: Apache-2.0
// modes.cpp - the peg held by a simulated arm, in every device mode and with delay (Fig. 13).
#include <algorithm>
#include <cmath>

#include "io/experiments/grid.h"
#include "io/scenes/scenes.h"

namespace h6::cli {
namespace {

constexpr int kDelays = 3;  // 0, 1 and 2 frames
constexpr int kSteps = 20;  // steps of a gain up or down, each by a factor of sqrt(2)
constexpr double kStep = 1.4142135623730951;

enum class Gain { coupling, hand };

struct Mode {
  const char* name;
  std::uint32_t mode;
  h6CouplingMode coupling;
  Gain gain;
};
const Mode kModes[] = {
    {"impedance", H6_IMPEDANCE, H6_COUPLING_DYNAMIC, Gain::coupling},
    {"impedance, static", H6_IMPEDANCE, H6_COUPLING_STATIC, Gain::coupling},
    {"admittance", H6_ADMITTANCE, H6_COUPLING_DYNAMIC, Gain::hand},
    {"pseudo-admittance", H6_PSEUDO_ADMITTANCE, H6_COUPLING_DYNAMIC, Gain::coupling}};

const char* gain_name(Gain gain) {
  return gain == Gain::coupling ? "largest k_VC [N/m]" : "stiffest grip [N/m]";
}

bool stable(const RunFigures& run) {
  return run.error.empty() && run.verdict != io::Verdict::unstable && run.late_depth_swing < 0.1 &&
         run.late_hand_swing < 1e-4;
}

// At rest, the peg also does not tremble with the steps of the encoders.
bool at_rest(const RunFigures& run) {
  return stable(run) && run.verdict != io::Verdict::chatters && run.late_speed < 2e-3;
}

// The peg a little too far to the side, turned, and 3 mm too deep. A hand that aims farther, as in
// the scene, saturates the coupling, and a pull that stays the same is stable with any delay.
io::Path light_press(const io::LoadedScene& loaded) {
  const h6Pose start = loaded.scene.hands[0].path.front().pose;
  h6Pose side = start, down;
  side.p.x += 2e-3;
  side.q = {std::cos(0.02), 0, std::sin(0.02), 0};
  down = side;
  down.p.z -= 13e-3;
  return {{0, start}, {0.05, start}, {0.15, side}, {0.25, side}, {0.6, down}, {1.6, down}};
}

// One run with the mode's gain times `factor`, on the scene's path or on another one.
RunFigures run_mode(const io::LoadedScene& loaded, const MethodColumn& method, const Mode& mode,
                    int delay, double factor, const io::Path* path = nullptr) {
  RunChange change;
  change.path = path;
  change.method = method;
  change.device = "arm";
  change.arm.emplace();
  change.arm->delay_frames = delay;
  if (mode.gain == Gain::hand) {  // keeps the damping ratio
    change.arm->grip_stiffness *= factor, change.arm->grip_rotational_stiffness *= factor;
    change.arm->grip_damping *= std::sqrt(factor);
    change.arm->grip_rotational_damping *= std::sqrt(factor);
  }
  change.also = [&](h6SessionDef&, h6HandDef& hand) {
    hand.mode = mode.mode;
    hand.coupling.mode = mode.coupling;
    if (mode.gain == Gain::coupling)
      hand.coupling.stiffness *= factor, hand.coupling.rotational_stiffness *= factor;
  };
  return run_experiment(loaded, change);
}

// The largest stable gain, in steps from the default: -kSteps .. kSteps, or -kSteps - 1 when none
// is stable.
int largest_gain(const std::function<bool(int)>& holds) {
  if (holds(kSteps)) return kSteps;
  int low = -kSteps - 1, high = kSteps;
  if (holds(0))
    low = 0;
  else
    high = 0;
  while (high - low > 1) {
    const int middle = low + (high - low) / 2;
    (holds(middle) ? low : high) = middle;
  }
  return low;
}

// The value of the gain after `steps` steps; 0 when none is stable.
double gain_value(Gain gain, const io::LoadedScene& loaded, int steps) {
  const double first =
      gain == Gain::coupling ? loaded.hands[0].coupling.stiffness : io::SceneArm{}.grip_stiffness;
  return steps < -kSteps ? 0 : first * std::pow(kStep, steps);
}

std::string gain_text(Gain gain, const io::LoadedScene& loaded, int steps) {
  if (steps < -kSteps) return "none";
  return (steps < kSteps ? "" : "≥ ") + number(gain_value(gain, loaded, steps), 0);
}

bool compared(const std::string& method) {
  return method == "robust" || method == "series" || method == "firm";
}

struct Row {
  const Mode* mode;
  std::size_t method;
  RunFigures defaults[kDelays];
  int limits[kDelays];  // in steps
};

}  // namespace

Study study_modes(const std::vector<MethodColumn>& columns, const Console& console) {
  Study out;
  out.title = "Fig. 13: device modes and delay";
  out.about =
      "The peg of Fig. 10 in a simulated arm (mass, friction, encoder steps, filtered velocity, "
      "1 kHz sample and hold, drive at 10 kHz) that a person holds. The arm gets its commands "
      "0, 1 or 2 frames late. First, with the default gains: verdict, deepest contact in "
      "voxels, and the RMS speed of the peg in the last 0.2 s. Then the largest stable gain, to "
      "a factor of √2, with a hand that aims only 3 mm under the floor and does not saturate the "
      "coupling. A gain is unstable when the handle moves by more than 0.1 mm (ten steps of its "
      "encoders) or the depth by more than 0.1 voxel in the last 0.2 s, while the hand rests, or "
      "when the run is unstable; smaller gains are assumed no worse. In the modes with a virtual "
      "coupling the gain is "
      "k_VC (default 1000 N/m). In admittance mode it is the stiffness of the grip (default "
      "1500 N/m), which closes the loop through the force sensor.";
  Result<io::Scene> scene = io::make_scene("peg-in-hole");
  if (!scene) return out;
  auto loaded = io::load_scene(std::move(*scene));
  if (!loaded) return out;
  const io::Path light = light_press(**loaded);
  std::vector<Row> rows;
  for (const Mode& mode : kModes)
    for (std::size_t m = 0; m < columns.size(); ++m)
      if (compared(columns[m].name)) rows.push_back({&mode, m, {}, {}});
  std::vector<std::function<void()>> jobs;
  for (Row& row : rows)
    for (int delay = 0; delay < kDelays; ++delay) {
      jobs.push_back([&, delay] {
        const MethodColumn& method = columns[row.method];
        row.defaults[delay] = run_mode(**loaded, method, *row.mode, delay, 1);
        row.limits[delay] = largest_gain([&](int steps) {
          return stable(
              run_mode(**loaded, method, *row.mode, delay, std::pow(kStep, steps), &light));
        });
      });
    }
  run_jobs(jobs, console, "device modes");

  out.table = {{"mode, method", "what", "0 frames", "1 frame", "2 frames"}};
  bool all = true;
  for (const Row& row : rows) {
    const std::string& method = columns[row.method].name;
    const std::string name = std::string(row.mode->name) + ", " + method;
    auto& json = out.json[row.mode->name][method];
    out.table.push_back({name, "defaults"});
    for (int delay = 0; delay < kDelays; ++delay) {
      const RunFigures& run = row.defaults[delay];
      all = all && at_rest(run);
      out.table.back().push_back(cell(run) + ", " + number(1e3 * run.late_speed, 2) + " mm/s" +
                                 (at_rest(run) ? "" : " (not at rest)"));
      json["defaults"].push_back({{"verdict", io::verdict_name(run.verdict)},
                                  {"at_rest", at_rest(run)},
                                  {"max_depth_voxels", run.max_depth_voxels},
                                  {"late_speed", run.late_speed},
                                  {"late_depth_swing_voxels", run.late_depth_swing}});
      if (!run.error.empty()) json["defaults"].back()["error"] = run.error;
    }
    const Gain gain = row.mode->gain;
    out.table.push_back({name, gain_name(gain)});
    for (const int steps : row.limits) {
      out.table.back().push_back(gain_text(gain, **loaded, steps));
      json[gain_name(gain)].push_back(gain_value(gain, **loaded, steps));
    }
  }
  out.after = all ? "With the default gains all modes are at rest at every delay."
                  : "With the default gains some of these do not come to rest.";
  return out;
}

}  // namespace h6::cli
