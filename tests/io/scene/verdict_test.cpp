// SPDX-License-Identifier: Apache-2.0
// verdict_test.cpp - verdicts on runs whose motion is given by formulas.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "hapsix/vector.h"
#include "io/scene/verdict.h"

using namespace h6;
using namespace h6::io;

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kRate = 1000;

h6Quat about_z(double angle) { return {std::cos(angle / 2), 0, 0, std::sin(angle / 2)}; }
h6Pose at(double x, double y, double z) { return {{x, y, z}, {1, 0, 0, 0}}; }

// Points of a cube of 20 mm. Its centre of mass is at its centre.
std::vector<h6Vec3> cube() {
  std::vector<h6Vec3> out;
  for (int i = -1; i <= 1; ++i)
    for (int j = -1; j <= 1; ++j)
      for (int k = -1; k <= 1; ++k)
        if (i || j || k) out.push_back({i * 0.01, j * 0.01, k * 0.01});
  return out;
}

struct Moment {
  h6Pose hand = at(0, 0, 0);
  h6Velocity hand_velocity{};
  h6BodyState body{at(0, 0, 0), {}};
  double depth = 0.2;
  bool finite = true;
};

// The hand moves 10 mm along x in the first 0.2 s (50 mm/s) and then rests. The body follows it
// exactly.
Moment calm(double t) {
  Moment m;
  const double x = 0.05 * std::min(t, 0.2);
  m.hand = at(x, 0, 0);
  if (t < 0.2) m.hand_velocity.linear.x = 0.05;
  m.body = {m.hand, m.hand_velocity};
  return m;
}

Verdict judge(const SceneVerdict& rules, double duration, const std::function<Moment(double)>& run,
              std::vector<h6Vec3> points = cube(), h6Vec3 com = {0, 0, 0}, double rate = kRate) {
  VerdictWatch watch(rules, std::move(points), com, rate);
  const auto frames = static_cast<int>(std::lround(duration * rate));
  for (int i = 0; i < frames; ++i) {
    const double t = i / rate;
    const Moment m = run(t);
    watch.frame(t, m.hand, m.hand_velocity, m.body, m.depth, m.finite);
  }
  return watch.verdict();
}

Verdict judge(double duration, const std::function<Moment(double)>& run) {
  return judge({}, duration, run);
}

// From t = 0.2 s the body swings along y about its place, at 50 Hz and with this RMS speed [m/s].
Moment swinging(double t, double rms_speed) {
  Moment m = calm(t);
  const double w = 2 * kPi * 50, amplitude = rms_speed * std::sqrt(2.0) / w;
  if (t >= 0.2) m.body.pose.p.y = amplitude * std::sin(w * (t - 0.2));
  return m;
}

}  // namespace

TEST_CASE("every verdict has a name") {
  for (const Verdict v :
       {Verdict::unstable, Verdict::through, Verdict::chatters, Verdict::sunk, Verdict::arrived,
        Verdict::stuck, Verdict::untouched, Verdict::unheld, Verdict::held})
    CHECK(std::string(verdict_name(v)).size() >= 4);
  CHECK(std::string(verdict_name(Verdict::held)) == "held");
}

TEST_CASE("a body that follows its hand and rests is held") {
  CHECK(judge(0.6, calm) == Verdict::held);
}

TEST_CASE("a body that ends deeper than three voxels has sunk, and one that came back is held") {
  const auto deep = [](double from, double to) {
    return [=](double t) {
      Moment m = calm(t);
      if (from <= t && t < to) m.depth = 3.5;
      return m;
    };
  };
  CHECK(judge(0.6, deep(0.1, 1)) == Verdict::sunk);
  CHECK(judge(0.6, deep(0.1, 0.15)) == Verdict::held);
}

TEST_CASE("a run that never touched is untouched, but one with a target is judged by it") {
  const auto apart = [](double t) {
    Moment m = calm(t);
    m.depth = 0;
    return m;
  };
  CHECK(judge(0.6, apart) == Verdict::untouched);
  CHECK(judge(0, calm) == Verdict::untouched);
  SceneVerdict rules;
  rules.target = at(0, 0, 0);
  rules.tolerance = 1;
  CHECK(judge(rules, 0, calm) == Verdict::stuck);
}

