// SPDX-License-Identifier: Apache-2.0
// check.cpp - a scene file's JSON against the table of keys.
#include "io/scene/check.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

namespace h6::io {

std::string shown(const std::string& text) {
  std::string out;
  for (const char c : text.substr(0, 80)) out += static_cast<unsigned char>(c) >= ' ' ? c : '?';
  return out;
}

std::string inside(const std::string& path, const std::string& key) {
  return path.empty() ? key : path + "." + key;
}

std::string number_text(double value) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out.precision(10);
  out << value;
  return out.str();
}

namespace {

using Json = nlohmann::json;

// Edits (insert, drop, change a letter) that turn one word into the other.
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

std::string nearest_key(const SceneKeys& keys, const std::string& name) {
  const SceneKey* best = keys.begin();
  std::size_t fewest = static_cast<std::size_t>(-1);
  for (const SceneKey& key : keys) {
    const std::size_t edits = edits_between(name, key.name);
    if (edits < fewest) fewest = edits, best = &key;
  }
  return best->name;
}

std::string range_text(const SceneKey& key) {
  const std::string low = (key.above_low ? "above " : "at least ") + number_text(key.low);
  const std::string high = "at most " + number_text(key.high);
  if (key.high == kNoLimit) return low;
  return key.low == -kNoLimit ? high : low + " and " + high;
}

void check_number(const Json& value, const SceneKey& key, const std::string& at) {
  if (!value.is_number()) throw Complaint{at, "must be a number"};
  const double x = value.get<double>();
  const bool whole = key.kind != KeyKind::whole || std::floor(x) == x;
  if (!whole) throw Complaint{at, "must be a whole number"};
  const bool in_range = (key.above_low ? x > key.low : x >= key.low) && x <= key.high;
  if (!in_range) throw Complaint{at, "is " + number_text(x) + " but must be " + range_text(key)};
}

void check_numbers(const Json& value, std::size_t count, const SceneKey& key,
                   const std::string& at) {
  if (!value.is_array() || value.size() != count)
    throw Complaint{at, "must be a list of " + std::to_string(count) + " numbers"};
  for (std::size_t i = 0; i < count; ++i)
    check_number(value[i], key, at + "[" + std::to_string(i) + "]");
}

void check_text(const Json& value, const std::string& at) {
  if (!value.is_string()) throw Complaint{at, "must be a text in quotes"};
  const auto& text = value.get_ref<const std::string&>();
  if (text.empty() || text.size() > 4096) throw Complaint{at, "must have 1 to 4096 letters"};
  for (const char c : text)
    if (static_cast<unsigned char>(c) < ' ') throw Complaint{at, "holds a control character"};
}

void check_choice(const Json& value, const SceneKey& key, const std::string& at) {
  const std::string all = std::string("|") + key.choices + "|";
  const std::string name = value.is_string() ? value.get<std::string>() : "";
  if (!name.empty() && name.find('|') == std::string::npos &&
      all.find("|" + name + "|") != std::string::npos)
    return;
  std::string known = key.choices;
  for (std::size_t bar; (bar = known.find('|')) != std::string::npos;) known.replace(bar, 1, ", ");
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

void check_quaternion(const Json& value, const SceneKey& key, const std::string& at) {
  check_numbers(value, 4, key, at);
  double norm2 = 0;
  for (const Json& x : value) norm2 += x.get<double>() * x.get<double>();
  if (!(std::abs(std::sqrt(norm2) - 1) <= 1e-3))
    throw Complaint{at, "is not a unit quaternion w x y z (its length is " +
                            number_text(std::sqrt(norm2)) + ")"};
}

// A real body's tensor: Sylvester's criterion on xx yy zz xy xz yz.
void check_inertia(const Json& value, const SceneKey& key, const std::string& at) {
  check_numbers(value, 6, key, at);
  double i[6];
  for (int n = 0; n < 6; ++n) i[n] = value[n].get<double>();
  const double minor2 = i[0] * i[1] - i[3] * i[3];
  const double minor3 = i[0] * (i[1] * i[2] - i[5] * i[5]) - i[3] * (i[3] * i[2] - i[5] * i[4]) +
                        i[4] * (i[3] * i[5] - i[1] * i[4]);
  if (!(i[0] > 0 && minor2 > 0 && minor3 > 0 && std::isfinite(minor3)))
    throw Complaint{at, "is not positive definite (xx yy zz xy xz yz)"};
}

void check(const Json& value, const SceneKey& key, const std::string& at);

void check_keys(const Json& value, const SceneKeys& keys, const std::string& at) {
  if (!value.is_object()) throw Complaint{at, "must be an object { ... }"};
  for (const auto& [name, item] : value.items()) {
    const auto key = std::find_if(keys.begin(), keys.end(),
                                  [&, &n = name](const SceneKey& k) { return n == k.name; });
    if (key == keys.end())
      throw Complaint{inside(at, shown(name)), "no such key; the nearest known one is \"" +
                                                   nearest_key(keys, shown(name)) + "\""};
    check(item, *key, inside(at, name));
  }
  for (const SceneKey& key : keys)
    if (key.required && !value.contains(key.name))
      throw Complaint{inside(at, key.name), std::string("is missing (") + key.about + ")"};
}

void check_corners(const Json& value, const SceneKey& key, const std::string& at) {
  if (!value.is_array() || value.size() != 2)
    throw Complaint{at, "must be two corners [[x,y,z],[x,y,z]]"};
  for (int i = 0; i < 2; ++i) check_numbers(value[i], 3, key, at + "[" + std::to_string(i) + "]");
  for (int axis = 0; axis < 3; ++axis)
    if (!(value[0][axis].get<double>() < value[1][axis].get<double>()))
      throw Complaint{at, "the first corner must be lower than the second on every axis"};
}

void check_list(const Json& value, const SceneKey& key, const std::string& at) {
  if (!value.is_array()) throw Complaint{at, "must be a list [ ... ]"};
  const auto count = static_cast<double>(value.size());
  if (count < key.low) throw Complaint{at, "must not be empty"};
  if (count > key.high)
    throw Complaint{at, "may have " + number_text(key.high) + " entries at most"};
  for (std::size_t i = 0; i < value.size(); ++i)
    check_keys(value[i], *key.keys, at + "[" + std::to_string(i) + "]");
}

void check(const Json& value, const SceneKey& key, const std::string& at) {
  switch (key.kind) {
    case KeyKind::boolean:
      if (!value.is_boolean()) throw Complaint{at, "must be true or false"};
      break;
    case KeyKind::number:
    case KeyKind::whole:
      check_number(value, key, at);
      break;
    case KeyKind::text:
      check_text(value, at);
      break;
    case KeyKind::choice:
      check_choice(value, key, at);
      break;
    case KeyKind::method:
      check_method(value, at);
      break;
    case KeyKind::vec3:
      check_numbers(value, 3, key, at);
      break;
    case KeyKind::inertia:
      check_inertia(value, key, at);
      break;
    case KeyKind::quaternion:
      check_quaternion(value, key, at);
      break;
    case KeyKind::corners:
      check_corners(value, key, at);
      break;
    case KeyKind::object:
      check_keys(value, *key.keys, at);
      break;
    case KeyKind::list:
      check_list(value, key, at);
      break;
  }
}

}  // namespace

void check_scene_json(const Json& value) { check_keys(value, scene_keys(), ""); }

}  // namespace h6::io
