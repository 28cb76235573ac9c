// SPDX-License-Identifier: Apache-2.0
// blue_noise.cpp - rounds of parallel dart throwing whose result does not depend on threads. Points
// lie in grid cells at least one radius wide. A cell has one of 27 colours, by its place modulo 3,
// and cells of one colour are too far apart to exclude each other's points (phase groups, L.-Y.
// Wei, "Parallel Poisson disk sampling", 2008).
#include "io/shell/blue_noise.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "io/file/mix.h"
#include "io/file/radix_sort.h"
#include "sched/parallel_for.h"

namespace h6::io {
namespace {

constexpr int axis_bits = 21;                     // of a cell's key, for each axis
constexpr double cells_across = double(1 << 20);  // most cells, so that keys have room at the rim
constexpr std::size_t cells_a_slice = 256;

// Normals with a smaller cosine are on two sides: 134 degrees, a wedge of 46. Thread flanks (60)
// and blunter edges keep their distance as on one surface. The sides of sharper edges would starve
// each other if they did.
constexpr float opposed = -0.7f;
// Two sides keep this share of the distance, so that the points of all sides together are blue
// noise and those of a sheet's two sides do not coincide.
constexpr float across = 0.75f;

struct Spot {  // 32 bytes: a cell's points lie together
  float p[3], n[3];
  float gap;  // distance to a known accepted point [m]; on another side, / `across`
  std::uint32_t id;
};

struct Row {  // accepted neighbours: cells [first, first + count) along x
  std::uint32_t first, count;
};

struct Cell {
  std::uint32_t first = 0, count = 0, accepted = 0;  // accepted spots come first
  float open = 0;                                    // largest gap of the rest
};

struct Bounds {
  double low[3], extent = 0;
};

Bounds bounds_of(std::span<const OrientedPoint> points) {
  Bounds box{};
  double high[3];
  for (int a = 0; a < 3; ++a) box.low[a] = high[a] = points[0].p[a];
  for (const OrientedPoint& q : points) {
    for (int a = 0; a < 3; ++a) {
      box.low[a] = std::min(box.low[a], double(q.p[a]));
      high[a] = std::max(high[a], double(q.p[a]));
    }
  }
  for (int a = 0; a < 3; ++a) box.extent = std::max(box.extent, high[a] - box.low[a]);
  return box;
}

std::uint64_t key_at(const Bounds& box, double inverse_cell, const float p[3]) {
  std::uint64_t key = 0;
  for (int a = 2; a >= 0; --a) {
    const auto place = std::uint64_t((double(p[a]) - box.low[a]) * inverse_cell) + 1;
    key = (key << axis_bits) | place;
  }
  return key;
}

class Thrower {
 public:
  Thrower(std::span<const OrientedPoint> points, const Thinning& options)
      : points_(points),
        options_(options),
        box_(bounds_of(points)),
        accepted_(points.size(), 0),
        chosen_(options.kept) {
    std::fill_n(accepted_.begin(), options.kept, 1);
  }

  Thinned run();

 private:
  bool alive() const { return io::alive(options_.pulse); }
  bool build_grid(double radius);
  void find_cells();
  void link_cells();
  void colour_cells();
  void place_spots();
  void round(double radius);
  void throw_at(Cell& cell, std::size_t cell_index, float radius, std::size_t from, std::size_t to,
                std::vector<std::uint32_t>& fresh);
  bool leaves_room(const Spot& other, const Spot& spot) const;
  float nearest_blocker(std::size_t cell_index, const Spot& spot, float radius) const;
  void forget_all();
  void drop_excess();
  void fill_up();
  double next_radius(double radius) const;
  Thinned finish(double spacing, bool cancelled = false) const;
  template <class Body>
  void slices(std::size_t count, const Body& body) const;

