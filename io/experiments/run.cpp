// SPDX-License-Identifier: Apache-2.0
#include "io/experiments/run.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "hapsix/vector.h"
#include "io/console/checks.h"
#include "io/record/recording.h"

namespace h6::cli {
namespace {

// Applies the changes to the scene's definitions and opens the run.
Outcome open(const RunChange& change, RunSetup& run) {
  for (h6HandDef& hand : run.hand_defs) {
    h6CouplingDef& c = hand.coupling;
    c.stiffness *= change.force, c.rotational_stiffness *= change.force;
    c.max_depth_voxels *= change.force;  // a max_force of 0 derives its bound from this
    if (change.max_force >= 0) c.max_force = change.max_force;
    c.max_force *= change.force, c.max_torque *= change.force;
  }
  change.method.apply(run.def.contact);
  if (change.stiffness > 0) run.def.contact.stiffness = change.stiffness;
  if (change.damping >= 0) run.def.contact.damping = change.damping;
  if (change.integrator >= 0) run.def.integrator = static_cast<h6Integrator>(change.integrator);
  if (change.rate > 0) run.def.rate = change.rate;
  if (change.also)
    for (h6HandDef& hand : run.hand_defs) change.also(run.def, hand);
  for (io::SceneHand& hand : run.hands) {
    hand.device = change.device;
    if (change.arm) hand.arm = change.arm;
  }
  if (change.path) run.hands[0].path = *change.path;
  run.record = change.record;
  return run.open();
}

// Whether the rule takes r x N made unit, without a bound on its length.
bool bare_torque_directions(const h6ContactDef& c) {
  return c.method == H6_METHOD_GAUSS6 && c.torque_length == 0 && !(c.pieces & H6_PIECE_HANDLES);
}

// Whether some r x N is so short that the rounding of r and N turns it by a twentieth of the hat's
// width: the weights, and all that follows, then differ from one processor to the next.
bool has_torque_noise(const h6Contacts& c) {
  for (std::size_t i = 0; i < c.count; ++i) {
    const h6Vec3 r = {c.rx[i], c.ry[i], c.rz[i]}, n = {c.nx[i], c.ny[i], c.nz[i]};
    if (norm(cross(r, n)) < 1e-4 * norm(r)) return true;
  }
  return false;
}

// Remembers where the deepest contact was.
class DeepestWatch {
 public:
  DeepestWatch(const io::LoadedScene& loaded, int body) : loaded_(loaded), body_(body) {}
  // `contacts` are those of the step from `before`.
  void frame(const h6Session* session, const h6Contacts& c, const h6Pose& before) {
    const auto deepest = std::max_element(c.depth, c.depth + c.count) - c.depth;
    const auto i = static_cast<std::size_t>(deepest);
    if (c.count == 0 || !(static_cast<double>(c.depth[i]) > out_.depth)) return;
    out_.depth = static_cast<double>(c.depth[i]);
    out_.point = c.point[i];
    field_body_ = c.field_body[i];
    const h6Pose field = h6GetBody(session, field_body_).pose;
    const auto shell =
        static_cast<std::size_t>(loaded_.bodies[static_cast<std::size_t>(body_)].shell);
    const h6Vec3 p = place(before, loaded_.shell_points[shell][out_.point]);
    place_ = rotate(conjugate(field.q), p - field.p);
  }
  Deepest found() const {
    Deepest out = out_;
    if (!(out.depth > 0)) return out;
    const auto body = static_cast<std::size_t>(field_body_);
    out.obstacle = loaded_.scene.bodies[body].name;
    const auto& mesh = loaded_.field_meshes[static_cast<std::size_t>(loaded_.bodies[body].field)];
    if (!mesh || !mesh->rays()) return out;
    out.triangle = (*mesh->rays())->nearest(place_).triangle;
    const io::Mesh& m = mesh->mesh();
    if (out.triangle < m.part.size() && m.part[out.triangle] >= 0)
      out.part = m.part_names[static_cast<std::size_t>(m.part[out.triangle])];
    return out;
  }

