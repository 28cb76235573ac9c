// SPDX-License-Identifier: Apache-2.0
// Pairs that are far or quiet are left out, and every bit stays as if they were not.
#include "runtime/frame/near_pairs.h"

#include <doctest/doctest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "runtime/frame/session.h"
#include "tests/support/analytic.h"

using namespace h6;
using namespace h6::test;

namespace {

constexpr double mm = 1e-3;

struct Uniform {
  std::mt19937_64 random;
  double operator()(double low, double high) {
    return low + (high - low) * std::ldexp(static_cast<double>(random() >> 11), -53);
  }
};

struct Destroy {
  void operator()(h6Session* s) const { h6DestroySession(s); }
};
using Session = std::unique_ptr<h6Session, Destroy>;

// Balls that are shell and field, and two rooms that hold them.
struct Balls {
  FieldArrays ball = sample_analytic(
      [](double x, double y, double z) { return std::sqrt(x * x + y * y + z * z) - 8 * mm; },
      {-16 * mm, -16 * mm, -16 * mm}, mm, 4, 4, 4);
  FieldArrays room = sample_analytic(
      [](double x, double y, double z) { return 40 * mm - std::sqrt(x * x + y * y + z * z); },
      {-48 * mm, -48 * mm, -48 * mm}, mm, 12, 12, 12);
  FieldArrays hall = sample_analytic(
      [](double x, double y, double z) { return 56 * mm - std::sqrt(x * x + y * y + z * z); },
      {-64 * mm, -64 * mm, -64 * mm}, mm, 16, 16, 16);
  ShellArrays shell = sphere_points(8 * mm, 400);
  Model model{{def_of(ball), def_of(room), def_of(hall)}, {shell.def()}};
  std::vector<h6BodyDef> bodies;
  h6SessionDef def = h6DefaultSessionDef();

  void add(bool fixed, int shell_index, int field, const h6Pose& at, h6Velocity u = {}) {
    h6BodyDef body = h6DefaultBodyDef();
    body.fixed = fixed, body.shell = shell_index, body.field = field;
    body.pose = at, body.velocity = u, body.mass = 0.01;
    for (int k = 0; k < 3; ++k) body.inertia[k] = 4e-7;
    bodies.push_back(body);
  }
  Session open(h6Error* error = nullptr) {
    def.bodies = bodies.data(), def.body_count = bodies.size();
    return Session(h6CreateSession(model.handle, &def, error));
  }
};

// `count` balls fly about in the room, hit its wall, each other and two obstacles.
void fill_room(Balls& world, int count, double speed) {
  Uniform uniform{std::mt19937_64(5)};
  world.add(true, -1, 1, pose(0, 0, 0));
  for (const double x : {-1.0, 1.0}) world.add(true, -1, 0, pose(12 * x * mm, 0, -30 * mm));
  for (int i = 0; i < count; ++i) {
    const double angle = 2.4 * i, r = 6 * mm * std::sqrt(i + 0.5);
    const h6Velocity u{{uniform(-speed, speed), uniform(-speed, speed), uniform(-speed, speed)},
                       {uniform(-20, 20), uniform(-20, 20), uniform(-20, 20)}};
    world.add(false, 0, i % 5 == 4 ? -1 : 0,
              pose(r * std::cos(angle), r * std::sin(angle), (i % 3 - 1) * 17 * mm), u);
  }
  world.def.gravity = {0, 0, -9.81};
  world.def.max_contacts = 4096;
}

// Both step with the same calls between two frames. Returns how many pairs were awake on average.
double compare(Balls& world, int frames, const std::function<void(h6Session*, int)>& between) {
  const Session some = world.open();
  world.def.threads = 1;
  const Session all = world.open();
  REQUIRE(some);
  REQUIRE(all);
  keep_all_awake(*all);
  double awake = 0;
  std::uint32_t most = 0;
  for (int i = 0; i < frames; ++i) {
    for (h6Session* s : {some.get(), all.get()}) {
      if (between) between(s, i);
      h6Step(s, nullptr, nullptr);
    }
    const h6FrameReport a = h6GetFrame(some.get()), b = h6GetFrame(all.get());
    CAPTURE(i);
    REQUIRE(a.state_hash == b.state_hash);
    REQUIRE(a.contacts == b.contacts);
    REQUIRE(a.max_depth == b.max_depth);
    REQUIRE(a.substeps == b.substeps);
    REQUIRE(a.status == b.status);
    most = std::max(most, a.contacts);
    awake += static_cast<double>(some->near.awake_count) / frames;
    REQUIRE(all->near.awake_count == all->near.near_count);
  }
  CHECK(most > 10);
  const double possible = static_cast<double>(all->near.near_count);
  MESSAGE(awake << " of " << possible << " pairs awake");
  CHECK(awake < 0.5 * possible);
  return awake;
}

}  // namespace

