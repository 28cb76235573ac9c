// SPDX-License-Identifier: Apache-2.0
// experiment_shapes.h - shapes that the paper's experiments share: closed meshes, and shells whose
// sampling can be made denser, coarser or uneven. Metres.
#pragma once
#include <cstdint>
#include <random>

#include "io/scenes/shapes.h"

namespace h6::io {

// How a scene's explicit shell is sampled: by the grid of the paper's figure, or a variant of it.
struct Sampling {
  double density = 1;  // points per area, relative to the figure's
  double jitter = 0;   // each point moves by up to +- this share of its cell: 0 .. 0.5
  std::uint64_t seed = 1;
  bool plain() const { return density == 1 && jitter == 0; }
};

// Makes point grids as shapes.h does, with the given sampling. The same seed gives the same points
// on every machine.
class Sampler {
 public:
  explicit Sampler(const Sampling& sampling) : sampling_(sampling), engine_(sampling.seed) {}
  // Each turns a value of the paper's figure into that of this density: the number of cells along a
  // side, the distance of neighbouring points, the number of points.
  int along(int cells) const;
  double spacing(double figure) const;
  int count(int figure) const;
  // A place inside cell i: its centre plus the jitter, in units of cells.
  double in_cell(int i) { return i + 0.5 + shift(); }
  double shift() { return sampling_.jitter * (2 * unit() - 1); }
  double unit();  // random, uniform in [0, 1), 53 bits

  void face(PointCloud& cloud, const h6Vec3& centre, const h6Vec3& u, const h6Vec3& v, int nu,
            int nv, const h6Vec3& inward);

 private:
  Sampling sampling_;
  std::mt19937_64 engine_;
};

void add_shell_point(PointCloud& cloud, const h6Vec3& p, const h6Vec3& inward);

// A regular prism along z from `low` to `high`, wound outward; its sides are at distance `radius`
// from its axis.
Mesh prism_mesh(const h6Vec3& centre, double radius, double low, double high, int segments);

// A plate |x| <= side, |y| <= side, -thickness <= z <= 0 and a wire along y that is fused with it,
// as one closed mesh. The wire's section is the part above the plate of a circle of `radius` around
// (x, z = height).
Mesh plate_with_wire(double side, double thickness, double x, double height, double radius,
                     int segments);

// One ring of a body of revolution around z.
struct Ring {
  double r, z;
};
// A square block |x|, |y| <= half_side, -height <= z <= 0 with a cavity of revolution around z. The
// first ring is the cavity's rim at z = 0; the last one joins the bottom point (0, 0, bottom).
Mesh block_with_cavity(double half_side, double height, const std::vector<Ring>& rings,
                       double bottom, int segments);

}  // namespace h6::io
