// SPDX-License-Identifier: Apache-2.0
// settings_page.cpp - makes the page runtime/SETTINGS.md from the tables of settings.
#include <locale>
#include <sstream>

#include "io/scene/scene_file.h"
#include "io/scene/scene_settings.h"
#include "io/scene/setting_text.h"
#include "runtime/settings/engine_settings.h"

namespace h6::io {
namespace {

constexpr const char* kHead = R"(# Settings

Every setting of a scene file and of the engine's definitions, from the rows in `runtime/settings/engine_settings.cpp` and `io/scene/scene_settings.cpp`. `hapsix info --settings` prints this page: after a change of a row write it anew with `build/release/hapsix info --settings > runtime/SETTINGS.md`.

Lengths are in metres here and in programs; in a scene file they are in its own unit, and at most 1e6 of it. METHOD.md has the equations.

## In a scene file
)";

constexpr const char* kEngine = R"(
## In programs only

The rest of the definitions in `hapsix/types.h` and `hapsix/hapsix.h`.
)";

std::string range_text(const Setting& row) {
  if (row.kind == SettingKind::boolean) return "true, false";
  if (row.kind == SettingKind::choice) {
    std::string out;
    for (const Choice& c : row.choices) out += (out.empty() ? "" : ", ") + std::string(c.name);
    return out;
  }
  const Range& r = row.range;
  if (row.kind == SettingKind::list)
    return number_text(r.low) + " to " + number_text(r.high) + " entries";
  std::string out;
  if (r.low != -kNoLimit) out = (r.above_low ? "above " : "from ") + number_text(r.low);
  if (r.high != kNoLimit) out += " to " + number_text(r.high);
  if (r.file_high != kNoLimit) out += ", in files to " + number_text(r.file_high);
  return out;
}

std::string kind_text(SettingKind kind) {
  switch (kind) {
    case SettingKind::whole:
      return "whole number";
    case SettingKind::vec3:
      return "x y z";
    case SettingKind::quaternion:
      return "w x y z, unit";
    case SettingKind::inertia:
      return "6 numbers";
    case SettingKind::text:
    case SettingKind::method:
      return "text";
    case SettingKind::corners:
      return "2 corners";
    default:
      return "";
  }
}

void add_table(const SettingTable& rows, std::string& out) {
  out += "\n| setting | values | unit | default | meaning |\n|---|---|---|---|---|\n";
  each_setting(rows, nullptr, [&](const Setting& row, const void*) {
    std::string values = range_text(row);
    if (const std::string kind = kind_text(row.kind); !kind.empty())
      values = values.empty() ? kind : kind + ", " + values;
    out += std::string("| `") + row.name + "` | " + values + " | " + row.unit + " | " +
           (row.required ? "required" : default_text(row)) + " | " + row.about + " |\n";
  });
}

// Adds a table, then the tables of the objects and lists in it.
void add_section(const SettingTable& rows, const std::string& path, std::string& out) {
  out += "\n### " + (path.empty() ? std::string("The file") : "`" + path + "`") + "\n";
  add_table(rows, out);
  each_setting(rows, nullptr, [&](const Setting& row, const void*) {
    if (row.inside)
      add_section(
          *row.inside,
          (path.empty() ? "" : path + ".") + row.name + (row.kind == SettingKind::list ? "[]" : ""),
          out);
  });
}

}  // namespace

std::string number_text(double value) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out.precision(10);
  out << value;
  return out.str();
}

std::string default_text(const Setting& row) {
  const Range& r = row.range;
  const bool numeric = row.kind == SettingKind::number || row.kind == SettingKind::whole;
  if (!row.member.number || row.required) return "";
  if (numeric && (row.start < r.low || (r.above_low && row.start == r.low))) return "";
  if (row.kind == SettingKind::boolean) return row.start != 0 ? "true" : "false";
  for (const Choice& c : row.choices)
    if (c.value == row.start) return c.name;
  return number_text(row.start) + (row.is_length() && row.start != 0 ? " m" : "");
}

std::string settings_page() {
  std::string out = kHead;
  add_section(scene_settings(), "", out);
  out += kEngine;
  for (const SettingTable* rows : {&session_settings(), &loop_settings()}) {
    out += std::string("\n### `") + rows->of + "`\n";
    add_table(*rows, out);
  }
  return out;
}

}  // namespace h6::io
