// SPDX-License-Identifier: Apache-2.0
// scan.cpp - a look at a .vdb file before OpenVDB allocates by what it says.
//
// What it walks (format of OpenVDB 4 and later, little endian; strings are a 32-bit length and
// bytes):
//   "VDB " as 64 bits, file version, library version (2), 1 byte: has offsets, 36 characters uuid
//   metadata; number of grids; then each grid: name, type, parent, 3 x 64-bit offsets,
//   compression, metadata, transform type ... tree
//   metadata: count, then (name, type, length, bytes) each
// Tree nodes need no look: each of them takes more bytes of the file than a small multiple of what
// it allocates.
#include <cstring>
#include <fstream>

#include "io/field/grids.h"

namespace h6::io {
namespace {

class Scan {
 public:
  Scan(std::istream& in, std::uint64_t size) : in_(in), size_(size) {}

  bool skip(std::uint64_t bytes) {
    if (bytes > size_ - at_) return false;
    at_ += bytes;
    in_.seekg(std::streamoff(at_));
    return bool(in_);
  }
  template <class T>
  bool take(T& value) {
    if (sizeof value > size_ - at_) return false;
    in_.read(reinterpret_cast<char*>(&value), sizeof value);
    at_ += sizeof value;
    return bool(in_);
  }
  // What is longer than any name here is skipped: then `text` is empty.
  bool string(std::string* text = nullptr) {
    std::uint32_t length = 0;
    if (!take(length)) return false;
    if (text == nullptr || length > 256) return skip(length);
    if (length > size_ - at_) return false;
    text->resize(length);
    in_.read(text->data(), length);
    at_ += length;
    return bool(in_);
  }
  // The 32-bit number of one name is taken, where it is there.
  bool metadata(const char* wanted = "", std::optional<std::int32_t>* number = nullptr) {
    std::uint32_t count = 0;
    if (!take(count)) return false;
    for (std::uint32_t i = 0; i < count; ++i) {
      std::string name, type, value;
      if (!string(&name) || !string(&type) || !string(&value)) return false;
      if (number && name == wanted && type == "int32" && value.size() == sizeof(std::int32_t)) {
        number->emplace();
        std::memcpy(&**number, value.data(), value.size());
      }
    }
    return true;
  }
  bool to(std::uint64_t place) {
    if (place < at_ || place > size_) return false;
    return skip(place - at_);
  }
  std::uint64_t at() const { return at_; }

 private:
  std::istream& in_;
  std::uint64_t size_, at_ = 0;
};

bool grids_fit(Scan& scan, bool offsets, VdbLayout& layout) {
  std::uint32_t count = 0;
  if (!scan.take(count)) return false;
  for (std::uint32_t i = 0; i < count; ++i) {
    VdbGrid grid;
    std::int64_t place[3] = {};
    if (!scan.string(&grid.name) || !scan.string(&grid.type) || !scan.string()) return false;
    for (std::int64_t& p : place)
      if (!scan.take(p)) return false;
    std::string transform;
    if (!scan.take(grid.compression) ||
        !scan.metadata("hapsix_format", i == 0 ? &layout.format : nullptr) ||
        !scan.string(&transform))
      return false;
    // Without offsets the next grid begins where this one's tree ends: OpenVDB alone knows.
    if (!offsets) return true;
    // Six vectors of three doubles.
    if (transform == "UniformScaleTranslateMap") grid.tree = scan.at() + 6 * 3 * sizeof(double);
    if (place[2] < 0 || !scan.to(std::uint64_t(place[2]))) return false;
    grid.block = place[1] < 0 ? 0 : std::uint64_t(place[1]);
    grid.end = std::uint64_t(place[2]);
    layout.grids.push_back(std::move(grid));
  }
  return true;
}

}  // namespace

Result<VdbLayout> scan_vdb(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error))
    return Failure{"there is no file " + file.string()};
  const std::uint64_t size = std::filesystem::file_size(file, error);
  std::ifstream in(file, std::ios::binary);
  if (error || !in) return Failure{"cannot open " + file.string() + ": check its permissions"};
  Scan scan(in, size);
  VdbLayout layout;
  layout.size = size;
  char magic[8];
  std::uint32_t version = 0;
  char offsets = 0;
  if (!scan.take(magic) || std::memcmp(magic, " BDV\0\0\0\0", 8) != 0)
    return Failure{file.string() +
                   " is no OpenVDB file: fields are .vdb, made by `hapsix bake field`"};
  if (!scan.take(version) || version < 222 || version > 1000)
    return Failure{file.string() + " is an OpenVDB file of a version that cannot be read"};
  if (!scan.skip(8) || !scan.take(offsets) || !scan.skip(36) || !scan.metadata() ||
      !grids_fit(scan, offsets != 0, layout))
    return Failure{file.string() + " ends too early or is damaged: it is no whole OpenVDB file"};
  return layout;
}

}  // namespace h6::io
