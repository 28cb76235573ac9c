// SPDX-License-Identifier: Apache-2.0
// lattice_hits.cpp - the fast twin of lattice_hits_ref: a row of lines at once. Barycentric areas
// are integers that doubles hold exactly, so they can be stepped from line to line.
#include "kernels/bake/lattice_hits.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/bake/lattice_hits.cpp"
#include "kernels/simd.h"
// After simd.h.
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

#include "kernels/compress-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

#if HWY_HAVE_FLOAT64 && HWY_TARGET != HWY_SCALAR
// Along axis a: the barycentric areas of the line of slot 0, their steps from line to line, and the
// coordinate of a hit: start + area 1 * second + area 2 * third.
struct Setup {
  alignas(32) double whole[4], share[3][4], per_column[3][4], per_row[3][4];
  alignas(32) double start[4], second[4], third[4];
};

// All three axes side by side: lane a has axis a.
HWY_INLINE void set_up(const std::int32_t (*corner)[3], const std::int32_t* first, Setup& s) {
  const hn::CappedTag<double, 4> d;
  alignas(32) double along[3][4], across[3][4], up[3][4], first_across[4], first_up[4];
  for (std::size_t a = 0; a < 4; ++a) {
    const std::size_t u = (a + 1) % 3, v = (a + 2) % 3;
    for (std::size_t i = 0; i < 3; ++i) {
      along[i][a] = corner[i][a % 3];
      across[i][a] = corner[i][u];
      up[i][a] = corner[i][v];
    }
    first_across[a] = first[u];
    first_up[a] = first[v];
  }
  const auto voxel = hn::Set(d, kLatticeVoxel), zero = hn::Zero(d);
  const auto scale = hn::Set(d, 1 / kLatticeVoxel);
  for (std::size_t n = 0; n < 4; n += hn::Lanes(d)) {
    using V = hn::Vec<decltype(d)>;
    V p[3], q[3];
    for (std::size_t i = 0; i < 3; ++i) {
      p[i] = hn::Load(d, across[i] + n);
      q[i] = hn::Load(d, up[i] + n);
    }
    const V whole = hn::Sub(hn::Mul(hn::Sub(p[1], p[0]), hn::Sub(q[2], q[0])),
                            hn::Mul(hn::Sub(q[1], q[0]), hn::Sub(p[2], p[0])));
    const auto turned = hn::Lt(whole, zero);
    const auto turn = [&](V v) HWY_ATTR { return hn::IfThenElse(turned, hn::Neg(v), v); };
    const V p0 = hn::Mul(hn::Load(d, first_across + n), voxel);
    const V q0 = hn::Mul(hn::Load(d, first_up + n), voxel);
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t a = (i + 1) % 3, b = (i + 2) % 3;
      const V du = turn(hn::Sub(p[b], p[a])), dv = turn(hn::Sub(q[b], q[a]));
      hn::Store(hn::Sub(hn::Mul(du, hn::Sub(q0, q[a])), hn::Mul(dv, hn::Sub(p0, p[a]))), d,
                s.share[i] + n);
      hn::Store(hn::Neg(hn::Mul(dv, voxel)), d, s.per_column[i] + n);
      hn::Store(hn::Mul(du, voxel), d, s.per_row[i] + n);
    }
    hn::Store(whole, d, s.whole + n);
    const V by_area = hn::Div(scale, turn(whole)), at = hn::Load(d, along[0] + n);
    hn::Store(hn::Mul(at, scale), d, s.start + n);
    hn::Store(hn::Mul(hn::Sub(hn::Load(d, along[1] + n), at), by_area), d, s.second + n);
    hn::Store(hn::Mul(hn::Sub(hn::Load(d, along[2] + n), at), by_area), d, s.third + n);
  }
}

void Hits(const std::int32_t (*corner)[3], const std::int32_t* first, const std::int32_t* last,
          LatticeHits& hits) {
  const hn::CappedTag<double, 8> d;
  const hn::Rebind<std::uint32_t, decltype(d)> du;
  using V = hn::Vec<decltype(d)>;
  const std::int32_t lanes = std::int32_t(hn::Lanes(d));
  const V lane = hn::Iota(d, 0.0), zero = hn::Zero(d);
  const auto number = hn::Iota(du, 0);  // unsigned: GCC builds a signed one lane by lane
  Setup setup;
  set_up(corner, first, setup);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    const std::int32_t columns = last[u] - first[u] + 1, rows = last[v] - first[v] + 1;
    hits.count[axis] = 0;
    const std::size_t shift = hits.shift[axis] = lattice_shift(columns);
    if (columns <= 0 || rows <= 0 || setup.whole[axis] == 0) continue;
    V row[3], per_vector[3], per_row[3];
    for (std::size_t i = 0; i < 3; ++i) {
      const V per_column = hn::Set(d, setup.per_column[i][axis]);
      row[i] = hn::Add(hn::Set(d, setup.share[i][axis]), hn::Mul(lane, per_column));
      per_vector[i] = hn::Mul(per_column, hn::Set(d, double(lanes)));
      per_row[i] = hn::Set(d, setup.per_row[i][axis]);
    }
    const V start = hn::Set(d, setup.start[axis]), second = hn::Set(d, setup.second[axis]),
            third = hn::Set(d, setup.third[axis]);
    std::uint32_t* name = hits.slot[axis];
    double* at = hits.at[axis];
    std::size_t count = 0;
    for (std::int32_t k = 0; k < rows; ++k) {
      V share[3] = {row[0], row[1], row[2]};
      for (std::int32_t j = 0; j < columns; j += lanes) {
        const auto met = hn::And(hn::Ge(hn::Min(hn::Min(share[0], share[1]), share[2]), zero),
                                 hn::FirstN(d, std::size_t(columns - j)));
        const std::uint32_t bits = bits_of(d, met);
        const std::size_t slot = std::size_t(k) << shift | std::size_t(j);
        hn::StoreU(hn::Add(start, hn::Add(hn::Mul(share[1], second), hn::Mul(share[2], third))), d,
                   at + slot);
        hn::StoreU(compress_by_bits(du, hn::Add(number, hn::Set(du, std::uint32_t(slot))), bits),
                   du, name + count);
        count += hwy::PopCount(bits);
        for (std::size_t i = 0; i < 3; ++i) share[i] = hn::Add(share[i], per_vector[i]);
      }
      for (std::size_t i = 0; i < 3; ++i) row[i] = hn::Add(row[i], per_row[i]);
    }
    hits.count[axis] = count;
  }
}
#else
void Hits(const std::int32_t (*corner)[3], const std::int32_t* first, const std::int32_t* last,
          LatticeHits& hits) {
  lattice_hits_ref(corner, first, last, hits);
}
#endif

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(Hits);

void lattice_hits(const std::int32_t corner[3][3], const std::int32_t first[3],
                  const std::int32_t last[3], LatticeHits& hits) {
  HWY_DYNAMIC_DISPATCH(Hits)(corner, first, last, hits);
}

}  // namespace h6::kernels
#endif
