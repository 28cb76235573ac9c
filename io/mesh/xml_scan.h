// SPDX-License-Identifier: Apache-2.0
// xml_scan.h - an XML file as a flat list of elements, in place: what COLLADA needs of XML.
//
// Elements, attributes, comments, CDATA, the five named entities and character numbers in
// attributes. A DOCTYPE is refused: entities of a file's own can grow without bound.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "io/mesh/formats.h"

namespace h6::io {

class Xml {
 public:
  using Index = std::uint32_t;
  static constexpr Index kNone = ~Index{0};

  // Throws when tags do not match, nest deeper than 200, or are too many. `source` must outlive it.
  explicit Xml(const MeshSource& source);

  Index root() const { return 0; }
  std::size_t size() const { return elements_.size(); }
  std::string_view name(Index e) const { return elements_[e].name; }  // without its prefix
  std::string attribute(Index e, std::string_view name) const;        // "": none
  std::string_view text(Index e) const { return elements_[e].text; }  // up to the first tag in it
  Index first(Index e) const { return elements_[e].first; }           // child
  Index next(Index e) const { return elements_[e].next; }             // sibling
  Index child(Index e, std::string_view name) const;                  // first of that name
  // "line 7 (triangles)"
  std::string place(Index e) const;

 private:
  struct Element {
    std::string_view name, attributes, text;
    Index first = kNone, last = kNone, next = kNone;
  };
  void scan();
  void open(std::string_view tag);
  void close(std::string_view tag);
  std::string line_at(const char* at) const;
  [[noreturn]] void fail(const char* at, const std::string& what) const;

  const MeshSource& source_;
  std::vector<Element> elements_;
  std::vector<Index> open_;
};

}  // namespace h6::io
