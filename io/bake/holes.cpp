// SPDX-License-Identifier: Apache-2.0
// holes.cpp - holes by the winding number, which passes one half in the middle of each.
//
// Away from the open edges no free way leads from outside into the solid. So only nodes near them
// are asked for their winding, and those of the solid are shut. If the flood comes out behind them
// all the same, a hole is wider, and the nodes behind it are opened again: half a plug is none.
#include "io/bake/holes.h"

#include <atomic>
#include <numeric>

#include "io/bake/flood.h"
#include "sched/parallel_for.h"

namespace h6::io::bake {
namespace {

using namespace flooding;

Vec3 place_of(const Grid& grid, const NarrowBand& band, std::size_t row, std::size_t n) {
  const std::array<int, 3> at = grid.place(band.cell[row]);
  return {8.0 * at[0] + double(n % 8), 8.0 * at[1] + double(n / 8 % 8),
          8.0 * at[2] + double(n / 64)};
}

// Triangles without area may lie anywhere, as no box is made for them.
bool within(const Grid& grid, const Vec3& p) {
  for (int k = 0; k < 3; ++k)
    if (!(component(p, k) >= 0 && component(p, k) <= 8.0 * grid.bricks[std::size_t(k)] - 1))
      return false;
  return true;
}

// Sets the node nearest to every voxel of the odd edges.
Masks rim_nodes(const Surface& surface, const Grid& grid, const NarrowBand& band) {
  Masks rim(band.rows());
  std::fill(rim.begin(), rim.end(), NodeMask{});
  for (const auto& edge : surface.odd) {
    const Vec3 &a = surface.vertices[edge[0]], &b = surface.vertices[edge[1]];
    if (!within(grid, a) || !within(grid, b)) continue;
    const int steps = std::max(1, int(std::ceil(norm(b - a))));
    for (int i = 0; i <= steps; ++i) {
      const Vec3 p = a + (double(i) / steps) * (b - a);
      const int n[3] = {int(std::lround(p.x)), int(std::lround(p.y)), int(std::lround(p.z))};
      const std::int32_t r = band.row[grid.cell(n[0] / 8, n[1] / 8, n[2] / 8)];
      if (r >= 0)
        rim[std::size_t(r)].set(std::size_t(((n[2] & 7) * 8 + (n[1] & 7)) * 8 + (n[0] & 7)));
    }
  }
  return rim;
}

// The free nodes within `away` [voxel] of the odd edges, and some more.
Masks near_rims(const Surface& surface, const Grid& grid, const NarrowBand& band, double away,
                unsigned threads) {
  Masks near = rim_nodes(surface, grid, band);
  // Steps along the axes take up to sqrt 3 times as long.
  for (int i = 0; i < int(std::ceil(1.7321 * away)) + 1; ++i) {
    const Masks next = neighbours(grid, band, near, threads);
    sched::parallel_for(near.size(), threads, [&](std::size_t r) { near[r] = near[r] | next[r]; });
  }
  sched::parallel_for(near.size(), threads, [&](std::size_t r) {
    near[r] = near[r] & band.free[r];
    const float* u = band.nodes(r);
    for (std::size_t z = 0; z < 8; ++z)
      for (std::uint64_t bits = near[r].z[z]; bits != 0; bits &= bits - 1) {
        const int n = std::countr_zero(bits);
        if (double(u[64 * z + std::size_t(n)]) > away) near[r].z[z] &= ~(std::uint64_t{1} << n);
      }
  });
  return near;
}

// Those of the nodes that lie in the solid.
Masks in_solid(const Winding& winding, const Grid& grid, const NarrowBand& band, const Masks& nodes,
               unsigned threads, Sides& known) {
  Masks in(nodes.size());
  Sides now{band.row, Masks(nodes.size()), Masks(nodes.size())};
  sched::parallel_for(nodes.size(), threads, [&](std::size_t r) {
    const std::int32_t last = known.row.empty() ? -1 : known.row[band.cell[r]];
    NodeMask& solid = now.solid[r];
    NodeMask& asked = now.asked[r];
    solid = last < 0 ? NodeMask{} : known.solid[std::size_t(last)];
    asked = last < 0 ? NodeMask{} : known.asked[std::size_t(last)];
    const NodeMask ask = nodes[r] & ~asked;
    const std::array<int, 3> at = grid.place(band.cell[r]);
    for (int box = 0; box < 32; ++box) {
      const int x = box % 2 * 4, y = box / 2 % 4 * 2, z = box / 8 * 2, first = 8 * y + x;
      const std::uint64_t nodes_of = std::uint64_t{0xf0f} << first;
      const std::size_t low = std::size_t(z);
      if (((ask.z[low] | ask.z[low + 1]) & nodes_of) == 0) continue;
      const std::uint32_t in_box = winding.inside({8 * at[0] + x, 8 * at[1] + y, 8 * at[2] + z});
      for (std::size_t k = 0; k < 2; ++k) {
        const std::uint64_t four = in_box >> 8 * k & 0xf, next = in_box >> (8 * k + 4) & 0xf;
        solid.z[low + k] |= (four | next << 8) << first & ask.z[low + k];
      }
    }
    asked = asked | nodes[r];
    in[r] = solid & nodes[r];
  });
  known = std::move(now);
  return in;
}

// Looks at a quarter of the nodes, those with three even or three odd numbers. Returns whether one
// of them lies in the solid. Where 2 x 2 nodes of a layer do, this sees it; a drained place that is
// smaller everywhere stays unseen, which costs a warning. Most meshes have no leak, and for these
// this is all: the robot's soup at a 500th takes half of its time.
bool some_in_solid(const Winding& winding, const Grid& grid, const NarrowBand& band,
                   const Masks& nodes, unsigned threads) {
  std::atomic<bool> found = false;
  sched::parallel_for(nodes.size(), threads, [&](std::size_t r) {
    const std::array<int, 3> at = grid.place(band.cell[r]);
    for (int box = 0; box < 8 && !found.load(std::memory_order_relaxed); ++box) {
      const int odd = box % 2, y = box / 2 % 2 * 4 + odd, z = box / 4 * 4 + odd;
      std::uint32_t ask = 0;  // in the order of the box
      for (int i = 0; i < 16; ++i) {
        const int row = 8 * (y + i / 4 % 2 * 2), layer = z + i / 8 * 2;
        ask |= std::uint32_t(nodes[r].z[std::size_t(layer)] >> (row + i % 4 * 2 + odd) & 1) << i;
      }
      if (ask != 0 &&
          (winding.inside({8 * at[0] + odd, 8 * at[1] + y, 8 * at[2] + z}, 2) & ask) != 0)
        found.store(true, std::memory_order_relaxed);
    }
  });
  return found;
}

// The first of the nodes, by rows, with most room; nothing where there is none.
std::optional<Hole> roomiest(const Grid& grid, const NarrowBand& band, const Masks& nodes) {
  std::optional<Hole> found;
  for (std::size_t r = 0; r < nodes.size(); ++r)
    for (std::size_t z = 0; z < 8; ++z)
      for (std::uint64_t bits = nodes[r].z[z]; bits != 0; bits &= bits - 1) {
        const std::size_t n = 64 * z + std::size_t(std::countr_zero(bits));
        const double width = 2 * double(band.nodes(r)[n]);
        if (!found || width > found->width) found = {place_of(grid, band, r, n), width};
      }
  return found;
}

NodeMask farther_than(const float* u, double level) {
  NodeMask mask;
  for (std::size_t z = 0; z < 8; ++z)
    for (std::size_t n = 0; n < 64; ++n)
      mask.z[z] |= std::uint64_t(double(u[64 * z + n]) > level) << n;
  return mask;
}

template <class F>
Masks for_rows(const NarrowBand& band, unsigned threads, F&& mask) {
  Masks out(band.rows());
  sched::parallel_for(band.rows(), threads, [&](std::size_t r) { out[r] = mask(r); });
  return out;
}

// The widest place where free edges lead from outside into the solid.
std::optional<Hole> door(const Grid& grid, const NarrowBand& band, const Masks& outside,
                         const Masks& solid, unsigned threads) {
  const Masks beside = neighbours(grid, band, solid, threads);
  return roomiest(grid, band,
                  for_rows(band, threads, [&](std::size_t r) { return outside[r] & beside[r]; }));
}

}  // namespace

Doors shut_doors(const Surface& surface, const Winding& winding, const Grid& grid,
                 const NarrowBand& band, double width, unsigned threads, Sides& known) {
  Doors doors;
  // A node of the solid beside a hole is within a voxel of the hole's middle.
  const Masks near = near_rims(surface, grid, band, width / 2 + 1.75, threads);
  const Masks solid = in_solid(winding, grid, band, near, threads, known);
  doors.shut = solid;
  Masks reached;
  const auto flood_again = [&] {
    const Masks passable =
        for_rows(band, threads, [&](std::size_t r) { return band.free[r] & ~doors.shut[r]; });
    Flood flood(grid, band, passable, Flood::Edges::cut, threads);
    flood.from_border();
    reached = flood.take_wet();
    doors.before =
        for_rows(band, threads, [&](std::size_t r) { return reached[r] & near[r] & ~solid[r]; });
  };
  flood_again();
  // Behind a hole that is much wider, the flood has come to the far end of these nodes.
  const Masks around = neighbours(grid, band, near, threads);
  const Masks behind = in_solid(
      winding, grid, band,
      for_rows(band, threads, [&](std::size_t r) { return around[r] & ~near[r] & reached[r]; }),
      threads, known);
  // A hole a little wider has room on both sides of its middle.
  const double level = width / 2 + 0.25;
  const Masks beside = neighbours(
      grid, band,
      for_rows(band, threads,
               [&](std::size_t r) { return doors.before[r] & farther_than(band.nodes(r), level); }),
      threads);
  Masks seeds = neighbours(grid, band, behind, threads);
  sched::parallel_for(seeds.size(), threads, [&](std::size_t r) {
    seeds[r] = seeds[r] | (doors.shut[r] & beside[r] & farther_than(band.nodes(r), level));
  });
  Flood open(grid, band, doors.shut, Flood::Edges::open, threads, Flood::Over::rows);
  if (!open.from_nodes(seeds, 1)) return doors;
  doors.leak = roomiest(grid, band, seeds);
  if (const auto at = door(grid, band, doors.before, open.wet(), threads)) doors.leak = at;
  remove(open.wet(), threads, doors.shut);
  flood_again();
  return doors;
}

void remove(const Masks& some, unsigned threads, Masks& from) {
  sched::parallel_for(from.size(), threads, [&](std::size_t r) { from[r] = from[r] & ~some[r]; });
}

std::optional<Hole> find_leak(const Surface& surface, const Winding& winding, const Grid& grid,
                              const NarrowBand& band, const Reached& reached, unsigned threads) {
  Masks near = near_rims(surface, grid, band, grid.offset + 2, threads);
  sched::parallel_for(near.size(), threads,
                      [&](std::size_t r) { near[r] = near[r] & reached.node[r]; });
  if (!some_in_solid(winding, grid, band, near, threads)) return std::nullopt;
  Sides known;
  const Masks solid = in_solid(winding, grid, band, near, threads, known);
  remove(solid, threads, near);
  return door(grid, band, near, solid, threads);
}

Plugs::Plugs(const Grid& grid, const NarrowBand& band, const Masks& open, const Masks& closed)
    : grid_(grid), band_(band) {
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
      NodeMask cut = (open[r] & ahead(closed)) | (closed[r] & ahead(open));
      if (!band_.crossing.empty()) cut = cut & ~band_.crossing[r].edge[axis];
      for (std::size_t z = 0; z < 8; ++z)
        for (std::uint64_t bits = cut.z[z]; bits != 0; bits &= bits - 1) {
          const int n = std::countr_zero(bits);
          add(r, {8 * at[0] + n % 8, 8 * at[1] + n / 8, 8 * at[2] + int(z)}, axis);
        }
    }
  }
}

