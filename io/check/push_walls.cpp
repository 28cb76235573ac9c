// SPDX-License-Identifier: Apache-2.0
// push_walls.cpp - see push_walls.h.
#include "io/check/push_walls.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "hapsix/vector.h"
#include "io/check/inner_faces.h"
#include "sched/parallel_for.h"

namespace h6::io {
namespace {

constexpr double kOpposite = -0.70710678;  // cosine between the faces of a wall
constexpr double kStartVoxels = 1;         // from the surface to the start
constexpr double kBeyondVoxels = 3;        // from the far face to the hand's end, plus stretches
constexpr double kLongVoxels = 16;         // the hand enters no farther than this, plus stretches
constexpr double kSunkVoxels = 5;          // below the band: a point there is held by no wall
constexpr double kCornerVoxels = 1;    // the nearest point of the mesh moves less round a corner
constexpr double kStepVoxels = 0.05;   // of the hand, a frame
constexpr int kRest = 2000;            // most frames after the hand has stopped
constexpr double kLookVoxels = 0.1;    // that the point moves between searches for its nearest face
constexpr int kStill = 60;             // frames
constexpr double kStillVoxels = 1e-4;  // a frame
constexpr int kWindow = 128;           // frames: a mean over so many tells whether it drifts
constexpr double kGuide = 20;          // stiffness of the guide over that of the contact
constexpr double kMass = 0.02;         // [kg]

// The search, in forces of a voxel of depth.
constexpr double kLeast = 1.0 / 64, kMost = 64;
constexpr double kFine = 1.1;  // the bracket's ratio at the end
constexpr double kSpare = 0.7;

// A part of one point at its origin, whose outward normal is z.
h6Model* point_and_field(const FieldData& field, h6Error* error) {
  static const float zero[1] = {0}, minus[1] = {-1};
  static const std::uint32_t first[2] = {0, 1}, none[1] = {0};
  h6ShellDef shell{};
  shell.point_count = 1;
  shell.x = shell.y = shell.z = shell.nx = shell.ny = zero;
  shell.nz = minus;
  shell.level_count = 1;
  shell.level_first = first;
  shell.node_point = shell.node_first_child = shell.node_child_count = none;
  shell.node_radius = zero;
  const h6FieldDef def = field.def();
  h6ModelDef model{};
  model.fields = &def, model.field_count = 1;
  model.shells = &shell, model.shell_count = 1;
  return h6CreateModel(&model, error);
}

// The shortest turn that takes z to this unit vector.
h6Quat turn_of_z(const Vec3& to) {
  if (to.z < -0.999999) return {0, 1, 0, 0};
  return unit(h6Quat{1 + to.z, -to.y, to.x, 0});
}

// Follows the point's way through the mesh. It knows the face behind the point: the one where the
// point came in, or one round a corner or a curve that it slid to.
class Trail {
 public:
  Trail(const RayScene& rays, const FaceTable& faces, const Vec3& from, double voxel)
      : rays_(rays), faces_(faces), voxel_(voxel), at_(from) {}

  bool due() const { return solids_ > 0 && norm(at_ - looked_) > kLookVoxels * voxel_; }
  // Whether the point has come through a wall when it moves on to `next`.
  bool comes_through(const Vec3& next) {
    const Vec3 way = next - at_;
    const double length = norm(way);
    if (!(length > 0)) return false;
    rays_.crossings(at_, (1 / length) * way, crossings_);
    at_ = next;
    bool left = false;
    for (const Crossing& c : crossings_) {
      if (c.t > length) break;
      const Vec3& in = faces_.inward[c.triangle];
      if (faces_.sheet[c.triangle] && !faces_.bowl[c.triangle]) return true;
      if (dot(in, way) > 0) {
        if (solids_++ == 0 && !left) entered_ = in, shadow_ = at_;
        continue;
      }
      solids_ = std::max(solids_ - 1, 0);
      left |= solids_ == 0 && dot(in, entered_) < kOpposite;
    }
    return left && solids_ == 0;  // it may have gone on into a solid that abuts
  }
  // Looks for the nearest face when it is due. Returns how deep the point is [m].
  double look() {
    looked_ = at_;
    const RayScene::Near near = rays_.nearest(at_);
    if (near.triangle == RayScene::kNoTriangle) return 0;
    const Vec3& in = faces_.inward[near.triangle];
    if (norm(near.point - shadow_) < kCornerVoxels * voxel_ && dot(in, entered_) > kOpposite)
      entered_ = in, shadow_ = near.point;
    return near.distance;
  }
  // Whether the face behind the point no longer lies across its way: the wall turned it aside.
  bool slid_round(const Vec3& along) const { return dot(entered_, along) < -kOpposite; }

