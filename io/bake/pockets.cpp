// SPDX-License-Identifier: Apache-2.0
// pockets.cpp - outside nodes at the bottom of grooves narrower than a voxel.
//
// Triangles cross all edges from such a node to its neighbours, so the flood cannot reach it. Each
// candidate is judged alone, by lines to the reached nodes in view. A line that crosses a closed
// component of the mesh an odd number of times rejects the node: that component holds it in.
// Nearly all candidates are tips of solids, and this is true of them even where solids overlap. A
// line that crosses nothing accepts the node. Where no line accepts any more, a walk of a few
// voxels on a lattice eight times finer decides; it costs as much as some forty looks, and few
// nodes need one. Its reach does not depend on the other nodes, so each node walks once.
#include "io/bake/pockets.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "sched/parallel_for.h"

namespace h6::io::bake {

struct Facet {
  Vec3 a, e, f;    // corner and two edges
  Vec3 low, high;  // its box, a little larger than it
  std::uint32_t component;
};

// Facets keep their boxes and planes in columns, so that a search for the facets in a box runs in
// SIMD. Lengths are from a node near by, as floats have few digits.
class Facets {
 public:
  explicit Facets(const Vec3& origin) : origin_(origin) {}
  bool empty() const { return facets_.empty(); }
  void add(const Facet& t) {
    const Vec3 n = cross(t.e, t.f), unit = (1 / norm(n)) * n;
    for (int k = 0; k < 3; ++k) {
      low_[k].push_back(float(component(t.low, k) - component(origin_, k)) - kSlack);
      high_[k].push_back(float(component(t.high, k) - component(origin_, k)) + kSlack);
      normal_[k].push_back(float(component(unit, k)));
    }
    height_.push_back(float(dot(unit, t.a - origin_)));
    facets_.push_back(t);
  }
  // Returns the facets whose boxes and planes meet a box, and few others.
  std::vector<const Facet*> in(const Vec3& low, const Vec3& high) const {
    float middle[3], half[3];
    for (int k = 0; k < 3; ++k) {
      middle[k] = float((component(low, k) + component(high, k)) / 2 - component(origin_, k));
      half[k] = float(component(high, k) - component(low, k)) / 2;
    }
    std::vector<std::int32_t> apart(facets_.size());
    for (std::size_t i = 0; i < apart.size(); ++i) {
      float height = -height_[i], most = kSlack;
      std::int32_t out = 0;
      for (int k = 0; k < 3; ++k) {
        out |= (low_[k][i] > middle[k] + half[k]) | (high_[k][i] < middle[k] - half[k]);
        height += normal_[k][i] * middle[k];
        most += std::fabs(normal_[k][i]) * half[k];
      }
      apart[i] = out | (std::fabs(height) > most);
    }
    std::vector<const Facet*> in(facets_.size());
    std::size_t count = 0;
    for (std::size_t i = 0; i < apart.size(); ++i) {
      in[count] = &facets_[i];
      count += apart[i] == 0;
    }
    in.resize(count);
    return in;
  }