TEST_CASE("a state that is not finite is unstable, whichever way it is told") {
  const auto nan_at = [](auto&& spoil) {
    return judge(0.4, [&](double t) {
      Moment m = calm(t);
      if (std::abs(t - 0.3) < 1e-9) spoil(m);
      return m;
    });
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(nan_at([](Moment& m) { m.finite = false; }) == Verdict::unstable);
  CHECK(nan_at([&](Moment& m) { m.body.pose.p.y = nan; }) == Verdict::unstable);
  CHECK(nan_at([&](Moment& m) { m.body.pose.q.w = nan; }) == Verdict::unstable);
  CHECK(nan_at([&](Moment& m) { m.body.velocity.angular.z = INFINITY; }) == Verdict::unstable);
  CHECK(nan_at([&](Moment& m) { m.depth = nan; }) == Verdict::unstable);
  // A bad hand sample does not make the body unstable.
  CHECK(nan_at([&](Moment& m) { m.hand.p.x = nan; }) == Verdict::held);
}

TEST_CASE("unstable begins at 100 times the hand's peak speed, wherever in the run that peak is") {
  const auto with_speed = [](double speed) {
    return judge(0.6, [=](double t) {
      Moment m = calm(t);
      if (t < 0.01) m.body.velocity.linear.y = speed;  // before the hand reaches its peak speed
      if (t < 0.1) m.hand_velocity = {};
      return m;
    });
  };
  CHECK(with_speed(4.9) == Verdict::held);
  CHECK(with_speed(5.1) == Verdict::unstable);
}

TEST_CASE("a body that flies half a metre to a hand at rest is not unstable for that") {
  const auto flies = [](double start) {
    return [start](double t) {  // critically damped, 20 rad/s
      Moment m;
      const double e = std::exp(-20 * t), x = start * (1 + 20 * t) * e;
      m.body = {at(x, 0, 0), {{-start * 400 * t * e, 0, 0}, {}}};
      m.depth = -1;
      return m;
    };
  };
  CHECK(judge(1.0, flies(0.5)) == Verdict::untouched);  // up to 3.7 m/s
  CHECK(judge(1.0, [&](double t) {
          Moment m = flies(0.5)(t);
          if (t > 0.3 && t < 0.31) m.body.velocity.linear.x = 51;
          return m;
        }) == Verdict::unstable);
}

TEST_CASE("spinning counts as speed") {
  // RMS distance of the cube's 26 points and centre from the z axis: sqrt(2 * 2/3) * 10 mm.
  const double arm = std::sqrt(36.0 / 27.0) * 0.01;
  const auto with_spin = [](double w) {
    return judge(0.6, [=](double t) {
      Moment m = calm(t);
      if (t < 0.01) m.body.velocity.angular.z = w;
      return m;
    });
  };
  CHECK(with_spin(4.9 / arm) == Verdict::held);
  CHECK(with_spin(5.1 / arm) == Verdict::unstable);
}

TEST_CASE("a hand at rest does not make slow settling unstable") {
  CHECK(judge(0.6, [](double t) {
          Moment m;
          m.body.velocity.linear.z = t < 0.01 ? 0.5 : 0;
          return m;
        }) == Verdict::held);
}

TEST_CASE("the first time and place in a forbidden box are kept") {
  SceneVerdict rules;
  rules.forbidden = {{{0.01449, -1, -1}, {1, 1, 1}}};  // points at x = 10 mm enter after 4.5 mm
  VerdictWatch watch(rules, cube(), {0, 0, 0}, kRate);
  for (int i = 0; i < 300; ++i) {
    const Moment m = calm(1e-3 * i);
    watch.frame(1e-3 * i, m.hand, m.hand_velocity, m.body, m.depth, m.finite);
    CHECK(watch.entry().has_value() == (i >= 90));
  }
  REQUIRE(watch.entry());
  CHECK(watch.entry()->time == doctest::Approx(0.09));
  CHECK(watch.entry()->place.x == doctest::Approx(0.0145));
}

TEST_CASE("one shell point in a forbidden box for one frame is through") {
  SceneVerdict rules;
  rules.forbidden.push_back({{0.0195, 0.009, 0.009}, {0.5, 0.5, 0.5}});
  // The motion `calm` ends with the body at x = 10 mm, so its corner is at 20 mm.
  CHECK(judge(rules, 0.6, calm) == Verdict::through);
  rules.forbidden[0].low.x = 0.0205;
  CHECK(judge(rules, 0.6, calm) == Verdict::held);
  const auto jump = [](double t) {
    Moment m = calm(t);
    if (std::abs(t - 0.3) < 1e-9) m.body.pose.p.x += 0.001;
    return m;
  };
  CHECK(judge(rules, 0.31, jump) == Verdict::through);
}

TEST_CASE("the centre of mass is watched too, and turned with the body") {
  SceneVerdict rules;
  rules.forbidden.push_back({{-0.001, 0.029, -0.001}, {0.001, 0.031, 0.001}});
  const h6Vec3 com = {0.03, 0, 0};
  const auto turned = [](double angle) {
    return [=](double) {
      Moment m;
      m.body.pose.q = about_z(angle);
      return m;
    };
  };
  CHECK(judge(rules, 0.1, turned(kPi / 2), cube(), com) == Verdict::through);
  CHECK(judge(rules, 0.1, turned(0), cube(), com) == Verdict::held);
}

TEST_CASE("among many points the one inside a small box is found, in every place of the shell") {
  std::vector<h6Vec3> points;
  for (int i = 0; i < 3000; ++i)
    points.push_back({0.05 * std::cos(2.4 * i), 0.05 * std::sin(2.4 * i), 1e-4 * i});
  for (const int i : {0, 1, 47, 48, 49, 1500, 2998, 2999}) {
    const h6Vec3 p = points[i];
    SceneVerdict rules;
    rules.forbidden.push_back(
        {{p.x - 1e-5, p.y - 1e-5, p.z - 1e-5}, {p.x + 1e-5, p.y + 1e-5, p.z + 1e-5}});
    const auto rest = [](double) { return Moment{}; };
    CHECK(judge(rules, 0.01, rest, points) == Verdict::through);
    points.erase(points.begin() + i);
    CHECK(judge(rules, 0.01, rest, points) == Verdict::held);
    points.insert(points.begin() + i, p);
  }
}

TEST_CASE("chatter begins at an RMS point speed of 2 mm/s") {
  CHECK(judge(0.6, [](double t) { return swinging(t, 1.9e-3); }) == Verdict::held);
  CHECK(judge(0.6, [](double t) { return swinging(t, 2.1e-3); }) == Verdict::chatters);
}

TEST_CASE("a steady slide is no chatter, but a swing about it is") {
  const auto sliding = [](double speed, double rms) {
    return judge(0.6, [=](double t) {
      Moment m = swinging(t, rms);
      if (t >= 0.2) m.body.pose.p.z = speed * (t - 0.2);
      return m;
    });
  };
  CHECK(sliding(10e-3, 1.9e-3) == Verdict::held);
  CHECK(sliding(10e-3, 2.1e-3) == Verdict::chatters);
  const auto turning = [](double t) {  // slowly about its own axis
    Moment m = calm(t);
    if (t >= 0.2) m.body.pose.q = about_z(0.3 * (t - 0.2));
    return m;
  };
  CHECK(judge(0.6, turning) == Verdict::held);
  VerdictWatch watch({}, cube(), {0, 0, 0}, kRate);
  for (int i = 0; i < 600; ++i) {
    const Moment m = turning(i / kRate);
    watch.frame(i / kRate, m.hand, m.hand_velocity, m.body, m.depth, m.finite);
  }
  CHECK(watch.slide() == doctest::Approx(0.3 * std::sqrt(36.0 / 27.0) * 0.01).epsilon(0.01));
}

TEST_CASE("turning to and fro chatters like moving") {
  const auto twist = [](double rms) {
    return judge(0.6, [=](double t) {
      Moment m = calm(t);
      const double arm = std::sqrt(36.0 / 27.0) * 0.01, w = 2 * kPi * 50;
      if (t >= 0.2) m.body.pose.q = about_z(rms * std::sqrt(2.0) / w / arm * std::sin(w * t));
      return m;
    });
  };
  CHECK(twist(1.9e-3) == Verdict::held);
  CHECK(twist(2.1e-3) == Verdict::chatters);
}

TEST_CASE("chatter begins at a peak-to-peak depth of 0.1 voxel, in a body that stands still") {
  const auto depth = [](double amplitude) {
    return judge(0.6, [=](double t) {
      Moment m = calm(t);
      m.depth = 0.3 + amplitude * std::sin(2 * kPi * 40 * t);
      return m;
    });
  };
  CHECK(depth(0.049) == Verdict::held);
  CHECK(depth(0.051) == Verdict::chatters);
}

TEST_CASE("a body that is still settling long before the end of a still phase does not chatter") {
  CHECK(judge(0.6, [](double t) { return swinging(t, t < 0.35 ? 10e-3 : 0); }) == Verdict::held);
}

TEST_CASE("a still phase is judged only when it has lasted 0.2 s") {
  CHECK(judge(0.39, [](double t) { return swinging(t, 10e-3); }) == Verdict::held);
  CHECK(judge(0.42, [](double t) { return swinging(t, 10e-3); }) == Verdict::chatters);
}

TEST_CASE("chatter in a still phase is not forgotten when the hand moves on") {
  CHECK(judge(1.5, [](double t) {
          Moment m = swinging(t, t < 0.6 ? 10e-3 : 0);
          m.hand.p.z = 0.05 * std::clamp(t - 0.6, 0.0, 0.2);
          return m;
        }) == Verdict::chatters);
}

TEST_CASE("a hand that sets out no longer rests, and its pull is no chatter") {
  // Its velocity comes a frame before its motion, and moves the body by 0.05 mm in that frame.
  const auto sets_out = [](double speed) {
    return judge(0.8, [=](double t) {
      Moment m = calm(t);
      if (t < 0.6 - 1e-9) return m;
      m.hand_velocity.linear.y = speed;
      m.body.pose.p.y = 0.05e-3 + 0.05 * (t - 0.6);
      m.hand.p.y = 0.05 * (t - 0.6);
      return m;
    });
  };
  CHECK(sets_out(0.05) == Verdict::held);
  CHECK(sets_out(0) == Verdict::chatters);  // a kick at rest
}

TEST_CASE("a hand that creeps is not still, one that trembles by micrometres is") {
  const auto hand_moves = [](auto&& z) {
    return judge(0.8, [&](double t) {
      Moment m = swinging(t, 10e-3);
      m.hand.p.z = z(t);
      return m;
    });
  };
  CHECK(hand_moves([](double t) { return 1e-3 * t; }) == Verdict::held);  // 1 mm/s
  CHECK(hand_moves([](double t) { return 5e-6 * std::sin(100 * t); }) == Verdict::chatters);
}

TEST_CASE("a turning hand is not still") {
  CHECK(judge(0.8, [](double t) {
          Moment m = swinging(t, 10e-3);
          m.hand.q = about_z(0.5 * t);
          return m;
        }) == Verdict::held);
}

TEST_CASE("the verdict is the same at other rates") {
  for (const double rate : {100.0, 333.0, 4000.0})
    for (const double speed : {1.8e-3, 2.2e-3}) {
      // The swing has 20 Hz, so that 100 frames a second still resolve it.
      const auto slow = [&](double t) {
        Moment m = calm(t);
        const double w = 2 * kPi * 10;
        if (t >= 0.2) m.body.pose.p.y = speed * std::sqrt(2.0) / w * std::sin(w * t);
        return m;
      };
      CHECK(judge({}, 0.7, slow, cube(), {0, 0, 0}, rate) ==
            (speed > 2e-3 ? Verdict::chatters : Verdict::held));
    }
}

TEST_CASE("a scene with a target ends arrived or stuck, by place and by angle") {
  SceneVerdict rules;
  rules.target = at(0.01, 0, 0);
  rules.target->q = about_z(0.1);
  rules.tolerance = 1e-3;
  CHECK(judge(rules, 0.6, calm) == Verdict::arrived);  // the rules accept any orientation
  rules.tolerance_angle = 0.09;
  CHECK(judge(rules, 0.6, calm) == Verdict::stuck);
  rules.tolerance_angle = 0.11;
  CHECK(judge(rules, 0.6, calm) == Verdict::arrived);
  rules.target->q = -rules.target->q;  // the same orientation
  CHECK(judge(rules, 0.6, calm) == Verdict::arrived);
  rules.target->p.y = 1.1e-3;
  CHECK(judge(rules, 0.6, calm) == Verdict::stuck);
}

TEST_CASE("verdicts stand in their order: unstable, through, chatters, then the target") {
  SceneVerdict rules;
  rules.target = at(0.01, 0, 0);
  rules.tolerance = 1e-3;
  rules.forbidden.push_back({{0.015, -1, -1}, {1, 1, 1}});
  const auto bad = [](double t) { return swinging(t, 10e-3); };
  const auto worse = [](double t) {
    Moment m = swinging(t, 10e-3);
    m.finite = t < 0.5;
    return m;
  };
  CHECK(judge(rules, 0.6, worse) == Verdict::unstable);
  CHECK(judge(rules, 0.6, bad) == Verdict::through);
  rules.forbidden.clear();
  CHECK(judge(rules, 0.6, bad) == Verdict::chatters);
  CHECK(judge(rules, 0.6, calm) == Verdict::arrived);
}
