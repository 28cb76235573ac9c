// SPDX-License-Identifier: Apache-2.0
// ply.cpp - PLY, text and binary in either byte order. It reads x y z of the element `vertex` and
// the corner list of `face`, and skips every other element and property.
#include <algorithm>
#include <bit>
#include <cstring>

#include "io/file/text_scan.h"
#include "io/mesh/formats.h"
#include "io/mesh/ply_header.h"

namespace h6::io {
namespace {

// Where the reader is, for error sentences.
struct Row {
  const PlyElement* element = nullptr;
  std::uint64_t number = 0;  // from 0
  std::string name() const { return element->name + " " + std::to_string(number + 1); }
};

// A text body and a binary body have the same members, so that there is one reader for both:
//   real(type), whole(type)   returns the next value
//   skip(type, n)             skips n values
//   left()                    the number of bytes left
//   smallest(type)            the fewest bytes of a value
class TextBody {
 public:
  TextBody(const MeshSource& source, const PlyHeader& header, const Row& row)
      : source_(source), row_(row), scan_(source.bytes.substr(header.body)), first_(header.lines) {}

  double real(PlyType) { return number<double>(); }
  std::int64_t whole(PlyType) { return number<std::int64_t>(); }
  void skip(PlyType, std::uint64_t n) {
    for (; n > 0; --n) word();
  }
  std::uint64_t left() const { return scan_.rest().size() + scan_.behind().size(); }
  static std::uint64_t smallest(PlyType) { return 1; }
  bool at_end() { return scan_.next_word().empty(); }
  std::string place() const {
    return "line " + std::to_string(first_ + scan_.line()) + " (" + row_.name() + ")";
  }

 private:
  std::string_view word() {
    const std::string_view word = scan_.next_word();
    if (word.empty()) source_.fail(place(), "the file ends early: it is truncated");
    return word;
  }
  template <class T>
  T number() {
    const std::string_view text = word();
    T value{};
    if (const char* fault = parse_number(text, value)) source_.fail(place(), quoted(text) + fault);
    return value;
  }

  const MeshSource& source_;
  const Row& row_;
  TextScan scan_;
  std::size_t first_;
};

class BinaryBody {
 public:
  BinaryBody(const MeshSource& source, const PlyHeader& header, const Row& row)
      : source_(source), row_(row), at_(header.body) {
    const bool file_little = header.form == PlyHeader::Form::little_endian;
    swap_ = file_little != (std::endian::native == std::endian::little);
  }

  double real(PlyType type) {
    if (type == PlyType::float32) return std::bit_cast<float>(take<std::uint32_t>());
    if (type == PlyType::float64) return std::bit_cast<double>(take<std::uint64_t>());
    return static_cast<double>(whole(type));
  }
  std::int64_t whole(PlyType type) {
    switch (type) {
      case PlyType::int8:
        return static_cast<std::int8_t>(take<std::uint8_t>());
      case PlyType::uint8:
        return take<std::uint8_t>();
      case PlyType::int16:
        return static_cast<std::int16_t>(take<std::uint16_t>());
      case PlyType::uint16:
        return take<std::uint16_t>();
      case PlyType::int32:
        return static_cast<std::int32_t>(take<std::uint32_t>());
      default:
        return take<std::uint32_t>();
    }
  }
  void skip(PlyType type, std::uint64_t n) {
    if (n > left() / size_of(type)) ends_early();
    at_ += static_cast<std::size_t>(n) * size_of(type);
  }
  std::uint64_t left() const { return source_.bytes.size() - at_; }
  static std::uint64_t smallest(PlyType type) { return size_of(type); }
  // Some programs end their files with a line end or zeros.
  bool at_end() const {
    return source_.bytes.find_first_not_of(std::string_view("\0\r\n ", 4), at_) ==
           std::string_view::npos;
  }
  std::string place() const { return "byte " + std::to_string(at_) + " (" + row_.name() + ")"; }

 private:
  [[noreturn]] void ends_early() const {
    source_.fail(place(), "the file ends early: it is truncated");
  }

  template <class Bits>
  Bits take() {
    if (left() < sizeof(Bits)) ends_early();
    unsigned char bytes[sizeof(Bits)];
    std::memcpy(bytes, source_.bytes.data() + at_, sizeof bytes);
    at_ += sizeof bytes;
    if (swap_) std::reverse(std::begin(bytes), std::end(bytes));
    return std::bit_cast<Bits>(bytes);
  }

  const MeshSource& source_;
  const Row& row_;
  std::size_t at_;
  bool swap_;
};

template <class Body>
class PlyReader {
 public:
  PlyReader(const MeshSource& source, const PlyHeader& header)
      : source_(source), header_(header), body_(source, header, row_) {}

