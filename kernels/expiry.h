// expiry.h - values that are each good until something has passed them, in blocks of 16.
//
// Traversal keeps, for every point, group of points and block of groups, how far the shell may
// travel before it can touch: its expiry. Few expire in a frame; these find them.
//
//   blocks, groups   float, voxels of the way
//   points           16 bits, rounded down to 1/256 voxel; those of a group count once it is known
#pragma once
#include "kernels/views.h"

namespace h6::kernels {

inline constexpr std::size_t kBlock = 16;

// Appends to `out`, in order, every index 16 b + i with values[16 b + i] <= now, for the blocks
// b = blocks[0..count-1] (or 0..count-1 when blocks is null). Room for 16 count. Returns how many.
std::size_t expired(const float* values, const std::uint32_t* blocks, std::size_t count, float now,
                    std::uint32_t* out);
std::size_t expired_ref(const float* values, const std::uint32_t* blocks, std::size_t count,
                        float now, std::uint32_t* out);

// Appends to `out`, in order, every block of `blocks` with `most` or more values <= now.
std::size_t mostly_expired(const float* values, const std::uint32_t* blocks, std::size_t count,
                           float now, std::size_t most, std::uint32_t* out);
std::size_t mostly_expired_ref(const float* values, const std::uint32_t* blocks, std::size_t count,
                               float now, std::size_t most, std::uint32_t* out);

// out[blocks[k]] = the least of the block's 16 values. No NaN.
void least_of_blocks(const float* values, const std::uint32_t* blocks, std::size_t count,
                     float* out);
void least_of_blocks_ref(const float* values, const std::uint32_t* blocks, std::size_t count,
                         float* out);

inline constexpr float kPointQuantum = 1.0f / 256.0f;  // [voxel]
inline constexpr float kNeverExpires = 65535.0f;       // in quanta

// Points 16 g .. 16 g + 15 of group g. Bit g % 16 of known[g / 16]: its expiries say something.
struct PointExpiries {
  const std::uint16_t* value;
  const std::uint16_t* known;
  std::size_t points;
};

// The same of points: groups that are not known, or `most` or more of whose points have expired.
std::size_t mostly_expired_points(const PointExpiries& points, const std::uint32_t* groups,
                                  std::size_t count, float now, std::size_t most,
                                  std::uint32_t* out);
std::size_t mostly_expired_points_ref(const PointExpiries& points, const std::uint32_t* groups,
                                      std::size_t count, float now, std::size_t most,
                                      std::uint32_t* out);

// Appends to `out`, in order, all points that have expired, and all of groups that are not known.
// Room for 16 count. Returns how many.
std::size_t expired_points(const PointExpiries& points, const std::uint32_t* groups,
                           std::size_t count, float now, std::uint32_t* out);
std::size_t expired_points_ref(const PointExpiries& points, const std::uint32_t* groups,
                               std::size_t count, float now, std::uint32_t* out);

// out[groups[k]] = the least expiry of the group's points [voxel], whether known or not.
void least_of_points(const PointExpiries& points, const std::uint32_t* groups, std::size_t count,
                     float* out);
void least_of_points_ref(const PointExpiries& points, const std::uint32_t* groups,
                         std::size_t count, float* out);

}  // namespace h6::kernels
