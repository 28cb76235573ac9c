// SPDX-License-Identifier: Apache-2.0
// A recording replays bit for bit, and a replay reports where a difference is.
#include <hdf5.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <set>
#include <string>
#include <thread>

#include "tests/io/cli/program.h"

using namespace h6::test;

namespace {

// Opens a recording's dataset to be changed in place.
struct Dataset {
  hid_t file, data, type, space;
  hsize_t dims[3] = {1, 1, 1};
  int rank;
  std::size_t cell;
  Dataset(const fs::path& name, const std::string& column)
      : file(H5Fopen(name.c_str(), H5F_ACC_RDWR, H5P_DEFAULT)),
        data(
            H5Dopen2(file, (column[0] == '/' ? column : "/frames/" + column).c_str(), H5P_DEFAULT)),
        type(H5Dget_type(data)),
        space(H5Dget_space(data)),
        rank(H5Sget_simple_extent_dims(space, dims, nullptr)),
        cell(H5Tget_size(type)) {
    REQUIRE(rank > 0);
  }
  Dataset(const Dataset&) = delete;
  Dataset& operator=(const Dataset&) = delete;
  ~Dataset() { H5Sclose(space), H5Tclose(type), H5Dclose(data), H5Fclose(file); }
  std::vector<unsigned char> read() const {
    std::vector<unsigned char> all(dims[0] * dims[1] * dims[2] * cell);
    REQUIRE(H5Dread(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, all.data()) >= 0);
    return all;
  }
  void write(const std::vector<unsigned char>& all) const {
    REQUIRE(H5Dwrite(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, all.data()) >= 0);
  }
};

// Flips the last bit of one number of a column, in place.
void flip_bit(const fs::path& file, const std::string& column, hsize_t frame, hsize_t cell) {
  const Dataset set(file, column);
  std::vector<unsigned char> all = set.read();
  all[(frame * set.dims[1] * set.dims[2] + cell) * set.cell] ^= 1;
  set.write(all);
}

std::vector<std::string> datasets_of(const fs::path& file) {
  std::vector<std::string> names;
  const hid_t h5 = H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  const auto one = [](hid_t, const char* name, const H5L_info_t*, void* all) -> herr_t {
    static_cast<std::vector<std::string>*>(all)->emplace_back(name);
    return 0;
  };
  const hid_t group = H5Gopen2(h5, "/frames", H5P_DEFAULT);
  REQUIRE(H5Literate(group, H5_INDEX_NAME, H5_ITER_INC, nullptr, one, &names) >= 0);
  H5Gclose(group), H5Fclose(h5);
  return names;
}

// Gives an attribute another value: a number one more, a text one letter more in its last cell.
void change_attribute(const fs::path& file, const std::string& object, const char* name) {
  const hid_t h5 = H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT),
              at = H5Oopen(h5, object.c_str(), H5P_DEFAULT), a = H5Aopen(at, name, H5P_DEFAULT),
              type = H5Aget_type(a), space = H5Aget_space(a);
  const auto cells = static_cast<std::size_t>(H5Sget_simple_extent_npoints(space));
  REQUIRE(cells > 0);
  if (H5Tget_class(type) == H5T_STRING) {
    std::vector<char*> texts(cells);
    REQUIRE(H5Aread(a, type, texts.data()) >= 0);
    const std::string longer = std::string(texts.back()) + "x";
    std::vector<const char*> changed(texts.begin(), texts.end());
    changed.back() = longer.c_str();
    REQUIRE(H5Awrite(a, type, changed.data()) >= 0);
    H5Dvlen_reclaim(type, space, H5P_DEFAULT, texts.data());
  } else {
    double number = 0;
    REQUIRE(H5Aread(a, H5T_NATIVE_DOUBLE, &number) >= 0);
    ++number;
    REQUIRE(H5Awrite(a, H5T_NATIVE_DOUBLE, &number) >= 0);
  }
  H5Sclose(space), H5Tclose(type), H5Aclose(a), H5Oclose(at), H5Fclose(h5);
}

