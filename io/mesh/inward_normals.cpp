// SPDX-License-Identifier: Apache-2.0
// inward_normals.cpp - welds, pairs the edges, gives each piece one winding, and then settles the
// sign of each piece by its volume.
#include "io/mesh/inward_normals.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "io/file/mix.h"
#include "io/file/radix_sort.h"
#include "io/mesh/weld.h"

namespace h6::io {
namespace {

using Triangle = std::array<std::uint32_t, 3>;
constexpr std::uint32_t none = UINT32_MAX;

// For each vertex the first one at the same place.
std::vector<std::uint32_t> first_at_place(const std::vector<Vec3>& vertices) {
  const Welded welded = weld_points(vertices.size(), vertices.size(),
                                    [&](std::size_t i) { return without_minus_zero(vertices[i]); });
  std::vector<std::uint32_t> first(welded.vertices.size()), out(vertices.size());
  for (std::size_t i = vertices.size(); i-- > 0;) first[welded.index[i]] = std::uint32_t(i);
  for (std::size_t i = 0; i < vertices.size(); ++i) out[i] = first[welded.index[i]];
  return out;
}

// Triangles joined by edges that exactly two of them share.
struct Piece {
  std::vector<std::uint32_t> triangles;
  bool closed = true;
  bool turned = false;             // its windings were mixed
  bool twisted = false;            // it has one side only, like a Moebius strip
  double volume = 0;               // [m^3] of its one winding
  double area = 0, area_kept = 0;  // [m^2] all of it; what kept its winding
  Vec3 low{}, high{};
  bool flip = false;  // whether its one winding points inwards
  double lid = 0;     // area of a flat lid over an open piece [m^2]
  bool bowl = false;  // open, but it nearly encloses a volume
};

class Orientation {
 public:
  Orientation(const Mesh& mesh, Pulse* pulse) : mesh_(mesh), pulse_(pulse) {}
  FaceTable run();

 private:
  void measure();
  void drop_duplicates();
  void pair_edges();
  void spread(std::uint32_t start);
  void find_open_pieces();
  void settle_signs();
  bool hollow(std::size_t piece) const;
  int crossings(const Piece& piece, const Vec3& from, const Vec3& along) const;
  void warn();
  const Vec3& corner(std::uint32_t t, int k) const { return mesh_.vertices[faces_[t][k]]; }

