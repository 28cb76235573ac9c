// triangle_distance.h - how far the nodes of a brick are from triangles.
//
// A brick is 8 x 8 x 8 nodes at unit spacing, node (i,j,k) at (i,j,k), x fastest in arrays. Corners
// are brick-local, in voxels and in double; the work runs in float, which is exact to about 1e-5
// voxel as long as corners lie within 128 voxels of the brick: cut larger triangles first.
#pragma once
#include <cstddef>

namespace h6::kernels {

inline constexpr std::size_t kBrickSamples = 512;

// distance[n] = min(reach, distance of node n to the nearest of `count` triangles). `corners` is
// (count x 3 corners x 3 coordinates). A triangle without area counts as its edges. The order of
// triangles may change the last bit: keep it fixed where bits matter.
void triangle_distance(const double* corners, std::size_t count, float reach, float* distance);
void triangle_distance_ref(const double* corners, std::size_t count, float reach, float* distance);

// The squared distance of one point to one triangle, in double: what the reference is made of.
double point_triangle_squared(const double p[3], const double a[3], const double b[3],
                              const double c[3]);

}  // namespace h6::kernels
