// SPDX-License-Identifier: Apache-2.0
// direct_file.h - large files in blocks by several threads, past the page cache where the file
// system lets us: a field of a gigabyte then costs what the disk costs, and neither a copy in
// memory nor what was in the cache.
#pragma once
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>

#include "hapsix/result.h"

namespace h6::io {

inline constexpr std::size_t kDirectPage = 4096;  // blocks start at, and buffers hold, multiples

struct FreeBuffer {
  void operator()(char* bytes) const;
};
using DirectBuffer = std::unique_ptr<char[], FreeBuffer>;
DirectBuffer direct_buffer(std::size_t bytes);  // aligned to a page, whole pages; may be null

// Calls return 0 or errno; any thread.
class DirectFile {
 public:
  enum class For { reading, writing };
  DirectFile() = default;
  ~DirectFile();
  DirectFile(const DirectFile&) = delete;
  DirectFile& operator=(const DirectFile&) = delete;

  int open(const std::filesystem::path& file, For purpose);
  std::uint64_t size() const { return size_; }  // when it was opened
  // Claims the room, so that a full disk is known at once.
  int reserve(std::uint64_t bytes);
  // Whole pages, the last bytes of the file apart: what is behind them in the buffer, up to the
  // page's end, may be written too, until `cut`.
  int write(std::uint64_t at, const char* pages, std::size_t bytes);
  int cut(std::uint64_t bytes);
  // Bytes behind the end stay as they are in the buffer. Those in the page cache come from there.
  int read(std::uint64_t at, char* pages, std::size_t bytes);

 private:
  int fd_ = -1, direct_ = -1;  // the same file, the second past the page cache or -1
  std::atomic<bool> use_direct_{false};
  std::uint64_t size_ = 0;
};

// Calls body(i, buffer) once for every i in 0..count-1 on all threads of the machine, each with a
// buffer of that many bytes, in rising order of start; stops after one that returns an errno. That
// is returned, ENOMEM where there is no memory. A body must not throw.
int for_blocks(std::size_t count, std::size_t buffer_bytes,
               const std::function<int(std::size_t, char*)>& body);

}  // namespace h6::io
