// SPDX-License-Identifier: Apache-2.0
// bent_shell.h - how a shell bends: the modes of a reduced model at the shell's points.
#pragma once
#include <memory>
#include <vector>

#include "hapsix/hapsix.h"
#include "hapsix/result.h"
#include "io/deform/reduced_model.h"

namespace h6::io {

struct BentShell {
  std::unique_ptr<const ReducedModel> model;
  std::vector<float> modes;  // (points x r x 3) [1/sqrt(kg)]
  double farthest = 0;       // how far outside the model's elements a point lies [m]

  // Points at this object's arrays.
  h6DeformableDef def() const;
};

// `points` [m] in the model's frame; there is at least one. The model must be fixed somewhere, and
// the shell must lie in it or near it: half of the shell's size outside is another part, or another
// unit. Error sentences call the model `name`.
Result<BentShell> bend_shell(ReducedModel model, const std::vector<h6Vec3>& points,
                             const std::string& name);

}  // namespace h6::io
