// SPDX-License-Identifier: Apache-2.0
// surface.cpp - the triangles that count, whether they close, and the grid around them.
#include <algorithm>
#include <cstdio>
#include <utility>

#include "io/bake/grid.h"
#include "io/field/refine.h"
#include "sched/parallel_for.h"

namespace h6::io::bake {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

Triangle sorted(Triangle t) {
  std::sort(t.begin(), t.end());
  return t;
}

// A height below 1e-12 of the longest side is rounding, not area.
bool has_area(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 u = b - a, v = c - a, w = c - b;
  const Vec3 n = cross(u, v);
  const double longest2 = std::max({dot(u, u), dot(v, v), dot(w, w)});
  return dot(n, n) > 1e-24 * longest2 * longest2;
}

constexpr std::size_t kSlice = 16384;  // triangles
std::size_t slices_of(std::size_t count) { return (count + kSlice - 1) / kSlice; }

// Calls body(slice, i) for every triangle, slices in parallel.
template <class F>
void each_triangle(std::size_t count, unsigned threads, F&& body) {
  sched::parallel_for(slices_of(count), threads, [&](std::size_t s) {
    for (std::size_t i = s * kSlice; i < std::min(count, (s + 1) * kSlice); ++i) body(s, i);
  });
}

struct Item {
  std::uint32_t vertex, what;
};

// Calls `each(range, vertex, begin, end)` for the items of every vertex that has some, in the order
// of triangles. Ranges of vertices, which fit the cache, run in parallel. `make(i, add)` calls
// add(item) for the items of triangle i; it is called twice and must repeat itself.
constexpr std::size_t kRanges = 128;
template <class Make, class Each>
void by_vertex(std::size_t vertices, std::size_t triangles, unsigned threads, Make&& make,
               Each&& each) {
  const std::size_t wide = std::max<std::size_t>(1, (vertices + kRanges - 1) / kRanges);
  const auto shift = std::uint32_t(std::bit_width(wide - 1));  // ranges of a power of two
  const std::size_t slices = slices_of(triangles);
  std::vector<std::array<std::size_t, kRanges>> place(slices);
  sched::parallel_for(slices, threads, [&](std::size_t s) {
    place[s].fill(0);
    for (std::size_t i = s * kSlice; i < std::min(triangles, (s + 1) * kSlice); ++i)
      make(i, [&](const Item& item) { ++place[s][item.vertex >> shift]; });
  });
  std::array<std::size_t, kRanges + 1> first{};
  std::size_t total = 0;
  for (std::size_t k = 0; k < kRanges; ++k) {
    first[k] = total;
    for (auto& of_slice : place) total += std::exchange(of_slice[k], total);
  }
  first[kRanges] = total;
  Large<Item> items(total);
  sched::parallel_for(slices, threads, [&](std::size_t s) {
    for (std::size_t i = s * kSlice; i < std::min(triangles, (s + 1) * kSlice); ++i)
      make(i, [&](const Item& item) { items[place[s][item.vertex >> shift]++] = item; });
  });
  sched::parallel_for(kRanges, threads, [&](std::size_t k) {
    std::vector<std::uint32_t> next((std::size_t{1} << shift) + 1, 0),
        sorted(first[k + 1] - first[k]);
    const std::uint32_t low = std::uint32_t(k << shift);
    for (std::size_t i = first[k]; i < first[k + 1]; ++i) ++next[items[i].vertex - low + 1];
    for (std::size_t v = 1; v < next.size(); ++v) next[v] += next[v - 1];
    for (std::size_t i = first[k]; i < first[k + 1]; ++i)
      sorted[next[items[i].vertex - low]++] = items[i].what;
    std::uint32_t begin = 0;
    for (std::size_t v = 0; v + 1 < next.size(); ++v) {
      if (next[v] != begin) each(k, low + v, sorted.data() + begin, sorted.data() + next[v]);
      begin = next[v];
    }
  });
}

// Marks every later copy of a triangle with the same three vertices, in any order.
std::vector<std::uint8_t> find_duplicates(const Mesh& mesh, unsigned threads) {
  const std::size_t count = mesh.triangles.size();
  std::vector<std::uint8_t> duplicate(count, 0);
  const auto lowest = [&](std::size_t i, auto&& add) {
    const Triangle& t = mesh.triangles[i];
    add(Item{std::min({t[0], t[1], t[2]}), std::uint32_t(i)});
  };
  by_vertex(mesh.vertices.size(), count, threads, lowest,
            [&](std::size_t, std::size_t, const std::uint32_t* begin, const std::uint32_t* end) {
              if (end - begin < 2) return;
              thread_local std::vector<std::pair<Triangle, std::uint32_t>> fan;
              fan.clear();
              for (; begin != end; ++begin) fan.push_back({sorted(mesh.triangles[*begin]), *begin});
              std::sort(fan.begin(), fan.end());
              for (std::size_t i = 1; i < fan.size(); ++i)
                if (fan[i].first == fan[i - 1].first) duplicate[fan[i].second] = 1;
            });
  return duplicate;
}

// Flat triangles count too, since one may close a T-junction. Triangles with two equal vertices
// have one edge twice, which changes nothing.
void count_edges(const Mesh& mesh, const std::vector<std::uint8_t>& duplicate, unsigned threads,
                 Surface& surface) {
  struct alignas(64) Count {
    std::size_t open = 0, odd = 0;
    std::vector<std::array<std::uint32_t, 2>> edges;
  };
  std::array<Count, kRanges> found;
  const auto edges = [&](std::size_t i, auto&& add) {
    const Triangle& t = mesh.triangles[i];
    if (duplicate[i] || t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) return;
    for (std::size_t k = 0; k < 3; ++k)
      add(Item{std::min(t[k], t[(k + 1) % 3]), std::max(t[k], t[(k + 1) % 3])});
  };
  by_vertex(mesh.vertices.size(), mesh.triangles.size(), threads, edges,
            [&](std::size_t range, std::size_t vertex, std::uint32_t* begin, std::uint32_t* end) {
              std::sort(begin, end);
              for (std::uint32_t* next; begin != end; begin = next) {
                next = std::find_if(begin, end, [&](std::uint32_t v) { return v != *begin; });
                found[range].open += next - begin == 1;
                if ((next - begin) % 2 == 0) continue;
                ++found[range].odd;
                found[range].edges.push_back({std::uint32_t(vertex), *begin});
              }
            });
  for (const Count& c : found) {
    surface.open_edges += c.open;
    surface.odd_edges += c.odd;
    surface.odd.insert(surface.odd.end(), c.edges.begin(), c.edges.end());
  }
  surface.closed = surface.odd_edges == 0;
}

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

constexpr std::size_t kNone = ~std::size_t{0};
constexpr double kHuge = std::numeric_limits<double>::max();

Outcome check_indices(const Mesh& mesh, unsigned threads) {
  const std::size_t count = mesh.triangles.size();
  std::vector<std::size_t> bad(slices_of(count), kNone);  // the first triangle of each slice
  each_triangle(count, threads, [&](std::size_t s, std::size_t i) {
    for (std::uint32_t v : mesh.triangles[i])
      if (v >= mesh.vertices.size()) bad[s] = std::min(bad[s], i);
  });
  const auto first = std::find_if(bad.begin(), bad.end(), [](std::size_t i) { return i != kNone; });
  if (first == bad.end()) return Done{};
  const auto vertex = *std::find_if(mesh.triangles[*first].begin(), mesh.triangles[*first].end(),
                                    [&](std::uint32_t v) { return v >= mesh.vertices.size(); });
  return Failure{"triangle " + std::to_string(*first) + " names vertex " + std::to_string(vertex) +
                 ", but the mesh has " + std::to_string(mesh.vertices.size())};
}

// The findings in a slice of triangles.
struct Slice {
  std::size_t not_finite = kNone;  // first triangle with such a coordinate
  std::size_t duplicates = 0, kept = 0;
  std::vector<Triangle> flat;
  double low[3] = {kHuge, kHuge, kHuge}, high[3] = {-kHuge, -kHuge, -kHuge};
};

// Sets `keep` (triangles) to 1 for triangles that are neither duplicates nor flat.
std::vector<Slice> sift(const Mesh& mesh, const std::vector<std::uint8_t>& duplicate,
                        unsigned threads, std::vector<std::uint8_t>& keep) {
  std::vector<Slice> slices(slices_of(mesh.triangles.size()));
  each_triangle(mesh.triangles.size(), threads, [&](std::size_t s, std::size_t i) {
    Slice& slice = slices[s];
    if (duplicate[i]) {
      ++slice.duplicates;
      return;
    }
    const Triangle& t = mesh.triangles[i];
    const Vec3 corner[3] = {mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]};
    for (const Vec3& p : corner)
      if (!std::isfinite(p.x + p.y + p.z)) slice.not_finite = std::min(slice.not_finite, i);
    if (!has_area(corner[0], corner[1], corner[2])) {
      slice.flat.push_back(t);
      return;
    }
    for (const Vec3& p : corner) {
      const double at[3] = {p.x, p.y, p.z};
      for (std::size_t k = 0; k < 3; ++k) {
        slice.low[k] = std::min(slice.low[k], at[k]);
        slice.high[k] = std::max(slice.high[k], at[k]);
      }
    }
    keep[i] = 1;
    ++slice.kept;
  });
  return slices;
}

}  // namespace

