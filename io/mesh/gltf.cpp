// SPDX-License-Identifier: Apache-2.0
// gltf.cpp - glTF 2.0, as JSON (.gltf; buffers inside it or in files beside it) and as one
// binary file (.glb): the triangles of the default scene with the transforms of their nodes.
//
// Own code over a JSON parser, and no package for the whole: what must be right here is that every
// index, offset and count is checked before it is used, and names its place when it is wrong.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "io/file/text_scan.h"
#include "io/mesh/assembly.h"
#include "io/mesh/gltf_container.h"

namespace h6::io {
namespace {

using nlohmann::json;

// Extensions of how things look, and one of how numbers are stored.
bool harmless(const std::string& extension) {
  for (const char* start : {"KHR_materials_", "KHR_texture_", "KHR_lights_", "EXT_texture_",
                            "EXT_lights_", "MSFT_texture_", "KHR_mesh_quantization"})
    if (extension.starts_with(start)) return true;
  return false;
}

json parse_json(std::string_view text, const MeshSource& source) {
  try {
    json root = json::parse(text);
    if (!root.is_object()) source.fail("this is JSON but no glTF");
    return root;
  } catch (const json::parse_error& fault) {
    source.fail("byte " + std::to_string(fault.byte),
                "this is no valid JSON; it is damaged, truncated or no glTF");
  } catch (const json::exception&) {
    source.fail("its JSON holds a number that no computer number can hold");
  }
}

class GltfReader {
 public:
  GltfReader(const MeshSource& source, const GltfContainer& file)
      : source_(source), file_(file), root_(parse_json(file.text, source)) {}

  Mesh read() {
    check_version();
    walk_scene();
    Mesh mesh = expand(placed_, source_);
    mesh.remarks = remarks();
    return mesh;
  }

 private:
  [[noreturn]] void fail(const std::string& place, const std::string& what) const {
    source_.fail(place, what);
  }

  // ---- members, each checked to be what it must be ----------------------------------------------

  const json& list(const char* key) const {
    static const json kNone = json::array();
    const auto found = root_.find(key);
    if (found == root_.end()) return kNone;
    if (!found->is_array()) fail(key, "this must be a list");
    return *found;
  }

  const json& item(const char* key, std::uint64_t index, const std::string& from) const {
    const json& all = list(key);
    if (index >= all.size())
      fail(from, "it names " + std::string(key) + " " + std::to_string(index) + ", the file has " +
                     std::to_string(all.size()));
    if (!all[index].is_object()) fail(at(key, index), "this must be an object");
    return all[index];
  }

  static std::string at(const char* key, std::uint64_t index) {
    return std::string(key) + " " + std::to_string(index);
  }

  std::uint64_t natural(const json& value, const std::string& place, const char* key) const {
    if (!value.is_number_unsigned())
      fail(place, "'" + std::string(key) + "' must be a whole number, not below 0");
    return value.get<std::uint64_t>();
  }
  std::uint64_t need(const json& object, const char* key, const std::string& place) const {
    const auto found = object.find(key);
    if (found == object.end()) fail(place, "'" + std::string(key) + "' is missing");
    return natural(*found, place, key);
  }
  std::uint64_t natural_or(const json& object, const char* key, std::uint64_t otherwise,
                           const std::string& place) const {
    const auto found = object.find(key);
    return found == object.end() ? otherwise : natural(*found, place, key);
  }

  template <std::size_t N>
  std::optional<std::array<double, N>> numbers(const json& object, const char* key,
                                               const std::string& place) const {
    const auto found = object.find(key);
    if (found == object.end()) return std::nullopt;
    std::array<double, N> out{};
    bool good = found->is_array() && found->size() == N;
    for (std::size_t i = 0; good && i < N; ++i) {
      good = (*found)[i].is_number();
      if (good) out[i] = (*found)[i].template get<double>();
    }
    if (!good) fail(place, "'" + std::string(key) + "' must be " + std::to_string(N) + " numbers");
    return out;
  }

  static std::string name_of(const json& object) {
    const auto found = object.find("name");
    return found != object.end() && found->is_string()
               ? printable(found->get_ref<const std::string&>())
               : std::string();
  }

  void check_version() const {
    const auto asset = root_.find("asset");
    if (asset == root_.end() || !asset->is_object() || !asset->contains("version") ||
        !(*asset)["version"].is_string())
      source_.fail("it does not say which version of glTF it is ('asset'), so it is none");
    const std::string version = (*asset)["version"];
    if (!version.starts_with("2."))
      source_.fail("this is glTF " + printable(version) +
                   ", only version 2 is read; export it anew");
    for (const json& extension : list("extensionsRequired")) {
      const std::string name = extension.is_string() ? extension.get<std::string>() : "";
      if (!harmless(name))
        source_.fail("it needs the extension " + io::quoted(name) +
                     ", which is not read; export it without (uncompressed)");
    }
  }