 private:
  const io::LoadedScene& loaded_;
  int body_, field_body_ = 0;
  Deepest out_;
  h6Vec3 place_{};  // of the deepest point, field's mesh frame [m]
};

}  // namespace

void MethodColumn::apply(h6ContactDef& contact) const {
  h6MethodFromName(method.c_str(), &contact.method, &contact.pieces);
  if (global_n0 > 0) contact.global_n0 = global_n0;
}

std::vector<MethodColumn> method_columns() {
  std::vector<MethodColumn> out;
  for (int i = 0; i < H6_METHOD_COUNT; ++i) {
    const std::string name = h6MethodName(static_cast<h6Method>(i));
    out.push_back({name, name, 0});
    if (name == "global") out.push_back({"global/1", name, 1});
    if (name == "gauss3" || name == "gauss6")
      out.push_back({name + "+facing", name + "+facing", 0});
  }
  return out;
}

Result<std::vector<MethodColumn>> columns_named(const std::string& list) {
  const std::vector<MethodColumn> known = method_columns();
  if (list.empty()) return known;
  std::vector<std::string> names;
  for (const MethodColumn& column : known) names.push_back(column.name);
  std::vector<MethodColumn> out;
  std::stringstream in(list);
  for (std::string name; std::getline(in, name, ',');) {
    if (name.empty()) continue;
    const auto same = [&](const MethodColumn& column) { return column.name == name; };
    if (std::any_of(out.begin(), out.end(), same)) continue;
    const auto found = std::find_if(known.begin(), known.end(), same);
    if (found != known.end())
      out.push_back(*found);
    else if (h6MethodFromName(name.c_str(), nullptr, nullptr) == 0)
      out.push_back({name, name, 0});  // a method with other pieces
    else
      return Failure{no_such("method", name, names)};
  }
  if (out.empty()) return Failure{"'" + list + "' names no method"};
  return out;
}

h6Wrench elastic_wrench(const h6Contacts& c, double stiffness) {
  h6Wrench out{};
  for (std::size_t i = 0; i < c.count; ++i) {
    const double s = stiffness * c.load[i];
    const h6Vec3 f = {s * c.nx[i], s * c.ny[i], s * c.nz[i]};
    out.force.x += f.x, out.force.y += f.y, out.force.z += f.z;
    out.torque.x += c.ry[i] * f.z - c.rz[i] * f.y;
    out.torque.y += c.rz[i] * f.x - c.rx[i] * f.z;
    out.torque.z += c.rx[i] * f.y - c.ry[i] * f.x;
  }
  return out;
}

RunFigures run_experiment(const io::LoadedScene& loaded, const RunChange& change) {
  RunFigures out;
  RunSetup run(loaded);
  if (Outcome opened = open(change, run); !opened) return out.error = opened.error(), out;
  const h6SessionDef& def = run.def;
  io::Recorder* recorder = run.recorder.get();
  const h6HandDef& first = run.hand_defs[0];
  const bool has_shell = loaded.bodies[static_cast<std::size_t>(first.body)].shell >= 0;

  const bool bare = bare_torque_directions(def.contact);
  DeepestWatch deepest(loaded, first.body);

  const double duration = change.path ? change.path->back().t : loaded.duration();
  RunTally tally(loaded, def.rate, duration);
  const auto frames = static_cast<std::uint64_t>(duration * def.rate + 0.5);
  const std::vector<io::RecordedBend> bends = recorded_bends(loaded);
  std::vector<h6FrameRecord> rows;
  std::vector<double> q;  // of `rows`
  for (std::uint64_t i = 0; i < frames && !interrupted.load(); ++i) {
    h6FrameRecord& r = rows.emplace_back();
    r = {};
    r.time = static_cast<double>(i) * (1 / def.rate);  // as the haptic loop counts
    const h6Pose before = h6GetBody(run.session.get(), first.body).pose;
    if (Outcome done = run.step(r); !done) return out.error = done.error(), out;
    const h6Contacts contacts =
        has_shell ? h6GetContacts(run.session.get(), first.body) : h6Contacts{};
    out.torque_noise = out.torque_noise || (bare && has_torque_noise(contacts));
    deepest.frame(run.session.get(), contacts, before);
    tally.frame(r, elastic_wrench(contacts, def.contact.stiffness).force);
    if (change.each) change.each(r, contacts);
    append_bends(run.session.get(), bends, q);
    if (recorder && rows.size() < 100) continue;
    if (recorder)
      if (Outcome done = recorder->frames(rows.data(), rows.size(), q.data()); !done)
        return out.error = done.error(), out;
    rows.clear(), q.clear();
  }
  static_cast<RunTotals&>(out) = tally.totals();
  out.frame_us_p50 = tally.times().frame_us.percentile(50);
  out.frame_us_p99 = tally.times().frame_us.percentile(99);
  for (std::size_t s = 0; s < H6_STAGE_COUNT; ++s)
    out.stage_us_p50[s] = tally.times().stage_us[s].percentile(50);
  out.deepest = deepest.found();
  if (recorder) {
    Outcome done = recorder->frames(rows.data(), rows.size(), q.data());
    const nlohmann::ordered_json summary{{"method", change.method.name},
                                         {"verdict", io::verdict_name(out.verdict)},
                                         {"max_depth_voxels", out.max_depth_voxels}};
    if (done) done = recorder->finish(summary.dump());
    if (!done) out.error = done.error();
  }
  return out;
}

void run_jobs(const std::vector<std::function<void()>>& jobs, const Console& console,
              const std::string& label, int threads) {
  std::atomic<std::size_t> next{0}, done{0};
  std::exception_ptr thrown;  // for instance std::bad_alloc; rethrown on the caller's thread
  std::mutex lock;
  const auto work = [&] {
    for (std::size_t i; !interrupted.load() && (i = next.fetch_add(1)) < jobs.size();) {
      try {
        jobs[i]();
      } catch (...) {
        const std::lock_guard<std::mutex> hold(lock);
        if (!thrown) thrown = std::current_exception();
        next.store(jobs.size());
        done.store(jobs.size());
      }
      done.fetch_add(1);
    }
  };
  std::vector<std::thread> workers;
  for (int i = 0; i < threads; ++i) workers.emplace_back(work);
  const io::Progress progress = console.progress();
  const double count = static_cast<double>(std::max<std::size_t>(1, jobs.size()));
  while (done.load() < jobs.size() && !interrupted.load()) {
    progress(label, 0.999 * static_cast<double>(done.load()) / count);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  for (std::thread& worker : workers) worker.join();
  progress(label, 1);
  if (thrown) std::rethrow_exception(thrown);
}

}  // namespace h6::cli