Result<Surface> prepare_surface(const Mesh& mesh, unsigned threads) {
  if (const Outcome fine = check_indices(mesh, threads); !fine) return fine.failure();
  Surface surface;
  const std::vector<std::uint8_t> duplicate = find_duplicates(mesh, threads);
  count_edges(mesh, duplicate, threads, surface);
  std::vector<std::uint8_t> keep(mesh.triangles.size(), 0);
  std::vector<Slice> slices = sift(mesh, duplicate, threads, keep);
  std::size_t kept = 0;
  double low[3] = {kHuge, kHuge, kHuge}, high[3] = {-kHuge, -kHuge, -kHuge};
  for (Slice& slice : slices) {
    if (slice.not_finite != kNone)
      return Failure{"triangle " + std::to_string(slice.not_finite) +
                     " has a coordinate that is not finite"};
    surface.duplicates += slice.duplicates;
    surface.flat.insert(surface.flat.end(), slice.flat.begin(), slice.flat.end());
    kept += std::exchange(slice.kept, kept);  // from here on: place of its first triangle
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], slice.low[k]);
      high[k] = std::max(high[k], slice.high[k]);
    }
  }
  if (kept == 0)
    return Failure{"the mesh has no triangle with area: there is nothing to make a field of"};
  surface.low = {low[0], low[1], low[2]};
  surface.high = {high[0], high[1], high[2]};
  const bool parts = mesh.part.size() == mesh.triangles.size();
  surface.triangles.resize(kept);
  surface.source.resize(kept);
  if (parts) surface.part.resize(kept);
  each_triangle(mesh.triangles.size(), threads, [&](std::size_t s, std::size_t i) {
    if (!keep[i]) return;
    const std::size_t to = slices[s].kept++;
    surface.triangles[to] = mesh.triangles[i];
    surface.source[to] = std::int32_t(i);
    if (parts) surface.part[to] = mesh.part[i];
  });
  surface.vertices.resize(mesh.vertices.size());
  sched::parallel_for(slices_of(mesh.vertices.size()), threads, [&](std::size_t s) {
    const std::size_t begin = s * kSlice, end = std::min(mesh.vertices.size(), begin + kSlice);
    std::copy(mesh.vertices.begin() + std::ptrdiff_t(begin),
              mesh.vertices.begin() + std::ptrdiff_t(end),
              surface.vertices.begin() + std::ptrdiff_t(begin));
  });
  return surface;
}

