// SPDX-License-Identifier: Apache-2.0
// warp_points.cpp - the SIMD twin of warp_points_ref.cpp, in float. Turns are right up to 39,000
// rad.
#include "kernels/bend/warp_points.h"

#include "kernels/bend/mean_rotation.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/bend/warp_points.cpp"
#include "kernels/simd.h"
// After simd.h.
#include "hwy/foreach_target.h"
// After foreach_target.h.
#include "hwy/highway.h"
// After highway.h.
#include "hwy/contrib/math/math-inl.h"
#include "kernels/bend/carried-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

HWY_INLINE VF dot_of(const VF* a, const VF* b) {
  return hn::MulAdd(a[0], b[0], hn::MulAdd(a[1], b[1], hn::Mul(a[2], b[2])));
}
HWY_INLINE VF cross_of(const VF* a, const VF* b, int k) {
  const int l = (k + 1) % 3, m = (k + 2) % 3;
  return hn::MulSub(a[l], b[m], hn::Mul(a[m], b[l]));
}

// MeanRotation in lanes, with first derivatives only.
struct Mean {
  VF s, a, b, c, b1, c1;

  HWY_INLINE explicit Mean(const VF* w) {
    const DF d;
    s = dot_of(w, w);
    b = c = b1 = c1 = hn::Zero(d);
    constexpr std::size_t kTerms = 8;  // the ninth is under 2e-10
    constexpr auto of_b = rotation_series<kTerms>(2), of_c = rotation_series<kTerms>(3);
    for (std::size_t k = kTerms; k-- > 0;) {
      b1 = hn::MulAdd(b1, s, b), c1 = hn::MulAdd(c1, s, c);
      b = hn::MulAdd(b, s, hn::Set(d, static_cast<float>(of_b[k])));
      c = hn::MulAdd(c, s, hn::Set(d, static_cast<float>(of_c[k])));
    }
    a = hn::NegMulAdd(c, s, hn::Set(d, 1.0f));
    const auto far = hn::Ge(s, hn::Set(d, static_cast<float>(kSeriesEnd)));
    if (!hn::AllFalse(d, far)) go_far(far);
  }
  template <class Mask>
  HWY_NOINLINE void go_far(Mask far) {
    const DF d;
    const VF one = hn::Set(d, 1.0f), angle = hn::Sqrt(s);
    const VF within = hn::Min(angle, hn::Set(d, 39000.0f));
    const VF sine = hn::Div(hn::Sin(d, within), angle);
    const VF far_b = hn::Div(hn::Sub(one, hn::Cos(d, within)), s);
    const VF far_c = hn::Div(hn::Sub(one, sine), s), half = hn::Div(hn::Set(d, 0.5f), s);
    a = hn::IfThenElse(far, sine, a);
    b = hn::IfThenElse(far, far_b, b), c = hn::IfThenElse(far, far_c, c);
    b1 = hn::IfThenElse(far, hn::Mul(hn::NegMulAdd(hn::Set(d, 2.0f), far_b, sine), half), b1);
    c1 = hn::IfThenElse(far, hn::Mul(hn::NegMulAdd(hn::Set(d, 3.0f), far_c, far_b), half), c1);
  }
};

// Component k of R~(w) u.
HWY_INLINE void warped(const VF* u, const VF* w, const Mean& m, VF* out) {
  const VF along = hn::Mul(m.c, dot_of(w, u));
  for (int k = 0; k < 3; ++k)
    out[k] = hn::MulAdd(m.a, u[k], hn::MulAdd(m.b, cross_of(w, u, k), hn::Mul(along, w[k])));
}

void warp_points_simd(const ModesView& modes, const float* q, const float* const rest[3],
                      const std::uint32_t* vectors, std::size_t n, float* const to[9]) {
  const DF d;
  each_register(vectors, n, [&](std::size_t v, std::size_t lane) HWY_ATTR {
    const Carried<6> way(modes, q, v, lane);
    const std::size_t i = v * kBendLanes + lane;
    const VF *u = way.axis, *w = way.axis + 3;
    VF moved[3];
    warped(u, w, Mean(w), moved);
    for (int a = 0; a < 3; ++a)
      hn::StoreU(hn::Add(hn::LoadU(d, rest[a] + i), moved[a]), d, to[a] + i);
    for (int a = 0; a < 6; ++a) hn::StoreU(way.axis[a], d, to[3 + a] + i);
  });
}

void warp_normals_simd(const float* const rest[3], const float* const turn[3],
                       const std::uint32_t* vectors, std::size_t n, float* const to[3]) {
  const DF d;
  each_register(vectors, n, [&](std::size_t v, std::size_t lane) HWY_ATTR {
    const std::size_t i = v * kBendLanes + lane;
    VF normal[3], w[3];
    for (int a = 0; a < 3; ++a)
      normal[a] = hn::LoadU(d, rest[a] + i), w[a] = hn::LoadU(d, turn[a] + i);
    const Mean m(w);
    const VF cosine = hn::NegMulAdd(m.b, m.s, hn::Set(d, 1.0f));
    const VF along = hn::Mul(m.b, dot_of(w, normal));
    for (int a = 0; a < 3; ++a)
      hn::StoreU(hn::MulAdd(cosine, normal[a],
                            hn::MulAdd(m.a, cross_of(w, normal, a), hn::Mul(along, w[a]))),
                 d, to[a] + i);
  });
}

