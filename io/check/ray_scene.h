// SPDX-License-Identifier: Apache-2.0
// ray_scene.h - rays through a mesh and the point of it nearest to a place, by Embree: the tool for
// a question at a few thousand places, where a field is a grid of answers.
//
// Embree works in single precision. Here it only chooses the triangles to look at; what is told is
// computed from them in double. The mesh is moved and scaled into the cube [-1, 1]^3 for it, so
// that a coordinate is rounded by 2^-25 of half the longest side at most (3e-8: 1.5e-5 of 1024
// voxels).
#pragma once
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "hapsix/result.h"
#include "io/mesh/mesh.h"

namespace h6::io {

// A ray meets a triangle at from + t * along [m].
struct Crossing {
  std::uint32_t triangle;
  double t;
};

class RayScene {
 public:
  // Of triangles that have area, each once whatever its winding. Indices must be in range and
  // vertices finite; the mesh must outlive this. A sentence where memory does not suffice.
  static Result<std::unique_ptr<RayScene>> make(const Mesh& mesh);
  ~RayScene();
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;

  // All may be asked from many threads at once. Mesh frame, metres; `along` is a unit vector.
  //
  // The distance to the mesh, exact in double: boxes are culled 1e-6 of half the longest side (of
  // the distance from the middle, where that is more) later than float says, thirty times its
  // rounding. Infinity where there is no triangle.
  double distance(const Vec3& place) const { return nearest(place).distance; }
  // The same with the triangle it is to and the point of it; kNoTriangle where there is none.
  static constexpr std::uint32_t kNoTriangle = UINT32_MAX;
  struct Near {
    double distance = std::numeric_limits<double>::infinity();
    std::uint32_t triangle = kNoTriangle;
    Vec3 point{};
  };
  Near nearest(const Vec3& place) const;
  // Every triangle that the ray meets, by t. No gap opens between triangles that share an edge, but
  // a ray through the edge itself (one in some million) may meet both: take votes of several rays.
  void crossings(const Vec3& from, const Vec3& along, std::vector<Crossing>& all) const;
  // Whether the ray meets any; up to the first it meets, or infinity.
  bool meets(const Vec3& from, const Vec3& along) const;
  double free_way(const Vec3& from, const Vec3& along) const;
  // From anywhere in the mesh's box, a run this long has left it and all around it behind.
  double reach() const;

 private:
  struct Embree;
  RayScene(const Mesh& mesh, std::unique_ptr<Embree> embree);
  const Mesh& mesh_;
  std::unique_ptr<Embree> embree_;
};

// Seeded places and directions: number i of a sequence, whatever was asked before.
class Dice {
 public:
  Dice(std::uint64_t seed, std::uint64_t i) : state_(seed * 0x9E3779B97F4A7C15u + i) { next(); }
  std::uint64_t next();  // splitmix64
  double within(double low, double high);
  Vec3 direction();  // uniform on the sphere

 private:
  std::uint64_t state_;
};

// Places spread over the triangles, evenly by area, or by given areas (triangles).
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
  std::vector<double> sum_;
};

}  // namespace h6::io
