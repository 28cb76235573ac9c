// SPDX-License-Identifier: Apache-2.0
// exact_check.cpp - compares random places of a field with its mesh, by Embree.
#include "io/check/exact_check.h"

#include <algorithm>
#include <cmath>

#include "io/check/ray_votes.h"
#include "io/field/view.h"
#include "io/walls/thin_pieces.h"
#include "kernels/field/field_layout.h"
#include "kernels/field/sample_field.h"
#include "sched/parallel_for.h"

namespace h6::io {
namespace {

constexpr double kJitter = 2.5;      // [voxel] how far near places lie from the mesh, per axis
constexpr double kPromised = 9;      // [tolerance] bake_field.h
constexpr double kNodeSlack = 1e-3;  // [voxel] error that counts as exact
constexpr double kFarSlack = 1e-4;   // [voxel] rounding of the engine's sampler
constexpr std::size_t kBlock = 128;  // places per task; sums are joined in the order of blocks
constexpr int kRuns = 200;           // straight runs in a search for a way out

struct Worst {
  double most = 0, sum = 0;
  std::size_t count = 0;
  void add(double error) { most = std::max(most, error), sum += error, ++count; }
  void add(const Worst& o) { most = std::max(most, o.most), sum += o.sum, count += o.count; }
  double mean() const { return count > 0 ? sum / double(count) : 0; }
};

struct Tally {
  Worst node, between, asked, gap, inside_gap, corner, deep;
  ExactCheck sum;  // its counts
  double excess = 0;
  std::size_t lost = 0;  // places near the mesh where the field has no samples

  void add(const Tally& o) {
    node.add(o.node), between.add(o.between), asked.add(o.asked), gap.add(o.gap),
        inside_gap.add(o.inside_gap), corner.add(o.corner), deep.add(o.deep);
    excess = std::max(excess, o.excess), lost += o.lost;
    for (const auto count :
         {&ExactCheck::buried, &ExactCheck::grown, &ExactCheck::odd, &ExactCheck::nearer,
          &ExactCheck::missed, &ExactCheck::voted, &ExactCheck::doubtful, &ExactCheck::solid,
          &ExactCheck::drained, &ExactCheck::filled, &ExactCheck::enclosed, &ExactCheck::far,
          &ExactCheck::far_wrong})
      sum.*count += o.sum.*count;
    if (o.sum.leak_depth > sum.leak_depth) sum.leak_depth = o.sum.leak_depth, sum.leak = o.sum.leak;
  }
};

// The bounds in the engine's own layout, without the bricks.
class FarBounds {
 public:
  FarBounds(const FieldData& field, unsigned threads) : def_(field.def()) {
    table_.resize(field.brick_index.size());
    kernels::layout_table(def_, table_.data());
    far_.resize(8 * kernels::field_layout_size(def_).far_cells);
    sched::parallel_for(table_.size() / def_.bricks[0], threads, [&](std::size_t row) {
      kernels::layout_row(def_, table_.data(), row, nullptr, far_.data());
    });
  }
  bool any() const { return !far_.empty(); }
  // The bound at a place in voxels. Returns false where there are samples, or where the corners of
  // the cell disagree about the side.
  bool operator()(const Vec3& g, double& bound, bool& inside) const {
    const std::size_t nx = std::size_t(def_.bricks[0]), ny = std::size_t(def_.bricks[1]);
    const std::size_t x = std::size_t(g.x / 8), y = std::size_t(g.y / 8), z = std::size_t(g.z / 8);
    if (table_[(z * ny + y) * nx + x] >= 0) return false;
    int below = 0;
    for (std::size_t k = 0; k < 8; ++k)
      below +=
          def_.far_grid[((z + (k >> 2)) * (ny + 1) + y + (k >> 1 & 1)) * (nx + 1) + x + (k & 1)] <
          0;
    if (below != 0 && below != 8) return false;
    inside = below == 8;
    const kernels::FieldView view{{def_.bricks[0], def_.bricks[1], def_.bricks[2]},
                                  table_.data(),
                                  nullptr,
                                  far_.data(),
                                  kernels::layout_band(def_)};
    const kernels::Affine same{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
    const float p[3] = {float(g.x), float(g.y), float(g.z)};
    float d = 0;
    kernels::sample_field_ref(view, same, {&p[0], &p[1], &p[2], 1}, nullptr, 1, &d, nullptr,
                              nullptr, nullptr);
    bound = std::fabs(double(d));
    return true;
  }

 private:
  h6FieldDef def_;
  std::vector<std::int32_t> table_;
  std::vector<std::int16_t> far_;
};

// The surfaces that the bake may have moved out because walls are thin there.
class GrownWalls {
 public:
  static Result<GrownWalls> find(const Mesh& mesh, const FieldData& field, unsigned threads) {
    GrownWalls walls;
    if (field.grown == 0) return walls;
    const double voxel = field.finest();
    ThinPieceOptions ask;
    ask.thinner_than = 1.51 * voxel;  // the bake's limit is 1.5
    ask.piece = 2 * voxel;
    ask.threads = threads;
    Result<ThinPieces> pieces = thin_pieces(mesh, ask);
    if (!pieces) return pieces.failure();
    if (pieces->mesh.triangles.empty()) return walls;
    walls.pieces_ = std::make_unique<Mesh>(std::move(pieces->mesh));
    auto rays = RayScene::make(*walls.pieces_);
    if (!rays) return rays.failure();
    walls.rays_ = std::move(*rays);
    return walls;
  }
  // Infinity if there is none.
  double distance(const Vec3& p) const {
    return rays_ ? rays_->distance(p) : std::numeric_limits<double>::infinity();
  }

