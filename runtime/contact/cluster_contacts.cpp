// SPDX-License-Identifier: Apache-2.0
// cluster_contacts.cpp - merges near contacts into one. Kim et al. 2003; METHOD.md, Sec. 3.
//
// The cells of a grid have the threshold as their diagonal. So contacts of one cell are in one
// cluster without a test, and only cells up to two apart can be linked. Cells are sorted, x
// fastest, so that one search finds five of them in a row. Nothing is allocated.
#include <algorithm>
#include <cmath>

#include "runtime/contact/weighing.h"

namespace h6 {
namespace {

constexpr int kBits = 21;                          // bits of each coordinate in a cell's key
constexpr double kMostCells = (1 << (kBits - 1));  // most cells along an axis
constexpr int kReach = 2;                          // cells farther apart than this cannot be linked

std::uint64_t key_of(std::uint64_t x, std::uint64_t y, std::uint64_t z) {
  return (z << kBits | y) << kBits | x;
}

// Computes the rows' cells. Coordinates are shifted by kReach so that neighbours never underflow.
// If the contacts spread over more cells than a key holds, the cells grow.
void fill_cells(const Contacts& c, std::size_t begin, std::size_t n, double distance,
                std::uint64_t* cell) {
  const float* const axes[3] = {c.rx + begin, c.ry + begin, c.rz + begin};
  double low[3], extent = 0;
  for (int k = 0; k < 3; ++k) {
    const auto [least, most] = std::minmax_element(axes[k], axes[k] + n);
    low[k] = *least;
    extent = std::max(extent, double{*most} - *least);
  }
  // The edge is a little shorter than the diagonal allows, so that rounding puts no two unlinked
  // rows into one cell.
  const double edge = std::max(distance / std::sqrt(3.0) * (1 - 1e-6), extent / kMostCells);
  for (std::size_t i = 0; i < n; ++i) {
    std::uint64_t at[3];
    for (int k = 0; k < 3; ++k)
      at[k] = kReach + static_cast<std::uint64_t>((axes[k][i] - low[k]) / edge);
    cell[i] = key_of(at[0], at[1], at[2]);
  }
}

struct Linker {
  const Contacts& c;
  std::size_t begin, count;
  double distance2;
  const std::uint64_t* cell;
  const std::uint32_t* order;  // the rows, sorted by cell
  std::uint32_t* root;         // a row of the same cluster, never above the row itself

