// SPDX-License-Identifier: Apache-2.0
// check.h - a scene file's JSON against the table of keys. Private to the reader.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "io/scene/keys.h"

namespace h6::io {

// What is wrong, and with which key. Thrown inside the reader only, from any depth of the tree;
// read_scene turns it into its sentence.
struct Complaint {
  std::string where, what;
};

// Every key known, of its kind and in its range, none missing; throws a Complaint.
void check_scene_json(const nlohmann::json& root);

// "bodies[1]" and "shell" -> "bodies[1].shell"
std::string inside(const std::string& path, const std::string& key);
std::string number_text(double value);
// A foreign name inside our sentence.
std::string shown(const std::string& text);

}  // namespace h6::io
