// SPDX-License-Identifier: Apache-2.0
#include "io/study/parquet.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>

#include <cerrno>
#include <string>
#include <vector>

#include "io/file/write_aside.h"

extern char** environ;

namespace h6::study {
namespace {

namespace fs = std::filesystem;

constexpr int kNone = 3;  // exit code: there is no pyarrow

// A hash is text, also where all its digits are decimal.
constexpr const char* kProgram = R"python(
import sys
try:
    import pyarrow, pyarrow.csv, pyarrow.parquet
except ImportError:
    sys.exit(3)
kinds = pyarrow.csv.ConvertOptions(column_types={"state_hash": pyarrow.string(), "error": pyarrow.string()})
pyarrow.parquet.write_table(pyarrow.csv.read_csv(sys.argv[1], convert_options=kinds), sys.argv[2])
)python";

// The exit code; -1 when it could not be started or was killed.
int run_python(const std::string& python, const fs::path& csv, const fs::path& out) {
  posix_spawn_file_actions_t quiet;
  posix_spawn_file_actions_init(&quiet);
  for (const int to : {1, 2})
    posix_spawn_file_actions_addopen(&quiet, to, "/dev/null", O_WRONLY, 0);
  std::string words[] = {python, "-c", kProgram, csv.string(), out.string()};
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t child = -1;
  const int failed =
      posix_spawnp(&child, python.c_str(), &quiet, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&quiet);
  if (failed) return -1;
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace

Result<bool> write_parquet(const fs::path& csv, const fs::path& parquet) {
  bool there = false;
  const Outcome written = io::write_aside(parquet, [&](const fs::path& aside) -> Outcome {
    for (const char* python : {"python3", "/usr/bin/python3"}) {
      const int code = run_python(python, csv, aside);
      if (code == 0) return there = true, Done{};
      if (code >= 0 && code != kNone)
        return there = true, Failure{"pyarrow failed on " + csv.string()};
    }
    return Failure{"there is none"};
  });
  if (!there) return false;
  return written ? Result<bool>(true) : Result<bool>(Failure{written.error()});
}

}  // namespace h6::study
