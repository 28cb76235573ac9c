// touch_points.h - which of some points touch a field, and their contacts.
#pragma once
#include "kernels/views.h"

namespace h6::kernels {

inline constexpr std::size_t kGroup = 16;  // points that stand next to each other

// Points that touch: rows of the shell, distance and gradient as sample_field gives them [voxel].
struct Touching {
  std::uint32_t* row;
  float *distance, *gx, *gy, *gz;
};

// Samples points rows[0..count-1], all below points.count, and writes those with a distance below
// `limit`, in order; returns how many. distance[i] is that of rows[i]. `out` has room for `count`
// rows, rounded up to whole groups. Fast where whole groups of rows follow each other. `cold`: the
// field is not in the caches, so memory is asked for some groups before they are sampled; the
// result is the same.
std::size_t touch_points(const FieldView& field, const Affine& to_field, const PointsView& points,
                         const std::uint32_t* rows, std::size_t count, float limit, bool cold,
                         const Touching& out, float* distance);
std::size_t touch_points_ref(const FieldView& field, const Affine& to_field,
                             const PointsView& points, const std::uint32_t* rows, std::size_t count,
                             float limit, bool cold, const Touching& out, float* distance);

// What traversal keeps of points that were sampled: how far the shell may travel before each can
// touch, now + max(0, cull_clearance(distance - margin) - slack), at expiry[rows[i]].
void note_expiry(const std::uint32_t* rows, const float* distance, std::size_t count, float margin,
                 bool wide, float now, float slack, float* expiry);
void note_expiry_ref(const std::uint32_t* rows, const float* distance, std::size_t count,
                     float margin, bool wide, float now, float slack, float* expiry);

// Contacts from rows that touch: columns of the engine, in the world frame and metres.
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
// depth = -voxel distance, n = Ra n, g = Rb gradient / |gradient| (n where that vanishes, on a
// medial sheet), r = Ra p + arm, for rows 0..count-1. Columns of the shell are readable to whole
// groups of 16. Fast where rows of a group follow each other, as touch_points writes them.
void make_contacts(const ShellColumns& shell, const Touching& rows, std::size_t count,
                   const ContactFrame& frame, const MadeContacts& out);
void make_contacts_ref(const ShellColumns& shell, const Touching& rows, std::size_t count,
                       const ContactFrame& frame, const MadeContacts& out);

}  // namespace h6::kernels
