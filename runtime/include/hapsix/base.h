// SPDX-License-Identifier: Apache-2.0
/* base.h - version, visibility, status bits, hooks for memory and messages.
 *
 * Everything in this folder is plain C99 (and C++), needs only the standard headers and is the
 * whole contract between the engine and a program that embeds it.
 *
 * A program that was compiled with an earlier 0.1 runs with this library unchanged. Definitions, and
 * records that may grow, end in `reserved`: a member that comes later takes words of it, so no size,
 * no offset and no array changes, and a zero there means "as before". A program writes zeros there: it
 * begins with the default function of the definition. A definition with other words is refused, since it asks for
 * something that this library does not know. Enumerations grow at their end.
 */
#ifndef HAPSIX_BASE_H
#define HAPSIX_BASE_H

#include <stddef.h>
#include <stdint.h>

#define H6_VERSION_MAJOR 0
#define H6_VERSION_MINOR 1
#define H6_VERSION_PATCH 0

#if defined(__GNUC__)
#define H6_API __attribute__((visibility("default")))
#else
#define H6_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* The version of the library that runs, 10000 * major + 100 * minor + patch; the macros tell which one
 * the program was compiled with. */
H6_API uint32_t h6Version(void);
/* One line for reports: version, compiler, SIMD targets that this machine runs, best first. */
H6_API const char* h6BuildInfo(void);

/* What happened in this frame, as bits; 0 is a frame in which nothing was dropped or limited.
 * Each bit says what was done about it and what the user can change. */
typedef uint32_t h6Status;
enum {
  H6_OK = 0,
  /* More points touched than max_contacts: the deepest of every place and direction were kept, then
     the deepest of the others. Raise h6SessionDef.max_contacts. */
  H6_CONTACTS_DROPPED = 1u << 0,
  /* A hand sent a pose that is not finite: its last good pose was used. */
  H6_HAND_NOT_FINITE = 1u << 1,
  /* A body's state became non-finite: it was put back to its last good pose, at rest. */
  H6_STATE_NOT_FINITE = 1u << 2,
  /* The virtual coupling pulls with its largest force or torque: the hand is ahead of the body. */
  H6_COUPLING_SATURATED = 1u << 3,
  /* The 6x6 system could not be solved: this body took an explicit step. */
  H6_SOLVE_FAILED = 1u << 4,
  /* The wrench was cut to the device's rating; admittance: the pose to its workspace. */
  H6_OUTPUT_CLAMPED = 1u << 5,
  /* The wrench changed faster than the slew limit and was slowed down; admittance: the motion. */
  H6_OUTPUT_SLEWED = 1u << 6,
  /* The output is held by a fault until h6Arm: the wrench at zero; admittance: the pose. */
  H6_OUTPUT_FAULT = 1u << 7,
  /* A device could not be read or written in this frame. */
  H6_DEVICE_LOST = 1u << 8,
  /* The frame before this one ended after its deadline. */
  H6_LATE = 1u << 9,
  /* Energy would have been made at a hand or a contact: the passivity controller took it away. */
  H6_PASSIVITY = 1u << 10,
  /* The frame would have overrun h6SessionDef.frame_budget_us: the last h6FrameReport.coarse_pairs
   * pairs sampled only coarse_points of each sixteen points. Raise the budget, lower the rate, or give
   * the shell fewer points. */
  H6_COARSE = 1u << 11,
  /* A body near a field would have moved farther than a fifth of a voxel in a step, since the frame
   * had no steps left or the body gained speed too suddenly: all bodies were slowed down. Raise
   * h6SessionDef.max_substeps or the rate. */
  H6_SHORTENED = 1u << 12,
  /* More pairs of bodies were near each other than max_pairs: some that came last take no part until
   * others have parted. Raise h6SessionDef.max_pairs. */
  H6_PAIRS_LEFT_OUT = 1u << 13
};

