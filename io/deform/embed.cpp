// SPDX-License-Identifier: Apache-2.0
// embed.cpp - modes at any points, from the elements that hold them.
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "io/deform/elements.h"
#include "io/deform/reduced_model.h"

namespace h6::io {
namespace {

using deform::QuadraturePoint;

h6Vec3 place_of(const SolidMesh& mesh, const SolidElement& e, const QuadraturePoint& at) {
  h6Vec3 p{};
  for (std::uint32_t a = 0; a < e.corners; ++a) p = p + at.value[a] * mesh.vertices[e.corner[a]];
  return p;
}

// Into the element: [0, 1]^3, or x, y, z >= 0 and x + y + z <= 1, nearest in local coordinates.
h6Vec3 clamped(const SolidElement& e, h6Vec3 x) {
  x = min(max(x, {0, 0, 0}), {1, 1, 1});
  const double sum = x.x + x.y + x.z;
  return e.corners == 4 && sum > 1 ? (1 / sum) * x : x;
}

// d(local)/dX times a vector: local coordinate i is the sum of the shape functions of the corners
// where it is 1.
h6Vec3 local_step(const SolidElement& e, const QuadraturePoint& at, const h6Vec3& d) {
  const auto along = [&](std::uint32_t a) { return dot(at.gradient[a], d); };
  if (e.corners == 4) return {along(1), along(2), along(3)};
  return {along(1) + along(2) + along(5) + along(6), along(2) + along(3) + along(6) + along(7),
          along(4) + along(5) + along(6) + along(7)};
}

// The nearest point of an element, or one close to it, by Newton steps that stay inside. A step
// that brings nothing is halved, so that twisted hexahedra converge too.
struct Near {
  double distance = 0;
  QuadraturePoint at;
};
Near nearest_in(const SolidMesh& mesh, const SolidElement& e, const h6Vec3& p) {
  const double third = e.corners == 4 ? 0.25 : 0.5;
  h6Vec3 local{third, third, third};
  Near best;
  best.at = deform::at_local(mesh, e, local);
  best.distance = norm(p - place_of(mesh, e, best.at));
  for (int step = 0; step < 30; ++step) {
    const h6Vec3 move = local_step(e, best.at, p - place_of(mesh, e, best.at));
    bool nearer = false;
    for (double share = 1; share > 0.05 && !nearer; share /= 2) {
      const h6Vec3 next = clamped(e, local + share * move);
      const QuadraturePoint at = deform::at_local(mesh, e, next);
      const double distance = norm(p - place_of(mesh, e, at));
      if (!(distance < best.distance * (1 - 1e-12))) continue;
      nearer = true;
      best.distance = distance, best.at = at;
      local = next;
    }
    if (!nearer) break;
  }
  return best;
}

// Boxes of elements, halved along their longest side down to a few.
class ElementTree {
 public:
  explicit ElementTree(const SolidMesh& mesh) : mesh_(mesh), order_(mesh.elements.size()) {
    std::iota(order_.begin(), order_.end(), 0u);
    for (const SolidElement& e : mesh.elements) {
      Box box{mesh.vertices[e.corner[0]], mesh.vertices[e.corner[0]]};
      for (std::uint32_t a = 1; a < e.corners; ++a) box.add(mesh.vertices[e.corner[a]]);
      boxes_.push_back(box);
    }
    build(0, order_.size());
  }

  Near nearest(const h6Vec3& p, std::uint32_t& element) const {
    Near best;
    best.distance = HUGE_VAL;
    search(0, p, best, element);
    return best;
  }

 private:
  struct Box {
    h6Vec3 low, high;
    void add(const h6Vec3& p) { low = min(low, p), high = max(high, p); }
    double distance(const h6Vec3& p) const { return norm(max(max(low - p, p - high), {0, 0, 0})); }
  };
  struct Node {
    Box box;
    std::size_t begin, end;  // in order_
    std::size_t second = 0;  // the second child; the first follows; 0: a leaf
  };

  std::size_t build(std::size_t begin, std::size_t end) {
    Box box = boxes_[order_[begin]];
    for (std::size_t i = begin; i < end; ++i)
      box.add(boxes_[order_[i]].low), box.add(boxes_[order_[i]].high);
    const std::size_t number = nodes_.size();
    nodes_.push_back({box, begin, end});
    if (end - begin <= 4) return number;
    const h6Vec3 size = box.high - box.low;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const auto middle = [&](std::uint32_t e) {
      return component(boxes_[e].low, axis) + component(boxes_[e].high, axis);
    };
    const std::size_t half = (begin + end) / 2;
    std::nth_element(order_.begin() + begin, order_.begin() + half, order_.begin() + end,
                     [&](std::uint32_t a, std::uint32_t b) {
                       return middle(a) != middle(b) ? middle(a) < middle(b) : a < b;
                     });
    build(begin, half);
    const std::size_t second = build(half, end);
    nodes_[number].second = second;
    return number;
  }

