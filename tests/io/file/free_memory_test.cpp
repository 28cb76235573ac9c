// SPDX-License-Identifier: Apache-2.0
// How much memory is free, by copies of the files in which the system tells it.
#include <doctest/doctest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "io/file/free_memory.h"

namespace fs = std::filesystem;
using h6::io::free_memory;

namespace {

constexpr std::uint64_t kGiga = 1u << 30;

class Root {
 public:
  Root() {
    char name[] = "/tmp/hapsix-memory-XXXXXX";
    REQUIRE(mkdtemp(name) != nullptr);
    root_ = name;
  }
  ~Root() {
    std::error_code ignored;
    fs::remove_all(root_, ignored);
  }
  Root(const Root&) = delete;
  Root& operator=(const Root&) = delete;
  const fs::path& path() const { return root_; }
  void file(const std::string& name, const std::string& text) const {
    fs::create_directories((root_ / name).parent_path());
    std::ofstream(root_ / name) << text;
  }

 private:
  fs::path root_;
};

}  // namespace

TEST_CASE("free memory is the least of the machine's and of what every control group leaves") {
  const Root root;
  CHECK_FALSE(free_memory(root.path()));
  root.file("proc/meminfo", "MemTotal: 16777216 kB\nMemFree: 1000 kB\nMemAvailable: 8388608 kB\n");
  CHECK(free_memory(root.path()) == 8 * kGiga);
  root.file("proc/self/cgroup", "0::/jobs/one\n");
  CHECK(free_memory(root.path()) == 8 * kGiga);
  root.file("sys/fs/cgroup/jobs/one/memory.max", "max\n");
  root.file("sys/fs/cgroup/jobs/one/memory.current", "1073741824\n");
  CHECK(free_memory(root.path()) == 8 * kGiga);
  // The group above has 4 GiB, of which 3 are taken, and 1 of these by pages of files.
  root.file("sys/fs/cgroup/jobs/memory.max", "4294967296\n");
  root.file("sys/fs/cgroup/jobs/memory.current", "3221225472\n");
  root.file("sys/fs/cgroup/jobs/memory.stat",
            "anon 1\ninactive_file 536870912\nactive_file 536870912\n");
  CHECK(free_memory(root.path()) == 2 * kGiga);
  // The first version, in a container that does not see its own path.
  root.file("proc/self/cgroup", "12:cpu,cpuacct:/box\n9:memory:/box\n");
  root.file("sys/fs/cgroup/memory/memory.limit_in_bytes", "2147483648\n");
  root.file("sys/fs/cgroup/memory/memory.usage_in_bytes", "1073741824\n");
  CHECK(free_memory(root.path()) == kGiga);
  root.file("sys/fs/cgroup/memory/memory.usage_in_bytes", "9073741824\n");
  CHECK(free_memory(root.path()) == 0);
  CHECK(free_memory());  // this machine tells
}
