// SPDX-License-Identifier: Apache-2.0
/* hapsix.h - the engine: models, sessions, the haptic loop. The header is the manual.
 *
 *   h6ModelDef -> h6CreateModel -> h6Model       fields and shells, immutable, shared by threads
 *   h6SessionDef -> h6CreateSession -> h6Session bodies, hands, state; one thread at a time
 *   h6Step(session, samples, commands)           one frame on the caller's own thread, or
 *   h6StartLoop(session, devices, ...)           a real-time thread that does it at the rate
 *
 * Nothing here opens a file or names a device. A step never allocates, locks, prints, throws or
 * waits. Create functions return NULL and fill `error` (which may be NULL) when they fail. For a NULL,
 * a -1 or an index past the end a function gives NULL, -1 or zeros, and changes nothing. A value that is
 * not finite is refused, by a create function or as a bad sample; what it does elsewhere stands at the
 * function.
 *
 * Threads. Any thread, many at once: defaults, names, h6Version, h6BuildInfo, h6SampleField,
 * h6StiffnessFor, h6WeighContacts, and everything that only reads a model. A session belongs to one
 * thread at a time: of two threads in h6Step at once, the second gets H6_OUTPUT_FAULT, and nothing
 * changes. While a loop runs a session it belongs to the loop's thread: h6Step then gives
 * H6_OUTPUT_FAULT, another h6StartLoop, h6TakeOver and h6RestartFit fail with H6_ERROR_BUSY, the
 * functions that set anything do nothing, but for h6Fault, h6LoseDevice and h6Disarm, which only take
 * force away, and what the h6Get functions give may change under the reader's eyes: a loop has
 * records and views instead. A session or model must not be destroyed while another call uses it.
 * Create functions and h6LoopRunning: any thread. */
#ifndef HAPSIX_H
#define HAPSIX_H

#include "base.h"
#include "device.h"
#include "types.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct h6Model h6Model;
typedef struct h6Session h6Session;
typedef struct h6Loop h6Loop;

/* Defaults. A def that was not made by its default function is not valid. */
H6_API h6FieldDef    h6DefaultFieldDef(void);   /* empty                                              */
H6_API h6ShellDef    h6DefaultShellDef(void);   /* empty                                              */
H6_API h6DeformableDef h6DefaultDeformableDef(void); /* empty, without damping                        */
H6_API h6ModelDef    h6DefaultModelDef(void);   /* empty                                              */
H6_API h6PairDef     h6DefaultPairDef(void);    /* -1, -1                                             */
H6_API h6ContactArrays h6DefaultContactArrays(void); /* empty, at rest                                */
H6_API h6Device      h6DefaultDevice(void);     /* no functions; 6-DoF, 10 N, 1 N m                   */
H6_API h6DeviceSample h6DefaultDeviceSample(void); /* at the origin, at rest                          */
H6_API h6BodyDef     h6DefaultBodyDef(void);    /* at the origin, at rest, 0.1 kg, no shell, no field */
H6_API h6ContactDef  h6DefaultContactDef(void); /* firm, k derived from the part, beta 1e-3 s        */
H6_API h6CouplingDef h6DefaultCouplingDef(void);/* 1e3 N/m, critically damped, half a voxel          */
H6_API h6SafetyDef   h6DefaultSafetyDef(void);  /* the device's ratings, soft start of 0.1 s         */
H6_API h6HandFilterDef h6DefaultHandFilterDef(void); /* passes everything: scales 1, no clutch       */
H6_API h6HandDef     h6DefaultHandDef(void);    /* body 0, impedance, that filter and that coupling   */
H6_API h6SessionDef  h6DefaultSessionDef(void); /* implicit, 1000 Hz, 16384 contacts, 1 thread       */

