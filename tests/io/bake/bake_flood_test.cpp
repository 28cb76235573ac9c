// SPDX-License-Identifier: Apache-2.0
// Compares the flood with a simple walk from node to node.
#include <doctest/doctest.h>

#include <array>
#include <cstdint>
#include <random>
#include <vector>

#include "io/bake/flood.h"

using namespace h6::io::bake;
using flooding::Flood;
using h6::kernels::kBrickSamples;

namespace {

// Random bricks with and without a row, passable nodes and crossed edges.
struct Rock {
  Grid grid;
  NarrowBand band;
  Masks free;
  std::vector<std::uint8_t> wet, wet_cell;  // the walk's nodes; tags of cells without a row

  struct Kind {
    std::array<int, 3> bricks;
    double rows, open_rows, passable, crossed;
  };
  Rock(const Kind& kind, unsigned seed) {
    std::mt19937 random(seed);
    const auto one_of = [&](double share) { return double(random()) < share * 4294967296.0; };
    grid.bricks = kind.bricks;
    band.row.assign(grid.cells(), -1);
    for (std::size_t cell = 0; cell < grid.cells(); ++cell) {
      if (!one_of(kind.rows)) continue;
      band.row[cell] = int(band.cell.size());
      band.cell.push_back(std::uint32_t(cell));
      const bool open = one_of(kind.open_rows);
      NodeMask mask;
      Crossing crossing;
      for (std::size_t n = 0; n < kBrickSamples; ++n) {
        if (open || one_of(kind.passable)) mask.set(n);
        for (NodeMask& edge : crossing.edge)
          if (!open && one_of(kind.crossed)) edge.set(n);
      }
      free.push_back(mask);
      band.crossing.push_back(crossing);
    }
    wet.assign(kBrickSamples * grid.cells(), 0);
    wet_cell.assign(grid.cells(), 0);
  }

  std::array<int, 3> nodes() const {
    return {8 * grid.bricks[0], 8 * grid.bricks[1], 8 * grid.bricks[2]};
  }
  std::size_t cell_of(const std::array<int, 3>& n) const {
    return grid.cell(n[0] / 8, n[1] / 8, n[2] / 8);
  }
  static std::size_t in_brick(const std::array<int, 3>& n) {
    return std::size_t(((n[2] & 7) * 8 + (n[1] & 7)) * 8 + (n[0] & 7));
  }
  bool passable(const std::array<int, 3>& n, Flood::Over over) const {
    const std::int32_t r = band.row[cell_of(n)];
    return r < 0 ? over == Flood::Over::cells : free[std::size_t(r)].get(in_brick(n));
  }

  // Walks on from these nodes, with the same tags as the flood.
  void walk(std::vector<std::array<int, 3>> from, Flood::Edges edges, Flood::Over over,
            std::uint8_t tag) {
    const auto enter = [&](const std::array<int, 3>& n) {
      std::uint8_t& at = wet[cell_of(n) * kBrickSamples + in_brick(n)];
      if (at || !passable(n, over)) return false;
      at = 1;
      std::uint8_t& cell = wet_cell[cell_of(n)];
      if (cell == 0 && band.row[cell_of(n)] < 0) cell = tag;
      return true;
    };
    std::erase_if(from, [&](const auto& n) { return !enter(n); });
    while (!from.empty()) {
      const std::array<int, 3> at = from.back();
      from.pop_back();
      for (std::size_t axis = 0; axis < 3; ++axis)
        for (int step : {-1, 1}) {
          std::array<int, 3> to = at;
          to[axis] += step;
          if (to[axis] < 0 || to[axis] >= nodes()[axis]) continue;
          const std::array<int, 3>& lower = step > 0 ? at : to;
          const std::int32_t r = band.row[cell_of(lower)];
          const bool cut = edges == Flood::Edges::cut && r >= 0 &&
                           band.crossing[std::size_t(r)].edge[axis].get(in_brick(lower));
          if (!cut && enter(to)) from.push_back(to);
        }
    }
  }

