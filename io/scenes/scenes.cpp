#include "io/scenes/scenes.h"

#include <iterator>

#include "io/scenes/list.h"

namespace h6::io {
namespace {

struct Entry {
  const char* name;
  const char* about;
  Scene (*make)();
};

constexpr Entry kScenes[] = {
    {"box-on-wall", "a box pressed on a wall, sliding and tilting a little", box_on_wall},
    {"peg-in-hole",
     "a peg pressed against the side, then the floor of a tight blind hole (Fig. 10)", peg_in_hole},
    {"alpha-shortcut",
     "one alpha forced through the gap of another, narrower than its tube (Fig. 8)",
     alpha_shortcut},
};

}  // namespace

std::vector<SceneName> scene_names() {
  std::vector<SceneName> out;
  for (const Entry& entry : kScenes) out.push_back({entry.name, entry.about});
  return out;
}

Result<Scene> make_scene(const std::string& name) {
  for (const Entry& entry : kScenes)
    if (name == entry.name) return entry.make();
  std::string known;
  for (const Entry& entry : kScenes) known += (known.empty() ? "" : ", ") + std::string(entry.name);
  return Failure{"there is no generated scene \"" + name + "\"; known: " + known};
}

}  // namespace h6::io
