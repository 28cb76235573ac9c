// SPDX-License-Identifier: Apache-2.0
// Shell files come back to the bit, other programs can read them, and no file does harm.
#include <doctest/doctest.h>

#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>
#include <string>
#include <string_view>

#include "io/shell/bake_shell.h"
#include "io/shell/shell_file.h"
#include "tests/io/shell/shell_test_meshes.h"

using namespace shells;
namespace fs = std::filesystem;
using h6::io::parse_shell;
using h6::io::read_shell;
using h6::io::write_shell;

namespace {

struct Folder {  // removed when the test ends
  fs::path path = fs::temp_directory_path() / ("hapsix-shell-test-" + std::to_string(getpid()));
  Folder() { fs::create_directories(path); }
  ~Folder() { fs::remove_all(path); }
};

ShellData small_shell(std::size_t points = 40, int levels = 3) {
  h6::io::ShellBake options;
  options.points = points;
  options.levels = levels;
  auto shell = h6::io::bake_shell(torus(0.03, 0.01, 24, 12), options, nullptr);
  REQUIRE(shell);
  return *shell;
}

std::string bytes_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::stringstream all;
  all << in.rdbuf();
  return all.str();
}

std::string written(const ShellData& shell) {
  const Folder folder;
  const fs::path file = folder.path / "shell.ply";
  const auto done = write_shell(file, shell);
  REQUIRE_MESSAGE(done, done.error());
  CHECK(std::distance(fs::directory_iterator(folder.path), {}) == 1);  // nothing left beside it
  return bytes_of(file);
}

void refused(const std::string& bytes) {
  const auto shell = parse_shell(bytes, "bad.ply");
  CHECK_FALSE(shell);
  CHECK(shell.error().find("bad.ply") == 0);
  CHECK(shell.error().back() == '.');
}

std::string replaced(std::string text, const std::string& what, const std::string& with) {
  const std::size_t at = text.find(what);
  REQUIRE(at != text.npos);
  return text.replace(at, what.size(), with);
}

std::size_t body_of(const std::string& bytes) { return bytes.find("end_header\n") + 11; }

template <class T>
std::string poked(std::string bytes, std::size_t at, T value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
  return bytes;
}

constexpr std::size_t vertex_bytes = 7 * 4 + 1 + 2 * 4 + 4, node_bytes = 16;

const char* cloud_text =
    "ply\nformat ascii 1.0\ncomment by another program\nelement vertex 4\n"
    "property double x\nproperty double y\nproperty double z\n"
    "property float nx\nproperty float ny\nproperty float nz\nproperty uchar red\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0 0 0 1 255\n1 0 0 0 0 0.999 255\n0 1 0 0 0.6 0.8 255\n1 1 0.5 0 0 -1 255\n3 0 1 2\n";

}  // namespace

TEST_CASE("a shell comes back to the bit, with and without source triangles") {
  for (const std::size_t points : {1, 2, 40, 3000}) {
    ShellData shell = small_shell(points, 7);
    for (int turn = 0; turn < 2; ++turn) {
      const auto back = parse_shell(written(shell), "shell.ply");
      REQUIRE_MESSAGE(back, back.error());
      CHECK(same_bits(shell, *back));
      shell.source.clear();
      shell.input_hash.clear();
      shell.x[0] = -0.0f;  // a sign that == does not see
      const bool fits = h6::io::check_shell(shell).operator bool();
      if (!fits) break;
      const auto again = parse_shell(written(shell), "shell.ply");
      REQUIRE(again);
      CHECK(std::signbit(again->x[0]));
    }
  }
}

