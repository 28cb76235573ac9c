// SPDX-License-Identifier: Apache-2.0
// A body that bends: free vibration, rest under a pressed part with every coupling and rule, the
// same bits for any number of threads, and what is refused.
#include <doctest/doctest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/bridge.h"

using namespace h6::test;

namespace {

constexpr double mm = 1e-3;

// The force of the internal springs, from their potential.
std::vector<double> force_at(const BridgeArrays& b, const std::vector<double>& q) {
  std::vector<double> out, rest(q.size());
  for (std::size_t j = 0; j < q.size(); ++j) {
    const auto moved = [&](double by) {
      std::vector<double> x = q;
      x[j] += by;
      return b.energy(x, rest);
    };
    constexpr double h = 1e-5;
    out.push_back((8 * (moved(h) - moved(-h)) - (moved(2 * h) - moved(-2 * h))) / (12 * h));
  }
  return out;
}

// Presses the ball onto the bridge for `frames` frames. Returns the last command.
h6DeviceCommand press(BallOnBridge& scene, int frames, double depth) {
  h6DeviceCommand command{};
  for (int i = 0; i < frames; ++i) {
    const double down = std::min(1e-5 * i, depth + 1 * mm);
    const h6DeviceSample sample = hand_at(pose(0.03, 5 * mm, scene.top() + 1 * mm - down));
    h6Step(scene.session, &sample, &command);
  }
  return command;
}

std::string refusal(BallOnBridge& scene) {
  h6Error error{};
  scene.open(&error);
  CHECK((scene.session != nullptr) == (error.message[0] == 0));
  return error.message;
}
bool has(const std::string& text, const char* part) { return text.find(part) != std::string::npos; }

}  // namespace

TEST_CASE("a free vibration keeps its energy within 1 % for 10 s without damping") {
  BallOnBridge scene(600, 8);
  scene.def.hand_count = 0;
  scene.bodies[1].pose = pose(0, 0, 0.5);  // far away
  REQUIRE(scene.open());
  std::vector<double> q(8), v(8);
  for (std::size_t j = 0; j < 8; ++j)
    q[j] = 4e-3 * std::cos(3.0 * double(j)) / double(1 + j), v[j] = 0.3 * std::sin(2.0 * double(j));
  REQUIRE(h6SetDeformation(scene.session, 0, q.data(), v.data(), 8));
  const double start = scene.bridge.energy(q, v);
  double least = start, most = start, far = 0;
  for (int i = 0; i < 10000; ++i) {
    h6Step(scene.session, nullptr, nullptr);
    const double now = scene.bridge.energy(scene.q(), scene.v());
    least = std::min(least, now), most = std::max(most, now);
    for (const double x : scene.q()) far = std::max(far, std::fabs(x));
  }
  MESSAGE("energy " << start << " J, least " << least / start << ", most " << most / start);
  CHECK(far > 1e-3);
  CHECK(std::fabs(least / start - 1) < 0.01);
  CHECK(std::fabs(most / start - 1) < 0.01);
}

