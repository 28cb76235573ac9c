// SPDX-License-Identifier: Apache-2.0
// README.md is true: its program is the one that is compiled and run, its paths exist.
#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>
#include <string>

namespace {
namespace fs = std::filesystem;
const fs::path root = HAPSIX_SOURCE_DIR;

std::string slurp(const fs::path& file) {
  std::ifstream in(file);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}
}  // namespace

TEST_CASE("the program in README.md is the one that is compiled and run") {
  const std::string program = slurp(root / "runtime/examples/hello.c");
  REQUIRE(program.size() > 500);
  const std::string shown = program.substr(program.find('\n') + 1);  // without the licence's line
  CHECK(slurp(root / "README.md").find("```c\n" + shown + "```\n") != std::string::npos);
}

TEST_CASE("folders and files that README.md and HACKING.md name are there") {
  const std::string readme = slurp(root / "README.md") + slurp(root / "HACKING.md");
  static const std::regex row(R"(\n\| `([a-z/]+)`[^|]*\|[^|]*\| `([a-z_.]+)` \|)");
  int seen = 0;
  for (std::sregex_iterator it(readme.begin(), readme.end(), row), end; it != end; ++it) {
    ++seen;
    const fs::path folder = root / (*it)[1].str();
    const fs::path file = folder / (*it)[2].str();
    CHECK_MESSAGE(fs::exists(file), file);
  }
  CHECK(seen >= 20);
  static const std::regex source(R"(`((?:runtime|kernels|sched|device|io)/[a-z_/]+\.(?:h|cpp))`)");
  for (std::sregex_iterator it(readme.begin(), readme.end(), source), end; it != end; ++it)
    CHECK_MESSAGE(fs::exists(root / (*it)[1].str()), (*it)[1].str());
}

TEST_CASE("README.md names verbs that ./dev has") {
  const std::string readme = slurp(root / "README.md"), dev = slurp(root / "dev");
  static const std::regex verb(R"(\./dev ([a-z]+))");
  int seen = 0;
  for (std::sregex_iterator it(readme.begin(), readme.end(), verb), end; it != end; ++it, ++seen)
    CHECK_MESSAGE(dev.find("\n  " + (*it)[1].str() + ")") != std::string::npos, (*it)[1].str());
  CHECK(seen >= 4);
}
