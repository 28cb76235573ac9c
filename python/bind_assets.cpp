// SPDX-License-Identifier: Apache-2.0
// bind_assets.cpp - meshes, fields, shells, models and scenes; what they hold is seen through
// views.
#include <algorithm>
#include <limits>
#include <numeric>

#include "python/bindings.h"

namespace hapsix::python {
namespace {

struct PyMesh {
  Unlocked<Mesh> mesh;
};
// Baked or read, or made of a program's own arrays.
struct OwnField {
  h6FieldDef def = h6DefaultFieldDef();
  std::vector<float> samples, far_grid;
  std::vector<std::int32_t> brick_index;
};
struct PyField {
  Unlocked<Field> field;
  std::unique_ptr<OwnField> own = {};
  h6FieldDef def() const {
    if (own) return own->def;
    h6FieldDef out{};
    h6GetField(field, &out);
    return out;
  }
};
struct OwnShell {
  h6ShellDef def = h6DefaultShellDef();
  std::vector<float> columns, radius;  // x, y, z, nx, ny, nz, one after the other
  std::vector<std::uint32_t> level_first, point, none;
};
struct PyShell {
  Unlocked<Shell> shell;
  std::unique_ptr<OwnShell> own = {};
  h6ShellDef def() const {
    if (own) return own->def;
    h6ShellDef out{};
    h6GetShell(shell, &out);
    return out;
  }
};

template <class T>
T chosen(const std::vector<const char*>& names, const std::string& name, const char* what) {
  std::string all;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (name == names[i]) return static_cast<T>(i);
    all += (all.empty() ? "'" : ", '") + std::string(names[i]) + "'";
  }
  throw py::value_error(std::string(what) + " is '" + name + "', not one of " + all);
}
h6Unit unit_of(const std::string& unit) {
  return chosen<h6Unit>({"m", "mm", "cm", "in"}, unit, "unit");
}

// The option `name` where it is given; it is taken out, so that what is left is unknown.
template <class T>
void take(py::dict& options, const char* name, T& value) {
  if (!options.contains(name)) return;
  value = options[name].cast<T>();
  options.attr("pop")(name);
}
template <class T>
void take_choice(py::dict& options, const char* name, const std::vector<const char*>& names,
                 T& value) {
  std::string text = names[static_cast<std::size_t>(value)];
  take(options, name, text);
  value = chosen<T>(names, text, name);
}
void refuse_rest(const py::dict& options, const char* function) {
  for (const auto& [key, value] : options)
    throw py::type_error(std::string(function) + " has no option '" + std::string(py::str(key)) +
                         "'");
}

h6FieldBakeDef take_field_options(py::dict& options) {
  h6FieldBakeDef def = h6DefaultFieldBakeDef();
  take(options, "voxels", def.voxels), take(options, "voxel_size", def.voxel_size);
  take(options, "tolerance", def.tolerance), take(options, "offset", def.offset);
  take_choice(options, "sign", {"auto", "flood", "winding"}, def.sign);
  take(options, "hollow", def.hollow), take(options, "seal", def.seal);
  take(options, "weld", def.weld), take(options, "band_voxels", def.band_voxels);
  take(options, "threads", def.threads), take(options, "cache", def.cache);
  return def;
}

std::shared_ptr<PyField> bake_field(const PyMesh& mesh, py::object progress,
                                    const py::kwargs& given) {
  py::dict options(given);
  h6FieldBakeDef def = take_field_options(options);
  refuse_rest(options, "bake_field");
  ProgressOf watched(std::move(progress));
  watched.enter(def);
  return std::make_shared<PyField>(PyField{
      watched.run([&](h6Error* error) { return Field(h6BakeField(mesh.mesh, &def, error)); })});
}

std::shared_ptr<PyShell> bake_shell(const PyMesh& mesh, py::object progress,
                                    const py::kwargs& given) {
  py::dict options(given);
  h6ShellBakeDef def = h6DefaultShellBakeDef();
  take(options, "points", def.points), take(options, "spacing", def.spacing);
  take(options, "levels", def.levels), take(options, "seed", def.seed);
  take_choice(options, "surface", {"auto", "triangles", "field"}, def.surface);
  take_choice(options, "normals", {"auto", "triangles", "field"}, def.normals);
  def.field = take_field_options(options);
  refuse_rest(options, "bake_shell");
  ProgressOf watched(std::move(progress));
  watched.enter(def.field);
  return std::make_shared<PyShell>(PyShell{
      watched.run([&](h6Error* error) { return Shell(h6BakeShell(mesh.mesh, &def, error)); })});
}

std::shared_ptr<PyMesh> make_mesh(const Rows<double>& vertices,
                                  const Rows<std::uint32_t>& triangles,
                                  const std::optional<Rows<std::int32_t>>& part) {
  h6MeshDef def = h6DefaultMeshDef();
  def.vertices = vertices.data(), def.vertex_count = rows_of(vertices, 3, "vertices");
  def.triangles = triangles.data(), def.triangle_count = rows_of(triangles, 3, "triangles");
  if (part && static_cast<std::size_t>(part->size()) != def.triangle_count)
    throw py::value_error("part must have one number for each triangle");
  def.part = part ? part->data() : nullptr;
  py::gil_scoped_release release;
  return std::make_shared<PyMesh>(
      PyMesh{Mesh::make([&](h6Error* error) { return h6CreateMesh(&def, error); })});
}

Typed<py::dict, "_MeshInfo"> info_of(const PyMesh& mesh) {
  h6MeshInfo i{};
  {
    py::gil_scoped_release release;
    h6GetMesh(mesh.mesh, &i);
  }
  py::list names;
  for (std::int32_t part = 0; const char* name = h6GetPartName(mesh.mesh, part); ++part)
    names.append(name);
  using namespace py::literals;
  return {py::dict("triangles"_a = i.triangles, "vertices"_a = i.vertices, "parts"_a = i.parts,
                   "duplicates"_a = i.duplicates, "degenerate"_a = i.degenerate,
                   "open_edges"_a = i.open_edges, "odd_edges"_a = i.odd_edges,
                   "components"_a = i.components, "closed"_a = i.closed, "low"_a = tuple_of(i.low),
                   "high"_a = tuple_of(i.high), "volume"_a = i.volume, "names"_a = names)};
}

Typed<py::dict, "_FieldCheck"> check_field(const PyMesh& mesh, const PyField& field,
                                           double stiffness, std::size_t points, bool push,
                                           std::uint32_t threads, py::object progress) {
  h6CheckDef def = h6DefaultCheckDef();
  def.stiffness = stiffness, def.points = points, def.push = push, def.threads = threads;
  h6CheckReport r{};
  ProgressOf watched(std::move(progress));
  watched.enter(def);
  watched.run(
      [&](h6Error* error) { return h6CheckField(mesh.mesh, field.field, &def, &r, error); });
  using namespace py::literals;
  return {py::dict("agrees"_a = r.agrees, "drains"_a = r.drains, "leak"_a = tuple_of(r.leak),
                   "worst_node"_a = r.worst_node, "worst_between"_a = r.worst_between,
                   "wall_hundredth"_a = r.wall_hundredth, "wall_median"_a = r.wall_median,
                   "gap_hundredth"_a = r.gap_hundredth, "gap_median"_a = r.gap_median,
                   "pushed"_a = r.pushed, "holding_force"_a = r.holding_force,
                   "weakest"_a = tuple_of(r.weakest))};
}

void add_meshes(py::module_& m) {
  py::class_<PyMesh, std::shared_ptr<PyMesh>>(m, "Mesh", "Triangles.")
      .def(py::init(&make_mesh), py::arg("vertices"), py::arg("triangles"),
           py::arg("part") = py::none(),
           "vertices (n, 3) [m], triangles (m, 3) rows of vertices, part (m,) or None. Copied.")
      .def_static(
          "read",
          [](const std::string& file, const std::string& unit) {
            const h6Unit in = unit_of(unit);
            py::gil_scoped_release release;
            return std::make_shared<PyMesh>(PyMesh{
                Mesh::make([&](h6Error* error) { return h6ReadMesh(file.c_str(), in, error); })});
          },
          py::arg("file"), py::arg("unit") = "m",
          "STL, OBJ, PLY, glTF, COLLADA, each also .gz. `unit` ('m', 'mm', 'cm', 'in') is that of "
          "a "
          "format that has none.")
      .def_static(
          "parse",
          [](const py::bytes& bytes, const std::string& name, const std::string& unit) {
            const std::string_view text = bytes;
            const h6Unit in = unit_of(unit);
            py::gil_scoped_release release;
            return std::make_shared<PyMesh>(PyMesh{Mesh::make([&](h6Error* error) {
              return h6ParseMesh(text.data(), text.size(), name.c_str(), in, error);
            })});
          },
          py::arg("bytes"), py::arg("name"), py::arg("unit") = "m",
          "The same from memory; the ending of `name` tells the format.")
      .def_property_readonly(
          "info", &info_of,
          "dict: triangles, vertices, parts, duplicates, degenerate, open_edges, "
          "odd_edges, components, closed, low, high [m], volume [m^3], names");
}

// An array of three or four axes, z before y before x, of which `sizes` are as told.
template <class T>
std::vector<T> copied(const Rows<T>& array, const std::vector<py::ssize_t>& sizes,
                      const char* sentence) {
  if (!std::equal(sizes.begin(), sizes.end(), array.shape(), array.shape() + array.ndim()))
    throw py::value_error(sentence);
  return {array.data(), array.data() + array.size()};
}

std::shared_ptr<PyField> own_field(const Rows<float>& samples, const Rows<std::int32_t>& index,
                                   const Rows<float>& far_grid, const Numbers<h6Vec3>& origin,
                                   double voxel_size, double band) {
  if (index.ndim() != 3) throw py::value_error("brick_index must have the shape (bz, by, bx)");
  const py::ssize_t z = index.shape(0), y = index.shape(1), x = index.shape(2);
  for (const py::ssize_t bricks : {x, y, z})
    if (bricks < 1 || bricks > 256) throw py::value_error("there may be 1 .. 256 bricks a side");
  py::gil_scoped_release release;
  auto own = std::make_unique<OwnField>();
  own->brick_index = copied(index, {z, y, x}, "");
  own->far_grid = copied(far_grid, {z + 1, y + 1, x + 1},
                         "far_grid must have the shape (bz + 1, by + 1, bx + 1)");
  const py::ssize_t count = samples.ndim() > 0 ? samples.shape(0) : 0;
  own->samples = copied(samples, {count, 8, 8, 8}, "samples must have the shape (bricks, 8, 8, 8)");
  h6FieldDef& d = own->def;
  d.origin = struct_of<h6Vec3>(origin), d.voxel_size = voxel_size, d.band = band;
  d.bricks[0] = static_cast<std::int32_t>(x), d.bricks[1] = static_cast<std::int32_t>(y);
  d.bricks[2] = static_cast<std::int32_t>(z);
  d.brick_index = own->brick_index.data(), d.far_grid = own->far_grid.data();
  d.samples = own->samples.data(), d.brick_count = static_cast<std::size_t>(count);
  return std::make_shared<PyField>(PyField{Field(), std::move(own)});
}

// One level: every point is a node without children.
std::shared_ptr<PyShell> own_shell(const Rows<double>& points, const Rows<double>& normals) {
  const std::size_t n = rows_of(points, 3, "points");
  if (rows_of(normals, 3, "normals") != n)
    throw py::value_error("normals must have a row for each point");
  if (n > std::numeric_limits<std::uint32_t>::max()) throw py::value_error("too many points");
  py::gil_scoped_release release;
  auto own = std::make_unique<OwnShell>();
  own->columns.resize(6 * n), own->radius.assign(n, 0);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t c = 0; c < 3; ++c) {
      own->columns[c * n + i] = static_cast<float>(points.data()[3 * i + c]);
      own->columns[(3 + c) * n + i] = static_cast<float>(normals.data()[3 * i + c]);
    }
  own->level_first = {0, static_cast<std::uint32_t>(n)};
  own->point.resize(n), own->none.assign(n, 0);
  std::iota(own->point.begin(), own->point.end(), 0u);
  h6ShellDef& d = own->def;
  const float* column = own->columns.data();
  d.point_count = n, d.level_count = 1;
  for (const float** to : {&d.x, &d.y, &d.z, &d.nx, &d.ny, &d.nz}) *to = column, column += n;
  d.level_first = own->level_first.data(), d.node_point = own->point.data();
  d.node_radius = own->radius.data();
  d.node_first_child = d.node_child_count = own->none.data();
  return std::make_shared<PyShell>(PyShell{Shell(), std::move(own)});
}

