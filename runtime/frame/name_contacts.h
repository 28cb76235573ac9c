// SPDX-License-Identifier: Apache-2.0
// name_contacts.h - the part and the triangle of a field's mesh near a place.
#pragma once
#include <cstdint>

#include "runtime/model/model.h"

namespace h6 {

struct NamedPlace {
  std::int32_t part, triangle;  // -1: the field names none, or no brick holds the place
};
NamedPlace name_place(const Field& field, const float (&at)[3]);  // at [voxel]

}  // namespace h6
