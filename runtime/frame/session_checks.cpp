// SPDX-License-Identifier: Apache-2.0
#include "runtime/frame/session_checks.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <cstring>

namespace h6 {
namespace {

bool positive(double v) { return v > 0 && std::isfinite(v); }
bool not_negative(double v) { return v >= 0 && std::isfinite(v); }

// Programs in C can put any number into an enumeration; reading it as one would be undefined.
template <class E>
int number(const E& value) {
  static_assert(sizeof(E) == sizeof(int));
  int out;
  std::memcpy(&out, &value, sizeof out);
  return out;
}

}  // namespace

bool check_contact(const h6ContactDef& c, h6Error* error) {
  if (number(c.method) < 0 || number(c.method) >= H6_METHOD_COUNT)
    return fail(error, "contact method %d does not exist", number(c.method));
  if (!positive(c.stiffness))
    return fail(error, "contact stiffness must be above 0 N/m, it is %g", c.stiffness);
  if (!not_negative(c.damping))
    return fail(error, "contact damping must be 0 s or more, it is %g", c.damping);
  if (!(c.global_n0 >= 1) || !std::isfinite(c.global_n0))
    return fail(error, "global_n0 must be 1 or more, it is %g", c.global_n0);
  for (const auto& [name, value] : {std::pair{"epsilon", c.epsilon},
                                    {"epsilon_normal", c.epsilon_normal},
                                    {"epsilon_torque", c.epsilon_torque}})
    if (!(value > 0 && value <= 2))
      return fail(error, "%s must be in (0, 2], it is %g", name, value);
  if (!not_negative(c.torque_length))
    return fail(error, "torque_length must be 0 m or more, it is %g", c.torque_length);
  if (!(c.series_c > 2 && c.series_c <= 1e6))
    return fail(error, "series_c must be in (2, 1e6], it is %g", c.series_c);
  if (!(c.margin_voxels >= 0 && c.margin_voxels <= 2))
    return fail(error, "margin_voxels must be in 0..2, it is %g", c.margin_voxels);
  if (!(c.cluster_voxels > 0.01 && c.cluster_voxels <= 100))
    return fail(error, "cluster_voxels must be in (0.01, 100], it is %g", c.cluster_voxels);
  return true;
}

namespace {

bool check_body(const h6Model& model, const h6BodyDef& b, std::size_t i, h6Error* error) {
  if (!finite(b.pose) || !from(b.velocity.linear).allFinite() ||
      !from(b.velocity.angular).allFinite() || !from(b.com).allFinite())
    return fail(error, "body %zu: pose, velocity and com must be finite", i);
  const double n = from(b.pose.q).norm();
  if (std::fabs(n - 1) > 1e-3)
    return fail(error, "body %zu: its quaternion has length %g, not 1", i, n);
  if (b.shell < -1 || b.shell >= static_cast<std::int64_t>(model.shell_count))
    return fail(error, "body %zu: shell %d, but the model has %zu", i, b.shell, model.shell_count);
  if (b.field < -1 || b.field >= static_cast<std::int64_t>(model.field_count))
    return fail(error, "body %zu: field %d, but the model has %zu", i, b.field, model.field_count);
  if (b.fixed) return true;
  if (!positive(b.mass))
    return fail(error, "body %zu: a moving body needs a mass above 0 kg, it is %g", i, b.mass);
  bool given = false;
  for (double v : b.inertia) {
    if (!std::isfinite(v)) return fail(error, "body %zu: its inertia is not finite", i);
    given = given || v != 0;
  }
  if (!given && b.shell < 0 && !b.translation_only)
    return fail(error, "body %zu: a moving body without a shell needs an inertia", i);
  if (given) {
    Mat3 I;
    const double* v = b.inertia;
    I << v[0], v[3], v[4], v[3], v[1], v[5], v[4], v[5], v[2];
    const Eigen::LLT<Mat3> factors(I);
    if (factors.info() != Eigen::Success)
      return fail(error, "body %zu: its inertia is not positive definite", i);
  }
  return true;
}

bool check_pair(const h6SessionDef& def, std::size_t i, h6Error* error) {
  const h6PairDef& p = def.pairs[i];
  const auto count = static_cast<std::int64_t>(def.body_count);
  if (p.shell_body < 0 || p.shell_body >= count || p.field_body < 0 || p.field_body >= count)
    return fail(error, "pair %zu names a body that does not exist", i);
  if (p.shell_body == p.field_body)
    return fail(error, "pair %zu: body %d against itself", i, p.shell_body);
  if (def.bodies[p.shell_body].shell < 0)
    return fail(error, "pair %zu: body %d has no shell", i, p.shell_body);
  if (def.bodies[p.field_body].field < 0)
    return fail(error, "pair %zu: body %d has no field", i, p.field_body);
  return true;
}

bool check_filter(const h6HandFilterDef& f, std::size_t i, h6Error* error) {
  for (const auto& [name, value] : {std::pair{"motion_scale", f.motion_scale},
                                    {"rotation_scale", f.rotation_scale},
                                    {"force_scale", f.force_scale}})
    if (!positive(value))
      return fail(error, "hand %zu: %s must be above 0, it is %g", i, name, value);
  return true;
}

bool check_coupling_mode(const h6HandDef& h, std::size_t i, h6Error* error) {
  const int mode = number(h.coupling.mode);
  if (mode != H6_COUPLING_DYNAMIC && mode != H6_COUPLING_STATIC && mode != H6_COUPLING_DIRECT)
    return fail(error, "hand %zu: coupling mode %d does not exist", i, mode);
  if (!positive(h.coupling.max_step_voxels))
    return fail(error, "hand %zu: max_step_voxels must be above 0, it is %g", i,
                h.coupling.max_step_voxels);
  if (mode != H6_COUPLING_DYNAMIC && h.mode != H6_IMPEDANCE)
    return fail(
        error,
        "hand %zu: %s coupling has no mass that a wrench could move; a hand in %s mode needs "
        "the dynamic coupling",
        i, mode == H6_COUPLING_STATIC ? "static" : "direct",
        h.mode == H6_ADMITTANCE ? "admittance" : "pseudo-admittance");
  return true;
}

bool check_device_mode(const h6HandDef& h, std::size_t i, h6Error* error) {
  if (h.mode != H6_IMPEDANCE && h.mode != H6_ADMITTANCE && h.mode != H6_PSEUDO_ADMITTANCE)
    return fail(error,
                "hand %zu: device mode %u does not exist; it is one of impedance (%u), admittance "
                "(%u) and pseudo-admittance (%u)",
                i, h.mode, static_cast<unsigned>(H6_IMPEDANCE),
                static_cast<unsigned>(H6_ADMITTANCE), static_cast<unsigned>(H6_PSEUDO_ADMITTANCE));
  if (!positive(h.manipulandum_mass))
    return fail(error, "hand %zu: manipulandum_mass must be above 0 kg, it is %g", i,
                h.manipulandum_mass);
  for (const auto& [name, value] : {std::pair{"driver_stiffness", h.driver_stiffness},
                                    {"driver_damping", h.driver_damping},
                                    {"admittance_damping", h.admittance_damping}})
    if (!not_negative(value))
      return fail(error, "hand %zu: %s must be 0 or more, it is %g", i, name, value);
  return true;
}

bool check_safety(const h6SafetyDef& d, std::size_t i, h6Error* error) {
  for (const auto& [name, value] : {std::pair{"max_force", d.max_force},
                                    {"max_torque", d.max_torque},
                                    {"max_force_rate", d.max_force_rate},
                                    {"max_torque_rate", d.max_torque_rate},
                                    {"max_power", d.max_power},
                                    {"max_speed", d.max_speed},
                                    {"derate_speed", d.derate_speed},
                                    {"cut_speed", d.cut_speed}})
    if (!not_negative(value))
      return fail(error, "hand %zu: safety %s must be 0 (the device's) or more, it is %g", i, name,
                  value);
  struct Range {
    const char* name;
    double value, least, most;
  };
  for (const Range& r : {Range{"soft_start", d.soft_start, 0, 10},
                         {"decay_time", d.decay_time, 0.001, 0.02},
                         {"pose_jump", d.pose_jump, 0.001, 0.05},
                         {"freeze_time", d.freeze_time, 0, 1}})
    if (!(r.value >= r.least && r.value <= r.most))
      return fail(error, "hand %zu: safety %s must be in %g..%g, it is %g", i, r.name, r.least,
                  r.most, r.value);
  if (d.derate_speed > 0 && d.cut_speed > 0 && d.derate_speed > d.cut_speed)
    return fail(error, "hand %zu: safety derate_speed, %g m/s, is above cut_speed, %g", i,
                d.derate_speed, d.cut_speed);
  return true;
}

// Several hands pull on one body as several springs do; but it cannot be where two of them are, nor
// step once for each.
bool check_other_hands(const h6SessionDef& def, std::size_t i, h6Error* error) {
  const auto alone = [](const h6HandDef& h) {
    return number(h.coupling.mode) != H6_COUPLING_DYNAMIC;
  };
  for (std::size_t j = 0; j < i; ++j)
    if (def.hands[j].body == def.hands[i].body && (alone(def.hands[i]) || alone(def.hands[j])))
      return fail(error,
                  "hands %zu and %zu hold body %d, which only the dynamic coupling allows: a body "
                  "with static or direct coupling has one hand",
                  j, i, def.hands[i].body);
  return true;
}

bool check_hand(const h6SessionDef& def, std::size_t i, h6Error* error) {
  const h6HandDef& h = def.hands[i];
  if (h.body < 0 || h.body >= static_cast<std::int64_t>(def.body_count))
    return fail(error, "hand %zu: body %d does not exist", i, h.body);
  if (def.bodies[h.body].fixed)
    return fail(error, "hand %zu holds body %d, which is fixed", i, h.body);
  const h6CouplingDef& c = h.coupling;
  if (!positive(c.stiffness))
    return fail(error, "hand %zu: coupling stiffness must be above 0 N/m, it is %g", i,
                c.stiffness);
  if (!(c.damping_ratio >= 0 && c.damping_ratio <= 10))
    return fail(error, "hand %zu: damping_ratio must be in 0..10, it is %g", i, c.damping_ratio);
  for (double v : {c.rotational_stiffness, c.max_force, c.max_torque})
    if (!not_negative(v))
      return fail(error,
                  "hand %zu: rotational_stiffness, max_force and max_torque must be 0 (derived) or "
                  "more, one is %g",
                  i, v);
  if (!positive(c.max_depth_voxels) && !(c.max_force > 0))
    return fail(error, "hand %zu: max_depth_voxels must be above 0, it is %g", i,
                c.max_depth_voxels);
  return check_device_mode(h, i, error) && check_coupling_mode(h, i, error) &&
         check_filter(h.filter, i, error) && check_safety(h.safety, i, error) &&
         check_other_hands(def, i, error);
}

}  // namespace

bool check_session(const h6Model& model, const h6SessionDef& def, h6Error* error) {
  if (def.body_count == 0 || !def.bodies || def.body_count > H6_MAX_BODIES)
    return fail(error, "a session needs 1 to %d bodies, it has %zu", H6_MAX_BODIES, def.body_count);
  if (def.hand_count > H6_MAX_HANDS || (def.hand_count && !def.hands))
    return fail(error, "a session has at most %d hands", H6_MAX_HANDS);
  if (def.pair_count && !def.pairs) return fail(error, "pairs are counted but not given");
  if (!(def.rate >= 100 && def.rate <= 10000))
    return fail(error, "rate must be in 100..10000 Hz, it is %g", def.rate);
  if (number(def.integrator) != H6_IMPLICIT && number(def.integrator) != H6_EXPLICIT)
    return fail(error, "integrator %d does not exist", number(def.integrator));
  if (number(def.gradient) != H6_SYMMETRIC && number(def.gradient) != H6_EXACT)
    return fail(error, "gradient %d does not exist", number(def.gradient));
  if (def.max_contacts < 1 || def.max_contacts > 1000000)
    return fail(error, "max_contacts must be in 1..1000000, it is %zu", def.max_contacts);
  if (def.threads < 1 || def.threads > 2)
    return fail(error, "threads must be 1 or 2 (the haptic thread and one helper), it is %u",
                def.threads);
  if (!(def.frame_budget_us >= 0 && def.frame_budget_us <= 1e6))
    return fail(error, "frame_budget_us must be in 0..1000000, it is %g", def.frame_budget_us);
  if (!from(def.gravity).allFinite()) return fail(error, "gravity is not finite");
  if (!check_contact(def.contact, error)) return false;
  for (std::size_t i = 0; i < def.body_count; ++i)
    if (!check_body(model, def.bodies[i], i, error)) return false;
  for (std::size_t i = 0; i < def.pair_count; ++i)
    if (!check_pair(def, i, error)) return false;
  for (std::size_t i = 0; i < def.hand_count; ++i)
    if (!check_hand(def, i, error)) return false;
  return true;
}

}  // namespace h6
