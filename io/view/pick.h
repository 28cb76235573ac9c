// SPDX-License-Identifier: Apache-2.0
// pick.h - a page on which the user marks vertices of a solid mesh.
#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "hapsix/result.h"
#include "hapsix/vector.h"
#include "io/view/envelope.h"

namespace h6::io::view {

struct Pickable {
  std::string name;                      // of the model, for the page
  std::string unit;                      // the page shows lengths in it
  double metres = 1;                     // in a unit
  std::vector<h6Vec3> vertices;          // [m]
  std::vector<std::uint32_t> triangles;  // of the surface, three vertices each
  std::vector<std::uint32_t> marked;     // at the start
};

// {"kind": "solid", ...}: positions and triangles for the page, in parts of the model's radius
// about its middle.
Message solid_message(const Pickable& model);

struct PickOptions {
  std::uint16_t port = 0;  // 0: any free one
  bool open = true;        // the user's browser
  std::function<void(const std::string& sentence)> say;
  std::function<bool()> stop;  // true: the user wants the program to end
};
// Serves the page on 127.0.0.1 until the user has chosen. Fails with a sentence when the page is
// closed, or `stop` says so, before that. A page that is loaded again within 3 s goes on.
Result<std::vector<std::uint32_t>> pick_vertices(const Pickable& model, const PickOptions& options);

}  // namespace h6::io::view