// Replaces `from` by `to`, which has the same length, in the head of a recording.
void change_head(const fs::path& file, const std::string& from, const std::string& to) {
  REQUIRE(from.size() == to.size());
  const hid_t h5 = H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  const hid_t data = H5Dopen2(h5, "/config/whole", H5P_DEFAULT), type = H5Dget_type(data);
  std::string text(H5Tget_size(type), '\0');
  REQUIRE(H5Dread(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, text.data()) >= 0);
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  text.replace(at, from.size(), to);
  REQUIRE(H5Dwrite(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, text.data()) >= 0);
  H5Tclose(type), H5Dclose(data), H5Fclose(h5);
}

// Runs a scene in which the hand pushes a ball 5 mm into the top of a block.
Json ball_and_block(Sandbox& box) {
  spill(box.file("ball.stl"), stl(sphere_facets(20, 16)));
  spill(box.file("block.stl"), stl(box_facets(60)));
  spill(box.file("hand.csv"),
        "t,x,y,z,qw,qx,qy,qz\n0,30,30,85,1,0,0,0\n0.5,30,30,75,1,0,0,0\n0.8,33,30,75,1,0,0,0\n");
  return Json::parse(R"({"hapsix": 1, "units": "mm",
    "bodies": [{"name": "block", "fixed": true, "pose": {"p": [50.5, -6.5, 0], "q": [0.8, 0, 0, 0.6]},
                "field": {"mesh": "block.stl", "voxel_size": 1.3}},
               {"name": "ball", "mass": 0.1, "pose": {"p": [30,30,85]},
                "shell": {"mesh": "ball.stl", "points": 800}}],
    "contact": {"torque_length": 0.7},
    "hands": [{"body": "ball", "path": "hand.csv"}]})");
}

}  // namespace

TEST_CASE("a recording has the same bits on one thread and on two, each time") {
  Sandbox box;
  result_of(box,
            {"run", "alpha-shortcut", "--virtual-time", "--duration", "3", "--record", "a.h5"});
  std::set<std::string> hashes;
  for (const char* threads : {"1", "2", "3", "8"}) {
    const Json json = result_of(box, {"replay", "a.h5", "--verify", "--threads", threads});
    CHECK(json["same"] == true);
    CHECK(json["divergence"].is_null());
    CHECK(json["frames"] == 3000);
    CHECK(json["replayed"]["contacts"]["max"] > 10);
    hashes.insert(json["replayed"]["hash"]);
    hashes.insert(json["recorded"]["hash"]);
  }
  CHECK(hashes.size() == 1);
}

TEST_CASE("a run with friction and substeps replays to the bit") {
  Sandbox box;
  Json scene = ball_and_block(box);
  spill(box.file("hand.csv"),
        "t,x,y,z,qw,qx,qy,qz\n0,30,30,85,1,0,0,0\n0.02,30,30,75,1,0,0,0\n"
        "0.3,33,28,75,0.8,0,0,0.6\n0.32,24,34,76,1,0,0,0\n0.5,30,30,75,0.8,0,0.6,0\n");
  // Without friction, and with one step a frame, the same hand makes another run.
  std::set<std::string> hashes;
  for (const double friction : {0.4, 0.0})
    for (const int substeps : {16, 1}) {
      scene["contact"]["friction"] = friction;
      scene["max_substeps"] = substeps;
      spill(box.file("scene.json"), scene.dump());
      result_of(box,
                {"run", "scene.json", "--virtual-time", "--duration", "0.6", "--record", "run.h5"});
      for (const char* threads : {"1", "2"}) {
        const Json json = result_of(box, {"replay", "run.h5", "--verify", "--threads", threads});
        CHECK(json["same"] == true);
        CHECK(json["frames"] == 600);
        hashes.insert(json["replayed"]["hash"]);
      }
    }
  CHECK(hashes.size() == 4);
}

