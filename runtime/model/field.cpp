// SPDX-License-Identifier: Apache-2.0
// field.cpp - checks a field's definition and lays it out for the kernels, in parallel.
#include <algorithm>
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

bool all_finite(const h6ModelDef& model, const float* samples, std::size_t count,
                std::size_t* which) {
  constexpr std::size_t kSlice = 65536;
  std::atomic<std::size_t> bad{SIZE_MAX};
  for_each(model, (count + kSlice - 1) / kSlice, [&](std::size_t s) {
    for (std::size_t i = s * kSlice; i < std::min(count, (s + 1) * kSlice); ++i)
      if (!std::isfinite(samples[i])) bad.store(i, std::memory_order_relaxed);
  });
  *which = bad.load();
  return *which == SIZE_MAX;
}

bool check_finer(const h6FieldDef& def, const h6ModelDef& model, h6Error* error) {
  if (!def.refined) return true;
  // More rows than bricks, or than the kernels can address, would only be a way to read past them.
  constexpr std::size_t most = INT32_MAX / (kernels::kFineUnit * sizeof(std::int16_t));
  if (def.refined_count > def.brick_count || def.half_count > most || def.quarter_count > most)
    return fail(error,
                "%zu refined bricks, %zu halves and %zu quarters are too many for %zu bricks",
                def.refined_count, def.half_count, def.quarter_count, def.brick_count);
  if ((def.refined_count && !def.fine_index) || (def.half_count && !def.halves) ||
      (def.quarter_count && !def.quarters))
    return fail(error, "fine_index, halves and quarters must be given where they are counted");
  for (std::size_t i = 0; i < def.brick_count; ++i)
    if (def.refined[i] < -1 ||
        (def.refined[i] >= 0 && std::size_t(def.refined[i]) >= def.refined_count))
      return fail(error, "refined[%zu] is %d, but there are %zu refined bricks", i, def.refined[i],
                  def.refined_count);
  for (std::size_t i = 0; i < def.refined_count * 512; ++i) {
    const std::int64_t cell = def.fine_index[i];
    if (cell > std::int64_t(def.half_count) || -cell > std::int64_t(def.quarter_count))
      return fail(error, "fine_index[%zu] is %d, but there are %zu halves and %zu quarters", i,
                  def.fine_index[i], def.half_count, def.quarter_count);
  }
  std::size_t bad = 0;
  if (!all_finite(model, def.halves, def.half_count * 27, &bad))
    return fail(error, "halves[%zu] is not finite", bad);
  if (!all_finite(model, def.quarters, def.quarter_count * 125, &bad))
    return fail(error, "quarters[%zu] is not finite", bad);
  return true;
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
  std::size_t bad = 0;
  if (!all_finite(model, def.samples, def.brick_count * 512, &bad))
    return fail(error, "samples[%zu] is not finite", bad);
  const std::size_t nodes =
      std::size_t(def.bricks[0] + 1) * (def.bricks[1] + 1) * (def.bricks[2] + 1);
  for (std::size_t i = 0; i < nodes; ++i)
    if (!std::isfinite(def.far_grid[i])) return fail(error, "far_grid[%zu] is not finite", i);
  return check_finer(def, model, error);
}

// Names by brick, in the order of the kernels' layout. Nothing is kept where there are none.
bool convert_names(const h6FieldDef& def, const std::int32_t* names, std::size_t bricks,
                   const Field& field, const h6Allocator& allocator, Buffer<std::int32_t>* out) {
  if (!names || bricks == 0) return true;
  if (!out->reserve(allocator, bricks)) return false;
  for (std::size_t cell = 0; cell < field.table.count; ++cell)
    if (field.table[cell] >= 0)
      (*out)[kernels::row_of(field.table[cell])] = names[def.brick_index[cell]];
  return true;
}

// Into how many parts the finest cells cut a voxel.
int finest_cut(const h6FieldDef& def) {
  int cut = 1;
  for (std::size_t i = 0; def.refined && i < def.refined_count * 512; ++i)
    cut = std::max(cut, def.fine_index[i] == 0 ? 1 : def.fine_index[i] > 0 ? 2 : 4);
  return cut;
}

