// SPDX-License-Identifier: Apache-2.0
#include "io/scene/load_scene.h"

#include <algorithm>
#include <chrono>
#include <map>

#include "io/deform/bent_shell.h"
#include "io/deform/deformable_file.h"
#include "io/field/field_file.h"
#include "io/mesh/mesh_file.h"
#include "io/scene/asset_hash.h"
#include "io/scene/cache.h"
#include "io/scene/mass.h"
#include "io/shell/shell_file.h"

namespace h6::io {
namespace {

using Clock = std::chrono::steady_clock;
double since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

std::vector<h6Vec3> points_of(const ShellData& shell) {
  std::vector<h6Vec3> points;
  points.reserve(shell.size());
  for (std::size_t i = 0; i < shell.size(); ++i)
    points.push_back({shell.x[i], shell.y[i], shell.z[i]});
  return points;
}

class Loader {
 public:
  Loader(LoadedScene& out, const Progress& progress) : out_(out), progress_(progress) {}

  Outcome run() {
    for (const SceneBody& body : out_.scene.bodies)
      if (Outcome done = add(body); !done)
        return Failure{"body '" + body.name + "': " + done.error()};
    for (const SceneHand& hand : out_.scene.hands) {
      h6HandDef def = hand.def;
      def.body = out_.body_index(hand.body);
      def.coupling = out_.scene.coupling;
      out_.hands.push_back(def);
    }
    keep_points();
    return make_model();
  }

 private:
  Outcome add(const SceneBody& body) {
    h6BodyDef def = h6DefaultBodyDef();
    def.pose = body.pose;
    def.fixed = body.fixed;
    def.mass = body.mass;
    def.translation_only = body.translation_only;
    if (body.field) {
      Result<int> index = field(body);
      if (!index) return index.failure();
      def.field = *index;
    }
    if (body.shell) {
      Result<int> index = shell(body);
      if (!index) return index.failure();
      def.shell = *index;
      if (body.shell->bends)
        if (Outcome done = bend(body, *index); !done) return done;
    }
    if (Outcome done = mass(body, def); !done) return done;
    out_.bodies.push_back(def);
    return Done{};
  }

  // Reads each mesh file only once.
  template <class Source>
  Result<const Mesh*> mesh_of(const Source& source) {
    if (source.mesh_data) return &*source.mesh_data;
    const Unit unit = source.unit.value_or(out_.scene.unit);
    const std::string key = source.mesh.string() + '\0' + std::to_string(static_cast<int>(unit));
    auto found = meshes_.find(key);
    if (found == meshes_.end()) {
      Result<Mesh> mesh = read_mesh(source.mesh, unit);
      if (!mesh) return mesh.failure();
      if (mesh->unit_is_doubtful && !source.unit && !out_.scene.unit_is_stated)
        return Failure{mesh->remarks.back() + " If they are metres: \"units\": \"m\"."};
      out_.warnings.insert(out_.warnings.end(), mesh->remarks.begin(), mesh->remarks.end());
      out_.meshes.push_back(std::make_unique<const Mesh>(std::move(*mesh)));
      found = meshes_.emplace(key, out_.meshes.back().get()).first;
    }
    return found->second;
  }

  // All fields or all shells. `index` maps the key of an asset to its place in `all`.
  template <class Data>
  struct Kept {
    std::map<std::string, int> index;
    std::vector<Data> all;
  };

  // Returns the index of a body's field or shell. It shares the asset of an earlier body if the
  // content is the same; else it reads the baked file, or bakes the mesh through the cache.
  template <class Data, class Source, class Read, class Bake, class Describe>
  Result<int> obtain(const SceneBody& body, const Source& source, Kept<Data>& kept, Read read,
                     Bake bake, Describe describe, bool shared = true) {
    const auto start = Clock::now();
    LoadedAsset asset;
    asset.body = body.name;
    const HashedMesh* mesh = nullptr;
    std::string key = "file " + source.file.string();
    if (source.file.empty()) {
      Result<const Mesh*> found = mesh_of(source);
      if (!found) return found.failure();
      mesh = &hashes_.try_emplace(*found, **found).first->second;
      key = asset_key(*mesh, source.bake);
    }
    const std::string place = shared ? key : key + " of " + body.name;
    if (const auto known = kept.index.find(place); known != kept.index.end()) return known->second;
    Cached cached;
    Result<Data> data =
        mesh ? bake(*mesh, source.bake, &cached, progress_, source.keep) : read(source.file);
    if (!data) return data.failure();
    for (const std::string& w : cached.warnings)
      out_.warnings.push_back("body '" + body.name + "': " + w);
    asset.hash = mesh ? key : asset_hash(*data);
    asset.from_cache = cached.hit;
    asset.rebuilt = cached.rebuilt;
    asset.seconds = since(start);
    describe(*data, asset);
    out_.assets.push_back(asset);
    return keep(kept, place, std::move(*data));
  }

