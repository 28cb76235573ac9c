// SPDX-License-Identifier: Apache-2.0
// targets.cpp - names and forces the SIMD target; see targets.h.
#include "kernels/targets.h"

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>

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

// The targets that this machine can run. They are found once, because Highway's answer changes
// while a target is forced.
std::int64_t machine_targets() {
  static const std::int64_t targets = [] {
    hwy::SetSupportedTargetsForTest(0);
    return HWY_SUPPORTED_TARGETS & HWY_TARGETS;
  }();
  return targets;
}

std::int64_t home_targets = 0;  // of force_target(nullptr); 0: the best of the machine

// The target with this name among `targets`; 0 when there is none.
std::int64_t target_in(std::int64_t targets, const char* name) {
  for (std::int64_t left = targets; left != 0; left &= left - 1)
    if (std::strcmp(name, hwy::TargetName(left & -left)) == 0) return left & -left;
  return 0;
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
  const std::int64_t chosen = name == nullptr ? home_targets : target_in(machine_targets(), name);
  if (name != nullptr && chosen == 0) return false;
  hwy::SetSupportedTargetsForTest(chosen);  // 0: what the machine has
  hwy::GetChosenTarget().Update(chosen == 0 ? machine_targets() : chosen);
  return true;
}

const char* force_target_from_environment(bool* built) {
  const char* const name = std::getenv("HAPSIX_SIMD");
  if (name == nullptr || *name == '\0') return nullptr;
  if (built != nullptr) *built = target_in(HWY_TARGETS, name) != 0;
  if (force_target(name)) {
    home_targets = target_in(machine_targets(), name);
    return nullptr;
  }
  static std::string why;
  why = std::string("HAPSIX_SIMD=") + name + " is not a SIMD target of this machine; it has";
  const char* names[32];
  const std::size_t count = supported_targets(names, 32);
  for (std::size_t i = 0; i < count; ++i)
    why += std::string(i == 0 ? " " : i + 1 == count ? " and " : ", ") + names[i];
  return why.c_str();
}

}  // namespace h6::kernels
#endif
