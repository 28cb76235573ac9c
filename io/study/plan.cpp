// SPDX-License-Identifier: Apache-2.0
#include "io/study/plan.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "hapsix/hapsix.h"
#include "io/file/content_hash.h"
#include "io/file/json.h"
#include "io/scene/check.h"
#include "io/scene/scene_file.h"
#include "io/scenes/scenes.h"

namespace h6::study {
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

namespace {

constexpr std::size_t kMostRuns = 1000000, kMostScenes = 100;
constexpr std::size_t kLongestKey = 300;  // each word is a level of JSON, and those cost stack

struct Varied {
  std::string key;
  std::vector<Json> values;
};
struct Drawn {
  std::string key;
  double low = 0, high = 0;
};

// A mistake in STUDY.json, on its way to the one place that makes a Failure of it.
struct Mistake {
  std::string sentence;
};

double number_of(const Json& from, const char* key, const std::string& where) {
  if (!from.contains(key) || !from[key].is_number() || !std::isfinite(from[key].get<double>()))
    throw Mistake{where + " needs a number '" + key + "'"};
  return from[key].get<double>();
}

std::uint64_t whole_of(const Json& from, const char* key, std::uint64_t usual, std::uint64_t most) {
  if (!from.contains(key)) return usual;
  if (!from[key].is_number_unsigned() || from[key].get<std::uint64_t>() > most)
    throw Mistake{std::string(key) + " must be a whole number from 0 to " + std::to_string(most)};
  return from[key].get<std::uint64_t>();
}

void refuse_others(const Json& object, const std::vector<std::string>& known,
                   const std::string& where) {
  for (const auto& [key, value] : object.items())
    if (std::find(known.begin(), known.end(), key) == known.end())
      throw Mistake{where + " has an unknown key '" + io::shown(key) + "'"};
}

Varied varied(const std::string& key, const Json& given) {
  const std::string where = "vary '" + key + "'";
  Varied out{key, {}};
  if (given.is_array()) {
    for (const Json& value : given) out.values.push_back(value);
  } else if (given.is_object()) {
    refuse_others(given, {"from", "to", "count", "log"}, where);
    const double from = number_of(given, "from", where), to = number_of(given, "to", where);
    const std::uint64_t count = whole_of(given, "count", 2, kMostRuns);
    const bool log = given.value("log", false);
    if (log && !(from > 0 && to > 0)) throw Mistake{where + ": log needs 'from' and 'to' above 0"};
    for (std::uint64_t i = 0; i < count; ++i) {
      // The product comes first: steps of 0.04 are then 0.04 and not 0.03999…
      const double at = static_cast<double>(i),
                   last = std::max(1.0, static_cast<double>(count) - 1);
      const double value =
          log ? from * std::pow(to / from, at / last) : from + (to - from) * at / last;
      if (!std::isfinite(value)) throw Mistake{where + ": 'from' and 'to' are too far apart"};
      out.values.push_back(value);
    }
  }
  if (out.values.empty())
    throw Mistake{where + " must be a list of values, or {\"from\", \"to\", \"count\"}"};
  return out;
}

Drawn drawn(const std::string& key, const Json& given) {
  const std::string where = "draw '" + key + "'";
  if (!given.is_object()) throw Mistake{where + " must be {\"low\", \"high\"}"};
  refuse_others(given, {"low", "high"}, where);
  const Drawn out{key, number_of(given, "low", where), number_of(given, "high", where)};
  if (!std::isfinite(out.high - out.low))
    throw Mistake{where + ": 'low' and 'high' are too far apart"};
  return out;
}

std::size_t check_runs(std::size_t runs) {
  if (runs < 1 || runs > kMostRuns)
    throw Mistake{"these are " + std::to_string(runs) + " or more runs: 1 to " +
                  std::to_string(kMostRuns)};
  return runs;
}

void check_key(const std::string& key) {
  if (key.size() > kLongestKey)
    throw Mistake{"the key '" + io::shown(key) + "' is longer than " + std::to_string(kLongestKey) +
                  " bytes"};
}

// A number in [0, 1) that depends on these three alone.
double draw(std::uint64_t seed, std::uint64_t repeat, std::uint64_t key) {
  const std::uint64_t words[] = {repeat, key};
  return static_cast<double>(io::hash_on(seed, words, sizeof words) >> 11) * 0x1p-53;
}

// The element of a list that a word of a key names.
Json* element(Json& list, const std::string& word) {
  for (Json& one : list)
    for (const char* name : {"name", "body"})
      if (one.is_object() && one.contains(name) && one[name] == word) return &one;
  std::size_t i = list.size();
  if (word.size() == 1 && std::string("xyz").find(word) != std::string::npos && list.size() == 3)
    i = std::string("xyz").find(word);
  else if (word.size() == 1 && std::string("wxyz").find(word) != std::string::npos &&
           list.size() == 4)
    i = std::string("wxyz").find(word);
  else if (!word.empty() && word.size() < 6 &&
           word.find_first_not_of("0123456789") == std::string::npos)
    i = std::stoul(word);
  return i < list.size() ? &list[i] : nullptr;
}

void put(Json& scene, const std::string& key, const Json& value) {
  Json* at = &scene;
  std::stringstream words(key);
  for (std::string word; std::getline(words, word, '.');) {
    if (at->is_array()) {
      at = element(*at, word);
      if (!at) throw Mistake{"the scene has no '" + word + "' for the key '" + key + "'"};
    } else if (at->is_object() || at->is_null()) {
      at = &(*at)[word];
    } else {
      throw Mistake{"'" + word + "' in the key '" + key + "' is inside a value, not a setting"};
    }
  }
  *at = value;
}

// A scene's file names become absolute, since its text goes elsewhere.
template <class Use>
void each_file(io::Scene& scene, Use&& use) {
  const auto both = [&](auto& source) {
    if (!source) return;
    for (fs::path* file : {&source->mesh, &source->file})
      if (!file->empty()) use(*file);
  };
  for (io::SceneBody& body : scene.bodies) {
    both(body.field), both(body.shell);
    if (body.shell && body.shell->bends && !body.shell->bends->file.empty())
      use(body.shell->bends->file);
  }
}

std::string content_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

// One scene of a study.
struct Base {
  std::string name;  // in the table
  fs::path file;
  io::Scene scene;
  Json text;
};

struct SceneFile {
  fs::path file;
  bool exported;  // by this program, so what it names is our own
};

// The file of a scene; a generated one is exported first, to a folder of its name. Only names of
// generated scenes become folders, and those have letters, digits and hyphens alone.
Result<SceneFile> scene_file_of(const std::string& name, const fs::path& study,
                                const fs::path& folder) {
  const fs::path file = fs::path(name).is_absolute() ? fs::path(name) : study.parent_path() / name;
  std::error_code error;
  if (fs::is_regular_file(file, error)) return SceneFile{file, false};
  const std::vector<io::SceneName> known = io::scene_names();
  if (std::none_of(known.begin(), known.end(),
                   [&](const io::SceneName& one) { return one.name == name; }))
    return Failure{io::shown(name) + ": there is neither such a file nor such a generated scene"};
  const fs::path exported = folder / "scenes" / name;
  if (fs::exists(exported / "scene.json", error)) return SceneFile{exported / "scene.json", true};
  const Result<io::Scene> made = io::make_scene(name);
  if (!made) return made.failure();
  // Aside first: a kill leaves no half scene.
  fs::path aside = exported;
  aside += ".unfinished";
  fs::remove_all(aside, error);
  fs::create_directories(exported.parent_path(), error);
  if (const Outcome out = io::export_scene(*made, aside); !out) return out.failure();
  fs::rename(aside, exported, error);
  if (error) return Failure{"cannot write " + exported.string() + ": " + error.message()};
  return SceneFile{exported / "scene.json", true};
}

Result<Base> read_base(const std::string& name, const fs::path& study, const fs::path& folder,
                       bool outside) {
  const Result<SceneFile> at = scene_file_of(name, study, folder);
  if (!at) return at.failure();
  Result<io::Scene> scene = io::read_scene(at->file, !at->exported && outside);
  if (!scene) return scene.failure();
  Base out{scene->name, at->file, std::move(*scene), {}};
  each_file(out.scene, [](fs::path& f) { f = fs::absolute(f).lexically_normal(); });
  out.text = Json::parse(io::scene_text(out.scene));
  return out;
}

// The names in "scene": one, or a list of them.
std::vector<std::string> scene_names_of(const Json& given) {
  if (given.is_string()) return {given.get<std::string>()};
  std::vector<std::string> out;
  for (const Json& name : given) {
    if (!name.is_string()) throw Mistake{"a scene of the list is no name"};
    out.push_back(name.get<std::string>());
  }
  if (out.empty() || out.size() > kMostScenes)
    throw Mistake{"a list of scenes has 1 to " + std::to_string(kMostScenes)};
  return out;
}

}  // namespace

struct Plan::Parts {
  std::vector<std::string> names;  // in "scene"
  std::vector<Base> bases;
  bool listed = false;   // the scenes are a list, and so a key
  bool outside = false;  // their files may lie outside their folders
  std::vector<Varied> vary;
  std::vector<Drawn> draws;
  std::uint64_t repeats = 1, seed = 1;
  std::vector<std::string> keys;
  std::string identity;

