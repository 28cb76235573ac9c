// SPDX-License-Identifier: Apache-2.0
#include "device/path_device.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "hapsix/vector.h"

namespace h6::device {
namespace {

h6Quat slerp(const h6Quat& a, h6Quat b, double s) {
  double c = dot(a, b);
  if (c < 0) {
    b = -b;
    c = -c;
  }
  double wa = 1 - s, wb = s;
  if (c < 0.9995) {
    const double angle = std::acos(c);
    wa = std::sin(wa * angle) / std::sin(angle);
    wb = std::sin(wb * angle) / std::sin(angle);
  }
  return unit({wa * a.w + wb * b.w, wa * a.x + wb * b.x, wa * a.y + wb * b.y, wa * a.z + wb * b.z});
}

}  // namespace

h6DeviceSample HandPath::keyframe(double t) const {
  h6DeviceSample sample{};
  const auto after = std::upper_bound(time.begin(), time.end(), t);
  if (after == time.begin() || after == time.end()) {  // still at either end
    sample.pose = after == time.begin() ? pose.front() : pose.back();
    return sample;
  }
  const std::size_t i = static_cast<std::size_t>(after - time.begin());
  const h6Pose &a = pose[i - 1], &b = pose[i];
  const double seconds = time[i] - time[i - 1], s = (t - time[i - 1]) / seconds;
  sample.pose.p = a.p + s * (b.p - a.p);
  sample.pose.q = slerp(a.q, b.q, s);
  sample.velocity.linear = {(b.p.x - a.p.x) / seconds, (b.p.y - a.p.y) / seconds,
                            (b.p.z - a.p.z) / seconds};
  sample.velocity.angular = (1 / seconds) * turn(a.q, b.q);
  return sample;
}

Outcome check_path(const HandPath& path) {
  char text[160];
  if (path.time.empty() || path.time.size() != path.pose.size())
    return Failure{"a hand path needs at least one row of time and pose"};
  for (std::size_t i = 0; i < path.time.size(); ++i) {
    const h6Pose& pose = path.pose[i];
    const double sum = path.time[i] + pose.p.x + pose.p.y + pose.p.z;
    if (!std::isfinite(sum) || std::fabs(dot(pose.q, pose.q) - 1) > 2e-3) {
      std::snprintf(text, sizeof text,
                    "row %zu of the hand path is not a finite pose with a unit quaternion", i + 1);
      return Failure{text};
    }
    if (i > 0 && !(path.time[i] > path.time[i - 1])) {
      std::snprintf(text, sizeof text,
                    "row %zu of the hand path is not later than the row before it", i + 1);
      return Failure{text};
    }
  }
  return Done{};
}

Result<std::unique_ptr<PathDevice>> PathDevice::open(HandPath path) {
  if (Outcome good = check_path(path); !good) return good.failure();
  return std::unique_ptr<PathDevice>(new PathDevice(std::move(path)));
}

h6Device PathDevice::device() {
  h6Device d{};
  d.self = this;
  std::snprintf(d.capabilities.name, sizeof d.capabilities.name, "path");
  d.capabilities.dof_in = d.capabilities.dof_out = 6;
  d.capabilities.max_force = 100;
  d.capabilities.max_torque = 10;
  d.capabilities.modes = H6_IMPEDANCE;
  d.capabilities.frame_time = true;
  d.read = [](void* self, double t, h6DeviceSample* out) {
    *out = static_cast<PathDevice*>(self)->path_.at(t);
    return 0;
  };
  d.write = [](void* self, double, const h6DeviceCommand* command) {
    static_cast<PathDevice*>(self)->last_ = *command;
    return 0;
  };
  d.stop = [](void*) {};  // nothing moves
  return d;
}

}  // namespace h6::device
