// SPDX-License-Identifier: Apache-2.0
#include "io/mesh/collada_geometry.h"

#include <algorithm>
#include <string>
#include <string_view>

namespace h6::io {
namespace {

constexpr std::uint64_t kMostLoaded = 300'000'000;

}  // namespace

std::vector<Vec3> ColladaGeometry::positions(Element source) {
  const Element technique = child_of(source, "technique_common");
  const Element accessor = child_of(technique, "accessor");
  const Element array =
      accessor ? xml_.follow(accessor, "source", "float_array") : child_of(source, "float_array");
  if (!array) xml_.fail(source, "it has no float_array");
  const std::uint64_t announced = xml_.count_or(array, "count", 0);
  const std::vector<double> values = xml_.numbers(array, announced);
  if (*array.attribute("count").value() && values.size() != announced)
    xml_.fail(array, "it announces " + std::to_string(announced) + " numbers and has " +
                         std::to_string(values.size()));
  // Any number of geometries may share an array: a small file can name a huge mesh.
  loaded_ += values.size();
  if (loaded_ > kMostLoaded) xml_.fail(source, "the file has more vertices than can be read");
  const std::uint64_t stride = accessor ? xml_.count_or(accessor, "stride", 1) : 3;
  const std::uint64_t offset = accessor ? xml_.count_or(accessor, "offset", 0) : 0;
  const std::uint64_t count = accessor ? xml_.count_or(accessor, "count", 0) : values.size() / 3;
  const std::array<std::uint64_t, 3> axis = axes(accessor);
  const std::uint64_t widest = *std::max_element(axis.begin(), axis.end());
  const Element where = accessor ? accessor : array;
  if (stride <= widest) xml_.fail(where, "a point needs three numbers of its stride");
  if (count > 0 && offset + (count - 1) * stride + widest >= values.size())
    xml_.fail(where, "it reaches beyond its float_array");
  std::vector<Vec3> out;
  out.reserve(count);
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::uint64_t at = offset + i * stride;
    out.push_back({values[at + axis[0]], values[at + axis[1]], values[at + axis[2]]});
  }
  return out;
}

// Finds the numbers of a stride that are x, y, z: those of the first three params with a name.
std::array<std::uint64_t, 3> ColladaGeometry::axes(Element accessor) const {
  std::array<std::uint64_t, 3> out{0, 1, 2};
  if (!accessor) return out;
  std::size_t named = 0;
  std::uint64_t number = 0;
  each_child(accessor, [&](Element param) {
    if (name_of(param) != "param") return;
    if (named < 3 && *param.attribute("name").value()) out[named++] = number;
    ++number;
  });
  if (named > 0 && named < 3) xml_.fail(accessor, "a point needs three named params");
  return named == 3 ? out : std::array<std::uint64_t, 3>{0, 1, 2};
}

struct Inputs {
  std::size_t stride = 1, vertex = 0;
};

ColladaGeometry::Inputs ColladaGeometry::inputs(Element primitive) const {
  Inputs out;
  bool found = false;
  each_child(primitive, [&](Element input) {
    if (name_of(input) != "input") return;
    const std::uint64_t offset = xml_.count_or(input, "offset", 0);
    if (offset > 255) xml_.fail(input, "its offset cannot be right");
    out.stride = std::max<std::size_t>(out.stride, offset + 1);
    if (std::string_view(input.attribute("semantic").value()) != "VERTEX") return;
    out.vertex = offset;
    found = true;
  });
  if (!found) xml_.fail(primitive, "it has no input VERTEX");
  return out;
}

const Shape& ColladaGeometry::shape(Element geometry) {
  const auto [found, fresh] = shapes_.try_emplace(geometry);
  Shape& out = found->second;
  if (!fresh) return out;
  Element mesh = child_of(geometry, "mesh");
  if (!mesh) mesh = child_of(geometry, "convex_mesh");
  if (!mesh) {
    ++without_polygons_;
    return out;
  }
  const Element vertices = child_of(mesh, "vertices");
  if (!vertices) xml_.fail(mesh, "it has no <vertices>");
  each_child(vertices, [&](Element input) {
    if (name_of(input) == "input" &&
        std::string_view(input.attribute("semantic").value()) == "POSITION" && out.points.empty())
      out.points = positions(xml_.follow(input, "source", "source"));
  });
  each_child(mesh, [&](Element primitive) { add_primitive(primitive, out); });
  return out;
}

