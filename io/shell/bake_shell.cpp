// SPDX-License-Identifier: Apache-2.0
// bake_shell.cpp - points on the surface, then levels and tree.
//
// Many candidates, spread evenly over the area that the outside reaches, are thinned out to the
// wanted number (blue_noise.h), and build_tree makes their levels. A field that is baked here
// decides what the outside reaches. A mesh of one closed piece needs no field: all of it is
// reached.
#include "io/shell/bake_shell.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <new>
#include <optional>

#include "io/shell/candidates.h"
#include "io/shell/tree.h"
#include "sched/parallel_for.h"

namespace h6::io {
namespace {

Outcome check_mesh(const Mesh& mesh) {
  if (mesh.triangles.empty())
    return Failure{"The mesh has no triangles: there is no surface to sample."};
  if (mesh.triangles.size() > UINT32_MAX / 3) {
    return Failure{"The mesh has more than 1.4 billion triangles: simplify it first."};
  }
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    for (const double v : {mesh.vertices[i].x, mesh.vertices[i].y, mesh.vertices[i].z}) {
      if (!(std::abs(v) <= 1e6)) {
        return Failure{"Vertex " + std::to_string(i) +
                       " of the mesh lies nowhere: a coordinate is "
                       "not a number or beyond 1,000,000 m. Check the file and its units."};
      }
    }
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const auto index : mesh.triangles[t]) {
      if (index < mesh.vertices.size()) continue;
      return Failure{"Triangle " + std::to_string(t) + " of the mesh names vertex " +
                     std::to_string(index) + ", but there are only " +
                     std::to_string(mesh.vertices.size()) + "."};
    }
  }
  return Done{};
}

// The spacing of a shell with a tolerance, where the surface is flat: two coarse voxels of a field
// with the same tolerance.
constexpr double kTolerances = 16;

constexpr const char* too_many = ", more than the 20 million a shell can have: ask for ";

Outcome check_options(const ShellBake& options) {
  if (Outcome fine = check_levels(options.levels); !fine) return fine;
  if (!std::isfinite(options.spacing)) {
    return Failure{"The spacing of a shell must be a length in metres."};
  }
  if (!(options.tolerance >= 0) || !std::isfinite(options.tolerance))
    return Failure{"The tolerance of a shell must be a positive length."};
  if (options.tolerance > 0 &&
      (options.surface == ShellSurface::field || options.normals == ShellNormals::field))
    return Failure{
        "A shell with a tolerance has points and normals of its triangles: leave surface and "
        "normals at auto."};
  if (options.tolerance > 0 || options.spacing > 0) return Done{};
  if (options.spacing < 0) {
    return Failure{
        "The spacing of a shell must be more than 0 m (or 0, to give a number of points)."};
  }
  if (options.points == 0) return Failure{"A shell needs at least one point: ask for 1 or more."};
  if (options.points > max_shell_points) {
    return Failure{std::to_string(options.points) + " points" + too_many + "fewer."};
  }
  return Done{};
}

std::string millimetres(double metres) {
  char text[40];
  std::snprintf(text, sizeof text, "%.3g mm", metres * 1e3);
  return text;
}

// Makes a full sentence of a failure of the field bake, which expects a file name before it.
std::string sentence(std::string text) {
  if (text == "cancelled" || text.empty()) return text;
  text[0] = char(std::toupper(static_cast<unsigned char>(text[0])));
  return text.back() == '.' ? text : text + ".";
}

using Warnings = std::vector<std::string>;

// The steps of bake_shell and the data they share.
class Bake {
 public:
  Bake(const Mesh& mesh, const ShellBake& options, Warnings& warnings, Pulse& pulse)
      : mesh_(mesh), options_(options), warnings_(warnings), pulse_(pulse) {}

  Result<ShellData> run() {
    if (!pulse_.step("reading the surface", 0, 0.05)) return cancelled_;
    surface_ = options_.surface;
    if (surface_ == ShellSurface::automatic) surface_ = ShellSurface::triangles;
    if (!pulse_.alive()) return cancelled_;
    Result<Candidates> samples = surface_ == ShellSurface::triangles ? on_triangles() : on_field();
    if (!samples) return samples.failure();
    if (options_.tolerance > 0) return build(samples->points, samples->source, demand().spacing);
    return thin_and_build(*samples);
  }

 private:
  // The unit of candidates [m]: a voxel for those of a field.
  double unit() const { return surface_ == ShellSurface::field ? field_->voxel_size : 1; }
  Demand demand() const {
    double spacing = options_.spacing;
    if (options_.tolerance > 0 && spacing == 0) spacing = kTolerances * options_.tolerance;
    return {options_.points, spacing / unit(), options_.seed, options_.threads};
  }