void add_fields(py::module_& m) {
  py::class_<PyField, std::shared_ptr<PyField>>(
      m, "Field", "A signed distance field in sparse bricks. Its arrays are views without copies.")
      .def(py::init(&own_field), py::arg("samples"), py::arg("brick_index"), py::arg("far_grid"),
           py::kw_only(), py::arg("origin"), py::arg("voxel_size"), py::arg("band"),
           "A field of your own: arrays as the properties of these names show them, copied. Where "
           "they are no field, Model says why. Every cell with a point nearer than band [m] to the "
           "surface must have its 8 nodes in bricks, and far_grid must not exceed the distance.")
      .def_static(
          "read",
          [](const std::string& file) {
            py::gil_scoped_release release;
            return std::make_shared<PyField>(PyField{
                Field::make([&](h6Error* error) { return h6ReadField(file.c_str(), error); })});
          },
          py::arg("file"), "A .vdb.")
      .def(
          "write",
          [](const PyField& f, const std::string& file) {
            if (f.own) throw py::value_error("only a field that was baked or read can be written");
            py::gil_scoped_release release;
            h6Error error{};
            if (!h6WriteField(f.field, file.c_str(), &error)) throw Error(error);
          },
          py::arg("file"), "A .vdb.")
      .def_property_readonly(
          "origin", [](const PyField& f) { return tuple_of(f.def().origin); },
          "(3,) node (0, 0, 0), mesh frame [m]")
      .def_property_readonly(
          "voxel_size", [](const PyField& f) { return f.def().voxel_size; }, "[m]")
      .def_property_readonly(
          "band", [](const PyField& f) { return f.def().band; }, "[m]")
      .def_property_readonly(
          "samples",
          [](const py::object& self) {
            const h6FieldDef d = self.cast<const PyField&>().def();
            return view(d.samples, {static_cast<py::ssize_t>(d.brick_count), 8, 8, 8},
                        {2048, 256, 32, 4}, self);
          },
          "(bricks, 8, 8, 8) float32, axes brick, z, y, x: signed distance [m]")
      .def_property_readonly(
          "brick_index",
          [](const py::object& self) {
            const h6FieldDef d = self.cast<const PyField&>().def();
            const py::ssize_t x = d.bricks[0], y = d.bricks[1], z = d.bricks[2];
            return view(d.brick_index, {z, y, x}, {4 * x * y, 4 * x, 4}, self);
          },
          "(bz, by, bx) int32: row in `samples`, -1: no brick")
      .def_property_readonly(
          "far_grid",
          [](const py::object& self) {
            const h6FieldDef d = self.cast<const PyField&>().def();
            const py::ssize_t x = d.bricks[0] + 1, y = d.bricks[1] + 1, z = d.bricks[2] + 1;
            return view(d.far_grid, {z, y, x}, {4 * x * y, 4 * x, 4}, self);
          },
          "(bz + 1, by + 1, bx + 1) float32: bounds of the distance at nodes (8a, 8b, 8c) [m]");
}