  const Mesh& mesh_;
  Pulse* pulse_;
  FaceTable table_;
  std::vector<Triangle> faces_;        // welded
  std::vector<std::uint32_t> across_;  // (3 x triangles) the twin of half edge 3t+k, or none
  KeyedIndices edges_;                 // half edges, sorted by edge
  std::vector<char> reversed_;         // (triangles) 1 when wound against the piece's one winding
  std::vector<std::uint32_t> piece_of_;
  std::vector<Piece> pieces_;
  std::size_t duplicates_ = 0, inside_out_ = 0, hollows_ = 0;
};

void Orientation::measure() {
  const std::vector<std::uint32_t> same = first_at_place(mesh_.vertices);
  faces_.resize(mesh_.triangles.size());
  table_.area.assign(faces_.size(), 0);
  table_.inward.assign(faces_.size(), Vec3{0, 0, 0});
  for (std::uint32_t t = 0; t < faces_.size(); ++t) {
    for (int k = 0; k < 3; ++k) faces_[t][k] = same[mesh_.triangles[t][k]];
    const Vec3 n = cross(corner(t, 1) - corner(t, 0), corner(t, 2) - corner(t, 0));
    const double length = std::sqrt(dot(n, n));
    if (!(length > 0)) continue;
    table_.area[t] = length / 2;
    table_.inward[t] = {-n.x / length, -n.y / length, -n.z / length};
  }
}

// Triangles with the same three corners, in any order, are one surface, which is sampled once.
// Degenerate triangles stay in the edge table, since they may carry the edge between two others.
void Orientation::drop_duplicates() {
  KeyedIndices order, spare;
  order.reserve(faces_.size());
  const auto sorted = [&](std::uint32_t t) {
    Triangle f = faces_[t];
    std::sort(f.begin(), f.end());
    return f;
  };
  for (std::uint32_t t = 0; t < faces_.size(); ++t) {
    const Triangle f = sorted(t);
    order.push_back({mix(mix(f[0], f[1]), f[2]), t});
  }
  radix_sort(order, spare, 0, pulse_);
  if (!alive(pulse_)) return;
  std::vector<std::uint32_t> again;
  for (std::size_t i = 1; i < order.size(); ++i) {
    for (std::size_t k = i; k-- > 0 && order[k].key == order[i].key;) {
      if (sorted(order[k].index) != sorted(order[i].index)) continue;
      again.push_back(order[i].index);
      break;
    }
  }
  for (const std::uint32_t t : again) {
    if (table_.area[t] > 0) ++duplicates_;
    table_.area[t] = 0;
    faces_[t] = {none, none, none};
  }
}

void Orientation::pair_edges() {
  KeyedIndices spare;
  edges_.reserve(3 * faces_.size());
  for (std::uint32_t t = 0; t < faces_.size(); ++t) {
    if (t % 65536 == 0 && !alive(pulse_)) return;
    const Triangle& f = faces_[t];
    if (f[0] == f[1] || f[1] == f[2] || f[2] == f[0]) continue;  // a line, or dropped
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t a = f[k], b = f[(k + 1) % 3];
      const std::uint64_t key = (std::uint64_t(std::min(a, b)) << 32) | std::max(a, b);
      edges_.push_back({key, 3 * t + k});
    }
  }
  radix_sort(edges_, spare, 0, pulse_);
  across_.assign(3 * faces_.size(), none);
  for (std::size_t i = 0; i + 1 < edges_.size(); ++i) {
    const bool pair = edges_[i].key == edges_[i + 1].key &&
                      (i == 0 || edges_[i - 1].key != edges_[i].key) &&
                      (i + 2 == edges_.size() || edges_[i + 2].key != edges_[i].key);
    if (!pair) continue;
    across_[edges_[i].index] = edges_[i + 1].index;
    across_[edges_[i + 1].index] = edges_[i].index;
  }
}

// Collects the piece of one triangle over all edges of exactly two faces.
void Orientation::spread(std::uint32_t start) {
  const auto id = std::uint32_t(pieces_.size());
  Piece piece;
  piece.low = piece.high = corner(start, 0);
  piece_of_[start] = id;
  piece.triangles.push_back(start);
  for (std::size_t i = 0; i < piece.triangles.size(); ++i) {
    if (i % 65536 == 65535 && !alive(pulse_)) break;
    const std::uint32_t t = piece.triangles[i];
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t other = across_[3 * t + k];
      if (other == none) continue;
      const std::uint32_t u = other / 3;
      // Neighbours of one winding run along their edge in opposite directions.
      const bool opposed = faces_[t][k] != faces_[u][other % 3];
      const char reversed = char(opposed ? reversed_[t] : !reversed_[t]);
      if (piece_of_[u] == none) {
        piece_of_[u] = id;
        reversed_[u] = reversed;
        piece.triangles.push_back(u);
      } else if (reversed_[u] != reversed) {
        piece.twisted = true;
      }
    }
  }
  const Vec3 origin = corner(start, 0);  // nearby, for the precision of small volumes far out
  for (const std::uint32_t t : piece.triangles) {
    const double six =
        dot(corner(t, 0) - origin, cross(corner(t, 1) - origin, corner(t, 2) - origin));
    piece.volume += (reversed_[t] ? -six : six) / 6;
    piece.area += table_.area[t];
    if (!reversed_[t]) piece.area_kept += table_.area[t];
    piece.turned = piece.turned || reversed_[t];
    for (int k = 0; k < 3; ++k) {
      const Vec3& v = corner(t, k);
      piece.low = min(piece.low, v);
      piece.high = max(piece.high, v);
    }
  }
  pieces_.push_back(std::move(piece));
}

