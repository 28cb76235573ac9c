// SPDX-License-Identifier: Apache-2.0
#include "io/record/log.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <bit>
#include <cerrno>
#include <cstring>

namespace h6::io::recording {
namespace {

static_assert(std::endian::native == std::endian::little, "rows are written as they are in memory");

constexpr std::uint32_t mark = 0x6c367068;                           // "hp6l"
constexpr std::uint64_t longest_payload = std::uint64_t{256} << 20;  // limits forged sizes
constexpr std::uint32_t longest_chunk = 4096;                        // rows

std::uint32_t checksum(const LogRecord& record, const std::vector<std::byte>& payload) {
  constexpr std::size_t skip = offsetof(LogRecord, kind);
  const uLong head = crc32(0, reinterpret_cast<const Bytef*>(&record) + skip, sizeof record - skip);
  return static_cast<std::uint32_t>(
      crc32_z(head, reinterpret_cast<const Bytef*>(payload.data()), payload.size()));
}

bool read_all(int fd, void* out, std::size_t bytes, std::uint64_t at) {
  for (char* to = static_cast<char*>(out); bytes > 0;) {
    const ssize_t got = ::pread(fd, to, bytes, static_cast<off_t>(at));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    to += got, at += static_cast<std::uint64_t>(got), bytes -= static_cast<std::size_t>(got);
  }
  return true;
}

int write_all(int fd, const std::vector<std::byte>& bytes, std::uint64_t at) {
  // Past a limit on file sizes the kernel sends a signal, which ends most programs.
  rlimit limit{};
  if (getrlimit(RLIMIT_FSIZE, &limit) == 0 && at + bytes.size() > limit.rlim_cur) return EFBIG;
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t wrote =
        ::pwrite(fd, bytes.data() + done, bytes.size() - done, static_cast<off_t>(at + done));
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote <= 0) return wrote < 0 ? errno : ENOSPC;
    done += static_cast<std::size_t>(wrote);
  }
  return 0;
}

// Adds the next record to the index; false if it does not fit the records before it.
bool take(LogIndex& index, const Payload& next) {
  const LogRecord& r = next.record;
  if (index.summary) return false;
  switch (r.kind) {
    case LogKind::head:
      return false;  // once, at the start
    case LogKind::rows: {
      const bool again = !index.rows.empty() && index.rows.back().record.first == r.first;
      if (r.first % index.chunk_rows != 0 || r.count == 0 || r.count > index.chunk_rows ||
          (again ? r.first + r.count < index.row_count : r.first != index.row_count))
        return false;
      if (again) index.rows.pop_back();
      index.rows.push_back(next);
      index.row_count = r.first + r.count;
      return true;
    }
    case LogKind::event:
      if (r.bytes != sizeof(EventRow)) return false;
      index.events.push_back(next);
      return true;
    case LogKind::summary:
      index.summary = next;
      return true;
  }
  return false;
}

}  // namespace

std::filesystem::path followed(const std::filesystem::path& file) {
  std::error_code failed;
  const bool link = std::filesystem::is_symlink(file, failed);
  const auto place = link ? std::filesystem::weakly_canonical(file, failed) : file;
  return failed || place.empty() ? file : place;
}

std::filesystem::path part_of(const std::filesystem::path& file) { return file.string() + ".part"; }

File::~File() {
  if (fd_ >= 0) ::close(fd_);
}

bool File::lock() const { return ::flock(fd_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK; }

bool File::named(const std::filesystem::path& name) const {
  struct stat by_name {
  }, by_fd{};
  return ::lstat(name.c_str(), &by_name) == 0 && ::fstat(fd_, &by_fd) == 0 &&
         by_name.st_dev == by_fd.st_dev && by_name.st_ino == by_fd.st_ino;
}

File create_log(const std::filesystem::path& name) {
  File log(::open(name.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (log.ok()) (void)log.lock();
  return log;
}

File open_log(const std::filesystem::path& name) {
  return File(::open(name.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
}

int append(const File& log, std::uint64_t& end, LogRecord record,
           const std::vector<std::byte>& payload) {
  record.mark = mark;
  record.bytes = payload.size();
  record.checksum = checksum(record, payload);
  std::vector<std::byte> bytes(sizeof record + payload.size());
  std::memcpy(bytes.data(), &record, sizeof record);
  if (!payload.empty()) std::memcpy(bytes.data() + sizeof record, payload.data(), payload.size());
  if (const int error = write_all(log, bytes, end)) {
    (void)!::ftruncate(log, static_cast<off_t>(end));
    return error;
  }
  end += bytes.size();
  return 0;
}

bool read_payload(const File& log, const Payload& payload, std::vector<std::byte>& out) {
  out.resize(payload.record.bytes);
  return read_all(log, out.data(), out.size(), payload.at) &&
         checksum(payload.record, out) == payload.record.checksum;
}

std::optional<LogIndex> index_log(const File& log) {
  struct stat status {};
  if (!log.ok() || ::fstat(log, &status) != 0 || !S_ISREG(status.st_mode)) return {};
  const auto size = static_cast<std::uint64_t>(status.st_size);
  LogIndex index;
  std::vector<std::byte> bytes;
  for (Payload next{}; index.end + sizeof(LogRecord) <= size;) {
    next.at = index.end + sizeof(LogRecord);
    if (!read_all(log, &next.record, sizeof(LogRecord), index.end) || next.record.mark != mark ||
        next.record.bytes > longest_payload || next.record.bytes > size - next.at ||
        !read_payload(log, next, bytes))
      break;
    if (index.end == 0) {
      const std::uint32_t chunk = next.record.count;
      if (next.record.kind != LogKind::head || chunk < 1 || chunk > longest_chunk) return {};
      index.head.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
      index.chunk_rows = chunk;
    } else if (!take(index, next)) {
      break;
    }
    index.end = next.at + next.record.bytes;
  }
  if (index.end == 0) return {};
  return index;
}

}  // namespace h6::io::recording
