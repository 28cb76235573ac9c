// SPDX-License-Identifier: Apache-2.0
// setting.cpp - defaults and checks of any definition, from its rows.
#include "runtime/settings/setting.h"

#include <cmath>
#include <cstdio>

#include "runtime/model/model.h"

namespace h6 {
namespace {

constexpr std::size_t kSentence = 320;  // bytes for a part of a sentence

// Writes a range in words: "above 0 N/m", "0 s or more", "in 0..10", "in (0, 2]".
void say_range(const Setting& row, char (&out)[kSentence]) {
  const Range& r = row.range;
  const char *space = *row.unit ? " " : "", *unit = row.unit;
  if (r.high == kNoLimit)
    std::snprintf(out, sizeof out, r.above_low ? "above %.10g%s%s" : "%.10g%s%s or more", r.low,
                  space, unit);
  else
    std::snprintf(out, sizeof out, r.above_low ? "in (%.10g, %.10g]%s%s" : "in %.10g..%.10g%s%s",
                  r.low, r.high, space, unit);
}

bool check_number(const Setting& row, double x, const char* where, h6Error* error) {
  const Range& r = row.range;
  if (std::isfinite(x) && (r.above_low ? x > r.low : x >= r.low) && x <= r.high) return true;
  char range[kSentence];
  say_range(row, range);
  return fail(error, H6_ERROR_RANGE, "%s%s must be %s, it is %g", where, row.name, range, x);
}

bool check_choice(const Setting& row, int x, const char* where, h6Error* error) {
  char known[kSentence] = "";
  int length = 0;
  for (const Choice& c : row.choices) {
    if (c.value == x) return true;
    const auto room = sizeof known - static_cast<std::size_t>(length);
    length += std::snprintf(known + length, room, "%s%s (%d)", length ? ", " : "", c.name, c.value);
    if (length >= static_cast<int>(sizeof known)) length = sizeof known - 1;
  }
  return fail(error, H6_ERROR_RANGE, "%s%s %d does not exist; it is one of %s", where, row.name, x,
              known);
}

bool check_finite(const Setting& row, const double* x, int count, const char* where,
                  h6Error* error) {
  for (int i = 0; i < count; ++i)
    if (!std::isfinite(x[i]))
      return fail(error, H6_ERROR_RANGE, "%s%s is not finite", where, row.name);
  return true;
}

bool check_quaternion(const Setting& row, const h6Quat& q, const char* where, h6Error* error) {
  const double x[4] = {q.w, q.x, q.y, q.z};
  if (!check_finite(row, x, 4, where, error)) return false;
  const double n = std::sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2] + x[3] * x[3]);
  return std::fabs(n - 1) <= 1e-3 ||
         fail(error, H6_ERROR_RANGE, "%s%s must be a unit quaternion, its length is %g", where,
              row.name, n);
}

bool check_row(const Setting& row, const void* value, const char* where, h6Error* error) {
  switch (row.kind) {
    case SettingKind::number:
    case SettingKind::whole:
      return check_number(row, row.member.number(value), where, error);
    case SettingKind::choice:
    case SettingKind::method:
      return check_choice(row, static_cast<int>(row.member.number(value)), where, error);
    case SettingKind::vec3: {
      const auto& v = *static_cast<const h6Vec3*>(value);
      const double x[3] = {v.x, v.y, v.z};
      return check_finite(row, x, 3, where, error);
    }
    case SettingKind::quaternion:
      return check_quaternion(row, *static_cast<const h6Quat*>(value), where, error);
    case SettingKind::inertia:
      return check_finite(row, static_cast<const double*>(value), 6, where, error);
    case SettingKind::object: {
      char inside[kSentence];
      std::snprintf(inside, sizeof inside, "%s%s ", where, row.name);
      return check_settings(*row.inside, value, inside, error);
    }
    default:
      return true;
  }
}

}  // namespace

void set_defaults(const SettingTable& rows, void* def) {
  for (const Setting& row : rows) {
    void* const value = row.member.make(def);
    if (row.inside)
      set_defaults(*row.inside, value);
    else if (row.kind == SettingKind::quaternion)
      *static_cast<h6Quat*>(value) = {1, 0, 0, 0};
    else if (row.member.set_number)
      row.member.set_number(value, row.start);
  }
}

bool is_default(const SettingTable& rows, const void* def) {
  bool same = true;
  each_setting(rows, def, [&](const Setting& row, const void* at) {
    if (row.member.number) same = same && row.member.number(row.member.get(at)) == row.start;
  });
  return same;
}

bool check_settings(const SettingTable& rows, const void* def, const char* where, h6Error* error) {
  bool good = true;
  each_setting(rows, def, [&](const Setting& row, const void* at) {
    good = good && check_row(row, row.member.get(at), where, error);
  });
  return good;
}

}  // namespace h6
