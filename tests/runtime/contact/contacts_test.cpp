// SPDX-License-Identifier: Apache-2.0
// contacts_test.cpp - traversal finds the contacts that a test of every point finds.
//
// Traversal remembers from frame to frame which points cannot touch yet. Here sessions walk, slowly
// and fast, and in every frame their contacts are compared with samples of all points at the same
// place: none missing, none extra, not by one rounding.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "kernels/field/sample_field.h"
#include "runtime/frame/session.h"
#include "tests/support/analytic.h"
#include "tests/support/frame_scenes.h"

using namespace h6::test;

namespace {

constexpr double mm = 1e-3;  // a voxel

double box(double x, double y, double z, const double c[3], const double half[3]) {
  const double a[3] = {std::fabs(x - c[0]) - half[0], std::fabs(y - c[1]) - half[1],
                       std::fabs(z - c[2]) - half[2]};
  const double out = std::hypot(std::max(a[0], 0.0), std::max(a[1], 0.0), std::max(a[2], 0.0));
  return out + std::min(std::max({a[0], a[1], a[2]}), 0.0);
}

double clutter(double x, double y, double z) {
  const double c[3][3] = {{30 * mm, 0, 0}, {-5 * mm, 34 * mm, 8 * mm}, {-30 * mm, -25 * mm, 0}};
  const double half[3][3] = {
      {6 * mm, 30 * mm, 4 * mm}, {14 * mm, 5 * mm, 9 * mm}, {4 * mm, 4 * mm, 40 * mm}};
  double d = std::hypot(x, y - 10 * mm, z + 34 * mm) - 10 * mm;
  for (int i = 0; i < 3; ++i) d = std::min(d, box(x, y, z, c[i], half[i]));
  return d;
}

FieldArrays field_of(const Distance& f) {
  return sample_analytic(f, {-56 * mm, -56 * mm, -56 * mm}, mm, 14, 14, 14);
}
constexpr double kRadius = 20 * mm;

struct Walk {
  std::string name;
  h6Method method;
  double voxel, radius;  // of the field, of the shell [m]
  double room;           // largest distance of the walk from the middle [m]
  bool moving_field = false;
  int jump = 0;  // frames from one jump of some voxels to the next; 0: none
};

double uniform(std::mt19937_64& random) {
  return std::ldexp(static_cast<double>(random() >> 11), -52) - 1;
}

struct Found {
  int missed = 0, extra = 0, contacts = 0, ahead = 0, near = 0, poses = 0;
};

bool is_sample(const h6Session* s, const h6::Shell& shell, std::size_t r) {
  const h6::kernels::Affine& place = s->near.pairs[0].search.last_place;
  const h6::Field& field = s->model->fields[0];
  h6::Vec3 at = field.origin;
  for (int k = 0; k < 3; ++k)
    at[k] += field.voxel * (place.m[k][0] * shell.x[r] + place.m[k][1] * shell.y[r] +
                            place.m[k][2] * shell.z[r] + place.m[k][3]);
  double d;
  std::uint8_t exact;
  h6SampleField(s->model, 0, at.data(), 1, &d, nullptr, &exact);
  return exact != 0;
}

// How deep row r would be if its body went the way that the last frame looked ahead [voxel].
float carried_depth(const h6Session* s, const h6::Shell& shell, std::size_t r, float distance) {
  const h6::PairSearch& pair = s->near.pairs[0].search;
  const double voxel = s->model->fields[0].voxel;
  h6::Mat3 turn;  // of the body: the field's axes are the world's
  for (int k = 0; k < 9; ++k) turn(k / 3, k % 3) = voxel * pair.last_place.m[k / 3][k % 3];
  const h6::Vec3 v(pair.ahead[0], pair.ahead[1], pair.ahead[2]),
      w(pair.ahead[3], pair.ahead[4], pair.ahead[5]);
  const h6::Vec3 arm =
      turn * (h6::Vec3(shell.x[r], shell.y[r], shell.z[r]) + shell.centre - s->bodies[1].com);
  const h6::Vec3 n = turn * h6::Vec3(shell.nx[r], shell.ny[r], shell.nz[r]);
  return float(std::max(0.0, -n.dot(v + w.cross(arm))) / voxel) - distance;
}

// All rows of the shell at the place that the last frame used.
void compare(const h6Session* s, Found& found, double* least, std::uint32_t* deepest) {
  const h6::PairSearch& pair = s->near.pairs[0].search;
  const h6::Shell& shell = s->model->shells[0];
  std::vector<float> d(shell.points);
  h6::kernels::sample_field(s->model->fields[0].view, pair.last_place,
                            {shell.x.data, shell.y.data, shell.z.data, shell.points}, nullptr,
                            shell.points, d.data(), nullptr, nullptr, nullptr);
  std::vector<int> touching(shell.points);
  const h6::Contacts& c = s->shells[0].contacts;
  for (std::size_t i = 0; i < c.count; ++i) ++touching[c.point[i]];
  *least = 1e9;
  for (std::size_t r = 0; r < shell.points; ++r) {
    const int got = touching[shell.point[r]];
    // Points that can carry load count where their gap is a sample, not a bound.
    int want = d[r] < 0;
    if (!want && d[r] < pair.margin && is_sample(s, shell, r)) {
      const float deep = carried_depth(s, shell, r, d[r]);
      want = std::fabs(deep) < 1e-4f ? got : deep > 0;
      found.ahead += want;
    }
    found.missed += got < want;
    found.extra += got > want;
    found.contacts += want;
    if (d[r] < *least) *least = d[r], *deepest = static_cast<std::uint32_t>(r);
  }
  found.near += std::fabs(*least - pair.margin) < 0.05;
  ++found.poses;
}

Found walk(const h6Model* model, const Walk& w, double step_voxels, int frames, unsigned threads) {
  h6BodyDef bodies[2] = {h6DefaultBodyDef(), h6DefaultBodyDef()};
  bodies[0].fixed = !w.moving_field, bodies[0].field = 0;
  bodies[0].inertia[0] = bodies[0].inertia[1] = bodies[0].inertia[2] = 1e-4;
  bodies[1].fixed = false, bodies[1].shell = 0;
  h6SessionDef def = h6DefaultSessionDef();
  const h6PairDef pair{1, 0, {}};
  def.pairs = &pair, def.pair_count = 1;
  def.bodies = bodies, def.body_count = 2;
  def.max_contacts = model->shells[0].points;  // none is dropped
  def.contact.method = w.method;
  def.threads = threads;
  h6Error error{};
  h6Session* s = h6CreateSession(model, &def, &error);
  CAPTURE(error.message);
  REQUIRE(s);
  h6::keep_all_awake(*s);  // each step places the points
  std::mt19937_64 random(7);
  Found found;
  h6::Vec3 p(0, 0, 0), base(0, 0, 0);
  h6::Quat q = h6::Quat::Identity();
  for (int i = 0; i < frames; ++i) {
    // Rests now and then; turns by as much as it shifts.
    if (i % 17 != 0) {
      for (int k = 0; k < 3; ++k) p[k] += step_voxels * w.voxel * uniform(random);
      if (w.jump > 0 && i % w.jump == 1)
        for (int k = 0; k < 3; ++k) p[k] += w.room * uniform(random);
      if (p.norm() > w.room) p *= w.room / p.norm();
      const double turn = step_voxels * w.voxel / w.radius;
      q = h6::exp_rotation(turn * h6::Vec3(uniform(random), uniform(random), uniform(random))) * q;
      q.normalize();
    }
    // The field moves too: only their relative pose counts.
    h6BodyState state{};
    h6::Quat turned = h6::Quat::Identity();
    if (w.moving_field) {
      base += 0.3 * w.voxel * h6::Vec3(uniform(random), uniform(random), uniform(random));
      turned = h6::exp_rotation(h6::Vec3(0, 0, 1e-3 * i));
      state.pose = {h6::to(base), h6::to(turned)};
      h6SetBody(s, 0, &state);
    }
    double least = 0;
    std::uint32_t deepest = 0;
    const auto step = [&] {
      const h6::Vec3 at = base + turned * p;
      const h6::Quat held = turned * q;
      state.pose = {h6::to(at), h6::to(held)};
      h6SetBody(s, 1, &state);
      if (w.moving_field) {
        h6BodyState f{};
        f.pose = {h6::to(base), h6::to(turned)};
        h6SetBody(s, 0, &f);
      }
      h6Step(s, nullptr, nullptr);
      compare(s, found, &least, &deepest);
    };
    step();
    if (i % 2) continue;
    // Grazing: shifted along the deepest point's gradient until it is within 0.05 voxel.
    const float margin = s->near.pairs[0].search.margin;
    for (int shift = 0; shift < 2; ++shift) {
      const h6::Shell& rows = model->shells[0];
      const h6::Vec3 local =
          rows.centre + h6::Vec3(rows.x[deepest], rows.y[deepest], rows.z[deepest]);
      const h6::Vec3 at = p + q * local;
      double d, g[3];
      h6SampleField(model, 0, at.data(), 1, &d, g, nullptr);
      const double wanted = (margin + 0.04 * uniform(random)) * w.voxel;
      if (std::fabs(d) > 3 * w.voxel) break;
      p += (wanted - d) * h6::Vec3(g[0], g[1], g[2]);
      step();
    }
  }
  h6DestroySession(s);
  return found;
}

struct FormulaWalk {
  Distance distance;
  Walk walk;
};

const FormulaWalk kWalks[] = {
    {clutter, {"clutter", H6_METHOD_GAUSS6, mm, kRadius, 18 * mm}},
    {clutter, {"series", H6_METHOD_SERIES, mm, kRadius, 18 * mm}},
    {[](double x, double y, double z) { return kRadius + 0.25 * mm - std::hypot(x, y, z); },
     {"socket", H6_METHOD_GAUSS3, mm, kRadius, 0.6 * mm}},
    {[](double, double, double z) { return std::fabs(z - 20.5 * mm) - mm; },
     {"sheet", H6_METHOD_NONE, mm, kRadius, 8 * mm}},
    {clutter, {"moving field", H6_METHOD_GAUSS6, mm, kRadius, 18 * mm, true}},
};

}  // namespace

