// SPDX-License-Identifier: Apache-2.0
#include "io/mesh/xml_scan.h"

#include <algorithm>
#include <cstdlib>

#include "io/file/text_scan.h"

namespace h6::io {
namespace {

constexpr std::size_t kDeepest = 200, kMostElements = 10'000'000;

bool blank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

std::string_view without_prefix(std::string_view name) {
  const std::size_t colon = name.rfind(':');
  return colon == std::string_view::npos ? name : name.substr(colon + 1);
}

// Where a tag ends: a '>' may stand in an attribute's quotes.
std::size_t end_of_tag(std::string_view text, std::size_t at) {
  char quote = 0;
  for (; at < text.size(); ++at) {
    const char c = text[at];
    if (quote)
      quote = c == quote ? char{0} : quote;
    else if (c == '"' || c == '\'')
      quote = c;
    else if (c == '>')
      return at;
  }
  return std::string_view::npos;
}

void append_utf8(std::string& out, unsigned long code) {
  const auto put = [&](unsigned long byte) { out.push_back(static_cast<char>(byte)); };
  if (code < 0x80) return put(code);
  if (code < 0x800) return put(0xc0 | code >> 6), put(0x80 | (code & 0x3f));
  if (code < 0x10000)
    put(0xe0 | code >> 12);
  else
    put(0xf0 | (code >> 18 & 7)), put(0x80 | (code >> 12 & 0x3f));
  put(0x80 | (code >> 6 & 0x3f));
  put(0x80 | (code & 0x3f));
}

std::string without_entities(std::string_view text) {
  static constexpr std::pair<std::string_view, char> kNamed[] = {
      {"&lt;", '<'}, {"&gt;", '>'}, {"&amp;", '&'}, {"&quot;", '"'}, {"&apos;", '\''}};
  std::string out;
  while (!text.empty()) {
    const auto* named = std::find_if(std::begin(kNamed), std::end(kNamed),
                                     [&](const auto& n) { return text.starts_with(n.first); });
    const std::size_t end = text.substr(0, 12).find(';');
    if (named != std::end(kNamed)) {
      out.push_back(named->second);
      text.remove_prefix(named->first.size());
    } else if (text.starts_with("&#") && end != std::string_view::npos) {
      const bool hex = text.size() > 2 && text[2] == 'x';
      const std::string digits(text.substr(hex ? 3 : 2, end - (hex ? 3 : 2)));
      append_utf8(out, std::strtoul(digits.c_str(), nullptr, hex ? 16 : 10) & 0x1fffff);
      text.remove_prefix(end + 1);
    } else {
      out.push_back(text.front());
      text.remove_prefix(1);
    }
  }
  return out;
}

}  // namespace

Xml::Xml(const MeshSource& source) : source_(source) { scan(); }

std::string Xml::line_at(const char* at) const {
  const auto lines = std::count(source_.bytes.data(), at, '\n');
  return "line " + std::to_string(lines + 1);
}

void Xml::fail(const char* at, const std::string& what) const { source_.fail(line_at(at), what); }

std::string Xml::place(Index e) const {
  return line_at(name(e).data()) + " (" + printable(name(e)) + ")";
}

void Xml::scan() {
  const std::string_view text = source_.bytes;
  std::size_t at = 0;
  const auto skip_past = [&](std::string_view end, const char* what) {
    const std::size_t found = text.find(end, at);
    if (found == std::string_view::npos)
      fail(text.data() + at, std::string(what) + " does not end: the file is truncated");
    at = found + end.size();
  };
  while ((at = text.find('<', at)) != std::string_view::npos) {
    const std::string_view rest = text.substr(at);
    if (rest.starts_with("<?"))
      skip_past("?>", "a declaration");
    else if (rest.starts_with("<!--"))
      skip_past("-->", "a comment");
    else if (rest.starts_with("<![CDATA["))
      skip_past("]]>", "a CDATA section");
    else if (rest.starts_with("<!"))
      fail(rest.data(), "a DOCTYPE is not read; export it without");
    else {
      const std::size_t end = end_of_tag(text, at);
      if (end == std::string_view::npos)
        fail(rest.data(), "a tag does not end: the file is truncated");
      const std::string_view tag = text.substr(at + 1, end - at - 1);
      at = end + 1;
      if (tag.starts_with("/")) {
        close(tag.substr(1));
        continue;
      }
      open(tag);
      const std::size_t content = text.find('<', at);
      elements_.back().text = text.substr(at, content == std::string_view::npos ? 0 : content - at);
      if (tag.ends_with("/")) {
        elements_.back().text = {};
        open_.pop_back();
      }
    }
  }
  if (elements_.empty()) source_.fail("there is no XML in it, so it is no COLLADA");
  if (!open_.empty())
    source_.fail("the file ends inside <" + printable(name(open_.back())) + ">: it is truncated");
}

void Xml::open(std::string_view tag) {
  std::size_t length = 0;
  while (length < tag.size() && !blank(tag[length]) && tag[length] != '/') ++length;
  if (length == 0) fail(tag.data(), "a tag has no name");
  if (open_.size() >= kDeepest) fail(tag.data(), "its elements are nested too deeply");
  if (elements_.size() >= kMostElements) fail(tag.data(), "more elements than can be read");
  if (open_.empty() && !elements_.empty()) fail(tag.data(), "a second root element stands here");
  Element element;
  element.name = without_prefix(tag.substr(0, length));
  element.attributes = tag.substr(length);
  const auto index = static_cast<Index>(elements_.size());
  elements_.push_back(element);
  if (!open_.empty()) {
    Element& parent = elements_[open_.back()];
    (parent.first == kNone ? parent.first : elements_[parent.last].next) = index;
    parent.last = index;
  }
  open_.push_back(index);
}

void Xml::close(std::string_view tag) {
  while (!tag.empty() && blank(tag.back())) tag.remove_suffix(1);
  if (open_.empty() || name(open_.back()) != without_prefix(tag))
    fail(tag.data(), "</" + printable(tag) + "> closes what is not open");
  open_.pop_back();
}

std::string Xml::attribute(Index e, std::string_view wanted) const {
  std::string_view rest = elements_[e].attributes;
  for (;;) {
    const std::size_t equals = rest.find('=');
    if (equals == std::string_view::npos) return {};
    std::string_view key = rest.substr(0, equals);
    while (!key.empty() && blank(key.front())) key.remove_prefix(1);
    while (!key.empty() && blank(key.back())) key.remove_suffix(1);
    const std::size_t open = rest.find_first_of("\"'", equals);
    if (open == std::string_view::npos) return {};
    const std::size_t end = rest.find(rest[open], open + 1);
    if (end == std::string_view::npos) return {};
    if (key == wanted) return without_entities(rest.substr(open + 1, end - open - 1));
    rest.remove_prefix(end + 1);
  }
}

Xml::Index Xml::child(Index e, std::string_view wanted) const {
  for (Index c = first(e); c != kNone; c = next(c))
    if (name(c) == wanted) return c;
  return kNone;
}

}  // namespace h6::io
