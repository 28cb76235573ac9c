// SPDX-License-Identifier: Apache-2.0
// start_place.cpp - a free start near contact, proved by the engine, and a path that touches.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "io/propose/propose_scene.h"

namespace h6::io {
namespace {

constexpr double kNear = 0.05;     // of the part: a free place this near to contact is kept
constexpr double kGap = 0.03;      // of the part: the gap to an obstacle where the start is chosen
constexpr double kFitting = 1;     // [voxel] overlaps of press fits; the place is then kept
constexpr double kResting = 0.01;  // [voxel] faces that lie on one another
constexpr double kUpFirst = 1.5;   // the way up may be longer than the shortest by this factor
constexpr int kTries = 8;

std::string phrase(const char* pattern, auto... values) {
  char text[300];
  std::snprintf(text, sizeof text, pattern, values...);
  return text;
}

struct Overlap {
  std::size_t points = 0;
  double depth_voxels = 0;
  bool unknown = false;  // a point so deep that the field knows only a bound
};

struct FreeSession {
  void operator()(h6Session* session) const { h6DestroySession(session); }
};

h6Vec3 axis_vector(int axis, double sign) {
  return {axis == 0 ? sign : 0, axis == 1 ? sign : 0, axis == 2 ? sign : 0};
}

class StartFinder {
 public:
  StartFinder(const ScenePlan& plan, LoadedScene& loaded)
      : plan_(plan), loaded_(loaded), unit_(loaded.scene.unit) {
    const double step = plan.voxel / 50 / metres(unit_);
    grid_ = std::pow(10, std::floor(std::log10(step))) * metres(unit_);
    const double force = plan.stiffness * plan.voxel / 2;
    press_ = 1.2 * force / plan.coupling + 2 * plan.voxel;
    gap_ = std::max(kGap * plan.size, 4 * plan.voxel);
  }

  Result<StartPlace> find(bool not_inside) {
    Result<Overlap> given = overlap({});
    if (!given) return given.failure();
    if (given->points == 0 && plan_.way->inside({}) == 0) return near(plan_.way->nearest({}));
    choose_way_out();
    const bool fits = !given->unknown && given->depth_voxels <= kFitting &&
                      plan_.way->inside({}, kFitting * plan_.voxel) == 0;
    if (fits && !not_inside) return fit(*given);
    return outside(*given);
  }

 private:
  std::string length(double l) const { return length_text(l, unit_); }
  h6Vec3 on_grid(const h6Vec3& p) const {
    const auto round = [&](double x) { return grid_ * std::round(x / grid_) + 0.0; };
    return {round(p.x), round(p.y), round(p.z)};
  }
  static std::string direction(const h6Vec3& d) {
    const double c[3] = {d.x, d.y, d.z};
    for (int axis = 0; axis < 3; ++axis)
      if (std::abs(c[axis]) > 0.9999) return std::string(c[axis] > 0 ? "+" : "-") + "xyz"[axis];
    return phrase("(%.2f, %.2f, %.2f)", d.x, d.y, d.z);
  }

  void place_at(const h6Vec3& shift) {
    loaded_.bodies.back().pose.p = loaded_.scene.bodies.back().pose.p = shift;
  }

  // The engine's answer, with the part at `shift`.
  Result<Overlap> overlap(const h6Vec3& shift) {
    place_at(shift);
    h6SessionDef def = loaded_.session_def();
    h6Error error{};
    const std::unique_ptr<h6Session, FreeSession> session(
        h6CreateSession(loaded_.model.get(), &def, &error));
    if (!session) return Failure{error.message};
    std::vector<h6OverlapPoint> points(h6GetOverlapPoints(session.get(), nullptr, 0));
    h6GetOverlapPoints(session.get(), points.data(), points.size());
    Overlap out;
    out.points = points.size();
    for (const h6OverlapPoint& p : points) {
      out.depth_voxels = std::max(out.depth_voxels, p.depth_voxels);
      out.unknown |= std::isinf(p.relief);
    }
    return out;
  }

  bool is_free(const h6Vec3& shift) {
    const Result<Overlap> there = overlap(shift);
    return there && there->points == 0 && plan_.way->inside(shift) == 0 &&
           plan_.way->nearest(shift).distance > 0;
  }

  // Of six directions the one in which the part is free soonest; up goes before shorter ways.
  void choose_way_out() {
    const int up = static_cast<int>(loaded_.scene.up);
    way_ = plan_.way->way_out(axis_vector(up, 1));
    out_ = axis_vector(up, 1);
    double least = way_ / kUpFirst;
    for (int axis = 0; axis < 3; ++axis)
      for (const double sign : {1.0, -1.0}) {
        const h6Vec3 d = axis_vector(axis, sign);
        const double way = plan_.way->way_out(d);
        if (way < least) least = way_ = way, out_ = d;
      }
  }

