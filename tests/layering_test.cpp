// SPDX-License-Identifier: Apache-2.0
// The house stands: includes point down, packages enter through one folder, link lines agree.
#include <doctest/doctest.h>

#include <algorithm>
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

// This table says what each room may include besides itself. A file belongs to the deepest room
// that holds it; "contract" is runtime/include. The order is from the bottom to the top.
using Rooms = std::map<std::string, std::set<std::string>>;
const Rooms& below() {
  static const Rooms rooms = [] {
    Rooms r;
    // A room, and the rooms that it sees. What it sees, its users do not see through it.
    const auto room = [&](const std::string& name, std::set<std::string> sees) {
      r[name] = std::move(sees);
    };
    room("contract", {});
    room("kernels", {"contract"});
    room("kernels/field", {"contract", "kernels"});
    room("kernels/contact", {"contract", "kernels", "kernels/field"});
    room("kernels/weights", {"contract", "kernels"});
    room("kernels/bake", {"contract", "kernels"});
    room("kernels/bend", {"contract", "kernels"});
    room("sched", {"contract"});

    room("runtime/base", {"contract"});
    room("runtime/model",
         {"contract", "kernels", "kernels/field", "kernels/bend", "sched", "runtime/base"});
    room("runtime/settings", {"contract", "runtime/model"});
    room("runtime/hand", {"contract", "runtime/base"});
    room("runtime/contact",
         {"contract", "kernels", "kernels/field", "kernels/contact", "kernels/weights",
          "kernels/bend", "sched", "runtime/base", "runtime/model"});
    room("runtime/motion", {"contract", "kernels", "kernels/bend", "runtime/base", "runtime/hand",
                            "runtime/contact"});
    room("runtime/frame", {"contract", "sched", "runtime/base", "runtime/settings", "runtime/model",
                           "runtime/contact", "runtime/motion"});
    room("runtime/loop", {"contract", "sched", "runtime/base", "runtime/settings", "runtime/hand",
                          "runtime/frame"});
    room("runtime", {"contract", "kernels", "kernels/contact", "sched", "runtime/base",
                     "runtime/settings", "runtime/contact", "runtime/frame"});

    room("runtime/examples", {"contract"});

    room("device", {"contract", "sched"});
    room("device/plugins", {"contract"});

    room("io/file", {"contract", "sched"});
    room("io/mesh", {"contract", "sched", "kernels/bake", "io/file"});
    room("io/field", {"contract", "sched", "kernels/field", "io/file", "io/mesh"});
    room("io/walls", {"contract", "sched", "io/mesh"});
    room("io/bake", {"contract", "sched", "kernels", "kernels/bake", "io/file", "io/mesh",
                     "io/walls", "io/field"});
    room("io/shell", {"contract", "sched", "io/file", "io/mesh", "io/field", "io/bake"});
    room("io/check", {"contract", "sched", "kernels", "kernels/field", "kernels/bake", "io/file",
                      "io/mesh", "io/walls", "io/field"});
    room("io/deform",
         {"contract", "sched", "io/file", "io/mesh", "io/field", "io/bake", "io/record"});
    room("io/scene", {"contract", "sched", "runtime/settings", "io/file", "io/mesh", "io/field",
                      "io/bake", "io/shell", "io/deform"});
    room("io/propose", {"contract", "sched", "io/file", "io/mesh", "io/field", "io/bake",
                        "io/shell", "io/check", "io/scene"});
    room("io/scenes", {"contract", "io/file", "io/mesh", "io/shell", "io/scene"});
    room("io/scenes/paper", {"contract", "io/file", "io/mesh", "io/scene", "io/scenes"});
    room("io/scenes/industrial", {"contract", "io/file", "io/mesh", "io/scene", "io/scenes"});
    room("io/scenes/machines",
         {"contract", "io/file", "io/mesh", "io/scene", "io/scenes", "io/scenes/industrial"});
    room("io/record", {"contract", "io/file"});
    room("io/api", {"contract", "runtime/base", "io/file", "io/mesh", "io/field", "io/shell",
                    "io/check", "io/scene", "io/scenes", "io/record"});
    room("io/examples", {"contract", "io/api"});
    room("python", {"contract", "io/api"});
    room("io/view",
         {"contract", "io/file", "io/mesh", "io/field", "io/shell", "io/scene", "io/record"});
    room("io/console", {"contract", "io/file"});
    room("io/run", {"contract", "kernels", "sched", "device", "io/console", "io/file", "io/mesh",
                    "io/scene", "io/scenes", "io/record", "io/view"});
    room("io/study", {"contract", "io/file", "io/mesh", "io/scene", "io/scenes"});
    room("io/experiments", {"contract", "kernels", "sched", "io/console", "io/file", "io/mesh",
                            "io/field", "io/bake", "io/shell", "io/scene", "io/scenes",
                            "io/scenes/paper", "io/scenes/industrial", "io/record", "io/run"});
    std::set<std::string> map = r["io/experiments"];
    map.insert("io/experiments");
    std::set<std::string> forced = map;
    map.insert("io/study");
    room("io/experiments/map", map);
    forced.insert("kernels/weights");
    room("io/experiments/forced", forced);
    // Programs and proof see everything.
    std::set<std::string> all;
    for (const auto& [name, sees] : r) all.insert(name);
    room("io/cli", all);
    all.insert("io/cli");
    room("bench", all);
    r["bench"].insert("tests");
    all.insert("bench");
    room("bench/peers", all);
    all.erase("bench");
    room("tests", all);
    return r;
  }();
  return rooms;
}

