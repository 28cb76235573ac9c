// bake_samples.cpp - from unsigned distances to the samples of the field, in place.
//
// Rows become bricks in the same order, and no brick lies behind its row. As soon as enough rows
// were left out, the next ones are signed right into the room of those before them; until then a
// few thousand at a time are signed into a buffer and moved down. A field of a gigabyte is never
// there twice.
#include <algorithm>

#include "io/bake_chains.h"
#include "io/bake_grid.h"
#include "kernels/sign_brick.h"
#include "sched/parallel_for.h"

namespace h6::io::bake {
namespace {

constexpr std::size_t kBatch = 2048;  // rows: 4 MiB

// The signed distances of one row [m].
void sign_row(const Grid& grid, const NarrowBand& band, const Reached& reached,
              const Inside& inside, std::size_t r, float* out) {
  const float offset = float(grid.offset), voxel = float(grid.voxel);
  const bool held = inside.chains && inside.chains->holds(r);
  const kernels::BrickSides sides{reached.node[r].z.data(), inside.in_sight[r].z.data(),
                                  held ? inside.chains->nodes(r) : nullptr,
                                  held && inside.corrected[r] != 0};
  kernels::sign_brick(band.nodes(r), sides, {offset, kSlack, kCornerSlack, kCrooked, voxel}, out);
  if (!band.crossing.empty() && offset == 0)
    for (std::size_t z = 0; z < 8; ++z)
      for (std::uint64_t on = band.crossing[r].on.z[z] & ~reached.node[r].z[z]; on != 0;
           on &= on - 1)
        out[64 * z + std::size_t(std::countr_zero(on))] = 0;
  for (const Inside::Depth& d : inside.depths[r]) out[d.node] = -d.depth * voxel;
}

}  // namespace

void write_samples(const Grid& grid, NarrowBand& band, const Reached& reached, const Inside& inside,
                   unsigned threads, FieldData& field) {
  field.brick_index.assign(grid.cells(), -1);
  std::vector<std::uint32_t> kept;
  for (std::size_t r = 0; r < band.rows(); ++r) {
    if (!inside.needed[r]) continue;
    field.brick_index[band.cell[r]] = std::int32_t(kept.size());
    kept.push_back(std::uint32_t(r));
  }
  if (!band.part.empty()) field.part.resize(kept.size());
  field.triangle.resize(kept.size());
  Samples buffer;
  for (std::size_t begin = 0, end; begin < kept.size(); begin = end) {
    const std::size_t left_out = kept[begin] - begin;
    const bool direct = left_out >= kBatch;
    end = std::min(kept.size(), begin + (direct ? left_out : kBatch));
    if (!direct) buffer.resize(kBatch * kBrickSamples);
    sched::parallel_for(end - begin, threads, [&](std::size_t i) {
      const std::size_t r = kept[begin + i];
      sign_row(grid, band, reached, inside, r,
               direct ? band.nodes(begin + i) : buffer.data() + i * kBrickSamples);
      if (!band.part.empty()) field.part[begin + i] = band.part[r];
      field.triangle[begin + i] = band.triangle[r];
    });
    if (direct) continue;
    sched::parallel_for(end - begin, threads, [&](std::size_t i) {
      std::copy_n(buffer.data() + i * kBrickSamples, kBrickSamples, band.nodes(begin + i));
    });
  }
  band.u.resize(kept.size() * kBrickSamples);
  field.samples = std::move(band.u);
}

}  // namespace h6::io::bake
