// SPDX-License-Identifier: Apache-2.0
// xml_file.h - an XML file as pugixml parses it, with its lines for error sentences. Inside io/mesh
// only.
//
// pugixml neither recurses nor expands entities of the file's own. This reader also refuses a file
// that has a DOCTYPE, a second root element, elements nested deeper than 200, or more tags than
// memory should hold.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include <pugixml.hpp>

#include "io/mesh/formats.h"

namespace h6::io {

using Element = pugi::xml_node;

// Without its namespace prefix.
std::string_view name_of(Element e);
// The first child element of that name; a null node when there is none.
Element child_of(Element e, std::string_view name);
// The first piece of text in it, up to an element or a comment.
inline std::string_view text_of(Element e) { return e.child_value(); }

// The children of an element that are elements.
template <class Work>
void each_child(Element e, const Work& work) {
  for (const Element child : e.children())
    if (child.type() == pugi::node_element) work(child);
}

// Every failure throws BadMesh with file, line and element.
class XmlFile {
 public:
  explicit XmlFile(const MeshSource& source);  // must outlive it

  Element root() const { return document_.document_element(); }
  const std::vector<Element>& elements() const { return elements_; }  // in the file's order

  // "line 7 (triangles): what."
  [[noreturn]] void fail(Element e, const std::string& what) const;

  // The element that an attribute names as "#id". A name other than "" must be its own.
  Element follow(Element e, const char* attribute, std::string_view name) const;
  // A whole number, not below 0, in an attribute; `otherwise` when the attribute is absent.
  std::uint64_t count_or(Element e, const char* attribute, std::uint64_t otherwise) const;
  // The element's text as finite numbers; `expected` is a hint of how many.
  std::vector<double> numbers(Element e, std::size_t expected = 0) const;
  std::vector<double> numbers_of(Element e, std::size_t count) const;  // exactly so many
  std::vector<std::uint32_t> wholes(Element e) const;                  // indices

 private:
  [[noreturn]] void fail_at(std::ptrdiff_t offset, const std::string& what) const;
  std::string line_at(std::ptrdiff_t offset) const;
  void parse();
  void list_elements();

  const MeshSource& source_;
  pugi::xml_document document_;
  std::vector<Element> elements_;
  std::unordered_map<std::string_view, Element> ids_;  // the first of each id
};

}  // namespace h6::io
