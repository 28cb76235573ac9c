// SPDX-License-Identifier: Apache-2.0
// gltf.cpp - glTF 2.0 (.gltf or .glb): the triangles of the default scene with the transforms of
// their nodes.
#include <cmath>
#include <map>

#include "io/mesh/assembly.h"
#include "io/mesh/gltf_data.h"

namespace h6::io {
namespace {

using Json = GltfData::Json;

class GltfReader {
 public:
  GltfReader(const MeshSource& source, const GltfContainer& file)
      : source_(source), data_(source, file) {}

  Mesh read() {
    walk_scene();
    Mesh mesh = expand(placed_, source_);
    mesh.remarks = remarks();
    return mesh;
  }

 private:
  // ---- meshes -----------------------------------------------------------------------------------

  const Shape& shape(std::uint64_t index, const std::string& from) {
    const Json& mesh = data_.item("meshes", index, from);
    const auto [found, fresh] = shapes_.try_emplace(index);
    if (!fresh) return found->second;
    const std::string place = GltfData::at("meshes", index);
    const auto primitives = mesh.find("primitives");
    if (primitives == mesh.end() || !primitives->is_array())
      data_.fail(place, "'primitives' must be a list");
    for (std::size_t i = 0; i < primitives->size(); ++i)
      add_primitive((*primitives)[i], place + ", primitive " + std::to_string(i), found->second);
    return found->second;
  }

  void add_primitive(const Json& primitive, const std::string& place, Shape& out) {
    if (!primitive.is_object()) data_.fail(place, "this must be an object");
    const std::uint64_t mode = data_.natural_or(primitive, "mode", 4, place);
    if (mode > 6) data_.fail(place, "mode " + std::to_string(mode) + " does not exist");
    if (mode < 4) {
      ++points_or_lines_;
      return;
    }
    if (GltfData::uses(primitive, "KHR_draco_mesh_compression"))
      data_.fail(place, "it is compressed (KHR_draco_mesh_compression); export it without");
    if (primitive.contains("targets")) ++morphed_;
    const auto attributes = primitive.find("attributes");
    if (attributes == primitive.end() || !attributes->is_object())
      data_.fail(place, "'attributes' must be an object");
    const GltfColumn points =
        data_.accessor(data_.need(*attributes, "POSITION", place), "VEC3", 3, place);
    if (points.type == 5125) data_.fail(place, "positions of this componentType do not exist");
    const std::vector<std::uint32_t> corners = indices(primitive, points.count, place);
    const std::size_t base = out.points.size();
    // The same bytes may stand in any number of primitives: a small file can name a huge mesh.
    loaded_ += points.count + corners.size();
    if (loaded_ > kMostLoaded) data_.fail(place, "the file has more vertices than can be read");
    for (std::uint64_t row = 0; row < points.count; ++row)
      out.points.push_back({points.real(row, 0), points.real(row, 1), points.real(row, 2)});
    add_triangles(mode, corners, static_cast<std::uint32_t>(base), place, out);
  }

  std::vector<std::uint32_t> indices(const Json& primitive, std::uint64_t points,
                                     const std::string& place) {
    std::vector<std::uint32_t> out;
    if (!primitive.contains("indices")) {
      for (std::uint64_t i = 0; i < points; ++i) out.push_back(static_cast<std::uint32_t>(i));
      return out;
    }
    const GltfColumn column =
        data_.accessor(data_.need(primitive, "indices", place), "SCALAR", 1, place);
    if (column.type != 5121 && column.type != 5123 && column.type != 5125)
      data_.fail(place,
                 "indices of componentType " + std::to_string(column.type) + " do not exist");
    out.reserve(column.count);
    for (std::uint64_t row = 0; row < column.count; ++row) {
      const std::uint32_t index = column.whole(row);
      if (index >= points)
        data_.fail(place, "a triangle names vertex " + std::to_string(index) + ", there are " +
                              std::to_string(points));
      out.push_back(index);
    }
    return out;
  }

  void add_triangles(std::uint64_t mode, const std::vector<std::uint32_t>& v, std::uint32_t base,
                     const std::string& place, Shape& out) const {
    if (mode == 4 && v.size() % 3 != 0)
      data_.fail(place, "the number of its triangles' corners is no multiple of 3");
    const auto add = [&](std::size_t a, std::size_t b, std::size_t c) {
      for (const std::size_t i : {a, b, c}) out.corners.push_back(base + v[i]);
      out.sizes.push_back(3);
    };
    for (std::size_t i = 0; i + 2 < v.size(); i += mode == 4 ? 3 : 1) {
      if (mode == 4)
        add(i, i + 1, i + 2);
      else if (mode == 6)
        add(0, i + 1, i + 2);
      else
        add(i, i + 1 + i % 2, i + 2 - i % 2);  // every second triangle of a strip runs back
    }
  }

  // ---- nodes ------------------------------------------------------------------------------------

  struct Visit {
    std::uint64_t node;
    Affine place;  // of its parent
  };

