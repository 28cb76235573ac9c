// SPDX-License-Identifier: Apache-2.0
// engine_settings.h - the setting rows of the engine's definitions (hapsix/types.h, hapsix.h).
#pragma once
#include "runtime/settings/setting.h"

namespace h6 {

const SettingTable& pose_settings();      // h6Pose
const SettingTable& body_settings();      // h6BodyDef
const SettingTable& contact_settings();   // h6ContactDef
const SettingTable& coupling_settings();  // h6CouplingDef
const SettingTable& hand_settings();      // h6HandDef with its filter's rows; `safety` is an object
const SettingTable& safety_settings();    // h6SafetyDef
const SettingTable& session_settings();   // h6SessionDef
const SettingTable& loop_settings();      // h6LoopDef

// The names of contact methods, and of the pieces that can be added to one. A piece's name follows
// a '+'; its value is the H6_PIECE_* bit.
std::span<const Choice> method_names();
std::span<const Choice> method_pieces();
// The pieces that `robust` always has.
inline constexpr std::uint32_t kRobustPieces = H6_PIECE_FACING | H6_PIECE_DEPTH | H6_PIECE_PRODUCT;

// Returns the row of that name, which must exist.
const Setting& setting_named(const SettingTable& rows, const char* name);

}  // namespace h6
