// SPDX-License-Identifier: Apache-2.0
/* device.h - what a haptic device must do for the engine, and what the engine promises in return.
 *
 * Thread rules: read and write are called by the haptic thread alone, once a frame, and must return
 * at once with what is there (a device with slow input keeps a thread of its own). stop may be
 * called by any thread and by a signal handler at any time, several times and while another thread is
 * in write: it puts the device into its safe state (zero force), takes no lock and allocates nothing.
 *
 * A real device needs a watchdog of its own that goes to zero force when no command has come for some
 * 20 ms: nothing here runs after SIGKILL or a loss of power. Commands are safe as they are; the device
 * must not smooth them, nor predict beyond the last one.
 */
#ifndef HAPSIX_DEVICE_H
#define HAPSIX_DEVICE_H

#include "types.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct h6DeviceCapabilities {
  char     name[64];
  uint32_t dof_in;          /* 3 or 6                                                              */
  uint32_t dof_out;         /* 0, 3 or 6                                                           */
  double   max_force;       /* continuous rating; 0: renders no force                         [N]  */
  double   max_torque;      /*                                                              [N m]  */
  double   max_force_rate;  /* slew limit; 0: max_force in 5 ms                             [N/s]  */
  double   max_torque_rate; /*                                                            [N m/s]  */
  double   max_velocity;    /* 0: not limited                                               [m/s]  */
  h6Vec3   workspace_min, workspace_max; /* equal: not limited                                [m]  */
  double   rate;            /* samples a second it can take and give; 0: any                 [Hz]  */
  uint32_t modes;           /* H6_IMPEDANCE ...                                                    */
  double   freeze_time;     /* equal samples (to the bit) for this long mean that the device hangs;
                               0: samples may stay equal (encoders at rest, a path)           [s]  */
  bool     frame_time;      /* a simulation that lives on the frames' own time: no frame is late for
                               it, and the watchdog ignores it                                     */
  uint64_t reserved[8];
} h6DeviceCapabilities;

/* Where the hand holds the mesh frame of its body. Beyond 1e6 m, m/s, rad/s or N a sample is bad. */
typedef struct h6DeviceSample {
  h6Pose     pose;     /* world frame                                                              */
  h6Velocity velocity; /* of the mesh frame's origin, world frame                                  */
  uint32_t   buttons;
  h6Wrench   wrench;   /* on the manipulandum, world frame, torque about the body's centre of mass:
                          from a force sensor (admittance) or the driver's coupling
                          (pseudo-admittance); not read in impedance mode                [N, N m]  */
  uint32_t   sequence; /* counts the device's own samples, so that a device that hangs is found
                          within 50 ms; always 0: the device does not count                        */
  uint64_t reserved[2];
} h6DeviceSample;

/* State of a hand's device. Only in `active` can the output differ from zero (admittance: from a held
 * pose), and in `armed` and `degraded` while it decays, at most decay_time. Only h6Arm leads from
 * absent, ready, lost and a latched fault to armed.
 *
 *   absent --a sample--> ready --h6Arm--> armed <--dead-man button--> active
 *   armed, active --trouble--> degraded --over in time--> armed, active; --latched and over--> ready
 *   any --reading or writing fails--> lost --a sample--> ready                                      */
typedef enum h6DeviceState {
  H6_ABSENT = 0, /* no usable sample has come yet                                                  */
  H6_READY,      /* samples come; not armed, or a fault is latched                                 */
  H6_ARMED,      /* armed, and the dead-man button is not held                                     */
  H6_ACTIVE,     /* renders                                                                        */
  H6_DEGRADED,   /* samples are not finite or frozen, or commands come too late: the output decays,
                    then latches                                                                   */
  H6_LOST,       /* reading or writing fails                                                       */
  H6_DEVICE_STATE_COUNT
} h6DeviceState;
H6_API const char* h6DeviceStateName(h6DeviceState state);