 private:
  static constexpr float kSlack = 1e-3f;  // more than floats round by
  Vec3 origin_;
  std::vector<Facet> facets_;
  std::array<std::vector<float>, 3> low_, high_, normal_;
  std::vector<float> height_;  // of the plane over the origin
};

namespace {

constexpr int kView = 2;  // nodes along each axis; a row knows all triangles so far
constexpr int kAcross = 2 * kView + 1;
constexpr int kFine = 8;                      // steps a voxel
constexpr int kSide = 2 * kView * kFine + 1;  // lattice points along each axis
constexpr std::size_t kLooks = 5;             // lines that vote; one may graze an edge

// The line p + t d meets a triangle with corner a and edges e, f where u, v and t are at least 0
// and u + v and t at most 1 (T. Moeller, B. Trumbore, 1997). With s = p - a:
//     det = e . (d x f)   u = s . (d x f) / det   v = d . (s x e) / det   t = f . (s x e) / det
constexpr double kTouch = 1e-7;  // touching an edge counts

// Numbers the triangles by the pieces of the mesh that share no vertex.
std::vector<std::uint32_t> components(const Surface& surface) {
  std::vector<std::uint32_t> parent(surface.vertices.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](std::uint32_t v) {
    for (; parent[v] != v; v = parent[v]) parent[v] = parent[parent[v]];
    return v;
  };
  const auto join = [&](const std::array<std::uint32_t, 3>& t) {
    const std::uint32_t r = root(t[0]);
    parent[root(t[1])] = r;
    parent[root(t[2])] = r;
  };
  for (const auto& t : surface.triangles) join(t);
  for (const auto& t : surface.flat) join(t);
  std::vector<std::uint32_t> out(surface.triangles.size());
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = root(surface.triangles[i][0]);
  return out;
}

// The facets that cross a line, counted by component.
class Crossed {
 public:
  void clear() { counts_.clear(); }
  void add(std::uint32_t component) {
    for (auto& [name, count] : counts_)
      if (name == component) {
        ++count;
        return;
      }
    counts_.emplace_back(component, 1);
  }
  bool none() const { return counts_.empty(); }
  bool some_odd() const {
    return std::any_of(counts_.begin(), counts_.end(), [](const auto& c) { return c.second % 2; });
  }

 private:
  std::vector<std::pair<std::uint32_t, int>> counts_;
};

// Fine steps in the view of a node. A row of lattice points along x is a word.
class Lattice {
 public:
  Lattice(const std::vector<const Facet*>& facets, const Vec3& eye)
      : low_(eye - Vec3{kView, kView, kView}) {
    for (const Facet* t : facets) {
      const Box box = lines_of(*t);
      for (int axis = 0; axis < 3 && !box.empty; ++axis) cut(*t, box, axis);
    }
  }

  // The grid nodes that fine steps from the middle reach, by View's numbers.
  InView walk() {
    std::vector<int> queue;
    const auto wet = [&](int y, int z, std::uint64_t points) {
      std::uint64_t& row = reached_[row_of(y, z)];
      if ((points & ~row) == 0) return;
      row |= points;
      queue.push_back(z * kSide + y);
    };
    wet(kSide / 2, kSide / 2, std::uint64_t{1} << kSide / 2);
    while (!queue.empty()) {
      const int y = queue.back() % kSide, z = queue.back() / kSide;
      queue.pop_back();
      const std::size_t at = row_of(y, z);
      std::uint64_t& row = reached_[at];
      for (std::uint64_t last = 0; last != row;) {
        last = row;
        row |= (row & ~cut_[0][at]) << 1 & kRow;
        row |= row >> 1 & ~cut_[0][at];
      }
      if (y + 1 < kSide) wet(y + 1, z, row & ~cut_[1][at]);
      if (y > 0) wet(y - 1, z, row & ~cut_[1][row_of(y - 1, z)]);
      if (z + 1 < kSide) wet(y, z + 1, row & ~cut_[2][at]);
      if (z > 0) wet(y, z - 1, row & ~cut_[2][row_of(y, z - 1)]);
    }
    InView nodes;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const int x = int(i) % kAcross, y = int(i) / kAcross % kAcross,
                z = int(i) / kAcross / kAcross;
      nodes[i] = reached_[row_of(y * kFine, z * kFine)] >> (x * kFine) & 1;
    }
    return nodes;
  }

 private:
  static constexpr std::uint64_t kRow = (std::uint64_t{1} << kSide) - 1;
  static std::size_t row_of(int y, int z) { return std::size_t(z * kSide + y); }

