// SPDX-License-Identifier: Apache-2.0
// landing_gear.h - the landing gear's groups of parts. x: inboard, y: aft, z: up [mm].
#pragma once
#include "io/scenes/industrial/assembly.h"

namespace h6::io::industrial {

inline constexpr double kGearHeight = 2000;
inline constexpr double kGearVoxel = kGearHeight / 1008;
inline constexpr double kGearWire = 1.03 * kGearVoxel;  // radius; wires are two voxels thick

// The actuator's place between its brackets. Its own frame has its origin at the bay's pin and its
// z axis towards the strut's pin.
inline constexpr double kActuatorLength = 580;  // pin to pin
inline constexpr h6Vec3 kBayPin = {640, 205, 1610};
inline constexpr h6Vec3 kStrutPin = {128.6, 205, 1336.3};
Frame actuator_seat();

void add_strut(Assembly& a);       // landing_gear_strut.cpp: fitting, piston, links, braces
void add_wheels(Assembly& a);      // landing_gear_wheels.cpp: tyres, rims, brakes
void add_bay(Assembly& a);         // landing_gear_bay.cpp: ribs, skins, doors, rivets
void add_gear_lines(Assembly& a);  // landing_gear_lines.cpp: hydraulics, wires

}  // namespace h6::io::industrial
