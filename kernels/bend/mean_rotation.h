// SPDX-License-Identifier: Apache-2.0
// mean_rotation.h - the mean of the rotations from none up to the turn w, and its derivatives.
// Choi & Ko 2005, Eq. 11: with s = |w|^2
//     R~(w) u = int_0^1 exp(t [w]x) u dt = a u + b w x u + c (w.u) w
//     exp([w]x) n = (1 - b s) n + a w x n + b (w.n) w
//     a = sin|w| / |w|,   b = (1 - cos|w|) / s,   c = (1 - a) / s
// R~ is also the left Jacobian of the rotation: d exp([w]x) = [R~ dw]x exp([w]x).
#pragma once
#include <array>
#include <cmath>
#include <cstddef>

namespace h6::kernels {

// Below this s the powers of s are summed; above it the closed forms lose no digits.
inline constexpr double kSeriesEnd = 4;

// The coefficients of s^k in b (first: 2) and in c (first: 3).
template <std::size_t kTerms>
constexpr std::array<double, kTerms> rotation_series(int first) {
  std::array<double, kTerms> out{};
  double term = 1;
  for (int n = 2; n <= first; ++n) term /= n;
  for (std::size_t k = 0; k < kTerms; ++k) {
    out[k] = term;
    const int n = first + 2 * static_cast<int>(k);
    term /= -double(n + 1) * double(n + 2);
  }
  return out;
}

// a, b and c with their first and second derivatives by s.
struct MeanRotation {
  double a[3], b[3], c[3];
};

// The derivatives of a polynomial's value follow Horner's rule with it.
template <std::size_t kTerms>
void sum_series(const std::array<double, kTerms>& terms, double s, double out[3]) {
  out[0] = out[1] = out[2] = 0;
  for (std::size_t k = kTerms; k-- > 0;) {
    out[2] = out[2] * s + 2 * out[1];
    out[1] = out[1] * s + out[0];
    out[0] = out[0] * s + terms[k];
  }
}

inline MeanRotation mean_rotation(double s) {
  MeanRotation m;
  double(&a)[3] = m.a, (&b)[3] = m.b, (&c)[3] = m.c;
  if (s < kSeriesEnd) {
    sum_series(rotation_series<14>(2), s, b);
    sum_series(rotation_series<14>(3), s, c);
    a[0] = 1 - c[0] * s;
  } else {
    const double angle = std::sqrt(s);
    a[0] = std::sin(angle) / angle;
    b[0] = (1 - std::cos(angle)) / s, c[0] = (1 - a[0]) / s;
    b[1] = (a[0] - 2 * b[0]) / (2 * s), c[1] = (b[0] - 3 * c[0]) / (2 * s);
    b[2] = (0.5 * (c[0] - b[0]) - 4 * b[1]) / (2 * s), c[2] = (b[1] - 5 * c[1]) / (2 * s);
  }
  a[1] = 0.5 * (c[0] - b[0]), a[2] = 0.5 * (c[1] - b[1]);
  return m;
}

}  // namespace h6::kernels