  // The lattice points in the box of a facet.
  struct Box {
    int first[3], last[3];
    bool empty = false;
  };
  Box lines_of(const Facet& t) const {
    Box box;
    for (int k = 0; k < 3; ++k) {
      const double low = component(t.low, k) - component(low_, k),
                   high = component(t.high, k) - component(low_, k);
      box.empty = box.empty || low > 2 * kView || high < 0;
      box.first[k] = int(std::max(0.0, std::ceil(kFine * low)));
      box.last[k] = int(std::min(kSide - 1.0, std::floor(kFine * high)));
    }
    return box;
  }

  // Cuts the steps along an axis that a facet crosses. On lines along one axis, u, v and t are
  // affine in the line's numbers p and q, so each row of lines has one interval of q.
  void cut(const Facet& t, const Box& box, int axis) {
    const int i = (axis + 1) % 3, j = (axis + 2) % 3;
    double along[3] = {0, 0, 0};
    along[axis] = 2 * kView;
    const Vec3 d{along[0], along[1], along[2]}, h = cross(d, t.f);
    const double det = dot(t.e, h);
    if (det == 0) return;
    const Affine u(*this, t, i, j, (1 / det) * h), v(*this, t, i, j, (1 / det) * cross(t.e, d)),
        at(*this, t, i, j, (1 / det) * cross(t.e, t.f));
    const double inverse[3] = {1 / u.by_q, 1 / v.by_q, -1 / (u.by_q + v.by_q)};
    for (int p = box.first[i]; p <= box.last[i]; ++p) {
      double from = box.first[j], to = box.last[j];
      const auto at_least_0 = [&](double value, double slope, double one_over) {
        if (slope > 0) from = std::max(from, -value * one_over);
        if (slope < 0) to = std::min(to, -value * one_over);
        if (slope == 0 && value < 0) to = -1;
      };
      at_least_0(u.at(p, 0) + kTouch, u.by_q, inverse[0]);
      at_least_0(v.at(p, 0) + kTouch, v.by_q, inverse[1]);
      at_least_0(1 + kTouch - u.at(p, 0) - v.at(p, 0), -u.by_q - v.by_q, inverse[2]);
      if (from > to) continue;  // from may be too large for an int
      for (int q = int(std::ceil(from)); q <= to; ++q) cut_at(axis, i, j, p, q, at.at(p, q));
    }
  }

  // Where a line meets a facet's plane at `at`. A hit at a point cuts the steps on both sides of
  // it.
  void cut_at(int axis, int i, int j, int p, int q, double at) {
    if (!(at >= 0 && at <= 1)) return;
    int point[3];
    point[i] = p, point[j] = q;
    const double step = at * (kSide - 1), touch = 1e-9;
    for (int k = std::max(0, int(std::ceil(step - 1 - touch)));
         k <= std::min(kSide - 2, int(std::floor(step + touch))); ++k) {
      point[axis] = k;
      cut_[axis][row_of(point[1], point[2])] |= std::uint64_t{1} << point[0];
    }
  }

  // dot(c, place of lattice line (p, q) - t.a)
  struct Affine {
    double value, by_p, by_q;
    Affine(const Lattice& l, const Facet& t, int i, int j, const Vec3& c)
        : value(dot(c, l.low_ - t.a)),
          by_p(component(c, i) / kFine),
          by_q(component(c, j) / kFine) {}
    double at(int p, int q) const { return value + by_p * p + by_q * q; }
  };

  Vec3 low_;
  // Bit x of row (y, z): the step from the point along each axis is cut; the point is reached.
  std::array<std::array<std::uint64_t, kSide * kSide>, 3> cut_{};
  std::array<std::uint64_t, kSide * kSide> reached_{};
};

// The step from the middle of a view to its i-th node.
std::array<int, 3> step_to(std::size_t i) {
  return {int(i) % kAcross - kView, int(i) / kAcross % kAcross - kView,
          int(i) / kAcross / kAcross - kView};
}

Vec3 along(std::size_t i) {
  const std::array<int, 3> d = step_to(i);
  return {double(d[0]), double(d[1]), double(d[2])};
}

// The nodes of a view, nearest first: short lines cross little.
std::array<std::size_t, kInView> nearest_first() {
  std::array<std::size_t, kInView> order;
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [](std::size_t a, std::size_t b) {
    const auto squared = [](const std::array<int, 3>& d) {
      return d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    };
    return squared(step_to(a)) < squared(step_to(b));
  });
  return order;
}

