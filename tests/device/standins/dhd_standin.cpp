// SPDX-License-Identifier: Apache-2.0
// dhd_standin.cpp - in place of Force Dimension's SDK: a device with serial 7 and the calls that
// dhd.cpp uses.
#include "device/plugins/dhd_calls.h"
#include "tests/device/standins/standin.h"

using h6::standin::Fault;

h6::standin::Standin standin;

namespace {

constexpr char kId = 3;
std::atomic<bool> expert{false};
std::atomic<int> error{0};
std::atomic<bool> moved_once{false};  // a velocity needs two places

int result(bool good) {
  error = good ? 0 : 2;
  return good ? 0 : -1;
}
bool ours(char id) {
  if (id != kId) ++standin.misused;
  return id == kId && standin.open;
}

}  // namespace

#pragma GCC visibility push(default)
extern "C" {
int dhdOpen() {
  if (!standin.open_it()) return result(false);
  moved_once = false;
  return kId;
}
int dhdOpenSerial(int serial) { return serial == 7 ? dhdOpen() : result(false); }
int dhdGetSerialNumber(unsigned short* serial, char id) {
  if (!ours(id)) return result(false);
  return *serial = static_cast<unsigned short>(standin.serial), 0;
}
int dhdClose(char id) {
  if (!ours(id)) return result(false);
  return standin.close_it(), 0;
}
int dhdErrorGetLast() { return error; }
const char* dhdErrorGetLastStr() { return error == 2 ? "communication error" : "no error"; }
const char* dhdGetSystemName(char) { return "omega.stand-in"; }
bool dhdHasWrist(char) { return standin.turns; }
bool dhdHasActiveWrist(char) { return standin.torques; }
int dhdEnableForce(unsigned char on, char id) {
  if (!ours(id) || standin.has(Fault::unplugged)) return result(false);
  return standin.switch_power(on), 0;
}
int dhdEnableExpertMode() { return expert = true, 0; }
int dhdDisableExpertMode() { return expert = false, 0; }
int dhdSetWatchdog(unsigned char duration, char id) {
  if (!ours(id) || !expert) return result(false);
  return standin.watchdog = 125e-6 * duration, 0;
}
int dhdGetPosition(double* x, double* y, double* z, char id) {
  if (!ours(id) || !standin.read()) return result(false);
  *x = standin.coordinate(0), *y = standin.coordinate(1), *z = standin.coordinate(2);
  return 0;
}
int dhdGetPositionAndOrientationFrame(double* x, double* y, double* z, double m[3][3], char id) {
  if (!standin.turns) return result(false);
  standin.matrix(m);
  return dhdGetPosition(x, y, z, id);
}
int dhdGetLinearVelocity(double* x, double* y, double* z, char id) {
  if (!ours(id)) return result(false);
  if (!moved_once.exchange(true)) return error = h6::plugin::DHD_ERROR_TIMEOUT, -1;
  *x = standin.velocity(0), *y = standin.velocity(1), *z = standin.velocity(2);
  return 0;
}
int dhdGetAngularVelocityRad(double* x, double* y, double* z, char id) {
  if (!ours(id) || !standin.turns) return result(false);
  return *x = *y = *z = 0, 0;
}
unsigned dhdGetButtonMask(char id) { return ours(id) ? standin.buttons.load() : 0; }
int dhdSetForceAndTorque(double fx, double fy, double fz, double tx, double ty, double tz,
                         char id) {
  const double f[3] = {fx, fy, fz}, t[3] = {tx, ty, tz};
  if (!ours(id) || !standin.write(f, t)) return result(false);
  return std::fabs(fz) > 4 ? 2 : 0;  // a motor is at its limit
}
}
#pragma GCC visibility pop

#define CHECK_CALL(result, name, arguments) H6_STANDIN_CALL(DhdCalls, name);
H6_DHD_CALLS(CHECK_CALL)