/* The weights as a function, without scene or session, for any penalty simulator. With w from
 * `contact`, J = [N; r x N], J_g = [g; r x g] and u the velocity (METHOD.md, Sec. 2, 3):
 *     wrench    = sum w k max(0, depth - beta J.u) J                                   [N, N m]
 *     stiffness = d wrench/dq = -sum w k J J^T;  H6_EXACT: -sum w k J J_g^T and the geometric term
 *     damping   = d wrench/du = -beta sum w k J J^T        both 6 x 6, row by row, q = (x, theta)
 * `series` has its own forms and always starts cold. `voxel` > 0 [m] is the length that l0 and
 * cluster_voxels are measured in. `lever` > 0 [m] is at least the largest |r|; take the body's radius
 * and not the patch's, since it should not change from call to call. weights (count), wrench, stiffness
 * (36), damping (36) may each be NULL. A clustered contact gets its share, by depth, of its cluster's
 * weight. Nothing is allocated when scratch is given. Returns 0, or -1 with `error` filled. */
H6_API int    h6WeighContacts(const h6ContactDef* contact, const h6ContactArrays* contacts,
                              double voxel, double lever, float* weights, h6Wrench* wrench,
                              double* stiffness, double* damping, h6Error* error);
H6_API size_t h6WeighScratchBytes(size_t count); /* 0: more than 1000000 contacts, the most */

/* "none", "global", ...; NULL when out of range. And back: 0 when the name is known. */
H6_API const char* h6MethodName(h6Method method);
H6_API int         h6MethodFromName(const char* name, h6Method* method, uint32_t* pieces);

/* Copies and converts fields and shells; the def's arrays can be freed afterwards. Every array is
 * checked: an index out of range, a NaN or a radius too small is an error, not a crash later. */
H6_API h6Model* h6CreateModel(const h6ModelDef* def, h6Error* error);
H6_API void     h6DestroyModel(h6Model* model);
H6_API size_t   h6ModelBytes(const h6Model* model);

/* A signed distance query for tools and tests: points (count x 3) in the field's mesh frame [m].
 * distance (count) [m]; gradient (count x 3), unit length where it is defined, or NULL; exact (count)
 * or NULL: 1 where the distance is a sample, 0 where it is a bound. A point that is not finite, or
 * beyond the range of a float, has distance INFINITY, gradient 0 and exact 0. Returns 0; -1: no such
 * field. */
H6_API int h6SampleField(const h6Model* model, int32_t field, const double* points, size_t count,
                         double* distance, double* gradient, uint8_t* exact);

/* The contact stiffness that a session of this definition has: contact.stiffness, or what is derived
 * where that is 0 (METHOD.md, Sec. 4, "Defaults from the scene"). 0: the definition is not valid [N/m]. */
H6_API double     h6StiffnessFor(const h6Model* model, const h6SessionDef* def);

/* The model must outlive the session. */
H6_API h6Session* h6CreateSession(const h6Model* model, const h6SessionDef* def, h6Error* error);
H6_API void       h6DestroySession(h6Session* session);

/* One frame of 1/rate seconds: samples of each hand in, a wrench for each out. NULL: H6_OUTPUT_FAULT. */
H6_API h6Status h6Step(h6Session* session, const h6DeviceSample* samples, h6DeviceCommand* commands);

/* For the next step only: traverses the last `pairs` pairs coarsely, with `points` of each sixteen
 * points (8, 4, 2, 1; 0: the 64 deepest contacts of 1), whatever the clock says. With coarse_pairs and
 * coarse_points of each h6FrameReport this repeats a run in anytime mode to the bit. */
H6_API void h6SetCoarse(h6Session* session, uint32_t pairs, uint32_t points);

/* Where shells overlap fields at the start, whatever `fit` says: one row for each pair that overlaps,
 * in the order of pairs, and one row for each point, in the order of pairs. Writes at most `capacity`
 * rows (out may be NULL when it is 0) and returns how many there are. Below its band a field knows only
 * bounds: a point is then at least as deep as is written. */
