// SPDX-License-Identifier: Apache-2.0
// setting_json.h - values of settings between a struct and a scene file's JSON. Private to the
// reader and the writer.
#pragma once
#include <functional>
#include <nlohmann/json.hpp>

#include "runtime/settings/setting.h"

namespace h6::io {

// `scale`: metres in one unit of the file. Only JSON that check_scene_json has passed comes here.
// Keys that are missing leave their members alone. Rows without a member are skipped.
void read_settings(const nlohmann::json& object, const SettingTable& rows, void* def, double scale);

// Adds every row of `def` in their order. `by_hand` is called for a row without a member. Throws
// std::out_of_range for a choice that has no name.
using WriteByHand = std::function<void(const Setting& row, nlohmann::ordered_json& out)>;
void write_settings(const SettingTable& rows, const void* def, double scale,
                    nlohmann::ordered_json& out, const WriteByHand& by_hand = nullptr);

}  // namespace h6::io
