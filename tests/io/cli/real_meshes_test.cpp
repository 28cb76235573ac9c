// SPDX-License-Identifier: Apache-2.0
// Runs real meshes through `hapsix run` as a user would, and checks the results against the physics
// of threads, fits and triangle soups. real_scenes.h has the scenes, sizes and clearances.
//
// If the pose of interest is in the middle of a run, --duration cuts the run there, so that its
// JSON has that pose. The tests have a cache of their own and bake each mesh once.
#include <doctest/doctest.h>

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>

#include "tests/io/cli/real_scenes.h"

using namespace h6::real;

namespace {

const std::string kMethods[] = {"firm", "robust", "global"};

// The folder of the meshes. If it is missing, prints a message and returns nothing.
std::optional<fs::path> test_data() {
  const char* folder = std::getenv("HAPSIX_TEST_DATA");
  if (folder && fs::exists(fs::path(folder) / "nut-bolt")) return fs::path(folder);
  MESSAGE("skipped: no real meshes");
  return std::nullopt;
}

// A folder for this process. The destructor removes it.
class Workplace {
 public:
  Workplace() : folder_(fs::temp_directory_path() / ("hapsix-real-" + std::to_string(getpid()))) {
    fs::create_directories(folder_);
  }
  ~Workplace() {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  const fs::path& folder() const { return folder_; }

 private:
  fs::path folder_;
};
const fs::path& workplace() {
  static const Workplace place;
  return place.folder();
}

std::string text_of(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

// Runs a scene. A duration of 0 means until the hand's path ends. Returns null if the program
// fails.
json run(const fs::path& scene, const std::string& method, double duration = 0) {
  const fs::path out = workplace() / "out.json", log = workplace() / "log.txt";
  std::ostringstream command;
  command << "HAPSIX_CACHE='" << (workplace() / "cache").string() << "' '" << HAPSIX_PROGRAM
          << "' run '" << scene.string() << "' --allow-outside --json --virtual-time --method "
          << method;
  if (duration > 0) command << " --duration " << duration;
  command << " > '" << out.string() << "' 2> '" << log.string() << "'";
  const int code = std::system(command.str().c_str());
  INFO(command.str(), "\n", text_of(log));
  REQUIRE(code == 0);
  const json result = json::parse(text_of(out), nullptr, false);
  REQUIRE(result.is_object());
  return result;
}

struct Pose {
  std::array<double, 3> p;
  std::array<double, 4> q;
};
Pose pose(const json& result, const char* which) {
  return {result[which]["p"].get<std::array<double, 3>>(),
          result[which]["q"].get<std::array<double, 4>>()};
}
Pose body(const json& result) { return pose(result, "final_pose"); }
Pose hand(const json& result) { return pose(result, "hand_pose"); }

double apart(const Pose& a, const Pose& b) {
  return std::hypot(a.p[0] - b.p[0], a.p[1] - b.p[1], a.p[2] - b.p[2]);
}
double sideways(const Pose& a) { return std::hypot(a.p[0], a.p[1]); }
double angle_between(const Pose& a, const Pose& b) {
  const double dot = a.q[0] * b.q[0] + a.q[1] * b.q[1] + a.q[2] * b.q[2] + a.q[3] * b.q[3];
  return 2 * std::acos(std::min(1.0, std::abs(dot)));
}
// `lean` is the tilt of the z axis, `turned` the turn about it [rad].
double lean(const Pose& a) { return 2 * std::asin(std::hypot(a.q[1], a.q[2])); }
double turned(const Pose& a) { return 2 * std::atan2(a.q[3], a.q[0]); }

// Checks what must hold for every scene and method: nothing chatters or gets away, no contact is
// deeper than half a voxel, and nothing was dropped or cut. A nut's rim, whose thread is near a
// field everywhere, may be faster than the substeps allow.
void check_sound(const json& result) {
  INFO(result["scene"].get<std::string>(), " ", result["method"].get<std::string>());
  CHECK((result["verdict"] == "held" || result["verdict"] == "untouched"));
  CHECK(result["max_depth_voxels"].get<double>() < 0.5);
  for (const json& event : result["events"])
    CHECK((event["what"] == "soft start" || event["what"] == "motion shortened"));
}

void check_with_its_hand(const json& result, double metres) {
  CHECK(apart(body(result), hand(result)) < metres);
  CHECK(angle_between(body(result), hand(result)) < 1e-3);
}

// doctest's Approx adds 1 to the size of the values, so for metres it would let anything pass.
bool near(double a, double b, double tolerance) { return std::abs(a - b) <= tolerance; }

void report(const json& r) {
  std::ostringstream line;
  line << r["scene"].get<std::string>() << ' ' << r["method"].get<std::string>()
       << ": contacts max " << r["contacts"]["max"] << ", depth "
       << r["max_depth_voxels"].get<double>() << " voxels, " << r["verdict"].get<std::string>()
       << ", force " << r["max_force"].get<double>() << " N";
  MESSAGE(line.str());
}

}  // namespace

TEST_CASE("a nut pulled along its bolt goes as far as the play of the thread, and comes back") {
  const auto data = test_data();
  if (!data) return;
  const fs::path scene = nut::write(*data, workplace() / "nut-pulled", nut::pull());
  for (const std::string& method : kMethods) {
    CAPTURE(method);
    const json held = run(scene, method, 1.69);
    report(held);
    check_sound(held);
    CHECK(near(hand(held).p[2], nut::start + 0.01, 1e-6));
    CHECK(held["contacts"]["max"].get<int>() > 100);
    CHECK(near(held["max_force"].get<double>(), nut::max_force, 0.01 * nut::max_force));
    // Without friction the pull also unscrews the nut until the hand's rotational spring balances
    // it: F pitch/2pi = k_rot turn. Beyond play and turn the nut penetrates by a part of a voxel.
    const double per_radian = nut::pitch / (2 * std::numbers::pi);
    const double turn = nut::max_force * per_radian / nut::grip.rotational_stiffness();
    const double found = turned(body(held));
    CAPTURE(found);
    // The thread is so flat that friction with a coefficient of 0.02 would be half of the turn.
    CHECK(near(found, turn, 0.15 * turn));
    const double lift = body(held).p[2] - nut::start - turn * per_radian;
    CAPTURE(lift);
    CHECK(lift > nut::play - 0.1 * nut::voxel);
    CHECK(lift < nut::play + 0.2 * nut::voxel);
    CHECK(sideways(body(held)) < 0.2 * nut::voxel);

    const json back = run(scene, method);
    check_sound(back);
    check_with_its_hand(back, 1e-6);
  }
}

TEST_CASE("a nut in the right screw motion follows its hand and is not held") {
  const auto data = test_data();
  if (!data) return;
  const fs::path scene = nut::write(*data, workplace() / "nut-screwed", nut::turn(2, nut::pitch));
  const json result = run(scene, "robust");
  report(result);
  check_sound(result);
  CHECK(near(body(result).p[2], nut::start + 2 * nut::pitch, 2e-6));
  check_with_its_hand(result, 2e-6);
  CHECK(result["max_force"].get<double>() < 0.2 * nut::max_force);
}

// The hand stays at its height, so only the thread can move the nut along its axis.
TEST_CASE("a nut that is only turned climbs one pitch a turn, and descends the other way") {
  const auto data = test_data();
  if (!data) return;
  for (const double turns : {1.0, -1.0}) {
    CAPTURE(turns);
    const fs::path scene = nut::write(
        *data, workplace() / (turns > 0 ? "nut-unscrewed" : "nut-tightened"), nut::turn(turns, 0));
    const json result = run(scene, "robust");
    report(result);
    check_sound(result);
    const double climb = body(result).p[2] - nut::start;
    CHECK(near(climb * turns, nut::pitch - nut::play, 0.2 * nut::voxel));
    CHECK(result["contacts"]["max"].get<int>() > 100);
  }
}

TEST_CASE("a gear sits on its post, is held by it sideways, and comes off freely") {
  const auto data = test_data();
  if (!data) return;
  const fs::path scene = gear::write(*data, workplace() / "gear");
  for (const std::string& method : kMethods) {
    CAPTURE(method);
    const json seated = run(scene, method, gear::seated);
    CHECK(std::abs(body(seated).p[2]) < 0.25 * gear::voxel);
    CHECK(sideways(body(seated)) < 0.25 * gear::voxel);
    CHECK(lean(body(seated)) < 2e-3);
    CHECK(near(seated["max_force"].get<double>(), gear::max_force, 0.01 * gear::max_force));

    const json pushed = run(scene, method, gear::pushed);
    CHECK(near(hand(pushed).p[0], 3e-3, 1e-6));
    CHECK(std::abs(body(pushed).p[2]) < 0.25 * gear::voxel);
    CHECK(body(pushed).p[0] > 0.005e-3);  // the gear moves within its play, but no further
    CHECK(sideways(body(pushed)) < 0.0125e-3 + 0.5 * gear::voxel);

    const json lifting = run(scene, method, gear::lifting);  // still around the post
    CHECK(body(lifting).p[2] < 0.01);
    check_with_its_hand(lifting, 5e-6);

    const json off = run(scene, method);
    report(off);
    check_sound(off);
    check_with_its_hand(off, 1e-6);
  }
}

// Points in the undercut start free, so relief does not help them past the post: the part is held,
// and the program says what to do. `robust` and `series` go 0.9 voxel deep there, and come off.
TEST_CASE("a gear that overlaps an undercut post is held until it is given play") {
  const auto data = test_data();
  if (!data) return;
  const json held = run(gear::write_seated(*data, workplace() / "gear-seated", 0), "firm");
  report(held);
  CHECK(held["start_overlap"][0]["depth_voxels"].get<double>() > 0.8);
  CHECK(held["max_depth_voxels"].get<double>() < 0.5);
  CHECK(body(held).p[2] < 0.5 * gear::voxel);
  REQUIRE(held["remarks"].size() == 1);
  CHECK(held["remarks"][0].get<std::string>().find("\"fit_offset\" gives") != std::string::npos);
  const json off =
      run(gear::write_seated(*data, workplace() / "gear-play", 0.9 * gear::voxel), "firm");
  report(off);
  check_with_its_hand(off, 1e-6);
  CHECK(off["max_depth_voxels"].get<double>() < 0.5);
  CHECK(off["remarks"].empty());
}

// With the method robust a straight press makes the peg creep sideways up to the wall. One point on
// the 45 degree chamfer touches the floor beside 678 flat ones. It is alone in its direction, so it
// keeps all of k and bears a fifth of the load along its own normal.
TEST_CASE("a peg in its hole is held by floor and wall, and is drawn out freely") {
  const auto data = test_data();
  if (!data) return;
  const fs::path scene = peg::write(*data, workplace() / "peg");
  for (const std::string& method : kMethods) {
    CAPTURE(method);
    const json seated = run(scene, method, peg::seated);
    CHECK(std::abs(body(seated).p[2]) < 0.5 * peg::voxel);
    CHECK(sideways(body(seated)) < peg::clearance + 0.5 * peg::voxel);
    CHECK(near(seated["max_force"].get<double>(), peg::max_force, 0.01 * peg::max_force));

    const json pushed = run(scene, method, peg::pushed);
    const Pose at = body(pushed);
    CHECK(near(hand(pushed).p[0], 3e-3, 1e-6));
    CHECK(at.p[0] > 0.3 * peg::clearance);
    CHECK(at.p[0] < peg::clearance + peg::voxel);
    // The hand pushes above the rim, so the peg leans as far as a hole 9 mm deep allows.
    CHECK(lean(at) < 2 * (peg::clearance + peg::voxel) / 9e-3);
    CHECK(at.p[2] > -0.5 * peg::voxel);
    CHECK(at.p[2] < 8e-3 * lean(at) + 0.5 * peg::voxel);

    const json lifting = run(scene, method, peg::lifting);  // still in the hole
    CHECK(body(lifting).p[2] < 9e-3);
    check_with_its_hand(lifting, 5e-6);

    const json out = run(scene, method);
    report(out);
    check_sound(out);
    check_with_its_hand(out, 1e-6);
  }
}

TEST_CASE("an anchor pushed onto a robot's lid is held there, and is free again above it") {
  const auto data = test_data();
  if (!data) return;
  const fs::path scene = anchor::write(*data, workplace() / "anchor");
  for (const std::string& method : kMethods) {
    CAPTURE(method);
    const json held = run(scene, method, anchor::pushed);
    report(held);
    check_sound(held);
    REQUIRE(held["assets"][0]["kind"] == "field");
    const double voxel = held["assets"][0]["voxel_size"].get<double>();
    const double max_force = anchor::grip.contact_stiffness * voxel / 2;
    CHECK(held["contacts"]["max"].get<int>() > 3);
    CHECK(near(held["max_force"].get<double>(), max_force, 0.01 * max_force));
    // The offset of the soup raises the lid's surface by 0.9 voxel. The hand is 40 mm below it.
    const double resting = anchor::lid + 0.9 * voxel + anchor::crown;
    CHECK(body(held).p[2] > resting - voxel);
    CHECK(body(held).p[2] < resting + voxel);
    CHECK(hand(held).p[2] < resting - 0.03);

    const json free = run(scene, method);
    check_sound(free);
    check_with_its_hand(free, 1e-6);
  }
}
