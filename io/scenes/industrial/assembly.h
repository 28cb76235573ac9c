// SPDX-License-Identifier: Apache-2.0
// assembly.h - joins many pieces to one mesh, sound or with the defects of CAD exports, and records
// what is known about it by construction.
#pragma once
#include <string>
#include <unordered_map>

#include "io/scenes/industrial/industrial.h"
#include "io/scenes/industrial/shapes.h"

namespace h6::io::industrial {

// Numbers that are the same everywhere: SplitMix64 (Steele, Lea, Flood 2014).
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

// The defects that a sound assembly gets.
struct Defects {
  int narrow_holes;       // single triangles missing, one a solid at most
  double flipped_pieces;  // share of pieces wound inside out
  double mixed_pieces;    // share of pieces in which every third triangle is
  std::size_t triangles;  // in all: reached by duplicates
};

class Assembly {
 public:
  Assembly(double voxel, std::uint64_t seed) : voxel_(voxel), dice_(seed) {}

  // One piece of the part `name`; a part may have many.
  void add(const std::string& name, const Piece& piece, const Frame& frame = {},
           Kind kind = Kind::solid);
  // A thin solid rod; its centre line is recorded.
  void add_wire(const std::string& name, const Line& line, double radius);
  // Of the last piece of a part the `triangles` nearest to the triangle whose centre is nearest to
  // `near` (world) will be missing. Not for sheets: a probe on one could fall into the hole.
  void leave_hole(const std::string& name, const h6Vec3& near, int triangles);

  std::size_t triangles() const { return triangles_.size(); }
  // Metres. Splits longest edges until there are so many triangles: the same surface.
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

  // Corners of triangle t [mm].
  std::array<h6Vec3, 3> corners(std::size_t t) const;
  double hole_width(const std::vector<std::size_t>& triangles) const;  // [mm]
  // Which triangles are missing, given the dice.
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
// Bolts standing around an outline, `apart` from each other, seats at height z of the frame.
void add_bolt_row(Assembly& a, const std::string& name, const Frame& frame, const Polygon& outline,
                  double z, double apart, double d, double length);

// `wires` of them around each other along a smooth curve, taped and tied here and there.
void add_bundle(Assembly& a, const std::string& name, const std::vector<h6Vec3>& through, int wires,
                double radius);

}  // namespace h6::io::industrial
