// SPDX-License-Identifier: Apache-2.0
/* own_tasks.c - memory, tasks and messages of your program: the engine asks for memory while it
 * makes models and sessions, and never in a step. */
#define _POSIX_C_SOURCE 200112L
#include <stdio.h>
#include <stdlib.h>

#include "floor.h"

typedef struct Heap {
  size_t calls, bytes;
} Heap;

static void* allocate(void* user, size_t bytes, size_t alignment) {
  Heap* heap = user;
  heap->calls += 1, heap->bytes += bytes;
  void* memory = NULL;
  return posix_memalign(&memory, alignment, bytes) == 0 ? memory : NULL;
}
static void release(void* user, void* memory, size_t bytes) {
  ((Heap*)user)->bytes -= bytes;
  free(memory);
}

/* Here your task system would run body(context, 0 .. count - 1) on its threads and wait for them.
 */
static void parallel_for(void* user, size_t count, void (*body)(void*, size_t), void* context) {
  for (size_t i = 0; i < count; ++i) body(context, i);
  *(size_t*)user += count;
}

static void log_line(void* user, h6LogLevel level, const char* sentence) {
  fprintf(user, "%s: %s\n", level == H6_LOG_WARNING ? "warning" : "note", sentence);
}

int main(void) {
  h6SetLogHandler(log_line, stderr);
  Heap heap = {0, 0};
  size_t tasks = 0;
  h6Error error;
  h6ModelDef parts = h6DefaultModelDef();
  h6SessionDef def = h6DefaultSessionDef();
  parts.allocator.allocate = allocate, parts.allocator.release = release;
  parts.allocator.user = &heap;
  def.allocator = parts.allocator;
  parts.parallel_for = parallel_for, parts.parallel_user = &tasks;
  h6Model* model = floor_and_tip(parts, &error);
  h6Session* session = model ? hold_tip(model, def, &error) : NULL;
  if (!session) return fprintf(stderr, "%s\n", error.message), 1;
  const size_t before = heap.calls;
  h6DeviceSample hand = h6DefaultDeviceSample();
  h6DeviceCommand felt;
  for (int i = 0; i < 1000; ++i) h6Step(session, &hand, &felt);
  printf("%zu allocations in 1000 steps, %s tasks of the program\n", heap.calls - before,
         tasks ? "used" : "no");
  h6DestroySession(session), h6DestroyModel(model);
  printf("%zu bytes are left\n", heap.bytes);
  return before == 0;
}
