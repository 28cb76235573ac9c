// bake_field.cpp - a field from a mesh, step by step (see bake_grid.h).
//
// Meaning of the sign: H. Xu, J. Barbic, "Signed distance fields for polygon soup meshes", 2014.
// What the outside cannot reach is inside: winding is never looked at, so inside-out, mixed or
// doubled meshes give the same field.
#include "io/bake_field.h"

#include <algorithm>
#include <new>

#include "io/bake_grid.h"
#include "io/cache.h"
#include "sched/parallel_for.h"

namespace h6::io {
namespace bake {

bool Steps::run(const std::string& what, double from, double to, std::size_t count,
                unsigned threads, const std::function<void(std::size_t)>& body) const {
  constexpr std::size_t kSlices = 16, kGrain = 16;
  const std::size_t blocks = (count + kGrain - 1) / kGrain;
  const std::size_t slices =
      progress_ ? std::min(kSlices, blocks) : std::min<std::size_t>(1, blocks);
  for (std::size_t s = 0; s < slices; ++s) {
    if (!tell(what, from + (to - from) * double(s) / double(slices))) return false;
    const std::size_t begin = blocks * s / slices, end = blocks * (s + 1) / slices;
    sched::parallel_for(end - begin, threads, [&](std::size_t i) {
      const std::size_t first = (begin + i) * kGrain, last = std::min(count, first + kGrain);
      for (std::size_t k = first; k < last; ++k) body(k);
    });
  }
  return tell(what, to);
}

}  // namespace bake

namespace {

constexpr std::size_t kMaxBricks = 1'400'000;

std::string plural(std::size_t n, const std::string& one, const std::string& many) {
  return std::to_string(n) + " " + (n == 1 ? one : many);
}

std::string millimetres(double metres) {
  char text[40];
  std::snprintf(text, sizeof text, "%.4g mm", metres * 1e3);
  return text;
}

void warn(const bake::Surface& surface, const bake::Grid& grid, const bake::Inside& inside,
          FieldBakeReport& report) {
  auto& out = report.warnings;
  if (surface.duplicates > 0)
    out.push_back(plural(surface.duplicates, "triangle is", "triangles are") +
                  " there twice and counted once");
  const double offset = grid.offset * grid.voxel;
  if (!surface.closed)
    out.push_back("the mesh is not closed: " +
                  plural(surface.odd_edges, "edge has", "edges have") +
                  " an odd number of faces (" + std::to_string(surface.open_edges) +
                  " have one); it is taken as a soup");
  if (offset > 0)
    out.push_back("the surface is moved out by " + millimetres(offset) +
                  ": open sheets become " + millimetres(2 * offset) + " thick and gaps below " +
                  millimetres(2 * offset) + " close; more voxels make this smaller");
  if (!surface.closed && grid.offset < 0.5)
    out.push_back("the offset is below half a voxel and the mesh is open: the outside leaks in "
                  "through every hole");
  if (inside.inside_nodes == 0)
    out.push_back("no node of the field lies inside: nothing can touch this obstacle; bake it with "
                  "more voxels, or with an offset");
  else if (inside.thin_edges > 0)
    out.push_back("walls thinner than a voxel (" + millimetres(grid.voxel) + ") at " +
                  plural(inside.thin_edges, "place", "places") +
                  " are no obstacles there; bake with more voxels, or with an offset");
}

// Kept rows become the bricks of the result, in the order of cells.
bool write_samples(const bake::Grid& grid, const bake::NarrowBand& band,
                   const bake::Inside& inside, unsigned threads, FieldData& field) {
  field.brick_index.assign(grid.cells(), -1);
  std::vector<std::uint32_t> kept;
  for (std::size_t r = 0; r < band.rows(); ++r) {
    if (!inside.needed[r]) continue;
    field.brick_index[band.cell[r]] = std::int32_t(kept.size());
    kept.push_back(std::uint32_t(r));
  }
  if (kept.size() > kMaxBricks) return false;
  field.samples.resize(kept.size() * bake::kBrickSamples);
  if (!band.part.empty()) field.part.resize(kept.size());
  sched::parallel_for(kept.size(), threads, [&](std::size_t i) {
    const float* from = band.nodes(kept[i]);
    float* to = field.samples.data() + i * bake::kBrickSamples;
    for (std::size_t n = 0; n < bake::kBrickSamples; ++n)
      to[n] = float(double(from[n]) * grid.voxel);
    if (!band.part.empty()) field.part[i] = band.part[kept[i]];
  });
  return true;
}

Result<FieldData> bake_checked(const Mesh& mesh, const FieldBake& options, FieldBakeReport* report,
                               const Progress& progress) {
  using namespace bake;
  const Steps steps(progress);
  const Failure cancelled{"cancelled"};
  if (!steps.tell("surface", 0)) return cancelled;
  Result<Surface> prepared = prepare_surface(mesh);
  if (!prepared) return prepared.failure();
  Surface& surface = *prepared;
  const bool sealed = surface.closed && options.sign == SignMode::automatic;
  const Result<Grid> grid = choose_grid(surface, options, sealed);
  if (!grid) return grid.failure();
  const unsigned threads = options.threads;
  to_grid(surface, *grid, threads);

  NarrowBand band;
  if (!steps.tell("bricks", 0.05)) return cancelled;
  if (const Outcome found = find_candidates(surface, *grid, threads, band); !found)
    return found.failure();
  band.u.reset(new float[band.rows() * kBrickSamples]);
  if (grid->offset < 0.5) band.crossing.resize(band.rows());
  if (!surface.part.empty() && mesh.part_names.size() > 1) band.part.resize(band.rows());
  else surface.part.clear();
  if (!steps.run("distance", 0.1, 0.6, band.rows(), threads, [&](std::size_t r) {
        measure_row(surface, *grid, r, band);
        if (!band.crossing.empty()) cross_row(surface, *grid, r, band);
      }))
    return cancelled;

  if (!steps.tell("flood", 0.6)) return cancelled;
  const Reached reached = flood(surface, *grid, band, options.cavities, threads);
  Inside inside;
  if (!sign_rows(*grid, band, reached, threads, steps, inside)) return cancelled;

  FieldData field;
  field.origin = grid->origin();
  field.voxel_size = grid->voxel;
  field.bricks = grid->bricks;
  field.band = grid->band * grid->voxel;
  field.offset = grid->offset * grid->voxel;
  field.sign_mode = sealed ? "closed" : "flood";
  field.triangles = mesh.triangles.size();
  if (!band.part.empty()) field.part_names = mesh.part_names;
  if (!write_samples(*grid, band, inside, threads, field))
    return Failure{"the surface fills too many bricks of 8x8x8 nodes: choose larger voxels"};
  if (const Outcome far =
          far_distances(surface, *grid, band, reached, threads, steps, field.far_grid);
      !far)
    return far.failure();
  field.input_hash = content_hash(mesh, options);
  if (report) {
    report->closed = surface.closed;
    warn(surface, *grid, inside, *report);
  }
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
