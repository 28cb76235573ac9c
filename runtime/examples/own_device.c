// SPDX-License-Identifier: Apache-2.0
/* own_device.c - a device of your own on the engine's haptic thread: read, write, stop. This one is
 * simulated: it goes down 2 mm in 0.1 s and yields 1 mm for every newton that it is pushed. */
#include <stdio.h>

#include "floor.h"

typedef struct Arm {
  double force, most;
} Arm;

static int read_arm(void* self, double time, h6DeviceSample* out) {
  const Arm* arm = self;
  *out = h6DefaultDeviceSample();
  out->pose.p.x = out->pose.p.y = 4e-3;
  out->pose.p.z = 5e-3 - 2e-2 * (time < 0.1 ? time : 0.1) + 1e-3 * arm->force;
  return 0; /* not 0: the device is lost */
}

static int write_arm(void* self, double time, const h6DeviceCommand* command) {
  Arm* arm = self;
  (void)time;
  arm->force = 0.99 * arm->force + 0.01 * command->wrench.force.z; /* it is slow */
  if (arm->force > arm->most) arm->most = arm->force;
  return 0;
}

static void stop_arm(void* self) { ((Arm*)self)->force = 0; } /* any thread, and signal handlers */

int main(void) {
  h6Error error;
  h6Model* model = floor_and_tip(h6DefaultModelDef(), &error);
  h6Session* session = model ? hold_tip(model, h6DefaultSessionDef(), &error) : NULL;
  if (!session) return fprintf(stderr, "%s\n", error.message), 1;
  Arm arm = {0, 0};
  h6Device device = h6DefaultDevice();
  device.self = &arm, device.read = read_arm, device.write = write_arm, device.stop = stop_arm;
  device.capabilities.max_force = 3;
  device.capabilities.frame_time = true; /* a simulation; a real arm leaves this out */
  h6LoopDef def = h6DefaultLoopDef();
  def.duration = 0.5;
  h6Loop* loop = h6StartLoop(session, &device, &def, &error);
  if (!loop) return fprintf(stderr, "%s\n", error.message), 1;
  h6LoopReport report;
  h6JoinLoop(loop, &report);
  printf("%llu frames, fault: %s, the arm felt up to %.2f N\n", (unsigned long long)report.frames,
         h6CauseName(report.fault), arm.most);
  h6DestroyLoop(loop), h6DestroySession(session), h6DestroyModel(model);
  return 0;
}