TEST_CASE("real time and virtual time, people and arms: every run replays") {
  Sandbox box;
  const Args runs[] = {
      {"run", "peg-in-hole", "--duration", "0.4"},
      {"run", "peg-in-hole", "--duration", "0.4", "--threads", "2"},
      {"run", "box-on-wall", "--duration", "0.4", "--budget", "0.001"},
      {"run", "box-on-wall", "--duration", "0.4", "--virtual-time", "--device", "simulated"},
      {"run", "box-on-wall", "--duration", "0.4", "--virtual-time", "--device", "arm"},
      {"run", "box-on-wall", "--duration", "0.4", "--virtual-time", "--method", "series"},
      {"run", "box-on-wall", "--duration", "0.4", "--virtual-time", "--method", "gauss6+facing"}};
  for (Args args : runs) {
    args.insert(args.end(), {"--record", "run.h5"});
    const Json recorded = result_of(box, args);
    if (recorded["records_lost"] > 0) continue;  // the machine stalled, so frames are missing
    const Json json = result_of(box, {"replay", "run.h5", "--verify"});
    CHECK(json["same"] == true);
    CHECK(json["frames"] == recorded["frames"]);
    // Every late frame has an event with its cause and counts in the histogram of that cause.
    const Json& deadline = recorded["deadline"];
    for (const char* cause : {"compute", "wakeup", "stolen"}) {
      using Names = std::set<std::string>;
      const Names said = std::string(cause) == "compute"
                             ? Names{"late: own computation", "late: the machine",
                                     "late: own computation or the machine"}
                             : Names{std::string("late: ") +
                                     (std::string(cause) == "wakeup" ? "wake-up" : "stolen")};
      long events = 0, in_bins = 0;
      for (const Json& event : recorded["events"]) events += said.count(event["what"]) > 0;
      for (const Json& frames : deadline["late_us"][cause]) in_bins += frames.get<long>();
      CHECK(in_bins == deadline[std::string("missed_") + cause]);
      if (recorded["events_dropped"] == 0) CHECK(events == in_bins);
    }
    const bool coarse = std::find(args.begin(), args.end(), "--budget") != args.end();
    CHECK((recorded["coarse"]["frames"] > 0) == coarse);
    CHECK(json["replayed"]["verdict"] == recorded["verdict"]);
    CHECK(json["replayed"]["max_depth_voxels"] == recorded["max_depth_voxels"]);
  }
}

TEST_CASE("a flipped bit is found at its frame, with its column") {
  Sandbox box;
  result_of(box, {"run", "peg-in-hole", "--virtual-time", "--record", "good.h5"});
  struct Flip {
    const char* column;
    hsize_t frame, cell;
  };
  for (const Flip& flip :
       {Flip{"hand_pose", 731, 2}, Flip{"hand_pose", 5000, 4}, Flip{"hand_velocity", 12, 1},
        Flip{"body_pose", 401, 5}, Flip{"max_depth", 1200, 0}, Flip{"wrench", 777, 2},
        Flip{"cause", 3, 0}, Flip{"hash", 0, 0}}) {
    CAPTURE(std::string(flip.column));
    const hsize_t frame = flip.frame % 1400;
    fs::copy_file(box.file("good.h5"), box.file("bad.h5"), fs::copy_options::overwrite_existing);
    flip_bit(box.file("bad.h5"), flip.column, frame, flip.cell);
    const Ended ended = run(box, {"replay", "bad.h5", "--verify", "--json"});
    CHECK(ended.code == 1);
    const Json json = Json::parse(ended.out);
    CHECK(json["same"] == false);
    CHECK(json["divergence"]["frame"] == frame);
    const std::string said = json["error"];
    CHECK(said.find("frame " + std::to_string(frame)) != std::string::npos);
    // A changed result is reported by its own name, a changed input by the first result it affects.
    if (std::string(flip.column).rfind("hand_", 0) != 0)
      CHECK(json["divergence"]["column"] == flip.column);
    if (std::string(flip.column) == "body_pose") CHECK(json["divergence"]["cell"] == "qy");
  }
}

