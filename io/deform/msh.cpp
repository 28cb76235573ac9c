// SPDX-License-Identifier: Apache-2.0
// msh.cpp - Gmsh's text formats 2.2 and 4.1. A physical group of volumes becomes a set.
#include <map>

#include "io/deform/solid_formats.h"

namespace h6::io::deform {
namespace {

// Gmsh's numbers for element types: how many nodes an element has that is read or left out.
constexpr int kTet = 4, kHex = 5;
bool lies_flat(std::int64_t type) {  // points, lines, triangles, quadrangles of any order
  constexpr int kFlat[] = {1, 2, 3, 8, 9, 10, 15, 16, 20, 21, 22, 23, 24, 25, 26, 27, 28};
  for (const int flat : kFlat)
    if (type == flat) return true;
  return type >= 36 && type <= 66;
}

class MshReader {
 public:
  explicit MshReader(SolidText& text) : text_(text) {}

  SolidMesh read() {
    while (text_.scan.next_line()) {
      const std::string_view section = text_.scan.word();
      if (section.empty()) continue;
      if (section[0] != '$')
        text_.fail(io::quoted(section) + " stands where a section such as $Nodes is expected");
      if (section == "$MeshFormat")
        format();
      else if (version_ == 0)
        text_.fail_whole("it does not begin with $MeshFormat, so it is no mesh of Gmsh 2 or 4");
      else if (section == "$PhysicalNames")
        names();
      else if (section == "$Entities" && version_ == 4)
        entities();
      else if (section == "$Nodes")
        version_ == 2 ? nodes2() : nodes4();
      else if (section == "$Elements")
        version_ == 2 ? elements2() : elements4();
      else {
        skip(section);
        continue;
      }
      end(section);
    }
    if (mesh_.vertices.empty()) text_.fail_whole("there is no $Nodes in it");
    mesh_.sets = sets_.take();
    if (left_out_ > 0)
      mesh_.remarks.push_back(std::to_string(left_out_) +
                              " points, lines and faces of the file were left out.");
    return std::move(mesh_);
  }

 private:
  std::string_view next() {
    const std::string_view w = text_.scan.next_word();
    if (w.empty()) text_.fail_whole("the file ends inside a section");
    return w;
  }
  std::int64_t whole() { return text_.whole(next()); }

  void end(std::string_view section) {
    const std::string wanted = "$End" + std::string(section.substr(1));
    if (const std::string_view w = next(); w != wanted)
      text_.fail(io::quoted(w) + " stands where " + wanted + " is expected");
  }
  void skip(std::string_view section) {
    const std::string wanted = "$End" + std::string(section.substr(1));
    while (text_.scan.next_line())
      if (text_.scan.word() == wanted) return;
    text_.fail_whole("the file ends before " + printable(wanted));
  }

  void format() {
    const double version = text_.number(next());
    if (version != 2.2 && version != 4.1)
      text_.fail("only the versions 2.2 and 4.1 of the format are read; save it as one of them");
    version_ = version < 3 ? 2 : 4;
    if (whole() != 0) text_.fail("binary .msh files are not read; save it as text (ASCII)");
    whole();  // the size of a number in binary files
  }

  void names() {
    const std::size_t count = text_.count(next(), "names", 4);
    for (std::size_t i = 0; i < count; ++i) {
      const std::int64_t dimension = whole(), tag = whole();
      std::string_view name = text_.scan.rest();
      if (name.size() >= 2 && name.front() == '"' && name.back() == '"')
        name = name.substr(1, name.size() - 2);
      if (dimension == 3) names_[tag] = printable(name);
      while (!text_.scan.word().empty()) {
      }
    }
  }

  // The physical groups of volumes; all else is passed over.
  void entities() {
    std::size_t counts[4];
    for (std::size_t& count : counts) count = text_.count(next(), "entities", 4);
    for (int dimension = 0; dimension < 4; ++dimension)
      for (std::size_t i = 0; i < counts[dimension]; ++i) {
        const std::int64_t tag = whole();
        for (int c = 0; c < (dimension == 0 ? 3 : 6); ++c) text_.number(next());
        const std::size_t groups = text_.count(next(), "groups");
        for (std::size_t g = 0; g < groups; ++g)
          if (const std::int64_t group = whole(); dimension == 3) volumes_[tag].push_back(group);
        const std::size_t sides = dimension == 0 ? 0 : text_.count(next(), "sides");
        for (std::size_t s = 0; s < sides; ++s) whole();
      }
  }

