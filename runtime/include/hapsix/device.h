/* device.h - what the engine asks of a haptic device, and what it promises in return.
 *
 * Thread rules: read and write are called by the haptic thread alone, once a frame, and must return
 * at once with what is there (a device with slow input keeps a thread of its own). stop may be
 * called by any thread and by a signal handler at any time: it puts the device into its safe state
 * (zero force), takes no lock and allocates nothing. A real device also needs a watchdog of its own:
 * nothing here runs after SIGKILL.
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
} h6DeviceCapabilities;

/* What a device says: where the hand holds the mesh frame of its body. */
typedef struct h6DeviceSample {
  h6Pose     pose;     /* world frame                                                              */
  h6Velocity velocity; /* of the mesh frame's origin, world frame                                  */
  uint32_t   buttons;
  h6Wrench   wrench;   /* on the manipulandum, world frame, torque about the body's centre of mass:
                          what a force sensor (admittance) or the driver's coupling
                          (pseudo-admittance) says; not read in impedance mode           [N, N m]  */
} h6DeviceSample;

/* Why the output is not what the coupling asked for. */
typedef enum h6Cause {
  H6_CAUSE_NONE = 0,
  H6_CAUSE_CLAMPED,     /* cut to the rating                                                       */
  H6_CAUSE_SLEWED,      /* changed too fast                                                        */
  H6_CAUSE_NOT_FINITE,  /* NaN or infinity: zero, latched                                          */
  H6_CAUSE_LATE,        /* deadline missed: held, then decays                                      */
  H6_CAUSE_DEVICE_LOST, /* read or write failed: zero, latched                                     */
  H6_CAUSE_STOPPED,     /* the program asked for it                                                */
  H6_CAUSE_SPEED,       /* admittance: the pose would have moved faster than the device may        */
  H6_CAUSE_CLUTCHED,    /* the hand holds the clutch: nothing is rendered                          */
  H6_CAUSE_PASSIVITY,   /* damped, because energy would have been made                             */
  H6_CAUSE_COUNT
} h6Cause;
H6_API const char* h6CauseName(h6Cause cause);

/* What a device is told. Always finite, inside the rating, slew-limited. */
typedef struct h6DeviceCommand {
  h6Wrench   wrench;  /* on the hand, world frame, torque about the body's centre of mass; zero in
                         the admittance modes                                                      */
  h6Pose     pose;    /* where the device should hold the mesh frame, world frame; in impedance mode
                         the manipulandum, for show                                                */
  h6Velocity velocity;/* its own, of the mesh frame's origin; zero in impedance mode               */
  h6Cause    cause;
} h6DeviceCommand;

typedef struct h6Device {
  void*                self;
  h6DeviceCapabilities capabilities;
  /* The newest sample at `time` seconds since the loop began. 0, or non-zero: the device is lost. */
  int  (*read)(void* self, double time, h6DeviceSample* out);
  int  (*write)(void* self, double time, const h6DeviceCommand* command);
  void (*stop)(void* self);
} h6Device;

#ifdef __cplusplus
}
#endif
#endif
