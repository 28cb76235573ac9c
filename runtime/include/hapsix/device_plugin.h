// SPDX-License-Identifier: Apache-2.0
/* device_plugin.h - a device of your own as a shared library, loaded while the program runs:
 *
 *     hapsix run SCENE --device 'plugin:./arm.so?host=10.0.0.7'
 *
 * This file is all that a plug-in needs: C99 and no library. It exports one symbol,
 * `h6_device_plugin_v1`. Start from device/plugins/template_device.c; device/plugins/udp_arm.c is a
 * device that is reached through a network. What stands here will not change; what comes later will
 * be another version with another symbol.
 *
 * Units are SI. Poses are those of the MESH FRAME of the body in hand, in the world; quaternions are
 * (w, x, y, z). Only the host knows where that body begins, so it says so in `open`: the usual plug-in
 * answers with `home`, moved by what its handle has moved since.
 *
 * Threads. open and close: one thread, at leisure. read, then write: the haptic thread, once a frame,
 * between an open and its close; they return at once with what is there (slow input wants a thread of
 * its own), allocate nothing, take no lock that another thread holds for long, and do not print.
 * stop: any thread and signal handlers, any number of times, also while another thread is in write.
 * arm: the haptic thread. Several handles may be open at once, or open refuses the second.
 * Before anything is used, the host opens, reads and closes once in a process of its own, which a
 * crash or a hang ends with a sentence instead of ending the host.
 *
 * Safety. What write receives is finite, inside the rating, and limited in its rate of change. That
 * is not enough for an arm that can hurt. Such a device, not its plug-in, must
 *   - go to zero force by itself when no command came for some 20 ms: nothing of this runs after a
 *     crash, SIGKILL or a power loss of the host;
 *   - limit force, velocity and workspace in its own drive, whatever it is told;
 *   - have an emergency stop that cuts the power of its motors without any software;
 *   - power its motors only after a person asked for it (`arm`), and not again by itself after a
 *     fault or a lost connection;
 *   - be tried with `hapsix devices --test`, which stays within 10 % of the rating, before any scene,
 *     by a person who is out of its reach. */
#ifndef HAPSIX_DEVICE_PLUGIN_H
#define HAPSIX_DEVICE_PLUGIN_H

#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32)
#define H6_PLUGIN_EXPORT __declspec(dllexport)
#else
#define H6_PLUGIN_EXPORT __attribute__((visibility("default")))
#endif

#ifdef __cplusplus
extern "C" {
#endif

enum { H6_PLUGIN_ABI = 1 };

/* Modes of control, bits (types.h says what each is). */
enum { H6_PLUGIN_IMPEDANCE = 1, H6_PLUGIN_ADMITTANCE = 2, H6_PLUGIN_PSEUDO_ADMITTANCE = 4 };

typedef struct h6PluginOption { const char* key; const char* value; } h6PluginOption;

/* What the host tells when it opens a device; valid until open returns. */
typedef struct h6PluginStart {
  const h6PluginOption* options;   /* behind the '?', in their order; refuse those you do not know     */
  size_t                option_count;
  double home_position[3];         /* where the mesh frame begins, world frame                    [m]  */
  double home_orientation[4];
  double grip[3];                  /* the body's centre of mass, mesh frame: torques are about it [m]  */
} h6PluginStart;

typedef struct h6PluginCapabilities {
  char     name[64];               /* for people, ended by a zero                                      */
  uint32_t dof_in;                 /* 3 or 6                                                           */
  uint32_t dof_out;                /* 0, 3 or 6                                                        */
  double   max_force;              /* continuous rating; 0: renders no force                      [N]  */
  double   max_torque;             /*                                                           [N m]  */
  double   max_force_rate;         /* slew limit; 0: max_force in 5 ms                          [N/s]  */
  double   max_torque_rate;        /*                                                         [N m/s]  */
  double   max_velocity;           /* 0: not limited                                            [m/s]  */
  double   workspace_min[3], workspace_max[3];/* world frame; equal: not limited                  [m]  */
  double   rate;                   /* samples a second it can take and give; 0: any              [Hz]  */
  uint32_t modes;                  /* H6_PLUGIN_IMPEDANCE ...                                          */
  double   freeze_time;            /* samples the same to the bit for so long mean that it hangs;
                                      0: they may stay the same                                   [s]  */
} h6PluginCapabilities;

typedef struct h6PluginSample {
  double   position[3], orientation[4]; /* of the mesh frame, world frame; a unit quaternion       [m]  */
  double   linear[3], angular[3];  /* velocity of the mesh frame's origin, and turn   [m/s], [rad/s]  */
  double   force[3], torque[3];    /* admittance modes: of the person on the handle         [N], [N m] */
  uint32_t buttons;                /* one bit each                                                     */
  uint32_t sequence;               /* counts the device's own samples; always 0: it does not count     */
} h6PluginSample;

typedef struct h6PluginCommand {
  double   force[3], torque[3];    /* impedance: on the hand, world frame, torque about the grip       */
  double   position[3], orientation[4]; /* admittance modes: where to hold the mesh frame              */
  double   linear[3], angular[3];
  uint32_t cause;                  /* h6Cause: why it is not what the scene asked for; 0: it is        */
} h6PluginCommand;

typedef struct h6DevicePluginV1 {
  uint32_t    abi;                 /* H6_PLUGIN_ABI                                                    */
  uint32_t    size;                /* sizeof(h6DevicePluginV1)                                         */
  const char* about;               /* one sentence for people: what it is, which options it takes      */
  /* 0, a handle in *device and *capabilities filled in (they come zeroed); or non-zero and one sentence
   * in `error`: what, where, what to do. Takes 5 s at most. */
  int  (*open)(const h6PluginStart* start, h6PluginCapabilities* capabilities, void** device,
               char* error, size_t error_size);
  /* The newest sample at `time` seconds since the run began. 0, or non-zero: the device is lost. Both
   * are called every frame while it is lost, too: with 0 the next time it is there again, and waits for
   * a person to arm it. */
  int  (*read)(void* device, double time, h6PluginSample* sample);
  int  (*write)(void* device, double time, const h6PluginCommand* command);
  /* Zero force now, and until arm, whatever write is told. Takes no lock, allocates nothing. */
  void (*stop)(void* device);
  /* May be NULL: then nothing leads back from stop. 0, or non-zero: it cannot. */
  int  (*arm)(void* device);
  /* Zero force, then everything is given back. */
  void (*close)(void* device);
} h6DevicePluginV1;

/* What a plug-in defines. */
extern H6_PLUGIN_EXPORT const h6DevicePluginV1 h6_device_plugin_v1;

#ifdef __cplusplus
}
#endif
#endif
