// SPDX-License-Identifier: Apache-2.0
/* batch.h - many sessions in one call, on several threads: for learning, sampling and search.
 *
 *   h6CreateWorkers -> h6StepMany(workers, arrays), as often as you like -> h6DestroyWorkers
 *
 * Sessions may share one model, which is only read. A session gives the same bits as with h6Step alone,
 * on any number of workers and beside any other sessions. A call never allocates, locks, prints or
 * throws; it waits only for the sessions that other workers are stepping. Make the workers first and
 * the sessions with h6SessionDef.workers: they then share one scratch a thread, which stays in its
 * cache, and take a third of the memory. Those without an allocator of their own lie side by side in
 * pages of 2 MB, where the system gives such pages; that memory is free again when all sessions in a
 * piece of 16 MB have ended. Other sessions can be stepped here, too, as long as nobody else steps
 * them. Use `threads` 1, since here a session stays on one thread, and max_contacts as small as your
 * parts allow: that is most of a session's memory. */
#ifndef HAPSIX_BATCH_H
#define HAPSIX_BATCH_H

#include "hapsix.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct h6Workers h6Workers;

typedef struct h6WorkersDef {
  uint32_t threads;     /* 1 .. 64, the calling one included; 0, the default: one for each core    */
  h6Tasks  tasks;       /* the program's own workers in place of the engine's; zero: the engine's   */
  h6Allocator allocator;/* of the workers, and of the scratch of sessions that name them; zero: heap */
  uint64_t reserved[5];
} h6WorkersDef;
H6_API h6WorkersDef h6DefaultWorkersDef(void);

/* The engine's workers poll during a call and nap between calls. def NULL: the default. NULL with
 * `error` filled for threads above 64, words in `reserved`, and where the system gives no threads. */
H6_API h6Workers* h6CreateWorkers(const h6WorkersDef* def, h6Error* error);
/* After the sessions that name them, and in no call with them. NULL is allowed. */
H6_API void       h6DestroyWorkers(h6Workers* workers);
H6_API uint32_t   h6WorkerThreads(const h6Workers* workers); /* 0 for a NULL                        */

/* One column for each quantity. Session i has the rows `hands` * i and on, one for each of its hands;
 * a row is a struct of doubles without gaps, so a column is also an array (rows x 7) or (rows x 6). What
 * a column means is said at the member of h6DeviceSample, h6DeviceCommand, h6BodyState and h6FrameReport
 * with that name. Columns of outputs may each be NULL; they must not overlap. */
typedef struct h6StepArrays {
  h6Session* const* sessions;    /* (count) each of them once                                       */
  size_t            count;
  uint32_t          hands;       /* of every session, 0 .. H6_MAX_HANDS; default 1                  */
  uint32_t          steps;       /* frames that each session takes, all with its samples of this call
                                    (default 1, at least 1): outputs are those of the last frame    */
  const h6Pose*     pose;        /* (rows) of each hand's sample; may be NULL only for no hands     */
  const h6Velocity* velocity;    /* (rows) of the sample; NULL: at rest                             */
  const h6Wrench*   wrench;      /* (rows) of the sample; NULL: zero                                */
  const uint32_t*   buttons;     /* (rows) of the sample; NULL: none                                */

  h6Wrench*         command;     /* (rows) the wrench on each hand                       [N, N m]  */
  h6Pose*           command_pose;/* (rows)                                                         */
  uint32_t*         causes;      /* (rows)                                                         */
  h6BodyState*      body;        /* (rows) of the hand's body, mesh frame: (rows x 13)              */
  h6Status*         status;      /* (count) all bits of the frames                                 */
  uint32_t*         contacts;    /* (count) points that touch                                      */
  double*           max_depth;   /* (count) deepest point                                     [m]  */
  double*           max_depth_voxels; /* (count)                                                   */
  uint64_t*         state_hash;  /* (count)                                                        */
  uint64_t          reserved[8];
} h6StepArrays;
H6_API h6StepArrays h6DefaultStepArrays(void);

/* Steps every session and returns the bits of all of them. A session that is NULL, has another number
 * of hands, names other workers, or is run by a loop or another thread gets H6_OUTPUT_FAULT and rows of zeros, and does not
 * change; the others step. Nothing steps, nothing is written and the result is H6_OUTPUT_FAULT for
 * arrays that are NULL, not whole or with words in `reserved`, and while another thread is in a call
 * with the same workers. workers NULL: all on the calling thread. Any thread may call. */
H6_API h6Status h6StepMany(h6Workers* workers, const h6StepArrays* arrays);

#ifdef __cplusplus
}
#endif
#endif
