// SPDX-License-Identifier: Apache-2.0
// replayed_contacts.h - the contacts of a frame of a recording, which holds none: they are computed
// again.
#pragma once
#include <vector>

#include "io/scene/load_scene.h"
#include "io/view/report.h"

namespace h6::io::view {

// A contact that touches, of the frame that was stepped last. Contacts stand in the order of
// bodies.
struct ReplayedContact {
  ReportContact contact;   // world frame [m]
  std::size_t body, with;  // whose shell's point touches, whose field
  std::uint32_t point;     // of the shell
  float load;              // force along the normal over k [m]
};
std::vector<ReplayedContact> replayed_contacts(const LoadedScene& scene, const h6Session* session);

// The coordinates of the bodies that bend, one body after another [m sqrt(kg)].
std::vector<float> replayed_bends(const LoadedScene& scene, const h6Session* session);

}  // namespace h6::io::view
