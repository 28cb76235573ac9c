// SPDX-License-Identifier: Apache-2.0
// defaults.cpp - default definitions, from the rows of settings, and the names of enumerations.
#include <cstring>

#include "hapsix/hapsix.h"
#include "runtime/base/foreign_enum.h"
#include "runtime/settings/engine_settings.h"

namespace {
constexpr const char* kStages[H6_STAGE_COUNT] = {"traverse", "contacts",  "weights", "wrench",
                                                 "coupling", "integrate", "output"};
constexpr const char* kCauses[H6_CAUSE_COUNT] = {
    "none",     "clamped",  "slewed",    "not finite", "late",    "device lost", "stopped",
    "speed",    "clutched", "passivity", "power",      "derated", "overspeed",   "soft start",
    "dead man", "disarmed", "pose jump", "bad sample", "frozen",  "watchdog"};
constexpr const char* kDeviceStates[H6_DEVICE_STATE_COUNT] = {"absent", "ready",    "armed",
                                                              "active", "degraded", "lost"};
constexpr const char* kStatus[] = {
    "contacts dropped", "hand not finite", "state not finite", "coupling saturated", "solve failed",
    "output clamped",   "output slewed",   "output fault",     "device lost",        "late",
    "passivity",        "coarse contacts", "motion shortened", "pairs left out"};

// The choice whose name is the first `length` letters of `name`, or null.
const h6::Choice* named(std::span<const h6::Choice> choices, const char* name, std::size_t length) {
  for (const h6::Choice& c : choices)
    if (std::strlen(c.name) == length && std::strncmp(c.name, name, length) == 0) return &c;
  return nullptr;
}

}  // namespace

extern "C" {

const char* h6StatusName(h6Status bit) {
  for (std::size_t i = 0; i < sizeof kStatus / sizeof *kStatus; ++i)
    if (bit == 1u << i) return kStatus[i];
  return nullptr;
}
const char* h6StageName(h6Stage stage) {
  return h6::raw_number(stage) < H6_STAGE_COUNT ? kStages[stage] : nullptr;
}
const char* h6CauseName(h6Cause cause) {
  return h6::raw_number(cause) < H6_CAUSE_COUNT ? kCauses[cause] : nullptr;
}
const char* h6DeviceStateName(h6DeviceState state) {
  return h6::raw_number(state) < H6_DEVICE_STATE_COUNT ? kDeviceStates[state] : nullptr;
}
const char* h6MethodName(h6Method method) {
  return h6::raw_number(method) < H6_METHOD_COUNT ? h6::method_names()[method].name : nullptr;
}

int h6MethodFromName(const char* name, h6Method* method, uint32_t* pieces) {
  if (!name) return -1;
  const std::size_t length = std::strcspn(name, "+");
  const h6::Choice* const found = named(h6::method_names(), name, length);
  if (!found) return -1;
  uint32_t bits = 0;
  for (const char* rest = name + length; *rest;) {
    ++rest;  // the '+'
    const std::size_t n = std::strcspn(rest, "+");
    const h6::Choice* const piece = named(h6::method_pieces(), rest, n);
    if (!piece) return -1;
    bits |= static_cast<uint32_t>(piece->value);
    rest += n;
  }
  if (method) *method = static_cast<h6Method>(found->value);
  if (pieces) *pieces = bits;
  return 0;
}

h6FieldDef h6DefaultFieldDef(void) { return {}; }
h6ShellDef h6DefaultShellDef(void) { return {}; }
h6DeformableDef h6DefaultDeformableDef(void) { return {}; }
h6ModelDef h6DefaultModelDef(void) { return {}; }
h6PairDef h6DefaultPairDef(void) { return {-1, -1, {}}; }
h6ContactArrays h6DefaultContactArrays(void) { return {}; }
h6Device h6DefaultDevice(void) {
  h6Device device{};
  h6DeviceCapabilities& rated = device.capabilities;
  std::strcpy(rated.name, "device");
  rated.dof_in = rated.dof_out = 6;
  rated.max_force = 10, rated.max_torque = 1;
  rated.modes = H6_IMPEDANCE;
  return device;
}
h6DeviceSample h6DefaultDeviceSample(void) {
  h6DeviceSample sample{};
  sample.pose.q.w = 1;
  return sample;
}

h6BodyDef h6DefaultBodyDef(void) {
  h6BodyDef def = h6::default_def<h6BodyDef>(h6::body_settings());
  def.shell = def.field = -1;
  return def;
}
h6ContactDef h6DefaultContactDef(void) {
  return h6::default_def<h6ContactDef>(h6::contact_settings());
}
h6CouplingDef h6DefaultCouplingDef(void) {
  return h6::default_def<h6CouplingDef>(h6::coupling_settings());
}
h6SafetyDef h6DefaultSafetyDef(void) { return h6::default_def<h6SafetyDef>(h6::safety_settings()); }
h6HandDef h6DefaultHandDef(void) {
  h6HandDef def = h6::default_def<h6HandDef>(h6::hand_settings());
  def.coupling = h6DefaultCouplingDef();
  return def;
}
h6HandFilterDef h6DefaultHandFilterDef(void) { return h6DefaultHandDef().filter; }
h6SessionDef h6DefaultSessionDef(void) {
  h6SessionDef def = h6::default_def<h6SessionDef>(h6::session_settings());
  def.contact = h6DefaultContactDef();
  return def;
}
h6LoopDef h6DefaultLoopDef(void) { return h6::default_def<h6LoopDef>(h6::loop_settings()); }

}  // extern "C"