  // ---- bytes ------------------------------------------------------------------------------------

  std::string_view buffer(std::uint64_t index, const std::string& from) {
    const json& entry = item("buffers", index, from);
    if (const auto known = buffers_.find(index); known != buffers_.end()) return known->second;
    const std::string place = at("buffers", index);
    const std::uint64_t length = need(entry, "byteLength", place);
    const std::string_view bytes = buffer_bytes(entry, index, length, place);
    if (bytes.size() < length)
      fail(place, "it announces " + std::to_string(length) + " bytes, " +
                      std::to_string(bytes.size()) + " are there; it is truncated");
    return buffers_[index] = bytes.substr(0, length);
  }

  std::string_view buffer_bytes(const json& entry, std::uint64_t index, std::uint64_t length,
                                const std::string& place) {
    const auto uri = entry.find("uri");
    if (uri == entry.end()) {
      if (index != 0 || !file_.blob) fail(place, "it has neither bytes nor a file");
      return *file_.blob;
    }
    if (!uri->is_string()) fail(place, "'uri' must be text");
    const std::string& text = uri->get_ref<const std::string&>();
    if (text.starts_with("data:")) {
      const std::size_t comma = text.find(',');
      if (comma == std::string::npos || !text.substr(0, comma).ends_with(";base64"))
        fail(place, "its data URI is not base64");
      return keep(decode_base64(std::string_view(text).substr(comma + 1), source_));
    }
    return keep(read_beside(source_, decode_percent(text), length));
  }

  std::string_view keep(std::string&& bytes) {
    owned_.push_back(std::make_unique<std::string>(std::move(bytes)));
    return *owned_.back();
  }

  struct Column {
    std::string_view bytes;  // from the first element to the last one's end
    std::uint64_t count = 0, stride = 0, type = 0;
    bool normalized = false;
  };

  // All its bytes are there: no later access can miss, and the count is no larger than the file.
  Column accessor(std::uint64_t index, const char* type, std::uint64_t width,
                  const std::string& from) {
    const json& entry = item("accessors", index, from);
    const std::string place = at("accessors", index);
    if (!entry.contains("type") || entry["type"] != type)
      fail(place, "its type must be " + std::string(type) + " here");
    if (entry.contains("sparse")) fail(place, "sparse accessors are not read; export it without");
    if (!entry.contains("bufferView")) fail(place, "it has no 'bufferView', so no data");
    Column out;
    out.type = need(entry, "componentType", place);
    out.count = need(entry, "count", place);
    out.normalized = entry.contains("normalized") && entry["normalized"] == true;
    const std::uint64_t size = width * component_size(out.type, place);
    const std::uint64_t number = need(entry, "bufferView", place);
    const json& view = item("bufferViews", number, place);
    const std::string view_place = at("bufferViews", number);
    if (view.contains("extensions") && view["extensions"].is_object() &&
        view["extensions"].contains("EXT_meshopt_compression"))
      fail(view_place, "it is compressed (EXT_meshopt_compression); export it without");
    const std::string_view all = buffer(need(view, "buffer", view_place), view_place);
    const std::uint64_t begin = natural_or(view, "byteOffset", 0, view_place);
    const std::uint64_t length = need(view, "byteLength", view_place);
    if (begin > all.size() || length > all.size() - begin)
      fail(view_place, "it reaches beyond its buffer");
    out.stride = natural_or(view, "byteStride", size, view_place);
    if (out.stride < size || out.stride > 252) fail(view_place, "its 'byteStride' cannot be right");
    const std::uint64_t offset = natural_or(entry, "byteOffset", 0, place);
    if (out.count == 0) return out;
    if (offset > length || length - offset < size ||
        (length - offset - size) / out.stride < out.count - 1)
      fail(place,
           "it has " + std::to_string(out.count) + " elements and reaches beyond its bufferView");
    out.bytes = all.substr(begin + offset, (out.count - 1) * out.stride + size);
    return out;
  }

  std::uint64_t component_size(std::uint64_t type, const std::string& place) const {
    switch (type) {
      case 5120:
      case 5121:
        return 1;
      case 5122:
      case 5123:
        return 2;
      case 5125:
      case 5126:
        return 4;
      default:
        fail(place, "componentType " + std::to_string(type) + " does not exist");
    }
  }

  template <class T>
  static T load(const Column& column, std::uint64_t at) {
    T value;
    std::memcpy(&value, column.bytes.data() + at, sizeof value);
    return value;
  }

  template <class T>
  static double scaled(const Column& column, std::uint64_t at) {
    const double value = load<T>(column, at);
    if (!column.normalized) return value;
    return std::max(-1.0, value / static_cast<double>(std::numeric_limits<T>::max()));
  }

