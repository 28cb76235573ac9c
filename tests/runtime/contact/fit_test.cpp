// SPDX-License-Identifier: Apache-2.0
// Parts that overlap at the start come apart without being thrown, and touch again when they
// return.
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "hapsix/vector.h"
#include "tests/support/ball_in_bowl.h"
#include "tests/support/box_on_floor.h"
#include "tests/support/near.h"
#include "tests/support/peg_in_tight_hole.h"

using namespace h6::test;

namespace {

// The force on a hand and the motion of a body along a path.
struct Travel {
  double speed = 0;    // greatest of the body [m/s]
  double apart = 0;    // greatest distance between hand and body [m]
  double force = 0;    // greatest on the hand [N]
  double jump = 0;     // greatest change of that from frame to frame [N]
  double work = 0;     // of the hand on the body [J]
  double deepest = 0;  // greatest pushing depth [voxel]
  std::uint32_t contacts = 0;
};

struct Mover {
  PegInTightHole& peg;
  h6Pose at = pose(0, 0, 0);
  h6Wrench last{};

  void step(Travel& t, const h6Pose& to) {
    const h6Vec3 way = to.p - at.p;
    at = to;
    const h6Wrench w = peg.step(at).wrench;
    t.work -= 0.5 * dot(last.force + w.force, way);
    t.jump = std::max(t.jump, norm(w.force - last.force));
    t.force = std::max(t.force, norm(w.force));
    last = w;
    const h6BodyState b = peg.body();
    t.speed = std::max(t.speed, norm(b.velocity.linear));
    t.apart = std::max(t.apart, norm(b.pose.p - at.p));
    t.deepest = std::max(t.deepest, peg.report().max_depth_voxels);
    t.contacts = std::max(t.contacts, peg.report().contacts);
  }
  Travel move(const h6Vec3& to, int frames) {
    Travel t;
    const h6Vec3 from = at.p;
    for (int i = 1; i <= frames; ++i) step(t, {from + (double(i) / frames) * (to - from), at.q});
    return t;
  }
};

constexpr h6Method kMethods[] = {H6_METHOD_ROBUST, H6_METHOD_SERIES};
constexpr double kOverlaps[] = {0.2, 0.7, 1.6, 2.9};

std::vector<h6Overlap> overlaps(const h6Session* s) {
  std::vector<h6Overlap> all(h6GetOverlaps(s, nullptr, 0));
  h6GetOverlaps(s, all.data(), all.size());
  return all;
}
std::vector<h6OverlapPoint> overlap_points(const h6Session* s) {
  std::vector<h6OverlapPoint> all(h6GetOverlapPoints(s, nullptr, 0));
  h6GetOverlapPoints(s, all.data(), all.size());
  return all;
}
std::size_t relieved(const h6Session* s) {
  std::size_t n = 0;
  for (const h6Overlap& o : overlaps(s)) n += o.relieved;
  return n;
}

// The depth to which one point stands below a floor, driven by h6SetBody.
struct TipOnFloor {
  BoxOnFloor scene;
  explicit TipOnFloor(double depth, h6Method method = H6_METHOD_NONE) {
    scene.shell = {};
    scene.shell.add(0, 0, 0, 0, 0, 1);
    h6DestroyModel(scene.model.handle);
    const h6FieldDef field = def_of(scene.field);
    const h6ShellDef shell = scene.shell.def();
    h6ModelDef def = h6DefaultModelDef();
    def.fields = &field, def.field_count = 1, def.shells = &shell, def.shell_count = 1;
    scene.model.handle = h6CreateModel(&def, nullptr);
    scene.bodies[1].com = {0, 0, 0};
    scene.bodies[1].pose = pose(0, 0, -depth);
    scene.def.hand_count = 0;
    scene.def.contact.method = method;
  }
  // The pushing depth at this depth; 0 without a contact [m].
  double at(double depth) {
    const h6BodyState state{pose(0, 0, -depth), {}};
    h6SetBody(scene.session, 1, &state);
    h6Step(scene.session, nullptr, nullptr);
    const h6Contacts c = h6GetContacts(scene.session, 1);
    return c.count == 0 ? 0 : std::max(0.0f, c.depth[0]);
  }
  void start() {
    scene.open();
    h6Step(scene.session, nullptr, nullptr);
  }
};

}  // namespace

