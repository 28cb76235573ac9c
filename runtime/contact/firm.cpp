// SPDX-License-Identifier: Apache-2.0
// firm.cpp - what the rule `firm` knows of each contact: the direction in which it pushes, its
// presence in the density, the stiffness of its direction. METHOD.md, Sec. 3.
#include "kernels/contact/smooth_depths.h"
#include "kernels/field/sample_around.h"
#include "kernels/field/sample_field.h"
#include "runtime/contact/contact_stages.h"
#include "runtime/contact/traverse_pair.h"
#include "runtime/contact/weighing.h"

namespace h6 {
namespace {

constexpr double kPresent = 0.1;  // the depth from which a contact counts in full [voxel]

// At most kPushedRows rows, begin..end-1, of one pair. Distances at the contacts and a voxel
// away go to columns that are filled later. `shifted`: depths have relief or play in them. A
// refined field is as exact as its tolerance says, so its depths stay as they are.
void push_rows(Contacts& c, const Body& b, const kernels::Affine& place, bool shifted,
               std::size_t begin, std::size_t end) {
  const kernels::FieldView& field = b.field->view;
  const kernels::PointsView arms{c.rx + begin, c.ry + begin, c.rz + begin, end - begin};
  // Half the finest spacing away. The contacts have no more columns that are filled later.
  float half_way[6][kPushedRows];
  float* const at[13] = {c.tx + begin,    c.ty + begin,   c.tz + begin,     c.slack + begin,
                         c.kappa + begin, c.load + begin, c.weight + begin, half_way[0],
                         half_way[1],     half_way[2],    half_way[3],      half_way[4],
                         half_way[5]};
  const auto per_voxel = static_cast<float>(-1 / b.field->voxel);
  for (std::size_t i = begin; i < end && !shifted; ++i) c.tx[i] = per_voxel * c.depth[i];
  if (shifted)
    kernels::sample_field(field, place, arms, nullptr, arms.count, at[0], nullptr, nullptr,
                          nullptr);
  kernels::Crosses crosses{{at[0], at[1], at[2], at[3], at[4], at[5], at[6]}, field.band, {}, {}};
  for (int k = 0; k < 9; ++k) crosses.turn[k] = static_cast<float>(b.R(k / 3, k % 3));
  for (int k = 0; k < 3; ++k) crosses.last[k] = static_cast<float>(8 * field.size[k] - 1);
  const auto step = static_cast<float>(b.field->finest / (2 * b.field->voxel));
  if (b.field->finest < b.field->voxel) {
    kernels::sample_cross(field, place, arms, step, at + 7);
  } else {
    kernels::sample_ends(field, place, arms, at + 1);
    kernels::smooth_depths(crosses, place, arms, static_cast<float>(b.field->voxel),
                           c.depth + begin, c.gx + begin, c.gy + begin, c.gz + begin);
  }
  crosses.step = step;
  for (int k = 1; k < 7; ++k) crosses.at[k] = at[6 + k];
  kernels::push_directions(kernel_columns(c, begin, end), &crosses, c.nx + begin, c.ny + begin,
                           c.nz + begin, c.facing + begin);
}

}  // namespace

void push_firmly(const Settings& set, const Body& b, const Pair& pair, Contacts& c,
                 std::size_t begin, std::size_t end) {
  const bool shifted = pair.search.fit.count > 0 || set.contact.fit_offset > 0;
  const Vec6 ahead = Eigen::Map<const Eigen::Matrix<float, 6, 1>>(pair.search.ahead).cast<double>();
  push_rows(c, b, pair.search.arms, shifted, begin, end);
  kernels::series_gap(kernel_columns(c, begin, end), c.depth + begin, 1, ahead.data(),
                      c.slack + begin);
  note_firmness(c, set.contact, b.field->finest, begin, end);
}

void note_firmness(Contacts& c, const h6ContactDef& def, double voxel, std::size_t begin,
                   std::size_t end) {
  const kernels::Firmness f{static_cast<float>(kPresent * voxel), static_cast<float>(voxel / 2),
                            static_cast<float>(def.firmness_shallow),
                            static_cast<float>(def.firmness - def.firmness_shallow)};
  kernels::firmness(c.depth + begin, end - begin, f, c.slack + begin, c.kappa + begin);
}

}  // namespace h6
