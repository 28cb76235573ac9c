// SPDX-License-Identifier: Apache-2.0
/* udp_arm.c - a plug-in for an arm that is reached through a network (udp_arm_protocol.h).
 *
 *   build/release/hapsix_udp_arm --port 47806 &
 *   hapsix run SCENE --device 'plugin:build/release/plugins/udp_arm.so?port=47806'
 *
 * It needs no thread: once a frame it sends and receives datagrams without waiting. The answer to a
 * frame's command is read in the next frame. */
#include <arpa/inet.h>
#include <errno.h>
#include <netinet/in.h>
#include <poll.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "device/plugins/grip.h"
#include "device/plugins/udp_arm_protocol.h"
#include "hapsix/device_plugin.h"

typedef struct Device {
  h6PluginStart start; /* its options are not read after open */
  int socket;
  uint32_t number;
  UdpArmSample newest;
  double waits;    /* time of the oldest command without an answer; 0: none [s] */
  double patience; /* longest wait for an answer [s] */
  atomic_int stopped;
} Device;

static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void send_command(Device* d, uint32_t motors, const h6PluginCommand* from) {
  UdpArmCommand c;
  memset(&c, 0, sizeof c);
  c.mark = UDP_ARM_COMMAND, c.number = d->number, c.motors = motors;
  if (motors) {
    memcpy(c.force, from->force, sizeof c.force);
    memcpy(c.torque, from->torque, sizeof c.torque);
  }
  if (d->waits == 0) d->waits = now();
  /* When nobody listens or a queue is full, no samples arrive, and read reports that. */
  (void)!send(d->socket, &c, sizeof c, MSG_DONTWAIT | MSG_NOSIGNAL);
}

/* Reads all queued datagrams and keeps the newest. */
static void take_samples(Device* d) {
  UdpArmSample s;
  for (int n = 0; n < 100; ++n) {
    const ssize_t bytes = recv(d->socket, &s, sizeof s, MSG_DONTWAIT | MSG_TRUNC);
    if (bytes < 0 && errno != ECONNREFUSED) return;
    if (bytes >= 0 && udp_arm_take(&s, (size_t)bytes, d->number, &d->newest)) d->waits = 0;
  }
}

static int fail(char* error, size_t size, const char* what, const char* which) {
  snprintf(error, size, "%s%s", what, which);
  return 1;
}