TEST_CASE("a pressed ball comes to rest on the bridge, which bends as far as its force allows") {
  struct Case {
    h6Method method;
    h6CouplingMode coupling;
    h6Gradient gradient;
  };
  for (const Case& at : {Case{H6_METHOD_FIRM, H6_COUPLING_DYNAMIC, H6_SYMMETRIC},
                         Case{H6_METHOD_FIRM, H6_COUPLING_DYNAMIC, H6_EXACT},
                         Case{H6_METHOD_FIRM, H6_COUPLING_STATIC, H6_SYMMETRIC},
                         Case{H6_METHOD_FIRM, H6_COUPLING_DIRECT, H6_SYMMETRIC},
                         Case{H6_METHOD_SERIES, H6_COUPLING_DYNAMIC, H6_SYMMETRIC},
                         Case{H6_METHOD_SERIES, H6_COUPLING_STATIC, H6_EXACT},
                         Case{H6_METHOD_ROBUST, H6_COUPLING_DYNAMIC, H6_SYMMETRIC},
                         Case{H6_METHOD_ROBUST, H6_COUPLING_STATIC, H6_SYMMETRIC},
                         Case{H6_METHOD_GAUSS6, H6_COUPLING_DYNAMIC, H6_SYMMETRIC},
                         Case{H6_METHOD_GLOBAL, H6_COUPLING_DYNAMIC, H6_SYMMETRIC}}) {
    CAPTURE(std::string(h6MethodName(at.method)));
    CAPTURE(int(at.coupling));
    CAPTURE(int(at.gradient));
    BallOnBridge scene(6000, 8, 0.02, true, 20, 1e-4);
    scene.def.contact.method = at.method;
    scene.def.gradient = at.gradient;
    scene.hand.coupling.mode = at.coupling;
    h6Error error;
    REQUIRE_MESSAGE(scene.open(&error), error.message);
    const h6DeviceCommand command = press(scene, 3000, 2 * mm);
    const h6FrameReport report = h6GetFrame(scene.session);
    CHECK(report.contacts > 0);
    CHECK((report.status & (H6_SOLVE_FAILED | H6_STATE_NOT_FINITE)) == 0);
    double fastest = 0;
    for (const double v : scene.v()) fastest = std::max(fastest, std::fabs(v));
    CHECK(fastest < 1e-4);
    // What the modes feel of the contacts is what their springs hold.
    const h6Contacts c = h6GetContacts(scene.session, 0);
    std::vector<double> felt(8);
    double up = 0;
    const double k = h6StiffnessFor(scene.model.handle, &scene.def);
    for (std::size_t i = 0; i < c.count; ++i) {
      const double load = k * double(c.load[i]);
      up -= load * double(c.nz[i]);
      for (std::size_t j = 0; j < 8; ++j) {
        const float* u = scene.bridge.modes.data() + (c.point[i] * 8 + j) * 3;
        felt[j] +=
            load * (double(c.nx[i]) * u[0] + double(c.ny[i]) * u[1] + double(c.nz[i]) * u[2]);
      }
    }
    const std::vector<double> held = force_at(scene.bridge, scene.q());
    double most = 0;
    for (std::size_t j = 0; j < 8; ++j) most = std::max(most, std::fabs(held[j]));
    CHECK(most > 0.3);
    for (std::size_t j = 0; j < 8; ++j) CHECK(std::fabs(felt[j] - held[j]) < 0.01 * most);
    CHECK(up > 0.5);
    CHECK(command.wrench.force.z == doctest::Approx(up).epsilon(0.02));
  }
}

TEST_CASE("a bridge under a moving ball has the same bits on any number of threads, and a hash") {
  for (const bool warped : {false, true}) {
    std::vector<std::uint64_t> want;
    for (const unsigned threads : {1u, 2u, 4u}) {
      BallOnBridge scene(20000, 12, 0.02, true, 0, 0, warped);
      scene.def.threads = threads;
      REQUIRE(scene.open());
      std::vector<std::uint64_t> got;
      std::uint32_t most = 0;
      for (int i = 0; i < 500; ++i) {
        const h6DeviceSample sample = scene.sample(i);
        h6Step(scene.session, &sample, nullptr);
        got.push_back(h6GetFrame(scene.session).state_hash);
        most = std::max(most, h6GetFrame(scene.session).contacts);
      }
      CHECK(most > 5);
      if (threads == 1) want = got;
      CHECK(got == want);
      // The hash knows the modes.
      BallOnBridge other(20000, 12, 0.02, true, 0, 0, warped);
      REQUIRE(other.open());
      std::vector<double> q(12);
      q[3] = 1e-12;
      const h6DeviceSample sample = other.sample(0);
      REQUIRE(h6SetDeformation(other.session, 0, q.data(), nullptr, 12));
      h6Step(other.session, &sample, nullptr);
      CHECK(h6GetFrame(other.session).state_hash != want[0]);
    }
  }
}

TEST_CASE("a pressed ball comes to rest on a warped bridge, which holds it") {
  for (const h6Gradient gradient : {H6_SYMMETRIC, H6_EXACT})
    for (const h6Method method : {H6_METHOD_FIRM, H6_METHOD_ROBUST, H6_METHOD_GLOBAL}) {
      CAPTURE(std::string(h6MethodName(method)));
      CAPTURE(int(gradient));
      BallOnBridge scene(6000, 8, 0.02, true, 20, 1e-4, true);
      scene.def.contact.method = method;
      scene.def.gradient = gradient;
      REQUIRE(scene.open());
      const h6DeviceCommand command = press(scene, 3000, 2 * mm);
      CHECK((h6GetFrame(scene.session).status & (H6_SOLVE_FAILED | H6_STATE_NOT_FINITE)) == 0);
      for (const double v : scene.v()) CHECK(std::fabs(v) < 1e-4);
      const h6Contacts c = h6GetContacts(scene.session, 0);
      const double k = h6StiffnessFor(scene.model.handle, &scene.def);
      double up = 0;
      for (std::size_t i = 0; i < c.count; ++i) up -= k * double(c.load[i]) * double(c.nz[i]);
      CHECK(up > 0.5);
      CHECK(command.wrench.force.z == doctest::Approx(up).epsilon(0.02));
    }
}

