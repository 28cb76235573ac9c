// SPDX-License-Identifier: Apache-2.0
// obj.cpp - Wavefront OBJ: vertices and polygons, with negative indices and lines continued by a
// backslash; `o` and `g` are parts. Texture, normals, materials, points and lines are ignored. An
// unknown statement is an error, because a damaged `f` would leave a hole.
#include <algorithm>
#include <array>
#include <string>
#include <unordered_map>

#include "io/file/text_scan.h"
#include "io/mesh/formats.h"

namespace h6::io {
namespace {

// Statements that are skipped: appearance, points and lines, and the rest of free-form blocks,
// whose `surf` is refused.
constexpr std::string_view kPassedOver[] = {
    "vt",        "vn",     "vp",     "p",     "l",        "s",        "mg",    "usemtl",
    "mtllib",    "usemap", "maplib", "bevel", "c_interp", "d_interp", "lod",   "shadow_obj",
    "trace_obj", "cstype", "deg",    "bmat",  "step",     "curv",     "curv2", "parm",
    "trim",      "hole",   "scrv",   "sp",    "end",      "con",      "stech", "ctech"};

bool passed_over(std::string_view statement) {
  return std::find(std::begin(kPassedOver), std::end(kPassedOver), statement) !=
         std::end(kPassedOver);
}

class ObjReader {
 public:
  explicit ObjReader(const MeshSource& source) : source_(source), scan_(source.bytes, true) {}

  Mesh read() {
    while (scan_.next_line()) {
      const std::string_view statement = scan_.word();
      if (statement.empty() || statement[0] == '#') continue;
      if (statement == "v")
        vertex();
      else if (statement == "f" || statement == "fo")
        face();
      else if (statement == "o")
        name_object();
      else if (statement == "g")
        name_group();
      else if (statement == "surf")
        fail("free-form surfaces are not read; export it as polygons");
      else if (!passed_over(statement))
        fail(quoted(statement) + " is no statement of an OBJ file");
    }
    // This check comes last, because a face may name vertices that follow it.
    if (largest_ >= polygons_.points.size() && !polygons_.sizes.empty())
      source_.fail("line " + std::to_string(largest_line_),
                   "a face names vertex " + std::to_string(std::uint64_t{largest_} + 1) +
                       ", the file has " + std::to_string(polygons_.points.size()));
    return assemble(std::move(polygons_), source_);
  }

 private:
  std::string place() const { return "line " + std::to_string(scan_.line()); }
  [[noreturn]] void fail(const std::string& what) const { source_.fail(place(), what); }

  double number() {
    const std::string_view word = scan_.word();
    double value = 0;
    if (const char* fault = parse_number(word, value)) fail(quoted(word) + fault);
    return coordinate(source_, value, [&] { return place(); });
  }

  // Numbers after the third, a weight or a colour, have no meaning for polygons.
  void vertex() {
    if (polygons_.points.size() >= kMaxPoints) fail("more vertices than can be read");
    const double x = number(), y = number(), z = number();
    polygons_.points.push_back({x, y, z});
  }

  void face() {
    std::size_t corners = 0;
    for (std::string_view word = scan_.word(); !word.empty(); word = scan_.word()) {
      if (word[0] == '#') break;
      polygons_.corners.push_back(corner(word));
      ++corners;
    }
    if (corners < 3)
      fail("a face has " + std::to_string(corners) + " corners, at least 3 are needed");
    polygons_.sizes.push_back(static_cast<std::uint32_t>(corners));
    polygons_.part.push_back(part());
  }

  // "7", "7/1", "7//2", "7/1/2"; -1 is the last vertex so far.
  std::uint32_t corner(std::string_view word) {
    const std::string_view digits = word.substr(0, word.find('/'));
    std::int64_t index = 0;
    if (const char* fault = parse_number(digits, index)) fail(quoted(word) + fault);
    const auto known = static_cast<std::int64_t>(polygons_.points.size());
    if (index == 0) fail("a face names vertex 0; the first one is 1");
    if (index < -known)
      fail("a face names vertex " + std::to_string(index) + ", only " + std::to_string(known) +
           " stand before it");
    const std::int64_t number = index > 0 ? index - 1 : known + index;
    if (number >= static_cast<std::int64_t>(kMaxPoints))
      fail("a face names vertex " + std::to_string(index) + ", the file has fewer");
    const auto vertex = static_cast<std::uint32_t>(number);
    if (vertex >= largest_) {
      largest_ = vertex;
      largest_line_ = scan_.line();
    }
    return vertex;
  }

  void name_object() {
    object_ = printable(scan_.rest());
    group_.clear();
    part_ = -1;
  }
  void name_group() {
    group_ = printable(scan_.rest());
    part_ = -1;
  }

  // The number of the current part. A part begins with its first face; equal names are one part.
  std::int32_t part() {
    if (part_ >= 0) return part_;
    const std::string name =
        object_.empty() || group_.empty() ? object_ + group_ : object_ + "/" + group_;
    const auto next = static_cast<std::int32_t>(polygons_.part_names.size());
    // A few bytes of the file may give a name of hundreds.
    if (next >= kMaxParts) fail("more than " + std::to_string(kMaxParts) + " parts (o, g)");
    const auto [found, is_new] = part_numbers_.try_emplace(name, next);
    if (is_new) polygons_.part_names.push_back(name);
    return part_ = found->second;
  }

  static constexpr std::int32_t kMaxParts = 100'000;
  static constexpr std::size_t kMaxPoints = (std::size_t{1} << 31) - 1;

  const MeshSource& source_;
  TextScan scan_;
  Polygons polygons_;
  std::uint32_t largest_ = 0;
  std::size_t largest_line_ = 0;
  std::string object_, group_;
  std::int32_t part_ = -1;
  std::unordered_map<std::string, std::int32_t> part_numbers_;
};

}  // namespace

Mesh read_obj(const MeshSource& whole) {
  // Some programs write the zero that ends a string, and a new line behind it.
  MeshSource source = whole;
  const std::string_view after("\0\r\n", 3);
  if (const std::size_t end = source.bytes.find_last_not_of(after) + 1;
      source.bytes.find('\0', end) != std::string_view::npos)
    source.bytes = source.bytes.substr(0, end);
  if (source.bytes.substr(0, 4096).find('\0') != std::string_view::npos)
    source.fail("this is not text, so no OBJ; was another file renamed?");
  return ObjReader(source).read();
}

}  // namespace h6::io
