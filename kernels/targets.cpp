// SPDX-License-Identifier: Apache-2.0
// targets.cpp - names and forces the SIMD target; see targets.h.
#include "kernels/targets.h"

#include <cstdint>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/targets.cpp"
#include "kernels/simd.h"
// After simd.h.
#include "hwy/foreach_target.h"
// After foreach_target.h.
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {

const char* name_of_this_target() { return hwy::TargetName(HWY_TARGET); }

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(name_of_this_target);

namespace {

// What the machine can run, apart from what is forced. Asked once: the answer changes while forced.
std::int64_t machine_targets() {
  static const std::int64_t targets = [] {
    hwy::SetSupportedTargetsForTest(0);
    return HWY_SUPPORTED_TARGETS & HWY_TARGETS;
  }();
  return targets;
}

}  // namespace

const char* target_name() { return HWY_DYNAMIC_DISPATCH(name_of_this_target)(); }

std::size_t supported_targets(const char** names, std::size_t capacity) {
  std::size_t count = 0;
  for (std::int64_t left = machine_targets(); left != 0; left &= left - 1) {  // low bits are better
    if (count < capacity) names[count] = hwy::TargetName(left & -left);
    ++count;
  }
  return count;
}

bool force_target(const char* name) {
  std::int64_t chosen = name == nullptr ? machine_targets() : 0;
  for (std::int64_t left = machine_targets(); name != nullptr && left != 0; left &= left - 1) {
    if (std::strcmp(name, hwy::TargetName(left & -left)) == 0) chosen = left & -left;
  }
  if (chosen == 0) return false;
  hwy::SetSupportedTargetsForTest(name == nullptr ? 0 : chosen);
  hwy::GetChosenTarget().Update(chosen);
  return true;
}

}  // namespace h6::kernels
#endif
