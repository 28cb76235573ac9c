// SPDX-License-Identifier: Apache-2.0
#include "io/deform/bent_shell.h"

#include <cmath>
#include <cstdio>

namespace h6::io {

h6DeformableDef BentShell::def() const {
  h6DeformableDef out = h6DefaultDeformableDef();
  out.mode_count = static_cast<std::uint32_t>(model->modes);
  out.modes = modes.data();
  out.linear = model->linear.data();
  if (turns.empty())
    out.quadratic = model->quadratic.data(), out.cubic = model->cubic.data();
  else
    out.turn_modes = turns.data();
  out.alpha = model->mass_damping;
  out.beta = model->stiffness_damping;
  return out;
}

Result<BentShell> bend_shell(ReducedModel model, const std::vector<h6Vec3>& points,
                             const std::string& name) {
  if (model.free)
    return Failure{name +
                   ": a model that is fixed nowhere would float away, since the body of a shell "
                   "that bends stands still; bake it with --fix-box"};
  BentShell out;
  double outside = 0;
  const std::vector<double> modes = modes_at(model, points, &outside);
  h6Vec3 low = points.front(), high = low;
  for (const h6Vec3& p : points) low = min(low, p), high = max(high, p);
  const double size = norm(high - low);
  char text[160];
  std::snprintf(text, sizeof text, ": points of the shell lie up to %.4g m outside its elements",
                outside);
  if (outside > 0.5 * size)
    return Failure{name + text + "; it must be in metres, in the frame of the shell's mesh"};
  if (outside > 0.02 * size) out.remark = name + text + ", where they follow the nearest element";
  out.modes.assign(modes.begin(), modes.end());
  if (!model.turn.empty()) {
    const std::vector<double> turns = turns_at(model, points);
    out.turns.assign(turns.begin(), turns.end());
  }
  out.model = std::make_unique<const ReducedModel>(std::move(model));
  return out;
}

}  // namespace h6::io
