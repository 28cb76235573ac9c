// SPDX-License-Identifier: Apache-2.0
// check_api.cpp - is a field right, and which force do its walls hold, for C.
#include <cmath>

#include "io/api/guard.h"
#include "io/api/objects.h"
#include "io/check/exact_check.h"
#include "io/check/push_walls.h"
#include "io/check/wall_thickness.h"

using namespace h6;
using namespace h6::io;

namespace {

// The sentence of what failed; empty: it was checked.
std::string check(const Mesh& mesh, const FieldData& field, const h6CheckDef& def,
                  h6CheckReport& out) {
  const Progress progress = progress_of(def.progress, def.user);
  ExactCheckOptions exact;
  exact.points = def.points, exact.threads = def.threads;
  exact.sealed = field.sign_mode == "winding" || field.sign_mode == "flood";
  const Result<ExactCheck> found = check_exactly(mesh, field, exact, progress);
  if (!found) return found.error();
  out.agrees = found->agrees(), out.drains = found->drains();
  out.leak = found->leak;
  out.worst_node = found->worst_node, out.worst_between = found->worst_between;
  WallOptions options;
  options.threads = def.threads;
  const Result<Walls> walls = measure_walls(mesh, options);
  if (!walls) return walls.error();
  out.wall_hundredth = quantile(walls->thickness, 0.01);
  out.wall_median = quantile(walls->thickness, 0.5);
  out.gap_hundredth = quantile(walls->gap, 0.01);
  out.gap_median = quantile(walls->gap, 0.5);
  if (!def.push || out.drains) return "";
  const Result<HeldForce> held =
      find_held_force(mesh, field, walls->places, def.stiffness, def.threads, progress);
  if (!held) return held.error();
  out.pushed = held->places, out.holding_force = held->force, out.weakest = held->weakest.p;
  return "";
}

}  // namespace

extern "C" {

h6CheckDef h6DefaultCheckDef(void) {
  h6CheckDef def{};
  def.stiffness = 1e4, def.points = ExactCheckOptions{}.points, def.push = true;
  return def;
}

bool h6CheckField(const h6Mesh* mesh, const h6Field* field, const h6CheckDef* def,
                  h6CheckReport* out, h6Error* error) {
  if (out) *out = {};
  if (!mesh || !field || !out)
    return fill(error, H6_ERROR_ARGUMENT, "a mesh, its field and a report are needed"), false;
  const h6CheckDef used = def ? *def : h6DefaultCheckDef();
  if (!understood(used, error)) return false;
  if (!(used.stiffness > 0 && used.stiffness <= 1e9) || used.points < 1 || used.points > 100000000)
    return fill(error, H6_ERROR_RANGE,
                "stiffness must be in (0, 1e9] N/m, and points in 1..100000000"),
           false;
  return guarded(error, false, [&] {
    const std::string why = check(mesh->mesh, field->data, used, *out);
    if (!why.empty()) *out = {}, fill(error, H6_ERROR_CONTENT, why);
    return why.empty();
  });
}

}  // extern "C"
