// SPDX-License-Identifier: Apache-2.0
#include "io/shell/creases.h"

#include <algorithm>
#include <cmath>

#include "io/file/radix_sort.h"
#include "io/mesh/weld.h"

namespace h6::io {
namespace {

constexpr double kCrease = 0.8660;  // cosine of 30 degrees
constexpr double kOwn = 0.5;        // of 60: a face this far from a ridge's own normal is kept, too
constexpr double kAlike = 0.9397;   // of 20: such normals count as one

using Normals = std::vector<Vec3>;

void add_distinct(const Vec3& n, Normals& to) {
  for (const Vec3& known : to)
    if (dot(known, n) > kAlike) return;
  to.push_back(n);
}

// The direction of a sum; zero where it cancels.
Vec3 direction(const Vec3& sum) {
  const double length = norm(sum);
  return length > 1e-6 ? (1 / length) * sum : Vec3{0, 0, 0};
}
Vec3 mean_of(const Normals& normals) {
  Vec3 sum{};
  for (const Vec3& n : normals) sum = sum + n;
  return direction(sum);
}

class CreaseFinder {
 public:
  CreaseFinder(const Mesh& mesh, const FaceTable& faces, const Reach& reach, double spacing,
               double tolerance, Pulse& pulse)
      : mesh_(mesh),
        faces_(faces),
        reach_(reach),
        spacing_(spacing),
        tolerance_(tolerance),
        pulse_(pulse) {}

  Creases run() {
    out_.first.push_back(0);
    index();
    for (std::size_t t = 0; t < mesh_.triangles.size() && pulse_.alive(); ++t) face(t);
    for (std::size_t i = 0; i < edges_.size() && pulse_.alive();) {
      std::size_t end = i;
      while (end < edges_.size() && edges_[end].key == edges_[i].key) ++end;
      edge(i, end);
      i = end;
    }
    for (std::uint32_t v = 0; v + 1 < first_face_.size() && pulse_.alive(); ++v) vertex(v);
    return std::move(out_);
  }

 private:
  // The creases that end at a vertex.
  struct Ends {
    std::uint32_t count = 0;
    Vec3 way[2] = {};  // of the first two, away from the vertex
    Vec3 into{};       // the sheet, at its rim
  };

  void index() {
    const Welded welded =
        weld_points(mesh_.vertices.size(), mesh_.vertices.size(),
                    [&](std::size_t i) { return without_minus_zero(mesh_.vertices[i]); });
    place_ = welded.vertices;
    corner_.resize(mesh_.triangles.size());
    first_face_.assign(place_.size() + 1, 0);
    for (std::uint32_t t = 0; t < corner_.size(); ++t) {
      for (std::size_t k = 0; k < 3; ++k) corner_[t][k] = welded.index[mesh_.triangles[t][k]];
      if (faces_.area[t] == 0) continue;
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t a = corner_[t][k], b = corner_[t][(k + 1) % 3];
        edges_.push_back({(std::uint64_t(std::min(a, b)) << 32) | std::max(a, b), 3 * t + k});
        ++first_face_[a + 1];
      }
    }
    for (std::size_t v = 0; v < place_.size(); ++v) first_face_[v + 1] += first_face_[v];
    face_at_.resize(first_face_.back());
    std::vector<std::uint32_t> next(first_face_.begin(), first_face_.end() - 1);
    for (std::uint32_t t = 0; t < corner_.size(); ++t)
      if (faces_.area[t] > 0)
        for (const std::uint32_t v : corner_[t]) face_at_[next[v]++] = t;
    KeyedIndices spare;
    radix_sort(edges_, spare, 0, &pulse_);
    ends_.resize(place_.size());
  }

  bool is_reached(const Vec3& p, const Vec3& inward) const {
    return reach_.field == nullptr || !reach_.hide || reached(reach_, p, -inward);
  }
  void put(const Vec3& p, const Vec3& inward, std::uint32_t triangle, Candidates& to) const {
    to.points.push_back({{float(p.x), float(p.y), float(p.z)},
                         {float(inward.x), float(inward.y), float(inward.z)}});
    to.source.push_back(triangle);
  }
  void put_ridge(const Vec3& p, const Vec3& own, std::uint32_t triangle, std::uint32_t ridge,
                 Creases::Places& to) const {
    if (!is_reached(p, own)) return;
    put(p, own, triangle, to.of);
    to.ridge.push_back(ridge);
  }
  std::uint32_t add_ridge(const Vec3& own, const Normals& normals) {
    for (const Vec3& n : normals)
      if (dot(n, own) < kOwn) out_.normals.push_back(n);
    out_.first.push_back(std::uint32_t(out_.normals.size()));
    return std::uint32_t(out_.first.size() - 2);
  }

  // All places of a triangle stand out as far along its normal, so one candidate tells for all.
  void face(std::size_t t) {
    if (faces_.area[t] == 0) return;
    const auto& c = corner_[t];
    const Vec3 middle = (1.0 / 3) * (place_[c[0]] + place_[c[1]] + place_[c[2]]);
    const Vec3& n = faces_.inward[t];
    for (const double sign : {1.0, -1.0}) {
      if (sign < 0 && !faces_.sheet[t]) continue;
      if (is_reached(middle, sign * n)) put(middle, sign * n, std::uint32_t(t), out_.faces);
    }
  }