 private:
  const RayScene& rays_;
  const FaceTable& faces_;
  double voxel_;
  Vec3 at_, looked_{}, entered_{}, shadow_{};
  int solids_ = 0;  // that the point is in
  std::vector<Crossing> crossings_;
};

// Tells when the point has come to rest under the coupling's whole force: it moves no more, or it
// trembles about a place. Beyond the band a point trembles by tenths of a voxel for ever, and most
// frames of a search were spent on that.
class Rest {
 public:
  explicit Rest(double voxel) : step_(kStillVoxels * voxel) {}

  // `full`: the coupling pulls with all of its force. Call it once a frame.
  bool reached(const Vec3& now, bool full) {
    const bool moved = norm(now - last_) >= step_;
    last_ = now;
    if (!full) {
      still_ = frames_ = 0, sum_ = {};
      return false;
    }
    still_ = moved ? 0 : still_ + 1;
    sum_ = sum_ + now;
    if (++frames_ % kWindow != 0) return still_ >= kStill;
    const Vec3 mean = (1.0 / kWindow) * sum_;
    const bool stays = frames_ > kWindow && norm(mean - mean_) < kWindow * step_;
    mean_ = mean, sum_ = {};
    return stays || still_ >= kStill;
  }

 private:
  double step_;
  Vec3 last_{}, sum_{}, mean_{};
  int still_ = 0, frames_ = 0;
};

}  // namespace

struct WallPusher::Push {
  Vec3 face, along;  // on the surface, and the way in
  double thickness, force;
  bool guided = false;  // by a second hand that holds the point on its line
};

WallPusher::WallPusher(const Mesh& mesh, const FieldData& field, double stiffness)
    : mesh_(without_inner_faces(mesh)),
      faces_(face_table(mesh_)),
      field_(field),
      stiffness_(stiffness) {}

Result<std::unique_ptr<WallPusher>> WallPusher::make(const Mesh& mesh, const FieldData& field,
                                                     double stiffness) {
  std::unique_ptr<WallPusher> out(new WallPusher(mesh, field, stiffness));
  Result<std::unique_ptr<RayScene>> rays = RayScene::make(out->mesh_);
  if (!rays) return rays.failure();
  out->rays_ = std::move(*rays);
  h6Error error{};
  out->model_.reset(point_and_field(field, &error));
  if (!out->model_) return Failure{error.message};
  return out;
}

WallPusher::Session WallPusher::session_of(const Push& push, const h6Pose& start) const {
  h6BodyDef bodies[2] = {h6DefaultBodyDef(), h6DefaultBodyDef()};
  bodies[0].fixed = true, bodies[0].field = 0;
  bodies[1].shell = 0, bodies[1].mass = kMass, bodies[1].translation_only = true;
  bodies[1].pose = start;
  h6HandDef hands[2] = {h6DefaultHandDef(), h6DefaultHandDef()};
  hands[0].body = hands[1].body = 1;
  hands[0].coupling.stiffness = stiffness_;
  hands[0].coupling.max_force = push.force;
  hands[1].coupling.stiffness = kGuide * stiffness_;
  hands[1].coupling.max_force = 100 * push.force;
  h6SessionDef def = h6DefaultSessionDef();
  def.bodies = bodies, def.body_count = 2;
  def.hands = hands, def.hand_count = push.guided ? 2 : 1;
  def.contact.fit = H6_FIT_TIGHT;
  def.contact.stiffness = stiffness_;
  def.max_contacts = 16;
  return Session(h6CreateSession(model_.get(), &def, nullptr));
}

WallPusher::Ended WallPusher::end_of(const Push& push) const {
  const double voxel = field_.finest(),
               before = kStartVoxels * voxel + field_.offset + field_.grown;
  const Vec3 from = push.face - before * push.along;
  const double start[3] = {from.x, from.y, from.z};
  double distance = 0;
  h6SampleField(model_.get(), 0, start, 1, &distance, nullptr, nullptr);
  if (distance <= 0) return Ended::left_out;

  const h6Pose pose{from, turn_of_z(push.along)};
  const Session session = session_of(push, pose);
  if (!session) return Ended::left_out;

  const double stretch = push.force / stiffness_;
  const double deep = std::min(push.thickness, kLongVoxels * voxel + 2 * stretch);
  const double way = before + deep + kBeyondVoxels * voxel + 2 * stretch;
  const double rate = h6DefaultSessionDef().rate, speed = kStepVoxels * voxel * rate;
  const int moving = int(std::ceil(way / (kStepVoxels * voxel)));
  Trail trail(*rays_, faces_, from, voxel);
  h6DeviceSample samples[2] = {};
  h6DeviceSample &sample = samples[0], &guide = samples[1];
  sample.pose = guide.pose = pose;
  Vec3 last = from;
  Rest rest(voxel);
  for (int i = 1; i <= moving + kRest; ++i) {
    sample.pose.p = from + std::min(1.0, double(i) / moving) * way * push.along;
    sample.velocity.linear = (i < moving ? speed : 0) * push.along;
    h6Step(session.get(), samples, nullptr);
    const Vec3 now = h6GetBody(session.get(), 1).pose.p;
    if (trail.comes_through(now)) return Ended::through;
    if (trail.due()) {
      const double depth = trail.look();
      if (!push.guided && trail.slid_round(push.along)) return Ended::slid;
      if (depth > field_.band + kSunkVoxels * voxel) return Ended::through;
      // A cavity that the field fills is solid behind the wall, too, and may hold the point there.
      if (depth > 2 * stretch + voxel && dot(now - push.face, push.along) > push.thickness)
        return Ended::through;
    }
    if (rest.reached(now, norm(sample.pose.p - now) > 1.5 * stretch)) break;
    guide.pose.p = from + dot(now - from, push.along) * push.along;
    guide.velocity.linear = rate * dot(now - last, push.along) * push.along;
    last = now;
  }
  return Ended::held;
}

WallPushes WallPusher::push(std::span<const WallPlace> places, double force,
                            unsigned threads) const {
  std::vector<Ended> ends(2 * places.size());
  sched::parallel_for(ends.size(), threads, [&](std::size_t i) {
    const WallPlace& place = places[i / 2];
    Push push{place.p, place.in, place.thickness, force};
    if (i % 2 == 1) push.face = place.p + place.thickness * place.in, push.along = -place.in;
    ends[i] = end_of(push);
    if (ends[i] != Ended::slid) return;
    push.guided = true;
    ends[i] = end_of(push);
  });
  WallPushes out;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Ended a = ends[2 * i], b = ends[2 * i + 1];
    out.places += a != Ended::left_out || b != Ended::left_out;
    if (a == Ended::through || b == Ended::through) out.through.push_back(places[i]);
  }
  return out;
}

