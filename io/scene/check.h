// SPDX-License-Identifier: Apache-2.0
// check.h - checks a scene file's JSON against the tables of settings. Only the scene reader uses
// it.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "io/scene/scene_settings.h"

namespace h6::io {

// Says which key is wrong and why. Only the reader throws and catches it; read_scene turns it into
// a sentence.
struct Complaint {
  std::string where, what;
};

// Throws a Complaint if a key is unknown or missing, or if its value has the wrong kind or is out
// of range.
void check_scene_json(const nlohmann::json& root);

// "bodies[1]" and "shell" -> "bodies[1].shell"
std::string inside(const std::string& path, const std::string& key);
// Makes text from a file safe for a sentence: short and without control characters.
std::string shown(const std::string& text);

}  // namespace h6::io
