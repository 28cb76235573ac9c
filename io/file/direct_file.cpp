// SPDX-License-Identifier: Apache-2.0
#include "io/file/direct_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>

#include "sched/parallel_for.h"

namespace h6::io {
namespace {

std::size_t whole_pages(std::size_t bytes) {
  return (bytes + kDirectPage - 1) / kDirectPage * kDirectPage;
}

// Repeats `call` until all bytes are moved, an error occurs (errno) or the file ends (0). `moved`
// counts the bytes.
template <class Call>
int all_of(std::size_t bytes, std::size_t& moved, const Call& call) {
  for (moved = 0; moved < bytes;) {
    const ssize_t n = call(moved);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return errno;
    if (n == 0) return 0;
    moved += std::size_t(n);
  }
  return 0;
}

}  // namespace

void FreeBuffer::operator()(char* bytes) const { std::free(bytes); }

DirectBuffer direct_buffer(std::size_t bytes) {
  return DirectBuffer(static_cast<char*>(
      std::aligned_alloc(kDirectPage, std::max(kDirectPage, whole_pages(bytes)))));
}

DirectFile::~DirectFile() {
  if (fd_ >= 0) close(fd_);
  if (direct_ >= 0) close(direct_);
}

int DirectFile::open(const std::filesystem::path& file) {
  const int flags = O_WRONLY | O_CLOEXEC;
  fd_ = ::open(file.c_str(), flags);
  if (fd_ < 0) return errno;
  struct stat there {};
  if (fstat(fd_, &there) != 0) return errno;
  if (!S_ISREG(there.st_mode)) return EINVAL;
#ifdef O_DIRECT
  direct_ = ::open(file.c_str(), flags | O_DIRECT);  // some file systems refuse
  struct stat same {};
  const bool one = direct_ >= 0 && fstat(direct_, &same) == 0 && same.st_ino == there.st_ino &&
                   same.st_dev == there.st_dev;
  use_direct_ = one;
#endif
  return 0;
}

int DirectFile::reserve(std::uint64_t bytes) {
#ifdef __linux__
  if (fallocate(fd_, 0, 0, off_t(bytes)) != 0 && errno != EOPNOTSUPP && errno != ENOSYS &&
      errno != EINVAL && errno != EINTR)
    return errno;
#else
  (void)bytes;
#endif
  return 0;
}

int DirectFile::write(std::uint64_t at, const char* pages, std::size_t bytes) {
  std::size_t done = 0;
  if (use_direct_.load(std::memory_order_relaxed)) {
    const std::size_t whole = whole_pages(bytes);
    const int error = all_of(whole, done, [&](std::size_t from) {
      // After a short write the place is not aligned: the other descriptor writes the rest.
      if (from % kDirectPage != 0) return ssize_t{0};
      return pwrite(direct_, pages + from, whole - from, off_t(at + from));
    });
    if (error != 0 && error != EINVAL) return error;
    if (done >= bytes) return 0;
    if (error == EINVAL) use_direct_ = false;
  }
  std::size_t more = 0;
  const int error = all_of(bytes - done, more, [&](std::size_t from) {
    return pwrite(fd_, pages + done + from, bytes - done - from, off_t(at + done + from));
  });
  if (error != 0) return error;
  return more == bytes - done ? 0 : ENOSPC;
}

int DirectFile::cut(std::uint64_t bytes) { return ftruncate(fd_, off_t(bytes)) == 0 ? 0 : errno; }

int for_blocks(std::size_t count, std::size_t buffer_bytes,
               const std::function<int(std::size_t, char*)>& body) {
  const std::size_t streams = std::min<std::size_t>(count, sched::machine_threads());
  std::atomic<std::size_t> next{0};
  std::atomic<int> failed{0};
  sched::parallel_for(streams, 0, [&](std::size_t) {
    const DirectBuffer buffer = direct_buffer(buffer_bytes);
    if (!buffer) failed = ENOMEM;
    while (failed == 0) {
      const std::size_t i = next.fetch_add(1);
      if (i >= count) break;
      if (const int error = body(i, buffer.get())) failed = error;
    }
  });
  return failed;
}

}  // namespace h6::io
