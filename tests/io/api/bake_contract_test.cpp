// SPDX-License-Identifier: Apache-2.0
// Meshes from files and from memory, and long work of io.h that is watched, cancelled or kept in
// the cache, through the contract.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "hapsix/hapsix.hpp"
#include "hapsix/io.h"
#include "tests/io/private_cache.h"

namespace {

namespace fs = std::filesystem;

// A box of 20 x 10 x 5 units whose low corner is the origin: 8 vertices, and 6 faces that are 12
// triangles.
constexpr double kSize[3] = {20, 10, 5};
constexpr int kQuads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                              {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
double corner(int i, int axis) { return (i >> axis & 1) != 0 ? kSize[axis] : 0; }

std::string as_obj() {
  std::string text = "# a box of quads, in two groups\n";
  for (int i = 0; i < 8; ++i) {
    text += "v";
    for (int k = 0; k < 3; ++k) text += " " + std::to_string(corner(i, k));
    text += "\n";
  }
  for (int q = 0; q < 6; ++q) {
    if (q % 3 == 0) text += q == 0 ? "g bottom\n" : "g top\n";
    text += "f";
    for (const int i : kQuads[q]) text += " " + std::to_string(i + 1);
    text += "\n";
  }
  return text;
}

void each_triangle(const std::function<void(int, int, int)>& take) {
  for (const auto& q : kQuads) take(q[0], q[1], q[2]), take(q[0], q[2], q[3]);
}

std::string as_ascii_stl() {
  std::string text = "solid box\n";
  each_triangle([&](int a, int b, int c) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (const int i : {a, b, c}) {
      text += "vertex";
      for (int k = 0; k < 3; ++k) text += " " + std::to_string(corner(i, k));
      text += "\n";
    }
    text += "endloop\nendfacet\n";
  });
  return text + "endsolid box\n";
}

std::string as_binary_stl() {
  std::string bytes(80, ' ');
  const auto put = [&](const auto& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  put(std::uint32_t{12});
  each_triangle([&](int a, int b, int c) {
    for (int k = 0; k < 3; ++k) put(0.0f);
    for (const int i : {a, b, c})
      for (int k = 0; k < 3; ++k) put(static_cast<float>(corner(i, k)));
    put(std::uint16_t{0});
  });
  return bytes;
}

// Whether this is the box, with a unit of so many metres.
void check_box(const h6Mesh* mesh, double metres) {
  REQUIRE(mesh);
  h6MeshInfo info;
  h6GetMesh(mesh, &info);
  CHECK((info.triangles == 12 && info.vertices == 8));
  CHECK((info.closed && info.open_edges == 0 && info.odd_edges == 0 && info.components == 1));
  CHECK((info.duplicates == 0 && info.degenerate == 0));
  CHECK(info.volume == doctest::Approx(1000 * metres * metres * metres));
  CHECK((info.low.x == 0 && info.low.y == 0 && info.low.z == 0));
  CHECK(info.high.x == doctest::Approx(20 * metres));
  CHECK(info.high.y == doctest::Approx(10 * metres));
  CHECK(info.high.z == doctest::Approx(5 * metres));
}

hapsix::Mesh parse(const std::string& bytes, const char* name, h6Unit unit) {
  return hapsix::Mesh::make(
      [&](h6Error* e) { return h6ParseMesh(bytes.data(), bytes.size(), name, unit, e); });
}
hapsix::Mesh box() { return parse(as_obj(), "box.obj", H6_MILLIMETRES); }

// Watches work, and cancels it at one of its calls.
struct Watch {
  int calls = 0, allowed = 1 << 30;
  bool odd = false;  // a call of another thread, without a name, or outside of 0 .. 1
  std::vector<double> done;
  std::set<std::string> names;
  std::thread::id caller = std::this_thread::get_id();

  static bool step(void* user, const char* what, double done) {
    Watch& w = *static_cast<Watch*>(user);
    w.odd |= !what || !*what || !(done >= 0 && done <= 1) || w.caller != std::this_thread::get_id();
    if (what) w.names.insert(what);
    w.done.push_back(done);
    return ++w.calls <= w.allowed;
  }
};

h6ShellBakeDef small_shell(Watch* watch) {
  h6ShellBakeDef def = h6DefaultShellBakeDef();
  def.points = 300, def.levels = 3, def.field.voxels = 48;
  if (watch) def.field.progress = Watch::step, def.field.user = watch;
  return def;
}

std::set<std::string> kept() {
  std::set<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(h6::test::private_cache.folder))
    files.insert(entry.path().string());
  return files;
}

bool same_points(const h6Shell* a, const h6Shell* b) {
  h6ShellDef x, y;
  h6GetShell(a, &x), h6GetShell(b, &y);
  const auto same = [&](const float* p, const float* q) {
    return std::memcmp(p, q, x.point_count * sizeof *p) == 0;
  };
  return x.point_count > 0 && x.point_count == y.point_count && x.level_count == y.level_count &&
         same(x.x, y.x) && same(x.y, y.y) && same(x.z, y.z) && same(x.nx, y.nx) &&
         same(x.ny, y.ny) && same(x.nz, y.nz);
}

}  // namespace