  // For a sound mesh, the field only has to say what the outside reaches. With half a voxel of
  // offset, the least that no step from node to node can cross, the bake skips its search for gaps
  // narrower than a voxel, which takes seconds where many parts touch.
  static void step_off(const Mesh& mesh, FieldBake& options) {
    if (options.offset >= 0) return;
    Vec3 low{INFINITY, INFINITY, INFINITY}, high{-INFINITY, -INFINITY, -INFINITY};
    for (const auto& triangle : mesh.triangles) {
      for (const std::uint32_t v : triangle) {
        const Vec3& p = mesh.vertices[v];
        low = min(low, p);
        high = max(high, p);
      }
    }
    const double longest = std::max({high.x - low.x, high.y - low.y, high.z - low.z});
    const double padding = std::min(double(options.padding_voxels), options.voxels / 4.0);
    if (options.voxel_size <= 0) options.voxel_size = longest / (options.voxels - 2 * padding);
    options.offset = 0.5001 * options.voxel_size;
  }

  Outcome bake_the_field(bool sound) {
    FieldBake options = options_.field;
    if (sound) step_off(mesh_, options);
    options.threads = options_.threads;
    options.cavities = Cavities::solid;                   // a shell is only touched from outside
    options.grow_thin = surface_ == ShellSurface::field;  // points on triangles must stay outside
    pulse_.step("finding the outside", 0.05, 0.4);
    Result<FieldData> field = bake_field(mesh_, options, &report_, pulse_.part());
    if (!field) return Failure{sentence(field.error())};
    field_ = std::move(*field);
    return Done{};
  }

  Result<Candidates> on_triangles() {
    const FaceTable faces = face_table(mesh_, &pulse_);
    if (!pulse_.alive()) return cancelled_;
    double area = 0;
    for (const double a : faces.area) area += a;
    if (!(area > 0)) {
      return Failure{"The mesh has no area: all its triangles are lines or points."};
    }
    const bool all_outside = faces.pieces == 1 && faces.sheets == 0;
    Reach reach;
    reach.hide = !all_outside;
    reach.field_normals = options_.normals == ShellNormals::field;
    std::optional<FieldView> view;
    if (reach.hide || reach.field_normals) {
      if (Outcome baked = bake_the_field(faces.sheets == 0); !baked) return baked.failure();
      reach.field = &view.emplace(*field_);
      reach.offset = field_->offset / field_->voxel_size;
    }
    pulse_.step("spreading points", 0.4, 0.8);
    Result<Candidates> samples =
        options_.tolerance > 0
            ? points_to_tolerance(mesh_, faces, reach, demand(), options_.tolerance, pulse_)
            : sample_triangles(mesh_, faces, reach, demand(), pulse_);
    if (!samples) return samples;
    warnings_.insert(warnings_.end(), faces.warnings.begin(), faces.warnings.end());
    if (faces.sheets > 0) {
      warnings_.push_back(std::to_string(faces.sheets) +
                          (faces.sheets == 1 ? " piece" : " pieces") +
                          " of the mesh not closed: both sides have points wherever the outside "
                          "reaches both.");
    }
    if (samples->hidden > 0.005) {
      warnings_.push_back(
          std::to_string(std::lround(100 * samples->hidden)) +
          " % of the mesh's area cannot be reached from outside and has no points; gaps below " +
          millimetres(2 * std::max(field_->offset, 0.5 * field_->voxel_size)) +
          " count as closed, more voxels look into narrower ones.");
    }
    return samples;
  }

  Result<Candidates> on_field() {
    if (Outcome baked = bake_the_field(false); !baked) return baked.failure();
    pulse_.step("spreading points", 0.4, 0.8);
    Result<Candidates> samples = sample_zero_set(*field_, demand(), pulse_);
    if (!samples) return samples;
    // Chooses 1.5 times the wanted number at the grid's accuracy, then moves these points exactly
    // to the surface.
    const Thinned some = thinned(*samples, demand().spacing * 0.8, options_.points * 3 / 2);
    if (some.cancelled) return cancelled_;
    for (std::size_t i = 0; i < some.chosen.size(); ++i) {
      samples->points[i] = samples->points[some.chosen[i]];
    }
    samples->points.resize(some.chosen.size());
    const Result<std::unique_ptr<RayScene>> nearest = RayScene::make(mesh_);
    if (!nearest) return Failure{sentence(nearest.error())};
    if (!pulse_.alive()) return cancelled_;
    settle({&mesh_, &*field_, nearest->get(), options_.normals == ShellNormals::triangles},
           options_.threads, pulse_, *samples);
    if (!pulse_.alive()) return cancelled_;
    if (field_->offset > 0) {
      warnings_.push_back(
          std::string(report_.closed ? "" : "The mesh is not closed. ") +
          "Its points lie where its field has its surface, " + millimetres(field_->offset) +
          " outside of the triangles; more voxels or a smaller offset bring them nearer, and "
          "\"triangles\" as surface puts them on the triangles.");
    }
    return samples;
  }

