// experiments_poses.cpp - studies of contacts at given poses: how large the weighted stiffness is,
// how smooth the force, what a closed cycle costs, how long a frame takes.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "io/cli/experiments_studies.h"

namespace h6::cli {
namespace {

using io::operator+;
using io::operator-;
using io::operator*;

constexpr double kPi = std::numbers::pi;
constexpr double kStiffness = 1e4, kVoxel = 1e-3;
constexpr double kMm = io::kMm;

TextTable head(const std::string& first, const std::vector<MethodColumn>& columns) {
  TextTable table(1, {first});
  for (const MethodColumn& c : columns) table[0].push_back(c.name);
  return table;
}

// A free body with these points against one obstacle; nothing holds it.
io::Scene posed_scene(const std::string& name, io::Mesh obstacle, io::PointCloud points) {
  io::Scene scene = io::common_scene(name, name);
  scene.bodies.push_back(io::obstacle("obstacle", std::move(obstacle), kVoxel));
  io::SceneBody body;
  body.name = "body";
  body.com = h6Vec3{0, 0, 0};
  body.inertia = io::box_inertia(body.mass, {10 * kMm, 10 * kMm, 5 * kMm});
  body.pose = {{0, 0, 0}, {1, 0, 0, 0}};
  body.shell.emplace();
  body.shell->points = std::move(points);
  body.shell->bake.levels = 3;
  scene.bodies.push_back(std::move(body));
  return scene;
}

// Puts the body at poses and asks for its contacts there.
class Probe {
 public:
  Probe(const io::LoadedScene& loaded, const MethodColumn& method) {
    h6SessionDef def = loaded.session_def();
    method.apply(def.contact);
    def.contact.damping = 0;
    def.max_contacts = 200000;
    session_.reset(h6CreateSession(loaded.model.get(), &def, nullptr));
  }
  explicit operator bool() const { return session_ != nullptr; }
  h6Contacts at(const h6Pose& pose) {
    const h6BodyState state{pose, {}};
    h6SetBody(session_.get(), 1, &state);
    h6DeviceSample sample{};
    h6DeviceCommand command{};
    h6Step(session_.get(), &sample, &command);
    return h6GetContacts(session_.get(), 1);
  }
  h6FrameReport report() const { return h6GetFrame(session_.get()); }

 private:
  SessionPtr session_;
};

io::Mesh plate(double from_x, double to_x) {
  return io::box_mesh({from_x, -40 * kMm, -12 * kMm}, {to_x, 40 * kMm, 0});
}

io::PointCloud bottom(int nu, int nv) {
  io::PointCloud cloud;
  io::add_face(cloud, {0, 0, -5 * kMm}, {10 * kMm, 0, 0}, {0, 10 * kMm, 0}, nu, nv, {0, 0, 1});
  return cloud;
}

// ---- net stiffness -----------------------------------------------------------------------------

// Largest eigenvalue of a symmetric 3 x 3 matrix: power iteration, shifted to be positive.
double largest_eigenvalue(const double (&A)[3][3]) {
  double shift = 0, v[3] = {0.48, 0.6, 0.64}, length = 0;
  for (const auto& row : A)
    for (const double a : row) shift += std::abs(a);
  if (shift == 0) return 0;
  for (int step = 0; step < 2000; ++step) {
    double w[3];
    for (int a = 0; a < 3; ++a)
      w[a] = A[a][0] * v[0] + A[a][1] * v[1] + A[a][2] * v[2] + shift * v[a];
    length = std::sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
    for (int a = 0; a < 3; ++a) v[a] = w[a] / length;
  }
  return length - shift;
}

// Of sum w N N^T: what the implicit step takes the stiffness for.
double frozen_stiffness(const h6Contacts& c) {
  double A[3][3] = {};
  for (std::size_t i = 0; i < c.count; ++i) {
    const double n[3] = {c.nx[i], c.ny[i], c.nz[i]};
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) A[a][b] += c.weight[i] * n[a] * n[b];
  }
  return largest_eigenvalue(A);
}

// Of the symmetric part of -dF/dx, by central differences over 0.02 voxel: what a hand feels.
double felt_stiffness(Probe& probe, const h6Pose& pose) {
  constexpr double kStep = 0.01 * kVoxel;
  double A[3][3], K[3][3];
  for (int b = 0; b < 3; ++b) {
    const h6Vec3 step = {b == 0 ? kStep : 0, b == 1 ? kStep : 0, b == 2 ? kStep : 0};
    const h6Vec3 more = elastic_wrench(probe.at({pose.p + step, pose.q}), 1).force;
    const h6Vec3 less = elastic_wrench(probe.at({pose.p - step, pose.q}), 1).force;
    const h6Vec3 d = (-0.5 / kStep) * (more - less);
    A[0][b] = d.x, A[1][b] = d.y, A[2][b] = d.z;
  }
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) K[a][b] = 0.5 * (A[a][b] + A[b][a]);
  return largest_eigenvalue(K);
}