// A facet as one eye sees it: det, u det, v det and t det of the line from the eye to d are
// dot(n, d), dot(m, d), dot(q, d) and w.
struct Seen {
  Vec3 n, m, q;
  double w;
  std::uint32_t component;
  InView may_meet;  // lines that its box does not rule out

  bool meets(const Vec3& d) const {
    const double det = dot(n, d), sign = det < 0 ? -1 : 1, size = sign * det;
    const double u = sign * dot(m, d), v = sign * dot(q, d), at = sign * w, touch = kTouch * size;
    return size > 0 && u >= -touch && v >= -touch && u + v <= size + touch && at >= 0 && at <= size;
  }
};

// The lines of a view whose end is at least k along an axis, or at most -k: k 0 to kView.
struct Ends {
  InView at_least[3][kView + 1], at_most[3][kView + 1];
  Ends() {
    for (std::size_t i = 0; i < kInView; ++i)
      for (std::size_t axis = 0; axis < 3; ++axis)
        for (int k = 0; k <= kView; ++k) {
          const int d = step_to(i)[axis];
          at_least[axis][k][i] = k == 0 || d >= k;
          at_most[axis][k][i] = k == 0 || d <= -k;
        }
  }
};

// Returns facets as the eye sees them.
std::vector<Seen> seen_from(const Vec3& eye, const std::vector<const Facet*>& facets) {
  static const Ends ends;
  std::vector<Seen> seen;
  seen.reserve(facets.size());
  for (const Facet* t : facets) {
    InView may_meet;
    may_meet.set();
    for (int k = 0; k < 3; ++k) {
      const double low = component(t->low, k) - component(eye, k),
                   high = component(t->high, k) - component(eye, k);
      // A line must end at least so far up, or down.
      const int beyond = low > 0 ? int(std::ceil(std::min(low, double(kView)))) : 0,
                before = high < 0 ? int(std::ceil(std::min(-high, double(kView)))) : 0;
      may_meet &= ends.at_least[k][beyond] & ends.at_most[k][before];
    }
    const Vec3 s = eye - t->a, q = cross(s, t->e);
    seen.push_back({cross(t->f, t->e), cross(t->f, s), q, dot(t->f, q), t->component, may_meet});
  }
  return seen;
}

// Returns those of the lines from the eye that meet no facet.
InView clear_lines(const std::vector<Seen>& seen, InView lines) {
  for (const Seen& t : seen) {
    const InView tried = lines & t.may_meet;
    if (tried.none()) continue;
    for (std::size_t i = tried._Find_first(); i < kInView; i = tried._Find_next(i))
      if (t.meets(along(i))) lines.reset(i);
    if (lines.none()) break;
  }
  return lines;
}

// The lines from a node to the nearest reached nodes vote on its side.
struct Votes {
  InView lines;     // up to kLooks
  bool clear;       // the last of them crosses nothing
  std::size_t odd;  // lines that cross a component an odd number of times
};
Votes vote(const Facets& facets, const Vec3& eye, const InView& view) {
  static const std::array<std::size_t, kInView> order = nearest_first();
  std::array<std::size_t, kLooks> lines;
  std::size_t count = 0;
  Vec3 low = eye, high = eye;
  for (const std::size_t i : order) {
    if (!view[i]) continue;
    if (count == kLooks) break;
    lines[count++] = i;
    const Vec3 end = eye + along(i);
    low = min(low, end), high = max(high, end);
  }
  const std::vector<Seen> seen = seen_from(eye, facets.in(low, high));
  Votes votes{{}, false, 0};
  Crossed crossed;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = lines[k];
    votes.lines.set(i);
    crossed.clear();
    for (const Seen& t : seen)
      if (t.may_meet[i] && t.meets(along(i))) crossed.add(t.component);
    votes.clear = crossed.none();
    votes.odd += crossed.some_odd();
    if (votes.clear || 2 * votes.odd > kLooks) break;
  }
  return votes;
}

}  // namespace