H6_API size_t h6GetOverlaps(const h6Session* session, h6Overlap* out, size_t capacity);
H6_API size_t h6GetOverlapPoints(const h6Session* session, h6OverlapPoint* out, size_t capacity);
/* Makes the present poses a new start: measures the overlap and sets the relief anew. False with
 * `error` filled when memory is out: nothing has changed. It allocates; call it between steps, not
 * while a loop runs. */
H6_API bool   h6RestartFit(h6Session* session, h6Error* error);

/* State after the last step. h6SetBody teleports: velocity as given, coupling history forgotten. A state
 * is ignored where a number is not finite or beyond 1e6, or the quaternion's length not in 0.5 .. 2. An
 * overlap that it makes pushes in full, since programs move obstacles with it. A point that has relief
 * keeps it unless it is free now; before the first step all points of the body lose it. To make the new
 * place a start, call h6RestartFit. Friction springs of a free body begin anew, unstretched; a fixed
 * body, an obstacle that a program moves, drags along what rests on it. The common spring of `series`
 * and `firm` keeps its extension, which decides which points take part before they touch in the next
 * step. */
H6_API h6BodyState   h6GetBody(const h6Session* session, int32_t body);
H6_API void          h6SetBody(h6Session* session, int32_t body, const h6BodyState* state);
/* Coordinates and velocities of a body whose shell bends, after the last step: the first `capacity` of
 * each array, which may be NULL. Returns r; 0: no such body, or it is rigid. */
H6_API size_t        h6GetDeformation(const h6Session* session, int32_t body, double* q,
                                      double* velocity, size_t capacity);
/* Puts such a body into a shape; `velocity` may be NULL: at rest. False, and nothing has changed, where
 * `count` is not r, a number is not finite or beyond 1e6, or a loop runs the session. */
H6_API bool          h6SetDeformation(h6Session* session, int32_t body, const double* q,
                                      const double* velocity, size_t count);
H6_API h6Contacts    h6GetContacts(const h6Session* session, int32_t shell_body);
/* What each row of h6GetContacts touches: the `part` and the `triangle` that the field names for the
 * brick (8 voxels wide) around the contact; -1 where it names none, or where the contact is deeper
 * than all bricks. Each array has room for `count` rows, or is NULL. Valid until the next step, like
 * the contacts; a frame spends no time on it. */
H6_API void          h6NameContacts(const h6Session* session, int32_t shell_body, int32_t* part,
                                    int32_t* triangle);
H6_API h6FrameReport h6GetFrame(const h6Session* session);
/* The last frame as a row that a recorder takes, for a program that steps by itself: `samples` and
 * `commands` are those of that h6Step. Zeros for a NULL. */
struct h6FrameRecord;
H6_API void          h6GetRecord(const h6Session* session, const h6DeviceSample* samples,
                                 const h6DeviceCommand* commands, struct h6FrameRecord* out);
/* Values derived from zeros of the defs: a hand's coupling in use, a body's voxel [m]. */
H6_API h6CouplingDef h6GetCoupling(const h6Session* session, int32_t hand);
H6_API double        h6GetVoxel(const h6Session* session, int32_t body);

/* Ratings that the safety chain keeps a hand's output inside; a loop sets them from its devices.
 * Without them: 100 N and 10 N m. Values above those, INFINITY too, are cut down to them. A force or
 * torque that is below 0 or NaN counts as 0, and nothing is rendered; another number that is NaN is not
 * known, and an axis of the workspace with NaN is not limited. */
H6_API void h6SetRating(h6Session* session, int32_t hand, const h6DeviceCapabilities* capabilities);
/* A session begins armed. h6Disarm lets every output decay to zero. h6Fault latches every output at
 * zero at once, for this cause. h6Arm clears faults and starts again softly; it does nothing for a hand
 * whose device is absent, lost, frozen or sends samples that are not finite. h6Rearm is the same as
 * h6Arm. While a loop runs the session, h6Fault and h6Disarm act in its next frame, from any thread;
 * h6Arm does nothing, since only h6ArmLoop arms a loop's devices, too. */