  std::uint32_t find(std::uint32_t i) const {
    while (root[i] != i) i = root[i] = root[root[i]];
    return i;
  }
  void link(std::uint32_t a, std::uint32_t b) const {
    a = find(a), b = find(b);
    root[std::max(a, b)] = std::min(a, b);
  }
  std::size_t run_end(std::size_t first) const {
    std::size_t end = first + 1;
    while (end < count && cell[order[end]] == cell[order[first]]) ++end;
    return end;
  }
  bool near(std::uint32_t i, std::uint32_t j) const {
    const double x = double{c.rx[begin + i]} - c.rx[begin + j],
                 y = double{c.ry[begin + i]} - c.ry[begin + j],
                 z = double{c.rz[begin + i]} - c.rz[begin + j];
    return x * x + y * y + z * z < distance2;
  }
  // One link is enough, because each cell is in one cluster already.
  void link_cells(std::size_t a, std::size_t a_end, std::size_t b, std::size_t b_end) const {
    if (find(order[a]) == find(order[b])) return;
    for (std::size_t i = a; i < a_end; ++i)
      for (std::size_t j = b; j < b_end; ++j)
        if (near(order[i], order[j])) return link(order[i], order[j]);
  }
  // Links cell `a` to the cells of one row of the grid, keys `from` to `to`.
  void link_row(std::size_t a, std::size_t a_end, std::uint64_t from, std::uint64_t to) const {
    std::size_t b =
        std::lower_bound(order, order + count, from,
                         [&](std::uint32_t row, std::uint64_t key) { return cell[row] < key; }) -
        order;
    for (std::size_t b_end; b < count && cell[order[b]] <= to; b = b_end) {
      b_end = run_end(b);
      link_cells(a, a_end, b, b_end);
    }
  }
  void link_all() const {
    for (std::size_t a = 0, a_end; a < count; a = a_end) {
      a_end = run_end(a);
      for (std::size_t i = a + 1; i < a_end; ++i) link(order[a], order[i]);
      // Neighbours with a smaller key have been linked already.
      const std::uint64_t key = cell[order[a]];
      for (int dz = 0; dz <= kReach; ++dz)
        for (int dy = dz == 0 ? 0 : -kReach; dy <= kReach; ++dy) {
          const std::uint64_t middle =
              key + (static_cast<std::uint64_t>(dz) << 2 * kBits) +
              static_cast<std::uint64_t>(static_cast<std::int64_t>(dy) * (1 << kBits));
          link_row(a, a_end, dz == 0 && dy == 0 ? key + 1 : middle - kReach, middle + kReach);
        }
    }
  }
};

void copy_row(Contacts& c, std::size_t from, std::size_t to) {
  each_column(c, [&](auto* column) {
    if (column) column[to] = column[from];
  });
}

// Updates means weighted by depth. `weight` holds the sum of depths, `facing` the largest so far.
void merge_row(Contacts& c, std::size_t from, std::size_t to) {
  const float depth = c.depth[from];
  c.weight[to] += depth;
  const float share = depth / c.weight[to];
  for (float* column : {c.depth, c.nx, c.ny, c.nz, c.gx, c.gy, c.gz, c.rx, c.ry, c.rz})
    column[to] += share * (column[from] - column[to]);
  if (depth > c.facing[to]) {
    c.facing[to] = depth;
    c.point[to] = c.point[from];
  }
}

// Gives a mean direction unit length; returns false if it nearly vanishes.
bool normalise(float& x, float& y, float& z) {
  const float length = std::sqrt(x * x + y * y + z * z);
  if (!(length > 1e-3f)) return false;
  x /= length, y /= length, z /= length;
  return true;
}

}  // namespace

std::size_t cluster_contacts(Contacts& c, std::size_t begin, std::size_t end, std::size_t out,
                             double distance, const ClusterScratch& scratch) {
  const std::size_t n = end - begin;
  if (n == 0) return out;
  fill_cells(c, begin, n, distance, scratch.cell);
  for (std::uint32_t i = 0; i < n; ++i) scratch.order[i] = scratch.root[i] = i;
  std::sort(scratch.order, scratch.order + n, [&](std::uint32_t a, std::uint32_t b) {
    return scratch.cell[a] != scratch.cell[b] ? scratch.cell[a] < scratch.cell[b] : a < b;
  });
  const Linker linker{c, begin, n, distance * distance, scratch.cell, scratch.order, scratch.root};
  linker.link_all();

  // Rows are read in order, so a cluster's row never overwrites a row that is still unread.
  std::uint32_t* const row_of = scratch.order;  // by root: the cluster's row
  std::size_t rows = 0;
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t root = scratch.root[i] = linker.find(i);
    if (root == i) {
      row_of[i] = static_cast<std::uint32_t>(rows++);
      const std::size_t to = out + row_of[i];
      copy_row(c, begin + i, to);
      c.weight[to] = c.facing[to] = c.depth[to];
    } else {
      merge_row(c, begin + i, out + row_of[root]);
    }
  }
  std::uint64_t* const kept = scratch.cell;  // where each cluster's row ends up
  std::size_t next = out;
  for (std::size_t row = 0; row < rows; ++row) {
    const std::size_t at = out + row;
    const bool direction = normalise(c.nx[at], c.ny[at], c.nz[at]);
    kept[row] = direction ? next : kNoCluster;
    if (!direction) continue;
    if (!normalise(c.gx[at], c.gy[at], c.gz[at]))
      c.gx[at] = c.nx[at], c.gy[at] = c.ny[at], c.gz[at] = c.nz[at];
    if (next != at) copy_row(c, at, next);
    ++next;
  }
  // The loop runs downwards, because a root lies below its rows and is still needed.
  for (std::uint32_t i = static_cast<std::uint32_t>(n); i-- > 0;)
    scratch.root[i] = static_cast<std::uint32_t>(kept[row_of[scratch.root[i]]]);
  return next;
}

}  // namespace h6
