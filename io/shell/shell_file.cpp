// SPDX-License-Identifier: Apache-2.0
// shell_file.cpp - the reader of shell_file.h. It trusts nothing in a file: it compares counts with
// the file's size before it reserves memory, and it checks the whole shell before it returns it.
#include "io/shell/shell_file.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <new>
#include <optional>
#include <span>
#include <utility>

#include "io/file/text_scan.h"
#include "io/mesh/ply_header.h"
#include "io/shell/bake_shell.h"

namespace h6::io {
namespace {

constexpr int default_levels = 7;

// A column of a table: exactly one of real and whole is set.
struct Column {
  std::string_view name;
  std::vector<float>* real = nullptr;
  std::vector<std::uint32_t>* whole = nullptr;
  bool needed = true;
  bool found = false;
};

// Reads values one after the other, from text or little-endian bytes.
class Body {
 public:
  Body(const MeshSource& source, const PlyHeader& header)
      : source_(source),
        text_(header.form == PlyHeader::Form::ascii),
        bytes_(source.bytes.substr(header.body)),
        scan_(bytes_),
        first_line_(header.lines) {}

  std::uint64_t left() const {
    return text_ ? scan_.rest().size() + scan_.behind().size() + 1 : bytes_.size() - at_;
  }
  // The least size of a value; in text a digit and a blank.
  std::uint64_t smallest(PlyType type) const { return text_ ? 2 : size_of(type); }

  double next(PlyType type) {
    if (text_) return next_word(type);
    if (left() < size_of(type)) fail("the file ends early: it is truncated");
    const char* at = bytes_.data() + at_;
    at_ += size_of(type);
    switch (type) {
      case PlyType::int8:
        return raw<std::int8_t>(at);
      case PlyType::uint8:
        return raw<std::uint8_t>(at);
      case PlyType::int16:
        return raw<std::int16_t>(at);
      case PlyType::uint16:
        return raw<std::uint16_t>(at);
      case PlyType::int32:
        return raw<std::int32_t>(at);
      case PlyType::uint32:
        return raw<std::uint32_t>(at);
      case PlyType::float32:
        return double(raw<float>(at));
      default:
        return raw<double>(at);
    }
  }
  void skip(const PlyProperty& property) {
    double values = 1;
    if (property.list) values = next(property.count_type);
    if (!(values >= 0) || values > double(left()) / double(smallest(property.type))) {
      fail("a list is longer than the file");
    }
    for (double i = 0; i < values; ++i) next(property.type);
  }
  bool at_end() {
    if (text_) return scan_.next_word().empty();
    return bytes_.find_first_not_of(std::string_view("\0\r\n ", 4), at_) == bytes_.npos;
  }
  [[noreturn]] void fail(const std::string& what) const {
    source_.fail(text_ ? "line " + std::to_string(first_line_ + scan_.line())
                       : "byte " + std::to_string(source_.bytes.size() - bytes_.size() + at_),
                 what);
  }

 private:
  template <class T>
  static T raw(const char* at) {
    static_assert(std::endian::native == std::endian::little);
    T value;
    std::memcpy(&value, at, sizeof value);
    return value;
  }
  double next_word(PlyType) {
    const std::string_view word = scan_.next_word();
    if (word.empty()) fail("the file ends early: it is truncated");
    double value = 0;
    if (const char* fault = parse_number(word, value)) fail(quoted(word) + fault);
    return value;
  }

