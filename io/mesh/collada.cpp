// SPDX-License-Identifier: Apache-2.0
// collada.cpp - COLLADA 1.4 and 1.5 (.dae): the polygons of the scene with the transforms of
// their nodes. Axes stay the file's own, whatever <up_axis> says: a part then lies as it was drawn
// and as its STL or OBJ has it.
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <unordered_map>

#include "io/file/text_scan.h"
#include "io/mesh/assembly.h"
#include "io/mesh/xml_scan.h"

namespace h6::io {
namespace {

using Index = Xml::Index;
constexpr Index kNone = Xml::kNone;

class ColladaReader {
 public:
  explicit ColladaReader(const MeshSource& source) : source_(source), xml_(source_) {
    if (!same_word(xml_.name(0), "collada"))
      source_.fail("this is XML but no COLLADA; was another file renamed?");
    for (Index e = 0; e < xml_.size(); ++e)
      if (std::string id = xml_.attribute(e, "id"); !id.empty()) ids_.try_emplace(std::move(id), e);
  }

  Mesh read() {
    read_unit();
    walk_scene();
    Mesh mesh = expand(placed_, source_);
    mesh.remarks = remarks();
    return mesh;
  }

 private:
  [[noreturn]] void fail(Index e, const std::string& what) const {
    source_.fail(xml_.place(e), what);
  }

  template <class Work>
  void each(Index e, const Work& work) const {
    for (Index c = xml_.first(e); c != kNone; c = xml_.next(c)) work(c);
  }

  // "#id" -> the element of that id, which must have that name.
  Index follow(Index e, std::string_view attribute, std::string_view name) const {
    const std::string url = xml_.attribute(e, attribute);
    if (!url.starts_with("#"))
      fail(e, "it refers to " + io::quoted(url) + "; only what is in the same file is read");
    const auto found = ids_.find(url.substr(1));
    if (found == ids_.end() || (!name.empty() && xml_.name(found->second) != name))
      fail(e, "it refers to " + io::quoted(url) + ", which is not there");
    return found->second;
  }

  std::vector<double> numbers(Index e, std::size_t reserve = 0) const {
    std::vector<double> out;
    out.reserve(std::min(reserve, xml_.text(e).size() / 2 + 1));
    TextScan scan(xml_.text(e));
    for (std::string_view word = scan.next_word(); !word.empty(); word = scan.next_word()) {
      double value = 0;
      if (const char* fault = parse_number(word, value)) fail(e, io::quoted(word) + fault);
      if (!std::isfinite(value)) fail(e, io::quoted(word) + " is not finite");
      out.push_back(value);
    }
    return out;
  }

  std::vector<double> numbers_of(Index e, std::size_t count) const {
    if (xml_.text(e).size() > 4096) fail(e, "it is too long");
    std::vector<double> out = numbers(e);
    if (out.size() != count)
      fail(e, "it has " + std::to_string(out.size()) + " numbers, " + std::to_string(count) +
                  " are needed");
    return out;
  }

  std::vector<std::uint32_t> wholes(Index e) const {
    std::vector<std::uint32_t> out;
    TextScan scan(xml_.text(e));
    for (std::string_view word = scan.next_word(); !word.empty(); word = scan.next_word()) {
      std::int64_t value = 0;
      if (const char* fault = parse_number(word, value)) fail(e, io::quoted(word) + fault);
      if (value < 0 || value > 0x7fffffff) fail(e, io::quoted(word) + " is no index");
      out.push_back(static_cast<std::uint32_t>(value));
    }
    return out;
  }

  std::uint64_t count_or(Index e, std::string_view attribute, std::uint64_t otherwise) const {
    const std::string word = xml_.attribute(e, attribute);
    if (word.empty()) return otherwise;
    std::int64_t value = 0;
    if (const char* fault = parse_number(word, value)) fail(e, io::quoted(word) + fault);
    if (value < 0 || value > 0x7fffffff) fail(e, io::quoted(word) + " cannot be right");
    return static_cast<std::uint64_t>(value);
  }

