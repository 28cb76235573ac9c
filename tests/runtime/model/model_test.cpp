// SPDX-License-Identifier: Apache-2.0
// Invalid definitions are refused with a sentence; valid ones are kept exactly.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "hapsix/hapsix.h"
#include "tests/support/analytic.h"

using namespace h6::test;

namespace {

constexpr double mm = 1e-3;
constexpr float nan_f = std::numeric_limits<float>::quiet_NaN();

FieldArrays ball_field() {
  return sample_analytic(
      [](double x, double y, double z) { return std::sqrt(x * x + y * y + z * z) - 10 * mm; },
      {-32 * mm, -32 * mm, -32 * mm}, mm, 8, 8, 8);
}

// The error of creating a model of this field and shell; empty when it works.
std::string complaint(const h6FieldDef* field, const h6ShellDef* shell) {
  h6ModelDef def = h6DefaultModelDef();
  def.fields = field, def.field_count = field ? 1 : 0;
  def.shells = shell, def.shell_count = shell ? 1 : 0;
  h6Error error{};
  h6Model* model = h6CreateModel(&def, &error);
  const std::string text = model ? "" : error.message;
  h6DestroyModel(model);
  return text;
}
bool says(const std::string& text, const char* word) {
  return text.find(word) != std::string::npos;
}

}  // namespace

TEST_CASE("sampling a field gives back its samples") {
  FieldArrays field = ball_field();
  Model model({def_of(field)}, {});
  REQUIRE(model.handle);
  double worst = 0, worst_gradient = 0;
  for (int i = 0; i < 2000; ++i) {
    const double a = 0.1 * i, b = 0.37 * i, r = (10 + 2.5 * std::sin(1.7 * i)) * mm;
    const double u[3] = {std::cos(a) * std::cos(b), std::sin(a) * std::cos(b), std::sin(b)};
    const double p[3] = {r * u[0], r * u[1], r * u[2]};
    double d, g[3];
    std::uint8_t exact;
    REQUIRE(h6SampleField(model.handle, 0, p, 1, &d, g, &exact) == 0);
    CHECK(exact == 1);
    worst = std::max(worst, std::fabs(d - (r - 10 * mm)));
    worst_gradient = std::max(worst_gradient, std::hypot(g[0] - u[0], g[1] - u[1], g[2] - u[2]));
  }
  // Trilinear error of a ball at r voxels: h^2/8 times the Laplacian 2/r; of its gradient half a
  // cell's diagonal times the curvature 1/r. The nearest points are at 7.5 voxels.
  CHECK(worst < 0.25 / 7.5 * mm);
  CHECK(worst_gradient < 0.5 * std::sqrt(3.0) / 7.5);
}

TEST_CASE("many points sampled at once give the bits of each one alone") {
  FieldArrays field = ball_field();
  Model model({def_of(field)}, {});
  for (const std::size_t count : {1, 2, 63, 64, 65, 200}) {
    std::vector<double> points, distance(count), gradient(3 * count);
    for (std::size_t i = 0; i < count; ++i) {  // near, far, and outside the grid
      const double a = 0.7 * double(i), r = 0.3 * double(i % 150) * mm;
      points.insert(points.end(), {r * std::cos(a), r * std::sin(a), 0.1 * r});
    }
    points[3 * (count / 2)] = std::numeric_limits<double>::quiet_NaN();
    std::vector<std::uint8_t> exact(count);
    REQUIRE(h6SampleField(model.handle, 0, points.data(), count, distance.data(), gradient.data(),
                          exact.data()) == 0);
    for (std::size_t i = 0; i < count; ++i) {
      double d = 0, g[3];
      std::uint8_t e = 2;
      REQUIRE(h6SampleField(model.handle, 0, &points[3 * i], 1, &d, g, &e) == 0);
      CHECK(d == distance[i]);
      for (std::size_t k = 0; k < 3; ++k) CHECK(g[k] == gradient[3 * i + k]);
      CHECK(e == exact[i]);
    }
  }
}