  // The given place is free.
  Result<StartPlace> near(const FreeWay::Nearest& nearest) {
    StartPlace start;
    h6Vec3 towards{};
    if (nearest.distance > 1e-6 * plan_.size) {
      towards = unit(nearest.to - nearest.from);
    } else {
      choose_way_out();
      towards = -out_;
    }
    start.kept = nearest.distance <= kNear * plan_.size + 4 * plan_.voxel;
    if (!start.kept) start.shift = on_grid((nearest.distance - gap_) * towards);
    if (!start.kept && !is_free(start.shift)) return Failure{no_start()};
    place_at(start.shift);
    start.gap = plan_.way->nearest(start.shift).distance;
    const std::string how = start.gap > 1e-6 * plan_.size
                                ? "free: " + length(start.gap) + " from the nearest obstacle"
                                : "free: the parts rest on one another";
    say(start, "start",
        start.kept ? "the given place, " + how
                   : "moved by " + length(norm(start.shift)) + " towards the environment; " + how);
    press_along(start, towards, start.gap);
    return start;
  }

  // The parts overlap a little in their given place, as press fits do.
  Result<StartPlace> fit(const Overlap& given) {
    StartPlace start;
    start.kept = start.overlaps = true;
    place_at({});
    say(start, "start",
        given.depth_voxels < kResting
            ? phrase("the given place, where the parts rest on one another at %zu points",
                     given.points)
            : phrase("the given place, where the parts overlap at %zu points, %.2g voxel deep at "
                     "most: these depths count as nothing until the part has been free",
                     given.points, given.depth_voxels));
    const double away = way_ + gap_ + (way_ > 0 ? 0 : 0.3 * plan_.size);
    const double back = way_ > 0 ? way_ - press_ : -press_;
    rows(start, {{0, 0}, {0.4, 0}, {2, away}, {2.4, away}, {4, back}, {5, back}}, out_);
    say(start, "hand",
        "goes out along " + direction(out_) + " by " + length(away) + ", returns and presses");
    return start;
  }

  // The parts overlap too much to start there.
  Result<StartPlace> outside(const Overlap& given) {
    StartPlace start;
    double along = way_ + gap_;
    int tries = 0;
    while (!is_free(start.shift = on_grid(along * out_))) {
      if (++tries > kTries) return Failure{no_start()};
      along += 2 * gap_;
    }
    place_at(start.shift);
    start.gap = plan_.way->nearest(start.shift).distance;
    say(start, "start",
        "outside along " + direction(out_) + ", " + length(along) +
            " from the given place, where the parts overlap" +
            (given.points > 0 ? phrase(" (%s%.2g voxels deep)", given.unknown ? "at least " : "",
                                       given.depth_voxels)
                              : " (one lies inside the other)") +
            "; free: " + length(start.gap) + " from the nearest obstacle");
    press_along(start, -out_, along - way_);
    return start;
  }

  // The hand rests, goes on until contact is `gap` behind it, and stays pressed.
  void press_along(StartPlace& start, const h6Vec3& d, double gap) {
    rows(start, {{0, 0}, {0.4, 0}, {1.8, gap + press_}, {3, gap + press_}}, d);
    say(start, "hand",
        "approaches along " + direction(d) + " and presses " + length(press_) + " beyond contact");
  }

  struct Row {
    double t, along;
  };
  void rows(StartPlace& start, const std::vector<Row>& rows, const h6Vec3& d) const {
    for (const Row& row : rows)
      start.path.push_back({row.t, {on_grid(start.shift + row.along * d), {1, 0, 0, 0}}});
  }

  static void say(StartPlace& start, const char* about, const std::string& text) {
    start.choices.push_back({about, text});
  }

  std::string no_start() const {
    return "no free start was found within " + length(2 * kTries * gap_) +
           " beyond the shortest way out: give the part a free \"pose\" in a scene file of your "
           "own";
  }

  const ScenePlan& plan_;
  LoadedScene& loaded_;
  Unit unit_;
  double grid_ = 0, press_ = 0, gap_ = 0;  // [m]
  h6Vec3 out_{0, 0, 1};                    // the way out, and how long it is [m]
  double way_ = 0;
};

}  // namespace

Result<StartPlace> find_start(const ScenePlan& plan, LoadedScene& loaded, bool outside) {
  const h6Vec3 given = loaded.bodies.back().pose.p;
  Result<StartPlace> start = StartFinder(plan, loaded).find(outside);
  if (!start) loaded.bodies.back().pose.p = loaded.scene.bodies.back().pose.p = given;
  if (start) loaded.scene.hands[0].path = start->path;
  return start;
}

}  // namespace h6::io
