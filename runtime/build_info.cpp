// SPDX-License-Identifier: Apache-2.0
// build_info.cpp - which library this is.
#include <string>

#include "hapsix/base.h"
#include "kernels/targets.h"

extern "C" {

uint32_t h6Version(void) {
  return 10000 * H6_VERSION_MAJOR + 100 * H6_VERSION_MINOR + H6_VERSION_PATCH;
}

const char* h6BuildInfo(void) {
  static const std::string line = [] {
    std::string text = "hapsix " + std::to_string(H6_VERSION_MAJOR) + "." +
                       std::to_string(H6_VERSION_MINOR) + "." + std::to_string(H6_VERSION_PATCH) +
                       ", " __VERSION__
#ifndef NDEBUG
                       ", with assertions"
#endif
                       ", SIMD";
    const char* names[32];
    const std::size_t count = h6::kernels::supported_targets(names, 32);
    for (std::size_t i = 0; i < count; ++i) text += std::string(" ") + names[i];
    return text;
  }();
  return line.c_str();
}

}  // extern "C"
