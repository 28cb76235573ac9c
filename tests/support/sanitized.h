// SPDX-License-Identifier: Apache-2.0
// sanitized.h - what a test does less of where everything is instrumented: AddressSanitizer makes
// it two to five times slower, ThreadSanitizer ten to a hundred times.
//
// Repetitions become fewer, and arithmetic on one thread alone is left out under ThreadSanitizer,
// which has nothing to see there. Whatever two threads touch stays.
#pragma once

namespace h6::test {

#if defined(__SANITIZE_THREAD__)
inline constexpr bool kThreadSanitized = true;
#else
inline constexpr bool kThreadSanitized = false;
#endif
#if defined(__SANITIZE_ADDRESS__)
inline constexpr bool kAddressSanitized = true;
#else
inline constexpr bool kAddressSanitized = false;
#endif
inline constexpr bool kSanitized = kThreadSanitized || kAddressSanitized;

// Repetitions: so many, under ThreadSanitizer so few.
template <class N>
constexpr N repeated(N many, N few) {
  return kThreadSanitized ? few : many;
}

}  // namespace h6::test
