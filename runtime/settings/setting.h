// SPDX-License-Identifier: Apache-2.0
// setting.h - one row for each setting: its name, member, kind, range, unit, default and meaning.
//
// Rows of the engine's definitions stand in engine_settings.cpp, rows of a scene in
// io/scene/scene_settings.cpp. They drive the defaults, the checks, reading and writing of scene
// files, the JSON schema and the page runtime/SETTINGS.md. tests/runtime/settings/cover.h proves
// that every member has its row.
#pragma once
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <type_traits>

#include "hapsix/types.h"

namespace h6 {

enum class SettingKind {
  boolean,
  number,      // double
  whole,       // any integer
  choice,      // an enumeration, a bit or a bool with names
  method,      // h6Method; in files its name with the pieces, as h6MethodFromName takes it
  vec3,        // h6Vec3
  quaternion,  // h6Quat: w x y z, unit within 0.001
  inertia,     // 6 double: xx yy zz xy xz yz
  object,      // another struct, with the rows `inside`
  text,        // std::string; this kind and those below occur in scene files only
  corners,     // two h6Vec3: low corner, high corner
  list         // a list of structs with the rows `inside`
};

inline constexpr double kNoLimit = std::numeric_limits<double>::infinity();

// A finite value is valid if low <= value <= high. Numbers in files must stay far from overflow, so
// a file may have a lower limit of its own.
struct Range {
  double low = -kNoLimit, high = kNoLimit;
  bool above_low = false;       // low itself is not valid
  double file_high = kNoLimit;  // the highest value that a file may give, in the file's unit
};
constexpr Range between(double low, double high) { return {low, high}; }
constexpr Range above(double low, double high) { return {low, high, true}; }
constexpr Range positive(double file_high) { return {0, kNoLimit, true, file_high}; }
constexpr Range not_negative(double file_high) { return {0, kNoLimit, false, file_high}; }

struct Choice {
  const char* name;
  int value;
};

// Access to one member of a struct that is known by its address only.
struct Member {
  const void* (*get)(const void* def) = nullptr;  // gives null for an optional without a value
  void* (*make)(void* def) = nullptr;             // gives an empty optional a value
  double (*number)(const void* value) = nullptr;  // for boolean, number, whole, choice and method
  void (*set_number)(void* value, double number) = nullptr;
};

struct SettingTable;

struct Setting {
  const char* name;  // "": an object whose rows belong to this table directly
  SettingKind kind;
  Member member;
  const char* about;      // one sentence
  const char* unit = "";  // "m": a length; files give it in the scene's unit
  Range range = {};       // for a list: how many entries
  double start = 0;       // the default
  std::span<const Choice> choices = {};
  const SettingTable* inside = nullptr;
  bool required = false;           // in a file
  bool quiet = false;              // written to a file only if it is not the default
  const char* replaces = nullptr;  // the key that must not occur beside this one

