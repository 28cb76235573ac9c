// SPDX-License-Identifier: Apache-2.0
// copies.cpp - see copies.h.
#include "io/record/copies.h"

#include <fcntl.h>
#include <stdio.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>
#include <vector>

namespace h6::io::recording {
namespace fs = std::filesystem;

namespace {

fs::path with_ending(const fs::path& file, const std::string& ending) {
  fs::path name = file;
  name += ending;
  return name;
}

// 0, or errno. A limit on file sizes is asked first: past it the kernel sends a signal that ends
// programs which do not expect it.
int write_all(int fd, const std::byte* from, std::size_t bytes, std::uint64_t at) {
  rlimit limit{};
  if (getrlimit(RLIMIT_FSIZE, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY &&
      at + bytes > limit.rlim_cur)
    return EFBIG;
  while (bytes > 0) {
    const ssize_t wrote = ::pwrite(fd, from, bytes, static_cast<off_t>(at));
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote < 0) return errno;
    if (wrote == 0) return ENOSPC;
    from += wrote, at += static_cast<std::uint64_t>(wrote);
    bytes -= static_cast<std::size_t>(wrote);
  }
  return 0;
}

int apply(int fd, const Change& change) {
  for (const auto& [number, page] : change.pages) {
    const std::uint64_t at = number * page_bytes;
    if (at >= change.size) break;
    const auto bytes =
        static_cast<std::size_t>(std::min<std::uint64_t>(page_bytes, change.size - at));
    if (const int error = write_all(fd, page.data(), bytes, at)) return error;
  }
  return ::ftruncate(fd, static_cast<off_t>(change.size)) == 0 ? 0 : errno;
}

int copy_all(int from, int to) {
  std::vector<std::byte> buffer(std::size_t{1} << 20);
  for (std::uint64_t at = 0;;) {
    const ssize_t got = ::pread(from, buffer.data(), buffer.size(), static_cast<off_t>(at));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return errno;
    if (got == 0) return 0;
    if (const int error = write_all(to, buffer.data(), static_cast<std::size_t>(got), at))
      return error;
    at += static_cast<std::uint64_t>(got);
  }
}

void close_file(int& fd) {
  if (fd >= 0) ::close(fd);
  fd = -1;
}

// Renames are on the disk when the folder is. Not every file system can: then it stays as it is.
void sync_folder(const fs::path& file) {
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return;
  (void)::fsync(fd);
  ::close(fd);
}

}  // namespace

fs::path followed(const fs::path& file) {
  std::error_code failed;
  const fs::path place = fs::is_symlink(file, failed) ? fs::weakly_canonical(file, failed) : file;
  return failed || place.empty() ? file : place;
}

fs::path part_of(const fs::path& file) { return with_ending(file, ".part"); }
fs::path swap_of(const fs::path& file) { return with_ending(file, ".swap"); }

bool swap_names(const fs::path& shown, const fs::path& other, const fs::path& spare_name,
                bool one_step) {
  if (one_step &&
      ::renameat2(AT_FDCWD, other.c_str(), AT_FDCWD, shown.c_str(), RENAME_EXCHANGE) == 0)
    return true;
  if (one_step && errno != EINVAL && errno != ENOSYS && errno != EOPNOTSUPP) return false;
  ::unlink(spare_name.c_str());
  if (::link(shown.c_str(), spare_name.c_str()) != 0 &&
      ::rename(shown.c_str(), spare_name.c_str()) != 0)
    return false;
  return ::rename(other.c_str(), shown.c_str()) == 0 &&
         ::rename(spare_name.c_str(), other.c_str()) == 0;
}

fs::path free_name(const fs::path& file, const char* ending) {
  fs::path name = with_ending(file, ending);
  std::error_code ignored;
  for (int i = 2; fs::exists(fs::symlink_status(name, ignored)); ++i)
    name = with_ending(file, ending + ("-" + std::to_string(i)));
  return name;
}

Copies::~Copies() {
  close_file(published_.fd);
  close_file(spare_.fd);
}

Failure Copies::failed(const char* doing, int error) const {
  return {std::string("cannot ") + doing + " " + file_.string() + ": " + std::strerror(error)};
}

bool Copies::named(const fs::path& name, const Copy& copy) const {
  struct stat by_name {
  }, by_fd{};
  return copy.fd >= 0 && ::lstat(name.c_str(), &by_name) == 0 && ::fstat(copy.fd, &by_fd) == 0 &&
         by_name.st_dev == by_fd.st_dev && by_name.st_ino == by_fd.st_ino;
}

Outcome Copies::start(const Change& first) {
  if (Outcome made = new_spare(false); !made) return made;
  const fs::path part = part_of(file_);
  if (const int error = apply(spare_.fd, first)) {
    drop_spare();
    return failed("write", error);
  }
  std::error_code ignored;
  if (fs::exists(file_, ignored)) {
    const fs::path kept = free_name(file_, ".before");
    if (::link(file_.c_str(), kept.c_str()) != 0 && ::rename(file_.c_str(), kept.c_str()) != 0) {
      const int error = errno;
      drop_spare();
      return failed("set aside the older", error);
    }
    before_ = kept;
  }
  if (::rename(part.c_str(), file_.c_str()) != 0) {
    const int error = errno;
    drop_spare();
    if (!before_.empty()) {
      ::rename(before_.c_str(), file_.c_str());
      ::unlink(before_.c_str());  // where it was a second link, the rename did nothing
    }
    before_.clear();
    return failed("write", error);
  }
  published_ = std::exchange(spare_, {});
  return Done{};
}

Outcome Copies::new_spare(bool filled) {
  close_file(spare_.fd);
  const fs::path part = part_of(file_);
  ::unlink(part.c_str());
  spare_.fd = ::open(part.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (spare_.fd < 0) return failed("write", errno);
  if (const int error = filled ? copy_all(published_.fd, spare_.fd) : 0) {
    drop_spare();
    return failed("write", error);
  }
  behind_ = {};
  return Done{};
}

// The spare was the published copy a moment ago: whoever opened it then and still reads (HDF5 locks
// what it opens) keeps it, and it is replaced by a new copy. So is one that somebody removed.
Outcome Copies::prepare_spare() {
  const bool there = named(part_of(file_), spare_);
  const bool read_by_others =
      there && ::flock(spare_.fd, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  if (!there || read_by_others) {
    if (Outcome made = new_spare(true); !made) return made;
    (void)::flock(spare_.fd, LOCK_EX | LOCK_NB);
  }
  return Done{};
}

Outcome Copies::publish(Change change) {
  if (Outcome ready = prepare_spare(); !ready) return ready;
  int error = behind_.pages.empty() ? 0 : apply(spare_.fd, behind_);
  if (error == 0) error = apply(spare_.fd, change);
  (void)::flock(spare_.fd, LOCK_UN);
  if (error != 0) {
    drop_spare();  // half written; and on a full disk its room is needed
    return failed("write", error);
  }
  const fs::path part = part_of(file_);
  struct stat ignored {};
  const bool gone = ::lstat(file_.c_str(), &ignored) != 0;
  if (!gone && !named(file_, published_)) {
    drop_spare();
    return Failure{"stopped recording to " + file_.string() +
                   ": another program put a file there; give every run its own file"};
  }
  const bool shown =
      gone ? ::rename(part.c_str(), file_.c_str()) == 0 : swap_names(file_, part, swap_of(file_));
  if (!shown) return failed("write", errno);
  std::swap(published_, spare_);
  behind_ = std::move(change);
  return Done{};
}

Outcome Copies::finish() {
  drop_spare();
  if (::fsync(published_.fd) != 0 && errno != EINVAL && errno != EROFS)
    return failed("finish", errno);
  if (!before_.empty()) ::unlink(before_.c_str());
  before_.clear();
  sync_folder(file_);
  return Done{};
}

void Copies::abandon() {
  drop_spare();
  if (!named(file_, published_)) return;
  if (before_.empty())
    ::unlink(file_.c_str());
  else
    ::rename(before_.c_str(), file_.c_str());
  before_.clear();
}

void Copies::drop_spare() {
  if (named(part_of(file_), spare_)) ::unlink(part_of(file_).c_str());
  close_file(spare_.fd);
}

}  // namespace h6::io::recording
