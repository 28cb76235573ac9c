// SPDX-License-Identifier: Apache-2.0
// haption_standin.cpp - in place of Haption's Virtuose API: a device at 127.0.0.1#53210 and the
// calls that haption.cpp uses. It counts what the API forbids: settings after the type of command,
// and forces of another type.
#include "device/plugins/haption_calls.h"
#include "tests/device/standins/standin.h"

using h6::plugin::VirtContext;
using h6::standin::Fault;

h6::standin::Standin standin;

namespace {

std::atomic<int> type{0}, error{0};
int token;  // its address is the context

int result(bool good) {
  error = good ? 0 : 2;
  return good ? 0 : -1;
}
bool ours(VirtContext context) {
  if (context != &token) ++standin.misused;
  return context == &token && standin.open && !standin.has(Fault::unplugged);
}
int setting(VirtContext context) {
  if (type != 0) ++standin.misused;
  return result(ours(context));
}
int frame(VirtContext context, const float* place) {
  const bool none = place[0] == 0 && place[3] == 0 && place[6] == 1;
  return result(ours(context) && none);
}

}  // namespace

#pragma GCC visibility push(default)
extern "C" {
VirtContext virtOpen(const char* address) {
  if (std::strcmp(address, "127.0.0.1#53210") != 0 || !standin.open_it())
    return result(false), nullptr;
  type = 0;
  return &token;
}
int virtClose(VirtContext context) {
  if (context != &token) ++standin.misused;
  return standin.close_it(), 0;
}
int virtGetErrorCode(VirtContext) { return error; }
char* virtGetErrorMessage(int code) {
  static char none[] = "no error", lost[] = "communication failure";
  return code == 2 ? lost : none;
}
int virtSetTimeoutValue(VirtContext c, float seconds) { return result(ours(c) && seconds > 0); }
int virtSetIndexingMode(VirtContext c, int mode) { return result(ours(c) && mode == 3); }
int virtSetForceFactor(VirtContext c, float factor) { return factor == 1 ? setting(c) : -1; }
int virtSetSpeedFactor(VirtContext c, float factor) { return factor == 1 ? setting(c) : -1; }
int virtSetTimeStep(VirtContext c, float seconds) { return seconds > 0 ? setting(c) : -1; }
int virtSetBaseFrame(VirtContext c, float* place) { return frame(c, place); }
int virtSetObservationFrame(VirtContext c, float* place) { return frame(c, place); }
int virtSetCommandType(VirtContext c, int wanted) { return type = wanted, result(ours(c)); }
int virtSaturateTorque(VirtContext c, float force, float torque) {
  return result(ours(c) && force > 0 && torque > 0);
}
int virtSetPowerOn(VirtContext c, int on) {
  if (!ours(c)) return result(false);
  return standin.switch_power(on != 0), 0;
}
int virtGetPosition(VirtContext c, float* place) {
  if (!ours(c) || !standin.read()) return result(false);
  for (int i = 0; i < 3; ++i) place[i] = static_cast<float>(standin.coordinate(i));
  const float half = static_cast<float>(standin.turn / 2);
  place[3] = std::sin(half), place[4] = place[5] = 0, place[6] = std::cos(half);
  if (standin.has(Fault::garbage)) place[6] = 7;
  return 0;
}
int virtGetSpeed(VirtContext c, float* speed) {
  for (int i = 0; i < 3; ++i) speed[i] = static_cast<float>(standin.velocity(i)), speed[3 + i] = 0;
  return result(ours(c));
}
int virtSetForce(VirtContext c, float* both) {
  if (type != h6::plugin::COMMAND_TYPE_IMPEDANCE) ++standin.misused;
  const double f[3] = {both[0], both[1], both[2]}, t[3] = {both[3], both[4], both[5]};
  return result(ours(c) && standin.write(f, t));
}
int virtGetButton(VirtContext c, int number, int* pressed) {
  if (number > 1) return -1;  // this handle has two
  *pressed = standin.buttons >> number & 1;
  return result(ours(c));
}
int virtGetDeadMan(VirtContext c, int* held) { return *held = standin.held, result(ours(c)); }
int virtGetEmergencyStop(VirtContext c, int* closed) {
  return *closed = !standin.has(Fault::special), result(ours(c));
}
int virtIsInShiftPosition(VirtContext c, int* shifted) {
  return *shifted = standin.shifted, result(ours(c));
}
}
#pragma GCC visibility pop

#define CHECK_CALL(result, name, arguments) H6_STANDIN_CALL(HaptionCalls, name);
H6_HAPTION_CALLS(CHECK_CALL)
