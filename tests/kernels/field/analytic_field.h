// SPDX-License-Identifier: Apache-2.0
// analytic_field.h - an h6FieldDef sampled from a formula, and its hot layout. In voxels
// throughout.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include "kernels/field/field_layout.h"

namespace h6::kernels::test {

struct Point {
  double x, y, z;
};
using Distance = std::function<double(const Point&)>;

inline double sphere(const Point& p, const Point& c, double radius) {
  return std::sqrt((p.x - c.x) * (p.x - c.x) + (p.y - c.y) * (p.y - c.y) +
                   (p.z - c.z) * (p.z - c.z)) -
         radius;
}

inline double box(const Point& p, const Point& c, const Point& half) {
  const double q[3] = {std::fabs(p.x - c.x) - half.x, std::fabs(p.y - c.y) - half.y,
                       std::fabs(p.z - c.z) - half.z};
  double outside2 = 0, inside = q[0];
  for (double v : q) {
    outside2 += std::max(v, 0.0) * std::max(v, 0.0);
    inside = std::max(inside, v);
  }
  return inside > 0 ? std::sqrt(outside2) : inside;
}

// Spheres, boxes and near-points, apart from each other: the least of their distances is the true
// distance of the union, on both sides.
inline double clutter(const Point& p) {
  return std::min({sphere(p, {40, 40, 40}, 22.3), sphere(p, {100, 30, 90}, 9.7),
                   box(p, {90, 92, 40}, {18.2, 14.1, 21.7}), box(p, {30, 100, 100}, {20, 0.9, 16}),
                   sphere(p, {20, 84, 20}, 0.2), sphere(p, {70, 60, 104}, 0.6)});
}

class AnalyticField {
 public:
  // Into how many parts the cell that begins at these nodes is cut: 1, 2 or 4.
  using Cut = std::function<int(int, int, int)>;
  // `bound_share`: the far grid holds the true distance times a factor from [bound_share, 1]. Finer
  // samples are exact, so the field jumps where a cut cell meets another.
  AnalyticField(std::int32_t bx, std::int32_t by, std::int32_t bz, const Distance& distance,
                double band = 3.0, double voxel = 0.001, double bound_share = 1.0,
                const Cut& cut = {})
      : distance_(distance) {
    def_ = h6FieldDef{};
    def_.voxel_size = voxel;
    def_.band = band * voxel;
    def_.bricks[0] = bx, def_.bricks[1] = by, def_.bricks[2] = bz;
    for (std::int32_t z = 0; z < bz; ++z)
      for (std::int32_t y = 0; y < by; ++y)
        for (std::int32_t x = 0; x < bx; ++x) add_brick(x, y, z, band);
    std::uint32_t state = 1;
    for (std::int32_t z = 0; z <= bz; ++z)
      for (std::int32_t y = 0; y <= by; ++y)
        for (std::int32_t x = 0; x <= bx; ++x) {
          state = state * 1664525u + 1013904223u;
          const double share = bound_share + (1 - bound_share) * (state >> 8) / double(1 << 24);
          const double d = distance_({8.0 * x, 8.0 * y, 8.0 * z});
          // Rounded to float towards 0: a bound stays a bound.
          far_.push_back(std::nextafter(static_cast<float>(d * share * voxel), 0.0f));
        }
    def_.brick_index = index_.data();
    def_.samples = samples_.data();
    def_.brick_count = samples_.size() / 512;
    def_.far_grid = far_.data();
    if (cut) add_finer(cut);
    lay_out();
  }
  AnalyticField(const AnalyticField&) = delete;

  const h6FieldDef& def() const { return def_; }
  FieldView view() const {
    return {{def_.bricks[0], def_.bricks[1], def_.bricks[2]},
            table_.data(),
            bricks_.data(),
            far_nodes_.data(),
            layout_band(def_),
            cuts_.data(),
            fine()};
  }
  double distance(const Point& p) const { return distance_(p); }
  double last(int axis) const { return 8.0 * def_.bricks[axis] - 1; }
  // Whether a point of the grid lies in a brick.
  bool near(const Point& p) const {
    const auto b = [](double v) { return static_cast<std::int32_t>(v) / 8; };
    return table_[(b(p.z) * std::size_t(def_.bricks[1]) + b(p.y)) * def_.bricks[0] + b(p.x)] >= 0;
  }
  std::size_t brick_count() const { return def_.brick_count; }

