// SPDX-License-Identifier: Apache-2.0
// bridge.h - a plate that bends under a rigid ball, with modes and an internal force that are made
// up: smooth displacement fields, and the gradient of a potential that is a sum of squares.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "hapsix/hapsix.h"
#include "tests/support/analytic.h"

namespace h6::test {

struct BridgeArrays {
  static constexpr double kLength = 0.3, kWidth = 0.06, kThick = 0.01;  // along x, y, z [m]
  std::size_t r = 0;
  ShellArrays shell;
  std::vector<float> modes, normal_modes, turn_modes;
  std::vector<double> linear, quadratic, cubic;
  h6DeformableDef bend = h6DefaultDeformableDef();

  // A mode's displacement at p, and its derivatives by x and y (there are none by z).
  struct Wave {
    double size[3], wave, phase, shear;
    void at(double x, double y, double u[3], double dx[3], double dy[3]) const {
      const double s = std::sin(wave * x + phase), c = std::cos(wave * x + phase);
      for (int k = 0; k < 3; ++k) {
        u[k] = size[k] * s * (1 + shear * y);
        dx[k] = size[k] * wave * c * (1 + shear * y);
        dy[k] = size[k] * s * shear;
      }
    }
  };
  std::vector<Wave> wave;
  // The potential: 1/2 sum w_j^2 q_j^2 + 1/2 sum_m stiff_m (a_m.q + b_m (c_m.q)^2)^2.
  struct Square {
    double stiff, b;
    std::vector<double> a, c;
  };
  std::vector<double> frequency;  // w [rad/s]
  std::vector<Square> squares;

  // `warped`: with turns in place of normals, and the linear part of the force only.
  BridgeArrays(std::size_t points, std::size_t mode_count, bool with_normals = true,
               double alpha = 0, double beta = 0, bool warped = false)
      : r(mode_count) {
    std::mt19937_64 random(7);
    const auto uniform = [&](double low, double high) {
      return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
    };
    spread_points(points);
    for (std::size_t j = 0; j < r; ++j) {
      Wave w{{0.2 * uniform(-1, 1), 0.3 * uniform(-1, 1), uniform(0.5, 1.4)},
             M_PI / kLength * double(1 + j % 6),
             uniform(0, 3),
             j < 6 ? 0.0 : uniform(-12, 12)};
      wave.push_back(w);
      frequency.push_back(60.0 + 45.0 * double(j));
    }
    for (std::size_t m = 0; m < 3; ++m) {
      Square s{4e4, 20, {}, {}};
      for (std::size_t j = 0; j < r; ++j) {
        s.a.push_back(uniform(-0.3, 0.3));
        s.c.push_back(uniform(-1, 1) / double(1 + j));
      }
      squares.push_back(s);
    }
    fill_modes();
    fill_force();
    bend.mode_count = static_cast<std::uint32_t>(r);
    bend.modes = modes.data();
    bend.normal_modes = with_normals ? normal_modes.data() : nullptr;
    bend.alpha = alpha, bend.beta = beta;
    bend.linear = linear.data(), bend.quadratic = quadratic.data(), bend.cubic = cubic.data();
    if (!warped) return;
    bend.turn_modes = turn_modes.data();
    bend.normal_modes = nullptr, bend.quadratic = bend.cubic = nullptr;
  }
  BridgeArrays(const BridgeArrays&) = delete;

  h6ShellDef def() {
    h6ShellDef out = shell.def();
    out.deformable = &bend;
    return out;
  }
  double energy(const std::vector<double>& q, const std::vector<double>& v) const {
    double sum = 0;
    for (std::size_t j = 0; j < r; ++j)
      sum += 0.5 * (v[j] * v[j] + frequency[j] * frequency[j] * q[j] * q[j]);
    for (const Square& s : squares) {
      double a = 0, c = 0;
      for (std::size_t j = 0; j < r; ++j) a += s.a[j] * q[j], c += s.c[j] * q[j];
      const double e = a + s.b * c * c;
      sum += 0.5 * s.stiff * e * e;
    }
    return sum;
  }