 private:
  std::unique_ptr<Mesh> pieces_;
  std::unique_ptr<RayScene> rays_;
};

class Check {
 public:
  Check(const Mesh& mesh, const FieldData& field, const ExactCheckOptions& options,
        const RayScene& rays, const FaceTable& faces, const GrownWalls& grown, bool closed)
      : field_(field),
        view_(field),
        options_(options),
        rays_(rays),
        faces_(faces),
        votes_(rays, faces),
        places_(mesh),
        grown_walls_(grown),
        far_(field, options.threads),
        h_(field.voxel_size),
        offset_(field.offset / field.voxel_size),
        grown_(field.grown / field.voxel_size),
        closed_(closed) {}

  bool has_area() const { return places_.area() > 0; }

  Tally near(std::size_t i) const {
    Tally t;
    Dice dice(options_.seed, i);
    Vec3 g{}, p{};
    const float* sample = nullptr;
    for (int tries = 0; sample == nullptr && tries < 4; ++tries) {
      p = places_(dice).p;
      for (double* c : {&p.x, &p.y, &p.z}) *c += h_ * dice.within(-kJitter, kJitter);
      g = view_.from_metres(p);
      sample = node({std::round(g.x), std::round(g.y), std::round(g.z)});
    }
    if (sample == nullptr) {
      t.lost = 1;
      return t;
    }
    const Vec3 at = view_.to_metres({std::round(g.x), std::round(g.y), std::round(g.z)});
    const RayScene::Near near = rays_.nearest(at);
    const double d = double(*sample) / h_, u = near.distance / h_;
    // Where a thin wall was made thicker, what lies near is nearer to it than to the mesh. The
    // bake's pieces of walls end up to a piece and a half elsewhere.
    const double thin = grown_walls_.distance(at) / h_;
    if (thin < u + 2 * grown_ + 3) {
      grown(d, u, thin, t);
      return t;
    }
    if (u < field_.band / h_) distance(d, near, dice, t);
    if (u > std::max(2 * offset_, kNodeSlack)) side(at, d < 0, u, dice, t);
    double value = 0;
    if (view_.distance(g, value) && value >= 0) {
      const double error = value + offset_ - rays_.distance(p) / h_;
      if (!options_.sealed || error > 0) t.between.add(std::fabs(error));
    }
    return t;
  }

  // A place as near to the mesh as the tolerance is promised.
  Tally asked(std::size_t i) const {
    Tally t;
    if (field_.tolerance == 0) return t;
    Dice dice(options_.seed + 2, i);
    const double reach = kPromised * field_.tolerance;
    for (int tries = 0; tries < 8; ++tries) {
      Vec3 p = places_(dice).p;
      for (double* c : {&p.x, &p.y, &p.z}) *c += reach * dice.within(-1, 1);
      const RayScene::Near near = rays_.nearest(p);
      if (near.distance < reach) {
        tolerance(p, near, dice, t);
        break;
      }
    }
    return t;
  }

