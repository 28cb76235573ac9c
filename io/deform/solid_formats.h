// SPDX-License-Identifier: Apache-2.0
// solid_formats.h - what the readers of solid meshes share. Private.
#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "io/deform/solid_mesh.h"
#include "io/file/text_scan.h"

namespace h6::io::deform {

// The readers throw it; parse_solid returns the sentence.
struct BadSolid {
  std::string sentence;
};

// The text of a file, with numbers that are checked as they are read.
class SolidText {
 public:
  SolidText(std::string_view bytes, std::string name, double scale)
      : scan(bytes), name_(std::move(name)), scale_(scale), bytes_(bytes.size()) {}

  [[noreturn]] void fail(const std::string& what) const;        // with the line
  [[noreturn]] void fail_whole(const std::string& what) const;  // without it

  double number(std::string_view word) const;
  std::int64_t whole(std::string_view word) const;
  // A count, of things that take at least `least` bytes each in what follows.
  std::size_t count(std::string_view word, const char* what, std::size_t least = 2) const;
  // Three coordinates in the file's unit of length, as metres; next() gives the words.
  template <class Next>
  h6Vec3 point(const Next& next) const {
    const double x = coordinate(next()), y = coordinate(next()), z = coordinate(next());
    return {x, y, z};
  }

  TextScan scan;

 private:
  double coordinate(std::string_view word) const;
  std::string name_;
  double scale_;
  std::size_t bytes_;
};

// Vertices under the numbers that a file gives them. Mostly they follow each other; then no table
// is needed.
class VertexNumbers {
 public:
  // False where the number was given before.
  bool add(std::int64_t number);
  // -1 where there is none.
  std::int64_t find(std::int64_t number) const;

 private:
  // Unsigned, so that no number of a file overflows.
  std::uint64_t behind_first(std::int64_t number) const {
    return static_cast<std::uint64_t>(number) - static_cast<std::uint64_t>(first_);
  }
  std::int64_t first_ = 0, count_ = 0;
  bool apart_ = false;  // they do not follow each other
  std::unordered_map<std::int64_t, std::int64_t> table_;
};

// Elements by the name of their set, in the order in which the names first come.
class SetNames {
 public:
  void add(const std::string& name, std::uint32_t element);
  std::vector<SolidMesh::Set> take() { return std::move(sets_); }

 private:
  std::vector<SolidMesh::Set> sets_;
  std::map<std::string, std::size_t> places_;
};

SolidMesh read_veg(SolidText& text);
SolidMesh read_msh(SolidText& text);
SolidMesh read_vtk(SolidText& text);

}  // namespace h6::io::deform
