// SPDX-License-Identifier: Apache-2.0
// friction.h - Coulomb friction with stiction: one 6-D spring between a shell and a field, cut
// contact by contact at mu times the normal load. METHOD.md, Sec. 9.
//
// With l a contact's normal force over k times its mu, and W the sum of all l of the pair, a
// displacement q = (d, theta) stretches the contact by z = P (d + theta x r) and
//     f = -K (q + beta u),   K = sum s J_t^T J_t,   J_t = P [I, -[r]x]
//     s = k l / W  while the contact sticks;  k l / |z|  beyond |z| = W
// so that no contact's friction exceeds k l. There are two kinds of rows:
//     in the plane    P = I - n n^T, n the direction of the push; mu is the setting
//     along a line    P = e e^T, only where e.(d + theta x r) > 0; mu is the lean of the push off
//                     the field's gradient (kernels/contact/contact_columns.h). `firm` alone has
//                     them: Sec. 3, "Friction of a push that leans".
#pragma once
#include <cstddef>

#include "runtime/base/math.h"
#include "runtime/contact/body.h"

namespace h6 {

// The friction between one shell body and one field body, from step to step.
struct FrictionSpring {
  bool holds = false;           // contacts carried load in the last step
  Mat3 Rb = Mat3::Identity();   // the field body's rotation in the last step
  Mat3 Q = Mat3::Identity();    // the shell body's rotation and place against the field body's
  Vec3 X = Vec3::Zero();        // centre of mass, in that body's axes
  Vec6 q = Vec6::Zero();        // stretch: displacement about a's centre of mass, axes of b
  double energy = 0;            // what the spring may give back: an upper bound on its energy [J]
  Mat6 K = Mat6::Zero();        // of the last step, about a's centre of mass, world axes
  Vec6 f = Vec6::Zero();        // the wrench on a, likewise
  Vec6 elastic = Vec6::Zero();  // of f, without damping
  bool implicit = false;        // the step has the force of its end
  double damping = 0;           // and the damper of so many steps
  Mat6 turning = Mat6::Zero();  // H6_EXACT: how f changes as arms and normals turn with a
};

// A pair's contacts, those in the plane first. T is float, or double in the test of the
// derivatives.
template <class T>
struct FrictionRows {
  const T *nx, *ny, *nz;  // unit: direction n of the push, or the line e
  const T *rx, *ry, *rz;  // arm from a's centre of mass [m]
  const double* load;     // most friction over k: mu times the normal force over k, > 0 [m]
  std::size_t count;
  double total;        // sum of the loads [m]
  std::size_t planes;  // rows in the plane; the others are along a line
};

// Where contacts stick and where they slip.
struct FrictionLaw {
  double stiffness;  // k, of the whole spring [N/m]
  double limit;      // the sum of all loads: the stretch at which a contact slips [m]
};

// K for the stretch q, which is expected to become `ahead` by the end of the step.
template <class T>
Mat6 friction_stiffness(const FrictionRows<T>& rows, const FrictionLaw& law, const Vec6& q,
                        const Vec6& ahead);
// How the wrench -K q changes as arms and normals turn with a: the terms that K leaves out. The
// secants s are those of friction_stiffness.
template <class T>
Mat6 friction_turning(const FrictionRows<T>& rows, const FrictionLaw& law, const Vec6& q,
                      const Vec6& ahead);
// The share, 0 .. 1, of its stretch that a spring keeps. `stretch`: of each row [m].
template <class T>
double friction_yield(const FrictionRows<T>& rows, const FrictionLaw& law, const double* stretch);

// `firm`: contacts whose push leans off the gradient, and so can make energy, have friction.
bool pushes_rub(const h6ContactDef& def);
// Whether any contact can rub: by the setting `friction`, or because its push leans.
bool contacts_rub(const h6ContactDef& def);
// How many rows each contact can have.
std::size_t rows_of_contact(const h6ContactDef& def);

// (max_contacts rows_of_contact), or null where no contact can rub.
struct FrictionScratch {
  double *load = nullptr, *stretch = nullptr;
  float *lean = nullptr, *row[6] = {};  // of the rows that rub: n and r
};

}  // namespace h6
