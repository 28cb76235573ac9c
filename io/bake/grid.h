// SPDX-License-Identifier: Apache-2.0
// grid.h - what the steps of a field bake hand to each other. Private to bake_*.cpp.
//
// All steps work in GRID coordinates: voxels, node (i,j,k) of the field at (i,j,k). Metres come
// back only when the result is written.
//
//   surface -> grid -> bins -> narrow band (unsigned u, crossings) -> flood -> inside -> samples
//                                                                             far grid ----^
#pragma once
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "hapsix/result.h"
#include "io/bake/bake_field.h"
#include "io/file/samples.h"
#include "io/mesh/mesh.h"
#include "kernels/bake/triangle_distance.h"

namespace h6::io::bake {

using kernels::kBrickSamples;

// Nodes in a box around the mesh, centred on it: a symmetric part gets a symmetric field, and a
// mesh far from the origin loses no digits.
struct Grid {
  Vec3 centre{};     // of the mesh's box, mesh frame [m]
  double voxel = 0;  // [m]
  std::array<std::int32_t, 3> bricks{};
  double offset = 0;  // sigma [voxel]
  double band = 0;    // [voxel]
  double seal = 0;    // width of holes to close [voxel]; 0 once they are closed

  // u is exact up to here.
  double reach() const { return std::max(offset + band + 2.0, seal / 2 + 1.0); }
  // A cell with a point within band of the zero set has a corner at most half a cell further off.
  double near_zero_set() const { return offset + band + 0.8661 + 1e-3; }
  std::size_t cells() const {
    return std::size_t(bricks[0]) * std::size_t(bricks[1]) * std::size_t(bricks[2]);
  }
  std::size_t cell(int a, int b, int c) const {
    return (std::size_t(c) * std::size_t(bricks[1]) + std::size_t(b)) * std::size_t(bricks[0]) +
           std::size_t(a);
  }
  std::array<int, 3> place(std::size_t cell) const {
    // At most 256^3: 32 bits divide faster.
    const std::uint32_t x = std::uint32_t(bricks[0]), y = std::uint32_t(bricks[1]);
    const std::uint32_t line = std::uint32_t(cell) / x;
    return {int(std::uint32_t(cell) - line * x), int(line % y), int(line / y)};
  }
  double middle(int axis) const { return (8.0 * bricks[std::size_t(axis)] - 1.0) / 2; }
  Vec3 from_metres(const Vec3& p) const {
    return {(p.x - centre.x) / voxel + middle(0), (p.y - centre.y) / voxel + middle(1),
            (p.z - centre.z) / voxel + middle(2)};
  }
  Vec3 origin() const {
    return {centre.x - voxel * middle(0), centre.y - voxel * middle(1),
            centre.z - voxel * middle(2)};
  }
};

// The triangles that count: with area, each once. Vertices are in metres until `to_grid`.
struct Surface {
  Large<Vec3> vertices;
  Large<std::array<std::uint32_t, 3>> triangles;
  Large<std::int32_t> part;    // (triangles) or empty
  Large<std::int32_t> source;  // (triangles) of the mesh; -1: a plug
  Vec3 low{}, high{};          // [m]
  std::size_t duplicates = 0, flat = 0;
  std::size_t open_edges = 0;  // of one face
  std::size_t odd_edges = 0;   // of an odd number of faces
  bool closed = false;         // every edge has an even number of faces
};
Result<Surface> prepare_surface(const Mesh& mesh, unsigned threads);
Result<Grid> choose_grid(const Surface& surface, const FieldBake& options, bool sealed);
void to_grid(Surface& surface, const Grid& grid, unsigned threads);

// One bit a node of a brick: word z, bit 8*y + x.
struct NodeMask {
  std::array<std::uint64_t, 8> z{};
  bool get(std::size_t n) const { return z[n / 64] >> (n % 64) & 1; }
  void set(std::size_t n) { z[n / 64] |= std::uint64_t{1} << (n % 64); }
  bool any() const {
    std::uint64_t all = 0;
    for (std::uint64_t w : z) all |= w;
    return all != 0;
  }
};
inline constexpr NodeMask kAllNodes{{~0ull, ~0ull, ~0ull, ~0ull, ~0ull, ~0ull, ~0ull, ~0ull}};
// Of the 27 around a brick (bit 13 + dx + 3*dy + 9*dz) those with a node beside one of these.
inline std::uint32_t neighbours_of(const NodeMask& nodes) {
  std::uint64_t layer[3] = {nodes.z[0], 0, nodes.z[7]};
  for (std::uint64_t z : nodes.z) layer[1] |= z;
  constexpr std::uint64_t kY[3] = {0xff, ~std::uint64_t{0}, std::uint64_t{0xff} << 56};
  constexpr std::uint64_t kX[3] = {0x0101010101010101, ~std::uint64_t{0}, 0x8080808080808080};
  std::uint32_t bits = 0;
  for (int i = 0; i < 27; ++i)
    bits |= std::uint32_t((layer[i / 9] & kY[i / 3 % 3] & kX[i % 3]) != 0) << i;
  return bits;
}
using Masks = Large<NodeMask>;  // (rows) not cleared
// Nodes of a row.
struct RowNodes {
  std::uint32_t row;
  NodeMask nodes;
};

// Where the surface runs between nodes: bit n of edge[k] is the edge from node n along axis k.
// Touching counts. Nodes exactly on the surface are in `on`.
struct Crossing {
  std::array<NodeMask, 3> edge;
  NodeMask on;
};

// Triangles are kept by tiles of 4^3 bricks. `near` says which bricks of the tile a triangle may be
// within reach of; the order within a tile means nothing.
struct Tiles {
  std::array<int, 3> size{};
  std::vector<std::size_t> first;  // (tiles + 1) into the lists
  Large<std::uint32_t> triangle;
  Large<std::uint64_t> near;  // bit (c*4 + b)*4 + a
  std::size_t count() const { return first.size() - 1; }
  std::size_t of(const std::array<int, 3>& brick) const {
    return (std::size_t(brick[2] / 4) * std::size_t(size[1]) + std::size_t(brick[1] / 4)) *
               std::size_t(size[0]) +
           std::size_t(brick[0] / 4);
  }
  static int bit(const std::array<int, 3>& brick) {
    return (brick[2] % 4 * 4 + brick[1] % 4) * 4 + brick[0] % 4;
  }
  std::array<int, 3> first_brick(std::size_t tile) const {
    const std::size_t x = std::size_t(size[0]), y = std::size_t(size[1]);
    return {int(tile % x) * 4, int(tile / x % y) * 4, int(tile / x / y) * 4};
  }
};

// What neighbours say about where a triangle may be the nearest (kernels::FacetRegion).
struct Features {
  using Gradient = std::array<float, 3>;  // of unit length, or zero: nothing is known
  Large<std::uint8_t> owned;              // (triangles) bit e: edge e, bit 3 + v: corner v
  Large<Gradient> across;                 // (3 triangles) into another triangle of an owned edge
  Large<Gradient> from;                   // (4 vertices) along edges that leave it
};
// features.cpp
void find_features(const Surface& surface, unsigned threads, Features& out);

// Bricks that a triangle comes near to, and what is known of their nodes. Rows are candidates, in
// the order of cells.
struct NarrowBand {
  Tiles tiles;
  Features features;                   // of the surface, for measure_tile
  std::vector<std::int32_t> row;       // (cells) row of a cell, or -1: farther than reach
  std::vector<std::uint32_t> cell;     // (rows)
  Samples u;                           // (rows x 512) unsigned distance, at most reach [voxel]
  Masks free;                          // (rows) u > offset, and not on the surface
  std::vector<float> first_node;       // (rows) u of the row's first node
  std::vector<std::uint32_t> towards;  // (rows) bit i: near neighbour i is the zero set
  std::vector<Crossing> crossing;      // (rows), or empty where offset >= 0.5: not needed there
  std::vector<std::int32_t> part;      // (rows) or empty
  std::vector<std::int32_t> triangle;  // (rows) of the mesh, nearest to the brick's middle; or -1
  std::size_t rows() const { return cell.size(); }
  float* nodes(std::size_t r) { return u.data() + r * kBrickSamples; }
  const float* nodes(std::size_t r) const { return u.data() + r * kBrickSamples; }
};

// Steps report through this; false: cancelled.
class Steps {
 public:
  explicit Steps(const Progress& progress) : progress_(progress) {}
  // Runs body(i) in parallel, telling progress between slices of the work.
  bool run(const std::string& what, double from, double to, std::size_t count, unsigned threads,
           const std::function<void(std::size_t)>& body) const;
  bool tell(const std::string& what, double done) const {
    clock(what);
    return !progress_ || progress_(what, done);
  }
  // From now on it is this that takes the time.
  void clock(const std::string& what) const;
  std::vector<FieldBakeReport::Stage> stages() const;

