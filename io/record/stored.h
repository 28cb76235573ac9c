// SPDX-License-Identifier: Apache-2.0
// stored.h - rows of a dataset, from a file that may be damaged or forged. For rooms that read
// HDF5.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "hapsix/result.h"
#include "io/record/layout.h"

namespace h6::io::recording {

// The file being read. Its name is for sentences; its size bounds what a dataset can claim.
struct Source {
  std::filesystem::path file;
  std::uint64_t bytes;
  Handle h5;
  std::string kind;  // "recording"

  Failure wrong(const std::string& what) const {
    return {file.string() + " is not a " + kind + " that can be read: " + what};
  }
};

// Whether the file itself has this group or dataset; links to elsewhere do not count.
bool has(hid_t at, const char* name, H5I_type_t type);

// A dataset that was checked to have all its rows in the file.
struct Stored {
  Handle dataset;
  std::string name;
  std::vector<hsize_t> dims;  // rows first
  std::size_t row_bytes = 0, cell_bytes = 0;
  hsize_t chunk_rows = 0;  // 0: contiguous
  bool shuffled = false, deflated = false;
};
// Opens a dataset of numbers of this type.
Result<Stored> open_stored(const Source& source, hid_t group, const char* folder, const char* name,
                           hid_t type);
// Opens a dataset of texts of one length, which is in cell_bytes.
Result<Stored> open_stored_texts(const Source& source, hid_t group, const char* folder,
                                 const char* name);

// Rows first .. first + count - 1, as on disk (little-endian). They must be in the dataset.
Outcome read_rows(const Source& source, const Stored& stored, hsize_t first, hsize_t count,
                  std::vector<std::byte>& out);

}  // namespace h6::io::recording
