// SPDX-License-Identifier: Apache-2.0
// contact_wrench.h - the wrench of weighted contacts and its derivatives, in one pass.
//
// With J = [N; r x N], J_g = [g; r x g] and relative velocity u = (v, omega) of shell against field
// at the shell body's centre of mass:
//     e_i  = depth_i - beta * J_i.u                     one-sided: e_i <= 0 leaves the contact out
//     f    = sum k w e J                                elastic force plus contact damping, no pull
//     f_el = sum k w depth J                            elastic part, over the same contacts
//     K    = sum k w J J_g^T     (exact)  or  sum k w J J^T  (symmetric)      -df/dq without the
//     B    = sum k w J J^T                                                     geometric term
// The damping gradient -df/du is beta * B. In symmetric form K = B and only B is summed.
// Xu & Barbic 2016, Eq. (1), (9); damping and one-sidedness are ours.
#pragma once
#include "kernels/views.h"

namespace h6::kernels {

template <class T>
struct WrenchColumnsT {
  const T* depth;         // penetration depth, > 0 inside           [m]
  const T* weight;        // share of the stiffness
  const T *nx, *ny, *nz;  // inward unit normal
  const T *gx, *gy, *gz;  // unit gradient of the field; not read in symmetric form
  const T *rx, *ry, *rz;  // arm from the centre of mass             [m]
  std::size_t count;
};
using WrenchColumns = WrenchColumnsT<float>;

// Sums in double of one slice of contacts; slices are added in index order.
struct WrenchSum {
  double force[6] = {};       // f
  double elastic[6] = {};     // f_el
  double stiffness[36] = {};  // K, row major; in symmetric form a copy of B
  double damping[36] = {};    // B, row major
  void add(const WrenchSum& other);
};

struct WrenchParameters {
  double stiffness;    // k                                        [N/m]
  double damping;      // beta                                     [s]
  double velocity[6];  // u = (v, omega)                           [m/s, rad/s]
  bool exact;
};

// The sum over contacts begin..end-1; overwrites `sum`.
void contact_wrench(const WrenchColumns& contacts, const WrenchParameters& parameters,
                    std::size_t begin, std::size_t end, WrenchSum& sum);
inline WrenchSum contact_wrench(const WrenchColumns& contacts, const WrenchParameters& parameters,
                                std::size_t begin, std::size_t end) {
  WrenchSum sum;
  contact_wrench(contacts, parameters, begin, end, sum);
  return sum;
}
// The specification, for float and (gradient tests) double columns.
template <class T>
WrenchSum contact_wrench_ref(const WrenchColumnsT<T>& contacts, const WrenchParameters& parameters,
                             std::size_t begin, std::size_t end);

}  // namespace h6::kernels