TEST_CASE("a session goes on with the deformation of the one before, to the bit") {
  BallOnBridge scene(3000, 8), next(3000, 8);
  REQUIRE(scene.open());
  press(scene, 400, 2 * mm);
  h6Session* other = h6CreateSession(scene.model.handle, &scene.def, nullptr);
  REQUIRE(other);
  REQUIRE(h6TakeOver(other, scene.session, nullptr));
  std::vector<double> q(8), v(8);
  CHECK(h6GetDeformation(other, 0, q.data(), v.data(), 8) == 8);
  CHECK(q == scene.q());
  CHECK(v == scene.v());
  h6DestroySession(other);
}

TEST_CASE("a fast ball does not fall through a thin bridge") {
  BallOnBridge scene(20000, 8, 0.02, true, 20, 1e-4);
  scene.hand.coupling.max_force = 5;
  REQUIRE(scene.open());
  bool shortened = false;
  std::uint32_t steps = 1;
  for (int i = 0; i < 1500; ++i) {
    const double down = std::min(2e-3 * i, 40 * mm);  // 2 m/s
    const h6DeviceSample sample = hand_at(pose(0.02, 0, scene.top() + 10 * mm - down));
    h6Step(scene.session, &sample, nullptr);
    shortened = shortened || (h6GetFrame(scene.session).status & H6_SHORTENED);
    steps = std::max(steps, h6GetFrame(scene.session).substeps);
  }
  CHECK(steps > 1);
  CHECK(h6GetFrame(scene.session).contacts > 0);
  CHECK(h6GetBody(scene.session, 1).pose.p.z > 0);
}

TEST_CASE("what does not go with a body that bends is refused with one sentence") {
  BallOnBridge good(600, 3);
  CHECK(refusal(good).empty());
  const auto refuses = [](const char* part, auto&& change) {
    BallOnBridge scene(600, 3);
    change(scene);
    const std::string why = refusal(scene);
    CAPTURE(why);
    CHECK(has(why, "body 0 bends"));
    CHECK(has(why, part));
  };
  refuses("friction", [](BallOnBridge& s) { s.def.contact.friction = 0.2; });
  refuses("passivity", [](BallOnBridge& s) { s.def.contact.passivity = true; });
  refuses("explicit", [](BallOnBridge& s) { s.def.integrator = H6_EXPLICIT; });
  refuses("clusters of contacts",
          [](BallOnBridge& s) { s.def.contact.method = H6_METHOD_CLUSTER; });
  refuses("budget", [](BallOnBridge& s) { s.def.frame_budget_us = 500; });
  refuses("fixed", [](BallOnBridge& s) { s.bodies[0].fixed = false; });
  refuses("field", [](BallOnBridge& s) { s.bodies[0].field = 0; });

  BallOnBridge two(600, 3);
  std::vector<h6BodyDef> bodies(two.bodies.begin(), two.bodies.end());
  bodies.push_back(bodies[1]);
  bodies[2].pose = pose(0.1, 0, 0.2);
  two.def.bodies = bodies.data(), two.def.body_count = 3, two.def.pair_count = 0;
  CHECK(has(refusal(two), "list one pair"));
  two.def.pair_count = 1;
  CHECK(refusal(two).empty());
}

