// SPDX-License-Identifier: Apache-2.0
// The contacts of a shell that bends: all of them, where they are, and their gradients.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "runtime/contact/deformation.h"
#include "runtime/frame/session.h"
#include "tests/support/bridge.h"

using namespace h6;
using namespace h6::test;

namespace {

double uniform(std::mt19937_64& random, double low, double high) {
  return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
}

Vec3 sum_of(const std::vector<float>& modes, const std::vector<double>& q, std::size_t i) {
  Vec3 out = Vec3::Zero();
  for (std::size_t j = 0; j < q.size(); ++j) {
    const float* u = modes.data() + (i * q.size() + j) * 3;
    out += q[j] * Vec3(u[0], u[1], u[2]);
  }
  return out;
}

// sum W^k u / (k + 1)!, the mean of the rotations exp(t W), t = 0 .. 1, and its derivative.
struct Warped {
  Vec3 value, slope;
};
Warped warp(const Vec3& w, const Vec3& u, const Vec3& dw, const Vec3& du) {
  Warped sum{u, du};
  Vec3 term = u, slope = du;
  for (int k = 1; k < 40 && term.norm() + slope.norm() > 1e-18; ++k) {
    slope = (dw.cross(term) + w.cross(slope)) / (k + 1);
    term = w.cross(term) / (k + 1);
    sum.value += term, sum.slope += slope;
  }
  return sum;
}

Vec3 bent_point(const BridgeArrays& b, const std::vector<double>& q, std::size_t i) {
  const Vec3 rest(b.shell.x[i], b.shell.y[i], b.shell.z[i]), u = sum_of(b.modes, q, i);
  if (!b.bend.turn_modes) return rest + u;
  return rest + warp(sum_of(b.turn_modes, q, i), u, Vec3::Zero(), Vec3::Zero()).value;
}
// How the point moves by q_j.
Vec3 bent_mode(const BridgeArrays& b, const std::vector<double>& q, std::size_t i, std::size_t j) {
  std::vector<double> one(q.size());
  one[j] = 1;
  const Vec3 u = sum_of(b.modes, one, i);
  if (!b.bend.turn_modes) return u;
  return warp(sum_of(b.turn_modes, q, i), sum_of(b.modes, q, i), sum_of(b.turn_modes, one, i), u)
      .slope;
}
Vec3 bent_normal(const BridgeArrays& b, const std::vector<double>& q, std::size_t i) {
  const Vec3 rest(b.shell.nx[i], b.shell.ny[i], b.shell.nz[i]);
  if (b.bend.turn_modes) return exp_rotation(sum_of(b.turn_modes, q, i)) * rest;
  return (rest + sum_of(b.normal_modes, q, i)).normalized();
}
// A place over the plate's middle layer as it is bent now.
Vec3 over_plate(const BridgeArrays& b, const std::vector<double>& q, const Vec3& at) {
  std::size_t nearest = 0;
  double least = HUGE_VAL;
  for (std::size_t i = 0; i < b.shell.x.size(); ++i) {
    const double d = std::hypot(double(b.shell.x[i]) - at[0], double(b.shell.y[i]) - at[1]);
    if (d < least && b.shell.nz[i] < -0.9f) least = d, nearest = i;
  }
  const Vec3 rest(b.shell.x[nearest], b.shell.y[nearest], b.shell.z[nearest]);
  return bent_point(b, q, nearest) + bent_normal(b, q, nearest) * (rest[2] - at[2]);
}

Quat any_turn(std::mt19937_64& random, double most) {
  return exp_rotation(Vec3(uniform(random, -most, most), uniform(random, -most, most),
                           uniform(random, -most, most)));
}

}  // namespace

