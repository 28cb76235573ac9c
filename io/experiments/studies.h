// SPDX-License-Identifier: Apache-2.0
// studies.h - studies of the methods beside the table of scenes: how stable and how smooth each
// method is, and how much it depends on the sampling.
#pragma once
#include <functional>

#include "io/experiments/report.h"

namespace h6::cli {

struct StudyKind {
  const char* name;
  const char* about;
  std::function<Study(const std::vector<MethodColumn>& columns, const Console& console)> run;
  bool long_run = false;  // takes minutes, so it runs only when it is named
};
const std::vector<StudyKind>& studies();

// stability.cpp
Study study_stability(const std::vector<MethodColumn>& columns, const Console& console);
// variations.cpp
Study study_sampling(const std::vector<MethodColumn>& columns, const Console& console);
Study study_force(const std::vector<MethodColumn>& columns, const Console& console);
Study study_voxel(const std::vector<MethodColumn>& columns, const Console& console);
// share.cpp
Study study_share(const std::vector<MethodColumn>& columns, const Console& console);
// global.cpp
Study study_global(const std::vector<MethodColumn>& columns, const Console& console);
// alpha.cpp
Study study_pushes(const std::vector<MethodColumn>& columns, const Console& console);
// industrial.cpp: a scene of io/scenes/industrial or io/scenes/machines
Study study_industrial(const std::string& scene, const std::vector<MethodColumn>& columns,
                       const Console& console);
// forced_paths.cpp: engine-bay or landing-gear on `count` seeded paths, at least 1; the first ones
// do not depend on it
Study study_forced_paths(const std::string& scene, const std::vector<MethodColumn>& columns,
                         const Console& console, std::size_t count);
// smoothness.cpp
Study study_smoothness(const std::vector<MethodColumn>& columns, const Console& console);
Study study_ripple(const std::vector<MethodColumn>& columns, const Console& console);
// stiffness.cpp
Study study_net_stiffness(const std::vector<MethodColumn>& columns, const Console& console);
Study study_two_planes(const std::vector<MethodColumn>& columns, const Console& console);
// modes.cpp
Study study_modes(const std::vector<MethodColumn>& columns, const Console& console);
// energy.cpp
Study study_energy(const std::vector<MethodColumn>& columns, const Console& console);
// loops.cpp: `loops` seeded loops on each surface, at least 1
Study study_loops(const std::vector<MethodColumn>& columns, const Console& console,
                  std::size_t loops);
// time.cpp
Study study_time(const std::vector<MethodColumn>& columns, const Console& console);

}  // namespace h6::cli
