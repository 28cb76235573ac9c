// SPDX-License-Identifier: Apache-2.0
// vary_scene.h - a generated scene with one thing changed, or many: the one place where studies
// take their variations from.
#pragma once
#include <cstdint>
#include <string>

#include "io/scenes/paper/experiments.h"

namespace h6::cli {

// Factors are relative to the scene's own values.
struct Variation {
  double voxel = 1;  // size of the voxels of all fields, or their tolerance; the hand's force stays
  h6Vec3 shift{};    // of a field's nodes against its mesh [voxel], each -0.5 .. 0.5
  h6Quat turn{1, 0, 0, 0};  // of a field's lattice against its mesh
  io::Sampling sampling;    // of the shell
  double mass = 1;          // and inertia
  double speed = 1;         // of the hand where it moves; its pauses last as long as before
  double step = 1;          // length of a time step
  double push = 1;  // of the hand's force. vary() leaves it to RunChange::force: a loaded scene
                    // serves the scene's own force and the push
};

// A drawn variation changes the push, and beside it everything at once or one thing.
enum class Vary { all, voxel, shift, turn, sampling, mass, speed, step };
inline constexpr int kVaryCount = 8;
const char* vary_name(Vary kind);

// Draws a variation; the same seed gives the same one on every machine, and two kinds of one seed
// agree in what both change. Factors are uniform in their logarithm: voxel 0.5 .. 1.25, density of
// the sampling 0.5 .. 2, mass 1/3 .. 3, speed and step 0.5 .. 2, push 1.5 .. 8. Shift and turn are
// uniform over all places and directions of the lattice; the jitter is uniform in 0 .. 0.4.
Variation draw_variation(Vary kind, std::uint64_t seed);

// Variation `index` of a series, for one scene. Every other one changes all, the others a single
// thing, each thing in its turn; a longer series begins like a shorter one.
Vary kind_in_series(std::size_t index);
std::uint64_t seed_in_series(std::uint64_t seed, const std::string& scene, std::size_t index);

// A generated scene (io/scenes/scenes.h) with this variation. Assets that it changes are not kept
// in the cache. Fails when there is no such scene, or its shell has given points that no function
// of experiments.h can sample anew.
Result<io::Scene> vary(const std::string& scene, const Variation& variation);

// The field's nodes turn against its mesh: the mesh is turned before it is baked, and the body's
// pose turns it back. The body must be fixed.
void turn_lattice(io::SceneBody& body, const h6Quat& turn);

// The size of the smallest voxel of a scene's fields, kFinest tolerances where there is one [m]; 0
// without fields of generated meshes.
double smallest_voxel(const io::Scene& scene);
// The force at which the scene's coupling saturates [N], and the force of half a voxel: contact
// stiffness times half of smallest_voxel().
double largest_force(const io::Scene& scene);
double half_voxel_force(const io::Scene& scene);

}  // namespace h6::cli