namespace {

// Of so many places: the thinnest ones, and as many from everywhere.
constexpr std::size_t kThinnest = 16, kSpread = 16;

std::vector<WallPlace> sample_of(std::span<const WallPlace> places) {
  if (places.size() <= kThinnest + kSpread) return {places.begin(), places.end()};
  std::vector<WallPlace> sorted(places.begin(), places.end());
  std::stable_sort(sorted.begin(), sorted.end(), [](const WallPlace& l, const WallPlace& r) {
    return l.thickness < r.thickness;
  });
  std::vector<WallPlace> out(sorted.begin(), sorted.begin() + kThinnest);
  const std::size_t rest = sorted.size() - kThinnest;
  for (std::size_t i = 0; i < kSpread; ++i)
    out.push_back(sorted[kThinnest + i * (rest - 1) / (kSpread - 1)]);
  return out;
}

// Narrows a bracket of forces at a sample of the places, and then pushes at all with what is found.
// Places that let this through are the next sample. In the end all are pushed at with a spare less.
// A place that holds a force holds less too, so while a bracket closes only places are pushed at
// that let its upper end through. On a cube, pushing at all places in every step took twice as
// long.
class Search {
 public:
  Search(const WallPusher& pusher, std::span<const WallPlace> places, unsigned threads,
         const Progress& progress)
      : pusher_(pusher),
        all_(places),
        weak_(sample_of(places)),
        threads_(threads),
        progress_(progress) {}