  Tally far(std::size_t i) const {
    Tally t;
    if (!far_.any()) return t;
    Dice dice(options_.seed + 1, i);
    Vec3 g{};
    double bound = 0;
    bool inside = false;
    for (int tries = 0;; ++tries) {
      if (tries == 64) return t;  // hardly any place lacks samples
      // The engine's last cell ends at the last node.
      g = {dice.within(0, 8 * field_.bricks[0] - 1), dice.within(0, 8 * field_.bricks[1] - 1),
           dice.within(0, 8 * field_.bricks[2] - 1)};
      g = {double(float(g.x)), double(float(g.y)), double(float(g.z))};
      if (far_(g, bound, inside)) break;
    }
    const Vec3 p = view_.to_metres(g);
    t.sum.far = 1;
    const Kept kept = promise(p, bound, inside, dice, t);
    if (!inside) t.gap.add(kept.gap);
    corner(g, dice, t);
    // Rays cost more than distances, so only a tenth of the places gets them.
    if (i % 10 != 0) return t;
    if (kept.near.distance / h_ > std::max(2 * offset_, kNodeSlack))
      side(p, inside, kept.near.distance / h_, dice, t);
    if (inside && outer(kept.near, dice)) t.inside_gap.add(kept.gap);
    return t;
  }

 private:
  // The nearest point, and by how much the bound is below the distance [voxel].
  struct Kept {
    RayScene::Near near;
    double gap;
  };
  Kept promise(const Vec3& p, double bound, bool inside, Dice& dice, Tally& t) const {
    const RayScene::Near near = rays_.nearest(p);
    const double u = near.distance / h_, most = inside ? u + offset_ : u - offset_;
    if (bound > most + kFarSlack && (!inside || outer(near, dice)))
      t.sum.far_wrong = 1, t.excess = std::max(t.excess, bound - most);
    return {near, most - bound};
  }
  // Checks the far grid at one of its own nodes, a corner of the cell of `g`.
  void corner(const Vec3& g, Dice& dice, Tally& t) const {
    const std::size_t c[3] = {std::size_t(g.x / 8), std::size_t(g.y / 8), std::size_t(g.z / 8)};
    const std::size_t nx = std::size_t(field_.bricks[0]) + 1,
                      ny = std::size_t(field_.bricks[1]) + 1;
    const double far = double(field_.far_grid[(c[2] * ny + c[1]) * nx + c[0]]) / h_;
    const Kept kept =
        promise(view_.to_metres({8.0 * double(c[0]), 8.0 * double(c[1]), 8.0 * double(c[2])}),
                std::fabs(far), far < 0, dice, t);
    if (far >= 0) t.corner.add(kept.gap);
  }
  // Whether the outside is on either side of the mesh there. If not, the mesh is buried in the
  // solid there, and the way out is longer than the distance to the mesh.
  bool outer(const RayScene::Near& near, Dice& dice) const {
    const Vec3& n = faces_.inward[near.triangle];
    for (const double step : {-1.05, 1.05}) {
      const double s = step * h_ * std::max(room(), 0.1);
      const Vec3 beside{near.point.x + s * n.x, near.point.y + s * n.y, near.point.z + s * n.z};
      if (votes_.side(beside, dice) == RayVotes::Side::outside && leads_out(beside, dice))
        return true;
    }
    return false;
  }
  // The radius [voxel] of a ball where a flood from node to node certainly passes too: sigma and
  // half a voxel's diagonal. Without an offset no way is too narrow.
  double room() const { return offset_ > 0 ? offset_ + 0.9 : 0; }
  bool leads_out(const Vec3& p, Dice& dice) const {
    return votes_.way_out(p, room() * h_, kRuns, dice);
  }

  const float* node(const Vec3& n) const {
    const double c[3] = {n.x, n.y, n.z};
    std::size_t at[3];
    for (std::size_t k = 0; k < 3; ++k) {
      if (!(c[k] >= 0 && c[k] < 8.0 * field_.bricks[k])) return nullptr;
      at[k] = std::size_t(c[k]);
    }
    const std::size_t nx = std::size_t(field_.bricks[0]), ny = std::size_t(field_.bricks[1]);
    const std::int32_t row = field_.brick_index[(at[2] / 8 * ny + at[1] / 8) * nx + at[0] / 8];
    if (row < 0) return nullptr;
    return &field_.samples[std::size_t(row) * 512 + (at[2] % 8 * 8 + at[1] % 8) * 8 + at[0] % 8];
  }

