// SPDX-License-Identifier: Apache-2.0
// field.cpp - checks a field's definition and lays it out for the kernels, in parallel.
#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <functional>
#include <mutex>

#include "kernels/field/field_layout.h"
#include "runtime/model/model.h"
#include "sched/parallel_for.h"

namespace h6 {
namespace {

template <class Body>
void for_each(const h6ModelDef& model, std::size_t count, const Body& body) {
  if (model.parallel_for)
    model.parallel_for(
        model.parallel_user, count,
        [](void* context, std::size_t i) { (*static_cast<const Body*>(context))(i); },
        const_cast<void*>(static_cast<const void*>(&body)));
  else
    sched::parallel_for(count, 0, std::ref(body));
}

// The first index from `begin` on that is bad; `count` if none is. Nearly always none is, so whole
// slices are tested without branches.
template <class Bad>
std::size_t first_bad(std::size_t begin, std::size_t count, const Bad& bad) {
  constexpr std::size_t kSlice = 4096;
  for (; begin < count; begin += kSlice) {
    const std::size_t end = std::min(count, begin + kSlice);
    int any = 0;  // compilers make no vectors of bool
    for (std::size_t i = begin; i < end; ++i) any |= bad(i);
    for (std::size_t i = begin; any != 0 && i < end; ++i)
      if (bad(i)) return i;
  }
  return count;
}

// The first sample from `begin` on that is not finite; `end` if all are.
std::size_t first_wild(const float* samples, std::size_t begin, std::size_t end) {
  return first_bad(begin, end, [&](std::size_t i) {
    return (std::bit_cast<std::int32_t>(samples[i]) & INT32_MAX) >= 0x7f800000;
  });
}

bool all_finite(const h6ModelDef& model, const float* samples, std::size_t count,
                std::size_t* which) {
  constexpr std::size_t kSlice = 65536;
  std::atomic<std::size_t> bad{SIZE_MAX};
  for_each(model, (count + kSlice - 1) / kSlice, [&](std::size_t s) {
    const std::size_t end = std::min(count, (s + 1) * kSlice);
    const std::size_t at = first_wild(samples, s * kSlice, end);
    if (at < end) bad.store(at, std::memory_order_relaxed);
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
    return fail(error, H6_ERROR_RANGE, "halves[%zu] is not finite", bad);
  if (!all_finite(model, def.quarters, def.quarter_count * 125, &bad))
    return fail(error, H6_ERROR_RANGE, "quarters[%zu] is not finite", bad);
  return true;
}

bool check(const h6FieldDef& def, const h6ModelDef& model, h6Error* error) {
  if (!check_reserved(def, "", error)) return false;
  if (!(def.voxel_size > 0) || !std::isfinite(def.voxel_size))
    return fail(error, H6_ERROR_RANGE, "voxel_size must be a positive number of metres, it is %g",
                def.voxel_size);
  if (!from(def.origin).allFinite()) return fail(error, H6_ERROR_RANGE, "origin is not finite");
  if (!(def.band >= 0) || !std::isfinite(def.band))
    return fail(error, H6_ERROR_RANGE, "band must be >= 0, it is %g", def.band);
  for (int k = 0; k < 3; ++k)
    if (def.bricks[k] < 1 || def.bricks[k] > 256)
      return fail(error, "bricks[%d] is %d; 1 to 256 (2048 nodes) are supported", k, def.bricks[k]);
  if (!def.brick_index || !def.far_grid || (def.brick_count && !def.samples))
    return fail(error, "brick_index, far_grid and samples must all be given");
  const std::size_t cells = std::size_t(def.bricks[0]) * def.bricks[1] * def.bricks[2];
  const auto bricks = static_cast<std::uint32_t>(std::min<std::size_t>(def.brick_count, INT32_MAX));
  std::size_t bad = first_bad(0, cells, [&](std::size_t i) {
    return static_cast<std::uint32_t>(def.brick_index[i]) + 1 > bricks;  // -1 is 0
  });
  if (bad < cells)
    return fail(error, "brick_index[%zu] is %d, but there are %zu bricks", bad,
                def.brick_index[bad], def.brick_count);
  const std::size_t nodes =
      std::size_t(def.bricks[0] + 1) * (def.bricks[1] + 1) * (def.bricks[2] + 1);
  if (!all_finite(model, def.far_grid, nodes, &bad))
    return fail(error, H6_ERROR_RANGE, "far_grid[%zu] is not finite", bad);
  return check_finer(def, model, error);
}

// Room for the names of bricks. Nothing is kept where there are none.
bool reserve_names(const std::int32_t* names, std::size_t bricks, const h6Allocator& allocator,
                   Buffer<std::int32_t>* out) {
  return !names || bricks == 0 || out->reserve(allocator, bricks);
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

// Whether some place in a far cell may sample less than the margin of the field's box: views.h, J.
bool may_be_near(const std::int16_t* corners, float band) {
  float least = HUGE_VALF;
  for (int k = 0; k < 8; ++k) least = std::min(least, kernels::kFarQuantum * corners[k]);
  if (!(least > 0)) return true;
  constexpr float kSag = 48;  // 64 sum t (1 - t), at most
  const float squared =
      std::max(least * least - kSag, std::min(least, band) * std::min(least, band));
  return squared < kBoxMargin * kBoxMargin;
}

// The first and the last cell along each axis that the field's box holds.
struct Extent {
  std::int32_t low[3] = {INT32_MAX, INT32_MAX, INT32_MAX}, high[3] = {-1, -1, -1};
  void add(std::int32_t a, std::int32_t b, std::int32_t c) {
    const std::int32_t cell[3] = {a, b, c};
    for (int k = 0; k < 3; ++k)
      low[k] = std::min(low[k], cell[k]), high[k] = std::max(high[k], cell[k]);
  }
};

Box box_of(const Extent& cells, const Field& field) {
  const auto [a, b, c] = cells.low;
  const auto [d, e, f] = cells.high;
  if (d < 0) return {};
  const double edge = 8 * field.voxel;
  return {field.origin + edge * Vec3(a, b, c),
          field.origin + edge * Vec3(d, e, f) + Vec3::Constant(edge)};
}

// Fills the field in parallel, row of bricks by row of bricks.
class Rows {
 public:
  Rows(const h6FieldDef& def, Field& field, std::int16_t* fine)
      : def_(def), field_(field), fine_(fine) {}

  void fill(std::size_t row) {
    const std::int32_t* const table = field_.table.data;
    const std::size_t first = row * def_.bricks[0], end = first + def_.bricks[0];
    check(first, end);
    kernels::layout_row(def_, table, row, field_.bricks.data, field_.far.data);
    for (std::size_t cell = first; cell < end && field_.cuts.count > 0; ++cell)
      kernels::layout_fine(def_, table, field_.cuts.data, cell, fine_);
    take_names(first, end, def_.part, field_.part);
    take_names(first, end, def_.triangle, field_.triangle);
    extend(row, first);
  }
  const Extent& extent() const { return extent_; }
  std::size_t wild() const { return wild_; }  // the first sample that is not finite, or SIZE_MAX

 private:
  // Done here, since what it reads is read next: a pass of its own would wait for memory once more.
  void check(std::size_t first, std::size_t end) {
    for (std::size_t cell = first; cell < end; ++cell) {
      const std::int32_t brick = def_.brick_index[cell];
      if (brick < 0) continue;
      const std::size_t begin = std::size_t{512} * brick;
      const std::size_t at = first_wild(def_.samples, begin, begin + 512);
      if (at == begin + 512) continue;
      const std::lock_guard guard(mutex_);
      wild_ = std::min(wild_, at);
    }
  }

  // Names by brick, in the order of the kernels' layout.
  void take_names(std::size_t first, std::size_t end, const std::int32_t* names,
                  Buffer<std::int32_t>& out) const {
    for (std::size_t cell = first; cell < end && out.count > 0; ++cell)
      if (field_.table[cell] >= 0)
        out[kernels::row_of(field_.table[cell])] = names[def_.brick_index[cell]];
  }

  bool in_box(std::size_t cell) const {
    const std::ptrdiff_t entry = field_.table[cell];
    return entry >= 0 || may_be_near(field_.far.data + 8 * (-1 - entry), field_.view.band);
  }

  void extend(std::size_t row, std::size_t first) {
    const auto b = static_cast<std::int32_t>(row % def_.bricks[1]);
    const auto c = static_cast<std::int32_t>(row / def_.bricks[1]);
    std::int32_t low = 0, high = def_.bricks[0] - 1;
    while (low <= high && !in_box(first + low)) ++low;
    while (low < high && !in_box(first + high)) --high;
    if (low > high) return;
    const std::lock_guard guard(mutex_);
    extent_.add(low, b, c), extent_.add(high, b, c);
  }

  const h6FieldDef& def_;
  Field& field_;
  std::int16_t* const fine_;
  Extent extent_;
  std::size_t wild_ = SIZE_MAX;
  std::mutex mutex_;
};

// Room for the bricks and the finer samples behind them, and for what a gather reads behind the
// last of each. Kernels address both by 32-bit byte offsets.
bool reserve_samples(const kernels::FieldLayoutSize& size, const h6Allocator& allocator,
                     Field* field, h6Error* error) {
  constexpr std::size_t most = INT32_MAX / sizeof(std::int16_t);
  constexpr std::size_t most_bricks = most / kernels::kBrickStride;
  constexpr std::size_t most_cuts = INT32_MAX / (kernels::kCutStride * sizeof(std::uint16_t));
  const std::size_t bricks = (size.bricks + 1) * kernels::kBrickStride;
  const std::size_t fine =
      size.refined > 0 ? (size.fine_units + 1) * std::size_t{kernels::kFineUnit} : 0;
  const std::size_t cuts = size.refined > 0 ? size.refined * kernels::kCutStride + 2 : 0;
  if (size.bricks > most_bricks)
    return fail(error,
                "%zu bricks are more than the %zu supported: use a larger voxel or a narrower band",
                size.bricks, most_bricks);
  if ((fine > 0 && bricks + fine > most) || size.refined > most_cuts)
    return fail(error,
                "%zu refined bricks with %zu MB of finer samples are too many: 2 GB can be "
                "addressed",
                size.refined, (bricks + fine) * 2 / 1000000);
  if (!field->bricks.reserve(allocator, bricks + fine) ||
      !field->far.reserve(allocator, (size.far_cells + 1) * 8) ||
      (cuts > 0 && !field->cuts.reserve(allocator, cuts)))
    return fail(error, H6_ERROR_MEMORY, "no memory for %zu bricks (%zu MB)", size.bricks,
                (bricks + fine + cuts) * 2 / 1000000);
  for (std::size_t i = bricks - kernels::kBrickStride; i < bricks; ++i) field->bricks[i] = 0;
  for (int i = 0; i < 8; ++i) field->far[size.far_cells * 8 + i] = 0;
  if (size.refined == 0) return true;
  for (std::size_t i = fine - kernels::kFineUnit; i < fine; ++i) field->bricks[bricks + i] = 0;
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
  if (!field->table.reserve(model.allocator, cells))
    return fail(error, H6_ERROR_MEMORY, "no memory for the table of %zu bricks", size.bricks);
  if (!reserve_samples(size, model.allocator, field, error)) return false;
  std::int16_t* const fine =
      field->bricks.data + (size.bricks + 1) * std::size_t{kernels::kBrickStride};
  kernels::layout_table(def, field->table.data);
  if (size.refined > 0) field->steepest = steepest(def);
  if (size.refined > 0) kernels::layout_cuts(def, field->table.data, field->cuts.data);
  if (!reserve_names(def.part, size.bricks, model.allocator, &field->part) ||
      !reserve_names(def.triangle, size.bricks, model.allocator, &field->triangle))
    return fail(error, H6_ERROR_MEMORY, "no memory for the names of %zu bricks", size.bricks);
  for (int k = 0; k < 3; ++k) field->view.size[k] = def.bricks[k];
  field->view.table = field->table.data;
  field->view.bricks = field->bricks.data;
  field->view.far = field->far.data;
  field->view.cuts = field->cuts.data;
  field->view.fine = fine;
  field->view.band = kernels::layout_band(def);
  Rows rows(def, *field, fine);
  for_each(model, cells / def.bricks[0], [&](std::size_t row) { rows.fill(row); });
  if (rows.wild() != SIZE_MAX)
    return fail(error, H6_ERROR_RANGE, "samples[%zu] is not finite", rows.wild());
  field->box = box_of(rows.extent(), *field);
  return true;
}

}  // namespace h6
