// SPDX-License-Identifier: Apache-2.0
#include "io/mesh/ply_header.h"

#include <algorithm>
#include <optional>

#include "io/file/text_scan.h"

namespace h6::io {
namespace {

std::optional<PlyType> type_from_name(std::string_view name) {
  static constexpr struct {
    std::string_view name;
    PlyType type;
  } kNames[] = {
      {"char", PlyType::int8},      {"int8", PlyType::int8},       {"uchar", PlyType::uint8},
      {"uint8", PlyType::uint8},    {"short", PlyType::int16},     {"int16", PlyType::int16},
      {"ushort", PlyType::uint16},  {"uint16", PlyType::uint16},   {"int", PlyType::int32},
      {"int32", PlyType::int32},    {"uint", PlyType::uint32},     {"uint32", PlyType::uint32},
      {"float", PlyType::float32},  {"float32", PlyType::float32}, {"double", PlyType::float64},
      {"float64", PlyType::float64}};
  for (const auto& known : kNames)
    if (known.name == name) return known.type;
  return std::nullopt;
}

class HeaderReader {
 public:
  explicit HeaderReader(const MeshSource& source)
      : source_(source), scan_(source.bytes.substr(0, header_end(source))) {}

  PlyHeader read() {
    if (!scan_.next_line() || scan_.rest() != "ply")
      source_.fail("this is no PLY (it does not start with 'ply'); was another file renamed?");
    bool has_form = false;
    while (scan_.next_line()) {
      const std::string_view statement = scan_.word();
      if (statement.empty() || statement == "comment" || statement == "obj_info") continue;
      if (statement == "format")
        has_form = true, form();
      else if (statement == "element")
        element();
      else if (statement == "property")
        property();
      else if (statement == "end_header")
        return finish(has_form);
      else
        fail(quoted(statement) + " is no statement of a PLY header");
    }
    fail("the file ends inside its header (no 'end_header'): it is truncated or no PLY");
  }

 private:
  // Where the header ends, or may end: the body may be binary, so lines are read in the header
  // only.
  static std::size_t header_end(const MeshSource& source) {
    const std::size_t found = source.bytes.find("end_header");
    if (found == source.bytes.npos) return std::min<std::size_t>(source.bytes.size(), 1 << 16);
    // Its line ends with "\n", "\r\n" or "\r" alone; after the last, a "\n" belongs to the data.
    const bool newlines = source.bytes.substr(0, found).find('\n') != source.bytes.npos;
    std::size_t end = found + 10;
    if (end < source.bytes.size() && source.bytes[end] == '\r') ++end;
    if (newlines && end < source.bytes.size() && source.bytes[end] == '\n') ++end;
    return end;
  }

  [[noreturn]] void fail(const std::string& what) const {
    source_.fail("line " + std::to_string(scan_.line()), what);
  }

  void form() {
    const std::string_view form = scan_.word(), version = scan_.word();
    if (form == "ascii")
      header_.form = PlyHeader::Form::ascii;
    else if (form == "binary_little_endian")
      header_.form = PlyHeader::Form::little_endian;
    else if (form == "binary_big_endian")
      header_.form = PlyHeader::Form::big_endian;
    else
      fail(quoted(form) + " is no format of PLY");
    if (version != "1.0") fail("PLY version " + quoted(version) + " is not known, 1.0 is");
  }

  void element() {
    PlyElement element;
    element.name = printable(scan_.word());
    const std::string_view word = scan_.word();
    std::int64_t count = 0;
    if (const char* fault = parse_number(word, count)) fail(quoted(word) + fault);
    if (count < 0) fail("an element cannot have " + std::to_string(count) + " rows");
    element.count = static_cast<std::uint64_t>(count);
    header_.elements.push_back(std::move(element));
  }

  PlyType type() {
    const std::string_view word = scan_.word();
    const std::optional<PlyType> known = type_from_name(word);
    if (!known) fail(quoted(word) + " is no type of PLY");
    return *known;
  }

  void property() {
    if (header_.elements.empty()) fail("a property stands before the first element");
    PlyProperty property;
    TextScan ahead = scan_;
    property.list = ahead.word() == "list";
    if (property.list) {
      scan_.word();
      property.count_type = type();
      if (!is_integer(property.count_type)) fail("the length of a list must be a whole number");
    }
    property.type = type();
    property.name = printable(scan_.word());
    header_.elements.back().properties.push_back(std::move(property));
  }

  PlyHeader finish(bool has_form) {
    if (!has_form) fail("the header names no format");
    header_.lines = scan_.line();
    header_.body = header_end(source_);
    return std::move(header_);
  }

  const MeshSource& source_;
  TextScan scan_;
  PlyHeader header_;
};

}  // namespace

std::size_t size_of(PlyType type) {
  static constexpr std::size_t kSizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<int>(type)];
}

bool is_integer(PlyType type) { return type != PlyType::float32 && type != PlyType::float64; }

PlyHeader read_ply_header(const MeshSource& source) { return HeaderReader(source).read(); }

}  // namespace h6::io