constexpr double kDepth = 0.2 * kMm;  // every point of these shells is about so deep

io::PointCloud uneven_bottom() {  // 700 points on one half, 100 on the other
  io::PointCloud cloud;
  const h6Vec3 v = {0, 10 * kMm, 0}, half = {5 * kMm, 0, 0}, in = {0, 0, 1};
  io::add_face(cloud, {-5 * kMm, 0, -5 * kMm}, half, v, 20, 35, in);
  io::add_face(cloud, {5 * kMm, 0, -5 * kMm}, half, v, 10, 10, in);
  return cloud;
}

io::Mesh bowl() {
  std::vector<io::Ring> rings;
  for (int i = 0; i < 24; ++i)
    rings.push_back(
        {10 * kMm * std::cos(kPi / 2 * i / 24), -10 * kMm * std::sin(kPi / 2 * i / 24)});
  return io::block_with_cavity(20 * kMm, 20 * kMm, rings, -10 * kMm, 96);
}

io::PointCloud half_ball(int count) {  // along a spiral: equal areas
  io::PointCloud cloud;
  const double turn = kPi * (3 - std::sqrt(5.0)), radius = 10 * kMm + kDepth;
  for (int i = 0; i < count; ++i) {
    const double z = -(i + 0.5) / count, r = std::sqrt(1 - z * z);
    const h6Vec3 out = {r * std::cos(turn * i), r * std::sin(turn * i), z};
    io::add_shell_point(cloud, radius * out, -1.0 * out);
  }
  return cloud;
}

io::PointCloud cylinder(int around, int along) {
  io::PointCloud cloud;
  io::add_cylinder_side(cloud, 10 * kMm + kDepth, 12 * kMm, around, along);
  return cloud;
}

io::PointCloud cone(double spacing) {  // its tip down, 20 mm high, in a seat of the same angle
  io::PointCloud cloud;
  const double radius = 10 * kMm, height = 20 * kMm;
  const h6Vec3 down = {0, 0, -kDepth * std::hypot(radius, height) / radius};
  const int rows = static_cast<int>(std::lround(std::hypot(radius, height) / spacing));
  for (int i = 0; i < rows; ++i) {
    const double t = (i + 0.5) / rows, r = radius * t;
    const int count = std::max(1, static_cast<int>(std::lround(2 * kPi * r / spacing)));
    for (int j = 0; j < count; ++j) {
      const double angle = 2 * kPi * (j + 0.5 * (i % 2)) / count;
      const h6Vec3 out = {std::cos(angle), std::sin(angle), 0};
      const h6Vec3 normal = io::unit(height * out - radius * h6Vec3{0, 0, 1});
      io::add_shell_point(cloud, r * out + h6Vec3{0, 0, (t - 1) * height} + down, -1.0 * normal);
    }
  }
  return cloud;
}

}  // namespace

