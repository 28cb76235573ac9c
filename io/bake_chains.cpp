// bake_chains.cpp - chains of neighbouring nodes from the reached set (see bake_chains.h).
#include "io/bake_chains.h"

#include <algorithm>

#include "sched/parallel_for.h"

namespace h6::io::bake {
namespace {

constexpr std::size_t kLine = 16;  // of a ChainBrick

// Bit y of the result: bit 8*y of the word.
std::uint8_t column(std::uint64_t word) {
  return std::uint8_t((word & 0x0101010101010101) * 0x0102040810204080 >> 56);
}

// Reached nodes by line of a brick: byte 8*z + y.
std::array<std::uint8_t, 64> lines_of(const NodeMask& nodes) {
  std::array<std::uint8_t, 64> lines;
  for (std::size_t n = 0; n < 64; ++n) lines[n] = std::uint8_t(nodes.z[n / 8] >> (8 * (n % 8)));
  return lines;
}

}  // namespace

Around::Around(const Grid& grid, const NarrowBand& band, const Reached& reached, std::size_t r) {
  const std::array<int, 3> at = grid.place(band.cell[r]);
  const std::size_t cell = band.cell[r];
  const std::ptrdiff_t up[3] = {1, grid.bricks[0], std::ptrdiff_t(grid.bricks[0]) * grid.bricks[1]};
  bool inner = true;
  for (std::size_t k = 0; k < 3; ++k) inner &= at[k] > 0 && at[k] + 1 < grid.bricks[k];
  for (int i = 0; i < 27; ++i) {
    const int by[3] = {i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
    bool in = inner;
    if (!inner) {
      in = true;
      for (std::size_t k = 0; k < 3; ++k)
        in &= at[k] + by[k] >= 0 && at[k] + by[k] < grid.bricks[k];
    }
    const std::size_t there =
        std::size_t(std::ptrdiff_t(cell) + by[0] * up[0] + by[1] * up[1] + by[2] * up[2]);
    row[std::size_t(i)] = in ? band.row[there] : -1;
    outside[std::size_t(i)] = !in || (row[std::size_t(i)] < 0 && reached.cell[there] != 0);
  }
}

bool gather_chains(const Grid& grid, const NarrowBand& band, const Reached& reached,
                   const Chains* chains, const Around& around, std::uint32_t wanted,
                   std::uint32_t through, kernels::ChainBrick& out) {
  const float offset = float(grid.offset), reach = float(grid.reach());
  constexpr int kBegin[3] = {-1, 0, 8}, kEnd[3] = {0, 8, 9};
  constexpr std::uint64_t kLines[3] = {std::uint64_t{0xff} << 56, ~std::uint64_t{0}, 0xff};
  constexpr std::uint64_t kColumns[3] = {0x8080808080808080, ~std::uint64_t{0}, 0x0101010101010101};
  const auto seed = [&](float u) {
    return Chain(int((offset - u) * (1 / kChainUnit) + 30000) - 29999);  // rounded up
  };
  const Chain clear = seed(reach);
  std::fill_n(&out.v[0][0][0], 10 * 10 * 16, kChainFar);
  bool any = false;
  for (std::size_t i = 0; i < 27; ++i) {
    if (!(wanted >> i & 1)) continue;
    const std::size_t dx = i % 3, dy = i / 3 % 3, dz = i / 9;
    const bool middle = dx == 1;
    const std::size_t x_in = dx == 0 ? 0 : 9, x_there = dx == 0 ? 7 : 0;
    // Calls f(place of the line in `out`, line of the neighbour).
    const auto each_line = [&](auto&& f) {
      for (int z = kBegin[dz]; z < kEnd[dz]; ++z)
        for (int y = kBegin[dy]; y < kEnd[dy]; ++y)
          f(out.v[z + 1][y + 1], std::size_t((z & 7) * 8 + (y & 7)));
    };
    const std::size_t r = std::size_t(around.row[i]);
    if (around.row[i] < 0) {
      if (!around.outside[i]) continue;
      any = true;
      if (middle)
        each_line([&](Chain* to, std::size_t) { std::fill_n(to + 1, 8, clear); });
      else
        each_line([&](Chain* to, std::size_t) { to[x_in] = clear; });
    } else if (chains != nullptr && chains->holds(r)) {
      if (!chains->some(r)) continue;
      any = true;
      const Chain* from = chains->nodes(r);
      if (middle)
        each_line([&](Chain* to, std::size_t line) { std::copy_n(from + 8 * line, 8, to + 1); });
      else
        each_line([&](Chain* to, std::size_t line) { to[x_in] = from[8 * line + x_there]; });
    } else if (through >> i & 1) {
      any = true;
      const float* u = band.nodes(r);
      const auto& wet = reached.node[r];
      constexpr std::uint8_t kWhole = 0xff;
      each_line([&](Chain* to, std::size_t line) {
        float signed_u[8];
        Chain seeds[8];
        for (std::size_t x = 0; x < 8; ++x)
          signed_u[x] = wet.get(8 * line + x) ? u[8 * line + x] : -u[8 * line + x];
        kernels::chain_seeds(signed_u, 8, &kWhole, 1, offset, middle ? to + 1 : seeds, 8);
        if (!middle) to[x_in] = seeds[x_there];
      });
    } else {
      const float* u = band.nodes(r);
      const auto& wet = reached.node[r].z;
      const std::size_t x = dx == 0 ? 7 : 0, y = dy == 0 ? 7 : 0;
      for (int z = kBegin[dz]; z < kEnd[dz]; ++z) {
        const std::size_t layer = std::size_t(z & 7);
        const std::uint64_t here = wet[layer] & kLines[dy] & kColumns[dx];
        if (here == 0) continue;
        any = true;
        const float* from = u + 64 * layer;
        if (middle) {  // whole lines
          std::uint8_t mask[8];
          for (std::size_t i = 0; i < 8; ++i) mask[i] = std::uint8_t(here >> (8 * i));
          if (dy == 1)
            kernels::chain_seeds(from, 8, mask, 8, offset, out.v[z + 1][1] + 1, kLine);
          else
            kernels::chain_seeds(from + 8 * y, 8, mask + y, 1, offset,
                                 out.v[z + 1][dy == 0 ? 0 : 9] + 1, kLine);
        } else if (dy == 1) {  // one node of each line
          float side[8];
          Chain seeds[8];
          for (std::size_t i = 0; i < 8; ++i) side[i] = from[8 * i + x];
          const std::uint8_t mask = column(here >> x);
          kernels::chain_seeds(side, 8, &mask, 1, offset, seeds, 8);
          for (std::size_t i = 0; i < 8; ++i) out.v[z + 1][i + 1][x_in] = seeds[i];
        } else {
          out.v[z + 1][dy == 0 ? 0 : 9][x_in] = seed(from[8 * y + x]);
        }
      }
    }
  }
  return any;
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
  for (std::size_t r = 0; r < band.rows(); ++r)
    if (rows[r]) slot_[r] = slots++;
  for (std::size_t tile = 0; tile < band.tiles.count(); ++tile) {
    if (band.tiles.first[tile] == band.tiles.first[tile + 1]) continue;
    bool any = false;
    each_row(grid, band, tile, [&](std::size_t r) { any |= slot_[r] >= 0; });
    if (!any) continue;
    const std::array<int, 3> at = band.tiles.first_brick(tile);
    tiles_[std::size_t((at[0] / 4 & 1) + 2 * (at[1] / 4 & 1) + 4 * (at[2] / 4 & 1))].push_back(
        std::uint32_t(tile));
  }
  chain_.resize(std::size_t(slots) * kBrickSamples);
  some_.resize(std::size_t(slots));
  sched::parallel_for(band.rows(), threads, [&](std::size_t r) {
    if (slot_[r] < 0) return;
    Chain* to = chain_.data() + std::size_t(slot_[r]) * kBrickSamples;
    kernels::chain_seeds(band_.nodes(r), 8, lines_of(reached_.node[r]).data(), 64,
                         float(grid_.offset), to, 8);
    some_[std::size_t(slot_[r])] = reached_.node[r].any();
  });
}

void Chains::pass() {
  for (const std::vector<std::uint32_t>& tiles : tiles_)
    sched::parallel_for(tiles.size(), threads_, [&](std::size_t i) {
      each_row(grid_, band_, tiles[i], [&](std::size_t r) {
        if (slot_[r] < 0) return;
        kernels::ChainBrick padded;
        const Around around(grid_, band_, reached_, r);
        std::uint32_t through = 0;
        for (std::size_t i = 0; i < 27 && buried_ != nullptr; ++i)
          if (const std::int32_t next = around.row[i]; next >= 0)
            through |= std::uint32_t(!(*buried_)[std::size_t(next)] && !holds(std::size_t(next))) << i;
        if (!gather_chains(grid_, band_, reached_, this, around, kAround, through, padded))
          return;  // nothing reached anywhere near, as yet
        some_[std::size_t(slot_[r])] = 1;
        kernels::chain_step(padded, kStepsAPass,
                            chain_.data() + std::size_t(slot_[r]) * kBrickSamples);
      });
    });
}

}  // namespace h6::io::bake
