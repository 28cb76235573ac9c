// SPDX-License-Identifier: Apache-2.0
// dhd_calls.h - the calls of Force Dimension's DHD SDK (3.x) that dhd.cpp uses. Written from the
// documented signatures; every call that takes a device's number has it last.
#pragma once
#include "device/plugins/vendor_library.h"

namespace h6::plugin {

// Results: below 0 an error, whose text dhdErrorGetLastStr has for the thread that called.
enum { DHD_TIMEGUARD = 1 };      // from a get: too soon after the last, the values are the old ones
enum { DHD_ERROR_TIMEOUT = 7 };  // dhdErrorGetLast: a velocity needs two positions within 20 ms

// [m], [m/s], [rad/s], [N], [N m]; a matrix is stored by rows. dhdSetWatchdog counts 125 us.
#define H6_DHD_CALLS(CALL)                                                        \
  CALL(int, dhdOpen, ())                                                          \
  CALL(int, dhdOpenSerial, (int serial))                                          \
  CALL(int, dhdGetSerialNumber, (unsigned short* serial, char id))                \
  CALL(int, dhdClose, (char id))                                                  \
  CALL(int, dhdErrorGetLast, ())                                                  \
  CALL(const char*, dhdErrorGetLastStr, ())                                       \
  CALL(const char*, dhdGetSystemName, (char id))                                  \
  CALL(bool, dhdHasWrist, (char id))                                              \
  CALL(bool, dhdHasActiveWrist, (char id))                                        \
  CALL(int, dhdEnableForce, (unsigned char on, char id))                          \
  CALL(int, dhdEnableExpertMode, ())                                              \
  CALL(int, dhdDisableExpertMode, ())                                             \
  CALL(int, dhdSetWatchdog, (unsigned char duration, char id))                    \
  CALL(int, dhdGetPosition, (double* x, double* y, double* z, char id))           \
  CALL(int, dhdGetPositionAndOrientationFrame,                                    \
       (double* x, double* y, double* z, double matrix[3][3], char id))           \
  CALL(int, dhdGetLinearVelocity, (double* x, double* y, double* z, char id))     \
  CALL(int, dhdGetAngularVelocityRad, (double* x, double* y, double* z, char id)) \
  CALL(unsigned, dhdGetButtonMask, (char id))                                     \
  CALL(int, dhdSetForceAndTorque,                                                 \
       (double fx, double fy, double fz, double tx, double ty, double tz, char id))

struct DhdCalls {
  H6_DHD_CALLS(H6_CALL_MEMBER)
};

}  // namespace h6::plugin
