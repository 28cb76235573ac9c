// SPDX-License-Identifier: Apache-2.0
// assert.cpp - handles a failed assertion. It is part of the public interface, so that kernels and
// sched can assert without the engine.
#include <cstdio>

#include "hapsix/base.h"

namespace {
int stop_on_assert(const char* condition, const char* file, int line) {
  std::fprintf(stderr, "hapsix: assertion failed: %s (%s:%d)\n", condition, file, line);
  return 1;
}
h6AssertHandler assert_handler = stop_on_assert;
}  // namespace

extern "C" {
void h6SetAssertHandler(h6AssertHandler handler) {
  assert_handler = handler ? handler : stop_on_assert;
}
int h6AssertFailed(const char* condition, const char* file, int line) {
  return assert_handler(condition, file, line);
}
}
