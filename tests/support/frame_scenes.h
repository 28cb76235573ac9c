// SPDX-License-Identifier: Apache-2.0
// frame_scenes.h - seeded scenes for whole frames: a part of 56,823 points in clutter and in a
// socket that fits it, both in fields of 1024^3 voxels sampled from signed distance functions.
//
// `size` scales everything except the voxels; tests take 0.25.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <random>
#include <vector>

#include "hapsix/hapsix.h"

namespace h6::bench {

using Point = std::array<double, 3>;  // voxels, the part's centre at 0

inline constexpr double kVoxel = 5e-4;    // [m]
inline constexpr int kBricks = 128;       // along each axis
inline constexpr double kMiddle = 512.0;  // node index of the origin on each axis
inline constexpr double kBand = 3.0;      // voxels
inline constexpr std::size_t kPoints = 56823;
inline constexpr double kClearance = 0.25;  // gap between part and socket [voxel]

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(engine_() >> 11) * 0x1p-53);
  }

 private:
  std::mt19937_64 engine_;
};

// A box with rounded edges, or a round tube, turned about z by `turn` [rad]. A long thin box is a
// post. Voxels.
struct Solid {
  Point centre, half;
  double round, turn = 0;
  bool tube = false;  // along its local z, radius half[0]

  double distance(const Point& p) const {
    const double x = p[0] - centre[0], y = p[1] - centre[1], c = std::cos(turn), s = std::sin(turn);
    const double q[3] = {c * x + s * y, c * y - s * x, p[2] - centre[2]};
    double a[3];
    int n = 3;
    if (tube) {
      a[0] = std::hypot(q[0], q[1]) - half[0] + round, a[1] = std::fabs(q[2]) - half[2] + round;
      n = 2;
    } else {
      for (int k = 0; k < 3; ++k) a[k] = std::fabs(q[k]) - half[k] + round;
    }
    double out = 0, in = -1e9;
    for (int k = 0; k < n; ++k) {
      out += a[k] > 0 ? a[k] * a[k] : 0;
      in = std::max(in, a[k]);
    }
    return std::sqrt(out) + std::min(in, 0.0) - round;
  }
};

using Solids = std::vector<Solid>;
inline Solids scaled(Solids solids, double size) {
  for (Solid& s : solids) {
    for (double& v : s.centre) v *= size;
    for (double& v : s.half) v *= size;
    s.round *= size;
  }
  return solids;
}
inline double distance(const Solids& solids, const Point& p) {
  double d = 1e9;
  for (const Solid& s : solids) d = std::min(d, s.distance(p));
  return d;
}

// Roughly a starter: a motor on a gear case on a foot.
inline Solids part() {
  return {{{0, 0, 0}, {110, 62, 62}, 30},
          {{150, 0, 0}, {50, 34, 34}, 20},
          {{-60, 70, 0}, {45, 24, 30}, 12},
          {{40, 0, 75}, {26, 26, 34}, 10, 0, true},
          {{20, 0, -70}, {70, 50, 14}, 8}};
}

struct PartPoints {
  std::vector<Point> at, inward;
};
// Random points near the part, moved onto its surface.
inline const PartPoints& part_points(double size = 1) {
  static std::map<double, PartPoints> made;
  PartPoints& out = made[size];
  if (!out.at.empty()) return out;
  {
    const Solids solids = part();
    Random random(1);
    const auto count = static_cast<std::size_t>(kPoints * size * size);
    while (out.at.size() < count) {
      Point p{random.uniform(-130, 215), random.uniform(-80, 110), random.uniform(-95, 120)}, g{};
      if (std::fabs(distance(solids, p)) > 4) continue;
      for (int step = 0; step < 6; ++step) {
        const double d = distance(solids, p), e = 1e-5;
        for (int k = 0; k < 3; ++k) {
          Point q = p;
          q[k] += e;
          g[k] = (distance(solids, q) - d) / e;
        }
        const double n = std::sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
        for (double& v : g) v /= n;
        for (int k = 0; k < 3; ++k) p[k] -= d * g[k];
      }
      if (std::fabs(distance(solids, p)) > 1e-6) continue;
      out.at.push_back(p);
      out.inward.push_back({-g[0], -g[1], -g[2]});
    }
  }
  for (Point& p : out.at)
    for (double& v : p) v *= size;
  return out;
}

