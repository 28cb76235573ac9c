// SPDX-License-Identifier: Apache-2.0
// samples.cpp - from unsigned distances to the samples of the field, in place.
//
// The needed rows become bricks in the same order, and no brick lies after its row. Chunks are
// signed in parallel, straight into their final place. Bricks whose place an earlier chunk may
// still read wait in a buffer; before it overflows, all chunks finish. So a field of a gigabyte is
// never in memory twice.
#include <algorithm>

#include "io/bake/chains.h"
#include "io/bake/grid.h"
#include "kernels/bake/sign_brick.h"
#include "sched/parallel_for.h"

namespace h6::io::bake {
namespace {

constexpr std::size_t kChunk = 1024;   // bricks
constexpr std::size_t kBuffer = 2048;  // bricks: 4 MiB

struct Chunk {
  std::size_t begin, end;            // bricks
  std::size_t late_begin, late_end;  // those of the bricks that wait
  std::size_t buffer;                // their place in the buffer
};

// The next chunks, from brick `begin` on, as many as have room in the buffer for their waiting
// bricks.
std::vector<Chunk> next_chunks(const std::vector<std::uint32_t>& slots, std::size_t begin) {
  std::vector<Chunk> chunks;
  const std::size_t first_slot = slots[begin];  // all before it have been read
  for (std::size_t at = begin, buffered = 0; at < slots.size(); at += kChunk) {
    const std::size_t end = std::min(slots.size(), at + kChunk);
    const std::size_t late = std::clamp(first_slot, at, end);
    const std::size_t late_end =
        at == begin ? late : std::clamp<std::size_t>(slots[at - 1] + 1, late, end);
    if (buffered + (late_end - late) > kBuffer) break;
    chunks.push_back({at, end, late, late_end, buffered});
    buffered += late_end - late;
  }
  return chunks;
}

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
  std::vector<std::uint32_t> kept, slots;  // rows; their places before
  for (std::size_t r = 0; r < band.rows(); ++r) {
    if (!inside.needed[r]) continue;
    field.brick_index[band.cell[r]] = std::int32_t(kept.size());
    kept.push_back(std::uint32_t(r));
    slots.push_back(band.slot[r]);
  }
  if (!band.part.empty()) field.part.resize(kept.size());
  field.triangle.resize(kept.size());
  Samples buffer;
  for (std::size_t begin = 0; begin < kept.size();) {
    const std::vector<Chunk> chunks = next_chunks(slots, begin);
    begin = chunks.back().end;
    const std::size_t buffered =
        chunks.back().buffer + (chunks.back().late_end - chunks.back().late_begin);
    if (buffer.size() < buffered * kBrickSamples) buffer.resize(kBuffer * kBrickSamples);
    sched::parallel_for(chunks.size(), threads, [&](std::size_t c) {
      const Chunk& chunk = chunks[c];
      for (std::size_t i = chunk.begin; i < chunk.end; ++i) {
        const std::size_t r = kept[i];
        const bool late = i >= chunk.late_begin && i < chunk.late_end;
        sign_row(grid, band, reached, inside, r,
                 late ? buffer.data() + (chunk.buffer + i - chunk.late_begin) * kBrickSamples
                      : band.u.data() + i * kBrickSamples);
        if (!band.part.empty()) field.part[i] = band.part[r];
        field.triangle[i] = band.triangle[r];
      }
    });
    if (buffered == 0) continue;
    sched::parallel_for(chunks.size(), threads, [&](std::size_t c) {
      const Chunk& chunk = chunks[c];
      std::copy_n(buffer.data() + chunk.buffer * kBrickSamples,
                  (chunk.late_end - chunk.late_begin) * kBrickSamples,
                  band.u.data() + chunk.late_begin * kBrickSamples);
    });
  }
  band.u.resize(kept.size() * kBrickSamples);
  field.samples = std::move(band.u);
}

}  // namespace h6::io::bake
