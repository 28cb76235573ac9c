// SPDX-License-Identifier: Apache-2.0
// The force that check finds, against pushes of this file, judged by shapes of known form.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>

#include "hapsix/hapsix.h"
#include "hapsix/vector.h"
#include "io/bake/bake_field.h"
#include "io/check/inner_faces.h"
#include "io/check/push_walls.h"
#include "io/check/surface_places.h"
#include "io/mesh/mesh_file.h"

#include "tests/io/bake/field_check.h"

using namespace field_check;
using namespace h6;
using namespace h6::io;

namespace {

constexpr double mm = 1e-3, k = 1e4;

enum class Side { front, behind, beside };

// A shape, random ways to push at it, and on which side of the wall that was pushed at a place
// lies.
struct Shape {
  std::string name;
  Mesh mesh;
  double voxel;
  std::function<void(Dice&, Vec3& from, Vec3& along)> aim;
  std::function<Side(const Vec3& from, const Vec3& at)> side;
};

Vec3 turned_point(const Vec3& p, double a, double b) {
  Mesh one;
  one.vertices = {p};
  return turned(one, a, b).vertices[0];
}

Shape slab(double thickness, double a, double b) {
  const double size = 16 * mm;
  return {"slab", turned(box({0, 0, 0}, {size, size, thickness}), a, b), 0.5 * mm,
          [=](Dice& dice, Vec3& from, Vec3& along) {
            const bool below = dice.within(0, 1) < 0.5;
            const Vec3 p{dice.within(0.3, 0.7) * size, dice.within(0.3, 0.7) * size,
                         below ? -0.7 * mm : thickness + 0.7 * mm};
            from = turned_point(p, a, b);
            along = turned_point({0, 0, below ? 1.0 : -1.0}, a, b);
          },
          [=](const Vec3& from, const Vec3& at) {
            const auto along = [&](double x, double y, double z) {
              return dot(at, turned_point({x, y, z}, a, b));
            };
            const double x = along(1, 0, 0), y = along(0, 1, 0), z = along(0, 0, 1);
            if (std::min(x, y) < 0 || std::max(x, y) > size) return Side::beside;
            const bool below = dot(from, turned_point({0, 0, 1}, a, b)) < 0;
            return (below ? z > thickness : z < 0) ? Side::behind : Side::front;
          }};
}

Shape hollow_ball(double radius, double wall) {
  Mesh ball = sphere({0, 0, 0}, radius, 24), hollow = sphere({0, 0, 0}, radius - wall, 24);
  for (auto& t : hollow.triangles) std::swap(t[0], t[1]);
  add(ball, hollow);
  return {"hollow ball", ball, 0.5 * mm,
          [=](Dice& dice, Vec3& from, Vec3& along) {
            along = dice.direction();
            from = -(radius + 0.7 * mm) * along;
          },
          [=](const Vec3& from, const Vec3& at) {
            if (dot(from, at) < 0.7 * norm(from) * norm(at)) return Side::beside;  // slid round
            return norm(at) < 0.97 * (radius - wall) ? Side::behind : Side::front;
          }};
}

// Of one sheet: behind it is the far side of the plane.
Shape sheet(double a, double b) {
  const double size = 16 * mm;
  Shape s = slab(0, a, b);
  s.name = "sheet";
  s.mesh = turned(patch(4, 4,
                        [=](double u, double v) {
                          return Vec3{u * size, v * size, 0};
                        }),
                  a, b);
  return s;
}

// The middle of the tube lies `big` from the axis z.
Shape ring(double big, double small) {
  return {"ring", torus(big, small), 0.4 * mm,
          [=](Dice& dice, Vec3& from, Vec3& along) {
            const double a = dice.within(0, 2 * M_PI);
            from = {big * std::cos(a), big * std::sin(a), -small - 0.7 * mm};
            along = {0, 0, 1};
          },
          [=](const Vec3& from, const Vec3& at) {
            const double out = std::hypot(at.x, at.y) - big;
            if (std::hypot(at.x - from.x, at.y - from.y) > 0.7 * small) return Side::beside;
            return at.z > 0.9 * small && std::hypot(out, at.z) > small ? Side::behind : Side::front;
          }};
}

// Closed boxes side by side: one bar without walls inside.
Shape five_boxes(double side) {
  Mesh row;
  for (int i = 0; i < 5; ++i) add(row, box({i * side, 0, 0}, {(i + 1) * side, side, side}, 1));
  return {"five boxes", weld(row), 0.4 * mm,
          [=](Dice& dice, Vec3& from, Vec3& along) {
            from = {dice.within(0.8, 4.2) * side, dice.within(0.3, 0.7) * side, -0.9 * mm};
            along = {0, 0, 1};
          },
          [=](const Vec3&, const Vec3& at) {
            if (at.y < 0 || at.y > side) return Side::beside;
            return at.z > side ? Side::behind : Side::front;
          }};
}

using Model = std::unique_ptr<h6Model, decltype(&h6DestroyModel)>;

Model point_against(const FieldData& field, const Vec3& along) {
  const float zero[1] = {0}, n[3] = {float(-along.x), float(-along.y), float(-along.z)};
  const std::uint32_t first[2] = {0, 1}, none[1] = {0};
  const h6ShellDef shell{1, zero,  zero, zero, n,    n + 1, n + 2,   nullptr,
                         1, first, none, zero, none, none,  nullptr, {}};
  const h6FieldDef def = field.def();
  h6ModelDef model{};
  model.fields = &def, model.field_count = 1, model.shells = &shell, model.shell_count = 1;
  return {h6CreateModel(&model, nullptr), h6DestroyModel};
}

// Whether a point gets behind the wall when a hand drags it straight on. guided: a second hand
// keeps it on its line.
bool gets_behind(const std::function<Side(const Vec3& from, const Vec3& at)>& side_of,
                 const FieldData& field, const Vec3& from, const Vec3& along, double force,
                 bool guided = false) {
  const double reach = 8 * mm + 6 * force / k;
  const Model model = point_against(field, along);
  REQUIRE(model);
  h6BodyDef bodies[2] = {h6DefaultBodyDef(), h6DefaultBodyDef()};
  bodies[0].fixed = true, bodies[0].field = 0;
  bodies[1].shell = 0, bodies[1].mass = 0.02, bodies[1].translation_only = true;
  bodies[1].pose.p = from;
  h6HandDef hands[2] = {h6DefaultHandDef(), h6DefaultHandDef()};
  hands[0].body = 1, hands[0].coupling.stiffness = k / 4, hands[0].coupling.max_force = force;
  hands[1].body = 1, hands[1].coupling.stiffness = 30 * k, hands[1].coupling.max_force = 1e4;
  h6SessionDef def = h6DefaultSessionDef();
  def.bodies = bodies, def.body_count = 2, def.hands = hands, def.hand_count = guided ? 2 : 1;
  def.contact.stiffness = k, def.contact.fit = H6_FIT_TIGHT;
  const std::unique_ptr<h6Session, decltype(&h6DestroySession)> session(
      h6CreateSession(model.get(), &def, nullptr), h6DestroySession);
  REQUIRE(session);
  h6DeviceSample samples[2] = {};
  samples[0].pose.q = samples[1].pose.q = {1, 0, 0, 0};
  samples[1].pose.p = from;
  const double step = 0.02 * mm;
  for (double way = 0; way < reach + 400 * step; way += step) {
    samples[0].pose.p = from + std::min(way, reach) * along;
    h6Step(session.get(), samples, nullptr);
    const Vec3 at = h6GetBody(session.get(), 1).pose.p;
    samples[1].pose.p = from + dot(at - from, along) * along;
    const Side side = side_of(from, at);
    if (side != Side::front) return side == Side::behind;
  }
  return false;
}

FieldData bake(const Mesh& mesh, double voxel) {
  FieldBake options;
  options.voxel_size = voxel, options.threads = 2;
  Result<FieldData> field = bake_field(mesh, options, nullptr);
  REQUIRE(field);
  return std::move(*field);
}

HeldForce held_by(const Mesh& mesh, const FieldData& field, unsigned threads = 2) {
  const Result<Walls> walls = measure_walls(mesh, {});
  REQUIRE(walls);
  const Result<HeldForce> held = find_held_force(mesh, field, walls->places, k, threads);
  REQUIRE(held);
  return *held;
}

// At the place that the check names, from either side, free or on a guide.
bool weakest_lets_through(const HeldForce& held, const FieldData& field, double force) {
  const WallPlace& w = held.weakest;
  bool through = false;
  for (const bool far : {false, true}) {
    const Vec3 along = far ? -w.in : w.in, face = far ? w.p + w.thickness * w.in : w.p;
    const Vec3 from = face - (0.7 * mm + field.offset + field.grown) * along;
    const auto side = [&](const Vec3&, const Vec3& at) {
      return dot(at - face, along) > w.thickness + 0.1 * mm ? Side::behind : Side::front;
    };
    for (const bool guided : {false, true})
      through |= gets_behind(side, field, from, along, force, guided);
  }
  return through;
}

}  // namespace

