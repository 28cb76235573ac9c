// SPDX-License-Identifier: Apache-2.0
// fail.cpp - why a call failed, as a sentence and a code.
#include <cstdarg>
#include <cstdio>

#include "runtime/model/model.h"

namespace h6 {

bool fail(h6Error* error, const char* format, ...) {
  if (error) {
    va_list arguments;
    va_start(arguments, format);
    std::vsnprintf(error->message, sizeof error->message, format, arguments);
    va_end(arguments);
    error->code = H6_ERROR_ARGUMENT;
  }
  return false;
}
bool fail(h6Error* error, h6ErrorCode code, const char* format, ...) {
  if (error) {
    va_list arguments;
    va_start(arguments, format);
    std::vsnprintf(error->message, sizeof error->message, format, arguments);
    va_end(arguments);
    error->code = code;
  }
  return false;
}

}  // namespace h6
