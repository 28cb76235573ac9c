// SPDX-License-Identifier: Apache-2.0
// scene_api.cpp - scene files and generated scenes as models and sessions, for C.
#include "io/api/guard.h"
#include "io/api/scene_object.h"
#include "io/scene/scene_file.h"
#include "io/scenes/scenes.h"

using namespace h6;
using namespace h6::io;

namespace {

Result<Scene> find(const std::string& name, bool outside) {
  std::error_code unreachable;  // a name that no file can have
  if (std::filesystem::exists(name, unreachable)) return read_scene(name, outside);
  for (const SceneName& known : scene_names())
    if (known.name == name) return make_scene(name);
  return Failure{name + ": there is neither such a file nor such a generated scene"};
}

const Scene* scene_of(const h6Scene* scene) { return scene ? &scene->loaded->scene : nullptr; }

}  // namespace

extern "C" {

h6SceneDef h6DefaultSceneDef(void) { return {}; }

h6Scene* h6ReadScene(const char* name, const h6SceneDef* def, h6Error* error) {
  if (!name) return fill(error, H6_ERROR_ARGUMENT, "no scene was named"), nullptr;
  const h6SceneDef used = def ? *def : h6DefaultSceneDef();
  if (!understood(used, error)) return nullptr;
  return guarded(error, static_cast<h6Scene*>(nullptr), [&]() -> h6Scene* {
    Result<Scene> scene = find(name, used.outside);
    if (!scene) return fill(error, reading(name), scene.error()), nullptr;
    Result<std::unique_ptr<LoadedScene>> loaded =
        load_scene(std::move(*scene), progress_of(used.progress, used.user), used.allocator);
    if (loaded) log_all((*loaded)->warnings);
    return wrap<h6Scene>(std::move(loaded), H6_ERROR_CONTENT, error);
  });
}

void h6DestroyScene(h6Scene* scene) { delete scene; }

const h6Model* h6GetSceneModel(const h6Scene* scene) {
  return scene ? scene->loaded->model.get() : nullptr;
}
void h6GetSceneSession(const h6Scene* scene, h6SessionDef* out) {
  if (out) *out = scene ? scene->loaded->session_def() : h6DefaultSessionDef();
}

int32_t h6FindBody(const h6Scene* scene, const char* name) {
  if (!scene || !name) return -1;
  const std::vector<SceneBody>& bodies = scene->loaded->scene.bodies;
  for (std::size_t i = 0; i < bodies.size(); ++i)
    if (bodies[i].name == name) return static_cast<std::int32_t>(i);
  return -1;
}
const char* h6GetBodyName(const h6Scene* scene, int32_t body) {
  const Scene* s = scene_of(scene);
  if (!s || body < 0 || static_cast<std::size_t>(body) >= s->bodies.size()) return nullptr;
  return s->bodies[static_cast<std::size_t>(body)].name.c_str();
}
double h6GetSceneDuration(const h6Scene* scene) { return scene ? scene->loaded->duration() : 0; }

bool h6SampleScenePath(const h6Scene* scene, int32_t hand, double time, h6DeviceSample* out) {
  if (!out) return false;
  *out = h6DefaultDeviceSample();
  const Scene* s = scene_of(scene);
  if (!s || hand < 0 || static_cast<std::size_t>(hand) >= s->hands.size()) return false;
  const Path& path = s->hands[static_cast<std::size_t>(hand)].path;
  if (path.empty() || !(time == time)) return false;
  out->pose = sample_path(path, time);
  out->velocity = sample_path_velocity(path, time);
  return true;
}

}  // extern "C"