TEST_CASE("contacts are all points that touch and no others, on slow, medium and fast walks") {
  for (const auto& [distance, w] : kWalks) {
    CAPTURE(w.name);
    FieldArrays field = field_of(distance);
    ShellArrays shell = sphere_points(kRadius, 3001);
    Model model({def_of(field)}, {shell.def()});
    REQUIRE(model.handle);
    Found all;
    for (const double step : {0.005, 0.1, 6.0}) {
      CAPTURE(step);
      const Found f = walk(model.handle, w, step, 1200, 1);
      CHECK(f.missed == 0);
      CHECK(f.extra == 0);
      all.contacts += f.contacts;
      all.near += f.near;
      all.ahead += f.ahead;
    }
    if (w.method == H6_METHOD_SERIES) CHECK(all.ahead > 100);
    MESSAGE(w.name << ": " << all.contacts << " contacts, " << all.near << " grazing poses");
    CHECK(all.contacts > 1000);
    CHECK(all.near > 200);
  }
}

// HAPSIX_ALL_POSES=1: at full size (1024^3 voxels, 56,823 points) and 10,000 poses a scene.
TEST_CASE("contacts in the scenes of the benches are all points that touch and no others") {
  const bool full = std::getenv("HAPSIX_ALL_POSES") != nullptr;
  const double size = full ? 1 : 0.25;
  for (const bool socket : {false, true}) {
    const std::unique_ptr<h6Model, void (*)(h6Model*)> model(h6::bench::make_model(socket, size),
                                                             h6DestroyModel);
    REQUIRE(model);
    const Walk w{socket ? "socket" : "clutter",
                 H6_METHOD_GAUSS6,
                 h6::bench::kVoxel,
                 model->shells[0].radius,
                 (socket ? 1
                  : full ? 6
                         : 2) *
                     h6::bench::kVoxel,
                 false,
                 50};
    CAPTURE(w.name);
    Found all;
    for (const double step : {0.005, 0.1, 6.0}) {
      CAPTURE(step);
      const Found f = walk(model.get(), w, step, full ? 2200 : 200, 1);
      CHECK(f.missed == 0);
      CHECK(f.extra == 0);
      all.contacts += f.contacts, all.near += f.near, all.poses += f.poses;
    }
    MESSAGE(w.name << ": " << all.poses << " poses, " << all.near << " of them grazing, "
                   << all.contacts << " contacts");
    CHECK(all.contacts > 1000);
    CHECK(all.near > 50);
    CHECK(all.poses >= (full ? 10000 : 500));
  }
}

