// SPDX-License-Identifier: Apache-2.0
// image.h - an HDF5 file as the library sees it: a file on disk that is only read, and
// the pages changed since. Private to the recordings.
//
//   HDF5 library -> driver -> Image = base (published file, read only) + changed pages (memory)
//                                     '-- take() hands the changes over, to be written elsewhere
//
// HDF5 updates a file in place and in many steps: killed in between, it leaves one that does not
// open; on a full disk, handles that do not close. Here no write of the library reaches the disk
// or can fail for want of space, and the same changes can be put into two files.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>

namespace h6::io::recording {

constexpr std::size_t page_bytes = 4096;
using Page = std::array<std::byte, page_bytes>;

// What turns one state of the file into the next.
struct Change {
  std::map<std::uint64_t, Page> pages;  // by number: offset / page_bytes
  std::uint64_t size = 0;               // of the whole file afterwards [bytes]
};

class Image {
 public:
  bool read(std::uint64_t at, std::size_t bytes, std::byte* out) const;
  bool write(std::uint64_t at, std::size_t bytes, const std::byte* in);
  void resize(std::uint64_t size);
  std::uint64_t size() const { return change_.size; }

  // The changes so far; afterwards `base` must hold them. -1: nothing on disk yet.
  Change take();
  void rebase(int base) { base_ = base; }

 private:
  bool read_base(std::uint64_t page, Page& out) const;

  int base_ = -1;
  Change change_;
};

// An HDF5 file access property list (close it) that opens `image` whatever the file's name is, or
// a negative number. The image must outlive the file.
std::int64_t image_access(Image* image);

}  // namespace h6::io::recording
