// SPDX-License-Identifier: Apache-2.0
// bend_step.cpp - one time step of the modes of a body that bends, together with the rigid body
// that it touches. METHOD.md, Sec. 10; Barbic & James 2005 (implicit Newmark, one Newton step).
// Contacts push with the force of the step's end, so that both bodies get the same impulse.
//
// The modes move by dq = h (v + w/2), v' = v + w, the rigid body by h (u + du). What w adds to the
// wrench on the rigid body is linear in du, so it joins that body's own wrench and derivatives:
// every solver of rigid bodies then solves the coupled system, and w follows from du.
#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "kernels/bend/bend_sums.h"
#include "runtime/motion/motion_stages.h"

namespace h6 {
namespace {

// Of w, what stands still without the rigid body's answer, and how it follows du (or, quasi-static,
// the shift of the body).
using Right = Eigen::Matrix<double, Eigen::Dynamic, 7, Eigen::ColMajor, H6_MAX_MODES, 7>;

// (2/h + alpha) I + (beta + h/2) df/dq + h K + 2 D of the contacts, and the right-hand sides.
struct System {
  ModalMatrix A;
  Right b;
};

System system_of(const Settings& set, Deformation& d, const Vec6& u, bool rests) {
  const double h = set.dt;
  const Eigen::Index r = d.modes, padded = (r + 7) / 8 * 8;
  const Deformable& bend = d.shell->bend;
  kernels::reduced_force({bend.force.data, bend.modes, bend.linear}, d.q, d.internal, d.tangent);
  const Eigen::Map<const ModalVector> f(d.internal, r);
  const Eigen::Map<const ModalMatrix, 0, Eigen::OuterStride<>> K(d.tangent, r, r,
                                                                 Eigen::OuterStride<>(padded));
  const auto v = d.V();
  const ModalVector Kv = K.lazyProduct(v);
  System s;
  s.A = (bend.beta + 0.5 * h) * K;
  s.A.diagonal().array() += 2 / h + bend.alpha;
  s.b.setZero(r, 7);
  s.b.col(0) = -2 * (f + bend.alpha * v + bend.beta * Kv) - h * Kv;
  if (!d.touches) return s;
  const RowMatrix Kc = d.sums.K(), Dc = d.sums.D();
  s.A += h * Kc.bottomRightCorner(r, r) + 2 * Dc.bottomRightCorner(r, r);
  s.b.col(0) += 2 * ModalVector::Map(d.sums.force + 6, r);
  s.b.col(0) -= 2 * h * Kc.bottomRightCorner(r, r).lazyProduct(v);
  s.b.col(0) += 2 * h * Kc.bottomLeftCorner(r, 6).lazyProduct(u);
  s.b.rightCols<6>() = 2 * h * Kc.bottomLeftCorner(r, 6);
  if (rests)
    s.b.rightCols<6>() /= h;
  else
    s.b.rightCols<6>() += 2 * Dc.bottomLeftCorner(r, 6);
  return s;
}

bool solve(h6Gradient form, const System& s, Right& x) {
  if (form == H6_EXACT) {
    x = s.A.partialPivLu().solve(s.b);
  } else {
    const Eigen::LDLT<ModalMatrix> factors(s.A);
    if (factors.info() != Eigen::Success || !factors.isPositive()) return false;
    x = factors.solve(s.b);
  }
  return x.allFinite();
}

bool quasi_static(const Body& body) { return body.motion == Motion::quasi_static; }

}  // namespace

void fold_bends(const Settings& set, std::span<const Body> bodies, std::span<Deformation> bends,
                std::span<LinearWrench> acting, h6Status& status) {
  for (Deformation& d : bends) {
    const Body* const b = d.partner < 0 ? nullptr : &bodies[d.partner];
    const bool rests = b && quasi_static(*b);
    // Contacts see a quasi-static body at rest.
    const Vec6 u = b && !rests ? velocity(*b) : Vec6(Vec6::Zero());
    d.before = u;
    const System s = system_of(set, d, u, rests);
    Right x;
    if (!solve(set.gradient, s, x)) {
      status |= H6_SOLVE_FAILED;
      x.setZero(d.modes, 7);
    }
    Eigen::Map<ModalVector>(d.wait, d.modes) = x.col(0);
    d.answer.topRows(d.modes) = x.rightCols<6>();
    if (!d.touches || !b || b->fixed) continue;
    const RowMatrix K = d.sums.K(), D = d.sums.D();
    using Left = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, H6_MAX_MODES>;
    const Left left = 0.5 * set.dt * K.topRightCorner(6, d.modes) + D.topRightCorner(6, d.modes);
    LinearWrench& on_b = acting[d.partner];
    on_b.f += set.dt * K.topRightCorner(6, d.modes).lazyProduct(d.V()) + left.lazyProduct(x.col(0));
    const Mat6 more = left.lazyProduct(x.rightCols<6>());
    (rests ? on_b.K : on_b.D) += more;
  }
}

void accelerate_bends(const Settings& set, std::span<const Body> bodies,
                      std::span<Deformation> bends) {
  for (Deformation& d : bends) {
    Vec6 change = Vec6::Zero();
    if (d.touches && d.partner >= 0) {
      const Body& b = bodies[d.partner];
      if (quasi_static(b))
        change = set.dt * b.step_rate;
      else if (!b.fixed && b.motion == Motion::dynamic)
        change = velocity(b) - d.before;
    }
    for (int j = 0; j < d.modes; ++j) {
      const double w = d.wait[j] + d.answer.row(j).dot(change);
      d.next_v[j] = d.v[j] + w;
      d.step[j] = set.dt * (d.v[j] + 0.5 * w);
    }
  }
}

void move_bends(std::span<Deformation> bends, h6Status& status) {
  for (Deformation& d : bends) {
    for (int j = 0; j < d.modes; ++j) d.q[j] += d.step[j], d.v[j] = d.next_v[j];
    if (d.Q().allFinite() && d.V().allFinite() && d.Q().cwiseAbs().maxCoeff() <= kMost &&
        d.V().cwiseAbs().maxCoeff() <= kMost)
      continue;
    status |= H6_STATE_NOT_FINITE;
    d.Q().setZero();
    d.V().setZero();
  }
}

}  // namespace h6