  void edge(std::size_t begin, std::size_t end) {
    const std::uint32_t t = edges_[begin].index / 3, k = edges_[begin].index % 3;
    const std::uint32_t a = corner_[t][k], b = corner_[t][(k + 1) % 3];
    if (end - begin == 2 && !is_crease(begin)) return blunt(begin, a, b);
    Normals normals;
    for (std::size_t i = begin; i < end; ++i)
      add_distinct(faces_.inward[edges_[i].index / 3], normals);
    const Vec3 way = direction(place_[b] - place_[a]);
    note(a, way);
    note(b, -way);
    if (!faces_.sheet[t]) return line(a, b, mean_of(normals), normals, t);
    if (end - begin == 1) {  // the rim of a sheet
      const Vec3 into = rim(t, k);
      ends_[a].into = ends_[a].into + into;
      ends_[b].into = ends_[b].into + into;
      normals.push_back(-normals[0]);
      return line(a, b, into, normals, t);
    }
    const Vec3 own = mean_of(normals);
    line(a, b, own, normals, t);
    for (Vec3& n : normals) n = -n;
    line(a, b, -own, normals, t);
  }

  bool is_crease(std::size_t pair) const {
    return dot(faces_.inward[edges_[pair].index / 3], faces_.inward[edges_[pair + 1].index / 3]) <
           kCrease;
  }

  // From the middle of an edge of triangle t into the triangle, in its plane.
  Vec3 rim(std::uint32_t t, std::uint32_t k) const {
    const Vec3 &a = place_[corner_[t][k]], &b = place_[corner_[t][(k + 1) % 3]],
               &c = place_[corner_[t][(k + 2) % 3]];
    const Vec3 side = b - a;
    return direction(c - a - (dot(c - a, side) / dot(side, side)) * side);
  }

  void note(std::uint32_t vertex, const Vec3& way) {
    Ends& e = ends_[vertex];
    if (e.count < 2) e.way[e.count] = way;
    ++e.count;
  }

  template <class Put>
  void along(std::uint32_t a, std::uint32_t b, const Put& at) const {
    const Vec3 side = place_[b] - place_[a];
    const int pieces = int(std::min(1e6, std::ceil(norm(side) / (spacing_ / 4))));
    for (int i = 0; i <= pieces; ++i) at(place_[a] + (double(i) / std::max(1, pieces)) * side);
  }

  void line(std::uint32_t a, std::uint32_t b, const Vec3& own, const Normals& normals,
            std::uint32_t t) {
    if (norm(own) == 0) return;
    const std::uint32_t ridge = add_ridge(own, normals);
    along(a, b, [&](const Vec3& p) { put_ridge(p, own, t, ridge, out_.edges); });
  }

  // An edge of two faces that turn little. Where it is convex, places on it stand out farther along
  // the mean of both normals than places of its faces.
  void blunt(std::size_t pair, std::uint32_t a, std::uint32_t b) {
    const std::uint32_t t = edges_[pair].index / 3, u = edges_[pair + 1].index / 3;
    const Vec3 &n = faces_.inward[t], &m = faces_.inward[u];
    const double turn = norm(n - m) / 2;  // sine of half the angle
    if (turn * spacing_ <= tolerance_) return;
    const Vec3& beyond = place_[corner_[u][(edges_[pair + 1].index % 3 + 2) % 3]];
    const double side = dot(n, beyond - place_[a]);  // > 0: it lies behind the other's face
    const Vec3 own = direction(n + m);
    for (const double sign : {1.0, -1.0}) {
      if (sign < 0 && !faces_.sheet[t]) continue;
      if (sign * side <= 0) continue;
      along(a, b, [&](const Vec3& p) {
        if (is_reached(p, sign * own)) put(p, sign * own, t, out_.faces);
      });
    }
  }

  void vertex(std::uint32_t v) {
    const std::uint32_t from = first_face_[v], to = first_face_[v + 1];
    if (from == to) return;
    const std::uint32_t t = face_at_[from];
    Normals normals;
    for (std::uint32_t i = from; i < to; ++i) add_distinct(faces_.inward[face_at_[i]], normals);
    const Ends& ends = ends_[v];
    const bool sheet = faces_.sheet[t], at_rim = sheet && norm(ends.into) > 0;
    if (at_rim)
      for (std::size_t i = 0, n = normals.size(); i < n; ++i) normals.push_back(-normals[i]);
    const Vec3 own = at_rim ? direction(ends.into) : mean_of(normals);
    if (norm(own) == 0) return;
    for (const double sign : {1.0, -1.0}) {
      if (sign < 0 && (!sheet || at_rim)) continue;
      if (sign < 0)
        for (Vec3& n : normals) n = -n;
      if (is_corner(ends, own, normals))
        put_ridge(place_[v], sign * own, t, add_ridge(sign * own, normals), out_.corners);
      else if (ends.count == 0 && normals.size() > 1 && is_reached(place_[v], sign * own))
        put(place_[v], sign * own, t, out_.faces);
    }
  }

  static bool is_corner(const Ends& ends, const Vec3& own, const Normals& normals) {
    if (ends.count == 2) return dot(ends.way[0], ends.way[1]) > -kCrease;
    if (ends.count > 0) return true;
    for (const Vec3& n : normals)  // a tip
      if (std::fabs(dot(n, own)) < kCrease) return true;
    return false;
  }

  const Mesh& mesh_;
  const FaceTable& faces_;
  const Reach& reach_;
  const double spacing_, tolerance_;
  Pulse& pulse_;
  std::vector<Vec3> place_;                           // welded vertices
  std::vector<std::array<std::uint32_t, 3>> corner_;  // (triangles) in place_
  KeyedIndices edges_;                                // half edges, sorted by edge
  std::vector<std::uint32_t> first_face_, face_at_;   // triangles at each vertex
  std::vector<Ends> ends_;                            // (vertices)
  Creases out_;
};

}  // namespace

Creases find_creases(const Mesh& mesh, const FaceTable& faces, const Reach& reach, double spacing,
                     double tolerance, Pulse& pulse) {
  return CreaseFinder(mesh, faces, reach, spacing, tolerance, pulse).run();
}

}  // namespace h6::io