  template <class Data>
  static int keep(Kept<Data>& kept, const std::string& key, Data data) {
    kept.all.push_back(std::move(data));
    return kept.index[key] = static_cast<int>(kept.all.size()) - 1;
  }

  Result<int> field(const SceneBody& body) {
    Result<int> index = obtain(body, *body.field, fields_, read_field, cached_field,
                               [](const FieldData& data, LoadedAsset& asset) {
                                 asset.is_field = true;
                                 asset.voxel_size = data.voxel_size;
                                 asset.finest = data.finest();
                                 asset.tolerance = data.tolerance;
                                 asset.origin = data.origin;
                                 for (int k = 0; k < 3; ++k) asset.nodes[k] = 8 * data.bricks[k];
                                 asset.bricks = data.brick_count();
                               });
    if (!index || out_.field_meshes.size() == fields_.all.size()) return index;
    out_.field_meshes.emplace_back();  // the field is new
    out_.field_voxels.push_back(fields_.all.back().finest());
    if (!body.field->file.empty()) return index;
    Result<const Mesh*> mesh = mesh_of(*body.field);
    if (!mesh) return mesh.failure();
    out_.field_meshes.back() = std::make_unique<FieldMesh>(**mesh);
    return index;
  }

  Result<int> shell(const SceneBody& body) {
    const auto describe = [](const ShellData& data, LoadedAsset& asset) {
      asset.points = data.size();
      asset.levels = static_cast<int>(data.level_points.size());
    };
    if (!body.shell->points)
      return obtain(body, *body.shell, shells_, read_shell, cached_shell, describe,
                    !body.shell->bends);
    const auto start = Clock::now();
    Result<ShellData> built = build_shell(*body.shell->points, body.shell->bake.levels);
    if (!built) return built.failure();
    LoadedAsset asset;
    asset.body = body.name;
    asset.hash = asset_hash(*built);
    asset.seconds = since(start);
    describe(*built, asset);
    out_.assets.push_back(asset);
    return keep(shells_, "points of " + body.name, std::move(*built));
  }

  // The shell is the last one, since no other body shares it.
  Outcome bend(const SceneBody& body, int index) {
    const auto start = Clock::now();
    const ShellData& shell = shells_.all[static_cast<std::size_t>(index)];
    const BendSource& source = *body.shell->bends;
    Cached cached;
    Result<ReducedModel> model = source.solid
                                     ? cached_bend(*source.solid, source.reduce, &cached, progress_)
                                     : read_deformable(source.file);
    if (!model) return model.failure();
    Result<BentShell> bent = bend_shell(std::move(*model), points_of(shell),
                                        source.solid ? "its model" : source.file.string());
    if (!bent) return bent.failure();
    for (const std::string& w : cached.warnings)
      out_.warnings.push_back("body '" + body.name + "': " + w);
    if (!bent->remark.empty()) out_.warnings.push_back("body '" + body.name + "': " + bent->remark);
    LoadedAsset& asset = out_.assets.back();
    asset.hash = asset_hash(asset.hash, *bent->model);
    asset.modes = bent->model->modes;
    asset.lowest_hz = bent->model->frequency.front();
    asset.from_cache &= !source.solid || cached.hit;
    asset.seconds += since(start);
    bent_.push_back({out_.bodies.size(), static_cast<std::size_t>(index), std::move(*bent)});
    return Done{};
  }

