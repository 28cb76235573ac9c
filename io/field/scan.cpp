// SPDX-License-Identifier: Apache-2.0
// scan.cpp - checks the lengths in a .vdb file before OpenVDB allocates by them.
//
// It walks this (OpenVDB 4 and later, little endian; a string is a 32-bit length and bytes):
//   "VDB " as 64 bits, file version, library version (2), 1 byte: has offsets, 36 characters uuid
//   metadata; number of grids; then each grid: name, type, parent, 3 x 64-bit offsets,
//   compression, metadata, transform type ... tree
//   metadata: count, then (name, type, length, bytes) each
// It skips the trees: what OpenVDB allocates for a node is a small multiple of the node's bytes in
// the file.
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
  // `text` stays empty when the string is longer than any that matters here.
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
  // Reads the 32-bit number of that name, if there is one.
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

bool grids_fit(Scan& scan, bool offsets, std::optional<std::int32_t>& format) {
  std::uint32_t count = 0;
  if (!scan.take(count)) return false;
  for (std::uint32_t i = 0; i < count; ++i) {
    std::int64_t place[3] = {};
    std::uint32_t compression = 0;
    if (!scan.string() || !scan.string() || !scan.string()) return false;
    for (std::int64_t& p : place)
      if (!scan.take(p)) return false;
    if (!scan.take(compression) || !scan.metadata("hapsix_format", i == 0 ? &format : nullptr) ||
        !scan.string())
      return false;
    // Without offsets the next grid begins where this one's tree ends, and only OpenVDB knows that
    // place.
    if (!offsets) return true;
    if (place[2] < 0 || !scan.to(std::uint64_t(place[2]))) return false;
  }
  return true;
}

}  // namespace

Result<std::optional<std::int32_t>> scan_vdb(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error))
    return Failure{"there is no file " + file.string()};
  const std::uint64_t size = std::filesystem::file_size(file, error);
  std::ifstream in(file, std::ios::binary);
  if (error || !in) return Failure{"cannot open " + file.string() + ": check its permissions"};
  Scan scan(in, size);
  std::optional<std::int32_t> format;
  char magic[8];
  std::uint32_t version = 0;
  char offsets = 0;
  if (!scan.take(magic) || std::memcmp(magic, " BDV\0\0\0\0", 8) != 0)
    return Failure{file.string() +
                   " is no OpenVDB file: fields are .vdb, made by `hapsix bake field`"};
  if (!scan.take(version) || version < 222 || version > 1000)
    return Failure{file.string() + " is an OpenVDB file of a version that cannot be read"};
  if (!scan.skip(8) || !scan.take(offsets) || !scan.skip(36) || !scan.metadata() ||
      !grids_fit(scan, offsets != 0, format))
    return Failure{file.string() + " ends too early or is damaged: it is no whole OpenVDB file"};
  return format;
}

}  // namespace h6::io