static int open_device(const h6PluginStart* start, h6PluginCapabilities* can, void** device,
                       char* error, size_t error_size) {
  double patience = 1e-3 * UDP_ARM_SILENCE;
  struct sockaddr_in to;
  memset(&to, 0, sizeof to);
  to.sin_family = AF_INET;
  to.sin_port = htons(UDP_ARM_PORT);
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  for (size_t i = 0; i < start->option_count; ++i) {
    const char *key = start->options[i].key, *value = start->options[i].value;
    if (strcmp(key, "host") == 0) {
      if (inet_pton(AF_INET, value, &to.sin_addr) != 1)
        return fail(error, error_size, "host must be an address like 127.0.0.1, not ", value);
    } else if (strcmp(key, "port") == 0) {
      char* end;
      const long port = strtol(value, &end, 10);
      if (*value == '\0' || *end != '\0' || port < 1 || port > 65535)
        return fail(error, error_size, "port must be 1 to 65535, not ", value);
      to.sin_port = htons((uint16_t)port);
    } else if (strcmp(key, "timeout") == 0) {
      patience = 1e-3 * atof(value);
      if (!(patience >= 1e-3 && patience <= 10))
        return fail(error, error_size, "timeout must be 1 to 10000 ms, not ", value);
    } else {
      return fail(error, error_size, "the options are host, port and timeout, not ", key);
    }
  }
  Device* d = calloc(1, sizeof *d);
  if (!d) return fail(error, error_size, "out of memory", "");
  d->start = *start;
  d->patience = patience;
  d->start.options = NULL, d->start.option_count = 0;
  atomic_init(&d->stopped, 0);
  d->socket = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (d->socket < 0 || connect(d->socket, (struct sockaddr*)&to, sizeof to) != 0) {
    if (d->socket >= 0) close(d->socket);
    free(d);
    return fail(error, error_size, "no socket: ", strerror(errno));
  }
  for (int attempt = 0; attempt < 10 && d->newest.mark == 0; ++attempt) {
    send_command(d, 0, NULL);
    struct pollfd wait = {d->socket, POLLIN, 0};
    poll(&wait, 1, 50);
    if (wait.revents & POLLERR) usleep(50000); /* nobody there yet */
    take_samples(d);
  }
  if (d->newest.mark == 0) {
    char where[INET_ADDRSTRLEN] = "";
    inet_ntop(AF_INET, &to.sin_addr, where, sizeof where);
    snprintf(error, error_size, "no arm answers at %s, UDP port %d: start it first", where,
             ntohs(to.sin_port));
    close(d->socket);
    free(d);
    return 1;
  }
  snprintf(can->name, sizeof can->name, "arm over UDP");
  can->dof_in = 6, can->dof_out = 6;
  can->max_force = 30, can->max_torque = 3;
  can->modes = H6_PLUGIN_IMPEDANCE;
  can->rate = 1000;
  /* A silent arm is reported as lost after `patience`; a longer freeze_time keeps the host from
   * calling it frozen before that. */
  can->freeze_time = d->patience < 0.5 ? 2 * d->patience : 1;
  *device = d;
  return 0;
}

/* The pose is home, moved by what the arm moved and turned about the grip. */
static int read_device(void* device, double time, h6PluginSample* out) {
  (void)time;
  Device* d = device;
  take_samples(d);
  if (d->waits != 0 && now() - d->waits > d->patience) return 1;
  /* An old sample's pose is still the best estimate; its velocity is not, and counts as 0. */
  const int silent = d->waits != 0 && now() - d->waits > 1e-3 * UDP_ARM_SILENCE;
  const UdpArmSample* s = &d->newest;
  Grip grip;
  memcpy(grip.moved, s->moved, sizeof grip.moved);
  memcpy(grip.turned, s->turned, sizeof grip.turned);
  for (int i = 0; i < 3; ++i) {
    grip.linear[i] = silent ? 0 : s->linear[i];
    grip.angular[i] = silent ? 0 : s->angular[i];
  }
  h6_sample_of_grip(&d->start, &grip, out);
  out->buttons = s->buttons;
  out->sequence = s->number;
  return 0;
}

static int write_device(void* device, double time, const h6PluginCommand* command) {
  (void)time;
  Device* d = device;
  ++d->number;
  send_command(d, atomic_load(&d->stopped) ? 0 : 1, command);
  return 0;
}

/* Sends its own datagram and uses no data of the haptic thread. */
static void stop_device(void* device) {
  Device* d = device;
  atomic_store(&d->stopped, 1);
  const UdpArmCommand c = {UDP_ARM_COMMAND, 0, 0, 0, {0, 0, 0}, {0, 0, 0}};
  (void)!send(d->socket, &c, sizeof c, MSG_DONTWAIT | MSG_NOSIGNAL);
}

static int arm_device(void* device) {
  atomic_store(&((Device*)device)->stopped, 0);
  return 0;
}

static void close_device(void* device) {
  Device* d = device;
  send_command(d, 0, NULL);
  close(d->socket);
  free(d);
}

const h6DevicePluginV1 h6_device_plugin_v1 = {
    H6_PLUGIN_ABI,
    sizeof(h6DevicePluginV1),
    "An arm behind UDP (hapsix_udp_arm simulates one); options: host, port, timeout [ms].",
    open_device,
    read_device,
    write_device,
    stop_device,
    arm_device,
    close_device};
