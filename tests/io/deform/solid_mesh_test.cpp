// SPDX-License-Identifier: Apache-2.0
// What makes a solid mesh unfit for a simulation, each in one sentence.
#include "io/deform/solid_mesh.h"

#include <doctest/doctest.h>

#include <cmath>

#include "io/deform/reduce.h"
#include "tests/io/deform/solids.h"

using namespace h6;
using namespace h6::io;

namespace {

SolidMesh held_block() {
  SolidMesh mesh = solids::block({0.4, 0.1, 0.1}, {4, 1, 1});
  REQUIRE(fix_box(mesh, {-1, -1, -1}, {0, 1, 1}) == 4);
  return mesh;
}

void refused(const SolidMesh& mesh, const std::string& word, bool free = false) {
  const Result<SolidFacts> facts = check_solid(mesh, free);
  REQUIRE_FALSE(facts);
  CHECK_MESSAGE(facts.error().find(word) != std::string::npos, facts.error());
  CHECK(facts.error().ends_with("."));
}

}  // namespace

TEST_CASE("volume and mass of a block, of hexahedra and of tetrahedra") {
  for (const SolidMesh& mesh : {held_block(), solids::tetrahedra(held_block())}) {
    const Result<SolidFacts> facts = check_solid(mesh, false);
    REQUIRE_MESSAGE(facts, facts.error());
    CHECK(facts->volume == doctest::Approx(4e-3).epsilon(1e-12));
    CHECK(facts->mass == doctest::Approx(4).epsilon(1e-12));
    CHECK(facts->parts == 1);
  }
}

TEST_CASE("materials out of their ranges are refused by name") {
  for (const double young : {0.0, -1.0, std::nan(""), 1e14, HUGE_VAL}) {
    SolidMesh mesh = held_block();
    mesh.materials[0].young = young;
    refused(mesh, "Young");
    refused(mesh, "'rubber'");
  }
  for (const double poisson : {-1.0, 0.5, 0.7, std::nan("")}) {
    SolidMesh mesh = held_block();
    mesh.materials[0].poisson = poisson;
    refused(mesh, "Poisson");
  }
  for (const double density : {0.0, -5.0, 1e6, std::nan("")}) {
    SolidMesh mesh = held_block();
    mesh.materials[0].density = density;
    refused(mesh, "density");
  }
  SolidMesh mesh = held_block();
  mesh.materials.push_back({"unused", 0, 0, 0});
  CHECK(check_solid(mesh, false));
}

TEST_CASE("an inverted or flat element is refused by its number") {
  for (const bool tets : {false, true}) {
    const SolidMesh good = tets ? solids::tetrahedra(held_block()) : held_block();
    SolidMesh mesh = good;
    std::swap(mesh.elements[2].corner[1], mesh.elements[2].corner[2]);
    if (!tets) std::swap(mesh.elements[2].corner[5], mesh.elements[2].corner[6]);
    refused(mesh, "Element 3");
    mesh = good;
    mesh.elements[1].corner[3] = mesh.elements[1].corner[0];
    if (!tets) {
      for (int a = 4; a < 8; ++a) mesh.elements[1].corner[a] = mesh.elements[1].corner[a - 4];
    }
    refused(mesh, "Element 2");
  }
}

TEST_CASE("a model that can still move as a whole is refused, unless it is to be free") {
  SolidMesh mesh = held_block();
  CHECK(check_solid(mesh, false));
  refused(mesh, "free", true);
  mesh.fixed.clear();
  refused(mesh, "No vertex");
  CHECK(check_solid(mesh, true));
  mesh.fixed = {0, 1};
  refused(mesh, "only 2");
  SolidMesh line = solids::block({0.4, 0.1, 0.1}, {4, 2, 1});
  fix_box(line, {-1, -1, -1}, {0, 1, 0});
  CHECK(line.fixed.size() == 3);
  refused(line, "one line");
}

TEST_CASE("each part that no element joins to the others needs fixed vertices of its own") {
  SolidMesh mesh = held_block();
  const SolidMesh other = mesh;
  const auto shift = static_cast<std::uint32_t>(mesh.vertices.size());
  for (const h6Vec3& p : other.vertices) mesh.vertices.push_back(p + h6Vec3{0, 1, 0});
  for (SolidElement e : other.elements) {
    for (std::uint32_t& c : e.corner) c += shift;
    mesh.elements.push_back(e);
  }
  refused(mesh, "one of 2");
  fix_box(mesh, {-1, 0.9, -1}, {0, 2, 1});
  REQUIRE(check_solid(mesh, false));
  CHECK(check_solid(mesh, false)->parts == 2);
  mesh.fixed.clear();
  refused(mesh, "2 parts", true);
}

TEST_CASE("blocks that share an edge only swing without force, and the reduction says so") {
  SolidMesh mesh = solids::block({0.2, 0.2, 0.1}, {2, 2, 1});
  mesh.elements.erase(mesh.elements.begin() + 1, mesh.elements.begin() + 3);
  REQUIRE(mesh.elements.size() == 2);
  fix_box(mesh, {-1, -1, -1}, {0, 0.1, 1});
  REQUIRE(check_solid(mesh, false));
  const auto model = reduce(mesh, {.modes = 3});
  REQUIRE_FALSE(model);
  CHECK_MESSAGE(model.error().find("without any force") != std::string::npos, model.error());
}

TEST_CASE("vertices are fixed by box and list, and regions get materials by name") {
  SolidMesh mesh = solids::block({0.4, 0.1, 0.1}, {4, 1, 1});
  REQUIRE(fix_vertices(mesh, {3, 1, 3}));
  CHECK(mesh.fixed == std::vector<std::uint32_t>{1, 3});
  CHECK_FALSE(fix_vertices(mesh, {20}));
  CHECK(fix_box(mesh, {5, 5, 5}, {6, 6, 6}) == 0);
  mesh.sets = {{"end", {2, 3}}};
  REQUIRE(give_material(mesh, "end", {"steel", 2e11, 0.3, 7850}));
  CHECK(mesh.elements[1].material == 0);
  CHECK(mesh.elements[3].material == 1);
  CHECK_FALSE(give_material(mesh, "start", solids::kRubber));
  REQUIRE(give_material(mesh, "", {"wood", 1e10, 0.3, 600}));
  CHECK(mesh.elements[3].material == 0);
}
