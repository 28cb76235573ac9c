// SPDX-License-Identifier: Apache-2.0
// holes.h - where the outside may not enter a solid with cracks and holes, and facets across them.
// Private to this folder.
#pragma once
#include <optional>
#include <unordered_map>

#include "io/bake/winding.h"

namespace h6::io::bake {

// The holes of a mesh whose winding is trusted.
struct Doors {
  Masks shut;                // (rows) nodes of the solid near open edges, not to be entered
  Masks before;              // (rows) nodes outside, before these, that are reached
  std::optional<Hole> leak;  // a hole that is wider than asked, through which the solid drains
};
// The nodes whose side is known already, for another band of the same grid.
struct Sides {
  std::vector<std::int32_t> row;  // (cells), of the masks; empty: nothing is known
  Masks asked, solid;             // (rows)
};
// Shuts holes and cracks up to `width` [voxel] wide. Needs the mesh's odd edges, and rows to half
// the width from the surface. What lies behind a wider hole stays open.
Doors shut_doors(const Surface& surface, const Winding& winding, const Grid& grid,
                 const NarrowBand& band, double width, unsigned threads, Sides& known);

// Takes some nodes out of a set.
void remove(const Masks& some, unsigned threads, Masks& from);

// A place in the solid that the outside reaches, and the width of the hole that lets it in.
std::optional<Hole> find_leak(const Surface& surface, const Winding& winding, const Grid& grid,
                              const NarrowBand& band, const Reached& reached, unsigned threads);

// A square voxel across the middle of each edge between a node of one side and one of the other.
class Plugs {
 public:
  // `open`, `closed` (rows); edges that the band's triangles cross get none.
  Plugs(const Grid& grid, const NarrowBand& band, const Masks& open, const Masks& closed);

  // The facets that hang together, each patch with the width of its hole, widest first.
  std::vector<Hole> holes() const;
  // Adds the facets with more room than this [voxel] to the surface; returns how many.
  std::size_t put(double least_room, Surface& surface) const;

 private:
  struct Facet {
    std::array<std::uint32_t, 4> corner;
    std::int32_t part;
    float room;  // distance to the surface, of the nearer end [voxel]
  };
  std::uint32_t corner(const std::array<int, 3>& twice);
  void add(std::size_t row, const std::array<int, 3>& node, std::size_t axis);
  double room(const std::array<int, 3>& node) const;

  const Grid& grid_;
  const NarrowBand& band_;
  std::unordered_map<std::uint64_t, std::uint32_t> number_;
  std::vector<Vec3> corner_;
  std::vector<Facet> facets_;
};

}  // namespace h6::io::bake
