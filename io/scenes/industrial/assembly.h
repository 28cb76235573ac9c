// SPDX-License-Identifier: Apache-2.0
// assembly.h - joins many pieces to one mesh, either sound or with the defects of CAD exports, and
// records what the construction knows about it: wires, holes, and which points are inside.
#pragma once
#include <string>
#include <unordered_map>

#include "io/scenes/industrial/industrial.h"
#include "io/scenes/industrial/shapes.h"

namespace h6::io::industrial {

// Random numbers that are the same on every machine: SplitMix64 (Steele, Lea, Flood 2014).
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(next() >> 11) * 0x1p-53;
  }
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(next() % n); }

 private:
  std::uint64_t state_;
};

enum class Kind { solid, sheet, wire };

// The defects that Assembly::broken adds to a sound assembly.
struct Defects {
  int narrow_holes;       // single missing triangles, at most one in each solid
  double flipped_pieces;  // share of pieces wound inside out
  double mixed_pieces;    // share of pieces with every third triangle wound inside out
  std::size_t triangles;  // total count, reached by adding duplicates
};

class Assembly {
 public:
  Assembly(double voxel, std::uint64_t seed) : voxel_(voxel), dice_(seed) {}

  // Adds one piece to the part `name`; a part may have many pieces.
  void add(const std::string& name, const Piece& piece, const Frame& frame = {},
           Kind kind = Kind::solid);
  // Adds a thin solid rod and records its centre line.
  void add_wire(const std::string& name, const Line& line, double radius);
  // Leaves a hole in the last piece of a part. `triangles` triangles will be missing: the one whose
  // centre is nearest to `near` (world frame [mm]) and those nearest to its centre. Do not use it
  // for sheets: a probe on a sheet could fall into the hole.
  void leave_hole(const std::string& name, const h6Vec3& near, int triangles);

  std::size_t triangles() const { return triangles_.size(); }
  // The mesh in metres, with the longest edges split until it has so many triangles. Splitting does
  // not change the surface.
  Mesh sound(std::size_t triangles) const;
  IndustrialInput broken(const Defects& defects, std::size_t probes) const;

 private:
  friend class Prober;
  struct Range {               // one piece
    std::size_t first, count;  // of triangles_
    std::int32_t part;
    Kind kind;
  };
  struct Hole {
    std::size_t range;
    std::vector<std::size_t> triangles;
  };

  std::array<h6Vec3, 3> corners(std::size_t t) const;                  // of triangle t [mm]
  double hole_width(const std::vector<std::size_t>& triangles) const;  // [mm]
  // For each triangle, 1 when it is missing. Counts the narrow holes.
  std::vector<std::uint8_t> missing(const Defects& defects, Dice& dice, std::size_t* narrow) const;

  double voxel_;  // [m]
  Dice dice_;
  std::vector<h6Vec3> points_;  // [mm]
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  std::vector<Range> ranges_;
  std::vector<std::string> names_;
  std::unordered_map<std::string, std::int32_t> part_of_;
  std::vector<IndustrialTruth::Wire> wires_;
  std::vector<Hole> holes_;
};

// A washer and a bolt in it; the frame's z axis points out of the seat.
void add_bolt(Assembly& a, const std::string& name, const Frame& seat, double d, double length);
// Bolts along an outline, about `apart` from each other, with their seats at height z of the frame.
void add_bolt_row(Assembly& a, const std::string& name, const Frame& frame, const Polygon& outline,
                  double z, double apart, double d, double length);

// A bundle of `wires` wires that wind around each other along a smooth curve, with ties on it.
void add_bundle(Assembly& a, const std::string& name, const std::vector<h6Vec3>& through, int wires,
                double radius);

}  // namespace h6::io::industrial