// The one mode of the plate is a shift along z: two rigid bodies in a straight impact.
TEST_CASE("an impact gives the body that bends the momentum that the part loses, in every frame") {
  constexpr double mass = 0.2;
  for (const h6Method method : {H6_METHOD_FIRM, H6_METHOD_ROBUST, H6_METHOD_GLOBAL}) {
    CAPTURE(std::string(h6MethodName(method)));
    BallOnBridge scene(3000, 1);
    BridgeArrays& plate = scene.bridge;
    for (std::size_t i = 0; i < plate.modes.size(); ++i)
      plate.modes[i] = i % 3 == 2 ? float(1 / std::sqrt(mass)) : 0.0f;
    std::fill(plate.normal_modes.begin(), plate.normal_modes.end(), 0.0f);
    plate.linear[0] = 1e-9, plate.quadratic[0] = plate.cubic[0] = 0;
    const Model loose({def_of(scene.field)}, {plate.def()});
    scene.def.hand_count = 0;
    scene.def.contact.method = method;
    scene.bodies[1].pose.p.z += 1 * mm;
    scene.bodies[1].velocity.linear.z = -0.2;
    h6Session* session = h6CreateSession(loose.handle, &scene.def, nullptr);
    REQUIRE(session);
    double most = 0, fastest = 0;
    for (int i = 0; i < 100; ++i) {
      h6Step(session, nullptr, nullptr);
      double v = 0;
      h6GetDeformation(session, 0, nullptr, &v, 1);
      const double plate_momentum = std::sqrt(mass) * v;
      const double ball_momentum = scene.bodies[1].mass * h6GetBody(session, 1).velocity.linear.z;
      most = std::max(most, std::fabs(plate_momentum + ball_momentum + 0.2 * scene.bodies[1].mass));
      fastest = std::max(fastest, std::fabs(v));
    }
    h6DestroySession(session);
    CHECK(fastest > 0.02);
    CHECK(most < 1e-9);
  }
}

TEST_CASE("without listed pairs the one moving field touches the bridge") {
  BallOnBridge scene(3000, 5);
  scene.def.pair_count = 0;
  REQUIRE(scene.open());
  press(scene, 400, 1 * mm);
  CHECK(h6GetFrame(scene.session).contacts > 0);
}

TEST_CASE("a definition of a deformable is checked, and its functions take wrong arguments") {
  const auto model_error = [](auto&& change) {
    BridgeArrays bridge(600, 3);
    change(bridge);
    h6ShellDef shell = bridge.def();
    h6ModelDef def = h6DefaultModelDef();
    def.shells = &shell, def.shell_count = 1;
    h6Error error{};
    h6Model* model = h6CreateModel(&def, &error);
    h6DestroyModel(model);
    CHECK((model != nullptr) == (error.message[0] == 0));
    return std::string(error.message);
  };
  CHECK(model_error([](BridgeArrays&) {}).empty());
  CHECK(model_error([](BridgeArrays& b) { b.bend.quadratic = b.bend.cubic = nullptr; }).empty());
  CHECK(has(model_error([](BridgeArrays& b) { b.bend.mode_count = 0; }), "modes"));
  CHECK(has(model_error([](BridgeArrays& b) { b.bend.mode_count = 65; }), "modes"));
  CHECK(has(model_error([](BridgeArrays& b) { b.bend.modes = nullptr; }), "must be given"));
  CHECK(has(model_error([](BridgeArrays& b) { b.bend.linear = nullptr; }), "must be given"));
  CHECK(has(model_error([](BridgeArrays& b) { b.modes[5] = NAN; }), "modes[5]"));
  CHECK(has(model_error([](BridgeArrays& b) { b.normal_modes[4] = NAN; }), "normal_modes[4]"));
  CHECK(has(model_error([](BridgeArrays& b) { b.cubic[3] = INFINITY; }), "cubic[3]"));
  const auto warp = [](BridgeArrays& b) {
    b.bend.turn_modes = b.turn_modes.data();
    b.bend.normal_modes = nullptr, b.bend.quadratic = b.bend.cubic = nullptr;
  };
  CHECK(model_error(warp).empty());
  const auto warp_error = [&](auto&& change) {
    return model_error([&](BridgeArrays& b) { warp(b), change(b); });
  };
  CHECK(has(warp_error([](BridgeArrays& b) { b.turn_modes[7] = NAN; }), "turn_modes[7]"));
  CHECK(has(warp_error([](BridgeArrays& b) { b.bend.normal_modes = b.normal_modes.data(); }),
            "not both"));
  CHECK(has(warp_error([](BridgeArrays& b) { b.bend.quadratic = b.quadratic.data(); }), "NULL"));
  CHECK(has(warp_error([](BridgeArrays& b) { b.bend.cubic = b.cubic.data(); }), "NULL"));
  CHECK(has(model_error([](BridgeArrays& b) { b.bend.alpha = -1; }), "alpha"));
  CHECK(has(model_error([](BridgeArrays& b) { b.bend.beta = NAN; }), "beta"));
  CHECK(has(model_error([](BridgeArrays& b) { b.bend.reserved[0] = 1; }), "reserved"));

  BallOnBridge scene(600, 3);
  REQUIRE(scene.open());
  double q[3] = {1e-3, 2e-3, 3e-3}, v[3] = {7, 7, 7};
  CHECK(h6GetDeformation(nullptr, 0, q, v, 3) == 0);
  CHECK(h6GetDeformation(scene.session, 1, q, v, 3) == 0);
  CHECK(h6GetDeformation(scene.session, -1, q, v, 3) == 0);
  CHECK(h6GetDeformation(scene.session, 2, q, v, 3) == 0);
  CHECK(v[0] == 7);
  CHECK(h6GetDeformation(scene.session, 0, nullptr, nullptr, 3) == 3);
  CHECK_FALSE(h6SetDeformation(nullptr, 0, q, nullptr, 3));
  CHECK_FALSE(h6SetDeformation(scene.session, 1, q, nullptr, 3));
  CHECK_FALSE(h6SetDeformation(scene.session, 2, q, nullptr, 3));
  CHECK_FALSE(h6SetDeformation(scene.session, 0, nullptr, nullptr, 3));
  CHECK_FALSE(h6SetDeformation(scene.session, 0, q, nullptr, 2));
  const double bad[3] = {0, NAN, 0}, huge[3] = {0, 0, 1e7};
  CHECK_FALSE(h6SetDeformation(scene.session, 0, bad, nullptr, 3));
  CHECK_FALSE(h6SetDeformation(scene.session, 0, q, huge, 3));
  CHECK(scene.q() == std::vector<double>(3));
  CHECK(h6SetDeformation(scene.session, 0, q, nullptr, 3));
  CHECK(h6GetDeformation(scene.session, 0, nullptr, v, 2) == 3);
  CHECK(v[0] == 0);
  CHECK(v[2] == 7);
  CHECK(scene.q() == std::vector<double>{1e-3, 2e-3, 3e-3});
}