  // Metres in the file's unit, in place of the one given.
  void read_unit() {
    const Index asset = xml_.child(0, "asset");
    const Index unit = asset == kNone ? kNone : xml_.child(asset, "unit");
    const std::string meter = unit == kNone ? "" : xml_.attribute(unit, "meter");
    if (meter.empty()) return;
    double value = 0;
    if (const char* fault = parse_number(meter, value)) fail(unit, io::quoted(meter) + fault);
    if (!(value > 0 && value < 1e6)) fail(unit, io::quoted(meter) + " m is no unit of length");
    if (std::abs(value / source_.scale - 1) < 1e-9) return;
    source_.scale = value;
    remarks_.push_back(source_.name + ": its own unit of length, " + printable(meter) +
                       " m, is used for it.");
  }

  // ---- geometry ---------------------------------------------------------------------------------

  std::vector<Vec3> positions(Index source) {
    const Index technique = xml_.child(source, "technique_common");
    const Index accessor = technique == kNone ? kNone : xml_.child(technique, "accessor");
    const Index array = accessor == kNone ? xml_.child(source, "float_array")
                                          : follow(accessor, "source", "float_array");
    if (array == kNone) fail(source, "it has no float_array");
    const std::uint64_t announced = count_or(array, "count", 0);
    const std::vector<double> values = numbers(array, announced);
    if (!xml_.attribute(array, "count").empty() && values.size() != announced)
      fail(array, "it announces " + std::to_string(announced) + " numbers and has " +
                      std::to_string(values.size()));
    // Any number of geometries may share an array: a small file can name a huge mesh.
    loaded_ += values.size();
    if (loaded_ > kMostLoaded) fail(source, "the file has more vertices than can be read");
    const std::uint64_t stride = accessor == kNone ? 3 : count_or(accessor, "stride", 1);
    const std::uint64_t offset = accessor == kNone ? 0 : count_or(accessor, "offset", 0);
    const std::uint64_t count =
        accessor == kNone ? values.size() / 3 : count_or(accessor, "count", 0);
    const std::array<std::uint64_t, 3> axis = axes(accessor);
    const std::uint64_t widest = *std::max_element(axis.begin(), axis.end());
    const Index where = accessor == kNone ? array : accessor;
    if (stride <= widest) fail(where, "a point needs three numbers of its stride");
    if (count > 0 && offset + (count - 1) * stride + widest >= values.size())
      fail(where, "it reaches beyond its float_array");
    std::vector<Vec3> out;
    out.reserve(count);
    for (std::uint64_t i = 0; i < count; ++i) {
      const std::uint64_t at = offset + i * stride;
      out.push_back({values[at + axis[0]], values[at + axis[1]], values[at + axis[2]]});
    }
    return out;
  }

  // Which numbers of a stride are x, y, z: those of the first three params with a name.
  std::array<std::uint64_t, 3> axes(Index accessor) const {
    std::array<std::uint64_t, 3> out{0, 1, 2};
    if (accessor == kNone) return out;
    std::size_t named = 0;
    std::uint64_t number = 0;
    each(accessor, [&](Index param) {
      if (xml_.name(param) != "param") return;
      if (named < 3 && !xml_.attribute(param, "name").empty()) out[named++] = number;
      ++number;
    });
    if (named > 0 && named < 3) fail(accessor, "a point needs three named params");
    return named == 3 ? out : std::array<std::uint64_t, 3>{0, 1, 2};
  }

  struct Inputs {
    std::size_t stride = 1, vertex = 0;
  };