// Corners lie half way between nodes, so twice their coordinates are integers.
std::uint32_t Plugs::corner(const std::array<int, 3>& twice) {
  const std::uint64_t key = (std::uint64_t(twice[2] + 1) << 26 | std::uint64_t(twice[1] + 1))
                                << 26 |
                            std::uint64_t(twice[0] + 1);
  const auto [at, is_new] = number_.try_emplace(key, std::uint32_t(corner_.size()));
  if (is_new) corner_.push_back({0.5 * twice[0], 0.5 * twice[1], 0.5 * twice[2]});
  return at->second;
}

void Plugs::add(std::size_t row, const std::array<int, 3>& node, std::size_t axis) {
  Facet facet{{}, band_.part.empty() ? 0 : band_.part[row], 0};
  for (std::size_t i = 0; i < 4; ++i) {
    std::array<int, 3> c = {2 * node[0], 2 * node[1], 2 * node[2]};
    c[axis] += 1;
    c[(axis + 1) % 3] += i == 1 || i == 2 ? 1 : -1;
    c[(axis + 2) % 3] += i >= 2 ? 1 : -1;
    facet.corner[i] = corner(c);
  }
  std::array<int, 3> next = node;
  next[axis] += 1;
  facet.room = float(std::min(room(node), room(next)));
  facets_.push_back(facet);
}