void add_shells(py::module_& m) {
  const auto points = [](const char* which) {
    return [which](const py::object& self) {
      const h6ShellDef d = self.cast<const PyShell&>().def();
      const std::string name = which;
      const float* data = name == "x"    ? d.x
                          : name == "y"  ? d.y
                          : name == "z"  ? d.z
                          : name == "nx" ? d.nx
                          : name == "ny" ? d.ny
                                         : d.nz;
      return column(data, d.point_count, self);
    };
  };
  py::class_<PyShell, std::shared_ptr<PyShell>> shell(
      m, "Shell", "Points that may touch, coarse ones first. Its arrays are views without copies.");
  shell
      .def(
          py::init(&own_shell), py::arg("points"), py::arg("normals"),
          "A shell of your own: points (n, 3) [m] and their inward unit normals (n, 3), copied, in "
          "one level: each is looked at in every frame near the field. For more than some "
          "thousand points bake_shell is faster.")
      .def_static(
          "read",
          [](const std::string& file) {
            py::gil_scoped_release release;
            return std::make_shared<PyShell>(PyShell{
                Shell::make([&](h6Error* error) { return h6ReadShell(file.c_str(), error); })});
          },
          py::arg("file"), "A .ply.")
      .def(
          "write",
          [](const PyShell& s, const std::string& file) {
            if (s.own) throw py::value_error("only a shell that was baked or read can be written");
            py::gil_scoped_release release;
            h6Error error{};
            if (!h6WriteShell(s.shell, file.c_str(), &error)) throw Error(error);
          },
          py::arg("file"), "A .ply.")
      .def(
          "__len__", [](const PyShell& s) { return s.def().point_count; },
          "How many points there are.");
  for (const char* name : {"x", "y", "z"})
    shell.def_property_readonly(name, points(name), "(points,) float32, mesh frame [m]");
  for (const char* name : {"nx", "ny", "nz"})
    shell.def_property_readonly(name, points(name), "(points,) float32, inward unit normal");
}

