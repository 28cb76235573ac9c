// SPDX-License-Identifier: Apache-2.0
// engine_bay.h - the engine bay's groups of parts. x: to the car's left, y: to its rear, z: up
// [mm].
#pragma once
#include "io/scenes/industrial/assembly.h"

namespace h6::io::industrial {

// The field has 1024 cells, 8 of them padding at either end; the other 1008 span the bay.
inline constexpr double kBayWidth = 900;
inline constexpr double kBayVoxel = kBayWidth / 1008;
inline constexpr double kBayWire = 1.03 * kBayVoxel;  // radius; wires are two voxels thick

// Origin of the starter's own frame when it is bolted on; its pinion points towards +x.
inline constexpr h6Vec3 kStarterSeat = {100, -118, 225};
Frame starter_seat();

// Outlines in the plane across the crankshaft: 2-D (y, z), extruded along x.
inline constexpr Frame kAcross = {{0, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 0}};
// Outlines seen from the front: 2-D (x, z), extruded towards the front (-y).
inline constexpr Frame kFront = {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}, {0, -1, 0}};

void add_engine(Assembly& a);      // engine_bay_engine.cpp: block, head, manifolds
void add_drive(Assembly& a);       // engine_bay_drive.cpp: accessories, belt, gearbox, shafts
void add_body_shell(Assembly& a);  // engine_bay_body.cpp: sheets, rails, tanks, battery
void add_radiator(Assembly& a);    // engine_bay_cooling.cpp: core, fans, hoses
void add_harness(Assembly& a);     // engine_bay_lines.cpp: wires, pipes

}  // namespace h6::io::industrial
