// SPDX-License-Identifier: Apache-2.0
#include "io/mesh/gltf_container.h"

#include <cstring>

namespace h6::io {
namespace {

constexpr std::size_t kMostJson = std::size_t{512} << 20;  // its tree takes ten times as much
constexpr int kDeepest = 64;

std::uint32_t word_at(std::string_view bytes, std::size_t at) {
  std::uint32_t value;
  std::memcpy(&value, bytes.data() + at, 4);
  return value;
}

// A .glb is a header ("glTF", 2, length) and chunks (length, type, bytes): JSON first, BIN second.
GltfContainer open_glb(const MeshSource& source) {
  const std::string_view bytes = source.bytes;
  if (bytes.size() < 20) source.fail("the file ends inside the header of a .glb: it is truncated");
  if (word_at(bytes, 4) != 2)
    source.fail("byte 4", "this is glTF " + std::to_string(word_at(bytes, 4)) +
                              ", only version 2 is read; export it anew");
  const std::uint64_t announced = word_at(bytes, 8);
  if (announced > bytes.size())
    source.fail("byte " + std::to_string(bytes.size()),
                "the file ends early: its header announces " + std::to_string(announced) +
                    " bytes; it is truncated");
  if (announced < bytes.size())
    source.fail("byte " + std::to_string(announced), "the file goes on behind its announced end");
  GltfContainer out;
  for (std::size_t at = 12, chunk = 0; at < bytes.size(); ++chunk) {
    if (bytes.size() - at < 8) source.fail("byte " + std::to_string(at), "a chunk is cut off");
    const std::size_t length = word_at(bytes, at), type = word_at(bytes, at + 4);
    if (length > bytes.size() - at - 8)
      source.fail("byte " + std::to_string(at), "a chunk is longer than the file");
    const std::string_view content = bytes.substr(at + 8, length);
    constexpr std::size_t kJson = 0x4E4F534A, kBin = 0x004E4942;
    if (chunk == 0 && type != kJson) source.fail("byte 16", "the first chunk is not JSON");
    if (chunk == 0) out.text = content;
    if (chunk == 1 && type == kBin) out.blob = content;
    at += 8 + length;
  }
  return out;
}

// No glTF nests deeply; a tree of hostile depth could exhaust the stack when it is destroyed.
void check_depth(std::string_view text, const MeshSource& source) {
  int depth = 0;
  bool quoting = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (quoting) {
      if (c == '\\')
        ++i;
      else if (c == '"')
        quoting = false;
    } else if (c == '"') {
      quoting = true;
    } else if (c == '{' || c == '[') {
      if (++depth > kDeepest)
        source.fail("byte " + std::to_string(i), "the JSON is nested too deeply for a glTF");
    } else if (c == '}' || c == ']') {
      --depth;
    }
  }
}

}  // namespace

GltfContainer open_gltf(const MeshSource& source) {
  const bool binary = source.bytes.starts_with("glTF");
  GltfContainer out = binary ? open_glb(source) : GltfContainer{source.bytes, std::nullopt};
  if (out.text.size() > kMostJson)
    source.fail("it has more than 512 MiB of JSON; export it as .glb");
  check_depth(out.text, source);
  return out;
}

std::string decode_base64(std::string_view text, const MeshSource& source) {
  std::string out;
  out.reserve(text.size() / 4 * 3 + 3);
  std::uint32_t bits = 0;
  int have = 0;
  while (!text.empty() && text.back() == '=') text.remove_suffix(1);
  for (const char c : text) {
    std::uint32_t six = 0;
    if (c >= 'A' && c <= 'Z')
      six = static_cast<std::uint32_t>(c - 'A');
    else if (c >= 'a' && c <= 'z')
      six = static_cast<std::uint32_t>(c - 'a' + 26);
    else if (c >= '0' && c <= '9')
      six = static_cast<std::uint32_t>(c - '0' + 52);
    else if (c == '+' || c == '-')
      six = 62;
    else if (c == '/' || c == '_')
      six = 63;
    else
      source.fail("a data URI is not base64");
    bits = bits << 6 | six;
    if ((have += 6) < 8) continue;
    have -= 8;
    out.push_back(static_cast<char>(bits >> have & 0xff));
  }
  return out;
}

// "a%20b" -> "a b".
std::string decode_percent(const std::string& uri) {
  std::string out;
  const auto digit = [](char c) {
    return c >= '0' && c <= '9'   ? c - '0'
           : c >= 'a' && c <= 'f' ? c - 'a' + 10
           : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                  : -1;
  };
  for (std::size_t i = 0; i < uri.size(); ++i) {
    const bool coded =
        uri[i] == '%' && i + 2 < uri.size() && digit(uri[i + 1]) >= 0 && digit(uri[i + 2]) >= 0;
    out.push_back(coded ? static_cast<char>(16 * digit(uri[i + 1]) + digit(uri[i + 2])) : uri[i]);
    if (coded) i += 2;
  }
  return out;
}

}  // namespace h6::io