std::shared_ptr<PyModel> make_model(const std::vector<std::shared_ptr<PyField>>& fields,
                                    const std::vector<std::shared_ptr<PyShell>>& shells) {
  std::vector<h6FieldDef> f;
  std::vector<h6ShellDef> s;
  for (const auto& field : fields) f.push_back(field->def());
  for (const auto& shell : shells) s.push_back(shell->def());
  py::gil_scoped_release release;
  auto model = std::make_shared<PyModel>();
  model->own = create_model(f, s);
  return model;
}

using Samples = Typed<py::tuple,
                      "Tuple[numpy.ndarray[numpy.float64], "
                      "numpy.ndarray[numpy.float64], numpy.ndarray[bool]]">;
Samples sample_field(const PyModel& model, std::int32_t field, const Rows<double>& points) {
  const std::size_t count = rows_of(points, 3, "points");
  py::array_t<double> distance(count), gradient({count, std::size_t{3}});
  py::array_t<bool> exact(count);
  static_assert(sizeof(bool) == 1);
  const double* in = points.data();
  double *d = distance.mutable_data(), *g = gradient.mutable_data();
  auto* e = reinterpret_cast<std::uint8_t*>(exact.mutable_data());
  int result;
  {
    py::gil_scoped_release release;
    result = h6SampleField(model.get(), field, in, count, d, g, e);
  }
  if (result != 0) throw py::index_error("the model has no field " + std::to_string(field));
  return py::make_tuple(distance, gradient, exact);
}

