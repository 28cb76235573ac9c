// SPDX-License-Identifier: Apache-2.0
// shapes.cpp - lofts, turned and swept parts, sheets, and the lines they follow.
#include "io/scenes/industrial/shapes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace h6::io::industrial {
namespace {

void flip(Piece& piece) {
  for (auto& t : piece.triangles) std::swap(t[1], t[2]);
}

// Rotation-minimising frames along a line, z along it (double reflection; Wang et al. 2008).
std::vector<Frame> frames_along(const Line& line) {
  const std::size_t n = line.size();
  std::vector<Frame> out(n);
  const auto tangent = [&](std::size_t i) {
    return unit(line[std::min(i + 1, n - 1)] - line[i == 0 ? 0 : i - 1]);
  };
  const h6Vec3 t0 = tangent(0);
  out[0] = facing(line[0], t0, std::abs(t0.z) < 0.9 ? h6Vec3{0, 0, 1} : h6Vec3{1, 0, 0});
  for (std::size_t i = 1; i < n; ++i) {
    const h6Vec3 step = line[i] - line[i - 1];
    const double c1 = dot(step, step);
    const h6Vec3 x1 = out[i - 1].x - (2 / c1 * dot(step, out[i - 1].x)) * step;
    const h6Vec3 t1 = out[i - 1].z - (2 / c1 * dot(step, out[i - 1].z)) * step;
    const h6Vec3 t = tangent(i), turn = t - t1;
    const double c2 = dot(turn, turn);
    const h6Vec3 x = c2 > 1e-24 ? x1 - (2 / c2 * dot(turn, x1)) * turn : x1;
    out[i] = facing(line[i], t, x);
  }
  return out;
}

}  // namespace

Frame at(double x, double y, double z) {
  Frame frame;
  frame.o = {x, y, z};
  return frame;
}

Frame facing(const h6Vec3& origin, const h6Vec3& direction, const h6Vec3& hint) {
  const h6Vec3 z = unit(direction);
  h6Vec3 x = hint - dot(hint, z) * z;
  if (norm(x) < 1e-3)
    x = std::abs(z.y) < 0.9 ? h6Vec3{0, 1, 0} - z.y * z : h6Vec3{0, 0, 1} - z.z * z;
  x = unit(x);
  return {origin, x, cross(z, x), z};
}

Frame rolled(const Frame& f, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  return {f.o, c * f.x + s * f.y, c * f.y - s * f.x, f.z};
}

Piece placed(const Piece& piece, const Frame& frame) {
  Piece out = piece;
  for (h6Vec3& p : out.points) p = frame.at(p);
  return out;
}

double volume(const Piece& piece) {
  double six = 0;
  const h6Vec3 o = piece.points.front();
  for (const auto& t : piece.triangles)
    six += dot(piece.points[t[0]] - o, cross(piece.points[t[1]] - o, piece.points[t[2]] - o));
  return six / 6;
}

Piece loft(const std::vector<Line>& rings, Ends ends) {
  Piece out;
  std::vector<std::uint32_t> first;
  for (const Line& ring : rings) {
    first.push_back(static_cast<std::uint32_t>(out.points.size()));
    out.points.insert(out.points.end(), ring.begin(), ring.end());
  }
  const auto join = [&](std::size_t k, std::size_t l) {
    const std::uint32_t a = first[k], b = first[l];
    const bool pole_a = rings[k].size() == 1, pole_b = rings[l].size() == 1;
    const auto n = static_cast<std::uint32_t>(std::max(rings[k].size(), rings[l].size()));
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t j = (i + 1) % n;
      if (!pole_a) out.triangles.push_back({a + i, a + j, pole_b ? b : b + j});
      if (!pole_b) out.triangles.push_back({pole_a ? a : a + i, b + j, b + i});
    }
  };
  for (std::size_t k = 0; k + 1 < rings.size(); ++k) join(k, k + 1);
  if (ends == Ends::joined) join(rings.size() - 1, 0);
  if (ends == Ends::capped)
    for (const std::size_t k : {std::size_t{0}, rings.size() - 1}) {
      const Line& ring = rings[k];
      if (ring.size() == 1) continue;
      h6Vec3 mean{0, 0, 0};
      for (const h6Vec3& p : ring) mean = mean + (1.0 / static_cast<double>(ring.size())) * p;
      const auto c = static_cast<std::uint32_t>(out.points.size());
      out.points.push_back(mean);
      const auto n = static_cast<std::uint32_t>(ring.size());
      for (std::uint32_t i = 0; i < n; ++i) {
        const std::uint32_t p = first[k] + i, q = first[k] + (i + 1) % n;
        out.triangles.push_back({c, k == 0 ? q : p, k == 0 ? p : q});
      }
    }
  if (ends != Ends::open && volume(out) < 0) flip(out);
  return out;
}