  void agrees(Flood& flood, Flood::Over over) const {
    std::size_t wrong = 0;
    for (std::size_t cell = 0; cell < grid.cells(); ++cell) {
      const std::int32_t r = band.row[cell];
      if (r < 0 && over == Flood::Over::cells) wrong += flood.cells()[cell] != wet_cell[cell];
      for (std::size_t n = 0; n < kBrickSamples && r >= 0; ++n)
        wrong += flood.wet()[std::size_t(r)].get(n) != (wet[cell * kBrickSamples + n] != 0);
    }
    CHECK(wrong == 0);
  }
};

// Wide and narrow grids, lines of more than a word of cells, a maze of whole bricks, and porous
// rock with long ways.
constexpr Rock::Kind kKinds[] = {
    {{7, 6, 5}, 0.5, 0.3, 0.9, 0.2},   {{70, 4, 3}, 0.55, 0.1, 0.0, 0.0},
    {{130, 3, 2}, 0.6, 0.3, 0.5, 0.5}, {{64, 3, 6}, 0.7, 0.2, 0.45, 0.3},
    {{1, 9, 2}, 0.8, 0.5, 0.9, 0.45},  {{7, 6, 40}, 0.62, 0.05, 0.36, 0.0},
    {{3, 4, 34}, 1.0, 0.0, 0.8, 0.6},  {{1, 1, 1}, 1.0, 0.0, 0.7, 0.2},
};

}  // namespace

TEST_CASE("the flood reaches from the border what a walk from node to node does") {
  unsigned seed = 1;
  for (const Rock::Kind& kind : kKinds)
    for (const Flood::Edges edges : {Flood::Edges::cut, Flood::Edges::open})
      for (const unsigned threads : {1u, 2u}) {
        CAPTURE(seed);
        Rock rock(kind, seed++);
        Flood flood(rock.grid, rock.band, rock.free, edges, threads);
        flood.from_border();
        std::vector<std::array<int, 3>> border;
        const std::array<int, 3> size = rock.nodes();
        for (int z = 0; z < size[2]; ++z)
          for (int y = 0; y < size[1]; ++y)
            for (int x = 0; x < size[0]; ++x)
              if (x == 0 || y == 0 || z == 0 || x + 1 == size[0] || y + 1 == size[1] ||
                  z + 1 == size[2])
                border.push_back({x, y, z});
        rock.walk(border, edges, Flood::Over::cells, 1);
        rock.agrees(flood, Flood::Over::cells);
      }
}

TEST_CASE("the flood goes on from more and more nodes, over rows alone or over all cells") {
  unsigned seed = 1000;
  for (const Rock::Kind& kind : kKinds)
    for (const Flood::Over over : {Flood::Over::cells, Flood::Over::rows})
      for (const unsigned threads : {1u, 2u}) {
        CAPTURE(seed);
        Rock rock(kind, seed);
        std::mt19937 random(seed++);
        Flood flood(rock.grid, rock.band, rock.free, Flood::Edges::cut, threads, over);
        for (std::uint8_t tag = 1; tag < 6; ++tag) {
          const bool many = tag % 2 == 0;  // nearly all rows, or a few
          Masks seeds;
          std::vector<RowNodes> list;
          std::vector<std::array<int, 3>> from;
          bool fresh = false;
          for (std::size_t r = 0; r < rock.band.rows(); ++r) {
            NodeMask mask;
            if (many ? random() % 8 != 0 : random() % 50 == 0)
              for (int i = 0; i < (many ? 40 : 3); ++i) mask.set(random() % kBrickSamples);
            const std::array<int, 3> at = rock.grid.place(rock.band.cell[r]);
            for (std::size_t n = 0; n < kBrickSamples; ++n) {
              if (!mask.get(n)) continue;
              from.push_back(
                  {8 * at[0] + int(n % 8), 8 * at[1] + int(n / 8 % 8), 8 * at[2] + int(n / 64)});
              fresh |= rock.free[r].get(n) && !rock.wet[rock.band.cell[r] * kBrickSamples + n];
            }
            seeds.push_back(mask);
            if (mask.any()) list.push_back({std::uint32_t(r), mask});
          }
          CHECK((tag < 4 ? flood.from_nodes(seeds, tag) : flood.from_nodes(list, tag)) == fresh);
          rock.walk(from, Flood::Edges::cut, over, tag);
          rock.agrees(flood, over);
        }
      }
}
