// SPDX-License-Identifier: Apache-2.0
// check.cpp - checks a scene file's JSON against the tables of settings.
#include "io/scene/check.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "io/mesh/mesh_file.h"
#include "io/scene/setting_text.h"
#include "runtime/settings/engine_settings.h"

namespace h6::io {

std::string shown(const std::string& text) {
  std::string out;
  for (const char c : text.substr(0, 80)) out += static_cast<unsigned char>(c) >= ' ' ? c : '?';
  return out;
}

std::string inside(const std::string& path, const std::string& key) {
  return path.empty() ? key : path + "." + key;
}

namespace {

using Json = nlohmann::json;

// The Levenshtein distance of two words: the least number of letters to insert, drop or change.
std::size_t edits_between(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t changed = diagonal + (a[i - 1] != b[j - 1]);
      diagonal = row[j];
      row[j] = std::min({changed, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row[b.size()];
}

std::string nearest_key(const SettingTable& rows, const std::string& name) {
  const char* best = "";
  std::size_t fewest = static_cast<std::size_t>(-1);
  each_setting(rows, nullptr, [&](const Setting& row, const void*) {
    const std::size_t edits = edits_between(name, row.name);
    if (edits < fewest) fewest = edits, best = row.name;
  });
  return best;
}

// The range of a number in the units of the file, where one unit is `scale` metres.
Range range_in_file(const Setting& row, double scale) {
  Range r = row.range;
  if (row.is_length()) r.low /= scale, r.high /= scale, r.file_high = kFarthest;
  r.high = std::min(r.high, r.file_high);
  if (row.kind == SettingKind::vec3 || row.kind == SettingKind::corners) r.low = -r.high;
  return r;
}

std::string range_text(const Range& r) {
  const std::string low = (r.above_low ? "above " : "at least ") + number_text(r.low);
  const std::string high = "at most " + number_text(r.high);
  if (r.high == kNoLimit) return low;
  return r.low == -kNoLimit ? high : low + " and " + high;
}

class SceneCheck {
 public:
  explicit SceneCheck(double scale) : scale_(scale) {}

  void keys(const Json& value, const SettingTable& rows, const std::string& at) const;

 private:
  void value(const Json& value, const Setting& row, const std::string& at) const;
  void number(const Json& value, const Setting& row, const std::string& at) const;
  void numbers(const Json& value, std::size_t count, const Setting& row,
               const std::string& at) const;
  void quaternion(const Json& value, const Setting& row, const std::string& at) const;
  void inertia(const Json& value, const Setting& row, const std::string& at) const;
  void corners(const Json& value, const Setting& row, const std::string& at) const;
  void list(const Json& value, const Setting& row, const std::string& at) const;

  double scale_;  // metres in one unit of the file
};

void SceneCheck::number(const Json& value, const Setting& row, const std::string& at) const {
  if (!value.is_number()) throw Complaint{at, "must be a number"};
  const double x = value.get<double>();
  if (row.kind == SettingKind::whole && std::floor(x) != x)
    throw Complaint{at, "must be a whole number"};
  const Range r = range_in_file(row, scale_);
  const bool in_range = (r.above_low ? x > r.low : x >= r.low) && x <= r.high;
  if (!in_range) throw Complaint{at, "is " + number_text(x) + " but must be " + range_text(r)};
}

void SceneCheck::numbers(const Json& value, std::size_t count, const Setting& row,
                         const std::string& at) const {
  if (!value.is_array() || value.size() != count)
    throw Complaint{at, "must be a list of " + std::to_string(count) + " numbers"};
  for (std::size_t i = 0; i < count; ++i) number(value[i], row, at + "[" + std::to_string(i) + "]");
}

void check_text(const Json& value, const std::string& at) {
  if (!value.is_string()) throw Complaint{at, "must be a text in quotes"};
  const auto& text = value.get_ref<const std::string&>();
  if (text.empty() || text.size() > 4096) throw Complaint{at, "must have 1 to 4096 letters"};
  for (const char c : text)
    if (static_cast<unsigned char>(c) < ' ') throw Complaint{at, "holds a control character"};
}

void check_choice(const Json& value, const Setting& row, const std::string& at) {
  std::string known;
  for (const Choice& c : row.choices) {
    if (value == c.name) return;
    known += (known.empty() ? "" : ", ") + std::string(c.name);
  }
  throw Complaint{at, "must be one of: " + known};
}

void check_method(const Json& value, const std::string& at) {
  check_text(value, at);
  h6Method method;
  std::uint32_t pieces;
  const auto& name = value.get_ref<const std::string&>();
  if (h6MethodFromName(name.c_str(), &method, &pieces) != 0)
    throw Complaint{at,
                    "\"" + shown(name) +
                        "\" is no method; known: none, global, cluster, gauss3, gauss6, robust, "
                        "series, and with pieces: gauss3+facing+depth, robust+cluster"};
}

void SceneCheck::quaternion(const Json& value, const Setting& row, const std::string& at) const {
  numbers(value, 4, row, at);
  double norm2 = 0;
  for (const Json& x : value) norm2 += x.get<double>() * x.get<double>();
  if (!(std::abs(std::sqrt(norm2) - 1) <= 1e-3))
    throw Complaint{at, "is not a unit quaternion w x y z (its length is " +
                            number_text(std::sqrt(norm2)) + ")"};
}

// Tests with Sylvester's criterion that xx yy zz xy xz yz is positive definite.
void SceneCheck::inertia(const Json& value, const Setting& row, const std::string& at) const {
  numbers(value, 6, row, at);
  double i[6];
  for (int n = 0; n < 6; ++n) i[n] = value[n].get<double>();
  const double minor2 = i[0] * i[1] - i[3] * i[3];
  const double minor3 = i[0] * (i[1] * i[2] - i[5] * i[5]) - i[3] * (i[3] * i[2] - i[5] * i[4]) +
                        i[4] * (i[3] * i[5] - i[1] * i[4]);
  if (!(i[0] > 0 && minor2 > 0 && minor3 > 0 && std::isfinite(minor3)))
    throw Complaint{at, "is not positive definite (xx yy zz xy xz yz)"};
}

void SceneCheck::corners(const Json& value, const Setting& row, const std::string& at) const {
  if (!value.is_array() || value.size() != 2)
    throw Complaint{at, "must be two corners [[x,y,z],[x,y,z]]"};
  for (int i = 0; i < 2; ++i) numbers(value[i], 3, row, at + "[" + std::to_string(i) + "]");
  for (int axis = 0; axis < 3; ++axis)
    if (!(value[0][axis].get<double>() < value[1][axis].get<double>()))
      throw Complaint{at, "the first corner must be lower than the second on every axis"};
}

void SceneCheck::list(const Json& value, const Setting& row, const std::string& at) const {
  if (!value.is_array()) throw Complaint{at, "must be a list [ ... ]"};
  const auto count = static_cast<double>(value.size());
  if (count < row.range.low) throw Complaint{at, "must not be empty"};
  if (count > row.range.high)
    throw Complaint{at, "may have " + number_text(row.range.high) + " entries at most"};
  for (std::size_t i = 0; i < value.size(); ++i)
    keys(value[i], *row.inside, at + "[" + std::to_string(i) + "]");
}

void SceneCheck::value(const Json& value, const Setting& row, const std::string& at) const {
  switch (row.kind) {
    case SettingKind::boolean:
      if (!value.is_boolean()) throw Complaint{at, "must be true or false"};
      return;
    case SettingKind::number:
    case SettingKind::whole:
      return number(value, row, at);
    case SettingKind::text:
      return check_text(value, at);
    case SettingKind::choice:
      return check_choice(value, row, at);
    case SettingKind::method:
      return check_method(value, at);
    case SettingKind::vec3:
      return numbers(value, 3, row, at);
    case SettingKind::inertia:
      return inertia(value, row, at);
    case SettingKind::quaternion:
      return quaternion(value, row, at);
    case SettingKind::corners:
      return corners(value, row, at);
    case SettingKind::object:
      return keys(value, *row.inside, at);
    case SettingKind::list:
      return list(value, row, at);
  }
}

void SceneCheck::keys(const Json& object, const SettingTable& rows, const std::string& at) const {
  if (!object.is_object()) throw Complaint{at, "must be an object { ... }"};
  for (const auto& [name, item] : object.items()) {
    const Setting* known = nullptr;
    each_setting(rows, nullptr, [&, &n = name](const Setting& row, const void*) {
      if (n == row.name) known = &row;
    });
    if (!known)
      throw Complaint{inside(at, shown(name)), "no such key; the nearest known one is \"" +
                                                   nearest_key(rows, shown(name)) + "\""};
    value(item, *known, inside(at, name));
  }
  each_setting(rows, nullptr, [&](const Setting& row, const void*) {
    if (row.required && !object.contains(row.name))
      throw Complaint{inside(at, row.name), std::string("is missing (") + row.about + ")"};
    if (row.replaces && object.contains(row.name) && object.contains(row.replaces))
      throw Complaint{inside(at, row.name),
                      std::string("stands beside \"") + row.replaces + "\"; give one of them"};
  });
}

}  // namespace

void check_scene_json(const Json& root) {
  double scale = 1;
  if (root.is_object() && root.contains("units")) {  // first, as ranges of lengths depend on it
    check_choice(root["units"], setting_named(scene_settings(), "units"), "units");
    scale = metres(*unit_from_name(root["units"].get<std::string>()));
  }
  SceneCheck(scale).keys(root, scene_settings(), "");
}

}  // namespace h6::io
