// SPDX-License-Identifier: Apache-2.0
// hdapi.cpp - a plug-in for 3D Systems' Touch, Touch X and Phantom through OpenHaptics (HDAPI),
// which is loaded at run time.
//
//   hapsix run SCENE --device 'plugin:build/release/plugins/hdapi.so?device=Default Device'
//
// Neither a device nor OpenHaptics was at hand: this was written from the documented calls
// (hdapi_calls.h) and tried against a stand-in of ours only (tests/device/standins). Before a
// person holds such a device, go through "Before an arm is switched on" in io/guide/devices.md.
//
// The device's axes, seen by a person in front of it: x to the right, y up, z towards the person.
// The default, axes=zxy, makes y the world's z. HDAPI has millimetres, N and N mm. The device tells
// its ratings; max_force and max_torque only lower them. A turn is a call of HDAPI's servo loop, of
// which a process has one: this plug-in opens one device at a time. A device that was unplugged is
// not opened anew.
#include "device/plugins/hdapi_calls.h"
#include "device/plugins/vendor_device.h"

namespace {

using namespace h6::plugin;

constexpr double kSmooth = 0.01;  // of the angular velocity [s]
std::atomic<bool> taken{false};   // the servo loop

class Hdapi final : public VendorDevice {
 public:
  Hdapi() : VendorDevice(40, 40, 1, 1) { (void)axes_.parse("zxy"); }

 private:
  const char* own_options() const override { return " and device"; }
  bool option(const std::string& key, const std::string& value, std::string&) override {
    if (key != "device") return false;
    name_ = value;
    return true;
  }

  std::string connect(h6PluginCapabilities& can) override {
    std::string wrong = load_calls(library_, {"libHD.so.3.4", "libHD.so"}, "OpenHaptics",
                                   {H6_HDAPI_CALLS(H6_CALL_ENTRY)});
    if (!wrong.empty()) return wrong;
    if (taken.exchange(true))
      return "another device of HDAPI is open: this plug-in opens one at a time";
    device_ = calls_.hdInitDevice(name_.empty() ? nullptr : name_.c_str());
    if (!quiet() || device_ == HD_INVALID_HANDLE) {
      const char* why = reason();
      if (device_ != HD_INVALID_HANDLE) calls_.hdDisableDevice(device_);
      taken = false;
      return "HDAPI does not open " + (name_.empty() ? "its default device" : name_) +
             ": connect it, name it in its set-up program (" + why + ")";
    }
    const char* model = calls_.hdGetString(HD_DEVICE_MODEL_TYPE);
    std::snprintf(can.name, sizeof can.name, "3D Systems %.40s", model ? model : "");
    if (wrong = ratings(can); !wrong.empty()) disconnect();
    return wrong;
  }
  std::string ratings(h6PluginCapabilities& can) {
    int in = 0, out = 0, style = 0;
    double force = 0, torque = 0;  // [N], [mN m]
    calls_.hdGetIntegerv(HD_INPUT_DOF, &in);
    calls_.hdGetIntegerv(HD_OUTPUT_DOF, &out);
    calls_.hdGetIntegerv(HD_CALIBRATION_STYLE, &style);
    calls_.hdGetDoublev(HD_NOMINAL_MAX_CONTINUOUS_FORCE, &force);
    calls_.hdDisable(HD_FORCE_OUTPUT);
    calls_.hdEnable(HD_MAX_FORCE_CLAMPING);
    if (!quiet()) return std::string(can.name) + " does not tell its ratings (" + reason() + ")";
    if (!(force > 0 && force < 1000)) return std::string(can.name) + " has no rating of its force";
    // Some with three motors report an error here.
    calls_.hdGetDoublev(HD_NOMINAL_MAX_TORQUE_CONTINUOUS_FORCE, &torque);
    torques_ = quiet() && out >= 6 && torque > 0;
    style_ = static_cast<unsigned>(style);
    can.dof_in = in >= 6 ? 6 : 3, can.dof_out = torques_ ? 6 : 3;
    max_force_ = std::min(max_force_, force);
    if (torques_) max_torque_ = std::min(max_torque_, 1e-3 * torque);
    return "";
  }
  void disconnect() override {
    calls_.hdDisableDevice(device_);
    (void)quiet();
    taken = false;
  }
  std::string begin() override {
    handle_ = calls_.hdScheduleAsynchronous(
        [](void* self) -> unsigned {
          (void)static_cast<Hdapi*>(self)->turn();
          return HD_CALLBACK_CONTINUE;
        },
        this, HD_DEFAULT_SCHEDULER_PRIORITY);
    if (!quiet()) return std::string("HDAPI's servo loop takes no callback (") + reason() + ")";
    calls_.hdStartScheduler();  // where it does not start, no place comes
    return "";
  }
  void end() override {
    // A turn or more with zero force before the loop stands still.
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    calls_.hdStopScheduler();
    calls_.hdUnschedule(handle_);
    (void)power(false);
  }

