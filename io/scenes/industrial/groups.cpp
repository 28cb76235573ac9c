// SPDX-License-Identifier: Apache-2.0
// groups.cpp - bolts in rows, wires in bundles.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "io/scenes/industrial/assembly.h"

namespace h6::io::industrial {
namespace {

// The place of the i-th wire across a bundle as {distance from the middle, angle}: one wire is in
// the middle, six are around it, twelve around those.
P2 bundle_place(int i, double radius) {
  const double step = 2.12 * radius;
  if (i == 0) return {0, 0};
  if (i < 7) return {step, std::numbers::pi / 3 * i};
  return {1.95 * step, std::numbers::pi / 6 * (i - 7) + 0.2};
}

}  // namespace

void add_bolt(Assembly& a, const std::string& name, const Frame& seat, double d, double length) {
  a.add(name, washer(d), seat);
  a.add(name, hex_bolt(d, length), seat * at(0, 0, 0.18 * d));
}

void add_bolt_row(Assembly& a, const std::string& name, const Frame& frame, const Polygon& outline,
                  double z, double apart, double d, double length) {
  double around = 0, s = 0;
  const std::size_t n = outline.size();
  const auto edge = [&](std::size_t i) {
    const P2 &p = outline[i], &q = outline[(i + 1) % n];
    return std::hypot(q.x - p.x, q.y - p.y);
  };
  for (std::size_t i = 0; i < n; ++i) around += edge(i);
  const double step = around / std::max(1.0, std::round(around / apart));
  for (std::size_t i = 0; i < n; ++i) {
    const P2 &p = outline[i], &q = outline[(i + 1) % n];
    const double length_here = edge(i);
    for (; s < length_here - 1e-9; s += step) {
      const double f = s / length_here;
      add_bolt(a, name, frame * at(p.x + f * (q.x - p.x), p.y + f * (q.y - p.y), z), d, length);
    }
    s -= length_here;
  }
}

void add_bundle(Assembly& a, const std::string& name, const std::vector<h6Vec3>& through, int wires,
                double radius) {
  const Line spine = smooth(through, 9 * radius / 0.92);
  for (int i = 0; i < wires; ++i) {
    const P2 place = bundle_place(i, radius);
    a.add_wire(name + " wire " + std::to_string(i + 1),
               place.x > 0 ? companion(spine, place.x, place.y, 175 * radius) : spine, radius);
  }
  const double r = (wires > 7 ? 5.2 : 3.3) * radius + 0.6, length = line_length(spine);
  const int ties = static_cast<int>(length / (76 * radius));
  for (int i = 1; i <= ties; ++i) {
    const Frame on = frame_on(spine, length * (i - 0.5) / ties);
    if (i % 3 == 0) {
      a.add("harness tape",
            revolve({{0, -15 * radius}, {r, -15 * radius}, {r, 15 * radius}, {0, 15 * radius}}, 20),
            on);
    } else {
      a.add(
          "cable tie",
          revolve({{r - 1, -1.4}, {r + 0.4, -1.4}, {r + 0.4, 1.4}, {r - 1, 1.4}}, 20, Ends::joined),
          on);
      a.add("cable tie", block(3.4, 5, 4, 0.8, 0.5, 2), on * at(r + 1.2, 0, -2));
    }
  }
}

}  // namespace h6::io::industrial
