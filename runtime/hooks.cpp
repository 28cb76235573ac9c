// SPDX-License-Identifier: Apache-2.0
// hooks.cpp - the program's handlers for failed assertions and for sentences. They are part of the
// public interface, so that kernels, sched and io can use them without the engine.
#include <cstdio>

#include "hapsix/base.h"

namespace {
int stop_on_assert(const char* condition, const char* file, int line) {
  std::fprintf(stderr, "hapsix: assertion failed: %s (%s:%d)\n", condition, file, line);
  return 1;
}
h6AssertHandler assert_handler = stop_on_assert;
h6LogHandler log_handler = nullptr;
void* log_user = nullptr;
}  // namespace

extern "C" {
void h6SetAssertHandler(h6AssertHandler handler) {
  assert_handler = handler ? handler : stop_on_assert;
}
int h6AssertFailed(const char* condition, const char* file, int line) {
  return assert_handler(condition, file, line);
}
void h6SetLogHandler(h6LogHandler handler, void* user) {
  log_handler = handler;
  log_user = user;
}
void h6Log(h6LogLevel level, const char* sentence) {
  if (log_handler && sentence) log_handler(log_user, level, sentence);
}
}
