// SPDX-License-Identifier: Apache-2.0
#include "io/file/mapped_file.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

namespace h6::io {
namespace {

std::size_t page_of(std::size_t at) {
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  return at / page * page;
}

}  // namespace

MappedFile::~MappedFile() {
  if (data_ != nullptr) munmap(data_, size_);
}

int MappedFile::open(const std::filesystem::path& file) {
  const int fd = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return errno;
  const int error = map(fd);
  close(fd);
  return error;
}

int MappedFile::map(int fd) {
  struct stat there {};
  if (fstat(fd, &there) != 0) return errno;
  if (!S_ISREG(there.st_mode)) return EINVAL;
  if (there.st_size == 0) return 0;
  const auto size = static_cast<std::size_t>(there.st_size);
  int flags = MAP_PRIVATE;
#ifdef MAP_NORESERVE
  flags |= MAP_NORESERVE;  // hardly a page is written
#endif
  void* const place = mmap(nullptr, size, PROT_READ | PROT_WRITE, flags, fd, 0);
  if (place == MAP_FAILED) return errno;
  data_ = static_cast<char*>(place);
  size_ = size;
  return 0;
}

void MappedFile::expect(std::size_t at, std::size_t bytes) const {
  if (at >= size_) return;
  const std::size_t first = page_of(at);
  madvise(data_ + first, std::min(bytes, size_ - at) + at - first, MADV_WILLNEED);  // only a hint
}

int MappedFile::fetch(std::size_t at, std::size_t bytes) const {
#ifdef MADV_POPULATE_READ
  const std::size_t first = page_of(at);
  if (madvise(data_ + first, at + bytes - first, MADV_POPULATE_READ) == 0) return 0;
  // Linux before 5.14 does not know the advice. EFAULT: the file was cut, or its disk fails.
  return errno == EINVAL ? 0 : errno == EFAULT ? EIO : errno;
#else
  return 0;
#endif
}

}  // namespace h6::io
