// SPDX-License-Identifier: Apache-2.0
// landing_gear.cpp - an airliner's landing gear in its bay as a soup of 1,789,551 triangles.
#include "io/scenes/industrial/landing_gear.h"

namespace h6::io {

IndustrialInput make_landing_gear(std::size_t probes) {
  using namespace industrial;
  Assembly a(kMm * kGearVoxel, 1789551);
  add_strut(a);
  add_wheels(a);
  add_bay(a);
  add_gear_lines(a);
  Defects defects;
  defects.narrow_holes = 120;
  defects.flipped_pieces = 0.15;
  defects.mixed_pieces = 0.05;
  defects.triangles = 1789551;
  return a.broken(defects, probes);
}

}  // namespace h6::io
