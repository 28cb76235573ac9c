// SPDX-License-Identifier: Apache-2.0
// verdict.cpp - judges a run by the rules in the header.
#include "io/scene/verdict.h"

#include <algorithm>
#include <cmath>

#include "hapsix/vector.h"

namespace h6::io {
namespace {

constexpr double kWindow = 0.2;            // end of a still phase that is judged [s]
constexpr double kStillMotion = 0.02e-3;   // RMS over points [m]
constexpr double kChatterSpeed = 2e-3;     // RMS over points and window [m/s]
constexpr double kChatterDepth = 0.1;      // peak to peak [voxels]
constexpr double kUnstableFactor = 100;    // times the hand's peak speed
constexpr double kLeastPeakSpeed = 10e-3;  // [m/s]
constexpr double kCatchUp = 1;             // for the way to the hand at the start [s]
constexpr std::size_t kClusterSize = 48;

struct Rotation {
  double m[3][3];
  explicit Rotation(const h6Quat& q)
      : m{{1 - 2 * (q.y * q.y + q.z * q.z), 2 * (q.x * q.y - q.w * q.z),
           2 * (q.x * q.z + q.w * q.y)},
          {2 * (q.x * q.y + q.w * q.z), 1 - 2 * (q.x * q.x + q.z * q.z),
           2 * (q.y * q.z - q.w * q.x)},
          {2 * (q.x * q.z - q.w * q.y), 2 * (q.y * q.z + q.w * q.x),
           1 - 2 * (q.x * q.x + q.y * q.y)}} {}
  h6Vec3 operator*(const h6Vec3& v) const {
    return {m[0][0] * v.x + m[0][1] * v.y + m[0][2] * v.z,
            m[1][0] * v.x + m[1][1] * v.y + m[1][2] * v.z,
            m[2][0] * v.x + m[2][1] * v.y + m[2][2] * v.z};
  }
};

bool finite(const h6Vec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}
bool finite(const h6Pose& pose) {
  const h6Quat& q = pose.q;
  return finite(pose.p) && std::isfinite(q.w) && std::isfinite(q.x) && std::isfinite(q.y) &&
         std::isfinite(q.z);
}

bool contains(const Box& box, const h6Vec3& p) {
  return p.x >= box.low.x && p.x <= box.high.x && p.y >= box.low.y && p.y <= box.high.y &&
         p.z >= box.low.z && p.z <= box.high.z;
}

bool touches(const Box& box, const h6Vec3& centre, double radius) {
  const auto outside = [](double x, double low, double high) {
    return x < low ? low - x : x > high ? x - high : 0.0;
  };
  const double dx = outside(centre.x, box.low.x, box.high.x);
  const double dy = outside(centre.y, box.low.y, box.high.y);
  const double dz = outside(centre.z, box.low.z, box.high.z);
  return dx * dx + dy * dy + dz * dz <= radius * radius;
}

double angle_between(const h6Quat& a, const h6Quat& b) {
  const double cosine = std::abs(dot(a, b));
  return 2 * std::acos(std::min(1.0, cosine));
}

}  // namespace

const char* verdict_name(Verdict verdict) {
  switch (verdict) {
    case Verdict::unstable:
      return "unstable";
    case Verdict::through:
      return "through";
    case Verdict::chatters:
      return "chatters";
    case Verdict::sunk:
      return "sunk";
    case Verdict::arrived:
      return "arrived";
    case Verdict::stuck:
      return "stuck";
    case Verdict::untouched:
      return "untouched";
    case Verdict::unheld:
      return "unheld";
    case Verdict::held:
      return "held";
  }
  return "unknown";
}

VerdictWatch::VerdictWatch(const SceneVerdict& rules, std::vector<h6Vec3> points, h6Vec3 com,
                           double rate)
    : rules_(rules), points_(std::move(points)), com_(com), rate_(rate > 0 ? rate : 1000) {
  // Treat the centre of mass as one more point.
  points_.push_back(com_);
  const double share = 1 / static_cast<double>(points_.size());
  for (const h6Vec3& p : points_) {
    mean_ = mean_ + share * p;
    const double products[6] = {p.x * p.x, p.y * p.y, p.z * p.z, p.x * p.y, p.x * p.z, p.y * p.z};
    for (int i = 0; i < 6; ++i) second_[i] += share * products[i];
  }
  if (!rules_.forbidden.empty()) cluster_points(0, points_.size());
  const auto frames = static_cast<std::size_t>(std::lround(kWindow * rate_));
  window_.speed2.resize(std::max<std::size_t>(frames, 2));
  window_.depth.resize(window_.speed2.size());
  window_.from.resize(window_.speed2.size());
}

// Halves the points along the longest side of their box until few are left.
void VerdictWatch::cluster_points(std::size_t first, std::size_t count) {
  const auto begin = points_.begin() + static_cast<std::ptrdiff_t>(first);
  const auto end = begin + static_cast<std::ptrdiff_t>(count);
  h6Vec3 low = *begin, high = *begin;
  for (auto p = begin; p != end; ++p) {
    low = min(low, *p), high = max(high, *p);
  }
  const h6Vec3 size = high - low;
  if (count > kClusterSize) {
    const auto along = size.x >= size.y && size.x >= size.z ? &h6Vec3::x
                       : size.y >= size.z                   ? &h6Vec3::y
                                                            : &h6Vec3::z;
    std::nth_element(begin, begin + static_cast<std::ptrdiff_t>(count / 2), end,
                     [along](const h6Vec3& a, const h6Vec3& b) { return a.*along < b.*along; });
    cluster_points(first, count / 2);
    cluster_points(first + count / 2, count - count / 2);
    return;
  }
  Cluster cluster = {{low.x + size.x / 2, low.y + size.y / 2, low.z + size.z / 2},
                     0,
                     static_cast<std::uint32_t>(first),
                     static_cast<std::uint32_t>(count)};
  for (auto p = begin; p != end; ++p) {
    const h6Vec3 arm = *p - cluster.centre;
    cluster.radius = std::max(cluster.radius, std::sqrt(dot(arm, arm)));
  }
  cluster.radius *= 1 + 1e-9;  // allows for rounding in the transform
  clusters_.push_back(cluster);
}

// Mean of |v + w x R p|^2 over the points p, in O(1): with a = RT w, u = RT v,
//   |u|^2 + 2 u.(a x mean) + |a|^2 tr S - aT S a,   S = mean of p pT.
double VerdictWatch::mean_speed2(const h6Vec3& origin_velocity, const h6Vec3& angular,
                                 const h6Quat& q) const {
  const Rotation to_mesh(conjugate(q));
  const h6Vec3 u = to_mesh * origin_velocity, a = to_mesh * angular;
  const double* s = second_;
  const h6Vec3 sa = {s[0] * a.x + s[3] * a.y + s[4] * a.z, s[3] * a.x + s[1] * a.y + s[5] * a.z,
                     s[4] * a.x + s[5] * a.y + s[2] * a.z};
  const double mean =
      dot(u, u) + 2 * dot(u, cross(a, mean_)) + dot(a, a) * (s[0] + s[1] + s[2]) - dot(a, sa);
  return std::max(0.0, mean);
}

// Mean square distance of the points between two poses. A turn D by the angle t about n carries the
// orientation A to B = D A. With the middle orientation M = D^(1/2) A,
//   B - A = (D^(1/2) - D^(-1/2)) M = 2 sin(t/2) [n]x M.
// So mean_speed2 gives the exact chord: its angular velocity is 2 sin(t/2) n, its orientation M.
double VerdictWatch::mean_motion2(const h6Pose& from, const h6Pose& to) const {
  const h6Quat &a = from.q, &b = to.q;
  h6Quat middle = {a.w + b.w, a.x + b.x, a.y + b.y, a.z + b.z};
  double sign = 1;
  if (dot(a, b) < 0) {
    middle = {a.w - b.w, a.x - b.x, a.y - b.y, a.z - b.z};
    sign = -1;
  }
  const h6Quat d = product(b, conjugate(a));  // (cos t/2, n sin t/2)
  const h6Vec3 turn = 2 * sign * h6Vec3{d.x, d.y, d.z};
  const double scale = 1 / std::sqrt(dot(middle, middle));
  return mean_speed2(to.p - from.p, turn,
                     {middle.w * scale, middle.x * scale, middle.y * scale, middle.z * scale});
}

std::optional<h6Vec3> VerdictWatch::entered(const h6Pose& body) const {
  if (clusters_.empty()) return std::nullopt;
  const Rotation r(body.q);
  for (const Cluster& cluster : clusters_) {
    const h6Vec3 centre = body.p + r * cluster.centre;
    for (const Box& box : rules_.forbidden) {
      if (!touches(box, centre, cluster.radius)) continue;
      for (std::uint32_t i = cluster.first; i < cluster.first + cluster.count; ++i)
        if (const h6Vec3 p = body.p + r * points_[i]; contains(box, p)) return p;
    }
  }
  return std::nullopt;
}

double VerdictWatch::slide() const {
  if (first_ || window_.filled < window_.speed2.size()) return 0;
  const double seconds = static_cast<double>(window_.filled) / rate_;
  return std::sqrt(mean_motion2(window_.from[window_.next], last_body_.pose)) / seconds;
}

bool VerdictWatch::chatters_now(double time) const {
  // Times are sums of frame periods and carry rounding errors, so allow half a frame.
  const bool still_long_enough = time - still_since_ >= kWindow - 0.5 / rate_;
  if (!still_long_enough || window_.filled < window_.speed2.size()) return false;
  double sum = 0;
  for (const double speed2 : window_.speed2) sum += speed2;
  const auto [low, high] = std::minmax_element(window_.depth.begin(), window_.depth.end());
  const double mean = slide();
  const double about2 = sum / static_cast<double>(window_.speed2.size()) - mean * mean;
  return about2 > kChatterSpeed * kChatterSpeed || *high - *low > kChatterDepth;
}

// Call it before the frame enters the window, so that a phase that ends here is judged by its own
// frames only.
void VerdictWatch::watch_stillness(double time, const h6Pose& hand, const h6Velocity& velocity) {
  // A hand that sets out has its velocity a frame before it is elsewhere, and the coupling's damper
  // already pulls.
  const double leaves = kStillMotion * rate_;
  if (!first_ && mean_motion2(still_hand_, hand) <= kStillMotion * kStillMotion &&
      mean_speed2(velocity.linear, velocity.angular, hand.q) <= leaves * leaves)
    return;
  if (!first_ && chatters_now(last_time_)) chattered_ = true;
  still_hand_ = hand;
  still_since_ = time;
  window_.filled = window_.next = 0;
}

void VerdictWatch::frame(double time, const h6Pose& hand, const h6Velocity& hand_velocity,
                         const h6BodyState& body, double max_depth_voxels, bool state_finite) {
  const bool all_finite = state_finite && finite(body.pose) && finite(body.velocity.linear) &&
                          finite(body.velocity.angular) && std::isfinite(max_depth_voxels);
  finite_ = finite_ && all_finite;
  if (!finite_) return;
  // The device is to blame for a hand sample that is not finite, so such a frame does not count.
  if (!finite(hand) || !finite(hand_velocity.linear) || !finite(hand_velocity.angular)) return;

  const h6Velocity& v = body.velocity;
  const h6Vec3 com_arm = Rotation(body.pose.q) * com_;
  const h6Vec3 origin_velocity = v.linear - cross(v.angular, com_arm);
  peak_speed2_ = std::max(peak_speed2_, mean_speed2(origin_velocity, v.angular, body.pose.q));
  peak_hand_speed2_ =
      std::max(peak_hand_speed2_, mean_speed2(hand_velocity.linear, hand_velocity.angular, hand.q));

  if (first_) start_lag2_ = mean_motion2(hand, body.pose);
  if (!entry_)
    if (const auto place = entered(body.pose)) entry_ = Entry{time, *place};
  touched_ = touched_ || max_depth_voxels > 0;

  watch_stillness(time, hand, hand_velocity);
  // Take the speed from poses, so that it does not depend on the velocity of the integrator.
  const double dt = first_ || time <= last_time_ ? 1 / rate_ : time - last_time_;
  const double speed2 = first_ ? 0 : mean_motion2(last_body_.pose, body.pose) / (dt * dt);
  window_.speed2[window_.next] = speed2;
  window_.depth[window_.next] = max_depth_voxels;
  window_.from[window_.next] = first_ ? body.pose : last_body_.pose;
  window_.next = (window_.next + 1) % window_.speed2.size();
  window_.filled = std::min(window_.filled + 1, window_.speed2.size());

  last_hand_ = hand;
  last_body_ = body;
  last_depth_ = max_depth_voxels;
  last_time_ = time;
  first_ = false;
}

bool VerdictWatch::arrived() const {
  if (first_) return false;
  const h6Vec3 off = last_body_.pose.p - rules_.target->p;
  const bool turned = rules_.tolerance_angle > 0 &&
                      angle_between(last_body_.pose.q, rules_.target->q) > rules_.tolerance_angle;
  return std::sqrt(dot(off, off)) <= rules_.tolerance && !turned;
}

Verdict VerdictWatch::verdict(bool popped_through) const {
  const double limit =
      kUnstableFactor *
      std::max({kLeastPeakSpeed, std::sqrt(peak_hand_speed2_), std::sqrt(start_lag2_) / kCatchUp});
  if (!finite_ || peak_speed2_ > limit * limit) return Verdict::unstable;
  if (entry_ || popped_through) return Verdict::through;
  if (chattered_ || (!first_ && chatters_now(last_time_))) return Verdict::chatters;
  if (last_depth_ > H6_DEEPEST_FIT) return Verdict::sunk;
  if (rules_.target) return arrived() ? Verdict::arrived : Verdict::stuck;
  return touched_ ? Verdict::held : Verdict::untouched;
}

}  // namespace h6::io
