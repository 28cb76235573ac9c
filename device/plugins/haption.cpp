// SPDX-License-Identifier: Apache-2.0
// haption.cpp - a plug-in for Haption's Virtuose through the Virtuose API, which is loaded at run
// time.
//
//   hapsix run SCENE --device 'plugin:build/release/plugins/haption.so?address=127.0.0.1#53210'
//
// Neither a device nor the API was at hand: this was written from the documented calls
// (haption_calls.h) and tried against a stand-in of ours only (tests/device/standins). Before a
// person holds such a device, go through "Before an arm is switched on" in io/guide/devices.md.
//
// The device's axes, seen by a person in front of it: x out of the base towards the person, y to
// the right, z up; base and observation frame are left as they are. The API does not tell a rating:
// max_force is 3 N and max_torque 0.2 N m unless the options say otherwise, and the controller gets
// them as its saturation. The controller's watchdog cuts the force 2 s after the last command: that
// is longer than the 20 ms which device_plugin.h asks for, so the emergency stop is not optional.
//
// The handle's shift button, its dead-man sensor and the power button inhibit the force in the
// controller; afterwards it rises within 0.1 s. Buttons 0 to 3 are the handle's, bit 4 is the
// dead-man sensor. An emergency stop is a lost device.
#include <utility>

#include "device/plugins/haption_calls.h"
#include "device/plugins/vendor_device.h"

namespace {

using namespace h6::plugin;

class Haption final : public VendorDevice {
 public:
  Haption() : VendorDevice(3, 35, 0.2, 3.3) {}

 private:
  const char* own_options() const override { return ", address and period"; }
  bool option(const std::string& key, const std::string& value, std::string& wrong) override {
    const double number = std::atof(value.c_str());
    if (key == "address") {
      if (value.empty()) wrong = "address must be one like 127.0.0.1#53210";
      address_ = value;
    } else if (key == "period") {
      if (!(number >= 1 && number <= 10)) wrong = "period must be 1 to 10 ms, not " + value;
      turn_time_ = 1e-3 * number;
    } else {
      return false;
    }
    return true;
  }

  std::string connect(h6PluginCapabilities& can) override {
    std::string wrong = load_calls(library_, {"libVirtuoseAPI.so", "libvirtuose.so"},
                                   "Haption's Virtuose API", {H6_HAPTION_CALLS(H6_CALL_ENTRY)});
    if (wrong.empty()) wrong = open_it();
    std::snprintf(can.name, sizeof can.name, "Haption Virtuose at %.40s", address_.c_str());
    can.dof_in = 6, can.dof_out = 6;
    return wrong;
  }
  std::string open_it() {
    context_ = calls_.virtOpen(address_.c_str());
    if (!context_)
      return "no Virtuose answers at " + address_ +
             ": start its service, give address=HOST#PORT (" + text() + ")";
    float none[7] = {0, 0, 0, 0, 0, 0, 1};
    const auto f = [](double v) { return static_cast<float>(v); };
    // The factors and the step must be known before the type of command.
    const std::pair<const char*, int> steps[] = {
        {"timeout", calls_.virtSetTimeoutValue(context_, f(patience_))},
        {"indexing", calls_.virtSetIndexingMode(context_, INDEXING_ALL_FORCE_FEEDBACK_INHIBITION)},
        {"force factor", calls_.virtSetForceFactor(context_, 1)},
        {"speed factor", calls_.virtSetSpeedFactor(context_, 1)},
        {"time step", calls_.virtSetTimeStep(context_, f(turn_time_))},
        {"base frame", calls_.virtSetBaseFrame(context_, none)},
        {"observation frame", calls_.virtSetObservationFrame(context_, none)},
        {"command type", calls_.virtSetCommandType(context_, COMMAND_TYPE_IMPEDANCE)},
        {"saturation", calls_.virtSaturateTorque(context_, f(max_force_), f(max_torque_))},
        {"power", calls_.virtSetPowerOn(context_, 0)}};
    for (const auto& [what, failed] : steps)
      if (failed) {
        const std::string why = text();
        disconnect();
        return std::string("the Virtuose at ") + address_ + " refuses its " + what + " (" + why +
               ")";
      }
    return "";
  }
  void disconnect() override {
    if (context_) (void)calls_.virtClose(context_);
    context_ = nullptr;
  }
  void connect_again() override {
    if (context_ && stopped_) return;  // the connection is good
    disconnect();
    (void)open_it();
  }

  bool read_state(State& s) override {
    if (!context_) return false;
    float place[7], speed[6];
    int closed = 0, shifted = 0, held = 0;
    stopped_ = false;
    if (calls_.virtGetPosition(context_, place) || calls_.virtGetSpeed(context_, speed) ||
        calls_.virtGetEmergencyStop(context_, &closed) ||
        calls_.virtIsInShiftPosition(context_, &shifted) || calls_.virtGetDeadMan(context_, &held))
      return false;
    stopped_ = closed == 0;
    if (stopped_) return false;
    for (int i = 0; i < 3; ++i) {
      s.position[i] = place[i];
      s.linear[i] = speed[i], s.angular[i] = speed[3 + i];
      s.turn[1 + i] = place[3 + i];
    }
    s.turn[0] = place[6];
    s.renders = !shifted && held;
    for (int i = 0, pressed = 0; i < 4; ++i, pressed = 0)  // some handles have fewer
      if (calls_.virtGetButton(context_, i, &pressed) == 0 && pressed) s.buttons |= 1u << i;
    if (held) s.buttons |= 1u << 4;
    return true;
  }
  bool write_wrench(const double f[3], const double t[3]) override {
    float both[6];
    for (int i = 0; i < 3; ++i)
      both[i] = static_cast<float>(f[i]), both[3 + i] = static_cast<float>(t[i]);
    return context_ && calls_.virtSetForce(context_, both) == 0;
  }
  bool power(bool on) override { return context_ && calls_.virtSetPowerOn(context_, on) == 0; }
  const char* text() {
    const char* why = calls_.virtGetErrorMessage(calls_.virtGetErrorCode(context_));
    return why ? why : "no reason given";
  }
  const char* reason() override {
    return stopped_ ? "its emergency stop is pressed, or not plugged in" : context_ ? text() : "";
  }

  HaptionCalls calls_;
  std::string address_ = "127.0.0.1#53210";
  VirtContext context_ = nullptr;
  bool stopped_ = false;
};

}  // namespace

extern "C" H6_PLUGIN_EXPORT const h6DevicePluginV1 h6_device_plugin_v1 = plugin_of<Haption>(
    "Haption's Virtuose through the Virtuose API; options: library, axes, timeout [ms], "
    "max_force [N], max_torque [N m], address, period [ms].");
