// SPDX-License-Identifier: Apache-2.0
#include "io/deform/solid_mesh.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "io/deform/elements.h"
#include "io/file/text_scan.h"

namespace h6::io {
namespace {

std::string figure(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

std::string place(const h6Vec3& p) {
  char text[96];
  std::snprintf(text, sizeof text, "(%.6g, %.6g, %.6g) m", p.x, p.y, p.z);
  return text;
}

Outcome check_material(const SolidMaterial& m) {
  const std::string name = m.name.empty() ? "The material" : "The material " + io::quoted(m.name);
  if (!(m.young > 0 && m.young <= 1e13))
    return Failure{name + " has Young's modulus " + figure(m.young) +
                   " Pa; it must be above 0 and at most 1e13 Pa (steel has 2e11)."};
  if (!(m.poisson > -1 && m.poisson < 0.5))
    return Failure{name + " has Poisson's ratio " + figure(m.poisson) +
                   "; it must be above -1 and below 0.5 (rubber has 0.49)."};
  if (!(m.density > 0 && m.density <= 1e5))
    return Failure{name + " has the density " + figure(m.density) +
                   " kg/m^3; it must be above 0 and at most 1e5 kg/m^3 (steel has 7850)."};
  return Done{};
}

double longest_edge(const SolidMesh& mesh, const SolidElement& element) {
  double most = 0;
  for (std::uint32_t a = 0; a < element.corners; ++a)
    for (std::uint32_t b = 0; b < a; ++b)
      most =
          std::max(most, norm(mesh.vertices[element.corner[a]] - mesh.vertices[element.corner[b]]));
  return most;
}

// The volume of an element, or why it cannot be used.
Result<double> check_element(const SolidMesh& mesh, std::size_t number) {
  const SolidElement& element = mesh.elements[number];
  const double edge = longest_edge(mesh, element);
  // A sliver this flat would make the stiffness matrix useless in double.
  const double least = 1e-9 * edge * edge * edge;
  const deform::Quadrature points = deform::quadrature(mesh, element);
  double volume = 0;
  for (std::size_t i = 0; i < points.count; ++i) {
    const double weight = points.point[i].weight;
    volume += weight;
    if (weight > least) continue;
    return Failure{std::string("Element ") + std::to_string(number + 1) + ", a " +
                   (element.corners == 4 ? "tetrahedron" : "hexahedron") + " at " +
                   place(mesh.vertices[element.corner[0]]) +
                   (weight < -least ? ", is inverted: its corners stand in the wrong order, or "
                                      "cross each other."
                                    : ", has no volume; remesh the part there.")};
  }
  return volume;
}

// Numbers the parts of the mesh: for each vertex its part, -1 where no element has it.
std::vector<std::int32_t> parts_of(const SolidMesh& mesh, std::size_t& count) {
  std::vector<std::uint32_t> root(mesh.vertices.size());
  std::iota(root.begin(), root.end(), 0u);
  const auto find = [&](std::uint32_t v) {
    while (root[v] != v) v = root[v] = root[root[v]];
    return v;
  };
  std::vector<std::int32_t> part(mesh.vertices.size(), -1);
  for (const SolidElement& e : mesh.elements)
    for (std::uint32_t a = 0; a < e.corners; ++a) {
      part[e.corner[a]] = -2;
      const std::uint32_t u = find(e.corner[0]), v = find(e.corner[a]);
      root[std::max(u, v)] = std::min(u, v);
    }
  count = 0;
  for (std::uint32_t v = 0; v < part.size(); ++v) {
    if (part[v] == -1) continue;
    const std::uint32_t r = find(v);  // the lowest vertex of the part: numbered before the others
    part[v] = r == v ? static_cast<std::int32_t>(count++) : part[r];
  }
  return part;
}

// Whether these vertices leave no rotation: three of them span a triangle.
bool pins(const SolidMesh& mesh, const std::vector<std::uint32_t>& vertices) {
  if (vertices.size() < 3) return false;
  const h6Vec3& a = mesh.vertices[vertices[0]];
  h6Vec3 far{};
  for (const std::uint32_t v : vertices)
    if (const h6Vec3 d = mesh.vertices[v] - a; norm(d) > norm(far)) far = d;
  const double length = norm(far);
  for (const std::uint32_t v : vertices)
    if (norm(cross(far, mesh.vertices[v] - a)) > 1e-6 * length * length) return true;
  return false;
}

Outcome check_fixed(const SolidMesh& mesh, const std::vector<std::int32_t>& part, std::size_t parts,
                    bool free) {
  if (free && !mesh.fixed.empty())
    return Failure{"The model is to be free, but " + std::to_string(mesh.fixed.size()) +
                   " of its vertices are fixed; ask for one of the two."};
  if (free && parts > 1)
    return Failure{"The model falls into " + std::to_string(parts) +
                   " parts that no element joins; a free model must be one part."};
  if (free) return Done{};
  if (mesh.fixed.empty())
    return Failure{
        "No vertex of the model is fixed, so it could move away as a whole; fix some of them, or "
        "ask for a free model."};
  std::vector<std::vector<std::uint32_t>> held(parts);
  for (const std::uint32_t v : mesh.fixed)
    if (part[v] >= 0) held[part[v]].push_back(v);
  for (std::uint32_t v = 0; v < part.size(); ++v) {
    if (part[v] < 0 || pins(mesh, held[part[v]])) continue;
    const std::size_t count = held[part[v]].size();
    const std::string where = parts > 1 ? "The part of the model at " + place(mesh.vertices[v]) +
                                              " (one of " + std::to_string(parts) + ")"
                                        : "The model";
    return Failure{where + " can still move as a whole: " +
                   (count == 0  ? "none of its vertices is fixed"
                    : count < 3 ? "only " + std::to_string(count) + " of its vertices are fixed"
                                : "its fixed vertices lie on one line") +
                   "; fix at least three that span a triangle."};
  }
  return Done{};
}

void sort_once(std::vector<std::uint32_t>& values) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
}

}  // namespace

std::size_t fix_box(SolidMesh& mesh, const h6Vec3& low, const h6Vec3& high) {
  std::size_t found = 0;
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
    const h6Vec3& p = mesh.vertices[v];
    if (p.x < low.x || p.y < low.y || p.z < low.z || p.x > high.x || p.y > high.y || p.z > high.z)
      continue;
    mesh.fixed.push_back(v);
    ++found;
  }
  sort_once(mesh.fixed);
  return found;
}

