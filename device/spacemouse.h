// SPDX-License-Identifier: Apache-2.0
// spacemouse.h - a 3Dconnexion cap as a hand: six axes of velocity in, one LED out.
//
//   HID thread    opens the device, reads all queued reports, keeps the newest, switches the LED;
//                 searches for the device again after it was unplugged
//        | latest value, never waits
//   haptic thread read: newest axes -> RateControl -> pose;  write: keeps the wrench
//
// It renders no force. The wrench slows motion against it (RateControl), switches the LED on, and
// is available to a program that shows it (status). While the device is unplugged, read fails; the
// engine then latches its output, and only the program arms it again. A device that comes back (the
// same serial number, or the same model where there is none) continues from the hand's last pose,
// at rest.
#pragma once
#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "device/hid_port.h"
#include "device/rate_control.h"
#include "device/spacemouse_report.h"
#include "sched/latest_value.h"

namespace h6::device {

struct SpaceMouseInfo {
  HidInterface hid;
  ReportLayout layout = ReportLayout::unknown;
};

// One entry per device, also when it has several interfaces.
std::vector<SpaceMouseInfo> list_spacemice(HidPort& port);

struct SpaceMouseOptions {
  std::string serial;  // empty: the first that can be opened
  RateFigures rate;
  double led_force = 0.5;  // smallest felt force that lights the LED, > 0 [N]
  // Ratings reported to the engine: bounds for display, since no force is rendered. [N], [N m]
  double shown_force = 30, shown_torque = 3;
};

class SpaceMouse {
 public:
  // Real time only, not virtual time. `home` and `grip` as in RateControl. Fails with a sentence.
  static Result<std::unique_ptr<SpaceMouse>> open(HidPort& port, const SpaceMouseOptions& options,
                                                  const h6Pose& home, const h6Vec3& grip);
  ~SpaceMouse();
  h6Device device();

  // For one thread other than the haptic one.
  struct Status {
    bool present = false;
    SpaceMouseState state;
    std::uint64_t reports = 0;  // read since it was opened
    std::uint64_t replugs = 0;  // times it was plugged in again
    bool led = false;
    double felt_force = 0, felt_torque = 0;  // norms of the last command [N], [N m]
  };
  Status status() const;
  const HidInterface& hid() const { return hid_; }

  // Input older than this counts as released: a cap that is held repeats its report every 8 to 16
  // ms.
  static constexpr double kStale = 0.1;  // [s]

 private:
  struct Stamped {
    SpaceMouseState state;
    std::int64_t moved_ns = 0;  // arrival of the last motion report
  };
  SpaceMouse(HidPort& port, const SpaceMouseOptions& options, const h6Pose& home,
             const h6Vec3& grip);
  bool connect(std::string& trouble);
  void run();
  void drain(int timeout_ms);
  void light();
  void gone();
  int read(double time, h6DeviceSample* out);

  HidPort& port_;
  SpaceMouseOptions options_;
  // Used by the HID thread alone, after open.
  HidInterface hid_;
  ReportLayout layout_ = ReportLayout::unknown;
  std::unique_ptr<HidHandle> handle_;
  Stamped newest_;
  bool led_ = false;
  // Shared between the threads.
  sched::LatestValue<Stamped> to_hand_;
  mutable sched::LatestValue<Stamped> to_status_;
  mutable Stamped shown_;
  std::atomic<bool> present_{false}, stopped_{false}, ending_{false}, lit_{false};
  std::atomic<std::uint64_t> reports_{0}, replugs_{0};
  std::atomic<double> felt_force_{0}, felt_torque_{0};
  // Used by the haptic thread alone.
  RateControl rate_;
  Stamped taken_;
  h6Wrench felt_{};
  double time_ = 0;
  bool was_present_ = true;
  h6DeviceSample last_{};
  std::thread thread_;
};

}  // namespace h6::device