  bool read_state(State& s) override {
    calls_.hdMakeCurrentDevice(device_);
    if (!armed() && !calibrated()) return false;
    calls_.hdBeginFrame(device_);
    framed_ = true;
    double t[16] = {}, m[3][3];
    int buttons = 0;
    calls_.hdGetDoublev(HD_CURRENT_TRANSFORM, t);
    calls_.hdGetDoublev(HD_CURRENT_VELOCITY, s.linear);
    calls_.hdGetIntegerv(HD_CURRENT_BUTTONS, &buttons);
    if (!quiet()) return false;
    for (int i = 0; i < 3; ++i) {
      s.position[i] = 1e-3 * t[12 + i];
      s.linear[i] *= 1e-3;
      for (int j = 0; j < 3; ++j) m[i][j] = t[4 * j + i];
    }
    if (!is_rotation(m)) return wrong_ = kNoRotation, false;
    h6_quaternion(m, s.turn);
    angular(s);
    s.buttons = static_cast<unsigned>(buttons);
    return true;
  }
  // The stylus must have been calibrated, or places are wrong. This runs while no force is
  // rendered.
  bool calibrated() {
    const unsigned state = calls_.hdCheckCalibration();
    if (state == HD_CALIBRATION_NEEDS_UPDATE) calls_.hdUpdateCalibration(style_);
    if (state != HD_CALIBRATION_NEEDS_MANUAL_INPUT) return quiet();
    return wrong_ = "it is not calibrated: put the stylus into its inkwell, or run its set-up",
           false;
  }
  // From the turns of the handle: programs in the field found HDAPI's own figure of no use.
  void angular(State& s) {
    const double t = now(), dt = t - last_time_;
    double d[4];
    h6_turned(s.turn, last_, d);
    for (int i = 0; i < 3; ++i) {
      const double rate = 2 * (d[0] < 0 ? -d[i + 1] : d[i + 1]) / std::max(dt, 1e-4);
      smooth_[i] =
          last_time_ > 0 && dt < kSmooth ? smooth_[i] + dt / kSmooth * (rate - smooth_[i]) : 0;
      s.angular[i] = smooth_[i];
    }
    std::copy(s.turn, s.turn + 4, last_);
    last_time_ = t;
  }
  bool write_wrench(const double f[3], const double t[3]) override {
    if (!framed_) calls_.hdBeginFrame(device_);
    calls_.hdSetDoublev(HD_CURRENT_FORCE, f);
    const double mnm[3] = {1e3 * t[0], 1e3 * t[1], 1e3 * t[2]};
    if (torques_) calls_.hdSetDoublev(HD_CURRENT_TORQUE, mnm);
    calls_.hdEndFrame(device_);
    framed_ = false;
    return quiet();
  }
  bool power(bool on) override {
    on ? calls_.hdEnable(HD_FORCE_OUTPUT) : calls_.hdDisable(HD_FORCE_OUTPUT);
    return quiet();
  }

  // Whether no error came; takes all from the stack.
  bool quiet() {
    bool good = true;
    for (int i = 0; i < 64; ++i) {
      const HdError e = calls_.hdGetError();
      if (e.code == 0) break;
      if (good) hint_ = calls_.hdGetErrorString(e.code);
      good = false;
    }
    return good;
  }
  const char* reason() override { return hint_ ? hint_ : "no reason given"; }

  HdapiCalls calls_;
  std::string name_;
  unsigned device_ = HD_INVALID_HANDLE, style_ = 0;
  unsigned long handle_ = 0;
  bool torques_ = false, framed_ = false;
  const char* hint_ = nullptr;
  double last_[4] = {1, 0, 0, 0}, last_time_ = 0, smooth_[3] = {};
};

}  // namespace

extern "C" H6_PLUGIN_EXPORT const h6DevicePluginV1 h6_device_plugin_v1 = plugin_of<Hdapi>(
    "3D Systems' devices through OpenHaptics (HDAPI); options: library, axes, timeout [ms], "
    "max_force [N], max_torque [N m], device.");
