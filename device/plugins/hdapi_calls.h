// SPDX-License-Identifier: Apache-2.0
// hdapi_calls.h - the calls of 3D Systems' OpenHaptics (HDAPI 3.x) that hdapi.cpp uses. Written
// from the documented signatures and values.
#pragma once
#include "device/plugins/vendor_library.h"

namespace h6::plugin {

struct HdError {
  unsigned code;  // 0: the stack of errors is empty
  int internal;
  unsigned device;
};
using HdCallback = unsigned (*)(void*);

enum : unsigned {
  HD_INVALID_HANDLE = 0xFFFFFFFF,
  HD_CALLBACK_DONE = 0,
  HD_CALLBACK_CONTINUE = 1,
  HD_CURRENT_BUTTONS = 0x2000,
  HD_CURRENT_VELOCITY = 0x2051,   // [mm/s]
  HD_CURRENT_TRANSFORM = 0x2052,  // 16 numbers by columns, the place in 12 .. 14 [mm]
  HD_DEVICE_MODEL_TYPE = 0x2501,
  HD_INPUT_DOF = 0x2553,
  HD_OUTPUT_DOF = 0x2554,
  HD_CALIBRATION_STYLE = 0x2555,
  HD_NOMINAL_MAX_CONTINUOUS_FORCE = 0x2604,         // [N]
  HD_NOMINAL_MAX_TORQUE_CONTINUOUS_FORCE = 0x2623,  // [mN m]
  HD_CURRENT_FORCE = 0x2700,                        // [N]
  HD_CURRENT_TORQUE = 0x2701,  // [mN m]; for devices with 6 motors, called deprecated
  HD_FORCE_OUTPUT = 0x4000,
  HD_MAX_FORCE_CLAMPING = 0x4001,
  HD_CALIBRATION_OK = 0x5000,
  HD_CALIBRATION_NEEDS_UPDATE = 0x5001,
  HD_CALIBRATION_NEEDS_MANUAL_INPUT = 0x5002
};
inline constexpr unsigned short HD_DEFAULT_SCHEDULER_PRIORITY = 0x7FFF;

#define H6_HDAPI_CALLS(CALL)                                       \
  CALL(unsigned, hdInitDevice, (const char* name))                 \
  CALL(void, hdDisableDevice, (unsigned device))                   \
  CALL(void, hdMakeCurrentDevice, (unsigned device))               \
  CALL(void, hdBeginFrame, (unsigned device))                      \
  CALL(void, hdEndFrame, (unsigned device))                        \
  CALL(HdError, hdGetError, ())                                    \
  CALL(const char*, hdGetErrorString, (unsigned code))             \
  CALL(void, hdEnable, (unsigned capability))                      \
  CALL(void, hdDisable, (unsigned capability))                     \
  CALL(const char*, hdGetString, (unsigned name))                  \
  CALL(void, hdGetIntegerv, (unsigned name, int* out))             \
  CALL(void, hdGetDoublev, (unsigned name, double* out))           \
  CALL(void, hdSetDoublev, (unsigned name, const double* in))      \
  CALL(unsigned, hdCheckCalibration, ())                           \
  CALL(void, hdUpdateCalibration, (unsigned style))                \
  CALL(unsigned long, hdScheduleAsynchronous,                      \
       (HdCallback callback, void* user, unsigned short priority)) \
  CALL(void, hdUnschedule, (unsigned long handle))                 \
  CALL(void, hdStartScheduler, ())                                 \
  CALL(void, hdStopScheduler, ())

struct HdapiCalls {
  H6_HDAPI_CALLS(H6_CALL_MEMBER)
};

}  // namespace h6::plugin