// Where each package enters: a room, or a box with all its rooms.
const std::vector<std::pair<std::string, std::set<std::string>>> packages = {
    {"hwy/", {"kernels"}},
    {"tbb/", {"sched"}},
    {"oneapi/", {"sched", "bench"}},
    {"Eigen/", {"runtime", "io/deform"}},
    {"Spectra/", {"io/deform"}},  // models are reduced offline: the engine gets their arrays
    {"openvdb/", {"io/field"}},
    {"embree", {"io/mesh"}},
    {"hdf5", {"io/record", "io/deform"}},
    {"H5", {"io/record", "io/deform"}},
    {"xxhash", {"io/file"}},
    {"pugixml", {"io/mesh"}},
    {"nlohmann/", {"io", "device/plugins"}},
    {"CLI/", {"io/cli"}},
    {"boost/", {"io/view", "device/plugins"}},
    {"meshoptimizer", {"io/view"}},
    {"zlib.h", {"io"}},
    {"hidapi", {"device"}},
    {"pybind11/", {"python"}},
    {"doctest/", {"tests"}},
    {"benchmark/", {"bench"}},
    {"ode/", {"bench/peers", "runtime/examples"}},
    {"fcl/", {"bench/peers"}},
    {"nanovdb/", {"bench/peers"}},
    {"BulletCollision/", {"bench/peers"}},
    {"btBullet", {"bench/peers"}},
};

// The deepest room that holds this path; empty when none does.
std::string room_of(std::string path) {
  if (path == "hapsix/io.h") return "io/api";
  if (path.rfind("hapsix/", 0) == 0 || path.rfind("runtime/include/", 0) == 0) return "contract";
  while (!path.empty()) {
    const std::size_t slash = path.rfind('/');
    path = slash == std::string::npos ? "" : path.substr(0, slash);
    if (below().count(path)) return path;
  }
  return "";
}

std::string room_of_file(const fs::path& file) {
  return room_of(fs::relative(file, root).generic_string());
}

bool is_in(const std::string& room, const std::set<std::string>& places) {
  for (const std::string& place : places)
    if (room == place || room.rfind(place + "/", 0) == 0) return true;
  return false;
}

std::string box_of(const std::string& room) { return room.substr(0, room.find('/')); }

