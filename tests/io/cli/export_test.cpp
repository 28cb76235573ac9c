// SPDX-License-Identifier: Apache-2.0
// hapsix export: what it writes has what the recording or the field has.
#include <map>

#include "tests/io/cli/program.h"

using namespace h6::test;

namespace {

std::vector<std::string> cells(const std::string& line) {
  std::vector<std::string> out;
  std::istringstream in(line);
  for (std::string cell; std::getline(in, cell, ',');) out.push_back(cell);
  return out;
}
std::size_t column(const std::string& head, const std::string& name) {
  const auto all = cells(head);
  const auto found = std::find(all.begin(), all.end(), name);
  REQUIRE_MESSAGE(found != all.end(), name);
  return static_cast<std::size_t>(found - all.begin());
}

// bend.h5: a tool pressed on a plate that bends. `more`: options of the bake.
void record_bend(Sandbox& box, const Args& more) {
  REQUIRE(run(box, {"scene", "export", "box-on-plates", "."}).code == 0);
  Args bake{"bake", "deformable", "large.stl", "--units",
            "mm",   "--cell",     "1",         "--young",
            "1e5",  "--poisson",  "0.4",       "--density",
            "1000", "--modes",    "4",         "--fix-box=-21,-12,-3,-7,-10.9,1",
            "-o",   "plate.h5"};
  bake.insert(bake.end(), more.begin(), more.end());
  const Ended baked = run(box, bake);
  REQUIRE_MESSAGE(baked.code == 0, baked.err);
  spill(box.file("hand.csv"),
        "t,x,y,z,qw,qx,qy,qz\n0,-31.75,8,2.2,1,0,0,0\n0.2,-31.75,8,1,1,0,0,0\n0.4,-31.75,8,1,1,0,0,"
        "0\n");
  spill(box.file("bend.json"), R"({"hapsix": 1, "units": "mm", "contact": {"stiffness": 1e4},
    "bodies": [
      {"name": "plate", "fixed": true,
       "shell": {"mesh": "large.stl", "points": 2000, "bends": "plate.h5"}},
      {"name": "tool", "mass": 0.05, "pose": {"p": [-31.75, 8, 2.2], "q": [1, 0, 0, 0]},
       "field": {"mesh": "small.stl", "voxel_size": 0.15}}],
    "hands": [{"body": "tool", "path": "hand.csv"}]})");
  const Ended ran = run(box, {"run", "bend.json", "--virtual-time", "--record", "bend.h5"});
  REQUIRE_MESSAGE(ran.code == 0, ran.err);
}

}  // namespace

