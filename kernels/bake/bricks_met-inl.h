// SPDX-License-Identifier: Apache-2.0
// bricks_met-inl.h - tests boxes of nodes against a triangle's FacetRegion, where the triangle may
// be the nearest.
//
// Included once for each SIMD target.
#include "kernels/bake/triangle_tables.h"

// Per-target include guard.
#if defined(H6_KERNELS_BRICKS_MET_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef H6_KERNELS_BRICKS_MET_INL_H_
#undef H6_KERNELS_BRICKS_MET_INL_H_
#else
#define H6_KERNELS_BRICKS_MET_INL_H_
#endif

#include "hwy/highway.h"

#include "kernels/bake/beside-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// The most that the functions change over half a box, plus the leeway.
HWY_INLINE void gains(const float* gx, const float* gy, const float* gz, std::size_t count,
                      const float (&half)[3], float* out) {
  const hn::CappedTag<float, 8> d;
  for (std::size_t k = 0; k < count; k += hn::Lanes(d))
    hn::Store(hn::MulAdd(hn::Set(d, half[0]), hn::Abs(hn::LoadU(d, gx + k)),
                         hn::MulAdd(hn::Set(d, half[1]), hn::Abs(hn::LoadU(d, gy + k)),
                                    hn::MulAdd(hn::Set(d, half[2]), hn::Abs(hn::LoadU(d, gz + k)),
                                               hn::Set(d, kLeeway)))),
              d, out + k);
}

// Boxes of one size in terms of a triangle's functions and the planes of its region.
struct Gains {
  alignas(64) float function[8], plane[kPlanes];
};
HWY_INLINE void set_gains(const DistanceFacet& f, const FacetRegion& r, const float (&half)[3],
                          Gains& gain) {
  gains(f.gx, f.gy, f.gz, 8, half, gain.function);
  if ((r.edges | r.corners) != 0) gains(r.gx, r.gy, r.gz, kPlanes, half, gain.plane);
}

// Whether boxes may meet the region. Their middles are at (x, y, z), where the functions are s and
// w; `plane` has the values of the planes at (0, 0, 0).
HWY_INLINE auto meets(const DistanceFacet& f, const FacetRegion& r, const Gains& gain,
                      const float* plane, VF x, VF y, VF z, const VF (&s)[3], const VF (&w)[3]) {
  const D d;
  const auto below = [&](VF value, float level)
                         HWY_ATTR { return hn::Le(value, hn::Set(d, level)); };
  const auto above = [&](VF value, float level)
                         HWY_ATTR { return hn::Ge(value, hn::Set(d, level)); };
  const auto below_plane = [&](std::size_t k) HWY_ATTR {
    return below(hn::MulAdd(x, hn::Set(d, r.gx[k]),
                            hn::MulAdd(y, hn::Set(d, r.gy[k]),
                                       hn::MulAdd(z, hn::Set(d, r.gz[k]), hn::Set(d, plane[k])))),
                 gain.plane[k]);
  };
  const float* g = gain.function;
  auto there = hn::And(hn::And(above(w[0], -g[3]), above(w[1], -g[4])), above(w[2], -g[5]));
  for (std::size_t e = 0; e < 3; ++e)
    if (r.edges >> e & 1)
      there = hn::Or(there, hn::And(hn::And(below(w[e], g[3 + e]), below_plane(e)),
                                    below(hn::Abs(s[e]), f.half[e] + g[e])));
  for (std::size_t v = 0; v < 3; ++v)
    if (r.corners >> v & 1) {
      const std::size_t u = (v + 2) % 3, p = 3 + 4 * v;
      there = hn::Or(
          there,
          hn::And(hn::And(hn::And(below(s[v], g[v] - f.half[v]), above(s[u], f.half[u] - g[u])),
                          hn::And(below_plane(p), below_plane(p + 1))),
                  hn::And(below_plane(p + 2), below_plane(p + 3))));
    }
  return there;
}

// The bricks that may meet the region. This also updates the nearest triangle at the middles of the
// bricks, and at some beside them, which does no harm.
template <int kEdges>
HWY_INLINE std::uint64_t bricks_met(const DistanceFacet& f, const FacetRegion& r,
                                    std::uint64_t bricks, std::int32_t name, TileRoom& room) {
  constexpr float kBrickHalf[3] = {3.5f, 3.5f, 3.5f};
  const D d;
  const hn::RebindToSigned<D> d32;
  // For a single brick the test costs as much as it saves.
  const bool all = r.everywhere || (bricks & (bricks - 1)) == 0;
  Gains gain = {};
  if (!all) set_gains(f, r, kBrickHalf, gain);
  std::uint64_t met = 0;
  for (std::size_t b = 0; b < 64; b += hn::Lanes(d)) {
    if ((bricks >> b & ((std::uint64_t{1} << hn::Lanes(d)) - 1)) == 0) continue;
    const VF x = hn::Load(d, kTile.x + b), y = hn::Load(d, kTile.y + b),
             z = hn::Load(d, kTile.z + b);
    const auto at = [&](std::size_t k) HWY_ATTR {
      return hn::MulAdd(x, hn::Set(d, f.gx[k]),
                        hn::MulAdd(y, hn::Set(d, f.gy[k]),
                                   hn::MulAdd(z, hn::Set(d, f.gz[k]), hn::Set(d, f.c[k]))));
    };
    const VF s[3] = {at(0), at(1), at(2)}, w[3] = {at(3), at(4), at(5)}, h = at(6);
    const VF away = hn::MulAdd(h, h, beside_squared<kEdges>(f, s, w)),
             least = hn::Load(d, room.middle + b);
    const auto named = hn::Load(d32, room.nearest + b), own = hn::Set(d32, name);
    const auto nearer = hn::Or(hn::Lt(away, least),
                               hn::And(hn::Eq(away, least), hn::RebindMask(d, hn::Lt(own, named))));
    hn::Store(hn::Min(away, least), d, room.middle + b);
    hn::Store(hn::IfThenElse(hn::RebindMask(d32, nearer), own, named), d32, room.nearest + b);
    if (all) continue;
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(d, meets(f, r, gain, r.c, x, y, z, s, w), bits);
    met |= (std::uint64_t{bits[0]} | std::uint64_t{bits[1]} << 8) << b;
  }
  return all ? bricks : bricks & met;
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