// The longest side gets `voxels` nodes. The padding around the mesh is at least band + offset + two
// voxels, so that the border of the grid is certainly outside.
Result<Grid> choose_grid(const Surface& surface, const FieldBake& options, bool sealed) {
  if (options.voxel_size <= 0 && (options.voxels < 16 || options.voxels > 2048))
    return Failure{"a field takes 16 to 2048 voxels on its longest side, not " +
                   std::to_string(options.voxels)};
  if (!(options.voxel_size >= 0) || !std::isfinite(options.voxel_size))
    return Failure{"the voxel size must be a positive length"};
  if (!(options.band_voxels >= 1) || options.band_voxels > kWidestBand)
    return Failure{"the band must be 1 to 8 voxels wide, not " + number(options.band_voxels)};
  if (options.padding_voxels < 0 || options.padding_voxels > 512)
    return Failure{"the padding must be 0 to 512 voxels, not " +
                   std::to_string(options.padding_voxels)};
  if (!(options.seal >= 0) || !std::isfinite(options.seal))
    return Failure{"the width of holes to seal must be a length, or 0 for none"};
  if (!std::isfinite(options.offset)) return Failure{"the offset must be a length, or -1 for auto"};
  for (const double s : {options.shift.x, options.shift.y, options.shift.z})
    if (!(std::abs(s) <= 0.5))
      return Failure{"the nodes move by at most half a voxel, not by " + number(s)};

  Grid grid;
  grid.band = options.band_voxels;
  grid.centre = {0.5 * surface.low.x + 0.5 * surface.high.x,
                 0.5 * surface.low.y + 0.5 * surface.high.y,
                 0.5 * surface.low.z + 0.5 * surface.high.z};
  const double side[3] = {surface.high.x - surface.low.x, surface.high.y - surface.low.y,
                          surface.high.z - surface.low.z};
  const double longest = std::max({side[0], side[1], side[2]});
  const bool automatic = options.offset < 0;
  const bool winding = options.sign == SignMode::winding;
  const double auto_offset = sealed || winding ? 0.0 : 0.9;  // [voxel]
  const double margin = grid.band + 2 + (automatic ? auto_offset : 0.0);
  const double extra = automatic ? 0.0 : options.offset;  // [m], on each side
  const double seal = sealed ? 0.0 : options.seal;        // [m]; a ball of it passes all around
  double padding = options.padding_voxels;
  if (options.voxel_size > 0) {
    grid.voxel = options.voxel_size;
    padding = std::max({padding, margin + extra / grid.voxel, 0.5 * seal / grid.voxel + 2});
  } else {
    const double n = options.voxels;
    padding = std::max(std::min(padding, n / 4), margin);
    grid.voxel = std::max({longest / (n - 2 * padding), (longest + 2 * extra) / (n - 2 * margin),
                           (longest + seal) / (n - 4)});
    padding = std::max({padding, margin + extra / grid.voxel, 0.5 * seal / grid.voxel + 2});
  }
  if (norm(options.shift) > 0) padding += 0.5;
  grid.centre = grid.centre + grid.voxel * options.shift;
  grid.offset = automatic ? auto_offset : options.offset / grid.voxel;
  if (grid.offset > 64)
    return Failure{"the offset of " + number(options.offset) + " m is " + number(grid.offset) +
                   " voxels; at most 64 are possible: choose larger voxels"};
  grid.seal = seal / grid.voxel;
  if (grid.seal > 0 && grid.offset < 0.6 && !winding)
    return Failure{"sealing holes needs an offset of at least 0.6 voxel (" +
                   number(0.6 * grid.voxel) + " m)"};
  if (grid.seal > 32)
    return Failure{"holes of " + number(options.seal) + " m are " + number(grid.seal) +
                   " voxels wide; at most 32 can be sealed: choose larger voxels"};
  for (std::size_t k = 0; k < 3; ++k) {
    const double nodes = side[k] / grid.voxel + 2 * padding;
    if (!(nodes <= 2048 + 1e-6)) {
      const double room = 2048 - 2 * std::max(double(options.padding_voxels), margin);
      return Failure{"voxels of " + number(grid.voxel) + " m make " + number(nodes) +
                     " nodes on a side, 2048 are possible: choose at least " +
                     number(1.001 * (longest + 2 * extra) / room) + " m"};
    }
    grid.bricks[k] = std::max(1, int(std::ceil(nodes / 8 - 1e-9)));
  }
  return grid;
}

