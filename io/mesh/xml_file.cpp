// SPDX-License-Identifier: Apache-2.0
#include "io/mesh/xml_file.h"

#include <algorithm>
#include <cmath>

#include "io/file/text_scan.h"

namespace h6::io {
namespace {

constexpr int kDeepest = 200;
// Bytes that may begin an element or an attribute: each costs pugixml up to 64 bytes.
constexpr std::ptrdiff_t kMostMarks = 40'000'000;

// An error sentence for `status`; `rest` begins where the parser stopped.
std::string sentence(pugi::xml_parse_status status, std::string_view rest) {
  const bool cut = rest.find('>') == std::string_view::npos;
  switch (status) {
    case pugi::status_bad_pi:
      return "a declaration does not end: the file is truncated";
    case pugi::status_bad_comment:
      return "a comment does not end: the file is truncated";
    case pugi::status_bad_cdata:
      return "a CDATA section does not end: the file is truncated";
    case pugi::status_bad_doctype:
      return "a DOCTYPE is not read; export it without";
    case pugi::status_end_element_mismatch: {
      const std::string_view name = rest.substr(0, rest.find_first_of("> \t\r\n"));
      return cut || name.empty() ? "the file ends inside an element: it is truncated"
                                 : "</" + printable(name) + "> closes what is not open";
    }
    case pugi::status_out_of_memory:
      return "there is not enough memory to read it";
    default:
      return cut ? "a tag does not end: the file is truncated" : "a tag is damaged";
  }
}

}  // namespace

std::string_view name_of(Element e) {
  const std::string_view name = e.name();
  const std::size_t colon = name.rfind(':');
  return colon == std::string_view::npos ? name : name.substr(colon + 1);
}

Element child_of(Element e, std::string_view name) {
  for (const Element child : e.children())
    if (name_of(child) == name) return child;
  return {};
}

XmlFile::XmlFile(const MeshSource& source) : source_(source) {
  parse();
  list_elements();
}

std::string XmlFile::line_at(std::ptrdiff_t offset) const {
  const auto end = std::clamp<std::ptrdiff_t>(offset, 0, std::ssize(source_.bytes));
  const auto lines = std::count(source_.bytes.begin(), source_.bytes.begin() + end, '\n');
  return "line " + std::to_string(lines + 1);
}

void XmlFile::fail_at(std::ptrdiff_t offset, const std::string& what) const {
  source_.fail(line_at(offset), what);
}

void XmlFile::fail(Element e, const std::string& what) const {
  source_.fail(line_at(e.offset_debug()) + " (" + printable(name_of(e)) + ")", what);
}

void XmlFile::parse() {
  const std::string_view bytes = source_.bytes;
  if (std::count_if(bytes.begin(), bytes.end(), [](char c) { return c == '<' || c == '='; }) >
      kMostMarks)
    source_.fail("more elements than can be read");
  const pugi::xml_parse_result result = document_.load_buffer(
      bytes.data(), bytes.size(),
      pugi::parse_escapes | pugi::parse_wconv_attribute | pugi::parse_doctype, pugi::encoding_utf8);
  if (result.status == pugi::status_no_document_element)
    source_.fail("there is no XML in it, so it is no COLLADA");
  if (!result) {
    const auto offset = std::clamp<std::ptrdiff_t>(result.offset, 0, std::ssize(bytes));
    fail_at(offset, sentence(result.status, bytes.substr(std::size_t(offset))));
  }
  std::size_t roots = 0;
  for (const Element e : document_.children()) {
    if (e.type() == pugi::node_doctype)
      fail_at(e.offset_debug(), sentence(pugi::status_bad_doctype, {}));
    if (e.type() == pugi::node_element && ++roots > 1)
      fail_at(e.offset_debug(), "a second root element stands here");
  }
}

// In the order of the file, without recursion.
void XmlFile::list_elements() {
  int depth = 0;
  for (Element e = root(); e;) {
    if (e.type() == pugi::node_element) {
      if (depth >= kDeepest) fail_at(e.offset_debug(), "its elements are nested too deeply");
      elements_.push_back(e);
      if (const std::string_view id = e.attribute("id").value(); !id.empty())
        ids_.try_emplace(id, e);
    }
    if (e.first_child()) {
      e = e.first_child();
      ++depth;
      continue;
    }
    while (e != root() && !e.next_sibling()) {
      e = e.parent();
      --depth;
    }
    e = e == root() ? Element{} : e.next_sibling();
  }
}

Element XmlFile::follow(Element e, const char* attribute, std::string_view name) const {
  const std::string_view url = e.attribute(attribute).value();
  if (!url.starts_with("#"))
    fail(e, "it refers to " + io::quoted(url) + "; only what is in the same file is read");
  const auto found = ids_.find(url.substr(1));
  if (found == ids_.end() || (!name.empty() && name_of(found->second) != name))
    fail(e, "it refers to " + io::quoted(url) + ", which is not there");
  return found->second;
}

std::uint64_t XmlFile::count_or(Element e, const char* attribute, std::uint64_t otherwise) const {
  const std::string_view word = e.attribute(attribute).value();
  if (word.empty()) return otherwise;
  std::int64_t value = 0;
  if (const char* fault = parse_number(word, value)) fail(e, io::quoted(word) + fault);
  if (value < 0 || value > 0x7fffffff) fail(e, io::quoted(word) + " cannot be right");
  return static_cast<std::uint64_t>(value);
}

std::vector<double> XmlFile::numbers(Element e, std::size_t expected) const {
  const std::string_view text = text_of(e);
  std::vector<double> out;
  out.reserve(std::min(expected, text.size() / 2 + 1));
  TextScan scan(text);
  for (std::string_view word = scan.next_word(); !word.empty(); word = scan.next_word()) {
    double value = 0;
    if (const char* fault = parse_number(word, value)) fail(e, io::quoted(word) + fault);
    if (!std::isfinite(value)) fail(e, io::quoted(word) + " is not finite");
    out.push_back(value);
  }
  return out;
}

std::vector<double> XmlFile::numbers_of(Element e, std::size_t count) const {
  if (text_of(e).size() > 4096) fail(e, "it is too long");
  std::vector<double> out = numbers(e);
  if (out.size() != count)
    fail(e, "it has " + std::to_string(out.size()) + " numbers, " + std::to_string(count) +
                " are needed");
  return out;
}

std::vector<std::uint32_t> XmlFile::wholes(Element e) const {
  std::vector<std::uint32_t> out;
  TextScan scan(text_of(e));
  for (std::string_view word = scan.next_word(); !word.empty(); word = scan.next_word()) {
    std::int64_t value = 0;
    if (const char* fault = parse_number(word, value)) fail(e, io::quoted(word) + fault);
    if (value < 0 || value > 0x7fffffff) fail(e, io::quoted(word) + " is no index");
    out.push_back(static_cast<std::uint32_t>(value));
  }
  return out;
}

}  // namespace h6::io
