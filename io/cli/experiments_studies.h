// experiments_studies.h - what the paper's experiments ask beside single scenes: how stable, how
// smooth, how dependent on the sampling each method is.
#pragma once
#include "io/cli/experiments_report.h"

namespace h6::cli {

struct StudyKind {
  const char* name;
  const char* about;
  Study (*run)(const std::vector<MethodColumn>& columns, const Console& console);
};
const std::vector<StudyKind>& studies();

// experiments_motion.cpp: runs of scenes, varied.
Study study_stability(const std::vector<MethodColumn>& columns, const Console& console);
Study study_sampling(const std::vector<MethodColumn>& columns, const Console& console);
Study study_force(const std::vector<MethodColumn>& columns, const Console& console);
Study study_voxel(const std::vector<MethodColumn>& columns, const Console& console);
Study study_share(const std::vector<MethodColumn>& columns, const Console& console);

// experiments_poses.cpp: contacts at given poses, nothing moves by itself.
Study study_smoothness(const std::vector<MethodColumn>& columns, const Console& console);
Study study_net_stiffness(const std::vector<MethodColumn>& columns, const Console& console);
Study study_energy(const std::vector<MethodColumn>& columns, const Console& console);
Study study_time(const std::vector<MethodColumn>& columns, const Console& console);

}  // namespace h6::cli
