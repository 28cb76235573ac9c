// SPDX-License-Identifier: Apache-2.0
// layout.h - where each number is in a recording, and safe handles on HDF5. Private.
//
//   /config    whole, seal; attributes: version, json, asset_hashes, simd_target, program, run,
//              rate, hands, stage_names, cause_names, state_names, units
//   /frames    one dataset a column of `columns`, rows are frames; attributes: units, columns
//   /events    t, what, detail, seal
//   /summary   whole, seal; attribute json; the group exists once the run has ended
//
// Attributes are text of variable length, for people and their tools. read_recording reads the same
// facts from the datasets /config/whole and /summary/whole; stored.cpp says why.
#pragma once
#include <hdf5.h>

#include <cstddef>
#include <filesystem>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "hapsix/hapsix.h"
#include "io/record/chunk.h"
#include "io/record/recording.h"

namespace h6::io::recording {

constexpr std::uint32_t format_version = 1;

enum class Cell { real, natural32, natural64 };

// A dataset of /frames and its place in h6FrameRecord: `width` cells at `offset`, and for each
// further hand `stride` bytes later. Stride 0: once a frame.
struct Column {
  const char* name;
  Cell cell;
  std::size_t width, offset, stride;
  const char* units;
  const char* labels;  // of the cells in a row, separated by blanks
  bool later = false;  // older recordings lack it and get zeros
  bool apart = false;  // no part of h6FrameRecord: the seals
  bool per_hand() const { return stride != 0; }
};

const std::vector<Column>& columns();
const std::vector<std::string>& stage_names();
const std::vector<std::string>& cause_names();
const std::vector<std::string>& state_names();

std::size_t cell_bytes(Cell cell);
hid_t cell_type(Cell cell);  // as on disk; a constant of the library, do not close it
// Dimensions of a dataset with `rows` frames: (n), (n, width), (n, hands) or (n, hands, width).
std::vector<hsize_t> shape(const Column& column, hsize_t rows, std::size_t hands);
std::size_t row_bytes(const Column& column, std::size_t hands);

// To and from the packed rows of a dataset; not for columns that stand apart.
void pack(const Column& column, std::size_t hands, const h6FrameRecord* from, std::size_t count,
          std::vector<std::byte>& out);
void unpack(const Column& column, std::size_t hands, const std::byte* from, std::size_t count,
            h6FrameRecord* out);

// The payload of a LogKind::rows record: the chunk of each column with `count` rows, filled up
// with zeros to `chunk_rows`. `seals` has one number a row.
std::vector<std::byte> pack_chunks(std::size_t hands, std::size_t chunk_rows,
                                   const h6FrameRecord* from, const std::uint64_t* seals,
                                   std::size_t count);
struct Span {
  const std::byte* from;
  std::size_t bytes;
};
// The inverse: the compressed chunks, in the order of columns(). False when the sizes do not add
// up.
bool find_chunks(const std::vector<std::byte>& payload, std::vector<Span>& chunks);

// Any HDF5 object, released at the end of the scope.
class Handle {
 public:
  Handle(hid_t id = -1) : id_(id) {}
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(id_, other.id_);
    return *this;
  }
  ~Handle() { close(); }
  void close() {
    if (id_ >= 0) H5Idec_ref(id_);
    id_ = -1;
  }
  operator hid_t() const { return id_; }
  bool ok() const { return id_ >= 0; }

 private:
  hid_t id_;
};

// Every use of the library must hold one: Debian's build serves one thread at a time, and it prints
// its errors unless told not to.
class LibraryLock {
 public:
  LibraryLock();

 private:
  std::lock_guard<std::mutex> lock_;
};

// The library's own words for the innermost reason of its last failure.
std::string library_reason();

// Variable-length UTF-8 text in memory and on disk.
Handle text_type();
// Texts of `bytes` bytes (0: 1), filled with NULs.
Handle fixed_text_type(std::size_t bytes);

// Access properties for every file: locked where the file system can, closed with all its objects.
Handle file_access();

// read_recording of one HDF5 file, without the lock.
Result<Recording> read_hdf5(const std::filesystem::path& file, FrameRange range);

// The head from the JSON text of /config/whole.
Result<RecordingHead> parse_head(const std::string& text);

}  // namespace h6::io::recording
