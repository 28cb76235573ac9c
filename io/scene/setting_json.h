// SPDX-License-Identifier: Apache-2.0
// setting_json.h - copies setting values between a struct and a scene file's JSON. Only the scene
// reader and the scene writer use it.
#pragma once
#include <functional>
#include <nlohmann/json.hpp>

#include "runtime/settings/setting.h"

namespace h6::io {

// Reads `object` into the struct `def`. `scale` is metres per unit of the file. check_scene_json
// must have accepted the JSON. A missing key leaves its member alone. Rows without a member are
// skipped.
void read_settings(const nlohmann::json& object, const SettingTable& rows, void* def, double scale);

// Adds the value of every row to `out`, in the order of the rows. It calls `by_hand` for a row
// without a member. Throws std::out_of_range for a choice that has no name.
using WriteByHand = std::function<void(const Setting& row, nlohmann::ordered_json& out)>;
void write_settings(const SettingTable& rows, const void* def, double scale,
                    nlohmann::ordered_json& out, const WriteByHand& by_hand = nullptr);

}  // namespace h6::io