H6_API void h6Arm(h6Session* session);
H6_API void h6Disarm(h6Session* session);
H6_API void h6Fault(h6Session* session, h6Cause cause);
H6_API void h6Rearm(h6Session* session);
/* For the next step only, in a program that steps by itself. h6LoseDevice: this hand's device failed
 * to read or write; all outputs latch. h6NoteInterval: seconds from the last commands to the next; up
 * to two frames, below 0 or NaN: in time; above 1e6: 1e6. */
H6_API void h6LoseDevice(h6Session* session, int32_t hand);
H6_API void h6NoteInterval(h6Session* session, double seconds);
/* The input of a hand's safety chain from outside before a step: requests, faults, deadlines.
 * h6GetSafetyInput gives that of the last step; h6SetSafetyInput sets it for the next one, which
 * repeats a recorded run to the bit, also where outputs move bodies (admittance modes). */
typedef struct h6SafetyInput {
  uint32_t asked;         /* H6_ASKED_*; a fault's h6Cause in the byte from bit 8 on               */
  double   overdue;       /* how late the command of this step comes; with H6_ASKED_SLOW: how much
                             longer than a step the last one lasted; below 0 or NaN: 0; above
                             1e6: 1e6                                                         [s]  */
} h6SafetyInput;
enum {
  H6_ASKED_ARM          = 1u << 0,
  H6_ASKED_DISARM       = 1u << 1, /* after an H6_ASKED_ARM of the same step                       */
  H6_ASKED_LOST         = 1u << 2, /* the device could not be read, or written before              */
  H6_ASKED_FROM_FAULT   = 1u << 3, /* H6_ASKED_ARM found a fault and cleared it                    */
  H6_ASKED_FROM_DISARMED= 1u << 4, /* H6_ASKED_ARM found the hand disarmed                         */
  H6_ASKED_SLOW         = 1u << 5  /* the command comes in time, after a step that took longer than
                                      its time: `overdue` moves the chain's clocks on, and no more */
};
H6_API h6SafetyInput h6GetSafetyInput(const h6Session* session, int32_t hand);
H6_API void          h6SetSafetyInput(h6Session* session, int32_t hand, const h6SafetyInput* input);
/* State and fault after the last step, and counts since the session was made. */
H6_API void         h6GetSafety(const h6Session* session, int32_t hand, h6HandSafety* out);

/* ---- the haptic loop ---------------------------------------------------------------------------- */

/* One row a frame for slow readers (recorder, viewer). */
typedef struct h6FrameRecord {
  double          time;                        /* since the loop began                        [s]  */
  h6FrameReport   report;
  h6DeviceSample  hand[H6_MAX_HANDS];
  h6DeviceCommand command[H6_MAX_HANDS];
  h6BodyState     body[H6_MAX_HANDS];          /* the body of each hand                            */
  double          wakeup_us;                   /* start after the deadline                         */
  uint32_t        late;                        /* H6_LATE_*                                        */
  h6DeviceState   state[H6_MAX_HANDS];
  double          late_us;                     /* of a late frame: end minus the next deadline     */
  double          cpu_us;                      /* CPU time of the haptic thread in this period, with
                                                  devices; 0 in virtual time                       */
  h6SafetyInput   safety_input[H6_MAX_HANDS];
  uint32_t        settings;                    /* number of h6ChangeSession before this frame      */
  uint32_t        inputs_only;                 /* 1: the reader was slow, and only the numbers are here
                                                  that repeat the frame: time, frame, coarse_pairs,
                                                  coarse_points, hand, safety_input, settings, and cause
                                                  and causes of commands. 0: all are here              */
  uint64_t reserved[8];
} h6FrameRecord;

enum { H6_LATE_COMPUTE = 1u << 0, H6_LATE_WAKEUP = 1u << 1, H6_LATE_STOLEN = 1u << 2 };

