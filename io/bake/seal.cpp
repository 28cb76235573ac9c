// SPDX-License-Identifier: Apache-2.0
// seal.cpp - plugs for holes up to a width, so that a part with missing triangles does not drain.
//
// 1. The wide outside W: where the middle of a ball of that width can move from outside.
// 2. The volume that the ball sweeps is outside: node p, if |p - q| <= u(q) for a q in W. The ball
//    around q holds no surface, so p is in plain view of q. Lengths are measured along chains of
//    nodes, which are a little longer, so never too much is swept.
// 3. The ball is too round for corners. A remaining space is a corner, and stays outside, if all of
//    it lies within a few steps of the swept volume. A deeper one is behind a hole, or at the end
//    of a gap narrower than the width.
// 4. A facet is put across each edge between the outside and the spaces behind. From then on these
//    facets are surface like any other for distances, offset, flood and far grid.
// This closes holes and gaps narrower than the width that lead to anything deeper than about the
// width. It leaves open all that a ball of the width can reach, and all concave corners. It needs
// no windings; where these can be trusted, holes.cpp knows solids from corners however thin.
#include <algorithm>

#include "io/bake/chains.h"
#include "io/bake/flood.h"
#include "io/bake/holes.h"
#include "sched/parallel_for.h"

namespace h6::io::bake {
namespace {

using namespace flooding;

// Calls mask(row) for all rows.
template <class F>
Masks for_rows(const NarrowBand& band, unsigned threads, F&& mask) {
  Masks out(band.rows());
  sched::parallel_for(band.rows(), threads, [&](std::size_t r) { out[r] = mask(r); });
  return out;
}

NodeMask farther_than(const float* u, float level) {
  NodeMask mask;
  for (std::size_t z = 0; z < 8; ++z)
    for (std::size_t n = 0; n < 64; ++n) mask.z[z] |= std::uint64_t(u[64 * z + n] > level) << n;
  return mask;
}

// The nodes that balls around the nodes of W sweep, W included.
Masks swept(const Grid& grid, const NarrowBand& band, const Reached& wide, double radius,
            unsigned threads) {
  std::vector<std::uint8_t> rows(band.rows());
  for (std::size_t r = 0; r < rows.size(); ++r) rows[r] = (band.free[r] & ~wide.node[r]).any();
  Chains chains(grid, band, wide, rows, threads);
  // A pass extends chains by one step at least: more end at the borders of bricks.
  for (int step = 0; step < int(radius) + 2 && chains.pass(); ++step) {
  }
  const int touch = int(grid.offset / double(kChainUnit));
  return for_rows(band, threads, [&](std::size_t r) {
    NodeMask mask = wide.node[r];
    if (!chains.holds(r)) return mask;
    const Chain* chain = chains.nodes(r);
    for (std::size_t n = 0; n < kBrickSamples; ++n)
      if (chain[n] <= touch && band.free[r].get(n)) mask.set(n);
    return mask;
  });
}

// Adds to `open` the remaining nodes of band.free that lie in corners; returns the nodes behind
// holes.
Masks behind_holes(const Grid& grid, const NarrowBand& band, double radius, unsigned threads,
                   Masks& open) {
  Masks near = open;
  // The corner of three walls is (sqrt 3 - 1) radii from the ball, which takes sqrt 3 times as many
  // steps.
  const int steps = int(std::ceil(1.27 * radius)) + 1;
  for (int i = 0; i < steps; ++i) {
    const Masks next = neighbours(grid, band, near, threads);
    for (std::size_t r = 0; r < near.size(); ++r) near[r] = near[r] | (next[r] & band.free[r]);
  }
  Masks left(band.rows()), deep(band.rows());
  for (std::size_t r = 0; r < left.size(); ++r) {
    left[r] = band.free[r] & ~open[r];
    deep[r] = left[r] & ~near[r];
  }
  Flood behind(grid, band, left, Flood::Edges::open, threads, Flood::Over::rows);
  behind.from_nodes(deep, 1);
  for (std::size_t r = 0; r < left.size(); ++r) open[r] = open[r] | (left[r] & ~behind.wet()[r]);
  return behind.take_wet();
}

}  // namespace

std::size_t plug_holes(const Grid& grid, const NarrowBand& band, unsigned threads, Surface& surface,
                       std::vector<Hole>& holes) {
  const double radius = grid.seal / 2;
  if (radius <= grid.offset) return 0;  // the offset already closes such holes
  const Masks roomy = for_rows(
      band, threads, [&](std::size_t r) { return farther_than(band.nodes(r), float(radius)); });
  Flood flood(grid, band, roomy, Flood::Edges::open, threads);
  flood.from_border();
  const Reached wide{flood.take_wet(), std::move(flood.cells())};
  Masks open = swept(grid, band, wide, radius, threads);
  const Masks closed = behind_holes(grid, band, radius, threads, open);
  const Plugs plugs(grid, band, open, closed);
  holes = plugs.holes();
  return plugs.put(0, surface);
}

}  // namespace h6::io::bake
