// SPDX-License-Identifier: Apache-2.0
// features.cpp - which triangle owns an edge or corner, and how the other triangles there bound the
// region in which it can be the nearest (kernels::FacetRegion).
#include <algorithm>

#include "io/bake/grid.h"
#include "sched/parallel_for.h"

namespace h6::io::bake {
namespace {

constexpr std::size_t kSlice = 1024;
constexpr std::uint32_t kLook = 48;  // most triangles considered around a vertex

// The triangles around each vertex, in ascending order. Every thread reads all triangles and takes
// those at its own range of vertices.
struct Rings {
  std::vector<std::uint32_t> first;
  Large<std::uint32_t> triangle;
  Rings(const Surface& surface, unsigned threads)
      : first(surface.vertices.size() + 1, 0), triangle(3 * surface.triangles.size()) {
    const std::size_t ranges = sched::usable_threads(threads);
    const std::size_t vertices = surface.vertices.size();
    const auto corners = [&](auto&& take) {
      sched::parallel_for(ranges, threads, [&](std::size_t range) {
        const auto low = std::uint32_t(vertices * range / ranges);
        const auto count = std::uint32_t(vertices * (range + 1) / ranges) - low;
        for (std::size_t i = surface.triangles.size(); i-- > 0;)
          for (std::uint32_t v : surface.triangles[i])
            if (v - low < count) take(v, std::uint32_t(i));
      });
    };
    corners([&](std::uint32_t v, std::uint32_t) { ++first[v]; });
    std::uint32_t sum = 0;
    for (std::uint32_t& f : first) f = sum += f;  // ends; the next pass lowers them to starts
    corners([&](std::uint32_t v, std::uint32_t i) { triangle[--first[v]] = i; });
  }
  std::uint32_t count(std::uint32_t v) const { return first[v + 1] - first[v]; }
};

// The edges at a vertex, in the order in which its triangles name their other ends.
struct Spokes {
  struct Triangles {
    std::uint32_t first, second;  // the first two triangles of the edge; equal if it has one
  };
  std::size_t count = 0;
  std::array<std::uint32_t, 2 * kLook> end;
  std::array<Triangles, 2 * kLook> of;

