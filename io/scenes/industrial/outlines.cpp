// SPDX-License-Identifier: Apache-2.0
// outlines.cpp - outlines with holes, cut into triangles, and plates made of them.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "io/scenes/industrial/shapes.h"

namespace h6::io::industrial {
namespace {

using Index = std::uint32_t;

// Twice the area of the triangle a b c, positive when counter-clockwise.
double area2(const P2& a, const P2& b, const P2& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

bool in_triangle(const P2& p, const P2& a, const P2& b, const P2& c) {
  return area2(a, b, p) >= 0 && area2(b, c, p) >= 0 && area2(c, a, p) >= 0;
}

bool same(const P2& a, const P2& b) { return a.x == b.x && a.y == b.y; }

// Ear clipping after D. Eberly, "Triangulation by ear clipping". The loop is one list of vertex
// numbers around the outline and all its holes, which double edges (bridges) connect. The holes are
// joined by descending x, and each hole's rightmost vertex sees a vertex of the loop to its right.
class Ears {
 public:
  explicit Ears(const Outline& outline) {
    for (const P2& p : outline.outer) loop_.push_back(add(p));
    std::vector<std::vector<Index>> holes;
    for (const Polygon& hole : outline.holes) {
      std::vector<Index> ring;
      for (const P2& p : hole) ring.push_back(add(p));
      std::reverse(ring.begin(), ring.end());
      const auto right = std::max_element(
          ring.begin(), ring.end(), [&](Index a, Index b) { return points_[a].x < points_[b].x; });
      std::rotate(ring.begin(), right, ring.end());
      holes.push_back(std::move(ring));
    }
    std::sort(holes.begin(), holes.end(),
              [&](const auto& a, const auto& b) { return points_[a[0]].x > points_[b[0]].x; });
    for (const auto& hole : holes) bridge(hole);
  }

  std::vector<std::array<Index, 3>> clip() {
    std::vector<std::array<Index, 3>> out;
    std::size_t i = 0, failures = 0;
    while (loop_.size() > 3) {
      const std::size_t n = loop_.size(), h = (i + n - 1) % n, j = (i + 1) % n;
      // When no ear is left, rounding has left only slivers: clip one.
      if (is_ear(h, i, j) || failures > n) {
        out.push_back({loop_[h], loop_[i], loop_[j]});
        loop_.erase(loop_.begin() + static_cast<std::ptrdiff_t>(i));
        failures = 0;
        i = (i + 1) % loop_.size();  // skipping one vertex avoids most fans
      } else {
        ++failures;
        i = j;
      }
    }
    out.push_back({loop_[0], loop_[1], loop_[2]});
    return out;
  }

 private:
  Index add(const P2& p) {
    points_.push_back(p);
    return static_cast<Index>(points_.size() - 1);
  }

  bool is_ear(std::size_t h, std::size_t i, std::size_t j) const {
    const P2 &a = points_[loop_[h]], &b = points_[loop_[i]], &c = points_[loop_[j]];
    if (area2(a, b, c) <= 0) return false;
    for (std::size_t k = 0; k < loop_.size(); ++k) {
      const P2& p = points_[loop_[k]];
      if (same(p, a) || same(p, b) || same(p, c)) continue;
      if (in_triangle(p, a, b, c)) return false;
    }
    return true;
  }

  void bridge(const std::vector<Index>& hole) {
    const P2 m = points_[hole[0]];
    // Find the loop's nearest edge to the right of m, and the end of that edge farther right.
    double nearest = 1e300;
    std::size_t best = 0;
    for (std::size_t i = 0; i < loop_.size(); ++i) {
      const P2 &a = points_[loop_[i]], &b = points_[loop_[(i + 1) % loop_.size()]];
      if (!(a.y <= m.y && b.y >= m.y) || a.y == b.y) continue;  // inside is left of upward edges
      const double x = a.x + (m.y - a.y) / (b.y - a.y) * (b.x - a.x);
      if (x < m.x || x >= nearest) continue;
      nearest = x;
      best = a.x > b.x ? i : (i + 1) % loop_.size();
    }
    // Reflex vertices inside the triangle (m, hit, best) hide `best`; take the one at the least
    // angle then.
    const P2 hit = {nearest, m.y}, target = points_[loop_[best]];
    const bool up = target.y > m.y;
    double least = std::abs(std::atan2(target.y - m.y, target.x - m.x));
    for (std::size_t i = 0; i < loop_.size(); ++i) {
      const P2& p = points_[loop_[i]];
      if (same(p, target) || !in_triangle(p, m, up ? hit : target, up ? target : hit)) continue;
      const double angle = std::abs(std::atan2(p.y - m.y, p.x - m.x));
      if (angle < least) least = angle, best = i;
    }
    std::vector<Index> joined(loop_.begin(), loop_.begin() + static_cast<std::ptrdiff_t>(best) + 1);
    joined.insert(joined.end(), hole.begin(), hole.end());
    joined.push_back(hole[0]);
    joined.insert(joined.end(), loop_.begin() + static_cast<std::ptrdiff_t>(best), loop_.end());
    loop_ = std::move(joined);
  }

  std::vector<P2> points_;
  std::vector<Index> loop_;
};

}  // namespace

Polygon circle(double radius, int sides, P2 centre) {
  Polygon out;
  for (int i = 0; i < sides; ++i) {
    const double angle = 2 * std::numbers::pi * i / sides;
    out.push_back({centre.x + radius * std::cos(angle), centre.y + radius * std::sin(angle)});
  }
  return out;
}

Polygon rectangle(double w, double h, double corner, int steps, P2 centre) {
  Polygon out;
  const double x = w / 2 - corner, y = h / 2 - corner;
  const P2 centres[4] = {{x, y}, {-x, y}, {-x, -y}, {x, -y}};
  for (int k = 0; k < 4; ++k)
    for (int i = 0; i <= (corner > 0 ? steps : 0); ++i) {
      const double angle = std::numbers::pi / 2 * (k + static_cast<double>(i) / steps);
      out.push_back({centre.x + centres[k].x + corner * std::cos(angle),
                     centre.y + centres[k].y + corner * std::sin(angle)});
    }
  return out;
}

Polygon slot(double length, double radius, P2 centre, double angle, int steps) {
  Polygon out;
  const double c = std::cos(angle), s = std::sin(angle);
  for (int end = 0; end < 2; ++end)
    for (int i = 0; i <= steps; ++i) {
      const double a =
          -std::numbers::pi / 2 + std::numbers::pi * (end + static_cast<double>(i) / steps);
      const double x = (end == 0 ? 1 : -1) * length / 2 + radius * std::cos(a);
      const double y = radius * std::sin(a);
      out.push_back({centre.x + c * x - s * y, centre.y + s * x + c * y});
    }
  return out;
}

Polygon hull(const std::vector<std::array<double, 3>>& circles, int sides) {
  Polygon all;
  for (const auto& [x, y, r] : circles)
    for (const P2& p : circle(r, sides, {x, y})) all.push_back(p);
  std::sort(all.begin(), all.end(),
            [](const P2& a, const P2& b) { return a.x < b.x || (a.x == b.x && a.y < b.y); });
  // Andrew's monotone chain: lower hull, then upper.
  Polygon out;
  for (int pass = 0; pass < 2; ++pass) {
    const std::size_t base = out.size();
    for (const P2& p : all) {
      while (out.size() >= base + 2 && area2(out[out.size() - 2], out.back(), p) <= 1e-9)
        out.pop_back();
      out.push_back(p);
    }
    out.pop_back();
    std::reverse(all.begin(), all.end());
  }
  return out;
}

Polygon gear(int teeth, double root, double tip) {
  Polygon out;
  // One pitch has root, flank, rounded tip, flank: {share of the pitch, share of the height}.
  constexpr double kTooth[][2] = {{0.0, 0},     {0.2, 0},    {0.27, 0.3}, {0.34, 0.65},
                                  {0.42, 0.97}, {0.5, 1},    {0.6, 1},    {0.68, 0.97},
                                  {0.76, 0.65}, {0.83, 0.3}, {0.9, 0}};
  for (int i = 0; i < teeth; ++i)
    for (const auto& [along, height] : kTooth) {
      const double angle = 2 * std::numbers::pi * (i + along) / teeth,
                   r = root + height * (tip - root);
      out.push_back({r * std::cos(angle), r * std::sin(angle)});
    }
  return out;
}

void add_bolt_circle(Outline& outline, double radius, int count, double hole, double phase,
                     P2 centre, int sides) {
  for (int i = 0; i < count; ++i) {
    const double angle = phase + 2 * std::numbers::pi * i / count;
    outline.holes.push_back(circle(
        hole, sides, {centre.x + radius * std::cos(angle), centre.y + radius * std::sin(angle)}));
  }
}

Polygon counter_clockwise(Polygon polygon) {
  double twice = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i)
    twice += area2({0, 0}, polygon[i], polygon[(i + 1) % polygon.size()]);
  if (twice < 0) std::reverse(polygon.begin(), polygon.end());
  return polygon;
}

std::vector<std::array<std::uint32_t, 3>> triangulate(const Outline& outline) {
  return Ears(outline).clip();
}

Piece flat(const Outline& outline, double z) {
  Piece out;
  for (const P2& p : outline.outer) out.points.push_back({p.x, p.y, z});
  for (const Polygon& hole : outline.holes)
    for (const P2& p : hole) out.points.push_back({p.x, p.y, z});
  out.triangles = triangulate(outline);
  return out;
}

Piece extrude(const Outline& outline, double z0, double z1) {
  Piece out = flat(outline, z0);
  const auto n = static_cast<Index>(out.points.size());
  for (Index i = 0; i < n; ++i) out.points.push_back({out.points[i].x, out.points[i].y, z1});
  const std::vector<std::array<Index, 3>> top = out.triangles;
  for (auto& t : out.triangles) std::swap(t[1], t[2]);
  for (const auto& t : top) out.triangles.push_back({t[0] + n, t[1] + n, t[2] + n});
  Index first = 0;
  const auto wall = [&](const Polygon& ring, bool hole) {
    const auto count = static_cast<Index>(ring.size());
    for (Index i = 0; i < count; ++i) {
      Index a = first + i, b = first + (i + 1) % count;
      if (hole) std::swap(a, b);
      out.triangles.push_back({a, b, b + n});
      out.triangles.push_back({a, b + n, a + n});
    }
    first += count;
  };
  wall(outline.outer, false);
  for (const Polygon& hole : outline.holes) wall(hole, true);
  return out;
}

}  // namespace h6::io::industrial
