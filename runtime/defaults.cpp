// SPDX-License-Identifier: Apache-2.0
// defaults.cpp - start values of every definition (METHOD.md, Sec. 4) and names of every
// enumeration.
#include <cstring>

#include "hapsix/hapsix.h"

namespace {
constexpr const char* kMethods[H6_METHOD_COUNT] = {"none",   "global", "cluster", "gauss3",
                                                   "gauss6", "robust", "series"};
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
    "passivity",        "coarse contacts"};
struct Piece {
  const char* name;
  uint32_t bit;
};
constexpr Piece kPieces[] = {{"facing", H6_PIECE_FACING},     {"depth", H6_PIECE_DEPTH},
                             {"product", H6_PIECE_PRODUCT},   {"cluster", H6_PIECE_CLUSTER},
                             {"geodesic", H6_PIECE_GEODESIC}, {"handles", H6_PIECE_HANDLES},
                             {"printed", H6_PIECE_PRINTED}};
}  // namespace

extern "C" {

const char* h6StatusName(h6Status bit) {
  for (std::size_t i = 0; i < sizeof kStatus / sizeof *kStatus; ++i)
    if (bit == 1u << i) return kStatus[i];
  return nullptr;
}
const char* h6StageName(h6Stage stage) {
  return stage >= 0 && stage < H6_STAGE_COUNT ? kStages[stage] : nullptr;
}
const char* h6CauseName(h6Cause cause) {
  return cause >= 0 && cause < H6_CAUSE_COUNT ? kCauses[cause] : nullptr;
}
const char* h6DeviceStateName(h6DeviceState state) {
  return state >= 0 && state < H6_DEVICE_STATE_COUNT ? kDeviceStates[state] : nullptr;
}
const char* h6MethodName(h6Method method) {
  return method >= 0 && method < H6_METHOD_COUNT ? kMethods[method] : nullptr;
}

int h6MethodFromName(const char* name, h6Method* method, uint32_t* pieces) {
  if (!name) return -1;
  const std::size_t length = std::strcspn(name, "+");
  int found = -1;
  for (int i = 0; i < H6_METHOD_COUNT; ++i)
    if (std::strlen(kMethods[i]) == length && std::strncmp(kMethods[i], name, length) == 0)
      found = i;
  if (found < 0) return -1;
  uint32_t bits = 0;
  for (const char* rest = name + length; *rest;) {
    ++rest;  // the '+'
    const std::size_t n = std::strcspn(rest, "+");
    uint32_t bit = 0;
    for (const Piece& piece : kPieces)
      if (std::strlen(piece.name) == n && std::strncmp(piece.name, rest, n) == 0) bit = piece.bit;
    if (!bit) return -1;
    bits |= bit;
    rest += n;
  }
  if (method) *method = static_cast<h6Method>(found);
  if (pieces) *pieces = bits;
  return 0;
}

h6ModelDef h6DefaultModelDef(void) { return {}; }

h6BodyDef h6DefaultBodyDef(void) {
  h6BodyDef def{};
  def.pose.q.w = 1;
  def.mass = 0.1;
  def.shell = -1;
  def.field = -1;
  return def;
}

h6ContactDef h6DefaultContactDef(void) {
  h6ContactDef def{};
  def.method = H6_METHOD_ROBUST;
  def.stiffness = 1e4;
  def.damping = 1e-3;
  def.global_n0 = 10;
  def.epsilon = 0.01;
  def.epsilon_normal = 0.05;
  def.epsilon_torque = 1;
  def.series_c = 4;
  def.margin_voxels = 0.5;
  def.cluster_voxels = 0.5;
  return def;
}

h6CouplingDef h6DefaultCouplingDef(void) {
  h6CouplingDef def{};
  def.stiffness = 1e3;
  def.damping_ratio = 1;
  def.max_depth_voxels = 0.5;
  def.max_step_voxels = 0.5;
  return def;
}

h6SafetyDef h6DefaultSafetyDef(void) {
  h6SafetyDef def{};
  def.soft_start = 0.1;
  def.decay_time = 0.02;
  def.pose_jump = 0.02;
  return def;
}

h6HandDef h6DefaultHandDef(void) {
  h6HandDef def{};
  def.mode = H6_IMPEDANCE;
  def.coupling = h6DefaultCouplingDef();
  def.filter.motion_scale = def.filter.rotation_scale = def.filter.force_scale = 1;
  def.manipulandum_mass = 0.1;
  def.safety = h6DefaultSafetyDef();
  return def;
}

h6SessionDef h6DefaultSessionDef(void) {
  h6SessionDef def{};
  def.contact = h6DefaultContactDef();
  def.integrator = H6_IMPLICIT;
  def.gradient = H6_SYMMETRIC;
  def.rate = 1000;
  def.max_contacts = 16384;
  def.threads = 1;
  return def;
}

h6LoopDef h6DefaultLoopDef(void) {
  h6LoopDef def{};
  def.realtime = true;
  def.core = -1;
  def.ring_frames = 1000;
  return def;
}

}  // extern "C"
