// SPDX-License-Identifier: Apache-2.0
// bake_field.cpp - a field from a mesh, step by step (see grid.h).
//
// The sign: H. Xu, J. Barbic, "Signed distance fields for polygon soup meshes", 2014. All that the
// outside cannot reach is inside. Winding has no effect, so inside-out, mixed or doubled meshes
// give the same field.
#include "io/bake/bake_field.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <optional>
#include <utility>

#include "io/bake/grid.h"
#include "io/bake/holes.h"
#include "io/bake/plan.h"
#include "io/field/unite.h"
#include "io/walls/thin_pieces.h"
#include "sched/clock.h"
#include "sched/parallel_for.h"

namespace h6::io {
namespace bake {

bool Steps::run(const std::string& what, double from, double to, std::size_t count,
                unsigned threads, const std::function<void(std::size_t)>& body) const {
  constexpr std::size_t kSlices = 16;
  const std::size_t grain = count < 4096 ? 1 : 16;
  const std::size_t blocks = (count + grain - 1) / grain;
  const std::size_t slices =
      progress_ ? std::min(kSlices, blocks) : std::min<std::size_t>(1, blocks);
  for (std::size_t s = 0; s < slices; ++s) {
    if (!tell(what, from + (to - from) * double(s) / double(slices))) return false;
    const std::size_t begin = blocks * s / slices, end = blocks * (s + 1) / slices;
    sched::parallel_for(end - begin, threads, [&](std::size_t i) {
      const std::size_t first = (begin + i) * grain, last = std::min(count, first + grain);
      for (std::size_t k = first; k < last; ++k) body(k);
    });
  }
  return tell(what, to);
}

void Steps::clock(const std::string& what) const {
  auto& stages = clock_->stages;
  if (!stages.empty() && stages.back().name == what) return;
  const std::int64_t now = sched::now_ns();
  if (!stages.empty()) stages.back().seconds += 1e-9 * double(now - clock_->since_ns);
  clock_->since_ns = now;
  stages.push_back({what, 0});
}

std::vector<FieldBakeReport::Stage> Steps::stages() const {
  clock("");
  std::vector<FieldBakeReport::Stage> sum;  // a stage entered twice counts once
  for (const FieldBakeReport::Stage& s : clock_->stages) {
    if (s.name.empty()) continue;
    const auto same = std::find_if(sum.begin(), sum.end(),
                                   [&](const auto& other) { return other.name == s.name; });
    if (same == sum.end())
      sum.push_back(s);
    else
      same->seconds += s.seconds;
  }
  return sum;
}

}  // namespace bake

namespace {

std::string plural(std::size_t n, const std::string& one, const std::string& many) {
  return std::to_string(n) + " " + (n == 1 ? one : many);
}

std::string millimetres(double metres) {
  char text[40];
  std::snprintf(text, sizeof text, "%.4g mm", metres * 1e3);
  return text;
}

// The first of the warnings.
void warn_of_gaps(const bake::Surface& surface, const bake::GapWeld& welded, bool by_winding,
                  FieldBakeReport& report) {
  std::string sentence;
  if (!surface.closed)
    sentence =
        "the mesh is not closed: " + plural(surface.odd_edges, "edge has", "edges have") +
        " an odd number of faces (" + std::to_string(surface.open_edges) + " have one); " +
        (by_winding ? "its winding number tells the inside" : "it is taken as a soup") +
        (welded.left > 0 ? "; welding its vertices would leave " + std::to_string(welded.left)
                         : "");
  else if (welded.vertices > 0)
    sentence = plural(welded.vertices, "vertex", "vertices") +
               " of open edges were welded to others up to " + millimetres(welded.widest) +
               " away; this closes the mesh";
  if (!sentence.empty()) report.warnings.insert(report.warnings.begin(), sentence);
}

}  // namespace

void bake::warn(const bake::Surface& surface, const bake::Grid& grid, bool nothing_inside,
                double seal, SignMode sign, FieldBakeReport& report) {
  auto& out = report.warnings;
  if (surface.duplicates > 0)
    out.push_back(plural(surface.duplicates, "triangle is", "triangles are") +
                  " there twice and counted once");
  const double offset = grid.offset * grid.voxel;
  if (offset > 0)
    out.push_back("the surface is moved out by " + millimetres(offset) + ": open sheets become " +
                  millimetres(2 * offset) + " thick, wires as much thicker, and gaps below " +
                  millimetres(2 * offset) + " close; more voxels make this smaller");
  if (surface.closed && seal > 0) out.push_back("the mesh is closed: there is no hole to seal");
  if (!surface.closed && grid.offset < 0.5 && sign != SignMode::winding)
    out.push_back(
        "the offset is below half a voxel and the mesh is open: the outside leaks in "
        "through every hole");
  if (nothing_inside)
    out.push_back(
        "no node of the field lies inside: nothing can touch this obstacle; bake it with "
        "more voxels, or with an offset");
  if (const FieldBakeReport::Thin& thin = report.thin; thin.area > 0) {
    char place[80], area[40];
    std::snprintf(place, sizeof place, "(%.4g, %.4g, %.4g) mm", 1e3 * thin.place.x,
                  1e3 * thin.place.y, 1e3 * thin.place.z);
    std::snprintf(area, sizeof area, "%.4g mm2", 1e6 * thin.area);
    out.push_back("walls thinner than " + millimetres(thin.below) + ", such as one of " +
                  millimetres(thin.thickness) + " at " + place + ", are too thin for the voxels: " +
                  area + " of surface is moved out by " + millimetres(thin.grow) + "; voxels of " +
                  millimetres(thin.thickness / bake::kThin) + " would keep them as they are");
  }
}

namespace {

// Closes gaps of a share of the voxel.
Outcome weld(const Mesh& mesh, const FieldBake& options, bake::Surface& surface,
             bake::GapWeld& welded) {
  if (!(options.weld >= 0 && options.weld <= 1))
    return Failure{"vertices are welded within 0 to 1 voxel"};
  if (surface.closed || (options.weld == 0 && options.weld_length == 0)) return Done{};
  const Result<double> found = bake::finest_voxel(surface, options);
  if (!found) return found.failure();
  const double voxel = *found;
  if (options.weld_length > voxel)
    return Failure{"vertices are welded within a voxel, which is " + millimetres(voxel) +
                   " here: choose less, or larger voxels"};
  const double length = options.weld_length > 0 ? options.weld_length : options.weld * voxel;
  weld_gaps(mesh, length, options.threads, surface, welded);
  return Done{};
}

// Masks and all else that a row has beside its distances: 310 to 670 bytes where rows are many.
constexpr std::size_t kBytesARow = 670;

// Finds the bricks near the surface and their distances.
Outcome measure(const FieldBake& options, const bake::Surface& surface, const bake::Grid& grid,
                const bake::Steps& steps, double from, double to, bake::NarrowBand& band) {
  using namespace bake;
  const unsigned threads = options.threads;
  band = {};
  if (!steps.tell("bricks", from)) return Failure{"cancelled"};
  if (const Outcome found = find_candidates(surface, grid, options, band); !found) return found;
  band.features = surface.features ? surface.features : find_features(surface, threads);
  const auto wanted = std::size_t(
      std::count_if(band.cell.begin(), band.cell.end(), [&](auto c) { return grid.wants(c); }));
  if (const Outcome room = room_for(
          double(wanted * kBrickSamples * sizeof(float) + band.rows() * kBytesARow), options);
      !room)
    return room;
  give_slots(grid, band);
  band.free.resize(band.rows());
  band.first_node.resize(band.rows());
  band.towards.resize(band.rows());
  if (grid.offset < 0.5) band.crossing.resize(band.rows());
  if (!surface.part.empty()) band.part.resize(band.rows());
  band.triangle.resize(band.rows(), -1);
  if (!steps.run("distance", from + 0.05, to, band.tiles.count(), threads, [&](std::size_t tile) {
        const auto triangles = measure_tile(surface, grid, tile, band);
        if (!band.crossing.empty()) cross_tile(surface, grid, tile, triangles, band);
      }))
    return Failure{"cancelled"};
  band.features.reset();
  return Done{};
}

// The holes and cracks of an open mesh.
struct Openings {
  std::optional<bake::Winding> winding;  // of a mesh that is wound like a solid
  std::size_t plugs = 0;                 // facets put across
  std::vector<bake::Hole> sealed;        // widest first
  std::optional<bake::Hole> leak;
};

// Shuts the holes that the winding knows, and plugs those with room for a plug.
Outcome shut_by_winding(const FieldBake& options, const bake::Steps& steps, bake::Surface& surface,
                        bake::Grid& grid, bake::NarrowBand& band, Openings& openings) {
  using namespace bake;
  constexpr double kWidest = 32;  // [voxel]
  const unsigned threads = options.threads;
  const bool any_width = options.sign == SignMode::winding && options.seal == 0;
  Sides known;
  Doors doors = shut_doors(surface, *openings.winding, grid, band, grid.seal, threads, known);
  while (any_width && doors.leak && grid.seal < kWidest) {
    const double reach = grid.reach();
    grid.seal *= 2;
    if (grid.reach() > reach)
      if (const Outcome done = measure(options, surface, grid, steps, 0.3, 0.35, band); !done)
        return done;
    doors = shut_doors(surface, *openings.winding, grid, band, grid.seal, threads, known);
  }
  const Plugs plugs(grid, band, doors.before, doors.shut);
  openings.sealed = plugs.holes();
  openings.leak = doors.leak;
  const double reach = grid.reach(), width = std::exchange(grid.seal, 0);
  // With an offset, plugs alone keep the outside out. Without one, narrow cracks need none.
  const bool keep_shut = grid.offset < 0.5;
  openings.plugs = plugs.put(keep_shut ? 0.75 : 0, surface);
  const bool again = openings.plugs > 0 || grid.reach() < reach;
  if (again)
    if (const Outcome done = measure(options, surface, grid, steps, 0.35, 0.6, band); !done)
      return done;
  if (!keep_shut) return Done{};
  if (again) doors = shut_doors(surface, *openings.winding, grid, band, width, threads, known);
  remove(doors.shut, threads, band.free);
  return Done{};
}

// Distances and crossings of the surface, with its holes closed as far as was asked.
Outcome measure_sealed(const FieldBake& options, const bake::Steps& steps, bake::Surface& surface,
                       bake::Grid& grid, bake::NarrowBand& band, Openings& openings) {
  using namespace bake;
  const unsigned threads = options.threads;
  const bool by_winding = options.sign == SignMode::winding && !surface.closed;
  if (by_winding && options.seal == 0) grid.seal = 2;  // the first that is tried
  if (!surface.closed && grid.seal > 0) openings.winding.emplace(surface, threads);
  if (openings.winding && !openings.winding->trusted()) openings.winding.reset();
  if (by_winding && !openings.winding)
    return Failure{
        "the triangles are not wound like a solid: they are sheets or face both ways; let the sign "
        "be found by flood"};
  const double measured = grid.seal > 0 ? 0.3 : 0.6;
  if (const Outcome done = measure(options, surface, grid, steps, 0.05, measured, band); !done)
    return done;
  if (openings.winding) return shut_by_winding(options, steps, surface, grid, band, openings);
  if (grid.seal == 0) return Done{};
  openings.plugs = plug_holes(grid, band, threads, surface, openings.sealed);
  const double reach = grid.reach();
  grid.seal = 0;
  if (openings.plugs == 0 && grid.reach() == reach) return Done{};
  return measure(options, surface, grid, steps, 0.35, 0.6, band);
}

// Finds the way in where a solid drains.
void look_for_leak(const bake::Surface& surface, const bake::Grid& grid,
                   const bake::NarrowBand& band, const bake::Reached& reached, unsigned threads,
                   Openings& openings) {
  if (surface.closed || openings.leak) return;
  if (!openings.winding) {
    openings.winding.emplace(surface, threads);
    if (!openings.winding->trusted()) return;
  }
  openings.leak = bake::find_leak(surface, *openings.winding, grid, band, reached, threads);
}

void warn_of_holes(const bake::Grid& grid, const Openings& openings, const FieldBake& options,
                   FieldBakeReport& report) {
  const auto in_metres = [&](const bake::Hole& h) {
    return FieldBakeReport::Hole{grid.origin() + grid.voxel * h.place, h.width * grid.voxel};
  };
  const auto about = [](const FieldBakeReport::Hole& h) {
    char text[120];
    std::snprintf(text, sizeof text, "about %.3g mm wide at (%.4g, %.4g, %.4g) mm", 1e3 * h.width,
                  1e3 * h.place.x, 1e3 * h.place.y, 1e3 * h.place.z);
    return std::string(text);
  };
  for (const bake::Hole& h : openings.sealed) report.sealed.push_back(in_metres(h));
  if (openings.leak) report.leaks.push_back(in_metres(*openings.leak));
  if (!report.sealed.empty()) {
    char area[40];
    std::snprintf(area, sizeof area, "%.4g mm2", report.sealed_area * 1e6);
    report.warnings.push_back(plural(report.sealed.size(), "hole was", "holes were") + " closed, " +
                              area + " in all; the widest is " + about(report.sealed.front()));
  }
  if (openings.leak)
    report.warnings.push_back(
        "the outside runs into the solid through an opening " + about(report.leaks.front()) +
        (options.seal > 0 ? ", which is wider than the seal: nothing holds inside; seal wider"
         : options.sign == SignMode::winding
             ? ", which is too wide to be closed: nothing holds inside; mend the mesh"
             : ": nothing holds inside; bake with --seal, or with --sign winding"));
  else if (options.seal > 0 && report.sealed.empty() && !report.closed)
    report.warnings.push_back("no hole up to " + millimetres(options.seal) +
                              " was found that leads into a solid: nothing was sealed");
}

}  // namespace

Result<bake::Baked> bake::bake_on_grid(bake::Surface& surface, bake::Grid grid,
                                       const FieldBake& options, Beyond beyond,
                                       const bake::Steps& steps, FieldBakeReport* report) {
  using namespace bake;
  const Failure cancelled{"cancelled"};
  const unsigned threads = options.threads;
  NarrowBand band;
  Openings openings;
  if (const Outcome done = measure_sealed(options, steps, surface, grid, band, openings); !done)
    return done.failure();

  if (!steps.tell("flood", 0.6)) return cancelled;
  const Reached reached = flood(surface, grid, band, options.cavities, threads);
  if (report) look_for_leak(surface, grid, band, reached, threads, openings);
  Large<std::uint32_t>().swap(band.tiles.triangle);
  Large<std::uint64_t>().swap(band.tiles.near);
  Inside inside;
  if (!look_inside(grid, band, reached, threads, steps, inside)) return cancelled;

  Baked out;
  out.nothing_inside = inside.inside_nodes == 0;
  for (std::size_t r = 0; r < inside.thin.size(); ++r)
    if (inside.thin[r].any()) {
      out.thin.push_back(band.cell[r]);
      out.thin_nodes.push_back(inside.thin[r]);
    }
  for (std::size_t r = 0; r < inside.buried.size(); ++r)
    if (inside.buried[r] != 0) out.unsure.push_back(band.cell[r]);
  out.unsure.insert(out.unsure.end(), reached.unsure.begin(), reached.unsure.end());
  FieldData& field = out.field;
  field.origin = grid.origin();
  field.voxel_size = grid.voxel;
  field.bricks = grid.bricks;
  field.band = grid.band * grid.voxel;
  field.offset = grid.offset * grid.voxel;
  if (!steps.tell("samples", 0.8)) return cancelled;
  write_samples(grid, band, reached, inside, threads, field);
  inside.chains.reset();
  if (beyond == Beyond::sides) out.inside = sides_of(grid, band, reached, threads);
  const bool walls = beyond == Beyond::sides && !out.thin.empty() && options.grow_thin;
  if (beyond == Beyond::bounds || walls)
    if (const Outcome done =
            far_distances(surface, grid, band, reached, threads, steps, field.far_grid);
        !done)
      return done.failure();
  if (report) {
    report->sealed_area = double(openings.plugs) * grid.voxel * grid.voxel;
    warn_of_holes(grid, openings, options, *report);
  }
  return out;
}

namespace {

// Which boxes [voxel] hold one of the given nodes, or may if they are large.
class NearNodes {
 public:
  NearNodes(const bake::Grid& grid, const bake::Baked& baked)
      : grid_(grid), nodes_(baked.thin_nodes), row_(grid.cells(), -1) {
    for (std::size_t i = 0; i < baked.thin.size(); ++i) row_[baked.thin[i]] = std::int32_t(i);
  }
  bool operator()(const Vec3& low, const Vec3& high) const {
    int first[3], last[3];
    for (int k = 0; k < 3; ++k) {
      const int most = 8 * grid_.bricks[std::size_t(k)] - 1;
      first[k] = std::clamp(int(std::floor(component(low, k))), 0, most);
      last[k] = std::clamp(int(std::ceil(component(high, k))), 0, most);
    }
    for (int z = first[2] / 8; z <= last[2] / 8; ++z)
      for (int y = first[1] / 8; y <= last[1] / 8; ++y)
        for (int x = first[0] / 8; x <= last[0] / 8; ++x)
          if (const std::int32_t row = row_[grid_.cell(x, y, z)]; row >= 0) {
            const int corner[3] = {8 * x, 8 * y, 8 * z};
            if (any_within(nodes_[std::size_t(row)], corner, first, last)) return true;
          }
    return false;
  }