  static double real(const Column& column, std::uint64_t row, std::uint64_t axis) {
    const std::uint64_t start = row * column.stride;
    switch (column.type) {
      case 5120:
        return scaled<std::int8_t>(column, start + axis);
      case 5121:
        return scaled<std::uint8_t>(column, start + axis);
      case 5122:
        return scaled<std::int16_t>(column, start + 2 * axis);
      case 5123:
        return scaled<std::uint16_t>(column, start + 2 * axis);
      case 5125:
        return scaled<std::uint32_t>(column, start + 4 * axis);
      default:
        return load<float>(column, start + 4 * axis);
    }
  }

  static std::uint32_t whole(const Column& column, std::uint64_t row) {
    const std::uint64_t start = row * column.stride;
    if (column.type == 5121) return load<std::uint8_t>(column, start);
    if (column.type == 5123) return load<std::uint16_t>(column, start);
    return load<std::uint32_t>(column, start);
  }

  // ---- meshes -----------------------------------------------------------------------------------

  const Shape& shape(std::uint64_t index, const std::string& from) {
    const json& mesh = item("meshes", index, from);
    const auto [found, fresh] = shapes_.try_emplace(index);
    if (!fresh) return found->second;
    const std::string place = at("meshes", index);
    const auto primitives = mesh.find("primitives");
    if (primitives == mesh.end() || !primitives->is_array())
      fail(place, "'primitives' must be a list");
    for (std::size_t i = 0; i < primitives->size(); ++i)
      add_primitive((*primitives)[i], place + ", primitive " + std::to_string(i), found->second);
    return found->second;
  }

  void add_primitive(const json& primitive, const std::string& place, Shape& out) {
    if (!primitive.is_object()) fail(place, "this must be an object");
    const std::uint64_t mode = natural_or(primitive, "mode", 4, place);
    if (mode > 6) fail(place, "mode " + std::to_string(mode) + " does not exist");
    if (mode < 4) {
      ++points_or_lines_;
      return;
    }
    if (primitive.contains("extensions") && primitive["extensions"].is_object() &&
        primitive["extensions"].contains("KHR_draco_mesh_compression"))
      fail(place, "it is compressed (KHR_draco_mesh_compression); export it without");
    if (primitive.contains("targets")) ++morphed_;
    const auto attributes = primitive.find("attributes");
    if (attributes == primitive.end() || !attributes->is_object())
      fail(place, "'attributes' must be an object");
    const Column points = accessor(need(*attributes, "POSITION", place), "VEC3", 3, place);
    if (points.type == 5125) fail(place, "positions of this componentType do not exist");
    const std::vector<std::uint32_t> corners = indices(primitive, points.count, place);
    const std::size_t base = out.points.size();
    // The same bytes may stand in any number of primitives: a small file can name a huge mesh.
    loaded_ += points.count + corners.size();
    if (loaded_ > kMostLoaded) fail(place, "the file has more vertices than can be read");
    for (std::uint64_t row = 0; row < points.count; ++row)
      out.points.push_back({real(points, row, 0), real(points, row, 1), real(points, row, 2)});
    add_triangles(mode, corners, static_cast<std::uint32_t>(base), place, out);
  }

  std::vector<std::uint32_t> indices(const json& primitive, std::uint64_t points,
                                     const std::string& place) {
    std::vector<std::uint32_t> out;
    if (!primitive.contains("indices")) {
      for (std::uint64_t i = 0; i < points; ++i) out.push_back(static_cast<std::uint32_t>(i));
      return out;
    }
    const Column column = accessor(need(primitive, "indices", place), "SCALAR", 1, place);
    if (column.type != 5121 && column.type != 5123 && column.type != 5125)
      fail(place, "indices of componentType " + std::to_string(column.type) + " do not exist");
    out.reserve(column.count);
    for (std::uint64_t row = 0; row < column.count; ++row) {
      const std::uint32_t index = whole(column, row);
      if (index >= points)
        fail(place, "a triangle names vertex " + std::to_string(index) + ", there are " +
                        std::to_string(points));
      out.push_back(index);
    }
    return out;
  }

  void add_triangles(std::uint64_t mode, const std::vector<std::uint32_t>& v, std::uint32_t base,
                     const std::string& place, Shape& out) const {
    if (mode == 4 && v.size() % 3 != 0)
      fail(place, "the number of its triangles' corners is no multiple of 3");
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
    Affine place;  // of what it hangs in
  };

