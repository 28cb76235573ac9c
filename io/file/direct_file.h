// SPDX-License-Identifier: Apache-2.0
// direct_file.h - writes large files in blocks on several threads, past the page cache where the
// file system allows it. A field of a gigabyte then takes the disk's time alone: nothing is copied
// into the page cache, and nothing is evicted from it.
#pragma once
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>

#include "hapsix/result.h"

namespace h6::io {

// Blocks start at multiples of this in the file, and buffers hold multiples [bytes].
inline constexpr std::size_t kDirectPage = 4096;

struct FreeBuffer {
  void operator()(char* bytes) const;
};
using DirectBuffer = std::unique_ptr<char[], FreeBuffer>;
// Whole pages, aligned to a page. Null when there is no memory.
DirectBuffer direct_buffer(std::size_t bytes);

// Calls return 0 or errno. Any thread may call write.
class DirectFile {
 public:
  DirectFile() = default;
  ~DirectFile();
  DirectFile(const DirectFile&) = delete;
  DirectFile& operator=(const DirectFile&) = delete;

  int open(const std::filesystem::path& file);
  // Claims the space, so that a full disk is noticed at once.
  int reserve(std::uint64_t bytes);
  // `bytes` is a multiple of the page, except at the end of the file. There the rest of the
  // buffer's last page may be written too: `cut` removes it.
  int write(std::uint64_t at, const char* pages, std::size_t bytes);
  int cut(std::uint64_t bytes);

 private:
  int fd_ = -1, direct_ = -1;  // the same file; the second bypasses the page cache, or is -1
  std::atomic<bool> use_direct_{false};
};

// Calls body(i, buffer) once for every i in 0..count-1, on all threads of the machine, in rising
// order. Each thread has a buffer of `buffer_bytes`. Stops when a body returns an errno, and
// returns it; ENOMEM when there is no buffer. A body must not throw.
int for_blocks(std::size_t count, std::size_t buffer_bytes,
               const std::function<int(std::size_t, char*)>& body);

}  // namespace h6::io
