// SPDX-License-Identifier: Apache-2.0
// bent_shell.h - how a shell bends: the modes of a reduced model at the shell's points.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "hapsix/hapsix.h"
#include "hapsix/result.h"
#include "io/deform/reduced_model.h"

namespace h6::io {

struct BentShell {
  std::unique_ptr<const ReducedModel> model;
  std::vector<float> modes;  // (points x r x 3) [1/sqrt(kg)]
  std::vector<float> turns;  // (points x r x 3) [rad/(m sqrt(kg))], or empty
  std::string remark;        // a sentence where points lie outside the model's elements; or empty

  // Points at this object's arrays.
  h6DeformableDef def() const;
};

// `points` [m] in the model's frame; there is at least one. The model must be fixed somewhere, and
// the shell must lie in it or near it: points outside by a 50th of the shell's size are remarked
// on, and half of its size outside is another part, or another unit. Sentences call the model
// `name`.
Result<BentShell> bend_shell(ReducedModel model, const std::vector<h6Vec3>& points,
                             const std::string& name);

}  // namespace h6::io