TEST_CASE("bodies that fly and collide have the same bits as if no pair ever slept") {
  for (const h6Method method : {H6_METHOD_FIRM, H6_METHOD_GAUSS6, H6_METHOD_SERIES})
    for (const bool rubs : {false, true}) {
      CAPTURE(std::string(h6MethodName(method)));
      CAPTURE(rubs);
      Balls world;
      fill_room(world, 14, 0.3);
      world.def.contact.method = method;
      if (rubs) world.def.contact.friction = 0.3;
      compare(world, 250, {});
    }
}

TEST_CASE("the same on several threads that weigh bodies side by side") {
  for (const unsigned threads : {2u, 3u, 8u}) {
    Balls world;
    fill_room(world, 14, 0.3);
    world.def.threads = threads;
    compare(world, 250, {});
  }
}

TEST_CASE("the same for bodies so fast that frames take several steps") {
  Balls world;
  fill_room(world, 10, 6);
  world.def.contact.passivity = true;
  world.def.net_stiffness = true;
  compare(world, 150, {});
}

TEST_CASE("the same where a program moves obstacles and puts bodies elsewhere") {
  Balls world;
  fill_room(world, 12, 0.2);
  world.def.contact.friction = 0.2;
  Uniform uniform{std::mt19937_64(11)};
  std::vector<h6BodyState> put;
  for (int i = 0; i < 300; ++i)
    put.push_back({pose(uniform(-20, 20) * mm, uniform(-20, 20) * mm, uniform(-20, 20) * mm), {}});
  compare(world, 300, [&](h6Session* s, int i) {
    const h6BodyState obstacle{pose(20 * mm * std::sin(0.02 * i), 0, -24 * mm), {}};
    h6SetBody(s, 1, &obstacle);
    if (i % 40 == 39) h6SetBody(s, 3 + i / 40, &put[static_cast<std::size_t>(i)]);
  });
}

TEST_CASE("the same for listed pairs, whose order is that of the list") {
  Balls world;
  fill_room(world, 12, 0.3);
  std::vector<h6PairDef> pairs;
  for (std::int32_t a = 14; a >= 3; --a)
    for (std::int32_t b = 14; b >= 0; --b)
      if (a != b && world.bodies[static_cast<std::size_t>(b)].field >= 0 && (a + b) % 4 != 0)
        pairs.push_back({a, b, {}});
  world.def.pairs = pairs.data(), world.def.pair_count = pairs.size();
  compare(world, 250, {});
}

TEST_CASE("fifty balls that fall on one another in a hall make no energy and stay apart") {
  Balls world;
  world.add(true, -1, 2, pose(0, 0, 0));
  int balls = 0;
  for (int i = 0; balls < 50 && i < 125; ++i) {
    const Vec3 p((i % 5 - 2) * 16.4 + 0.1 * (i % 7), (i / 5 % 5 - 2) * 16.4, (i / 25 - 2) * 16.4);
    if (p.norm() > 47) continue;  // not inside
    world.add(false, 0, 0, pose(p.x() * mm, p.y() * mm, p.z() * mm));
    ++balls;
  }
  REQUIRE(balls == 50);
  world.def.gravity = {0, 0, -9.81};
  world.def.max_contacts = 4096;
  world.def.contact.friction = 0.3;
  const Session s = world.open();
  REQUIRE(s);
  const auto energy = [&] {
    double sum = 0;
    for (int i = 1; i <= balls; ++i) {
      const h6BodyState b = h6GetBody(s.get(), i);
      const auto square = [](const h6Vec3& v) { return v.x * v.x + v.y * v.y + v.z * v.z; };
      sum += 0.5 * 0.01 * square(b.velocity.linear) + 0.5 * 4e-7 * square(b.velocity.angular) +
             0.01 * 9.81 * b.pose.p.z;
    }
    return sum;
  };
  const double start = energy();
  double deepest = 0;
  std::uint32_t touching = 0;
  for (int i = 0; i < 600; ++i) {
    h6Step(s.get(), nullptr, nullptr);
    deepest = std::max(deepest, h6GetFrame(s.get()).max_depth_voxels);
    touching = std::max(touching, h6GetFrame(s.get()).contacts);
    REQUIRE(energy() < start + 1e-4);
  }
  CHECK(deepest < 0.5);
  CHECK(touching > 100);
  CHECK(energy() < start - 1e-3);
  for (int i = 1; i <= balls; ++i) {
    const h6Vec3 p = h6GetBody(s.get(), i).pose.p;
    CHECK(std::hypot(p.x, p.y, p.z) < 48.6 * mm);
    for (int k = 1; k < i; ++k) {
      const h6Vec3 q = h6GetBody(s.get(), k).pose.p;
      CHECK(std::hypot(p.x - q.x, p.y - q.y, p.z - q.z) > 15.4 * mm);
    }
  }
  MESSAGE(balls << " balls, deepest " << deepest << " voxel, contacts " << touching);
}