static_assert(kInView == kAcross * kAcross * kAcross);

Pockets::Pockets(const Surface& surface, const Grid& grid, const NarrowBand& band,
                 const std::vector<RowNodes>& candidates, unsigned threads)
    : surface_(surface), grid_(grid), band_(band), threads_(threads) {
  if (!candidates.empty()) component_ = components(surface);
  for (const RowNodes& row : candidates) {
    rows_.push_back({row.row, {}});
    for (std::size_t n = 0; n < kBrickSamples; ++n)
      if (row.nodes.get(n)) rows_.back().nodes.push_back({std::uint16_t(n), false, {}, {}});
  }
}

std::vector<RowNodes> Pockets::reached(const Masks& wet, By by) {
  std::vector<RowNodes> out(rows_.size());
  sched::parallel_for(rows_.size(), threads_,
                      [&](std::size_t i) { out[i] = judge(rows_[i], wet, by); });
  std::erase_if(out, [](const RowNodes& row) { return !row.nodes.any(); });
  std::erase_if(rows_, [](const Row& row) { return row.nodes.empty(); });
  return out;
}

// The reached nodes of a brick and of two more on each side: bit x + 2 of line (y + 2, z + 2).
class Pockets::Window {
 public:
  Window(const Grid& grid, const NarrowBand& band, const std::array<int, 3>& brick,
         const Masks& wet) {
    for (std::size_t i = 0; i < 27; ++i) {
      const int by[3] = {int(i % 3) - 1, int(i / 3 % 3) - 1, int(i / 9) - 1};
      std::array<int, 3> at;
      bool in = true;
      for (std::size_t k = 0; k < 3; ++k) {
        at[k] = brick[k] + by[k];
        in = in && at[k] >= 0 && at[k] < grid.bricks[k];
      }
      const std::int32_t row = in ? band.row[grid.cell(at[0], at[1], at[2])] : -1;
      if (row >= 0) add(wet[std::size_t(row)], by);
    }
    const double most = grid.reach() * grid.reach();
    for (std::size_t i = 0; i < kInView; ++i) within_[i] = dot(along(i), along(i)) <= most;
  }
  // Those in the view of a node of the brick.
  InView about(std::size_t node) const {
    const std::size_t x = node % 8, y = node / 8 % 8, z = node / 64;
    InView view;
    for (std::size_t k = kAcross; k-- > 0;) {
      std::uint32_t layer = 0;
      for (std::size_t j = kAcross; j-- > 0;)
        layer = layer << kAcross | (line_[z + k][y + j] >> x & ((1u << kAcross) - 1));
      view = view << kAcross * kAcross | InView(layer);
    }
    return view & within_;
  }

 private:
  static constexpr int kLines = 8 + 2 * kView;
  void add(const NodeMask& nodes, const int (&by)[3]) {
    for (int z = std::max(0, -kView - 8 * by[2]); z < std::min(8, 8 + kView - 8 * by[2]); ++z)
      for (int y = std::max(0, -kView - 8 * by[1]); y < std::min(8, 8 + kView - 8 * by[1]); ++y) {
        const std::uint32_t eight = nodes.z[std::size_t(z)] >> (8 * y) & 0xff;
        line_[z + 8 * by[2] + kView][y + 8 * by[1] + kView] |=
            by[0] < 0 ? eight >> (8 - kView) : eight << (8 * by[0] + kView);
      }
  }
  std::uint32_t line_[kLines][kLines] = {};
  InView within_;  // the nodes that are not too far from the middle
};

