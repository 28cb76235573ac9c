// SPDX-License-Identifier: Apache-2.0
// log.h - the append-only file of a run that has not ended. Private.
//
//   OUT.part = head, (rows | event)..., summary        each one a LogRecord and its payload
//
// A record is appended with one write, so a kill cuts off at most the last record, and its checksum
// shows that. Numbers are little-endian. The writer holds a lock on the file; the kernel releases
// it when the process ends, however it ends.
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hapsix/result.h"

namespace h6::io::recording {

enum class LogKind : std::uint32_t {
  head = 1,  // the JSON text of /config/whole; `count` rows make a chunk
  rows,      // `count` rows from row `first` on: one chunk of every column, see below
  event,     // one EventRow
  summary    // the JSON text of /summary
};

// Rows stand as the compressed size of each column's chunk (4 bytes each, in the order of
// columns()), then those chunks. A chunk that is not full may follow again with more rows: the
// later record replaces the earlier one.
struct LogRecord {
  std::uint32_t mark, checksum;  // checksum: crc32 of the rest of this and of the payload
  LogKind kind;
  std::uint32_t count;
  std::uint64_t first, bytes;  // bytes: of the payload
};
static_assert(sizeof(LogRecord) == 32);

constexpr std::size_t event_what_bytes = 64, event_detail_bytes = 512;
struct EventRow {
  double t;                                                 // [s]
  char what[event_what_bytes], detail[event_detail_bytes];  // filled with NULs
};

// The file that a symbolic link names. That file is written and has its log beside it.
std::filesystem::path followed(const std::filesystem::path& file);
std::filesystem::path part_of(const std::filesystem::path& file);  // OUT.part

// An open file, closed at the end of the scope.
class File {
 public:
  explicit File(int fd = -1) : fd_(fd) {}
  File(File&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  File& operator=(File&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~File();
  operator int() const { return fd_; }
  bool ok() const { return fd_ >= 0; }
  // False where another process holds the lock.
  bool lock() const;
  // Whether `name` still leads to this file.
  bool named(const std::filesystem::path& name) const;

 private:
  int fd_;
};

// A new, empty, locked file; refuses an existing one with errno EEXIST.
File create_log(const std::filesystem::path& name);
File open_log(const std::filesystem::path& name);

// Appends at `end` and moves it on. Returns 0 or errno; the log is then as before.
int append(const File& log, std::uint64_t& end, LogRecord record,
           const std::vector<std::byte>& payload);

struct Payload {
  LogRecord record;
  std::uint64_t at;  // of the payload, in bytes from the start of the file
};

// Where everything is in a log, as far as it can be read.
struct LogIndex {
  std::string head;
  std::uint32_t chunk_rows = 0;
  std::vector<Payload> rows, events;
  std::optional<Payload> summary;
  std::uint64_t row_count = 0;
  std::uint64_t end = 0;  // bytes behind are cut off or damaged
};
// No value: the log has no head, so nothing was recorded.
std::optional<LogIndex> index_log(const File& log);

// False when the checksum is wrong.
bool read_payload(const File& log, const Payload& payload, std::vector<std::byte>& out);

}  // namespace h6::io::recording
