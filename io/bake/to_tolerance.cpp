// SPDX-License-Identifier: Apache-2.0
// to_tolerance.cpp - a field to a tolerance: coarse bricks everywhere, finer samples where those
// miss it.
//
//   coarse ----------------------------------> samples, far bounds
//      |
//   middle (half as wide) -> suspects --> fine (a quarter as wide), only there --> finer samples
//                                             |
//                          crossed edges everywhere --> sides, thin walls
//
// The middle voxels take a sixteenth of the work that fine ones with as wide a band would take.
// Coarse samples that miss between the middle nodes miss there, too, by less: so half of what makes
// a cell finer makes a brick a suspect.
#include <utility>

#include "io/bake/grid.h"
#include "io/bake/plan.h"
#include "io/field/refine.h"
#include "io/walls/thin_pieces.h"

namespace h6::io::bake {
namespace {

// A bake to a tolerance: coarse bricks everywhere, fine ones where those may miss it.
class Refined {
 public:
  Refined(Surface& surface, const GridLevels& grids, const FieldBake& options, const Steps& steps,
          FieldBakeReport* report)
      : surface_(surface), grids_(grids), options_(options), steps_(steps), report_(report) {}

  Result<FieldData> run(bool sealed) {
    // With an offset, sides depend on distances in all fine bricks. Which hollows are empty may
    // depend on the voxels.
    const bool crossings_suffice =
        sealed && grids_.fine.offset == 0 && options_.cavities == Cavities::solid;
    if (crossings_suffice) {
      surface_.features = find_features(surface_, options_.threads);
      if (const Outcome done = bake_coarse(0, options_.sign); !done) return done.failure();
      if (surface_.triangles.size() >= kDense * coarse_.field.brick_count())
        surface_.features.reset();  // they take memory, and one more bake finds them again
      else if (const Outcome done = suspect(); !done)
        return done.failure();
    }
    if (const Outcome done = bake_fine(); !done) return done.failure();
    surface_.features.reset();
    if (!crossings_suffice) {
      // The sides are those of the fine bake.
      const SignMode sign = sealed ? options_.sign : SignMode::flood;
      if (const Outcome done = bake_coarse(0.6, sign); !done) return done.failure();
    }
    return add_walls();
  }

 private:
  // The surface is in fine voxels, with what seals it, but during `body` in voxels `by` times as
  // wide. A power of two changes no digit.
  template <class Body>
  void widened(double by, Body&& body) {
    for (Vec3& v : surface_.vertices) v = (1 / by) * v;
    body();
    for (Vec3& v : surface_.vertices) v = by * v;
  }

  Outcome bake_coarse(double from, SignMode sign) {
    Result<Baked> coarse{Baked{}};
    FieldBake options = options_;
    options.sign = sign;
    widened(kCut, [&] {
      coarse = bake_on_grid(surface_, grids_.coarse, options, Beyond::bounds,
                            steps_.part(from, from + 0.1), nullptr);
    });
    if (!coarse) return coarse.failure();
    coarse_ = std::move(*coarse);
    return Done{};
  }

  // Finds the bricks where the coarse samples are not good enough at the nodes of the middle grid,
  // or where it takes fine voxels to tell. Where only fine voxels let the outside in, the middle
  // bake has the inside on both sides of a surface: such bricks are unsure, or their samples miss.
  Outcome suspect() {
    Result<Baked> middle{Baked{}};
    widened(2, [&] {
      middle = bake_on_grid(surface_, grids_.middle, options_, Beyond::nothing,
                            steps_.part(0.1, 0.2), nullptr);
    });
    if (!middle) return middle.failure();
    wanted_ = suspect_bricks(coarse_.field, middle->field, options_.tolerance, options_.threads);
    for (const auto* bricks : {&middle->thin, &middle->unsure})
      for (const std::uint32_t cell : *bricks) want_around(grids_.middle.place(cell), 2);
    grids_.fine.wanted = &wanted_;
    return Done{};
  }

