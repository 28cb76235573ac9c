// SPDX-License-Identifier: Apache-2.0
// own_highway.cpp - the engine's own run-time part of Highway.
//
// A program may bring another version of Highway, or force a target of its own. Then the linker
// would give both of them one table of the chosen target. So CMakeLists.txt compiles all kernels
// with the namespace hwy renamed to h6_hwy, and what Highway's library would define is defined
// here. On x86 that includes what the machine can do: a host may have disabled targets of its own
// Highway, and ours must not follow. On other processors Highway's library still answers that.
#include <hwy/targets.h>

#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "hapsix/base.h"

#if HWY_ARCH_X86
#include <cpuid.h>
#else
#undef hwy
namespace hwy {
std::int64_t SupportedTargets();
}
#endif

namespace h6_hwy {
namespace {

std::int64_t forced_targets = 0;

#if HWY_ARCH_X86
// Clang's __builtin_cpu_supports does not know these two. They need no registers beyond AVX's.
bool has_f16c_and_lzcnt() {
  unsigned a = 0, b = 0, c = 0, d = 0;
  if (__get_cpuid(1, &a, &b, &c, &d) == 0 || (c & bit_F16C) == 0) return false;
  return __get_cpuid(0x80000001U, &a, &b, &c, &d) != 0 && (c & bit_LZCNT) != 0;
}

// The same features as in hwy/targets.cc of Highway 1.0.3. Each target needs what the one before it
// needs. __builtin_cpu_supports denies AVX and AVX-512 where the system does not save their
// registers.
std::int64_t machine_targets() {
  __builtin_cpu_init();  // a host may ask before its constructors have run
  std::int64_t targets = HWY_SCALAR | HWY_EMU128 | HWY_STATIC_TARGET;
  if (!(__builtin_cpu_supports("sse2") && __builtin_cpu_supports("sse3") &&
        __builtin_cpu_supports("ssse3")))
    return targets;
  targets |= HWY_SSSE3;
  if (!(__builtin_cpu_supports("sse4.1") && __builtin_cpu_supports("sse4.2") &&
        __builtin_cpu_supports("pclmul") && __builtin_cpu_supports("aes")))
    return targets;
  targets |= HWY_SSE4;
  if (!(__builtin_cpu_supports("avx") && __builtin_cpu_supports("avx2") &&
        __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi") &&
        __builtin_cpu_supports("bmi2") && has_f16c_and_lzcnt()))
    return targets;
  targets |= HWY_AVX2;
  if (!(__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
        __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw")))
    return targets;
  return targets | HWY_AVX3;
}
#else
std::int64_t machine_targets() { return hwy::SupportedTargets(); }
#endif

}  // namespace

std::int64_t SupportedTargets() { return forced_targets ? forced_targets : machine_targets(); }
void SetSupportedTargetsForTest(std::int64_t targets) { forced_targets = targets; }

ChosenTarget& GetChosenTarget() {
  static ChosenTarget chosen;
  return chosen;
}

// Highway's own assertions, which only debug builds have.
void Abort(const char* file, int line, const char* format, ...) {
  char text[256];
  std::va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  h6AssertFailed(text, file, line);
  std::abort();
}

}  // namespace h6_hwy