namespace {

void compare_with_all_points(bool warped) {
  BallOnBridge scene(5000, 8, 0.02, true, 0, 0, warped);
  scene.def.max_substeps = 1;
  scene.def.hand_count = 0;
  scene.def.contact.fit = H6_FIT_TIGHT;
  // Warped shapes go farther.
  const double most = warped ? 1.2e-2 : 6e-3;
  std::size_t touching = 0, steps_with_contacts = 0;
  int round = 0;
  for (const h6Method method : {H6_METHOD_NONE, H6_METHOD_FIRM}) {
    CAPTURE(std::string(h6MethodName(method)));
    // `firm` smooths depths inside.
    const double near = method == H6_METHOD_FIRM ? 0.025 * BallOnBridge::kVoxel : 2e-6;
    scene.def.contact.method = method;
    h6Error error;
    REQUIRE_MESSAGE(scene.open(&error), error.message);
    std::mt19937_64 random(method + 1);
    std::vector<double> q(8), centre(3);
    Quat turn_a, turn_b;
    for (int k = 0; k < 1000; ++k, ++round) {
      // Every eighth pose is far from the last one; the others follow it, so that the search may
      // remember: by little, where single points are sampled, or by half a voxel.
      const double step = k % 3 ? 1e-5 : 5e-4;
      if (k % 8 == 0) {
        for (double& v : q) v = uniform(random, -most, most);
        turn_a = any_turn(random, 1), turn_b = any_turn(random, 3);
        centre = {uniform(random, -0.14, 0.14), uniform(random, -0.02, 0.02),
                  uniform(random, 0.015, 0.027)};
      } else {
        for (double& v : q) v += uniform(random, -step, step);
        for (double& v : centre) v += uniform(random, -step, step);
      }
      const Vec3 origin(0.02, -0.01, 0.03);
      const h6BodyState a{{to(origin), to(turn_a)}, {}};
      const Vec3 at = over_plate(scene.bridge, q, {centre[0], centre[1], centre[2]});
      const h6BodyState b{{to(Vec3(origin + turn_a * at)), to(turn_b)}, {}};
      h6SetBody(scene.session, 0, &a), h6SetBody(scene.session, 1, &b);
      REQUIRE(h6SetDeformation(scene.session, 0, q.data(), nullptr, q.size()));
      std::vector<double> points;
      for (std::size_t i = 0; i < 5000; ++i) {
        const Vec3 world = origin + turn_a * bent_point(scene.bridge, q, i);
        const Vec3 p = turn_b.conjugate() * (world - from(b.pose.p));
        points.insert(points.end(), {p[0], p[1], p[2]});
      }
      std::vector<double> distance(5000);
      REQUIRE(h6SampleField(scene.model.handle, 0, points.data(), 5000, distance.data(), nullptr,
                            nullptr) == 0);
      h6Step(scene.session, nullptr, nullptr);
      const h6Contacts c = h6GetContacts(scene.session, 0);
      std::set<std::uint32_t> found;
      for (std::size_t i = 0; i < c.count; ++i)
        if (c.depth[i] > 0) found.insert(c.point[i]);
      std::size_t wrong = 0;
      for (std::uint32_t i = 0; i < 5000; ++i)
        if (std::fabs(distance[i]) > 1e-6) wrong += (distance[i] < 0) != (found.count(i) > 0);
      CHECK(wrong == 0);
      touching += found.size();
      steps_with_contacts += !found.empty();
      for (std::size_t i = 0; i < c.count; i += 7) {
        CHECK(std::fabs(double(c.depth[i]) + distance[c.point[i]]) <
              (c.depth[i] > 0 ? near : 2e-6));
        // Arms are about the ball's centre of mass.
        const Vec3 p = from(b.pose.p) + Vec3(c.rx[i], c.ry[i], c.rz[i]);
        const Vec3 q_world = origin + turn_a * bent_point(scene.bridge, q, c.point[i]);
        CHECK((p - q_world).norm() < 1e-6);
      }
    }
  }
  CHECK(round == 2000);
  CHECK(steps_with_contacts > 1000);
  CHECK(touching > 20000);
}

}  // namespace

TEST_CASE("contacts of a bent shell are those of all points, in 2,000 seeded poses and shapes") {
  compare_with_all_points(false);
}
TEST_CASE("contacts of a warped shell are those of all points, in 2,000 seeded poses and shapes") {
  compare_with_all_points(true);
}

