// SPDX-License-Identifier: Apache-2.0
// mesh_nodes_test.cpp - glTF and COLLADA: every node is where its transforms put it, with outward
// triangles and its name; and no hostile file does harm.
#include <doctest/doctest.h>
#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "io/mesh/mesh_file.h"
#include "tests/io/mesh/node_files.h"
#include "tests/support/near.h"

namespace fs = std::filesystem;
using namespace h6::io;
using namespace node_files;
using h6::test::near;
using samples::File;

namespace {

const samples::Mesh kBox = samples::box();  // 2 x 1 x 0.25, low corner (-1, -0.5, 0)
const std::string kPlain = R"([{"mesh":0}])";
const std::string kPlainDae = R"(<node name="n"><instance_geometry url="#g"/></node>)";

Mesh good(const File& file, Unit unit = Unit::m) {
  auto mesh = parse_mesh(file.bytes, file.name, unit);
  REQUIRE_MESSAGE(mesh, mesh.error());
  return *mesh;
}

void refuses(const File& file, const std::string& words) {
  CAPTURE(words);
  const auto mesh = parse_mesh(file.bytes, file.name);
  REQUIRE_FALSE(mesh);
  CAPTURE(mesh.error());
  CHECK(mesh.error().starts_with(file.name));
  CHECK(mesh.error().size() < 300);
  CHECK(mesh.error().find(words) != std::string::npos);
}

std::string with(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

void spans(const Mesh& mesh, Vec3 low, Vec3 high) {
  const MeshAudit a = audit(mesh);
  for (const auto& [is, should] : {std::pair{a.low, low}, std::pair{a.high, high}}) {
    CHECK(std::abs(is.x - should.x) < 1e-12);
    CHECK(std::abs(is.y - should.y) < 1e-12);
    CHECK(std::abs(is.z - should.z) < 1e-12);
  }
}

File as_gltf(const std::string& nodes) {
  return {"a.gltf", gltf(kBox, nodes, data_uri(buffer(kBox)))};
}
File as_dae(const std::string& nodes, const std::string& asset = "",
            const std::string& library = "") {
  return {"a.dae", dae(kBox, asset, nodes, library)};
}

struct Folder {
  fs::path path = fs::temp_directory_path() / ("hapsix_nodes_" + std::to_string(getpid()));
  Folder() { fs::create_directories(path / "sub"); }
  ~Folder() { fs::remove_all(path); }
  fs::path put(const std::string& name, const std::string& bytes) const {
    std::ofstream(path / name, std::ios::binary) << bytes;
    return path / name;
  }
};

}  // namespace

TEST_CASE("JSON with its data inside, one binary file and XML give the same mesh, packed or not") {
  const Mesh expected = weld(kBox);
  const std::vector<File> files = {
      as_gltf(kPlain), {"a.glb", glb(gltf(kBox, kPlain, ""), buffer(kBox))}, as_dae(kPlainDae)};
  for (const File& file : files) {
    CAPTURE(file.name);
    CHECK(samples::same_bits(good(file), expected));
    CHECK(samples::same_bits(good({file.name + ".gz", samples::gz(file.bytes)}), expected));
    CHECK(good(file).remarks.empty());
  }
}

TEST_CASE(
    "nested nodes apply the inner transform first: scale, turn, shift, each by the parent's") {
  // Box 2 x 1 x 0.25, scaled to 4 x 3 x 1, turned by 90 deg about z, shifted by (0, 0, 1); then
  // scaled by (10, 1, 1), which does not commute with the turn, and shifted by (100, 0, 0).
  const Vec3 low = {100 - 15, -2, 1}, high = {100 + 15, 2, 2};
  spans(good(as_gltf(R"([{"children":[1],"scale":[10,1,1],"translation":[100,0,0]},
      {"mesh":0,"translation":[0,0,1],"rotation":[0,0,0.70710678118654752,0.70710678118654752],
       "scale":[2,3,4]}])")),
        low, high);
  spans(good(as_gltf(R"([{"children":[1],"matrix":[10,0,0,0, 0,1,0,0, 0,0,1,0, 100,0,0,1]},
      {"mesh":0,"matrix":[0,2,0,0, -3,0,0,0, 0,0,4,0, 0,0,1,1]}])")),
        low, high);
  spans(good(as_dae(R"(<node><translate>100 0 0</translate><scale>10 1 1</scale><node>
      <translate>0 0 1</translate><rotate>0 0 2 90</rotate><scale>2 3 4</scale>
      <instance_geometry url="#g"/></node></node>)")),
        low, high);
  spans(good(as_dae(R"(<node><matrix>10 0 0 100 0 1 0 0 0 0 1 0 0 0 0 1</matrix><node>
      <matrix>0 -3 0 0 2 0 0 0 0 0 4 1 0 0 0 1</matrix><instance_geometry url="#g"/>
      </node></node>)")),
        low, high);
}

TEST_CASE("a mirrored part stays the right way out, and one mirrored twice too") {
  const std::string twin = R"([{"children":[1,2,3]},{"mesh":0},
      {"mesh":0,"scale":[-1,1,1],"translation":[5,0,0]},
      {"children":[4],"scale":[1,1,-2],"translation":[10,0,0]},{"mesh":0,"scale":[1,-1,1]}])";
  const std::string xml = R"(<node><instance_geometry url="#g"/></node>
      <node><translate>5 0 0</translate><scale>-1 1 1</scale><instance_geometry url="#g"/></node>
      <node><translate>10 0 0</translate><scale>1 1 -2</scale>
      <node><scale>1 -1 1</scale><instance_geometry url="#g"/></node></node>)";
  for (const File& file : {as_gltf(twin), as_dae(xml)}) {
    CAPTURE(file.name);
    const MeshAudit a = audit(good(file));
    CHECK(a.closed);
    CHECK(a.components == 3);
    CHECK(a.flipped_edges == 0);
    CHECK(a.volume == near(0.5 + 0.5 + 1.0));  // one inside out would subtract
  }
}