typedef struct h6LoopDef {
  double   duration;      /* seconds of frames; 0: until h6RequestStop                         [s] */
  bool     virtual_time;  /* as fast as possible, the clock counts frames: same code, same bits    */
  bool     realtime;      /* ask for pinning, SCHED_FIFO and locked memory                         */
  int32_t  core;          /* -1: the last one                                                      */
  double   spin_us;       /* poll the clock this long before each deadline instead of sleeping [us]*/
  size_t   ring_frames;   /* records kept for a slow reader; 0: none                               */
  size_t   ring_inputs;   /* frames beyond these of which the inputs are kept (inputs_only); frames
                             beyond both are lost and counted                                      */
  bool     disarmed;      /* every output stays at zero until h6ArmLoop                            */
  size_t   view_contacts; /* rows of contacts kept for a viewer; 0: no viewer                      */
  uint64_t reserved[8];
} h6LoopDef;
H6_API h6LoopDef h6DefaultLoopDef(void);  /* real time, realtime asked for, 1000 records           */

/* Late frames by how long after the deadline they ended: under 10, 100 us, 1, 10, 100 ms, longer. */
#define H6_LATE_BINS 6
typedef struct h6LateHistogram { uint64_t frames[H6_LATE_BINS]; } h6LateHistogram;

/* Which real-time requests the system granted. `governor`: of that core; "": not known. */
typedef struct h6Granted {
  int32_t core;           /* pinned to it; -1: not pinned                                          */
  bool    fifo;           /* SCHED_FIFO                                                            */
  bool    locked;         /* memory                                                                */
  bool    isolated;       /* nothing else is scheduled on that core by itself (isolcpus)           */
  char    governor[32];   /* "performance" keeps the clock up                                      */
  uint64_t reserved[4];
} h6Granted;

typedef struct h6LoopReport {
  uint64_t frames;
  /* Frames that ended after the next deadline, each counted once, by cause: */
  uint64_t late_compute;  /* the thread's own CPU time in the frame, without waiting for a helper's
                             slice, was over the period                                            */
  uint64_t late_stolen;   /* it was not, but the clock was: the machine ran something else         */
  uint64_t late_wakeup;   /* the frame was short enough but started too late                       */
  uint64_t ring_overruns; /* records lost to a slow reader                                         */
  uint64_t inputs_only;   /* records of which only the inputs were kept                            */
  h6Status status;        /* all bits seen                                                         */
  h6Cause  fault;         /* why the output is latched at zero, or H6_CAUSE_NONE                   */
  double   wakeup_us_max;
  char     granted[1024]; /* which real-time requests were granted, and how to get the others      */
  uint64_t watchdog_trips;/* times the watchdog found the haptic thread stalled, stopping devices  */
  h6HandSafety hand[H6_MAX_HANDS];
  h6Granted grant;        /* the same for programs                                                 */
  h6LateHistogram late_us_compute, late_us_stolen, late_us_wakeup;
  uint64_t coarse_frames; /* frames with H6_COARSE                                                 */
  uint64_t reserved[16];
} h6LoopReport;

/* Starts the haptic thread. `devices` has one entry per hand and must outlive the loop. Memory comes
 * from the session's allocator. A watchdog
 * thread stops the devices when no command has been sent for a frame and a decay_time, and latches the
 * outputs at zero; there is none when every device lives on the frames' own time (frame_time). */
H6_API h6Loop* h6StartLoop(h6Session* session, const h6Device* devices, const h6LoopDef* def,
                           h6Error* error);
/* Takes up to `capacity` records, oldest first. Never blocks the loop. One thread at a time reads: two
 * readers need a lock of their own, and each record then goes to one of them. */
H6_API size_t h6ReadRecords(h6Loop* loop, h6FrameRecord* out, size_t capacity);
/* The same with the shapes of bodies that bend: row i of `bends` is q of all these bodies after frame i,
 * one body after another, as in h6LoopView [m sqrt(kg)]; NaN where only the inputs were kept. `bends`
 * has room for `capacity` rows, or is NULL. */