TEST_CASE("a recording as CSV: a row for each frame, and every contact of every frame") {
  Sandbox box;
  // Under `firm` contacts are deeper or shallower than the report says, by up to 0.025 voxel.
  REQUIRE(run(box, {"run", "peg-in-hole", "--method", "robust", "--virtual-time", "--duration",
                    "0.8", "--record", "run.h5"})
              .code == 0);
  const Ended rigid = run(box, {"export", "run.h5", "-o", "run.csv", "--bends", "q.csv"});
  CHECK(rigid.code == 1);
  CHECK_MESSAGE(rigid.err.find("nothing in its scene bends") != std::string::npos, rigid.err);
  for (const char* name : {"q.csv", "run.csv"}) CHECK(box.files().count(name) == 0);
  const Ended done = run(box, {"export", "run.h5", "-o", "run.csv", "--contacts", "c.csv"});
  REQUIRE_MESSAGE(done.code == 0, done.err);
  std::istringstream frames(slurp(box.file("run.csv"))), contacts(slurp(box.file("c.csv")));
  std::string head, line, contact_head;
  std::getline(frames, head), std::getline(contacts, contact_head);
  const std::size_t count_at = column(head, "contacts"), depth_at = column(head, "max_depth"),
                    width = cells(head).size();
  column(head, "hand_pose_qw"), column(head, "wrench_fz"), column(head, "stage_us_weights");
  std::map<std::string, std::pair<int, double>> found;  // by frame: contacts, the deepest
  const std::size_t frame_at = column(contact_head, "frame"),
                    contact_depth = column(contact_head, "depth"),
                    weight = column(contact_head, "weight"), load = column(contact_head, "load"),
                    with = column(contact_head, "with");
  while (std::getline(contacts, line)) {
    const auto c = cells(line);
    REQUIRE(c.size() == cells(contact_head).size());
    auto& [n, deepest] = found[c[frame_at]];
    ++n;
    deepest = std::max(deepest, std::stod(c[contact_depth]));
    const double of = std::stod(c[weight]), loaded = std::stod(c[load]);
    CHECK(of >= 0);
    CHECK(std::fabs(of * std::stod(c[contact_depth]) - loaded) <= 1e-5 * loaded + 1e-15);
    CHECK(c[with] == "\"block\"");
  }
  const std::size_t number = column(head, "frame");
  std::size_t rows = 0, touching = 0;
  while (std::getline(frames, line)) {
    const auto c = cells(line);
    REQUIRE(c.size() == width);
    ++rows;
    const auto& [n, deepest] = found[c[number]];
    CHECK(n == std::stoi(c[count_at]));
    if (n == 0) continue;
    ++touching;
    CHECK(std::fabs(deepest - std::stod(c[depth_at])) < 1e-6 * deepest + 1e-12);
  }
  CHECK(rows == 800);
  CHECK(touching > 10);
}

TEST_CASE("a field as a plain level set is read back, and by OpenVDB's Python where it is there") {
  Sandbox box;
  REQUIRE(run(box, {"scene", "export", "box-on-plates", "."}).code == 0);
  REQUIRE(
      run(box, {"bake", "field", "small.stl", "--units", "mm", "--voxels", "32", "-o", "field.vdb"})
          .code == 0);
  const Ended done = run(box, {"export", "field.vdb", "-o", "plain.vdb"});
  REQUIRE_MESSAGE(done.code == 0, done.err);
  CHECK(run(box, {"info", "plain.vdb"}).code == 0);
  const std::string folder = "cd " + box.folder().string() + " && ";
  if (std::system("/usr/bin/python3 -c 'import pyopenvdb' 2> /dev/null") != 0) {
    MESSAGE("skipped: no python3-openvdb here");
    return;
  }
  CHECK(std::system((folder + "/usr/bin/python3 -c \"import pyopenvdb as v; g = "
                              "v.readAll('plain.vdb')[0]; assert len(g) == 1; assert g[0].name == "
                              "'distance' and g[0].activeVoxelCount() > 1000\"")
                        .c_str()) == 0);
}

TEST_CASE(
    "shapes of a body that bends as CSV: a row for each frame, bent while something presses") {
  Sandbox box;
  record_bend(box, {});
  const Ended done = run(box, {"export", "bend.h5", "-o", "bend.csv", "--bends", "q.csv"});
  REQUIRE_MESSAGE(done.code == 0, done.err);
  std::istringstream shapes(slurp(box.file("q.csv")));
  std::string head, line;
  std::getline(shapes, head);
  CHECK(head == "t,frame,body,q1,q2,q3,q4");
  double first = 0, last = 0;
  int rows = 0;
  while (std::getline(shapes, line)) {
    const auto c = cells(line);
    REQUIRE(c.size() == 7);
    CHECK(c[2] == "\"plate\"");
    double size = 0;
    for (std::size_t j = 3; j < 7; ++j) size += std::fabs(std::stod(c[j]));
    (rows++ ? last : first) = size;
  }
  CHECK(rows == 400);
  std::istringstream frames(slurp(box.file("bend.csv")));
  for (std::string row; std::getline(frames, row);) line = row;
  double of_frames = 0;  // the last columns are those of body 0
  const auto c = cells(line);
  for (std::size_t j = c.size() - 4; j < c.size(); ++j) of_frames += std::fabs(std::stod(c[j]));
  CHECK(of_frames == last);
  CHECK(first == 0);
  CHECK(last > 0);
  const Ended none = run(box, {"export", "bend.h5", "-o", "bend.csv", "--bends", "no/q.csv"});
  CHECK(none.code != 0);
}

