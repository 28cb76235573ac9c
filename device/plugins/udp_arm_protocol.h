// SPDX-License-Identifier: Apache-2.0
/* udp_arm_protocol.h - two datagrams between udp_arm.c (the plug-in) and udp_arm_main.c (the arm).
 *
 *   plug-in --command, numbered--> arm --one sample for each, with the command's number--> plug-in
 *
 * Both sides have the same byte order. A datagram of another size or mark is ignored.
 */
#ifndef HAPSIX_UDP_ARM_PROTOCOL_H
#define HAPSIX_UDP_ARM_PROTOCOL_H

#include <stdint.h>

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

#endif