Piece revolve(const Profile& profile, int sides, Ends ends) {
  std::vector<Line> rings;
  for (const P2& p : profile) {
    Line ring;
    for (int i = 0; i < (p.x == 0 ? 1 : sides); ++i) {
      const double angle = 2 * std::numbers::pi * i / sides;
      ring.push_back({p.x * std::cos(angle), p.x * std::sin(angle), p.y});
    }
    rings.push_back(std::move(ring));
  }
  return loft(rings, ends);
}

Piece cylinder(double radius, double z0, double z1, int sides) {
  return revolve({{radius, z0}, {radius, z1}}, sides);
}

Piece block(double w, double d, double h, double corner, double rim, int steps) {
  std::vector<Line> rings;
  const auto add = [&](double inset, double z) {
    Line ring;
    const double r = std::max(corner - inset, 0.05 * corner);
    for (const P2& p : rectangle(w - 2 * inset, d - 2 * inset, r, steps))
      ring.push_back({p.x, p.y, z});
    rings.push_back(std::move(ring));
  };
  const int rounds = 3;
  for (int i = 0; i <= rounds; ++i) {
    const double angle = std::numbers::pi / 2 * i / rounds;
    add(rim * (1 - std::sin(angle)), rim * (1 - std::cos(angle)));
  }
  for (int i = rounds; i >= 0; --i) {
    const double angle = std::numbers::pi / 2 * i / rounds;
    add(rim * (1 - std::sin(angle)), h - rim * (1 - std::cos(angle)));
  }
  return loft(rings, Ends::capped);
}

Piece box(const h6Vec3& low, const h6Vec3& high) {
  const auto ring = [&](double z) {
    return Line{{low.x, low.y, z}, {high.x, low.y, z}, {high.x, high.y, z}, {low.x, high.y, z}};
  };
  return loft({ring(low.z), ring(high.z)}, Ends::capped);
}

Piece rod(const Line& line, double radius, int sides) {
  return rod(
      line, [radius](double) { return radius; }, sides);
}

Piece rod(const Line& line, const std::function<double(double)>& radius, int sides) {
  std::vector<Line> rings;
  double s = 0;
  const std::vector<Frame> frames = frames_along(line);
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (i > 0) s += norm(line[i] - line[i - 1]);
    Line ring;
    for (const P2& p : circle(radius(s), sides)) ring.push_back(frames[i].at({p.x, p.y, 0}));
    rings.push_back(std::move(ring));
  }
  return loft(rings, Ends::capped);
}

Piece pipe(const Line& line, double outer, double inner, int sides) {
  std::vector<Line> rings;
  const std::vector<Frame> frames = frames_along(line);
  const auto add = [&](const Frame& frame, double r) {
    Line ring;
    for (const P2& p : circle(r, sides)) ring.push_back(frame.at({p.x, p.y, 0}));
    rings.push_back(std::move(ring));
  };
  for (const Frame& frame : frames) add(frame, outer);
  for (auto frame = frames.rbegin(); frame != frames.rend(); ++frame) add(*frame, inner);
  return loft(rings, Ends::joined);
}

Piece sweep(const Line& line, const Polygon& profile, const h6Vec3& up, Ends ends) {
  std::vector<Line> rings;
  const std::size_t n = line.size();
  for (std::size_t i = 0; i < n; ++i) {
    const bool loop = ends == Ends::joined;
    const h6Vec3& next = line[i + 1 < n ? i + 1 : (loop ? 0 : i)];
    const h6Vec3& last = line[i > 0 ? i - 1 : (loop ? n - 1 : 0)];
    const h6Vec3 t = unit(next - last), side = unit(cross(up, t)), top = cross(t, side);
    Line ring;
    for (const P2& p : profile) ring.push_back(line[i] + p.x * side + p.y * top);
    rings.push_back(std::move(ring));
  }
  return loft(rings, ends);
}

