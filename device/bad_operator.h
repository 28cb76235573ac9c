// SPDX-License-Identifier: Apache-2.0
// bad_operator.h - a hand with faults, for soak tests of the engine behind it.
//
//     a device --sample--> shake | jerk | freeze | NaN | jump | unplug --sample--> engine
//
// Faults come one at a time, at random moments. The same seed and the same times of reading give
// the same samples to the bit, on every machine.
#pragma once
#include <array>
#include <cstdint>

#include "hapsix/device.h"
#include "hapsix/result.h"

namespace h6::device {

enum class Trouble { shake, jerk, freeze, nan, jump, unplug, count };
inline constexpr std::size_t kTroubles = static_cast<std::size_t>(Trouble::count);
const char* trouble_name(Trouble trouble);

struct BadOperatorFigures {
  std::uint64_t seed = 1;
  std::uint32_t kinds = (1u << kTroubles) - 1;  // bits 1u << Trouble
  double every = 0.5;                           // mean time between two faults, 0.001 .. 1000 [s]
  double shake = 5e-3;                          // largest amplitude, at 5 .. 15 Hz, 0 .. 1 [m]
  double jerk = 50e-3;  // largest way there and back within 10 .. 40 ms, 0 .. 1 [m]
  double jump = 0.3;    // largest jump from one frame to the next, 0 .. 10 [m]
};

class BadOperator {
 public:
  // `hand` is read in every frame, also during a fault, so that its person moves on; it must
  // outlive this object. Fails with a sentence when a figure is out of range or `kinds` is empty.
  static Result<BadOperator> open(const h6Device& hand, const BadOperatorFigures& figures);
  h6Device device();

  // How often each fault has begun.
  const std::array<std::uint64_t, kTroubles>& times() const { return times_; }

 private:
  BadOperator(const h6Device& hand, const BadOperatorFigures& figures);
  int read(double time, h6DeviceSample& out);
  void begin(double time);
  void shake(double t, h6DeviceSample& s) const;
  void jerk(double t, h6DeviceSample& s) const;
  void spoil(h6DeviceSample& s) const;
  double random(double low, double high);
  h6Vec3 direction();

  h6Device hand_;
  BadOperatorFigures figures_;
  std::uint64_t state_;  // of the random numbers
  double next_ = 0;      // start of the next fault [s]
  bool now_ = false;
  Trouble kind_ = Trouble::shake;
  double begun_ = 0, lasts_ = 0;  // [s]
  h6Vec3 way_{}, axis_{};         // displacement [m] and rotation vector [rad]
  double pace_ = 0;               // of a shake [Hz]
  std::uint64_t which_ = 0;       // picks how a sample is spoilt
  h6DeviceSample last_{};         // the last sample that was passed on
  bool unplugged_ = false;
  std::array<std::uint64_t, kTroubles> times_{};
};

}  // namespace h6::device