TEST_CASE("far from the surface the answer is a bound with the right sign") {
  FieldArrays field = sample_analytic(
      [](double x, double y, double z) { return std::sqrt(x * x + y * y + z * z) - 22 * mm; },
      {-32 * mm, -32 * mm, -32 * mm}, mm, 8, 8, 8);
  Model model({def_of(field)}, {});
  const double points[] = {27 * mm,  27 * mm, 27 * mm, 0,        0,       0,
                           500 * mm, 0,       0,       -31 * mm, 30 * mm, -28 * mm};
  double d[4];
  std::uint8_t exact[4];
  h6SampleField(model.handle, 0, points, 4, d, nullptr, exact);
  for (int i = 0; i < 4; ++i) {
    const double* p = points + 3 * i;
    const double truth = std::hypot(p[0], p[1], p[2]) - 22 * mm;
    CHECK(exact[i] == 0);
    CHECK(std::signbit(d[i]) == std::signbit(truth));
    CHECK(std::fabs(d[i]) <= std::fabs(truth));
    CHECK(std::fabs(d[i]) >= 0.9 * std::fabs(truth) - 5 * mm);
  }
  CHECK(h6SampleField(model.handle, 1, points, 1, d, nullptr, nullptr) == -1);
}

TEST_CASE("an invalid field is refused with a sentence that names the entry") {
  const auto refused = [](const std::function<void(FieldArrays&, h6FieldDef&)>& spoil,
                          const char* word) {
    FieldArrays arrays = ball_field();
    h6FieldDef def = def_of(arrays);
    REQUIRE(complaint(&def, nullptr).empty());
    spoil(arrays, def);
    const std::string text = complaint(&def, nullptr);
    CHECK_MESSAGE(says(text, word), text);
  };
  refused([](auto&, auto& d) { d.voxel_size = 0; }, "voxel_size");
  refused([](auto&, auto& d) { d.voxel_size = NAN; }, "voxel_size");
  refused([](auto&, auto& d) { d.origin.y = INFINITY; }, "origin");
  refused([](auto&, auto& d) { d.bricks[1] = 0; }, "bricks[1]");
  refused([](auto&, auto& d) { d.bricks[2] = 100000; }, "bricks[2]");
  refused([](auto& a, auto&) { a.index[7] = 1 << 30; }, "brick_index[7]");
  refused([](auto& a, auto&) { a.index[0] = -2; }, "brick_index[0]");
  refused([](auto& a, auto&) { a.samples[100] = nan_f; }, "samples[100]");
  refused([](auto& a, auto&) { a.far[3] = nan_f; }, "far_grid[3]");
  refused([](auto&, auto& d) { d.far_grid = nullptr; }, "far_grid");
  refused([](auto&, auto& d) { d.band = -1; }, "band");
}

namespace {

// Some finer samples: cell 5 of the first brick cut into halves, cell 6 into quarters.
struct Finer {
  std::vector<std::int32_t> refined, index;
  std::vector<float> halves = std::vector<float>(27, 1e-3f),
                     quarters = std::vector<float>(125, 2e-3f);
  explicit Finer(std::size_t bricks) : refined(bricks, -1), index(512) {
    refined[0] = 0;
    index[5] = 1, index[6] = -1;
  }
  void give(h6FieldDef& d) const {
    d.refined = refined.data(), d.fine_index = index.data(), d.refined_count = 1;
    d.halves = halves.data(), d.half_count = 1;
    d.quarters = quarters.data(), d.quarter_count = 1;
  }
};

}  // namespace

