// SPDX-License-Identifier: Apache-2.0
// experiment_shapes.h - what the scenes of the paper's experiments share: shells that can be
// sampled more or less densely and unevenly, and a few more closed meshes. Metres.
#pragma once
#include <cstdint>
#include <random>

#include "io/scenes/shapes.h"

namespace h6::io {

// How a scene's explicit shell is sampled: the figure's own grid, or a variant of it.
struct Sampling {
  double density = 1;  // points per area, relative to the figure's
  double jitter = 0;   // each point moves by up to this share of its cell, both ways: 0 .. 0.5
  std::uint64_t seed = 1;
  bool plain() const { return density == 1 && jitter == 0; }
};

// Point grids as in shapes.h, sampled as told; the same seed gives the same points anywhere.
class Sampler {
 public:
  explicit Sampler(const Sampling& sampling) : sampling_(sampling), engine_(sampling.seed) {}
  // Cells along a side that the figure divides into `cells`.
  int along(int cells) const;
  double spacing(double figure) const;
  int count(int figure) const;
  // Centre of cell i, moved inside it: in units of cells.
  double in_cell(int i) { return i + 0.5 + shift(); }
  double shift() { return sampling_.jitter * (2 * unit() - 1); }
  double unit();  // [0, 1), 53 bits

  void face(PointCloud& cloud, const h6Vec3& centre, const h6Vec3& u, const h6Vec3& v, int nu,
            int nv, const h6Vec3& inward);

 private:
  Sampling sampling_;
  std::mt19937_64 engine_;
};

void add_shell_point(PointCloud& cloud, const h6Vec3& p, const h6Vec3& inward);

// A polygonal cylinder along z from `low` to `high` whose flats are at `radius`, wound outward.
Mesh prism_mesh(const h6Vec3& centre, double radius, double low, double high, int segments);

// A fixed plate |x| <= side, |y| <= side, -thickness <= z <= 0 with a wire lying on it, along y: a
// circle of `radius` around (x, height), its part above the plate. One closed mesh.
Mesh plate_with_wire(double side, double thickness, double x, double height, double radius,
                     int segments);

// A point of a profile: radius and height.
struct Ring {
  double r, z;
};
// A square block |x|, |y| <= half_side, -height <= z <= 0 with a cavity of revolution around z:
// from its rim, the first ring at z = 0, through the rings to a bottom point on the axis.
Mesh block_with_cavity(double half_side, double height, const std::vector<Ring>& rings,
                       double bottom, int segments);

}  // namespace h6::io
