// SPDX-License-Identifier: Apache-2.0
// contacts.h - the contacts of one shell body in columns, one row for each touching point.
#pragma once
#include <cstdint>

#include "runtime/base/arena.h"

namespace h6 {

struct Contacts {
  float* depth;          // penetration depth, > 0; `series`: <= 0 before a point touches [m]
  float *nx, *ny, *nz;   // direction of the push: inward unit normal; `firm` leans it. World frame
  float *gx, *gy, *gz;   // unit gradient of the field, world frame, outward
  float *rx, *ry, *rz;   // arm from the centre of mass, world frame           [m]
  float *tx, *ty, *tz;   // torque direction T, world frame
  float* facing;         // c = clamp(N.g / 0.25, 0, 1), or 1; `firm`: push_directions
  float* weight;         // share of the stiffness
  float* load;           // elastic force over k: weight * depth, or lambda (series) [m]
  float *slack, *kappa;  // `series`, `firm`: series_solve, then series_loads      [m], [1]
  std::uint32_t* point;  // index into the shell's points
  std::int32_t* field_body;
  std::uint32_t* cell;  // `firm`: Shell::cell; null: every contact is on its own
  std::size_t count, capacity;
};

// Calls f for every column. Columns are listed here only.
template <class F>
void each_column(Contacts& c, F&& f) {
  for (float** column : {&c.depth, &c.nx, &c.ny, &c.nz, &c.gx, &c.gy, &c.gz, &c.rx, &c.ry, &c.rz,
                         &c.tx, &c.ty, &c.tz, &c.facing, &c.weight, &c.load, &c.slack, &c.kappa})
    f(*column);
  f(c.point);
  f(c.field_body);
  f(c.cell);
}

inline void take_columns(Contacts& c, Arena& arena, std::size_t capacity) {
  each_column(c, [&](auto*& column) {
    column = arena.take<std::remove_reference_t<decltype(*column)>>(capacity);
  });
  c.count = 0;
  c.capacity = capacity;
}

// Lays the columns side by side for up to `rows` <= capacity contacts. What they held is lost. With
// few contacts, columns then share pages of memory. So 1,024 sessions of 94 contacts make 1.16 to
// 1.20 times as many steps a second (h6StepMany, AVX-512).
inline void place_columns(Contacts& c, std::size_t rows) {
  H6_ASSERT(rows <= c.capacity);
  Arena arena(c.depth, SIZE_MAX);  // the first column
  each_column(c, [&](auto*& column) {
    auto* const at = arena.take<std::remove_reference_t<decltype(*column)>>(rows);
    if (column) column = at;
  });
}

}  // namespace h6
