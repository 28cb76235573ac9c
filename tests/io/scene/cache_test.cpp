// SPDX-License-Identifier: Apache-2.0
// cache_test.cpp - the cache finds baked assets again, checks the files it reads, and never stops a
// run.
#include <doctest/doctest.h>

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "io/scene/cache.h"
#include "io/shell/shell_file.h"
#include "tests/io/shell/shell_test_meshes.h"

using namespace shells;
namespace fs = std::filesystem;
using namespace h6::io;

namespace {

// Sets HAPSIX_CACHE for one test, to a folder that does not exist yet.
struct CacheFolder {
  fs::path root = fs::temp_directory_path() / ("hapsix-cache-test-" + std::to_string(getpid()));
  fs::path path = root / "not" / "yet";
  CacheFolder() {
    fs::create_directories(root);
    setenv("HAPSIX_CACHE", path.c_str(), 1);
  }
  ~CacheFolder() {
    unsetenv("HAPSIX_CACHE");
    fs::remove_all(root);
  }
};

ShellBake shell_options() {
  ShellBake options;
  options.points = 200;
  return options;
}

FieldBake field_options() {
  FieldBake options;
  options.voxels = 16;
  return options;
}

const Mesh box_mesh = box({0, 0, 0}, {0.03, 0.02, 0.01});
const HashedMesh mesh(box_mesh);

// Takes a shell through the cache and REQUIREs success.
Cached shell_run(ShellData* out = nullptr, const ShellBake& options = shell_options()) {
  Cached cached;
  const auto shell = cached_shell(mesh, options, &cached);
  REQUIRE_MESSAGE(shell, shell.error());
  CHECK(shell->input_hash == asset_key(mesh, options));
  CHECK(shell->size() == options.points);
  if (out) *out = *shell;
  return cached;
}

Cached field_run(FieldData* out = nullptr) {
  Cached cached;
  const auto field = cached_field(mesh, field_options(), &cached);
  REQUIRE_MESSAGE(field, field.error());
  CHECK(field->input_hash == asset_key(mesh, field_options()));
  if (out) *out = *field;
  return cached;
}

void overwrite(const fs::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary | std::ios::trunc) << bytes;
}

void restore(const char* name, const char* value) {
  if (value)
    setenv(name, value, 1);
  else
    unsetenv(name);
}

}  // namespace

TEST_CASE("the folder is HAPSIX_CACHE, else that of XDG, else the home's") {
  const char* xdg = std::getenv("XDG_CACHE_HOME");
  const char* home = std::getenv("HOME");
  const std::string old_xdg = xdg ? xdg : "", old_home = home ? home : "";
  unsetenv("HAPSIX_CACHE");
  setenv("HOME", "/h", 1);
  setenv("XDG_CACHE_HOME", "/x", 1);
  CHECK(cache_folder() == "/x/hapsix");
  setenv("XDG_CACHE_HOME", "relative", 1);  // XDG ignores relative paths
  CHECK(cache_folder() == "/h/.cache/hapsix");
  unsetenv("XDG_CACHE_HOME");
  CHECK(cache_folder() == "/h/.cache/hapsix");
  setenv("HAPSIX_CACHE", "/own", 1);
  CHECK(cache_folder() == "/own");
  unsetenv("HAPSIX_CACHE");
  unsetenv("HOME");
  CHECK(cache_folder().empty());
  Cached cached;
  CHECK(cached_shell(mesh, shell_options(), &cached));  // it bakes without a cache
  CHECK(cached.warnings.size() == 1);
  restore("XDG_CACHE_HOME", xdg ? old_xdg.c_str() : nullptr);
  restore("HOME", home ? old_home.c_str() : nullptr);
}

TEST_CASE(
    "what is not to be kept is baked and not stored, and a stored asset serves it all the same") {
  const CacheFolder folder;
  Cached cached;
  REQUIRE(cached_field(mesh, field_options(), &cached, {}, false));
  CHECK_FALSE(cached.hit);
  CHECK_FALSE(fs::exists(folder.path));
  REQUIRE(cached_field(mesh, field_options(), &cached));
  REQUIRE(cached_field(mesh, field_options(), &cached, {}, false));
  CHECK(cached.hit);
}

