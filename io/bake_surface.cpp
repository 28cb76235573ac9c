// bake_surface.cpp - which triangles of a mesh count, whether they close, and the grid around them.
#include <algorithm>
#include <cstdio>

#include "io/bake_grid.h"
#include "sched/parallel_for.h"

namespace h6::io::bake {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

Triangle sorted(Triangle t) {
  std::sort(t.begin(), t.end());
  return t;
}

double dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vec3 sub(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }

// Height over the longest side below 1e-12 of it: rounding, not area.
bool has_area(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 u = sub(b, a), v = sub(c, a), w = sub(c, b);
  const Vec3 n = {u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x};
  const double longest2 = std::max({dot(u, u), dot(v, v), dot(w, w)});
  return dot(n, n) > 1e-24 * longest2 * longest2;
}

// Rows of `count` keyed items gathered by key, in order: a counting sort.
struct Buckets {
  std::vector<std::uint32_t> first, item;
};
template <class Key>
Buckets gather(std::size_t keys, std::size_t count, Key&& key) {
  Buckets b;
  b.first.assign(keys + 1, 0);
  for (std::size_t i = 0; i < count; ++i) ++b.first[key(i) + 1];
  for (std::size_t k = 0; k < keys; ++k) b.first[k + 1] += b.first[k];
  b.item.resize(count);
  std::vector<std::uint32_t> next(b.first.begin(), b.first.end() - 1);
  for (std::size_t i = 0; i < count; ++i) b.item[next[key(i)]++] = static_cast<std::uint32_t>(i);
  return b;
}

// Marks every later copy of a triangle with the same three vertices, in any order.
std::vector<std::uint8_t> find_duplicates(const Mesh& mesh) {
  const std::size_t count = mesh.triangles.size();
  const Buckets by_lowest = gather(mesh.vertices.size(), count, [&](std::size_t i) {
    const Triangle& t = mesh.triangles[i];
    return std::min({t[0], t[1], t[2]});
  });
  std::vector<std::uint8_t> duplicate(count, 0);
  std::vector<std::pair<Triangle, std::uint32_t>> fan;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    fan.clear();
    for (std::uint32_t i = by_lowest.first[v]; i < by_lowest.first[v + 1]; ++i)
      fan.push_back({sorted(mesh.triangles[by_lowest.item[i]]), by_lowest.item[i]});
    std::sort(fan.begin(), fan.end());
    for (std::size_t i = 1; i < fan.size(); ++i)
      if (fan[i].first == fan[i - 1].first) duplicate[fan[i].second] = 1;
  }
  return duplicate;
}

// Flat triangles carry edges too: a T-junction closed by one is closed. Those with two equal
// vertices carry one edge twice, which changes nothing.
void count_edges(const Mesh& mesh, const std::vector<std::uint8_t>& duplicate, Surface& surface) {
  std::vector<std::array<std::uint32_t, 2>> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Triangle& t = mesh.triangles[i];
    if (duplicate[i] || t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
    for (std::size_t k = 0; k < 3; ++k)
      edges.push_back({std::min(t[k], t[(k + 1) % 3]), std::max(t[k], t[(k + 1) % 3])});
  }
  const Buckets by_lowest =
      gather(mesh.vertices.size(), edges.size(), [&](std::size_t i) { return edges[i][0]; });
  std::vector<std::uint32_t> ends;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    ends.clear();
    for (std::uint32_t i = by_lowest.first[v]; i < by_lowest.first[v + 1]; ++i)
      ends.push_back(edges[by_lowest.item[i]][1]);
    std::sort(ends.begin(), ends.end());
    for (std::size_t i = 0, j = 0; i < ends.size(); i = j) {
      while (j < ends.size() && ends[j] == ends[i]) ++j;
      surface.open_edges += (j - i) == 1;
      surface.odd_edges += (j - i) % 2;
    }
  }
  surface.closed = surface.odd_edges == 0;
}

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

}  // namespace