TEST_CASE("invalid finer samples are refused with a sentence that names the entry") {
  const auto refused = [](const std::function<void(Finer&, h6FieldDef&)>& spoil, const char* word) {
    FieldArrays arrays = ball_field();
    h6FieldDef def = def_of(arrays);
    Finer finer(def.brick_count);
    finer.give(def);
    REQUIRE(complaint(&def, nullptr).empty());
    spoil(finer, def);
    const std::string text = complaint(&def, nullptr);
    CHECK_MESSAGE(says(text, word), text);
  };
  refused([](auto& f, auto&) { f.refined[1] = 1; }, "refined[1]");
  refused([](auto& f, auto&) { f.refined[1] = -2; }, "refined[1]");
  refused([](auto& f, auto&) { f.index[7] = 2; }, "fine_index[7]");
  refused([](auto& f, auto&) { f.index[8] = -2; }, "fine_index[8]");
  refused([](auto& f, auto&) { f.index[9] = INT32_MIN; }, "fine_index[9]");
  refused([](auto& f, auto&) { f.halves[26] = nan_f; }, "halves[26]");
  refused([](auto& f, auto&) { f.quarters[3] = nan_f; }, "quarters[3]");
  refused([](auto&, auto& d) { d.fine_index = nullptr; }, "fine_index");
  refused([](auto&, auto& d) { d.quarters = nullptr; }, "quarters");
  refused([](auto&, auto& d) { d.refined_count = SIZE_MAX; }, "too many");
  refused([](auto&, auto& d) { d.half_count = SIZE_MAX / 27; }, "too many");
}

TEST_CASE("a cell with finer samples gives these back, and its neighbours keep their own") {
  FieldArrays arrays = ball_field();
  h6FieldDef def = def_of(arrays);
  std::size_t cell = 0;  // of the first brick
  while (def.brick_index[cell] != 0) ++cell;
  const int at[3] = {int(cell % 8), int(cell / 8 % 8), int(cell / 64)};
  Finer finer(def.brick_count);
  for (int n = 0; n < 125; ++n) finer.quarters[std::size_t(n)] = float(1e-5 * n);
  finer.give(def);
  h6ModelDef model_def = h6DefaultModelDef();
  model_def.fields = &def, model_def.field_count = 1;
  h6Model* model = h6CreateModel(&model_def, nullptr);
  REQUIRE(model);
  const auto sample = [&](double x, double y, double z) {  // voxels from the brick's first node
    const double p[3] = {def.origin.x + (8 * at[0] + x) * mm, def.origin.y + (8 * at[1] + y) * mm,
                         def.origin.z + (8 * at[2] + z) * mm};
    double d = 0;
    std::uint8_t exact = 0;
    CHECK(h6SampleField(model, 0, p, 1, &d, nullptr, &exact) == 0);
    CHECK(exact == 1);
    return d;
  };
  for (int n = 0; n < 125; ++n) {  // off the faces, where a neighbour may answer
    const double e = 1e-4;
    const double x = 6 + std::clamp(n % 5 / 4.0, e, 1 - e),
                 y = std::clamp(n / 5 % 5 / 4.0, e, 1 - e), z = std::clamp(n / 25 / 4.0, e, 1 - e);
    CHECK(std::fabs(sample(x, y, z) - 1e-5 * n) < 2e-6);
  }
  CHECK(std::fabs(sample(5.5, 0.5, 0.5) - 1e-3) < 1e-6);
  const double before = sample(4.5, 0.5, 0.5);
  CHECK(std::fabs(before - 1e-3) > 1e-4);
  h6DestroyModel(model);
}

TEST_CASE("a shell that would lose contacts is refused") {
  const auto refused = [](const std::function<void(ShellArrays&, h6ShellDef&)>& spoil,
                          const char* word) {
    ShellArrays arrays = sphere_points(10 * mm, 50);
    h6ShellDef def = arrays.def();
    REQUIRE(complaint(nullptr, &def).empty());
    spoil(arrays, def);
    const std::string text = complaint(nullptr, &def);
    CHECK_MESSAGE(says(text, word), text);
  };
  refused([](auto& a, auto&) { a.radius[0] *= 0.5f; }, "does not hold point");
  refused([](auto& a, auto&) { a.radius[0] = nan_f; }, "radius");
  refused([](auto& a, auto&) { a.x[4] = nan_f; }, "point 4");
  refused([](auto& a, auto&) { a.nz[9] *= 2; }, "normal of point 9");
  refused([](auto& a, auto&) { a.point[20] = 77; }, "node 20");
  refused([](auto& a, auto&) { a.child_count[0] = 49; }, "nobody's children");
  refused([](auto& a, auto&) { a.first_child[0] = 2; }, "children of node 0");
  refused([](auto& a, auto&) { a.child_count[0] = UINT32_MAX; }, "children of node 0");
  refused([](auto&, auto& d) { d.point_count = 0; }, "points");
  refused([](auto&, auto& d) { d.level_count = 0; }, "levels");
  refused([](auto&, auto& d) { d.level_count = 99; }, "levels");
  refused([](auto&, auto& d) { d.nx = nullptr; }, "nx ny nz");
}