// Finds the nodes that are reached, and drops those and the nodes that are inside.
RowNodes Pockets::judge(Row& row, const Masks& wet, By by) const {
  RowNodes found{row.row, {}};
  const std::array<int, 3> brick = grid_.place(band_.cell[row.row]);
  const Window window(grid_, band_, brick, wet);
  const std::array<int, 3> first = {8 * brick[0], 8 * brick[1], 8 * brick[2]};
  Facets facets({double(first[0]), double(first[1]), double(first[2])});  // in view of the row
  std::erase_if(row.nodes, [&](Node& node) {
    if (wet[row.row].get(node.place)) return true;
    const std::array<int, 3> p = {first[0] + node.place % 8, first[1] + node.place / 8 % 8,
                                  first[2] + node.place / 64};
    const InView view = window.about(node.place);
    if (by == By::lines && view == node.view) return false;
    node.view = view;
    Side side = (node.linked & view).any() ? Side::outside : Side::unknown;
    if (!node.walked && view.any()) {
      if (facets.empty()) add_facets(row.row, facets);
      side = look(facets, p, by, node);
    }
    if (side == Side::outside) found.nodes.set(node.place);
    return side != Side::unknown;
  });
  return found;
}

// Adds the facets in view of the nodes of a row.
void Pockets::add_facets(std::size_t row, Facets& facets) const {
  const Tiles& tiles = band_.tiles;
  const std::array<int, 3> brick = grid_.place(band_.cell[row]);
  const std::size_t tile = tiles.of(brick);
  const Vec3 slack{1e-6, 1e-6, 1e-6}, sight{kView, kView, kView};
  const Vec3 first{8.0 * brick[0], 8.0 * brick[1], 8.0 * brick[2]};
  const Vec3 from = first - sight, to = first + Vec3{7, 7, 7} + sight;
  for (std::size_t i = tiles.first[tile]; i < tiles.first[tile + 1]; ++i) {
    if (!(tiles.near[i] >> Tiles::bit(brick) & 1)) continue;
    const std::uint32_t triangle = tiles.triangle[i];
    const auto& t = surface_.triangles[triangle];
    const Vec3 &a = surface_.vertices[t[0]], &b = surface_.vertices[t[1]],
               &c = surface_.vertices[t[2]];
    const Vec3 low = min(min(a, b), c) - slack, high = max(max(a, b), c) + slack;
    if (low.x > to.x || low.y > to.y || low.z > to.z || high.x < from.x || high.y < from.y ||
        high.z < from.z)
      continue;
    facets.add({a, b - a, c - a, low, high, component_[triangle]});
  }
}

// Looks along lines to the reached nodes in view; where they do not decide, may let the node walk.
Pockets::Side Pockets::look(const Facets& facets, const std::array<int, 3>& p, By by,
                            Node& node) const {
  const Vec3 eye{double(p[0]), double(p[1]), double(p[2])};
  const Votes votes = vote(facets, eye, node.view);
  if (votes.clear) return Side::outside;
  if (2 * votes.odd > kLooks) return Side::inside;
  const Vec3 sight{kView, kView, kView};
  const std::vector<const Facet*> near = facets.in(eye - sight, eye + sight);
  const std::vector<Seen> seen = seen_from(eye, near);
  if (clear_lines(seen, node.view & ~votes.lines).any()) return Side::outside;
  if (by == By::lines || 2 * votes.odd > votes.lines.count()) return Side::unknown;
  node.walked = true;
  node.linked = Lattice(near, eye).walk();
  if ((node.linked & node.view).any()) return Side::outside;
  node.linked |= clear_lines(seen, ~(node.linked | node.view));
  return Side::unknown;
}

}  // namespace h6::io::bake