TEST_CASE("every parameter and every part of the mesh makes another key, threads do not") {
  std::set<std::string> keys{asset_key(mesh, ShellBake{}), asset_key(mesh, FieldBake{})};
  std::size_t expected = 2;
  const auto shell = [&](auto change) {
    ShellBake options;
    change(options);
    keys.insert(asset_key(mesh, options));
    CHECK(keys.size() == ++expected);
  };
  shell([](ShellBake& o) { o.points = 9999; });
  shell([](ShellBake& o) { o.spacing = 1e-3; });
  shell([](ShellBake& o) { o.levels = 6; });
  shell([](ShellBake& o) { o.seed = 2; });
  shell([](ShellBake& o) { o.surface = ShellSurface::field; });
  shell([](ShellBake& o) { o.normals = ShellNormals::field; });
  shell([](ShellBake& o) { o.field.voxels = 128; });
  shell([](ShellBake& o) { o.field.voxel_size = 1e-3; });
  shell([](ShellBake& o) { o.field.offset = 0; });
  shell([](ShellBake& o) { o.field.seal = 1e-3; });
  const auto field = [&](auto change) {
    FieldBake options;
    change(options);
    keys.insert(asset_key(mesh, options));
    CHECK(keys.size() == ++expected);
  };
  field([](FieldBake& o) { o.voxels = 255; });
  field([](FieldBake& o) { o.voxel_size = 1e-3; });
  field([](FieldBake& o) { o.offset = 1e-4; });
  field([](FieldBake& o) { o.sign = SignMode::flood; });
  field([](FieldBake& o) { o.cavities = Cavities::hollow; });
  field([](FieldBake& o) { o.seal = 1e-3; });
  field([](FieldBake& o) { o.weld = 0.1; });
  field([](FieldBake& o) { o.band_voxels = 4; });
  field([](FieldBake& o) { o.padding_voxels = 9; });
  field([](FieldBake& o) { o.shift = {0.25, 0, 0}; });
  field([](FieldBake& o) { o.shift = {0, 0.25, 0}; });
  const auto other_mesh = [&](auto change) {
    Mesh changed_mesh = box_mesh;
    change(changed_mesh);
    const HashedMesh changed(changed_mesh);
    keys.insert(asset_key(changed, ShellBake{}));
    keys.insert(asset_key(changed, FieldBake{}));
    CHECK(keys.size() == (expected += 2));
  };
  other_mesh([](Mesh& m) { m.vertices[3].y = std::nextafter(m.vertices[3].y, 1.0); });
  other_mesh([](Mesh& m) { std::swap(m.triangles[0][1], m.triangles[0][2]); });
  other_mesh([](Mesh& m) { m.vertices.push_back({0, 0, 0}); });
  other_mesh([](Mesh& m) { m.triangles.pop_back(); });
  other_mesh([](Mesh& m) { m.part.assign(m.triangles.size(), 0); });
  other_mesh([](Mesh& m) { m.part_names = {"ab", "c"}; });
  other_mesh([](Mesh& m) { m.part_names = {"a", "bc"}; });
  ShellBake threaded;
  threaded.threads = 3;
  CHECK(asset_key(mesh, threaded) == asset_key(mesh, ShellBake{}));
}

TEST_CASE("keys and cache take the hash of a mesh as it is: nothing hashes the mesh again") {
  const CacheFolder folder;
  Mesh changing = box_mesh;
  const HashedMesh hashed(changing);
  changing.vertices[0].x -= 1e-3;
  CHECK(asset_key(hashed, shell_options()) == asset_key(mesh, shell_options()));
  CHECK(asset_key(hashed, field_options()) == asset_key(mesh, field_options()));
  const auto shell = cached_shell(hashed, shell_options(), nullptr);
  const auto field = cached_field(hashed, field_options(), nullptr);
  REQUIRE(shell);
  REQUIRE(field);
  CHECK(shell->input_hash == asset_key(mesh, shell_options()));
  CHECK(field->input_hash == asset_key(mesh, field_options()));
  CHECK(asset_key(HashedMesh(changing), field_options()) != field->input_hash);
}

TEST_CASE("what was baked once is found again, to the bit") {
  const CacheFolder folder;
  ShellData first, second;
  const Cached miss = shell_run(&first), hit = shell_run(&second);
  CHECK_FALSE(miss.hit);
  CHECK(hit.hit);
  CHECK(hit.warnings.empty());
  CHECK(hit.file == folder.path / (asset_key(mesh, shell_options()) + ".ply"));
  CHECK(same_bits(first, second));
  ShellBake more = shell_options();
  more.points = 201;
  CHECK_FALSE(shell_run(nullptr, more).hit);

  FieldData field, again;
  CHECK_FALSE(field_run(&field).hit);
  const Cached found = field_run(&again);
  CHECK(found.hit);
  CHECK(found.file.extension() == ".field");
  CHECK(field.samples == again.samples);
  CHECK(field.brick_index == again.brick_index);
  CHECK(field.far_grid == again.far_grid);
}

