// SPDX-License-Identifier: Apache-2.0
// scene_settings.h - the rows of a scene: every key of a scene file, once.
//
// They drive check.cpp, setting_json.cpp and schema.cpp. Rows without a member are read and written
// by read.cpp and write.cpp: names of files, lists, and what depends on them.
#pragma once
#include "io/scene/scene.h"
#include "runtime/settings/setting.h"

namespace h6::io {

const SettingTable& scene_settings();          // Scene
const SettingTable& scene_body_settings();     // SceneBody
const SettingTable& field_source_settings();   // FieldSource: its bake's among them
const SettingTable& shell_source_settings();   // ShellSource: likewise
const SettingTable& scene_hand_settings();     // SceneHand: its def's among them, `arm` inside
const SettingTable& arm_settings();            // SceneArm
const SettingTable& forbidden_settings();      // Box
const SettingTable& target_settings();         // SceneVerdict, its target
const SettingTable& scene_verdict_settings();  // SceneVerdict

// Largest coordinate and length, in the scene's units: numbers stay far from overflow whatever is
// done with them.
inline constexpr double kFarthest = 1e6;

}  // namespace h6::io
