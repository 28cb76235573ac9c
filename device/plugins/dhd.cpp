// SPDX-License-Identifier: Apache-2.0
// dhd.cpp - a plug-in for Force Dimension's omega, delta, sigma and lambda through the DHD SDK,
// which is loaded at run time.
//
//   hapsix run SCENE --device 'plugin:build/release/plugins/dhd.so?max_force=8'
//
// Neither a device nor the SDK was at hand: this was written from the documented calls
// (dhd_calls.h) and tried against a stand-in of ours only (tests/device/standins). Before a person
// holds such a device, go through "Before an arm is switched on" in io/guide/devices.md.
//
// The device's axes, seen by a person in front of it: x towards the person, y to the right, z up.
// It turns its handle with a wrist, and gives torques with an active one. The SDK does not tell a
// rating: max_force is 5 N and max_torque 0.1 N m unless the options say otherwise. The firmware's
// watchdog takes the force away 20 ms after the last command (option watchdog, at most 31 ms), so
// it also works when this process is gone; "no watchdog" in the name means that the device has
// none.
#include "device/plugins/dhd_calls.h"
#include "device/plugins/vendor_device.h"

namespace {

using namespace h6::plugin;

class Dhd final : public VendorDevice {
 public:
  Dhd() : VendorDevice(5, 20, 0.1, 0.4) {}

 private:
  const char* own_options() const override { return ", serial and watchdog"; }
  bool option(const std::string& key, const std::string& value, std::string& wrong) override {
    const double number = std::atof(value.c_str());
    if (key == "serial") {
      if (!(number >= 1 && number <= 65535)) wrong = "serial must be 1 to 65535, not " + value;
      serial_ = static_cast<int>(number);
    } else if (key == "watchdog") {
      if (!(number >= 0 && number <= 31))
        wrong = "watchdog must be 0 (none) to 31 ms, not " + value;
      watchdog_ = 1e-3 * number;
    } else {
      return false;
    }
    return true;
  }

  std::string connect(h6PluginCapabilities& can) override {
    std::string wrong = load_calls(library_, {"libdhd.so.3", "libdhd.so"}, "Force Dimension's SDK",
                                   {H6_DHD_CALLS(H6_CALL_ENTRY)});
    if (wrong.empty()) wrong = open_it();
    if (!wrong.empty()) return wrong;
    const char* name = calls_.dhdGetSystemName(id_);
    std::snprintf(can.name, sizeof can.name, "Force Dimension %.32s%s", name ? name : "",
                  watched_ ? "" : ", no watchdog");
    can.dof_in = wrist_ ? 6 : 3;
    can.dof_out = calls_.dhdHasActiveWrist(id_) ? 6 : 3;
    return "";
  }
  std::string open_it() {
    const int id = serial_ ? calls_.dhdOpenSerial(serial_) : calls_.dhdOpen();
    if (id < 0) {
      const char* why = calls_.dhdErrorGetLastStr();
      return "no device of Force Dimension opens" +
             (serial_ ? " with serial " + std::to_string(serial_) : "") +
             ": connect it, switch it on (" + (why ? why : "no reason given") + ")";
    }
    id_ = static_cast<char>(id);
    connected_ = true;
    unsigned short serial = 0;
    if (calls_.dhdGetSerialNumber(&serial, id_) < 0) serial = 0;  // old models do not tell
    if (known_ != 0 && serial != known_) {
      disconnect();
      return "another device was plugged in";
    }
    known_ = serial;
    wrist_ = calls_.dhdHasWrist(id_);
    if (!power(false)) {
      disconnect();
      return "the device of Force Dimension does not switch its forces off: do not use it";
    }
    watch();
    return "";
  }
  void watch() {
    if (watchdog_ <= 0) return watched_ = false, void();
    const auto duration = static_cast<unsigned char>(std::lround(watchdog_ / 125e-6));
    // The watchdog is one of the calls for experts.
    watched_ = calls_.dhdEnableExpertMode() >= 0 && calls_.dhdSetWatchdog(duration, id_) >= 0;
    (void)calls_.dhdDisableExpertMode();
    // A force that the watchdog cut off comes back only after a person armed the device.
    if (watched_) late_ = std::min(late_, watchdog_);
  }
  void disconnect() override {
    if (connected_) (void)calls_.dhdClose(id_);
    connected_ = false;
  }
  void connect_again() override {
    disconnect();
    (void)open_it();
  }

  bool read_state(State& s) override {
    if (!connected_) return false;
    double *p = s.position, *v = s.linear, *w = s.angular, m[3][3];
    const int got = wrist_ ? calls_.dhdGetPositionAndOrientationFrame(p, p + 1, p + 2, m, id_)
                           : calls_.dhdGetPosition(p, p + 1, p + 2, id_);
    if (got < 0) return false;
    s.fresh = got != DHD_TIMEGUARD;
    if (wrist_) {
      if (!is_rotation(m)) return wrong_ = kNoRotation, false;
      h6_quaternion(m, s.turn);
    }
    if (!velocity(calls_.dhdGetLinearVelocity(v, v + 1, v + 2, id_), v)) return false;
    if (wrist_ && !velocity(calls_.dhdGetAngularVelocityRad(w, w + 1, w + 2, id_), w)) return false;
    s.buttons = calls_.dhdGetButtonMask(id_);
    return true;
  }
  // The SDK has no velocity yet, after opening and after a pause.
  bool velocity(int result, double v[3]) {
    if (result >= 0) return true;
    v[0] = v[1] = v[2] = 0;
    return calls_.dhdErrorGetLast() == DHD_ERROR_TIMEOUT;
  }
  bool write_wrench(const double f[3], const double t[3]) override {
    // A positive result says that motors are at their limit.
    return connected_ && calls_.dhdSetForceAndTorque(f[0], f[1], f[2], t[0], t[1], t[2], id_) >= 0;
  }
  bool power(bool on) override { return connected_ && calls_.dhdEnableForce(on, id_) >= 0; }
  const char* reason() override { return connected_ ? calls_.dhdErrorGetLastStr() : ""; }

  DhdCalls calls_;
  int serial_ = 0;            // option; 0: the first device
  unsigned short known_ = 0;  // of the device that was opened
  double watchdog_ = 0.02;    // [s]
  char id_ = 0;
  bool connected_ = false, wrist_ = false, watched_ = false;
};

}  // namespace

extern "C" H6_PLUGIN_EXPORT const h6DevicePluginV1 h6_device_plugin_v1 = plugin_of<Dhd>(
    "Force Dimension's devices through the DHD SDK; options: library, axes, timeout [ms], "
    "max_force [N], max_torque [N m], serial, watchdog [ms].");
