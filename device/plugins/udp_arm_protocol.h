// SPDX-License-Identifier: Apache-2.0
/* udp_arm_protocol.h - two datagrams between udp_arm.c (the plug-in) and udp_arm_main.c (the arm).
 *
 *   plug-in --command, numbered--> arm --one sample for each, with the command's number--> plug-in
 *
 * Both sides are on machines of the same byte order. What is not of this size and mark is thrown
 * away.
 */
#ifndef HAPSIX_UDP_ARM_PROTOCOL_H
#define HAPSIX_UDP_ARM_PROTOCOL_H

#include <stdint.h>

enum { UDP_ARM_COMMAND = 0x31433668, UDP_ARM_SAMPLE = 0x31533668, UDP_ARM_PORT = 47806 };
/* The arm gives no force when no command came for so long; the plug-in takes it for lost when a
 * command has no answer for so long, unless it is told otherwise. [ms] */
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