namespace {

// A ball of many points among obstacles.
struct BallInClutter {
  FieldArrays field = field_of(clutter);
  ShellArrays shell = sphere_points(kRadius, 9000);
  Model model{{def_of(field)}, {shell.def()}};
  h6BodyDef bodies[2] = {h6DefaultBodyDef(), h6DefaultBodyDef()};
  h6SessionDef def = h6DefaultSessionDef();
  BallInClutter() {
    bodies[0].fixed = true, bodies[0].field = 0;
    bodies[1].fixed = false, bodies[1].shell = 0;
    def.bodies = bodies, def.body_count = 2;
  }
  h6Session* open(unsigned threads) {
    def.threads = threads;
    h6Session* s = h6CreateSession(model.handle, &def, nullptr);
    REQUIRE(s);
    return s;
  }
};

}  // namespace

TEST_CASE("contacts depend neither on earlier frames nor on the helper") {
  BallInClutter scene;
  scene.def.contact.method = H6_METHOD_GAUSS6;
  h6Session *one = scene.open(1), *two = scene.open(2);
  std::mt19937_64 random(3);
  int contacts = 0;
  for (int i = 0; i < 200; ++i) {
    h6BodyState state{};
    const double size = i % 40 < 30 ? 0.02 : 10;  // steps of both kinds
    static h6::Vec3 p(8 * mm, 0, 0);
    p += size * mm * h6::Vec3(uniform(random), uniform(random), uniform(random));
    if (p.norm() > 15 * mm) p *= 15 * mm / p.norm();
    state.pose = pose(p.x(), p.y(), p.z());
    h6Session* fresh = scene.open(1);
    std::uint64_t hash[3];
    int k = 0;
    for (h6Session* s : {one, two, fresh}) {
      h6SetBody(s, 1, &state);
      h6Step(s, nullptr, nullptr);
      hash[k++] = h6GetFrame(s).state_hash;
    }
    contacts += static_cast<int>(h6GetFrame(fresh).contacts);
    CHECK(hash[0] == hash[2]);
    CHECK(hash[1] == hash[2]);
    h6DestroySession(fresh);
  }
  CHECK(contacts > 1000);
  h6DestroySession(one);
  h6DestroySession(two);
}

