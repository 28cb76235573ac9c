// SPDX-License-Identifier: Apache-2.0
// engine_settings.h - the rows of the engine's definitions (hapsix/types.h, hapsix/hapsix.h).
#pragma once
#include "runtime/settings/setting.h"

namespace h6 {

const SettingTable& pose_settings();      // h6Pose
const SettingTable& body_settings();      // h6BodyDef
const SettingTable& contact_settings();   // h6ContactDef
const SettingTable& coupling_settings();  // h6CouplingDef
const SettingTable& hand_settings();      // h6HandDef: its filter's among them, `safety` inside
const SettingTable& safety_settings();    // h6SafetyDef
const SettingTable& session_settings();   // h6SessionDef
const SettingTable& loop_settings();      // h6LoopDef

// Contact methods, and the pieces that can be added to one: name after the '+', H6_PIECE_* bit.
std::span<const Choice> method_names();
std::span<const Choice> method_pieces();
// Those that `robust` has whatever its pieces say.
inline constexpr std::uint32_t kRobustPieces = H6_PIECE_FACING | H6_PIECE_DEPTH | H6_PIECE_PRODUCT;

// The row of that name, which must exist.
const Setting& setting_named(const SettingTable& rows, const char* name);

}  // namespace h6