 private:
  static bool any_within(const bake::NodeMask& nodes, const int (&corner)[3], const int (&first)[3],
                         const int (&last)[3]) {
    int low[3], high[3];  // in the brick
    for (int k = 0; k < 3; ++k)
      low[k] = std::max(first[k] - corner[k], 0), high[k] = std::min(last[k] - corner[k], 7);
    std::uint64_t line = 0, layer = 0;
    for (int x = low[0]; x <= high[0]; ++x) line |= std::uint64_t{1} << x;
    for (int y = low[1]; y <= high[1]; ++y) layer |= line << (8 * y);
    for (int z = low[2]; z <= high[2]; ++z)
      if ((nodes.z[std::size_t(z)] & layer) != 0) return true;
    return false;
  }

  const bake::Grid& grid_;
  const std::vector<bake::NodeMask>& nodes_;
  std::vector<std::int32_t> row_;  // (cells) of the nodes, or -1
};

constexpr double kGrow = 0.9;  // [voxel] on each side of a thin wall, as on each side of a sheet

}  // namespace

Result<ThinPieces> bake::find_thin(const bake::Surface& surface, const bake::Grid& grid,
                                   const bake::Baked& baked, const FieldBake& options,
                                   FieldBakeReport* report) {
  if (baked.thin.empty() || !options.grow_thin) return ThinPieces{};
  Mesh mesh;
  mesh.vertices.assign(surface.vertices.begin(), surface.vertices.end());
  mesh.triangles.assign(surface.triangles.begin(), surface.triangles.end());
  mesh.part.assign(surface.part.begin(), surface.part.end());
  ThinPieceOptions ask;
  ask.thinner_than = bake::kThin - 2 * grid.offset;
  ask.piece = 2;
  ask.asked = NearNodes(grid, baked);
  ask.threads = options.threads;
  Result<ThinPieces> thin = thin_pieces(mesh, ask);
  if (!thin || !report || thin->area == 0) return thin;
  const double voxel = grid.voxel;
  report->thin = {thin->area * voxel * voxel, thin->thickness * voxel,
                  grid.origin() + voxel * thin->place, ask.thinner_than * voxel, kGrow * voxel};
  return thin;
}

Outcome bake::add_thin(const ThinPieces& thin, const bake::Surface& whole, bake::Grid grid,
                       double cut, FieldBake options, const bake::Steps& steps, FieldData& field) {
  Result<Surface> surface = prepare_surface(thin.mesh, options.threads);
  if (!surface) return surface.failure();
  for (Vec3& v : surface->vertices) v = (1 / cut) * v;
  for (std::int32_t& source : surface->source)
    source = whole.source[std::size_t(thin.source[std::size_t(source)])];
  if (whole.part.empty()) surface->part.clear();
  grid.offset += kGrow / cut;
  grid.seal = 0;
  options.sign = SignMode::flood;
  const WantedBricks* const wanted = std::exchange(grid.wanted, nullptr);
  Result<Baked> walls = bake_on_grid(*surface, grid, options, Beyond::bounds, steps, nullptr);
  if (!walls) return walls.failure();
  grid.wanted = wanted;
  for (std::size_t c = 0; c < grid.cells(); ++c)
    if (!grid.wants(c)) walls->field.brick_index[c] = -1;
  field = unite(std::move(field), walls->field, options.threads);
  field.grown = kGrow / cut * grid.voxel;
  return Done{};
}

namespace {

Result<FieldData> bake_uniform(bake::Surface& surface, const FieldBake& options, bool sealed,
                               const bake::Steps& steps, FieldBakeReport* report) {
  using namespace bake;
  const Result<Grid> grid = choose_grid(surface, options, sealed);
  if (!grid) return grid.failure();
  to_grid(surface, *grid, options.threads);
  Result<Baked> baked = bake_on_grid(surface, *grid, options, Beyond::bounds, steps, report);
  if (!baked) return baked.failure();
  const Result<ThinPieces> thin = find_thin(surface, *grid, *baked, options, report);
  if (!thin) return thin.failure();
  if (thin->area > 0)
    if (const Outcome done =
            add_thin(*thin, surface, *grid, 1, options, steps.part(0.9, 1), baked->field);
        !done)
      return done.failure();
  if (report)
    warn(surface, *grid, baked->nothing_inside && thin->area == 0, options.seal, options.sign,
         *report);
  return std::move(baked->field);
}

Result<FieldData> bake_checked(const Mesh& mesh, FieldBake options, FieldBakeReport* report,
                               const Progress& progress) {
  using namespace bake;
  const Steps steps(progress);
  if (!(options.tolerance >= 0) || !std::isfinite(options.tolerance))
    return Failure{"the tolerance must be a positive length"};
  if (options.tolerance > 0 && options.voxel_size > 0)
    return Failure{"a field takes a tolerance or a voxel size, not both"};
  if (!steps.tell("surface", 0)) return Failure{"cancelled"};
  Result<Surface> prepared = prepare_surface(mesh, options.threads);
  if (!prepared) return prepared.failure();
  Surface& surface = *prepared;
  GapWeld welded;
  if (const Outcome done = weld(mesh, options, surface, welded); !done) return done.failure();
  if (report) {
    report->closed = surface.closed;
    report->welded = welded.left == 0 ? welded.vertices : 0;
    report->weld_widest = welded.left == 0 ? welded.widest : 0;
  }
  const bool sealed = surface.closed && options.sign != SignMode::flood;
  if (mesh.part_names.size() < 2) surface.part.clear();
  const bool parts = !surface.part.empty();
  const auto bake = options.tolerance > 0 ? bake_to_tolerance : bake_uniform;
  Result<FieldData> field = bake(surface, options, sealed, steps, report);
  if (!field) return field;
  field->sign_mode = sealed ? "closed" : options.sign == SignMode::winding ? "winding" : "flood";
  field->triangles = mesh.triangles.size();
  field->tolerance = options.tolerance;
  if (parts) field->part_names = mesh.part_names;
  if (!report) return field;
  warn_of_gaps(surface, welded, options.sign == SignMode::winding, *report);
  report->stages = steps.stages();
  return field;
}

}  // namespace

Result<FieldData> bake_field(const Mesh& mesh, const FieldBake& options, FieldBakeReport* report,
                             const Progress& progress) {
  try {
    return bake_checked(mesh, options, report, progress);
  } catch (const std::bad_alloc&) {
    return Failure{"not enough memory to bake this field: choose larger voxels"};
  }
}

}  // namespace h6::io
