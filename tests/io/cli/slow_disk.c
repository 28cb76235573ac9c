// SPDX-License-Identifier: Apache-2.0
/* slow_disk.c - preloaded: the fifth write to a recording's log takes 6 s, and the machine seems to
 * have 105 MB left, so that the ring of records is as short as it may be. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

static int is_log(int file) {
  char link[64], name[4096];
  snprintf(link, sizeof link, "/proc/self/fd/%d", file);
  const ssize_t length = readlink(link, name, sizeof name);
  return length > 5 && memcmp(name + length - 5, ".part", 5) == 0;
}

static ssize_t write_slowly(int file, const void* bytes, size_t size, off_t at) {
  static ssize_t (*real)(int, const void*, size_t, off_t);
  static int writes;
  if (!real) *(void**)&real = dlsym(RTLD_NEXT, "pwrite");
  if (is_log(file) && ++writes == 5) sleep(6);
  return real(file, bytes, size, at);
}
ssize_t pwrite(int file, const void* bytes, size_t size, off_t at) {
  return write_slowly(file, bytes, size, at);
}
ssize_t pwrite64(int file, const void* bytes, size_t size, off64_t at) {
  return write_slowly(file, bytes, size, at);
}

static FILE* open_small(const char* call, const char* name, const char* mode) {
  FILE* (*real)(const char*, const char*);
  *(void**)&real = dlsym(RTLD_NEXT, call);
  if (strcmp(name, "/proc/meminfo") != 0) return real(name, mode);
  FILE* small = tmpfile();  /* a stream of a descriptor, as libstdc++ wants */
  if (!small) return NULL;
  fputs("MemAvailable: 102400 kB\n", small);
  rewind(small);
  return small;
}
FILE* fopen(const char* name, const char* mode) { return open_small("fopen", name, mode); }
FILE* fopen64(const char* name, const char* mode) { return open_small("fopen64", name, mode); }
