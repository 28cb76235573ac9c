// SPDX-License-Identifier: Apache-2.0
// fasteners.cpp - bolts, nuts, washers, rivets, springs, hose clamps.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "io/scenes/industrial/shapes.h"

namespace h6::io::industrial {
namespace {

constexpr int kSides = 12;  // a multiple of six, so that hexagons have their corners among them

Line round_ring(double radius, double z) {
  Line out;
  for (const P2& p : circle(radius, kSides)) out.push_back({p.x, p.y, z});
  return out;
}

// A hexagon that is `across` wide between its flats.
Line hex_ring(double across, double z) {
  Line out;
  for (int i = 0; i < kSides; ++i) {
    const double angle = 2 * std::numbers::pi * i / kSides;
    const double from_flat = std::remainder(angle - std::numbers::pi / 6, std::numbers::pi / 3);
    const double r = across / 2 / std::cos(from_flat);
    out.push_back({r * std::cos(angle), r * std::sin(angle), z});
  }
  return out;
}

// Adds a shank of diameter d below z = 0: a smooth part, threads as rings, a chamfer, a pole.
void add_shank(std::vector<Line>& rings, double d, double length) {
  const double r = d / 2, pitch = 0.28 * d, root = r - 0.6 * pitch;
  rings.push_back(round_ring(r, 0));
  double z = -length / 2;
  for (; z > -length + 1.5 * pitch; z -= pitch) {
    rings.push_back(round_ring(r, z));
    rings.push_back(round_ring(root, z - pitch / 2));
  }
  rings.push_back(round_ring(r, z));
  rings.push_back(round_ring(0.8 * root, -length));
  rings.push_back({{0, 0, -length}});
}

}  // namespace

Piece hex_bolt(double d, double length) {
  const double across = 1.6 * d, head = 0.65 * d;
  std::vector<Line> rings = {{{0, 0, head}},
                             round_ring(0.47 * across, head),
                             hex_ring(across, 0.86 * head),
                             hex_ring(across, 0.1 * head),
                             round_ring(0.475 * across, 0)};
  add_shank(rings, d, length);
  return loft(rings, Ends::capped);
}

Piece socket_bolt(double d, double length) {
  const double r = 0.78 * d, head = d;
  std::vector<Line> rings = {{{0, 0, 0.4 * head}},      hex_ring(0.8 * d, 0.45 * head),
                             hex_ring(0.8 * d, head),   round_ring(0.9 * r, head),
                             round_ring(r, 0.9 * head), round_ring(r, 0)};
  add_shank(rings, d, length);
  return loft(rings, Ends::capped);
}

Piece nut(double d) {
  const double across = 1.6 * d, height = 0.85 * d, bore = 0.46 * d;
  return loft({round_ring(bore, 0), round_ring(0.475 * across, 0), hex_ring(across, 0.1 * height),
               hex_ring(across, 0.88 * height), round_ring(0.475 * across, height),
               round_ring(1.1 * bore, height), round_ring(bore, 0.93 * height)},
              Ends::joined);
}

Piece washer(double d) {
  const double r = 1.1 * d, bore = 0.54 * d, t = 0.18 * d;
  return revolve({{bore, 0}, {r, 0}, {r, t}, {bore, t}}, kSides, Ends::joined);
}

Piece rivet(double d, int sides) {
  // The dome's foot is a little below the sheet.
  const double r = 0.9 * d;
  return revolve({{0, -0.2 * d}, {0.5 * d, -0.2 * d}, {r, 0}, {0.85 * r, 0.3 * d}, {0, 0.5 * d}},
                 sides);
}

Piece spring(double radius, double wire, double pitch, double turns) {
  return rod(helix(radius, pitch, turns, 32), wire, 12);
}

Piece hose_clamp(double radius) {
  // A band, embossed like a worm thread, and the housing with its screw.
  Piece out =
      revolve({{radius, -6}, {radius + 1.2, -6}, {radius + 1.2, 6}, {radius, 6}}, 56, Ends::joined);
  const auto add = [&](const Piece& piece, const Frame& frame) {
    const auto first = static_cast<std::uint32_t>(out.points.size());
    for (const h6Vec3& p : piece.points) out.points.push_back(frame.at(p));
    for (const auto& t : piece.triangles)
      out.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  };
  const Frame tangent = facing({radius + 4, 0, 0}, {0, 1, 0});
  add(block(8, 13, 16, 1.5, 1), tangent * at(0, 0, -8));
  add(hex_bolt(5, 22), tangent * at(0, 0, 10));
  return out;
}

}  // namespace h6::io::industrial
