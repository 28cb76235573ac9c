// SPDX-License-Identifier: Apache-2.0
// settings.h - the settings of a session: every stage may read them, none changes them.
#pragma once
#include <cstddef>
#include <cstdint>

#include "hapsix/hapsix.h"
#include "runtime/base/math.h"

namespace h6 {

// Stiffness of a contact between light bodies, where no definition sets one [N/m].
inline constexpr double kLeastStiffness = 1e4;

struct Settings {
  h6ContactDef contact{};
  h6Integrator integrator = H6_IMPLICIT;
  h6Gradient gradient = H6_SYMMETRIC;
  double dt = 1e-3;              // length of a step: of a frame, or of one of its substeps [s]
  Vec3 gravity = Vec3::Zero();   // world frame [m/s^2]
  bool net_stiffness = false;    // the report includes it
  std::size_t max_contacts = 0;  // limit for one shell body
  std::uint32_t max_substeps = 1;
};

// Whether all contacts of a shell body stand in series with one spring.
inline bool uses_series(const h6ContactDef& contact) {
  return contact.method == H6_METHOD_SERIES || contact.method == H6_METHOD_FIRM;
}

}  // namespace h6