TEST_CASE("every node with a mesh is a part under its own name, else its mesh's") {
  const Mesh a = good(as_gltf(R"([{"children":[1,2],"name":"group"},{"mesh":0,"name":"left é"},
                                  {"mesh":0,"translation":[5,0,0]}])"));
  CHECK(a.part_names == std::vector<std::string>{"left é", "drawn"});
  const Mesh b = good(as_dae(R"(<node name="left &amp; &#233;"><instance_geometry url="#g"/></node>
      <node><translate>5 0 0</translate><instance_geometry url="#g"/></node>)"));
  CHECK(b.part_names == std::vector<std::string>{"left & é", "drawn"});
  for (const Mesh& mesh : {a, b}) {
    REQUIRE(mesh.part.size() == 24);
    for (std::size_t t = 0; t < 24; ++t) {
      CHECK(mesh.part[t] == static_cast<std::int32_t>(t / 12));
      CHECK((mesh.vertices[mesh.triangles[t][0]].x > 3) == (t >= 12));
    }
  }
}

TEST_CASE("a library node of COLLADA appears wherever it is named") {
  const Mesh mesh = good(as_dae(
      R"(<node><instance_node url="#k"/></node>
         <node><translate>0 0 7</translate><instance_node url="#k"/></node>)",
      "", R"(<node id="k"><translate>1 0 0</translate><instance_geometry url="#g"/></node>)"));
  CHECK(mesh.triangles.size() == 24);
  spans(mesh, {0, -0.5, 0}, {2, 0.5, 7.25});
}

TEST_CASE("COLLADA brings its unit, keeps its axes, and says which unit counts") {
  const std::string mm = R"(<unit name="millimeter" meter="0.001"/><up_axis>Z_UP</up_axis>)";
  for (const char* up : {"X_UP", "Y_UP", "Z_UP"}) {
    const Mesh mesh = good(as_dae(kPlainDae, with(mm, "Z_UP", up)));
    spans(mesh, {-1e-3, -0.5e-3, 0}, {1e-3, 0.5e-3, 0.25e-3});
    REQUIRE(mesh.remarks.size() == 1);
    CHECK(mesh.remarks[0].find("0.001") != std::string::npos);
  }
  CHECK(good(as_dae(kPlainDae, mm), Unit::mm).remarks.empty());  // they agree
  spans(good(as_dae(kPlainDae, ""), Unit::cm), {-1e-2, -0.5e-2, 0}, {1e-2, 0.5e-2, 0.25e-2});
  refuses(as_dae(kPlainDae, R"(<unit meter="0"/>)"), "no unit of length");
}

TEST_CASE("glTF is in metres whatever unit is given, and says so") {
  const Mesh mesh = good(as_gltf(kPlain), Unit::mm);
  spans(mesh, {-1, -0.5, 0}, {1, 0.5, 0.25});
  REQUIRE(mesh.remarks.size() == 1);
  CHECK(mesh.remarks[0].find("metres") != std::string::npos);
}

TEST_CASE(
    "a buffer beside the file or below it is read; nothing above, elsewhere or in a network") {
  const Folder folder;
  const std::string bytes = buffer(kBox);
  folder.put("a b.bin", bytes);
  folder.put("sub/c.bin", bytes + "padding");
  for (const char* uri : {"a%20b.bin", "./a b.bin", "sub/c.bin"}) {
    CAPTURE(uri);
    const auto mesh = read_mesh(folder.put("m.gltf", gltf(kBox, kPlain, uri)));
    REQUIRE_MESSAGE(mesh, mesh.error());
    CHECK(samples::same_bits(*mesh, weld(kBox)));
  }
  const std::vector<std::string> outside = {"../a b.bin",        "%2e%2e/a b.bin",
                                            "sub/../../a b.bin", "http://a.b/c.bin",
                                            "file:///c.bin",     (folder.path / "a b.bin").string(),
                                            "..\\\\a b.bin",     "a%00"};
  for (const std::string& uri : outside) {
    CAPTURE(uri);
    const auto mesh = read_mesh(folder.put("sub/m.gltf", gltf(kBox, kPlain, uri)));
    REQUIRE_FALSE(mesh);
    CHECK(mesh.error().find("only files in its own folder") != std::string::npos);
  }
  const auto missing = read_mesh(folder.put("m.gltf", gltf(kBox, kPlain, "none.bin")));
  REQUIRE_FALSE(missing);
  CHECK(missing.error().find("no such file") != std::string::npos);
  folder.put("short.bin", bytes.substr(1));
  const auto cut = read_mesh(folder.put("m.gltf", gltf(kBox, kPlain, "short.bin")));
  REQUIRE_FALSE(cut);
  CHECK(cut.error().find("truncated") != std::string::npos);
  refuses({"a.gltf", gltf(kBox, kPlain, "a.bin")}, "out of reach");
}

TEST_CASE("strips, fans and polygons are cut with the winding they have; lines are left out") {
  const samples::Mesh strip{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}, {{0, 1, 2}}, {}, {}, {}};
  const auto up = [](const Mesh& mesh) {  // two triangles, both to +z
    REQUIRE(mesh.triangles.size() == 2);
    for (const auto& t : mesh.triangles) {
      const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
      CHECK((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x) > 0);
    }
  };
  const std::string file = gltf(strip, kPlain, data_uri(buffer(strip)));
  up(good({"a.gltf", with(file, R"("indices":1)", R"("mode":5)")}));
  const std::string xml = dae(strip, "", kPlainDae);
  const std::string three = with(xml, "0 0 1 0 2 0 ", "0 0 1 0 2 0 3 0 ");
  up(good({"a.dae", with(with(three, "<triangles", "<tristrips"), "</triangles", "</tristrips")}));
  const std::string loop = with(xml, "0 0 1 0 2 0 ", "0 0 1 0 3 0 2 0 ");
  up(good({"a.dae", with(with(loop, "<triangles", "<polygons"), "</triangles", "</polygons")}));
  up(good({"a.dae", with(with(loop, "<triangles", "<trifans"), "</triangles", "</trifans")}));
  up(good({"a.dae", with(with(with(loop, "<triangles", "<polylist"), "</triangles", "</polylist"),
                         "<p>", "<vcount>4</vcount><p>")}));

  const Mesh both =
      good({"a.gltf", with(file, R"([{"attributes")",
                           R"([{"mode":1,"attributes":{"POSITION":0}},{"attributes")")});
  CHECK(both.triangles.size() == 1);
  REQUIRE(both.remarks.size() == 1);
  CHECK(both.remarks[0].find("lines are left out") != std::string::npos);
  refuses({"a.gltf", with(file, R"("indices":1)", R"("indices":1,"mode":0)")}, "no triangle");
}

TEST_CASE("what moves is read where it rests, with a remark") {
  const std::string more = R"(,"animations":[{}],"skins":[{"joints":[0]}])";
  const Mesh a =
      good({"a.gltf", gltf(kBox, R"([{"mesh":0,"skin":0}])", data_uri(buffer(kBox)), more)});
  CHECK(a.triangles.size() == 12);
  CHECK(a.remarks.size() == 2);
  const std::string skinned =
      with(as_dae(R"(<node><instance_controller url="#c"/></node>)").bytes, "<library_nodes>",
           R"(<library_controllers><controller id="c"><skin source="#g"/></controller>
              </library_controllers><library_nodes>)");
  const Mesh b = good({"a.dae", skinned});
  CHECK(b.triangles.size() == 12);
  CHECK(b.remarks.size() == 1);
}

TEST_CASE("a file that is wrong is refused with a sentence that names the place") {
  const std::string file = as_gltf(kPlain).bytes;
  refuses({"a.gltf", with(file, R"("version":"2.0")", R"("version":"1.0")")}, "only version 2");
  refuses({"a.gltf", with(file, R"("count":8)", R"("count":9)")}, "accessors 0");
  refuses({"a.gltf", with(file, R"("count":8)", R"("count":18446744073709551615)")}, "accessors 0");
  refuses({"a.gltf", with(file, R"("count":8)", R"("count":7)")}, "names vertex 7");
  refuses({"a.gltf", with(file, R"("count":8)", R"("count":-8)")}, "whole number");
  refuses({"a.gltf", with(file, R"("byteLength":96)", R"("byteLength":960)")}, "bufferViews 0");
  refuses({"a.gltf", with(file, R"("mesh":0)", R"("mesh":1)")}, "nodes 0");
  refuses({"a.gltf", with(file, R"("mesh":0)", R"("mesh":0,"scale":[1e300,1,1])")}, "1e6 m");
  refuses({"a.gltf", with(file, R"("mesh":0)", R"("mesh":0,"scale":[1e999,1,1])")}, "number");
  refuses({"a.gltf", with(file, R"("mesh":0)", R"("mesh":0,"rotation":[0,0,0,0])")}, "quaternion");
  refuses({"a.gltf", with(file, R"("scene":0)",
                          R"("scene":0,"extensionsRequired":["KHR_draco_mesh_compression"])")},
          "KHR_draco");
  refuses({"a.gltf", "{}"}, "asset");
  refuses({"a.gltf", "[1, 2]"}, "no glTF");
  refuses({"a.gltf", std::string(100000, '[')}, "nested too deeply");
  const std::string binary = glb(gltf(kBox, kPlain, ""), buffer(kBox));
  refuses({"a.glb", binary.substr(0, binary.size() - 1)}, "truncated");
  refuses({"a.glb", binary + "more"}, "goes on");
  samples::Mesh bad = kBox;
  bad.vertices[3].y = std::nan("");
  refuses({"a.gltf", gltf(bad, kPlain, data_uri(buffer(bad)))}, "not finite");

  const std::string xml = as_dae(kPlainDae).bytes;
  refuses({"a.dae", with(xml, "-1 -0.5 0", "nan -0.5 0")}, "line 5 (float_array)");
  refuses({"a.dae", with(xml, "count=\"8\"", "count=\"9\"")}, "reaches beyond");
  refuses({"a.dae", with(xml, "count=\"8\"", "count=\"7\"")}, "names vertex 7");
  refuses({"a.dae", with(xml, "<triangles count=\"12\"", "<triangles count=\"13\"")},
          "announces 13");
  refuses({"a.dae", with(xml, "url=\"#g\"", "url=\"#h\"")}, "not there");
  refuses({"a.dae", with(xml, "url=\"#g\"", "url=\"http://a/b.dae#g\"")}, "same file");
  refuses({"a.dae", with(xml, "<!-- a comment -->", "<!DOCTYPE x>")}, "DOCTYPE");
  refuses({"a.dae", with(xml, "</COLLADA>", "")}, "truncated");
  refuses({"a.dae", with(xml, "</COLLADA>", "</b>")}, "closes what is not open");
  refuses({"a.dae", with(kPlainDae, "node", "html")}, "closes");
  std::string deep, ends;
  for (int i = 0; i < 100000; ++i) {
    deep += "<a>";
    ends += "</a>";
  }
  refuses({"a.dae", deep + ends}, "nested too deeply");
  refuses({"a.dae", deep}, "truncated");
  refuses({"a.dae", xml + "<b/>"}, "a second root");
  refuses({"a.dae", with(xml, "<node", "<node name=b")}, "a tag is damaged");
}

TEST_CASE("nodes in a ring, and repetitions without bound, end with a sentence at once") {
  refuses(as_gltf(R"([{"mesh":0,"children":[1]},{"children":[0]}])"), "in itself");
  refuses(as_gltf(R"([{"children":[1,1]},{"mesh":0}])"), "two places");
  refuses(as_dae(R"(<node><instance_node url="#k"/></node>)", "",
                 R"(<node id="k"><instance_node url="#k"/></node>)"),
          "without end");
  std::string library = R"(<node id="k0"><instance_geometry url="#g"/></node>)";  // 10^12 boxes
  for (int i = 1; i <= 12; ++i) {
    library += "<node id=\"k" + std::to_string(i) + "\">";
    for (int k = 0; k < 10; ++k)
      library += "<instance_node url=\"#k" + std::to_string(i - 1) + "\"/>";
    library += "</node>";
  }
  refuses(as_dae(R"(<node><instance_node url="#k12"/></node>)", "", library), "more parts than");
  // Few nodes, a large mesh: 1,000 times 100,000 triangles.
  samples::Mesh large = kBox;
  while (large.triangles.size() < 100'000) large.triangles.push_back({0, 1, 2});
  std::string nodes = R"([{"children":[1)", rest = R"(,{"mesh":0})";
  for (int i = 2; i <= 1000; ++i) nodes += "," + std::to_string(i), rest += R"(,{"mesh":0})";
  refuses({"a.gltf", gltf(large, nodes + "]}" + rest + "]", data_uri(buffer(large)))},
          "more than 50000000 triangles");
}

TEST_CASE("2,000 damaged files of each kind are refused or a mesh") {
  std::mt19937_64 random(20);
  const std::string nodes =
      R"([{"children":[1,2]},{"mesh":0,"name":"a"},{"mesh":0,"scale":[1,-1,2]}])";
  const std::string xml = R"(<node name="n"><translate>1 2 3</translate><rotate>0 0 1 30</rotate>
      <instance_geometry url="#g"/><instance_node url="#k"/></node>)";
  const std::vector<File> files = {
      as_gltf(nodes),
      {"a.glb", glb(gltf(kBox, nodes, ""), buffer(kBox))},
      as_dae(xml, R"(<unit meter="0.01"/>)",
             R"(<node id="k"><scale>1 -1 1</scale><instance_geometry url="#g"/></node>)")};
  static const std::string kEvil[] = {"-1",    "0",    "4294967295", "18446744073709551615",
                                      "1e999", "null", "99",         "[",
                                      "{}",    "<",    "\"",         "#k",
                                      "<a>",   "/>",   "nan",        "\xff\xff\xff\xff"};
  int accepted = 0, refused = 0;
  for (const File& file : files) {
    CAPTURE(file.name);
    for (int round = 0; round < 2000; ++round) {
      CAPTURE(round);
      std::string bytes = file.bytes;
      for (unsigned changes = 1 + random() % 3; changes > 0; --changes) {
        const std::size_t at = random() % bytes.size(), length = 1 + random() % 8;
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
            bytes.insert(at, bytes.substr(random() % bytes.size(), 8 * length));
            break;
          case 4:
            bytes.replace(at, random() % 3, kEvil[random() % std::size(kEvil)]);
            break;
          default:
            if (random() % 8 == 0)
              bytes.resize(at + 1);
            else if (bytes[at] >= '0' && bytes[at] <= '9')
              bytes[at] = static_cast<char>('0' + random() % 10);
        }
        if (bytes.empty()) bytes = " ";
      }
      const auto mesh = parse_mesh(bytes, file.name);
      if (!mesh) {
        ++refused;
        REQUIRE(mesh.error().starts_with(file.name));
        for (const char c : mesh.error()) REQUIRE(static_cast<unsigned char>(c) >= 0x20);
        continue;
      }
      ++accepted;
      REQUIRE_FALSE(mesh->triangles.empty());
      for (const auto& t : mesh->triangles)
        for (const std::uint32_t v : t) REQUIRE(v < mesh->vertices.size());
      for (const Vec3& p : mesh->vertices)
        REQUIRE((std::abs(p.x) <= 1e6 && std::abs(p.y) <= 1e6 && std::abs(p.z) <= 1e6));
      REQUIRE((mesh->part.empty() || mesh->part.size() == mesh->triangles.size()));
      for (const std::int32_t part : mesh->part)
        REQUIRE((part >= 0 && part < static_cast<std::int32_t>(mesh->part_names.size())));
    }
  }
  CHECK(accepted > 300);
  CHECK(refused > 300);
}
