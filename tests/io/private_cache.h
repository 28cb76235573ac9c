// SPDX-License-Identifier: Apache-2.0
// private_cache.h - a cache folder for one test program, which is removed at its end.
#pragma once
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>

namespace h6::test {

struct PrivateCache {
  std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("hapsix-test-" + std::to_string(getpid()));
  PrivateCache() {
    std::filesystem::create_directories(folder);
    setenv("HAPSIX_CACHE", folder.c_str(), 1);
  }
  ~PrivateCache() { std::filesystem::remove_all(folder); }
};
inline const PrivateCache private_cache;

}  // namespace h6::test
