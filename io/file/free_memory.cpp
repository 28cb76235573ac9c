// SPDX-License-Identifier: Apache-2.0
#include "io/file/free_memory.h"

#include <algorithm>
#include <fstream>
#include <sstream>
#include <string>

namespace h6::io {
namespace {

namespace fs = std::filesystem;

// The number after `name` in a file of lines "name number"; an empty name: the first word.
std::optional<std::uint64_t> number_in(const fs::path& file, const std::string& name) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string word;
    if (!name.empty() && !(words >> word && word == name)) continue;
    std::uint64_t value = 0;
    if (words >> value) return value;
    return std::nullopt;  // "max"
  }
  return std::nullopt;
}

// The names of one version's files.
struct Version {
  const char *limit, *used, *inactive, *active;  // the last two: pages of files
};
constexpr Version kSecond{"memory.max", "memory.current", "inactive_file", "active_file"},
    kFirst{"memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file",
           "total_active_file"};

void bound(const fs::path& group, const Version& v, std::optional<std::uint64_t>& least) {
  const auto limit = number_in(group / v.limit, ""), used = number_in(group / v.used, "");
  if (!limit || !used) return;
  const auto stat = [&](const char* name) {
    return number_in(group / "memory.stat", name).value_or(0);
  };
  const std::uint64_t files = stat(v.inactive) + stat(v.active);
  const std::uint64_t kept = *used - std::min(*used, files);
  const std::uint64_t left = *limit - std::min(*limit, kept);
  least = least ? std::min(*least, left) : left;
}

}  // namespace

std::optional<std::uint64_t> free_memory(const fs::path& root) {
  std::optional<std::uint64_t> least;
  if (const auto kilobytes = number_in(root / "proc/meminfo", "MemAvailable:"))
    least = *kilobytes * 1024;
  // "0::/a/b" is the group of the second version, "9:memory:/a/b" that of the first. In a container
  // the path may be unknown, and its own group is at the top.
  std::ifstream groups(root / "proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string kinds = line.substr(first + 1, second - first - 1);
    const bool memory = ("," + kinds + ",").find(",memory,") != std::string::npos;
    if (!kinds.empty() && !memory) continue;
    const fs::path top = root / (memory ? "sys/fs/cgroup/memory" : "sys/fs/cgroup");
    fs::path way = fs::path(line.substr(second + 1)).relative_path();
    for (;; way = way.parent_path()) {
      bound(top / way, memory ? kFirst : kSecond, least);
      if (way.empty()) break;
    }
  }
  return least;
}

}  // namespace h6::io
