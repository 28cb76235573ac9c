// bake_chains.cpp - chains of neighbouring nodes from the reached set (see bake_chains.h).
#include "io/bake_chains.h"

#include <algorithm>

#include "sched/parallel_for.h"

namespace h6::io::bake {
namespace {

// Reached nodes of a line of a brick.
std::uint8_t line_of(const NodeMask& nodes, std::size_t line) {
  return std::uint8_t(nodes.z[line / 8] >> (8 * (line % 8)));
}

}  // namespace

Around::Around(const Grid& grid, const NarrowBand& band, const Reached& reached, std::size_t r) {
  const std::array<int, 3> at = grid.place(band.cell[r]);
  const std::size_t cell = band.cell[r];
  const std::ptrdiff_t up[3] = {1, grid.bricks[0],
                                std::ptrdiff_t(grid.bricks[0]) * grid.bricks[1]};
  for (int i = 0; i < 27; ++i) {
    const int by[3] = {i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
    row[std::size_t(i)] = -1;
    outside[std::size_t(i)] = true;
    bool in = true;
    std::ptrdiff_t there = std::ptrdiff_t(cell);
    for (std::size_t k = 0; k < 3; ++k) {
      in &= at[k] + by[k] >= 0 && at[k] + by[k] < grid.bricks[k];
      there += by[k] * up[k];
    }
    if (!in) continue;
    row[std::size_t(i)] = band.row[std::size_t(there)];
    outside[std::size_t(i)] = reached.cell[std::size_t(there)] != 0;
  }
}

void gather_chains(const Grid& grid, const NarrowBand& band, const Reached& reached,
                   const Chains* chains, const Around& around, kernels::ChainBrick& out) {
  const float offset = float(grid.offset), reach = float(grid.reach());
  constexpr int kBegin[3] = {-1, 0, 8}, kEnd[3] = {0, 8, 9};
  const auto seed = [&](float u) {
    return Chain(int((offset - u) * (1 / kChainUnit) + 30000) - 29999);  // rounded up
  };
  const Chain clear = seed(reach);
  for (std::size_t i = 0; i < 27; ++i) {
    const std::size_t dx = i % 3, dy = i / 3 % 3, dz = i / 9;
    const std::int32_t row = around.row[i];
    const std::size_t r = std::size_t(row);
    const Chain* held = row >= 0 && chains != nullptr && chains->holds(r) ? chains->nodes(r)
                                                                           : nullptr;
    const NodeMask* wet =
        row >= 0 && held == nullptr && reached.node[r].any() ? &reached.node[r] : nullptr;
    const Chain blank = row < 0 && around.outside[i] ? clear : kChainFar;
    for (int z = kBegin[dz]; z < kEnd[dz]; ++z) {
      const std::size_t lines = dy == 1 ? 8 : 1;  // of x that lie in a row
      const std::size_t first = std::size_t((z & 7) * 8 + (kBegin[dy] & 7));
      Chain seeds[64];
      const Chain* from = held != nullptr ? held + 8 * first : nullptr;
      std::uint64_t some = 0;
      if (wet != nullptr)
        some = wet->z[first / 8] >> (8 * (first % 8)) & (lines == 8 ? ~std::uint64_t{0} : 0xff);
      if (dx == 1 && some != 0) {
        std::uint8_t masks[8];
        for (std::size_t k = 0; k < lines; ++k) masks[k] = std::uint8_t(some >> (8 * k));
        kernels::chain_seeds(band.nodes(r) + 8 * first, masks, lines, offset, seeds);
        from = seeds;
      }
      const std::size_t x = dx == 0 ? 7 : 0;
      for (std::size_t k = 0; k < lines; ++k) {
        Chain* to = out.v[z + 1][std::size_t(kBegin[dy] + 1) + k];
        if (dx == 1) {
          if (from != nullptr)
            std::copy_n(from + 8 * k, 8, to + 1);
          else
            std::fill_n(to + 1, 8, blank);
          continue;
        }
        Chain& side = to[dx == 0 ? 0 : 9];
        if (from != nullptr)
          side = from[8 * k + x];
        else
          side = some >> (8 * k + x) & 1 ? seed(band.nodes(r)[8 * (first + k) + x]) : blank;
      }
    }
  }
}

Chains::Chains(const Grid& grid, const NarrowBand& band, const Reached& reached,
               const std::vector<std::uint8_t>& rows, unsigned threads)
    : grid_(grid), band_(band), reached_(reached), threads_(threads), slot_(band.rows(), -1) {
  std::int32_t slots = 0;
  for (std::size_t r = 0; r < band.rows(); ++r) {
    if (!rows[r]) continue;
    slot_[r] = slots++;
  }
  for (std::vector<std::uint32_t>& of_tile : rows_by_tile(grid, band, rows)) {
    const std::array<int, 3> at = grid.place(band.cell[of_tile[0]]);
    rows_[std::size_t((at[0] / 4 & 1) + 2 * (at[1] / 4 & 1) + 4 * (at[2] / 4 & 1))].push_back(
        std::move(of_tile));
  }
  chain_.reset(new Chain[std::size_t(slots) * kBrickSamples]);
  sched::parallel_for(band.rows(), threads, [&](std::size_t r) {
    if (slot_[r] < 0) return;
    Chain* to = chain_.get() + std::size_t(slot_[r]) * kBrickSamples;
    std::uint8_t lines[64];
    for (std::size_t line = 0; line < 64; ++line) lines[line] = line_of(reached_.node[r], line);
    kernels::chain_seeds(band_.nodes(r), lines, 64, float(grid_.offset), to);
  });
}

void Chains::pass() {
  for (const auto& tiles : rows_)
    sched::parallel_for(tiles.size(), threads_, [&](std::size_t tile) {
      for (const std::uint32_t r : tiles[tile]) {
        kernels::ChainBrick padded;
        gather_chains(grid_, band_, reached_, this, Around(grid_, band_, reached_, r), padded);
        Chain* own = chain_.get() + std::size_t(slot_[r]) * kBrickSamples;
        for (int step = 0; step < kStepsAPass; ++step) {
          if (step > 0)
            for (std::size_t line = 0; line < 64; ++line)
              std::copy_n(own + 8 * line, 8, padded.v[line / 8 + 1][line % 8 + 1] + 1);
          kernels::chain_step(padded, own);
        }
      }
    });
}

std::vector<std::vector<std::uint32_t>> rows_by_tile(const Grid& grid, const NarrowBand& band,
                                                     const std::vector<std::uint8_t>& rows) {
  std::vector<std::vector<std::uint32_t>> all(band.tiles.count());
  for (std::size_t r = 0; r < band.rows(); ++r)
    if (rows[r]) all[band.tiles.of(grid.place(band.cell[r]))].push_back(std::uint32_t(r));
  std::erase_if(all, [](const auto& tile) { return tile.empty(); });
  return all;
}

}  // namespace h6::io::bake
