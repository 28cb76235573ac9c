// SPDX-License-Identifier: Apache-2.0
#include "io/view/view_request.h"

#include <cmath>
#include <nlohmann/json.hpp>

namespace h6::io::view {
namespace {

using nlohmann::json;

bool number(const json& object, const char* key, double low, double high, double& out) {
  const auto found = object.find(key);
  if (found == object.end()) return true;
  if (!found->is_number()) return false;
  const double value = found->get<double>();
  if (!std::isfinite(value) || value < low || value > high) return false;
  out = value;
  return true;
}

bool flag(const json& object, const char* key, bool& out) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_boolean()) return false;
  out = found->get<bool>();
  return true;
}

template <std::size_t N>
bool numbers(const json& object, const char* key, double limit, std::array<double, N>& out) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_array() || found->size() != N) return false;
  for (std::size_t i = 0; i < N; ++i) {
    if (!(*found)[i].is_number()) return false;
    out[i] = (*found)[i].get<double>();
    if (!std::isfinite(out[i]) || std::abs(out[i]) > limit) return false;
  }
  return true;
}

Failure wrong(const std::string& what) { return Failure{"a request was not understood: " + what}; }

Result<ViewRequest> hand(const json& object) {
  std::array<double, 3> p{};
  std::array<double, 4> q{};
  if (!numbers(object, "p", 1e3, p) || !numbers(object, "q", 2, q))
    return wrong("'hand' takes p of 3 and q of 4 finite numbers");
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(length > 0.5)) return wrong("'hand' takes a unit quaternion w, x, y, z");
  MoveHand move;
  move.pose.p = {p[0], p[1], p[2]};
  move.pose.q = {q[0] / length, q[1] / length, q[2] / length, q[3] / length};
  return ViewRequest(move);
}

Result<ViewRequest> contact(const json& object) {
  SetContact set;
  if (const auto method = object.find("method"); method != object.end()) {
    h6Method known;
    std::uint32_t pieces;
    if (!method->is_string() ||
        h6MethodFromName(method->get_ref<const std::string&>().c_str(), &known, &pieces) != 0)
      return wrong("'method' is not the name of a method");
    set.method = method->get<std::string>();
  }
  if (!number(object, "stiffness", 1, 1e6, set.stiffness))
    return wrong("'stiffness' is 1 to 1e6 N/m");
  if (!number(object, "epsilon", 1e-4, 2, set.epsilon)) return wrong("'epsilon' is 1e-4 to 2");
  if (!number(object, "max_depth_voxels", 0.01, 100, set.max_depth_voxels))
    return wrong("'max_depth_voxels' is 0.01 to 100");
  if (!number(object, "hand_stiffness", 1, 1e6, set.hand_stiffness))
    return wrong("'hand_stiffness' is 1 to 1e6 N/m");
  return ViewRequest(set);
}

template <class Switch>
Result<ViewRequest> turn(const json& object) {
  Switch s;
  if (!flag(object, "on", s.on)) return wrong("'on' is true or false");
  return ViewRequest(s);
}

}  // namespace

Result<ViewRequest> parse_request(std::string_view text) {
  const json object = json::parse(text, nullptr, false);
  if (!object.is_object()) return wrong("it is not a JSON object");
  const auto what = object.find("do");
  if (what == object.end() || !what->is_string()) return wrong("'do' is missing");
  const auto& name = what->get_ref<const std::string&>();
  if (name == "grab") return turn<Grab>(object);
  if (name == "hand") return hand(object);
  if (name == "clutch") return turn<Clutch>(object);
  if (name == "contact") return contact(object);
  if (name == "reset") return ViewRequest(Reset{});
  if (name == "keep") return ViewRequest(Keep{});
  if (name == "back") return ViewRequest(GoBack{});
  if (name == "record") return turn<Record>(object);
  if (name == "pace") {
    SetPace set;
    if (!number(object, "pace", 0, 1, set.pace)) return wrong("'pace' is 0 to 1");
    return ViewRequest(set);
  }
  if (name == "slice") {
    Slice slice;
    double axis = slice.axis;
    if (!number(object, "axis", 0, 2, axis) || !number(object, "at", 0, 1, slice.at) ||
        axis != std::floor(axis))
      return wrong("'slice' takes axis 0, 1 or 2 and at from 0 to 1");
    slice.axis = static_cast<int>(axis);
    return ViewRequest(slice);
  }
  return wrong("there is nothing called '" + name.substr(0, 40) + "' to do");
}

}  // namespace h6::io::view