Result<Surface> prepare_surface(const Mesh& mesh) {
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    for (std::uint32_t v : mesh.triangles[i])
      if (v >= mesh.vertices.size())
        return Failure{"triangle " + std::to_string(i) + " names vertex " + std::to_string(v) +
                       ", but the mesh has " + std::to_string(mesh.vertices.size())};
  Surface surface;
  const std::vector<std::uint8_t> duplicate = find_duplicates(mesh);
  count_edges(mesh, duplicate, surface);
  const double huge = std::numeric_limits<double>::max();
  surface.low = {huge, huge, huge};
  surface.high = {-huge, -huge, -huge};
  const bool parts = mesh.part.size() == mesh.triangles.size();
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (duplicate[i]) {
      ++surface.duplicates;
      continue;
    }
    const Triangle& t = mesh.triangles[i];
    const Vec3 corner[3] = {mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]};
    for (const Vec3& p : corner)
      if (!std::isfinite(p.x + p.y + p.z))
        return Failure{"triangle " + std::to_string(i) + " has a coordinate that is not finite"};
    if (!has_area(corner[0], corner[1], corner[2])) {
      ++surface.flat;
      continue;
    }
    for (const Vec3& p : corner) {
      surface.low = {std::min(surface.low.x, p.x), std::min(surface.low.y, p.y),
                     std::min(surface.low.z, p.z)};
      surface.high = {std::max(surface.high.x, p.x), std::max(surface.high.y, p.y),
                      std::max(surface.high.z, p.z)};
    }
    surface.triangles.push_back(t);
    surface.source.push_back(std::int32_t(i));
    if (parts) surface.part.push_back(mesh.part[i]);
  }
  if (surface.triangles.empty())
    return Failure{"the mesh has no triangle with area: there is nothing to make a field of"};
  surface.vertices = mesh.vertices;
  return surface;
}

// The longest side gets `voxels` nodes. Around the mesh stay the wanted padding and never less than
// the band, the offset and two voxels: the border of the grid is outside for certain.
Result<Grid> choose_grid(const Surface& surface, const FieldBake& options, bool sealed) {
  if (options.voxel_size <= 0 && (options.voxels < 16 || options.voxels > 2048))
    return Failure{"a field takes 16 to 2048 voxels on its longest side, not " +
                   std::to_string(options.voxels)};
  if (!(options.voxel_size >= 0) || !std::isfinite(options.voxel_size))
    return Failure{"the voxel size must be a positive length"};
  if (!(options.band_voxels >= 1) || options.band_voxels > 8)
    return Failure{"the band must be 1 to 8 voxels wide, not " + number(options.band_voxels)};
  if (options.padding_voxels < 0 || options.padding_voxels > 512)
    return Failure{"the padding must be 0 to 512 voxels, not " +
                   std::to_string(options.padding_voxels)};
  if (!(options.seal >= 0) || !std::isfinite(options.seal))
    return Failure{"the width of holes to seal must be a length, or 0 for none"};
  if (!std::isfinite(options.offset)) return Failure{"the offset must be a length, or -1 for auto"};

  Grid grid;
  grid.band = options.band_voxels;
  grid.centre = {0.5 * surface.low.x + 0.5 * surface.high.x,
                 0.5 * surface.low.y + 0.5 * surface.high.y,
                 0.5 * surface.low.z + 0.5 * surface.high.z};
  const double side[3] = {surface.high.x - surface.low.x, surface.high.y - surface.low.y,
                          surface.high.z - surface.low.z};
  const double longest = std::max({side[0], side[1], side[2]});
  const bool automatic = options.offset < 0;
  const double auto_offset = sealed ? 0.0 : 0.9;  // [voxel]
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
  grid.offset = automatic ? auto_offset : options.offset / grid.voxel;
  if (grid.offset > 64)
    return Failure{"the offset of " + number(options.offset) + " m is " + number(grid.offset) +
                   " voxels; at most 64 are possible: choose larger voxels"};
  grid.seal = seal / grid.voxel;
  if (grid.seal > 0 && grid.offset < 0.6)
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

void to_grid(Surface& surface, const Grid& grid, unsigned threads) {
  constexpr std::size_t kSlice = 16384;
  sched::parallel_for((surface.vertices.size() + kSlice - 1) / kSlice, threads, [&](std::size_t s) {
    const std::size_t end = std::min(surface.vertices.size(), (s + 1) * kSlice);
    for (std::size_t i = s * kSlice; i < end; ++i)
      surface.vertices[i] = grid.from_metres(surface.vertices[i]);
  });
}

}  // namespace h6::io::bake