  Mesh read() {
    for (const PlyElement& element : header_.elements) {
      row_ = {&element, 0};
      check_room(element);
      if (element.name == "vertex")
        read_vertices(element);
      else if (element.name == "face")
        read_faces(element);
      else if (element.name == "tristrips" && element.count > 0)
        source_.fail("triangle strips are not read; export it as single faces");
      else
        step_over(element);
    }
    check_whole();
    return assemble(std::move(polygons_), source_);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const { source_.fail(body_.place(), what); }

  // A count of the header is checked before anything is allocated by it.
  void check_room(const PlyElement& element) const {
    std::uint64_t row = 0;
    for (const PlyProperty& property : element.properties)
      row += body_.smallest(property.list ? property.count_type : property.type);
    if (row > 0 && element.count > body_.left() / row)
      source_.fail("the header announces " + std::to_string(element.count) + " rows of '" +
                   element.name + "', the file has no room for them: it is truncated or damaged");
  }

  void read_vertices(const PlyElement& element) {
    int column_of[3] = {-1, -1, -1};  // of x, y, z
    for (std::size_t i = 0; i < element.properties.size(); ++i)
      for (int axis = 0; axis < 3; ++axis)
        if (element.properties[i].name == std::string(1, static_cast<char>('x' + axis)) &&
            !element.properties[i].list)
          column_of[axis] = static_cast<int>(i);
    for (int axis = 0; axis < 3; ++axis)
      if (column_of[axis] < 0)
        source_.fail(std::string("its vertices have no '") + static_cast<char>('x' + axis) + "'");
    if (element.count >= std::uint64_t{1} << 31) source_.fail("more vertices than can be read");
    if (!polygons_.points.empty()) source_.fail("there are two elements 'vertex'");
    has_vertices_ = true;

    polygons_.points.reserve(static_cast<std::size_t>(element.count));
    for (; row_.number < element.count; ++row_.number) {
      double xyz[3] = {};
      for (std::size_t i = 0; i < element.properties.size(); ++i) {
        const PlyProperty& property = element.properties[i];
        const auto* axis = std::find(column_of, column_of + 3, static_cast<int>(i));
        if (axis == column_of + 3)
          step_over(property);
        else
          xyz[axis - column_of] =
              coordinate(source_, body_.real(property.type), [&] { return body_.place(); });
      }
      polygons_.points.push_back({xyz[0], xyz[1], xyz[2]});
    }
  }

  void read_faces(const PlyElement& element) {
    const auto list = std::find_if(
        element.properties.begin(), element.properties.end(), [](const PlyProperty& p) {
          return p.list && (p.name == "vertex_indices" || p.name == "vertex_index");
        });
    if (list == element.properties.end()) source_.fail("its faces have no list 'vertex_indices'");
    if (!is_integer(list->type)) source_.fail("its 'vertex_indices' are not whole numbers");
    for (; row_.number < element.count; ++row_.number)
      for (const PlyProperty& property : element.properties)
        if (&property == &*list)
          read_corners(property);
        else
          step_over(property);
  }

  void read_corners(const PlyProperty& list) {
    const std::uint64_t corners = length(list);
    if (corners < 3)
      fail("a face has " + std::to_string(corners) + " corners, at least 3 are needed");
    for (std::uint64_t i = 0; i < corners; ++i) {
      const std::int64_t vertex = body_.whole(list.type);
      if (vertex < 0 || vertex >= std::int64_t{1} << 31)
        fail("a face names vertex " + std::to_string(vertex));
      polygons_.corners.push_back(static_cast<std::uint32_t>(vertex));
      if (polygons_.corners.back() < largest_) continue;
      largest_ = polygons_.corners.back();
      largest_row_ = row_.number;
    }
    polygons_.sizes.push_back(static_cast<std::uint32_t>(corners));
  }

  std::uint64_t length(const PlyProperty& list) {
    const std::int64_t length = body_.whole(list.count_type);
    if (length < 0 || static_cast<std::uint64_t>(length) > body_.left() / body_.smallest(list.type))
      fail("a list of " + std::to_string(length) +
           " values cannot be there: the file is "
           "truncated or damaged");
    return static_cast<std::uint64_t>(length);
  }

  void step_over(const PlyProperty& property) {
    body_.skip(property.type, property.list ? length(property) : 1);
  }
  void step_over(const PlyElement& element) {
    if (element.properties.empty()) return;
    for (; row_.number < element.count; ++row_.number)
      for (const PlyProperty& property : element.properties) step_over(property);
  }

  // These checks come last, because `face` may stand before `vertex`. Data after the last row mean
  // that a count is wrong and that something would be missing.
  void check_whole() {
    if (!has_vertices_) source_.fail("it has no element 'vertex'");
    if (polygons_.sizes.empty())
      source_.fail("it has no faces; a cloud of points has no inside, build a mesh from it first");
    if (largest_ >= polygons_.points.size())
      source_.fail("face " + std::to_string(largest_row_ + 1),
                   "it names vertex " + std::to_string(largest_) +
                       " (0 is the first), the file has " +
                       std::to_string(polygons_.points.size()));
    if (!body_.at_end())
      fail("the file goes on behind the last row its header announces: a count in it is wrong");
  }

  const MeshSource& source_;
  const PlyHeader& header_;
  Row row_;
  Body body_;
  Polygons polygons_;
  bool has_vertices_ = false;
  std::uint32_t largest_ = 0;
  std::uint64_t largest_row_ = 0;
};

}  // namespace

Mesh read_ply(const MeshSource& source) {
  const PlyHeader header = read_ply_header(source);
  if (header.form == PlyHeader::Form::ascii) return PlyReader<TextBody>(source, header).read();
  return PlyReader<BinaryBody>(source, header).read();
}

}  // namespace h6::io