  // Takes the mass properties that the scene states. It derives the rest from the mesh as a uniform
  // solid if the mesh is closed, else from the points of the shell.
  Outcome mass(const SceneBody& body, h6BodyDef& def) {
    if (body.fixed) return Done{};
    std::optional<MassProperties> found;
    if (!body.com || !body.inertia) {
      if (body.shell && (body.shell->mesh_data || !body.shell->mesh.empty())) {
        Result<const Mesh*> mesh = mesh_of(*body.shell);
        if (!mesh) return mesh.failure();
        found = solid_mass(**mesh, body.mass);
      }
      if (!found && body.field && (body.field->mesh_data || !body.field->mesh.empty())) {
        Result<const Mesh*> mesh = mesh_of(*body.field);
        if (!mesh) return mesh.failure();
        found = solid_mass(**mesh, body.mass);
      }
      if (!found && def.shell >= 0)
        found = shell_mass(shells_.all[static_cast<std::size_t>(def.shell)], body.mass);
      if (!found)
        return Failure{
            "its mass properties cannot be derived (no shell, no closed mesh): state 'com' and "
            "'inertia'"};
    }
    def.com = body.com ? *body.com : found->com;
    std::array<double, 6> inertia = body.inertia ? *body.inertia : found->inertia;
    if (body.com && !body.inertia) {  // move the inertia from the derived centre to the stated one
      const double x = def.com.x - found->com.x, y = def.com.y - found->com.y,
                   z = def.com.z - found->com.z, m = body.mass;
      const double more[6] = {m * (y * y + z * z), m * (x * x + z * z), m * (x * x + y * y),
                              -m * x * y,          -m * x * z,          -m * y * z};
      for (int i = 0; i < 6; ++i) inertia[i] += more[i];
    }
    std::copy(inertia.begin(), inertia.end(), def.inertia);
    return Done{};
  }

  void keep_points() {
    for (const ShellData& data : shells_.all) out_.shell_points.push_back(points_of(data));
  }

  Outcome make_model() {
    std::vector<h6FieldDef> fields;
    std::vector<h6ShellDef> shells;
    for (const FieldData& f : fields_.all) fields.push_back(f.def());
    for (const ShellData& s : shells_.all) shells.push_back(s.def());
    std::vector<h6DeformableDef> bends;
    bends.reserve(bent_.size());
    for (const Bent& b : bent_) shells[b.shell].deformable = &bends.emplace_back(b.how.def());
    h6ModelDef def = h6DefaultModelDef();
    def.allocator = out_.allocator;
    def.fields = fields.data(), def.field_count = fields.size();
    def.shells = shells.data(), def.shell_count = shells.size();
    h6Error error{};
    out_.model.reset(h6CreateModel(&def, &error));
    if (!out_.model) return Failure{error.message};
    out_.bends.resize(out_.bodies.size());
    for (Bent& b : bent_) out_.bends[b.body] = std::move(b.how.model);
    return Done{};
  }

  struct Bent {
    std::size_t body, shell;
    BentShell how;
  };

  LoadedScene& out_;
  const Progress& progress_;
  std::map<std::string, const Mesh*> meshes_;  // in out_.meshes
  std::map<const Mesh*, HashedMesh> hashes_;
  Kept<FieldData> fields_;
  Kept<ShellData> shells_;
  std::vector<Bent> bent_;
};

}  // namespace

int LoadedScene::body_index(const std::string& name) const {
  for (std::size_t i = 0; i < scene.bodies.size(); ++i)
    if (scene.bodies[i].name == name) return static_cast<int>(i);
  return -1;
}

const std::vector<h6Vec3>& LoadedScene::watched_points() const {
  static const std::vector<h6Vec3> none;
  const int shell = hands.empty() ? -1 : bodies[static_cast<std::size_t>(hands[0].body)].shell;
  return shell < 0 ? none : shell_points[static_cast<std::size_t>(shell)];
}

double LoadedScene::duration() const {
  if (scene.duration > 0) return scene.duration;
  double longest = 0;
  for (const SceneHand& hand : scene.hands)
    if (!hand.path.empty()) longest = std::max(longest, hand.path.back().t);
  return longest > 0 ? longest : 1;
}

h6SessionDef LoadedScene::session_def() const {
  h6SessionDef def = h6DefaultSessionDef();
  def.bodies = bodies.data(), def.body_count = bodies.size();
  def.hands = hands.data(), def.hand_count = hands.size();
  def.contact = scene.contact;
  def.integrator = scene.integrator;
  def.gradient = scene.gradient;
  def.rate = scene.rate;
  def.max_substeps = scene.max_substeps;
  def.net_stiffness = scene.net_stiffness;
  def.allocator = allocator;
  return def;
}

Result<std::unique_ptr<LoadedScene>> load_scene(Scene scene, const Progress& progress,
                                                const h6Allocator& allocator) {
  auto out = std::make_unique<LoadedScene>();
  out->allocator = allocator;
  out->scene = std::move(scene);
  if (Outcome done = Loader(*out, progress).run(); !done) return done.failure();
  return out;
}

}  // namespace h6::io
