// SPDX-License-Identifier: Apache-2.0
// haption_calls.h - the calls of Haption's Virtuose API (4.x) that haption.cpp uses. Written from
// the documented signatures and values.
#pragma once
#include "device/plugins/vendor_library.h"

namespace h6::plugin {

using VirtContext = void*;
enum { COMMAND_TYPE_IMPEDANCE = 3 };
enum { INDEXING_ALL_FORCE_FEEDBACK_INHIBITION = 3 };  // no force while the handle is shifted

// Results: 0, or an error whose number virtGetErrorCode has. A place is x y z [m] and a quaternion
// x y z w; speeds [m/s], [rad/s]; forces [N], [N m]; times [s].
#define H6_HAPTION_CALLS(CALL)                                                                  \
  CALL(VirtContext, virtOpen, (const char* address))                                            \
  CALL(int, virtClose, (VirtContext))                                                           \
  CALL(int, virtGetErrorCode, (VirtContext))                                                    \
  CALL(char*, virtGetErrorMessage, (int code))                                                  \
  CALL(int, virtSetTimeoutValue, (VirtContext, float seconds))                                  \
  CALL(int, virtSetIndexingMode, (VirtContext, int mode))                                       \
  CALL(int, virtSetForceFactor, (VirtContext, float factor))                                    \
  CALL(int, virtSetSpeedFactor, (VirtContext, float factor))                                    \
  CALL(int, virtSetTimeStep, (VirtContext, float seconds))                                      \
  CALL(int, virtSetBaseFrame, (VirtContext, float* place))                                      \
  CALL(int, virtSetObservationFrame, (VirtContext, float* place))                               \
  CALL(int, virtSetCommandType, (VirtContext, int type))                                        \
  CALL(int, virtSaturateTorque, (VirtContext, float force, float torque))                       \
  CALL(int, virtSetPowerOn, (VirtContext, int on))                                              \
  CALL(int, virtGetPosition, (VirtContext, float* place))                                       \
  CALL(int, virtGetSpeed, (VirtContext, float* speed))                                          \
  CALL(int, virtSetForce, (VirtContext, float* force))                                          \
  CALL(int, virtGetButton, (VirtContext, int number, int* pressed))                             \
  CALL(int, virtGetDeadMan, (VirtContext, int* held))                                           \
  CALL(int, virtGetEmergencyStop, (VirtContext, int* closed))   /* 1: it may run; 0: stopped */ \
  CALL(int, virtIsInShiftPosition, (VirtContext, int* shifted)) /* or without power */

struct HaptionCalls {
  H6_HAPTION_CALLS(H6_CALL_MEMBER)
};

}  // namespace h6::plugin
