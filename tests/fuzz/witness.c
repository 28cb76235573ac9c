// SPDX-License-Identifier: Apache-2.0
/* witness.c - a plug-in that keeps in a file what a device got and when. The file outlives the process
 * that is killed.
 *
 *   double newest;                     time of the newest command since the run began [s]
 *   uint64_t count, room;              rows that were told, and how many fit
 *   { double at, force; uint32_t what, trouble; } row[room];
 *
 * `at` is CLOCK_MONOTONIC [s], `force` the norm of the motors' force from then on [N]. A stop takes
 * the force away until arm, as in a real drive. Options: file; rows (0: only `newest` is kept); seed
 * and every: a hand that presses down, with a fault of its own every so many seconds on average:
 *
 *   lost    read fails                        freeze  the same sample again and again
 *   nan     a sample that is not a number     jump    a sample 0.3 m away
 *   stall   read sleeps
 *
 * A thread above all others wakes up every millisecond on the core that reads, and tells of each time
 * that it came half a millisecond late: then the machine stood still, and no program could have done
 * anything. */
#define _GNU_SOURCE
#include <fcntl.h>
#include <math.h>
#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

#include "hapsix/device_plugin.h"

enum { WRITE, STOP, ARM, BEGINS, ENDS, STOOD_STILL }; /* what */
enum { NONE, LOST, NAN_SAMPLE, FREEZE, JUMP, STALL, TROUBLES };
static const double kShortest[TROUBLES] = {0, 1e-3, 1e-3, 0.01, 1e-3, 3e-3}; /* [s] */
static const double kLongest[TROUBLES] = {0, 0.05, 0.05, 0.15, 0.05, 0.08};

typedef struct Row {
  double at, force;
  uint32_t what, trouble;
} Row;
typedef struct Told {
  volatile double newest;
  _Atomic uint64_t count;
  uint64_t room;
  Row row[];
} Told;
typedef struct Device {
  Told* told; /* in the file */
  size_t size;
  h6PluginSample sample, home;
  double every, next, ends; /* [s] of the run; every 0: no fault */
  uint32_t trouble;
  uint64_t random;
  atomic_int stopped, over, core;
  pthread_t pulse;
} Device;
static Device one;

static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void tell(Device* d, uint32_t what, double force) {
  if (d->told->room == 0) return;
  const double at = now();
  const uint64_t i = atomic_fetch_add(&d->told->count, 1);
  if (i < d->told->room) d->told->row[i] = (Row){at, force, what, d->trouble};
}

static double draw(Device* d, double low, double high) {
  uint64_t z = d->random += 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  z ^= z >> 31;
  return low + (high - low) * (double)(z >> 11) * 0x1p-53;
}

static void sleep_s(double seconds) {
  const struct timespec t = {0, (long)(1e9 * seconds)};
  nanosleep(&t, NULL);
}

static void* pulse(void* self) {
  Device* d = self;
  const struct sched_param top = {sched_get_priority_max(SCHED_FIFO)};
  pthread_setschedparam(pthread_self(), SCHED_FIFO, &top);
  int core = -1;
  for (double last = now(); !atomic_load(&d->over);) {
    if (core != atomic_load(&d->core)) {
      cpu_set_t there;
      core = atomic_load(&d->core);
      CPU_ZERO(&there);
      CPU_SET(core, &there);
      pthread_setaffinity_np(pthread_self(), sizeof there, &there);
    }
    sleep_s(1e-3);
    const double at = now();
    if (at - last > 1.5e-3) tell(d, STOOD_STILL, at - last);
    last = at;
  }
  return NULL;
}

static int refuse(char* error, size_t size, const char* what) {
  snprintf(error, size, "%s", what);
  return 1;
}

