// SPDX-License-Identifier: Apache-2.0
#include "io/run/start_warnings.h"

#include <algorithm>
#include <cstdio>

#include "hapsix/vector.h"
#include "io/mesh/mesh_file.h"

namespace h6::cli {
namespace {

constexpr double kFar = 0.1;  // of the part's longest side

// The longest side of the box around a body's shell points [m].
double longest_side(const io::LoadedScene& loaded, std::size_t body) {
  const int shell = loaded.bodies[body].shell;
  if (shell < 0) return 0;
  h6Vec3 low{1e9, 1e9, 1e9}, high{-1e9, -1e9, -1e9};
  for (const h6Vec3& p : loaded.shell_points[static_cast<std::size_t>(shell)])
    low = min(low, p), high = max(high, p);
  return std::max({high.x - low.x, high.y - low.y, high.z - low.z});
}

// Only these devices hold a path in the scene's own frame.
bool follows_path(const io::SceneHand& hand, const std::string& device) {
  const h6HandFilterDef& filter = hand.def.filter;
  return !hand.path.empty() && filter.motion_scale == 1 && !filter.relative &&
         (device == "path" || device == "simulated" || device == "arm");
}

}  // namespace

std::vector<std::string> start_warnings(const io::LoadedScene& loaded, const std::string& device) {
  if (loaded.scene.hands.empty())
    return {
        "the scene has no hands: nothing moves its parts, and the run holds nothing; add "
        "\"hands\": [{\"body\": ..., \"path\": ...}]"};
  std::vector<std::string> out;
  for (const io::SceneHand& hand : loaded.scene.hands) {
    if (!follows_path(hand, device.empty() ? hand.device : device)) continue;
    const auto body = static_cast<std::size_t>(loaded.body_index(hand.body));
    const double far = norm(hand.path.front().pose.p - loaded.bodies[body].pose.p);
    const double size = longest_side(loaded, body);
    if (!(far > kFar * size) || size == 0) continue;
    char text[200];
    const double scale = 1 / io::metres(loaded.scene.unit);
    std::snprintf(text, sizeof text,
                  " starts %.3g %s from where its hand begins, and will fly there", far * scale,
                  io::unit_name(loaded.scene.unit));
    out.push_back("'" + hand.body + "'" + text +
                  ": begin the path at the part's pose, or set \"relative\": true for the hand");
  }
  return out;
}

}  // namespace h6::cli
