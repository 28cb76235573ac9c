// SPDX-License-Identifier: Apache-2.0
//
// The library trusts the sizes that a file states, and reads past its buffers where a damaged file
// lies. So the library only finds the bytes of a chunk; chunk.h inflates them into memory of the
// size that they must have. For the same reason this file reads no text of variable length, which
// stands in HDF5's global heap.
#include "io/record/stored.h"

#include <algorithm>
#include <cstring>

namespace h6::io::recording {
namespace {

constexpr std::uint64_t most_inflated = 1040;  // deflate makes nothing smaller than 1/1032
constexpr hsize_t most_chunk_bytes = hsize_t{64} << 20;

// Filters: none, shuffle, deflate, or shuffle then deflate.
bool known_filters(hid_t how, Stored& stored) {
  const int count = H5Pget_nfilters(how);
  for (int i = 0; i < count; ++i) {
    unsigned flags = 0;
    std::size_t values = 0;
    const H5Z_filter_t filter = H5Pget_filter2(how, static_cast<unsigned>(i), &flags, &values,
                                               nullptr, 0, nullptr, nullptr);
    if (filter == H5Z_FILTER_SHUFFLE && i == 0)
      stored.shuffled = true;
    else if (filter == H5Z_FILTER_DEFLATE && i == count - 1)
      stored.deflated = true;
    else
      return false;
  }
  return count >= 0 && count <= 2;
}

// Refuses datasets that lack rows, and chunks so large that reading a few rows takes much memory.
Outcome check_chunks(const Source& source, Stored& stored, hid_t how, hid_t space) {
  hsize_t chunk[H5S_MAX_RANK] = {}, found = 0;
  const std::size_t rank = stored.dims.size();
  if (H5Pget_chunk(how, H5S_MAX_RANK, chunk) != static_cast<int>(rank) || chunk[0] == 0 ||
      !std::equal(stored.dims.begin() + 1, stored.dims.end(), chunk + 1))
    return source.wrong(stored.name + " has chunks of another shape");
  if (chunk[0] > most_chunk_bytes / stored.row_bytes)
    return source.wrong(stored.name + " has chunks of over 64 MiB");
  if (!known_filters(how, stored))
    return source.wrong(stored.name + " is packed in another way than shuffle and deflate");
  stored.chunk_rows = chunk[0];
  const hsize_t rows = stored.dims[0], needed = (rows + chunk[0] - 1) / chunk[0];
  if (rows > 0 && (H5Dget_num_chunks(stored.dataset, space, &found) < 0 || found != needed))
    return source.wrong(stored.name + " claims more rows than are stored");
  return Done{};
}

Outcome check_storage(const Source& source, Stored& stored, hid_t space) {
  const hsize_t rows = stored.dims[0];
  if (rows > source.bytes * most_inflated / stored.row_bytes)
    return source.wrong(stored.name + " claims more rows than the file can hold");
  const Handle how = H5Dget_create_plist(stored.dataset);
  const H5D_layout_t layout = how.ok() ? H5Pget_layout(how) : H5D_LAYOUT_ERROR;
  if (layout == H5D_CHUNKED) return check_chunks(source, stored, how, space);
  if (layout != H5D_CONTIGUOUS || H5Pget_external_count(how) != 0)
    return source.wrong(stored.name + " is stored in another way or another file");
  const hsize_t needed = rows * stored.row_bytes;
  if (needed > source.bytes || H5Dget_storage_size(stored.dataset) < needed)
    return source.wrong(stored.name + " claims more rows than are stored");
  return Done{};
}

// The dataset, its dimensions and row size. A negative `wanted` means text of fixed length.
Result<Stored> open_any(const Source& source, hid_t group, const char* folder, const char* name,
                        hid_t wanted) {
  Stored stored;
  stored.name = std::string(folder) + "/" + name;
  if (!has(group, name, H5I_DATASET)) return source.wrong(stored.name + " is missing");
  stored.dataset = H5Dopen2(group, name, H5P_DEFAULT);
  if (!stored.dataset.ok()) return source.wrong(stored.name + ": " + library_reason());
  const Handle type = H5Dget_type(stored.dataset), space = H5Dget_space(stored.dataset);
  const bool fits = wanted >= 0 ? H5Tequal(type, wanted) > 0
                                : H5Tget_class(type) == H5T_STRING && H5Tis_variable_str(type) == 0;
  if (!fits) return source.wrong(stored.name + " has entries of another type");
  hsize_t dims[H5S_MAX_RANK] = {};
  const int rank = H5Sget_simple_extent_dims(space, dims, nullptr);
  if (rank < 1) return source.wrong(stored.name + " has another shape");
  stored.dims.assign(dims, dims + rank);
  stored.cell_bytes = stored.row_bytes = H5Tget_size(type);
  for (int i = 0; i < rank; ++i) {
    if (i > 0 && (dims[i] == 0 || stored.row_bytes > most_chunk_bytes / dims[i]))
      return source.wrong(stored.name + " has another shape");
    if (i > 0) stored.row_bytes *= dims[i];
  }
  if (stored.row_bytes == 0 || stored.row_bytes > most_chunk_bytes)
    return source.wrong(stored.name + " has rows of over 64 MiB");
  if (Outcome checked = check_storage(source, stored, space); !checked) return checked.failure();
  return stored;
}

// One chunk with its filters undone; `mask` has a bit for each filter that was left out.
bool read_chunk(const Stored& stored, hsize_t number, std::vector<std::byte>& out) {
  std::vector<hsize_t> at(stored.dims.size(), 0);
  at[0] = number * stored.chunk_rows;
  hsize_t bytes = 0;
  out.resize(stored.chunk_rows * stored.row_bytes);
  if (H5Dget_chunk_storage_size(stored.dataset, at.data(), &bytes) < 0 || bytes == 0 ||
      bytes > out.size() + out.size() / 8 + 1024)
    return false;
  std::vector<std::byte> raw(bytes);
  std::uint32_t mask = 0;
  if (H5Dread_chunk(stored.dataset, H5P_DEFAULT, at.data(), &mask, raw.data()) < 0) return false;
  const std::uint32_t deflate_bit = stored.shuffled ? 2 : 1;
  if (stored.deflated && (mask & deflate_bit) == 0) {
    if (!inflate(raw.data(), raw.size(), out)) return false;
    raw = out;
  }
  if (raw.size() != out.size()) return false;
  if (stored.shuffled && (mask & 1) == 0)
    unshuffle(raw, stored.cell_bytes, out);
  else
    out.swap(raw);
  return true;
}

bool read_piece(const Stored& stored, hsize_t first, hsize_t count, std::byte* out) {
  std::vector<hsize_t> start(stored.dims.size(), 0), block = stored.dims;
  start[0] = first, block[0] = count;
  const Handle memory = H5Screate_simple(static_cast<int>(block.size()), block.data(), nullptr);
  const Handle disk = H5Dget_space(stored.dataset), type = H5Dget_type(stored.dataset);
  return H5Sselect_hyperslab(disk, H5S_SELECT_SET, start.data(), nullptr, block.data(), nullptr) >=
             0 &&
         H5Dread(stored.dataset, type, memory, disk, H5P_DEFAULT, out) >= 0;
}

}  // namespace

bool has(hid_t at, const char* name, H5I_type_t type) {
  H5L_info_t link;
  if (H5Lexists(at, name, H5P_DEFAULT) <= 0 || H5Lget_info(at, name, &link, H5P_DEFAULT) < 0)
    return false;
  if (link.type != H5L_TYPE_HARD) return false;
  // Not H5Oget_info_by_name: its arguments differ between HDF5 1.10 and 1.14.
  const Handle object = H5Oopen(at, name, H5P_DEFAULT);
  return object.ok() && H5Iget_type(object) == type;
}

Result<Stored> open_stored(const Source& source, hid_t group, const char* folder, const char* name,
                           hid_t type) {
  return open_any(source, group, folder, name, type);
}

Result<Stored> open_stored_texts(const Source& source, hid_t group, const char* folder,
                                 const char* name) {
  return open_any(source, group, folder, name, -1);
}

Outcome read_rows(const Source& source, const Stored& stored, hsize_t first, hsize_t count,
                  std::vector<std::byte>& out) {
  out.resize(count * stored.row_bytes);
  if (count == 0) return Done{};
  if (stored.chunk_rows == 0) {
    if (read_piece(stored, first, count, out.data())) return Done{};
    return source.wrong(stored.name + ": " + library_reason());
  }
  std::vector<std::byte> chunk;
  for (hsize_t row = first; row < first + count;) {
    const hsize_t number = row / stored.chunk_rows, skip = row % stored.chunk_rows;
    const hsize_t here = std::min(stored.chunk_rows - skip, first + count - row);
    if (!read_chunk(stored, number, chunk))
      return source.wrong(stored.name + " is damaged from row " + std::to_string(row) + " on");
    std::memcpy(out.data() + (row - first) * stored.row_bytes,
                chunk.data() + skip * stored.row_bytes, here * stored.row_bytes);
    row += here;
  }
  return Done{};
}

}  // namespace h6::io::recording
