// SPDX-License-Identifier: Apache-2.0
/* template_device.c - a plug-in to start from: a handle of 0.3 kg that a spring holds where it
 * began. Put your driver's calls where the spring is. Build and try it:
 *
 *   cc -shared -fPIC -I runtime/include device/plugins/template_device.c -o template.so
 *   hapsix devices plugin:./template.so --test */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "hapsix/device_plugin.h"

typedef struct {
  h6PluginStart home;
  double stiffness, time, moved[3], velocity[3], force[3];
  volatile int stopped; /* written by any thread, read by one */
} Device;

static int open_device(const h6PluginStart* start, h6PluginCapabilities* can, void** device,
                       char* error, size_t error_size) {
  double stiffness = 500; /* [N/m] */
  for (size_t i = 0; i < start->option_count; ++i) {
    if (strcmp(start->options[i].key, "stiffness") == 0) stiffness = atof(start->options[i].value);
    if (strcmp(start->options[i].key, "stiffness") != 0 || !(stiffness > 0)) {
      snprintf(error, error_size, "the only option is stiffness=NEWTONS_PER_METRE, above 0");
      return 1;
    }
  }
  Device* d = calloc(1, sizeof *d);
  if (!d) return 1;
  d->home = *start;
  d->stiffness = stiffness;
  snprintf(can->name, sizeof can->name, "a handle on a spring");
  can->dof_in = 6, can->dof_out = 3;
  can->max_force = 10, can->modes = H6_PLUGIN_IMPEDANCE;
  *device = d;
  return 0;
}

/* Your device's newest sample; here a step of the spring, the handle's mass and some damping. */
static int read_device(void* device, double time, h6PluginSample* sample) {
  Device* d = device;
  double left = time - d->time;
  d->time = time;
  for (int n = 0; left > 0 && n < 1000; ++n, left -= 1e-4)
    for (int i = 0; i < 3; ++i) {
      const double motor = d->stopped ? 0 : d->force[i];
      d->velocity[i] += 1e-4 / 0.3 * (motor - d->stiffness * d->moved[i] - 10 * d->velocity[i]);
      d->moved[i] += 1e-4 * d->velocity[i];
    }
  for (int i = 0; i < 3; ++i) {
    sample->position[i] = d->home.home_position[i] + d->moved[i];
    sample->linear[i] = d->velocity[i];
  }
  memcpy(sample->orientation, d->home.home_orientation, sizeof sample->orientation);
  return 0;
}

static int write_device(void* device, double time, const h6PluginCommand* command) {
  (void)time;
  memcpy(((Device*)device)->force, command->force, sizeof command->force);
  return 0;
}
static void stop_device(void* device) { ((Device*)device)->stopped = 1; }
static int arm_device(void* device) { return ((Device*)device)->stopped = 0; }

const h6DevicePluginV1 h6_device_plugin_v1 = {H6_PLUGIN_ABI,
                                              sizeof(h6DevicePluginV1),
                                              "A handle on a spring; option: stiffness [N/m].",
                                              open_device,
                                              read_device,
                                              write_device,
                                              stop_device,
                                              arm_device,
                                              free};
