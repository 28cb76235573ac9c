// SPDX-License-Identifier: Apache-2.0
// mapped_file.h - a file as memory: its pages are those of the page cache, so a file of gigabytes
// that is read a second time is neither copied nor needs fresh memory.
//
// What is written to the memory stays in this process. Whoever cuts the file meanwhile takes the
// pages away, and then a process that reads them gets SIGBUS: files that hapsix writes are renamed
// to their name and never changed, so the old file stays whole.
#pragma once
#include <cstddef>
#include <filesystem>

namespace h6::io {

class MappedFile {
 public:
  MappedFile() = default;
  ~MappedFile();
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;

  // Returns 0 or errno; EINVAL for what is no regular file.
  int open(const std::filesystem::path& file);
  char* data() const { return data_; }        // null when the file is empty
  std::size_t size() const { return size_; }  // when it was opened
  // Asks the disk for bytes that are read soon. Any thread may call it.
  void expect(std::size_t at, std::size_t bytes) const;
  // Brings bytes into memory: 0 or errno, where reading them would end the process. Any thread may
  // call it.
  int fetch(std::size_t at, std::size_t bytes) const;

 private:
  int map(int fd);

  char* data_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace h6::io
