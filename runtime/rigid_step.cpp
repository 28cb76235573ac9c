// rigid_step.cpp - one time step of the moving bodies.
//
// Implicit (METHOD.md, Sec. 2; Barbic & James 2008):
//     (M - h D - h^2 K) du = h (f + h K u - [0; w x I w]),   x += h v,   R = exp(h w) R
// Bodies that may touch one another are one dense system when there are at most four of them.
#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "runtime/stages.h"

namespace h6 {
namespace {

template <int Bodies>
using Matrix = Eigen::Matrix<double, 6 * Bodies, 6 * Bodies>;
template <int Bodies>
using Vector = Eigen::Matrix<double, 6 * Bodies, 1>;

Mat6 mass_matrix(const Body& body) {
  Mat6 m = Mat6::Zero();
  m.topLeftCorner<3, 3>() = body.mass * Mat3::Identity();
  m.bottomRightCorner<3, 3>() = body.R * body.inertia * body.R.transpose();
  return m;
}

Vec6 velocity(const Body& body) {
  Vec6 u;
  u << body.v, body.w;
  return u;
}

// Wrench less the gyroscopic torque.
Vec6 driving(const Body& body) {
  Vec6 f = body.f;
  const Vec3 momentum = body.R * (body.inertia * (body.R.transpose() * body.w));
  f.tail<3>() -= body.w.cross(momentum);
  return f;
}

void move(Body& body, const Vec6& du, double h) {
  body.v += du.head<3>();
  body.w += du.tail<3>();
  body.x += h * body.v;
  body.q = (exp_rotation(h * body.w) * body.q).normalized();
  body.R = body.q.toRotationMatrix();
}

bool sane(const Body& body) {
  return body.x.allFinite() && body.v.allFinite() && body.w.allFinite() &&
         body.q.coeffs().allFinite();
}

// A step that leaves the numbers is taken back: the body rests where it was, and the frame says so.
void move_or_rest(h6Session& s, Body& body, const Vec6& du) {
  const Body before = body;
  move(body, du, s.dt);
  if (sane(body)) return;
  body = before;
  body.v.setZero();
  body.w.setZero();
  if (!sane(body)) {
    body.x.setZero();
    body.q.setIdentity();
    body.R.setIdentity();
  }
  s.report.status |= H6_STATE_NOT_FINITE;
}

Vec6 explicit_change(const h6Session& s, const Body& body) {
  const Vec6 f = s.dt * driving(body);
  Vec6 du;
  du.head<3>() = f.head<3>() / body.mass;
  du.tail<3>() = body.R * body.inertia.inverse() * (body.R.transpose() * f.tail<3>());
  return du;
}

int place_in(const Island& island, std::int32_t body) {
  for (int i = 0; i < island.count; ++i)
    if (island.body[i] == body) return i;
  return -1;
}

// `series`: field bodies that one shell body touches feel one another.
template <int N>
void add_between_fields(const h6Session& s, const Island& island, Matrix<N>& K, Matrix<N>& D) {
  for (std::size_t first = 0, end; first < s.pair_count; first = end) {
    end = pairs_of_shell(s, first);
    if (place_in(island, s.pairs[first].a) < 0) continue;
    for (std::size_t p = first; p < end; ++p)
      for (std::size_t q = first; q < end; ++q) {
        const int b = place_in(island, s.pairs[p].b), other = place_in(island, s.pairs[q].b);
        if (p == q || b < 0 || other < 0) continue;
        K.template block<6, 6>(6 * b, 6 * other) += s.pairs[p].left * s.pairs[q].right;
        D.template block<6, 6>(6 * b, 6 * other) +=
            s.contact.damping * s.pairs[p].left * s.pairs[q].right_d;
      }
  }
}

// The island's system. With one body it is that body's own 6x6 one, whatever it touches.
template <int N>
bool solve(const h6Session& s, const Island& island, Vector<N>& du) {
  const double h = s.dt;
  Matrix<N> K = Matrix<N>::Zero(), D = Matrix<N>::Zero(), M = Matrix<N>::Zero();
  Vector<N> u, f;
  for (int i = 0; i < N; ++i) {
    const Body& body = s.bodies[island.body[i]];
    M.template block<6, 6>(6 * i, 6 * i) = mass_matrix(body);
    K.template block<6, 6>(6 * i, 6 * i) = body.K;
    D.template block<6, 6>(6 * i, 6 * i) = body.D;
    u.template segment<6>(6 * i) = velocity(body);
    f.template segment<6>(6 * i) = driving(body);
  }
  if constexpr (N > 1) {
    for (std::size_t p = 0; p < s.pair_count; ++p) {
      const int a = place_in(island, s.pairs[p].a), b = place_in(island, s.pairs[p].b);
      if (a < 0 || b < 0) continue;
      K.template block<6, 6>(6 * a, 6 * b) += s.pairs[p].Kab;
      K.template block<6, 6>(6 * b, 6 * a) += s.pairs[p].Kba;
      D.template block<6, 6>(6 * a, 6 * b) += s.pairs[p].Dab;
      D.template block<6, 6>(6 * b, 6 * a) += s.pairs[p].Dba;
    }
    if (s.contact.method == H6_METHOD_SERIES) add_between_fields<N>(s, island, K, D);
  }
  const Matrix<N> A = M - h * D - h * h * K;
  const Vector<N> rhs = h * (f + h * (K * u));
  if (s.gradient == H6_EXACT) {
    du = A.partialPivLu().solve(rhs);
  } else {
    const Eigen::LDLT<Matrix<N>> factors(A);
    if (factors.info() != Eigen::Success || !factors.isPositive()) return false;
    du = factors.solve(rhs);
  }
  return du.allFinite();
}

template <int N>
void step_island(h6Session& s, const Island& island) {
  Vector<N> du;
  if (s.integrator == H6_IMPLICIT && solve<N>(s, island, du)) {
    for (int i = 0; i < N; ++i)
      move_or_rest(s, s.bodies[island.body[i]], du.template segment<6>(6 * i));
    return;
  }
  if (s.integrator == H6_IMPLICIT) s.report.status |= H6_SOLVE_FAILED;
  for (int i = 0; i < N; ++i) {
    Body& body = s.bodies[island.body[i]];
    move_or_rest(s, body, explicit_change(s, body));
  }
}

}  // namespace

void step_bodies(h6Session& s) {
  for (std::size_t i = 0; i < s.island_count; ++i) {
    const Island& island = s.islands[i];
    switch (island.count) {
      case 1:
        step_island<1>(s, island);
        break;
      case 2:
        step_island<2>(s, island);
        break;
      case 3:
        step_island<3>(s, island);
        break;
      case 4:
        step_island<4>(s, island);
        break;
    }
  }
}

}  // namespace h6