static int open_it(const h6PluginStart* start, h6PluginCapabilities* can, void** device,
                   char* error, size_t size) {
  Device* d = &one;
  memset(d, 0, sizeof *d);
  const char* file = "";
  uint64_t room = 0;
  for (size_t i = 0; i < start->option_count; ++i) {
    const char *key = start->options[i].key, *value = start->options[i].value;
    if (strcmp(key, "file") == 0) file = value;
    if (strcmp(key, "rows") == 0) room = strtoull(value, NULL, 10);
    if (strcmp(key, "seed") == 0) d->random = strtoull(value, NULL, 10);
    if (strcmp(key, "every") == 0) d->every = atof(value);
  }
  const int fd = open(file, O_RDWR | O_CREAT, 0600);
  d->size = sizeof(Told) + room * sizeof(Row);
  if (fd < 0 || ftruncate(fd, (off_t)d->size) != 0)
    return refuse(error, size, "the file cannot be written: give file=PATH");
  void* place = mmap(NULL, d->size, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
  close(fd);
  if (place == MAP_FAILED) return refuse(error, size, "the file cannot be mapped");
  d->told = place;
  d->told->newest = 0;
  atomic_store(&d->told->count, 0);
  d->told->room = room;
  memcpy(d->home.position, start->home_position, sizeof start->home_position);
  memcpy(d->home.orientation, start->home_orientation, sizeof start->home_orientation);
  d->sample = d->home;
  d->next = d->every > 0 ? draw(d, 0.3, 0.3 + 2 * d->every) : 1e300;
  if (room > 0) pthread_create(&d->pulse, NULL, pulse, d);
  snprintf(can->name, sizeof can->name, "witness");
  can->dof_in = can->dof_out = 6, can->max_force = 5, can->max_torque = 1;
  can->modes = H6_PLUGIN_IMPEDANCE;
  if (d->every > 0) can->freeze_time = 0.05;
  *device = d;
  return 0;
}

static void turn_trouble(Device* d, double time) {
  if (d->trouble != NONE && time >= d->ends) {
    tell(d, ENDS, 0);
    d->trouble = NONE;
    d->next = time + draw(d, 0.1, 2 * d->every);
  }
  if (d->trouble != NONE || time < d->next) return;
  d->trouble = 1 + (uint32_t)draw(d, 0, TROUBLES - 1);
  /* Most are short, because the first long one latches and ends the force of a run. */
  const double share = draw(d, 0, 1), cube = share * share * share;
  d->ends = time + kShortest[d->trouble] + cube * (kLongest[d->trouble] - kShortest[d->trouble]);
  tell(d, BEGINS, 0);
}

static int read_it(void* device, double time, h6PluginSample* sample) {
  Device* d = device;
  atomic_store(&d->core, sched_getcpu());
  turn_trouble(d, time);
  if (d->trouble == LOST) return 1;
  if (d->trouble == STALL) {
    sleep_s(d->ends - time);
    d->ends = time;
  }
  if (d->trouble != FREEZE) {
    const double swing = 0.5 * (1 - cos(8 * time)), pace = 4 * sin(8 * time);
    ++d->sample.sequence;
    if (d->every > 0) {
      d->sample.position[2] = d->home.position[2] - 0.02 * swing;
      d->sample.linear[2] = -0.02 * pace;
    }
  }
  *sample = d->sample;
  if (d->trouble == NAN_SAMPLE) sample->position[1] = NAN;
  if (d->trouble == JUMP) sample->position[0] += 0.3;
  return 0;
}

static int write_it(void* device, double time, const h6PluginCommand* command) {
  Device* d = device;
  const double* f = command->force;
  d->told->newest = time;
  const double norm = sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]);
  tell(d, WRITE, atomic_load(&d->stopped) ? 0 : norm);
  return d->trouble == LOST;
}
static void stop_it(void* device) {
  atomic_store(&((Device*)device)->stopped, 1);
  tell(device, STOP, 0);
}
static int arm_it(void* device) {
  atomic_store(&((Device*)device)->stopped, 0);
  return tell(device, ARM, 0), 0;
}
static void close_it(void* device) {
  Device* d = device;
  atomic_store(&d->over, 1);
  if (d->told->room > 0) pthread_join(d->pulse, NULL);
  munmap(d->told, d->size);
}

const h6DevicePluginV1 h6_device_plugin_v1 = {
    H6_PLUGIN_ABI,
    sizeof(h6DevicePluginV1),
    "Keeps in a file what it got and when; options: file, rows, seed, every.",
    open_it,
    read_it,
    write_it,
    stop_it,
    arm_it,
    close_it};
