// SPDX-License-Identifier: Apache-2.0
// gauss_tree.cpp - the memory and the stages of gauss_tree.h; the work is in gauss_tree_sort.cpp,
// gauss_tree_build.cpp and gauss_tree_sum.cpp.
#include "kernels/weights/gauss_tree.h"

#include <algorithm>

#include "kernels/weights/gauss_memory.h"
#include "kernels/weights/gauss_tree_stages.h"

namespace h6::kernels {
namespace {

constexpr std::size_t kLeavesASlice = 64;   // stage 1
constexpr std::size_t kTargetsASlice = 16;  // leaves, stage 3
constexpr std::size_t kRowsASlice = 8192;   // stage 4

std::size_t padded(std::size_t rows) { return (rows + kGaussLeaf - 1) / kGaussLeaf * kGaussLeaf; }
int moments_of(int axes) { return axes == 3 ? 2 : kGaussMoments; }

void lay_out(GaussDensity& g, std::size_t count, GaussColumns& columns) {
  const std::size_t rows = padded(count);
  columns.take(g.leaves, rows * static_cast<std::size_t>(g.axes + 1));
  columns.take(g.source, rows);
  columns.take(g.key, rows);
  for (auto& order : g.order) columns.take(order, rows);
  columns.take(g.phi, rows);
  columns.take(g.uneven, 1);
  g.levels = 0;
  for (std::size_t nodes = rows / kGaussLeaf; nodes > 0;) {
    GaussLevel& level = g.level[g.levels++];
    level.count = nodes;
    const std::size_t wide = padded(nodes);
    for (int k = 0; k < g.axes; ++k) columns.take(level.centre[k], wide);
    for (int k = 0; k < g.axes; ++k) columns.take(level.rest[k], wide);
    for (int k = 0; k < g.axes / 3; ++k) columns.take(level.radius[k], wide);
    for (int k = 0; k < moments_of(g.axes); ++k) columns.take(level.moment[k], wide);
    nodes = nodes > kGaussLeaf ? wide / kGaussLeaf : 0;
  }
}

GaussTree with_columns(const DirectionsView& c, Hat hat, const GaussWidths& widths,
                       GaussColumns& columns) {
  GaussTree tree{};
  tree.contacts = c;
  tree.hat = hat;
  tree.densities = hat == Hat::sum ? 2 : 1;
  columns.take(tree.per_share, 1);
  const float* const normals[6] = {c.nx, c.ny, c.nz, c.tx, c.ty, c.tz};
  for (int p = 0; p < tree.densities; ++p) {
    GaussDensity& g = tree.density[p];
    g.axes = hat == Hat::product ? 6 : 3;
    std::copy_n(normals + 3 * p, g.axes, g.column);
    g.width[0] = std::max(p == 0 ? widths.normal : widths.torque, kMinWidth);
    g.width[1] = std::max(widths.torque, kMinWidth);
    g.unit = c.facing == nullptr && c.depth == nullptr;
    lay_out(g, c.count, columns);
  }
  return tree;
}

std::size_t slices_of(std::size_t rows, std::size_t size) { return (rows + size - 1) / size; }

}  // namespace

std::size_t gauss_tree_bytes(std::size_t count, Hat hat) {
  GaussColumns counting{nullptr};
  DirectionsView c{};
  c.count = count;
  with_columns(c, hat, {1, 1}, counting);
  return counting.block_bytes();
}

GaussTree gauss_tree(const DirectionsView& c, Hat hat, const GaussWidths& widths, void* memory,
                     float* weight) {
  GaussColumns columns = GaussColumns::in(memory);
  GaussTree tree = with_columns(c, hat, widths, columns);
  tree.weight = weight;
  return tree;
}

std::size_t gauss_tree_slices(const GaussTree& tree, int stage) {
  const std::size_t densities = static_cast<std::size_t>(tree.densities);
  const std::size_t leaves = tree.density[0].level[0].count;
  if (tree.contacts.count == 0) return 0;
  switch (stage) {
    case 1:
      return densities * slices_of(leaves, kLeavesASlice);
    case 3:
      return densities * slices_of(leaves, kTargetsASlice);
    case 4:
      return slices_of(tree.contacts.count, kRowsASlice);
    default:
      return densities;
  }
}

void gauss_tree_run(const GaussTree& tree, int stage, std::size_t slice) {
  if (stage == 4) {
    const std::size_t first = slice * kRowsASlice;
    return gauss_weigh_rows(tree, first, std::min(first + kRowsASlice, tree.contacts.count));
  }
  const std::size_t size = stage == 1 ? kLeavesASlice : kTargetsASlice;
  const std::size_t each = gauss_tree_slices(tree, stage) / tree.densities;
  const GaussDensity& g = tree.density[slice / each];
  const std::size_t first = slice % each * size;
  const std::size_t end = std::min(first + size, g.level[0].count);
  switch (stage) {
    case 0:
      if (slice == 0) *tree.per_share = gauss_per_share(tree.contacts);
      return gauss_sort(g, tree.contacts.count);
    case 1:
      return gauss_build_leaves(tree, g, first, end);
    case 2:
      return gauss_build_levels(g);
    default:
      return gauss_sum_leaves(g, tree.contacts.count, first, end);
  }
}

}  // namespace h6::kernels
