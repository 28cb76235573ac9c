// SPDX-License-Identifier: Apache-2.0
// setting_json.cpp - copies setting values between a struct and a scene file's JSON.
#include "io/scene/setting_json.h"

#include <cmath>
#include <stdexcept>
#include <string>

#include "io/scene/scene.h"
#include "runtime/settings/engine_settings.h"

namespace h6::io {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

// ---- reading -----------------------------------------------------------------------------------

h6Vec3 vec3_of(const json& v, double scale) {
  return {v[0].get<double>() * scale, v[1].get<double>() * scale, v[2].get<double>() * scale};
}

h6Quat unit_quaternion(const json& v) {
  double q[4], norm2 = 0;
  for (std::size_t i = 0; i < 4; ++i) q[i] = v[i].get<double>(), norm2 += q[i] * q[i];
  const double s = 1 / std::sqrt(norm2);
  return {q[0] * s, q[1] * s, q[2] * s, q[3] * s};
}

void read_choice(const json& value, const Setting& row, void* to) {
  for (const Choice& c : row.choices)
    if (value == c.name) row.member.set_number(to, c.value);
}

// In a file one text gives both the method and its pieces; the definition has a member for each.
void read_method(const json& value, void* def) {
  auto& contact = *static_cast<h6ContactDef*>(def);
  h6MethodFromName(value.get_ref<const std::string&>().c_str(), &contact.method, &contact.pieces);
}

void read_value(const json& value, const Setting& row, void* def, double scale) {
  const double unit = row.is_length() ? scale : 1;
  if (row.kind == SettingKind::method) return read_method(value, def);
  void* const to = row.member.make(def);
  switch (row.kind) {
    case SettingKind::boolean:
      return row.member.set_number(to, value.get<bool>() ? 1 : 0);
    case SettingKind::number:
    case SettingKind::whole:
      return row.member.set_number(to, value.get<double>() * unit);
    case SettingKind::choice:
      return read_choice(value, row, to);
    case SettingKind::vec3:
      *static_cast<h6Vec3*>(to) = vec3_of(value, unit);
      return;
    case SettingKind::quaternion:
      *static_cast<h6Quat*>(to) = unit_quaternion(value);
      return;
    case SettingKind::inertia:
      for (std::size_t i = 0; i < 6; ++i) static_cast<double*>(to)[i] = value[i].get<double>();
      return;
    case SettingKind::text:
      *static_cast<std::string*>(to) = value.get<std::string>();
      return;
    case SettingKind::corners:
      *static_cast<Box*>(to) = {vec3_of(value[0], unit), vec3_of(value[1], unit)};
      return;
    default:
      return read_settings(value, *row.inside, to, scale);
  }
}

// ---- writing -----------------------------------------------------------------------------------

ordered_json list_of(const h6Vec3& v, double unit) {
  return ordered_json::array({v.x / unit, v.y / unit, v.z / unit});
}

std::string method_text(const h6ContactDef& contact) {
  const char* known = h6MethodName(contact.method);
  if (!known) throw std::out_of_range("the contact method is out of range");
  std::string text = known;
  const std::uint32_t implied = contact.method == H6_METHOD_ROBUST ? kRobustPieces : 0;
  for (const Choice& piece : method_pieces())
    if (contact.pieces & ~implied & static_cast<std::uint32_t>(piece.value))
      text += std::string("+") + piece.name;
  return text;
}

const char* choice_text(const Setting& row, double value) {
  for (const Choice& c : row.choices)
    if (c.value == value) return c.name;
  throw std::out_of_range(std::string(row.name) + " is out of range");
}

bool left_out(const Setting& row, const void* value) {
  if (!value) return true;
  if (row.kind == SettingKind::corners) {  // an empty box means no box
    const Box& box = *static_cast<const Box*>(value);
    return !(box.low.x < box.high.x);
  }
  if (!row.quiet) return false;
  if (row.kind == SettingKind::text) return static_cast<const std::string*>(value)->empty();
  return row.inside ? is_default(*row.inside, value) : row.member.number(value) == row.start;
}

ordered_json json_of(const Setting& row, const void* def, const void* value, double scale) {
  const double unit = row.is_length() ? scale : 1;
  switch (row.kind) {
    case SettingKind::boolean:
      return row.member.number(value) != 0;
    case SettingKind::number:
      return row.member.number(value) / unit;
    case SettingKind::whole:
      return static_cast<std::int64_t>(row.member.number(value));
    case SettingKind::choice:
      return choice_text(row, row.member.number(value));
    case SettingKind::method:
      return method_text(*static_cast<const h6ContactDef*>(def));
    case SettingKind::vec3:
      return list_of(*static_cast<const h6Vec3*>(value), unit);
    case SettingKind::quaternion: {
      const auto& q = *static_cast<const h6Quat*>(value);
      return ordered_json::array({q.w, q.x, q.y, q.z});
    }
    case SettingKind::inertia: {
      const auto* x = static_cast<const double*>(value);
      return ordered_json::array({x[0], x[1], x[2], x[3], x[4], x[5]});
    }
    case SettingKind::text:
      return *static_cast<const std::string*>(value);
    case SettingKind::corners: {
      const Box& box = *static_cast<const Box*>(value);
      return ordered_json::array({list_of(box.low, unit), list_of(box.high, unit)});
    }
    default: {
      ordered_json out = ordered_json::object();
      write_settings(*row.inside, value, scale, out);
      return out;
    }
  }
}

}  // namespace

void read_settings(const json& object, const SettingTable& rows, void* def, double scale) {
  for (const Setting& row : rows) {
    if (row.stands_among())
      read_settings(object, *row.inside, row.member.make(def), scale);
    else if (row.member.make && object.contains(row.name))
      read_value(object[row.name], row, def, scale);
  }
}

void write_settings(const SettingTable& rows, const void* def, double scale, ordered_json& out,
                    const WriteByHand& by_hand) {
  each_setting(rows, def, [&](const Setting& row, const void* at) {
    if (!row.member.get) {
      if (by_hand) by_hand(row, out);
      return;
    }
    const void* const value = row.member.get(at);
    if (left_out(row, value)) return;
    if (row.replaces) out.erase(row.replaces);
    out[row.name] = json_of(row, at, value, scale);
  });
}

}  // namespace h6::io