  Spokes(const Surface& surface, const Rings& rings, std::uint32_t vertex) {
    const std::uint32_t begin = rings.first[vertex];
    const std::uint32_t stop = std::min(rings.first[vertex + 1], begin + kLook);
    for (std::uint32_t i = begin; i < stop; ++i) {
      const std::uint32_t t = rings.triangle[i];
      for (std::uint32_t v : surface.triangles[t]) {
        if (v == vertex) continue;
        std::size_t k = 0;
        while (k < count && end[k] != v) ++k;
        if (k == count) {
          end[k] = v;
          of[k] = {t, t};
          ++count;
        } else if (of[k].second == of[k].first) {
          of[k].second = t;
        }
      }
    }
  }
};

// The unit vector in the triangle's plane, across its edge from a to b into it; zero where rounding
// decides.
Features::Gradient inwards(const Surface& surface, std::uint32_t triangle, std::uint32_t a,
                           std::uint32_t b) {
  const auto& t = surface.triangles[triangle];
  std::uint32_t third = t[0];
  for (std::uint32_t v : t)
    if (v != a && v != b) third = v;
  const Vec3 along = surface.vertices[b] - surface.vertices[a];
  Vec3 in = surface.vertices[third] - surface.vertices[a];
  const double slanted2 = dot(in, in), part = dot(in, along) / dot(along, along);
  in = in - part * along;
  const double length = std::sqrt(dot(in, in));
  if (!(length * length > 1e-12 * slanted2) || !(length > 1e-6)) return {};
  const double over = 1 / length;
  return {float(in.x * over), float(in.y * over), float(in.z * over)};
}

// The first triangle of an edge owns it. `owned` (3 triangles): whether it owns that edge.
void look_at_edge(const Surface& surface, const Rings& rings, std::uint32_t vertex,
                  std::uint32_t end, const Spokes::Triangles& of, std::vector<std::uint8_t>& owned,
                  Features& out) {
  const auto& t = surface.triangles[of.first];
  std::size_t edge = 0;
  while (!(t[edge] == vertex && t[(edge + 1) % 3] == end) &&
         !(t[edge] == end && t[(edge + 1) % 3] == vertex))
    ++edge;
  std::uint32_t a = t[edge], b = t[(edge + 1) % 3];
  if (rings.count(b) < rings.count(a)) std::swap(a, b);
  const std::size_t at = 3 * std::size_t(of.first) + edge;
  owned[at] = 1;
  out.across[at] = of.second == of.first ? Features::Gradient{} : inwards(surface, of.second, a, b);
}

// Chooses up to four edges from a vertex that the first triangle does not have, each time the one
// that points away most from those before.
void look_at_corner(const Surface& surface, const Spokes& spokes, std::uint32_t vertex,
                    Features& out) {
  const Vec3& p = surface.vertices[vertex];
  std::array<Vec3, 2 * kLook> direction;
  std::size_t count = 0;
  Vec3 sum{0, 0, 0};
  for (std::size_t i = 0; i < spokes.count; ++i) {
    Vec3 d = surface.vertices[spokes.end[i]] - p;
    const double length = std::sqrt(dot(d, d));
    if (!(length > 1e-9)) continue;
    const double over = 1 / length;
    d = over * d;
    if (i < 2)  // an edge of the first triangle
      sum = sum + d;
    else
      direction[count++] = d;
  }
  for (std::size_t k = 0; k < 4; ++k) {
    Features::Gradient& from = out.from[4 * std::size_t(vertex) + k];
    if (count == 0) {
      from = {};
      continue;
    }
    std::size_t best = 0;
    double least = dot(direction[0], sum);
    for (std::size_t i = 1; i < count; ++i)
      if (const double lean = dot(direction[i], sum); lean < least) {
        best = i;
        least = lean;
      }
    const Vec3 d = direction[best];
    from = {float(d.x), float(d.y), float(d.z)};
    sum = sum + d;
    direction[best] = direction[--count];
  }
}

}  // namespace

std::shared_ptr<const Features> find_features(const Surface& surface, unsigned threads) {
  const auto features = std::make_shared<Features>();
  Features& out = *features;
  const Rings rings(surface, threads);
  const std::size_t triangles = surface.triangles.size(), vertices = surface.vertices.size();
  out.owned.resize(triangles);
  out.across.resize(3 * triangles);
  out.from.resize(4 * vertices);
  // Each edge is handled at the end that has fewer triangles around it.
  std::vector<std::uint8_t> owned(3 * triangles, 0);
  sched::parallel_for((vertices + kSlice - 1) / kSlice, threads, [&](std::size_t s) {
    for (std::size_t i = s * kSlice; i < std::min(vertices, (s + 1) * kSlice); ++i) {
      const auto v = std::uint32_t(i);
      const Spokes spokes(surface, rings, v);
      look_at_corner(surface, spokes, v, out);
      const std::uint32_t count = rings.count(v);
      if (count > kLook) continue;
      for (std::size_t k = 0; k < spokes.count; ++k) {
        const std::uint32_t end = spokes.end[k], there = rings.count(end);
        if (count < there || (count == there && v < end))
          look_at_edge(surface, rings, v, end, spokes.of[k], owned, out);
      }
    }
  });
  sched::parallel_for((triangles + kSlice - 1) / kSlice, threads, [&](std::size_t s) {
    for (std::size_t t = s * kSlice; t < std::min(triangles, (s + 1) * kSlice); ++t) {
      const auto& corner = surface.triangles[t];
      std::uint8_t bits = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t at = 3 * t + k;
        // The loop above skipped edges with too many triangles around both ends.
        if (rings.count(corner[k]) > kLook && rings.count(corner[(k + 1) % 3]) > kLook) {
          owned[at] = 1;
          out.across[at] = {};
        }
        bits |= std::uint8_t(owned[at] << k);
        if (rings.triangle[rings.first[corner[k]]] == t) bits |= std::uint8_t(8u << k);
      }
      out.owned[t] = bits;
    }
  });
  return features;
}

}  // namespace h6::io::bake
