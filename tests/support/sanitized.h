// SPDX-License-Identifier: Apache-2.0
// sanitized.h - tells a test under which sanitizer it runs, so that it can do less work.
//
// AddressSanitizer makes tests two to five times slower, ThreadSanitizer ten to a hundred times.
// Under ThreadSanitizer tests repeat less often and leave out arithmetic on a single thread, where
// it has nothing to find. Everything that two threads touch stays.
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

// The number of repetitions: `few` under ThreadSanitizer, else `many`.
template <class N>
constexpr N repeated(N many, N few) {
  return kThreadSanitized ? few : many;
}

}  // namespace h6::test
