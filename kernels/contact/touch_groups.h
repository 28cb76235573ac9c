// SPDX-License-Identifier: Apache-2.0
// touch_groups.h - finds the points of groups of 16 that touch a field, and makes contacts of them.
#pragma once
#include "kernels/views.h"

namespace h6::kernels {

inline constexpr std::size_t kGroup = 16;  // consecutive points

// Points that touch: rows of the shell, distance and gradient as sample_field gives them [voxel].
struct Touching {
  std::uint32_t* row;
  float *distance, *gx, *gy, *gz;
};

// Which points of each group are sampled, and what their samples tell about the group.
struct GroupLook {
  const std::uint16_t* rows;  // bit i: point i of the group is sampled; null: all are
  float* least;               // the smallest sampled distance, infinity when none is sampled
  // Written for groups whose points are all sampled, unless `rows` is null. Bit i of near_rows:
  // point i is nearer than max(near, kNearLeast least). rest: the smallest distance of the other
  // points, or infinity.
  std::uint16_t* near_rows;
  float* rest;
  float near;  // [voxel]
  // reach[g]: the limit of the points of group g, at most `limit`; null: `limit` for all.
  const float* reach = nullptr;
  // Without `rows`: where points of bricks and of far cells are mixed, a `least` above the field's
  // band may be less than the smallest distance, down to the band. Such a bound is found sooner.
  bool roughly = false;
};
inline constexpr std::uint16_t kAllRows = 0xffff;
inline constexpr float kNearLeast = 3;

// Samples the points 16 g .. 16 g + 15 of groups g = groups[0..count-1] and writes, in order, those
// with a distance below 0, or below `limit` where the distance is a sample of a brick and not a
// bound. Returns their number. Columns of `points` are readable to whole groups; rows from
// points.count on are ignored. `out` has room for 16 count rows, columns of `look` for count.
// `cold`: the field is not in the caches, so memory is prefetched some groups ahead; the result is
// the same.
std::size_t touch_groups(const FieldView& field, const Affine& to_field, const PointsView& points,
                         const std::uint32_t* groups, std::size_t count, float limit, bool cold,
                         const GroupLook& look, const Touching& out);
std::size_t touch_groups_ref(const FieldView& field, const Affine& to_field,
                             const PointsView& points, const std::uint32_t* groups,
                             std::size_t count, float limit, bool cold, const GroupLook& look,
                             const Touching& out);

// Contacts made of the rows that touch: columns of the engine, in the world frame and metres.
struct ContactFrame {
  float Ra[9], Rb[9];  // rotations of the shell's and the field's body, row major
  float arm[3];        // of the shell's centre from the centre of mass  [m]
  float voxel;         // [m]
};
struct ShellColumns {
  const float *x, *y, *z, *nx, *ny, *nz;
  const std::uint32_t* point;
};
struct MadeContacts {
  float *depth, *nx, *ny, *nz, *gx, *gy, *gz, *rx, *ry, *rz;
  std::uint32_t* point;
};
// For rows 0..count-1: depth = -voxel distance, n = Ra n, g = Rb gradient / |gradient| (n where the
// gradient vanishes, on a medial sheet), r = Ra p + arm. Columns of the shell are readable to whole
// groups of 16. Fast when rows of one group follow each other, as touch_groups writes them.
void make_contacts(const ShellColumns& shell, const Touching& rows, std::size_t count,
                   const ContactFrame& frame, const MadeContacts& out);
void make_contacts_ref(const ShellColumns& shell, const Touching& rows, std::size_t count,
                       const ContactFrame& frame, const MadeContacts& out);

}  // namespace h6::kernels