TEST_CASE("an invalid session is refused with a sentence that names the value") {
  FieldArrays field = ball_field();
  ShellArrays shell = sphere_points(5 * mm, 100);
  Model model({def_of(field)}, {shell.def()});
  struct Scene {
    std::array<h6BodyDef, 2> bodies;
    h6HandDef hand;
    h6PairDef pair;
    h6SessionDef def;
  };
  const auto complaint_of = [&](const std::function<void(Scene&)>& spoil) {
    Scene s{{h6DefaultBodyDef(), h6DefaultBodyDef()},
            h6DefaultHandDef(),
            {1, 0, {}},
            h6DefaultSessionDef()};
    s.bodies[0].fixed = true, s.bodies[0].field = 0;
    s.bodies[1].shell = 0;
    s.hand.body = 1;
    s.def.bodies = s.bodies.data(), s.def.body_count = 2;
    s.def.pairs = &s.pair, s.def.pair_count = 1;
    s.def.hands = &s.hand, s.def.hand_count = 1;
    spoil(s);
    h6Error error{};
    h6Session* session = h6CreateSession(model.handle, &s.def, &error);
    const std::string text = session ? "" : error.message;
    h6DestroySession(session);
    return text;
  };
  CHECK(complaint_of([](Scene&) {}) == "");
  const std::pair<std::function<void(Scene&)>, const char*> bad[] = {
      {[](Scene& s) { s.def.contact.stiffness = -1; }, "stiffness"},
      {[](Scene& s) { s.def.contact.stiffness = NAN; }, "stiffness"},
      {[](Scene& s) { s.def.contact.damping = -1e-3; }, "damping"},
      {[](Scene& s) { s.def.contact.epsilon = 0; }, "epsilon"},
      {[](Scene& s) { s.def.contact.epsilon_normal = 3; }, "epsilon_normal"},
      {[](Scene& s) { s.def.contact.epsilon_normal = 0; }, "epsilon_normal"},
      {[](Scene& s) { s.def.contact.epsilon_torque = 0; }, "epsilon_torque"},
      {[](Scene& s) { s.def.contact.epsilon = NAN; }, "epsilon"},
      {[](Scene& s) { s.def.contact.torque_length = -1e-3; }, "torque_length"},
      {[](Scene& s) { s.def.contact.global_n0 = 0.5; }, "global_n0"},
      {[](Scene& s) { s.def.contact.series_c = 2; }, "series_c"},
      {[](Scene& s) { s.def.contact.series_c = NAN; }, "series_c"},
      {[](Scene& s) { s.def.contact.margin_voxels = -0.1; }, "margin_voxels"},
      {[](Scene& s) { s.def.contact.cluster_voxels = 0; }, "cluster_voxels"},
      {[](Scene& s) { s.def.contact.method = static_cast<h6Method>(77); }, "method"},
      {[](Scene& s) { s.bodies[1].mass = 0; }, "mass"},
      {[](Scene& s) { s.bodies[1].mass = -0.1; }, "mass"},
      {[](Scene& s) { s.bodies[1].mass = NAN; }, "mass"},
      {[](Scene& s) { s.def.rate = NAN; }, "rate"},
      {[](Scene& s) { s.def.rate = -1000; }, "rate"},
      {[](Scene& s) { s.hand.coupling.stiffness = -1e3; }, "coupling stiffness"},
      {[](Scene& s) { s.hand.coupling.rotational_stiffness = -1; }, "rotational_stiffness"},
      {[](Scene& s) { s.hand.coupling.max_torque = NAN; }, "max_torque"},
      {[](Scene& s) { s.hand.coupling.damping_ratio = -1; }, "damping_ratio"},
      {[](Scene& s) { s.def.gravity.z = NAN; }, "gravity"},
      {[](Scene& s) { s.bodies[1].inertia[0] = 1; }, "inertia"},
      {[](Scene& s) { s.bodies[1].pose.p.x = NAN; }, "finite"},
      {[](Scene& s) { s.bodies[1].pose.q.w = 3; }, "quaternion"},
      {[](Scene& s) { s.bodies[1].shell = 1; }, "shell 1"},
      {[](Scene& s) { s.bodies[0].field = -7; }, "field -7"},
      {[](Scene& s) { s.def.rate = 0; }, "rate"},
      {[](Scene& s) { s.def.rate = 1e6; }, "rate"},
      {[](Scene& s) { s.def.max_contacts = 0; }, "max_contacts"},
      {[](Scene& s) { s.def.threads = 0; }, "threads"},
      {[](Scene& s) { s.hand.body = 0; }, "fixed"},
      {[](Scene& s) { s.hand.body = 9; }, "body 9"},
      {[](Scene& s) { s.hand.coupling.stiffness = 0; }, "coupling stiffness"},
      {[](Scene& s) { s.hand.coupling.max_depth_voxels = 0; }, "max_depth_voxels"},
      {[](Scene& s) { s.hand.coupling.max_force = -2; }, "max_force"},
      {[](Scene& s) {
         s.pair = {0, 1, {}};
       },
       "no shell"},
      {[](Scene& s) {
         s.pair = {1, 1, {}};
       },
       "itself"},
      {[](Scene& s) { s.def.hand_count = 99; }, "hands"},
      {[](Scene& s) { s.def.body_count = 0; }, "bodies"},
  };
  for (const auto& [spoil, word] : bad) {
    const std::string text = complaint_of(spoil);
    CHECK_MESSAGE(says(text, word), word, " / ", text);
  }
}

