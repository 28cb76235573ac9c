// SPDX-License-Identifier: Apache-2.0
#include "device/bad_operator.h"

#include <cmath>
#include <cstdio>
#include <limits>

#include "device/forward_arm.h"
#include "hapsix/vector.h"

namespace h6::device {
namespace {

constexpr double kPi = 3.14159265358979323846;

}  // namespace

const char* trouble_name(Trouble trouble) {
  static constexpr const char* names[kTroubles] = {"shake", "jerk", "freeze",
                                                   "nan",   "jump", "unplug"};
  return names[static_cast<std::size_t>(trouble)];
}

Result<BadOperator> BadOperator::open(const h6Device& hand, const BadOperatorFigures& f) {
  const bool good = f.every >= 1e-3 && f.every <= 1000 && f.shake >= 0 && f.shake <= 1 &&
                    f.jerk >= 0 && f.jerk <= 1 && f.jump >= 0 && f.jump <= 10;
  if (!good)
    return Failure{
        "a bad operator is in trouble every 0.001 to 1000 s, shakes and jerks by 0 to 1 m and "
        "jumps by 0 to 10 m"};
  if ((f.kinds & ((1u << kTroubles) - 1)) == 0)
    return Failure{"a bad operator needs at least one kind of trouble"};
  return BadOperator(hand, f);
}

BadOperator::BadOperator(const h6Device& hand, const BadOperatorFigures& figures)
    : hand_(hand), figures_(figures), state_(figures.seed) {
  last_.pose.q.w = 1;
  next_ = -figures_.every * std::log(random(1e-9, 1));
}

// splitmix64: the same everywhere, unlike the distributions of the standard library.
double BadOperator::random(double low, double high) {
  std::uint64_t z = state_ += 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  which_ = z ^= z >> 31;
  return low + (high - low) * static_cast<double>(z >> 11) * 0x1p-53;
}

h6Vec3 BadOperator::direction() {
  const double z = random(-1, 1), around = random(-kPi, kPi), r = std::sqrt(1 - z * z);
  return {r * std::cos(around), r * std::sin(around), z};
}

void BadOperator::begin(double time) {
  // Durations of each kind [s].
  static constexpr double shortest[kTroubles] = {0.2, 0.01, 0.005, 0.001, 0.001, 0.001};
  static constexpr double longest[kTroubles] = {1, 0.04, 0.4, 0.04, 0.2, 0.3};
  std::size_t kind;
  do kind = static_cast<std::size_t>(random(0, static_cast<double>(kTroubles)));
  while (kind >= kTroubles || !(figures_.kinds >> kind & 1));
  kind_ = static_cast<Trouble>(kind);
  now_ = true;
  begun_ = time;
  lasts_ = random(shortest[kind], longest[kind]);
  const double most = kind_ == Trouble::shake  ? figures_.shake
                      : kind_ == Trouble::jerk ? figures_.jerk
                                               : figures_.jump;
  // One draw a statement: the compiler chooses the order in which arguments are computed.
  const double far = random(0.1, 1) * most;
  way_ = far * direction();
  const double turned_by = random(0, kind_ == Trouble::jump ? kPi : 0.2);
  axis_ = turned_by * direction();
  pace_ = random(5, 15);
  (void)random(0, 1);  // which_
  ++times_[kind];
}

// Displaces a sample by `swing` times (way, axis); `rate` is the rate of change of swing [1/s].
namespace {
void displace(h6DeviceSample& s, const h6Vec3& way, const h6Vec3& axis, double swing, double rate) {
  s.pose.p = s.pose.p + swing * way;
  s.pose.q = turned(s.pose.q, swing * axis);
  s.velocity.linear = s.velocity.linear + rate * way;
  s.velocity.angular = s.velocity.angular + rate * axis;
}
}  // namespace

// A tremor that swells and fades.
void BadOperator::shake(double t, h6DeviceSample& s) const {
  const double w = 2 * kPi * pace_, e = kPi / lasts_;
  displace(s, way_, axis_, std::sin(e * t) * std::sin(w * t),
           e * std::cos(e * t) * std::sin(w * t) + w * std::sin(e * t) * std::cos(w * t));
}

void BadOperator::jerk(double t, h6DeviceSample& s) const {
  const double e = kPi / lasts_;
  displace(s, way_, axis_, std::sin(e * t) * std::sin(e * t), e * std::sin(2 * e * t));
}

void BadOperator::spoil(h6DeviceSample& s) const {
  static constexpr double bad[] = {std::numeric_limits<double>::quiet_NaN(),
                                   std::numeric_limits<double>::infinity(),
                                   -std::numeric_limits<double>::infinity(), 1e308, -1e200};
  const double value = bad[which_ % 5];
  double* const at[] = {&s.pose.p.x,          &s.pose.p.y,          &s.pose.p.z,
                        &s.pose.q.w,          &s.pose.q.x,          &s.pose.q.y,
                        &s.pose.q.z,          &s.velocity.linear.x, &s.velocity.linear.y,
                        &s.velocity.linear.z, &s.velocity.angular.x};
  const std::size_t where = which_ / 5 % 13;
  if (where < 11)
    *at[where] = value;
  else if (where == 11)
    s.pose.q = {0, 0, 0, 0};  // no rotation at all
  else
    s.wrench.force.x = value;
}

int BadOperator::read(double time, h6DeviceSample& out) {
  const int failed = hand_.read(hand_.self, time, &out);
  if (now_ && time - begun_ >= lasts_) {
    now_ = false;
    next_ = time - figures_.every * std::log(random(1e-9, 1));
  }
  if (!now_ && time >= next_) begin(time);
  unplugged_ = now_ && kind_ == Trouble::unplug;
  if (failed || unplugged_) return 1;
  if (now_) {
    const double t = time - begun_;
    if (kind_ == Trouble::shake) shake(t, out);
    if (kind_ == Trouble::jerk) jerk(t, out);
    if (kind_ == Trouble::freeze) out = last_;
    if (kind_ == Trouble::jump) displace(out, way_, axis_, 1, 0);
  }
  last_ = out;
  if (now_ && kind_ == Trouble::nan) spoil(out);
  return 0;
}

h6Device BadOperator::device() {
  h6Device d = hand_;
  d.self = this;
  std::snprintf(d.capabilities.name, sizeof d.capabilities.name, "bad operator");
  d.read = [](void* self, double time, h6DeviceSample* out) {
    return static_cast<BadOperator*>(self)->read(time, *out);
  };
  d.write = [](void* self, double time, const h6DeviceCommand* command) {
    auto& bad = *static_cast<BadOperator*>(self);
    const int failed = bad.hand_.write(bad.hand_.self, time, command);
    return failed || bad.unplugged_ ? 1 : 0;
  };
  d.stop = [](void* self) {
    auto& bad = *static_cast<BadOperator*>(self);
    bad.hand_.stop(bad.hand_.self);
  };
  d.arm = [](void* self) { return arm(static_cast<BadOperator*>(self)->hand_); };
  return d;
}

}  // namespace h6::device
