// SPDX-License-Identifier: Apache-2.0
// assembly.cpp - joins pieces to one mesh and refines it to an exact count or gives it defects.
#include "io/scenes/industrial/assembly.h"

#include <algorithm>
#include <cmath>
#include <queue>

#include "io/scenes/industrial/probes.h"

namespace h6::io::industrial {
namespace {

Vec3 metres_of(const h6Vec3& p) { return {kMm * p.x, kMm * p.y, kMm * p.z}; }

double distance_to_segment(const h6Vec3& p, const h6Vec3& a, const h6Vec3& b) {
  const h6Vec3 ab = b - a;
  const double s = std::clamp(dot(p - a, ab) / std::max(dot(ab, ab), 1e-300), 0.0, 1.0);
  return norm(p - a - s * ab);
}

// Orders edges for the queue: the longest comes first, equal ones in the order of their vertices.
struct Edge {
  double squared;
  std::uint32_t a, b;
  bool operator<(const Edge& o) const {
    return std::tie(squared, o.a, o.b) < std::tie(o.squared, a, b);
  }
};

// Splits the longest edges until a mesh has so many triangles. Splitting an inner edge adds two
// triangles, splitting a border edge adds one.
class Splitter {
 public:
  explicit Splitter(Mesh& mesh) : mesh_(mesh) {
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      for (int k = 0; k < 3; ++k) {
        const auto [a, b] = side(t, k);
        faces_[key(a, b)].push_back(t);
        if (faces_[key(a, b)].size() == 1) push(a, b);
      }
  }

  void split_until(std::size_t count) {
    while (mesh_.triangles.size() < count && !queue_.empty()) {
      const Edge edge = queue_.top();
      queue_.pop();
      const auto found = faces_.find(key(edge.a, edge.b));
      if (found == faces_.end()) continue;
      const std::vector<std::size_t> faces = found->second;
      if (mesh_.triangles.size() + faces.size() > count) continue;
      faces_.erase(found);
      split(edge, faces);
    }
  }

 private:
  static std::uint64_t key(std::uint32_t a, std::uint32_t b) {
    return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
  }
  std::pair<std::uint32_t, std::uint32_t> side(std::size_t t, int k) const {
    return {mesh_.triangles[t][static_cast<std::size_t>(k)],
            mesh_.triangles[t][static_cast<std::size_t>((k + 1) % 3)]};
  }
  void push(std::uint32_t a, std::uint32_t b) {
    const Vec3 &p = mesh_.vertices[a], &q = mesh_.vertices[b];
    queue_.push({dot(p - q, p - q), std::min(a, b), std::max(a, b)});
  }

  void split(const Edge& edge, const std::vector<std::size_t>& faces) {
    const Vec3 &p = mesh_.vertices[edge.a], &q = mesh_.vertices[edge.b];
    const Vec3 half = {(p.x + q.x) / 2, (p.y + q.y) / 2, (p.z + q.z) / 2};
    const auto m = static_cast<std::uint32_t>(mesh_.vertices.size());
    mesh_.vertices.push_back(half);
    for (const std::size_t t : faces) {
      auto old = mesh_.triangles[t];
      while (key(old[0], old[1]) != key(edge.a, edge.b))
        std::rotate(old.begin(), old.begin() + 1, old.end());
      const std::size_t u = mesh_.triangles.size();
      mesh_.triangles[t] = {old[0], m, old[2]};
      mesh_.triangles.push_back({m, old[1], old[2]});
      if (!mesh_.part.empty()) mesh_.part.push_back(mesh_.part[t]);
      auto& far_side = faces_[key(old[1], old[2])];
      *std::find(far_side.begin(), far_side.end(), t) = u;
      faces_[key(m, old[2])] = {t, u};
      push(m, old[2]);
      for (const auto& [v, w] : {std::pair{old[0], t}, std::pair{old[1], u}}) {
        auto& half_faces = faces_[key(m, v)];
        half_faces.push_back(w);
        if (half_faces.size() == 1) push(m, v);
      }
    }
  }