TEST_CASE("points clear of a field are not sampled again while the shell trembles") {
  BallInClutter scene;
  h6Session* s = scene.open(1);
  std::size_t looked = 0;
  // 60 voxels in all, more than any clearance.
  for (int i = 0; i < 2000; ++i) {
    h6BodyState state{};
    state.pose = pose(0.03 * mm * (i % 2), 0, 0);
    h6SetBody(s, 1, &state);
    h6Step(s, nullptr, nullptr);
    if (i > 1) looked += s->near.pairs[0].search.sampled;
    CHECK(h6GetFrame(s).contacts == 0);
  }
  CHECK(looked == 0);
  h6DestroySession(s);
}

TEST_CASE("the columns of few contacts lie close together, apart, and within their memory") {
  constexpr std::size_t kCapacity = 1000;
  h6::Contacts c{};
  h6::Arena count;
  h6::take_columns(c, count, kCapacity);
  const std::size_t lines = (count.used() + 63) / 64;
  std::vector<std::uint32_t> memory(16 * (lines + 1));
  std::uint32_t* const base =
      memory.data() + (64 - reinterpret_cast<std::uintptr_t>(memory.data()) % 64) % 64 / 4;
  for (const std::size_t rows : {kCapacity, std::size_t{0}, std::size_t{1}, std::size_t{94},
                                 std::size_t{16}, std::size_t{17}, kCapacity - 1, kCapacity}) {
    h6::Arena arena(base, 64 * lines);
    h6::take_columns(c, arena, kCapacity);
    h6::place_columns(c, rows);
    std::vector<std::uintptr_t> begins;
    h6::each_column(
        c, [&](auto*& column) { begins.push_back(reinterpret_cast<std::uintptr_t>(column)); });
    std::sort(begins.begin(), begins.end());
    const std::size_t room = 64 * ((rows + 15) / 16);
    for (std::size_t k = 1; k < begins.size(); ++k) CHECK(begins[k] - begins[k - 1] == room);
    CHECK(begins.front() == reinterpret_cast<std::uintptr_t>(base));
    CHECK(begins.back() + room <= reinterpret_cast<std::uintptr_t>(base) + 64 * lines);
  }
  c.cell = nullptr;  // a rule that has no such column keeps none
  h6::place_columns(c, 20);
  CHECK(c.cell == nullptr);
}
