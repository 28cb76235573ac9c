// SPDX-License-Identifier: Apache-2.0
// collada.cpp - COLLADA 1.4 and 1.5 (.dae): the polygons of the scene with the transforms of
// their nodes. <up_axis> is not applied: a part then lies as it was drawn and as its STL or OBJ has
// it.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "io/file/text_scan.h"
#include "io/mesh/assembly.h"
#include "io/mesh/collada_geometry.h"
#include "io/mesh/xml_file.h"

namespace h6::io {
namespace {

class ColladaReader {
 public:
  explicit ColladaReader(const MeshSource& source) : source_(source) {
    if (!same_word(name_of(xml_.root()), "collada"))
      source_.fail("this is XML but no COLLADA; was another file renamed?");
  }

  Mesh read() {
    read_unit();
    walk_scene();
    Mesh mesh = expand(placed_, source_);
    mesh.remarks = remarks();
    return mesh;
  }

 private:
  // Metres in the file's unit, in place of the one given.
  void read_unit() {
    const Element unit = child_of(child_of(xml_.root(), "asset"), "unit");
    const std::string meter = unit.attribute("meter").value();
    if (meter.empty()) return;
    double value = 0;
    if (const char* fault = parse_number(meter, value)) xml_.fail(unit, io::quoted(meter) + fault);
    if (!(value > 0 && value < 1e6)) xml_.fail(unit, io::quoted(meter) + " m is no unit of length");
    if (std::abs(value / source_.scale - 1) < 1e-9) return;
    source_.scale = value;
    remarks_.push_back(source_.name + ": its own unit of length, " + printable(meter) +
                       " m, is used for it.");
  }

  // ---- nodes ------------------------------------------------------------------------------------

  struct Visit {
    Element node;
    Affine place;  // of its parent
    Element odd;   // a transform above it that is not read, an error once a mesh hangs below
    int depth;
  };

  void walk_scene() {
    std::vector<Visit> stack;
    const Element shown = child_of(child_of(xml_.root(), "scene"), "instance_visual_scene");
    Element visual = shown ? xml_.follow(shown, "url", "visual_scene") : Element{};
    for (const Element e : xml_.elements())
      if (!visual && name_of(e) == "visual_scene") visual = e;
    if (!visual) return place_library();
    push_nodes(visual, {{}, {}, {}, 0}, stack);
    while (!stack.empty()) {
      const Visit visit = stack.back();
      stack.pop_back();
      if (visited_ > 4 * kMaxNodes || visit.depth > 200)
        xml_.fail(visit.node, "its nodes repeat or hold themselves without end");
      visit_node(visit, stack);
    }
  }

  // A file without a scene is a library: every geometry is read as it is drawn.
  void place_library() {
    for (const Element e : xml_.elements())
      if (name_of(e) == "geometry") placed_.push_back({&geometry_.shape(e), {}, part_name({}, e)});
  }

  // In reverse order, because a stack returns the last one first.
  void push_nodes(Element parent, const Visit& here, std::vector<Visit>& stack) const {
    const auto begin = static_cast<std::ptrdiff_t>(stack.size());
    each_child(parent, [&](Element c) {
      const std::string_view kind = name_of(c);
      if (kind == "node") stack.push_back({c, here.place, here.odd, here.depth + 1});
      if (kind == "instance_node")
        stack.push_back({xml_.follow(c, "url", "node"), here.place, here.odd, here.depth + 1});
    });
    if (stack.size() > kMaxNodes) xml_.fail(parent, "more nodes than can be read");
    std::reverse(stack.begin() + begin, stack.end());
  }

  void visit_node(const Visit& visit, std::vector<Visit>& stack) {
    Visit here = visit;
    each_child(visit.node, [&](Element c) {
      ++visited_;
      transform(c, here);
    });
    ++visited_;
    each_child(visit.node, [&](Element c) {
      const std::string_view kind = name_of(c);
      if (kind == "instance_geometry") place(here, xml_.follow(c, "url", "geometry"));
      if (kind == "instance_controller")
        place(here, controlled(xml_.follow(c, "url", "controller")));
    });
    push_nodes(visit.node, here, stack);
  }

  // The geometry that a skin or morph bends; one may bend the result of another.
  Element controlled(Element controller) {
    ++bent_;
    for (int depth = 0; depth < 16; ++depth) {
      Element bend = child_of(controller, "skin");
      if (!bend) bend = child_of(controller, "morph");
      if (!bend) xml_.fail(controller, "it has neither skin nor morph");
      const Element target = xml_.follow(bend, "source", "");
      if (name_of(target) == "geometry") return target;
      if (name_of(target) != "controller") xml_.fail(bend, "its source is no geometry");
      controller = target;
    }
    xml_.fail(controller, "it refers to itself");
  }

  void place(const Visit& here, Element geometry) {
    if (here.odd) xml_.fail(here.odd, "this transform is not read; export it as a <matrix>");
    placed_.push_back({&geometry_.shape(geometry), here.place, part_name(here.node, geometry)});
    if (placed_.size() > kMaxNodes) xml_.fail(here.node, "more parts than can be read");
  }

  std::string part_name(Element node, Element geometry) const {
    for (const Element e : {node, geometry})
      for (const char* key : {"name", "id"})
        if (const std::string_view name = e.attribute(key).value(); !name.empty())
          return printable(name);
    return {};
  }

  // A node's transforms apply from the last to the first.
  void transform(Element e, Visit& here) const {
    const std::string_view kind = name_of(e);
    if (kind == "translate") {
      const auto t = xml_.numbers_of(e, 3);
      here.place = here.place * translation(t[0], t[1], t[2]);
    } else if (kind == "scale") {
      const auto s = xml_.numbers_of(e, 3);
      here.place = here.place * scaling(s[0], s[1], s[2]);
    } else if (kind == "rotate") {
      const auto r = xml_.numbers_of(e, 4);  // axis, degrees
      const double n = std::sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]);
      if (n == 0 && r[3] == 0) return;
      if (!(n > 0)) xml_.fail(e, "its axis has no length");
      const double half = 0.5 * r[3] * std::numbers::pi / 180, s = std::sin(half) / n;
      here.place = here.place * rotation(s * r[0], s * r[1], s * r[2], std::cos(half));
    } else if (kind == "matrix") {
      const auto m = xml_.numbers_of(e, 16);  // row by row
      if (m[12] != 0 || m[13] != 0 || m[14] != 0 || m[15] != 1) xml_.fail(e, "it is not affine");
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
    say(geometry_.without_polygons(), "sets of lines or curves are left out");
    say(bent_, "parts have a skin or morph targets and are read unbent");
    if (child_of(xml_.root(), "library_animations").first_child())
      out.push_back(source_.name + ": animations are left out: everything is read where it rests.");
    return out;
  }

  MeshSource source_;  // its scale becomes the file's
  const XmlFile xml_{source_};
  ColladaGeometry geometry_{xml_};
  std::vector<Placed> placed_;
  std::vector<std::string> remarks_;
  std::size_t visited_ = 0;  // nodes and their children
  std::size_t bent_ = 0;     // parts with a skin or a morph
};

}  // namespace

Mesh read_collada(const MeshSource& source) {
  if (source.bytes.substr(0, 4096).find('\0') != std::string_view::npos)
    source.fail(
        "this is not UTF-8 text, so no COLLADA that can be read; was another file renamed?");
  return ColladaReader(source).read();
}

}  // namespace h6::io
