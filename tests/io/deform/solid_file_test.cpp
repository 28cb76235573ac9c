// SPDX-License-Identifier: Apache-2.0
// Solid meshes from files: what the formats say, what is refused, and damaged bytes.
#include "io/deform/solid_file.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <random>

#include "io/deform/reduce.h"
#include "tests/io/deform/solids.h"

using namespace h6;
using namespace h6::io;

namespace {

struct Sample {
  const char* name;
  std::string text;
};

const Sample kVeg{"a.veg", R"(# two tetrahedra
*VERTICES
5 3 0 0
1 0 0 0
2 1 0 0
3 0 1 0
4 0, 0, 1
5 1 1 1

*ELEMENTS
TET
2 4 0
1 1 2 3 4
2 2 5 3 4
*MATERIAL SOFT
ENU, 1000, 1e6, 0.45
*MATERIAL STIFF
ENU, 2000, 1e9, 0.3
*SET top
2
*REGION
allElements, SOFT
*REGION
top, STIFF
)"};

const Sample kMsh2{"a.msh", R"($MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
2
2 1 "skin"
3 7 "core of it"
$EndPhysicalNames
$Nodes
5
10 0 0 0
11 1 0 0
12 0 1 0
20 0 0 1
21 1 1 1
$EndNodes
$Elements
3
1 2 2 1 5 10 11 12
2 4 2 7 1 10 11 12 20
3 4 2 7 1 11 21 12 20
$EndElements
)"};

const Sample kMsh4{"b.msh", R"($MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
1
3 7 "core"
$EndPhysicalNames
$Entities
1 0 0 1
1 0 0 0 0
1 0 0 0 1 1 1 1 7 0
$EndEntities
$Nodes
2 5 1 5
0 1 0 1
1
0 0 0
3 1 0 4
2
3
4
5
1 0 0
0 1 0
0 0 1
1 1 1
$EndNodes
$Elements
2 3 1 3
0 1 15 1
1 1
3 1 4 2
2 1 2 3 4
3 2 5 3 4
$EndElements
)"};

const Sample kVtk4{"a.vtk", R"(# vtk DataFile Version 3.0
a cube as a hexahedron, another as a voxel
ASCII
DATASET UNSTRUCTURED_GRID
POINTS 12 double
0 0 0 1 0 0 1 1 0 0 1 0
0 0 1 1 0 1 1 1 1 0 1 1
0 0 2 1 0 2 1 1 2 0 1 2
CELLS 3 20
8 0 1 2 3 4 5 6 7
8 4 5 7 6 8 9 11 10
1 3
CELL_TYPES 3
12 11 1
POINT_DATA 12
SCALARS anything float
)"};

const Sample kVtk5{"b.vtk", R"(# vtk DataFile Version 5.1
tetrahedra
ASCII
DATASET UNSTRUCTURED_GRID
POINTS 5 double
0 0 0 1 0 0 0 1 0 0 0 1 1 1 1
METADATA
INFORMATION 0

CELLS 3 8
OFFSETS vtktypeint64
0 4 8
CONNECTIVITY vtktypeint64
0 1 2 3 1 4 2 3
CELL_TYPES 2
10
10
)"};

const Sample kAll[] = {kVeg, kMsh2, kMsh4, kVtk4, kVtk5};

SolidMesh read(const Sample& s) {
  const Result<SolidMesh> mesh = parse_solid(s.text, s.name);
  REQUIRE_MESSAGE(mesh, mesh.error());
  return *mesh;
}

void refused(const Sample& from, const std::string& old, const std::string& now,
             const std::string& word) {
  std::string text = from.text;
  REQUIRE(text.find(old) != std::string::npos);
  text.replace(text.find(old), old.size(), now);
  const Result<SolidMesh> mesh = parse_solid(text, from.name);
  REQUIRE_FALSE(mesh);
  CHECK_MESSAGE(mesh.error().find(word) != std::string::npos, mesh.error());
  CHECK(mesh.error().starts_with(from.name));
  CHECK(mesh.error().ends_with("."));
}

// What solid_file.h promises of every mesh, and that all later checks stand it.
void promises(const std::string& text, const char* name, int& accepted) {
  const Result<SolidMesh> mesh = parse_solid(text, name);
  if (!mesh) {
    REQUIRE(mesh.error().starts_with(name));
    REQUIRE(mesh.error().ends_with("."));
    for (const char c : mesh.error()) REQUIRE(static_cast<unsigned char>(c) >= 0x20);
    return;
  }
  ++accepted;
  REQUIRE_FALSE(mesh->elements.empty());
  for (const h6Vec3& p : mesh->vertices)
    REQUIRE((std::abs(p.x) <= 1e6 && std::abs(p.y) <= 1e6 && std::abs(p.z) <= 1e6));
  for (const SolidElement& e : mesh->elements) {
    REQUIRE((e.corners == 4 || e.corners == 8));
    REQUIRE((e.material == kNoMaterial || e.material < mesh->materials.size()));
    for (std::uint32_t a = 0; a < e.corners; ++a) REQUIRE(e.corner[a] < mesh->vertices.size());
  }
  for (const SolidMesh::Set& set : mesh->sets)
    for (const std::uint32_t e : set.elements) REQUIRE(e < mesh->elements.size());
  (void)check_solid(*mesh, true);
}

}  // namespace