H6_API size_t h6ReadRecordsWithBends(h6Loop* loop, h6FrameRecord* out, double* bends, size_t capacity);
/* For one viewer on a thread of its own: bodies and contacts of the newest frame, about 125 times a
 * second. False when there is nothing newer than at the last call. The arrays stay valid until the next
 * call that gives true. The loop never waits: frames that were not fetched are lost. World frame. */
typedef struct h6ViewContact {
  float   position[3];         /*                                                             [m]  */
  float   normal[3];           /* inward unit normal; `firm`: direction of the push                */
  float   torque_direction[3]; /* T                                                                */
  float   weight, depth;       /* share of the stiffness; > 0 inside                          [m]  */
  int32_t shell_body, field_body;
} h6ViewContact;
typedef struct h6LoopView {
  uint64_t frame;
  double   time;               /* since the loop began                                        [s]  */
  size_t   body_count;    const h6Pose* bodies;         /* mesh frame -> world, after the step     */
  size_t   contact_count;                               /* all there are                           */
  size_t   row_count;     const h6ViewContact* contacts;/* all, or evenly picked ones              */
  size_t   bend_count;    const double* bends;          /* q of the bodies whose shells bend, one body
                                                           after another   [m sqrt(kg)]            */
  uint64_t reserved[2];
} h6LoopView;
H6_API bool   h6ReadView(h6Loop* loop, h6LoopView* out);
/* Slow motion: `pace` frames a period, 1 (real time) .. 0 (paused); another number, NaN too, means 1.
 * Devices get the time of the frames, so this is for simulated hands (frame_time), not for a real arm.
 * Any thread. */
H6_API void   h6SetPace(h6Loop* loop, double pace);
/* Changes settings while the loop runs: `next` has the same model, bodies, hands and rate. Between two
 * frames it takes over poses, velocities, hands and the state of their safety chains; other history is
 * forgotten (coherence, warm starts). A point keeps the relief that it has left, if its start in `next`
 * overlaps too and `next` relieves. Friction springs stay stretched where both have friction. Filters
 * and safety limits of the hands stay as they were.
 * Returns the previous session, which the caller destroys; or NULL with `error` filled, and nothing
 * has changed. Waits for other callers, 2 s at most, and then for the frame in progress, 2 s at most
 * (H6_ERROR_BUSY: a driver hangs). Any thread: callers take turns, and each gets the session that ran
 * until its own one came. The haptic thread is refused (H6_ERROR_BUSY). Meanwhile another thread may
 * join the loop and destroy its session, but not the loop. */
H6_API h6Session* h6ChangeSession(h6Loop* loop, h6Session* next, h6Error* error);
/* The same between two steps of a program that steps by itself. False: `error` is filled, no change. */
H6_API bool   h6TakeOver(h6Session* next, const h6Session* before, h6Error* error);
H6_API bool   h6LoopRunning(const h6Loop* loop);
/* Asks the loop to end after the current frame; any thread, and a signal handler. */
H6_API void   h6RequestStop(h6Loop* loop);
/* The same as h6Arm and h6Disarm, for the next frame; any thread. */
H6_API void   h6ArmLoop(h6Loop* loop);
H6_API void   h6DisarmLoop(h6Loop* loop);
/* Stops every device now, sends nothing more and ends the loop; waits at most 2 ms for a command that
 * is being written. Any thread, and a signal handler. h6HaltAll halts every loop of the process, and
 * so does the exit of the process. The program installs its signal handlers itself. */
H6_API void   h6HaltLoop(h6Loop* loop);
H6_API void   h6HaltAll(void);
/* Waits for the loop's end, stops the devices and writes the report, unless `out` is NULL. Records can
 * be read until h6DestroyLoop. One thread at a time, not the haptic thread: there h6JoinLoop gives zeros
 * and h6DestroyLoop only asks the loop to end. */
H6_API void         h6JoinLoop(h6Loop* loop, h6LoopReport* out);
H6_API void         h6DestroyLoop(h6Loop* loop);

#ifdef __cplusplus
}
#endif
#endif