Piece sheet(int nu, int nv, const std::function<h6Vec3(double, double)>& point) {
  Piece out;
  for (int i = 0; i <= nu; ++i)
    for (int j = 0; j <= nv; ++j)
      out.points.push_back(point(static_cast<double>(i) / nu, static_cast<double>(j) / nv));
  for (int i = 0; i < nu; ++i)
    for (int j = 0; j < nv; ++j) {
      const auto a = static_cast<std::uint32_t>(i * (nv + 1) + j);
      const auto b = static_cast<std::uint32_t>(a + static_cast<std::uint32_t>(nv) + 1);
      out.triangles.push_back({a, b, b + 1});
      out.triangles.push_back({a, b + 1, a + 1});
    }
  return out;
}

// ---- lines -------------------------------------------------------------------------------------

namespace {

// The centripetal Catmull-Rom spline between b and c, 0 <= s <= 1 (Barry and Goldman's pyramid).
h6Vec3 catmull_rom(const h6Vec3& a, const h6Vec3& b, const h6Vec3& c, const h6Vec3& d, double s) {
  const double t1 = std::sqrt(norm(b - a)), t2 = t1 + std::sqrt(norm(c - b));
  const double t3 = t2 + std::sqrt(norm(d - c)), t = t1 + s * (t2 - t1);
  const auto mix = [t](const h6Vec3& p, double tp, const h6Vec3& q, double tq) {
    return ((tq - t) / (tq - tp)) * p + ((t - tp) / (tq - tp)) * q;
  };
  const h6Vec3 ab = mix(a, 0, b, t1), bc = mix(b, t1, c, t2), cd = mix(c, t2, d, t3);
  return mix(mix(ab, 0, bc, t2), t1, mix(bc, t1, cd, t3), t2);
}

Line resampled(const Line& dense, double spacing) {
  const double total = line_length(dense);
  const int pieces = std::max(1, static_cast<int>(std::lround(total / spacing)));
  Line out = {dense.front()};
  double s = 0;
  int next = 1;
  for (std::size_t i = 1; i < dense.size(); ++i) {
    const double step = norm(dense[i] - dense[i - 1]);
    for (; next < pieces && s + step >= total * next / pieces; ++next)
      out.push_back(dense[i - 1] +
                    ((total * next / pieces - s) / step) * (dense[i] - dense[i - 1]));
    s += step;
  }
  out.push_back(dense.back());
  return out;
}

}  // namespace

Line smooth(const std::vector<h6Vec3>& through, double spacing) {
  const std::size_t n = through.size();
  Line dense = {through.front()};
  for (std::size_t i = 0; i + 1 < n; ++i) {
    const h6Vec3 &b = through[i], &c = through[i + 1];
    const h6Vec3 a = i > 0 ? through[i - 1] : b - (c - b);
    const h6Vec3 d = i + 2 < n ? through[i + 2] : c + (c - b);
    for (int k = 1; k <= 24; ++k) dense.push_back(catmull_rom(a, b, c, d, k / 24.0));
  }
  return resampled(dense, spacing);
}

Line helix(double radius, double pitch, double turns, int per_turn) {
  Line out;
  const int steps = static_cast<int>(std::lround(turns * per_turn));
  for (int i = 0; i <= steps; ++i) {
    const double angle = 2 * std::numbers::pi * i / per_turn;
    out.push_back({radius * std::cos(angle), radius * std::sin(angle), pitch * i / per_turn});
  }
  return out;
}

Line companion(const Line& line, double radius, double angle, double lay) {
  Line out;
  double s = 0;
  const std::vector<Frame> frames = frames_along(line);
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (i > 0) s += norm(line[i] - line[i - 1]);
    const double a = angle + 2 * std::numbers::pi * s / lay;
    out.push_back(frames[i].at({radius * std::cos(a), radius * std::sin(a), 0}));
  }
  return out;
}

double line_length(const Line& line) {
  double s = 0;
  for (std::size_t i = 1; i < line.size(); ++i) s += norm(line[i] - line[i - 1]);
  return s;
}

Frame frame_on(const Line& line, double s) {
  const std::vector<Frame> frames = frames_along(line);
  for (std::size_t i = 1; i < line.size(); ++i) {
    const double step = norm(line[i] - line[i - 1]);
    if (s <= step || i + 1 == line.size()) {
      Frame out = frames[i - 1];
      out.o = line[i - 1] + std::min(s / step, 1.0) * (line[i] - line[i - 1]);
      return out;
    }
    s -= step;
  }
  return frames.front();
}

}  // namespace h6::io::industrial