  Mesh& mesh_;
  std::unordered_map<std::uint64_t, std::vector<std::size_t>> faces_;
  std::priority_queue<Edge> queue_;
};

}  // namespace

void Assembly::add(const std::string& name, const Piece& piece, const Frame& frame, Kind kind) {
  const auto [found, fresh] = part_of_.try_emplace(name, static_cast<std::int32_t>(names_.size()));
  if (fresh) names_.push_back(name);
  const auto first = static_cast<std::uint32_t>(points_.size());
  ranges_.push_back({triangles_.size(), piece.triangles.size(), found->second, kind});
  for (const h6Vec3& p : piece.points) points_.push_back(frame.at(p));
  for (const auto& t : piece.triangles)
    triangles_.push_back({t[0] + first, t[1] + first, t[2] + first});
}

void Assembly::add_wire(const std::string& name, const Line& line, double radius) {
  add(name, rod(line, radius, 8), {}, Kind::wire);
  IndustrialTruth::Wire wire{ranges_.back().part, {}, kMm * radius};
  for (const h6Vec3& p : line) wire.line.push_back(kMm * p);
  wires_.push_back(std::move(wire));
}

std::array<h6Vec3, 3> Assembly::corners(std::size_t t) const {
  return {points_[triangles_[t][0]], points_[triangles_[t][1]], points_[triangles_[t][2]]};
}

void Assembly::leave_hole(const std::string& name, const h6Vec3& near, int triangles) {
  std::size_t piece = ranges_.size() - 1;
  while (names_[static_cast<std::size_t>(ranges_[piece].part)] != name) --piece;
  const Range& range = ranges_[piece];
  const auto centre = [&](std::size_t t) {
    const auto [a, b, c] = corners(t);
    return (1.0 / 3) * (a + b + c);
  };
  std::vector<std::size_t> order;
  for (std::size_t t = range.first; t < range.first + range.count; ++t) order.push_back(t);
  const auto nearest_to = [&](const h6Vec3& p) {
    return [&centre, p](std::size_t s, std::size_t t) {
      return norm(centre(s) - p) < norm(centre(t) - p);
    };
  };
  const h6Vec3 middle = centre(*std::min_element(order.begin(), order.end(), nearest_to(near)));
  std::sort(order.begin(), order.end(), nearest_to(middle));
  order.resize(static_cast<std::size_t>(triangles));
  holes_.push_back({piece, order});
}

// Diameter of the largest ball among the missing triangles that does not cross their border. The
// result is 5 percent larger, because the centres are tried on a grid.
double Assembly::hole_width(const std::vector<std::size_t>& triangles) const {
  std::vector<std::array<std::uint32_t, 2>> border;
  for (const std::size_t t : triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = triangles_[t][k], b = triangles_[t][(k + 1) % 3];
      const std::array<std::uint32_t, 2> edge = {std::min(a, b), std::max(a, b)};
      const auto twin = std::find(border.begin(), border.end(), edge);
      if (twin == border.end())
        border.push_back(edge);
      else
        border.erase(twin);
    }
  constexpr int kSteps = 20;
  double most = 0;
  for (const std::size_t t : triangles) {
    const auto [a, b, c] = corners(t);
    for (int i = 0; i <= kSteps; ++i)
      for (int j = 0; i + j <= kSteps; ++j) {
        const h6Vec3 p = a + (1.0 / kSteps) * (i * 1.0 * (b - a) + j * 1.0 * (c - a));
        double nearest = 1e300;
        for (const auto& [u, v] : border)
          nearest = std::min(nearest, distance_to_segment(p, points_[u], points_[v]));
        most = std::max(most, nearest);
      }
  }
  return 2.1 * most;
}

Mesh Assembly::sound(std::size_t triangles) const {
  Mesh mesh;
  for (const h6Vec3& p : points_) mesh.vertices.push_back(metres_of(p));
  mesh.triangles = triangles_;
  mesh.part_names = names_;
  for (const Range& range : ranges_) mesh.part.insert(mesh.part.end(), range.count, range.part);
  Splitter(mesh).split_until(triangles);
  return mesh;
}

std::vector<std::uint8_t> Assembly::missing(const Defects& defects, Dice& dice,
                                            std::size_t* narrow) const {
  std::vector<std::uint8_t> gone(triangles_.size(), 0);
  std::vector<std::uint8_t> taken(ranges_.size(), 0);
  for (const Hole& hole : holes_) {
    taken[hole.range] = 1;
    for (const std::size_t t : hole.triangles) gone[t] = 1;
  }
  *narrow = 0;
  const int tries = 50 * defects.narrow_holes;
  for (int i = 0; i < tries && *narrow < static_cast<std::size_t>(defects.narrow_holes); ++i) {
    const std::size_t r = dice.below(ranges_.size());
    if (taken[r] != 0 || ranges_[r].kind == Kind::sheet) continue;
    const std::size_t t = ranges_[r].first + dice.below(ranges_[r].count);
    if (kMm * hole_width({t}) > voxel_) continue;
    taken[r] = gone[t] = 1;
    ++*narrow;
  }
  return gone;
}

IndustrialInput Assembly::broken(const Defects& defects, std::size_t probes) const {
  IndustrialInput out;
  Mesh& mesh = out.mesh;
  Dice dice = dice_;
  const std::vector<std::uint8_t> gone = missing(defects, dice, &out.truth.narrow_holes);
  mesh.vertices.reserve(points_.size());
  for (const h6Vec3& p : points_) mesh.vertices.push_back(metres_of(p));
  mesh.triangles.reserve(defects.triangles);
  mesh.part.reserve(defects.triangles);
  mesh.part_names = names_;
  for (const Range& range : ranges_) {
    const double lot = dice.uniform(0, 1);
    const bool flipped = lot < defects.flipped_pieces;
    const bool mixed = !flipped && lot < defects.flipped_pieces + defects.mixed_pieces;
    for (std::size_t t = range.first; t < range.first + range.count; ++t) {
      if (gone[t] != 0) continue;
      auto triangle = triangles_[t];
      if (flipped || (mixed && t % 3 == 0)) std::swap(triangle[1], triangle[2]);
      mesh.triangles.push_back(triangle);
      mesh.part.push_back(range.part);
    }
  }
  const std::size_t single = mesh.triangles.size();
  while (mesh.triangles.size() < defects.triangles) {
    const std::size_t t = dice.below(single);
    auto twin = mesh.triangles[t];
    std::rotate(twin.begin(), twin.begin() + static_cast<std::ptrdiff_t>(dice.below(3)),
                twin.end());
    if (dice.below(2) == 0) std::swap(twin[0], twin[1]);
    mesh.triangles.push_back(twin);
    mesh.part.push_back(mesh.part[t]);
  }

  IndustrialTruth& truth = out.truth;
  truth.duplicates = mesh.triangles.size() - single;
  truth.voxel = bounds_of(mesh).longest() / (1024 - 2 * 8);  // 8 cells of padding at either end
  truth.wires = wires_;
  for (const Hole& hole : holes_) {
    h6Vec3 centre{0, 0, 0}, normal{0, 0, 0};
    for (const std::size_t t : hole.triangles) {
      const auto [a, b, c] = corners(t);
      centre = centre + (1.0 / (3.0 * static_cast<double>(hole.triangles.size()))) * (a + b + c);
      normal = normal + cross(b - a, c - a);
    }
    truth.holes.push_back({ranges_[hole.range].part, kMm * centre, unit(normal),
                           kMm * hole_width(hole.triangles), hole.triangles.size()});
  }
  if (probes > 0) Prober(*this).fill(truth, probes);
  return out;
}

}  // namespace h6::io::industrial