  bool is_length() const { return unit[0] == 'm' && unit[1] == 0; }
  bool stands_among() const { return name[0] == 0; }
};

// The rows of one struct; `of` is the struct's name.
struct SettingTable {
  const char* of;
  const Setting* first;
  std::size_t count;
  const Setting* begin() const { return first; }
  const Setting* end() const { return first + count; }
};
template <std::size_t N>
constexpr SettingTable settings_of(const char* of, const Setting (&rows)[N]) {
  return {of, rows, N};
}

// ---- builders of rows --------------------------------------------------------------------------

template <auto M>
struct MemberTraits;
template <class D, class V, V D::*M>
struct MemberTraits<M> {
  using Def = D;
  using Value = V;
};

template <class V>
concept AnOptional = requires(V v) {
  v.has_value();
  v.emplace();
};

// A C program can put any number into an enumeration, so its bytes are read.
template <class V>
double number_of(const void* value) {
  if constexpr (std::is_enum_v<V>) {
    std::underlying_type_t<V> bits;
    std::memcpy(&bits, value, sizeof bits);
    return static_cast<double>(static_cast<int>(bits));
  } else {
    return static_cast<double>(*static_cast<const V*>(value));
  }
}

template <auto M>
constexpr Member member() {
  using Def = typename MemberTraits<M>::Def;
  using V = typename MemberTraits<M>::Value;
  Member out;
  if constexpr (AnOptional<V>) {
    out.get = [](const void* def) -> const void* {
      const V& value = static_cast<const Def*>(def)->*M;
      return value.has_value() ? &*value : nullptr;
    };
    out.make = [](void* def) -> void* {
      V& value = static_cast<Def*>(def)->*M;
      if (!value.has_value()) value.emplace();
      return &*value;
    };
  } else {
    out.get = [](const void* def) -> const void* { return &(static_cast<const Def*>(def)->*M); };
    out.make = [](void* def) -> void* { return &(static_cast<Def*>(def)->*M); };
    if constexpr (std::is_arithmetic_v<V> || std::is_enum_v<V>) {
      out.number = number_of<V>;
      out.set_number = [](void* value, double x) {
        *static_cast<V*>(value) =
            static_cast<V>(static_cast<std::conditional_t<std::is_enum_v<V>, int, V>>(x));
      };
    }
  }
  return out;
}

// A row of any kind, without range and default.
template <auto M>
constexpr Setting plain(const char* name, SettingKind kind, const char* unit, const char* about) {
  return {.name = name, .kind = kind, .member = member<M>(), .about = about, .unit = unit};
}
template <auto M>
constexpr Setting number(const char* name, const char* unit, double start, Range range,
                         const char* about) {
  Setting row = plain<M>(name, SettingKind::number, unit, about);
  row.range = range, row.start = start;
  return row;
}
template <auto M>
constexpr Setting whole(const char* name, double start, Range range, const char* about) {
  Setting row = number<M>(name, "", start, range, about);
  row.kind = SettingKind::whole;
  return row;
}
template <auto M>
constexpr Setting flag(const char* name, const char* about, bool start = false) {
  Setting row = plain<M>(name, SettingKind::boolean, "", about);
  row.start = start ? 1 : 0, row.quiet = true;
  return row;
}
template <auto M>
constexpr Setting choice(const char* name, std::span<const Choice> choices, double start,
                         const char* about) {
  Setting row = plain<M>(name, SettingKind::choice, "", about);
  row.choices = choices, row.start = start;
  return row;
}
template <auto M>
constexpr Setting object(const char* name, const SettingTable& inside, const char* about) {
  Setting row = plain<M>(name, SettingKind::object, "", about);
  row.inside = &inside;
  return row;
}
constexpr Setting quiet(Setting row) {
  row.quiet = true;
  return row;
}
constexpr Setting required(Setting row) {
  row.required = true;
  return row;
}

// ---- functions on rows -------------------------------------------------------------------------

// Calls visit(row, def) for every row. The rows of an object without a name take its place. `def`
// may be null.
template <class Visit>
void each_setting(const SettingTable& rows, const void* def, Visit&& visit) {
  for (const Setting& row : rows)
    if (row.stands_among())
      each_setting(*row.inside, def ? row.member.get(def) : nullptr, visit);
    else
      visit(row, def);
}

// Puts the default of every row into `def`. Members without a row keep their value.
void set_defaults(const SettingTable& rows, void* def);
template <class Def>
Def default_def(const SettingTable& rows) {
  Def def{};
  set_defaults(rows, &def);
  return def;
}
// Returns whether every row of `def` has its default.
bool is_default(const SettingTable& rows, const void* def);

// Checks that every row of `def` is finite and in its range, and that every choice exists. If not,
// returns false with a sentence that begins with `where` ("hand 0: ") and names the setting, its
// range and the value.
bool check_settings(const SettingTable& rows, const void* def, const char* where, h6Error* error);

}  // namespace h6