  void walk_scene() {
    const Json& scenes = data_.list("scenes");
    std::vector<Visit> stack;
    if (scenes.empty()) {
      push_roots(stack);
    } else {
      const std::uint64_t number = data_.natural_or(data_.root(), "scene", 0, "the file");
      push_children(data_.item("scenes", number, "'scene'"), "nodes", {},
                    GltfData::at("scenes", number), stack);
      other_scenes_ = scenes.size() - 1;
    }
    std::vector<bool> seen(data_.list("nodes").size());
    while (!stack.empty()) {
      const Visit visit = stack.back();
      stack.pop_back();
      const std::string place = GltfData::at("nodes", visit.node);
      const Json& node = data_.item("nodes", visit.node, "a node");
      if (seen[visit.node]) data_.fail(place, "it hangs in two places, or in itself");
      seen[visit.node] = true;
      visit_node(node, visit, place, stack);
    }
  }

  // A file without a scene shows every node that has no parent.
  void push_roots(std::vector<Visit>& stack) const {
    const std::size_t count = data_.list("nodes").size();
    std::vector<bool> hangs(count);
    for (std::size_t i = 0; i < count; ++i) {
      std::vector<Visit> children;
      push_children(data_.item("nodes", i, ""), "children", {}, GltfData::at("nodes", i), children);
      for (const Visit& child : children)
        if (child.node < count) hangs[child.node] = true;
    }
    for (std::size_t i = count; i-- > 0;)
      if (!hangs[i]) stack.push_back({i, {}});
  }

  // In reverse order, because a stack returns the last one first.
  void push_children(const Json& object, const char* key, const Affine& place,
                     const std::string& where, std::vector<Visit>& stack) const {
    const auto found = object.find(key);
    if (found == object.end()) return;
    if (!found->is_array()) data_.fail(where, "'" + std::string(key) + "' must be a list");
    if (found->size() > kMaxNodes) data_.fail(where, "more nodes than can be read");
    for (std::size_t i = found->size(); i-- > 0;)
      stack.push_back({data_.natural((*found)[i], where, key), place});
  }

  void visit_node(const Json& node, const Visit& visit, const std::string& place,
                  std::vector<Visit>& stack) {
    if (GltfData::uses(node, "EXT_mesh_gpu_instancing"))
      data_.fail(place, "it is repeated by EXT_mesh_gpu_instancing, which is not read");
    const Affine here = visit.place * transform(node, place);
    if (node.contains("mesh")) {
      const std::uint64_t index = data_.need(node, "mesh", place);
      const Shape& drawn = shape(index, place);
      std::string name = GltfData::name_of(node);
      if (name.empty()) name = GltfData::name_of(data_.list("meshes")[index]);
      if (name.empty()) name = "node " + std::to_string(visit.node);
      if (node.contains("skin")) ++skinned_;
      placed_.push_back({&drawn, here, name});
    }
    push_children(node, "children", here, place, stack);
  }

  Affine transform(const Json& node, const std::string& place) const {
    if (const auto m = data_.numbers<16>(node, "matrix", place)) {  // column by column
      if ((*m)[3] != 0 || (*m)[7] != 0 || (*m)[11] != 0 || (*m)[15] != 1)
        data_.fail(place, "its matrix is not affine");
      Affine out;
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 4; ++j) out.row[i][j] = (*m)[4 * j + i];
      return out;
    }
    Affine out;
    if (const auto t = data_.numbers<3>(node, "translation", place))
      out = translation((*t)[0], (*t)[1], (*t)[2]);
    if (const auto q = data_.numbers<4>(node, "rotation", place)) {
      const double n =
          std::sqrt((*q)[0] * (*q)[0] + (*q)[1] * (*q)[1] + (*q)[2] * (*q)[2] + (*q)[3] * (*q)[3]);
      if (!(std::abs(n - 1) < 1e-2)) data_.fail(place, "its rotation is no unit quaternion");
      out = out * rotation((*q)[0] / n, (*q)[1] / n, (*q)[2] / n, (*q)[3] / n);
    }
    if (const auto s = data_.numbers<3>(node, "scale", place))
      out = out * scaling((*s)[0], (*s)[1], (*s)[2]);
    return out;
  }

  std::vector<std::string> remarks() const {
    std::vector<std::string> out;
    const auto say = [&](std::size_t count, const std::string& what) {
      if (count > 0) out.push_back(source_.name + ": " + std::to_string(count) + " " + what + ".");
    };
    say(points_or_lines_, "sets of points or lines are left out");
    say(skinned_, "parts have a skin and are read unbent");
    say(morphed_, "sets of triangles have morph targets and are read unmorphed");
    say(data_.list("animations").size(),
        "animations are left out: everything is read where it rests");
    say(other_scenes_, "more scenes are left out: only the one to be shown first is read");
    return out;
  }

  static constexpr std::uint64_t kMostLoaded = 200'000'000;

  const MeshSource& source_;
  GltfData data_;
  std::map<std::uint64_t, Shape> shapes_;  // stay where they are: placed_ points to them
  std::vector<Placed> placed_;
  std::uint64_t loaded_ = 0;
  std::size_t points_or_lines_ = 0, skinned_ = 0, morphed_ = 0, other_scenes_ = 0;
};

}  // namespace

Mesh read_gltf(const MeshSource& source) {
  MeshSource metres = source;
  metres.scale = 1;  // a glTF is in metres
  const GltfContainer file = open_gltf(source);
  Mesh mesh = GltfReader(metres, file).read();
  if (source.scale != 1)
    mesh.remarks.push_back(source.name +
                           ": lengths in a glTF are metres; the unit given is not used for it.");
  return mesh;
}

}  // namespace h6::io
