// SPDX-License-Identifier: Apache-2.0
/* udp_arm_protocol.h - two datagrams between udp_arm.c (the plug-in) and udp_arm_main.c (the arm).
 *
 *   plug-in --command, numbered--> arm --one sample for each, with the command's number--> plug-in
 *
 * Both sides have the same byte order. A datagram of another size or mark is ignored, and so is a
 * sample with numbers that no arm has. */
#ifndef HAPSIX_UDP_ARM_PROTOCOL_H
#define HAPSIX_UDP_ARM_PROTOCOL_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

enum { UDP_ARM_COMMAND = 0x31433668, UDP_ARM_SAMPLE = 0x31533668, UDP_ARM_PORT = 47806 };
/* The arm gives no force when no command came for this long. The plug-in reports the arm as lost
 * when a command had no answer for this long, unless its options say otherwise. [ms] */
enum { UDP_ARM_SILENCE = 20 };

typedef struct UdpArmCommand {
  uint32_t mark, number;
  uint32_t motors; /* 1: give the wrench; 0: none */
  uint32_t unused;
  double force[3], torque[3];
} UdpArmCommand;

typedef struct UdpArmSample {
  uint32_t mark, number;
  uint32_t buttons, unused;
  double moved[3], turned[4]; /* of the grip since the arm was started, world frame; a quaternion */
  double linear[3], angular[3];
} UdpArmSample;

/* NaN and infinity lie within no bound. */
static inline int udp_arm_within(const double* numbers, int count, double most) {
  for (int i = 0; i < count; ++i)
    if (!(numbers[i] >= -most && numbers[i] <= most)) return 0;
  return 1;
}

/* Within 100 m, 100 m/s and 1000 rad/s, and turned by a quaternion within 1 % of unit length. */
static inline int udp_arm_sensible(const UdpArmSample* s) {
  const double* q = s->turned;
  if (!udp_arm_within(s->moved, 3, 100) || !udp_arm_within(q, 4, 1.01) ||
      !udp_arm_within(s->linear, 3, 100) || !udp_arm_within(s->angular, 3, 1000))
    return 0;
  const double square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
  return square >= 0.99 * 0.99 && square <= 1.01 * 1.01;
}

/* Takes a datagram as the newest sample, or returns 0 and leaves that as it is. It must answer a
 * command between the one that `newest` answers and `sent`, the last one. Numbers may wrap. */
static inline int udp_arm_take(const void* datagram, size_t bytes, uint32_t sent,
                               UdpArmSample* newest) {
  UdpArmSample s;
  if (bytes != sizeof s) return 0;
  memcpy(&s, datagram, sizeof s);
  if (s.mark != UDP_ARM_SAMPLE || !udp_arm_sensible(&s)) return 0;
  if ((uint32_t)(s.number - newest->number) > (uint32_t)(sent - newest->number)) return 0;
  *newest = s;
  return 1;
}

#endif
