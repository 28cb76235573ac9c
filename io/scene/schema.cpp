// SPDX-License-Identifier: Apache-2.0
// schema.cpp - the JSON schema of scene files, printed from the one table of keys.
#include <algorithm>
#include <nlohmann/json.hpp>

#include "io/scene/keys.h"
#include "io/scene/scene_file.h"

namespace h6::io {
namespace {

using Kind = KeyKind;
using Json = nlohmann::ordered_json;

Json numbers(std::size_t count) {
  return {
      {"type", "array"}, {"items", {{"type", "number"}}}, {"minItems", count}, {"maxItems", count}};
}

Json schema_of(const SceneKeys& keys);

Json choices_of(const SceneKey& key) {
  Json names = Json::array();
  const std::string all = key.choices;
  for (std::size_t at = 0; at <= all.size();) {
    const std::size_t end = std::min(all.find('|', at), all.size());
    names.push_back(all.substr(at, end - at));
    at = end + 1;
  }
  return names;
}

void add_limits(const SceneKey& key, Json& out) {
  if (key.low != -kNoLimit) out[key.above_low ? "exclusiveMinimum" : "minimum"] = key.low;
  if (key.high != kNoLimit) out["maximum"] = key.high;
}

Json schema_of(const SceneKey& key) {
  Json out;
  switch (key.kind) {
    case Kind::boolean:
      out["type"] = "boolean";
      break;
    case Kind::number:
      out["type"] = "number";
      add_limits(key, out);
      break;
    case Kind::whole:
      out["type"] = "integer";
      add_limits(key, out);
      break;
    case Kind::text:
      out["type"] = "string";
      out["minLength"] = 1;
      break;
    case Kind::choice:
      out["enum"] = choices_of(key);
      break;
    case Kind::method:
      out["type"] = "string";
      out["pattern"] = "^[a-z0-9]+(\\+[a-z]+)*$";
      break;
    case Kind::vec3:
      out = numbers(3);
      add_limits(key, out["items"]);
      break;
    case Kind::inertia:
      out = numbers(6);
      break;
    case Kind::quaternion:
      out = numbers(4);
      break;
    case Kind::corners:
      out = {{"type", "array"}, {"items", numbers(3)}, {"minItems", 2}, {"maxItems", 2}};
      add_limits(key, out["items"]["items"]);
      break;
    case Kind::object:
      out = schema_of(*key.keys);
      break;
    case Kind::list:
      out = {{"type", "array"}, {"items", schema_of(*key.keys)}};
      if (key.low > 0) out["minItems"] = static_cast<int>(key.low);
      out["maxItems"] = static_cast<int>(key.high);
      break;
  }
  out["description"] = key.about;
  return out;
}

Json schema_of(const SceneKeys& keys) {
  Json properties = Json::object(), required = Json::array();
  for (const SceneKey& key : keys) {
    properties[key.name] = schema_of(key);
    if (key.required) required.push_back(key.name);
  }
  Json out = {{"type", "object"}, {"additionalProperties", false}, {"properties", properties}};
  if (!required.empty()) out["required"] = required;
  return out;
}

}  // namespace

std::string scene_schema() {
  Json out = {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
              {"title", "hapsix scene, version 1"}};
  out.update(schema_of(scene_keys()));
  return out.dump(2) + "\n";
}

}  // namespace h6::io
