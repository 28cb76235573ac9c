// SPDX-License-Identifier: Apache-2.0
// surface_places.h - reproducible random directions, and random places on a mesh.
#pragma once
#include <cstdint>
#include <vector>

#include "io/mesh/mesh.h"

namespace h6::io {

// Random numbers of trial i. They depend on the seed and on i alone, so trials may run in any order
// and on any thread.
class Dice {
 public:
  Dice(std::uint64_t seed, std::uint64_t i) : state_(seed * 0x9E3779B97F4A7C15u + i) { next(); }
  std::uint64_t next();  // splitmix64
  double within(double low, double high);
  Vec3 direction();  // unit vector, uniform on the sphere

 private:
  std::uint64_t state_;
};

// Places on the triangles, uniform by area or by the given areas (triangles). The mesh must outlive
// this.
class SurfacePlaces {
 public:
  explicit SurfacePlaces(const Mesh& mesh);
  SurfacePlaces(const Mesh& mesh, const std::vector<double>& area);
  double area() const { return sum_.empty() ? 0 : sum_.back(); }  // [m^2]
  struct Place {
    std::uint32_t triangle;
    Vec3 p;
  };
  Place operator()(Dice& dice) const;  // area() must be > 0

 private:
  const Mesh& mesh_;
  std::vector<double> sum_;  // (triangles) running sum of areas
};

}  // namespace h6::io
