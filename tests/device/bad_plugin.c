// SPDX-License-Identifier: Apache-2.0
/* bad_plugin.c - plug-ins that fail, in one way for each value of WRONG. */
#define _GNU_SOURCE
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "hapsix/device_plugin.h"

enum {
  NOTHING,
  ABI,
  SIZE,
  CRASH,
  HANG,
  LEAVES,
  MODES,
  RATING,
  REFUSES,
  SILENT,
  NO_READ,
  ASLEEP, /* closes all descriptors, then hangs */
  AGAIN,  /* hangs when it is opened a second time; its first option is a file that tells */
  CLOSES, /* hangs in its close, after more than one read */
  STUCK,  /* hangs in its 50th read */
  ENDS    /* hangs in its destructor */
};

static int reads = 0;
static void hang(void) {
  for (;;) sleep(1);
}
__attribute__((destructor)) static void end(void) {
  if (WRONG == ENDS) hang();
}

static int open_it(const h6PluginStart* start, h6PluginCapabilities* can, void** device,
                   char* error, size_t size) {
  if (WRONG == CRASH) raise(SIGSEGV);
  if (WRONG == LEAVES) exit(7);
  if (WRONG == HANG) hang();
  if (WRONG == ASLEEP) {
    for (int i = 0; i < 1024; ++i) close(i);
    hang();
  }
  if (WRONG == AGAIN) {
    const char* mark = start->options[0].value;
    FILE* before = fopen(mark, "r");
    if (before) hang();
    fclose(fopen(mark, "w"));
  }
  if (WRONG == REFUSES) {
    memset(error, 'x', size); /* without an end */
    memcpy(error, "the cable is not plugged in", 27);
    return 1;
  }
  if (WRONG == SILENT) return 1;
  can->dof_in = 6, can->dof_out = 6, can->max_force = 5, can->max_torque = 1;
  can->modes = WRONG == MODES ? 64 : H6_PLUGIN_IMPEDANCE;
  if (WRONG == RATING) can->max_force = -1;
  *device = NULL;
  printf("a plug-in that prints\n");
  fflush(stdout);
  return 0;
}
static int read_it(void* device, double time, h6PluginSample* sample) {
  (void)device, (void)time;
  sample->orientation[0] = 1;
  if (++reads == 50 && WRONG == STUCK) hang();
  return 0;
}
static int write_it(void* device, double time, const h6PluginCommand* command) {
  (void)device, (void)time, (void)command;
  return 0;
}
static void end_it(void* device) { (void)device; }
static void close_it(void* device) {
  (void)device;
  if (WRONG == CLOSES && reads > 1) hang();
}

#ifdef NO_SYMBOL
const h6DevicePluginV1 another_name
#else
const h6DevicePluginV1 h6_device_plugin_v1
#endif
    = {WRONG == ABI ? 7 : H6_PLUGIN_ABI,
       WRONG == SIZE ? 8 : sizeof(h6DevicePluginV1),
       NULL,
       open_it,
       WRONG == NO_READ ? NULL : read_it,
       write_it,
       end_it,
       NULL,
       close_it};