  const MeshSource& source_;
  bool text_;
  std::string_view bytes_;
  TextScan scan_;
  std::size_t first_line_, at_ = 0;
};

void read_value(Body& body, const PlyProperty& property, const Column& column) {
  const double value = body.next(property.type);
  if (column.real) {
    if (!(std::abs(value) <= 3e38)) body.fail(std::string(column.name) + " is not a finite number");
    column.real->push_back(float(value));
  } else {
    if (!(value >= 0 && value <= double(UINT32_MAX)) || value != std::floor(value)) {
      body.fail(std::string(column.name) + " is not a whole number from 0 to 4294967295");
    }
    column.whole->push_back(std::uint32_t(value));
  }
}

void read_table(const MeshSource& source, Body& body, const PlyElement& element,
                std::span<Column> columns) {
  std::uint64_t row_bytes = 0;
  std::vector<Column*> sinks;
  for (const PlyProperty& property : element.properties) {
    row_bytes += body.smallest(property.list ? property.count_type : property.type);
    Column* sink = nullptr;
    for (Column& column : columns) {
      if (column.name != property.name || property.list) continue;
      if (column.found) source.fail("'" + property.name + "' is there twice");
      column.found = true;
      sink = &column;
    }
    sinks.push_back(sink);
  }
  if (row_bytes > 0 && element.count > body.left() / row_bytes) {
    source.fail("the header announces " + std::to_string(element.count) + " rows of '" +
                printable(element.name) +
                "', the file has no room for them: it is truncated or damaged");
  }
  for (const Column& column : columns) {
    if (column.needed && !column.found) {
      source.fail("its element '" + printable(element.name) + "' has no '" +
                  std::string(column.name) + "'" +
                  (column.name[0] == 'n'
                       ? ": a shell needs the inward normal nx ny nz of each point"
                       : ""));
    }
    if (!column.found) continue;
    if (column.real) column.real->reserve(element.count);
    if (column.whole) column.whole->reserve(element.count);
  }
  if (row_bytes == 0) return;  // empty rows need no memory
  for (std::uint64_t row = 0; row < element.count; ++row) {
    for (std::size_t i = 0; i < sinks.size(); ++i) {
      if (sinks[i])
        read_value(body, element.properties[i], *sinks[i]);
      else
        body.skip(element.properties[i]);
    }
  }
}

// The comments of the header hold data that elements cannot.
struct Remarks {
  std::string input_hash;
  std::optional<std::vector<std::uint32_t>> level_first;
};

Remarks read_remarks(const MeshSource& source, const PlyHeader& header) {
  Remarks remarks;
  TextScan scan(source.bytes.substr(0, header.body));
  while (scan.next_line()) {
    const std::string_view statement = scan.word();
    if (statement != "comment" && statement != "obj_info") continue;
    const std::string_view key = scan.word();
    const auto fail = [&](const std::string& what) {
      source.fail("line " + std::to_string(scan.line()), what);
    };
    if (key == "hapsix" && scan.word() == "shell") {
      const std::string_view version = scan.word();
      if (version != "1") fail("shell format " + quoted(version) + " is not known, 1 is");
    } else if (key == "input_hash") {
      remarks.input_hash = std::string(scan.word());
      if (remarks.input_hash.size() > 256) fail("the input hash is too long");
      for (const char c : remarks.input_hash) {
        if (c <= ' ' || c > '~') fail("the input hash is no text");
      }
    } else if (key == "level_first") {
      if (remarks.level_first) fail("the levels are given twice");
      std::vector<std::uint32_t> rows;
      for (std::string_view word = scan.word(); !word.empty(); word = scan.word()) {
        std::int64_t row = 0;
        if (const char* fault = parse_number(word, row)) fail(quoted(word) + fault);
        if (row < 0 || row > std::int64_t{UINT32_MAX} || rows.size() > 32) {
          fail("this is no table of 1 to 32 levels");
        }
        rows.push_back(std::uint32_t(row));
      }
      remarks.level_first = std::move(rows);
    }
  }
  return remarks;
}

struct VertexExtras {  // columns of `vertex` that repeat `node`
  std::vector<float> radius;
  std::vector<std::uint32_t> level, first_child, child_count;
};

// If repeated values differ, one of the two is damaged.
void check_extras(const MeshSource& source, const ShellData& shell, const VertexExtras& extras) {
  const std::vector<std::uint32_t> own = first_rows(shell);
  std::uint32_t level = 0;
  for (std::size_t i = 0; i < shell.size(); ++i) {
    while (i >= shell.level_points[level]) ++level;
    const bool same =
        (extras.level.empty() || extras.level[i] == level) &&
        (extras.radius.empty() || extras.radius[i] == shell.node_radius[own[i]]) &&
        (extras.first_child.empty() || extras.first_child[i] == shell.node_first_child[own[i]]) &&
        (extras.child_count.empty() || extras.child_count[i] == shell.node_child_count[own[i]]);
    if (!same) {
      source.fail("vertex " + std::to_string(i) +
                  " and its node say different things: the file is "
                  "damaged, bake the shell again");
    }
  }
}

// MeshSource::fail ends the sentence itself.
[[noreturn]] void pass_on(const MeshSource& source, std::string sentence) {
  if (sentence.ends_with('.')) sentence.pop_back();
  source.fail(sentence);
}

ShellData with_tree(const MeshSource& source, ShellData shell, const Remarks& remarks,
                    const VertexExtras& extras) {
  if (!remarks.level_first) {
    source.fail(
        "it has nodes but no comment 'level_first' with the rows of their levels; bake the "
        "shell again, or remove the element 'node'");
  }
  shell.level_first = *remarks.level_first;
  for (std::size_t k = 0; k + 1 < shell.level_first.size(); ++k) {
    shell.level_points.push_back(shell.level_first[k + 1] - shell.level_first[k]);
  }
  if (Outcome fine = check_shell(shell); !fine) pass_on(source, fine.error());
  check_extras(source, shell, extras);
  return shell;
}

ShellData without_tree(const MeshSource& source, ShellData read) {
  PointCloud cloud;
  cloud.x = std::move(read.x), cloud.y = std::move(read.y), cloud.z = std::move(read.z);
  cloud.nx = std::move(read.nx), cloud.ny = std::move(read.ny), cloud.nz = std::move(read.nz);
  cloud.source = std::move(read.source);
  for (std::size_t i = 0; i < cloud.x.size(); ++i) {  // other programs round normals
    const double x = cloud.nx[i], y = cloud.ny[i], z = cloud.nz[i];
    const double length = std::sqrt(x * x + y * y + z * z);
    if (!(length > 0.5 && length < 2)) continue;  // build_shell will report it
    cloud.nx[i] = float(x / length);
    cloud.ny[i] = float(y / length);
    cloud.nz[i] = float(z / length);
  }
  Result<ShellData> shell = build_shell(cloud, default_levels);
  if (!shell) pass_on(source, shell.error());
  shell->input_hash = std::move(read.input_hash);
  return std::move(*shell);
}

ShellData read_all(const MeshSource& source) {
  const PlyHeader header = read_ply_header(source);
  if (header.form == PlyHeader::Form::big_endian) {
    source.fail("big-endian PLY is not read as a shell; save it as binary little-endian or ascii");
  }
  const Remarks remarks = read_remarks(source, header);
  ShellData shell;
  shell.input_hash = remarks.input_hash;
  VertexExtras extras;
  std::vector<Column> vertex = {{"x", &shell.x},
                                {"y", &shell.y},
                                {"z", &shell.z},
                                {"nx", &shell.nx},
                                {"ny", &shell.ny},
                                {"nz", &shell.nz},
                                {"triangle", nullptr, &shell.source, false}};
  Column node[] = {{"point", nullptr, &shell.node_point},
                   {"radius", &shell.node_radius},
                   {"first_child", nullptr, &shell.node_first_child},
                   {"child_count", nullptr, &shell.node_child_count}};
  bool has_vertices = false, has_nodes = false;
  for (const PlyElement& element : header.elements) {
    bool& seen = element.name == "vertex" ? has_vertices : has_nodes;
    if ((element.name == "vertex" || element.name == "node") && std::exchange(seen, true)) {
      source.fail("there are two elements '" + element.name + "'");
    }
    if (element.name == "node" && element.count > 32 * max_shell_points) {
      source.fail("it has more nodes than a shell can have");
    }
    if (element.name == "vertex" && element.count > max_shell_points) {
      source.fail("it has " + std::to_string(element.count) +
                  " points, more than the 20 million a shell can have");
    }
  }
  if (!has_vertices) source.fail("it has no element 'vertex': there are no points in it");
  if (has_nodes) {  // without nodes these properties are another program's
    vertex.push_back({"radius", &extras.radius, nullptr, false});
    vertex.push_back({"level", nullptr, &extras.level, false});
    vertex.push_back({"first_child", nullptr, &extras.first_child, false});
    vertex.push_back({"child_count", nullptr, &extras.child_count, false});
  }
  Body body(source, header);
  for (const PlyElement& element : header.elements) {
    if (element.name == "vertex")
      read_table(source, body, element, vertex);
    else if (element.name == "node")
      read_table(source, body, element, node);
    else
      read_table(source, body, element, {});
  }
  if (!body.at_end()) body.fail("the file goes on behind its last element: it is damaged");
  return has_nodes ? with_tree(source, std::move(shell), remarks, extras)
                   : without_tree(source, std::move(shell));
}

}  // namespace

Result<ShellData> parse_shell(std::string_view bytes, const std::string& name) {
  try {
    return read_all(MeshSource{bytes, name, 1.0});
  } catch (const BadMesh& bad) {
    return Failure{bad.sentence};
  } catch (const std::bad_alloc&) {
    return Failure{name + ": not enough memory to read this shell."};
  }
}

Result<ShellData> read_shell(const std::filesystem::path& file) {
  const std::string name = file.string();
  std::error_code error;
  if (!std::filesystem::exists(file, error)) {
    return Failure{name + ": there is no such file."};
  }
  if (!std::filesystem::is_regular_file(file, error)) {
    return Failure{name + ": this is not a file; give the .ply of a shell."};
  }
  try {
    std::ifstream in(file, std::ios::binary);
    const std::uintmax_t size = std::filesystem::file_size(file, error);
    std::string bytes(error ? 0 : std::size_t(size), '\0');
    if (!in || error || !in.read(bytes.data(), std::streamsize(bytes.size()))) {
      return Failure{name + ": cannot be read; check that you may open it."};
    }
    return parse_shell(bytes, name);
  } catch (const std::exception&) {
    return Failure{name + ": not enough memory to read this file."};
  }
}

}  // namespace h6::io
