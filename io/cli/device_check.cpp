// SPDX-License-Identifier: Apache-2.0
#include "io/cli/device_check.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <thread>

#include "hapsix/vector.h"
#include "io/run/open_device.h"

namespace h6::cli {
namespace {

using Clock = std::chrono::steady_clock;

double us_since(Clock::time_point t) {
  return std::chrono::duration<double, std::micro>(Clock::now() - t).count();
}

bool usable(const h6DeviceSample& s) {
  const h6Pose& p = s.pose;
  const double sum = p.p.x + p.p.y + p.p.z + s.velocity.linear.x + s.velocity.linear.y +
                     s.velocity.linear.z + s.velocity.angular.x + s.velocity.angular.y +
                     s.velocity.angular.z;
  const double q2 = p.q.w * p.q.w + p.q.x * p.q.x + p.q.y * p.q.y + p.q.z * p.q.z;
  return std::fabs(sum) < 1e6 && std::fabs(q2 - 1) < 2e-3;  // false for NaN, too
}

double& part(h6Vec3& v, int i) { return i == 0 ? v.x : i == 1 ? v.y : v.z; }

// The rotation vector from a to b, for small angles.
h6Vec3 turned(const h6Quat& a, const h6Quat& b) {
  const h6Quat d = product(b, conjugate(a));
  const double sign = d.w < 0 ? -2 : 2;
  return {sign * d.x, sign * d.y, sign * d.z};
}

// Reads and writes a device at 1 kHz.
class Frames {
 public:
  explicit Frames(const h6Device& device) : device_(device), next_(Clock::now()) {
    sample.pose.q.w = 1;
  }
  // One frame: waits for its time, reads, writes.
  void run(const h6Wrench& wrench) {
    std::this_thread::sleep_until(next_);
    next_ =
        std::max(next_, Clock::now() - std::chrono::milliseconds(5)) + std::chrono::milliseconds(1);
    time = 1e-3 * static_cast<double>(count.frames++);
    const h6DeviceSample before = sample;
    Clock::time_point begun = Clock::now();
    lost = device_.read(device_.self, time, &sample) != 0;
    count.read_us_max = std::max(count.read_us_max, us_since(begun));
    good = usable(sample);
    count.failed += lost;
    count.unusable += !lost && !good;
    count.changed += std::memcmp(&before.pose, &sample.pose, sizeof sample.pose) != 0;
    h6DeviceCommand command{};
    command.wrench = lost || !good ? h6Wrench{} : wrench;
    command.pose = sample.pose;
    begun = Clock::now();
    lost = device_.write(device_.self, time, &command) != 0 || lost;
    count.write_us_max = std::max(count.write_us_max, us_since(begun));
    beat.fetch_add(1, std::memory_order_relaxed);
  }
  h6DeviceSample sample{};
  SampleCount count;
  double time = 0;
  bool lost = false, good = true;
  std::atomic<std::uint64_t> beat{0};    // whole frames
  std::atomic<bool> stood_still{false};  // the vigil has stopped the device

 private:
  const h6Device& device_;
  Clock::time_point next_;
};

// Watches the frames from a thread of its own. It stops the device after 0.1 s without one, because
// the last command may still push, and calls `hangs` after kDriverSilence. It counts turns, not
// time: a program that was stopped goes on after it.
class Vigil {
 public:
  Vigil(const h6Device& device, Frames& frames, const std::function<void()>& hangs)
      : thread_([this, &device, &frames, &hangs] {
          std::uint64_t seen = 0;
          for (int still = 0; !end_.load(); std::this_thread::sleep_for(kTurn)) {
            const std::uint64_t now = frames.beat.load(std::memory_order_relaxed);
            still = now == seen ? still + 1 : 0;
            seen = now;
            if (still == 100 / kTurn.count() && !stopper_.joinable())
              stopper_ = std::thread([this, &device, &frames] {  // it may hang, too
                device.stop(device.self);
                frames.stood_still.store(true);
                stopped_.store(true);
              });
            if (still == 0 && stopped_.exchange(false)) stopper_.join();
            if (still == std::lround(1e3 * kDriverSilence) / kTurn.count()) hangs();
          }
        }) {}
  ~Vigil() {
    end_.store(true);
    thread_.join();
    if (stopper_.joinable()) stopper_.join();
  }