TEST_CASE("bent normals are the first derivative, given or from neighbours") {
  for (const bool given : {true, false}) {
    CAPTURE(given);
    BallOnBridge scene(20000, 8, 0.02, given);
    scene.def.max_substeps = 1, scene.def.hand_count = 0;
    scene.def.contact.method = H6_METHOD_NONE;
    scene.def.contact.fit = H6_FIT_TIGHT;
    REQUIRE(scene.open());
    std::mt19937_64 random(4);
    double worst = 0, mean = 0, turned = 0;
    std::size_t count = 0;
    for (int k = 0; k < 60; ++k) {
      std::vector<double> q(8);
      for (double& v : q) v = uniform(random, -4e-3, 4e-3);
      const double x = uniform(random, -0.1, 0.1);
      double lift = 0;
      for (std::size_t j = 0; j < 8; ++j) {
        double u[3], dx[3], dy[3];
        scene.bridge.wave[j].at(x, 0, u, dx, dy);
        lift += q[j] * u[2];
      }
      const h6BodyState b{pose(x, 0, scene.top() + lift - 1e-3), {}};
      h6SetBody(scene.session, 1, &b);
      h6SetDeformation(scene.session, 0, q.data(), nullptr, 8);
      h6Step(scene.session, nullptr, nullptr);
      const h6Contacts c = h6GetContacts(scene.session, 0);
      for (std::size_t i = 0; i < c.count; ++i) {
        const std::uint32_t p = c.point[i];
        const BridgeArrays& plate = scene.bridge;
        const Vec3 rest(plate.shell.nx[p], plate.shell.ny[p], plate.shell.nz[p]);
        const Vec3 n = bent_normal(plate, q, p);
        const double off = (n - Vec3(c.nx[i], c.ny[i], c.nz[i])).norm();
        worst = std::max(worst, off);
        mean += off, turned += (n - rest).norm(), ++count;
      }
    }
    REQUIRE(count > 1000);
    mean /= double(count), turned /= double(count);
    CHECK(turned > 0.1);
    CHECK(mean < (given ? 1e-6 : 0.005));
    CHECK(worst < (given ? 1e-6 : 0.06));
  }
}

namespace {

// The contacts of one step with their weights held: forces on the ball and on the modes, in double,
// as a function of where the ball is, how it moves, and of the modes. The ball's field is taken as
// the plane of each contact's distance, which the step's own depths fix.
struct Held {
  const BallOnBridge& scene;
  double k, beta;
  Quat turn;   // of the bridge
  Vec3 place;  // of its origin
  std::vector<std::uint32_t> point;
  std::vector<double> weight, depth;
  std::vector<Vec3> slope, start;  // of the field at the contact, in the ball's axes; its place
  std::vector<double> q0;

  struct State {
    Vec3 x;
    Quat q;
    Vec6 u;
    std::vector<double> modes, rates;
  };
  State at;