// A piece is open when one of its edges has an odd number of its faces.
void Orientation::find_open_pieces() {
  for (std::size_t i = 0; i < edges_.size();) {
    std::size_t end = i;
    while (end < edges_.size() && edges_[end].key == edges_[i].key) ++end;
    if (end - i == 1) {
      pieces_[piece_of_[edges_[i].index / 3]].closed = false;
    } else if (end - i > 2) {
      std::vector<std::uint32_t> here;
      for (std::size_t k = i; k < end; ++k) here.push_back(piece_of_[edges_[k].index / 3]);
      std::sort(here.begin(), here.end());
      for (std::size_t k = 0; k < here.size();) {
        const std::size_t first = k;
        while (k < here.size() && here[k] == here[first]) ++k;
        if ((k - first) % 2 == 1) pieces_[here[first]].closed = false;
      }
    }
    i = end;
  }
  // The volume of an open piece depends on the point it is measured from: the middle of its box.
  for (Piece& piece : pieces_) {
    if (piece.closed) continue;
    const Vec3 middle{(piece.low.x + piece.high.x) / 2, (piece.low.y + piece.high.y) / 2,
                      (piece.low.z + piece.high.z) / 2};
    piece.volume = 0;
    Vec3 across{};  // twice the sum of all vector areas, which is that of the missing lids
    for (const std::uint32_t t : piece.triangles) {
      const double six =
          dot(corner(t, 0) - middle, cross(corner(t, 1) - middle, corner(t, 2) - middle));
      piece.volume += (reversed_[t] ? -six : six) / 6;
      const Vec3 n = cross(corner(t, 1) - corner(t, 0), corner(t, 2) - corner(t, 0));
      const double sign = reversed_[t] ? -1 : 1;
      across = {across.x + sign * n.x, across.y + sign * n.y, across.z + sign * n.z};
    }
    piece.lid = std::sqrt(dot(across, across)) / 2;
  }
}

// Crossings of a ray with a piece (Moller & Trumbore 1997).
int Orientation::crossings(const Piece& piece, const Vec3& from, const Vec3& along) const {
  int count = 0;
  for (const std::uint32_t t : piece.triangles) {
    const Vec3 e1 = corner(t, 1) - corner(t, 0), e2 = corner(t, 2) - corner(t, 0);
    const Vec3 p = cross(along, e2);
    const double det = dot(e1, p);
    if (det == 0) continue;
    const Vec3 s = from - corner(t, 0), q = cross(s, e1);
    const double u = dot(s, p) / det, v = dot(along, q) / det;
    count += u >= 0 && v >= 0 && u + v <= 1 && dot(e2, q) / det > 0;
  }
  return count;
}

// Whether the piece has a body around it and no body inside it. The windings of closed pieces tell
// where bodies are: a place is in no body if a ray from it enters as many pieces as it leaves. A
// piece with the winding of the one around it is a part inside a part, not a hollow; a piece inside
// a hollow is a body again. A mixed winding tells nothing: then a piece is hollow when an odd
// number of pieces is around it.
bool Orientation::hollow(std::size_t c) const {
  const Piece& piece = pieces_[c];
  std::vector<std::size_t> maybe;
  bool unlike = false, mixed = piece.turned;
  for (std::size_t o = 0; o < pieces_.size(); ++o) {
    const Piece& outer = pieces_[o];
    const bool holds = outer.low.x < piece.low.x && outer.high.x > piece.high.x &&
                       outer.low.y < piece.low.y && outer.high.y > piece.high.y &&
                       outer.low.z < piece.low.z && outer.high.z > piece.high.z;
    if (o == c || !outer.closed || !holds) continue;
    maybe.push_back(o);
    mixed |= outer.turned;
    unlike |= outer.turned || (outer.volume < 0) != (piece.volume < 0);
  }
  if (!unlike && !piece.turned) return false;
  const std::uint32_t t = piece.triangles[0];
  const Vec3 &a = corner(t, 0), &b = corner(t, 1), &d = corner(t, 2);
  const Vec3 from{(a.x + b.x + d.x) / 3, (a.y + b.y + d.y) / 3, (a.z + b.z + d.z) / 3};
  constexpr Vec3 rays[3] = {
      {0.8017, 0.5323, 0.2719}, {-0.3571, 0.8929, 0.2741}, {0.1873, -0.4561, 0.87}};
  int around = 0, bodies = 0;
  for (const std::size_t o : maybe) {
    int votes = 0;
    for (const Vec3& ray : rays) votes += crossings(pieces_[o], from, ray) % 2;
    if (votes < 2) continue;
    ++around;
    bodies += pieces_[o].volume < 0 ? -1 : 1;
  }
  if (mixed) return around % 2 == 1;
  return bodies != 0 && bodies + (piece.volume < 0 ? -1 : 1) == 0;
}