void add_models(py::module_& m) {
  py::class_<PyModel, std::shared_ptr<PyModel>>(m, "Model",
                                                "Fields and shells, immutable, shared by sessions.")
      .def(py::init(&make_model), py::arg("fields"), py::arg("shells"),
           "Copies fields and shells, whose places here are the indices that bodies name. An Error "
           "says which of them is damaged.")
      .def_property_readonly(
          "bytes", [](const PyModel& model) { return h6ModelBytes(model.get()); },
          "memory that the model holds")
      .def("sample_field", &sample_field, py::arg("field"), py::arg("points"),
           "points (n, 3) in the field's mesh frame [m] -> distance (n,) [m], gradient (n, 3), "
           "exact "
           "(n,) bool: a sample, not a bound")
      .def(
          "stiffness_for",
          [](const PyModel& model, const Definition& definition) {
            return definition.with([&](const h6SessionDef& def) {  // a copy, which no one changes
              py::gil_scoped_release release;
              return h6StiffnessFor(model.get(), &def);
            });
          },
          py::arg("definition"),
          "The contact stiffness that such a session has [N/m]; 0: not valid.");
}

std::shared_ptr<PyScene> read_scene(const std::string& name, bool outside, py::object progress) {
  h6SceneDef def = h6DefaultSceneDef();
  def.outside = outside;
  ProgressOf watched(std::move(progress));
  watched.enter(def);
  return std::make_shared<PyScene>(PyScene{
      watched.run([&](h6Error* error) { return Scene(h6ReadScene(name.c_str(), &def, error)); })});
}