void ColladaGeometry::add_primitive(Element e, Shape& out) {
  const std::string_view kind = name_of(e);
  if (kind == "lines" || kind == "linestrips") ++without_polygons_;
  const bool strips = kind == "tristrips" || kind == "trifans";
  if (kind != "triangles" && kind != "polylist" && kind != "polygons" && !strips) return;
  const Inputs in = inputs(e);
  std::uint64_t faces = 0;
  each_child(e, [&](Element p) {
    if (name_of(p) == "ph") xml_.fail(p, "polygons with holes are not read; export triangles");
    if (name_of(p) != "p") return;
    const Indices loop = vertices_of(p, in, out);
    if (kind == "triangles")
      faces += add_triangles(p, loop, out);
    else if (kind == "polylist")
      faces += add_polylist(e, p, loop, out);
    else if (strips)
      faces += add_strip(p, loop, kind == "trifans", out);
    else
      faces += add_face(p, loop, 0, loop.size(), out);
  });
  const std::uint64_t announced = xml_.count_or(e, "count", faces);
  if (announced != faces)
    xml_.fail(e, "it announces " + std::to_string(announced) + " and has " + std::to_string(faces));
}

ColladaGeometry::Indices ColladaGeometry::vertices_of(Element p, const Inputs& in,
                                                      const Shape& shape) const {
  const Indices all = xml_.wholes(p);
  if (all.size() % in.stride != 0)
    xml_.fail(p, "the number of its indices is no multiple of " + std::to_string(in.stride));
  Indices out;
  out.reserve(all.size() / in.stride);
  for (std::size_t i = in.vertex; i < all.size(); i += in.stride) {
    if (all[i] >= shape.points.size())
      xml_.fail(p, "a face names vertex " + std::to_string(all[i]) + ", there are " +
                       std::to_string(shape.points.size()));
    out.push_back(all[i]);
  }
  return out;
}

std::uint64_t ColladaGeometry::add_face(Element p, const Indices& v, std::size_t begin,
                                        std::size_t size, Shape& out) const {
  if (size < 3) xml_.fail(p, "a face has " + std::to_string(size) + " corners, 3 are needed");
  const auto first = v.begin() + static_cast<std::ptrdiff_t>(begin);
  out.corners.insert(out.corners.end(), first, first + static_cast<std::ptrdiff_t>(size));
  out.sizes.push_back(static_cast<std::uint32_t>(size));
  return 1;
}

std::uint64_t ColladaGeometry::add_triangles(Element p, const Indices& v, Shape& out) const {
  if (v.size() % 3 != 0) xml_.fail(p, "the number of corners is no multiple of 3");
  for (std::size_t i = 0; i < v.size(); i += 3) add_face(p, v, i, 3, out);
  return v.size() / 3;
}

std::uint64_t ColladaGeometry::add_polylist(Element e, Element p, const Indices& v,
                                            Shape& out) const {
  const Element vcount = child_of(e, "vcount");
  if (!vcount) xml_.fail(e, "it has no <vcount>");
  const Indices sizes = xml_.wholes(vcount);
  std::size_t at = 0;
  for (const std::uint32_t size : sizes) {
    if (size > v.size() - at) xml_.fail(p, "it has fewer corners than its <vcount> announces");
    add_face(p, v, at, size, out);
    at += size;
  }
  if (at != v.size()) xml_.fail(p, "it has more corners than its <vcount> announces");
  return sizes.size();
}

std::uint64_t ColladaGeometry::add_strip(Element p, const Indices& v, bool fan, Shape& out) const {
  for (std::size_t i = 0; i + 2 < v.size(); ++i) {
    const Indices corners = {fan ? v[0] : v[i], v[i + 1 + (fan ? 0 : i % 2)],
                             v[i + 2 - (fan ? 0 : i % 2)]};
    add_face(p, corners, 0, 3, out);
  }
  return 1;
}

}  // namespace h6::io