void Orientation::settle_signs() {
  for (std::size_t c = 0; c < pieces_.size(); ++c) {
    if (!alive(pulse_)) return;
    Piece& piece = pieces_[c];
    if (piece.closed) {
      const bool inside = hollow(c);
      piece.flip = (piece.volume < 0) != inside;
      hollows_ += inside;
      inside_out_ += !piece.turned && !inside && piece.volume < 0;
      continue;
    }
    // A sphere of this area encloses area^1.5 / (6 sqrt(pi)) = 0.094 area^1.5. A twentieth of that
    // suffices to tell the sides; a piece with less is a sheet.
    const bool holds = std::abs(piece.volume) > 0.05 * 0.094 * std::pow(piece.area, 1.5);
    piece.flip = holds ? piece.volume < 0 : 2 * piece.area_kept < piece.area;
    piece.bowl = holds && piece.lid < 0.35 * piece.area;  // 0.2 for a box without a lid
  }
}

void Orientation::warn() {
  std::size_t open = 0, mixed = 0, twisted = 0;
  for (const Piece& piece : pieces_) {
    if (piece.area == 0) continue;
    ++table_.pieces;
    open += !piece.closed;
    mixed += piece.turned;
    twisted += piece.twisted;
  }
  table_.sheets = open;
  const auto pieces = [](std::size_t n) {
    return std::to_string(n) + (n == 1 ? " piece" : " pieces");
  };
  auto& out = table_.warnings;
  if (duplicates_ > 0) {
    out.push_back(std::to_string(duplicates_) +
                  " triangles are stored more than once; each surface was sampled once.");
  }
  if (inside_out_ > 0) {
    out.push_back(pieces(inside_out_) +
                  " of the mesh wound inside out; normals were turned to point into the body.");
  }
  if (mixed > 0) {
    out.push_back(pieces(mixed) + " of the mesh with mixed winding; one winding was made of it.");
  }
  if (twisted > 0) {
    out.push_back(
        pieces(twisted) +
        " of the mesh with one side only (like a Moebius strip); the normals there jump.");
  }
}

FaceTable Orientation::run() {
  measure();
  drop_duplicates();
  pair_edges();
  if (!alive(pulse_)) return {};
  reversed_.assign(faces_.size(), 0);
  piece_of_.assign(faces_.size(), none);
  for (std::uint32_t t = 0; t < faces_.size(); ++t) {
    if (piece_of_[t] == none && faces_[t][0] != none) spread(t);
  }
  if (!alive(pulse_)) return {};
  find_open_pieces();
  settle_signs();
  table_.sheet.assign(faces_.size(), 0);
  table_.bowl.assign(faces_.size(), 0);
  for (std::uint32_t t = 0; t < faces_.size(); ++t) {
    if (piece_of_[t] == none) continue;
    table_.sheet[t] = !pieces_[piece_of_[t]].closed;
    table_.bowl[t] = pieces_[piece_of_[t]].bowl;
    if (bool(reversed_[t]) == pieces_[piece_of_[t]].flip) continue;
    Vec3& n = table_.inward[t];
    n = -n;
  }
  warn();
  return std::move(table_);
}

}  // namespace

FaceTable face_table(const Mesh& mesh, Pulse* pulse) { return Orientation(mesh, pulse).run(); }

}  // namespace h6::io