  Inputs inputs(Index primitive) const {
    Inputs out;
    bool found = false;
    each(primitive, [&](Index input) {
      if (xml_.name(input) != "input") return;
      const std::uint64_t offset = count_or(input, "offset", 0);
      if (offset > 255) fail(input, "its offset cannot be right");
      out.stride = std::max<std::size_t>(out.stride, offset + 1);
      if (xml_.attribute(input, "semantic") != "VERTEX") return;
      out.vertex = offset;
      found = true;
    });
    if (!found) fail(primitive, "it has no input VERTEX");
    return out;
  }

  const Shape& shape(Index geometry) {
    const auto [found, fresh] = shapes_.try_emplace(geometry);
    Shape& out = found->second;
    if (!fresh) return out;
    Index mesh = xml_.child(geometry, "mesh");
    if (mesh == kNone) mesh = xml_.child(geometry, "convex_mesh");
    if (mesh == kNone) {
      ++no_polygons_;
      return out;
    }
    const Index vertices = xml_.child(mesh, "vertices");
    if (vertices == kNone) fail(mesh, "it has no <vertices>");
    each(vertices, [&](Index input) {
      if (xml_.name(input) == "input" && xml_.attribute(input, "semantic") == "POSITION" &&
          out.points.empty())
        out.points = positions(follow(input, "source", "source"));
    });
    each(mesh, [&](Index primitive) { add_primitive(primitive, out); });
    return out;
  }

  void add_primitive(Index e, Shape& out) {
    const std::string_view kind = xml_.name(e);
    if (kind == "lines" || kind == "linestrips") ++no_polygons_;
    const bool strips = kind == "tristrips" || kind == "trifans";
    if (kind != "triangles" && kind != "polylist" && kind != "polygons" && !strips) return;
    const Inputs in = inputs(e);
    std::uint64_t faces = 0;
    each(e, [&](Index p) {
      if (xml_.name(p) == "ph") fail(p, "polygons with holes are not read; export triangles");
      if (xml_.name(p) != "p") return;
      const std::vector<std::uint32_t> loop = vertices_of(p, in, out);
      if (kind == "triangles")
        faces += add_triangles(p, loop, out);
      else if (kind == "polylist")
        faces += add_polylist(e, p, loop, out);
      else if (strips)
        faces += add_strip(p, loop, kind == "trifans", out);
      else
        faces += add_face(p, loop, 0, loop.size(), out);
    });
    const std::uint64_t announced = count_or(e, "count", faces);
    if (announced != faces)
      fail(e, "it announces " + std::to_string(announced) + " and has " + std::to_string(faces));
  }

  std::vector<std::uint32_t> vertices_of(Index p, const Inputs& in, const Shape& shape) const {
    const std::vector<std::uint32_t> all = wholes(p);
    if (all.size() % in.stride != 0)
      fail(p, "the number of its indices is no multiple of " + std::to_string(in.stride));
    std::vector<std::uint32_t> out;
    out.reserve(all.size() / in.stride);
    for (std::size_t i = in.vertex; i < all.size(); i += in.stride) {
      if (all[i] >= shape.points.size())
        fail(p, "a face names vertex " + std::to_string(all[i]) + ", there are " +
                    std::to_string(shape.points.size()));
      out.push_back(all[i]);
    }
    return out;
  }

  std::uint64_t add_face(Index p, const std::vector<std::uint32_t>& v, std::size_t begin,
                         std::size_t size, Shape& out) const {
    if (size < 3) fail(p, "a face has " + std::to_string(size) + " corners, 3 are needed");
    const auto first = v.begin() + static_cast<std::ptrdiff_t>(begin);
    out.corners.insert(out.corners.end(), first, first + static_cast<std::ptrdiff_t>(size));
    out.sizes.push_back(static_cast<std::uint32_t>(size));
    return 1;
  }

  std::uint64_t add_triangles(Index p, const std::vector<std::uint32_t>& v, Shape& out) const {
    if (v.size() % 3 != 0) fail(p, "the number of corners is no multiple of 3");
    for (std::size_t i = 0; i < v.size(); i += 3) add_face(p, v, i, 3, out);
    return v.size() / 3;
  }