/* The name of one status bit ("contacts dropped"), or NULL when the bit has no name. */
H6_API const char* h6StatusName(h6Status bit);

/* Why a call failed, for programs. */
typedef enum h6ErrorCode {
  H6_NO_ERROR = 0,
  H6_ERROR_ARGUMENT,  /* a NULL, a count or an index that cannot be, a definition that is not whole   */
  H6_ERROR_RANGE,     /* a value outside the range that its comment gives, or not finite             */
  H6_ERROR_MEMORY,    /* the allocator, or the machine, has no more                                   */
  H6_ERROR_SYSTEM,    /* the system refused a thread or another service                               */
  H6_ERROR_BUSY,      /* a loop runs that session                                                     */
  H6_ERROR_FILE,      /* a file cannot be read or written                                             */
  H6_ERROR_CONTENT,   /* a file or mesh was read, and what it holds cannot be used                    */
  H6_ERROR_CANCELLED  /* a progress function returned false                                           */
} h6ErrorCode;

/* ... and for people: one sentence that says what is wrong, where, and what to do. */
typedef struct h6Error {
  char        message[512];
  h6ErrorCode code;
} h6Error;

/* All memory of a model, session, loop or workers comes from these two when both are set, else from the
 * C library. They are called only while one of them is created or destroyed and in h6RestartFit, never
 * inside a step, and with an alignment of at least 64. What the system and TBB keep for threads of the
 * engine is not of this memory: for helpers, and for the haptic thread and the watchdog of a loop. A model
 * and a session have no such threads with h6Tasks and parallel_for of the program. */
typedef struct h6Allocator {
  void* (*allocate)(void* user, size_t bytes, size_t alignment);
  void (*release)(void* user, void* memory, size_t bytes);
  void* user;
} h6Allocator;

/* Sentences that no call returns: how a session starts, what a bake repaired. The default is silence;
 * nothing is ever printed. Any thread but one inside a step calls it, so it must be thread-safe. Set it
 * before any other call; NULL restores silence. */
typedef enum h6LogLevel { H6_LOG_NOTE = 0, H6_LOG_WARNING } h6LogLevel;
typedef void (*h6LogHandler)(void* user, h6LogLevel level, const char* sentence);
H6_API void h6SetLogHandler(h6LogHandler handler, void* user);
H6_API void h6Log(h6LogLevel level, const char* sentence); /* to that handler */

/* A program's own workers, for sessions with several threads (h6SessionDef.tasks). At the start of
 * each frame the engine calls enqueue once for every helper that it would like: some thread of the
 * program, not the caller, should soon run task(context), which takes work until the frame ends. At the
 * end of the frame it calls finish with what enqueue returned: task then returns at once, or does
 * nothing if it has not begun, and finish returns when it will not touch `context` again. A task that
 * never runs only makes the frame slower. Both are called by the stepping thread. */
typedef struct h6Tasks {
  void* (*enqueue)(void* user, void (*task)(void* context), void* context);
  void  (*finish)(void* user, void* handle);
  void* user;
} h6Tasks;

/* Called when one of the engine's own assertions fails; return 0 to go on, else the process
 * stops. Set before any other call; NULL restores the default (a line on stderr, then stop). A library
 * that was built with NDEBUG, as a release is, has no assertions and never calls it. */
typedef int (*h6AssertHandler)(const char* condition, const char* file, int line);
H6_API void h6SetAssertHandler(h6AssertHandler handler);
H6_API int h6AssertFailed(const char* condition, const char* file, int line);

#if defined(NDEBUG) && !defined(H6_FORCE_ASSERTS)
#define H6_ASSERT(condition) ((void)0)
#else
#define H6_ASSERT(condition)                                                        \
  do {                                                                              \
    if (!(condition) && h6AssertFailed(#condition, __FILE__, __LINE__)) __builtin_trap(); \
  } while (0)
#endif

#ifdef __cplusplus
}
#endif
#endif
