// SPDX-License-Identifier: Apache-2.0
/* quiet_host.c - a program with an allocator, a pool and a log of its own: the engine takes all of its
 * memory from that allocator and nothing after creation, starts no thread and writes nothing to stdout
 * and stderr. */
#define _GNU_SOURCE
#include <dirent.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "hapsix/batch.h"
#include "runtime/examples/floor.h"

void* __libc_malloc(size_t);
void* __libc_calloc(size_t, size_t);
void* __libc_realloc(void*, size_t);
void* __libc_memalign(size_t, size_t);
static long of_heap, of_ours, held, lines, tasks;
/* All that asks the C library for memory comes through here, the engine and its packages too. */
void* malloc(size_t n) { return ++of_heap, __libc_malloc(n); }
void* calloc(size_t n, size_t each) { return ++of_heap, __libc_calloc(n, each); }
void* realloc(void* p, size_t n) { return ++of_heap, __libc_realloc(p, n); }
void* aligned_alloc(size_t a, size_t n) { return ++of_heap, __libc_memalign(a, n); }
int posix_memalign(void** p, size_t a, size_t n) {
  return ++of_heap, (*p = __libc_memalign(a, n)) == NULL;
}

static void* allocate(void* user, size_t bytes, size_t alignment) {
  (void)user, ++of_ours, held += (long)bytes;
  return __libc_memalign(alignment, bytes);
}
static void release(void* user, void* memory, size_t bytes) {
  (void)user, held -= (long)bytes, free(memory);
}

/* The pool: one thread, which takes one task at a time. */
static struct {
  pthread_t thread;
  pthread_mutex_t lock;
  pthread_cond_t changed;
  void (*task)(void*);
  void* context;
  enum { IDLE, GIVEN, RUNS, ENDS } state;
  long ran;
} pool = {.lock = PTHREAD_MUTEX_INITIALIZER, .changed = PTHREAD_COND_INITIALIZER};

static void* work(void* unused) {
  pthread_mutex_lock(&pool.lock);
  while (pool.state != ENDS) {
    if (pool.state != GIVEN) {
      pthread_cond_wait(&pool.changed, &pool.lock);
      continue;
    }
    pool.state = RUNS, ++pool.ran;
    pthread_mutex_unlock(&pool.lock);
    pool.task(pool.context);
    pthread_mutex_lock(&pool.lock);
    pool.state = IDLE;
    pthread_cond_broadcast(&pool.changed);
  }
  pthread_mutex_unlock(&pool.lock);
  return unused;
}
static void* enqueue(void* user, void (*task)(void*), void* context) {
  (void)user;
  pthread_mutex_lock(&pool.lock);
  pool.task = task, pool.context = context, pool.state = GIVEN;
  pthread_cond_broadcast(&pool.changed);
  pthread_mutex_unlock(&pool.lock);
  return &pool;
}
static void finish(void* user, void* handle) {
  (void)user, (void)handle;
  pthread_mutex_lock(&pool.lock);
  if (pool.state == GIVEN) pool.state = IDLE; /* it has not begun and never will */
  while (pool.state == RUNS) pthread_cond_wait(&pool.changed, &pool.lock);
  pthread_mutex_unlock(&pool.lock);
}
static void parallel_for(void* user, size_t count, void (*body)(void*, size_t), void* context) {
  (void)user;
  for (size_t i = 0; i < count; ++i) body(context, i), ++tasks;
}
static void log_line(void* user, h6LogLevel level, const char* sentence) {
  (void)user, (void)level, lines += sentence[0] != 0;
}
static int threads(void) {
  int count = 0;
  DIR* all = opendir("/proc/self/task");
  for (struct dirent* one; all && (one = readdir(all)) != NULL;) count += one->d_name[0] != '.';
  if (all) closedir(all);
  return count;
}

int main(int argc, char** argv) {
  const char* said = argc > 1 ? argv[1] : "quiet_host.out";
  const int out = open(said, O_RDWR | O_CREAT | O_TRUNC, 0600), terminal = dup(1);
  dup2(out, 1), dup2(out, 2);
  h6SetLogHandler(log_line, NULL);
  pthread_create(&pool.thread, NULL, work, NULL);
  const int of_host = threads();
  h6ModelDef parts = h6DefaultModelDef();
  parts.allocator.allocate = allocate, parts.allocator.release = release;
  parts.parallel_for = parallel_for;
  h6SessionDef def = h6DefaultSessionDef();
  def.allocator = parts.allocator;
  def.threads = 2, def.tasks.enqueue = enqueue, def.tasks.finish = finish;
  h6Error error;
  h6WorkersDef crew = h6DefaultWorkersDef();
  crew.allocator = parts.allocator, crew.threads = 2, crew.tasks = def.tasks;
  const long heap_at_first = of_heap;
  h6Model* model = floor_and_tip(parts, &error);
  h6Session* session = model ? hold_tip(model, def, &error) : NULL;
  h6Workers* workers = h6CreateWorkers(&crew, &error);
  const long to_create = of_heap - heap_at_first;
  h6DeviceSample in = h6DefaultDeviceSample();
  h6DeviceCommand felt;
  in.pose.p.x = in.pose.p.y = 4e-3;
  const long heap_before = of_heap, ours_before = of_ours;
  for (int i = 0; session && i < 2000; ++i) {
    in.pose.p.z = 5e-3 - 2e-3 * (i % 500 < 250 ? i % 250 : 250 - i % 250) / 250;
    h6Step(session, &in, &felt);
    h6FrameRecord row;
    h6GetRecord(session, &in, &felt, &row);
  }
  const long allocated = of_heap - heap_before + of_ours - ours_before;
  const int running = threads() - of_host;
  /* A start inside the floor is told to the log. */
  h6BodyDef body[2] = {h6DefaultBodyDef(), h6DefaultBodyDef()};
  body[0].fixed = true, body[0].field = 0;
  body[1].shell = 0, body[1].pose.p.x = body[1].pose.p.y = 4e-3, body[1].pose.p.z = 2e-3;
  def.bodies = body, def.body_count = 2;
  h6Session* inside = model ? h6CreateSession(model, &def, &error) : NULL;
  h6DestroySession(inside);
  /* Refusals are sentences for the caller, and no text for the terminal. */
  def.rate = -1;
  const bool refused = h6CreateSession(model, &def, &error) == NULL && error.code != H6_NO_ERROR;
  h6DestroyWorkers(workers), h6DestroySession(session), h6DestroyModel(model);
  pthread_mutex_lock(&pool.lock);
  pool.state = ENDS;
  pthread_cond_broadcast(&pool.changed);
  pthread_mutex_unlock(&pool.lock);
  pthread_join(pool.thread, NULL);
  struct stat written;
  fstat(out, &written);
  dup2(terminal, 1);
  dprintf(1, "%ld of the heap, %ld bytes kept, %ld allocations in 2000 steps, %d threads, "
          "%ld bytes said, %ld tasks, %s, %ld line, %s\n",
          to_create, held, allocated, running, (long)written.st_size, tasks,
          refused && ours_before > 0 ? "refused" : "not refused", lines,
          pool.ran > 0 ? "helped by the pool" : "never helped");
  return 0;
}