  Vec3 mode(const std::vector<double>& q, std::size_t i, std::size_t j) const {
    return turn * bent_mode(scene.bridge, q, point[i], j);
  }
  // On the ball: force and torque; then on the modes.
  Eigen::VectorXd forces(const State& s, bool damped) const {
    const std::size_t r = scene.bridge.r;
    Eigen::VectorXd out = Eigen::VectorXd::Zero(static_cast<int>(6 + r));
    for (std::size_t i = 0; i < point.size(); ++i) {
      const Vec3 p = place + turn * bent_point(scene.bridge, s.modes, point[i]);
      const Vec3 local = s.q.conjugate() * (p - s.x);
      const double d = depth[i] - slope[i].dot(local - start[i]);
      const Vec3 N = turn * bent_normal(scene.bridge, s.modes, point[i]), arm = p - s.x;
      Vec3 v = Vec3::Zero();
      for (std::size_t j = 0; j < r; ++j) v += s.rates[j] * mode(s.modes, i, j);
      v -= s.u.head<3>() + s.u.tail<3>().cross(arm);
      const double e = d - (damped ? beta * N.dot(v) : 0);
      const Vec3 F = k * weight[i] * e * N;
      out.head<3>() -= F;
      out.segment<3>(3) -= arm.cross(F);
      for (std::size_t j = 0; j < r; ++j)
        out[static_cast<int>(6 + j)] += F.dot(mode(s.modes, i, j));
    }
    return out;
  }
};

void compare_with_differences(bool warped) {
  BallOnBridge scene(20000, 8, 0.02, true, 0, 0, warped);
  scene.def.max_substeps = 1, scene.def.hand_count = 0;
  scene.def.contact.method = H6_METHOD_ROBUST;
  scene.def.contact.fit = H6_FIT_TIGHT;
  scene.def.gradient = H6_EXACT;
  scene.bodies[1].com = {6e-3, -4e-3, 5e-3};  // about its middle a ball feels no torque
  scene.bodies[0].pose = {{0.01, 0.02, -0.03}, to(exp_rotation({0.3, -0.2, 0.5}))};
  REQUIRE(scene.open());
  h6Session& s = *scene.session;
  const Quat turn = from(scene.bodies[0].pose.q);
  std::mt19937_64 random(3);
  std::vector<double> q(8), v(8);
  const double most = warped ? 1e-2 : 2e-3;
  for (double& x : q) x = uniform(random, -most, most);
  for (double& x : v) x = uniform(random, -2e-3, 2e-3);
  const Vec3 at = over_plate(scene.bridge, q, {0.03, 0.01, scene.top() - 2e-3});
  const Quat ball_turn = exp_rotation({-0.4, 0.9, 0.2});
  const h6BodyState b{{to(Vec3(from(scene.bodies[0].pose.p) + turn * at)), to(ball_turn)},
                      {{2e-3, -1e-3, 3e-3}, {0.05, -0.02, 0.03}}};
  h6SetBody(scene.session, 1, &b);
  h6SetDeformation(scene.session, 0, q.data(), v.data(), 8);
  h6Step(scene.session, nullptr, nullptr);
  const Deformation& d = s.bends[0];
  const Contacts& c = s.shells[0].contacts;
  REQUIRE(d.touches);
  REQUIRE(c.count > 50);

  Held held{scene,
            s.settings.contact.stiffness,
            s.settings.contact.damping,
            turn,
            from(scene.bodies[0].pose.p),
            {},
            {},
            {},
            {},
            {},
            q,
            {}};
  held.at = {from(b.pose.p) + ball_turn * from(scene.bodies[1].com), ball_turn, Vec6::Zero(), q, v};
  held.at.u << from(b.velocity.linear), from(b.velocity.angular);
  for (std::size_t i = 0; i < c.count; ++i) {
    if (!(d.share[i] > 0)) continue;
    held.point.push_back(c.point[i]);
    held.weight.push_back(double{d.share[i]} / held.k);
    held.depth.push_back(double{c.depth[i]});
    held.slope.push_back(ball_turn.conjugate() * Vec3(c.gx[i], c.gy[i], c.gz[i]));
    const Vec3 p = held.place + turn * bent_point(scene.bridge, q, c.point[i]);
    held.start.push_back(ball_turn.conjugate() * (p - held.at.x));
  }
  const Eigen::VectorXd f = held.forces(held.at, true), elastic = held.forces(held.at, false);
  Eigen::VectorXd mine = Eigen::Map<const Eigen::VectorXd>(d.sums.force, 14);
  mine.head<6>() = -mine.head<6>();
  CHECK((mine - f).norm() < 1e-6 * f.norm());

  // By rows and columns: force, torque, modes.
  using Move = std::function<Held::State(int, double)>;
  const auto derivative = [&](int columns, double step, bool damped, const Move& move) {
    Eigen::MatrixXd out(14, columns);
    for (int i = 0; i < columns; ++i) {
      const auto f_at = [&](double h) { return held.forces(move(i, h * step), damped); };
      out.col(i) = (8 * (f_at(1) - f_at(-1)) - (f_at(2) - f_at(-2))) / (12 * step);
    }
    return out;
  };
  const auto moved = [&](int i, double h) {
    Held::State state = held.at;
    if (i < 3)
      state.x[i] += h;
    else if (i < 6)
      state.q = exp_rotation(100 * h * Vec3::Unit(i - 3)) * state.q;
    else
      state.modes[static_cast<std::size_t>(i - 6)] += h;
    return state;
  };
  const auto faster = [&](int i, double h) {
    Held::State state = held.at;
    if (i < 6)
      state.u[i] += h;
    else
      state.rates[static_cast<std::size_t>(i - 6)] += h;
    return state;
  };
  Eigen::MatrixXd K = derivative(14, 1e-6, false, moved), D = derivative(14, 1e-4, true, faster);
  K.middleCols(3, 3) /= 100;
  // The engine's: by the motion of ball and modes, from sums by the relative motion.
  const auto own = [](const RowMatrix& sums) {
    Eigen::MatrixXd m = sums;
    m.topLeftCorner(6, 6) = -m.topLeftCorner(6, 6).eval();
    m.bottomRightCorner(8, 8) = -m.bottomRightCorner(8, 8).eval();
    return m;
  };
  Eigen::MatrixXd my_K = own(d.sums.K());
  const Eigen::MatrixXd my_D = own(d.sums.D());
  my_K.block(3, 0, 3, 3) += cross_matrix(elastic.head<3>());  // of the force on the ball
  const int at_row[4] = {0, 3, 6, 14};
  for (int r = 0; r < 3; ++r)
    for (int col = 0; col < 3; ++col) {
      CAPTURE(r);
      CAPTURE(col);
      const auto block = [&](const Eigen::MatrixXd& m) {
        return Eigen::MatrixXd(m.block(at_row[r], at_row[col], at_row[r + 1] - at_row[r],
                                       at_row[col + 1] - at_row[col]));
      };
      CHECK((block(my_K) - block(K)).norm() <= 1e-6 * block(K).norm());
      CHECK((block(my_D) - block(D)).norm() <= 1e-6 * block(D).norm());
    }
}

}  // namespace