// Boxes, tubes and posts around the part, none nearer than 1 voxel to it.
inline Solids clutter(double size = 1) {
  Random random(2);
  std::vector<Point> points = part_points(size).at;
  for (Point& p : points)
    for (double& v : p) v /= size;
  Solids solids;
  while (solids.size() < 160) {
    Solid s{{random.uniform(-420, 420), random.uniform(-420, 420), random.uniform(-420, 420)},
            {random.uniform(10, 70), random.uniform(10, 70), random.uniform(10, 90)},
            4,
            random.uniform(0, 3)};
    if (solids.size() % 3 == 1) s.tube = true, s.half[0] = s.half[1] = random.uniform(6, 20);
    if (solids.size() % 3 == 2) s.half = {random.uniform(5, 9), random.uniform(5, 9), 250};
    double nearest = 1e9;
    for (std::size_t i = 0; i < points.size(); i += 7)
      nearest = std::min(nearest, s.distance(points[i]));
    // Every fourth solid must stand close to the part.
    if (nearest < 2 || (solids.size() % 4 == 0 && nearest > 12)) continue;
    solids.push_back(s);
  }
  return scaled(solids, size);
}

struct FieldArrays {
  std::vector<std::int32_t> index;
  std::vector<float> samples, far;
  h6FieldDef def{};
};

// Samples the distance to the solids. With `socket` it is the distance to the socket instead: all
// space less the solids grown by kClearance.
inline FieldArrays sample(const Solids& solids, bool socket, double size = 1) {
  FieldArrays out;
  const int bricks = static_cast<int>(kBricks * size), blocks = bricks / 8;
  const double middle_node = kMiddle * size;
  const auto at = [middle_node](const Solids& set, bool turned, double i, double j, double k) {
    const double d = distance(set, {i - middle_node, j - middle_node, k - middle_node});
    return turned ? kClearance - d : d;
  };
  constexpr double kHalfDiagonal = 4 * 1.7320508 + 1e-6;
  // The solids that can be the nearest within `reach` of a centre. This narrows the list for blocks
  // of 8 x 8 x 8 bricks first, then for bricks.
  const auto nearest = [](const Solids& set, const Point& centre, double reach) {
    const double least = distance(set, centre);
    Solids some;
    for (const Solid& s : set)
      if (s.distance(centre) <= least + 2 * reach) some.push_back(s);
    return some;
  };
  const std::size_t n = bricks, m = n + 1, side = blocks;
  out.index.assign(n * n * n, -1);
  out.far.resize(m * m * m);
  for (std::size_t block = 0; block < side * side * side; ++block) {
    const std::size_t b[3] = {block % side, block / side % side, block / (side * side)};
    const Solids set = nearest(solids,
                               {64.0 * b[0] + 32 - middle_node, 64.0 * b[1] + 32 - middle_node,
                                64.0 * b[2] + 32 - middle_node},
                               8 * kHalfDiagonal);
    for (std::size_t k = 0; k <= 8; ++k)
      for (std::size_t j = 0; j <= 8; ++j)
        for (std::size_t i = 0; i <= 8; ++i) {
          const std::size_t x = 8 * b[0] + i, y = 8 * b[1] + j, z = 8 * b[2] + k;
          const double d = at(set, socket, 8.0 * x, 8.0 * y, 8.0 * z);
          out.far[(z * m + y) * m + x] = std::nextafter(static_cast<float>(d * kVoxel), 0.0f);
          if (i == 8 || j == 8 || k == 8) continue;
          const Point centre{8.0 * x + 4 - middle_node, 8.0 * y + 4 - middle_node,
                             8.0 * z + 4 - middle_node};
          const double middle = distance(set, centre) - (socket ? kClearance : 0);
          if (std::fabs(middle) > kBand + 1.74 + kHalfDiagonal) continue;
          out.index[(z * n + y) * n + x] = static_cast<std::int32_t>(out.samples.size() / 512);
          const Solids few = nearest(set, centre, kHalfDiagonal);
          for (int node = 0; node < 512; ++node)
            out.samples.push_back(
                static_cast<float>(kVoxel * at(few, socket, 8.0 * x + node % 8,
                                               8.0 * y + node / 8 % 8, 8.0 * z + node / 64)));
        }
  }
  const double origin = -middle_node * kVoxel;
  out.def.origin = {origin, origin, origin};
  out.def.voxel_size = kVoxel;
  for (int& count : out.def.bricks) count = bricks;
  out.def.band = kBand * kVoxel;
  out.def.brick_index = out.index.data();
  out.def.samples = out.samples.data();
  out.def.brick_count = out.samples.size() / 512;
  out.def.far_grid = out.far.data();
  return out;
}