TEST_CASE("a box of STL or OBJ has its triangles and vertices, from memory and from a file") {
  const std::vector<std::pair<std::string, std::string>> meshes{
      {"box.obj", as_obj()}, {"ascii.stl", as_ascii_stl()}, {"binary.stl", as_binary_stl()}};
  const std::pair<h6Unit, double> units[] = {
      {H6_METRES, 1}, {H6_MILLIMETRES, 1e-3}, {H6_CENTIMETRES, 1e-2}, {H6_INCHES, 0.0254}};
  for (const auto& [name, bytes] : meshes) {
    CAPTURE(name);
    const std::string file = h6::test::private_cache.folder / name;
    std::ofstream(file, std::ios::binary) << bytes;
    for (const auto& [unit, metres] : units) {
      check_box(parse(bytes, name.c_str(), unit), metres);
      const hapsix::Mesh read =
          hapsix::Mesh::make([&, u = unit](h6Error* e) { return h6ReadMesh(file.c_str(), u, e); });
      check_box(read, metres);
    }
    h6Error error{};
    CHECK(h6ParseMesh(bytes.data(), bytes.size() / 2, name.c_str(), H6_METRES, &error) == nullptr);
    CHECK(error.code == H6_ERROR_CONTENT);
  }
}

TEST_CASE("groups of an OBJ are parts with their names") {
  const hapsix::Mesh mesh = box();
  h6MeshInfo info;
  h6GetMesh(mesh, &info);
  REQUIRE(info.parts == 2);
  CHECK(std::string(h6GetPartName(mesh, 0)) == "bottom");
  CHECK(std::string(h6GetPartName(mesh, 1)) == "top");
}

TEST_CASE("the progress of a shell rises, and false at any call cancels it and leaves nothing") {
  const hapsix::Mesh mesh = box();
  for (const h6ShellFrom from : {H6_FROM_TRIANGLES, H6_FROM_FIELD}) {
    Watch all;
    h6ShellBakeDef def = small_shell(&all);
    def.surface = from, def.field.cache = true;
    const std::set<std::string> before = kept();
    for (int allowed = 0;; ++allowed) {
      Watch some;
      some.allowed = allowed, def.field.user = &some;
      h6Error error{};
      const hapsix::Shell shell(h6BakeShell(mesh, &def, &error));
      CHECK_FALSE(some.odd);
      if (shell.get()) {
        all = some;
        break;
      }
      CHECK(error.code == H6_ERROR_CANCELLED);
      CHECK(some.calls == allowed + 1);  // it is not asked again
      CHECK(kept() == before);
    }
    CHECK(all.calls >= 3);
    CHECK(all.calls == all.allowed);
    CHECK(std::is_sorted(all.done.begin(), all.done.end()));
    CHECK(kept().size() == before.size() + 1);
  }
}

TEST_CASE("a check tells its progress, and false at any call cancels it with an empty report") {
  const hapsix::Mesh mesh = box();
  const h6ShellBakeDef bake = small_shell(nullptr);
  const hapsix::Field field =
      hapsix::Field::make([&](h6Error* e) { return h6BakeField(mesh, &bake.field, e); });
  Watch all;
  h6CheckDef def = h6DefaultCheckDef();
  def.points = 200, def.progress = Watch::step, def.user = &all;
  h6CheckReport report;
  h6Error error{};
  REQUIRE_MESSAGE(h6CheckField(mesh, field, &def, &report, &error), error.message);
  CHECK((report.agrees && report.pushed > 0));
  CHECK_FALSE(all.odd);
  CHECK(all.names.count("pushing at walls") == 1);
  const std::set<std::string> before = kept();
  std::set<int> moments{all.calls - 1};
  for (int i = 0; i < all.calls; i += 1 + all.calls / 20) moments.insert(i);
  for (const int allowed : moments) {
    Watch some;
    some.allowed = allowed, def.user = &some;
    std::memset(&report, 1, sizeof report);
    error = {};
    CHECK_FALSE(h6CheckField(mesh, field, &def, &report, &error));
    CHECK(error.code == H6_ERROR_CANCELLED);
    CHECK_FALSE(some.odd);
    CHECK((!report.agrees && report.pushed == 0 && report.worst_node == 0));
    CHECK((report.wall_median == 0 && report.holding_force == 0));
  }
  CHECK(kept() == before);
}

TEST_CASE("a shell is kept in the cache only on request, and comes from there with its bits") {
  const hapsix::Mesh mesh = box();
  Watch first, second;
  h6ShellBakeDef def = small_shell(&first);
  def.seed = 77;
  const std::set<std::string> before = kept();
  const auto bake = [&] {
    return hapsix::Shell::make([&](h6Error* e) { return h6BakeShell(mesh, &def, e); });
  };
  const hapsix::Shell plain = bake();
  CHECK(kept() == before);
  def.field.cache = true;
  const hapsix::Shell stored = bake();
  CHECK(kept().size() == before.size() + 1);
  def.field.user = &second;
  const hapsix::Shell found = bake();
  CHECK(kept().size() == before.size() + 1);
  CHECK((first.calls > 0 && second.calls == 0));  // nothing was left to do
  CHECK((same_points(plain, stored) && same_points(plain, found)));
  def.seed = 78;
  const hapsix::Shell other = bake();
  CHECK(kept().size() == before.size() + 2);
  CHECK(second.calls > 0);
  CHECK_FALSE(same_points(plain, other));
}