  std::uint64_t add_polylist(Index e, Index p, const std::vector<std::uint32_t>& v,
                             Shape& out) const {
    const Index vcount = xml_.child(e, "vcount");
    if (vcount == kNone) fail(e, "it has no <vcount>");
    const std::vector<std::uint32_t> sizes = wholes(vcount);
    std::size_t at = 0;
    for (const std::uint32_t size : sizes) {
      if (size > v.size() - at) fail(p, "it has fewer corners than its <vcount> announces");
      add_face(p, v, at, size, out);
      at += size;
    }
    if (at != v.size()) fail(p, "it has more corners than its <vcount> announces");
    return sizes.size();
  }

  std::uint64_t add_strip(Index p, const std::vector<std::uint32_t>& v, bool fan,
                          Shape& out) const {
    for (std::size_t i = 0; i + 2 < v.size(); ++i) {
      const std::vector<std::uint32_t> corners = {fan ? v[0] : v[i], v[i + 1 + (fan ? 0 : i % 2)],
                                                  v[i + 2 - (fan ? 0 : i % 2)]};
      add_face(p, corners, 0, 3, out);
    }
    return 1;
  }

  // ---- nodes ------------------------------------------------------------------------------------

  struct Visit {
    Index node;
    Affine place;  // of what it hangs in
    Index odd;     // a transform on the way that is not read; matters only above a mesh
    int depth;
  };

  void walk_scene() {
    std::vector<Visit> stack;
    const Index scene = xml_.child(0, "scene");
    const Index shown = scene == kNone ? kNone : xml_.child(scene, "instance_visual_scene");
    Index visual = shown == kNone ? kNone : follow(shown, "url", "visual_scene");
    for (Index e = 0; visual == kNone && e < xml_.size(); ++e)
      if (xml_.name(e) == "visual_scene") visual = e;
    if (visual == kNone) return place_library();
    push_nodes(visual, {kNone, {}, kNone, 0}, stack);
    while (!stack.empty()) {
      const Visit visit = stack.back();
      stack.pop_back();
      if (visited_ > 4 * kMaxNodes || visit.depth > 200)
        fail(visit.node, "its nodes repeat or hold themselves without end");
      visit_node(visit, stack);
    }
  }

  // A file without a scene is a library: everything as it is drawn.
  void place_library() {
    for (Index e = 0; e < xml_.size(); ++e)
      if (xml_.name(e) == "geometry") placed_.push_back({&shape(e), {}, part_name(kNone, e)});
  }

  // The last one first: the stack turns them round.
  void push_nodes(Index parent, const Visit& here, std::vector<Visit>& stack) const {
    const auto begin = static_cast<std::ptrdiff_t>(stack.size());
    each(parent, [&](Index c) {
      const std::string_view kind = xml_.name(c);
      if (kind == "node") stack.push_back({c, here.place, here.odd, here.depth + 1});
      if (kind == "instance_node")
        stack.push_back({follow(c, "url", "node"), here.place, here.odd, here.depth + 1});
    });
    if (stack.size() > kMaxNodes) fail(parent, "more nodes than can be read");
    std::reverse(stack.begin() + begin, stack.end());
  }

  void visit_node(const Visit& visit, std::vector<Visit>& stack) {
    Visit here = visit;
    each(visit.node, [&](Index c) {
      ++visited_;
      transform(c, here);
    });
    ++visited_;
    each(visit.node, [&](Index c) {
      const std::string_view kind = xml_.name(c);
      if (kind == "instance_geometry") place(here, follow(c, "url", "geometry"));
      if (kind == "instance_controller") place(here, controlled(follow(c, "url", "controller")));
    });
    push_nodes(visit.node, here, stack);
  }

