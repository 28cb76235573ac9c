// bake_tree.cpp - closest-point search over triangles (see bake_tree.h).
//
// Boxes and triangles are weighed eight at a time in float, by bounds that are never more than the
// truth (rounding to float included). The least of the triangles' bounds is one of the distance;
// the triangle that gave it is measured in double, and where that tells more than a little more,
// the search is done again with all that may be nearest measured in double.
#include "io/bake_tree.h"

#include <algorithm>
#include <utility>

#include "sched/parallel_for.h"

namespace h6::io::bake {
namespace {

constexpr float kRounded = 2.5e-4f;  // [voxel] float at 1024 voxels from the middle, four times

// Steps of eight, of which compilers make vectors.
using Eight = std::array<std::uint32_t, 8>;

// Ten bits each, interleaved.
std::uint32_t apart(std::uint32_t v) {
  v &= 0x3ff;
  v = (v | v << 16) & 0x030000ff;
  v = (v | v << 8) & 0x0300f00f;
  v = (v | v << 4) & 0x030c30c3;
  return (v | v << 2) & 0x09249249;
}

// The places of eight cells on Hilbert's curve, which leaves no cube before it has been everywhere
// in it and never jumps: what follows each other lies together (J. Skilling, "Programming the
// Hilbert curve", 2004: reflect and exchange axes from the largest cube down, then undo the Gray
// code).
Eight hilbert(std::array<Eight, 3> c) {
  for (std::uint32_t half = 512; half > 1; half /= 2)
    for (Eight& axis : c)
      for (std::size_t i = 0; i < 8; ++i) {
        const std::uint32_t low = half - 1, upper = (axis[i] & half) != 0 ? ~0u : 0u;
        const std::uint32_t exchange = (c[0][i] ^ axis[i]) & low & ~upper;
        c[0][i] ^= exchange | (low & upper);
        axis[i] ^= exchange;
      }
  Eight place;
  for (std::size_t i = 0; i < 8; ++i) {
    const std::uint32_t x = c[0][i], y = c[1][i] ^ x, z = c[2][i] ^ y;
    std::uint32_t flip = 0;
    for (std::uint32_t half = 512; half > 1; half /= 2)
      flip ^= (z & half) != 0 ? half - 1 : 0u;
    place[i] = apart(z ^ flip) | apart(y ^ flip) << 1 | apart(x ^ flip) << 2;
  }
  return place;
}

// By the upper half of the words, which has 30 bits; equal ones keep their order. Slices count and
// move side by side; each knows its places from the counts of all.
void sort_by_code(Large<std::uint64_t>& words, unsigned threads) {
  constexpr std::size_t kSlice = 65536, kDigits = 1024;
  Large<std::uint64_t> other(words.size());
  const std::size_t slices = (words.size() + kSlice - 1) / kSlice;
  std::vector<std::array<std::uint32_t, kDigits>> place(slices);
  for (int shift = 32; shift < 62; shift += 10) {
    const auto each = [&](auto&& body) {
      sched::parallel_for(slices, threads, [&](std::size_t s) {
        for (std::size_t i = s * kSlice; i < std::min(words.size(), (s + 1) * kSlice); ++i)
          body(place[s][words[i] >> shift & (kDigits - 1)], words[i]);
      });
    };
    for (auto& counts : place) counts.fill(0);
    each([](std::uint32_t& count, std::uint64_t) { ++count; });
    std::uint32_t sum = 0;
    for (std::size_t digit = 0; digit < kDigits; ++digit)
      for (auto& counts : place) sum += std::exchange(counts[digit], sum);
    each([&](std::uint32_t& to, std::uint64_t word) { other[to++] = word; });
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

kernels::EightTurnedBoxes nothing_around() {
  kernels::EightTurnedBoxes boxes{};
  for (std::size_t k = 0; k < 3; ++k) {
    std::fill_n(boxes.middle[k], 8, 1e9f);
    std::fill_n(boxes.half[k], 8, -1.0f);
  }
  return boxes;
}

struct EightCorners {
  float a[3][8], ab[3][8], ac[3][8];  // first corner, edges from it
};

// How far eight triangles reach along an axis: in steps of eight, of which compilers make vectors.
void reach_along(const EightCorners& t, const std::array<float, 3>& n, float& low, float& high) {
  float least[8], most[8];
  for (std::size_t i = 0; i < 8; ++i) {
    const float a = n[0] * t.a[0][i] + n[1] * t.a[1][i] + n[2] * t.a[2][i];
    const float b = n[0] * t.ab[0][i] + n[1] * t.ab[1][i] + n[2] * t.ab[2][i];
    const float c = n[0] * t.ac[0][i] + n[1] * t.ac[1][i] + n[2] * t.ac[2][i];
    const float under = b < c ? b : c, over = b > c ? b : c;
    least[i] = a + (under < 0.0f ? under : 0.0f);
    most[i] = a + (over > 0.0f ? over : 0.0f);
  }
  low = *std::min_element(least, least + 8);
  high = *std::max_element(most, most + 8);
}

// Around eight triangles: along the grid, or across and along their mean plane, whichever is less.
void put_box_around(const EightCorners& t, kernels::EightTurnedBoxes& boxes, std::size_t box) {
  float normal[3] = {0, 0, 0};
  for (std::size_t i = 0; i < 8; ++i) {
    float n[3];
    for (std::size_t k = 0; k < 3; ++k)
      n[k] =
          t.ab[(k + 1) % 3][i] * t.ac[(k + 2) % 3][i] - t.ab[(k + 2) % 3][i] * t.ac[(k + 1) % 3][i];
    const float along = normal[0] * n[0] + normal[1] * n[1] + normal[2] * n[2];
    for (std::size_t k = 0; k < 3; ++k) normal[k] += along < 0 ? -n[k] : n[k];
  }
  using Frame = std::array<std::array<float, 3>, 3>;
  const auto put = [&](const Frame& axis, float largest) {
    float middle[3], half[3], size = 1;
    for (std::size_t k = 0; k < 3; ++k) {
      float low, high;
      reach_along(t, axis[k], low, high);
      middle[k] = (low + high) / 2;
      half[k] = (high - low) / 2 + 4 * kRounded;
      size *= half[k] + 0.5f;
    }
    if (size >= largest) return size;
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t c = 0; c < 3; ++c) boxes.axis[k][c][box] = axis[k][c];
      boxes.middle[k][box] = middle[k];
      boxes.half[k][box] = half[k];
    }
    return size;
  };
  const float along_grid = put({{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, 1e30f);
  const float length =
      std::sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
  if (!(length > 1e-6f)) return;
  for (float& c : normal) c /= length;
  std::size_t least = 0;
  for (std::size_t k = 1; k < 3; ++k)
    if (std::fabs(normal[k]) < std::fabs(normal[least])) least = k;
  const std::size_t l1 = (least + 1) % 3, l2 = (least + 2) % 3;
  const float across = std::sqrt(normal[l1] * normal[l1] + normal[l2] * normal[l2]);
  Frame axis{};
  axis[0] = {normal[0], normal[1], normal[2]};
  axis[1][l1] = -normal[l2] / across;
  axis[1][l2] = normal[l1] / across;
  for (std::size_t k = 0; k < 3; ++k)
    axis[2][k] =
        axis[0][(k + 1) % 3] * axis[1][(k + 2) % 3] - axis[0][(k + 2) % 3] * axis[1][(k + 1) % 3];
  put(axis, along_grid);
}

}  // namespace

TriangleTree::TriangleTree(const Surface& surface, const Grid& grid, unsigned threads)
    : surface_(surface) {
  for (int k = 0; k < 3; ++k) middle_[k] = grid.middle(k);
  const std::size_t count = surface.triangles.size();
  constexpr std::size_t kSlice = 8192;
  Large<std::uint64_t> words(count);
  sched::parallel_for((count + kSlice - 1) / kSlice, threads, [&](std::size_t s) {
    const std::size_t end = std::min(count, (s + 1) * kSlice);
    for (std::size_t first = s * kSlice; first < end; first += 8) {
      const std::size_t some = std::min<std::size_t>(8, end - first);
      std::array<Eight, 3> cells{};
      for (std::size_t i = 0; i < some; ++i) {
        const auto& t = surface.triangles[first + i];
        const Vec3 &a = surface.vertices[t[0]], &b = surface.vertices[t[1]],
                   &c = surface.vertices[t[2]];
        const auto cell = [](double sum) {  // 2 voxels; the grid has at most 2048
          return std::uint32_t(int(std::clamp(sum / 6, 0.0, 1023.0)));
        };
        cells[0][i] = cell(a.x + b.x + c.x);
        cells[1][i] = cell(a.y + b.y + c.y);
        cells[2][i] = cell(a.z + b.z + c.z);
      }
      const Eight places = hilbert(cells);
      for (std::size_t i = 0; i < some; ++i)
        words[first + i] = std::uint64_t{places[i]} << 32 | (first + i);
    }
  });
  sort_by_code(words, threads);
  triangle_.resize(count);
  sched::parallel_for((count + kSlice - 1) / kSlice, threads, [&](std::size_t s) {
    for (std::size_t i = s * kSlice; i < std::min(count, (s + 1) * kSlice); ++i)
      triangle_[i] = std::uint32_t(words[i]);
  });
  Large<std::uint64_t>().swap(words);

  const std::size_t leaves = (count + 7) / 8;
  leaf_.resize(leaves);
  around_leaf_.resize((leaves + 7) / 8);
  level_.emplace_back((leaves + 7) / 8);
  sched::parallel_for(level_[0].size(), threads, [&](std::size_t node) {
    around_leaf_[node] = nothing_around();
    level_[0][node] = no_boxes();
    for (std::size_t l = 8 * node; l < std::min(leaves, 8 * node + 8); ++l) {
      kernels::EightBoxes& boxes = level_[0][node];
      EightCorners corners;
      for (std::size_t i = 0; i < 8; ++i) {
        const auto& t = surface.triangles[triangle_[std::min(8 * l + i, count - 1)]];
        double c[3][3];
        for (std::size_t v = 0; v < 3; ++v) {
          const Vec3& p = surface.vertices[t[v]];
          c[v][0] = p.x - middle_[0];
          c[v][1] = p.y - middle_[1];
          c[v][2] = p.z - middle_[2];
        }
        kernels::set_triangle(leaf_[l], i, c[0], c[1], c[2]);
        for (std::size_t k = 0; k < 3; ++k) {
          corners.a[k][i] = float(c[0][k]);
          corners.ab[k][i] = float(c[1][k] - c[0][k]);
          corners.ac[k][i] = float(c[2][k] - c[0][k]);
          const double low = std::min({c[0][k], c[1][k], c[2][k]});
          const double high = std::max({c[0][k], c[1][k], c[2][k]});
          boxes.low[k][l % 8] = std::min(boxes.low[k][l % 8], float(low) - kRounded);
          boxes.high[k][l % 8] = std::max(boxes.high[k][l % 8], float(high) + kRounded);
        }
      }
      put_box_around(corners, around_leaf_[node], l % 8);
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

// Looks at every leaf whose box is nearer than `most`, which may shrink meanwhile.
template <class Look>
void TriangleTree::walk(const float (&at)[3], const float& most, Look&& look) const {
  struct Entry {
    float squared;  // bound of the distance
    std::uint32_t level, node;
  };
  Entry stack[128];
  int depth = 0;
  stack[depth++] = {0, std::uint32_t(level_.size()) - 1, 0};
  while (depth > 0) {
    const Entry entry = stack[--depth];
    if (entry.squared >= most) continue;
    // The start is nearly always the nearest: the order of what is left hardly matters.
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
  return search_exactly(p, squared, found.place);  // a sliver, or huge: weighed low
}

double TriangleTree::search_exactly(const double (&p)[3], double best2,
                                    std::uint32_t& nearest) const {
  const float at[3] = {float(p[0] - middle_[0]), float(p[1] - middle_[1]),
                       float(p[2] - middle_[2])};
  // Bounds are for the point and corners as rounded to float.
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
