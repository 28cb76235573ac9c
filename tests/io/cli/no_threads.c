// SPDX-License-Identifier: Apache-2.0
/* no_threads.c - preloaded: the system gives no more threads. */
#include <errno.h>
#include <pthread.h>

int pthread_create(pthread_t* thread, const pthread_attr_t* how, void* (*work)(void*), void* with) {
  (void)thread, (void)how, (void)work, (void)with;
  return EAGAIN;
}