 private:
  void add_brick(std::int32_t a, std::int32_t b, std::int32_t c, double band) {
    // Unit cells that touch the brick's nodes reach from 8a-1 to 8a+8.
    const double centre = distance_({8 * a + 3.5, 8 * b + 3.5, 8 * c + 3.5});
    if (std::fabs(centre) > band + 4.5 * std::sqrt(3.0)) return index_.push_back(-1);
    index_.push_back(static_cast<std::int32_t>(samples_.size() / 512));
    for (int z = 0; z < 8; ++z)
      for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 8; ++x) {
          const double d = distance_({8.0 * a + x, 8.0 * b + y, 8.0 * c + z});
          samples_.push_back(static_cast<float>(d * def_.voxel_size));
        }
  }

  void add_finer(const Cut& cut) {
    const std::int32_t bx = def_.bricks[0], by = def_.bricks[1];
    refined_.resize(def_.brick_count);
    for (std::size_t slot = 0; slot < index_.size(); ++slot) {
      if (index_[slot] < 0) continue;
      const int at[3] = {int(slot) % bx, int(slot) / bx % by, int(slot) / bx / by};
      std::vector<std::int32_t> cells;
      for (int c = 0; c < 512; ++c)
        cells.push_back(
            cut_cell(cut, 8 * at[0] + c % 8, 8 * at[1] + c / 8 % 8, 8 * at[2] + c / 64));
      const bool any = std::any_of(cells.begin(), cells.end(), [](auto c) { return c != 0; });
      refined_[std::size_t(index_[slot])] = any ? std::int32_t(fine_index_.size() / 512) : -1;
      if (any) fine_index_.insert(fine_index_.end(), cells.begin(), cells.end());
    }
    def_.refined = refined_.data();
    def_.fine_index = fine_index_.data();
    def_.refined_count = fine_index_.size() / 512;
    def_.halves = halves_.data(), def_.half_count = halves_.size() / 27;
    def_.quarters = quarters_.data(), def_.quarter_count = quarters_.size() / 125;
  }
  std::int32_t cut_cell(const Cut& cut, int x, int y, int z) {
    const int factor = cut(x, y, z), side = factor + 1;
    if (factor == 1) return 0;
    std::vector<float>& to = factor == 2 ? halves_ : quarters_;
    for (int n = 0; n < side * side * side; ++n)
      to.push_back(float(def_.voxel_size * distance_({x + double(n % side) / factor,
                                                      y + double(n / side % side) / factor,
                                                      z + double(n / side / side) / factor})));
    return factor == 2 ? std::int32_t(halves_.size() / 27) : -std::int32_t(quarters_.size() / 125);
  }

  const std::int16_t* fine() const { return bricks_.data() + fine_at_; }
  std::int16_t* fine() { return bricks_.data() + fine_at_; }
  void lay_out() {
    const FieldLayoutSize size = field_layout_size(def_);
    table_.resize(index_.size());
    fine_at_ = size.bricks * kBrickStride;
    bricks_.assign(fine_at_ + (size.fine_units + 1) * kFineUnit, 0x7fff);
    far_nodes_.assign(size.far_cells * 8, 0x7fff);
    layout_table(def_, table_.data());
    cuts_.assign(size.refined * kCutStride + 2, 0x7fff);
    layout_cuts(def_, table_.data(), cuts_.data());
    for (std::size_t row = 0; row < index_.size() / def_.bricks[0]; ++row)
      layout_row(def_, table_.data(), row, bricks_.data(), far_nodes_.data());
    for (std::size_t slot = 0; slot < index_.size(); ++slot)
      layout_fine(def_, table_.data(), cuts_.data(), slot, fine());
  }

  Distance distance_;
  h6FieldDef def_;
  std::vector<std::int32_t> index_, table_, refined_, fine_index_;
  std::vector<float> samples_, far_, halves_, quarters_;
  std::vector<std::int16_t> bricks_, far_nodes_;
  std::size_t fine_at_ = 0;
  std::vector<std::uint16_t> cuts_;
};

// Cells near the surface of the clutter, cut into 1, 2 and 4 as if by chance.
inline int scattered_cut(int x, int y, int z) {
  if (std::fabs(clutter({x + 0.5, y + 0.5, z + 0.5})) > 2.5) return 1;
  const std::uint32_t mixed =
      std::uint32_t(x) * 73856093 ^ std::uint32_t(y) * 19349663 ^ std::uint32_t(z) * 83492791;
  return 1 << (mixed >> 9) % 3;
}

inline constexpr Affine kIdentity = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

inline const AnalyticField& clutter_field() {
  static const AnalyticField field(16, 17, 18, clutter);
  return field;
}
// The same with some cells cut.
inline const AnalyticField& refined_field() {
  static const AnalyticField field(16, 17, 18, clutter, 3.0, 0.001, 1.0, scattered_cut);
  return field;
}

}  // namespace h6::kernels::test
