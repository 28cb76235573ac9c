// SPDX-License-Identifier: Apache-2.0
// spacemouse.h - a 3Dconnexion cap as a hand: six axes of velocity in, one light out.
//
//   HID thread    opens, reads all that is queued, keeps the newest, lights the LED; looks for the
//                 device again when it was unplugged
//        | latest value, never waits
//   haptic thread read: newest axes -> RateControl -> pose;  write: keeps the wrench
//
// It renders no force: the wrench slows what pushes against it (RateControl), lights the LED while
// it is felt, and can be asked for, to be shown or heard. While unplugged, read fails; the engine
// then latches its output, and only the program arms it again. A device that comes back (the same
// serial number, or the same model where there is none) goes on from where the hand was, at rest.
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

// One entry a device, whatever number of interfaces it has.
std::vector<SpaceMouseInfo> list_spacemice(HidPort& port);

struct SpaceMouseOptions {
  std::string serial;  // empty: the first that can be opened
  RateFigures rate;
  double led_force = 0.5;  // felt from which the LED is lit, > 0 [N]
  // Ratings told to the engine: what may be shown, not what is rendered. [N], [N m]
  double shown_force = 30, shown_torque = 3;
};

class SpaceMouse {
 public:
  // Not rated for virtual time: it lives in real time. `home` and `grip` as in RateControl.
  static Result<std::unique_ptr<SpaceMouse>> open(HidPort& port, const SpaceMouseOptions& options,
                                                  const h6Pose& home, const h6Vec3& grip);
  ~SpaceMouse();
  h6Device device();

  // For any one thread beside the haptic one, at leisure.
  struct Status {
    bool present = false;
    SpaceMouseState state;
    std::uint64_t reports = 0;  // taken since it was opened
    std::uint64_t replugs = 0;  // times it came back
    bool led = false;
    double felt_force = 0, felt_torque = 0;  // norms of the last command [N], [N m]
  };
  Status status() const;
  const HidInterface& hid() const { return hid_; }

  // Input that is not refreshed for so long is taken as released: a cap that is held repeats itself
  // every 8 to 16 ms.
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
  // HID thread's, after open.
  HidInterface hid_;
  ReportLayout layout_ = ReportLayout::unknown;
  std::unique_ptr<HidHandle> handle_;
  Stamped newest_;
  bool led_ = false;
  // Between the threads.
  sched::LatestValue<Stamped> to_hand_;
  mutable sched::LatestValue<Stamped> to_status_;
  mutable Stamped shown_;
  std::atomic<bool> present_{false}, stopped_{false}, ending_{false}, lit_{false};
  std::atomic<std::uint64_t> reports_{0}, replugs_{0};
  std::atomic<double> felt_force_{0}, felt_torque_{0};
  // Haptic thread's.
  RateControl rate_;
  Stamped taken_;
  h6Wrench felt_{};
  double time_ = 0;
  bool was_present_ = true;
  h6DeviceSample last_{};
  std::thread thread_;
};

}  // namespace h6::device