  std::span<const OrientedPoint> points_;
  const Thinning& options_;
  Bounds box_;
  std::vector<char> accepted_;  // by point
  std::size_t chosen_ = 0;
  std::vector<std::uint32_t> fresh_;  // accepted in the last round
  double cell_ = 0;
  RawVector<Spot> spots_;
  std::vector<float> gap_;  // by point, kept when the grid is rebuilt; empty: not known
  std::vector<Cell> cells_;
  std::vector<std::uint64_t> keys_;  // of cells, ascending
  std::vector<std::array<Row, 9>> rows_;
  std::array<std::vector<std::uint32_t>, 27> colours_;
  KeyedIndices order_, spare_;
};

template <class Body>
void Thrower::slices(std::size_t count, const Body& body) const {
  const std::size_t pieces = (count + cells_a_slice - 1) / cells_a_slice;
  const auto piece = [&](std::size_t i) {
    if (!alive()) return;
    body(i, i * cells_a_slice, std::min(count, (i + 1) * cells_a_slice));
  };
  if (pieces < 2) {
    for (std::size_t i = 0; i < pieces; ++i) piece(i);
  } else {
    sched::parallel_for(pieces, options_.threads, piece);
  }
}

// Returns false when the user cancelled; the grid is then undefined.
bool Thrower::build_grid(double radius) {
  // A little wider than the radius: distances are compared in float.
  cell_ = std::max(radius * 1.0001, box_.extent / cells_across);
  find_cells();
  if (!alive()) return false;
  link_cells();
  if (!alive()) return false;
  colour_cells();
  place_spots();
  return alive();
}

// Points grouped by cell; cells in ascending order of key: z, then y, then x.
void Thrower::find_cells() {
  order_.resize(points_.size());
  slices(points_.size(), [&](std::size_t, std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) {
      order_[i] = {key_at(box_, 1 / cell_, points_[i].p), std::uint32_t(i)};
    }
  });
  radix_sort(order_, spare_, options_.threads, options_.pulse);
  cells_.clear();
  keys_.clear();
  for (std::size_t i = 0; i < order_.size(); ++i) {
    if (i % 65536 == 0 && !alive()) return;
    if (i == 0 || order_[i].key != order_[i - 1].key) {
      keys_.push_back(order_[i].key);
      cells_.push_back({std::uint32_t(i), 0, 0, 0});
    }
    ++cells_.back().count;
  }
}

// Finds the cells in the nine rows around each cell. Keys are sorted, so each row's place only
// moves forward.
void Thrower::link_cells() {
  rows_.resize(cells_.size());
  slices(cells_.size(), [&](std::size_t, std::size_t from, std::size_t to) {
    for (int row = 0; row < 9; ++row) {
      const std::int64_t shift =
          (std::int64_t(row / 3 - 1) << (2 * axis_bits)) + (std::int64_t(row % 3 - 1) << axis_bits);
      const auto low_key = [&](std::size_t c) { return keys_[c] + std::uint64_t(shift - 1); };
      std::size_t at =
          std::size_t(std::lower_bound(keys_.begin(), keys_.end(), low_key(from)) - keys_.begin());
      for (std::size_t c = from; c < to; ++c) {
        const std::uint64_t low = low_key(c);
        while (at < keys_.size() && keys_[at] < low) ++at;
        std::uint32_t count = 0;
        while (count < 3 && at + count < keys_.size() && keys_[at + count] <= low + 2) ++count;
        rows_[c][row] = {std::uint32_t(at), count};
      }
    }
  });
}

void Thrower::colour_cells() {
  constexpr std::uint64_t mask = (1u << axis_bits) - 1;
  for (auto& list : colours_) list.clear();
  for (std::size_t c = 0; c < keys_.size(); ++c) {
    if (c % 65536 == 0 && !alive()) return;
    const std::uint64_t key = keys_[c];
    const std::uint64_t x = key & mask, y = (key >> axis_bits) & mask, z = key >> (2 * axis_bits);
    colours_[(x % 3) + 3 * (y % 3) + 9 * (z % 3)].push_back(std::uint32_t(c));
  }
}

// Order within a cell: accepted points first, then a random order that is the same in every grid.
void Thrower::place_spots() {
  spots_.resize(points_.size());
  slices(cells_.size(), [&](std::size_t, std::size_t from, std::size_t to) {
    std::vector<std::pair<std::uint64_t, std::uint32_t>> shuffled;
    for (std::size_t c = from; c < to; ++c) {
      Cell& cell = cells_[c];
      shuffled.clear();
      for (std::uint32_t i = 0; i < cell.count; ++i) {
        const std::uint32_t id = order_[cell.first + i].index;
        const std::uint64_t late = accepted_[id] ? 0 : std::uint64_t{1} << 63;
        shuffled.push_back({late | (mix(options_.seed, id) >> 1), id});
        cell.accepted += accepted_[id] ? 1 : 0;
      }
      std::sort(shuffled.begin(), shuffled.end());
      for (std::uint32_t i = 0; i < cell.count; ++i) {
        const std::uint32_t id = shuffled[i].second;
        const OrientedPoint& q = points_[id];
        const float gap = gap_.empty() ? INFINITY : gap_[id];
        spots_[cell.first + i] = {{q.p[0], q.p[1], q.p[2]}, {q.n[0], q.n[1], q.n[2]}, gap, id};
        if (i >= cell.accepted) cell.open = std::max(cell.open, gap);
      }
    }
  });
}

// Whether an accepted point leaves another one its place although it is near.
bool Thrower::leaves_room(const Spot& other, const Spot& spot) const {
  const float* n = spot.n;
  const float above = n[0] * (other.p[0] - spot.p[0]) + n[1] * (other.p[1] - spot.p[1]) +
                      n[2] * (other.p[2] - spot.p[2]);
  return above > float(options_.tolerance) ||
         other.n[0] * n[0] + other.n[1] * n[1] + other.n[2] * n[2] < opposed;
}

// The distance to an accepted point nearer than `radius`, or infinity. The search ends at the first
// point that is near enough to exclude this spot for some rounds, not at the nearest one.
float Thrower::nearest_blocker(std::size_t cell_index, const Spot& spot, float radius) const {
  const float far2 = radius * radius, enough2 = 0.6f * far2;
  float best2 = far2;
  for (const Row& row : rows_[cell_index]) {
    for (std::uint32_t c = row.first; c < row.first + row.count; ++c) {
      const Spot* other = &spots_[cells_[c].first];
      for (const Spot* end = other + cells_[c].accepted; other != end; ++other) {
        const float dx = other->p[0] - spot.p[0], dy = other->p[1] - spot.p[1],
                    dz = other->p[2] - spot.p[2];
        float d2 = dx * dx + dy * dy + dz * dz;
        if (!(d2 < best2)) continue;
        if (options_.tolerance > 0) {
          if (leaves_room(*other, spot)) continue;
        } else if (options_.both_sides &&
                   other->n[0] * spot.n[0] + other->n[1] * spot.n[1] + other->n[2] * spot.n[2] <
                       opposed) {
          d2 *= 1 / (across * across);
          if (!(d2 < best2)) continue;
        }
        best2 = d2;
        if (best2 < enough2) return std::sqrt(best2);
      }
    }
  }
  return best2 < far2 ? std::sqrt(best2) : INFINITY;
}

// Tries spots [from, to) of the list of spots that were not yet accepted when the round began.
void Thrower::throw_at(Cell& cell, std::size_t cell_index, float radius, std::size_t from,
                       std::size_t to, std::vector<std::uint32_t>& fresh) {
  for (std::size_t i = std::max<std::size_t>(from, cell.accepted); i < to; ++i) {
    Spot& spot = spots_[cell.first + i];
    if (spot.gap < radius) continue;
    const float blocker = nearest_blocker(cell_index, spot, radius);
    if (blocker < INFINITY) {
      spot.gap = blocker;
      continue;
    }
    fresh.push_back(spot.id);
    std::swap(spot, spots_[cell.first + cell.accepted]);
    ++cell.accepted;
  }
}

// Accepts spots that keep `radius` from all accepted ones, until no spot is left that does. A few
// spots per cell come first, then all: if a cell chose among all its spots before its neighbours,
// the grid would show.
void Thrower::round(double radius) {
  fresh_.clear();
  std::vector<std::vector<std::uint32_t>> fresh;
  const auto r = float(radius);
  const std::size_t steps[] = {1, 4, SIZE_MAX};
  std::size_t done = 0;
  const bool first = chosen_ == options_.kept;
  for (const std::size_t step : steps) {
    if (!first && step != SIZE_MAX) continue;
    for (std::size_t k = 0; k < colours_.size(); ++k) {
      const auto& list = colours_[(k * 10 + std::min<std::size_t>(step, 7) * 5) % 27];
      fresh.assign((list.size() + cells_a_slice - 1) / cells_a_slice, {});
      slices(list.size(), [&](std::size_t slice, std::size_t from, std::size_t to) {
        for (std::size_t i = from; i < to; ++i) {
          Cell& cell = cells_[list[i]];
          if (cell.open < r) continue;
          throw_at(cell, list[i], r, done, std::min<std::size_t>(step, cell.count), fresh[slice]);
          if (step != SIZE_MAX) continue;
          cell.open = 0;
          for (std::uint32_t s = cell.accepted; s < cell.count; ++s) {
            cell.open = std::max(cell.open, spots_[cell.first + s].gap);
          }
        }
      });
      if (!alive()) return;
      for (const auto& part : fresh) fresh_.insert(fresh_.end(), part.begin(), part.end());
    }
    done = step;
  }
  for (const std::uint32_t id : fresh_) accepted_[id] = 1;
  chosen_ += fresh_.size();
}

void Thrower::forget_all() {
  std::fill(accepted_.begin(), accepted_.end(), 0);
  chosen_ = 0;
  gap_.clear();
}

// Drops points if there are too many. Only points of the last round go, so that the round before it
// still covers all.
void Thrower::drop_excess() {
  const std::size_t excess = chosen_ - options_.target;
  const auto later = [&](std::uint32_t a, std::uint32_t b) {
    const auto ha = mix(options_.seed ^ 0x5bd1, a), hb = mix(options_.seed ^ 0x5bd1, b);
    return ha != hb ? ha < hb : a < b;
  };
  std::nth_element(fresh_.begin(), fresh_.begin() + std::ptrdiff_t(excess), fresh_.end(), later);
  for (std::size_t i = 0; i < excess; ++i) accepted_[fresh_[i]] = 0;
  chosen_ = options_.target;
}

// Fills up with points that coincide with chosen ones: no radius separates them.
void Thrower::fill_up() {
  order_.clear();
  for (std::uint32_t id = 0; id < accepted_.size(); ++id) {
    if (id % 65536 == 0 && !alive()) return;
    if (!accepted_[id]) order_.push_back({mix(options_.seed, id), id});
  }
  radix_sort(order_, spare_, options_.threads, options_.pulse);
  if (!alive()) return;
  for (std::size_t i = 0; chosen_ < options_.target; ++i, ++chosen_) accepted_[order_[i].index] = 1;
}

// The next radius. On a surface the count grows with 1/r^2; steps are smaller than that suggests,
// so that the last round adds little and most points keep the larger distance.
double Thrower::next_radius(double radius) const {
  const double share = double(chosen_) / double(options_.target);
  return radius * std::clamp(std::pow(share, 0.4), 0.5, 0.985);
}

Thinned Thrower::finish(double spacing, bool cancelled) const {
  Thinned out;
  out.spacing = spacing;
  out.cancelled = cancelled;
  if (cancelled) return out;
  out.chosen.reserve(chosen_);
  for (std::uint32_t id = 0; id < accepted_.size(); ++id) {
    if (id % 65536 == 0 && !alive()) break;
    if (accepted_[id]) out.chosen.push_back(id);
  }
  out.cancelled = !alive();
  return out;
}

Thinned Thrower::run() {
  const double smallest = box_.extent / cells_across;
  double radius =
      options_.fixed_radius ? options_.first_radius : std::max(options_.first_radius, 2 * smallest);
  for (;;) {
    if (options_.pulse) {
      options_.pulse->share(double(chosen_) / double(std::max<std::size_t>(options_.target, 1)));
    }
    if (!alive()) return finish(0, true);
    if (!options_.fixed_radius && !(radius > smallest)) break;
    if (cell_ == 0 || radius > cell_ || radius < 0.5 * cell_) {
      if (chosen_ > 0 && cell_ > 0) {
        gap_.resize(points_.size());
        for (const Spot& spot : spots_) gap_[spot.id] = spot.gap;
      }
      if (!build_grid(radius)) return finish(0, true);
    }
    const bool first = chosen_ == 0;
    round(radius);
    if (!alive()) return finish(0, true);
    if (options_.fixed_radius || chosen_ == options_.target) return finish(radius);
    if (chosen_ < options_.target) {
      radius = next_radius(radius);
    } else if (first &&
               radius < 4 * box_.extent) {  // far too many: start again with a larger radius
      const double share = double(chosen_) / double(options_.target);
      radius *= std::clamp(1.1 * std::sqrt(share), 1.2, 8.0);
      forget_all();
      cell_ = 0;
    } else {
      drop_excess();
      return finish(radius);
    }
  }
  fill_up();
  return finish(0, !alive());
}

}  // namespace

Thinned thin_out(std::span<const OrientedPoint> points, const Thinning& options) {
  Thinned all;
  if (points.empty()) return all;
  if (!options.fixed_radius && options.target >= points.size()) {
    for (std::uint32_t i = 0; i < points.size(); ++i) all.chosen.push_back(i);
    return all;
  }
  return Thrower(points, options).run();
}

}  // namespace h6::io