 private:
  static constexpr std::chrono::milliseconds kTurn{5};
  std::atomic<bool> end_{false}, stopped_{false};
  std::thread stopper_;  // of `thread_`, which starts it
  std::thread thread_;
};

// Why the check must stop; empty when it may go on.
std::string danger(const Frames& f, const h6Pose& start) {
  if (f.lost) return "the device was lost";
  if (!f.good) return "the device sent what is no place or no rotation";
  if (norm(f.sample.velocity.linear) > 1) return "the device moved faster than 1 m/s";
  if (norm(f.sample.pose.p - start.p) > 0.1) return "the device moved farther than 0.1 m";
  return "";
}

}  // namespace

SampleCount watch_device(const h6Device& device, double seconds, const EachFrame& each,
                         const std::function<void()>& hangs) {
  Frames frames(device);
  const Vigil vigil(device, frames, hangs);
  while (frames.time < seconds) {
    frames.run({});
    if (!each(frames.time, frames.sample, frames.lost)) break;
  }
  device.stop(device.self);
  return frames.count;
}

// The noise of sensors. [m], [rad]
constexpr double kStill = 1e-5;

CheckResult check_device_by_pushes(const h6Device& device, const EachFrame& each,
                                   const std::function<void()>& hangs) {
  constexpr double kPi = 3.14159265358979323846;
  constexpr int kMostStops = 20;
  CheckResult result;
  Frames frames(device);
  const Vigil vigil(device, frames, hangs);
  h6Pose start{};
  int stops = 0;  // of the device, by the vigil
  const auto go_on = [&](const h6Wrench& wrench) {
    frames.run(wrench);
    if (frames.count.frames == 1) start = frames.sample.pose;
    if (result.trouble.empty()) result.trouble = danger(frames, start);
    if (result.trouble.empty() && !each(frames.time, frames.sample, frames.lost))
      result.trouble = "cancelled";
    return result.trouble.empty();
  };
  const auto push = [&](bool torque, int axis, double sign, double most) {
    static constexpr const char* names[] = {"x", "y", "z"};
    Push p;
    p.what = std::string(torque ? "torque " : "force ") + (sign < 0 ? "-" : "+") + names[axis];
    p.applied = most;
    h6Pose before = frames.sample.pose;
    for (int i = 0; i < 400; ++i) {
      if (frames.stood_still.exchange(false)) {
        // The machine stood still, and the vigil has stopped the device: the push begins anew.
        if (++stops > kMostStops) result.trouble = "the machine stands still again and again";
        if (device.arm && device.arm(device.self) != 0)
          result.trouble = "the device cannot be armed again after the machine stood still";
        if (!result.trouble.empty()) return false;
        before = frames.sample.pose;
        i = 0;
      }
      h6Wrench w{};
      part(torque ? w.torque : w.force, axis) = sign * most * 0.5 * (1 - std::cos(kPi * i / 200));
      if (!go_on(w)) return false;
      if (i != 220) continue;  // measures a little after the peak, because the device lags
      h6Vec3 moved =
          torque ? turned(before.q, frames.sample.pose.q) : frames.sample.pose.p - before.p;
      p.moved = sign * part(moved, axis);
    }
    for (int i = 0; i < 100; ++i)
      if (!go_on({})) return false;
    result.pushes.push_back(p);
    return true;
  };
  const h6DeviceCapabilities& c = device.capabilities;
  const double force = std::min(0.1 * c.max_force, 10.0),
               torque = std::min(0.1 * c.max_torque, 1.0);
  bool going = true;
  for (int i = 0; i < 500 && going; ++i) going = go_on({});
  // The motors of some have no power before.
  if (going && device.arm && device.arm(device.self) != 0) {
    result.trouble = "the device cannot be armed";
    going = false;
  }
  // A device without motors may show the force with a light.
  for (int i = 0; i < 1000 && going && c.dof_out == 0; ++i) going = go_on({{0, 0, force}, {}});
  for (const bool turn : {false, true})
    for (int axis = 0; axis < 3; ++axis)
      for (const double sign : {1.0, -1.0}) {
        const double most = turn ? torque : force;
        const bool renders = c.dof_out == 6 || (c.dof_out == 3 && !turn);
        if (going && most > 0 && renders) going = push(turn, axis, sign, most);
      }
  device.stop(device.self);
  result.samples = frames.count;
  for (const Push& p : result.pushes)
    if (result.trouble.empty() && p.moved < -2e-4)
      result.trouble = "pushed by " + p.what +
                       " it moved the other way: an axis or a sign is wrong, or a person pushed";
  const auto stood = [](const Push& p) { return std::fabs(p.moved) < kStill; };
  if (result.trouble.empty() && !result.pushes.empty() &&
      std::all_of(result.pushes.begin(), result.pushes.end(), stood))
    result.trouble = "no push moved the handle: the motors have no power, or a person holds it";
  return result;
}

}  // namespace h6::cli