TEST_CASE("of 50 pushes none gets through at the promised force, and some at twice of it") {
  const Shape shapes[] = {slab(0.2 * mm, 0, 0),     slab(1 * mm, 0, 0),
                          slab(1.5 * mm, 0.3, 0.2), slab(2 * mm, 0.4, 0.9),
                          slab(3.1 * mm, 1.2, 0.3), sheet(0, 0),
                          sheet(0.5, 0.8),          hollow_ball(16 * mm, 1.4 * mm),
                          ring(7 * mm, 1.5 * mm),   five_boxes(4 * mm)};
  for (const Shape& s : shapes) {
    CAPTURE(s.name);
    const FieldData field = bake(s.mesh, s.voxel);
    const HeldForce held = held_by(s.mesh, field);
    CAPTURE(held.force);
    REQUIRE(held.force > 0);
    CHECK(held.places >= 24);
    int early = 0, late = 0;
    for (std::uint64_t i = 0; i < 50; ++i) {
      Dice dice(7, i);
      Vec3 from{}, along{};
      s.aim(dice, from, along);
      early += gets_behind(s.side, field, from, along, held.force);
      late += gets_behind(s.side, field, from, along, 2 * held.force);
    }
    late += weakest_lets_through(held, field, 2 * held.force);
    CHECK(early == 0);
    CHECK(late > 0);
  }
}

