// SPDX-License-Identifier: Apache-2.0
// inner_faces.cpp - see inner_faces.h.
#include "io/check/inner_faces.h"

#include <map>
#include <numeric>
#include <utility>

namespace h6::io {
namespace {

using Triangle = std::array<std::uint32_t, 3>;
using Edge = std::pair<std::uint32_t, std::uint32_t>;

struct Turned {
  Triangle corners;  // ascending
  bool odd;          // wound against that order
  std::uint32_t triangle;
};

Turned turned(const Triangle& t, std::uint32_t i) {
  Turned out{t, false, i};
  auto& c = out.corners;
  for (const auto& [a, b] : {std::pair{0, 1}, {1, 2}, {0, 1}})
    if (c[std::size_t(a)] > c[std::size_t(b)])
      std::swap(c[std::size_t(a)], c[std::size_t(b)]), out.odd = !out.odd;
  return out;
}

std::array<Edge, 3> edges(const Triangle& c) {  // of ascending corners
  return {Edge{c[0], c[1]}, {c[1], c[2]}, {c[0], c[2]}};
}

// Marks the triangles that have as many twins of their winding as of the other, and lists each set
// of corners once.
std::vector<Triangle> mark_pairs(const Mesh& mesh, std::vector<char>& paired) {
  std::vector<Turned> all;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i)
    all.push_back(turned(mesh.triangles[i], i));
  std::sort(all.begin(), all.end(),
            [](const Turned& a, const Turned& b) { return a.corners < b.corners; });
  std::vector<Triangle> pairs;
  for (std::size_t i = 0, end; i < all.size(); i = end) {
    int sum = 0;
    for (end = i; end < all.size() && all[end].corners == all[i].corners; ++end)
      sum += all[end].odd ? 1 : -1;
    if (sum != 0 || all[i].corners[0] == all[i].corners[1]) continue;
    for (std::size_t k = i; k < end; ++k) paired[all[k].triangle] = 1;
    pairs.push_back(all[i].corners);
  }
  return pairs;
}

struct Around {
  std::size_t others = 0;  // faces at this edge that are not paired
  std::vector<std::size_t> pairs{};
};

std::size_t root(std::vector<std::size_t>& parent, std::size_t i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

// For each pair whether its region lies between solids.
std::vector<char> between_solids(const std::vector<Triangle>& pairs,
                                 std::map<Edge, Around>& around) {
  std::vector<std::size_t> parent(pairs.size());
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  for (const auto& [edge, a] : around)
    for (const std::size_t p : a.pairs) parent[root(parent, p)] = root(parent, a.pairs[0]);
  std::vector<char> border(pairs.size()), goes_on(pairs.size()), inner(pairs.size());
  for (const auto& [edge, a] : around) {
    const std::size_t region = root(parent, a.pairs[0]);
    if (a.others > 0)
      goes_on[region] = 1;
    else if (a.pairs.size() == 1)
      border[region] = 1;
  }
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const std::size_t region = root(parent, i);
    inner[i] = goes_on[region] && !border[region];
  }
  return inner;
}

}  // namespace

Mesh without_inner_faces(const Mesh& mesh) {
  std::vector<char> paired(mesh.triangles.size());
  const std::vector<Triangle> pairs = mark_pairs(mesh, paired);
  if (pairs.empty()) return mesh;
  std::map<Edge, Around> around;
  for (std::size_t i = 0; i < pairs.size(); ++i)
    for (const Edge& e : edges(pairs[i])) around[e].pairs.push_back(i);
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    if (paired[i]) continue;
    for (const Edge& e : edges(turned(mesh.triangles[i], i).corners))
      if (const auto found = around.find(e); found != around.end()) ++found->second.others;
  }
  const std::vector<char> inner = between_solids(pairs, around);
  Mesh out;
  out.vertices = mesh.vertices;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    if (paired[i]) {
      const Triangle corners = turned(mesh.triangles[i], i).corners;
      const auto at = std::lower_bound(pairs.begin(), pairs.end(), corners);
      if (inner[std::size_t(at - pairs.begin())]) continue;
    }
    out.triangles.push_back(mesh.triangles[i]);
  }
  return out;
}

}  // namespace h6::io
