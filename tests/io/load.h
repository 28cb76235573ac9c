// SPDX-License-Identifier: Apache-2.0
// load.h - loads a scene or fails the test with the reason.
#pragma once
#include <doctest/doctest.h>

#include <memory>
#include <utility>

#include "io/scene/load_scene.h"
#include "tests/io/private_cache.h"

namespace h6::test {

inline std::unique_ptr<io::LoadedScene> load(io::Scene scene) {
  auto made = io::load_scene(std::move(scene));
  if (!made) FAIL(made.error());
  return std::move(*made);
}

}  // namespace h6::test
