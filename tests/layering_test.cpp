// The house stands: includes point down, packages enter through one folder, link lines agree.
#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace {

namespace fs = std::filesystem;
const fs::path root = HAPSIX_SOURCE_DIR;

// What each box may include. "contract" is runtime/include.
const std::map<std::string, std::set<std::string>> below = {
    {"contract", {}},
    {"kernels", {"contract"}},
    {"sched", {"contract"}},
    {"runtime", {"contract", "kernels", "sched"}},
    {"device", {"contract", "sched"}},
    {"io", {"contract", "runtime", "kernels", "sched"}},
    {"io/view", {"contract", "io"}},
    {"io/cli", {"contract", "runtime", "kernels", "sched", "io", "io/view", "device"}},
    {"tests", {"contract", "runtime", "kernels", "sched", "io", "io/view", "device", "io/cli"}},
    {"bench", {"contract", "runtime", "kernels", "sched", "io", "device", "tests"}},
};

// Where each package enters.
const std::vector<std::pair<std::string, std::set<std::string>>> packages = {
    {"hwy/", {"kernels"}},
    {"tbb/", {"sched"}},
    {"oneapi/", {"sched"}},
    {"Eigen/", {"runtime"}},
    {"Spectra/", {"runtime"}},
    {"openvdb/", {"io"}},
    {"embree3/", {"io"}},
    {"assimp/", {"io"}},
    {"hdf5", {"io"}},
    {"H5", {"io"}},
    {"nlohmann/", {"io", "io/view", "io/cli"}},
    {"CLI/", {"io/cli"}},
    {"boost/", {"io/view"}},
    {"meshoptimizer", {"io/view"}},
    {"zlib.h", {"io", "io/view"}},
    {"hidapi", {"device"}},
    {"doctest/", {"tests"}},
    {"benchmark/", {"bench"}},
};

std::string box_of(const fs::path& file) {
  const std::string path = fs::relative(file, root).generic_string();
  if (path.rfind("runtime/include/", 0) == 0) return "contract";
  for (const char* box : {"io/cli", "io/view"})
    if (path.rfind(std::string(box) + "/", 0) == 0) return box;
  return path.substr(0, path.find('/'));
}

std::string box_of_include(const std::string& name) {
  if (name.rfind("hapsix/", 0) == 0) return "contract";
  for (const char* box : {"io/cli", "io/view"})
    if (name.rfind(std::string(box) + "/", 0) == 0) return box;
  const std::string first = name.substr(0, name.find('/'));
  return below.count(first) ? first : "";
}

std::vector<fs::path> sources() {
  std::vector<fs::path> files;
  for (const char* box : {"kernels", "sched", "runtime", "device", "io", "tests", "bench"})
    for (const auto& entry : fs::recursive_directory_iterator(root / box)) {
      const std::string ending = entry.path().extension().string();
      if (ending == ".h" || ending == ".cpp" || ending == ".c") files.push_back(entry.path());
    }
  return files;
}

struct Include {
  fs::path file;
  int line;
  std::string name;
  bool quoted;
};

std::vector<Include> includes() {
  static const std::regex pattern(R"(^\s*#\s*include\s*([<"])([^>"]+)[>"])");
  std::vector<Include> found;
  for (const fs::path& file : sources()) {
    std::ifstream in(file);
    std::string text;
    for (int line = 1; std::getline(in, text); ++line) {
      std::smatch match;
      if (std::regex_search(text, match, pattern))
        found.push_back({file, line, match[2], match[1] == "\""});
    }
  }
  return found;
}

std::string slurp(const fs::path& file) {
  std::ifstream in(file);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

}  // namespace

TEST_CASE("every include points to the same box or one below") {
  std::size_t seen = 0;
  for (const Include& include : includes()) {
    const std::string from = box_of(include.file), to = box_of_include(include.name);
    if (to.empty() || from == to) continue;
    ++seen;
    CHECK_MESSAGE(below.at(from).count(to) == 1, include.file, ":", include.line, " includes ",
                  include.name);
  }
  CHECK(seen > 50);  // the scan works
}

TEST_CASE("each package enters through one folder, and never through the contract") {
  std::size_t seen = 0;
  for (const Include& include : includes())
    for (const auto& [prefix, allowed] : packages) {
      if (include.quoted || include.name.rfind(prefix, 0) != 0) continue;
      ++seen;
      const std::string box = box_of(include.file);
      const bool proof = box == "tests" || box == "bench";  // may look at anything
      CHECK_MESSAGE((proof || allowed.count(box) == 1), include.file, ":", include.line,
                    " includes ", include.name);
    }
  CHECK(seen > 20);
}

TEST_CASE("headers that pull a heavy package in stay inside their own box") {
  const std::vector<Include> all = includes();
  const auto path_of = [](const Include& i) { return fs::relative(i.file, root).generic_string(); };
  const auto is_header = [](const Include& i) { return i.file.extension() == ".h"; };
  std::set<std::string> heavy;  // headers with such an include, directly or through another
  for (const Include& i : all)
    for (const char* prefix : {"openvdb/", "embree3/", "assimp/", "H5", "hdf5", "nlohmann/json.hpp",
                               "tbb/", "oneapi/", "Eigen/", "hwy/"})
      if (!i.quoted && is_header(i) && i.name.rfind(prefix, 0) == 0) heavy.insert(path_of(i));
  for (std::size_t before = 0; before != heavy.size();) {
    before = heavy.size();
    for (const Include& i : all)
      if (i.quoted && is_header(i) && heavy.count(i.name)) heavy.insert(path_of(i));
  }
  CHECK(heavy.size() > 3);
  for (const Include& i : all) {
    const std::string box = box_of(i.file);
    if (!i.quoted || !heavy.count(i.name) || box == "tests" || box == "bench") continue;
    CHECK_MESSAGE(box == box_of_include(i.name), i.file, ":", i.line, " includes ", i.name);
  }
}

TEST_CASE("link lines agree with the house") {
  static const std::regex call(R"(h6_library\(\s*([a-z_]+)([^)]*)\))");
  static const std::regex target(R"(hapsix_([a-z]+))");
  std::size_t seen = 0;
  for (const char* box : {"kernels", "sched", "runtime", "device", "io"}) {
    const std::string text = slurp(root / box / "CMakeLists.txt");
    for (std::sregex_iterator it(text.begin(), text.end(), call), end; it != end; ++it) {
      CHECK((*it)[1] == box);  // one target a box
      const std::string body = (*it)[2];
      for (std::sregex_iterator t(body.begin(), body.end(), target); t != end; ++t) {
        ++seen;
        CHECK_MESSAGE(below.at(box).count((*t)[1]) == 1, box, " links ", (*t)[0].str());
      }
    }
  }
  CHECK(seen >= 7);
}

TEST_CASE("no file names an instruction set or loosens floating point for the compiler") {
  for (const auto& entry : fs::recursive_directory_iterator(root)) {
    const fs::path& file = entry.path();
    if (file.string().find("/build/") != std::string::npos) continue;
    if (file.filename() != "CMakeLists.txt" && file.filename() != "CMakePresets.json") continue;
    const std::string text = slurp(file);
    for (const char* flag : {"-march=", "-mavx", "-ffast-math", "-Ofast"})
      CHECK_MESSAGE(text.find(flag) == std::string::npos, file, " has ", flag);
  }
}