  // Compares a node with what bake_field.h promises.
  void distance(double d, const RayScene::Near& near, Dice& dice, Tally& t) const {
    const double u = near.distance / h_;
    // A node nearer to the surface than the mesh allows is next to a plug. The mesh allows a node
    // in front of the surface its distance, a node in a solid the least depth that the offset
    // leaves.
    const bool solid = d <= -offset_;
    const double to_surface = solid ? -d : d + offset_,
                 to_mesh = solid ? std::fabs(offset_ - u) : u;
    if (options_.sealed && to_surface < to_mesh - kNodeSlack) {
      ++t.sum.nearer;
    } else if (d >= 0) {
      t.node.add(std::fabs(d + offset_ - u));
    } else if (-d > u + offset_ + kNodeSlack) {
      if (outer(near, dice))
        t.deep.add(-d - u - offset_);
      else
        ++t.sum.buried;
    } else if (offset_ == 0) {
      t.node.add(std::fabs(-d - u));
    } else {
      t.node.add(std::max(0.0, std::fabs(offset_ - u) + d));
    }
  }

  // Near walls that grew: outside, the distance to the mesh or to what grew, or between them where
  // a part of the wall did not grow. Inside, no more than the depth in what grew.
  void grown(double d, double u, double thin, Tally& t) const {
    ++t.sum.grown;
    if (u >= field_.band / h_) return;
    const double to_mesh = u - offset_, to_grown = thin - grown_ - offset_;
    const double error = std::min(std::fabs(d - to_mesh), std::fabs(d - to_grown));
    t.sum.odd += d > 0 && error > kNodeSlack;
    t.node.add(std::max(0.0, d - to_mesh));
    const double deepest = std::min(-u, thin - grown_) - grown_ - offset_;
    if (d < deepest - kNodeSlack) t.deep.add(deepest - d);
  }

  // A place near the mesh, which is nearest to it at `near`.
  void tolerance(const Vec3& p, const RayScene::Near& near, Dice& dice, Tally& t) const {
    const double reach = kPromised * field_.tolerance, u = near.distance;
    if (grown_walls_.distance(p) < u + 2 * field_.grown + reach) return;
    double found = 0, bound = 0;
    const Vec3 g = view_.from_metres(p);
    if (!view_.distance(g, found)) {
      // The field need not have samples near a sheet that lies buried deep in the solid.
      bool inside = false;
      if (far_(g, bound, inside) && inside && !outer(near, dice)) return;
      t.asked.add(reach / field_.tolerance);
      ++t.sum.missed;
      return;
    }
    found *= h_;
    double error = std::fabs(std::fabs(found) - u);
    if (field_.offset > 0) {
      // Behind a sheet the field knows the way out, which need not be the distance to the mesh.
      if (found <= -field_.offset) return;
      error = std::fabs(found + field_.offset - u);
      if (found < 0 && error > field_.tolerance && !has_room(p, near)) return;
    } else if (closed_) {
      const RayVotes::Side says = votes_.side(p, dice);
      if (says == RayVotes::Side::doubtful) return;
      if ((found < 0) != (says == RayVotes::Side::inside)) error = std::fabs(found) + u;
    }
    if (options_.sealed && std::fabs(found) < u) return;  // nearer to a plug than to the mesh
    // Where parts overlap, the way out is longer than the way to the mesh.
    if (-found > u && error > field_.tolerance && !outer(near, dice)) return;
    t.asked.add(error / field_.tolerance);
    t.sum.missed += error > field_.tolerance;
  }
  // Whether a ball that a flood from fine node to fine node follows fits between the mesh and the
  // place's side of it. Narrower grooves may close, and are solid then.
  bool has_room(const Vec3& p, const RayScene::Near& near) const {
    if (!(near.distance > 0)) return true;
    const double radius = field_.offset + 0.9 * field_.finest();
    const Vec3 middle = near.point + radius / near.distance * (p - near.point);
    return rays_.distance(middle) > 0.999 * radius;
  }

