// SPDX-License-Identifier: Apache-2.0
#include "io/experiments/studies.h"

namespace h6::cli {
namespace {

// A scene under every method; it runs only when it is asked for.
StudyKind by_name(const char* scene, const char* about) {
  return {scene, about,
          [scene](const auto& columns, const auto& console) {
            return study_industrial(scene, columns, console);
          },
          true};
}

}  // namespace

const std::vector<StudyKind>& studies() {
  static const std::vector<StudyKind> kinds = {
      {"global", "where the paper says global scaling fails", study_global},
      {"two-planes", "Fig. 4: stiffness of two inclined planes", study_two_planes},
      {"alpha-pushes", "Fig. 8: the alpha pushed in many ways", study_pushes},
      by_name("engine-bay", "Figs. 1, 10: a starter motor forced in its engine bay"),
      by_name("landing-gear", "Figs. 1, 11: an actuator forced in a landing gear"),
      by_name("wire-bundle", "cf. Fig. 12: a bar dragged over a loom"),
      by_name("spline-hub-1k", "a splined shaft in its hub, 1,000 points on driven flanks"),
      by_name("spline-hub-10k", "the same with 10,000"),
      by_name("spline-hub-100k", "the same with 100,000"),
      by_name("piston-in-bore", "cf. Fig. 10: a piston in its bore"),
      by_name("gear-train", "a gear turned against two others"),
      by_name("bridge-and-dinosaur", "Fig. 14: a rigid dinosaur on a bridge that bends"),
      by_name("clip-and-rod", "a rod snaps into a clip that bends"),
      by_name("hose-in-bracket", "a hose that bends in the eye of a bracket"),
      by_name("alphas-in-two-hands", "cf. Fig. 9: the alphas in two hands"),
      {"forced-paths", "a starter motor forced through its engine bay",
       [](const auto& columns, const auto& console) {
         return study_forced_paths("engine-bay", columns, console, 50);
       },
       true},
      {"forced-paths-gear", "an actuator forced through its landing gear",
       [](const auto& columns, const auto& console) {
         return study_forced_paths("landing-gear", columns, console, 50);
       },
       true},
      {"modes", "Fig. 13: device modes and delay", study_modes},
      {"stability", "largest stable stiffness", study_stability},
      {"resampling", "other samplings of the shell", study_sampling},
      {"push-harder", "more force", study_force},
      {"voxel-size", "finer fields around thin parts", study_voxel},
      {"smoothness", "force smoothness", study_smoothness},
      {"ripple", "force and torque ripple on baked fields", study_ripple},
      {"net-stiffness", "net stiffness against sampling", study_net_stiffness},
      {"energy", "energy of a cycle and of a bounce", study_energy},
      {"loops", "net work of random closed loops",
       [](const auto& columns, const auto& console) { return study_loops(columns, console, 30); }},
      {"plate-share", "Fig. 7: how few contacts are still heard", study_share},
      {"time", "Fig. 6: time against the number of contacts", study_time},
  };
  return kinds;
}

}  // namespace h6::cli