TEST_CASE("a damaged or foreign file is baked again, says so, and is then good") {
  const CacheFolder folder;
  const fs::path file = shell_run().file;
  std::ifstream in(file, std::ios::binary);
  const std::string good((std::istreambuf_iterator<char>(in)), {});
  std::string flipped = good;
  flipped[good.size() / 2] ^= 4;
  for (const std::string& bad : {std::string(), good.substr(0, good.size() / 2), flipped,
                                 std::string("hello"), good + "x"}) {
    overwrite(file, bad);
    const Cached cached = shell_run();
    CHECK_FALSE(cached.hit);
    CHECK(cached.warnings.size() == 1);
    CHECK(shell_run().hit);
  }
  // A valid shell with other options, under the name of this key.
  ShellBake other = shell_options();
  other.seed = 77;
  const auto foreign = bake_shell(box_mesh, other, nullptr);
  REQUIRE(foreign);
  REQUIRE(write_shell(file, *foreign));
  const Cached cached = shell_run();
  CHECK_FALSE(cached.hit);
  CHECK(cached.warnings.size() == 1);
  CHECK(shell_run().hit);

  const fs::path field = field_run().file;
  overwrite(field, "no field");
  CHECK_FALSE(field_run().hit);
  CHECK(field_run().hit);
}

TEST_CASE("a cache of another user, or open to all, is not used") {
  const CacheFolder folder;
  const fs::path file = shell_run().file;
  const fs::path place = file.parent_path();
  const fs::perms before = fs::status(place).permissions();
  fs::permissions(place, fs::perms::others_write, fs::perm_options::add);
  const Cached open = shell_run();
  CHECK_FALSE(open.hit);
  REQUIRE(open.warnings.size() == 1);
  CHECK(open.warnings[0].find("open to all") != std::string::npos);
  fs::permissions(place, before);
  CHECK(shell_run().hit);
  fs::permissions(file, fs::perms::others_write, fs::perm_options::add);
  CHECK_FALSE(shell_run().hit);  // baked again, and its own from now on
  CHECK(shell_run().hit);
  if (geteuid() != 0) return;  // only root can give files away
  for (const fs::path& given : {file, place}) {
    REQUIRE(chown(given.c_str(), 65534, 65534) == 0);
    const Cached foreign = shell_run();
    CHECK_FALSE(foreign.hit);
    CHECK(foreign.warnings.size() == 1);
    CHECK(chown(given.c_str(), 0, 0) == 0);
  }
}

TEST_CASE("a cache that cannot be written is a warning, not an error") {
  const CacheFolder folder;
  overwrite(folder.root / "file", "in the way");
  setenv("HAPSIX_CACHE", (folder.root / "file" / "cache").c_str(), 1);
  const Cached cached = shell_run();
  CHECK_FALSE(cached.hit);
  CHECK(cached.warnings.size() == 1);
  CHECK(field_run().warnings.size() == 1);
  // A folder in the place of the file.
  setenv("HAPSIX_CACHE", folder.root.c_str(), 1);
  fs::create_directories(folder.root / (asset_key(mesh, shell_options()) + ".ply"));
  CHECK(shell_run().warnings.size() == 2);  // one for reading, one for writing
}

TEST_CASE("a bake that fails or is cancelled leaves nothing in the cache") {
  const CacheFolder folder;
  Cached cached;
  const auto cancelled = cached_shell(mesh, shell_options(), &cached,
                                      [](const std::string&, double) { return false; });
  CHECK_FALSE(cancelled);
  CHECK(cancelled.error() == "cancelled");
  const Mesh empty;
  CHECK_FALSE(cached_shell(HashedMesh(empty), shell_options(), nullptr));
  CHECK((!fs::exists(folder.path) || fs::is_empty(folder.path)));
}

TEST_CASE("many who bake the same asset at once all succeed and leave one file") {
  const CacheFolder folder;
  std::vector<ShellData> shells(4);
  std::vector<std::thread> bakers;
  for (ShellData& out : shells) {
    bakers.emplace_back([&out] {
      for (int turn = 0; turn < 5; ++turn) {
        Cached cached;
        const auto shell = cached_shell(mesh, shell_options(), &cached);
        if (shell && cached.warnings.empty()) out = *shell;
      }
    });
  }
  for (auto& baker : bakers) baker.join();
  for (const ShellData& shell : shells) {
    CHECK(shell.size() == 200);
    CHECK(same_bits(shell, shells[0]));
  }
  CHECK(std::distance(fs::directory_iterator(folder.path), {}) == 1);
}