  // By the spacing if it is > 0, else by the number.
  Thinned thinned(const Candidates& samples, double spacing, std::size_t number) {
    Thinning thinning;
    thinning.fixed_radius = spacing > 0;
    thinning.target = thinning.fixed_radius ? max_shell_points : number;
    thinning.first_radius =
        thinning.fixed_radius ? spacing : 0.93 * std::sqrt(samples.area / double(number));
    thinning.both_sides = true;
    thinning.seed = options_.seed;
    thinning.threads = options_.threads;
    thinning.pulse = &pulse_;
    return thin_out(samples.points, thinning);
  }

  Result<ShellData> thin_and_build(const Candidates& samples) {
    const Thinned thinned = this->thinned(samples, demand().spacing, options_.points);
    if (thinned.cancelled) return cancelled_;
    if (thinned.chosen.size() > max_shell_points) {
      return Failure{"This spacing gives " + std::to_string(thinned.chosen.size()) + " points" +
                     too_many + "a wider spacing."};
    }
    std::vector<OrientedPoint> points(thinned.chosen.size());
    std::vector<std::uint32_t> source(thinned.chosen.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (i % 65536 == 0 && !pulse_.alive()) return cancelled_;
      points[i] = in_metres(samples.points[thinned.chosen[i]]);
      source[i] = samples.source[thinned.chosen[i]];
    }
    return build(points, source, thinned.spacing * unit());
  }

  // `spacing` [m] of most points.
  Result<ShellData> build(std::span<const OrientedPoint> points,
                          std::span<const std::uint32_t> source, double spacing) {
    if (points.size() > max_shell_points)
      return Failure{"This shell has " + std::to_string(points.size()) + " points" + too_many +
                     "a larger tolerance."};
    if (!pulse_.step("building levels", 0.8, 1)) return cancelled_;
    TreeOptions tree;
    tree.levels = options_.levels;
    tree.spacing = spacing;
    tree.seed = options_.seed;
    tree.threads = options_.threads;
    tree.pulse = &pulse_;
    return build_tree(points, source, tree);
  }

  OrientedPoint in_metres(OrientedPoint q) const {
    if (surface_ == ShellSurface::triangles) return q;
    const Vec3 p = FieldView(*field_).to_metres({q.p[0], q.p[1], q.p[2]});
    q.p[0] = float(p.x), q.p[1] = float(p.y), q.p[2] = float(p.z);
    return q;
  }

  const Mesh& mesh_;
  const ShellBake& options_;
  Warnings& warnings_;
  Pulse& pulse_;
  const Failure cancelled_{"cancelled"};
  ShellSurface surface_ = ShellSurface::automatic;
  std::optional<FieldData> field_;
  FieldBakeReport report_;
};

constexpr const char* mode_names[] = {"auto", "triangles", "field"};  // both enums, in order

template <class Mode>
std::optional<Mode> mode_from_name(const std::string& name) {
  for (int i = 0; i < 3; ++i) {
    if (name == mode_names[i]) return Mode(i);
  }
  return {};
}

}  // namespace

std::optional<ShellSurface> surface_from_name(const std::string& name) {
  return mode_from_name<ShellSurface>(name);
}
std::optional<ShellNormals> normals_from_name(const std::string& name) {
  return mode_from_name<ShellNormals>(name);
}
const char* name_of(ShellSurface surface) { return mode_names[int(surface)]; }
const char* name_of(ShellNormals normals) { return mode_names[int(normals)]; }

double candidates_for(double points, bool by_spacing) {
  // A fixed spacing needs more, since no second round fills its gaps. Very large shells get fewer
  // to save memory.
  const double each = points > 2e6 ? 4 : by_spacing ? 24 : 12;
  return std::max(4096.0, each * points);
}

Result<double> Demand::wanted(double area) const {
  if (!by_spacing()) return double(points);
  // Random darts at least r apart cover 0.547 of a plane with discs of radius r/2 when no more fit:
  // r = 0.83 sqrt(area / points).
  const double count = std::max(1.0, 0.70 * area / (spacing * spacing));
  if (count <= double(max_shell_points)) return count;
  return Failure{"This spacing gives about " + std::to_string(std::llround(count / 1e6)) +
                 " million points" + too_many + "a wider spacing."};
}

double Demand::guess(double area, double count) const {
  return by_spacing() ? spacing : std::sqrt(area / count);
}

Result<ShellData> bake_shell(const Mesh& mesh, const ShellBake& options,
                             std::vector<std::string>* warnings, const Progress& progress) {
  if (Outcome fine = check_options(options); !fine) return fine.failure();
  if (Outcome fine = check_mesh(mesh); !fine) return fine.failure();
  try {
    Warnings unheard;
    Pulse pulse(progress);
    return Bake(mesh, options, warnings ? *warnings : unheard, pulse).run();
  } catch (const std::bad_alloc&) {
    return Failure{"Not enough memory for this shell: ask for fewer points or a wider spacing."};
  }
}

}  // namespace h6::io
