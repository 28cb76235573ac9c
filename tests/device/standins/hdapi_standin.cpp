// SPDX-License-Identifier: Apache-2.0
// hdapi_standin.cpp - in place of OpenHaptics' HDAPI: a device with a servo loop and the calls that
// hdapi.cpp uses, in millimetres. It has a stack of errors, and counts what HDAPI forbids: a frame
// within a frame, and values outside of one.
#include <vector>

#include "device/plugins/hdapi_calls.h"
#include "tests/device/standins/standin.h"

using h6::plugin::HdCallback;
using h6::plugin::HdError;
using h6::standin::Fault;
namespace hd = h6::plugin;

h6::standin::Standin standin;

namespace {

constexpr unsigned kDevice = 5;
thread_local std::vector<unsigned> errors;
thread_local bool framed = false;
double force[3], torque[3];  // of the frame
HdCallback callback = nullptr;
void* user = nullptr;
std::atomic<bool> running{false};
std::thread loop;

void fail(unsigned code) { errors.push_back(code); }
void within_a_frame(bool must) {
  if (framed != must) ++standin.misused, fail(0x0402);
}

}  // namespace

#pragma GCC visibility push(default)
extern "C" {
unsigned hdInitDevice(const char* name) {
  if ((name && std::strcmp(name, "Left") != 0) || !standin.open_it())
    return fail(0x0300), static_cast<unsigned>(hd::HD_INVALID_HANDLE);
  return kDevice;
}
void hdDisableDevice(unsigned) { standin.close_it(); }
void hdMakeCurrentDevice(unsigned device) {
  if (device != kDevice) fail(0x0104);
}
void hdBeginFrame(unsigned) { within_a_frame(false), framed = true; }
void hdEndFrame(unsigned) {
  within_a_frame(true);
  framed = false;
  if (!standin.write(force, torque)) fail(0x0302);
}
HdError hdGetError() {
  if (errors.empty()) return {0, 0, 0};
  const unsigned code = errors.back();
  errors.pop_back();
  return {code, 0, kDevice};
}
const char* hdGetErrorString(unsigned code) {
  return code == 0x0302 ? "comm error" : "device fault";
}
void hdEnable(unsigned what) {
  if (what == hd::HD_FORCE_OUTPUT) standin.switch_power(true);
}
void hdDisable(unsigned what) {
  if (what == hd::HD_FORCE_OUTPUT) standin.switch_power(false);
}
const char* hdGetString(unsigned) { return "stand-in"; }
void hdGetIntegerv(unsigned name, int* out) {
  switch (name) {
    case hd::HD_CURRENT_BUTTONS:
      return within_a_frame(true), *out = static_cast<int>(standin.buttons), void();
    case hd::HD_INPUT_DOF:
      return *out = standin.turns ? 6 : 3, void();
    case hd::HD_OUTPUT_DOF:
      return *out = standin.torques ? 6 : 3, void();
    case hd::HD_CALIBRATION_STYLE:
      return *out = 4, void();
    default:
      return fail(0x0100);
  }
}
void hdGetDoublev(unsigned name, double* out) {
  switch (name) {
    case hd::HD_CURRENT_TRANSFORM: {
      within_a_frame(true);
      if (!standin.read()) return fail(0x0302);
      double m[3][3];
      standin.matrix(m);
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) out[4 * j + i] = m[i][j];
        out[12 + i] = 1e3 * standin.coordinate(i);
        out[4 * i + 3] = 0;
      }
      return out[15] = 1, void();
    }
    case hd::HD_CURRENT_VELOCITY:
      within_a_frame(true);
      for (int i = 0; i < 3; ++i) out[i] = 1e3 * standin.velocity(i);
      return;
    case hd::HD_NOMINAL_MAX_CONTINUOUS_FORCE:
      return *out = 1.5, void();
    case hd::HD_NOMINAL_MAX_TORQUE_CONTINUOUS_FORCE:
      return standin.torques ? *out = 100, void() : fail(0x0100);
    default:
      return fail(0x0100);
  }
}
void hdSetDoublev(unsigned name, const double* in) {
  within_a_frame(true);
  if (name != hd::HD_CURRENT_FORCE && name != hd::HD_CURRENT_TORQUE) return fail(0x0100);
  std::memcpy(name == hd::HD_CURRENT_FORCE ? force : torque, in, sizeof force);
}
unsigned hdCheckCalibration() {
  return standin.has(Fault::special) ? hd::HD_CALIBRATION_NEEDS_MANUAL_INPUT
                                     : hd::HD_CALIBRATION_OK;
}
void hdUpdateCalibration(unsigned) {}
unsigned long hdScheduleAsynchronous(HdCallback to, void* with, unsigned short) {
  return callback = to, user = with, 9;
}
void hdUnschedule(unsigned long) { callback = nullptr; }
void hdStartScheduler() {
  if (running.exchange(true)) return fail(0x0102);
  loop = std::thread([] {
    while (running) {
      if (callback(user) != hd::HD_CALLBACK_CONTINUE) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  });
}
void hdStopScheduler() {
  running = false;
  if (loop.joinable()) loop.join();
}
}
#pragma GCC visibility pop

#define CHECK_CALL(result, name, arguments) H6_STANDIN_CALL(HdapiCalls, name);
H6_HDAPI_CALLS(CHECK_CALL)
