// SPDX-License-Identifier: Apache-2.0
// thin_pieces.cpp - see thin_pieces.h.
#include "io/walls/thin_pieces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "io/mesh/inward_normals.h"
#include "io/mesh/ray_scene.h"
#include "io/walls/pieces.h"
#include "sched/parallel_for.h"

namespace h6::io {
namespace {

constexpr double kOpposite = 0.70710678;  // cosine of 45 degrees

struct Thin {
  Vec3 middle;
  double thickness, area;
};
struct Facet {
  std::array<Vec3, 3> corner;
  std::uint32_t triangle;
};
// The pieces of some triangles, and as few facets as fill them. Two halves that are thin altogether
// become one again, so a plate of two triangles does not become a million.
struct Found {
  std::vector<Thin> pieces;
  std::vector<Facet> facets;
};

class Cutter {
 public:
  Cutter(const Mesh& mesh, const ThinPieceOptions& options, const RayScene& rays,
         const FaceTable& faces)
      : mesh_(mesh), options_(options), rays_(rays), faces_(faces) {}

  void cut(std::uint32_t triangle, Found& out) const {
    if (!(faces_.area[triangle] > 0) || flat(triangle)) return;
    const auto& t = mesh_.triangles[triangle];
    cut(triangle, Piece(mesh_.vertices[t[0]], mesh_.vertices[t[1]], mesh_.vertices[t[2]]), out);
  }

 private:
  // Whether all of it is thin. Then it has added its facets.
  bool cut(std::uint32_t triangle, const Piece& piece, Found& out) const {
    if (!asked(piece)) return false;
    const std::size_t before = out.facets.size();
    if (const auto two = halves(piece, options_.piece)) {
      const bool one = cut(triangle, (*two)[0], out), other = cut(triangle, (*two)[1], out);
      if (!one || !other) return false;
      out.facets.resize(before);
    } else {
      const Vec3 middle = piece.middle();
      const double thickness = thickness_at(triangle, middle);
      if (!(thickness < options_.thinner_than)) return false;
      out.pieces.push_back({middle, thickness, piece.area()});
    }
    const auto& c = piece.corner;
    out.facets.push_back({{c[0], c[1], c[2]}, triangle});
    if (piece.corners == 4) out.facets.push_back({{c[0], c[2], c[3]}, triangle});
    return true;
  }

  bool asked(const Piece& piece) const {
    if (!options_.asked) return true;
    Vec3 low = piece.corner[0], high = low;
    for (int k = 1; k < piece.corners; ++k) {
      low = min(low, piece.corner[std::size_t(k)]);
      high = max(high, piece.corner[std::size_t(k)]);
    }
    return options_.asked(low, high);
  }

  // From a place of the surface straight into the solid to its end; infinity where this is no wall.
  // Parts that overlap are one solid.
  double thickness_at(std::uint32_t triangle, const Vec3& place) const {
    thread_local std::vector<Crossing> way;
    const Vec3& in = faces_.inward[triangle];
    rays_.crossings(place, in, way, options_.thinner_than);
    int depth = 1;
    for (const Crossing& c : way) {
      if (c.triangle == triangle || flat(c.triangle)) continue;
      const double enters = dot(faces_.inward[c.triangle], in);
      depth += enters > 0 ? 1 : -1;
      if (depth == 0 && enters < -kOpposite) return c.t;
      if (depth == 0) break;
    }
    return std::numeric_limits<double>::infinity();
  }

  bool flat(std::uint32_t triangle) const {
    return faces_.sheet[triangle] && !faces_.bowl[triangle];
  }

  const Mesh& mesh_;
  const ThinPieceOptions& options_;
  const RayScene& rays_;
  const FaceTable& faces_;
};

void take(const Mesh& whole, const Facet& facet, ThinPieces& out) {
  const auto first = std::uint32_t(out.mesh.vertices.size());
  for (const Vec3& v : facet.corner) out.mesh.vertices.push_back(v);
  out.mesh.triangles.push_back({first, first + 1, first + 2});
  if (!whole.part.empty()) out.mesh.part.push_back(whole.part[facet.triangle]);
  out.source.push_back(std::int32_t(facet.triangle));
}

// Sharp edges taper to nothing, so the thinnest place of all says little about the walls.
void find_typical(std::vector<Thin> pieces, ThinPieces& out) {
  std::stable_sort(pieces.begin(), pieces.end(),
                   [](const Thin& a, const Thin& b) { return a.thickness < b.thickness; });
  double area = 0;
  for (const Thin& piece : pieces) {
    area += piece.area;
    if (area < 0.1 * out.area) continue;
    out.thickness = piece.thickness;
    out.place = piece.middle;
    return;
  }
}

}  // namespace

Result<ThinPieces> thin_pieces(const Mesh& mesh, const ThinPieceOptions& options) {
  const Result<std::unique_ptr<RayScene>> rays = RayScene::make(mesh);
  if (!rays) return rays.failure();
  const FaceTable faces = face_table(mesh);
  const Cutter cutter(mesh, options, **rays, faces);
  constexpr std::size_t kBlock = 256;  // triangles; blocks are joined in order
  std::vector<Found> found((mesh.triangles.size() + kBlock - 1) / kBlock);
  sched::parallel_for(found.size(), options.threads, [&](std::size_t b) {
    const std::size_t end = std::min(mesh.triangles.size(), kBlock * (b + 1));
    for (std::size_t t = kBlock * b; t < end; ++t) cutter.cut(std::uint32_t(t), found[b]);
  });
  ThinPieces out;
  out.mesh.part_names = mesh.part_names;
  std::vector<Thin> all;
  for (const Found& some : found) {
    for (const Facet& facet : some.facets) take(mesh, facet, out);
    for (const Thin& piece : some.pieces) out.area += piece.area;
    all.insert(all.end(), some.pieces.begin(), some.pieces.end());
  }
  find_typical(std::move(all), out);
  return out;
}

}  // namespace h6::io
