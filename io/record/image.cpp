// SPDX-License-Identifier: Apache-2.0
// image.cpp - see image.h; the HDF5 file driver is below the image.
#include "io/record/image.h"

#include <H5FDpublic.h>
#include <hdf5.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>
#include <new>
#include <utility>

namespace h6::io::recording {

// Bytes that the base does not have read as zero: the file has just grown over them.
bool Image::read_base(std::uint64_t page, Page& out) const {
  std::size_t have = 0;
  while (base_ >= 0 && have < page_bytes) {
    const auto at = static_cast<off_t>(page * page_bytes + have);
    const ssize_t got = ::pread(base_, out.data() + have, page_bytes - have, at);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return false;
    if (got == 0) break;
    have += static_cast<std::size_t>(got);
  }
  std::fill(out.begin() + static_cast<std::ptrdiff_t>(have), out.end(), std::byte{0});
  return true;
}

bool Image::read(std::uint64_t at, std::size_t bytes, std::byte* out) const {
  Page from_base;
  while (bytes > 0) {
    const std::uint64_t number = at / page_bytes;
    const std::size_t skip = at % page_bytes;
    const std::size_t part = std::min(bytes, page_bytes - skip);
    const auto found = change_.pages.find(number);
    if (found == change_.pages.end() && !read_base(number, from_base)) return false;
    const Page& page = found == change_.pages.end() ? from_base : found->second;
    std::memcpy(out, page.data() + skip, part);
    at += part, out += part, bytes -= part;
  }
  return true;
}

bool Image::write(std::uint64_t at, std::size_t bytes, const std::byte* in) {
  while (bytes > 0) {
    const std::uint64_t number = at / page_bytes;
    const std::size_t skip = at % page_bytes;
    const std::size_t part = std::min(bytes, page_bytes - skip);
    const auto [page, fresh] = change_.pages.try_emplace(number);
    if (fresh && part < page_bytes && !read_base(number, page->second)) {
      change_.pages.erase(page);
      return false;
    }
    std::memcpy(page->second.data() + skip, in, part);
    at += part, in += part, bytes -= part;
  }
  change_.size = std::max(change_.size, at);
  return true;
}

void Image::resize(std::uint64_t size) {
  change_.size = size;
  change_.pages.erase(change_.pages.lower_bound((size + page_bytes - 1) / page_bytes),
                      change_.pages.end());
}

Change Image::take() {
  Change taken = std::exchange(change_, {});
  change_.size = taken.size;
  return taken;
}

namespace {

// The library allocates nothing here: it calls open, and gets this with its own part first.
struct ImageFile {
  H5FD_t library;  // must stand first
  Image* image;
  haddr_t end_of_addresses;
};

struct Access {
  Image* image;
};

ImageFile* mine(H5FD_t* file) { return reinterpret_cast<ImageFile*>(file); }
const ImageFile* mine(const H5FD_t* file) { return reinterpret_cast<const ImageFile*>(file); }

H5FD_t* open_image(const char*, unsigned, hid_t access, haddr_t) {
  const auto* info = static_cast<const Access*>(H5Pget_driver_info(access));
  if (info == nullptr) return nullptr;
  auto* file = new (std::nothrow) ImageFile{};
  if (file == nullptr) return nullptr;
  file->image = info->image;
  return &file->library;
}

herr_t close_image(H5FD_t* file) {
  delete mine(file);
  return 0;
}

herr_t query_image(const H5FD_t*, unsigned long* flags) {
  *flags = H5FD_FEAT_AGGREGATE_METADATA | H5FD_FEAT_AGGREGATE_SMALLDATA;
  return 0;
}

haddr_t end_of_addresses(const H5FD_t* file, H5FD_mem_t) { return mine(file)->end_of_addresses; }

herr_t set_end_of_addresses(H5FD_t* file, H5FD_mem_t, haddr_t end) {
  mine(file)->end_of_addresses = end;
  return 0;
}

haddr_t end_of_file(const H5FD_t* file, H5FD_mem_t) { return mine(file)->image->size(); }

herr_t read_image(H5FD_t* file, H5FD_mem_t, hid_t, haddr_t at, std::size_t bytes, void* out) {
  return mine(file)->image->read(at, bytes, static_cast<std::byte*>(out)) ? 0 : -1;
}

herr_t write_image(H5FD_t* file, H5FD_mem_t, hid_t, haddr_t at, std::size_t bytes, const void* in) {
  try {
    return mine(file)->image->write(at, bytes, static_cast<const std::byte*>(in)) ? 0 : -1;
  } catch (const std::bad_alloc&) {
    return -1;
  }
}

// A file shorter than its superblock says is "truncated" and does not open: keep both equal.
herr_t truncate_image(H5FD_t* file, hid_t, hbool_t) {
  mine(file)->image->resize(mine(file)->end_of_addresses);
  return 0;
}

hid_t image_driver() {
  static const hid_t driver = [] {
    H5FD_class_t c{};
    c.name = "hapsix_image";
    c.maxaddr = static_cast<haddr_t>(std::numeric_limits<off_t>::max());
    c.fc_degree = H5F_CLOSE_STRONG;
    c.fapl_size = sizeof(Access);
    c.open = open_image;
    c.close = close_image;
    c.query = query_image;
    c.get_eoa = end_of_addresses;
    c.set_eoa = set_end_of_addresses;
    c.get_eof = end_of_file;
    c.read = read_image;
    c.write = write_image;
    c.truncate = truncate_image;
    // One free list for metadata, one for data, as for ordinary files.
    const H5FD_mem_t by_kind[H5FD_MEM_NTYPES] = H5FD_FLMAP_DICHOTOMY;
    std::copy(std::begin(by_kind), std::end(by_kind), std::begin(c.fl_map));
    return H5FDregister(&c);
  }();
  return driver;
}

}  // namespace

std::int64_t image_access(Image* image) {
  const hid_t driver = image_driver();
  if (driver < 0) return -1;
  const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
  const Access info{image};
  if (access >= 0 && H5Pset_driver(access, driver, &info) < 0) {
    H5Pclose(access);
    return -1;
  }
  return access;
}

}  // namespace h6::io::recording
