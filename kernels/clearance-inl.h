// clearance-inl.h - cull_clearance of a vector of distances; shared by cull_spheres and touch_rows.
#include "kernels/cull_spheres.h"

// Per-target include guard.
#if defined(H6_KERNELS_CLEARANCE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef H6_KERNELS_CLEARANCE_INL_H_
#undef H6_KERNELS_CLEARANCE_INL_H_
#else
#define H6_KERNELS_CLEARANCE_INL_H_
#endif

#include "hwy/highway.h"
#include "kernels/sample_field-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {

// cull_clearance of every lane.
HWY_INLINE VF clearance_of(VF distance, bool wide) {
  const DF d;
  const VF left = hn::Sub(distance, hn::Set(d, kReachRounding));
  const VF long_form = hn::Sub(left, hn::Set(d, kSqrt3));
  if (wide) return long_form;
  const VF short_form = hn::Mul(left, hn::Set(d, 1.0f / kSqrt3));
  const VF edge = hn::Set(d, kShortReach);
  const VF far_form =
      hn::IfThenElse(hn::Gt(long_form, edge), long_form, hn::Set(d, kShortReach - 1e-4f));
  return hn::IfThenElse(hn::Lt(short_form, edge), short_form, far_form);
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
