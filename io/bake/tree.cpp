// SPDX-License-Identifier: Apache-2.0
// tree.cpp - closest-point search over triangles (see tree.h).
//
// The search compares eight boxes or eight triangles at a time in float, by lower bounds that allow
// for rounding. The least bound of all triangles bounds the distance from below. Then the triangle
// with the least bound is measured in double. If its distance is more than kTight above the bound,
// the search runs again and measures every triangle that may be nearest in double.
#include "io/bake/tree.h"

#include <algorithm>
#include <utility>

#include "sched/parallel_for.h"

namespace h6::io::bake {
namespace {

constexpr float kRounded = 2.5e-4f;  // [voxel] four times a float's rounding at 1024 voxels

kernels::EightBoxes no_boxes() {
  kernels::EightBoxes boxes;
  for (std::size_t k = 0; k < 3; ++k) {
    std::fill_n(boxes.low[k], 8, 1e9f);
    std::fill_n(boxes.high[k], 8, -1e9f);
  }
  return boxes;
}

kernels::EightTurnedBoxes nothing_around() {
  kernels::EightTurnedBoxes boxes{};
  for (std::size_t k = 0; k < 3; ++k) {
    std::fill_n(boxes.middle[k], 8, 1e9f);
    std::fill_n(boxes.half[k], 8, -1.0f);
  }
  return boxes;
}

}  // namespace

TriangleTree::TriangleTree(const Surface& surface, const Grid& grid, unsigned threads)
    : surface_(surface) {
  for (int k = 0; k < 3; ++k) middle_[k] = grid.middle(k);
  const std::size_t count = surface.triangles.size();
  triangle_ = order_for_leaves(surface, threads);
  const std::size_t leaves = (count + 7) / 8;
  leaf_.resize(leaves);
  around_leaf_.resize((leaves + 7) / 8);
  level_.emplace_back((leaves + 7) / 8);
  sched::parallel_for(level_[0].size(), threads, [&](std::size_t node) {
    around_leaf_[node] = nothing_around();
    level_[0][node] = no_boxes();
    for (std::size_t l = 8 * node; l < std::min(leaves, 8 * node + 8); ++l) {
      kernels::LeafCorners corners;
      for (std::size_t i = 0; i < 8; ++i) {
        const auto& t = surface.triangles[triangle_[std::min(8 * l + i, count - 1)]];
        for (std::size_t v = 0; v < 3; ++v) {
          const Vec3& p = surface.vertices[t[v]];
          corners.at[v][0][i] = p.x - middle_[0];
          corners.at[v][1][i] = p.y - middle_[1];
          corners.at[v][2][i] = p.z - middle_[2];
        }
      }
      kernels::set_leaf(corners, leaf_[l], around_leaf_[node], level_[0][node], l % 8);
    }
  });
  while (level_.back().size() > 1) {
    const Large<kernels::EightBoxes>& below = level_.back();
    Large<kernels::EightBoxes> above((below.size() + 7) / 8, no_boxes());
    for (std::size_t i = 0; i < below.size(); ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        above[i / 8].low[k][i % 8] = *std::min_element(below[i].low[k], below[i].low[k] + 8);
        above[i / 8].high[k][i % 8] = *std::max_element(below[i].high[k], below[i].high[k] + 8);
      }
    level_.push_back(std::move(above));
  }
  tree_.leaf = leaf_.data();
  tree_.around_leaf = around_leaf_.data();
  for (std::size_t k = 0; k < level_.size(); ++k) tree_.level[k] = level_[k].data();
  tree_.levels = std::uint32_t(level_.size());
  tree_.triangles = std::uint32_t(count);
}

double TriangleTree::squared_to(const double (&p)[3], std::uint32_t place) const {
  const auto& t = surface_.triangles[triangle_[place]];
  const Vec3 &a = surface_.vertices[t[0]], &b = surface_.vertices[t[1]],
             &c = surface_.vertices[t[2]];
  const double pa[3] = {a.x, a.y, a.z}, pb[3] = {b.x, b.y, b.z}, pc[3] = {c.x, c.y, c.z};
  return kernels::point_triangle_squared(p, pa, pb, pc);
}

// Calls look(leaf) for every leaf whose box is nearer than `most` (squared), which look may lower.
template <class Look>
void TriangleTree::walk(const float (&at)[3], const float& most, Look&& look) const {
  struct Entry {
    float squared;  // lower bound of the squared distance
    std::uint32_t level, node;
  };
  Entry stack[128];
  int depth = 0;
  stack[depth++] = {0, std::uint32_t(level_.size()) - 1, 0};
  while (depth > 0) {
    const Entry entry = stack[--depth];
    if (entry.squared >= most) continue;
    // The start is nearly always the nearest, so the order of the rest hardly matters.
    float squared[8];
    if (entry.level > 0) {
      std::uint32_t live = kernels::eight_boxes(level_[entry.level][entry.node], at, most, squared);
      for (; live != 0; live &= live - 1) {
        const std::uint32_t i = std::uint32_t(std::countr_zero(live));
        stack[depth++] = {squared[i], entry.level - 1, 8 * entry.node + i};
      }
      continue;
    }
    std::uint32_t live = kernels::eight_turned_boxes(around_leaf_[entry.node], at, most, squared);
    for (; live != 0; live &= live - 1) {
      const std::uint32_t child = std::uint32_t(std::countr_zero(live));
      if (squared[child] < most) look(8 * entry.node + child);
    }
  }
}

double TriangleTree::search(const double (&p)[3], std::span<const std::uint32_t> start,
                            double enough, Found& found) const {
  const float at[3] = {float(p[0] - middle_[0]), float(p[1] - middle_[1]),
                       float(p[2] - middle_[2])};
  std::uint32_t leaf[kStarts];
  for (std::size_t i = 0; i < start.size(); ++i) leaf[i] = start[i] / 8;
  const float enough2 = enough > 0 ? float(enough * enough) : -1;
  found.place = kNone;
  kernels::nearest_search(tree_, at, leaf, start.size(), enough2, &found);
  if (found.squared <= enough2) return 0;
  if (found.place == kNone) return search_exactly(p, 1e18, found.place);
  const double least = std::sqrt(double(found.squared));
  const double most = least + kTight - 2 * double(kRounded);
  if (double(found.above) <= most * most) return std::max(0.0, least - double(kRounded));
  const double squared = squared_to(p, found.place);
  if (squared <= most * most) return std::max(0.0, least - double(kRounded));
  // In float, the bounds of slivers and huge triangles are too low.
  return search_exactly(p, squared, found.place);
}

double TriangleTree::search_exactly(const double (&p)[3], double best2,
                                    std::uint32_t& nearest) const {
  const float at[3] = {float(p[0] - middle_[0]), float(p[1] - middle_[1]),
                       float(p[2] - middle_[2])};
  // The kernels see the point and the corners rounded to float.
  const auto limit = [&] {
    const double reach = std::sqrt(best2) + double(kRounded);
    return float(reach * reach * (1 + 1e-6));
  };
  float most = limit();
  walk(at, most, [&](std::uint32_t leaf) {
    float near[8];
    std::uint32_t hits = kernels::eight_triangles(leaf_[leaf], at, most, near);
    for (; hits != 0; hits &= hits - 1) {
      const std::uint32_t i = std::uint32_t(std::countr_zero(hits)), place = 8 * leaf + i;
      if (near[i] >= most || place >= triangle_.size() || place == nearest) continue;
      const double d2 = squared_to(p, place);
      if (d2 >= best2) continue;
      best2 = d2;
      nearest = place;
      most = limit();
    }
  });
  return std::sqrt(best2);
}

}  // namespace h6::io::bake
