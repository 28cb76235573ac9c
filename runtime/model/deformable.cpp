// SPDX-License-Identifier: Apache-2.0
// deformable.cpp - checks how a shell bends, and lays its modes and its internal force out for the
// kernels. METHOD.md, Sec. 10.
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "kernels/bend/bend_points.h"
#include "kernels/bend/bend_sums.h"
#include "runtime/model/model.h"

namespace h6 {
namespace {

// Monomials of degree 1, 2, 3.
struct Counts {
  std::size_t linear, quadratic, cubic;
  explicit Counts(std::size_t r)
      : linear(r), quadratic(r * (r + 1) / 2), cubic(r * (r + 1) * (r + 2) / 6) {}
  std::size_t all() const { return linear + quadratic + cubic; }
};

template <class T>
bool check_finite(const T* values, std::size_t count, const char* what, h6Error* error) {
  for (std::size_t i = 0; values && i < count; ++i)
    if (!std::isfinite(values[i]))
      return fail(error, H6_ERROR_RANGE, "deformable %s[%zu] is not finite", what, i);
  return true;
}

bool check(const h6DeformableDef& def, std::size_t points, h6Error* error) {
  if (!check_reserved(def, "deformable ", error)) return false;
  const std::size_t r = def.mode_count;
  if (r < 1 || r > H6_MAX_MODES)
    return fail(error, "a deformable has 1 to %d modes, this one has %zu", H6_MAX_MODES, r);
  if (!def.modes || !def.linear)
    return fail(error, "the modes of a deformable and its linear force must be given");
  if (!(def.alpha >= 0 && def.alpha <= 1e6) || !(def.beta >= 0 && def.beta <= 1e3))
    return fail(error, H6_ERROR_RANGE,
                "a deformable's alpha is 0 to 1e6 1/s and its beta 0 to 1e3 s, not %g and %g",
                def.alpha, def.beta);
  if (def.turn_modes && def.normal_modes)
    return fail(error,
                "a deformable has normal_modes or turn_modes, not both: the turn of a point turns "
                "its normal");
  if (def.turn_modes && (def.quadratic || def.cubic))
    return fail(
        error, "a deformable with turn_modes has a linear force: quadratic and cubic must be NULL");
  const Counts n(r);
  return check_finite(def.modes, points * r * 3, "modes", error) &&
         check_finite(def.normal_modes, points * r * 3, "normal_modes", error) &&
         check_finite(def.turn_modes, points * r * 3, "turn_modes", error) &&
         check_finite(def.linear, r * n.linear, "linear", error) &&
         check_finite(def.quadratic, r * n.quadratic, "quadratic", error) &&
         check_finite(def.cubic, r * n.cubic, "cubic", error);
}

void lay_out(Deformable& bend, const Shell& shell, Arena& arena) {
  const std::size_t r = bend.modes, row = r * kernels::kBendLanes;
  const std::size_t vectors = shell.x.count / kernels::kBendLanes;
  bend.blocks.take(arena, bend.sphere_axes() * row * (shell.blocks.x.count / kernels::kBendLanes));
  bend.groups.take(arena, bend.sphere_axes() * row * (shell.groups.x.count / kernels::kBendLanes));
  bend.force.take(arena, (r + kernels::kForceLanes - 1) / kernels::kForceLanes *
                             kernels::kForceLanes * (bend.linear ? r : Counts(r).all()));
  bend.points.take(arena, bend.point_axes() * row * vectors);
  bend.normals.take(arena, bend.warps ? 0 : 3 * row * vectors);
}

// The place of a row's value in columns of vectors.
float& at(Column<float>& column, std::size_t modes, std::size_t axes, std::size_t row,
          std::size_t mode, std::size_t axis) {
  constexpr std::size_t lanes = kernels::kBendLanes;
  return column[((row / lanes * modes + mode) * axes + axis) * lanes + row % lanes];
}
Vec3 mode_at(Deformable& bend, std::size_t row, std::size_t mode, std::size_t axis = 0) {
  Vec3 out;
  for (std::size_t k = 0; k < 3; ++k)
    out[static_cast<int>(k)] =
        double{at(bend.points, bend.modes, bend.point_axes(), row, mode, axis + k)};
  return out;
}

// Writes axes `first` to `first` + 2.
void take_rows(const Shell& shell, std::size_t r, const float* values, std::size_t axes,
               std::size_t first, Column<float>& to) {
  for (std::size_t i = 0; i < shell.x.count; ++i)
    for (std::size_t j = 0; j < r; ++j)
      for (std::size_t k = 0; k < 3; ++k)
        at(to, r, axes, i, j, first + k) = values[(std::size_t{shell.point[i]} * r + j) * 3 + k];
}

// The middle of the box of f(i), i = first .. end-1, in float, and the largest distance from it.
struct Middle {
  Vec3 at;
  float spread;
};
template <class F>
Middle middle_of(std::size_t first, std::size_t end, const F& f) {
  Vec3 low = Vec3::Constant(HUGE_VAL), high = -low;
  for (std::size_t i = first; i < end; ++i) low = low.cwiseMin(f(i)), high = high.cwiseMax(f(i));
  const Vec3 middle = (0.5 * (low + high)).cast<float>().cast<double>();
  double spread = 0;
  for (std::size_t i = first; i < end; ++i) spread = std::max(spread, (f(i) - middle).norm());
  return {middle, static_cast<float>(spread * 1.000001)};
}

// A sphere's centre goes with the middle of what its points do; the next axis is how far any of
// them goes from there. Of warped points that is the middle but for the turn of the sphere, and
// there are those of the turns too: kernels/bend/warp_points.h. Columns repeat the last sphere up
// to a whole vector.
void take_spheres(Deformable& bend, const Shell& shell, const Tier& tier, std::size_t rows,
                  Column<float>& to) {
  const std::size_t axes = bend.sphere_axes();
  for (std::size_t s = 0; s < tier.x.count; ++s) {
    const std::size_t first = std::min(s, tier.count - 1) * rows;
    const std::size_t end = std::min(first + rows, shell.points);
    const Vec3 centre(tier.x[s], tier.y[s], tier.z[s]);
    const auto put = [&](std::size_t j, std::size_t axis, const Middle& m,
                         std::size_t spread_axis) {
      for (std::size_t k = 0; k < 3; ++k)
        at(to, bend.modes, axes, s, j, axis + k) = static_cast<float>(m.at[static_cast<int>(k)]);
      at(to, bend.modes, axes, s, j, spread_axis) = m.spread;
    };
    for (std::size_t j = 0; j < bend.modes; ++j) {
      Vec3 turn = Vec3::Zero();
      if (bend.warps) {
        const Middle turns = middle_of(first, end, [&](auto i) { return mode_at(bend, i, j, 3); });
        put(j, 3, turns, 7);
        turn = turns.at;
      }
      put(j, 0,
          middle_of(first, end,
                    [&](std::size_t i) -> Vec3 {
                      const Vec3 arm = Vec3(shell.x[i], shell.y[i], shell.z[i]) - centre;
                      return mode_at(bend, i, j) - turn.cross(arm);
                    }),
          bend.warps ? 6 : 3);
    }
  }
}

// The neighbours that tell how the surface bends at a row: the nearest ones of its block that face
// the same way.
constexpr std::size_t kNeighbours = 12;
constexpr double kSameFace = 0.7;  // least N.N'

std::size_t neighbours_of(const Shell& shell, std::size_t row, std::uint32_t out[kNeighbours]) {
  const std::size_t first = row / kBlockRows * kBlockRows;
  const std::size_t end = std::min(first + kBlockRows, shell.points);
  float distance[kNeighbours];
  std::size_t count = 0;
  for (std::size_t i = first; i < end; ++i) {
    if (i == row) continue;
    const float x = shell.x[i] - shell.x[row], y = shell.y[i] - shell.y[row],
                z = shell.z[i] - shell.z[row], d = x * x + y * y + z * z;
    if (count == kNeighbours && !(d < distance[count - 1])) continue;
    if (shell.nx[i] * shell.nx[row] + shell.ny[i] * shell.ny[row] + shell.nz[i] * shell.nz[row] <
        kSameFace)
      continue;
    std::size_t place = count < kNeighbours ? count++ : count - 1;
    for (; place > 0 && d < distance[place - 1]; --place)
      distance[place] = distance[place - 1], out[place] = out[place - 1];
    distance[place] = d, out[place] = static_cast<std::uint32_t>(i);
  }
  return count;
}

// dN/dq_j = -(grad u_j)^T N along the surface. The gradient is that of the plane through what the
// neighbours do, weighted by 1/distance^2, in the least squares.
void derive_normals(Deformable& bend, const Shell& shell) {
  for (std::size_t row = 0; row < shell.x.count; ++row) {
    const std::size_t from = std::min(row, shell.points - 1);
    std::uint32_t near[kNeighbours];
    const std::size_t count = neighbours_of(shell, from, near);
    const auto place = [&](std::size_t i) { return Vec3(shell.x[i], shell.y[i], shell.z[i]); };
    const Vec3 n(shell.nx[from], shell.ny[from], shell.nz[from]), t1 = n.unitOrthogonal(),
                                                                  t2 = n.cross(t1);
    Eigen::Matrix2d A = Eigen::Matrix2d::Zero();
    Eigen::Vector2d share[kNeighbours];
    for (std::size_t k = 0; k < count; ++k) {
      const Vec3 d = place(near[k]) - place(from);
      const Eigen::Vector2d t(t1.dot(d), t2.dot(d));
      share[k] = t / std::max(t.squaredNorm(), 1e-24);
      A += share[k] * t.transpose();
    }
    // Where all neighbours lie on a line, nothing is known across it: no turn there.
    A += 1e-6 * std::max(A.trace(), 1e-12) * Eigen::Matrix2d::Identity();
    const Eigen::Matrix2d inverse = A.inverse();
    for (std::size_t j = 0; j < bend.modes; ++j) {
      const double u = n.dot(mode_at(bend, from, j));
      Eigen::Vector2d slope = Eigen::Vector2d::Zero();
      for (std::size_t k = 0; k < count; ++k)
        slope += (n.dot(mode_at(bend, near[k], j)) - u) * share[k];
      slope = inverse * slope;
      const Vec3 turn = -(slope[0] * t1 + slope[1] * t2);
      for (int k = 0; k < 3; ++k)
        at(bend.normals, bend.modes, 3, row, j, static_cast<std::size_t>(k)) =
            static_cast<float>(turn[k]);
    }
  }
}

// kernels/bend/bend_sums.h has the order.
void take_force(const h6DeformableDef& def, bool linear, Column<double>& to) {
  const std::size_t r = def.mode_count;
  const Counts n(r);
  double* out = to.data;
  const auto put = [&](std::size_t first, const double* values, std::size_t count) {
    for (std::size_t m = 0; m < count; ++m)
      for (std::size_t i = first; i < first + kernels::kForceLanes; ++i)
        *out++ = values && i < r ? values[i * count + m] : 0;
  };
  for (std::size_t first = 0; first < r; first += kernels::kForceLanes) {
    put(first, def.linear, n.linear);
    if (linear) continue;
    put(first, def.quadratic, n.quadratic);
    put(first, def.cubic, n.cubic);
  }
}

// Bent points and spheres round in float: so much more room for each sphere [shell radius].
constexpr float kBendRounding = 1e-6f;

}  // namespace

bool convert_deformable(const h6DeformableDef& def, const h6Allocator& allocator, Shell* shell,
                        h6Error* error) {
  if (!check(def, shell->points, error)) return false;
  Deformable& bend = shell->bend;
  const std::size_t r = bend.modes = def.mode_count;
  bend.alpha = def.alpha, bend.beta = def.beta;
  bend.warps = def.turn_modes != nullptr;
  bend.linear = !def.quadratic && !def.cubic;
  Arena room;
  lay_out(bend, *shell, room);
  if (!bend.memory.reserve(allocator, room.used()))
    return fail(error, H6_ERROR_MEMORY, "no memory for %zu modes of %zu points (%zu MB)", r,
                shell->points, room.used() / 1000000);
  Arena arena(bend.memory.data, bend.memory.count);
  lay_out(bend, *shell, arena);
  take_rows(*shell, r, def.modes, bend.point_axes(), 0, bend.points);
  if (def.turn_modes)
    take_rows(*shell, r, def.turn_modes, 6, 3, bend.points);
  else if (def.normal_modes)
    take_rows(*shell, r, def.normal_modes, 3, 0, bend.normals);
  else
    derive_normals(bend, *shell);
  take_spheres(bend, *shell, shell->groups, kGroupRows, bend.groups);
  take_spheres(bend, *shell, shell->blocks, kBlockRows, bend.blocks);
  take_force(def, bend.linear, bend.force);
  for (Tier* tier : {&shell->groups, &shell->blocks})
    for (std::size_t i = 0; i < tier->x.count; ++i)
      tier->radius[i] += kBendRounding * static_cast<float>(shell->radius);
  return true;
}

}  // namespace h6