Result<GridLevels> choose_grids(const Surface& surface, const FieldBake& options, bool sealed) {
  const double voxel = kFinest * options.tolerance;  // the fine one
  constexpr double kMost = 8 * kMaxBricksOnSide;
  const auto too_fine = [&](double side) {  // [m]
    char text[200];
    std::snprintf(text, sizeof text,
                  "a tolerance of %.4g m takes %.4g nodes on a side, %.0f are possible: choose at "
                  "least %.4g m",
                  options.tolerance, side / voxel, kMost, 1.1 * side / (kFinest * kMost));
    return Failure{text};
  };
  const Vec3 size = surface.high - surface.low;
  const double longest = std::max({size.x, size.y, size.z});
  if (longest / voxel > kMost) return too_fine(longest);
  FieldBake o = options;
  o.voxel_size = kCut * voxel;
  const bool winding = options.sign == SignMode::winding;
  if (o.offset < 0) o.offset = sealed || winding ? 0 : 0.9 * voxel;
  // Holes are sealed on the fine grid; the coarse one only makes room for it.
  o.seal = 0;
  if (!sealed && options.seal > 0)
    o.padding_voxels += int(std::min(64.0, std::ceil(options.seal / o.voxel_size))) + 2;
  Result<Grid> coarse = choose_grid(surface, o, sealed);
  if (!coarse) return coarse.failure();
  const Vec3 origin = coarse->origin();
  // The grid that begins at the same node, with `cut` voxels to a coarse one.
  const auto finer = [&](int cut) {
    Grid grid = *coarse;
    grid.voxel = o.voxel_size / cut;
    for (std::size_t k = 0; k < 3; ++k) grid.bricks[k] = cut * coarse->bricks[k];
    grid.centre = {origin.x + grid.voxel * grid.middle(0), origin.y + grid.voxel * grid.middle(1),
                   origin.z + grid.voxel * grid.middle(2)};
    grid.band = std::min(1.5 * cut, cut * coarse->band);
    if (cut < kCut) grid.beyond = 1;  // these distances only tell where finer ones are needed
    grid.offset = cut * coarse->offset;
    return grid;
  };
  GridLevels levels{*coarse, finer(kCut / 2), finer(kCut)};
  const auto& bricks = levels.fine.bricks;
  const int most = *std::max_element(bricks.begin(), bricks.end());
  if (most > kMaxBricksOnSide) return too_fine(8 * most * voxel);
  Grid& fine = levels.fine;
  fine.seal = sealed ? 0 : options.seal / voxel;
  if (fine.seal > 32 || (fine.seal > 0 && fine.offset < 0.6 && !winding)) {
    char text[200];
    std::snprintf(text, sizeof text,
                  "with a tolerance of %.4g m, holes up to %.4g m can be sealed, with an offset of "
                  "at least %.4g m",
                  options.tolerance, 32 * voxel, 0.6 * voxel);
    return Failure{text};
  }
  return levels;
}

Result<double> finest_voxel(const Surface& surface, const FieldBake& options) {
  if (options.tolerance > 0) return kFinest * options.tolerance;
  const Result<Grid> grid = choose_grid(surface, options, true);
  if (!grid) return grid.failure();
  return grid->voxel;
}

void to_grid(Surface& surface, const Grid& grid, unsigned threads) {
  sched::parallel_for((surface.vertices.size() + kSlice - 1) / kSlice, threads, [&](std::size_t s) {
    const std::size_t end = std::min(surface.vertices.size(), (s + 1) * kSlice);
    for (std::size_t i = s * kSlice; i < end; ++i)
      surface.vertices[i] = grid.from_metres(surface.vertices[i]);
  });
}

}  // namespace h6::io::bake
