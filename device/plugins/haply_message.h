// SPDX-License-Identifier: Apache-2.0
// haply_message.h - the states that Haply's service sends, as JSON. `out` is half filled where a
// function fails.
#pragma once
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace h6::plugin {

// Three finite numbers of {"x", "y", "z"}.
inline bool vector(const nlohmann::json& from, double out[3]) {
  const char* names[] = {"x", "y", "z"};
  for (int i = 0; i < 3; ++i) {
    const auto found = from.find(names[i]);
    if (found == from.end() || !found->is_number()) return false;
    out[i] = found->get<double>();
    if (!std::isfinite(out[i]) || std::fabs(out[i]) > 100) return false;
  }
  return true;
}

// The first entry of a list of devices that has a state; null: there is none.
inline const nlohmann::json* device_in(const nlohmann::json& all, const char* kind) {
  const auto list = all.find(kind);
  if (list == all.end() || !list->is_array() || list->empty() || !list->front().is_object())
    return nullptr;
  return &list->front();
}
inline const nlohmann::json* member(const nlohmann::json* of, const char* name) {
  if (!of || !of->is_object()) return nullptr;
  const auto found = of->find(name);
  return found != of->end() && found->is_object() ? &*found : nullptr;
}

struct HaplyState {
  std::string id;  // of the device
  double position[3], velocity[3] = {}, orientation[4] = {1, 0, 0, 0};
  unsigned buttons = 0;
  bool grip = false;
};

inline bool read_grip(const nlohmann::json& all, HaplyState& out) {
  for (const char* kind : {"wireless_verse_grip", "verse_grip"}) {
    const nlohmann::json* state = member(device_in(all, kind), "state");
    const nlohmann::json* q = member(state, "orientation");
    if (!q) continue;
    const auto w = q->find("w");
    double xyz[3];
    if (w == q->end() || !w->is_number() || !vector(*q, xyz)) return false;
    const double length = std::sqrt(w->get<double>() * w->get<double>() + xyz[0] * xyz[0] +
                                    xyz[1] * xyz[1] + xyz[2] * xyz[2]);
    if (!(std::fabs(length - 1) < 0.1)) return false;
    out.orientation[0] = w->get<double>() / length;
    for (int i = 0; i < 3; ++i) out.orientation[i + 1] = xyz[i] / length;
    out.grip = true;
    if (const nlohmann::json* buttons = member(state, "buttons"))
      for (int i = 0; i < 3; ++i)
        if (buttons->value(std::string(1, static_cast<char>('a' + i)), nlohmann::json(false)) ==
            nlohmann::json(true))
          out.buttons |= 1u << i;
    return true;
  }
  return true;  // without a VerseGrip the part does not turn
}

enum class HaplySaid { state, other, nonsense };

// `other`: it has no state of an Inverse3. `nonsense`: it has one that no device can be in.
inline HaplySaid parse_haply(std::string_view text, HaplyState& out) {
  const nlohmann::json all = nlohmann::json::parse(text, nullptr, false);
  if (!all.is_object()) return HaplySaid::nonsense;
  const nlohmann::json* inverse = device_in(all, "inverse3");
  const nlohmann::json* state = member(inverse, "state");
  if (!state) return HaplySaid::other;
  const nlohmann::json *p = member(state, "cursor_position"), *v = member(state, "cursor_velocity");
  if (!p || !vector(*p, out.position) || (v && !vector(*v, out.velocity)) || !read_grip(all, out))
    return HaplySaid::nonsense;
  const auto id = inverse->find("device_id");
  if (id == inverse->end() || !id->is_string()) return HaplySaid::nonsense;
  out.id = id->get<std::string>();
  return HaplySaid::state;
}

}  // namespace h6::plugin
