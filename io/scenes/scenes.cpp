// SPDX-License-Identifier: Apache-2.0
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
    {"box-on-wall-explicit", "a flat contact integrated explicitly, without damping (Fig. 2)",
     box_on_wall_explicit},
    {"cone-in-gap", "a cone pulled under a ceiling lower than its tip (Fig. 3)", cone_in_gap},
    {"box-on-plates", "a box pressed on a large and a very small plate (Fig. 7)", box_on_plates},
    {"rod-between-tubes", "a rod forced with 20 N at a gap narrower than itself (Fig. 8)",
     rod_between_tubes},
    {"box-over-wire", "a box dragged against a thin wire on a plate (Fig. 12)", box_over_wire},
    {"box-over-fused-wire", "the same with wire and plate as one field", box_over_fused_wire},
    {"box-over-post", "a box dragged against a thin post on a plate (Fig. 12, upright)",
     box_over_post},
    {"alpha-shortcut",
     "one alpha forced through the gap of another, narrower than its tube (Fig. 8)",
     alpha_shortcut},
    {"alpha-solution", "the way that does take the alphas apart, without contact", alpha_solution},
    {"alphas-in-two-hands", "the alphas pulled apart at the shortcut, one in each hand",
     alphas_in_two_hands},
    {"piston-in-bore", "a piston in a blind bore with a quarter of a voxel of play",
     piston_in_bore},
    {"gear-train", "a gear pushed into the mesh of two others and turned against both", gear_train},
    {"nut-on-bolt", "a nut screwed on a bolt, pulled against its thread and screwed off",
     nut_on_bolt},
    {"bridge-and-dinosaur",
     "a dinosaur presses and drags on a bridge that bends, 20 modes (Fig. 14)",
     bridge_and_dinosaur},
    {"clip-and-rod", "a rod snaps into a clip that bends, and out again", clip_and_rod},
    {"hose-in-bracket", "a hose that bends goes through the eye of a bracket", hose_in_bracket},
    {"wire-bundle", "a bar dragged over a loom of wires two voxels thick", wire_bundle},
    {"spline-hub-1k", "a splined shaft turned in its hub, 1,000 points on its driven flanks",
     spline_hub_1k},
    {"spline-hub-10k", "the same with 10,000 points there", spline_hub_10k},
    {"spline-hub-100k", "the same with 100,000 points there", spline_hub_100k},
    {"engine-bay", "a starter motor in a car's engine bay, 505,276 broken triangles", engine_bay},
    {"landing-gear", "an actuator in an airliner's landing gear, 1,789,551 broken triangles",
     landing_gear},
};

}  // namespace

std::vector<SceneName> scene_names() {
  std::vector<SceneName> out;
  for (const Entry& entry : kScenes) out.push_back({entry.name, entry.about});
  return out;
}

Result<Scene> make_scene(const std::string& name) {
  for (const Entry& entry : kScenes) {
    if (name != entry.name) continue;
    Scene scene = entry.make();
    scene.generated = name;
    return scene;
  }
  std::string known;
  for (const Entry& entry : kScenes) known += (known.empty() ? "" : ", ") + std::string(entry.name);
  return Failure{"there is no generated scene \"" + name + "\"; known: " + known};
}

}  // namespace h6::io
