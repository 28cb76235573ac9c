// SPDX-License-Identifier: Apache-2.0
// leaves.cpp - the order of triangles in the tree.
//
// Hilbert's curve keeps neighbours together, but eight successive triangles on it may still lie
// around an edge or across faces. So every run of 512 is halved until eights are left, each time
// along the axis that gives the smallest boxes. A search then looks at a third fewer leaves.
#include "io/bake/tree.h"

#include <algorithm>
#include <utility>

#include "kernels/bake/box_halves.h"
#include "sched/parallel_for.h"

namespace h6::io::bake {
namespace {

// Eight at a time, so that the compiler makes vectors.
using Eight = std::array<std::uint32_t, 8>;

// Cells along an axis, and their width: the grid has at most 2048 voxels. Smaller cells gain
// nothing, since the halving orders the content of a cell.
constexpr std::uint32_t kCells = 256;
constexpr double kCell = 8;  // [voxel]

// Spreads ten bits, to be interleaved with those of two other axes.
std::uint32_t apart(std::uint32_t v) {
  v &= 0x3ff;
  v = (v | v << 16) & 0x030000ff;
  v = (v | v << 8) & 0x0300f00f;
  v = (v | v << 4) & 0x030c30c3;
  return (v | v << 2) & 0x09249249;
}

// The places of eight cells on Hilbert's curve. The curve never jumps and finishes a cube before it
// leaves it, so successors are neighbours (J. Skilling, "Programming the Hilbert curve", 2004:
// reflect and exchange axes from the largest cube down, then undo the Gray code).
Eight hilbert(std::array<Eight, 3> c) {
  for (std::uint32_t half = kCells / 2; half > 1; half /= 2)
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
    for (std::uint32_t half = kCells / 2; half > 1; half /= 2)
      flip ^= (z & half) != 0 ? half - 1 : 0u;
    place[i] = apart(z ^ flip) | apart(y ^ flip) << 1 | apart(x ^ flip) << 2;
  }
  return place;
}

// A stable radix sort by the upper half of the words, which has 24 bits. Slices count in parallel;
// the counts of all slices give each slice the places of its words.
void sort_by_code(Large<std::uint64_t>& words, unsigned threads) {
  constexpr std::size_t kSlice = 65536, kDigits = 4096;
  Large<std::uint64_t> other(words.size());
  const std::size_t slices = (words.size() + kSlice - 1) / kSlice;
  std::vector<std::array<std::uint32_t, kDigits>> place(slices);
  for (int shift = 32; shift < 56; shift += 12) {
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

// Orders up to kMost triangles by halving them until eights are left.
class Halves {
 public:
  static constexpr std::size_t kMost = 512;

  void order(const Surface& surface, std::uint32_t* triangles, std::size_t count) {
    // Reads all indices before all corners, because loads that do not depend on each other overlap.
    std::array<std::uint32_t, 3> corners[kMost];
    for (std::size_t i = 0; i < count; ++i) corners[i] = surface.triangles[triangles[i]];
    float low[3][kMost], high[3][kMost];
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3 &a = surface.vertices[corners[i][0]], &b = surface.vertices[corners[i][1]],
                 &c = surface.vertices[corners[i][2]];
      const auto put = [&](std::size_t k, float u, float v, float w) {
        low[k][i] = std::min(std::min(u, v), w);
        high[k][i] = std::max(std::max(u, v), w);
      };
      put(0, float(a.x), float(b.x), float(c.x));
      put(1, float(a.y), float(b.y), float(c.y));
      put(2, float(a.z), float(b.z), float(c.z));
    }
    float from[3], width = 1e-3f;
    for (std::size_t k = 0; k < 3; ++k) {
      from[k] = *std::min_element(low[k], low[k] + count);
      width = std::max(width, *std::max_element(high[k], high[k] + count) - from[k]);
    }
    const float scale = float(kernels::ShortBox::kMost) / width;
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t i = 0; i < count; ++i) {
        box_[i].least[k] = std::int16_t(int((low[k][i] - from[k]) * scale));
        box_[i].least[4 + k] = std::int16_t(-int((high[k][i] - from[k]) * scale));
      }
      sort(k, count);
    }
    for (std::size_t i = 0; i < count; ++i) box_[i].least[3] = box_[i].least[7] = 0;
    halve(0, count);
    std::uint32_t before[kMost];
    std::copy_n(triangles, count, before);
    for (std::size_t i = 0; i < count; ++i) triangles[i] = before[sorted_[0][i]];
  }

 private:
  using Index = std::uint16_t;

  // A counting sort by the middles along an axis, in steps; the order within a step stays.
  void sort(std::size_t k, std::size_t count) {
    constexpr int kStep = 128;
    Index digit[kMost], place[2 * kernels::ShortBox::kMost / kStep + 1] = {};
    for (std::size_t i = 0; i < count; ++i)
      digit[i] = Index((box_[i].least[k] - box_[i].least[4 + k]) / kStep);
    for (std::size_t i = 0; i < count; ++i) ++place[digit[i]];
    Index sum = 0;
    for (Index& p : place) sum = Index(sum + std::exchange(p, sum));
    for (std::size_t i = 0; i < count; ++i) sorted_[k][place[digit[i]]++] = Index(i);
  }

  void halve(std::size_t first, std::size_t count) {
    if (count <= 8) return;
    const std::size_t half = std::bit_ceil(count) / 2, rest = count - half;
    const Index* const orders[3] = {sorted_[0] + first, sorted_[1] + first, sorted_[2] + first};
    const std::size_t axis = kernels::smallest_halves(box_, orders, count, half);
    if (count <= 16) {
      if (axis != 0) std::copy_n(sorted_[axis] + first, count, sorted_[0] + first);
      return;
    }
    for (std::size_t i = 0; i < count; ++i) upper_[sorted_[axis][first + i]] = i >= half;
    for (std::size_t k = 0; k < 3; ++k) {
      if (k == axis) continue;
      Index over[kMost];
      Index* some = sorted_[k] + first;
      std::size_t below = 0;
      for (std::size_t i = 0; i < count; ++i) {
        const Index one = some[i];
        over[i - below] = one;
        some[below] = one;
        below += 1u - upper_[one];
      }
      std::copy_n(over, rest, some + half);
    }
    halve(first, half);
    halve(first + half, rest);
  }

  kernels::ShortBox box_[kMost];  // scaled by the box around all
  Index sorted_[3][kMost];
  std::uint8_t upper_[kMost];
};

}  // namespace

Large<std::uint32_t> order_for_leaves(const Surface& surface, unsigned threads) {
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
        const auto cell = [](double sum) {
          return std::uint32_t(int(std::clamp(sum / (3 * kCell), 0.0, kCells - 1.0)));
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
  Large<std::uint32_t> order(count);
  sched::parallel_for((count + Halves::kMost - 1) / Halves::kMost, threads, [&](std::size_t s) {
    const std::size_t first = s * Halves::kMost, some = std::min(Halves::kMost, count - first);
    for (std::size_t i = first; i < first + some; ++i) order[i] = std::uint32_t(words[i]);
    Halves().order(surface, order.data() + first, some);
  });
  return order;
}

}  // namespace h6::io::bake
