// SPDX-License-Identifier: Apache-2.0
#include "io/deform/deformable_file.h"

#include <hdf5.h>

#include <bit>
#include <cstring>
#include <nlohmann/json.hpp>

#include "io/file/content_hash.h"
#include "io/file/json.h"
#include "io/file/write_aside.h"
#include "io/record/first_in_child.h"
#include "io/record/stored.h"

namespace h6::io {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;
using recording::Handle;
using recording::LibraryLock;
using recording::Source;
using recording::Stored;

static_assert(std::endian::native == std::endian::little, "rows are read as they are on disk");

constexpr int kVersion = 1, kWarpedVersion = 2;
constexpr const char* kKind = "hapsix reduced deformable";
constexpr std::uint32_t kNoCorner = 0xffffffff;

// ---- the arrays of a file: their names and shapes, as they are written and must be found

template <class T>
struct Array {
  const char* group;
  const char* name;
  std::vector<hsize_t> shape;
  std::vector<T> values;
};

struct Arrays {
  std::vector<Array<double>> reals;
  std::vector<Array<std::uint32_t>> wholes;
};

Arrays shapes(std::size_t n, std::size_t m, std::size_t fixed, std::size_t r, bool warps) {
  Arrays a;
  a.reals = {{"/mesh", "vertices", {n, 3}, {}},
             {"/modes", "basis", {n, r, 3}, {}},
             {"/modes", "frequency", {r}, {}},
             {"/force", "linear", {r, r}, {}}};
  if (warps) {
    a.reals.push_back({"/modes", "turn", {n, r, 3}, {}});
  } else {
    a.reals.push_back({"/force", "quadratic", {r, pair_count(r)}, {}});
    a.reals.push_back({"/force", "cubic", {r, triple_count(r)}, {}});
  }
  a.wholes = {{"/mesh", "corners", {m, 8}, {}},
              {"/mesh", "material", {m}, {}},
              {"/mesh", "fixed", {fixed}, {}}};
  return a;
}

Arrays to_arrays(const ReducedModel& model) {
  const SolidMesh& mesh = model.mesh;
  Arrays a = shapes(mesh.vertices.size(), mesh.elements.size(), mesh.fixed.size(), model.modes,
                    !model.turn.empty());
  for (const h6Vec3& p : mesh.vertices)
    a.reals[0].values.insert(a.reals[0].values.end(), {p.x, p.y, p.z});
  a.reals[1].values = model.basis;
  a.reals[2].values = model.frequency;
  a.reals[3].values = model.linear;
  if (model.turn.empty())
    a.reals[4].values = model.quadratic, a.reals[5].values = model.cubic;
  else
    a.reals[4].values = model.turn;
  for (const SolidElement& e : mesh.elements) {
    for (std::uint32_t c = 0; c < 8; ++c)
      a.wholes[0].values.push_back(c < e.corners ? e.corner[c] : kNoCorner);
    a.wholes[1].values.push_back(e.material);
  }
  a.wholes[2].values = mesh.fixed;
  return a;
}

void from_arrays(Arrays&& a, ReducedModel& model) {
  SolidMesh& mesh = model.mesh;
  const std::vector<double>& p = a.reals[0].values;
  for (std::size_t i = 0; i + 2 < p.size(); i += 3)
    mesh.vertices.push_back({p[i], p[i + 1], p[i + 2]});
  model.basis = std::move(a.reals[1].values);
  model.frequency = std::move(a.reals[2].values);
  model.linear = std::move(a.reals[3].values);
  if (a.reals.size() == 5)
    model.turn = std::move(a.reals[4].values);
  else
    model.quadratic = std::move(a.reals[4].values), model.cubic = std::move(a.reals[5].values);
  const std::vector<std::uint32_t>&corners = a.wholes[0].values, &material = a.wholes[1].values;
  for (std::size_t i = 0; i < material.size(); ++i) {
    SolidElement e;
    e.corners = corners[8 * i + 4] == kNoCorner ? 4 : 8;
    for (std::uint32_t c = 0; c < e.corners; ++c) e.corner[c] = corners[8 * i + c];
    e.material = material[i];
    mesh.elements.push_back(e);
  }
  mesh.fixed = std::move(a.wholes[2].values);
}

std::uint64_t seal_of(const std::string& text, const Arrays& a) {
  std::uint64_t seal = hash_on(0, text.data(), text.size());
  for (const auto& array : a.reals)
    seal = hash_on(seal, array.values.data(), array.values.size() * sizeof(double));
  for (const auto& array : a.wholes)
    seal = hash_on(seal, array.values.data(), array.values.size() * sizeof(std::uint32_t));
  return seal;
}

// ---- the text

std::string config_text(const ReducedModel& model) {
  ordered_json materials = ordered_json::array();
  for (const SolidMaterial& m : model.mesh.materials)
    materials.push_back(
        {{"name", m.name}, {"young", m.young}, {"poisson", m.poisson}, {"density", m.density}});
  ordered_json made = ordered_json::parse(model.made_with, nullptr, false);
  if (made.is_discarded()) made = nullptr;
  return ordered_json{{"kind", kKind},
                      {"version", model.turn.empty() ? kVersion : kWarpedVersion},
                      {"vertices", model.mesh.vertices.size()},
                      {"elements", model.mesh.elements.size()},
                      {"fixed", model.mesh.fixed.size()},
                      {"modes", model.modes},
                      {"free", model.free},
                      {"mass_damping", model.mass_damping},
                      {"stiffness_damping", model.stiffness_damping},
                      {"materials", materials},
                      {"input_hash", model.input_hash},
                      {"made_with", made}}
      .dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

struct Config {
  std::size_t vertices = 0, elements = 0, fixed = 0;
};

// Fills what the text knows of the model. Throws the package's exceptions on a wrong type.
Config take_config(const ordered_json& json, ReducedModel& model) {
  Config c;
  c.vertices = json.at("vertices").get<std::uint32_t>();
  c.elements = json.at("elements").get<std::uint32_t>();
  c.fixed = json.at("fixed").get<std::uint32_t>();
  model.modes = json.at("modes").get<std::uint32_t>();
  model.free = json.at("free").get<bool>();
  model.mass_damping = json.at("mass_damping").get<double>();
  model.stiffness_damping = json.at("stiffness_damping").get<double>();
  for (const ordered_json& m : json.at("materials"))
    model.mesh.materials.push_back({m.at("name").get<std::string>(), m.at("young").get<double>(),
                                    m.at("poisson").get<double>(), m.at("density").get<double>()});
  model.input_hash = json.at("input_hash").get<std::string>();
  model.made_with = json.at("made_with").dump();
  return c;
}

// ---- writing; false when the library fails

bool put(hid_t group, const char* name, hid_t disk, hid_t memory, const std::vector<hsize_t>& shape,
         const void* values) {
  const Handle space = H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr);
  const Handle made = H5Dcreate2(group, name, disk, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  return made.ok() && H5Dwrite(made, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) >= 0;
}

bool put_all(hid_t h5, const std::string& text, const Arrays& a) {
  for (const char* name : {"/config", "/mesh", "/modes", "/force"})
    if (!Handle(H5Gcreate2(h5, name, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT)).ok()) return false;
  const auto group = [&](const char* name) { return Handle(H5Gopen2(h5, name, H5P_DEFAULT)); };
  const Handle type = recording::fixed_text_type(text.size());
  const std::uint64_t seal = seal_of(text, a);
  if (!put(group("/config"), "whole", type, type, {1}, text.c_str()) ||
      !put(group("/config"), "seal", H5T_STD_U64LE, H5T_NATIVE_UINT64, {1}, &seal))
    return false;
  for (const auto& array : a.reals)
    if (!put(group(array.group), array.name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, array.shape,
             array.values.data()))
      return false;
  for (const auto& array : a.wholes)
    if (!put(group(array.group), array.name, H5T_STD_U32LE, H5T_NATIVE_UINT32, array.shape,
             array.values.data()))
      return false;
  return H5Fflush(h5, H5F_SCOPE_GLOBAL) >= 0;
}

// ---- reading

Result<Source> open_source(const fs::path& file) {
  const std::string cannot = "Cannot read " + file.string() + ": ";
  std::error_code failed;
  if (!fs::exists(file, failed)) return Failure{cannot + "there is no such file."};
  if (!fs::is_regular_file(file, failed)) return Failure{cannot + "it is not a regular file."};
  const std::uint64_t bytes = fs::file_size(file, failed);
  Handle h5;
  if (!failed) h5 = H5Fopen(file.c_str(), H5F_ACC_RDONLY, recording::file_access());
  if (!h5.ok())
    return Failure{cannot +
                   "it is no HDF5 file, or damaged; reduced models are made by `hapsix "
                   "bake deformable`."};
  return Source{file, bytes, std::move(h5), "reduced model"};
}

Result<Handle> open_group(const Source& source, const char* name) {
  if (!recording::has(source.h5, name, H5I_GROUP))
    return source.wrong(std::string("the group ") + name + " is missing.");
  return Handle(H5Gopen2(source.h5, name, H5P_DEFAULT));
}

Result<std::string> read_text(const Source& source) {
  const Result<Handle> config = open_group(source, "/config");
  if (!config) return config.failure();
  const Result<Stored> stored = open_stored_texts(source, *config, "/config", "whole");
  if (!stored) return stored.failure();
  if (stored->dims != std::vector<hsize_t>{1})
    return source.wrong("/config/whole has another shape.");
  std::vector<std::byte> bytes;
  if (Outcome read = read_rows(source, *stored, 0, 1, bytes); !read) return read.failure();
  const char* text = reinterpret_cast<const char*>(bytes.data());
  return std::string(text, strnlen(text, bytes.size()));
}

template <class T>
Outcome read_array(const Source& source, hid_t type, Array<T>& array) {
  const Result<Handle> group = open_group(source, array.group);
  if (!group) return group.failure();
  const Result<Stored> stored = open_stored(source, *group, array.group, array.name, type);
  if (!stored) return stored.failure();
  if (stored->dims != array.shape)
    return source.wrong(stored->name + " has another shape than /config says.");
  std::vector<std::byte> bytes;
  if (Outcome read = read_rows(source, *stored, 0, array.shape[0], bytes); !read) return read;
  array.values.resize(bytes.size() / sizeof(T));
  if (!bytes.empty()) std::memcpy(array.values.data(), bytes.data(), bytes.size());
  return Done{};
}

Outcome check_seal(const Source& source, const std::string& text, const Arrays& arrays) {
  Array<std::uint64_t> seal{"/config", "seal", {1}, {}};
  if (Outcome read = read_array(source, H5T_STD_U64LE, seal); !read) return read;
  if (seal.values[0] != seal_of(text, arrays))
    return source.wrong("it was changed or damaged since it was written; bake it again.");
  return Done{};
}

Result<ordered_json> parse_config(const Source& source, const std::string& text) {
  if (Outcome good = check_json_text(text, "/config/whole"); !good)
    return source.wrong(good.error());
  ordered_json json = ordered_json::parse(text, nullptr, false);
  if (!json.is_object() || json.value("kind", ordered_json()) != kKind)
    return source.wrong("/config does not say that it is one.");
  const ordered_json version = json.value("version", ordered_json());
  if (version != kVersion && version != kWarpedVersion)
    return source.wrong("it is of another version of the format; bake it again.");
  return json;
}

Result<ReducedModel> read_here(const fs::path& file) {
  const Result<Source> source = open_source(file);
  if (!source) return source.failure();
  const Result<std::string> text = read_text(*source);
  if (!text) return text.failure();
  const Result<ordered_json> json = parse_config(*source, *text);
  if (!json) return json.failure();
  ReducedModel model;
  Config config;
  try {
    config = take_config(*json, model);
  } catch (const nlohmann::json::exception&) {
    return source->wrong("/config lacks a value, or has one of another type.");
  }
  if (model.modes < 1 || model.modes > kMostModes)
    return source->wrong("it claims " + std::to_string(model.modes) + " modes.");
  Arrays arrays = shapes(config.vertices, config.elements, config.fixed, model.modes,
                         json->value("version", 0) == kWarpedVersion);
  for (auto& array : arrays.reals)
    if (Outcome read = read_array(*source, H5T_IEEE_F64LE, array); !read) return read.failure();
  for (auto& array : arrays.wholes)
    if (Outcome read = read_array(*source, H5T_STD_U32LE, array); !read) return read.failure();
  if (Outcome sealed = check_seal(*source, *text, arrays); !sealed) return sealed.failure();
  from_arrays(std::move(arrays), model);
  if (!consistent(model)) return source->wrong("its arrays do not fit each other.");
  return model;
}

}  // namespace

Outcome write_deformable(const fs::path& file, const ReducedModel& model) {
  const Arrays arrays = to_arrays(model);
  const std::string text = config_text(model);
  return write_aside(file, [&](const fs::path& aside) -> Outcome {
    const LibraryLock lock;
    const Handle h5 =
        H5Fcreate(aside.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, recording::file_access());
    if (h5.ok() && put_all(h5, text, arrays)) return Done{};
    return Failure{"Cannot write " + file.string() + ": " + recording::library_reason() + "."};
  });
}

Result<ReducedModel> read_deformable(const fs::path& file) {
  const LibraryLock lock;
  if (const Outcome survives =
          recording::first_in_child(file, "a model", [&] { (void)read_here(file); });
      !survives)
    return survives.failure();
  return read_here(file);
}

bool is_deformable(const fs::path& file) {
  const LibraryLock lock;
  const auto says_so = [&] {
    const Result<Source> source = open_source(file);
    if (!source) return false;
    const Result<std::string> text = read_text(*source);
    return text && text->find(kKind) != std::string::npos;
  };
  return recording::first_in_child(file, "its kind", [&] { (void)says_so(); }) && says_so();
}

}  // namespace h6::io