Study study_net_stiffness(const std::vector<MethodColumn>& columns, const Console& console) {
  Study out;
  out.title = "Net stiffness against sampling";
  out.about =
      "How much stiffer than one contact a whole patch is in translation, in k, all points about "
      "0.2 "
      "voxel deep. First the largest eigenvalue of Σ w N Nᵀ with the engine's shares w, then that "
      "of "
      "the force's true derivative, by central differences. For `series`, whose shares are secants "
      "of a joint solve, only the second says what the step uses, and its bound is c = 4. "
      "Prototype, "
      "by shares: hemisphere gauss3 100 / 1000, robust 100 / 662; tight cylinder 139 / 229 and 83 "
      "/ "
      "100; series at most 4 everywhere.";
  struct Patch {
    const char* name;
    io::Scene scene;
    h6Pose pose;
  };
  const h6Pose down = {{0, 0, 5 * kMm - kDepth}, {1, 0, 0, 0}}, here = {{0, 0, 0}, {1, 0, 0, 0}};
  const h6Pose in_hole = {{0, 0, -16 * kMm}, {1, 0, 0, 0}};
  const io::Mesh wall = plate(-40 * kMm, 40 * kMm);
  const io::Mesh hole = io::block_with_hole(20 * kMm, 40 * kMm, 10 * kMm, 32 * kMm, 128);
  const io::Mesh seat = io::block_with_cavity(20 * kMm, 30 * kMm,
                                              {{10 * kMm, 0}, {5 * kMm, -10 * kMm}}, -20 * kMm, 96);
  std::vector<Patch> patches;
  patches.push_back({"wall, 144", posed_scene("wall", wall, bottom(12, 12)), down});
  patches.push_back({"wall, 1600", posed_scene("wall", wall, bottom(40, 40)), down});
  patches.push_back({"wall, 800 uneven", posed_scene("wall", wall, uneven_bottom()), down});
  patches.push_back({"hemisphere, 300", posed_scene("bowl", bowl(), half_ball(300)), here});
  patches.push_back({"hemisphere, 3000", posed_scene("bowl", bowl(), half_ball(3000)), here});
  patches.push_back({"cylinder, 400", posed_scene("hole", hole, cylinder(20, 20)), in_hole});
  patches.push_back({"cylinder, 4000", posed_scene("hole", hole, cylinder(80, 50)), in_hole});
  patches.push_back({"cone seat, about 189", posed_scene("seat", seat, cone(1.95 * kMm)), here});
  patches.push_back({"cone seat, about 1437", posed_scene("seat", seat, cone(0.7 * kMm)), here});

  out.table = head("patch", columns);
  const std::vector<double> zeros(columns.size(), 0);
  std::vector<std::vector<double>> frozen(patches.size(), zeros), felt(patches.size(), zeros);
  std::vector<std::uint32_t> counts(patches.size(), 0);
  std::vector<std::function<void()>> jobs;
  for (std::size_t p = 0; p < patches.size(); ++p)
    jobs.push_back([&, p] {
      auto loaded = io::load_scene(patches[p].scene);
      if (!loaded) return;
      for (std::size_t m = 0; m < columns.size(); ++m)
        if (Probe probe(**loaded, columns[m]); probe) {
          frozen[p][m] = frozen_stiffness(probe.at(patches[p].pose));
          counts[p] = std::max(counts[p], static_cast<std::uint32_t>(probe.report().contacts));
          felt[p][m] = felt_stiffness(probe, patches[p].pose);
        }
    });
  run_jobs(jobs, console, "net stiffness");
  for (std::size_t p = 0; p < patches.size(); ++p) {
    out.table.push_back(
        {std::string(patches[p].name) + " (" + std::to_string(counts[p]) + " touch)"});
    out.json[patches[p].name]["contacts"] = counts[p];
    for (std::size_t m = 0; m < columns.size(); ++m) {
      const double a = frozen[p][m], b = felt[p][m];
      out.table.back().push_back(number(a, a < 20 ? 2 : 0) + " / " +
                                 number(b, std::abs(b) < 20 ? 2 : 0));
      out.json[patches[p].name][columns[m].name] = {{"shares", a}, {"derivative", b}};
    }
  }
  return out;
}

// ---- smoothness --------------------------------------------------------------------------------