TEST_CASE("each format gives the same two tetrahedra") {
  for (const Sample& s : {kVeg, kMsh2, kMsh4, kVtk5}) {
    SolidMesh mesh = read(s);
    INFO(s.name);
    REQUIRE(mesh.vertices.size() == 5);
    REQUIRE(mesh.elements.size() == 2);
    CHECK(mesh.elements[1].corner[1] == 4);
    CHECK(mesh.vertices[4].z == 1);
    if (mesh.materials.empty()) {
      CHECK_FALSE(check_solid(mesh, true));
      REQUIRE(give_material(mesh, "", solids::kRubber));
    }
    const Result<SolidFacts> facts = check_solid(mesh, true);
    REQUIRE_MESSAGE(facts, facts.error());
    CHECK(facts->volume == doctest::Approx(0.5));
  }
}

TEST_CASE("regions of a Vega file have their materials, in SI whatever the unit of length") {
  const Result<SolidMesh> mesh = parse_solid(kVeg.text, "a.veg", Unit::mm);
  REQUIRE(mesh);
  CHECK(mesh->vertices[1].x == doctest::Approx(1e-3));
  REQUIRE(mesh->materials.size() == 2);
  CHECK(mesh->materials[mesh->elements[0].material].young == 1e6);
  CHECK(mesh->materials[mesh->elements[1].material].density == 2000);
}

TEST_CASE("physical groups of volumes are sets by their names") {
  SolidMesh two = read(kMsh2), four = read(kMsh4);
  REQUIRE(two.sets.size() == 1);
  CHECK(two.sets[0].name == "core of it");
  CHECK(two.sets[0].elements == std::vector<std::uint32_t>{0, 1});
  REQUIRE(four.sets.size() == 1);
  CHECK(four.sets[0].name == "core");
  CHECK(four.sets[0].elements == std::vector<std::uint32_t>{0, 1});
  CHECK(two.remarks.size() == 1);
}

TEST_CASE("a VTK voxel is a hexahedron with its corners in another order") {
  SolidMesh mesh = read(kVtk4);
  REQUIRE(give_material(mesh, "", solids::kRubber));
  const Result<SolidFacts> facts = check_solid(mesh, true);
  REQUIRE_MESSAGE(facts, facts.error());
  CHECK(facts->volume == doctest::Approx(2));
}

TEST_CASE("a file that winds all its elements the other way is turned, one of both is refused") {
  Sample all = kVeg;
  all.text.replace(all.text.find("1 1 2 3 4"), 9, "1 2 1 3 4");
  {
    SolidMesh one = read(all);
    CHECK_FALSE(check_solid(one, true));
  }
  all.text.replace(all.text.find("2 2 5 3 4"), 9, "2 5 2 3 4");
  SolidMesh mesh = read(all);
  CHECK(check_solid(mesh, true));
  CHECK(mesh.remarks.size() == 1);
}

