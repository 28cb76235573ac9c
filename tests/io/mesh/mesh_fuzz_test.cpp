// SPDX-License-Identifier: Apache-2.0
// mesh_fuzz_test.cpp - damaged mesh files never crash the readers, and what they accept is a mesh.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <set>
#include <string>
#include <tuple>

#include "io/mesh/mesh.h"
#include "io/mesh/mesh_file.h"
#include "tests/io/mesh/mesh_samples.h"

using namespace h6::io;
using samples::File;

namespace {

struct Tally {
  int accepted = 0, refused = 0;
};

// Checks what mesh.h promises of every mesh that was read, or that a sentence refuses it.
void try_reading(const File& file, Tally& tally) {
  const auto mesh = parse_mesh(file.bytes, file.name);
  if (!mesh) {
    ++tally.refused;
    REQUIRE(mesh.error().starts_with(file.name));
    REQUIRE(mesh.error().ends_with("."));
    for (const char c : mesh.error()) REQUIRE(static_cast<unsigned char>(c) >= 0x20);
    return;
  }
  ++tally.accepted;
  REQUIRE_FALSE(mesh->triangles.empty());
  REQUIRE((mesh->part.empty() || mesh->part.size() == mesh->triangles.size()));
  for (const std::int32_t part : mesh->part)
    REQUIRE((part >= 0 && part < static_cast<std::int32_t>(mesh->part_names.size())));
  std::uint32_t next = 0;  // vertices stand in the order in which triangles name them
  for (const auto& t : mesh->triangles)
    for (const std::uint32_t v : t) {
      REQUIRE(v <= next);
      next += v == next;
    }
  REQUIRE(next == mesh->vertices.size());
  std::set<std::tuple<double, double, double>> places;
  for (const Vec3& p : mesh->vertices) {
    REQUIRE((std::abs(p.x) <= 1e6 && std::abs(p.y) <= 1e6 && std::abs(p.z) <= 1e6));
    REQUIRE(places.insert({p.x, p.y, p.z}).second);
  }
  const MeshAudit a = audit(*mesh);
  REQUIRE(a.vertices == mesh->vertices.size());
  REQUIRE(std::isfinite(a.volume));
}

}  // namespace

TEST_CASE("a file cut at any byte is refused or a mesh") {
  for (const File& file : samples::every_format(samples::box())) {
    CAPTURE(file.name);
    Tally tally;
    for (std::size_t length = 0; length < file.bytes.size(); ++length)
      try_reading({file.name, file.bytes.substr(0, length)}, tally);
    // An OBJ has neither a count nor an end mark: cut after a face, it is a smaller mesh.
    if (file.name == "mesh.obj") CHECK(tally.accepted > 0);
    // In other formats only the last bytes may be missing unnoticed: a line end, or a digit.
    else
      CHECK(tally.accepted <= 1);
  }
}

TEST_CASE("a file with bytes changed, doubled, dropped or moved is refused or a mesh") {
  std::mt19937_64 random(20);
  Tally tally;
  for (const File& file : samples::every_format(samples::box())) {
    CAPTURE(file.name);
    for (int round = 0; round < 1000; ++round) {
      std::string bytes = file.bytes;
      for (unsigned changes = 1 + random() % 4; changes > 0; --changes) {
        const std::size_t at = random() % bytes.size();
        const std::size_t length = std::min<std::size_t>(1 + random() % 8, bytes.size() - at);
        static const std::string kEvil[] = {"-1",
                                            "0",
                                            "4294967295",
                                            "1e999",
                                            "nan",
                                            "\n",
                                            " ",
                                            "f ",
                                            "end",
                                            "\xff\xff\xff\xff",
                                            "\x7f\xff\xff\xff",
                                            "/",
                                            "\\\n",
                                            "solid",
                                            "g a\n",
                                            "#"};
        switch (random() % 6) {
          case 0:
            bytes[at] = static_cast<char>(random());
            break;
          case 1:
            bytes[at] = static_cast<char>(bytes[at] ^ (1u << random() % 8));
            break;
          case 2:
            bytes.erase(at, length);
            break;
          case 3:
            bytes.insert(at, bytes.substr(at, length));
            break;
          case 4:
            bytes.replace(at, length, kEvil[random() % std::size(kEvil)]);
            break;
          default:
            bytes.insert(random() % bytes.size(), bytes.substr(at, length));
            break;
        }
        if (bytes.empty()) bytes = " ";
      }
      CAPTURE(round);
      try_reading({file.name, bytes}, tally);
    }
  }
  CHECK(tally.accepted > 100);  // else the test covers one outcome only
  CHECK(tally.refused > 100);
}

TEST_CASE("bytes that mean nothing are refused under every ending") {
  std::mt19937_64 random(21);
  Tally tally;
  for (const char* name : {"a.stl", "a.obj", "a.ply", "a.stl.gz", "a.obj.gz", "a.ply.gz"}) {
    for (int round = 0; round < 100; ++round) {
      std::string bytes(random() % 300, ' ');
      for (char& c : bytes) c = static_cast<char>(random());
      try_reading({name, bytes}, tally);
      try_reading({name, samples::gz(bytes)}, tally);
    }
  }
  CHECK(tally.accepted == 0);
}