TEST_CASE("all memory of a model and a session comes from the given allocator and goes back") {
  struct Counter {
    std::size_t bytes = 0, calls = 0;
  } counter;
  const h6Allocator allocator{[](void* user, std::size_t n, std::size_t alignment) {
                                auto& c = *static_cast<Counter*>(user);
                                c.bytes += n, ++c.calls;
                                return std::aligned_alloc(alignment, n);
                              },
                              [](void* user, void* memory, std::size_t n) {
                                static_cast<Counter*>(user)->bytes -= n;
                                std::free(memory);
                              },
                              &counter};
  FieldArrays field = ball_field();
  ShellArrays shell = sphere_points(5 * mm, 100);
  const h6FieldDef f = def_of(field);
  const h6ShellDef sh = shell.def();
  h6ModelDef def = h6DefaultModelDef();
  def.fields = &f, def.field_count = 1, def.shells = &sh, def.shell_count = 1;
  def.allocator = allocator;
  h6Model* model = h6CreateModel(&def, nullptr);
  REQUIRE(model);
  CHECK(counter.bytes >= h6ModelBytes(model));
  const std::size_t of_model = counter.bytes;
  h6BodyDef bodies[2] = {h6DefaultBodyDef(), h6DefaultBodyDef()};
  bodies[0].fixed = true, bodies[0].field = 0, bodies[1].shell = 0;
  h6SessionDef sdef = h6DefaultSessionDef();
  sdef.bodies = bodies, sdef.body_count = 2, sdef.allocator = allocator;
  h6Session* session = h6CreateSession(model, &sdef, nullptr);
  REQUIRE(session);
  CHECK(counter.bytes > of_model);
  h6DestroySession(session);
  CHECK(counter.bytes == of_model);
  h6DestroyModel(model);
  CHECK(counter.bytes == 0);
  CHECK(counter.calls > 5);
}

