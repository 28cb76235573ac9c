// SPDX-License-Identifier: Apache-2.0
#include "io/experiments/vary_scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "io/bake/plan.h"
#include "io/scenes/scenes.h"

namespace h6::cli {
namespace {

struct Resampled {
  const char* scene;
  io::Scene (*make)(const io::Sampling&);
};
constexpr Resampled kResampled[] = {
    {"box-on-wall", io::box_on_wall},     {"box-on-wall-explicit", io::box_on_wall_explicit},
    {"cone-in-gap", io::cone_in_gap},     {"box-on-plates", io::box_on_plates},
    {"peg-in-hole", io::peg_in_hole},     {"rod-between-tubes", io::rod_between_tubes},
    {"box-over-wire", io::box_over_wire}, {"box-over-fused-wire", io::box_over_fused_wire},
    {"box-over-post", io::box_over_post}};

Result<io::Scene> resampled(const std::string& name, const io::Sampling& sampling) {
  for (const Resampled& known : kResampled)
    if (name == known.scene) {
      io::Scene scene = known.make(sampling);
      scene.generated = name;
      return scene;
    }
  Result<io::Scene> scene = io::make_scene(name);
  if (!scene || sampling.plain()) return scene;
  for (io::SceneBody& body : scene->bodies) {
    if (!body.shell) continue;
    io::ShellSource& shell = *body.shell;
    if (!shell.mesh_data)
      return Failure{"the points of '" + body.name + "' in " + name +
                     " are given: a function in io/scenes/paper/experiments.h must sample them"};
    // The points are blue noise over the mesh: another seed stands for the jitter.
    shell.bake.points = static_cast<std::size_t>(
        std::lround(sampling.density * static_cast<double>(shell.bake.points)));
    shell.bake.spacing /= std::sqrt(sampling.density);
    shell.bake.seed = sampling.seed;
    shell.keep = false;
  }
  return scene;
}

// The spacing of the finest nodes, in which depths are counted.
double voxel_of(const io::FieldSource& field) {
  if (field.bake.tolerance > 0) return io::kFinest * field.bake.tolerance;
  if (field.bake.voxel_size > 0) return field.bake.voxel_size;
  if (!field.mesh_data) return 0;
  const auto plan = io::plan_field(*field.mesh_data, io::audit(*field.mesh_data), field.bake);
  return plan ? plan->voxel_size : 0;
}

// The same poses, reached sooner or later.
void change_speed(io::Path& path, double speed) {
  const auto same = [](const h6Pose& a, const h6Pose& b) {
    return norm(a.p - b.p) == 0 && dot(a.q, b.q) == dot(a.q, a.q);
  };
  double before = path.empty() ? 0 : path.front().t, t = before;
  for (std::size_t i = 1; i < path.size(); ++i) {
    const double lasted = path[i].t - before;
    before = path[i].t;
    t += same(path[i - 1].pose, path[i].pose) ? lasted : lasted / speed;
    path[i].t = t;
  }
}

// The voxel's size must be stated before the lattice turns, because a turned mesh has another box.
void change_field(io::SceneBody& body, const Variation& v) {
  io::FieldSource& field = *body.field;
  const bool turned = v.turn.w != 1, shifted = norm(v.shift) > 0;
  if (v.voxel == 1 && !turned && !shifted) return;
  if (field.bake.tolerance > 0)
    field.bake.tolerance *= v.voxel;
  else
    field.bake.voxel_size = v.voxel * voxel_of(field);
  field.bake.shift = v.shift;
  field.keep = false;
  if (turned) turn_lattice(body, v.turn);
}

}  // namespace

const char* vary_name(Vary kind) {
  constexpr const char* kNames[kVaryCount] = {"all",      "voxel", "shift", "turn",
                                              "sampling", "mass",  "speed", "step"};
  return kNames[static_cast<int>(kind)];
}

Variation draw_variation(Vary kind, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  const auto uniform = [&] { return static_cast<double>(engine() >> 11) * 0x1p-53; };  // [0, 1)
  const auto factor = [&](double low, double high) {
    return low * std::exp(uniform() * std::log(high / low));
  };
  Variation all, out;
  all.voxel = factor(0.5, 1.25);
  all.shift.x = uniform() - 0.5, all.shift.y = uniform() - 0.5, all.shift.z = uniform() - 0.5;
  // Uniform over rotations (K. Shoemake, Uniform Random Rotations, Graphics Gems III, 1992).
  const double share = uniform(), a = 2 * std::numbers::pi * uniform(),
               b = 2 * std::numbers::pi * uniform();
  all.turn = {std::sqrt(share) * std::cos(b), std::sqrt(1 - share) * std::sin(a),
              std::sqrt(1 - share) * std::cos(a), std::sqrt(share) * std::sin(b)};
  all.sampling.density = factor(0.5, 2);
  all.sampling.jitter = 0.4 * uniform();
  all.sampling.seed = engine() >> 11;
  all.mass = factor(1.0 / 3, 3);
  all.speed = factor(0.5, 2);
  all.step = factor(0.5, 2);
  out.push = factor(1.5, 8);
  const auto changes = [&](Vary one) { return kind == one || kind == Vary::all; };
  if (changes(Vary::voxel)) out.voxel = all.voxel;
  if (changes(Vary::shift)) out.shift = all.shift;
  if (changes(Vary::turn)) out.turn = all.turn;
  if (changes(Vary::sampling)) out.sampling = all.sampling;
  if (changes(Vary::mass)) out.mass = all.mass;
  if (changes(Vary::speed)) out.speed = all.speed;
  if (changes(Vary::step)) out.step = all.step;
  return out;
}

Vary kind_in_series(std::size_t index) {
  if (index % 2 == 0) return Vary::all;
  constexpr int kFirst = static_cast<int>(Vary::voxel);
  return static_cast<Vary>(kFirst + static_cast<int>(index / 2 % (kVaryCount - kFirst)));
}

std::uint64_t seed_in_series(std::uint64_t seed, const std::string& scene, std::size_t index) {
  std::uint64_t h = 0xcbf29ce484222325;  // FNV-1a over everything
  const auto add = [&](std::uint64_t byte) { h = (h ^ byte) * 0x100000001b3; };
  for (int i = 0; i < 8; ++i) add(seed >> (8 * i) & 0xff);
  for (const char c : scene) add(static_cast<unsigned char>(c));
  for (int i = 0; i < 8; ++i) add(static_cast<std::uint64_t>(index) >> (8 * i) & 0xff);
  return h;
}

void turn_lattice(io::SceneBody& body, const h6Quat& turn) {
  body.field->mesh_data = io::moved(*body.field->mesh_data, {{0, 0, 0}, turn});
  body.pose.q = product(body.pose.q, conjugate(turn));
}

double smallest_voxel(const io::Scene& scene) {
  double least = 0;
  for (const io::SceneBody& body : scene.bodies)
    if (const double voxel = body.field ? voxel_of(*body.field) : 0; voxel > 0)
      least = least > 0 ? std::min(least, voxel) : voxel;
  return least;
}

double half_voxel_force(const io::Scene& scene) {
  return scene.contact.stiffness * 0.5 * smallest_voxel(scene);
}

double largest_force(const io::Scene& scene) {
  if (scene.coupling.max_force > 0) return scene.coupling.max_force;
  return 2 * scene.coupling.max_depth_voxels * half_voxel_force(scene);
}

Result<io::Scene> vary(const std::string& name, const Variation& v) {
  Result<io::Scene> scene = resampled(name, v.sampling);
  if (!scene) return scene;
  if (v.voxel != 1) scene->coupling.max_force = largest_force(*scene);
  for (io::SceneBody& body : scene->bodies) {
    if (body.field && body.field->mesh_data && body.fixed) change_field(body, v);
    if (body.fixed) continue;
    body.mass *= v.mass;
    if (body.inertia)
      for (double& entry : *body.inertia) entry *= v.mass;
  }
  if (v.speed != 1)
    for (io::SceneHand& hand : scene->hands) change_speed(hand.path, v.speed);
  scene->rate /= v.step;
  return scene;
}

}  // namespace h6::cli
