// SPDX-License-Identifier: Apache-2.0
// alpha_solution_path.h - the way that takes one alpha off the other, as keyframes.
#pragma once

namespace h6::io {

// The tool faces the static alpha: its x axis points against the world's x axis, and both axes pass
// through the crossings. At a turn of 0 its crossing strands stand at right angles to the static
// ones. It moves along the world's x axis and turns about it. Half a turn about that axis maps each
// alpha onto itself, so nothing pushes the tool sideways where it passes between the strands.
struct AlphaKey {
  double advance;  // x of the tool's crossing, seen from the static one [mm]
  double turn;     // rotation about the world's x axis [degrees]
};

// At each advance the turn has the greatest clearance, found offline with the exact distance
// between the tubes' axes. Where there is more than enough room, the turn is smaller than that. The
// gaps pass through each other at advance 0, the tightest place.
inline constexpr AlphaKey kAlphaSolution[] = {
    {-22, 72.0}, {-20, 71.0}, {-18, 69.6}, {-16, 67.4}, {-14, 63.6},  {-13, 61.0},  {-12, 58.2},
    {-11, 54.9}, {-10, 51.1}, {-9, 46.7},  {-8, 42.1},  {-7, 37.4},   {-6, 32.6},   {-5, 27.6},
    {-4, 22.4},  {-3, 17.05}, {-2, 11.6},  {-1, 6.15},  {0, 0.7},     {1, -4.65},   {2, -9.9},
    {3, -15.1},  {4, -20.2},  {5, -25.1},  {6, -29.8},  {7, -34.5},   {8, -39.1},   {9, -43.6},
    {10, -48.0}, {11, -52.2}, {12, -56.1}, {14, -63.2}, {16, -69.2},  {18, -74.3},  {20, -78.6},
    {24, -84.8}, {28, -88.2}, {34, -90.0}, {50, -90.0}, {100, -90.0}, {150, -90.0},
};

}  // namespace h6::io