TEST_CASE("an overlap at the start gives no force in the first frame, under any rule") {
  for (int m = 0; m < H6_METHOD_COUNT; ++m)
    for (const double overlap : kOverlaps) {
      PegInTightHole peg(overlap, static_cast<h6Method>(m));
      peg.open();
      CAPTURE(m);
      const h6DeviceCommand command = peg.step(pose(0, 0, 0));
      CHECK(norm(command.wrench.force) == 0);
      CHECK(norm(command.wrench.torque) == 0);
      CHECK(norm(peg.body().velocity.linear) == 0);
      CHECK(peg.report().max_depth == 0);
      CHECK(peg.report().fit_depth_voxels == near(overlap).epsilon(0.05));
    }
}

TEST_CASE("the overlap at the start is told point by point, whatever the fit") {
  for (const h6Fit fit : {H6_FIT_RELIEVE, H6_FIT_TIGHT}) {
    PegInTightHole peg(1.6);
    peg.def.contact.fit = fit;
    peg.open();
    const std::vector<h6Overlap> pairs = overlaps(peg.session);
    REQUIRE(pairs.size() == 1);
    const std::vector<h6OverlapPoint> points = overlap_points(peg.session);
    REQUIRE(points.size() == pairs[0].points);
    CHECK(pairs[0].points > 24 * 72 - 1);  // half of the side is in the hole
    CHECK(pairs[0].relieved == (fit == H6_FIT_RELIEVE ? pairs[0].points : 0));
    CHECK((pairs[0].shell_body == 1 && pairs[0].field_body == 0));
    CHECK(pairs[0].depth_voxels == near(1.6).epsilon(0.05));
    CHECK(pairs[0].depth == near(1.6 * kFitVoxel).epsilon(0.05));
    CHECK(points[pairs[0].deepest].depth == pairs[0].depth);
    for (const h6OverlapPoint& p : points) {
      CHECK(p.position.x == near(peg.shell.x[p.point]));
      const bool side = std::hypot(p.position.x, p.position.y) > kHoleRadius + 1.59 * kFitVoxel;
      if (side && p.position.z < -2 * kFitVoxel)  // above, interpolation rounds the hole's edge off
        CHECK(p.depth == near(1.6 * kFitVoxel).epsilon(0.05));
      CHECK(p.relief == (fit == H6_FIT_RELIEVE ? near(p.depth) : near(0)));
    }
    h6OverlapPoint few[3];
    CHECK(h6GetOverlapPoints(peg.session, few, 3) == points.size());
    CHECK(std::memcmp(few, points.data(), sizeof few) == 0);
  }
  BoxOnFloor free;
  free.open();
  CHECK(h6GetOverlaps(free.session, nullptr, 0) == 0);
  CHECK(h6GetOverlapPoints(free.session, nullptr, 0) == 0);
}

TEST_CASE("a point that goes deeper than at the start pushes by the difference until it was free") {
  TipOnFloor tip(0.8 * mm);
  tip.start();
  CHECK(tip.at(0.8 * mm) == 0);
  CHECK(tip.at(1.1 * mm) == near(0.3 * mm).epsilon(1e-3));
  CHECK(tip.at(0.5 * mm) == 0);
  CHECK(tip.at(0.7 * mm) == 0);  // it came out in part: its zero stays
  CHECK(tip.at(1.1 * mm) == near(0.3 * mm).epsilon(1e-3));
  CHECK(relieved(tip.scene.session) == 1);
  CHECK(tip.at(-0.1 * mm) == 0);
  CHECK(relieved(tip.scene.session) == 0);
  CHECK(tip.at(0.5 * mm) == near(0.5 * mm).epsilon(1e-3));  // free once, so every depth counts
  CHECK(overlap_points(tip.scene.session)[0].relief == 0);
}

TEST_CASE("under series a point keeps its relief up to the margin, where losing it is no jump") {
  TipOnFloor tip(0.8 * mm, H6_METHOD_SERIES);
  tip.start();
  tip.at(-0.2 * mm);
  CHECK(relieved(tip.scene.session) == 1);
  CHECK(tip.at(0.7 * mm) == 0);
  tip.at(-0.6 * mm);
  CHECK(relieved(tip.scene.session) == 0);
  CHECK(tip.at(0.7 * mm) == near(0.7 * mm).epsilon(1e-3));
}

