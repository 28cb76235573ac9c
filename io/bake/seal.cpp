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
// width. It leaves open all that a ball of the width can reach, and all concave corners.
#include <algorithm>
#include <unordered_map>

#include "io/bake/chains.h"
#include "io/bake/flood.h"
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
  for (int steps = 0; steps < int(radius) + 2; steps += kStepsAPass) chains.pass();
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

// Puts a facet across the middle of each edge between a node of one side and one of the other.
class Plugs {
 public:
  Plugs(const Grid& grid, const NarrowBand& band, Surface& surface)
      : grid_(grid), band_(band), surface_(surface), first_(surface.triangles.size()) {}

  void add(const Masks& open, const Masks& closed) {
    for (std::size_t r = 0; r < band_.rows(); ++r) {
      const std::array<int, 3> at = grid_.place(band_.cell[r]);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        std::array<int, 3> to = at;
        to[axis] += 1;
        const std::int32_t next =
            to[axis] < grid_.bricks[axis] ? band_.row[grid_.cell(to[0], to[1], to[2])] : -1;
        const auto ahead = [&](const Masks& side) {
          NodeMask mask = before(side[r], axis);
          return next < 0 ? mask : mask | through(side[std::size_t(next)], kOpenEdges, axis, -1);
        };
        const NodeMask cut = (open[r] & ahead(closed)) | (closed[r] & ahead(open));
        for (std::size_t z = 0; z < 8; ++z)
          for (std::uint64_t bits = cut.z[z]; bits != 0; bits &= bits - 1) {
            const int n = std::countr_zero(bits);
            facet({8 * at[0] + n % 8, 8 * at[1] + n / 8, 8 * at[2] + int(z)}, axis,
                  band_.part.empty() ? 0 : band_.part[r]);
          }
      }
    }
  }
  std::size_t facets() const { return (surface_.triangles.size() - first_) / 2; }

 private:
  // Corners lie half way between nodes, so twice their coordinates are integers.
  std::uint32_t corner(const std::array<int, 3>& twice) {
    const std::uint64_t key = (std::uint64_t(twice[2] + 1) << 26 | std::uint64_t(twice[1] + 1))
                                  << 26 |
                              std::uint64_t(twice[0] + 1);
    const auto [at, is_new] = corner_.try_emplace(key, std::uint32_t(surface_.vertices.size()));
    if (is_new) surface_.vertices.push_back({0.5 * twice[0], 0.5 * twice[1], 0.5 * twice[2]});
    return at->second;
  }
  void facet(const std::array<int, 3>& node, std::size_t axis, std::int32_t part) {
    std::array<std::uint32_t, 4> v{};
    for (std::size_t i = 0; i < 4; ++i) {
      std::array<int, 3> c = {2 * node[0], 2 * node[1], 2 * node[2]};
      c[axis] += 1;
      c[(axis + 1) % 3] += i == 1 || i == 2 ? 1 : -1;
      c[(axis + 2) % 3] += i >= 2 ? 1 : -1;
      v[i] = corner(c);
    }
    surface_.triangles.push_back({v[0], v[1], v[2]});
    surface_.triangles.push_back({v[0], v[2], v[3]});
    surface_.source.insert(surface_.source.end(), 2, -1);
    if (!surface_.part.empty()) surface_.part.insert(surface_.part.end(), 2, part);
  }

  const Grid& grid_;
  const NarrowBand& band_;
  Surface& surface_;
  std::size_t first_;
  std::unordered_map<std::uint64_t, std::uint32_t> corner_;
};

}  // namespace

std::size_t plug_holes(const Grid& grid, const NarrowBand& band, unsigned threads,
                       Surface& surface) {
  const double radius = grid.seal / 2;
  if (radius <= grid.offset) return 0;  // the offset already closes such holes
  const Masks roomy = for_rows(
      band, threads, [&](std::size_t r) { return farther_than(band.nodes(r), float(radius)); });
  Flood flood(grid, band, roomy, Flood::Edges::open, threads);
  flood.from_border();
  const Reached wide{flood.take_wet(), std::move(flood.cells())};
  Masks open = swept(grid, band, wide, radius, threads);
  const Masks closed = behind_holes(grid, band, radius, threads, open);
  Plugs plugs(grid, band, surface);
  plugs.add(open, closed);
  return plugs.facets();
}

}  // namespace h6::io::bake