TEST_CASE("a flipped bit in any number of a recording is found, in real time too") {
  Sandbox box;
  for (const char* clock : {"--virtual-time", "--threads=1"}) {
    const Json made =
        result_of(box, {"run", "peg-in-hole", "--duration", "0.3", clock, "--record", "good.h5"});
    if (made["records_lost"] > 0) continue;
    REQUIRE(result_of(box, {"replay", "good.h5", "--verify"})["sealed"] == true);
    const std::vector<std::string> names = datasets_of(box.file("good.h5"));
    CHECK(names.size() > 30);
    for (const std::string& name : names) {
      CAPTURE(name);
      fs::copy_file(box.file("good.h5"), box.file("bad.h5"), fs::copy_options::overwrite_existing);
      flip_bit(box.file("bad.h5"), name, 222, 0);
      const Ended ended = run(box, {"replay", "bad.h5", "--verify", "--json"});
      CHECK(ended.code == 1);
      if (name == "state" || name == "frame" || name == "settings") continue;  // other sentences
      CHECK(Json::parse(ended.out)["divergence"]["frame"] == 222);
    }
  }
}

TEST_CASE("a changed head, event or summary is found, and named") {
  Sandbox box;
  result_of(box, {"run", "peg-in-hole", "--virtual-time", "--record", "good.h5"});
  struct Change {
    const char *dataset, *named;
  };
  for (const Change& change :
       {Change{"/config/whole", "its head"}, Change{"/config/seal", "its head"},
        Change{"/events/t", "event 0 ("}, Change{"/events/what", "event 0 ("},
        Change{"/events/detail", "event 0 ("}, Change{"/events/seal", "event 0 ("},
        Change{"/summary/whole", "its summary"}, Change{"/summary/seal", "its summary"}}) {
    CAPTURE(std::string(change.dataset));
    fs::copy_file(box.file("good.h5"), box.file("bad.h5"), fs::copy_options::overwrite_existing);
    {
      const Dataset set(box.file("bad.h5"), change.dataset);
      std::vector<unsigned char> all = set.read();
      // A digit of the text of a head or a summary; elsewhere the first byte.
      const auto digit = std::find(all.begin(), all.end(), '7');
      const bool text = std::string(change.dataset).find("whole") != std::string::npos;
      REQUIRE((!text || digit != all.end()));
      (text ? *digit : all[0]) ^= 1;
      set.write(all);
    }
    const Ended ended = run(box, {"replay", "bad.h5", "--verify", "--json"});
    CHECK(ended.code == 1);
    const std::string said = Json::parse(ended.out)["error"];
    CHECK(said.find(change.named) != std::string::npos);
    CHECK(said.find("was changed after it was recorded") != std::string::npos);
  }
}

TEST_CASE("an attribute that no longer repeats what the recording says is found, and named") {
  Sandbox box;
  result_of(box,
            {"run", "peg-in-hole", "--virtual-time", "--duration", "0.1", "--record", "good.h5"});
  struct Change {
    const char *object, *name;
  };
  for (const Change& change :
       {Change{"config", "rate"}, Change{"config", "hands"}, Change{"config", "version"},
        Change{"config", "json"}, Change{"config", "run"}, Change{"config", "program"},
        Change{"config", "simd_target"}, Change{"config", "asset_hashes"},
        Change{"config", "cause_names"}, Change{"config", "units"}, Change{"summary", "json"},
        Change{"frames/wrench", "units"}, Change{"frames/body_pose", "columns"},
        Change{"events/t", "units"}}) {
    const std::string named = "the attribute " + std::string(change.name) + " of /" + change.object;
    CAPTURE(named);
    fs::copy_file(box.file("good.h5"), box.file("bad.h5"), fs::copy_options::overwrite_existing);
    change_attribute(box.file("bad.h5"), change.object, change.name);
    const Ended ended = run(box, {"replay", "bad.h5", "--verify", "--json"});
    CHECK(ended.code == 1);
    const std::string said = Json::parse(ended.out)["error"];
    CHECK(said.find(named) == 0);
  }
}

