// SPDX-License-Identifier: Apache-2.0
// shell_file_write.cpp - the writer of shell_file.h.
#include <bit>
#include <cstring>
#include <fstream>

#include "io/file/write_aside.h"
#include "io/shell/shell_file.h"

namespace h6::io {
namespace {

static_assert(std::endian::native == std::endian::little, "rows are written as they lie in memory");

// Rows are written in pieces, so that a shell of millions of points is not in memory twice.
class Rows {
 public:
  explicit Rows(std::ofstream& out) : out_(out) {}
  template <class T>
  void put(T value) {
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    buffer_.append(bytes, sizeof value);
    if (buffer_.size() > (1u << 20)) flush();
  }
  void flush() {
    out_.write(buffer_.data(), std::streamsize(buffer_.size()));
    buffer_.clear();
  }

 private:
  std::ofstream& out_;
  std::string buffer_;
};

std::string header(const ShellData& shell) {
  std::string text =
      "ply\nformat binary_little_endian 1.0\ncomment hapsix shell 1\n"
      "comment units metres\n";
  if (!shell.input_hash.empty()) text += "comment input_hash " + shell.input_hash + "\n";
  text += "comment level_first";
  for (const auto first : shell.level_first) (text += ' ') += std::to_string(first);
  text += "\nelement vertex " + std::to_string(shell.size()) + "\n";
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz", "radius"}) {
    text += std::string("property float ") + name + "\n";
  }
  text += "property uchar level\nproperty uint first_child\nproperty uint child_count\n";
  if (!shell.source.empty()) text += "property uint triangle\n";
  return text + "element node " + std::to_string(shell.node_point.size()) +
         "\nproperty uint point\nproperty float radius\nproperty uint first_child\n"
         "property uint child_count\nend_header\n";
}

Outcome write_rows(const std::filesystem::path& file, const ShellData& shell) {
  std::ofstream out(file, std::ios::binary);
  const std::string head = header(shell);
  out.write(head.data(), std::streamsize(head.size()));
  Rows rows(out);
  const std::vector<std::uint32_t> own = first_rows(shell);
  std::uint8_t level = 0;
  for (std::size_t i = 0; i < shell.size(); ++i) {
    while (i >= shell.level_points[level]) ++level;
    for (const auto* column : {&shell.x, &shell.y, &shell.z, &shell.nx, &shell.ny, &shell.nz}) {
      rows.put((*column)[i]);
    }
    rows.put(shell.node_radius[own[i]]);
    rows.put(level);
    rows.put(shell.node_first_child[own[i]]);
    rows.put(shell.node_child_count[own[i]]);
    if (!shell.source.empty()) rows.put(shell.source[i]);
  }
  for (std::size_t r = 0; r < shell.node_point.size(); ++r) {
    rows.put(shell.node_point[r]);
    rows.put(shell.node_radius[r]);
    rows.put(shell.node_first_child[r]);
    rows.put(shell.node_child_count[r]);
  }
  rows.flush();
  out.close();
  if (!out) {
    return Failure{"Cannot write " + file.string() + ": the disk may be full or not writable."};
  }
  return Done{};
}

}  // namespace

Outcome write_shell(const std::filesystem::path& file, const ShellData& shell) {
  if (Outcome fine = check_shell(shell); !fine) {
    return Failure{"Not written to " + file.string() + ": " + fine.error()};
  }
  for (const char c : shell.input_hash) {
    if (c > ' ' && c <= '~') continue;
    return Failure{"Not written to " + file.string() +
                   ": its input hash holds a character that a PLY comment cannot carry."};
  }
  return write_aside(file, [&](const auto& aside) { return write_rows(aside, shell); });
}

}  // namespace h6::io