  // Wants the fine bricks within `size` fine bricks and in one layer around.
  void want_around(const std::array<int, 3>& at, int size) {
    const auto& bricks = grids_.fine.bricks;
    int low[3], high[3];
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::max(0, size * at[k] - 1);
      high[k] = std::min(bricks[k] - 1, size * at[k] + size);
    }
    for (int z = low[2]; z <= high[2]; ++z)
      for (int y = low[1]; y <= high[1]; ++y)
        for (int x = low[0]; x <= high[0]; ++x) {
          wanted_[grids_.coarse.cell(x / kCut, y / kCut, z / kCut)] |= std::uint64_t{1}
                                                                       << Tiles::bit({x, y, z});
        }
  }

  // The middle voxels may not have seen what the fine ones see, which then want bricks around it.
  // Mostly these are few. But each more step may show a little more of a thin shell, so after some
  // steps, or where many are wanted, all are found.
  bool want_more(int step) {
    const std::size_t before = wanted_count();
    for (const auto* bricks : {&fine_.thin, &fine_.unsure})
      for (const std::uint32_t cell : *bricks) want_around(grids_.fine.place(cell), 1);
    const std::size_t more = wanted_count() - before;
    if (more == 0) return false;
    if (step == 3 || more > before / 8) grids_.fine.wanted = nullptr;
    return true;
  }
  std::size_t wanted_count() const {
    std::size_t count = 0;
    for (const std::uint64_t bits : wanted_) count += std::size_t(std::popcount(bits));
    return count;
  }

  Outcome bake_fine() {
    double from = 0.2, to = 0.5;
    for (int step = 1;; ++step) {
      Result<Baked> fine = bake_on_grid(surface_, grids_.fine, options_, Beyond::sides,
                                        steps_.part(from, to), report_);
      if (!fine) return fine.failure();
      fine_ = std::move(*fine);
      if (grids_.fine.wanted == nullptr || !want_more(step)) return Done{};
      fine_ = {};
      from = std::exchange(to, (to + 0.6) / 2);
    }
  }

  Result<FieldData> add_walls() {
    const Result<ThinPieces> thin = find_thin(surface_, grids_.fine, fine_, options_, report_);
    if (!thin) return thin.failure();
    const bool grown = thin->area > 0;
    if (grown) {
      if (const Outcome done = add_thin(*thin, surface_, grids_.fine, 1, options_,
                                        steps_.part(0.7, 0.75), fine_.field);
          !done)
        return done.failure();
      if (const Outcome done = add_thin(*thin, surface_, grids_.coarse, kCut, options_,
                                        steps_.part(0.75, 0.8), coarse_.field);
          !done)
        return done.failure();
    }
    if (report_)
      warn(surface_, grids_.fine, fine_.nothing_inside && !grown, options_.seal, options_.sign,
           *report_);
    if (!steps_.tell("refine", 0.8)) return Failure{"cancelled"};
    const std::uint64_t room = options_.free_memory().value_or(UINT64_MAX);
    std::optional<FieldData> field =
        refine(std::move(coarse_.field), std::move(fine_.field), fine_.inside, options_.tolerance,
               room, options_.threads);
    if (!field) return takes_more_than(double(room));
    return std::move(*field);
  }

  Surface& surface_;
  GridLevels grids_;
  FieldBake options_;
  const Steps& steps_;
  FieldBakeReport* report_;
  WantedBricks wanted_;
  Baked coarse_, fine_;
};

}  // namespace

Result<FieldData> bake_to_tolerance(Surface& surface, const FieldBake& options, bool sealed,
                                    const Steps& steps, FieldBakeReport* report) {
  const Result<GridLevels> grids = choose_grids(surface, options, sealed);
  if (!grids) return grids.failure();
  to_grid(surface, grids->fine, options.threads);
  return Refined(surface, *grids, options, steps, report).run(sealed);
}

}  // namespace h6::io::bake