// The steepest slope of the interpolation in a cell of (cut + 1)^3 nodes [m a node]. Each component
// of the gradient is affine along each axis, so its length is greatest at a node.
float steepest_in(const float* nodes, int cut) {
  const int side = cut + 1, step[3] = {1, side, side * side};
  float most = 0;
  for (int n = 0; n < side * side * side; ++n) {
    const int at[3] = {n % side, n / side % side, n / side / side};
    float squares = 0;
    for (int k = 0; k < 3; ++k) {
      const float up = at[k] < cut ? std::fabs(nodes[n + step[k]] - nodes[n]) : 0;
      const float down = at[k] > 0 ? std::fabs(nodes[n - step[k]] - nodes[n]) : 0;
      squares += std::max(up, down) * std::max(up, down);
    }
    most = std::max(most, squares);
  }
  return std::sqrt(most);
}

// The steepest slope of all finer samples, at least 1 [voxel a voxel].
float steepest(const h6FieldDef& def) {
  float most = 1;
  for (std::size_t i = 0; i < def.half_count; ++i)
    most = std::max(most,
                    steepest_in(def.halves + 27 * i, 2) * static_cast<float>(2 / def.voxel_size));
  for (std::size_t i = 0; i < def.quarter_count; ++i)
    most = std::max(
        most, steepest_in(def.quarters + 125 * i, 4) * static_cast<float>(4 / def.voxel_size));
  return most;
}

// Room for the finer samples, if there are any, and for what a gather reads behind the last.
bool reserve_finer(const kernels::FieldLayoutSize& size, const h6Allocator& allocator, Field* field,
                   h6Error* error) {
  if (size.refined == 0) return true;
  constexpr std::size_t most_units = INT32_MAX / (kernels::kFineUnit * sizeof(std::int16_t));
  constexpr std::size_t most_cuts = INT32_MAX / (kernels::kCutStride * sizeof(std::uint16_t));
  if (size.fine_units > most_units || size.refined > most_cuts)
    return fail(error,
                "%zu refined bricks with %zu MB of finer samples are too many: 2 GB can be "
                "addressed",
                size.refined, size.fine_units * kernels::kFineUnit * 2 / 1000000);
  const std::size_t fine = (size.fine_units + 1) * kernels::kFineUnit;
  const std::size_t cuts = size.refined * kernels::kCutStride + 2;
  if (!field->fine.reserve(allocator, fine) || !field->cuts.reserve(allocator, cuts))
    return fail(error, "no memory for %zu refined bricks (%zu MB)", size.refined,
                (fine + cuts) * 2 / 1000000);
  for (int i = 0; i < kernels::kFineUnit; ++i) field->fine[fine - kernels::kFineUnit + i] = 0;
  field->cuts[cuts - 2] = field->cuts[cuts - 1] = 0;
  return true;
}

}  // namespace

bool convert_field(const h6FieldDef& def, const h6ModelDef& model, Field* field, h6Error* error) {
  if (!check(def, model, error)) return false;
  field->origin = from(def.origin);
  field->voxel = def.voxel_size;
  field->finest = def.voxel_size / finest_cut(def);
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
  if (!reserve_finer(size, model.allocator, field, error)) return false;
  // One row more than used, because a gather may read past its node, and an empty pool must be
  // readable.
  for (int i = 0; i < kernels::kBrickStride; ++i)
    field->bricks[size.bricks * kernels::kBrickStride + i] = 0;
  for (int i = 0; i < 8; ++i) field->far[size.far_cells * 8 + i] = 0;
  kernels::layout_table(def, field->table.data);
  if (size.refined > 0) field->steepest = steepest(def);
  if (size.refined > 0) kernels::layout_cuts(def, field->table.data, field->cuts.data);
  if (!convert_names(def, def.part, size.bricks, *field, model.allocator, &field->part) ||
      !convert_names(def, def.triangle, size.bricks, *field, model.allocator, &field->triangle))
    return fail(error, "no memory for the names of %zu bricks", size.bricks);
  for_each(model, cells, [&](std::size_t cell) {
    kernels::layout_cell(def, field->table.data, cell, field->bricks.data, field->far.data);
    if (size.refined > 0)
      kernels::layout_fine(def, field->table.data, field->cuts.data, cell, field->fine.data);
  });
  for (int k = 0; k < 3; ++k) field->view.size[k] = def.bricks[k];
  field->view.table = field->table.data;
  field->view.bricks = field->bricks.data;
  field->view.far = field->far.data;
  field->view.cuts = field->cuts.data;
  field->view.fine = field->fine.data;
  field->view.band = kernels::layout_band(def);
  return true;
}

}  // namespace h6