TEST_CASE("other programs see plain vertices with normals") {
  const ShellData shell = small_shell();
  const std::string bytes = written(shell);
  CHECK(bytes.find("ply\nformat binary_little_endian 1.0\n") == 0);
  CHECK(bytes.find("comment units metres\n") < body_of(bytes));
  CHECK(
      bytes.find("element vertex 40\nproperty float x\nproperty float y\nproperty float z\n"
                 "property float nx\nproperty float ny\nproperty float nz\nproperty float radius\n"
                 "property uchar level\nproperty uint first_child\nproperty uint child_count\n"
                 "property uint triangle\n") < body_of(bytes));
  CHECK(bytes.size() == body_of(bytes) + 40 * vertex_bytes + shell.node_point.size() * node_bytes);
  float first[3];
  std::memcpy(first, bytes.data() + body_of(bytes), sizeof first);
  CHECK(first[0] == shell.x[0]);
  CHECK(first[2] == shell.z[0]);
}

TEST_CASE("a cloud of another program gets a tree") {
  const auto shell = parse_shell(cloud_text, "cloud.ply");
  REQUIRE_MESSAGE(shell, shell.error());
  CHECK(shell->size() == 4);
  CHECK(shell->source.empty());
  CHECK(std::string(broken_promise(*shell)) == "");
  for (std::size_t i = 0; i < 4; ++i) {
    CHECK(std::abs(dot(normal(*shell, i), normal(*shell, i)) - 1) < 1e-6);
  }
}

TEST_CASE("a cloud without usable normals is refused, naming them") {
  std::string bare = replaced(cloud_text, "property float nx", "property float a");
  const auto shell = parse_shell(bare, "bare.ply");
  CHECK_FALSE(shell);
  CHECK(shell.error().find("normal") != std::string::npos);
  for (const char* bad :
       {"0 0 0 0 0 0 255", "0 0 0 nan 0 1 255", "0 0 0 0 0 7 255", "nan 0 0 0 0 1 255",
        "2e6 0 0 0 0 1 255", "1e300 0 0 0 0 1 255", "0 0 0 0 0", "0 0 0 0 0 one 255"}) {
    CAPTURE(bad);
    CHECK_FALSE(parse_shell(replaced(cloud_text, "0 0 0 0 0 1 255", bad), "bad.ply"));
  }
}

TEST_CASE("a shell that is cut anywhere is refused") {
  const std::string bytes = written(small_shell());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    CHECK_FALSE(parse_shell(std::string_view(bytes).substr(0, size), "cut.ply"));
  }
  const std::string text = cloud_text;
  for (std::size_t size = 0; size + 1 < text.size(); ++size) {
    CHECK_FALSE(parse_shell(std::string_view(text).substr(0, size), "cut.ply"));
  }
  refused(bytes + "more");
}

TEST_CASE("counts and tables that lie are refused before memory is spent on them") {
  const std::string bytes = written(small_shell());
  const std::string nodes = std::to_string(small_shell().node_point.size());
  for (const char* lie : {"0", "1", "39", "41", "20000000", "20000001", "4294967296",
                          "9223372036854775807", "99999999999999999999", "-1", "x", ""}) {
    CAPTURE(lie);
    refused(replaced(bytes, "element vertex 40", std::string("element vertex ") + lie));
    refused(replaced(bytes, "element node " + nodes, std::string("element node ") + lie));
  }
  for (const char* lie : {"", "0", "0 40", "0 1 2 3 4 5", "0 4294967295 3", "0 5000000000", "1 2 3",
                          "0 0 0 0", "0 -4", "0 a"}) {
    CAPTURE(lie);
    const std::size_t at = bytes.find("comment level_first") + 19, end = bytes.find('\n', at);
    refused(bytes.substr(0, at) + " " + lie + bytes.substr(end));
  }
  refused(replaced(bytes, "comment level_first", "comment other_words"));
  refused(replaced(bytes, "hapsix shell 1", "hapsix shell 2"));
  refused(replaced(bytes, "binary_little_endian", "binary_big_endian"));
  refused(replaced(bytes, "property float nx", "property float ny"));
  refused(replaced(bytes, "property uint point", "property uint joint"));
  refused(replaced(bytes, "element vertex 40", "element vortex 40"));
  refused("ply\nformat ascii 1.0\nelement vertex 9000000000000000000\nend_header\n");
  refused(
      "ply\nformat ascii 1.0\nelement nothing 9000000000000000000\nelement vertex 0\nend_header\n");
  refused("");
}

