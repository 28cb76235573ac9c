// SPDX-License-Identifier: Apache-2.0
// field.cpp - checks a field's definition and lays it out for the kernels, in parallel.
#include <atomic>
#include <cmath>

#include "kernels/field/field_layout.h"
#include "runtime/model/model.h"
#include "sched/parallel_for.h"

namespace h6 {
namespace {

void for_each(const h6ModelDef& model, std::size_t count,
              const std::function<void(std::size_t)>& body) {
  if (model.parallel_for) {
    model.parallel_for(
        model.parallel_user, count,
        [](void* context, std::size_t i) {
          (*static_cast<const std::function<void(std::size_t)>*>(context))(i);
        },
        const_cast<void*>(static_cast<const void*>(&body)));
  } else {
    sched::parallel_for(count, 0, body);
  }
}

bool check(const h6FieldDef& def, const h6ModelDef& model, h6Error* error) {
  if (!(def.voxel_size > 0) || !std::isfinite(def.voxel_size))
    return fail(error, "voxel_size must be a positive number of metres, it is %g", def.voxel_size);
  if (!from(def.origin).allFinite()) return fail(error, "origin is not finite");
  if (!(def.band >= 0) || !std::isfinite(def.band))
    return fail(error, "band must be >= 0, it is %g", def.band);
  for (int k = 0; k < 3; ++k)
    if (def.bricks[k] < 1 || def.bricks[k] > 256)
      return fail(error, "bricks[%d] is %d; 1 to 256 (2048 nodes) are supported", k, def.bricks[k]);
  if (!def.brick_index || !def.far_grid || (def.brick_count && !def.samples))
    return fail(error, "brick_index, far_grid and samples must all be given");
  const std::size_t cells = std::size_t(def.bricks[0]) * def.bricks[1] * def.bricks[2];
  for (std::size_t i = 0; i < cells; ++i)
    if (def.brick_index[i] < -1 ||
        (def.brick_index[i] >= 0 && std::size_t(def.brick_index[i]) >= def.brick_count))
      return fail(error, "brick_index[%zu] is %d, but there are %zu bricks", i, def.brick_index[i],
                  def.brick_count);
  std::atomic<std::size_t> bad{SIZE_MAX};
  for_each(model, def.brick_count, [&](std::size_t b) {
    for (std::size_t i = b * 512; i < b * 512 + 512; ++i)
      if (!std::isfinite(def.samples[i])) bad.store(i, std::memory_order_relaxed);
  });
  if (bad.load() != SIZE_MAX) return fail(error, "samples[%zu] is not finite", bad.load());
  const std::size_t nodes =
      std::size_t(def.bricks[0] + 1) * (def.bricks[1] + 1) * (def.bricks[2] + 1);
  for (std::size_t i = 0; i < nodes; ++i)
    if (!std::isfinite(def.far_grid[i])) return fail(error, "far_grid[%zu] is not finite", i);
  return true;
}

// Names by brick, in the order of the kernels' layout. Nothing is kept where there are none.
bool convert_names(const h6FieldDef& def, const std::int32_t* names, std::size_t bricks,
                   const Field& field, const h6Allocator& allocator, Buffer<std::int32_t>* out) {
  if (!names || bricks == 0) return true;
  if (!out->reserve(allocator, bricks)) return false;
  for (std::size_t cell = 0; cell < field.table.count; ++cell)
    if (field.table[cell] >= 0) (*out)[field.table[cell]] = names[def.brick_index[cell]];
  return true;
}

}  // namespace

bool convert_field(const h6FieldDef& def, const h6ModelDef& model, Field* field, h6Error* error) {
  if (!check(def, model, error)) return false;
  field->origin = from(def.origin);
  field->voxel = def.voxel_size;
  field->wide = def.band < 2.999 * def.voxel_size;
  const std::size_t cells = std::size_t(def.bricks[0]) * def.bricks[1] * def.bricks[2];
  const kernels::FieldLayoutSize size = kernels::field_layout_size(def);
  // Kernels address bricks by 32-bit byte offsets.
  constexpr std::size_t most = INT32_MAX / (kernels::kBrickStride * sizeof(std::int16_t));
  if (size.bricks > most)
    return fail(error,
                "%zu bricks are more than the %zu supported: use a larger voxel or a narrower band",
                size.bricks, most);
  if (!field->table.reserve(model.allocator, cells) ||
      !field->bricks.reserve(model.allocator, (size.bricks + 1) * kernels::kBrickStride) ||
      !field->far.reserve(model.allocator, (size.far_cells + 1) * 8))
    return fail(error, "no memory for %zu bricks (%zu MB)", size.bricks,
                size.bricks * kernels::kBrickStride * 2 / 1000000);
  // One row more than used, because a gather may read past its node, and an empty pool must be
  // readable.
  for (int i = 0; i < kernels::kBrickStride; ++i)
    field->bricks[size.bricks * kernels::kBrickStride + i] = 0;
  for (int i = 0; i < 8; ++i) field->far[size.far_cells * 8 + i] = 0;
  kernels::layout_table(def, field->table.data);
  if (!convert_names(def, def.part, size.bricks, *field, model.allocator, &field->part) ||
      !convert_names(def, def.triangle, size.bricks, *field, model.allocator, &field->triangle))
    return fail(error, "no memory for the names of %zu bricks", size.bricks);
  for_each(model, cells, [&](std::size_t cell) {
    kernels::layout_cell(def, field->table.data, cell, field->bricks.data, field->far.data);
  });
  for (int k = 0; k < 3; ++k) field->view.size[k] = def.bricks[k];
  field->view.table = field->table.data;
  field->view.bricks = field->bricks.data;
  field->view.far = field->far.data;
  field->view.band = kernels::layout_band(def);
  return true;
}

}  // namespace h6
