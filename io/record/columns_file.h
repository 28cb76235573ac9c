// SPDX-License-Identifier: Apache-2.0
// columns_file.h - a table as an HDF5 file: a dataset for each column, each of one length.
#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "hapsix/result.h"

namespace h6::io {

struct TableColumn {
  std::string name, units;
  bool whole = false;  // whole numbers >= 0, stored in 64 bits; else doubles
};

class ColumnsFile {
 public:
  // `names`: what indices in the table mean, an attribute of the file.
  static Result<std::unique_ptr<ColumnsFile>> create(const std::filesystem::path& file,
                                                     std::vector<TableColumn> columns,
                                                     const std::vector<std::string>& names);
  ~ColumnsFile();
  ColumnsFile(const ColumnsFile&) = delete;
  ColumnsFile& operator=(const ColumnsFile&) = delete;
  // (n x columns) values, row by row.
  Outcome append(const std::vector<double>& rows);
  // Writes all to the disk. Without it the file may be incomplete.
  Outcome close();

 private:
  struct Parts;
  explicit ColumnsFile(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace h6::io
