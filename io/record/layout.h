// SPDX-License-Identifier: Apache-2.0
// layout.h - where each number is in a recording, and safe handles on HDF5. Private.
//
//   /config    whole, seal; attributes: version, json, asset_hashes, simd_target, program, run,
//              rate, hands, stage_names, cause_names, state_names, units
//   /frames    one dataset a column of `columns`, rows are frames; attributes: units, columns, and
//              body, of bend_N
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

enum class Part { record, bends, seal };

// A dataset of /frames and its place in h6FrameRecord: `width` cells at `offset`, and for each
// further hand `stride` bytes later. Stride 0: once a frame. Of bodies that bend: `offset` bytes
// into the row of all their q.
struct Column {
  std::string name;
  Cell cell;
  std::size_t width, offset, stride;
  std::string units;
  std::string labels;  // of the cells in a row, separated by blanks
  bool later = false;  // older recordings lack it and get zeros
  Part part = Part::record;
  std::string body = "";  // that bends: its name
  bool per_hand() const { return stride != 0; }
};

// Those of every recording, then one of each body that bends.
const std::vector<Column>& common_columns();
std::vector<Column> columns(const std::vector<RecordedBend>& bends);
const std::vector<std::string>& stage_names();
const std::vector<std::string>& cause_names();
const std::vector<std::string>& state_names();

std::size_t cell_bytes(Cell cell);
hid_t cell_type(Cell cell);  // as on disk; a constant of the library, do not close it
// Dimensions of a dataset with `rows` frames: (n), (n, width), (n, hands) or (n, hands, width).
std::vector<hsize_t> shape(const Column& column, hsize_t rows, std::size_t hands);
std::size_t row_bytes(const Column& column, std::size_t hands);

// Frames in memory.
template <class Record, class Number, class Seal>
struct RowsOf {
  Record* records = nullptr;
  Number* bends = nullptr;  // (count x modes)
  Seal* seals = nullptr;    // (count)
  std::size_t count = 0, modes = 0;
};
using Rows = RowsOf<const h6FrameRecord, const double, const std::uint64_t>;
using RoomForRows = RowsOf<h6FrameRecord, double, std::uint64_t>;

// To and from the packed rows of a dataset.
void pack(const Column& column, std::size_t hands, const Rows& from, std::vector<std::byte>& out);
void unpack(const Column& column, std::size_t hands, const std::byte* from, const RoomForRows& out);

// The payload of a LogKind::rows record: the chunk of each column with the rows, filled up with
// zeros to `chunk_rows`.
std::vector<std::byte> pack_chunks(const std::vector<Column>& columns, std::size_t hands,
                                   std::size_t chunk_rows, const Rows& from);
struct Span {
  const std::byte* from;
  std::size_t bytes;
};
// The inverse: the compressed chunks of so many columns, in their order. False when the sizes do
// not add up.
bool find_chunks(const std::vector<std::byte>& payload, std::size_t count,
                 std::vector<Span>& chunks);

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

// Why these cannot be the bodies that bend, in words; or nothing.
std::string wrong_bends(const std::vector<RecordedBend>& bends);

// The head from the JSON text of /config/whole.
Result<RecordingHead> parse_head(const std::string& text);

}  // namespace h6::io::recording