  void node(std::int64_t number, const h6Vec3& at) {
    if (!numbers_.add(number)) text_.fail("there is a second node " + std::to_string(number));
    mesh_.vertices.push_back(at);
  }
  void once() const {
    if (!mesh_.vertices.empty()) text_.fail("there is a second $Nodes");
  }

  void nodes2() {
    once();
    const std::size_t count = text_.count(next(), "nodes", 8);
    for (std::size_t i = 0; i < count; ++i) {
      const std::int64_t number = whole();
      node(number, text_.point([this] { return next(); }));
    }
  }

  void nodes4() {
    once();
    const std::size_t blocks = text_.count(next(), "blocks", 8);
    for (int i = 0; i < 3; ++i) whole();  // count, least and largest number
    std::vector<std::int64_t> numbers;
    for (std::size_t b = 0; b < blocks; ++b) {
      const std::int64_t dimension = whole();
      whole();  // the entity
      const bool parametric = whole() != 0;
      numbers.assign(text_.count(next(), "nodes", 8), 0);
      for (std::int64_t& number : numbers) number = whole();
      for (const std::int64_t number : numbers) {
        node(number, text_.point([this] { return next(); }));
        for (int c = 0; parametric && c < dimension && c < 3; ++c) text_.number(next());
      }
    }
  }

  // The corners of an element follow. Returns false for one that is left out, whose line is passed
  // over.
  bool element(std::int64_t type) {
    if (lies_flat(type)) {
      ++left_out_;
      while (!text_.scan.word().empty()) {
      }
      return false;
    }
    if (type != kTet && type != kHex)
      text_.fail("elements of Gmsh's type " + std::to_string(type) +
                 " are not read, only tetrahedra of 4 and hexahedra of 8 nodes (save it with "
                 "element order 1)");
    SolidElement e;
    e.corners = type == kTet ? 4 : 8;
    e.material = kNoMaterial;
    for (std::uint32_t a = 0; a < e.corners; ++a) {
      const std::int64_t number = whole(), found = numbers_.find(number);
      if (found < 0)
        text_.fail("an element names node " + std::to_string(number) + ", there is none");
      e.corner[a] = static_cast<std::uint32_t>(found);
    }
    mesh_.elements.push_back(e);
    return true;
  }
  void put_in_group(std::int64_t group) {
    if (group == 0) return;  // no group
    const auto name = names_.find(group);
    sets_.add(name == names_.end() ? "physical " + std::to_string(group) : name->second,
              static_cast<std::uint32_t>(mesh_.elements.size() - 1));
  }

  void elements2() {
    const std::size_t count = text_.count(next(), "elements", 6);
    for (std::size_t i = 0; i < count; ++i) {
      whole();  // its number
      const std::int64_t type = whole();
      const std::size_t tags = text_.count(next(), "tags");
      std::int64_t group = 0;
      for (std::size_t t = 0; t < tags; ++t)
        if (const std::int64_t tag = whole(); t == 0) group = tag;
      if (element(type)) put_in_group(group);
    }
  }

  void elements4() {
    const std::size_t blocks = text_.count(next(), "blocks", 8);
    for (int i = 0; i < 3; ++i) whole();
    for (std::size_t b = 0; b < blocks; ++b) {
      const std::int64_t dimension = whole(), entity = whole(), type = whole();
      const std::size_t count = text_.count(next(), "elements", 4);
      for (std::size_t i = 0; i < count; ++i) {
        whole();  // its number
        if (!element(type) || dimension != 3) continue;
        const auto volume = volumes_.find(entity);
        if (volume == volumes_.end()) continue;
        for (const std::int64_t group : volume->second) put_in_group(group);
      }
    }
  }

  SolidText& text_;
  SolidMesh mesh_;
  int version_ = 0;
  std::size_t left_out_ = 0;
  VertexNumbers numbers_;
  SetNames sets_;
  std::map<std::int64_t, std::string> names_;
  std::map<std::int64_t, std::vector<std::int64_t>> volumes_;
};

}  // namespace

SolidMesh read_msh(SolidText& text) { return MshReader(text).read(); }

}  // namespace h6::io::deform
