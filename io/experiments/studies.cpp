// SPDX-License-Identifier: Apache-2.0
#include "io/experiments/studies.h"

namespace h6::cli {

const std::vector<StudyKind>& studies() {
  static const std::vector<StudyKind> kinds = {
      {"global", "where the paper says global scaling fails", study_global},
      {"two-planes", "Fig. 4: stiffness of two inclined planes", study_two_planes},
      {"alpha-pushes", "Fig. 8: the alpha pushed in many ways", study_pushes},
      {"forced-paths", "a starter motor forced through its engine bay",
       [](const auto& columns, const auto& console) {
         return study_forced_paths(columns, console, 50);
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
