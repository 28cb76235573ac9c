// SPDX-License-Identifier: Apache-2.0
// keys.h - every key of a scene file, once: the reader checks by this table and the schema is
// printed from it, so neither can know a key that the other does not.
#pragma once
#include <cstddef>
#include <limits>
#include <vector>

#include "io/scene/scene.h"

namespace h6::io {

struct SceneKeys;

enum class KeyKind {
  boolean,
  number,      // low <= value <= high
  whole,       // the same, without a fraction
  text,        // 1 .. 4096 bytes without control characters
  choice,      // one of `choices`
  method,      // a contact method's name, known by h6MethodFromName
  vec3,        // three numbers, each in low .. high
  inertia,     // xx yy zz xy xz yz: positive definite
  quaternion,  // w x y z, unit within 0.001
  corners,     // two vec3: low corner, high corner
  object,      // `keys`
  list         // of `keys` objects, at most `high` of them
};

inline constexpr double kNoLimit = std::numeric_limits<double>::infinity();

struct SceneKey {
  const char* name;
  KeyKind kind;
  const char* about;  // for the schema: meaning, unit, default
  double low = -kNoLimit, high = kNoLimit;
  bool above_low = false;  // low itself is out of range
  bool required = false;
  const char* choices = nullptr;  // "a|b|c"
  const SceneKeys* keys = nullptr;
};

struct SceneKeys {
  const SceneKey* first;
  std::size_t count;
  const SceneKey* begin() const { return first; }
  const SceneKey* end() const { return first + count; }
};

const SceneKeys& scene_keys();  // of the file itself

// The keys of `arm` that are plain numbers, and where their values go.
struct ArmNumber {
  const char* name;
  double SceneArm::*value;
  bool length = false;  // in the scene's units
};
const std::vector<ArmNumber>& arm_numbers();

// Largest coordinate, in the scene's units: numbers stay far from overflow whatever is done with
// them.
inline constexpr double kFarthest = 1e6;
inline constexpr double kMostBoxes = 1024;

}  // namespace h6::io
