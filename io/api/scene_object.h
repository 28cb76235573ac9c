// SPDX-License-Identifier: Apache-2.0
// scene_object.h - what stands behind h6Scene.
#pragma once
#include <memory>

#include "hapsix/io.h"
#include "io/scene/load_scene.h"

struct h6Scene {
  std::unique_ptr<h6::io::LoadedScene> loaded;
};