std::size_t Plugs::put(double least_room, Surface& surface) const {
  const auto first = std::uint32_t(surface.vertices.size());
  surface.vertices.insert(surface.vertices.end(), corner_.begin(), corner_.end());
  std::size_t count = 0;
  for (const Facet& f : facets_) {
    if (double(f.room) <= least_room) continue;
    const auto& v = f.corner;
    surface.triangles.push_back({first + v[0], first + v[1], first + v[2]});
    surface.triangles.push_back({first + v[0], first + v[2], first + v[3]});
    surface.source.insert(surface.source.end(), 2, -1);
    if (!surface.part.empty()) surface.part.insert(surface.part.end(), 2, f.part);
    ++count;
  }
  return count;
}

double Plugs::room(const std::array<int, 3>& n) const {
  const std::int32_t r = band_.row[grid_.cell(n[0] / 8, n[1] / 8, n[2] / 8)];
  return r < 0
             ? grid_.reach()
             : double(band_.nodes(std::size_t(r))[((n[2] & 7) * 8 + (n[1] & 7)) * 8 + (n[0] & 7)]);
}

std::vector<Hole> Plugs::holes() const {
  std::vector<std::uint32_t> parent(corner_.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](std::uint32_t v) {
    for (; parent[v] != v; v = parent[v]) parent[v] = parent[parent[v]];
    return v;
  };
  for (const Facet& f : facets_)
    for (const std::uint32_t v : f.corner) parent[root(v)] = root(f.corner[0]);
  std::unordered_map<std::uint32_t, std::size_t> patch;
  std::vector<Hole> holes;
  for (const Facet& f : facets_) {
    const auto [at, is_new] = patch.try_emplace(root(f.corner[0]), holes.size());
    if (is_new) holes.push_back({{}, -1});
    if (2 * double(f.room) > holes[at->second].width)
      holes[at->second] = {0.5 * (corner_[f.corner[0]] + corner_[f.corner[2]]), 2 * double(f.room)};
  }
  std::stable_sort(holes.begin(), holes.end(),
                   [](const Hole& a, const Hole& b) { return a.width > b.width; });
  return holes;
}

}  // namespace h6::io::bake
