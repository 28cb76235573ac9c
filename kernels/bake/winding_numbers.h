// SPDX-License-Identifier: Apache-2.0
// winding_numbers.h - generalised winding numbers of sixteen places, from clusters of triangles far
// away and triangles near by.
#pragma once
#include <cstddef>
#include <cstdint>

namespace h6::kernels {

inline constexpr std::size_t kWindingPlaces = 16;

// Far triangles count as one dipole: G. Barill et al., "Fast winding numbers for soups and clouds",
// 2018.
struct WindingCluster {
  float middle[3];
  float reach;      // farther from the middle it counts as a dipole
  float dipole[3];  // sum of area normals over 4 pi
};

// At most eight triangles. Each vertex is there once: triangles share most of them, so fewer
// distances have to be taken.
struct WindingLeaf {
  double origin[3];                   // that the vertices are relative to
  float x[24], y[24], z[24];          // of the vertices
  std::uint32_t vertices, triangles;  // at most 24 and 8
  std::uint8_t corner[24];            // (3 x triangles) vertices
};

// Offsets from a place that they share [voxel], a few voxels long: they are in float.
struct WindingPlaces {
  alignas(64) float x[kWindingPlaces], y[kWindingPlaces], z[kWindingPlaces];
};

// number[i]: the dipoles of the `far` clusters and the solid angles of all triangles in the `near`
// leaves, over 4 pi, around place i. A triangle whose rim the place is on does not count. Every
// target has the same bits.
void winding_numbers(const WindingCluster* clusters, const std::uint32_t* far,
                     std::size_t far_count, const WindingLeaf* leaves, const std::uint32_t* near,
                     std::size_t near_count, const double (&base)[3], const WindingPlaces& offsets,
                     float (&number)[kWindingPlaces]);
void winding_numbers_ref(const WindingCluster* clusters, const std::uint32_t* far,
                         std::size_t far_count, const WindingLeaf* leaves,
                         const std::uint32_t* near, std::size_t near_count, const double (&base)[3],
                         const WindingPlaces& offsets, float (&number)[kWindingPlaces]);

}  // namespace h6::kernels