TEST_CASE("a recording whose wrenches were all replaced is not the same") {
  Sandbox box;
  result_of(box, {"run", "peg-in-hole", "--virtual-time", "--duration", "0.2", "--record", "a.h5"});
  {
    const Dataset wrench(box.file("a.h5"), "wrench");
    std::vector<unsigned char> all = wrench.read();
    const double wrong = 999;
    for (std::size_t at = 0; at < all.size(); at += 8) std::memcpy(&all[at], &wrong, 8);
    wrench.write(all);
  }
  const Ended ended = run(box, {"replay", "a.h5", "--verify", "--json"});
  CHECK(ended.code == 1);
  const Json json = Json::parse(ended.out);
  CHECK(json["divergence"]["column"] == "wrench");
  CHECK(json["divergence"]["recorded"] == 999);
  // Its seal goes with it: what can be computed is compared all the same.
  const hid_t h5 = H5Fopen(box.file("a.h5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  REQUIRE(H5Ldelete(h5, "/frames/seal", H5P_DEFAULT) >= 0);
  H5Fclose(h5);
  CHECK(run(box, {"replay", "a.h5", "--verify"}).code == 1);
}

TEST_CASE("files come back to the bit, from where they were or from beside the recording") {
  Sandbox box;
  spill(box.file("scene.json"), ball_and_block(box).dump());
  const Json recorded =
      result_of(box, {"run", "scene.json", "--virtual-time", "--record", "run.h5"});
  REQUIRE(recorded["contacts"]["max"] > 0);
  const auto verified = [&](const std::string& file) {
    return result_of(box, {"replay", file, "--verify"})["same"] == true;
  };
  CHECK(verified("run.h5"));
  // The recording contains the hand's path and the scene.
  fs::remove(box.file("hand.csv")), fs::remove(box.file("scene.json"));
  CHECK(verified("run.h5"));
  fs::create_directory(box.file("else"));
  for (const char* name : {"ball.stl", "block.stl", "run.h5"})
    fs::rename(box.file(name), box.file("else") / name);
  CHECK(verified("else/run.h5"));

  // One part has changed; below, one is missing.
  spill(box.file("else") / "block.stl", stl(box_facets(61)));
  const Ended other = run(box, {"replay", "else/run.h5", "--verify"});
  CHECK(other.code == 1);
  CHECK(other.err.find("the field of body 'block' is not the one") != std::string::npos);
  fs::remove(box.file("else") / "ball.stl");
  const Ended gone = run(box, {"replay", "else/run.h5"});
  CHECK(gone.code == 1);
  CHECK(gone.err.find("ball.stl is not there any more") != std::string::npos);
}

TEST_CASE(
    "a scene that bends comes back to the bit, from any folder, and from beside the recording") {
  Sandbox box;
  REQUIRE(run(box, {"scene", "export", "clip-and-rod", "scene"}).code == 0);
  result_of(box, {"run", "scene/scene.json", "--virtual-time", "--duration", "0.2", "--record",
                  "run.h5"});
  CHECK(result_of(box, {"replay", "run.h5", "--verify"})["same"] == true);
  fs::rename(box.file("scene"), box.file("moved"));
  const Ended gone = run(box, {"replay", "run.h5", "--verify"});
  CHECK(gone.code == 1);
  CHECK(gone.err.find("is not there any more") != std::string::npos);
  fs::rename(box.file("run.h5"), box.file("moved/run.h5"));
  CHECK(result_of(box, {"replay", "moved/run.h5", "--verify"})["same"] == true);
}

TEST_CASE("a coordinate of a body that bends is computed again, and a changed one is named") {
  Sandbox box;
  REQUIRE(run(box, {"scene", "export", "clip-and-rod", "scene"}).code == 0);
  const Args record{"run", "scene/scene.json", "--virtual-time", "--duration", "0.45", "--record"};
  const auto recorded = [&](const char* file, std::vector<std::string> more) {
    Args args = record;
    args.push_back(file);
    args.insert(args.end(), more.begin(), more.end());
    result_of(box, args);
    return Dataset(box.file(file), "bend_0").read();
  };
  const auto one = recorded("run.h5", {}), two = recorded("two.h5", {"--threads", "2"});
  CHECK(one == two);
  double last = 0;
  std::memcpy(&last, one.data() + one.size() - sizeof last, sizeof last);
  CHECK(last != 0);
  // An older recording does not say what bends: it replays, and its shapes are computed again.
  change_head(box.file("two.h5"), "\"bends\":[", "\"-----\":[");
  CHECK(run(box, {"replay", "two.h5"}).code == 0);
  for (const std::string name : {"run", "two"}) {
    const Ended done =
        run(box, {"export", name + ".h5", "-o", "all.csv", "--bends", name + ".csv"});
    REQUIRE_MESSAGE(done.code == 0, done.err);
    CHECK((slurp(box.file("all.csv")).find("bend_0_q1") != std::string::npos) == (name == "run"));
  }
  CHECK(slurp(box.file("run.csv")).size() > 1000);
  CHECK(slurp(box.file("run.csv")) == slurp(box.file("two.csv")));
  flip_bit(box.file("run.h5"), "bend_0", 400, 2);
  const Ended changed = run(box, {"replay", "run.h5", "--verify"});
  CHECK(changed.code == 1);
  CHECK_MESSAGE(changed.err.find("frame 400 (0.4000 s) is not what was recorded: bend_0 q3") !=
                    std::string::npos,
                changed.err);
}

TEST_CASE("a baked file that was changed since is told from the one that was recorded") {
  Sandbox box;
  Json scene = ball_and_block(box);
  const Args bake{"bake", "shell", "ball.stl", "-o", "ball.ply", "--units", "mm"};
  const auto with_points = [&](const char* points) {
    Args args = bake;
    args.insert(args.end(), {"--points", points});
    return run(box, args).code;
  };
  REQUIRE(with_points("800") == 0);
  scene["bodies"][1]["shell"] = {{"file", "ball.ply"}};
  spill(box.file("scene.json"), scene.dump());
  result_of(box, {"run", "scene.json", "--virtual-time", "--record", "run.h5"});
  CHECK(result_of(box, {"replay", "run.h5", "--verify"})["same"] == true);
  REQUIRE(with_points("801") == 0);
  const Ended other = run(box, {"replay", "run.h5"});
  CHECK(other.code == 1);
  CHECK(other.err.find("the shell of body 'ball' is not the one") != std::string::npos);
}

TEST_CASE("the same hand runs with another method, and nothing is compared") {
  Sandbox box;
  result_of(box, {"run", "peg-in-hole", "--virtual-time", "--record", "run.h5"});
  const Json json = result_of(box, {"replay", "run.h5", "--method", "none"});
  CHECK(json["method"] == "none");
  CHECK(json["recorded_method"] == "firm");
  CHECK_FALSE(json.contains("same"));
  CHECK(json["replayed"]["hash"] != json["recorded"]["hash"]);
  CHECK(json["replayed"]["max_depth_voxels"] < json["recorded"]["max_depth_voxels"]);
  CHECK(run(box, {"replay", "run.h5", "--method", "none", "--verify"}).code == 2);
  CHECK(run(box, {"replay", "run.h5", "--method", "nose"}).code == 2);
  CHECK(run(box, {"replay", "run.h5", "--threads", "65"}).code == 2);
  CHECK(run(box, {"replay", "gone.h5"}).code == 1);
  spill(box.file("text.h5"), "no recording");
  CHECK(run(box, {"replay", "text.h5"}).code == 1);
}

TEST_CASE(
    "a recording of another instruction set is replayed on that set, or the replay says it "
    "cannot") {
  Sandbox box;
  const Json recorded =
      result_of(box, {"run", "peg-in-hole", "--virtual-time", "--record", "run.h5"});
  const std::string target = recorded["simd_target"];
  const auto as_if = [&](std::string other) {
    other.resize(target.size(), ' ');
    fs::copy_file(box.file("run.h5"), box.file("other.h5"), fs::copy_options::overwrite_existing);
    change_head(box.file("other.h5"), "\"simd_target\":\"" + target, "\"simd_target\":\"" + other);
    return run(box, {"replay", "other.h5", "--verify", "--json"});
  };
  const Ended unknown = as_if("M");
  CHECK(unknown.err.find("does not have") != std::string::npos);
  // Only the recorded name is wrong. The bits agree, and the seal tells.
  CHECK(unknown.code == 1);
  CHECK(unknown.err.find("its head was changed after it was recorded") != std::string::npos);
  if (target != "AVX3") return;
  const Ended old = as_if("SSE4");
  CHECK(old.code == 1);
  const Json json = Json::parse(old.out);
  CHECK(json["simd_target"] == "SSE4");
  CHECK(json["same"] == false);
  CHECK(std::string(json["error"]).find("recorded on SSE4") == std::string::npos);
}

TEST_CASE("frames that the recorder was too slow for are computed again from their inputs") {
  if (kSanitized) return;  // preloaded libraries do not go with it
  Sandbox box;
  setenv("LD_PRELOAD", HAPSIX_SLOW_DISK, 1);  // hangs for 6 s; the ring has room for 4 s
  const Json recorded =
      result_of(box, {"run", "peg-in-hole", "--duration", "8", "--record", "run.h5"});
  unsetenv("LD_PRELOAD");
  CHECK(recorded["records_lost"] == 0);
  const long inputs = recorded["records_with_inputs_only"];
  CHECK(inputs > 1000);
  std::set<std::string> said;
  for (const Json& event : recorded["events"]) said.insert(event["what"]);
  CHECK(said.count("frames short") == 1);
  CHECK(said.count("frames whole again") == 1);
  const Json json = result_of(box, {"replay", "run.h5", "--verify"});
  CHECK(json["same"] == true);
  CHECK(json["frames"] == recorded["frames"]);
  CHECK(json["compared"] == recorded["frames"].get<long>() - inputs);
  const Ended text = run(box, {"replay", "run.h5", "--verify"});
  CHECK(text.out.find(std::to_string(inputs) + " more were computed and not compared") !=
        std::string::npos);
  // A sample in the gap counts: after it the frames differ.
  const Dataset kept(box.file("run.h5"), "inputs_only");
  const std::vector<unsigned char> all = kept.read();
  const auto first = static_cast<hsize_t>(
      std::find_if(all.begin(), all.end(), [](unsigned char c) { return c != 0; }) - all.begin());
  flip_bit(box.file("run.h5"), "hand_pose", first / kept.cell + 10, 2);
  CHECK(run(box, {"replay", "run.h5", "--verify"}).code == 1);
}

TEST_CASE("the recording of a run that the user ended replays to the bit") {
  Sandbox box;
  spill(box.file("scene.json"), ball_and_block(box).dump());
  result_of(box, {"run", "scene.json", "--virtual-time", "--duration", "0.01"});  // bakes
  Process process(box, {"run", "scene.json", "--duration", "60", "--record", "run.h5"});
  REQUIRE(soon([&] { return records(box, "run.h5"); }));
  process.send(SIGINT);
  CHECK(process.wait().code == 1);
  // There was no time to look for points that passed through, so the replay does not look either.
  CHECK(result_of(box, {"info", "run.h5"})["summary"]["pop_through"]["interrupted"] == true);
  const Json json = result_of(box, {"replay", "run.h5", "--verify"});
  CHECK(json["same"] == true);
  CHECK(json["frames"] > kSomeFrames);
}

TEST_CASE("the log of a killed run is replayed as far as it goes") {
  Sandbox box;
  {
    Process victim(box, {"run", "peg-in-hole", "--record", "run.h5"});
    REQUIRE(soon([&] { return records(box, "run.h5"); }));
  }  // killed
  // The first program that reads the log turns it into a recording and says so.
  const Json json = result_of(box, {"replay", "run.h5", "--verify"});
  CHECK(json["same"] == true);
  CHECK(json["frames"] > kSomeFrames);
  REQUIRE(json["remarks"].size() == 1);
  CHECK(std::string(json["remarks"][0]).find("run.h5.part with ") != std::string::npos);
  CHECK(box.files() == std::set<std::string>{"run.h5"});
  const Json info = result_of(box, {"info", "run.h5"});
  CHECK(info["repaired"] == "");
  CHECK(info["whole"] == false);
  CHECK(info["run"]["scene"] == "peg-in-hole");
  CHECK(info["run"]["virtual_time"] == false);
  CHECK(result_of(box, {"replay", "run.h5", "--verify"})["same"] == true);
}
