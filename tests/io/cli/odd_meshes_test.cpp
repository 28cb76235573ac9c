// SPDX-License-Identifier: Apache-2.0
// Feeds defective meshes to bakes, info and runs. Each command must end with a clear result or with
// one error sentence.
#include <array>
#include <functional>
#include <limits>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "tests/io/cli/program.h"
#include "tests/support/near.h"

using namespace h6::test;

namespace {

using Point = std::array<double, 3>;
using Triangle = std::array<Point, 3>;
using Triangles = std::vector<Triangle>;

Triangles box(double edge, Point at = {0, 0, 0}) {
  Triangles out;
  for (const Facet& facet : box_facets(1)) {
    Triangle t;
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) t[i][k] = at[k] + edge * facet[i][k];
    out.push_back(t);
  }
  return out;
}

Triangles together(Triangles a, const Triangles& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

Triangles times(int n, const Triangles& some) {
  Triangles out;
  for (; n > 0; --n) out = together(out, some);
  return out;
}

Triangles inside_out(Triangles some) {
  for (Triangle& t : some) std::swap(t[0], t[1]);
  return some;
}

std::string as_stl(const Triangles& some) {
  std::vector<Facet> facets;
  for (const Triangle& t : some) {
    Facet facet;
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) facet[i][k] = static_cast<float>(t[i][k]);
    facets.push_back(facet);
  }
  return stl(facets);
}

std::string as_obj(const Triangles& some) {
  std::ostringstream out;
  out.precision(17);
  for (const Triangle& t : some)
    for (const Point& p : t) out << "v " << p[0] << ' ' << p[1] << ' ' << p[2] << '\n';
  for (std::size_t i = 0; i < some.size(); ++i)
    out << "f " << 3 * i + 1 << ' ' << 3 * i + 2 << ' ' << 3 * i + 3 << '\n';
  return out.str();
}

const double kNan = std::numeric_limits<double>::quiet_NaN(),
             kInf = std::numeric_limits<double>::infinity();
const Triangle kPoint{{{0.1, 0, 0}, {0.1, 0, 0}, {0.1, 0, 0}}},
    kLine{{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}}, kOne{{{0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0}}};

Triangle with(double bad) { return {{{0, 0, 0}, {0.1, 0, 0}, {0, bad, 0}}}; }

struct Odd {
  const char* file;
  std::string bytes;
  const char* refused;  // words of the error sentence of a bake; nullptr if the bake succeeds
  const char* read;     // words of the error sentence if the mesh cannot be read
  const char* warned;   // words of a warning of both bakes; nullptr if none is required
};

std::vector<Odd> odd_meshes() {
  const Triangles good = box(0.1);
  Triangles lost = good;
  lost.erase(lost.begin() + 3);
  const char* const no_area = "area";
  return {
      {"empty.stl", as_stl({}), "no triangle", "no triangle", nullptr},
      {"empty.obj", as_obj({}), "the file is empty", "the file is empty", nullptr},
      {"one.stl", as_stl({kOne}), nullptr, nullptr, "not closed"},
      {"one_of_no_area.stl", as_stl({kPoint}), no_area, nullptr, nullptr},
      {"line.stl", as_stl({kLine}), no_area, nullptr, nullptr},
      {"points.stl", as_stl(times(10, {kPoint})), no_area, nullptr, nullptr},
      {"also_points.stl", as_stl(together(good, {kPoint, kLine})), nullptr, nullptr, nullptr},
      {"needle.stl", as_stl({{{{0, 0, 0}, {1e5, 0, 0}, {0, 1e-7, 0}}}}), nullptr, nullptr, nullptr},
      {"nan.stl", as_stl(together(good, {with(kNan)})), "not finite", "triangle 13", nullptr},
      {"nan.obj", as_obj({with(kNan)}), "not finite", "line 3", nullptr},
      {"infinite.stl", as_stl({kOne, with(-kInf)}), "not finite", "triangle 2", nullptr},
      {"huge.stl", as_stl(box(1e30)), "1e+30", "unit of length", nullptr},
      {"one_huge.obj", as_obj(together(good, {with(1e30)})), "1e+30", "unit of length", nullptr},
      {"wide.stl", as_stl(together(good, box(0.1, {9e5, 9e5, 9e5}))), nullptr, nullptr, nullptr},
      {"twice.stl", as_stl(times(2, good)), nullptr, nullptr, nullptr},
      {"fifty_times.stl", as_stl(times(50, {kOne})), nullptr, nullptr, "not closed"},
      {"inside_out.stl", as_stl(inside_out(good)), nullptr, nullptr, nullptr},
      {"both_ways.stl", as_stl(together(good, inside_out(good))), nullptr, nullptr, nullptr},
      {"lost.stl", as_stl(lost), nullptr, nullptr, "not closed"},
      {"small.stl", as_stl(box(1e-9)), nullptr, nullptr, nullptr},
      {"denormal.stl", as_stl(box(1e-40)), nullptr, nullptr, nullptr},
      {"far.stl", as_stl(box(1e-3, {999e3, 999e3, 999e3})), "62.5 mm apart", nullptr, nullptr},
      {"rather_far.stl", as_stl(box(0.1, {5e3, 0, 0})), nullptr, nullptr, "nearer to its origin"},
  };
}

