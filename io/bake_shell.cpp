// bake_shell.cpp - points on the surface, then levels and tree.
//
// Many candidates, spread evenly over the area, are thinned out to the number asked for (see
// blue_noise.h); build_tree makes the levels of those. Normals are those of the triangles.
//
// All of the surface is sampled, also what lies inside the body or cannot be reached from outside:
// such points are never in contact, but they take their share of the number.
#include "io/bake_shell.h"

#include <algorithm>
#include <cmath>
#include <new>

#include "io/cache.h"
#include "io/inward_normals.h"
#include "io/shell_tree.h"
#include "sched/parallel_for.h"

namespace h6::io {
namespace {

// Candidates for each point: few leave gaps, many take time. A fixed spacing has no second round to
// fill its gaps and needs more. Very large shells get fewer: theirs alone fill gigabytes.
double candidates_for(double points, bool by_spacing) {
  const double each = points > 2e6 ? 4 : by_spacing ? 24 : 12;
  return std::max(4096.0, each * points);
}

// A number in [0, 1) of the top bits.
double unit(std::uint64_t bits) { return double(bits >> 11) * 0x1p-53; }

struct Surface {
  FaceTable faces;
  std::vector<double> reach;  // (triangles + 1) running sum of weights
  double area = 0;            // [m^2]
};

// Candidates fall in proportion to area, but wires and slivers get more: along a strip far narrower
// than the spacing, area alone leaves holes. `spacing` is a rough one [m].
void weigh(const Mesh& mesh, double spacing, Surface& surface) {
  const std::size_t count = mesh.triangles.size();
  surface.reach.assign(count + 1, 0);
  for (std::size_t t = 0; t < count; ++t) {
    const double area = surface.faces.area[t];
    double longest2 = 0;
    for (int k = 0; k < 3; ++k) {
      const Vec3 &a = mesh.vertices[mesh.triangles[t][k]],
                 &b = mesh.vertices[mesh.triangles[t][(k + 1) % 3]];
      const double dx = a.x - b.x, dy = a.y - b.y, dz = a.z - b.z;
      longest2 = std::max(longest2, dx * dx + dy * dy + dz * dz);
    }
    const double longest = std::sqrt(longest2);
    double weight = area;
    if (area > 0 && longest > spacing) {
      const double width = 2 * area / longest;
      weight *= std::clamp(0.5 * spacing / width, 1.0, 8.0);
    }
    surface.reach[t + 1] = surface.reach[t] + weight;
  }
}

// Candidate i lies in the i-th of `count` equal parts of the running weight, within its triangle by
// the R2 sequence (additive recurrence with the plastic number): even in large triangles, even over
// many small ones, and a function of i alone, so that threads do not matter.
struct Candidates {
  std::vector<OrientedPoint> points;
  std::vector<std::uint32_t> source;
};

Candidates scatter(const Mesh& mesh, const Surface& surface, std::size_t count, std::uint64_t seed,
                   unsigned threads) {
  Candidates out;
  out.points.resize(count);
  out.source.resize(count);
  constexpr std::size_t slice = 4096;
  const double step = surface.reach.back() / double(count);
  const std::uint64_t start_u = mix(seed, 1), start_v = mix(seed, 2);
  sched::parallel_for((count + slice - 1) / slice, threads, [&](std::size_t s) {
    const std::size_t from = s * slice, to = std::min(count, from + slice);
    const auto first =
        std::upper_bound(surface.reach.begin(), surface.reach.end(), double(from) * step);
    std::size_t t = std::size_t(std::max<std::ptrdiff_t>(first - surface.reach.begin() - 1, 0));
    for (std::size_t i = from; i < to; ++i) {
      const double at = (double(i) + unit(mix(seed ^ 0xA5A5, i))) * step;
      while (t + 1 < mesh.triangles.size() && surface.reach[t + 1] <= at) ++t;
      while (surface.faces.area[t] == 0) --t;  // rounding at the very end
      double u = unit(start_u + i * 0xC13FA9A902A6328Fu),
             v = unit(start_v + i * 0x91E10DA5C79E7B1Du);
      if (u + v > 1) u = 1 - u, v = 1 - v;
      const auto& f = mesh.triangles[t];
      const Vec3 &a = mesh.vertices[f[0]], &b = mesh.vertices[f[1]], &c = mesh.vertices[f[2]];
      const Vec3& n = surface.faces.inward[t];
      out.points[i] = {{float(a.x + u * (b.x - a.x) + v * (c.x - a.x)),
                        float(a.y + u * (b.y - a.y) + v * (c.y - a.y)),
                        float(a.z + u * (b.z - a.z) + v * (c.z - a.z))},
                       {float(n.x), float(n.y), float(n.z)}};
      out.source[i] = std::uint32_t(t);
    }
  });
  return out;
}

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

constexpr const char* too_many = ", more than the 20 million a shell can have: ask for ";

Outcome check_options(const ShellBake& options) {
  if (Outcome fine = check_levels(options.levels); !fine) return fine;
  if (!std::isfinite(options.spacing)) {
    return Failure{"The spacing of a shell must be a length in metres."};
  }
  if (options.spacing > 0) return Done{};
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

// Random darts that keep a distance r from one another cover 0.547 of a plane with discs of radius
// r/2 when no more fit: r = 0.83 sqrt(area / points).
double points_at(double spacing, double area) { return 0.70 * area / (spacing * spacing); }

// Progress from several steps, heard from the calling thread only.
std::function<bool(double)> part_of(const Progress& progress, const char* what, double from,
                                    double to) {
  if (!progress) return {};
  return [&progress, what, from, to](double done) {
    return progress(what, from + (to - from) * std::clamp(done, 0.0, 1.0));
  };
}

Result<ShellData> bake(const Mesh& mesh, const ShellBake& options,
                       std::vector<std::string>* warnings, const Progress& progress) {
  if (progress && !progress("reading the surface", 0)) return Failure{"cancelled"};
  Surface surface;
  surface.faces = face_table(mesh);
  for (const double area : surface.faces.area) surface.area += area;
  if (!(surface.area > 0)) {
    return Failure{"The mesh has no area: all its triangles are lines or points."};
  }
  const bool by_spacing = options.spacing > 0;
  const double wanted =
      by_spacing ? std::max(1.0, points_at(options.spacing, surface.area)) : double(options.points);
  if (wanted > double(max_shell_points)) {
    return Failure{"A spacing of " + std::to_string(options.spacing) + " m gives about " +
                   std::to_string(std::llround(wanted / 1e6)) + " million points" + too_many +
                   "a wider spacing."};
  }
  const double guess = by_spacing ? options.spacing : std::sqrt(surface.area / wanted);
  weigh(mesh, guess, surface);
  const double boost = std::min(surface.reach.back() / surface.area, 3.0);
  const auto count = std::size_t(candidates_for(wanted, by_spacing) * boost);
  const Candidates candidates = scatter(mesh, surface, count, options.seed, options.threads);

  Thinning thinning;
  thinning.target = by_spacing ? max_shell_points : options.points;
  thinning.first_radius = by_spacing ? options.spacing : 0.93 * guess;
  thinning.fixed_radius = by_spacing;
  thinning.both_sides = true;
  thinning.seed = options.seed;
  thinning.threads = options.threads;
  thinning.keep_going = part_of(progress, "spreading points", 0.1, 0.8);
  const Thinned thinned = thin_out(candidates.points, thinning);
  if (thinned.cancelled) return Failure{"cancelled"};
  if (thinned.chosen.size() > max_shell_points) {
    return Failure{"This spacing gives " + std::to_string(thinned.chosen.size()) + " points" +
                   too_many + "a wider spacing."};
  }

  std::vector<OrientedPoint> points;
  std::vector<std::uint32_t> source;
  points.reserve(thinned.chosen.size());
  source.reserve(thinned.chosen.size());
  for (const auto id : thinned.chosen) {
    points.push_back(candidates.points[id]);
    source.push_back(candidates.source[id]);
  }
  TreeOptions tree;
  tree.levels = options.levels;
  tree.spacing = thinned.spacing;
  tree.seed = options.seed;
  tree.threads = options.threads;
  tree.keep_going = part_of(progress, "building levels", 0.8, 1);
  Result<ShellData> shell = build_tree(points, source, tree);
  if (!shell) return shell;
  shell->input_hash = content_hash(mesh, options);
  if (warnings) {
    warnings->insert(warnings->end(), surface.faces.warnings.begin(), surface.faces.warnings.end());
  }
  return shell;
}

}  // namespace

Result<ShellData> bake_shell(const Mesh& mesh, const ShellBake& options,
                             std::vector<std::string>* warnings, const Progress& progress) {
  if (Outcome fine = check_options(options); !fine) return fine.failure();
  if (Outcome fine = check_mesh(mesh); !fine) return fine.failure();
  try {
    return bake(mesh, options, warnings, progress);
  } catch (const std::bad_alloc&) {
    return Failure{"Not enough memory for this shell: ask for fewer points or a wider spacing."};
  }
}

}  // namespace h6::io
