// SPDX-License-Identifier: Apache-2.0
// session_checks.cpp - checks whether the values of a definition fit together. Their ranges come
// from the rows of settings.
#include "runtime/frame/session_checks.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "runtime/settings/engine_settings.h"
#include "sched/host_memory.h"

namespace h6 {

bool check_contact(const h6ContactDef& def, h6Error* error) {
  return check_reserved(def, "contact ", error) &&
         check_settings(contact_settings(), &def, "contact ", error);
}

namespace {

constexpr double kLeastGyration = 1e-7;  // [m]

// "hand 0: ", "hand 0: coupling "
struct Where {
  char text[64];
  Where(const char* what, std::size_t i, const char* part = "") {
    std::snprintf(text, sizeof text, "%s %zu: %s", what, i, part);
  }
};

bool check_inertia(const h6BodyDef& b, std::size_t i, h6Error* error) {
  const double* v = b.inertia;
  bool given = false;
  for (int k = 0; k < 6; ++k) given = given || v[k] != 0;
  if (!given)
    return b.shell >= 0 || b.translation_only ||
           fail(error, "body %zu: a moving body without a shell needs an inertia", i);
  Mat3 I;
  I << v[0], v[3], v[4], v[3], v[1], v[5], v[4], v[5], v[2];
  if (Eigen::LLT<Mat3>(I).info() != Eigen::Success)
    return fail(error, "body %zu: its inertia is not positive definite", i);
  const Eigen::SelfAdjointEigenSolver<Mat3> axes(I, Eigen::EigenvaluesOnly);
  const double least = std::sqrt(axes.eigenvalues()[0] / b.mass),
               most = std::sqrt(axes.eigenvalues()[2] / b.mass);
  return (least >= kLeastGyration && most <= kMost) ||
         fail(error, H6_ERROR_RANGE,
              "body %zu: its inertia means radii of gyration of %g to %g m, not %g to %g", i, least,
              most, kLeastGyration, kMost);
}

bool check_body(const h6Model& model, h6BodyDef b, std::size_t i, h6Error* error) {
  if (b.fixed) {  // neither value is read
    b.mass = h6DefaultBodyDef().mass;
    for (double& v : b.inertia) v = 0;
  }
  const Where where("body", i);
  if (!check_reserved(b, where.text, error) ||
      !check_settings(body_settings(), &b, where.text, error))
    return false;
  if (!usable(b.pose, b.velocity) || !within(b.com))
    return fail(error, H6_ERROR_RANGE,
                "body %zu: its place, com or velocity is not within %g m and m/s", i, kMost);
  if (b.shell < -1 || b.shell >= static_cast<std::int64_t>(model.shell_count))
    return fail(error, "body %zu: shell %d, but the model has %zu", i, b.shell, model.shell_count);
  if (b.field < -1 || b.field >= static_cast<std::int64_t>(model.field_count))
    return fail(error, "body %zu: field %d, but the model has %zu", i, b.field, model.field_count);
  return b.fixed || check_inertia(b, i, error);
}

bool check_pair(const h6SessionDef& def, std::size_t i, h6Error* error) {
  const h6PairDef& p = def.pairs[i];
  const auto count = static_cast<std::int64_t>(def.body_count);
  if (!check_reserved(p, Where("pair", i).text, error)) return false;
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

bool check_pairs(const h6SessionDef& def, h6Error* error) {
  if (def.pair_count && !def.pairs) return fail(error, "pairs are counted but not given");
  // A pair is listed once, so more of them cannot be; nothing is read behind the last that can.
  const std::size_t most = std::min<std::size_t>(UINT32_MAX, def.body_count * (def.body_count - 1));
  if (def.pair_count > most)
    return fail(error, "%zu pairs are too many: %zu bodies have at most %zu pairs", def.pair_count,
                def.body_count, most);
  for (std::size_t i = 0; i < def.pair_count; ++i)
    if (!check_pair(def, i, error)) return false;
  sched::HostVector<std::size_t> order(def.pair_count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto key = [&](std::size_t i) {
    return std::tuple(def.pairs[i].shell_body, def.pairs[i].field_body, i);
  };
  std::sort(order.begin(), order.end(),
            [&](std::size_t l, std::size_t r) { return key(l) < key(r); });
  for (std::size_t i = 1; i < order.size(); ++i) {
    const h6PairDef &p = def.pairs[order[i - 1]], &q = def.pairs[order[i]];
    if (p.shell_body == q.shell_body && p.field_body == q.field_body)
      return fail(error, "pair %zu is listed before", order[i]);
  }
  return true;
}

bool check_coupling(const h6HandDef& h, std::size_t i, h6Error* error) {
  h6CouplingDef c = h.coupling;
  if (c.max_force > 0) c.max_depth_voxels = 1;  // its value is not read then
  const Where where("hand", i, "coupling ");
  if (!check_reserved(c, where.text, error) ||
      !check_settings(coupling_settings(), &c, where.text, error))
    return false;
  if (c.mode != H6_COUPLING_DYNAMIC && h.mode != H6_IMPEDANCE)
    return fail(
        error,
        "hand %zu: %s coupling has no mass that a wrench could move; a hand in %s mode needs "
        "the dynamic coupling",
        i, c.mode == H6_COUPLING_STATIC ? "static" : "direct",
        h.mode == H6_ADMITTANCE ? "admittance" : "pseudo-admittance");
  return true;
}

// Several dynamic couplings can pull on one body. A static or direct one sets the body's pose, so
// it must be the only one.
bool check_other_hands(const h6SessionDef& def, std::size_t i, h6Error* error) {
  const auto alone = [](const h6HandDef& h) { return h.coupling.mode != H6_COUPLING_DYNAMIC; };
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
  const h6SafetyDef& s = h.safety;
  const Where where("hand", i);
  if (!check_reserved(h, where.text, error) || !check_reserved(h.filter, where.text, error) ||
      !check_reserved(s, where.text, error) ||
      !check_settings(hand_settings(), &h, where.text, error))
    return false;
  if (s.derate_speed > 0 && s.cut_speed > 0 && s.derate_speed > s.cut_speed)
    return fail(error, H6_ERROR_RANGE,
                "hand %zu: safety derate_speed, %g m/s, is above cut_speed, %g", i, s.derate_speed,
                s.cut_speed);
  return check_coupling(h, i, error) && check_other_hands(def, i, error);
}

}  // namespace

bool check_session(const h6Model& model, const h6SessionDef& def, h6Error* error) {
  if (def.body_count == 0 || !def.bodies || def.body_count > INT32_MAX)
    return fail(error, "a session needs 1 to %d bodies, it has %zu", INT32_MAX, def.body_count);
  if (def.hand_count > H6_MAX_HANDS || (def.hand_count && !def.hands))
    return fail(error, "a session has at most %d hands", H6_MAX_HANDS);
  if (!within(def.gravity, 1e4))
    return fail(error, H6_ERROR_RANGE, "gravity is not within 1e4 m/s^2");
  if (!check_reserved(def, "", error) || !check_settings(session_settings(), &def, "", error) ||
      !check_contact(def.contact, error))
    return false;
  if (def.workers && def.threads != 1)
    return fail(error, "a session of workers stays on one thread: threads is %u, not 1",
                def.threads);
  for (std::size_t i = 0; i < def.body_count; ++i)
    if (!check_body(model, def.bodies[i], i, error)) return false;
  if (!check_pairs(def, error)) return false;
  for (std::size_t i = 0; i < def.hand_count; ++i)
    if (!check_hand(def, i, error)) return false;
  return true;
}

}  // namespace h6
