// SPDX-License-Identifier: Apache-2.0
// put.h - attributes and datasets into an HDF5 file. False, or no handle, when the library fails.
#pragma once
#include <string>
#include <vector>

#include "io/record/layout.h"

namespace h6::io::recording {

bool put_text(hid_t at, const char* name, const std::string& text);
bool put_texts(hid_t at, const char* name, const std::vector<std::string>& texts);

// A dataset of `rows` rows, in chunks of `chunk` (rows first), shuffled and deflated.
Handle make_dataset(hid_t group, const char* name, hid_t type, hsize_t rows,
                    const std::vector<hsize_t>& chunk);
// Rows [first, first + count) of a dataset of one dimension.
bool write_rows(hid_t dataset, hid_t type, hsize_t first, hsize_t count, const void* rows);

}  // namespace h6::io::recording
