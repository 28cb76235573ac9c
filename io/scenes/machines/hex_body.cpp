// SPDX-License-Identifier: Apache-2.0
// hex_body.cpp - makes the elements and the skin of a bent grid.
#include "io/scenes/machines/hex_body.h"

#include <algorithm>
#include <map>

namespace h6::io {
namespace {

using Place = HexBody::Place;

bool is_solid(const HexBody& body, Place cell) {
  if (body.closed) cell[1] = (cell[1] + body.cells[1]) % body.cells[1];
  for (std::size_t a = 0; a < 3; ++a)
    if (cell[a] < 0 || cell[a] >= body.cells[a]) return false;
  return !body.solid || body.solid(cell);
}

template <class Do>
void each_cell(const HexBody& body, Do&& handle) {
  for (int k = 0; k < body.cells[2]; ++k)
    for (int j = 0; j < body.cells[1]; ++j)
      for (int i = 0; i < body.cells[0]; ++i)
        if (is_solid(body, {i, j, k})) handle(Place{i, j, k});
}

// A closed grid has each of its corners once, with `parts` to a cell.
Place once(const HexBody& body, Place corner, int parts = 1) {
  if (body.closed && corner[1] == parts * body.cells[1]) corner[1] = 0;
  return corner;
}

class Skin {
 public:
  explicit Skin(const HexBody& body) : body_(body) {}
  void add_faces(const Place& cell) {
    for (int axis = 0; axis < 3; ++axis)
      for (const int side : {0, 1}) {
        Place next = cell;
        next[std::size_t(axis)] += side ? 1 : -1;
        if (!is_solid(body_, next)) add_face(cell, axis, side);
      }
  }
  Mesh mesh() && { return std::move(mesh_); }

 private:
  void add_face(const Place& cell, int axis, int side) {
    Place low = cell;
    low[std::size_t(axis)] += side;
    const int n = body_.split;
    for (int u = 0; u < n; ++u)
      for (int v = 0; v < n; ++v) {
        std::array<std::uint32_t, 4> q{vertex(low, axis, u, v), vertex(low, axis, u + 1, v),
                                       vertex(low, axis, u + 1, v + 1),
                                       vertex(low, axis, u, v + 1)};
        if (side == 0) std::swap(q[1], q[3]);  // seen from outside
        mesh_.triangles.push_back({q[0], q[1], q[2]});
        mesh_.triangles.push_back({q[0], q[2], q[3]});
      }
  }

  // u, v parts along the other axes of the face at `low`: bilinear, as a hexahedron's face is.
  std::uint32_t vertex(const Place& low, int axis, int u, int v) {
    const std::size_t b = std::size_t(axis + 1) % 3, c = std::size_t(axis + 2) % 3;
    const int n = body_.split;
    Place fine{n * low[0], n * low[1], n * low[2]};
    fine[b] += u, fine[c] += v;
    const auto [found, fresh] =
        index_.try_emplace(once(body_, fine, n), std::uint32_t(mesh_.vertices.size()));
    if (!fresh) return found->second;
    h6Vec3 p{};
    for (int end = 0; end < 4; ++end) {
      Place corner = low;
      corner[b] += end % 2, corner[c] += end / 2;
      const double s = double(u) / n, t = double(v) / n;
      p = p + (end % 2 ? s : 1 - s) * (end / 2 ? t : 1 - t) * body_.at(once(body_, corner));
    }
    mesh_.vertices.push_back(p);
    return found->second;
  }

  const HexBody& body_;
  Mesh mesh_;
  std::map<Place, std::uint32_t> index_;
};

}  // namespace

SolidMesh hex_solid(const HexBody& body) {
  SolidMesh out;
  out.materials.push_back(body.material);
  std::map<Place, std::uint32_t> index;
  const auto vertex = [&](const Place& corner) {
    const auto [found, fresh] = index.try_emplace(corner, std::uint32_t(out.vertices.size()));
    if (fresh) out.vertices.push_back(body.at(corner));
    return found->second;
  };
  each_cell(body, [&](const Place& c) {
    SolidElement hex{{}, 8, 0};
    constexpr int kX[] = {0, 1, 1, 0}, kY[] = {0, 0, 1, 1};
    for (int n = 0; n < 8; ++n)
      hex.corner[std::size_t(n)] =
          vertex(once(body, {c[0] + kX[n % 4], c[1] + kY[n % 4], c[2] + n / 4}));
    out.elements.push_back(hex);
  });
  for (const auto& [corner, number] : index)
    if (body.fixed(corner)) out.fixed.push_back(number);
  std::sort(out.fixed.begin(), out.fixed.end());
  return out;
}

Mesh hex_skin(const HexBody& body) {
  Skin skin(body);
  each_cell(body, [&](const Place& cell) { skin.add_faces(cell); });
  return std::move(skin).mesh();
}

SceneBody bending(const char* name, const HexBody& body, std::size_t points) {
  SceneBody out;
  out.name = name;
  out.fixed = true;
  out.shell.emplace();
  out.shell->mesh_data = hex_skin(body);
  out.shell->bake.points = points;
  out.shell->bends.emplace();
  out.shell->bends->solid = hex_solid(body);
  return out;
}

}  // namespace h6::io
