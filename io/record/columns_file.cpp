// SPDX-License-Identifier: Apache-2.0
#include "io/record/columns_file.h"

#include <sys/resource.h>

#include <system_error>
#include <utility>

#include "io/record/put.h"

namespace h6::io {

using namespace recording;
namespace fs = std::filesystem;

namespace {

constexpr hsize_t kChunk = 16384;  // rows

}  // namespace

struct ColumnsFile::Parts {
  fs::path file;
  std::vector<TableColumn> columns;
  Handle h5;
  std::vector<Handle> datasets;
  hsize_t rows = 0;

  Failure failed() const { return {"it could not be written: " + library_reason()}; }

  // HDF5 cannot close a file whose last pages do not fit on the disk, so room is asked for first.
  Outcome room_for(std::size_t bytes) const {
    std::error_code error;
    const auto used = fs::file_size(file, error);
    const fs::space_info space = fs::space(file, error);
    const std::uint64_t needed = 2 * bytes + (std::uint64_t{columns.size()} * kChunk * 8);
    rlimit limit{};
    if ((!error && space.available < needed) ||
        (getrlimit(RLIMIT_FSIZE, &limit) == 0 && !error && used + needed > limit.rlim_cur))
      return Failure{"it could not be written: is the disk full?"};
    return Done{};
  }
};

ColumnsFile::ColumnsFile(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}

ColumnsFile::~ColumnsFile() {
  const LibraryLock lock;
  parts_.reset();
}

Result<std::unique_ptr<ColumnsFile>> ColumnsFile::create(const fs::path& file,
                                                         std::vector<TableColumn> columns,
                                                         const std::vector<std::string>& names) {
  const LibraryLock lock;
  auto p = std::make_unique<Parts>();
  p->file = file, p->columns = std::move(columns);
  p->h5 = H5Fcreate(file.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, file_access());
  if (!p->h5.ok() || !put_texts(p->h5, "names", names)) return p->failed();
  for (const TableColumn& column : p->columns) {
    p->datasets.push_back(make_dataset(p->h5, column.name.c_str(),
                                       column.whole ? H5T_STD_U64LE : H5T_IEEE_F64LE, 0, {kChunk}));
    const hid_t made = p->datasets.back();
    if (made < 0 || !put_text(made, "units", column.units)) return p->failed();
  }
  return std::unique_ptr<ColumnsFile>(new ColumnsFile(std::move(p)));
}

Outcome ColumnsFile::append(const std::vector<double>& rows) {
  Parts& p = *parts_;
  const std::size_t width = p.columns.size(), count = rows.size() / width;
  if (count == 0) return Done{};
  const LibraryLock lock;
  if (Outcome room = p.room_for(8 * rows.size()); !room) return room;
  const hsize_t first = p.rows, now = p.rows += count;
  std::vector<double> column(count);
  std::vector<std::uint64_t> whole(count);
  for (std::size_t c = 0; c < width; ++c) {
    for (std::size_t i = 0; i < count; ++i) {
      column[i] = rows[i * width + c];
      if (p.columns[c].whole) whole[i] = static_cast<std::uint64_t>(column[i]);
    }
    if (H5Dset_extent(p.datasets[c], &now) < 0 ||
        !write_rows(p.datasets[c], p.columns[c].whole ? H5T_NATIVE_UINT64 : H5T_NATIVE_DOUBLE,
                    first, count,
                    p.columns[c].whole ? static_cast<const void*>(whole.data()) : column.data()))
      return p.failed();
  }
  return Done{};
}

Outcome ColumnsFile::close() {
  const LibraryLock lock;
  return H5Fflush(parts_->h5, H5F_SCOPE_GLOBAL) < 0 ? Outcome(parts_->failed()) : Outcome(Done{});
}

}  // namespace h6::io