TEST_CASE("a warped model says so, and what it does is replayed to the bit") {
  Sandbox box;
  record_bend(box, {"--warp"});
  CHECK(result_of(box, {"info", "plate.h5"})["warp"] == true);
  CHECK(result_of(box, {"replay", "bend.h5", "--verify"})["same"] == true);
}

TEST_CASE("every contact as HDF5 columns: the same as in CSV") {
  if (std::system("/usr/bin/python3 -c 'import h5py' 2> /dev/null") != 0) {
    MESSAGE("skipped: no h5py");
    return;
  }
  Sandbox box;
  REQUIRE(
      run(box, {"run", "peg-in-hole", "--virtual-time", "--duration", "0.8", "--record", "run.h5"})
          .code == 0);
  for (const char* to : {"c.csv", "c.h5"}) {
    const Ended done = run(box, {"export", "run.h5", "-o", "run.csv", "--contacts", to});
    REQUIRE_MESSAGE(done.code == 0, done.err);
  }
  spill(box.file("compare.py"), R"(
import csv, h5py
with h5py.File("c.h5") as h5, open("c.csv") as text:
    names, columns = list(h5.attrs["names"]), {name: h5[name][()] for name in h5}
    rows = list(csv.DictReader(text))
    assert len(rows) > 1000 and all(len(column) == len(rows) for column in columns.values())
    for i, row in enumerate(rows):
        assert row["part"] == names[columns["body"][i]] and row["with"] == names[columns["with"][i]]
        for name, column in columns.items():
            if name != "with":
                assert abs(float(row[name]) - float(column[i])) <= 1e-6 * max(1e-3, abs(column[i])), (i, name)
    assert h5["depth"].attrs["units"] == "m" and h5["frame"].dtype == "uint64"
)");
  CHECK(std::system(
            ("cd '" + box.folder().string() + "' && /usr/bin/python3 compare.py").c_str()) == 0);
}

TEST_CASE("a file that brings the HDF5 library down gets one sentence, and the program goes on") {
  Sandbox box;
  const fs::path found =
      fs::path(HAPSIX_SOURCE_DIR) / "tests/fuzz/findings/deformable/heap-at-nowhere";
  fs::copy_file(found, box.file("bad.h5"));
  for (const Args& words : {Args{"info", "bad.h5"}, Args{"replay", "bad.h5"},
                            Args{"export", "bad.h5", "-o", "out.csv"}}) {
    const Ended e = run(box, words);
    CAPTURE(e.err);
    CHECK(e.code == 1);
    CHECK(std::count(e.err.begin(), e.err.end(), '\n') == 1);
  }
}

TEST_CASE("what cannot be exported gets one sentence, and no file is made") {
  Sandbox box;
  spill(box.file("run.h5"), "no recording");
  for (const Args& wrong :
       {Args{"export", "run.h5", "-o", "out.csv"}, Args{"export", "run.h5", "-o", "out.mcap"},
        Args{"export", "run.h5", "-o", "out.vdb"}, Args{"export", "none.vdb", "-o", "out.vdb"},
        Args{"export", "none.vdb", "-o", "out.vdb", "--contacts", "c.csv"}}) {
    const Ended e = run(box, wrong);
    CAPTURE(e.err);
    CHECK(e.code != 0);
    CHECK(std::count(e.err.begin(), e.err.end(), '\n') == 1);
    CHECK(box.files() == std::set<std::string>{"run.h5"});
  }
}
