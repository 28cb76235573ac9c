// SPDX-License-Identifier: Apache-2.0
// standin.h - what the stand-ins for vendors' libraries have in common: a handle that a hand holds
// by a damped spring, and faults. Each library has one Standin, the symbol `standin`, that a test
// in the same process reads and writes. A program from outside chooses a fault by the environment:
// HAPSIX_STANDIN="error", or "error 300": 300 ms after the device was opened.
#pragma once
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <thread>
#include <type_traits>

namespace h6::standin {

enum class Fault {
  none,
  open,        // the device cannot be opened
  error,       // reading reports an error
  write,       // writing reports an error
  unplugged,   // everything reports an error until the device is closed and opened again
  not_finite,  // a place of NaN
  garbage,     // an orientation that is none
  stall,       // reading does not return
  special      // the vendor's own: Haption's emergency stop, HDAPI's lost calibration
};

inline double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

struct Standin {
  // From the test. The device's axes [m], [rad].
  std::atomic<Fault> fault{Fault::none};
  std::atomic<double> hand[3] = {};  // where the hand holds the handle
  std::atomic<double> turn{0.3};     // of the handle about the device's x
  std::atomic<unsigned> buttons{0};
  std::atomic<int> serial{7};
  std::atomic<bool> held{true}, shifted{false}, turns{true}, torques{true};
  // For the test.
  std::atomic<double> force[3] = {}, torque[3] = {};  // last written, in the vendor's units
  std::atomic<double> most{0};                        // largest force that the motors gave [N]
  std::atomic<bool> open{false}, power{false};
  std::atomic<int> writes{0}, opened{0}, powered{0}, misused{0};
  std::atomic<double> watchdog{0};  // [s]

  // For the library. Faults begin at `when`.
  std::atomic<double> when{0};
  bool has(Fault f) const { return fault == f && now() >= when; }
  bool open_it() {
    if (const char* text = std::getenv("HAPSIX_STANDIN")) {
      const char* names[] = {"none",       "open",    "error", "write",  "unplugged",
                             "not_finite", "garbage", "stall", "special"};
      char name[32] = "";
      double after = 0;
      if (std::sscanf(text, "%31s %lf", name, &after) < 1) return false;
      for (int i = 0; i < 9; ++i)
        if (std::strcmp(names[i], name) == 0) fault = static_cast<Fault>(i);
      when = now() + 1e-3 * after;
    }
    if (open || fault == Fault::open) return false;
    if (fault == Fault::unplugged && opened > 0) fault = Fault::none;
    open = true;
    ++opened;
    return true;
  }
  void close_it() { open = false, power = false; }
  void switch_power(bool on) {
    if (on && !power) ++powered;
    power = on;
  }
  // Before the values are read; false: reading fails.
  bool read() {
    while (has(Fault::stall)) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    if (!open || has(Fault::error) || has(Fault::unplugged)) return false;
    move();
    return true;
  }
  // False: writing fails.
  bool write(const double f[3], const double t[3]) {
    if (!open || has(Fault::write) || has(Fault::unplugged)) return false;
    for (int i = 0; i < 3; ++i) force[i] = f[i], torque[i] = t[i];
    const double norm = std::sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]);
    if (power && norm > most) most = norm;
    ++writes;
    return true;
  }
  // The handle: 0.2 kg on 2000 N/m with critical damping.
  void move() {
    const std::lock_guard lock(moving);
    const double t = now();
    double left = std::fmin(t - time, 0.1);
    time = t;
    for (; left > 0; left -= 1e-4)
      for (int i = 0; i < 3; ++i) {
        const double motor = power ? force[i].load() : 0;
        speed[i] += 1e-4 / 0.2 * (motor - 2000 * (place[i] - hand[i]) - 40 * speed[i]);
        place[i] += 1e-4 * speed[i];
      }
  }
  double coordinate(int axis) {
    const std::lock_guard lock(moving);
    return has(Fault::not_finite) && axis == 1 ? std::nan("") : place[axis] + offset[axis];
  }
  double velocity(int axis) {
    const std::lock_guard lock(moving);
    return speed[axis];
  }
  // The matrix by rows.
  void matrix(double m[3][3]) const {
    const double c = std::cos(turn), s = std::sin(turn);
    const double rows[3][3] = {{1, 0, 0}, {0, c, -s}, {0, s, c}};
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) m[i][j] = has(Fault::garbage) ? 7 : rows[i][j];
  }
  // As at the beginning; for a test whose device is closed.
  void reset() {
    fault = Fault::none, when = 0, turn = 0.3, buttons = 0, most = 0, watchdog = 0;
    held = true, shifted = false, turns = true, torques = true;
    serial = 7;
    writes = opened = powered = misused = 0;
    for (int i = 0; i < 3; ++i) hand[i] = 0, force[i] = 0, torque[i] = 0, place[i] = speed[i] = 0;
  }

 private:
  std::mutex moving;
  double time = 0, place[3] = {}, speed[3] = {};
  const double offset[3] = {0.01, -0.1, 0.2};  // of the device's origin
};

}  // namespace h6::standin

extern "C" __attribute__((visibility("default"))) h6::standin::Standin standin;

// Each stand-in defines a call with the type that the adapter's table has for it.
#define H6_STANDIN_CALL(calls, name) \
  static_assert(std::is_same_v<decltype(&name), decltype(h6::plugin::calls::name)>)