Study study_smoothness(const std::vector<MethodColumn>& columns, const Console& console) {
  Study out;
  out.title = "Force smoothness";
  out.about =
      "Largest change of the contact force between two frames, in k·voxel, at h = 1 ms and 0.1 ms, "
      "on paths given in time: a box (400 points) that tilts from 0.05 rad to flat in 1 s, and one "
      "that slides off a plate's edge at 50 mm/s, 0.4 voxel deep. What is continuous shrinks "
      "tenfold, a jump does not. Prototype, slide-off: gauss3 .129 → .031, with depth weighting "
      ".021 → .0003.";
  auto flat = io::load_scene(posed_scene("flat", plate(-40 * kMm, 40 * kMm), bottom(20, 20)));
  auto edge = io::load_scene(posed_scene("edge", plate(-40 * kMm, 0), bottom(20, 20)));
  out.table = head("path", columns);
  if (!flat || !edge) return out;
  struct Way {
    const char* name;
    const io::LoadedScene* scene;
    double seconds;
    h6Pose (*at)(double t);
  };
  const Way ways[] = {{"tilt to flat", flat->get(), 1,
                       [](double t) {
                         const double a = 0.05 * (1 - t);
                         return h6Pose{{0, 0, 4.6 * kMm}, io::turn_by({0.5 * a, a, 0})};
                       }},
                      {"slide off an edge", edge->get(), 0.5, [](double t) {
                         return h6Pose{{-12.5 * kMm + 50 * kMm * t, 0, 4.6 * kMm}, {1, 0, 0, 0}};
                       }}};
  double found[2][2][64] = {};
  std::vector<std::function<void()>> jobs;
  for (int w = 0; w < 2; ++w)
    for (int fine = 0; fine < 2; ++fine)
      for (std::size_t m = 0; m < columns.size() && m < 64; ++m)
        jobs.push_back([&, w, fine, m] {
          Probe probe(*ways[w].scene, columns[m]);
          if (!probe) return;
          const int steps = static_cast<int>(ways[w].seconds * (fine ? 10000 : 1000));
          h6Vec3 last{};
          for (int i = 0; i <= steps; ++i) {
            const h6Pose pose = ways[w].at(ways[w].seconds * i / steps);
            const h6Vec3 f = elastic_wrench(probe.at(pose), 1 / kVoxel).force;
            if (i > 0) found[w][fine][m] = std::max(found[w][fine][m], io::length(f - last));
            last = f;
          }
        });
  run_jobs(jobs, console, "smoothness");
  for (int w = 0; w < 2; ++w) {
    out.table.push_back({ways[w].name});
    for (std::size_t m = 0; m < columns.size() && m < 64; ++m) {
      const double coarse = found[w][0][m], fine = found[w][1][m];
      out.table.back().push_back(number(coarse, 4) + " → " + number(fine, 4));
      out.json[ways[w].name][columns[m].name] = {{"1ms", coarse}, {"0.1ms", fine}};
    }
  }
  return out;
}

// ---- energy ------------------------------------------------------------------------------------

