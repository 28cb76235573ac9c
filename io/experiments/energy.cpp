// SPDX-License-Identifier: Apache-2.0
// energy.cpp - the net work of a closed cycle, and whether a bounce gains energy.
#include <algorithm>
#include <cmath>

#include "io/experiments/probe.h"

namespace h6::cli {
namespace {

// The box goes down tilted, turns flat while it is down, and goes up flat (or the other way round).
// Returns the contacts' net work over this closed cycle, divided by the greatest work done against
// them on the way.
double cycle_work(const io::LoadedScene& loaded, const MethodColumn& method, bool reverse) {
  Probe probe(loaded, method);
  if (!probe) return 0;
  constexpr int kSteps = 3000;
  double work = 0, stored = 0;
  h6Wrench last{};
  h6Vec3 last_p{}, last_turn{};
  for (int i = 0; i <= kSteps; ++i) {
    const double u =
        reverse ? 1 - static_cast<double>(i) / kSteps : static_cast<double>(i) / kSteps;
    double z = 4.6, tilt = 0;
    if (u < 1.0 / 3)
      z = 5.8 - 3.6 * u, tilt = 0.05;  // at 5.8 mm nothing touches, tilted or not
    else if (u < 2.0 / 3)
      tilt = 0.05 * (2 - 3 * u);
    else
      z = 4.6 + 3.6 * (u - 2.0 / 3);
    // One fixed axis, so angles add up.
    const h6Vec3 p = {0, 0, z * kMm}, turn = {0.5 * tilt, tilt, 0};
    const h6Wrench f = elastic_wrench(probe.at({p, turn_by(turn)}), kProbeStiffness);
    if (i > 0) {
      work += 0.5 * dot(f.force + last.force, p - last_p) +
              0.5 * dot(f.torque + last.torque, turn - last_turn);
      stored = std::max(stored, -work);
    }
    last = f, last_p = p, last_turn = turn;
  }
  return stored > 0 ? work / stored : 0;
}

// A tilted box falls 3 mm and bounces for 2 s. Returns its greatest energy over its initial energy.
double bounce_peak(const io::LoadedScene& loaded, const MethodColumn& method, double damping,
                   int integrator, bool passivity = false) {
  h6SessionDef def = loaded.session_def();
  method.apply(def.contact);
  def.contact.damping = damping;
  def.contact.passivity = passivity;
  // All methods get the same net stiffness on a flat wall, so the contacts of methods that do not
  // share the load get a share of it. The points are 1 mm apart, so each is its own cluster.
  if (method.method == "none" || method.method == "cluster") def.contact.stiffness /= 400;
  if (def.contact.method == H6_METHOD_GLOBAL) def.contact.stiffness /= def.contact.global_n0;
  def.integrator = static_cast<h6Integrator>(integrator);
  def.gravity = {0, 0, -9.8};
  const SessionPtr session(h6CreateSession(loaded.model.get(), &def, nullptr));
  if (!session) return 0;
  const h6BodyState start{{{0, 0, 8.3 * kMm}, turn_by({0.03, 0.06, 0})}, {}};
  h6SetBody(session.get(), 1, &start);
  const h6BodyDef& body = def.bodies[1];
  const double first = body.mass * 9.8 * (start.pose.p.z - 5 * kMm);
  double most = 0;
  for (int i = 0; i < 2000; ++i) {
    h6DeviceSample sample{};
    h6DeviceCommand command{};
    h6Step(session.get(), &sample, &command);
    const h6BodyState state = h6GetBody(session.get(), 1);
    const h6Vec3 w = rotate(conjugate(state.pose.q), state.velocity.angular);
    const double turning =
        body.inertia[0] * w.x * w.x + body.inertia[1] * w.y * w.y + body.inertia[2] * w.z * w.z;
    const double energy = 0.5 * body.mass * dot(state.velocity.linear, state.velocity.linear) +
                          0.5 * turning + body.mass * 9.8 * (state.pose.p.z - 5 * kMm);
    most = std::max(most, std::isfinite(energy) ? energy / first : 1e9);
  }
  return most;
}

}  // namespace

Study study_energy(const std::vector<MethodColumn>& columns, const Console& console) {
  Study out;
  out.title = "Energy";
  out.about =
      "A box with 400 points on a plane. Cycle: the net work of the contacts over a closed "
      "cycle (down tilted, flat, up; and reversed), relative to the peak of the stored work; "
      "prototype: ±0.14 to ±0.76 for all scaled methods. Bounce: a free box falls 3 mm and "
      "bounces for 2 s; the table gives its highest kinetic and potential energy relative to "
      "the energy at the start. Above 1 the contacts made energy. The passivity controller "
      "damps energy only after it has seen it, so it is at most a frame late. All methods have "
      "the same net stiffness on the flat (`none` and `cluster` k/400, `global` k/n0).";
  auto flat = io::load_scene(posed_scene("flat", plate(-40 * kMm, 40 * kMm), bottom(20, 20)));
  out.table = head("path", columns);
  if (!flat) return out;
  struct Row {
    const char* name;
    std::function<double(const MethodColumn&)> value;
  };
  const io::LoadedScene& s = **flat;
  const std::vector<Row> rows = {
      {"cycle", [&](const MethodColumn& m) { return cycle_work(s, m, false); }},
      {"cycle reversed", [&](const MethodColumn& m) { return cycle_work(s, m, true); }},
      {"bounce, explicit, undamped",
       [&](const MethodColumn& m) { return bounce_peak(s, m, 0, H6_EXPLICIT); }},
      {"bounce, explicit, undamped, passivity controller",
       [&](const MethodColumn& m) { return bounce_peak(s, m, 0, H6_EXPLICIT, true); }},
      {"bounce, explicit, 0.1 ms",
       [&](const MethodColumn& m) { return bounce_peak(s, m, 1e-4, H6_EXPLICIT); }},
      {"bounce, implicit, undamped",
       [&](const MethodColumn& m) { return bounce_peak(s, m, 0, H6_IMPLICIT); }},
      {"bounce, implicit, 1 ms",
       [&](const MethodColumn& m) { return bounce_peak(s, m, 1e-3, H6_IMPLICIT); }}};
  std::vector<double> found(rows.size() * columns.size(), 0);
  std::vector<std::function<void()>> jobs;
  for (std::size_t r = 0; r < rows.size(); ++r)
    for (std::size_t m = 0; m < columns.size(); ++m)
      jobs.push_back([&, r, m] { found[r * columns.size() + m] = rows[r].value(columns[m]); });
  run_jobs(jobs, console, "energy");
  for (std::size_t r = 0; r < rows.size(); ++r) {
    out.table.push_back({rows[r].name});
    for (std::size_t m = 0; m < columns.size(); ++m) {
      const double value = found[r * columns.size() + m];
      out.table.back().push_back(value > 1e3 ? "> 1000" : number(value, 3));
      out.json[rows[r].name][columns[m].name] = value;
    }
  }
  return out;
}

}  // namespace h6::cli
