// SPDX-License-Identifier: Apache-2.0
// bridge_message.h - a pose as JSON, which any program on this machine may send to the bridge.
#pragma once
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string_view>

namespace h6::plugin {

struct BridgeMessage {
  std::int64_t number = 0;
  double p[3] = {}, q[4] = {1, 0, 0, 0};  // [m]; unit, w x y z
  double v[3] = {}, w[3] = {};            // [m/s], [rad/s]
  unsigned buttons = 0;
};

// Reads `count` finite numbers up to `most`. A missing key is false only where it `must` be there.
inline bool numbers(const nlohmann::json& from, const char* key, int count, double most, bool must,
                    double* out) {
  const auto found = from.find(key);
  if (found == from.end()) return !must;
  if (!found->is_array() || found->size() != static_cast<std::size_t>(count)) return false;
  for (int i = 0; i < count; ++i) {
    const nlohmann::json& x = (*found)[static_cast<std::size_t>(i)];
    if (!x.is_number()) return false;
    out[i] = x.get<double>();
    if (!std::isfinite(out[i]) || std::fabs(out[i]) > most) return false;
  }
  return true;
}

// Returns false, with `out` half filled, when the text is no such message.
inline bool parse_bridge(std::string_view text, BridgeMessage& out) {
  const nlohmann::json in = nlohmann::json::parse(text, nullptr, false);
  if (!in.is_object()) return false;
  const auto n = in.find("n"), buttons = in.find("buttons");
  if (n == in.end() || !n->is_number_integer()) return false;
  out.number = n->get<std::int64_t>();
  if (!numbers(in, "p", 3, 100, true, out.p) || !numbers(in, "q", 4, 2, false, out.q) ||
      !numbers(in, "v", 3, 100, false, out.v) || !numbers(in, "w", 3, 1000, false, out.w))
    return false;
  const double* q = out.q;
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(std::fabs(length - 1) < 0.1)) return false;
  for (double& c : out.q) c /= length;
  if (buttons != in.end() && buttons->is_number_unsigned()) out.buttons = buttons->get<unsigned>();
  return true;
}

}  // namespace h6::plugin