namespace {

// A closed cycle: down while tilted, flat while down, up while flat (or the other way round). Work
// done by the contacts, in peaks of the work done against them.
double cycle_work(const io::LoadedScene& loaded, const MethodColumn& method, bool reverse) {
  Probe probe(loaded, method);
  if (!probe) return 0;
  constexpr int kSteps = 3000;
  double work = 0, stored = 0;
  h6Wrench last{};
  h6Vec3 last_p{}, last_turn{};
  for (int i = 0; i <= kSteps; ++i) {
    const double u =
        reverse ? 1 - static_cast<double>(i) / kSteps : static_cast<double>(i) / kSteps;
    double z = 4.6, tilt = 0;
    if (u < 1.0 / 3)
      z = 5.8 - 3.6 * u, tilt = 0.05;  // at 5.8 mm nothing touches, tilted or not
    else if (u < 2.0 / 3)
      tilt = 0.05 * (2 - 3 * u);
    else
      z = 4.6 + 3.6 * (u - 2.0 / 3);
    const h6Vec3 p = {0, 0, z * kMm}, turn = {0.5 * tilt, tilt, 0};  // one axis: angles add up
    const h6Wrench f = elastic_wrench(probe.at({p, io::turn_by(turn)}), kStiffness);
    if (i > 0) {
      work += 0.5 * io::dot(f.force + last.force, p - last_p) +
              0.5 * io::dot(f.torque + last.torque, turn - last_turn);
      stored = std::max(stored, -work);
    }
    last = f, last_p = p, last_turn = turn;
  }
  return stored > 0 ? work / stored : 0;
}

// A tilted box falls 3 mm and bounces for 2 s: its highest energy, in its first.
double bounce_peak(const io::LoadedScene& loaded, const MethodColumn& method, double damping,
                   int integrator) {
  h6SessionDef def = loaded.session_def();
  method.apply(def.contact);
  def.contact.damping = damping;
  // The same net stiffness on the flat for all: those that add contacts up get a share.
  // (Points are 1 mm apart: no two are one cluster.)
  if (method.method == "none" || method.method == "cluster") def.contact.stiffness /= 400;
  if (def.contact.method == H6_METHOD_GLOBAL) def.contact.stiffness /= def.contact.global_n0;
  def.integrator = static_cast<h6Integrator>(integrator);
  def.gravity = {0, 0, -9.8};
  const SessionPtr session(h6CreateSession(loaded.model.get(), &def, nullptr));
  if (!session) return 0;
  const h6BodyState start{{{0, 0, 8.3 * kMm}, io::turn_by({0.03, 0.06, 0})}, {}};
  h6SetBody(session.get(), 1, &start);
  const h6BodyDef& body = def.bodies[1];
  const double first = body.mass * 9.8 * (start.pose.p.z - 5 * kMm);
  double most = 0;
  for (int i = 0; i < 2000; ++i) {
    h6DeviceSample sample{};
    h6DeviceCommand command{};
    h6Step(session.get(), &sample, &command);
    const h6BodyState state = h6GetBody(session.get(), 1);
    const h6Quat q = state.pose.q;
    const h6Vec3 w = io::rotate({q.w, -q.x, -q.y, -q.z}, state.velocity.angular);
    const double turning =
        body.inertia[0] * w.x * w.x + body.inertia[1] * w.y * w.y + body.inertia[2] * w.z * w.z;
    const double energy = 0.5 * body.mass * io::dot(state.velocity.linear, state.velocity.linear) +
                          0.5 * turning + body.mass * 9.8 * (state.pose.p.z - 5 * kMm);
    most = std::max(most, std::isfinite(energy) ? energy / first : 1e9);
  }
  return most;
}

}  // namespace

Study study_energy(const std::vector<MethodColumn>& columns, const Console& console) {
  Study out;
  out.title = "Energy";
  out.about =
      "A box with 400 points on a plane. Cycle: net work of the contacts over a closed cycle (down "
      "tilted, flat, up; and reversed), in peaks of the work stored; prototype: ±0.14 to ±0.76 for "
      "all scaled methods. Bounce: highest kinetic and potential energy of a free box that falls 3 "
      "mm and bounces for 2 s, in its first; above 1 energy was made. Contacts of equal net "
      "stiffness on the flat (`none` and `cluster` k/400, `global` k/n0).";
  auto flat = io::load_scene(posed_scene("flat", plate(-40 * kMm, 40 * kMm), bottom(20, 20)));
  out.table = head("path", columns);
  if (!flat) return out;
  struct Row {
    const char* name;
    std::function<double(const MethodColumn&)> value;
  };
  const io::LoadedScene& s = **flat;
  const std::vector<Row> rows = {
      {"cycle", [&](const MethodColumn& m) { return cycle_work(s, m, false); }},
      {"cycle reversed", [&](const MethodColumn& m) { return cycle_work(s, m, true); }},
      {"bounce, explicit, undamped",
       [&](const MethodColumn& m) { return bounce_peak(s, m, 0, H6_EXPLICIT); }},
      {"bounce, explicit, 0.1 ms",
       [&](const MethodColumn& m) { return bounce_peak(s, m, 1e-4, H6_EXPLICIT); }},
      {"bounce, implicit, undamped",
       [&](const MethodColumn& m) { return bounce_peak(s, m, 0, H6_IMPLICIT); }},
      {"bounce, implicit, 1 ms",
       [&](const MethodColumn& m) { return bounce_peak(s, m, 1e-3, H6_IMPLICIT); }}};
  std::vector<double> found(rows.size() * columns.size(), 0);
  std::vector<std::function<void()>> jobs;
  for (std::size_t r = 0; r < rows.size(); ++r)
    for (std::size_t m = 0; m < columns.size(); ++m)
      jobs.push_back([&, r, m] { found[r * columns.size() + m] = rows[r].value(columns[m]); });
  run_jobs(jobs, console, "energy");
  for (std::size_t r = 0; r < rows.size(); ++r) {
    out.table.push_back({rows[r].name});
    for (std::size_t m = 0; m < columns.size(); ++m) {
      const double value = found[r * columns.size() + m];
      out.table.back().push_back(value > 1e3 ? "> 1000" : number(value, 3));
      out.json[rows[r].name][columns[m].name] = value;
    }
  }
  return out;
}

