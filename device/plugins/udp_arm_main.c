// SPDX-License-Identifier: Apache-2.0
/* udp_arm_main.c - the other side of udp_arm.c: a simulated arm as a process of its own.
 *
 *   hapsix_udp_arm [--port N] [--press METRES] [--period SECONDS]
 *
 * A handle of 0.3 kg in the hand of a person (500 N/m, 20 N s/m) who lowers it by METRES along -z
 * and raises it again. It runs on the machine's clock at 10 kHz and answers each command with one
 * sample. It gives no force when no command came for 20 ms, like the watchdog in a real arm's
 * drive. */
#include <arpa/inet.h>
#include <math.h>
#include <netinet/in.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

#include "device/plugins/udp_arm_protocol.h"

static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

typedef struct Arm {
  double moved[3], velocity[3], force[3];
  double press, period;
} Arm;

/* Simulates from time `from` to `to` [s], at most the last second of that. */
static void advance(Arm* arm, double from, double to) {
  const double h = 1e-4, mass = 0.3, stiffness = 500, damping = 20, turn = 6.283185307179586;
  if (to - from > 1) from = to - 1;
  for (double t = from; t < to; t += h) {
    const double want[3] = {0, 0, -0.5 * arm->press * (1 - cos(turn * t / arm->period))};
    for (int i = 0; i < 3; ++i) {
      arm->velocity[i] +=
          h / mass *
          (arm->force[i] + stiffness * (want[i] - arm->moved[i]) - damping * arm->velocity[i]);
      arm->moved[i] += h * arm->velocity[i];
    }
  }
}

static double number_after(int argc, char** argv, const char* option, double value) {
  for (int i = 1; i + 1 < argc; ++i)
    if (strcmp(argv[i], option) == 0) value = atof(argv[i + 1]);
  return value;
}

int main(int argc, char** argv) {
  Arm arm;
  memset(&arm, 0, sizeof arm);
  arm.press = number_after(argc, argv, "--press", 0.01);
  arm.period = number_after(argc, argv, "--period", 2);
  if (!(arm.period > 0)) arm.period = 2;
  struct sockaddr_in at, from;
  memset(&at, 0, sizeof at);
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK); /* local only */
  at.sin_port = htons((uint16_t)number_after(argc, argv, "--port", UDP_ARM_PORT));
  const int s = socket(AF_INET, SOCK_DGRAM, 0);
  socklen_t size = sizeof at;
  if (s < 0 || bind(s, (struct sockaddr*)&at, sizeof at) != 0 ||
      getsockname(s, (struct sockaddr*)&at, &size) != 0) {
    perror("hapsix_udp_arm: no socket at this port");
    return 1;
  }
  printf("%d\n", ntohs(at.sin_port));
  fflush(stdout);
  const struct timeval wait = {0, 1000 * UDP_ARM_SILENCE};
  setsockopt(s, SOL_SOCKET, SO_RCVTIMEO, &wait, sizeof wait);

  const double begun = now();
  double time = 0, commanded = 0; /* of the last command */
  for (;;) {
    UdpArmCommand c;
    socklen_t from_size = sizeof from;
    const ssize_t bytes = recvfrom(s, &c, sizeof c, MSG_TRUNC, (struct sockaddr*)&from, &from_size);
    const double then = now() - begun;
    advance(&arm, time, then);
    time = then;
    if (then - commanded > 1e-3 * UDP_ARM_SILENCE) /* the watchdog */
      memset(arm.force, 0, sizeof arm.force);
    if (bytes != (ssize_t)sizeof c || c.mark != UDP_ARM_COMMAND) continue;
    commanded = then;
    for (int i = 0; i < 3; ++i)
      arm.force[i] = c.motors && isfinite(c.force[i]) ? fmin(30, fmax(-30, c.force[i])) : 0;
    UdpArmSample out;
    memset(&out, 0, sizeof out);
    out.mark = UDP_ARM_SAMPLE, out.number = c.number;
    out.turned[0] = 1;
    memcpy(out.moved, arm.moved, sizeof out.moved);
    memcpy(out.linear, arm.velocity, sizeof out.linear);
    (void)!sendto(s, &out, sizeof out, 0, (struct sockaddr*)&from, from_size);
  }
}
