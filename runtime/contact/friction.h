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
//                     the field's gradient (kernels/contact/friction_rows.h). `firm` alone has
//                     them: Sec. 3, "Friction of a push that leans".
#pragma once
#include <cstddef>

#include "kernels/contact/friction_rows.h"
#include "runtime/base/math.h"
#include "runtime/contact/body.h"

namespace h6 {

// The friction between one shell body and one field body, from step to step.
struct FrictionSpring {
  bool holds = false;          // contacts carried load in the last step
  Mat3 Rb = Mat3::Identity();  // the field body's rotation in the last step
  Quat Q = Quat::Identity();   // the shell body's rotation and place against the field body's
  Vec3 X = Vec3::Zero();       // centre of mass, in that body's axes
  Vec6 q = Vec6::Zero();       // stretch: displacement about a's centre of mass, axes of b
  double energy = 0;           // what the spring may give back: an upper bound on its energy [J]
  Mat6 K = Mat6::Zero();       // of the last step, about a's centre of mass, world axes
  Vec6 f = Vec6::Zero();       // the wrench on a, likewise
  bool implicit = false;       // the step has the force of its end
  double damping = 0;          // and the damper of so many steps
  // H6_EXACT: f without damping, and how f changes as arms and normals turn with a.
  Vec6 elastic = Vec6::Zero();
  Mat6 turning = Mat6::Zero();
};

// A pair's contacts, in the plane and along lines; either may have none. T is float, or double in
// the test of the derivatives.
template <class T>
struct FrictionRows {
  kernels::FrictionRowsT<T> planes, lines;
  double total;  // sum of the loads: mu times the normal forces over k [m]
};

// Where contacts stick and where they slip.
struct FrictionLaw {
  double stiffness;  // k, of the whole spring [N/m]
  double limit;      // the sum of all loads: the stretch at which a contact slips [m]
};

// K for the stretch q, which is expected to become `ahead` by the end of the step.
template <class T>
void friction_stiffness(const FrictionRows<T>& rows, const FrictionLaw& law, const Vec6& q,
                        const Vec6& ahead, Mat6& K);
// How the wrench -K q changes as arms and normals turn with a: the terms that K leaves out. The
// secants s are those of friction_stiffness.
template <class T>
Mat6 friction_turning(const FrictionRows<T>& rows, const FrictionLaw& law, const Vec6& q,
                      const Vec6& ahead);

// `firm`: contacts whose push leans off the gradient, and so can make energy, have friction.
bool pushes_rub(const h6ContactDef& def);
// Whether any contact can rub: by the setting `friction`, or because its push leans.
bool contacts_rub(const h6ContactDef& def);
// How many rows each contact can have.
std::size_t rows_of_contact(const h6ContactDef& def);

inline constexpr std::size_t kRubSlice = 2048;  // contacts whose friction is summed at a time

// (max_contacts rows_of_contact), or null where no contact can rub.
struct FrictionScratch {
  float* load = nullptr;      // of each row, those in the plane first
  double* stretch = nullptr;  // likewise
  float* line[6] = {};        // of rows along a line: e and r
  // (slices of contacts)
  FrictionRows<float>* slice = nullptr;  // its rows, with the total of its own loads
  kernels::FrictionSums* sums = nullptr;
  Mat6* K = nullptr;
};

}  // namespace h6