// ---- time --------------------------------------------------------------------------------------

Study study_time(const std::vector<MethodColumn>& columns, const Console& console) {
  Study out;
  out.title = "Fig. 6: time against the number of contacts";
  out.about =
      "A flat patch of n points, all in contact, one thread: median time of finding them, of their "
      "weights, and of wrench, coupling and solve, in µs (collision / weights / system). –: the "
      "weights alone would take more than 2 s a frame. The paper: weights 25.6 % of the frame at "
      "n = 200, system 20 µs to 30 µs.";
  out.table = head("n", columns);
  const int sides[][2] = {{2, 5}, {10, 10}, {25, 40}, {100, 100}, {250, 400}};
  const io::Progress progress = console.progress();
  std::vector<double> per_contact2(columns.size(), 0);
  for (const auto& side : sides) {
    const int n = side[0] * side[1];
    out.table.push_back({std::to_string(n)});
    auto loaded =
        io::load_scene(posed_scene("patch", plate(-40 * kMm, 40 * kMm), bottom(side[0], side[1])));
    if (!loaded) continue;
    for (std::size_t m = 0; m < columns.size(); ++m) {
      if (interrupted.load()) return out;
      progress("times", static_cast<double>(out.table.size() - 2) / std::size(sides));
      Probe probe(**loaded, columns[m]);
      if (!probe || per_contact2[m] * n * n > 2e6) {
        out.table.back().push_back("–");
        continue;
      }
      std::vector<double> collision, weights, system;
      const int frames = n > 20000 ? 3 : n > 2000 ? 5 : 50;
      for (int i = 0; i < frames; ++i) {
        probe.at({{0, 0, 5 * kMm - kDepth}, {1, 0, 0, 0}});
        const h6FrameReport r = probe.report();
        collision.push_back(r.stage_us[H6_STAGE_TRAVERSE] + r.stage_us[H6_STAGE_CONTACTS]);
        weights.push_back(r.stage_us[H6_STAGE_WEIGHTS]);
        system.push_back(r.stage_us[H6_STAGE_WRENCH] + r.stage_us[H6_STAGE_COUPLING] +
                         r.stage_us[H6_STAGE_INTEGRATE]);
      }
      const auto median = [](std::vector<double>& v) {
        std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
        return v[v.size() / 2];
      };
      const double c = median(collision), w = median(weights), s = median(system);
      // Only what grows with the square can become too long.
      per_contact2[m] = n >= 1000 && w > 1e-4 * n * n ? w / (1.0 * n * n) : 0;
      out.table.back().push_back(number(c, c < 10 ? 1 : 0) + " / " + number(w, w < 10 ? 1 : 0) +
                                 " / " + number(s, s < 10 ? 1 : 0));
      out.json[std::to_string(n)][columns[m].name] = {
          {"collision_us", c}, {"weights_us", w}, {"system_us", s}};
    }
  }
  progress("times", 1);
  return out;
}

}  // namespace h6::cli
