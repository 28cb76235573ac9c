// SPDX-License-Identifier: Apache-2.0
// mapped_file.h - a file as memory: its pages are those of the page cache, so a file of gigabytes
// that is read a second time is neither copied nor needs fresh memory.
//
// The file itself never changes when a process writes to this memory. But the pages of a file that
// someone cuts meanwhile are gone, and a process that reads them gets SIGBUS. hapsix never cuts or
// changes a file that it has finished: it renames a new one over it, and the old one stays whole.
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

  // Returns 0 or errno; EINVAL where `file` is no regular file.
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
