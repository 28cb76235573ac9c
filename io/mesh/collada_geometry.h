// SPDX-License-Identifier: Apache-2.0
// collada_geometry.h - the polygons of a COLLADA file's <geometry> elements. Inside io/mesh only.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "io/mesh/assembly.h"
#include "io/mesh/xml_file.h"

namespace h6::io {

// Reads each geometry once, when it is first placed.
class ColladaGeometry {
 public:
  explicit ColladaGeometry(const XmlFile& xml) : xml_(xml) {}
  const Shape& shape(Element geometry);  // stays where it is
  // Sets of lines, curves and other things that have no polygons.
  std::size_t without_polygons() const { return without_polygons_; }

 private:
  using Indices = std::vector<std::uint32_t>;
  struct Inputs {
    std::size_t stride = 1, vertex = 0;  // indices a corner has, and which of them is the vertex
  };

  std::vector<Vec3> positions(Element source);
  std::array<std::uint64_t, 3> axes(Element accessor) const;
  Inputs inputs(Element primitive) const;
  Indices vertices_of(Element p, const Inputs& inputs, const Shape& shape) const;
  void add_primitive(Element e, Shape& out);
  std::uint64_t add_face(Element p, const Indices& v, std::size_t begin, std::size_t size,
                         Shape& out) const;
  std::uint64_t add_triangles(Element p, const Indices& v, Shape& out) const;
  std::uint64_t add_polylist(Element e, Element p, const Indices& v, Shape& out) const;
  std::uint64_t add_strip(Element p, const Indices& v, bool fan, Shape& out) const;

  const XmlFile& xml_;
  std::map<Element, Shape> shapes_;
  std::uint64_t loaded_ = 0;  // numbers of all sources, as often as they are read
  std::size_t without_polygons_ = 0;
};

}  // namespace h6::io