  bool cancelled() const { return cancelled_; }
  // unit: the force of a voxel of depth [N].
  HeldForce run(double unit) {
    const double least = kLeast * unit;
    double low = largest_of_sample(unit, kMost * unit, least);
    while (low > 0 && !holds(low, all_)) low = largest_of_sample(low, low, least);
    // Where more force slides off, less of it may go through: so all are pushed at again.
    double force = kSpare * low;
    while (force >= kSpare * least && !holds(force, all_)) force *= kSpare;
    out_.force = force >= kSpare * least ? force : 0;
    if (out_.force == 0) (void)holds(least, all_);  // counts them
    return out_;
  }

 private:
  // The largest force that the sample holds, to a tenth; 0: it does not hold `least`. The search
  // begins at `high` and goes on to `most`, which is not tried; if `high` is `most`, it is known to
  // come through.
  double largest_of_sample(double high, double most, double least) {
    double low = 0;
    bool fails = high == most;
    while (!fails && high < most) {
      fails = !holds(high, weak_);
      if (!fails) low = high, high *= 2;
    }
    while (low == 0 && high > least)
      if (holds(high / 2, weak_))
        low = high / 2;
      else
        high /= 2;
    while (fails && low > 0 && high > kFine * low) {
      const double middle = std::sqrt(low * high);
      (holds(middle, weak_) ? low : high) = middle;
    }
    return low;
  }
  bool holds(double force, std::span<const WallPlace> places) {
    cancelled_ |= progress_ && !progress_("pushing at walls", std::min(0.95, 0.07 * runs_++));
    if (cancelled_) return true;
    WallPushes pushes = pusher_.push(places, force, threads_);
    out_.places = std::max(out_.places, pushes.places);
    out_.through = pushes.through.size();
    if (pushes.through.empty()) return true;
    out_.weakest = pushes.through.front();
    weak_ = std::move(pushes.through);
    return false;
  }

  const WallPusher& pusher_;
  std::span<const WallPlace> all_;
  std::vector<WallPlace> weak_;  // the sample: those that let the bracket's upper end through
  unsigned threads_;
  const Progress& progress_;
  HeldForce out_;
  bool cancelled_ = false;
  int runs_ = 0;
};

}  // namespace

Result<HeldForce> find_held_force(const Mesh& mesh, const FieldData& field,
                                  std::span<const WallPlace> places, double stiffness,
                                  unsigned threads, const Progress& progress) {
  if (places.empty()) return HeldForce{};
  const Result<std::unique_ptr<WallPusher>> pusher = WallPusher::make(mesh, field, stiffness);
  if (!pusher) return pusher.failure();
  Search search(**pusher, places, threads, progress);
  HeldForce held = search.run(stiffness * field.finest());
  if (search.cancelled()) return Failure{"cancelled"};
  return held;
}

}  // namespace h6::io
