// SPDX-License-Identifier: Apache-2.0
// extend_band.h - safe distances beyond the band of a narrow-band level set.
//
// All lengths here are in voxels. Let b >= 3 be the half width of the level set's band, and K the
// nodes m with b - 2.5 <= |d(m)| < b. A node n beyond the band gets
//     v(n) = max(b, min(b + 2, min over m in K, |n - m| <= 4.5, of |d(m)| + |n - m|) - 1/4).
// Neighbours differ by at most 1, in the band and beyond it: v is the greatest function with that
// property (McShane 1934), less 1/4; nodes of K that are farther away would give b + 2 and more.
// And v(n) is at most the distance of n: on the straight way from n to the surface some node of K
// lies so near that the detour over it is at most 1/4, whatever the direction. A search over
// directions and distances found 0.2483 at most where b = 3, 0.21 where b = 4, but more than 0.3
// where b = 2.23: narrower bands are left alone.
#pragma once
#include <functional>

#include "io/field/field_data.h"

namespace h6::io {

// Writes v to the nodes beyond the band, those with a sample of size `known` (b) [m]. Adds the
// bricks of nodes nearer than b + sqrt(3): then each cell with a point nearer than b lies in
// bricks. `inside` says on which side a cell without a brick lies.
void extend_band(FieldData& field, double known,
                 const std::function<bool(std::size_t cell)>& inside, unsigned threads);

}  // namespace h6::io