  void walk_scene() {
    const json& scenes = list("scenes");
    std::vector<Visit> stack;
    if (scenes.empty()) {
      push_roots(stack);
    } else {
      const std::uint64_t number = natural_or(root_, "scene", 0, "the file");
      push_children(item("scenes", number, "'scene'"), "nodes", {}, at("scenes", number), stack);
      other_scenes_ = scenes.size() - 1;
    }
    std::vector<bool> seen(list("nodes").size());
    while (!stack.empty()) {
      const Visit visit = stack.back();
      stack.pop_back();
      const std::string place = at("nodes", visit.node);
      const json& node = item("nodes", visit.node, "a node");
      if (seen[visit.node]) fail(place, "it hangs in two places, or in itself");
      seen[visit.node] = true;
      visit_node(node, visit, place, stack);
    }
  }

  // Without a scene: whatever hangs in nothing.
  void push_roots(std::vector<Visit>& stack) const {
    const std::size_t count = list("nodes").size();
    std::vector<bool> hangs(count);
    for (std::size_t i = 0; i < count; ++i) {
      std::vector<Visit> children;
      push_children(item("nodes", i, ""), "children", {}, at("nodes", i), children);
      for (const Visit& child : children)
        if (child.node < count) hangs[child.node] = true;
    }
    for (std::size_t i = count; i-- > 0;)
      if (!hangs[i]) stack.push_back({i, {}});
  }

  // The last one first: the stack turns them round.
  void push_children(const json& object, const char* key, const Affine& place,
                     const std::string& where, std::vector<Visit>& stack) const {
    const auto found = object.find(key);
    if (found == object.end()) return;
    if (!found->is_array()) fail(where, "'" + std::string(key) + "' must be a list");
    if (found->size() > kMaxNodes) fail(where, "more nodes than can be read");
    for (std::size_t i = found->size(); i-- > 0;)
      stack.push_back({natural((*found)[i], where, key), place});
  }

  void visit_node(const json& node, const Visit& visit, const std::string& place,
                  std::vector<Visit>& stack) {
    if (node.contains("extensions") && node["extensions"].is_object() &&
        node["extensions"].contains("EXT_mesh_gpu_instancing"))
      fail(place, "it is repeated by EXT_mesh_gpu_instancing, which is not read");
    const Affine here = visit.place * transform(node, place);
    if (node.contains("mesh")) {
      const std::uint64_t index = need(node, "mesh", place);
      const Shape& drawn = shape(index, place);
      std::string name = name_of(node);
      if (name.empty()) name = name_of(list("meshes")[index]);
      if (name.empty()) name = "node " + std::to_string(visit.node);
      if (node.contains("skin")) ++skinned_;
      placed_.push_back({&drawn, here, name});
    }
    push_children(node, "children", here, place, stack);
  }

  Affine transform(const json& node, const std::string& place) const {
    if (const auto m = numbers<16>(node, "matrix", place)) {  // column by column
      if ((*m)[3] != 0 || (*m)[7] != 0 || (*m)[11] != 0 || (*m)[15] != 1)
        fail(place, "its matrix is not affine");
      Affine out;
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 4; ++j) out.row[i][j] = (*m)[4 * j + i];
      return out;
    }
    Affine out;
    if (const auto t = numbers<3>(node, "translation", place))
      out = translation((*t)[0], (*t)[1], (*t)[2]);
    if (const auto q = numbers<4>(node, "rotation", place)) {
      const double n =
          std::sqrt((*q)[0] * (*q)[0] + (*q)[1] * (*q)[1] + (*q)[2] * (*q)[2] + (*q)[3] * (*q)[3]);
      if (!(std::abs(n - 1) < 1e-2)) fail(place, "its rotation is no unit quaternion");
      out = out * rotation((*q)[0] / n, (*q)[1] / n, (*q)[2] / n, (*q)[3] / n);
    }
    if (const auto s = numbers<3>(node, "scale", place))
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
    say(list("animations").size(), "animations are left out: everything is read where it rests");
    say(other_scenes_, "more scenes are left out: only the one to be shown first is read");
    return out;
  }

  static constexpr std::uint64_t kMostLoaded = 200'000'000;

  const MeshSource& source_;
  const GltfContainer& file_;
  const json root_;
  std::map<std::uint64_t, std::string_view> buffers_;
  std::vector<std::unique_ptr<std::string>> owned_;
  std::map<std::uint64_t, Shape> shapes_;  // stay where they are: placed_ points to them
  std::vector<Placed> placed_;
  std::uint64_t loaded_ = 0;
  std::size_t points_or_lines_ = 0, skinned_ = 0, morphed_ = 0, other_scenes_ = 0;
};

}  // namespace

Mesh read_gltf(const MeshSource& source) {
  MeshSource metres = source;
  metres.scale = 1;  // by definition of the format
  const GltfContainer file = open_gltf(source);
  Mesh mesh = GltfReader(metres, file).read();
  if (source.scale != 1)
    mesh.remarks.push_back(source.name +
                           ": lengths in a glTF are metres; the unit given is not used for it.");
  return mesh;
}

}  // namespace h6::io
