// SPDX-License-Identifier: Apache-2.0
// Reduced models as files: the round trip, and files that are damaged or something else.
#include "io/deform/deformable_file.h"

#include <doctest/doctest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>

#include "io/deform/reduce.h"
#include "tests/io/deform/solids.h"

using namespace h6;
using namespace h6::io;
namespace fs = std::filesystem;

namespace {

struct Folder {
  Folder() {
    char name[] = "/tmp/hapsix-deform-XXXXXX";
    REQUIRE(mkdtemp(name) != nullptr);
    path = name;
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
  fs::path path;
};

ReducedModel some_model(bool warp = false) {
  SolidMesh mesh = solids::block({0.3, 0.1, 0.1}, {3, 1, 1});
  const SolidMesh cut = solids::tetrahedra(mesh);
  mesh.elements.erase(mesh.elements.begin());
  mesh.elements.insert(mesh.elements.begin(), cut.elements.begin(), cut.elements.begin() + 6);
  fix_box(mesh, {-1, -1, -1}, {0, 1, 1});
  const Result<ReducedModel> model = reduce(mesh, {.modes = 4, .warp = warp});
  REQUIRE_MESSAGE(model, model.error());
  ReducedModel out = *model;
  out.made_with = R"({"program":"test"})";
  return out;
}

std::string slurp(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}
void spill(const fs::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

}  // namespace

TEST_CASE("a model comes back as it was, bit for bit") {
  for (const bool warp : {false, true}) {
    const Folder folder;
    const fs::path file = folder.path / "m.h5";
    const ReducedModel model = some_model(warp);
    CHECK(model.turn.size() == (warp ? model.basis.size() : 0));
    CHECK(model.cubic.empty() == warp);
    REQUIRE(model.input_hash.size() == 32);
    REQUIRE(write_deformable(file, model));
    CHECK(is_deformable(file));
    const Result<ReducedModel> back = read_deformable(file);
    REQUIRE_MESSAGE(back, back.error());
    CHECK(back->modes == model.modes);
    CHECK(back->basis == model.basis);
    CHECK(back->turn == model.turn);
    CHECK(back->linear == model.linear);
    CHECK(back->quadratic == model.quadratic);
    CHECK(back->cubic == model.cubic);
    CHECK(back->frequency == model.frequency);
    CHECK(back->mass_damping == model.mass_damping);
    CHECK(back->stiffness_damping == model.stiffness_damping);
    CHECK(back->input_hash == model.input_hash);
    CHECK(back->made_with == model.made_with);
    CHECK(back->mesh.fixed == model.mesh.fixed);
    REQUIRE(back->mesh.elements.size() == model.mesh.elements.size());
    for (std::size_t e = 0; e < model.mesh.elements.size(); ++e) {
      CHECK(back->mesh.elements[e].corners == model.mesh.elements[e].corners);
      CHECK(back->mesh.elements[e].corner == model.mesh.elements[e].corner);
    }
    CHECK(back->mesh.materials[0].young == model.mesh.materials[0].young);
  }
}

TEST_CASE("a file that is cut off, changed or something else is refused with a sentence") {
  for (const bool warp : {false, true}) {
    const Folder folder;
    const fs::path file = folder.path / "m.h5", bad = folder.path / "bad.h5";
    REQUIRE(write_deformable(file, some_model(warp)));
    const std::string bytes = slurp(file);
    const auto refused = [&](const std::string& text) {
      spill(bad, text);
      const Result<ReducedModel> model = read_deformable(bad);
      if (model) return false;
      CHECK(model.error().size() > 20);
      return true;
    };
    for (std::size_t cut = 0; cut < bytes.size(); cut += 997) CHECK(refused(bytes.substr(0, cut)));
    CHECK(refused("not HDF5"));
    CHECK_FALSE(read_deformable(folder.path / "absent.h5"));
    CHECK_FALSE(read_deformable(folder.path));
    CHECK_FALSE(is_deformable(bad));

    // HDF5 has bytes of its own that nothing reads: a change of those leaves the same model.
    const Result<ReducedModel> whole = read_deformable(file);
    REQUIRE(whole);
    std::mt19937 random(5);
    int told = 0;
    constexpr int kTries = 300;
    for (int i = 0; i < kTries; ++i) {
      std::string text = bytes;
      text[random() % text.size()] ^= static_cast<char>(1 << random() % 8);
      if (refused(text)) {
        ++told;
        continue;
      }
      const Result<ReducedModel> same = read_deformable(bad);
      REQUIRE(same);
      CHECK(same->basis == whole->basis);
      CHECK(same->turn == whole->turn);
      CHECK(same->cubic == whole->cubic);
      CHECK(same->made_with == whole->made_with);
    }
    CHECK(told > kTries / 4);
  }
}

TEST_CASE("a warped model whose turns are of another size, or that has a cubic force, is refused") {
  const Folder folder;
  const fs::path file = folder.path / "m.h5";
  ReducedModel model = some_model(true);
  REQUIRE(consistent(model));
  model.turn.resize(model.turn.size() - 3);
  CHECK_FALSE(consistent(model));
  model = some_model(true);
  model.turn[4] = NAN;
  REQUIRE(write_deformable(file, model));
  const Result<ReducedModel> read = read_deformable(file);
  REQUIRE_FALSE(read);
  CHECK(read.error().find("do not fit") != std::string::npos);
  model = some_model(true);
  model.cubic.assign(triple_count(4) * 4, 0);
  CHECK_FALSE(consistent(model));
  CHECK_FALSE(reduce(model.mesh, {.modes = 4, .linear_modes = 4, .warp = true}));
}

TEST_CASE("the key tells inputs apart, and a failed write leaves nothing behind") {
  SolidMesh mesh = solids::block({0.3, 0.1, 0.1}, {3, 1, 1});
  const std::string key = reduction_key(mesh, {});
  CHECK(key == reduction_key(mesh, {.threads = 3}));
  CHECK(key != reduction_key(mesh, {.modes = 10}));
  CHECK(key != reduction_key(mesh, {.damping = 0.1}));
  CHECK(key != reduction_key(mesh, {.warp = true}));
  mesh.materials[0].young *= 2;
  CHECK(key != reduction_key(mesh, {}));
  const Folder folder;
  CHECK_FALSE(write_deformable(folder.path / "no" / "m.h5", some_model()));
  CHECK(fs::is_empty(folder.path));
}
