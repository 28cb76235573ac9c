// SPDX-License-Identifier: Apache-2.0
#include "io/propose/doubt.h"

namespace h6::io {

const char* doubt_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::through:
      return "in the trial the part went through a wall; a smaller \"voxel_size\" of the field "
             "or a smaller \"max_force\" of the coupling holds more, and 'hapsix check' says how "
             "much";
    case Verdict::chatters:
      return "in the trial the part trembled; a heavier part, more \"damping\" or a lower "
             "\"stiffness\" of the contact calms it";
    case Verdict::unstable:
    case Verdict::sunk:
      return "the trial failed; a smaller \"voxel_size\" of the field, a smaller \"max_force\" of "
             "the coupling or a lower \"stiffness\" of the contact may help";
    case Verdict::untouched:
      return "the part touched nothing in the trial: move it by hand in the view";
    default:
      return nullptr;
  }
}

}  // namespace h6::io
