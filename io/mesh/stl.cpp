// SPDX-License-Identifier: Apache-2.0
// stl.cpp - STL, text and binary.
//
// A binary STL is 80 bytes of anything, the number of triangles n (uint32), and n times 50 bytes:
// normal and three vertices (12 floats), two bytes of anything; little endian. Its size, 84 + 50 n,
// tells the two kinds apart; some programs begin their binary files with "solid". Normals are
// ignored: many files have wrong ones, and the winding gives them.
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#include "io/file/text_scan.h"
#include "io/mesh/formats.h"
#include "io/mesh/weld.h"

namespace h6::io {
namespace {

constexpr std::size_t kHead = 84, kTriangle = 50, kFirstVertex = 12;

static_assert(std::endian::native == std::endian::little, "binary STL is read in place");

template <class T>
T load(std::string_view bytes, std::size_t at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

bool looks_like_text(std::string_view head) {
  // In 512 bytes of a binary file some are zero: the upper bytes of the count, or the two bytes
  // after a triangle.
  for (const char c : head.substr(0, 512)) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 && c != '\n' && c != '\r' && c != '\t' && c != '\f' && c != '\v') return false;
  }
  return true;
}

std::string_view first_word(std::string_view head) {
  TextScan scan(head);
  return scan.next_word();
}

enum class Kind { text, binary };

// Bytes after the last triangle are accepted as padding if they are fewer than one more triangle
// takes.
Kind kind_of(std::string_view head, std::uint64_t size, const MeshSource& source) {
  const bool has_count = size >= kHead && head.size() >= kHead;
  const std::uint64_t announced = has_count ? load<std::uint32_t>(head, 80) : 0;
  const std::uint64_t expected = kHead + kTriangle * announced;
  if (has_count && size == expected) return Kind::binary;
  if (looks_like_text(head)) {
    if (same_word(first_word(head).substr(0, 5), "solid")) return Kind::text;
    source.fail(
        "this is text but no STL (it does not start with 'solid'); "
        "was another file renamed?");
  }
  if (!has_count)
    source.fail("byte " + std::to_string(size),
                "the file ends inside the 84-byte header of a binary STL: it is truncated");
  const std::uint64_t present = (size - kHead) / kTriangle;
  if (size < expected)
    source.fail("byte " + std::to_string(size), "the file ends early: its header announces " +
                                                    std::to_string(announced) + " triangles, " +
                                                    std::to_string(present) +
                                                    " are there; it is truncated or no STL");
  if (size >= expected + kTriangle)
    source.fail("byte " + std::to_string(expected),
                "the file goes on behind its last triangle: its header announces " +
                    std::to_string(announced) + " triangles, there is room for " +
                    std::to_string(present) + "; export it again");
  return Kind::binary;
}

Mesh read_binary(const MeshSource& source) {
  const std::string_view bytes = source.bytes;
  const std::size_t count = load<std::uint32_t>(bytes, 80);
  for (std::size_t t = 0; t < count; ++t) {
    for (std::size_t i = 0; i < 9; ++i) {
      const std::size_t at = kHead + t * kTriangle + kFirstVertex + 4 * i;
      coordinate(source, load<float>(bytes, at), [&] {
        return "triangle " + std::to_string(t + 1) + " (byte " + std::to_string(at) + ")";
      });
    }
  }
  // A closed mesh has half as many vertices as triangles.
  Welded welded = weld_points(count * 3, count / 2 + 16, [&](std::size_t corner) {
    const std::size_t at =
        kHead + corner / 3 * kTriangle + kFirstVertex + corner % 3 * 3 * sizeof(float);
    const auto metres = [&](std::size_t axis) {
      return static_cast<double>(load<float>(bytes, at + 4 * axis)) * source.scale + 0.0;
    };
    return Vec3{metres(0), metres(1), metres(2)};
  });
  Mesh mesh;
  mesh.vertices = std::move(welded.vertices);
  mesh.triangles.resize(count);
  for (std::size_t t = 0; t < count; ++t)
    mesh.triangles[t] = {welded.index[3 * t], welded.index[3 * t + 1], welded.index[3 * t + 2]};
  return mesh;
}

// ---- text ---------------------------------------------------------------------------------------

class TextStl {
 public:
  explicit TextStl(const MeshSource& source) : source_(source), scan_(source.bytes) {}

  Mesh read() {
    for (std::string_view word = scan_.next_word(); !word.empty(); word = scan_.next_word()) {
      if (!same_word(word, "solid")) fail("'solid' should stand here, not " + quoted(word));
      solid();
    }
    return assemble(std::move(polygons_), source_);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    const std::string triangle = std::to_string(polygons_.sizes.size() + 1);
    source_.fail("line " + std::to_string(scan_.line()) + " (triangle " + triangle + ")", what);
  }

  std::string_view need_word(const char* wanted) {
    const std::string_view word = scan_.next_word();
    if (word.empty())
      fail(std::string("the file ends where '") + wanted + "' should stand: it is truncated");
    return word;
  }

  void expect(const char* wanted) {
    const std::string_view word = need_word(wanted);
    if (!same_word(word, wanted))
      fail(std::string("'") + wanted + "' should stand here, not " + quoted(word));
  }

  // A name, of any number of words, ends with the line; so does that of endsolid.
  void solid() {
    const std::string name = printable(scan_.rest());
    scan_.next_line();
    const std::size_t before = polygons_.sizes.size();
    for (;;) {
      const std::string_view word = need_word("endsolid");
      if (same_word(word, "facet"))
        facet();
      else if (same_word(word, "endsolid"))
        break;
      else
        fail("'facet' or 'endsolid' should stand here, not " + quoted(word));
    }
    scan_.next_line();
    if (polygons_.sizes.size() == before) return;
    const auto number = static_cast<std::int32_t>(polygons_.part_names.size());
    polygons_.part_names.push_back(name);
    polygons_.part.resize(polygons_.sizes.size(), number);
  }

  void facet() {
    // 'normal' and its three numbers, or what some programs write in their place ('nan',
    // '1.#QNAN').
    for (int words = 0; !same_word(need_word("outer"), "outer"); ++words)
      if (words >= 4) fail("'outer loop' should stand behind the normal");
    expect("loop");
    for (int corner = 0; corner < 3; ++corner) {
      expect("vertex");
      const double x = number(), y = number(), z = number();
      polygons_.corners.push_back(static_cast<std::uint32_t>(polygons_.points.size()));
      polygons_.points.push_back({x, y, z});
    }
    expect("endloop");
    expect("endfacet");
    polygons_.sizes.push_back(3);
  }

  double number() {
    const std::string_view word = need_word("a number");
    double value = 0;
    if (const char* fault = parse_number(word, value)) fail(quoted(word) + fault);
    return coordinate(source_, value, [&] {
      return "line " + std::to_string(scan_.line()) + " (triangle " +
             std::to_string(polygons_.sizes.size() + 1) + ")";
    });
  }

  const MeshSource& source_;
  TextScan scan_;
  Polygons polygons_;
};

}  // namespace

void check_stl_size(std::string_view head, std::uint64_t size, const MeshSource& source) {
  kind_of(head, size, source);
}

Mesh read_stl(const MeshSource& source) {
  const Kind kind = kind_of(source.bytes, source.bytes.size(), source);
  return kind == Kind::binary ? read_binary(source) : TextStl(source).read();
}

}  // namespace h6::io
