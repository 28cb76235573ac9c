// SPDX-License-Identifier: Apache-2.0
// schema.cpp - makes the JSON schema of scene files from the tables of settings.
#include <algorithm>
#include <nlohmann/json.hpp>

#include "io/scene/scene_file.h"
#include "io/scene/scene_settings.h"
#include "io/scene/setting_text.h"

namespace h6::io {
namespace {

using Kind = SettingKind;
using OrderedJson = nlohmann::ordered_json;

OrderedJson numbers(std::size_t count) {
  return {
      {"type", "array"}, {"items", {{"type", "number"}}}, {"minItems", count}, {"maxItems", count}};
}

OrderedJson schema_of(const SettingTable& rows);

// Adds the limits that hold in every unit. A length with bounds in metres gets none, because the
// schema does not know the unit of the scene.
void add_limits(const Setting& row, OrderedJson& out) {
  const Range& r = row.range;
  if (row.is_length() && r.high != kNoLimit) return;
  const double high = row.is_length() ? kFarthest : std::min(r.high, r.file_high);
  if (r.low != -kNoLimit) out[r.above_low ? "exclusiveMinimum" : "minimum"] = r.low;
  if (high != kNoLimit) out["maximum"] = high;
}

void add_limits_of_items(const Setting& row, OrderedJson& items) {
  if (row.is_length()) items["minimum"] = -kFarthest, items["maximum"] = kFarthest;
}

OrderedJson default_of(const Setting& row) {
  if (row.kind == Kind::boolean) return row.start != 0;
  if (row.kind == Kind::whole) return static_cast<std::int64_t>(row.start);
  if (row.kind == Kind::number) return row.start;
  for (const Choice& c : row.choices)
    if (c.value == row.start) return c.name;
  return nullptr;
}

OrderedJson schema_of(const Setting& row) {
  OrderedJson out;
  switch (row.kind) {
    case Kind::boolean:
      out["type"] = "boolean";
      break;
    case Kind::number:
      out["type"] = "number";
      add_limits(row, out);
      break;
    case Kind::whole:
      out["type"] = "integer";
      add_limits(row, out);
      break;
    case Kind::text:
      out["type"] = "string";
      out["minLength"] = 1;
      break;
    case Kind::choice:
      for (const Choice& c : row.choices) out["enum"].push_back(c.name);
      break;
    case Kind::method:
      out["type"] = "string";
      out["pattern"] = "^[a-z0-9]+(\\+[a-z]+)*$";
      break;
    case Kind::vec3:
      out = numbers(3);
      add_limits_of_items(row, out["items"]);
      break;
    case Kind::inertia:
      out = numbers(6);
      break;
    case Kind::quaternion:
      out = numbers(4);
      break;
    case Kind::corners:
      out = {{"type", "array"}, {"items", numbers(3)}, {"minItems", 2}, {"maxItems", 2}};
      add_limits_of_items(row, out["items"]["items"]);
      break;
    case Kind::object:
      out = schema_of(*row.inside);
      break;
    case Kind::list:
      out = {{"type", "array"}, {"items", schema_of(*row.inside)}};
      if (row.range.low > 0) out["minItems"] = static_cast<int>(row.range.low);
      out["maxItems"] = static_cast<int>(row.range.high);
      break;
  }
  return out;
}

std::string description_of(const Setting& row) {
  std::string out = row.about;
  if (row.is_length())
    out += " [scene units]";
  else if (*row.unit)
    out += std::string(" [") + row.unit + "]";
  if (row.is_length() && row.range.high != kNoLimit)
    out += ", " + number_text(row.range.low) + " to " + number_text(row.range.high) + " m";
  const std::string start = default_text(row);
  return start.empty() ? out : out + "; default " + start;
}

OrderedJson schema_of(const SettingTable& rows) {
  OrderedJson properties = OrderedJson::object(), required = OrderedJson::array();
  each_setting(rows, nullptr, [&](const Setting& row, const void*) {
    OrderedJson& property = properties[row.name] = schema_of(row);
    // A default length other than 0 depends on the unit of the scene.
    if (!default_text(row).empty() && !(row.is_length() && row.start != 0))
      property["default"] = default_of(row);
    property["description"] = description_of(row);
    if (row.required) required.push_back(row.name);
  });
  OrderedJson out = {
      {"type", "object"}, {"additionalProperties", false}, {"properties", properties}};
  if (!required.empty()) out["required"] = required;
  return out;
}

}  // namespace

std::string scene_schema() {
  OrderedJson out = {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
                     {"title", "hapsix scene, version 1"}};
  out.update(schema_of(scene_settings()));
  return out.dump(2) + "\n";
}

}  // namespace h6::io