  // The geometry that a skin or a morph bends, through others that do.
  Index controlled(Index controller) {
    ++bent_;
    for (int depth = 0; depth < 16; ++depth) {
      Index bend = xml_.child(controller, "skin");
      if (bend == kNone) bend = xml_.child(controller, "morph");
      if (bend == kNone) fail(controller, "it has neither skin nor morph");
      const Index target = follow(bend, "source", "");
      if (xml_.name(target) == "geometry") return target;
      if (xml_.name(target) != "controller") fail(bend, "its source is no geometry");
      controller = target;
    }
    fail(controller, "it refers to itself");
  }

  void place(const Visit& here, Index geometry) {
    if (here.odd != kNone) fail(here.odd, "this transform is not read; export it as a <matrix>");
    placed_.push_back({&shape(geometry), here.place, part_name(here.node, geometry)});
    if (placed_.size() > kMaxNodes) fail(here.node, "more parts than can be read");
  }

  std::string part_name(Index node, Index geometry) const {
    for (const Index e : {node, geometry})
      for (const char* key : {"name", "id"})
        if (e != kNone)
          if (const std::string name = xml_.attribute(e, key); !name.empty())
            return printable(name);
    return {};
  }

  // They count from left to right: the last one stands next to the points.
  void transform(Index e, Visit& here) const {
    const std::string_view kind = xml_.name(e);
    if (kind == "translate") {
      const auto t = numbers_of(e, 3);
      here.place = here.place * translation(t[0], t[1], t[2]);
    } else if (kind == "scale") {
      const auto s = numbers_of(e, 3);
      here.place = here.place * scaling(s[0], s[1], s[2]);
    } else if (kind == "rotate") {
      const auto r = numbers_of(e, 4);  // axis, degrees
      const double n = std::sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]);
      if (n == 0 && r[3] == 0) return;
      if (!(n > 0)) fail(e, "its axis has no length");
      const double half = 0.5 * r[3] * std::numbers::pi / 180, s = std::sin(half) / n;
      here.place = here.place * rotation(s * r[0], s * r[1], s * r[2], std::cos(half));
    } else if (kind == "matrix") {
      const auto m = numbers_of(e, 16);  // row by row
      if (m[12] != 0 || m[13] != 0 || m[14] != 0 || m[15] != 1) fail(e, "it is not affine");
      Affine a;
      for (std::size_t i = 0; i < 12; ++i) a.row[i / 4][i % 4] = m[i];
      here.place = here.place * a;
    } else if (kind == "lookat" || kind == "skew") {
      here.odd = e;  // of cameras, as a rule
    }
  }

  std::vector<std::string> remarks() const {
    std::vector<std::string> out = remarks_;
    const auto say = [&](std::size_t count, const std::string& what) {
      if (count > 0) out.push_back(source_.name + ": " + std::to_string(count) + " " + what + ".");
    };
    say(no_polygons_, "sets of lines or curves are left out");
    say(bent_, "parts have a skin or morph targets and are read unbent");
    const Index moves = xml_.child(0, "library_animations");
    if (moves != kNone && xml_.first(moves) != kNone)
      out.push_back(source_.name + ": animations are left out: everything is read where it rests.");
    return out;
  }

  MeshSource source_;  // its scale becomes the file's
  const Xml xml_;
  std::unordered_map<std::string, Index> ids_;
  std::map<Index, Shape> shapes_;  // stay where they are: placed_ points to them
  std::vector<Placed> placed_;
  std::vector<std::string> remarks_;
  static constexpr std::uint64_t kMostLoaded = 300'000'000;
  std::uint64_t loaded_ = 0;
  std::size_t visited_ = 0;  // nodes and what is in them
  std::size_t no_polygons_ = 0, bent_ = 0;
};

}  // namespace

Mesh read_collada(const MeshSource& source) {
  if (source.bytes.substr(0, 4096).find('\0') != std::string_view::npos)
    source.fail(
        "this is not UTF-8 text, so no COLLADA that can be read; was another file renamed?");
  return ColladaReader(source).read();
}

}  // namespace h6::io
