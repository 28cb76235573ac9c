// SPDX-License-Identifier: Apache-2.0
#include "io/record/put.h"

namespace h6::io::recording {

bool put_text(hid_t at, const char* name, const std::string& text) {
  const Handle type = text_type(), space = H5Screate(H5S_SCALAR);
  const Handle made = H5Acreate2(at, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
  const char* chars = text.c_str();
  return made.ok() && H5Awrite(made, type, &chars) >= 0;
}

bool put_texts(hid_t at, const char* name, const std::vector<std::string>& texts) {
  const hsize_t count = texts.size();
  const Handle type = text_type(), space = H5Screate_simple(1, &count, nullptr);
  const Handle made = H5Acreate2(at, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
  std::vector<const char*> chars;
  for (const std::string& text : texts) chars.push_back(text.c_str());
  return made.ok() && (chars.empty() || H5Awrite(made, type, chars.data()) >= 0);
}

Handle make_dataset(hid_t group, const char* name, hid_t type, hsize_t rows,
                    const std::vector<hsize_t>& chunk) {
  std::vector<hsize_t> now = chunk, most = chunk;
  now[0] = rows, most[0] = H5S_UNLIMITED;
  const Handle space = H5Screate_simple(static_cast<int>(now.size()), now.data(), most.data());
  const Handle how = H5Pcreate(H5P_DATASET_CREATE);
  if (H5Pset_chunk(how, static_cast<int>(chunk.size()), chunk.data()) < 0 ||
      H5Pset_shuffle(how) < 0 || H5Pset_deflate(how, deflate_level) < 0)
    return {};
  return H5Dcreate2(group, name, type, space, H5P_DEFAULT, how, H5P_DEFAULT);
}

bool write_rows(hid_t dataset, hid_t type, hsize_t first, hsize_t count, const void* rows) {
  const Handle memory = H5Screate_simple(1, &count, nullptr), disk = H5Dget_space(dataset);
  return H5Sselect_hyperslab(disk, H5S_SELECT_SET, &first, nullptr, &count, nullptr) >= 0 &&
         H5Dwrite(dataset, type, memory, disk, H5P_DEFAULT, rows) >= 0;
}

}  // namespace h6::io::recording