TEST_CASE("boxes: a search finds what a comparison with all of them finds, wherever they go") {
  constexpr std::size_t kBodies = 700;
  Uniform uniform{std::mt19937_64(3)};
  const auto random_box = [&] {
    const Vec3 at(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
    return grown({at, at}, uniform(0, 0.2));
  };
  std::vector<Box> boxes(kBodies);
  const auto moves = std::make_unique<bool[]>(kBodies);
  for (std::size_t i = 0; i < kBodies; ++i) {
    if (i % 50 != 7) boxes[i] = random_box();
    moves[i] = i % 3 == 0;
  }
  BodyBoxes tiers;
  Arena count;
  tiers.lay_out(count, kBodies);
  std::vector<char> memory(count.used() + 64);
  char* const base = memory.data() + (64 - reinterpret_cast<std::uintptr_t>(memory.data()) % 64);
  Arena arena(base, count.used());
  tiers.lay_out(arena, kBodies);
  tiers.fill(boxes, {moves.get(), kBodies});
  for (int round = 0; round < 2000; ++round) {
    const std::size_t moved = static_cast<std::size_t>(uniform(0, kBodies));
    boxes[moved] = round % 97 == 0 ? Box() : random_box();
    tiers.set(moved, boxes[moved]);
    const Box look = random_box();
    std::vector<bool> found(kBodies);
    tiers.each_overlap(look, [&](std::uint32_t body) {
      CHECK(!found[body]);
      found[body] = true;
    });
    for (std::size_t i = 0; i < kBodies; ++i) REQUIRE(found[i] == overlap(boxes[i], look));
  }
}

TEST_CASE("a part among ten thousand placed ones touches the one that it meets") {
  Balls world;
  for (int i = 0; i < 10000; ++i)
    world.add(true, -1, 0, pose((i % 100) * 30 * mm, (i / 100 % 100) * 30 * mm, -15.5 * mm));
  world.add(false, 0, -1, pose(30 * 42 * mm, 30 * 17 * mm, 0));
  h6HandDef hand = h6DefaultHandDef();
  hand.body = 10000;
  hand.coupling.mode = H6_COUPLING_DIRECT;
  world.def.hands = &hand, world.def.hand_count = 1;
  world.def.contact.fit = H6_FIT_TIGHT;
  world.def.max_substeps = 1;  // else a jump near a field is shortened
  h6Error error{};
  const Session s = world.open(&error);
  REQUIRE_MESSAGE(s, error.message);
  h6DeviceSample in = hand_at(pose(30 * 42 * mm, 30 * 17 * mm, 0));
  h6Step(s.get(), &in, nullptr);
  CHECK(h6GetFrame(s.get()).contacts > 0);
  const h6Contacts c = h6GetContacts(s.get(), 10000);
  for (std::size_t i = 0; i < c.count; ++i)
    if (c.depth[i] > 0) CHECK(c.field_body[i] == 17 * 100 + 42);
  CHECK(s->near.near_count < 10);
  CHECK(s->memory_bytes < 60'000'000);
  // It goes to another one, in one frame.
  in = hand_at(pose(30 * 3 * mm, 30 * 90 * mm, 0));
  h6Step(s.get(), &in, nullptr);
  h6Step(s.get(), &in, nullptr);
  const h6Contacts there = h6GetContacts(s.get(), 10000);
  CHECK(there.count > 0);
  for (std::size_t i = 0; i < there.count; ++i)
    if (there.depth[i] > 0) CHECK(there.field_body[i] == 90 * 100 + 3);
}

TEST_CASE("without room for all near pairs the last ones take no part, and the frame says so") {
  Balls world;
  for (int i = 0; i < 3; ++i) world.add(true, -1, 0, pose(60 * i * mm, 0, 0));
  for (int i = 0; i < 3; ++i) world.add(false, 0, -1, pose(60 * i * mm, 0, 15.5 * mm));
  world.def.contact.fit = H6_FIT_TIGHT;
  world.def.max_substeps = 1;  // the balls are thrown out: no motion is shortened
  world.def.max_pairs = 2;
  const Session s = world.open();
  REQUIRE(s);
  h6Step(s.get(), nullptr, nullptr);
  CHECK(h6GetFrame(s.get()).status == H6_PAIRS_LEFT_OUT);
  CHECK(s->near.near_count == 2);
  // One pair parts, and there is room.
  h6BodyState away{pose(1, 0, 0), {}};
  h6SetBody(s.get(), 3, &away);
  for (int i = 4; i < 6; ++i) {
    const h6BodyState back{pose(60 * (i - 3) * mm, 0, 15.5 * mm), {}};
    h6SetBody(s.get(), i, &back);
  }
  h6Step(s.get(), nullptr, nullptr);
  for (int i = 4; i < 6; ++i) CHECK(h6GetContacts(s.get(), i).count > 0);
  world.def.max_pairs = 0;
  const Session roomy = world.open();
  h6Step(roomy.get(), nullptr, nullptr);
  CHECK(h6GetFrame(roomy.get()).status == H6_OK);
}

TEST_CASE("more pairs than remember their searches find the same contacts") {
  // A large ball among 150 obstacles, all of them touching its shell or nearly.
  Balls world;
  FieldArrays small = sample_analytic(
      [](double x, double y, double z) { return std::sqrt(x * x + y * y + z * z) - 3 * mm; },
      {-8 * mm, -8 * mm, -8 * mm}, mm, 2, 2, 2);
  ShellArrays large = sphere_points(40 * mm, 6000);
  Model model({def_of(small)}, {large.def()});
  std::vector<h6BodyDef> bodies(151, h6DefaultBodyDef());
  bodies[0].shell = 0;
  for (int i = 0; i < 150; ++i) {
    const double z = 1 - 2 * (i + 0.5) / 150, r = std::sqrt(1 - z * z), away = 42.8 * mm;
    h6BodyDef& b = bodies[static_cast<std::size_t>(i) + 1];
    b.fixed = true, b.field = 0;
    b.pose = pose(away * r * std::cos(2.4 * i), away * r * std::sin(2.4 * i), away * z);
  }
  h6HandDef hand = h6DefaultHandDef();
  hand.coupling.mode = H6_COUPLING_DIRECT;
  h6SessionDef def = h6DefaultSessionDef();
  def.bodies = bodies.data(), def.body_count = bodies.size();
  def.hands = &hand, def.hand_count = 1;
  def.contact.fit = H6_FIT_TIGHT;
  def.contact.method = H6_METHOD_ROBUST;  // contacts of `firm` depend on the last frame's spring
  const Session s(h6CreateSession(model.handle, &def, nullptr));
  REQUIRE(s);
  for (int i = 0; i < 40; ++i) {
    const h6DeviceSample in =
        hand_at(pose(0.3 * mm * std::sin(0.3 * i), 0, 0.2 * mm * std::cos(i)));
    h6Step(s.get(), &in, nullptr);
    CHECK(s->near.awake_count > 100);
    // A session that was just made remembers nothing.
    bodies[0].pose = in.pose;
    const Session fresh(h6CreateSession(model.handle, &def, nullptr));
    h6Step(fresh.get(), &in, nullptr);
    const h6Contacts a = h6GetContacts(s.get(), 0), b = h6GetContacts(fresh.get(), 0);
    REQUIRE(a.count == b.count);
    CHECK(a.count > 100);
    for (std::size_t k = 0; k < a.count; ++k) {
      REQUIRE(a.depth[k] == b.depth[k]);
      REQUIRE(a.point[k] == b.point[k]);
    }
  }
}
