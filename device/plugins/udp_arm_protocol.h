// SPDX-License-Identifier: Apache-2.0
/* udp_arm_protocol.h - two datagrams between udp_arm.c (the plug-in) and udp_arm_main.c (the arm).
 *
 *   plug-in --command, numbered--> arm --one sample for each, with the command's number--> plug-in
 *
 * Both sides have the same byte order. A datagram of another size or mark is ignored. */
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

/* Takes a datagram as the newest sample, or returns 0 and leaves that as it is. It must answer a
 * command between the one that `newest` answers and `sent`, the last one. Numbers may wrap. A place of
 * NaN is taken, too: the host's safety chain answers it at once, and a sample left out only later. */
static inline int udp_arm_take(const void* datagram, size_t bytes, uint32_t sent,
                               UdpArmSample* newest) {
  UdpArmSample s;
  if (bytes != sizeof s) return 0;
  memcpy(&s, datagram, sizeof s);
  if (s.mark != UDP_ARM_SAMPLE) return 0;
  if ((uint32_t)(s.number - newest->number) > (uint32_t)(sent - newest->number)) return 0;
  *newest = s;
  return 1;
}

#endif
