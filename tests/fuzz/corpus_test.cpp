// SPDX-License-Identifier: Apache-2.0
// The seeds and all findings of the fuzzers, and seeded changes of them, go through every target.
#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "tests/fuzz/targets.h"

namespace {

namespace fs = std::filesystem;

std::vector<std::string> files_in(const fs::path& folder) {
  std::vector<std::string> all;
  std::error_code absent;
  std::vector<fs::path> names;
  for (const auto& entry : fs::directory_iterator(folder, absent)) names.push_back(entry.path());
  std::sort(names.begin(), names.end());
  for (const fs::path& name : names) {
    std::ifstream in(name, std::ios::binary);
    all.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
  }
  return all;
}

std::string changed(std::string bytes, std::mt19937_64& random) {
  for (unsigned n = 1 + random() % 4; n > 0 && !bytes.empty(); --n) {
    const std::size_t at = random() % bytes.size();
    switch (random() % 4) {
      case 0:
        bytes[at] = static_cast<char>(random());
        break;
      case 1:
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << random() % 8));
        break;
      case 2:
        bytes.resize(at);
        break;
      default:
        bytes.insert(at, bytes.substr(random() % bytes.size(), random() % 16));
        break;
    }
  }
  return bytes;
}

}  // namespace

TEST_CASE("every target has seeds and takes them, their changes and all findings") {
  const fs::path here = HAPSIX_SOURCE_DIR "/tests/fuzz";
  std::mt19937_64 random(23);
  for (const h6::fuzz::Target& target : h6::fuzz::targets()) {
    CAPTURE(std::string(target.name));
    target.take({});
    const std::vector<std::string> seeds = files_in(here / "corpus" / target.name);
    CHECK_FALSE(seeds.empty());
    for (const std::string& bytes : files_in(here / "findings" / target.name)) target.take(bytes);
    for (const std::string& bytes : seeds) {
      target.take(bytes);
      for (int i = 0; i < 200; ++i) target.take(changed(bytes, random));
    }
  }
}