TEST_CASE("nodes that are no tree are refused: circles, gaps, strangers, small spheres, NaN") {
  const ShellData shell = small_shell();
  const std::string bytes = written(shell);
  const std::size_t vertex = body_of(bytes), node = vertex + 40 * vertex_bytes;
  const auto nodes = std::uint32_t(shell.node_point.size());
  for (const std::uint32_t wild : {0u, 1u, nodes - 1, nodes, 0x7FFFFFFFu, 0xFFFFFFFFu}) {
    CAPTURE(wild);
    for (const std::uint32_t row :
         {0u, 1u, shell.level_first[1], shell.level_first[2], nodes - 1}) {
      const std::size_t at = node + row * node_bytes;
      if (wild != shell.node_point[row]) refused(poked(bytes, at, wild));
      if (wild != shell.node_first_child[row]) refused(poked(bytes, at + 8, wild));
      if (wild != shell.node_child_count[row]) refused(poked(bytes, at + 12, wild));
    }
  }
  for (const float bad : {NAN, INFINITY, -1.0f, shell.node_radius[0] * 0.999f}) {
    refused(poked(bytes, node + 4, bad));
  }
  for (int column = 0; column < 6; ++column) {
    for (const float bad : {NAN, INFINITY, -INFINITY, 3e38f}) {
      refused(poked(bytes, vertex + 4 * column + 7 * vertex_bytes, bad));
    }
  }
  refused(poked(bytes, vertex + 24, 1e-9f));  // what a vertex repeats of its node
  refused(poked(bytes, vertex + 28, char(5)));
  refused(poked(bytes, vertex + 29, std::uint32_t(9)));
  refused(poked(bytes, vertex + 33, std::uint32_t(77)));
}

TEST_CASE("two thousand damaged files: none does harm, what is accepted is whole") {
  const std::string good[] = {written(small_shell()), cloud_text};
  std::mt19937_64 random(2016);
  int accepted = 0;
  for (int i = 0; i < 2000; ++i) {
    std::string bytes = good[i % 2];
    for (std::uint64_t flips = 1 + random() % 4; flips > 0; --flips) {
      // Half of the damage is in the header, where it matters most.
      const std::size_t range = random() % 2 ? bytes.size() : body_of(bytes);
      bytes[random() % range] ^= char(1u << random() % 8);
    }
    const auto shell = parse_shell(bytes, "fuzz.ply");
    if (!shell) {
      CHECK_FALSE(shell.error().empty());
      continue;
    }
    ++accepted;
    CHECK(std::string(broken_promise(*shell)) == "");
    CHECK(h6::io::check_shell(*shell));
  }
  CHECK(accepted > 20);  // a flip in a comment or in a colour does not matter
  CHECK(accepted < 1900);
}

TEST_CASE("a shell that is not whole is not written") {
  const Folder folder;
  const fs::path file = folder.path / "bad.ply";
  ShellData shell = small_shell();
  shell.node_radius[0] *= 0.5f;
  CHECK_FALSE(write_shell(file, shell));
  shell = small_shell();
  shell.input_hash = "two\nlines";
  CHECK_FALSE(write_shell(file, shell));
  CHECK_FALSE(write_shell(file, ShellData{}));
  CHECK(fs::is_empty(folder.path));
  CHECK_FALSE(write_shell(folder.path / "no" / "such" / "folder.ply", small_shell()));
}

TEST_CASE("files that are not there or not files are refused") {
  const Folder folder;
  CHECK_FALSE(read_shell(folder.path / "nothing.ply"));
  CHECK_FALSE(read_shell(folder.path));
  CHECK_FALSE(read_shell("/dev/zero"));
  std::ofstream(folder.path / "empty.ply").flush();
  CHECK_FALSE(read_shell(folder.path / "empty.ply"));
}