// The part's points with a sphere tree of 7 nested levels, each with four times as many points as
// the one above.
struct ShellArrays {
  std::vector<float> x, y, z, nx, ny, nz, radius;
  std::vector<std::uint32_t> level_first{0}, point, first_child, child_count;

  explicit ShellArrays(double size = 1) {
    const PartPoints& points = part_points(size);
    const std::size_t total = points.at.size();
    for (std::size_t i = 0; i < total; ++i) {
      x.push_back(float(kVoxel * points.at[i][0])), y.push_back(float(kVoxel * points.at[i][1]));
      z.push_back(float(kVoxel * points.at[i][2]));
      const Point& n = points.inward[i];
      nx.push_back(float(n[0])), ny.push_back(float(n[1])), nz.push_back(float(n[2]));
    }
    // members: the points of a level, those of one parent together. parent: the row of each row's
    // parent.
    std::vector<std::uint32_t> members(14), parent;
    for (std::uint32_t i = 0; i < 14; ++i) members[i] = i;
    for (int level = 0; level < 7; ++level) {
      const std::size_t first = point.size(), count = members.size();
      for (std::uint32_t p : members) {
        point.push_back(p);
        first_child.push_back(0), child_count.push_back(0), radius.push_back(0);
      }
      level_first.push_back(static_cast<std::uint32_t>(point.size()));
      if (level == 6) break;
      const std::size_t next = level == 5 ? total : std::min(total, 4 * count);
      std::vector<std::vector<std::uint32_t>> children(count);
      for (std::size_t k = 0; k < count; ++k) children[k].push_back(members[k]);
      for (std::size_t i = count; i < next; ++i) {
        std::size_t best = 0;
        float least = 1e9f;
        for (std::size_t k = 0; k < count; ++k) {
          const std::uint32_t q = members[k];
          const float dx = x[i] - x[q], dy = y[i] - y[q], dz = z[i] - z[q];
          const float d = dx * dx + dy * dy + dz * dz;
          if (d < least) least = d, best = k;
        }
        children[best].push_back(static_cast<std::uint32_t>(i));
      }
      members.clear();
      for (std::size_t k = 0; k < count; ++k) {
        first_child[first + k] = static_cast<std::uint32_t>(point.size() + members.size());
        child_count[first + k] = static_cast<std::uint32_t>(children[k].size());
        members.insert(members.end(), children[k].begin(), children[k].end());
      }
    }
    parent.resize(point.size());
    for (std::size_t r = 0; r < level_first[6]; ++r)
      for (std::uint32_t c = 0; c < child_count[r]; ++c)
        parent[first_child[r] + c] = static_cast<std::uint32_t>(r);
    for (std::uint32_t leaf = level_first[6]; leaf < point.size(); ++leaf)
      for (std::uint32_t r = leaf; r >= level_first[1];) {
        r = parent[r];
        const std::uint32_t p = point[leaf], q = point[r];
        radius[r] =
            std::max(radius[r], 1.00001f * std::hypot(x[p] - x[q], y[p] - y[q], z[p] - z[q]));
      }
  }
  h6ShellDef def() const {
    h6ShellDef d{};
    d.point_count = x.size();
    d.x = x.data(), d.y = y.data(), d.z = z.data();
    d.nx = nx.data(), d.ny = ny.data(), d.nz = nz.data();
    d.level_count = 7;
    d.level_first = level_first.data();
    d.node_point = point.data(), d.node_radius = radius.data();
    d.node_first_child = first_child.data(), d.node_child_count = child_count.data();
    return d;
  }
};

inline h6Model* make_model(bool socket, double size = 1) {
  FieldArrays field = sample(socket ? scaled(part(), size) : clutter(size), socket, size);
  const ShellArrays shell(size);
  const h6ShellDef shell_def = shell.def();
  h6ModelDef def = h6DefaultModelDef();
  def.fields = &field.def, def.field_count = 1;
  def.shells = &shell_def, def.shell_count = 1;
  return h6CreateModel(&def, nullptr);
}

}  // namespace h6::bench