TEST_CASE("fit_offset is play: every depth counts less by it, also of points that start free") {
  for (const h6Method method : {H6_METHOD_NONE, H6_METHOD_SERIES}) {
    TipOnFloor tip(0.8 * mm, method);
    tip.scene.def.contact.fit_offset = 0.3 * mm;
    tip.start();
    CHECK(tip.at(0.8 * mm) == 0);
    CHECK(tip.at(1.1 * mm) == near(0.3 * mm).epsilon(1e-3));
    tip.at(-2 * mm);
    CHECK(tip.at(0.2 * mm) == 0);
    CHECK(tip.at(0.8 * mm) == near(0.5 * mm).epsilon(1e-3));
  }
  BoxOnFloor box;
  box.def.contact.fit_offset = 3.5 * mm;
  h6Error error{};
  CHECK(h6CreateSession(box.model.handle, &box.def, &error) == nullptr);
  CHECK(std::string(error.message) ==
        "contact fit_offset is 3.5 mm, which is 3.5 voxels of body 0: at most 3");
}

TEST_CASE("a peg is pulled from a hole that is too narrow, held by its walls, and never thrown") {
  for (const h6Method method : kMethods)
    for (const double overlap : kOverlaps) {
      PegInTightHole peg(overlap, method);
      peg.open();
      CAPTURE(std::string(h6MethodName(method)));
      CAPTURE(overlap);
      Mover hand{peg};
      const Travel rest = hand.move({0, 0, 0}, 50);
      CHECK((rest.speed == 0 && rest.force == 0 && rest.work == 0));

      const Travel side = hand.move({2 * mm, 0, 0}, 100);  // the wall resists
      CHECK(side.force > 1.8);
      CHECK(norm(peg.body().pose.p) < 0.2 * kFitVoxel);
      hand.move({0, 0, 0}, 100);

      const Travel out = hand.move({0, 0, 16 * mm}, 800);
      CHECK(out.speed < 1.2 * 0.02);  // the hand moves at 20 mm/s
      CHECK(out.apart < 0.45 * mm);   // its lag in free air is 0.4 mm
      CHECK(out.jump < 0.03);         // that of a hand that sets off in free air: 0.02 N
      CHECK(out.deepest < 0.01);
      CHECK(relieved(peg.session) == 0);  // every point has been free

      hand.move({0, 0, 16 * mm}, 200);
      const Travel in = hand.move({0, 0, 8 * mm}, 800);  // the rim stands on the block
      CHECK(in.force > 2.4);
      CHECK(peg.body().pose.p.z > kHoleDepth - kFitVoxel);
      CHECK(in.deepest < 0.5);
      CHECK(in.speed < 0.02);
    }
}

namespace {

// The work of a hand that presses a peg against its hole all around and comes back [J].
double work_of_wiggling(double overlap_voxels, h6Method method) {
  PegInTightHole peg(overlap_voxels, method);
  peg.open();
  Mover hand{peg};
  double work = 0;
  for (int turn = 0; turn < 8; ++turn) {
    const double a = 0.7 * turn;
    work += hand.move({2 * mm * std::cos(a), 2 * mm * std::sin(a), 0.2 * mm}, 60).work;
    work += hand.move({0, 0, 0}, 60).work;
  }
  hand.move({0, 0, 0}, 200);
  CHECK(norm(peg.body().pose.p) < 0.02 * kFitVoxel);
  CHECK(norm(hand.last.force) < 0.02);
  return work;
}

}  // namespace

TEST_CASE("wiggling a tight peg gives out no more than a loose one, and leaves its fit as it was") {
  for (const h6Method method : kMethods) {
    // A coupling that is sampled gives out a little, in proportion to the speed.
    const double loose = std::min(work_of_wiggling(-0.01, method), work_of_wiggling(-0.3, method));
    for (const double overlap : kOverlaps) CHECK(work_of_wiggling(overlap, method) > 1.2 * loose);
  }
}