Outcome fix_vertices(SolidMesh& mesh, const std::vector<std::uint32_t>& vertices) {
  for (const std::uint32_t v : vertices)
    if (v >= mesh.vertices.size())
      return Failure{"Vertex " + std::to_string(std::uint64_t{v} + 1) +
                     " is to be fixed, but the model has " + std::to_string(mesh.vertices.size()) +
                     "."};
  mesh.fixed.insert(mesh.fixed.end(), vertices.begin(), vertices.end());
  sort_once(mesh.fixed);
  return Done{};
}

Outcome give_material(SolidMesh& mesh, const std::string& set, const SolidMaterial& material) {
  const auto number = static_cast<std::uint32_t>(mesh.materials.size());
  if (set.empty()) {
    for (SolidElement& e : mesh.elements) e.material = 0;
    mesh.materials = {material};
    return Done{};
  }
  for (const SolidMesh::Set& s : mesh.sets) {
    if (s.name != set) continue;
    for (const std::uint32_t e : s.elements) mesh.elements[e].material = number;
    mesh.materials.push_back(material);
    return Done{};
  }
  std::string names;
  for (const SolidMesh::Set& s : mesh.sets)
    names += (names.empty() ? "" : ", ") + io::quoted(s.name);
  return Failure{"The model has no set of elements " + io::quoted(set) +
                 (names.empty() ? "; it names none." : "; it has " + names + ".")};
}

Result<SolidFacts> check_solid(const SolidMesh& mesh, bool free) {
  if (mesh.elements.empty()) return Failure{"The model has no element."};
  std::vector<bool> used(mesh.materials.size(), false);
  for (std::size_t e = 0; e < mesh.elements.size(); ++e) {
    if (mesh.elements[e].material >= used.size())
      return Failure{"Element " + std::to_string(e + 1) +
                     " has no material; give Young's modulus, Poisson's ratio and the density."};
    used[mesh.elements[e].material] = true;
  }
  for (std::size_t m = 0; m < used.size(); ++m)
    if (used[m])
      if (Outcome good = check_material(mesh.materials[m]); !good) return good.failure();
  SolidFacts facts;
  for (std::size_t e = 0; e < mesh.elements.size(); ++e) {
    const Result<double> volume = check_element(mesh, e);
    if (!volume) return volume.failure();
    facts.volume += *volume;
    facts.mass += *volume * mesh.materials[mesh.elements[e].material].density;
  }
  const std::vector<std::int32_t> part = parts_of(mesh, facts.parts);
  facts.unused = static_cast<std::size_t>(std::count(part.begin(), part.end(), -1));
  if (Outcome held = check_fixed(mesh, part, facts.parts, free); !held) return held.failure();
  return facts;
}

}  // namespace h6::io