void warp_spheres_simd(const ModesView& modes, const float* q, const float* const rest[4],
                       const std::uint32_t* vectors, std::size_t n, float* const to[4]) {
  const DF d;
  each_register(vectors, n, [&](std::size_t v, std::size_t lane) HWY_ATTR {
    const Carried<6, 2> way(modes, q, v, lane);
    const std::size_t i = v * kBendLanes + lane;
    const VF *u = way.axis, *w = way.axis + 3, a = way.axis[6], b = way.axis[7];
    VF moved[3];
    warped(u, w, Mean(w), moved);
    for (int k = 0; k < 3; ++k)
      hn::StoreU(hn::Add(hn::LoadU(d, rest[k] + i), moved[k]), d, to[k] + i);
    const VF radius = hn::LoadU(d, rest[3] + i), held = hn::Add(radius, a);
    const VF most = hn::MulAdd(length_of(w), radius, hn::Add(length_of(u), a));
    const VF share = hn::MulAdd(b, hn::Set(d, 0.5f), hn::Set(d, kWarpRounding));
    hn::StoreU(hn::Mul(hn::MulAdd(share, most, held), hn::Set(d, kRoundUp)), d, to[3] + i);
  });
}

void warp_reach_simd(const ModesView& modes, const float* q, const float* radius, std::size_t n,
                     WarpReach* out) {
  const DF d;
  VF shift = hn::Zero(d), turn = hn::Zero(d);
  each_register(nullptr, n, [&](std::size_t v, std::size_t lane) HWY_ATTR {
    const Carried<6, 2> way(modes, q, v, lane);
    const VF turned = length_of(way.axis + 3);
    const VF r = hn::LoadU(d, radius + v * kBendLanes + lane);
    shift = hn::Max(shift, hn::MulAdd(turned, r, hn::Add(way.length(), way.axis[6])));
    turn = hn::Max(turn, hn::Add(turned, way.axis[7]));
  });
  out->shift = hn::GetLane(hn::MaxOfLanes(d, shift)) * kRoundUp;
  out->turn = hn::GetLane(hn::MaxOfLanes(d, turn)) * kRoundUp;
}

// The derivatives of n.R~(w) u by u and by w.
HWY_INLINE void derivatives(const VF* n, const VF* u, const VF* w, VF* by_u, VF* by_w) {
  const Mean m(w);
  VF un[3];
  for (int k = 0; k < 3; ++k) un[k] = cross_of(u, n, k);
  const VF wn = dot_of(w, n), wu = dot_of(w, u), along = hn::Mul(m.c, wn);
  const VF twice_b1 = hn::Add(m.b1, m.b1), twice_c1 = hn::Add(m.c1, m.c1);
  const VF to_w =
      hn::MulAdd(hn::Sub(m.c, m.b), dot_of(u, n),
                 hn::MulAdd(twice_b1, dot_of(w, un), hn::Mul(twice_c1, hn::Mul(wu, wn))));
  for (int k = 0; k < 3; ++k) {
    by_u[k] = hn::MulAdd(m.a, n[k], hn::MulAdd(m.b, cross_of(n, w, k), hn::Mul(along, w[k])));
    const VF both = hn::MulAdd(wn, u[k], hn::Mul(wu, n[k]));
    by_w[k] = hn::MulAdd(to_w, w[k], hn::MulAdd(m.b, un[k], hn::Mul(m.c, both)));
  }
}

void warp_rows_simd(const BentContacts& c, const ModesView& modes, const float* const at[6],
                    const float turn[9], std::size_t stride, float* out) {
  const DF d;
  HWY_ALIGN float local[3][kBendLanes], by[6][kBendLanes];
  each_vector(c, [&](std::size_t v, std::size_t first, std::size_t end) HWY_ATTR {
    rigid_rows(c, first, end, turn, stride, out, local);
    for (std::size_t lane = 0; lane < kBendLanes; lane += hn::Lanes(d)) {
      VF n[3], u[3], w[3], of[6];
      for (int k = 0; k < 3; ++k) {
        n[k] = hn::Load(d, local[k] + lane);
        u[k] = hn::LoadU(d, at[k] + v * kBendLanes + lane);
        w[k] = hn::LoadU(d, at[3 + k] + v * kBendLanes + lane);
      }
      derivatives(n, u, w, of, of + 3);
      for (int k = 0; k < 6; ++k) hn::Store(of[k], d, by[k] + lane);
    }
    modal_rows<6>(c, modes, v, first, end, by, stride, out);
  });
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(warp_points_simd);
HWY_EXPORT(warp_normals_simd);
HWY_EXPORT(warp_spheres_simd);
HWY_EXPORT(warp_reach_simd);
HWY_EXPORT(warp_rows_simd);

void warp_points(const ModesView& modes, const float* q, const float* const rest[3],
                 const std::uint32_t* vectors, std::size_t n, float* const to[9]) {
  HWY_DYNAMIC_DISPATCH(warp_points_simd)(modes, q, rest, vectors, n, to);
}
void warp_normals(const float* const rest[3], const float* const turn[3],
                  const std::uint32_t* vectors, std::size_t n, float* const to[3]) {
  HWY_DYNAMIC_DISPATCH(warp_normals_simd)(rest, turn, vectors, n, to);
}
void warp_spheres(const ModesView& modes, const float* q, const float* const rest[4],
                  const std::uint32_t* vectors, std::size_t n, float* const to[4]) {
  HWY_DYNAMIC_DISPATCH(warp_spheres_simd)(modes, q, rest, vectors, n, to);
}
WarpReach warp_reach(const ModesView& modes, const float* q, const float* radius, std::size_t n) {
  WarpReach out;
  HWY_DYNAMIC_DISPATCH(warp_reach_simd)(modes, q, radius, n, &out);
  return out;
}
void warp_rows(const BentContacts& contacts, const ModesView& modes, const float* const at[6],
               const float turn[9], std::size_t stride, float* out) {
  HWY_DYNAMIC_DISPATCH(warp_rows_simd)(contacts, modes, at, turn, stride, out);
}

}  // namespace h6::kernels
#endif
