// SPDX-License-Identifier: Apache-2.0
// shapes.h - shapes for generated machines: lofts, turned and swept parts, plates with holes,
// sheets, fasteners. All lengths are in millimetres; an Assembly converts them to metres.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "io/scenes/shapes.h"

namespace h6::io::industrial {

struct P2 {
  double x, y;
};
using Polygon = std::vector<P2>;   // counter-clockwise
using Line = std::vector<h6Vec3>;  // a polyline, or a ring of a loft
using Profile = std::vector<P2>;   // of a turned part: x is the radius, y the height

// A piece of surface. Solids are closed and wound outward; vertices are shared.
struct Piece {
  std::vector<h6Vec3> points;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

// A pose in which a piece is placed: origin and axes, orthonormal and right-handed.
struct Frame {
  h6Vec3 o{0, 0, 0}, x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
  h6Vec3 turn(const h6Vec3& v) const { return v.x * x + v.y * y + v.z * z; }
  h6Vec3 at(const h6Vec3& p) const { return o + turn(p); }
  // Converts `inner`, which is given relative to this frame, to this frame's parent.
  Frame operator*(const Frame& inner) const {
    return {at(inner.o), turn(inner.x), turn(inner.y), turn(inner.z)};
  }
};
Frame at(double x, double y, double z);
// The z axis is along `direction`, the x axis as near to `hint` as possible.
Frame facing(const h6Vec3& origin, const h6Vec3& direction, const h6Vec3& hint = {1, 0, 0});
// The frame turned about its own z axis by `angle` [rad].
Frame rolled(const Frame& frame, double angle);

Piece placed(const Piece& piece, const Frame& frame);
double volume(const Piece& piece);  // signed [mm^3]

// ---- surfaces ----------------------------------------------------------------------------------

enum class Ends { capped, open, joined };
// Joins rings in order; each has the same number of points, or a single one (a pole). Caps are fans
// around the ring's mean. A closed result is wound outward.
Piece loft(const std::vector<Line>& rings, Ends ends);
// Turns a profile about the z axis. A profile that starts or ends at radius 0 is closed there. With
// `joined` the profile is a closed loop off the axis.
Piece revolve(const Profile& profile, int sides, Ends ends = Ends::capped);
Piece cylinder(double radius, double z0, double z1, int sides);
// |x| <= w/2, |y| <= d/2, 0 <= z <= h with rounded vertical edges and rounded rims.
Piece block(double w, double d, double h, double corner, double rim, int steps = 4);
Piece box(const h6Vec3& low, const h6Vec3& high);
// A round rod along a line; the radius may change with the arc length s.
Piece rod(const Line& line, double radius, int sides);
Piece rod(const Line& line, const std::function<double(double s)>& radius, int sides);
// A tube with a wall: open at both ends, a solid by itself.
Piece pipe(const Line& line, double outer, double inner, int sides);
// A profile carried along a line; its y axis stays as near to `up` as possible.
Piece sweep(const Line& line, const Polygon& profile, const h6Vec3& up, Ends ends);
// An open surface of 2 nu nv triangles.
Piece sheet(int nu, int nv, const std::function<h6Vec3(double u, double v)>& point);

// ---- outlines ----------------------------------------------------------------------------------

struct Outline {
  Polygon outer;
  std::vector<Polygon> holes;  // counter-clockwise too; inside `outer`, apart from each other
};
Polygon circle(double radius, int sides, P2 centre = {0, 0});
Polygon rectangle(double w, double h, double corner = 0, int steps = 4, P2 centre = {0, 0});
Polygon slot(double length, double radius, P2 centre, double angle, int steps = 8);
// Convex hull of circles {x, y, r}: levers, lugs, flanges, belts.
Polygon hull(const std::vector<std::array<double, 3>>& circles, int sides = 32);
Polygon gear(int teeth, double root, double tip);
// Adds `count` holes of radius `hole` on a circle of `radius`.
void add_bolt_circle(Outline& outline, double radius, int count, double hole, double phase = 0,
                     P2 centre = {0, 0}, int sides = 16);

Polygon counter_clockwise(Polygon polygon);
// The indices count through the points of `outer`, then of every hole in turn.
std::vector<std::array<std::uint32_t, 3>> triangulate(const Outline& outline);
Piece flat(const Outline& outline, double z = 0);             // an open sheet
Piece extrude(const Outline& outline, double z0, double z1);  // a solid

// ---- lines -------------------------------------------------------------------------------------

// A smooth curve through the points (centripetal Catmull-Rom), at equal steps of about `spacing`.
Line smooth(const std::vector<h6Vec3>& through, double spacing);
Line helix(double radius, double pitch, double turns, int per_turn);
// A second line that winds around the given one, `radius` away, once every `lay` mm; it starts at
// `angle` [rad].
Line companion(const Line& line, double radius, double angle, double lay);
double line_length(const Line& line);
// The frame `s` mm along a line; its z axis is along the line.
Frame frame_on(const Line& line, double s);

// ---- fasteners: the seat is z = 0, the head above it, the shank below --------------------------

Piece hex_bolt(double d, double length);     // an M`d` bolt, threaded over its lower half
Piece socket_bolt(double d, double length);  // cylinder head with a hexagon socket
Piece nut(double d);
Piece washer(double d);
Piece rivet(double d, int sides = 16);  // a dome
Piece spring(double radius, double wire, double pitch, double turns);
Piece hose_clamp(double radius);  // around the z axis, with its screw

}  // namespace h6::io::industrial