 private:
  void spread_points(std::size_t points) {
    const double L = kLength, W = kWidth, T = kThick;
    const double area[3] = {L * W, L * T, W * T}, all = 2 * (area[0] + area[1] + area[2]);
    constexpr double g1 = 0.7548776662466927, g2 = 0.5698402909980532;  // a plastic sequence
    std::size_t left = points;
    for (int face = 0; face < 6; ++face) {
      const int kind = face / 2, axis = 2 - kind;
      const double side = face % 2 ? -1 : 1;
      const auto count =
          face == 5 ? left : static_cast<std::size_t>(double(points) * area[kind] / all);
      left -= count;
      for (std::size_t i = 0; i < count; ++i) {
        const double s = std::fmod(0.5 + g1 * double(i + 1), 1.0) - 0.5,
                     t = std::fmod(0.5 + g2 * double(i + 1), 1.0) - 0.5;
        double p[3], n[3] = {0, 0, 0};
        const double size[3] = {L, W, T};
        p[axis] = side * size[axis] / 2;
        p[(axis + 1) % 3] = s * size[(axis + 1) % 3];
        p[(axis + 2) % 3] = t * size[(axis + 2) % 3];
        n[axis] = -side;
        shell.add(p[0], p[1], p[2], n[0], n[1], n[2]);
      }
    }
  }
  void fill_modes() {
    for (std::size_t i = 0; i < shell.x.size(); ++i)
      for (std::size_t j = 0; j < r; ++j) {
        double u[3], dx[3], dy[3];
        wave[j].at(double(shell.x[i]), double(shell.y[i]), u, dx, dy);
        const double n[3] = {double(shell.nx[i]), double(shell.ny[i]), double(shell.nz[i])};
        double turn[3] = {0, 0, 0}, along = 0;  // -(grad u)^T n, without its part along n
        for (int k = 0; k < 3; ++k) turn[0] -= dx[k] * n[k], turn[1] -= dy[k] * n[k];
        for (int k = 0; k < 3; ++k) along += turn[k] * n[k];
        for (const double w : {dy[2], -dx[2], dx[1] - dy[0]}) turn_modes.push_back(float(0.5 * w));
        for (int k = 0; k < 3; ++k) {
          modes.push_back(float(u[k]));
          normal_modes.push_back(float(turn[k] - along * n[k]));
        }
      }
  }
  void fill_force() {
    const std::size_t two = r * (r + 1) / 2, three = r * (r + 1) * (r + 2) / 6;
    linear.assign(r * r, 0), quadratic.assign(r * two, 0), cubic.assign(r * three, 0);
    for (std::size_t i = 0; i < r; ++i) linear[i * r + i] = frequency[i] * frequency[i];
    for (const Square& s : squares)
      for (std::size_t i = 0; i < r; ++i) {
        // stiff (a.q + b (c.q)^2) (a_i + 2 b (c.q) c_i)
        std::size_t pair = i * two, triple = i * three;
        const double k = s.stiff, ai = s.a[i], ci = s.c[i];
        for (std::size_t j = 0; j < r; ++j) linear[i * r + j] += k * s.a[j] * ai;
        for (std::size_t j = 0; j < r; ++j)
          for (std::size_t l = j; l < r; ++l) {
            const double twice = j == l ? 1 : 2, cc = s.c[j] * s.c[l] * twice;
            const double ac = j == l ? s.a[j] * s.c[j] : s.a[j] * s.c[l] + s.a[l] * s.c[j];
            quadratic[pair++] += k * s.b * (cc * ai + 2 * ac * ci);
            for (std::size_t m = l; m < r; ++m) {
              const double many = j == l && l == m ? 1 : j == l || l == m ? 3 : 6;
              cubic[triple++] += 2 * k * s.b * s.b * ci * many * s.c[j] * s.c[l] * s.c[m];
            }
          }
      }
  }
};

// The bridge, fixed, and a ball with a field on top of it, which a hand presses down.
struct BallOnBridge {
  static constexpr double kVoxel = 1e-3;
  double radius;
  BridgeArrays bridge;
  FieldArrays field;
  Model model;
  std::array<h6BodyDef, 2> bodies{h6DefaultBodyDef(), h6DefaultBodyDef()};
  h6HandDef hand = h6DefaultHandDef();
  h6PairDef pair = h6DefaultPairDef();
  h6SessionDef def = h6DefaultSessionDef();
  h6Session* session = nullptr;

  static FieldArrays ball(double radius) {
    const int bricks = static_cast<int>(std::ceil((2 * radius / kVoxel + 10) / 8));
    const double low = -4 * kVoxel * bricks;
    return sample_analytic(
        [radius](double x, double y, double z) { return std::hypot(x, y, z) - radius; },
        {low, low, low}, kVoxel, bricks, bricks, bricks);
  }
  explicit BallOnBridge(std::size_t points = 6000, std::size_t modes = 8, double ball_radius = 0.02,
                        bool with_normals = true, double alpha = 0, double beta = 0,
                        bool warped = false)
      : radius(ball_radius),
        bridge(points, modes, with_normals, alpha, beta, warped),
        field(ball(ball_radius)),
        model({def_of(field)}, {bridge.def()}) {
    bodies[0].fixed = true, bodies[0].shell = 0;
    bodies[1].field = 0;
    bodies[1].mass = 0.1;
    for (int k = 0; k < 3; ++k) bodies[1].inertia[k] = 0.04 * radius * radius;
    bodies[1].pose = pose(0, 0, top());
    hand.body = 1;
    hand.safety.soft_start = 0;
    hand.coupling.max_force = 5;
    pair.shell_body = 0, pair.field_body = 1;
    def.bodies = bodies.data(), def.body_count = 2;
    def.hands = &hand, def.hand_count = 1;
    def.pairs = &pair, def.pair_count = 1;
  }
  ~BallOnBridge() { h6DestroySession(session); }
  BallOnBridge(const BallOnBridge&) = delete;
  // Where the ball's centre is when it just touches.
  double top() const { return BridgeArrays::kThick / 2 + radius; }
  h6Session* open(h6Error* error = nullptr) {
    h6DestroySession(session);
    return session = h6CreateSession(model.handle, &def, error);
  }
  // The hand comes from above, presses, and goes round on the bridge.
  h6DeviceSample sample(int frame) const {
    const double t = 1e-3 * frame;
    return hand_at(pose(0.05 * std::sin(3 * t), 0.01 * std::sin(5 * t),
                        top() - std::min(0.02 * t, 4e-3) + 1e-3));
  }
  std::vector<double> q() const { return coordinates(true); }
  std::vector<double> v() const { return coordinates(false); }

 private:
  std::vector<double> coordinates(bool place) const {
    std::vector<double> out(bridge.r);
    h6GetDeformation(session, 0, place ? out.data() : nullptr, place ? nullptr : out.data(),
                     out.size());
    return out;
  }
};

}  // namespace h6::test