TEST_CASE("while a loop runs a session, nothing puts its bodies into another shape") {
  const auto open = [](BallOnBridge& scene) {
    scene.def.hand_count = 0;
    scene.bodies[1].pose = pose(0, 0, 0.5);  // far away
    REQUIRE(scene.open());
    const std::vector<double> q(8, 1e-3);
    REQUIRE(h6SetDeformation(scene.session, 0, q.data(), nullptr, 8));
  };
  BallOnBridge scene(600, 8), again(600, 8);
  open(scene), open(again);
  h6LoopDef def = h6DefaultLoopDef();
  def.duration = 0, def.realtime = false;
  h6Loop* loop = h6StartLoop(scene.session, nullptr, &def, nullptr);
  REQUIRE(loop);
  const std::vector<double> other(8, -2e-3);
  CHECK_FALSE(h6SetDeformation(scene.session, 0, other.data(), other.data(), 8));
  std::thread([&] {
    for (int i = 0; i < 20; ++i) {
      CHECK_FALSE(h6SetDeformation(scene.session, 0, other.data(), nullptr, 8));
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }).join();
  h6RequestStop(loop);
  h6LoopReport report;
  h6JoinLoop(loop, &report);
  for (std::uint64_t i = 0; i < report.frames; ++i) h6Step(again.session, nullptr, nullptr);
  CHECK(scene.q() == again.q());
  CHECK(h6SetDeformation(scene.session, 0, other.data(), nullptr, 8));  // it is ours again
  h6DestroyLoop(loop);
}

TEST_CASE("a viewer of a loop gets the coordinates of the body that bends") {
  const auto vibrate = [](BallOnBridge& scene) {
    scene.def.hand_count = 0;
    scene.bodies[1].pose = pose(0, 0, 0.5);  // far away
    REQUIRE(scene.open());
    const std::vector<double> q(8, 1e-3);
    REQUIRE(h6SetDeformation(scene.session, 0, q.data(), nullptr, 8));
  };
  BallOnBridge scene(600, 8), again(600, 8);
  vibrate(scene), vibrate(again);
  h6LoopDef def = h6DefaultLoopDef();
  def.duration = 0.2, def.realtime = false, def.view_contacts = 64;
  h6Loop* loop = h6StartLoop(scene.session, nullptr, &def, nullptr);
  REQUIRE(loop);
  h6LoopView view{};
  for (int i = 0; i < 30000 && view.frame < 50; ++i) {
    h6ReadView(loop, &view);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  REQUIRE(view.frame >= 50);
  REQUIRE(view.bend_count == 8);
  const std::vector<double> seen(view.bends, view.bends + 8);
  h6DestroyLoop(loop);
  do {
    h6Step(again.session, nullptr, nullptr);
  } while (h6GetFrame(again.session).frame < view.frame);
  CHECK(again.q() == seen);
}
