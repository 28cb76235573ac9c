// SPDX-License-Identifier: Apache-2.0
// scene_settings.h - tables of settings with one row for every key of a scene file.
//
// The tables drive check.cpp, setting_json.cpp and schema.cpp. Some rows have no struct member:
// file names, lists, and values that depend on them. read.cpp and write.cpp handle those.
#pragma once
#include "io/scene/scene.h"
#include "runtime/settings/setting.h"

namespace h6::io {

const SettingTable& scene_settings();          // Scene
const SettingTable& scene_body_settings();     // SceneBody
const SettingTable& field_source_settings();   // FieldSource, with the rows of its bake
const SettingTable& shell_source_settings();   // ShellSource, with the rows of its bake
const SettingTable& scene_hand_settings();     // SceneHand, with the rows of its def and its `arm`
const SettingTable& arm_settings();            // SceneArm
const SettingTable& forbidden_settings();      // Box
const SettingTable& target_settings();         // the target of a SceneVerdict
const SettingTable& scene_verdict_settings();  // SceneVerdict

// The largest coordinate and length, in the scene's units. It keeps computed numbers far from
// overflow.
inline constexpr double kFarthest = 1e6;

}  // namespace h6::io