std::vector<fs::path> sources() {
  std::vector<fs::path> files;
  for (const char* box :
       {"kernels", "sched", "runtime", "device", "io", "python", "tests", "bench"})
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

TEST_CASE("every file stands in a room, and every folder holds at most 30 files") {
  std::map<std::string, int> files;
  for (const fs::path& file : sources()) {
    const std::string room = room_of_file(file);
    CHECK_MESSAGE(!room.empty(), file, " is in no room");
    ++files[file.parent_path().string()];
  }
  for (const auto& [folder, count] : files) CHECK_MESSAGE(count <= 30, folder, " has ", count);
  CHECK(files.size() > 20);  // the scan works
}

TEST_CASE("the rooms have an order: no two see each other, directly or through others") {
  std::set<std::string> placed;
  for (std::size_t before = placed.size() + 1; before != placed.size();) {
    before = placed.size();
    for (const auto& [room, sees] : below())
      if (std::includes(placed.begin(), placed.end(), sees.begin(), sees.end()))
        placed.insert(room);
  }
  CHECK(placed.size() == below().size());
}

TEST_CASE("every include points to the same room or one below") {
  std::size_t seen = 0;
  for (const Include& include : includes()) {
    const std::string from = room_of_file(include.file), to = room_of(include.name);
    if (to.empty() || from == to) continue;
    ++seen;
    CHECK_MESSAGE(below().at(from).count(to) == 1, include.file, ":", include.line, " includes ",
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
      const std::string room = room_of_file(include.file);
      // These may look at anything that the program needs anyway.
      const bool proof =
          (room == "tests" || box_of(room) == "bench") && !allowed.count("bench/peers");
      CHECK_MESSAGE((proof || is_in(room, allowed)), include.file, ":", include.line, " includes ",
                    include.name);
    }
  CHECK(seen > 20);
}

TEST_CASE("headers that pull a heavy package in stay inside their own box") {
  const std::vector<Include> all = includes();
  const auto path_of = [](const Include& i) { return fs::relative(i.file, root).generic_string(); };
  const auto is_header = [](const Include& i) { return i.file.extension() == ".h"; };
  std::set<std::string> heavy;  // headers with such an include, directly or through another
  for (const Include& i : all)
    for (const char* prefix : {"openvdb/", "embree", "assimp/", "H5", "hdf5", "nlohmann/json.hpp",
                               "tbb/", "oneapi/", "Eigen/", "hwy/"})
      if (!i.quoted && is_header(i) && i.name.rfind(prefix, 0) == 0) heavy.insert(path_of(i));
  for (std::size_t before = 0; before != heavy.size();) {
    before = heavy.size();
    for (const Include& i : all)
      if (i.quoted && is_header(i) && heavy.count(i.name)) heavy.insert(path_of(i));
  }
  CHECK(heavy.size() > 3);
  for (const Include& i : all) {
    const std::string box = box_of(room_of_file(i.file));
    if (!i.quoted || !heavy.count(i.name) || box == "tests" || box == "bench") continue;
    CHECK_MESSAGE(box == box_of(room_of(i.name)), i.file, ":", i.line, " includes ", i.name);
  }
}

TEST_CASE("link lines agree with the house") {
  static const std::regex call(R"(h6_library\(\s*([a-z_]+)([^)]*)\))");
  static const std::regex target(R"(hapsix_([a-z]+))");
  // One library a box; io has three, since scenes and recordings are not optimised.
  const std::map<std::string, std::set<std::string>> links = {
      {"kernels", {"contract"}},
      {"sched", {"contract"}},
      {"runtime", {"contract", "kernels", "sched"}},
      {"device", {"contract", "sched"}},
      {"io", {"contract", "runtime", "kernels", "sched"}},
      {"deform", {"io"}},
      {"scene", {"io", "deform"}},
  };
  std::size_t seen = 0;
  for (const char* box : {"kernels", "sched", "runtime", "device", "io"}) {
    const std::string text = slurp(root / box / "CMakeLists.txt");
    for (std::sregex_iterator it(text.begin(), text.end(), call), end; it != end; ++it) {
      const std::string library = (*it)[1], body = (*it)[2];
      const auto allowed = links.find(library);
      REQUIRE_MESSAGE(allowed != links.end(), box, " has an unknown library ", library);
      for (std::sregex_iterator t(body.begin(), body.end(), target); t != end; ++t) {
        if ((*t)[1] == library) continue;  // its own name, in what is said about it later
        ++seen;
        CHECK_MESSAGE(allowed->second.count((*t)[1]) == 1, library, " links ", (*t)[0].str());
      }
    }
  }
  CHECK(seen >= 8);
}

TEST_CASE("every source file names its licence in its first line") {
  for (const fs::path& file : sources()) {
    std::ifstream in(file);
    std::string first;
    std::getline(in, first);
    CHECK_MESSAGE(first == "// SPDX-License-Identifier: Apache-2.0", file);
  }
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
