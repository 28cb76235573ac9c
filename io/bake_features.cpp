// bake_features.cpp - which triangle answers for an edge or corner, and what the others that share
// it say about where it may be nearest (see kernels::FacetRegion).
#include <algorithm>

#include "io/bake_grid.h"
#include "sched/parallel_for.h"

namespace h6::io::bake {
namespace {

constexpr std::size_t kSlice = 4096;
constexpr std::uint32_t kLook = 48;  // triangles around a vertex; more are not looked at

Vec3 minus(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
double dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

// The triangles around each vertex, in order. Every thread reads all triangles and takes those at
// its range of vertices.
struct Rings {
  std::vector<std::uint32_t> first;
  Large<std::uint32_t> triangle;
  Rings(const Surface& surface, unsigned threads)
      : first(surface.vertices.size() + 1, 0), triangle(3 * surface.triangles.size()) {
    constexpr std::size_t kRanges = 4;
    const std::size_t vertices = surface.vertices.size();
    const auto corners = [&](auto&& take) {
      sched::parallel_for(kRanges, threads, [&](std::size_t range) {
        const auto low = std::uint32_t(vertices * range / kRanges);
        const auto count = std::uint32_t(vertices * (range + 1) / kRanges) - low;
        for (std::size_t i = surface.triangles.size(); i-- > 0;)
          for (std::uint32_t v : surface.triangles[i])
            if (v - low < count) take(v, std::uint32_t(i));
      });
    };
    corners([&](std::uint32_t v, std::uint32_t) { ++first[v]; });
    std::uint32_t sum = 0;
    for (std::uint32_t& f : first) f = sum += f;  // ends, which go down to starts
    corners([&](std::uint32_t v, std::uint32_t i) { triangle[--first[v]] = i; });
  }
  std::uint32_t count(std::uint32_t v) const { return first[v + 1] - first[v]; }
};

bool has(const std::array<std::uint32_t, 3>& t, std::uint32_t v) {
  return t[0] == v || t[1] == v || t[2] == v;
}

// Into the plane of the triangle, across its edge from a to b; zero when that is rounding.
Features::Gradient inwards(const Surface& surface, std::uint32_t triangle, std::uint32_t a,
                           std::uint32_t b) {
  const auto& t = surface.triangles[triangle];
  std::uint32_t third = t[0];
  for (std::uint32_t v : t)
    if (v != a && v != b) third = v;
  const Vec3 along = minus(surface.vertices[b], surface.vertices[a]);
  Vec3 in = minus(surface.vertices[third], surface.vertices[a]);
  const double slanted2 = dot(in, in), part = dot(in, along) / dot(along, along);
  in = minus(in, {part * along.x, part * along.y, part * along.z});
  const double length = std::sqrt(dot(in, in));
  if (!(length * length > 1e-12 * slanted2) || !(length > 1e-6)) return {};
  return {float(in.x / length), float(in.y / length), float(in.z / length)};
}

// Edge a-b of a triangle: another triangle that has it, if this one answers for it.
void look_at_edge(const Surface& surface, const Rings& rings, std::uint32_t triangle,
                  std::size_t edge, Features& out) {
  const auto& t = surface.triangles[triangle];
  std::uint32_t a = t[edge], b = t[(edge + 1) % 3];
  if (rings.count(b) < rings.count(a)) std::swap(a, b);
  std::uint32_t other = triangle;
  if (rings.count(a) <= kLook)
    for (std::uint32_t i = rings.first[a]; i < rings.first[a + 1]; ++i) {
      const std::uint32_t candidate = rings.triangle[i];
      if (candidate == triangle || !has(surface.triangles[candidate], b)) continue;
      if (candidate < triangle) return;
      other = candidate;
      break;
    }
  out.owned[triangle] |= std::uint8_t(1u << edge);
  if (other != triangle)
    out.across[3 * std::size_t(triangle) + edge] = inwards(surface, other, a, b);
}

// Up to four edges from a vertex that are not the first triangle's own: each next one the one that
// leans away most from those before.
void look_at_corner(const Surface& surface, const Rings& rings, std::uint32_t vertex,
                    Features& out) {
  const std::uint32_t begin = rings.first[vertex];
  const std::uint32_t end = std::min(rings.first[vertex + 1], begin + kLook);
  if (begin == end) return;
  const auto& own = surface.triangles[rings.triangle[begin]];
  const Vec3& p = surface.vertices[vertex];
  std::array<Vec3, 2 * kLook> direction;
  std::array<std::uint32_t, 2 * kLook> end_of;
  std::size_t count = 0;
  Vec3 sum{0, 0, 0};
  for (std::uint32_t i = begin; i < end; ++i)
    for (std::uint32_t v : surface.triangles[rings.triangle[i]]) {
      // Most ends are met twice: what is known is asked before what is long.
      const auto stop = end_of.begin() + std::ptrdiff_t(count);
      if (v == vertex || (i > begin && (has(own, v) || std::find(end_of.begin(), stop, v) != stop)))
        continue;
      Vec3 d = minus(surface.vertices[v], p);
      const double length = std::sqrt(dot(d, d));
      if (!(length > 1e-9)) continue;
      d = {d.x / length, d.y / length, d.z / length};
      if (i == begin) {
        sum = {sum.x + d.x, sum.y + d.y, sum.z + d.z};
      } else {
        direction[count] = d;
        end_of[count++] = v;
      }
    }
  for (std::size_t k = 0; k < 4 && count > 0; ++k) {
    std::size_t best = 0;
    for (std::size_t i = 1; i < count; ++i)
      if (dot(direction[i], sum) < dot(direction[best], sum)) best = i;
    const Vec3 d = direction[best];
    out.from[4 * std::size_t(vertex) + k] = {float(d.x), float(d.y), float(d.z)};
    sum = {sum.x + d.x, sum.y + d.y, sum.z + d.z};
    direction[best] = direction[--count];
  }
}

}  // namespace

void find_features(const Surface& surface, unsigned threads, Features& out) {
  const Rings rings(surface, threads);
  const std::size_t triangles = surface.triangles.size(), vertices = surface.vertices.size();
  out.owned.resize(triangles);
  out.across.resize(3 * triangles);
  out.from.resize(4 * vertices);
  sched::parallel_for((triangles + kSlice - 1) / kSlice, threads, [&](std::size_t s) {
    for (std::size_t t = s * kSlice; t < std::min(triangles, (s + 1) * kSlice); ++t) {
      out.owned[t] = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        out.across[3 * t + k] = {};
        look_at_edge(surface, rings, std::uint32_t(t), k, out);
        const std::uint32_t corner = surface.triangles[t][k];
        if (rings.triangle[rings.first[corner]] == t) out.owned[t] |= std::uint8_t(8u << k);
      }
    }
  });
  sched::parallel_for((vertices + kSlice - 1) / kSlice, threads, [&](std::size_t s) {
    for (std::size_t v = s * kSlice; v < std::min(vertices, (s + 1) * kSlice); ++v) {
      std::fill_n(out.from.begin() + std::ptrdiff_t(4 * v), 4, Features::Gradient{});
      look_at_corner(surface, rings, std::uint32_t(v), out);
    }
  });
}

}  // namespace h6::io::bake
