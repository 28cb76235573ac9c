// SPDX-License-Identifier: Apache-2.0
// grid.h - the data that the steps of a field bake pass on. Private to this folder.
//
// All steps work in GRID coordinates: the unit is a voxel, and node (i,j,k) lies at (i,j,k). Only
// the last steps return to metres.
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

namespace h6::io {
struct ThinPieces;  // io/walls
}

namespace h6::io::bake {

using kernels::kBrickSamples;

// (tiles) bit (c*4 + b)*4 + a: brick (a,b,c) of a tile of 4^3 bricks.
using WantedBricks = std::vector<std::uint64_t>;

// The nodes fill a box around the mesh and share its centre (but for FieldBake::shift), so that a
// symmetric part gets a symmetric field and a mesh far from the origin keeps its digits.
struct Grid {
  Vec3 centre{};     // of the nodes, mesh frame [m]
  double voxel = 0;  // [m]
  std::array<std::int32_t, 3> bricks{};
  double offset = 0;  // sigma [voxel]
  double band = 0;    // [voxel]
  double beyond = 2;  // how far beyond the band distances are exact [voxel]
  double seal = 0;    // width of the holes to close [voxel]; 0 when none is left to close
  // The bricks that get samples; null: all near the surface. Needs an offset of 0: then crossed
  // edges alone tell the sides of the others.
  const WantedBricks* wanted = nullptr;

