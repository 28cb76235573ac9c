// SPDX-License-Identifier: Apache-2.0
// chains.cpp - chains of neighbouring nodes to the reached set.
#include "io/bake/chains.h"

#include <algorithm>
#include <atomic>

#include "sched/parallel_for.h"

namespace h6::io::bake {

TileRows::TileRows(const Grid& grid, const NarrowBand& band, const Reached& reached,
                   std::size_t tile) {
  const std::array<int, 3> low = band.tiles.first_brick(tile);
  row.fill(-1);
  outside.fill(true);
  const int first = low[0] > 0 ? -1 : 0, end = std::min(kSide - 1, grid.bricks[0] - low[0]);
  for (int c = -1; c < kSide - 1; ++c) {
    if (low[2] + c < 0 || low[2] + c >= grid.bricks[2]) continue;
    for (int b = -1; b < kSide - 1; ++b) {
      if (low[1] + b < 0 || low[1] + b >= grid.bricks[1]) continue;
      const std::size_t cell = grid.cell(low[0] + first, low[1] + b, low[2] + c);
      const std::size_t to = place(first, b, c);
      for (std::size_t i = 0; i < std::size_t(end - first); ++i) {
        row[to + i] = band.row[cell + i];
        outside[to + i] = band.row[cell + i] < 0 && reached.cell[cell + i] != 0;
      }
    }
  }
}

// The part of a brick that lies in the room: all of it, or the side of a brick around the tile.
struct ChainRoom::Box {
  std::uint8_t x, y, z;               // its first node there
  std::uint8_t width, lines, layers;  // 8 or 1
  std::uint32_t to;                   // where that node is
  std::size_t node(std::size_t j, std::size_t k) const { return 64 * (z + k) + 8 * (y + j); }
};

constexpr std::array<ChainRoom::Box, TileRows::kPlaces> ChainRoom::make_boxes() {
  std::array<Box, TileRows::kPlaces> boxes{};
  for (std::size_t p = 0; p < boxes.size(); ++p) {
    const std::array<int, 3> at = TileRows::brick(p);
    const auto first = [&](std::size_t k) { return std::uint8_t(at[k] < 0 ? 7 : 0); };
    const auto count = [&](std::size_t k) {
      return std::uint8_t(at[k] < 0 || at[k] == kernels::kTileBricks ? 1 : 8);
    };
    boxes[p] = {
        first(0),
        first(1),
        first(2),
        count(0),
        count(1),
        count(2),
        std::uint32_t(node(8 * at[0] + first(0), 8 * at[1] + first(1), 8 * at[2] + first(2)))};
  }
  return boxes;
}

namespace {

template <class T, class Box>
void ask_for_box(const T* brick, const Box& box) {
  const std::size_t apart = std::max<std::size_t>(1, 64 / (8 * sizeof(T)));
  for (std::size_t k = 0; k < box.layers; ++k)
    for (std::size_t j = 0; j < box.lines; j += apart) __builtin_prefetch(brick + box.node(j, k));
}

}  // namespace

void ChainRoom::fill_with(const Box& box, Chain value) {
  for (std::size_t k = 0; k < box.layers; ++k)
    for (std::size_t j = 0; j < box.lines; ++j) {
      Chain* to = v_ + box.to + k * kLayer + j * kLine;
      if (box.width == 8)
        std::fill_n(to, 8, value);
      else
        *to = value;
    }
}

void ChainRoom::copy(const Box& box, const Chain* from) {
  for (std::size_t k = 0; k < box.layers; ++k)
    for (std::size_t j = 0; j < box.lines; ++j) {
      Chain* to = v_ + box.to + k * kLayer + j * kLine;
      if (box.width == 8)
        std::copy_n(from + box.node(j, k), 8, to);
      else
        *to = from[box.node(j, k) + box.x];
    }
}

// Sets chains from the nodes of R alone. All are far if the brick has no node of R and `passes` is
// false.
void ChainRoom::seed(const Box& box, const NodeMask& wet, const float* u, float offset,
                     bool passes) {
  std::uint64_t mask[8], any = 0;
  for (std::size_t k = 0; k < box.layers; ++k) {
    mask[k] = wet.z[box.z + k] >> (8 * box.y);
    any |= mask[k];
  }
  if (any == 0 && !passes) return fill_with(box, kChainFar);
  const kernels::ChainSeeds seeds{offset, passes, box.layers, box.lines};
  Chain* to = v_ + box.to;
  if (box.width == 8)
    return kernels::chain_seeds(u + box.node(0, 0), mask, seeds, to, kLine, kLayer);
  Chain all[kBrickSamples];
  kernels::chain_seeds(u + box.node(0, 0), mask, seeds, all, 8, 64);
  for (std::size_t k = 0; k < box.layers; ++k)
    for (std::size_t j = 0; j < box.lines; ++j)
      to[k * kLayer + j * kLine] = all[64 * k + 8 * j + box.x];
}

void ChainRoom::fill(const Grid& grid, const NarrowBand& band, const Reached& reached,
                     const Chains* chains, const TileRows& rows, const std::vector<Wanted>& bricks,
                     const std::vector<std::uint8_t>* through) {
  static constexpr std::array<Box, TileRows::kPlaces> kBoxes = make_boxes();
  constexpr int kLayerPlaces = TileRows::kSide * TileRows::kSide;
  const float offset = float(grid.offset);
  const Chain clear =
      Chain(int((offset - float(grid.reach())) * (1 / kChainUnit) + 30000) - 29999);  // rounded up
  std::uint64_t wanted[TileRows::kSide] = {};
  for (const Wanted& brick : bricks) {
    const std::array<int, 3> at = TileRows::brick(brick.place);
    for (int i = 0; i < 9; ++i)
      wanted[at[2] + i / 3] |= std::uint64_t{brick.around >> (3 * i) & 7}
                               << (TileRows::kSide * (at[1] + i % 3) + at[0]);
  }
  std::array<std::uint8_t, TileRows::kPlaces> from;  // places with a row
  std::size_t count = 0;
  for (int c = 0; c < TileRows::kSide; ++c)
    for (; wanted[c] != 0; wanted[c] &= wanted[c] - 1) {
      const std::size_t p = std::size_t(c * kLayerPlaces + std::countr_zero(wanted[c]));
      const std::int32_t r = rows.row[p];
      if (r < 0)
        fill_with(kBoxes[p], rows.outside[p] ? clear : kChainFar);
      else
        from[count++] = std::uint8_t(p);
    }
  // Rows are scattered over memory, so they are prefetched.
  constexpr std::size_t kLater = 8, kSoon = 3;
  const auto row = [&](std::size_t i) { return std::size_t(rows.row[from[i]]); };
  const auto held = [&](std::size_t r) { return chains != nullptr && chains->holds(r); };
  for (std::size_t i = 0; i < count + kLater; ++i) {
    if (i < count && !held(row(i))) __builtin_prefetch(&reached.node[row(i)]);
    if (const std::size_t k = i + kSoon - kLater; i + kSoon >= kLater && k < count) {
      const Box& box = kBoxes[from[k]];
      if (held(row(k)))
        ask_for_box(chains->nodes(row(k)), box);
      else
        ask_for_box(band.nodes(row(k)), box);
    }
    if (i < kLater) continue;
    const std::size_t r = row(i - kLater);
    const Box& box = kBoxes[from[i - kLater]];
    if (!held(r))
      seed(box, reached.node[r], band.nodes(r), offset, through != nullptr && !(*through)[r]);
    else if (chains->some(r))
      copy(box, chains->nodes(r));
    else
      fill_with(box, kChainFar);
  }
}

Chains::Chains(const Grid& grid, const NarrowBand& band, const Reached& reached,
               const std::vector<std::uint8_t>& rows, unsigned threads,
               const std::vector<std::uint8_t>* buried)
    : grid_(grid),
      band_(band),
      reached_(reached),
      buried_(buried),
      threads_(threads),
      slot_(band.rows(), -1) {
  std::int32_t slots = 0;
  for (std::size_t tile = 0; tile < band.tiles.count(); ++tile) {
    if (band.tiles.first[tile] == band.tiles.first[tile + 1]) continue;
    const std::int32_t before = slots;
    TileRows(grid, band, reached, tile).each([&](std::size_t, std::size_t r) {
      if (rows[r]) slot_[r] = slots++;
    });
    if (slots == before) continue;
    const std::array<int, 3> at = band.tiles.first_brick(tile);
    tiles_[std::size_t((at[0] / 4 & 1) + 2 * (at[1] / 4 & 1) + 4 * (at[2] / 4 & 1))].push_back(
        std::uint32_t(tile));
  }
  chain_.resize(std::size_t(slots) * kBrickSamples);
  some_.resize(std::size_t(slots));
  sched::parallel_for(band.rows(), threads, [&](std::size_t r) {
    if (slot_[r] < 0) return;
    Chain* to = chain_.data() + std::size_t(slot_[r]) * kBrickSamples;
    kernels::chain_seeds(band_.nodes(r), reached_.node[r].z.data(), {float(grid_.offset), false},
                         to, 8, 64);
    some_[std::size_t(slot_[r])] = reached_.node[r].any();
  });
}

bool Chains::pass() {
  std::atomic<bool> changed{false};
  for (const std::vector<std::uint32_t>& tiles : tiles_)
    sched::parallel_for(tiles.size(), threads_, [&](std::size_t i) {
      if (pass_tile(tiles[i])) changed.store(true, std::memory_order_relaxed);
    });
  return changed;
}

constexpr int kStepsAPass = 3;  // in each brick

bool Chains::pass_tile(std::size_t tile) {
  thread_local const auto room = std::make_unique<ChainRoom>();
  thread_local std::vector<ChainRoom::Wanted> bricks;
  const TileRows rows(grid_, band_, reached_, tile);
  bricks.clear();
  rows.each([&](std::size_t place, std::size_t r) {
    if (slot_[r] >= 0) bricks.push_back({place, ChainRoom::kAllAround});
  });
  room->fill(grid_, band_, reached_, this, rows, bricks, buried_);
  constexpr std::size_t kLine = ChainRoom::kLine, kLayer = ChainRoom::kLayer;
  bool any = false;
  for (const ChainRoom::Wanted& brick : bricks) {
    Chain* first = room->first(brick.place);
    bool changed = false;
    for (int step = 0; step < kStepsAPass; ++step) {
      if (!kernels::chain_step(first, kLine, kLayer, first, kLine, kLayer)) break;
      changed = true;
    }
    if (!changed) continue;
    any = true;
    const std::size_t slot = std::size_t(slot_[std::size_t(rows.row[brick.place])]);
    Chain* to = chain_.data() + slot * kBrickSamples;
    for (std::size_t n = 0; n < kBrickSamples; n += 8)
      std::copy_n(first + n / 64 * kLayer + n / 8 % 8 * kLine, 8, to + n);
    some_[slot] = 1;
  }
  return any;
}

}  // namespace h6::io::bake