TEST_CASE("wherever memory ends, model, session and loop say so and give back what they had") {
  struct Purse {
    int calls = 0, most = 0;
    std::size_t bytes = 0;
  } purse;
  const h6Allocator allocator{[](void* user, std::size_t n, std::size_t alignment) -> void* {
                                auto& p = *static_cast<Purse*>(user);
                                if (p.calls++ == p.most) return nullptr;
                                p.bytes += n;
                                return std::aligned_alloc(alignment, n);
                              },
                              [](void* user, void* memory, std::size_t n) {
                                static_cast<Purse*>(user)->bytes -= n;
                                std::free(memory);
                              },
                              &purse};
  FieldArrays field = ball_field();
  ShellArrays shell = sphere_points(5 * mm, 100);
  const h6FieldDef f = def_of(field);
  const h6ShellDef sh = shell.def();
  h6ModelDef def = h6DefaultModelDef();
  def.fields = &f, def.field_count = 1, def.shells = &sh, def.shell_count = 1;
  h6BodyDef bodies[2] = {h6DefaultBodyDef(), h6DefaultBodyDef()};
  bodies[0].fixed = true, bodies[0].field = 0, bodies[1].shell = 0;
  const h6PairDef pair{1, 0, {}};
  h6SessionDef sdef = h6DefaultSessionDef();
  sdef.bodies = bodies, sdef.body_count = 2, sdef.allocator = allocator;
  sdef.pairs = &pair, sdef.pair_count = 1;
  h6LoopDef ldef = h6DefaultLoopDef();
  ldef.virtual_time = true, ldef.duration = 0.002, ldef.ring_frames = 8, ldef.view_contacts = 8;

  // Makes one of them with room for 0, 1, 2 ... calls until it succeeds.
  const auto count_failures = [&](const auto& make, const auto& end) {
    for (int most = 0; most < 1000; ++most) {
      purse = {0, most, purse.bytes};
      const std::size_t before = purse.bytes;
      h6Error error{};
      if (auto* const made = make(&error)) {
        end(made);
        CHECK(purse.bytes == before);
        return most;
      }
      CHECK_MESSAGE(error.code == H6_ERROR_MEMORY, error.message);
      CHECK(says(error.message, "memory"));
      CHECK(purse.bytes == before);
    }
    return 0;
  };
  h6ModelDef poor = def;
  poor.allocator = allocator;
  CHECK(count_failures([&](h6Error* e) { return h6CreateModel(&poor, e); }, h6DestroyModel) > 3);
  h6Model* const model = h6CreateModel(&def, nullptr);
  REQUIRE(model);
  CHECK(count_failures([&](h6Error* e) { return h6CreateSession(model, &sdef, e); },
                       h6DestroySession) > 6);
  purse = {0, 1000};
  h6Session* const session = h6CreateSession(model, &sdef, nullptr);
  REQUIRE(session);
  CHECK(count_failures([&](h6Error* e) { return h6StartLoop(session, nullptr, &ldef, e); },
                       h6DestroyLoop) > 4);
  h6DestroySession(session);
  CHECK(purse.bytes == 0);
  h6DestroyModel(model);
}

TEST_CASE("every name has its value and back") {
  for (int i = 0; i < H6_METHOD_COUNT; ++i) {
    h6Method method;
    std::uint32_t pieces = 99;
    REQUIRE(h6MethodFromName(h6MethodName(static_cast<h6Method>(i)), &method, &pieces) == 0);
    CHECK(method == i);
    CHECK(pieces == 0);
  }
  std::uint32_t pieces;
  h6Method method;
  CHECK(h6MethodFromName("gauss6+facing+depth", &method, &pieces) == 0);
  CHECK(method == H6_METHOD_GAUSS6);
  CHECK(pieces == (H6_PIECE_FACING | H6_PIECE_DEPTH));
  CHECK(h6MethodFromName("robust+cluster+geodesic", &method, &pieces) == 0);
  CHECK(pieces == (H6_PIECE_CLUSTER | H6_PIECE_GEODESIC));
  CHECK(h6MethodFromName("gauss6+handles+printed", &method, &pieces) == 0);
  CHECK(pieces == (H6_PIECE_HANDLES | H6_PIECE_PRINTED));
  for (const char* wrong :
       {"", "gauss", "gauss66", "robust+", "robust+nothing", "+facing", "Robust"})
    CHECK_MESSAGE(h6MethodFromName(wrong, &method, &pieces) != 0, wrong);
  CHECK(h6MethodFromName(nullptr, &method, &pieces) != 0);
  for (std::uint32_t bit = 1; bit <= H6_PASSIVITY; bit <<= 1) CHECK(h6StatusName(bit) != nullptr);
  CHECK(h6StatusName(3) == nullptr);
}
