// SPDX-License-Identifier: Apache-2.0
// bad_operator.h - a hand, and what goes wrong with hands: for soak tests of whatever is behind it.
//
//     a device --sample--> shake | jerk | freeze | NaN | jump | unplug --sample--> engine
//
// Trouble comes one at a time, at random moments; a seed and the times asked for give the same to
// the bit, on every machine.
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
  double every = 0.5;                           // mean time between two, 0.001 .. 1000 [s]
  double shake = 5e-3;                          // amplitude at most, at 5 .. 15 Hz [m]
  double jerk = 50e-3;                          // there and back within 10 .. 40 ms, at most [m]
  double jump = 0.3;                            // somewhere else from one frame to the next [m]
};

class BadOperator {
 public:
  // `hand` is read all the while, so that its person goes on; it must outlive this object.
  static Result<BadOperator> open(const h6Device& hand, const BadOperatorFigures& figures);
  h6Device device();

  // How often each has come.
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
  double next_ = 0;      // when trouble begins [s]
  bool now_ = false;
  Trouble kind_ = Trouble::shake;
  double begun_ = 0, lasts_ = 0;  // [s]
  h6Vec3 way_{}, axis_{};         // how far [m], and about what [rad]
  double pace_ = 0;               // [Hz]
  std::uint64_t which_ = 0;       // of the ways to spoil a sample
  h6DeviceSample last_{};         // as it was passed on
  bool unplugged_ = false;
  std::array<std::uint64_t, kTroubles> times_{};
};

}  // namespace h6::device