  // The unsigned distance u is exact up to here.
  double reach() const { return std::max(offset + band + beyond, seal / 2 + 1.0); }
  // If a cell has a point within the band, one of its corners lies at most half a diagonal beyond.
  double near_zero_set() const { return offset + band + 0.8661 + 1e-3; }
  std::size_t cells() const {
    return std::size_t(bricks[0]) * std::size_t(bricks[1]) * std::size_t(bricks[2]);
  }
  std::size_t cell(int a, int b, int c) const {
    return (std::size_t(c) * std::size_t(bricks[1]) + std::size_t(b)) * std::size_t(bricks[0]) +
           std::size_t(a);
  }
  std::array<int, 3> place(std::size_t cell) const {
    // There are at most 256^3 cells, and 32 bits divide faster.
    const std::uint32_t x = std::uint32_t(bricks[0]), y = std::uint32_t(bricks[1]);
    const std::uint32_t line = std::uint32_t(cell) / x;
    return {int(std::uint32_t(cell) - line * x), int(line % y), int(line / y)};
  }
  bool wants(std::size_t cell) const {
    if (wanted == nullptr) return true;
    const std::array<int, 3> at = place(cell);
    const std::size_t x = std::size_t(bricks[0] + 3) / 4, y = std::size_t(bricks[1] + 3) / 4;
    return (*wanted)[(std::size_t(at[2] / 4) * y + std::size_t(at[1] / 4)) * x +
                     std::size_t(at[0] / 4)] >>
               ((at[2] % 4 * 4 + at[1] % 4) * 4 + at[0] % 4) &
           1;
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

// Where a triangle can be the nearest one, as its neighbours bound it (kernels::FacetRegion).
struct Features {
  using Gradient = std::array<float, 3>;  // unit vector, or zero: gives no bound
  // One triangle owns each edge and each corner, and only its owner measures it.
  Large<std::uint8_t> owned;  // (triangles) bit e: owns edge e, bit 3 + v: owns corner v
  Large<Gradient> across;     // (3 triangles) from an owned edge into the other triangle
  Large<Gradient> from;       // (4 vertices) along up to four edges that leave the vertex
};

// The mesh without its flat and repeated triangles. Vertices are in metres until `to_grid`.
struct Surface {
  Large<Vec3> vertices;
  Large<std::array<std::uint32_t, 3>> triangles;
  Large<std::int32_t> part;    // (triangles) or empty
  Large<std::int32_t> source;  // (triangles) index in the mesh; -1: a plug of plug_holes
  std::vector<std::array<std::uint32_t, 3>> flat;  // those left out for want of area
  Vec3 low{}, high{};                              // [m]
  std::size_t duplicates = 0;
  std::size_t open_edges = 0;                     // edges of one face
  std::size_t odd_edges = 0;                      // edges of an odd number of faces
  bool closed = false;                            // every edge has an even number of faces
  std::vector<std::array<std::uint32_t, 2>> odd;  // edges of an odd number of faces, in order
  std::shared_ptr<const Features> features;       // kept where several grids measure the surface
};
Result<Surface> prepare_surface(const Mesh& mesh, unsigned threads);
// gaps.cpp: moves vertices of odd edges to others within `tolerance` [m] if this closes the mesh.
struct GapWeld {
  std::size_t vertices = 0;  // moved
  double widest = 0;         // [m]
  std::size_t left = 0;      // odd edges that would be left; > 0: no vertex was moved
};
void weld_gaps(const Mesh& mesh, double tolerance, unsigned threads, Surface& surface,
               GapWeld& welded);
Result<Grid> choose_grid(const Surface& surface, const FieldBake& options, bool sealed);
// For a field with a tolerance: grids that begin at the same node. The fine voxels are kFinest
// tolerances; each of the middle ones is two of them wide, each of the coarse ones kCut.
struct GridLevels {
  Grid coarse, middle, fine;
};
Result<GridLevels> choose_grids(const Surface& surface, const FieldBake& options, bool sealed);
// The voxel that decides about sides [m].
Result<double> finest_voxel(const Surface& surface, const FieldBake& options);
void to_grid(Surface& surface, const Grid& grid, unsigned threads);

// One bit for each node of a brick: word z, bit 8*y + x.
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
// Which of the 27 bricks around a brick (bit 13 + dx + 3*dy + 9*dz) have a node beside one of
// `nodes`.
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
using Masks = Large<NodeMask>;  // (rows), not cleared on creation
// Some nodes of one row.
struct RowNodes {
  std::uint32_t row;
  NodeMask nodes;
};

// Which edges between nodes the surface crosses: bit n of edge[k] is the edge from node n along
// axis k. Touching counts as crossing. `on` has the nodes exactly on the surface.
struct Crossing {
  std::array<NodeMask, 3> edge;
  NodeMask on;
};

// The triangles of each tile of 4^3 bricks. `near` says which bricks of the tile a triangle may be
// within reach of. The order within a tile has no meaning.
struct Tiles {
  std::array<int, 3> size{};
  std::vector<std::size_t> first;  // (tiles + 1) where a tile's entries begin
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

// features.cpp
std::shared_ptr<const Features> find_features(const Surface& surface, unsigned threads);

// The bricks near triangles, one row each in the order of cells, with the data of their nodes.
struct NarrowBand {
  Tiles tiles;
  std::shared_ptr<const Features> features;  // of the surface, for measure_tile
  std::vector<std::int32_t> row;             // (cells) row of a cell, or -1: farther than reach
  std::vector<std::uint32_t> cell;           // (rows)
  Samples u;                           // (slots x 512) unsigned distance, at most reach [voxel]
  std::vector<std::uint32_t> slot;     // (rows) rising; rows that are not wanted share the last
  Masks free;                          // (rows) nodes with u > offset that are not on the surface
  std::vector<float> first_node;       // (rows) u of the row's first node
  std::vector<std::uint32_t> towards;  // (rows) bit i: the zero set is near neighbour brick i
  std::vector<Crossing> crossing;      // (rows); empty where offset >= 0.5, which needs none
  std::vector<std::int32_t> part;      // (rows) or empty
  std::vector<std::int32_t> triangle;  // (rows) of the mesh, near the brick's middle; or -1
  std::size_t rows() const { return cell.size(); }
  float* nodes(std::size_t r) { return u.data() + slot[r] * kBrickSamples; }
  const float* nodes(std::size_t r) const { return u.data() + slot[r] * kBrickSamples; }
};

// Progress and clock of a bake. Functions return false when the user cancelled.
class Steps {
 public:
  explicit Steps(const Progress& progress) : progress_(progress) {}
  // Runs body(i) for all i < count in parallel and reports progress between slices.
  bool run(const std::string& what, double from, double to, std::size_t count, unsigned threads,
           const std::function<void(std::size_t)>& body) const;
  bool tell(const std::string& what, double done) const {
    clock(what);
    return !progress_ || progress_(what, from_ + (to_ - from_) * done);
  }
  // The same steps within a part of the whole; they share the clock.
  Steps part(double from, double to) const {
    Steps steps = *this;
    steps.from_ = from;
    steps.to_ = to;
    return steps;
  }
  // The time from now on belongs to stage `what`.
  void clock(const std::string& what) const;
  std::vector<FieldBakeReport::Stage> stages() const;

 private:
  struct Clock {
    std::vector<FieldBakeReport::Stage> stages;  // the last one runs
    std::int64_t since_ns = 0;
  };
  const Progress& progress_;
  std::shared_ptr<Clock> clock_ = std::make_shared<Clock>();
  double from_ = 0, to_ = 1;
};

// distance.cpp: makes room for distances, in the order of rows.
void give_slots(const Grid& grid, NarrowBand& band);
// bins.cpp: fills tiles, cells and rows. Fails, with a sentence, when there are too many.
Outcome find_candidates(const Surface& surface, const Grid& grid, const FieldBake& options,
                        NarrowBand& band);
// distance.cpp: distances of the rows of one tile. Returns the triangles that may meet the tile
// itself; the list is valid until the same thread measures another tile.
std::span<const std::uint32_t> measure_tile(const Surface& surface, const Grid& grid,
                                            std::size_t tile, NarrowBand& band);
// crossing.cpp: crossings of the rows of one tile, by the list that measure_tile returned.
void cross_tile(const Surface& surface, const Grid& grid, std::size_t tile,
                std::span<const std::uint32_t> triangles, NarrowBand& band);

// seal.cpp: adds facets across holes up to grid.seal wide and returns how many; each is a square
// voxel.
struct Hole {
  Vec3 place;    // [voxel] in its middle
  double width;  // [voxel] of a ball that can pass, give or take a voxel
};
std::size_t plug_holes(const Grid& grid, const NarrowBand& band, unsigned threads, Surface& surface,
                       std::vector<Hole>& holes);

// sign.cpp: the set R that the outside reaches without entering u <= offset or crossing a triangle.
struct Reached {
  Masks node;                              // (rows)
  std::vector<std::uint8_t> cell;          // (cells) for cells without a row: not 0: all of it
  std::vector<std::uint32_t> unsure = {};  // bricks that are not wanted, but need distances
};
Reached flood(const Surface& surface, const Grid& grid, const NarrowBand& band, Cavities cavities,
              unsigned threads);
class Chains;  // chains.h

// A wall this thin [voxel] may be nowhere deeper than a quarter of a voxel in the field, or lie
// between its nodes altogether.
inline constexpr double kThin = 1.5;

// inside.cpp: the rows that the field needs, and the data beside u that their signed distances
// need.
struct Inside {
  std::vector<std::uint8_t> needed;  // (rows) has a node of a cell within the band
  Masks in_sight;                    // (rows) nodes not in R, but on R's side of the sheet
  // Lengths of the ways out to R, for the rows near sheets that lie buried in the solid.
  std::shared_ptr<const Chains> chains;
  std::vector<std::uint8_t> corrected;  // (rows)
  // Nodes below cracks: u alone does not give their depth.
  struct Depth {
    std::uint32_t node;
    float depth;  // [voxel]
  };
  std::vector<std::vector<Depth>> depths;
  Masks thin;  // (rows) nodes near walls that may be thinner than kThin; empty: there are none
  std::vector<std::uint8_t> buried;  // (rows) in or beside them lies a sheet that the solid buries;
                                     // where all bricks are wanted, also near one with no R around
  std::size_t inside_nodes = 0;
};
bool look_inside(const Grid& grid, NarrowBand& band, const Reached& reached, unsigned threads,
                 const Steps& steps, Inside& inside);
// samples.cpp: the needed rows' signed distances [m], which take the place of u, and their index.
void write_samples(const Grid& grid, NarrowBand& band, const Reached& reached, const Inside& inside,
                   unsigned threads, FieldData& field);

// far.cpp: signed lower bounds of the distance [m] at every eighth node.
Outcome far_distances(const Surface& surface, const Grid& grid, const NarrowBand& band,
                      const Reached& reached, unsigned threads, const Steps& steps, Samples& far);
// sign.cpp: (cells) bit i + 2j + 4k: node (4i, 4j, 4k) of the brick lies inside.
std::vector<std::uint8_t> sides_of(const Grid& grid, const NarrowBand& band, const Reached& reached,
                                   unsigned threads);

// A field of a surface, and what else the bake needs to know about it.
struct Baked {
  FieldData field;
  std::vector<std::uint32_t> thin;    // bricks that may have thin walls
  std::vector<NodeMask> thin_nodes;   // (thin) where in them
  std::vector<std::uint32_t> unsure;  // bricks where crossed edges do not tell the sides
  std::vector<std::uint8_t> inside;   // sides_of, if asked for
  bool nothing_inside = false;
};
// bake_field.cpp. The surface is in grid coordinates and gains the facets that seal it. With
// `sides` there are far bounds only where thin walls may have to be added.
enum class Beyond { bounds, sides, nothing };  // what is found beyond the band
Result<Baked> bake_on_grid(Surface& surface, Grid grid, const FieldBake& options, Beyond beyond,
                           const Steps& steps, FieldBakeReport* report);
// The pieces of the surface that bound walls too thin for the grid, in its coordinates.
Result<ThinPieces> find_thin(const Surface& surface, const Grid& grid, const Baked& baked,
                             const FieldBake& options, FieldBakeReport* report);
// Adds the thin walls of a surface to its field on this grid, whose voxels are `cut` voxels of
// theirs, as open sheets with an offset of kGrow of their voxels.
Outcome add_thin(const ThinPieces& thin, const Surface& whole, Grid grid, double cut,
                 FieldBake options, const Steps& steps, FieldData& field);
// Adds what the user should know.
void warn(const Surface& surface, const Grid& grid, bool nothing_inside, double seal, SignMode sign,
          FieldBakeReport& report);

// With more triangles in a coarse brick than this, most of the time goes into triangles, and to
// look at them in middle voxels takes longer than all fine bricks do.
inline constexpr std::size_t kDense = 20;
// to_tolerance.cpp: coarse bricks everywhere, finer samples where those miss the tolerance.
Result<FieldData> bake_to_tolerance(Surface& surface, const FieldBake& options, bool sealed,
                                    const Steps& steps, FieldBakeReport* report);

}  // namespace h6::io::bake