  std::size_t runs_a_scene() const {
    std::size_t n = repeats;
    for (const Varied& v : vary) n *= v.values.size();
    return n;
  }
  const Base& base(std::size_t run) const { return bases[run / runs_a_scene()]; }
  // The values of a run, one for each key; the last of `vary` changes fastest, then repeats.
  std::vector<Json> values(std::size_t run) const {
    std::vector<Json> out(keys.size());
    if (listed) out[0] = base(run).name;
    const std::size_t first = listed ? 1 : 0;
    std::size_t rest = run / repeats;
    for (std::size_t i = vary.size(); i-- > 0; rest /= vary[i].values.size())
      out[first + i] = vary[i].values[rest % vary[i].values.size()];
    for (std::size_t i = 0; i < draws.size(); ++i)
      out[first + vary.size() + i] =
          draws[i].low + (draws[i].high - draws[i].low) * draw(seed, run % repeats, i);
    return out;
  }
  // Runs in which every value occurs with every scene: the first of the scene, and those that
  // differ from it in one value.
  std::vector<std::size_t> with_each_value() const {
    std::vector<std::size_t> out;
    for (std::size_t b = 0; b < bases.size(); ++b) {
      const std::size_t begin = b * runs_a_scene();
      std::size_t step = repeats;
      out.push_back(begin);
      for (std::size_t i = vary.size(); i-- > 0; step *= vary[i].values.size())
        for (std::size_t j = 1; j < vary[i].values.size(); ++j) out.push_back(begin + j * step);
    }
    return out;
  }
  void read(const Json& study) {
    refuse_others(study, {"hapsix_study", "scene", "vary", "draw", "repeats", "seed"}, "the study");
    const Json given_vary = study.value("vary", Json::object());
    const Json given_draw = study.value("draw", Json::object());
    repeats = whole_of(study, "repeats", 1, kMostRuns);
    seed = whole_of(study, "seed", 1, std::uint64_t{1} << 53);
    listed = study["scene"].is_array();
    if (listed) keys.push_back("scene");
    names = scene_names_of(study["scene"]);
    std::size_t runs = check_runs(repeats * names.size());
    for (const auto& [key, given] : given_vary.items()) {
      check_key(key);
      vary.push_back(varied(key, given));
      // Counted here, many long lists never stand in memory together.
      runs = check_runs(runs * vary.back().values.size());
      keys.push_back(key);
    }
    for (const auto& [key, given] : given_draw.items()) {
      check_key(key);
      draws.push_back(drawn(key, given));
      keys.push_back(key);
    }
  }
  Outcome read_bases(const fs::path& file, const fs::path& folder) {
    for (const std::string& name : names) {
      Result<Base> base = read_base(name, file, folder, outside);
      if (!base) return base.failure();
      for (const Base& other : bases)
        if (other.name == base->name)
          throw Mistake{"two scenes of the list have the name '" + io::shown(other.name) +
                        "': give one of them another \"name\""};
      bases.push_back(std::move(*base));
    }
    return Done{};
  }
  // Files that vary lie beside the scene, as its own do, and no stranger's study reads others.
  Outcome settle_files(const fs::path& file, io::Scene& scene) const {
    fs::path strange;
    each_file(scene, [&](fs::path& f) {
      f = (file.parent_path() / f).lexically_normal();
      if (!outside && !io::lies_below(f, file)) strange = f;
    });
    if (strange.empty()) return Done{};
    return Failure{io::shown(strange.string()) +
                   " lies outside the folder of the scene file: move it there, or give "
                   "--allow-outside if you trust the study"};
  }
  void identify(const Json& study) {
    std::ostringstream out;
    out << study.dump() << '\n';
    for (Base& base : bases) {
      out << base.text.dump() << '\n';
      each_file(base.scene, [&](fs::path& file) {
        const std::string content = content_of(file);
        out << io::hex(io::hash_bytes(content.data(), content.size())) << '\n';
      });
      for (const io::SceneHand& hand : base.scene.hands)
        out << io::hex(io::hash_bytes(hand.path.data(), hand.path.size() * sizeof(io::PathRow)))
            << '\n';
    }
    out << h6BuildInfo() << '\n';  // another processor may give other bits
    identity = out.str();
  }
};

Plan::Plan(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
Plan::Plan(Plan&&) noexcept = default;
Plan& Plan::operator=(Plan&&) noexcept = default;
Plan::~Plan() = default;

Result<Plan> Plan::read(const fs::path& file, const fs::path& folder, bool outside) {
  const std::string text = content_of(file), name = file.string();
  if (const Outcome json = io::check_json_text(text, name); !json) return json.failure();
  try {
    const Json study = Json::parse(text);
    if (!study.is_object() || study.value("hapsix_study", Json()) != 1 ||
        !study.contains("scene") || !(study["scene"].is_string() || study["scene"].is_array()))
      return Failure{name + ": a study begins with \"hapsix_study\": 1 and names a \"scene\""};
    auto parts = std::make_unique<Parts>();
    parts->outside = outside;
    parts->read(study);
    if (const Outcome all = parts->read_bases(fs::absolute(file), folder); !all)
      return all.failure();
    parts->identify(study);
    Plan plan(std::move(parts));
    for (const std::size_t run : plan.parts_->with_each_value())
      if (Result<io::Scene> scene = plan.scene(run); !scene)
        return Failure{name + ": " + scene.error()};
    return plan;
  } catch (const Mistake& mistake) {
    return Failure{name + ": " + mistake.sentence};
  } catch (const std::exception& problem) {
    return Failure{name + ": this is no study (" + problem.what() + ")"};
  }
}

std::size_t Plan::runs() const { return parts_->bases.size() * parts_->runs_a_scene(); }
const std::vector<std::string>& Plan::keys() const { return parts_->keys; }
std::size_t Plan::repeat(std::size_t run) const { return run % parts_->repeats; }
const fs::path& Plan::scene_file(std::size_t run) const { return parts_->base(run).file; }
double Plan::unit(std::size_t run) const { return io::metres(parts_->base(run).scene.unit); }
std::vector<fs::path> Plan::scene_files() const {
  std::vector<fs::path> out;
  for (const Base& base : parts_->bases) out.push_back(base.file);
  return out;
}
const std::string& Plan::identity() const { return parts_->identity; }

std::vector<std::string> Plan::values(std::size_t run) const {
  std::vector<std::string> out;
  for (const Json& value : parts_->values(run))
    out.push_back(value.is_string() ? value.get<std::string>() : value.dump());
  return out;
}

namespace {

std::vector<Json> paths_of(const Json& scene) {
  std::vector<Json> paths;
  if (scene.contains("hands"))
    for (const Json& hand : scene["hands"])
      paths.push_back(hand.is_object() ? hand.value("path", Json()) : Json());
  return paths;
}

}  // namespace

Result<io::Scene> Plan::scene(std::size_t run) const {
  const Base& base = parts_->base(run);
  Json text = base.text;
  const std::vector<Json> values = parts_->values(run);
  try {
    for (std::size_t i = parts_->listed ? 1 : 0; i < values.size(); ++i)
      put(text, parts_->keys[i], values[i]);
  } catch (const Mistake& mistake) {
    return Failure{mistake.sentence};
  }
  if (paths_of(text) != paths_of(base.text))
    return Failure{"the path of a hand cannot vary: a study has one, read with its scene"};
  Result<io::Scene> scene = io::read_scene_text(text.dump(), "run " + std::to_string(run));
  if (!scene) return scene;
  if (const Outcome settled = parts_->settle_files(base.file, *scene); !settled)
    return settled.failure();
  for (std::size_t h = 0; h < scene->hands.size() && h < base.scene.hands.size(); ++h)
    scene->hands[h].path = base.scene.hands[h].path;
  return scene;
}

}  // namespace h6::study