TEST_CASE("what a format may hold and is not read is named, with the line") {
  refused(kVeg, "*SET", "*INCLUDE other.veg\n*SET", "*INCLUDE");
  refused(kVeg, "ENU", "MOONEYRIVLIN", "line 16");
  refused(kVeg, "1 1 2 3 4", "1 1 2 3 9", "vertex 9");
  refused(kVeg, "5 3 0 0", "500000 3 0 0", "claims");
  refused(kVeg, "1 0 0 0", "1 nan 0 0", "finite");
  refused(kVeg, "5 1 1 1", "5 1 1 1e300", "1e6 m");
  refused(kVeg, "2 1 0 0", "1 1 0 0", "second vertex");
  refused(kVeg, "TET\n", "PRISM\n", "PRISM");
  refused(kVeg, "top, STIFF", "top, HARD", "'HARD'");
  refused(kVeg, "top, STIFF", "bottom, STIFF", "'bottom'");
  refused(kMsh2, "2.2 0 8", "2.2 1 8", "binary");
  refused(kMsh2, "2.2 0 8", "1.0 0 8", "2.2 and 4.1");
  refused(kMsh2, "2 4 2 7 1", "2 6 2 7 1", "type 6");
  refused(kMsh2, "11 21 12 20", "11 22 12 20", "node 22");
  refused(kMsh2, "$Nodes\n5", "$Nodes\n-5", "negative");
  refused(kMsh4, "$EndNodes", "$EndKnots", "$EndNodes");
  refused(kMsh4, "2 5 3 4", "2 5 3 99999999999999999999", "too large");
  refused(kVtk4, "ASCII", "BINARY", "binary");
  refused(kVtk4, "UNSTRUCTURED_GRID", "POLYDATA", "POLYDATA");
  refused(kVtk4, "12 11 1", "12 13 1", "type 13");
  refused(kVtk4, "8 0 1", "8 0 77", "point 77");
  refused(kVtk5, "0 4 8", "0 9 8", "out of order");
  CHECK_FALSE(parse_solid("", "a.veg"));
  CHECK_FALSE(parse_solid("solid", "a.stl"));
  CHECK_FALSE(read_solid("no_such_file.veg"));
}

TEST_CASE("a file cut at any byte, or with any byte changed, is refused or a mesh") {
  int accepted = 0;
  std::mt19937 random(11);
  for (const Sample& s : kAll) {
    for (std::size_t cut = 0; cut < s.text.size(); ++cut)
      promises(s.text.substr(0, cut), s.name, accepted);
    for (int i = 0; i < 3000; ++i) {
      std::string text = s.text;
      for (int n = static_cast<int>(random() % 3); n >= 0; --n) {
        const std::size_t at = random() % text.size();
        switch (random() % 4) {
          case 0:
            text[at] = static_cast<char>(random());
            break;
          case 1:
            text.insert(at, 1, "0123456789-. \n"[random() % 14]);
            break;
          case 2:
            text.erase(at, 1 + random() % 8);
            break;
          default:
            text.insert(at, text.substr(random() % text.size(), random() % 40));
        }
        if (text.empty()) break;
      }
      promises(text, s.name, accepted);
    }
  }
  CHECK(accepted > 500);
}

TEST_CASE("real models are read, checked and reduced") {
  const char* data = std::getenv("HAPSIX_TEST_DATA");
  const std::filesystem::path folder = std::filesystem::path(data ? data : "") / "deformable";
  if (!data || !std::filesystem::exists(folder)) {
    MESSAGE("skipped: no real models");
    return;
  }
  Result<SolidMesh> beam = read_solid(folder / "beam3_tet.veg");
  REQUIRE_MESSAGE(beam, beam.error());
  CHECK(beam->vertices.size() == 208);
  CHECK(beam->elements.size() == 450);
  CHECK(fix_box(*beam, {-1, -1e-6, -1}, {1, 1e-6, 1}) > 3);
  const Result<ReducedModel> small = reduce(*beam, {.modes = 20});
  REQUIRE_MESSAGE(small, small.error());

  Result<SolidMesh> bridge = read_solid(folder / "simpleBridge.veg");
  REQUIRE_MESSAGE(bridge, bridge.error());
  CHECK(bridge->vertices.size() == 3923);
  CHECK(bridge->elements.size() == 1736);
  const double cell = 0.251087;
  const Result<SolidFacts> facts = check_solid(*bridge, true);
  REQUIRE_MESSAGE(facts, facts.error());
  CHECK(facts->volume == doctest::Approx(1736 * cell * cell * cell).epsilon(1e-4));
  const double left = bridge->vertices[0].x;
  CHECK(fix_box(*bridge, {left - 0.01, -10, -10}, {left + 0.01, 10, 10}) > 3);
  CHECK(check_solid(*bridge, false));
}