 private:
  const Progress& progress_;
  mutable std::vector<FieldBakeReport::Stage> stages_;  // the last one is running
  mutable std::int64_t since_ns_ = 0;
};

// bins.cpp: tiles, cells and rows. A sentence when there are too many.
Outcome find_candidates(const Surface& surface, const Grid& grid, unsigned threads,
                        NarrowBand& band);
// distance.cpp, crossing.cpp: what is known of the rows of one tile.
// The first returns the triangles that may meet the tile itself, which the second needs; they are
// there until the thread measures another.
std::span<const std::uint32_t> measure_tile(const Surface& surface, const Grid& grid,
                                            std::size_t tile, NarrowBand& band);
void cross_tile(const Surface& surface, const Grid& grid, std::size_t tile,
                std::span<const std::uint32_t> triangles, NarrowBand& band);

// seal.cpp: facets across holes up to grid.seal wide; returns how many, a square voxel each.
std::size_t plug_holes(const Grid& grid, const NarrowBand& band, unsigned threads,
                       Surface& surface);

// sign.cpp: what the outside reaches without passing u <= offset or crossing a triangle.
struct Reached {
  Masks node;                      // (rows)
  std::vector<std::uint8_t> cell;  // (cells) all of it, where it has no row
};
Reached flood(const Surface& surface, const Grid& grid, const NarrowBand& band, Cavities cavities,
              unsigned threads);
// pockets.cpp: those of the candidates from which a reached node can be reached after all.
std::vector<RowNodes> reachable(const Surface& surface, const Grid& grid, const NarrowBand& band,
                                const std::vector<RowNodes>& candidates, const Masks& wet,
                                unsigned threads);

class Chains;  // chains.h

// inside.cpp: what the signed distances need besides u, and which rows are needed at all.
struct Inside {
  std::vector<std::uint8_t> needed;  // (rows) has a node of a cell within band of the zero set
  Masks in_sight;                    // (rows) not reached, yet R is on this side of the sheet
  // Where sheets are buried: lengths of the ways out; a row that has them may be corrected by them.
  std::shared_ptr<const Chains> chains;
  std::vector<std::uint8_t> corrected;  // (rows)
  // Other nodes whose depth is not told by u alone, by row: below cracks.
  struct Depth {
    std::uint32_t node;
    float depth;  // [voxel]
  };
  std::vector<std::vector<Depth>> depths;
  std::size_t thin_edges = 0;  // surface between two outside nodes with no inside node near
  std::size_t inside_nodes = 0;
};
bool look_inside(const Grid& grid, NarrowBand& band, const Reached& reached, unsigned threads,
                 const Steps& steps, Inside& inside);
// samples.cpp: the needed rows' signed distances [m], in place of u, and where they are.
void write_samples(const Grid& grid, NarrowBand& band, const Reached& reached, const Inside& inside,
                   unsigned threads, FieldData& field);

// far.cpp: lower bounds [m] with sign at every eighth node.
Outcome far_distances(const Surface& surface, const Grid& grid, const NarrowBand& band,
                      const Reached& reached, unsigned threads, const Steps& steps,
                      std::vector<float>& far);

}  // namespace h6::io::bake
