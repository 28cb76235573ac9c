// SPDX-License-Identifier: Apache-2.0
// ray_scene.h - rays through a mesh, and the point of the mesh nearest to a place, by Embree.
//
// hapsix has two searches for the nearest triangle:
//  - This one answers single questions exactly, with the triangle and the point, from anywhere.
//    Shells and checks use it, and only it shoots rays.
//  - io/bake/tree.h serves the far field, where a million nodes in rows start from their neighbours
//    and a result may be 0.02 voxel low. There it is 3 to 14 times faster (io/bake/far.cpp).
//
// Embree works in single precision. Here it only proposes triangles; every result is computed from
// the mesh in double. Embree sees the mesh moved and scaled into the cube [-1, 1]^3, so it rounds a
// coordinate by at most 2^-25 of half the longest side (3e-8; 1.5e-5 voxel of 1024).
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

// Queries are in the mesh frame and in metres; `along` is a unit vector. Any number of threads may
// query at once.
class RayScene {
 public:
  // Holds the triangles with area. Among triangles with the same three corners it holds only the
  // first. Indices must be in range, vertices finite, and the mesh must outlive this. Fails, with a
  // sentence, if there is not enough memory.
  static Result<std::unique_ptr<RayScene>> make(const Mesh& mesh);
  ~RayScene();
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;

  static constexpr std::uint32_t kNoTriangle = UINT32_MAX;
  struct Near {
    double distance = std::numeric_limits<double>::infinity();
    std::uint32_t triangle = kNoTriangle;  // the first of equally near ones
    Vec3 point{};                          // of the triangle, nearest to the place
  };
  // Exact in double: a box is culled only when it lies farther off than the best triangle by 1e-6
  // of half the longest side (or of the distance from the middle, if that is more), thirty times
  // Embree's rounding. kNoTriangle where no triangle is nearer than `within`.
  Near nearest(const Vec3& place, double within = std::numeric_limits<double>::infinity()) const;
  double distance(const Vec3& place) const { return nearest(place).distance; }

  // Every triangle that the ray meets, by t. No gap opens between triangles that share an edge, but
  // a ray through the edge itself (one in some million) may meet both: let several rays vote.
  // Those farther than `within` [m] may be left out.
  void crossings(const Vec3& from, const Vec3& along, std::vector<Crossing>& all,
                 double within = std::numeric_limits<double>::infinity()) const;
  bool meets(const Vec3& from, const Vec3& along) const;
  // The first triangle that the ray meets, and the way to it; infinity where it meets none.
  struct Hit {
    std::uint32_t triangle = kNoTriangle;
    double t = std::numeric_limits<double>::infinity();
  };
  Hit first(const Vec3& from, const Vec3& along) const;
  double free_way(const Vec3& from, const Vec3& along) const { return first(from, along).t; }
  // A ray this long that starts in the mesh's box ends beyond the box.
  double reach() const;

 private:
  struct Embree;
  RayScene(const Mesh& mesh, std::unique_ptr<Embree> embree);
  const Mesh& mesh_;
  std::unique_ptr<Embree> embree_;
};

}  // namespace h6::io
