// SPDX-License-Identifier: Apache-2.0
// veg.cpp - Vega's text format. Words are separated by blanks or commas; a line that starts with #
// is a comment. J. Barbic, F. Sin, D. Schroeder, "Vega FEM library", 2012.
#include <algorithm>

#include "io/deform/solid_formats.h"

namespace h6::io::deform {
namespace {

class VegReader {
 public:
  explicit VegReader(SolidText& text) : text_(text) {}

  SolidMesh read() {
    bool more = line();
    while (more) {
      if (word_.empty() || word_[0] != '*')
        text_.fail(io::quoted(word_) + " stands where a statement such as *VERTICES is expected");
      if (same_word(word_, "*vertices"))
        vertices(), more = line();
      else if (same_word(word_, "*elements"))
        elements(), more = line();
      else if (same_word(word_, "*material"))
        material(), more = line();
      else if (same_word(word_, "*region"))
        region(), more = line();
      else if (same_word(word_, "*set"))
        more = set();
      else if (same_word(word_, "*include"))
        text_.fail("*INCLUDE is not read; put the other file's text in its place");
      else
        text_.fail(io::quoted(word_) + " is no statement of a .veg file");
    }
    if (mesh_.vertices.empty()) text_.fail_whole("there is no *VERTICES in it");
    apply_regions();
    return std::move(mesh_);
  }

 private:
  // The next line that is neither empty nor a comment; its first word is in word_.
  bool line() {
    while (text_.scan.next_line()) {
      rest_ = text_.scan.rest();
      word_ = next();
      if (!word_.empty() && word_[0] != '#') return true;
    }
    return false;
  }
  void must_line(const char* what) {
    if (!line()) text_.fail_whole(std::string("the file ends where ") + what + " should follow");
  }
  // The next word of the line; a comma separates as a blank does.
  std::string_view next() {
    const auto apart = [](char c) { return c == ' ' || c == '\t' || c == ',' || c == '\r'; };
    while (!rest_.empty() && apart(rest_.front())) rest_.remove_prefix(1);
    std::size_t end = 0;
    while (end < rest_.size() && !apart(rest_[end])) ++end;
    const std::string_view word = rest_.substr(0, end);
    rest_.remove_prefix(end);
    return word;
  }

  void vertices() {
    if (!mesh_.vertices.empty()) text_.fail("there is a second *VERTICES");
    must_line("the number of vertices");
    const std::size_t count = text_.count(word_, "vertices", 7);
    if (const std::string_view size = next(); !size.empty() && text_.whole(size) != 3)
      text_.fail("vertices have " + io::quoted(size) + " coordinates, 3 are needed");
    mesh_.vertices.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
      must_line("a vertex");
      if (!numbers_.add(text_.whole(word_)))
        text_.fail("there is a second vertex " + std::string(word_));
      mesh_.vertices.push_back(text_.point([this] { return next(); }));
    }
  }

  void elements() {
    must_line("the kind of element");
    const bool tets = same_word(word_, "tet") || same_word(word_, "tets");
    if (!tets && !same_word(word_, "cubic"))
      text_.fail("elements of kind " + io::quoted(word_) + " are not read, only TET and CUBIC");
    must_line("the number of elements");
    const std::uint32_t corners = tets ? 4 : 8;
    const std::size_t count = text_.count(word_, "elements", 2 * corners);
    if (text_.whole(next()) != corners)
      text_.fail("an element of this kind has " + std::to_string(corners) + " corners");
    for (std::size_t i = 0; i < count; ++i) {
      must_line("an element");
      if (!elements_.add(text_.whole(word_)))
        text_.fail("there is a second element " + std::string(word_));
      SolidElement e;
      e.corners = corners;
      e.material = kNoMaterial;
      for (std::uint32_t a = 0; a < corners; ++a) e.corner[a] = corner(next());
      mesh_.elements.push_back(e);
    }
  }

  std::uint32_t corner(std::string_view word) {
    const std::int64_t found = numbers_.find(text_.whole(word));
    if (found < 0) text_.fail("an element names vertex " + std::string(word) + ", there is none");
    return static_cast<std::uint32_t>(found);
  }

  void material() {
    SolidMaterial m;
    m.name = printable(next());
    if (m.name.empty()) text_.fail("a *MATERIAL has no name");
    must_line("a material");
    if (!same_word(word_, "enu"))
      text_.fail("materials of kind " + io::quoted(word_) +
                 " are not read, only ENU (density, Young's modulus, Poisson's ratio)");
    m.density = text_.number(next());
    m.young = text_.number(next());
    m.poisson = text_.number(next());
    mesh_.materials.push_back(m);
  }

  // Its lines end at the next statement, which is then in word_; false at the end of the file.
  bool set() {
    SolidMesh::Set set{printable(next()), {}};
    if (set.name.empty()) text_.fail("a *SET has no name");
    bool more;
    while ((more = line()) && word_[0] != '*')
      for (std::string_view w = word_; !w.empty(); w = next()) {
        const std::int64_t found = elements_.find(text_.whole(w));
        if (found < 0) text_.fail("a set names element " + std::string(w) + ", there is none");
        set.elements.push_back(static_cast<std::uint32_t>(found));
      }
    std::sort(set.elements.begin(), set.elements.end());
    set.elements.erase(std::unique(set.elements.begin(), set.elements.end()), set.elements.end());
    mesh_.sets.push_back(std::move(set));
    return more;
  }

  void region() {
    must_line("a set and its material");
    const std::string set = printable(word_), material = printable(next());
    regions_.push_back({set, material, text_.scan.line()});
  }

  // At the end, since a region may stand before its set and material.
  void apply_regions() {
    for (const Region& r : regions_) {
      const std::string place = "line " + std::to_string(r.line) + ": a region ";
      std::uint32_t number = 0;
      while (number < mesh_.materials.size() && mesh_.materials[number].name != r.material)
        ++number;
      if (number == mesh_.materials.size())
        text_.fail_whole(place + "names the material " + io::quoted(r.material) +
                         ", there is none");
      if (r.set == "allElements") {
        for (SolidElement& e : mesh_.elements) e.material = number;
        continue;
      }
      const auto set = std::find_if(mesh_.sets.begin(), mesh_.sets.end(),
                                    [&](const SolidMesh::Set& s) { return s.name == r.set; });
      if (set == mesh_.sets.end())
        text_.fail_whole(place + "names the set " + io::quoted(r.set) + ", there is none");
      for (const std::uint32_t e : set->elements) mesh_.elements[e].material = number;
    }
  }

  struct Region {
    std::string set, material;
    std::size_t line;
  };
  SolidText& text_;
  std::string_view word_, rest_;
  VertexNumbers numbers_, elements_;
  std::vector<Region> regions_;
  SolidMesh mesh_;
};

}  // namespace

SolidMesh read_veg(SolidText& text) { return VegReader(text).read(); }

}  // namespace h6::io::deform
