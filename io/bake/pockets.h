// SPDX-License-Identifier: Apache-2.0
// pockets.h - nodes that the outside reaches through gaps finer than a voxel. Private to this
// folder.
#pragma once
#include <bitset>

#include "io/bake/grid.h"

namespace h6::io::bake {

// Nodes around one, itself in the middle: x first, then y, then z.
inline constexpr std::size_t kInView = 125;
using InView = std::bitset<kInView>;

class Facets;

// Judges the candidates again and again, as more of the outside is known. Needs a closed surface
// that outlives it, as do the grid and the band.
class Pockets {
 public:
  Pockets(const Surface& surface, const Grid& grid, const NarrowBand& band,
          const std::vector<RowNodes>& candidates, unsigned threads);

  // The candidates that `wet` (rows), nodes of the outside, reaches. Each is returned once. A
  // caller asks by lines until they reach no more, since walks are dear.
  enum class By { lines, walks };
  std::vector<RowNodes> reached(const Masks& wet, By by);

 private:
  struct Node {
    std::uint16_t place;  // in the brick
    bool walked;
    InView view;    // the nodes of the outside when it was judged last
    InView linked;  // if walked: the nodes that no triangle parts from this one
  };
  struct Row {
    std::uint32_t row;
    std::vector<Node> nodes;  // not yet decided
  };
  class Window;
  enum class Side { outside, inside, unknown };

  RowNodes judge(Row& row, const Masks& wet, By by) const;
  void add_facets(std::size_t row, Facets& facets) const;
  Side look(const Facets& facets, const std::array<int, 3>& p, By by, Node& node) const;

  const Surface& surface_;
  const Grid& grid_;
  const NarrowBand& band_;
  unsigned threads_;
  std::vector<std::uint32_t> component_;  // (triangles)
  std::vector<Row> rows_;
};

}  // namespace h6::io::bake