/* Why the output is not what the coupling asked for. */
typedef enum h6Cause {
  H6_CAUSE_NONE = 0,
  H6_CAUSE_CLAMPED,     /* cut to the rating                                                       */
  H6_CAUSE_SLEWED,      /* changed too fast                                                        */
  H6_CAUSE_NOT_FINITE,  /* NaN or infinity: zero, latched                                          */
  H6_CAUSE_LATE,        /* commands come too late: held for a frame, decays, then latched          */
  H6_CAUSE_DEVICE_LOST, /* read or write failed: zero, latched                                     */
  H6_CAUSE_STOPPED,     /* the program asked for it                                                */
  H6_CAUSE_SPEED,       /* admittance: the pose would have moved faster than the device may        */
  H6_CAUSE_CLUTCHED,    /* the hand holds the clutch: nothing is rendered                          */
  H6_CAUSE_PASSIVITY,   /* damped or scaled down, because energy would have been made              */
  H6_CAUSE_POWER,       /* scaled down to the largest power that the hand may get                  */
  H6_CAUSE_DERATED,     /* less because the hand is fast                                           */
  H6_CAUSE_OVERSPEED,   /* the hand is faster than it may be: zero, latched                        */
  H6_CAUSE_SOFT_START,  /* rises after arming, a jump or trouble                                   */
  H6_CAUSE_DEAD_MAN,    /* the dead-man button is not held: decays                                 */
  H6_CAUSE_DISARMED,    /* not armed: decays                                                       */
  H6_CAUSE_POSE_JUMP,   /* the hand cannot have moved so far: zero, then a soft start              */
  H6_CAUSE_BAD_SAMPLE,  /* samples are not finite: held for a frame, decays, then latched          */
  H6_CAUSE_FROZEN,      /* the device sends the same sample for too long: decays, then latched     */
  H6_CAUSE_WATCHDOG,    /* the haptic thread stalled: devices were stopped; latched                */
  H6_CAUSE_COUNT
} h6Cause;
#define H6_MAX_CAUSES 32 /* h6DeviceCommand.causes has a bit for each */
H6_API const char* h6CauseName(h6Cause cause);

/* A command to a device. Always finite, inside the rating, slew-limited. */
typedef struct h6DeviceCommand {
  h6Wrench   wrench;  /* on the hand, world frame, torque about the body's centre of mass; zero in
                         the admittance modes                                                      */
  h6Pose     pose;    /* where the device should hold the mesh frame, world frame; in impedance mode
                         the manipulandum, for show                                                */
  h6Velocity velocity;/* of that mesh frame's origin, world frame; zero in impedance mode          */
  h6Cause    cause;   /* the gravest cause                                                         */
  uint32_t   causes;  /* all causes: bits 1u << h6Cause                                            */
  uint64_t reserved[2];
} h6DeviceCommand;

/* What the safety chain of a hand has done. */
typedef struct h6HandSafety {
  h6DeviceState state;
  h6Cause       fault;                 /* latched, until h6Arm; or H6_CAUSE_NONE                   */
  uint64_t      frames[H6_MAX_CAUSES]; /* frames with this cause                                   */
  uint64_t      times[H6_MAX_CAUSES];  /* times that this cause began                              */
} h6HandSafety;

typedef struct h6Device {
  void*                self;
  h6DeviceCapabilities capabilities;
  /* The newest sample at `time` seconds since the loop began. Returns 0; non-zero: the device is lost.
   * read and write are called in every frame, also while it is lost; a 0 then says that it is back. */
  int  (*read)(void* self, double time, h6DeviceSample* out);
  int  (*write)(void* self, double time, const h6DeviceCommand* command);
  void (*stop)(void* self);
  /* May be NULL. Lets commands through again. The haptic thread calls it when the loop starts armed and
   * at every h6ArmLoop; it must return at once. A device that has it renders nothing from a stop to the
   * next arm, whatever the commands. Returns 0; non-zero: it cannot, and the hand stays as it is. */
  int  (*arm)(void* self);
  uint64_t reserved[4];
} h6Device;

#ifdef __cplusplus
}
#endif
#endif