TEST_CASE(
    "on real meshes other places hold the promised force too, and some let twice of it through") {
  const char* folder = std::getenv("HAPSIX_TEST_DATA");
  if (!folder || !std::filesystem::exists(std::filesystem::path(folder) / "nut-bolt")) {
    MESSAGE("skipped: no real meshes");
    return;
  }
  const std::pair<const char*, Unit> meshes[] = {
      {"ariac/pump_base.stl", Unit::m},
      {"beams/1.obj", Unit::mm},
      {"cad/featuretype.STL", Unit::mm},
      {"gears/factory_gear_base_loose_space_5e-4_subdiv_4x.obj", Unit::m},
      {"nut-bolt/factory_nut_m16_loose_subdiv_3x.obj", Unit::m},
      {"peg-hole/factory_round_hole_16mm_subdiv_3x.obj", Unit::m},
      {"screw/anchor.obj", Unit::mm},
      {"screw/nut-big.obj", Unit::mm},
      {"shells/hip_fe_module_shell_cover.STL", Unit::mm},
      {"soups/curiosity_chassis.obj", Unit::m}};
  for (const auto& [name, unit] : meshes) {
    CAPTURE(name);
    const Result<Mesh> mesh = read_mesh(std::filesystem::path(folder) / name, unit);
    REQUIRE(mesh);
    const Result<FieldData> field = bake_field(*mesh, {}, nullptr);
    REQUIRE(field);
    // A voxel of depth is 10 N, whatever the unit.
    const double stiffness = 10 / field->voxel_size;
    const Result<Walls> walls = measure_walls(*mesh, {});
    WallOptions other;
    other.seed = 99;
    const Result<Walls> elsewhere = measure_walls(*mesh, other);
    REQUIRE((walls && elsewhere));
    const Result<HeldForce> held = find_held_force(*mesh, *field, walls->places, stiffness, 2);
    const auto pusher = WallPusher::make(*mesh, *field, stiffness);
    REQUIRE((held && pusher));
    REQUIRE(held->force > 0);
    const WallPushes early = (*pusher)->push(elsewhere->places, held->force, 2);
    std::vector<WallPlace> places = elsewhere->places;
    places.push_back(held->weakest);
    std::size_t late = 0;
    for (const double times : {1.4, 2.0})  // where more force slides off, less of it goes through
      late = std::max(late, (*pusher)->push(places, times * held->force, 2).through.size());
    CHECK(early.through.empty());
    CHECK(late > 0);
  }
}

