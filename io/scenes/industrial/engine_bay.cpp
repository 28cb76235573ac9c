// SPDX-License-Identifier: Apache-2.0
// engine_bay.cpp - a car's engine bay as a soup of 505,276 triangles.
#include "io/scenes/industrial/engine_bay.h"

namespace h6::io {
namespace industrial {

Frame starter_seat() {
  const h6Vec3 up = unit(h6Vec3{0, -0.34, 0.94}), along = {1, 0, 0};
  return {kStarterSeat, cross(up, along), up, along};
}

}  // namespace industrial

IndustrialInput make_engine_bay(std::size_t probes) {
  using namespace industrial;
  Assembly a(kMm * kBayVoxel, 505276);
  add_engine(a);
  add_drive(a);
  add_body_shell(a);
  add_radiator(a);
  add_harness(a);
  Defects defects;
  defects.narrow_holes = 60;
  defects.flipped_pieces = 0.15;
  defects.mixed_pieces = 0.05;
  defects.triangles = 505276;
  return a.broken(defects, probes);
}

}  // namespace h6::io
