// bake_tree.cpp - closest-point search over triangles (see bake_tree.h).
//
// Boxes and triangles are weighed eight at a time in float, by bounds that are never more than the
// truth (rounding to float included); what may be nearer than the best so far is measured in
// double. So the result is the least of all triangles' distances in double, whatever the order.
#include "io/bake_tree.h"

#include <algorithm>

#include "sched/parallel_for.h"

namespace h6::io::bake {
namespace {

constexpr float kRounded = 2.5e-4f;  // [voxel] float at 1024 voxels from the middle, four times

// Ten bits each, interleaved.
std::uint32_t morton(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  const auto apart = [](std::uint32_t v) {
    v &= 0x3ff;
    v = (v | v << 16) & 0x030000ff;
    v = (v | v << 8) & 0x0300f00f;
    v = (v | v << 4) & 0x030c30c3;
    return (v | v << 2) & 0x09249249;
  };
  return apart(x) | apart(y) << 1 | apart(z) << 2;
}

// By the upper half of the words, which has 30 bits; equal ones keep their order.
void sort_by_code(std::vector<std::uint64_t>& words) {
  std::vector<std::uint64_t> other(words.size());
  for (int shift = 32; shift < 62; shift += 10) {
    std::vector<std::size_t> next(1025, 0);
    for (std::uint64_t w : words) ++next[(w >> shift & 1023) + 1];
    for (std::size_t i = 1; i < next.size(); ++i) next[i] += next[i - 1];
    for (std::uint64_t w : words) other[next[w >> shift & 1023]++] = w;
    words.swap(other);
  }
}

kernels::EightBoxes no_boxes() {
  kernels::EightBoxes boxes;
  for (std::size_t k = 0; k < 3; ++k) {
    std::fill_n(boxes.low[k], 8, 1e9f);
    std::fill_n(boxes.high[k], 8, -1e9f);
  }
  return boxes;
}

}  // namespace

TriangleTree::TriangleTree(const Surface& surface, const Grid& grid, unsigned threads)
    : surface_(surface) {
  for (int k = 0; k < 3; ++k) middle_[k] = grid.middle(k);
  const std::size_t count = surface.triangles.size();
  constexpr std::size_t kSlice = 8192;
  std::vector<std::uint64_t> words(count);
  sched::parallel_for((count + kSlice - 1) / kSlice, threads, [&](std::size_t s) {
    for (std::size_t i = s * kSlice; i < std::min(count, (s + 1) * kSlice); ++i) {
      const auto& t = surface.triangles[i];
      const Vec3 &a = surface.vertices[t[0]], &b = surface.vertices[t[1]],
                 &c = surface.vertices[t[2]];
      const auto cell = [](double sum) {  // 2 voxels; the grid has at most 2048
        return std::uint32_t(std::clamp(sum / 6, 0.0, 1023.0));
      };
      words[i] = std::uint64_t(morton(cell(a.x + b.x + c.x), cell(a.y + b.y + c.y),
                                      cell(a.z + b.z + c.z))) << 32 | i;
    }
  });
  sort_by_code(words);
  triangle_.resize(count);
  for (std::size_t i = 0; i < count; ++i) triangle_[i] = std::uint32_t(words[i]);
  std::vector<std::uint64_t>().swap(words);

  const std::size_t leaves = (count + 7) / 8;
  leaf_.resize(leaves);
  level_.emplace_back((leaves + 7) / 8, no_boxes());
  sched::parallel_for(level_[0].size(), threads, [&](std::size_t node) {
    for (std::size_t l = 8 * node; l < std::min(leaves, 8 * node + 8); ++l) {
      kernels::EightBoxes& boxes = level_[0][node];
      for (std::size_t i = 0; i < 8; ++i) {
        const auto& t = surface.triangles[triangle_[std::min(8 * l + i, count - 1)]];
        double c[3][3];
        for (std::size_t v = 0; v < 3; ++v) {
          const Vec3& p = surface.vertices[t[v]];
          c[v][0] = p.x - middle_[0];
          c[v][1] = p.y - middle_[1];
          c[v][2] = p.z - middle_[2];
        }
        for (std::size_t k = 0; k < 3; ++k) {
          leaf_[l].a[k][i] = float(c[0][k]);
          leaf_[l].ab[k][i] = float(c[1][k] - c[0][k]);
          leaf_[l].ac[k][i] = float(c[2][k] - c[0][k]);
          const double low = std::min({c[0][k], c[1][k], c[2][k]});
          const double high = std::max({c[0][k], c[1][k], c[2][k]});
          boxes.low[k][l % 8] = std::min(boxes.low[k][l % 8], float(low) - kRounded);
          boxes.high[k][l % 8] = std::max(boxes.high[k][l % 8], float(high) + kRounded);
        }
      }
    }
  });
  while (level_.back().size() > 1) {
    const std::vector<kernels::EightBoxes>& below = level_.back();
    std::vector<kernels::EightBoxes> above((below.size() + 7) / 8, no_boxes());
    for (std::size_t i = 0; i < below.size(); ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        above[i / 8].low[k][i % 8] = *std::min_element(below[i].low[k], below[i].low[k] + 8);
        above[i / 8].high[k][i % 8] = *std::max_element(below[i].high[k], below[i].high[k] + 8);
      }
    level_.push_back(std::move(above));
  }
}

double TriangleTree::squared_to(const double (&p)[3], std::uint32_t place) const {
  const auto& t = surface_.triangles[triangle_[place]];
  const Vec3 &a = surface_.vertices[t[0]], &b = surface_.vertices[t[1]],
             &c = surface_.vertices[t[2]];
  const double pa[3] = {a.x, a.y, a.z}, pb[3] = {b.x, b.y, b.z}, pc[3] = {c.x, c.y, c.z};
  return kernels::point_triangle_squared(p, pa, pb, pc);
}

void TriangleTree::search(const double (&p)[3], Found& found) const {
  const float at[3] = {float(p[0] - middle_[0]), float(p[1] - middle_[1]),
                       float(p[2] - middle_[2])};
  struct Entry {
    float squared;  // bound of the distance
    std::uint32_t level, node;
  };
  Entry stack[128];
  int depth = 0;
  stack[depth++] = {0, std::uint32_t(level_.size()) - 1, 0};
  // Bounds are for the point and corners as rounded to float.
  const auto limit = [&] {
    const double reach = std::sqrt(found.best2) + double(kRounded);
    return float(reach * reach * (1 + 1e-6));
  };
  float most = limit();
  while (depth > 0) {
    const Entry entry = stack[--depth];
    if (entry.squared >= most) continue;
    // The start is nearly always the nearest: the order of what is left hardly matters.
    float squared[8];
    std::uint32_t live =
        kernels::eight_boxes(level_[entry.level][entry.node], at, most, squared);
    if (entry.level > 0) {
      for (; live != 0; live &= live - 1) {
        const std::uint32_t i = std::uint32_t(std::countr_zero(live));
        stack[depth++] = {squared[i], entry.level - 1, 8 * entry.node + i};
      }
      continue;
    }
    for (; live != 0; live &= live - 1) {
      const std::uint32_t child = std::uint32_t(std::countr_zero(live));
      if (squared[child] >= most) continue;
      const std::uint32_t leaf = 8 * entry.node + child;
      float near[8];
      std::uint32_t hits = kernels::eight_triangles(leaf_[leaf], at, most, near);
      for (; hits != 0; hits &= hits - 1) {
        const std::uint32_t i = std::uint32_t(std::countr_zero(hits)), place = 8 * leaf + i;
        if (near[i] >= most || place >= triangle_.size() || place == found.nearest) continue;
        const double d2 = squared_to(p, place);
        if (d2 >= found.best2) continue;
        found = {d2, place};
        most = limit();
      }
    }
  }
}

}  // namespace h6::io::bake
