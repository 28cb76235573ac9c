// SPDX-License-Identifier: Apache-2.0
// vtk.cpp - legacy VTK: an unstructured grid as text, with cells as before version 5 (a count and
// its points) or since (offsets and connectivity).
#include <algorithm>

#include "io/deform/solid_formats.h"

namespace h6::io::deform {
namespace {

constexpr int kTetra = 10, kVoxel = 11, kHexahedron = 12;

class VtkReader {
 public:
  explicit VtkReader(SolidText& text) : text_(text) {}

  SolidMesh read() {
    head();
    for (std::string_view w = next(); !w.empty(); w = next()) {
      if (same_word(w, "points"))
        points();
      else if (same_word(w, "cells"))
        cells();
      else if (same_word(w, "cell_types"))
        types();
      else if (same_word(w, "metadata"))
        while (text_.scan.next_line() && !text_.scan.rest().empty()) {
        }
      else if (same_word(w, "cell_data") || same_word(w, "point_data"))
        break;  // values at cells and points are no part of the shape
      else if (same_word(w, "field"))
        skip_field();
      else
        text_.fail(io::quoted(w) + " is not expected here");
    }
    build();
    return std::move(mesh_);
  }

 private:
  std::string_view next() { return text_.scan.next_word(); }
  std::string_view must_next(const char* what) {
    const std::string_view w = next();
    if (w.empty()) text_.fail_whole(std::string("the file ends where ") + what + " should follow");
    return w;
  }

  void head() {
    if (!text_.scan.next_line() || !text_.scan.rest().starts_with("# vtk DataFile"))
      text_.fail_whole("it does not begin with '# vtk DataFile', so it is no legacy VTK file");
    text_.scan.next_line();  // the title
    while (!text_.scan.word().empty()) {
    }
    const std::string_view kind = must_next("ASCII or BINARY");
    if (same_word(kind, "binary"))
      text_.fail("binary VTK files are not read; save it as text (ASCII)");
    if (!same_word(kind, "ascii")) text_.fail(io::quoted(kind) + " is neither ASCII nor BINARY");
    if (!same_word(must_next("DATASET"), "dataset")) text_.fail("DATASET is missing");
    if (const std::string_view set = must_next("the kind of data set");
        !same_word(set, "unstructured_grid"))
      text_.fail("data sets of kind " + io::quoted(set) + " are not read, only UNSTRUCTURED_GRID");
  }

  void points() {
    if (!mesh_.vertices.empty()) text_.fail("there is a second POINTS");
    const std::size_t count = text_.count(must_next("a count"), "points", 6);
    must_next("the type of the coordinates");
    mesh_.vertices.reserve(count);
    for (std::size_t i = 0; i < count; ++i)
      mesh_.vertices.push_back(text_.point([this] { return must_next("a coordinate"); }));
  }

  void cells() {
    if (!offsets_.empty()) text_.fail("there is a second CELLS");
    const std::size_t first = text_.count(must_next("a count"), "cells", 1);
    const std::size_t second = text_.count(must_next("a count"), "numbers", 2);
    const std::string_view w = must_next("the cells");
    offsets_ = {0};
    if (same_word(w, "offsets")) {
      must_next("a type");
      offsets_.clear();
      for (std::size_t i = 0; i < first; ++i) offset(text_.whole(must_next("an offset")), second);
      if (!same_word(must_next("CONNECTIVITY"), "connectivity"))
        text_.fail("CONNECTIVITY is missing");
      must_next("a type");
      for (std::size_t i = 0; i < second; ++i) corner(must_next("a point of a cell"));
      return;
    }
    std::string_view size = w;
    for (std::size_t i = 0; i < first; ++i) {
      if (i > 0) size = must_next("a cell");
      const std::size_t points = text_.count(size, "points of a cell");
      for (std::size_t p = 0; p < points; ++p) corner(must_next("a point of a cell"));
      offsets_.push_back(corners_.size());
    }
  }

  void offset(std::int64_t value, std::size_t most) {
    if (value < 0 || static_cast<std::uint64_t>(value) > most ||
        (offsets_.empty() ? value != 0 : static_cast<std::size_t>(value) < offsets_.back()))
      text_.fail("the offset " + std::to_string(value) + " of a cell is out of order");
    offsets_.push_back(static_cast<std::size_t>(value));
  }

  void corner(std::string_view word) {
    const std::int64_t value = text_.whole(word);
    if (value < 0 || static_cast<std::uint64_t>(value) >= mesh_.vertices.size())
      text_.fail("a cell names point " + std::to_string(value) + ", there are " +
                 std::to_string(mesh_.vertices.size()));
    corners_.push_back(static_cast<std::uint32_t>(value));
  }

  void types() {
    if (!types_.empty()) text_.fail("there is a second CELL_TYPES");
    const std::size_t count = text_.count(must_next("a count"), "cell types", 2);
    for (std::size_t i = 0; i < count; ++i) types_.push_back(text_.whole(must_next("a cell type")));
  }

  // FIELD name arrays; each: name components tuples type values...
  void skip_field() {
    must_next("a name");
    const std::size_t arrays = text_.count(must_next("a count"), "arrays", 2);
    for (std::size_t i = 0; i < arrays; ++i) {
      must_next("a name");
      const std::size_t wide = text_.count(must_next("a count"), "components", 1);
      const std::size_t high = text_.count(must_next("a count"), "tuples", 1);
      must_next("a type");
      for (std::size_t t = 0; t < high; ++t)
        for (std::size_t c = 0; c < wide; ++c) must_next("a value");
    }
  }

  void build() {
    const std::size_t cells = offsets_.empty() ? 0 : offsets_.size() - 1;
    if (cells != types_.size())
      text_.fail_whole("it has " + std::to_string(cells) + " cells, but the types of " +
                       std::to_string(types_.size()));
    std::size_t left_out = 0;
    for (std::size_t i = 0; i < cells; ++i) {
      const std::int64_t type = types_[i];
      if (type >= 1 && type <= 9) {
        ++left_out;
        continue;
      }
      const std::uint32_t corners = type == kTetra ? 4 : 8;
      const std::string place = "cell " + std::to_string(i) + " is ";
      if (type != kTetra && type != kVoxel && type != kHexahedron)
        text_.fail_whole(place + "of type " + std::to_string(type) +
                         "; only tetra (10), voxel (11) and hexahedron (12) are read");
      if (offsets_[i + 1] - offsets_[i] != corners)
        text_.fail_whole(place + "of type " + std::to_string(type) + ", but has " +
                         std::to_string(offsets_[i + 1] - offsets_[i]) + " points");
      SolidElement e;
      e.corners = corners;
      e.material = kNoMaterial;
      std::copy_n(corners_.begin() + static_cast<std::ptrdiff_t>(offsets_[i]), corners,
                  e.corner.begin());
      // A voxel's corners are in the order of their coordinates.
      if (type == kVoxel) std::swap(e.corner[2], e.corner[3]), std::swap(e.corner[6], e.corner[7]);
      mesh_.elements.push_back(e);
    }
    if (left_out > 0)
      mesh_.remarks.push_back(std::to_string(left_out) +
                              " points, lines and faces of the file were left out.");
  }

  SolidText& text_;
  SolidMesh mesh_;
  std::vector<std::size_t> offsets_;
  std::vector<std::uint32_t> corners_;
  std::vector<std::int64_t> types_;
};

}  // namespace

SolidMesh read_vtk(SolidText& text) { return VtkReader(text).read(); }

}  // namespace h6::io::deform
