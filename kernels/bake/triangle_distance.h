// SPDX-License-Identifier: Apache-2.0
// triangle_distance.h - distances of the nodes of a brick to triangles.
//
// A brick is 8 x 8 x 8 nodes at unit spacing, node (i,j,k) at (i,j,k), x fastest in arrays; a tile
// is 4 x 4 x 4 bricks, brick (a,b,c) at (8a, 8b, 8c), x fastest too. Corners are in voxels, in
// double. The work runs in float, to about 2e-5 voxel while corners lie within 128 voxels of the
// nodes: cut larger triangles first.
#pragma once
#include <cstddef>
#include <cstdint>
#include <limits>

namespace h6::kernels {

inline constexpr std::size_t kBrickSamples = 512;
inline constexpr int kTileBricks = 4;  // along an axis

// One triangle prepared for float work: seven affine functions g.p + c of the place p, in voxels.
// 0..2: along edge e, from its middle; 3..5: off edge e in the plane, positive on the triangle's
// side; 6: off the plane; 7 is not used. They are made in double: on a long sliver a float cross
// product is wrong by whole voxels at the far end.
struct DistanceFacet {
  float gx[8], gy[8], gz[8], c[8];
  float half[3];      // lengths of the edges
  float inside_from;  // a point is over the triangle when all of 3..5 are at least this
  float low[3], high[3];
};

// `corners` is 3 corners x 3 coordinates. A triangle without area becomes its longest edge.
DistanceFacet make_distance_facet(const double* corners);
// The same for many, with the same bits: `corners` is count x 3 corners x 3 coordinates.
void make_distance_facets(const double* corners, std::size_t count, DistanceFacet* facets);

// Bit (c*4 + b)*4 + a: brick (a,b,c) may have a node within reach of the triangle. The tile's first
// node is at `first`, in the frame of the facet's corners. A clear bit is certain; a set bit can be
// wrong only around edges and corners.
std::uint64_t bricks_within_reach(const DistanceFacet& facet, const float first[3], float reach);

// Where a triangle of a mesh may be the nearest of all: over its inside; beyond an edge e (from
// corner e to the next) that it answers for, below plane e; beyond a corner v that it answers for,
// below planes 3 + 4 v .. 6 + 4 v. Planes are g.p + c <= 0; a plane of zeros excludes nothing.
//
// The nearest point of a mesh lies inside a triangle, inside an edge or on a corner. If it lies on
// an edge, the place is beyond that edge in the plane of EACH triangle that has the edge; if it is
// a corner, the place is behind the start of EACH edge that leaves it. So it is enough that one
// triangle answers for each edge and each corner, and planes of the neighbouring triangles and
// edges keep its region small. It is also enough to compare distances over the triangle's inside
// and along its first `weighed` edges, when these include all edges and corners that it answers for
// and all edges without a neighbour.
struct FacetRegion {
  float gx[16] = {}, gy[16] = {}, gz[16] = {}, c[16] = {};
  std::uint8_t edges = 0, corners = 0;  // bits: the edges and corners that it answers for
  std::uint8_t weighed = 3;
  bool everywhere = true;  // its neighbours are not known
};

// Squared distances of the bricks of a tile, in blocks (triangle_tables.h), and the name of the
// facet nearest to the middle of each brick, half way between its nodes 3 and 4 along every axis.
inline constexpr std::int32_t kNobody = std::numeric_limits<std::int32_t>::max();
struct TileRoom {
  alignas(64) float squared[64 * kBrickSamples];
  alignas(64) float most[64 * kBrickSamples / 16];  // the largest of each block
  std::uint32_t lowered[64], visits[64];
  alignas(64) float middle[64];          // squared distance of the middle
  alignas(64) std::int32_t nearest[64];  // or kNobody
};

// The squared distances, at most reach^2, of the nodes of a tile's bricks to the nearest of `count`
// facets; facet i is compared in the bricks of near[i] only. Bricks in no near[i] are left alone,
// and the nearest to their middles is unspecified. In the others it is the nearest facet compared
// in the brick, or a nearer one; the least name of equals. The order of the facets does not change
// a bit.
void tile_distance(const DistanceFacet* facets, const FacetRegion* regions,
                   const std::uint64_t* near, const std::int32_t* names, std::size_t count,
                   float reach, TileRoom& room);
// The distances of the nodes of one brick.
void brick_distance(const TileRoom& room, std::size_t brick, float* distance);

// The same from corners (count x 3 corners x 3 coordinates), for the brick at (0,0,0).
void triangle_distance(const double* corners, std::size_t count, float reach, float* distance);
void triangle_distance_ref(const double* corners, std::size_t count, float reach, float* distance);

// Bit n % 64 of word n / 64: distance[n] > level.
void nodes_above(const float* distance, float level, std::uint64_t words[8]);
void nodes_above_ref(const float* distance, float level, std::uint64_t words[8]);

// The squared distance of one point to one triangle, in double; the reference uses it.
double point_triangle_squared(const double p[3], const double a[3], const double b[3],
                              const double c[3]);

}  // namespace h6::kernels
