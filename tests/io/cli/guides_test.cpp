// SPDX-License-Identifier: Apache-2.0
// The guides are true: every command in them is run, in their order, in a folder of its own; links
// lead somewhere; the Python of every document runs where h5py and pandas are there.
#include <cstdlib>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "tests/io/cli/program.h"

using namespace h6::test;

namespace {

const fs::path guides = fs::path(HAPSIX_SOURCE_DIR) / "io/guide";

std::vector<fs::path> all_guides() {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(guides))
    if (entry.path().extension() == ".md") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

// All fenced blocks of one language, joined.
std::string blocks(const fs::path& guide, const std::string& language) {
  std::istringstream in(slurp(guide));
  std::string out;
  bool open = false, wanted = false;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("```")) {
      open = !open;
      wanted = open && line == "```" + language;
    } else if (wanted) {
      out += line + "\n";
    }
  }
  return out;
}

int shell(const std::string& command) { return std::system(command.c_str()); }

// Runs a script in `folder`, with the program on the path and a cache of its own.
int run_script(const Sandbox& box, const std::string& what, const fs::path& script,
               const fs::path& log) {
  const fs::path bin = fs::path(HAPSIX_PROGRAM).parent_path();
  return shell("cd '" + box.folder().string() + "' && HAPSIX_CACHE='" + box.cache().string() +
               "' HAPSIX='" + HAPSIX_SOURCE_DIR + "' PATH=\"" + bin.string() +
               ":$PATH\" PYTHONPATH='" + (bin / "python").string() + "' " + what + " '" +
               script.string() + "' > '" + log.string() + "' 2>&1 < /dev/null");
}

// Runs the Python of a document, all its blocks as one program.
void run_python(Sandbox& box, const fs::path& document) {
  if (shell("/usr/bin/python3 -c 'import h5py, numpy, pandas' 2> /dev/null") != 0) {
    MESSAGE("skipped: no h5py, numpy or pandas for the Python of ", document.filename().string());
    return;
  }
  const fs::path script = box.stream(), log = box.stream();
  spill(script, blocks(document, "python"));
  const int ran = run_script(box, "/usr/bin/python3", script, log);
  CHECK_MESSAGE(ran == 0, document.filename(), "\n", slurp(log));
}

}  // namespace

TEST_CASE("every command of every guide runs") {
  int with_commands = 0;
  for (const fs::path& guide : all_guides()) {
    const std::string commands = blocks(guide, "sh");
    if (commands.empty()) continue;
    ++with_commands;
    Sandbox box;
    const fs::path script = box.stream(), log = box.stream();
    spill(script, commands);
    const int code = run_script(box, "bash -e -o pipefail", script, log);
    CHECK_MESSAGE(code == 0, guide.filename(), "\n", slurp(log));
    if (!blocks(guide, "python").empty()) run_python(box, guide);
  }
  CHECK(with_commands >= 6);
}

TEST_CASE("the Python of README.md runs, and no other document has some that does not") {
  const fs::path readme = fs::path(HAPSIX_SOURCE_DIR) / "README.md";
  REQUIRE(blocks(readme, "python").size() > 200);
  Sandbox box;
  run_python(box, readme);
  int seen = 0;
  fs::recursive_directory_iterator file(HAPSIX_SOURCE_DIR), end;
  for (; file != end; ++file) {
    const std::string name = file->path().filename().string();
    if (file->is_directory() && (name == "build" || name.starts_with("."))) {
      file.disable_recursion_pending();
    } else if (name.ends_with(".md")) {
      ++seen;
      CAPTURE(file->path());
      for (const char* unknown : {"py", "python3", "pycon"})
        CHECK(blocks(file->path(), unknown).empty());
      const bool runs = file->path() == readme || file->path().parent_path() == guides;
      CHECK((runs || blocks(file->path(), "python").empty()));
    }
  }
  CHECK(seen > 15);
}

TEST_CASE("the guides have no command outside the blocks that are run") {
  for (const fs::path& guide : all_guides())
    for (const char* other : {"", "text", "bash", "console", "shell"})
      CHECK_MESSAGE(blocks(guide, other).find("hapsix ") == std::string::npos, guide.filename(),
                    " has commands in a block of '", other, "'");
}

// Those in a sentence name scenes and files that only a reader has.
TEST_CASE("every command in a sentence has words and options that the program knows") {
  static const std::regex command("`hapsix ([^`]+)`"), option("--[a-z-]+");
  std::vector<fs::path> files = all_guides();
  files.push_back(fs::path(HAPSIX_SOURCE_DIR) / "README.md");
  Sandbox box;
  int seen = 0;
  for (const fs::path& file : files) {
    const std::string text = slurp(file);
    for (std::sregex_iterator it(text.begin(), text.end(), command), end; it != end; ++it, ++seen) {
      const std::string said = (*it)[1].str();
      std::istringstream words(said);
      std::string first, second;
      words >> first >> second;
      Args help = {first, "--help"};
      if (first == "bake" || first == "scene") help = {first, second, "--help"};
      const Ended ended = run(box, help);
      CHECK_MESSAGE(ended.code == 0, file.filename(), ": hapsix ", said);
      for (std::sregex_iterator o(said.begin(), said.end(), option), none; o != none; ++o)
        CHECK_MESSAGE(ended.out.find(o->str()) != std::string::npos, file.filename(), ": hapsix ",
                      said);
    }
  }
  CHECK(seen > 15);
}

TEST_CASE("links of the guides lead somewhere") {
  static const std::regex link(R"(\]\(([^)#:]+)(#[^)]*)?\))");
  int seen = 0;
  for (const fs::path& guide : all_guides()) {
    const std::string text = slurp(guide);
    for (std::sregex_iterator it(text.begin(), text.end(), link), end; it != end; ++it, ++seen)
      CHECK_MESSAGE(fs::exists(guide.parent_path() / (*it)[1].str()), guide.filename(), " names ",
                    (*it)[1].str());
  }
  CHECK(seen > 10);
}

// ./dev test-view draws them, and fails where one shows next to nothing.
TEST_CASE("every picture of the gallery is drawn by its command") {
  static const std::regex picture(R"(pictures/([a-z]+)\.png)");
  const std::string text = slurp(guides / "gallery.md");
  const fs::path drawn = fs::path(HAPSIX_SOURCE_DIR) / "tests/io/view/browser/gallery.mjs";
  const std::string script = slurp(drawn);
  int seen = 0;
  for (std::sregex_iterator it(text.begin(), text.end(), picture), end; it != end; ++it, ++seen)
    CHECK_MESSAGE(script.find("'" + (*it)[1].str()) != std::string::npos, (*it)[1].str());
  CHECK(seen >= 5);
}