TEST_CASE("a start deeper than any fit is never thrown, and its points count once they are free") {
  for (const h6Method method : kMethods) {
    BoxOnFloor box;
    box.bodies[1].pose = pose(0, 0, 0);  // its bottom is 5 mm, five voxels, inside
    box.def.contact.method = method;
    box.open();
    REQUIRE(overlaps(box.session).size() == 1);
    CHECK(overlaps(box.session)[0].depth_voxels > H6_DEEPEST_FIT);
    CHECK(std::isinf(overlap_points(box.session)[0].relief));
    double fastest = 0;
    for (int i = 0; i < 600; ++i) {
      const double z = i < 500 ? 0.02 * mm * i : 10 * mm;
      box.hold(pose(0, 0, z), 1);
      fastest = std::max(fastest, norm(box.body().velocity.linear));
    }
    CHECK(fastest < 1.2 * 0.02);
    CHECK(relieved(box.session) == 0);
    box.hold(pose(0, 0, 0), 1000);
    CHECK(box.body().pose.p.z > 4.4 * mm);
  }
}

TEST_CASE("without an overlap, and under tight, frames have the bits that they had") {
  for (const unsigned threads : {1u, 2u})
    for (const h6Method method : kMethods) {
      std::vector<std::uint64_t> hashes[2];
      for (const h6Fit fit : {H6_FIT_RELIEVE, H6_FIT_TIGHT}) {
        BallInBowl ball(threads, 6000);
        ball.def.contact.method = method;
        ball.def.contact.fit = fit;
        ball.open();
        for (int i = 0; i < 150; ++i) {
          const h6DeviceSample sample = ball.sample(i);
          h6Step(ball.session, &sample, nullptr);
          hashes[fit].push_back(h6GetFrame(ball.session).state_hash);
        }
      }
      CHECK(hashes[0] == hashes[1]);
    }
}

TEST_CASE("with relief the bits are the same for any number of threads, also in coarse frames") {
  for (const h6Method method : kMethods) {
    std::vector<std::uint64_t> hashes[2];
    for (const unsigned threads : {1u, 2u}) {
      BallInBowl ball(threads);
      ball.bodies[1].pose = pose(0.9 * kMm, 0, 0);
      ball.def.contact.method = method;
      ball.open();
      REQUIRE(relieved(ball.session) > 1000);
      for (int i = 0; i < 150; ++i) {
        const h6DeviceSample sample = ball.sample(i);
        if (i % 7 == 3) h6SetCoarse(ball.session, 1, 4);
        h6Step(ball.session, &sample, nullptr);
        hashes[threads - 1].push_back(h6GetFrame(ball.session).state_hash);
      }
    }
    CHECK(hashes[0] == hashes[1]);
  }
}

TEST_CASE("a coarse frame neither pushes with relief nor takes it away") {
  PegInTightHole peg(1.6);
  peg.open();
  const std::size_t all = relieved(peg.session);
  for (const std::uint32_t points : {8u, 4u, 2u, 1u, 0u}) {
    h6SetCoarse(peg.session, 1, points);
    CHECK(norm(peg.step(pose(0, 0, 0)).wrench.force) == 0);
    CHECK(peg.report().contacts == 0);
    CHECK(relieved(peg.session) == all);
  }
}

TEST_CASE("a session that takes over keeps the relief that is left") {
  PegInTightHole peg(1.6), other(1.6);
  peg.open();
  Mover hand{peg};
  hand.move({0, 0, 6 * mm}, 300);
  const std::size_t left = relieved(peg.session);
  REQUIRE(left > 100);
  h6SessionDef def = peg.def;
  def.contact.stiffness = 2e4;
  h6Session* next = h6CreateSession(peg.model.handle, &def, nullptr);
  REQUIRE(relieved(next) > left);
  REQUIRE(h6TakeOver(next, peg.session, nullptr));
  CHECK(relieved(next) == left);
  h6DestroySession(peg.session);
  peg.session = next;
  const Travel rest = hand.move({0, 0, 6 * mm}, 50);
  CHECK(rest.speed < 0.02);
  CHECK(rest.deepest < 0.01);
}

TEST_CASE("a body that is put somewhere pushes there in full, until its place is made a start") {
  TipOnFloor tip(0.8 * mm);
  tip.scene.open();
  CHECK(tip.at(0.5 * mm) == near(0.5 * mm).epsilon(1e-3));  // before the first step
  const h6BodyState there{pose(0, 0, -0.5 * mm), {}};
  h6SetBody(tip.scene.session, 1, &there);
  REQUIRE(h6RestartFit(tip.scene.session, nullptr));
  CHECK(overlaps(tip.scene.session)[0].depth == near(0.5 * mm).epsilon(1e-3));
  CHECK(tip.at(0.5 * mm) == 0);
  CHECK(tip.at(0.7 * mm) == near(0.2 * mm).epsilon(1e-3));
}
