// SPDX-License-Identifier: Apache-2.0
// probes.h - points of an assembly that are known to be inside, outside or on a sheet.
#pragma once
#include "io/scenes/industrial/assembly.h"

namespace h6::io::industrial {

class Prober {
 public:
  explicit Prober(const Assembly& assembly) : all_(assembly), voxel_(assembly.voxel_ / kMm) {}
  void fill(IndustrialTruth& truth, std::size_t probes) const;

 private:
  using Probe = IndustrialTruth::Probe;
  // A point inside the piece, behind the given triangle and more than a voxel away from all of the
  // piece's triangles. The clearance is 0 when there is none.
  Probe behind(const Assembly::Range& range, std::size_t triangle) const;
  void solids(IndustrialTruth& truth, std::size_t probes) const;
  void sheets(IndustrialTruth& truth, std::size_t probes) const;
  void surroundings(IndustrialTruth& truth, std::size_t probes) const;

  const Assembly& all_;
  double voxel_;  // [mm]
};

}  // namespace h6::io::industrial
