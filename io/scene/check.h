// SPDX-License-Identifier: Apache-2.0
// check.h - a scene file's JSON against the rows of settings. Private to the reader.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "io/scene/scene_settings.h"

namespace h6::io {

// What is wrong, and with which key. Thrown inside the reader only; read_scene makes a sentence of
// it.
struct Complaint {
  std::string where, what;
};

// Throws a Complaint unless every key is known, of its kind and in its range, and none is missing.
void check_scene_json(const nlohmann::json& root);

// "bodies[1]" and "shell" -> "bodies[1].shell"
std::string inside(const std::string& path, const std::string& key);
// Foreign text for use in a sentence: cut short, without control characters.
std::string shown(const std::string& text);

}  // namespace h6::io