  void side(const Vec3& p, bool inside, double u, Dice& dice, Tally& t) const {
    const RayVotes::Side says = votes_.side(p, dice);
    if (says == RayVotes::Side::doubtful) {
      ++t.sum.doubtful;
      return;
    }
    ++t.sum.voted;
    t.sum.solid += says == RayVotes::Side::inside;
    if (inside == (says == RayVotes::Side::inside)) return;
    if (!inside) {
      ++t.sum.drained;
      if (u > t.sum.leak_depth) t.sum.leak_depth = u, t.sum.leak = p;
      return;
    }
    const bool out = u > room() && leads_out(p, dice);
    ++(out ? t.sum.filled : t.sum.enclosed);
  }

  const FieldData& field_;
  const FieldView view_;
  const ExactCheckOptions& options_;
  const RayScene& rays_;
  const FaceTable& faces_;
  const RayVotes votes_;
  const SurfacePlaces places_;
  const GrownWalls& grown_walls_;
  const FarBounds far_;
  const double h_, offset_, grown_;  // [m], [voxel], [voxel]
  const bool closed_;
};

// Adds ask(i) for all i < count to `sum`. Returns false when the user cancelled.
template <class Ask>
bool ask_all(std::size_t count, unsigned threads, const Progress& progress, const char* what,
             double from, double to, Tally& sum, const Ask& ask) {
  const std::size_t blocks = (count + kBlock - 1) / kBlock;
  constexpr std::size_t kSlices = 20;
  for (std::size_t s = 0; s < kSlices; ++s) {
    if (progress && !progress(what, from + (to - from) * double(s) / kSlices)) return false;
    const std::size_t first = blocks * s / kSlices, last = blocks * (s + 1) / kSlices;
    std::vector<Tally> part(last - first);
    sched::parallel_for(part.size(), threads, [&](std::size_t b) {
      const std::size_t begin = (first + b) * kBlock;
      for (std::size_t i = begin; i < std::min(count, begin + kBlock); ++i) part[b].add(ask(i));
    });
    for (const Tally& t : part) sum.add(t);
  }
  return true;
}

}  // namespace

Result<ExactCheck> check_exactly(const Mesh& mesh, const FieldData& field,
                                 const ExactCheckOptions& options, const Progress& progress) {
  const Failure cancelled{"cancelled"};
  if (progress && !progress("rays", 0)) return cancelled;
  const Result<std::unique_ptr<RayScene>> rays = RayScene::make(mesh);
  if (!rays) return rays.failure();
  const FaceTable faces = face_table(mesh);
  const Result<GrownWalls> grown = GrownWalls::find(mesh, field, options.threads);
  if (!grown) return grown.failure();
  const bool closed = audit(mesh).closed;
  const Check check(mesh, field, options, **rays, faces, *grown, closed);
  if (!check.has_area())
    return Failure{"the mesh has no area: there is nothing to check a field with"};
  Tally sum;
  if (!ask_all(options.points, options.threads, progress, "near the mesh", 0.1, 0.5, sum,
               [&](std::size_t i) { return check.near(i); }))
    return cancelled;
  if (sum.lost > options.points * 9 / 10)
    return Failure{
        "hardly any place near the mesh has samples in the field: it was baked from "
        "another mesh, or in another unit"};
  if (field.tolerance > 0 && !ask_all(options.points, options.threads, progress, "between nodes",
                                      0.5, 0.6, sum, [&](std::size_t i) { return check.asked(i); }))
    return cancelled;
  if (!ask_all(options.far_points, options.threads, progress, "far from it", 0.6, 1, sum,
               [&](std::size_t i) { return check.far(i); }))
    return cancelled;

  ExactCheck out = sum.sum;
  out.closed = closed;
  out.nodes = sum.node.count, out.worst_node = sum.node.most, out.mean_node = sum.node.mean();
  out.between = sum.between.count;
  out.worst_between = sum.between.most, out.mean_between = sum.between.mean();
  out.asked = sum.asked.count;
  out.worst_asked = sum.asked.most, out.mean_asked = sum.asked.mean();
  out.far_excess = sum.excess;
  out.outside = sum.gap.count, out.far_gap = sum.gap.mean();
  out.inside = sum.inside_gap.count, out.inside_gap = sum.inside_gap.mean();
  out.deep = sum.deep.count, out.worst_deep = sum.deep.most;
  out.corner_gap = sum.corner.mean();
  return out;
}

}  // namespace h6::io