  void search(std::size_t number, const h6Vec3& p, Near& best, std::uint32_t& element) const {
    const Node& node = nodes_[number];
    if (node.box.distance(p) >= best.distance) return;
    if (node.second == 0) {
      for (std::size_t i = node.begin; i < node.end; ++i) {
        if (boxes_[order_[i]].distance(p) >= best.distance) continue;
        const Near near = nearest_in(mesh_, mesh_.elements[order_[i]], p);
        if (near.distance < best.distance) best = near, element = order_[i];
      }
      return;
    }
    std::size_t first = number + 1, second = node.second;
    if (nodes_[second].box.distance(p) < nodes_[first].box.distance(p)) std::swap(first, second);
    search(first, p, best, element);
    search(second, p, best, element);
  }

  const SolidMesh& mesh_;
  std::vector<std::uint32_t> order_;
  std::vector<Box> boxes_;
  std::vector<Node> nodes_;
};

// Values at the vertices (vertices x r x 3), at points.
std::vector<double> values_at(const ReducedModel& model, const std::vector<double>& values,
                              const std::vector<h6Vec3>& points, double* farthest) {
  const SolidMesh& mesh = model.mesh;
  const ElementTree tree(mesh);
  const std::size_t width = model.modes * 3;
  std::vector<double> out(points.size() * width, 0);
  double far = 0;
  for (std::size_t n = 0; n < points.size(); ++n) {
    std::uint32_t number = 0;
    const Near near = tree.nearest(points[n], number);
    const SolidElement& e = mesh.elements[number];
    const h6Vec3 rest = points[n] - place_of(mesh, e, near.at);
    far = std::max(far, near.distance);
    for (std::uint32_t a = 0; a < e.corners; ++a) {
      const double share = near.at.value[a] + dot(near.at.gradient[a], rest);
      const double* mode = values.data() + e.corner[a] * width;
      for (std::size_t i = 0; i < width; ++i) out[n * width + i] += share * mode[i];
    }
  }
  if (farthest) *farthest = far;
  return out;
}

// The local coordinates of a corner.
h6Vec3 corner_place(const SolidElement& e, std::uint32_t corner) {
  if (e.corners == 4) return {double(corner == 1), double(corner == 2), double(corner == 3)};
  const std::uint32_t around = corner % 4;
  return {double(around == 1 || around == 2), double(around >= 2), double(corner >= 4)};
}

}  // namespace

std::vector<double> modes_at(const ReducedModel& model, const std::vector<h6Vec3>& points,
                             double* farthest) {
  return values_at(model, model.basis, points, farthest);
}

std::vector<double> turns_at(const ReducedModel& model, const std::vector<h6Vec3>& points) {
  return values_at(model, model.turn, points, nullptr);
}

std::vector<double> vertex_turns(const SolidMesh& mesh, const std::vector<double>& basis,
                                 std::size_t modes) {
  const std::size_t width = modes * 3;
  std::vector<double> out(basis.size(), 0), volume(mesh.vertices.size(), 0);
  for (const SolidElement& e : mesh.elements) {
    const deform::Quadrature points = deform::quadrature(mesh, e);
    double size = 0;
    for (std::size_t p = 0; p < points.count; ++p) size += points.point[p].weight;
    for (std::uint32_t c = 0; c < e.corners; ++c) {
      const QuadraturePoint at = deform::at_local(mesh, e, corner_place(e, c));
      double* const turn = out.data() + e.corner[c] * width;
      volume[e.corner[c]] += size;
      for (std::uint32_t a = 0; a < e.corners; ++a)
        for (std::size_t j = 0; j < modes; ++j) {
          const double* u = basis.data() + e.corner[a] * width + 3 * j;
          const h6Vec3 curl = cross(at.gradient[a], h6Vec3{u[0], u[1], u[2]});
          turn[3 * j] += 0.5 * size * curl.x;
          turn[3 * j + 1] += 0.5 * size * curl.y;
          turn[3 * j + 2] += 0.5 * size * curl.z;
        }
    }
  }
  for (std::size_t v = 0; v < volume.size(); ++v)
    for (std::size_t i = 0; volume[v] > 0 && i < width; ++i) out[v * width + i] /= volume[v];
  return out;
}

}  // namespace h6::io
