// SPDX-License-Identifier: Apache-2.0
// mesh_file_test.cpp - good mesh files are read whole; bad ones are refused with a sentence.
#include <doctest/doctest.h>
#include <sys/stat.h>
#include <unistd.h>
#include "tests/support/near.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "io/file/gunzip.h"
#include "io/mesh/mesh_file.h"
#include "tests/io/mesh/mesh_samples.h"

namespace fs = std::filesystem;
using namespace h6::io;
using samples::File;

namespace {

struct Folder {
  fs::path path = fs::temp_directory_path() / ("hapsix_mesh_" + std::to_string(getpid()));
  Folder() { fs::create_directories(path); }
  ~Folder() { fs::remove_all(path); }
  fs::path put(const std::string& name, const std::string& bytes) const {
    std::ofstream(path / name, std::ios::binary) << bytes;
    return path / name;
  }
};

// Checks for one sentence about `file` that contains all of the words.
void refuses(const File& file, std::initializer_list<const char*> words) {
  CAPTURE(file.name);
  const auto mesh = parse_mesh(file.bytes, file.name);
  REQUIRE_FALSE(mesh);
  CAPTURE(mesh.error());
  CHECK(mesh.error().starts_with(file.name));
  CHECK(mesh.error().ends_with("."));
  CHECK(mesh.error().find('\n') == std::string::npos);
  CHECK(mesh.error().size() < 300);
  for (const char* word : words) CHECK(mesh.error().find(word) != std::string::npos);
}

std::string with(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

void poke(std::string& bytes, std::size_t at, float value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

double area(const Mesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    const double ux = b.x - a.x, uy = b.y - a.y, uz = b.z - a.z;
    const double vx = c.x - a.x, vy = c.y - a.y, vz = c.z - a.z;
    sum += 0.5 * std::hypot(uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx);
  }
  return sum;
}

}  // namespace

TEST_CASE("every format, packed or not, gives the same mesh bit for bit") {
  samples::Mesh drawn = samples::box();
  samples::append(drawn, samples::box({3, -2, -0.125}, {4, 0, 8}));
  const Mesh expected = weld(drawn);
  for (const File& file : samples::every_format(drawn)) {
    CAPTURE(file.name);
    const auto mesh = parse_mesh(file.bytes, file.name);
    REQUIRE_MESSAGE(mesh, mesh.error());
    CHECK(samples::same_bits(*mesh, expected));
  }
}

TEST_CASE("an OBJ may end with the zeros of a string, but have none inside") {
  const std::string text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  const auto plain = parse_mesh(text, "a.obj");
  REQUIRE(plain);
  for (const std::string& end : {std::string(1, '\0'), std::string(3, '\0'), std::string("\0\n", 2),
                                 std::string("\0\r\n", 3)}) {
    const auto ended = parse_mesh(text + end, "a.obj");
    REQUIRE_MESSAGE(ended, ended.error());
    CHECK(samples::same_bits(*ended, *plain));
  }
  CHECK_FALSE(parse_mesh(text.substr(0, 8) + std::string(1, '\0') + text.substr(8), "a.obj"));
}

TEST_CASE("equal corners are one vertex, in order of appearance, and minus zero is zero") {
  const auto mesh = parse_mesh(
      "v 9 9 9\nv 1 0 0\nv 0 0 0\nv 0 1 0\nv -0 0 -0\nv 0 -1 -0\nf 2 4 3\nf 5 6 2\n", "a.obj");
  REQUIRE(mesh);
  CHECK(mesh->vertices.size() == 4);  // 9 9 9 belongs to no triangle
  CHECK(mesh->vertices[0].x == 1);
  CHECK(mesh->triangles[0] == std::array<std::uint32_t, 3>{0, 1, 2});
  CHECK(mesh->triangles[1] == std::array<std::uint32_t, 3>{2, 3, 0});
  for (const Vec3& p : mesh->vertices)
    for (const double x : {p.x, p.y, p.z}) CHECK((x != 0 || !std::signbit(x)));
}

TEST_CASE("a written STL reads back with the same vertices, in every unit") {
  const Folder folder;
  for (const Unit unit : {Unit::m, Unit::mm, Unit::cm, Unit::in}) {
    // Coordinates that are floats in this unit come back as the same doubles.
    samples::Mesh drawn;
    for (int i = 0; i < 12; ++i)
      drawn.vertices.push_back({static_cast<float>(std::sin(i) * 37.3) * metres(unit),
                                static_cast<float>(std::cos(3.0 * i) * 1e-3) * metres(unit),
                                static_cast<float>(i / 7.0) * metres(unit)});
    drawn.triangles = {{0, 1, 2}, {3, 4, 5}, {6, 7, 8}, {9, 10, 11}};
    const fs::path file = folder.path / "round.stl";
    REQUIRE(write_stl(file, drawn, unit));
    const auto back = read_mesh(file, unit);
    REQUIRE_MESSAGE(back, back.error());
    CHECK(samples::same_bits(*back, drawn));
  }
  CHECK(std::distance(fs::directory_iterator(folder.path), {}) == 1);  // nothing left beside it
}

TEST_CASE("write_stl refuses what no reader could take") {
  const Folder folder;
  samples::Mesh drawn = samples::box();
  CHECK_FALSE(write_stl(folder.path / "none" / "a.stl", drawn));
  CHECK_FALSE(write_stl(folder.path / "a.stl", samples::Mesh{}));
  drawn.vertices[3].y = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(write_stl(folder.path / "a.stl", drawn));
  drawn = samples::box();
  drawn.triangles[5][1] = 8;
  CHECK_FALSE(write_stl(folder.path / "a.stl", drawn));
  CHECK(fs::is_empty(folder.path));
}

TEST_CASE("units have names, and millimetres are a thousandth") {
  for (const auto& [name, length] :
       {std::pair{"m", 1.0}, {"mm", 1e-3}, {"cm", 1e-2}, {"in", 0.0254}}) {
    const auto unit = unit_from_name(name);
    REQUIRE(unit);
    CHECK(metres(*unit) == length);
    const auto mesh = parse_mesh(samples::obj(samples::box()), "a.obj", *unit);
    REQUIRE(mesh);
    CHECK(mesh->vertices[0].x == -1 * length);
  }
  CHECK_FALSE(unit_from_name("furlong"));
  CHECK_FALSE(unit_from_name(""));
}

TEST_CASE("a part of thirty metres is asked whether it is one of thirty millimetres") {
  const std::string part = "v 0 0 0\nv 30 0 0\nv 0 1 0\nf 1 2 3\n";
  const auto asked = parse_mesh(part, "part.obj");
  REQUIRE(asked);
  REQUIRE(asked->remarks.size() == 1);
  CHECK(asked->remarks[0].find("30 m across") != std::string::npos);
  CHECK(asked->remarks[0].find("--units mm") != std::string::npos);
  for (const Unit said : {Unit::mm, Unit::cm, Unit::in}) {
    const auto told = parse_mesh(part, "part.obj", said);
    REQUIRE(told);
    CHECK(told->remarks.empty());
  }
  CHECK(parse_mesh(with(part, "30", "19"), "part.obj")->remarks.empty());
}

TEST_CASE("OBJ: groups are parts, indices may count backwards, lines may go on, CR LF is fine") {
  const auto mesh = parse_mesh(
      "\xef\xbb\xbf# made by hand\r\no left\r\nv 0 0 0\r\nv +1 0 0 0.5 0.5 0.5\r\nv 0 1. 0\r\n"
      "f -3/1/1 -2/2/1 \\\r\n -1/3/1\r\ng empty\r\no right\r\ng \xff\x01 top\r\nv 0 0 1e0\r\n"
      "f 1 2 4\r\no left\r\nf 2 3 4 # comment\r\nl 1 2\r\n",
      "a.obj");
  REQUIRE_MESSAGE(mesh, mesh.error());
  CHECK(mesh->part_names == std::vector<std::string>{"left", "right/?? top"});
  CHECK(mesh->part == std::vector<std::int32_t>{0, 1, 0});
  CHECK(mesh->vertices.size() == 4);
}

TEST_CASE("text STL: each solid is a part, words may stand on any line, normals may be nonsense") {
  const auto mesh = parse_mesh(
      "solid one\nFACET normal nan -nan(ind) 1.#QNAN outer loop vertex 0 0 0 vertex 1 0 0\n"
      "vertex 0 1 0 endloop endfacet\nendsolid one\n\nsolid\nfacet normal 0 0 1\nouter loop\n"
      "vertex 0 0 1\nvertex 1 0 1\nvertex 0 1 1\nendloop\nendfacet\nendsolid",
      "a.stl");
  REQUIRE_MESSAGE(mesh, mesh.error());
  CHECK(mesh->part == std::vector<std::int32_t>{0, 1});
  CHECK(mesh->part_names == std::vector<std::string>{"one", ""});
}

TEST_CASE("polygons are cut into triangles that cover them once, whichever way they lie") {
  // An L, a comb and a dart: none is convex. The area shows both gaps and overlaps.
  struct Shape {
    std::vector<std::array<double, 2>> outline;
    double area;
  };
  const std::vector<Shape> shapes = {{{{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 3}, {0, 3}}, 4},
                                     {{{0, 0},
                                       {7, 0},
                                       {7, 3},
                                       {6, 3},
                                       {6, 1},
                                       {5, 1},
                                       {5, 3},
                                       {4, 3},
                                       {4, 1},
                                       {3, 1},
                                       {3, 3},
                                       {2, 3},
                                       {2, 1},
                                       {1, 1},
                                       {1, 3},
                                       {0, 3}},
                                      15},
                                     {{{0, 0}, {3, 1}, {0, 2}, {1, 1}}, 2},
                                     {{{0, 0}, {1, 0}, {2, 0}, {2, 2}, {1, 2}, {0, 2}}, 4}};
  for (const Shape& shape : shapes) {
    const std::size_t n = shape.outline.size();
    for (std::size_t start = 0; start < n; ++start) {
      for (int axes = 0; axes < 6; ++axes) {  // lying in xy, yz, zx, from the front and behind
        std::string text, face = "f";
        for (std::size_t i = 0; i < n; ++i) {
          const auto& at = shape.outline[(start + i) % n];
          double p[3] = {1000, 1000, 1000};
          p[axes % 3] += axes < 3 ? at[0] : at[1];
          p[(axes + 1) % 3] += axes < 3 ? at[1] : at[0];
          text += "v " + samples::text({p[0], p[1], p[2]}) + "\n";
          face += " " + std::to_string(i + 1);
        }
        const auto mesh = parse_mesh(text + face, "a.obj");
        REQUIRE_MESSAGE(mesh, mesh.error());
        CHECK(mesh->triangles.size() == n - 2);
        CHECK(area(*mesh) == h6::test::near(shape.area));
      }
    }
  }
}

TEST_CASE("a concave face of thousands of corners is cut, one of very many is refused soon") {
  for (const int teeth : {2000, 30000}) {  // a saw: every other corner is concave
    std::string text = "v 0 -9 0\nv " + std::to_string(2 * teeth) + " -9 0\n", face = "f 1 2";
    for (int i = 0; i < 2 * teeth; ++i) {
      text += "v " + std::to_string(2 * teeth - i) + " " + std::to_string(i % 2) + " 0\n";
      face += " " + std::to_string(i + 3);
    }
    const auto mesh = parse_mesh(text + face, "saw.obj");
    CHECK(bool(mesh) == (teeth == 2000));
    // Teeth of height 1 over a block of height 9; the last corner stands one before the edge.
    if (mesh)
      CHECK(area(*mesh) == h6::test::near(2 * teeth * 9.5).epsilon(1e-3));
    else
      CHECK(mesh.error().find("face 1: ") != std::string::npos);
  }
}

TEST_CASE("wrong files get one sentence that names file and place") {
  const Folder folder;
  const auto sentence = [&](const fs::path& file) {
    const auto mesh = read_mesh(file);
    REQUIRE_FALSE(mesh);
    CHECK(mesh.error().find(file.string()) == 0);
    return mesh.error();
  };
  const auto says = [&](const fs::path& file, const char* words) {
    CAPTURE(file);
    const std::string error = sentence(file);
    CAPTURE(error);
    CHECK(error.find(words) != std::string::npos);
  };
  says(folder.path / "none.stl", "no such file");
  says(folder.path / "none" / "none.stl", "no such file");
  fs::create_directory(folder.path / "folder.stl");
  says(folder.path / "folder.stl", "folder");
  says(folder.put("empty.stl", ""), "empty");
  says(folder.put("empty.obj", ""), "empty");
  says(folder.put("empty.ply.gz", samples::gz("")), "empty");
  says(folder.put("part.step", "ISO-10303-21;"), "'.step'");
  says(folder.put("part", "solid"), "no ending");
  mkfifo((folder.path / "pipe.stl").c_str(), 0600);
  says(folder.path / "pipe.stl", "not a regular file");
  if (geteuid() != 0) {
    const fs::path secret = folder.put("secret.stl", samples::stl_text(samples::box()));
    fs::permissions(secret, fs::perms::none);
    says(secret, "ermission");
  }
  // A sparse file of 200 GB is refused by its header or its size, without being read.
  const fs::path sparse = folder.put("sparse.stl", std::string(80, 'x') + "\xff\xff\xff\xff");
  fs::resize_file(sparse, 200'000'000'000);
  says(sparse, "4294967295");
  fs::resize_file(sparse, 84 + 50 * std::uintmax_t{4294967295});
  says(sparse, "more than can be read");
}

TEST_CASE("wrong STL gets a sentence with byte, line or triangle") {
  const std::string good = samples::stl_binary(samples::box());
  refuses({"notes.stl", "Dear all,\nthe mesh is in the other mail.\n"}, {"text", "solid"});
  refuses({"cut.stl", good.substr(0, 60)}, {"byte 60", "truncated"});
  refuses({"cut.stl", good.substr(0, 84 + 7 * 50 + 20)},
          {"byte 454", "12 triangles", "7 are there"});
  refuses({"more.stl", good + std::string(50, 'x')}, {"byte 684", "12 triangles", "13"});
  CHECK(parse_mesh(good + std::string(49, '\0'), "padded.stl"));  // less than a triangle: padding
  std::string bytes = good;
  std::memcpy(bytes.data() + 80, "\xff\xff\xff\xff", 4);
  refuses({"huge.stl", bytes}, {"4294967295", "12 are there"});
  std::memset(bytes.data() + 80, 0, 4);
  bytes.resize(84);
  refuses({"none.stl", bytes}, {"no triangle"});
  for (const float value : {NAN, INFINITY, -INFINITY}) {
    bytes = good;
    poke(bytes, 84 + 4 * 50 + 12 + 16, value);
    refuses({"nan.stl", bytes}, {"triangle 5", "byte 312", "not finite"});
  }
  bytes = good;
  poke(bytes, 84 + 11 * 50 + 12, 1.1e6f);
  refuses({"far.stl", bytes}, {"triangle 12", "1e6", "unit"});
  CHECK(parse_mesh(bytes, "far.stl", Unit::mm));

  const std::string text = samples::stl_text(samples::box());
  refuses({"a.stl", "solid\nendsolid\n"}, {"no triangle"});
  refuses({"a.stl", text.substr(0, text.find("endloop"))}, {"line 7", "triangle 1", "truncated"});
  refuses({"a.stl", with(text, "vertex -1", "vertex 1e400")}, {"line 4", "triangle 1", "1e400"});
  refuses({"a.stl", with(text, "vertex -1", "vertex nan")}, {"line 4", "triangle 1", "not finite"});
  refuses({"a.stl", with(text, "vertex -1", "vertex 1,5")}, {"line 4", "'1,5'"});
  refuses({"a.stl", with(text, "endloop", "vertex 1 2 3 endloop")}, {"line 7", "'endloop'"});
  refuses({"a.stl.gz", text}, {"gzip"});
  refuses({"a.stl", samples::gz(text)}, {".gz"});
  refuses({"a.stl", "version https://git-lfs.github.com/spec/v1\noid 0\n"}, {"git lfs pull"});
}

TEST_CASE("wrong OBJ gets a sentence with the line") {
  const std::string points = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  refuses({"a.obj", points}, {"no triangle"});
  refuses({"a.obj", points + "f 1 2 0\n"}, {"line 4", "vertex 0"});
  refuses({"a.obj", points + "f 1 2 4\n\nf 1 2 3\n"}, {"line 4", "vertex 4", "has 3"});
  refuses({"a.obj", points + "f 1 2 -4\n"}, {"line 4", "-4"});
  refuses({"a.obj", points + "f 1 2 4000000000\n"}, {"line 4", "4000000000"});
  refuses({"a.obj", points + "f 1 2 99999999999999999999\n"}, {"line 4", "too large"});
  refuses({"a.obj", points + "f 1 2 -9223372036854775808\n"}, {"line 4"});
  refuses({"a.obj", points + "f 1 2 3.5\n"}, {"line 4", "'3.5'"});
  refuses({"a.obj", points + "f 1 2\n"}, {"line 4", "2 corners"});
  refuses({"a.obj", points + "\\\n\nv 1 x 2\n"}, {"line 6", "'x'"});
  refuses({"a.obj", points + "v 1 2\n"}, {"line 4", "ends early"});
  refuses({"a.obj", points + "v 1 2 1e400\n"}, {"line 4", "1e400"});
  refuses({"a.obj", points + "v 1 2 inf\n"}, {"line 4", "not finite"});
  refuses({"a.obj", points + "v 1 2 -2e6\n"}, {"line 4", "-2e+06", "1e6"});
  refuses({"a.obj", "Dear all,\n"}, {"line 1", "'Dear'"});
  refuses({"a.obj", samples::stl_binary(samples::box())}, {"not text"});
  CHECK(parse_mesh(points + "v 1 2 1e-400\nf 1 2 4", "small.obj"));
}

TEST_CASE("wrong PLY gets a sentence with byte, line or row") {
  const auto header = [](const std::string& form, const std::string& vertices,
                         const std::string& faces, const std::string& length = "uchar") {
    return "ply\nformat " + form + " 1.0\nelement vertex " + vertices +
           "\nproperty float x\nproperty float y\nproperty float z\nelement face " + faces +
           "\nproperty list " + length + " int vertex_indices\nend_header\n";
  };
  const std::string points = "0 0 0\n1 0 0\n0 1 0\n", ascii = header("ascii", "3", "1") + points;
  CHECK(parse_mesh(ascii + "3 0 1 2\n", "a.ply"));
  refuses({"a.ply", "solid\n"}, {"'ply'"});
  refuses({"a.ply", "ply\nformat ascii 1.0\nelement vertex 3\n"}, {"end_header", "truncated"});
  refuses({"a.ply", ascii + "3 0 1\n"}, {"line 13", "face 1", "truncated"});
  refuses({"a.ply", ascii + "3 0 1 3\n"}, {"face 1", "vertex 3", "has 3"});
  refuses({"a.ply", ascii + "3 0 1 -1\n"}, {"face 1", "-1"});
  refuses({"a.ply", ascii + "3 0 1 two\n"}, {"line 13", "'two'"});
  refuses({"a.ply", ascii + "2 0 1\n"}, {"face 1", "2 corners"});
  refuses({"a.ply", ascii + "200 0 1 2\n"}, {"face 1", "200"});
  refuses({"a.ply", ascii + "-1 0 1 2\n"}, {"face 1", "-1"});
  refuses({"a.ply", ascii + "3 0 1 2\n3 0 2 1\n"}, {"goes on"});
  refuses({"a.ply", with(ascii, "1 0 0", "1 nan 0") + "3 0 1 2\n"}, {"line 11", "vertex 2"});
  refuses({"a.ply", with(ascii, "float y", "float why") + "3 0 1 2\n"}, {"'y'"});
  refuses({"a.ply", with(ascii, "float y", "real y") + "3 0 1 2\n"}, {"line 5", "'real'"});
  refuses({"a.ply", with(ascii, "vertex_indices", "colours") + "3 0 1 2\n"}, {"vertex_indices"});
  refuses({"a.ply", with(ascii, "ascii 1.0", "ebcdic 1.0") + "3 0 1 2\n"}, {"line 2", "'ebcdic'"});
  refuses({"a.ply", header("ascii", "3", "0") + points}, {"no faces"});
  for (const std::string form : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    refuses({"a.ply", header(form, "4000000000", "1") + points}, {"4000000000", "room"});
    refuses({"a.ply", header(form, "0", "4000000000") + points}, {"4000000000", "room"});
    refuses({"a.ply", header(form, "-3", "1") + points}, {"line 3", "-3"});
    refuses({"a.ply", header(form, "99999999999999999999", "1") + points}, {"line 3", "too large"});
    // An element without columns takes no bytes, so its count must not drive a loop.
    const std::string air = "element air 9223372036854775807\nelement";
    refuses({"a.ply", with(header(form, "0", "0"), "element", air)}, {"no faces"});
  }
  std::string list = header("binary_little_endian", "0", "1", "uint");
  samples::put(list, std::uint32_t{4000000000u});
  samples::put(list, std::uint32_t{0});
  refuses({"a.ply", list}, {"byte", "face 1", "4000000000"});
}

TEST_CASE("damaged, cut and explosive gzip is refused with the byte") {
  const std::string packed = samples::gz(samples::stl_binary(samples::box()));
  refuses({"a.stl.gz", packed.substr(0, packed.size() / 2)}, {"byte", "truncated"});
  refuses({"a.stl.gz", packed.substr(0, packed.size() - 4)}, {"byte", "truncated"});
  std::string bad = packed;
  bad[packed.size() - 6] ^= 1;  // the checksum
  refuses({"a.stl.gz", bad}, {"byte", "damaged"});
  bad = packed;
  bad[10] = '\x07';  // a block type that does not exist
  refuses({"a.stl.gz", bad}, {"byte", "damaged"});
  refuses({"bomb.obj.gz", samples::gz(std::string(100'000'000, '\n'))}, {"times its size"});
  CHECK_FALSE(gunzip(samples::gz(std::string(5000, 'x')), "a", 4999));
  CHECK(gunzip(samples::gz(std::string(5000, 'x')), "a", 5000)->size() == 5000);
  CHECK(*gunzip(samples::gz("one ") + samples::gz("two"), "a") == "one two");
}

TEST_CASE("real meshes survive writing and reading bit for bit, packed or not") {
  const char* folder = std::getenv("HAPSIX_TEST_DATA");
  if (!folder || !fs::exists(folder)) {
    MESSAGE("skipped: no real meshes");
    return;
  }
  const Folder scratch;
  for (const auto& [name, unit] : {std::pair{"cad/counter.unitsmm.STL", Unit::mm},
                                   {"soups/anymal_b_ref_pose.stl.gz", Unit::m}}) {
    const auto mesh = read_mesh(fs::path(folder) / name, unit);
    REQUIRE_MESSAGE(mesh, mesh.error());
    const fs::path copy = scratch.path / "copy.stl";
    REQUIRE(write_stl(copy, *mesh, unit));
    const auto back = read_mesh(copy, unit);
    REQUIRE_MESSAGE(back, back.error());
    CHECK(samples::same_bits(*mesh, *back));
  }
}