TEST_CASE("gradients of ball and modes together are derivatives of all forces, to 1e-6") {
  compare_with_differences(false);
}
TEST_CASE("gradients on a warped shell are derivatives of all forces too, to 1e-6") {
  compare_with_differences(true);
}

TEST_CASE("turns of zero leave points, depths and arms as they are without turns, to the bit") {
  struct Seen {
    std::vector<float> depth, rx, nx;
    std::vector<std::uint32_t> point;
  };
  const auto look = [](bool warped) {
    BallOnBridge scene(5000, 8, 0.02, true, 0, 0, warped);
    BridgeArrays& plate = scene.bridge;
    std::fill(plate.turn_modes.begin(), plate.turn_modes.end(), 0.0f);
    std::fill(plate.normal_modes.begin(), plate.normal_modes.end(), 0.0f);
    plate.bend.quadratic = plate.bend.cubic = nullptr;
    const Model model({def_of(scene.field)}, {plate.def()});
    scene.def.max_substeps = 1, scene.def.hand_count = 0;
    scene.bodies[1].pose.p.z -= 1e-3;
    h6Session* session = h6CreateSession(model.handle, &scene.def, nullptr);
    REQUIRE(session);
    const double q[8] = {1e-3, -2e-3, 1e-3, 5e-4, -1e-4, 3e-4, 1e-4, -2e-4};
    h6SetDeformation(session, 0, q, nullptr, 8);
    h6Step(session, nullptr, nullptr);
    const h6Contacts c = h6GetContacts(session, 0);
    Seen seen;
    for (std::size_t i = 0; i < c.count; ++i)
      if (c.depth[i] > 0) {
        seen.depth.push_back(c.depth[i]), seen.rx.push_back(c.rx[i]);
        seen.nx.push_back(c.nx[i]), seen.point.push_back(c.point[i]);
      }
    h6DestroySession(session);
    return seen;
  };
  const Seen with = look(true), without = look(false);
  CHECK(with.point.size() > 10);
  CHECK(with.point == without.point);
  CHECK(with.depth == without.depth);
  CHECK(with.rx == without.rx);
  CHECK(with.nx == without.nx);
}
