// SPDX-License-Identifier: Apache-2.0
/* witness.c - a plug-in whose file holds the time of the newest command [s], a double. It outlives
 * the process that is killed. Option: file. */
#define _GNU_SOURCE
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "hapsix/device_plugin.h"

typedef struct Device {
  volatile double* told; /* in the file */
  h6PluginSample sample;
} Device;
static Device one;

static int open_it(const h6PluginStart* start, h6PluginCapabilities* can, void** device,
                   char* error, size_t size) {
  const char* file = start->option_count == 1 ? start->options[0].value : "";
  const int fd = open(file, O_RDWR | O_CREAT, 0600);
  if (fd < 0 || ftruncate(fd, sizeof *one.told) != 0) {
    snprintf(error, size, "the file '%s' cannot be written: give file=PATH", file);
    return 1;
  }
  void* place = mmap(NULL, sizeof *one.told, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
  close(fd);
  if (place == MAP_FAILED) return 1;
  one.told = place;
  memcpy(one.sample.position, start->home_position, sizeof start->home_position);
  memcpy(one.sample.orientation, start->home_orientation, sizeof start->home_orientation);
  snprintf(can->name, sizeof can->name, "witness");
  can->dof_in = can->dof_out = 6, can->max_force = 5, can->max_torque = 1;
  can->modes = H6_PLUGIN_IMPEDANCE;
  *device = &one;
  return 0;
}
static int read_it(void* device, double time, h6PluginSample* sample) {
  Device* d = device;
  (void)time;
  ++d->sample.sequence;
  *sample = d->sample;
  return 0;
}
static int write_it(void* device, double time, const h6PluginCommand* command) {
  Device* d = device;
  (void)command;
  *d->told = time;
  return 0;
}
static void stop_it(void* device) { (void)device; }
static int arm_it(void* device) { return (void)device, 0; }
static void close_it(void* device) { munmap((void*)((Device*)device)->told, sizeof(double)); }

const h6DevicePluginV1 h6_device_plugin_v1 = {H6_PLUGIN_ABI,
                                              sizeof(h6DevicePluginV1),
                                              "Tells a file when it was written; option: file.",
                                              open_it,
                                              read_it,
                                              write_it,
                                              stop_it,
                                              arm_it,
                                              close_it};
