// SPDX-License-Identifier: Apache-2.0
/* base.h - version, visibility, status bits, hooks for memory and messages.
 *
 * Everything in this folder is plain C99 (and C++), needs only the standard headers and is the
 * whole contract between the engine and a program that embeds it.
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
  H6_SHORTENED = 1u << 12
};

/* The name of one status bit ("contacts dropped"), or NULL when the bit has no name. */
H6_API const char* h6StatusName(h6Status bit);

/* Why a call failed: one sentence that says what is wrong, where, and what to do. */
typedef struct h6Error {
  char message[512];
} h6Error;

/* Memory comes from these two when both are set, else from the C library. They are called only
 * while a model, session or loop is created or destroyed, never inside a step. */
typedef struct h6Allocator {
  void* (*allocate)(void* user, size_t bytes, size_t alignment);
  void (*release)(void* user, void* memory, size_t bytes);
  void* user;
} h6Allocator;

/* Called when one of the engine's own assertions fails; return 0 to go on, else the process
 * stops. Set before any other call; NULL restores the default (a line on stderr, then stop). */
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
