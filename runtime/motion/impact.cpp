// SPDX-License-Identifier: Apache-2.0
// impact.cpp - stops a body that strikes a field faster than its contacts' springs can stop it.
// METHOD.md, Sec. 8.
#include <cmath>

#include "runtime/contact/contact_stages.h"
#include "runtime/motion/motion_stages.h"

namespace h6 {
namespace {

// A contact is an impact where the body, undamped, would sink in deeper than this by its inertia.
constexpr double kInertiaDepth = 0.1;  // [voxel]
// In one step an impact leaves 1/(1 + this) of the speed.
constexpr double kStrength = 16;

double free_mass(const Body& body) {
  return !body.fixed && body.motion == Motion::dynamic ? body.mass : HUGE_VAL;
}

// The mean of J J^T over the pair's contacts that approach faster than `slow` [m/s]. False when
// there are none. Shares of stiffness do not enter: that of a new contact can be zero.
bool strikes(const Contacts& c, const Pair& pair, const Vec6& u, double slow, Mat6& B) {
  int count = 0;
  clear(B);
  for (std::size_t i = pair.begin; i < pair.end; ++i) {
    if (!(c.depth[i] > 0)) continue;
    const Vec3 N(c.nx[i], c.ny[i], c.nz[i]), r(c.rx[i], c.ry[i], c.rz[i]);
    const Vec3 v = u.head<3>() + u.tail<3>().cross(r);
    if (!(-N.dot(v) > slow)) continue;
    Vec6 J;
    J << N, r.cross(N);
    B.noalias() += J * J.transpose();
    ++count;
  }
  if (count) B /= count;
  return count > 0;
}

}  // namespace

void stop_impacts(const Settings& set, std::span<const Body> bodies,
                  std::span<const ShellBody> shells, std::span<LinearWrench> acting) {
  for (const ShellBody& shell : shells)
    for (const Pair& pair : shell.pairs) {
      // The modes of a body that bends would not feel this damper.
      if (pair.begin == pair.end || bodies[pair.a].bend) continue;
      const Sides sides = sides_of(pair, bodies, acting);
      const Body &a = sides.a, &b = sides.b;
      const double mass = std::min(free_mass(a), free_mass(b));
      if (!(mass < HUGE_VAL)) continue;
      const Vec6 u = pair_velocity(a, b);
      const double slow = kInertiaDepth * b.field->voxel * std::sqrt(set.contact.stiffness / mass);
      Mat6 B;
      if (!strikes(shell.contacts, pair, u, slow, B)) continue;
      B *= kStrength * mass / set.dt;
      const Vec6 f = -(B * u);
      const Mat6 S = arm_shift(a, b);
      if (!a.fixed) sides.on_a.f += f, sides.on_a.D -= B;
      if (!b.fixed) sides.on_b.f -= S * f, sides.on_b.D -= S * B * S.transpose();
      if (pair.between) {
        pair.between->Dab += B * S.transpose();
        pair.between->Dba += S * B;
      }
    }
}

}  // namespace h6
