// SPDX-License-Identifier: Apache-2.0
// real_scenes.h - writes scenes of real meshes as files for the program: scene.json and hand.csv.
//
// The meshes come from $HAPSIX_TEST_DATA. Unless a comment says otherwise, they are in metres and
// both parts of a pair share one assembled frame. Every fixed part is a field; the part in the hand
// is a shell.
//
// The coupling gives its largest force at half a voxel of penetration. The contact stiffness k
// makes that force 1 to 2 N, and k_VC = k/10. `half_size` sets the rotational stiffness
// k_VC half_size^2. The default lever of 30 voxels would be only 3 mm here, so that a 50 mm peg
// could lean on the rim of its hole.
#pragma once
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

namespace h6::real {

namespace fs = std::filesystem;
using nlohmann::json;

struct Keyframe {
  double t;                 // [s]
  std::array<double, 3> p;  // [m]
  std::array<double, 4> q{1, 0, 0, 0};
};
using HandPath = std::vector<Keyframe>;

inline std::array<double, 4> turn_about_z(double angle) {
  return {std::cos(angle / 2), 0, 0, std::sin(angle / 2)};
}

struct Grip {
  double contact_stiffness;  // k [N/m]
  double half_size;          // half size of the held part [m]
  double stiffness() const { return contact_stiffness / 10; }
  double rotational_stiffness() const { return stiffness() * half_size * half_size; }
};

inline json field_of(const std::string& name, const fs::path& mesh, json bake) {
  bake["mesh"] = mesh.string();
  return {{"name", name}, {"fixed", true}, {"field", bake}};
}

inline json shell_of(const std::string& name, const fs::path& mesh, json bake, const Keyframe& at) {
  bake["mesh"] = mesh.string();
  return {{"name", name}, {"mass", 0.1}, {"shell", bake}, {"pose", {{"p", at.p}, {"q", at.q}}}};
}

// The last body is the one in the hand. Returns the scene file.
inline fs::path write_scene(const fs::path& folder, const json& bodies, const Grip& grip,
                            const HandPath& path, double play = 0) {
  fs::create_directories(folder);
  std::ofstream csv(folder / "hand.csv");
  csv.precision(17);
  csv << "t,x,y,z,qw,qx,qy,qz\n";
  for (const Keyframe& k : path)
    csv << k.t << ',' << k.p[0] << ',' << k.p[1] << ',' << k.p[2] << ',' << k.q[0] << ',' << k.q[1]
        << ',' << k.q[2] << ',' << k.q[3] << '\n';
  const json scene = {
      {"hapsix", 1},
      {"name", folder.filename().string()},
      {"units", "m"},
      {"bodies", bodies},
      {"contact", {{"stiffness", grip.contact_stiffness}, {"fit_offset", play}}},
      {"coupling",
       {{"stiffness", grip.stiffness()}, {"rotational_stiffness", grip.rotational_stiffness()}}},
      {"hands", {{{"body", bodies.back()["name"]}, {"path", "hand.csv"}}}}};
  std::ofstream(folder / "scene.json") << scene.dump(1);
  return folder / "scene.json";
}

// An M16 nut on its bolt: pitch 2 mm, right-handed, with an axial play of 0.072 mm either way. In
// the frame of the files the nut's lowest turn runs into the thread's run-out (z = 16 to 18 mm), so
// the nut starts three turns further up. The bolt is closed, so its field has no offset. The nut
// has T-junctions at 108 edges; a shell can be built all the same.
namespace nut {
constexpr double voxel = 1e-4, pitch = 2e-3, play = 0.072e-3, start = 6e-3;
constexpr Grip grip{2e4, 7e-3};
constexpr double max_force = grip.contact_stiffness * voxel / 2;  // 1 N

inline fs::path write(const fs::path& data, const fs::path& folder, const HandPath& path) {
  return write_scene(
      folder,
      {field_of("bolt", data / "nut-bolt/factory_bolt_m16_tight.obj", {{"voxel_size", voxel}}),
       shell_of("nut", data / "nut-bolt/factory_nut_m16_loose_subdiv_3x.obj", {{"spacing", 3e-4}},
                path.front())},
      grip, path);
}
// The hand goes up 10 mm in a second, rests, and comes back.
inline HandPath pull() {
  return {{0, {0, 0, start}},          {0.2, {0, 0, start}}, {1.2, {0, 0, start + 0.01}},
          {1.7, {0, 0, start + 0.01}}, {2.7, {0, 0, start}}, {3.2, {0, 0, start}}};
}
// The hand makes one turn a second; `turns` > 0 unscrews. It rises by `lead` metres per turn.
inline HandPath turn(double turns, double lead) {
  HandPath path;
  const double steps = std::ceil(std::abs(turns)) * 100;
  for (double i = 0; i <= steps; ++i) {
    const double done = turns * i / steps;
    path.push_back(
        {0.01 * i, {0, 0, start + lead * done}, turn_about_z(2 * std::numbers::pi * done)});
  }
  path.push_back({path.back().t + 0.5, path.back().p, path.back().q});
  return path;
}
}  // namespace nut

// The medium gear and the middle post of its base. The clearance is 0.0125 mm a side (bore radius
// 5.000 mm, post radius 4.987 mm), a sixteenth of a voxel. A field without an offset resolves it:
// its error on this cylinder is voxel^2/(8 R) = 0.001 mm. The base has T-junctions at 68 edges, so
// it counts as open, and the default offset of 0.9 voxel would keep the gear on top of the post.
// The scene sets the offset to 0; no gap of the mesh is wider than rounding, so nothing leaks.
namespace gear {
constexpr double voxel = 2e-4, start = 22e-3;
constexpr Grip grip{2e4, 20e-3};
constexpr double max_force = grip.contact_stiffness * voxel / 2;  // 2 N
// The hand goes down to 2 mm below the seat until 1.5 s, pushes sideways until 2.2 s, comes back
// and draws the gear off.
constexpr double seated = 1.49, pushed = 2.19, lifting = 3.0;

inline fs::path write(const fs::path& data, const fs::path& folder) {
  const HandPath path = {{0, {0, 0, start}},   {0.1, {0, 0, start}},    {1.1, {0, 0, -2e-3}},
                         {1.5, {0, 0, -2e-3}}, {1.8, {3e-3, 0, -2e-3}}, {2.2, {3e-3, 0, -2e-3}},
                         {2.5, {0, 0, -2e-3}}, {2.6, {0, 0, 0}},        {3.6, {0, 0, start}},
                         {4.0, {0, 0, start}}};
  return write_scene(
      folder,
      {field_of("base", data / "gears/factory_gear_base_loose_space_5e-4_subdiv_4x.obj",
                {{"voxel_size", voxel}, {"offset", 0}}),
       shell_of("gear", data / "gears/factory_gear_medium_space_5e-4.obj", {{"spacing", 5e-4}},
                path.front())},
      grip, path);
}

// The gear starts on its post, and the base has the default offset of 0.9 voxel, so that gear and
// post overlap by 0.84 voxel. The foot of the post is undercut by 0.5 mm.
inline fs::path write_seated(const fs::path& data, const fs::path& folder, double play) {
  const HandPath path = {
      {0, {0, 0, 0}}, {0.2, {0, 0, 0}}, {1.2, {0, 0, start}}, {1.6, {0, 0, start}}};
  return write_scene(
      folder,
      {field_of("base", data / "gears/factory_gear_base_loose_space_5e-4_subdiv_4x.obj",
                {{"voxel_size", voxel}}),
       shell_of("gear", data / "gears/factory_gear_medium_space_5e-4.obj", {{"spacing", 5e-4}},
                path.front())},
      grip, path, play);
}
}  // namespace gear

// A 16 mm peg (r = 7.997 mm) in its hole (r = 8.250 mm, 9 mm deep). The hole goes through, and a
// plate under it is the floor. The part with the hole has T-junctions at 36 edges, so it counts as
// open and gets the default offset of 0.9 voxel. Of the clearance of 0.253 mm, 0.163 mm remain.
namespace peg {
constexpr double voxel = 1e-4, start = 15e-3, clearance = 0.253e-3 - 0.9 * voxel;
constexpr Grip grip{2e4, 25e-3};
constexpr double max_force = grip.contact_stiffness * voxel / 2;  // 1 N
// The hand goes down to 2 mm below the floor until 1.2 s, pushes sideways until 2 s, comes back and
// draws the peg out.
constexpr double seated = 1.19, pushed = 1.99, lifting = 2.8;

inline void write_floor(const fs::path& file) {
  std::ofstream obj(file);
  for (const double z : {-4e-3, 0.0})
    for (const double y : {-15e-3, 15e-3})
      for (const double x : {-15e-3, 15e-3}) obj << "v " << x << ' ' << y << ' ' << z << '\n';
  obj << "f 1 3 4\nf 1 4 2\nf 5 6 8\nf 5 8 7\nf 1 2 6\nf 1 6 5\n"
         "f 3 7 8\nf 3 8 4\nf 1 5 7\nf 1 7 3\nf 2 4 8\nf 2 8 6\n";
}

inline fs::path write(const fs::path& data, const fs::path& folder) {
  const HandPath path = {{0, {0, 0, start}},   {0.1, {0, 0, start}},    {0.8, {0, 0, -2e-3}},
                         {1.2, {0, 0, -2e-3}}, {1.5, {3e-3, 0, -2e-3}}, {2.0, {3e-3, 0, -2e-3}},
                         {2.3, {0, 0, -2e-3}}, {2.4, {0, 0, 0}},        {3.2, {0, 0, start}},
                         {3.6, {0, 0, start}}};
  fs::create_directories(folder);
  write_floor(folder / "floor.obj");
  return write_scene(folder,
                     {field_of("hole", data / "peg-hole/factory_round_hole_16mm_subdiv_3x.obj",
                               {{"voxel_size", voxel}}),
                      field_of("floor", "floor.obj", {{"voxel_size", voxel}}),
                      shell_of("peg", data / "peg-hole/factory_round_peg_16mm_tight.obj",
                               {{"spacing", 4e-4}}, path.front())},
                     grip, path);
}
}  // namespace peg

// A whole robot, a soup of 377,205 triangles at 512 voxels of 1.9 mm, and a ship's anchor. The file
// of the anchor states no unit. Read as centimetres the anchor is 9 cm long, and its thinnest part,
// the ring, is as thick as a voxel. It goes crown down between two sensors on the trunk's lid
// (z = 781 mm); on the way a fluke meets the side of one sensor.
namespace anchor {
constexpr double lid = 0.781, crown = 0.08137, gap = 0.02;
constexpr Grip grip{2e3, 45e-3};
// The hand starts 20 mm above the lid, goes 60 mm down until 1.6 s, and comes back.
constexpr double pushed = 1.59;

inline fs::path write(const fs::path& data, const fs::path& folder) {
  const double high = lid + crown + gap, low = high - 0.06, x = 0.07;
  const std::array<double, 4> q{std::sqrt(0.5), std::sqrt(0.5), 0, 0};  // its y axis up
  const HandPath path = {{0, {x, 0, high}, q},  {0.1, {x, 0, high}, q}, {1.1, {x, 0, low}, q},
                         {1.6, {x, 0, low}, q}, {2.6, {x, 0, high}, q}, {3.0, {x, 0, high}, q}};
  return write_scene(
      folder,
      {field_of("anymal", data / "soups/anymal_b_ref_pose.stl.gz", {{"voxels", 512}}),
       shell_of("anchor", data / "screw/anchor.obj", {{"units", "cm"}, {"spacing", 5e-4}},
                path.front())},
      grip, path);
}
}  // namespace anchor

}  // namespace h6::real