// Checks that a command did not crash or hang, and ended with success or one error sentence.
void check_end(const Ended& ended, bool may_fail, bool may_succeed) {
  CAPTURE(ended.err);
  CHECK(ended.in_time);
  CHECK((ended.code == 0 || ended.code == 1));
  if (!may_fail) CHECK(ended.code == 0);
  if (!may_succeed) CHECK(ended.code == 1);
  CHECK((ended.err.find("hapsix: ") != std::string::npos) == (ended.code == 1));
  CHECK(ended.err.size() < 2000);
}

void spill_scene(Sandbox& sandbox, const std::string& mesh) {
  Json scene = Json::parse(R"({"hapsix": 1, "units": "m", "duration": 0.02,
    "bodies": [
      {"name": "part", "fixed": true, "field": {"mesh": "", "voxels": 32}},
      {"name": "tool", "mass": 0.1, "com": [0, 0, 0], "inertia": [1e-4, 1e-4, 1e-4, 0, 0, 0],
       "shell": {"mesh": "", "points": 100}}],
    "hands": [{"body": "tool", "device": "path", "path": "hand.csv"}]})");
  scene["bodies"][0]["field"]["mesh"] = mesh;
  scene["bodies"][1]["shell"]["mesh"] = mesh;
  spill(sandbox.file("scene.json"), scene.dump());
  spill(sandbox.file("hand.csv"), "t,x,y,z,qw,qx,qy,qz\n0,0,0,0.05,1,0,0,0\n1,0,0,0,1,0,0,0\n");
}

}  // namespace

TEST_CASE("a mesh of nothing, of too much or of the same again is a result or a sentence") {
  for (const Odd& odd : odd_meshes()) {
    CAPTURE(odd.file);
    Sandbox sandbox;
    spill(sandbox.file(odd.file), odd.bytes);
    spill_scene(sandbox, odd.file);
    const std::set<std::string> before = sandbox.files();
    // With a stated unit no mesh is too large.
    Process field(sandbox,
                  {"bake", "field", odd.file, "-o", "out.vdb", "--voxels", "32", "--units", "m"});
    Process shell(sandbox, {"bake", "shell", odd.file, "-o", "out.ply", "--points", "100",
                            "--voxels", "32", "--units", "m"});
    Process info(sandbox, {"info", odd.file});
    Process scene(sandbox, {"run", "scene.json", "--virtual-time"});
    std::set<std::string> expected = before;
    if (!odd.refused) expected.insert({"out.vdb", "out.ply"});

    for (Process* bake : {&field, &shell}) {
      const Ended ended = bake->wait();
      check_end(ended, odd.refused, !odd.refused);
      if (odd.refused) CHECK(ended.err.find(odd.refused) != std::string::npos);
      if (odd.refused) CHECK(ended.err.find(odd.file) != std::string::npos);
      if (odd.warned) CHECK(ended.err.find(odd.warned) != std::string::npos);
    }
    const Ended facts = info.wait();
    check_end(facts, odd.read, !odd.read);
    if (odd.read) CHECK(facts.err.find(odd.read) != std::string::npos);
    const Ended ran = scene.wait();
    check_end(ran, true, !odd.refused);
    CHECK(sandbox.files() == expected);
  }
}

TEST_CASE("a mesh far from its origin, in a file of doubles, has the field it has at home") {
  Sandbox sandbox;
  const auto bake = [&](const std::string& name, Point at) {
    spill(sandbox.file(name + ".obj"), as_obj(box(1e-3, at)));
    return result_of(sandbox,
                     {"bake", "field", name + ".obj", "-o", name + ".vdb", "--voxels", "64"});
  };
  const Json near = bake("near", {0, 0, 0}), far = bake("far", {999e3, -999e3, 999e3});
  for (const char* key : {"dims", "bricks", "closed", "offset", "warnings"}) {
    CAPTURE(key);
    CHECK(near[key] == far[key]);
  }
  CHECK(far["voxel_size"].get<double>() ==
        h6::test::near(near["voxel_size"].get<double>()).epsilon(1e-5));
  // Shell points have single precision, which is too coarse so far out. A warning must say so.
  const Json shell =
      result_of(sandbox, {"bake", "shell", "far.obj", "-o", "far.ply", "--points", "100"});
  REQUIRE(!shell["warnings"].empty());
  CHECK(shell["warnings"].dump().find("62.5 mm apart") != std::string::npos);
}

TEST_CASE("the same triangles again, inside out or with others of no area are the same field") {
  Sandbox sandbox;
  const Triangles good = box(0.1);
  const auto bytes_of = [&](const Triangles& mesh) {
    spill(sandbox.file("mesh.stl"), as_stl(mesh));
    result_of(sandbox, {"bake", "field", "mesh.stl", "-o", "mesh.vdb", "--voxels", "32"});
    Json info = result_of(sandbox, {"info", "mesh.vdb"});
    info.erase("input_hash"), info.erase("triangles");
    return info;
  };
  const Json plain = bytes_of(good);
  CHECK(plain["sign_mode"] == "closed");
  CHECK(bytes_of(times(3, good)) == plain);
  CHECK(bytes_of(inside_out(good)) == plain);
  CHECK(bytes_of(together(good, {kPoint})) == plain);
}