void add_scenes(py::module_& m) {
  py::class_<PyScene, std::shared_ptr<PyScene>>(m, "Scene",
                                                "Parts, hands and rules of a scene file.")
      .def(py::init(&read_scene), py::arg("name"), py::kw_only(), py::arg("outside") = false,
           py::arg("progress") = py::none(),
           "A scene file (.json) or a generated scene ('peg-in-hole'). Assets are baked, or come "
           "from "
           "the cache. outside: files outside the scene's folder may be read.")
      .def_property_readonly(
          "model",
          [](const std::shared_ptr<PyScene>& scene) {
            auto model = std::make_shared<PyModel>();
            model->scene = scene;
            return model;
          },
          "made of the scene's parts; it lives as long as the scene")
      .def(
          "definition",
          [](const PyScene& scene) {
            h6SessionDef def;
            h6GetSceneSession(scene.scene, &def);
            return std::make_shared<Definition>(def);
          },
          "A new Definition of a session, to be changed at will.")
      .def_property_readonly(
          "duration", [](const PyScene& s) { return h6GetSceneDuration(s.scene); }, "[s]")
      .def_property_readonly(
          "bodies",
          [](const PyScene& scene) -> NameTuple {
            py::list names;
            for (std::int32_t i = 0; const char* name = h6GetBodyName(scene.scene, i); ++i)
              names.append(name);
            return py::tuple(names);
          },
          "names of bodies, in the order of their indices")
      .def(
          "path",
          [](const PyScene& scene, std::int32_t hand,
             double time) -> Typed<py::tuple, "Tuple[Tuple[float, ...], Tuple[float, ...]]"> {
            h6DeviceSample sample;
            if (!h6SampleScenePath(scene.scene, hand, time, &sample))
              throw py::index_error("hand " + std::to_string(hand) + " has no path");
            return py::make_tuple(tuple_of(sample.pose), tuple_of(sample.velocity));
          },
          py::arg("hand"), py::arg("time"),
          "Where the scene's hand wants to be at a time [s]: pose (7,), velocity (6,).");
}

}  // namespace

void add_assets(py::module_& m) {
  add_meshes(m);
  add_fields(m);
  add_shells(m);
  add_models(m);
  add_scenes(m);
  m.def(
      "bake_field", &bake_field, py::arg("mesh"), py::kw_only(), py::arg("progress") = py::none(),
      "A Field of a Mesh. Options: voxels (256), voxel_size [m], tolerance [m], offset [m], sign "
      "('auto', 'flood', 'winding'), hollow, seal [m], weld [voxel], band_voxels (3), threads (0: "
      "all), cache (False). progress(what, done) may return False to cancel.");
  m.def("bake_shell", &bake_shell, py::arg("mesh"), py::kw_only(), py::arg("progress") = py::none(),
        "A Shell of a Mesh. Options: points (10000), spacing [m], levels (7), seed, surface and "
        "normals "
        "('auto', 'triangles', 'field'), and those of bake_field for the field that finds what the "
        "outside reaches.");
  m.def("check_field", &check_field, py::arg("mesh"), py::arg("field"), py::kw_only(),
        py::arg("stiffness") = 1e4, py::arg("points") = 20000, py::arg("push") = true,
        py::arg("threads") = 0, py::arg("progress") = py::none(),
        "Compares a field with its mesh; dict as h6CheckReport, lengths in m, force in N.");
}

}  // namespace hapsix::python