TEST_CASE("a plate that the grid lost holds nothing; voxels of half its thickness hold it again") {
  const Mesh plate = box({0, 0, 0}, {12 * mm, 12 * mm, 0.2 * mm}, 1);
  FieldBake options;
  options.voxel_size = 0.5 * mm, options.threads = 2, options.grow_thin = false;
  const Result<FieldData> without = bake_field(plate, options, nullptr);
  REQUIRE(without);
  const HeldForce lost = held_by(plate, *without);
  CHECK(lost.force == 0);
  CHECK(lost.places > 0);
  CHECK(lost.through > lost.places / 2);
  CHECK(lost.weakest.thickness == doctest::Approx(0.2 * mm).epsilon(1e-3));
  CHECK(held_by(plate, bake(plate, 0.1 * mm)).force > 0.2);
}

TEST_CASE("the force is the same for any number of threads") {
  const Mesh plate = box({0, 0, 0}, {8 * mm, 8 * mm, 1 * mm}, 1);
  const FieldData field = bake(plate, 0.4 * mm);
  CHECK(held_by(plate, field, 1).force == held_by(plate, field, 2).force);
}

TEST_CASE("faces between boxes that abut are no walls; a sheet that is drawn twice stays") {
  const Mesh row = five_boxes(4 * mm).mesh;
  CHECK(row.triangles.size() == 5 * 12);
  CHECK(without_inner_faces(row).triangles.size() == 5 * 12 - 4 * 4);
  CHECK(audit(without_inner_faces(row)).closed);
  WallOptions options;
  options.places = 4000;
  const Result<Walls> walls = measure_walls(row, options);
  REQUIRE(walls);
  CHECK(walls->sheets == 0);
  CHECK(walls->thickness.front() == doctest::Approx(4 * mm));
  CHECK(walls->thickness.back() == doctest::Approx(20 * mm));

  // Of another triangulation, and shorter: the faces coincide in part.
  Mesh step = box({0, 0, 0}, {4, 4, 4}, 1);
  add(step, box({4, 1, 1}, {9, 3, 3}, 2));
  const Result<Walls> of_step = measure_walls(weld(step), options);
  REQUIRE(of_step);
  CHECK(of_step->sheets == 0);
  CHECK(of_step->thickness.front() == doctest::Approx(2));
  CHECK(of_step->thickness.back() == doctest::Approx(9));
  CHECK(of_step->gap.empty());

  Mesh sheet = patch(4, 4, [](double s, double t) { return Vec3{s, t, 0}; });
  Mesh other = sheet;
  for (auto& t : other.triangles) std::swap(t[0], t[1]);
  add(sheet, other);
  sheet = weld(sheet);
  CHECK(without_inner_faces(sheet).triangles.size() == sheet.triangles.size());
}
