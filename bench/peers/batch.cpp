// SPDX-License-Identifier: Apache-2.0
#include "bench/peers/batch.h"

#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>

#include "bench/peers/peer.h"
#include "hapsix/batch.h"
#include "io/scenes/industrial/shapes.h"
#include "io/scenes/scenes.h"
#include "sched/clock.h"

namespace h6::peers {
namespace {

constexpr double kOut = 6e-3;  // the peg is 9 mm deep in its hole [m]
constexpr int kSettled = 400;  // frames
constexpr int kTurns = 5;      // of all peers; the best of each counts
constexpr std::size_t kCounts[] = {1, 64, 1024, 16384};

using SessionOf = std::unique_ptr<h6Session, void (*)(h6Session*)>;
using WorkersOf = std::unique_ptr<h6Workers, void (*)(h6Workers*)>;

h6Pose hand(double share, int frame) {
  const double y = 2e-5 * std::sin(0.03 * frame + 6 * share);
  return {{(7e-3 + 1e-3 * share) * std::min(1.0, frame / 200.0), y, kOut}, {1, 0, 0, 0}};
}

// The peg that peg-in-hole samples by 60 x 40 cells and a bottom, as triangles of that size.
io::Mesh peg_mesh() {
  std::vector<io::industrial::Line> rings;
  for (int j = 0; j <= 40; ++j) {
    rings.emplace_back();
    for (int i = 0; i < 60; ++i) {
      const double angle = 2 * 3.14159265358979323846 * i / 60;
      rings.back().push_back(
          {10e-3 * std::cos(angle), 10e-3 * std::sin(angle), 15e-3 * (j / 20.0 - 1)});
    }
  }
  const io::industrial::Piece piece = io::industrial::loft(rings, io::industrial::Ends::capped);
  io::Mesh mesh;
  mesh.vertices = piece.points;
  mesh.triangles.assign(piece.triangles.begin(), piece.triangles.end());
  return mesh;
}

// The engine's sessions on some threads.
class Crowd {
 public:
  Crowd(const io::LoadedScene& scene, std::size_t count, unsigned threads)
      : workers_(make_workers(threads)), pose_(count), contacts(count), body(count) {
    h6SessionDef def = scene.session_def();
    std::vector<h6BodyDef> bodies(def.bodies, def.bodies + def.body_count);
    bodies[1].pose.p.z = kOut;
    def.bodies = bodies.data(), def.max_contacts = 1000, def.workers = workers_.get();
    for (std::size_t i = 0; i < count; ++i) {
      sessions_.emplace_back(h6CreateSession(scene.model.get(), &def, nullptr), h6DestroySession);
      handles_.push_back(sessions_.back().get());
    }
    arrays_.sessions = handles_.data(), arrays_.count = count, arrays_.pose = pose_.data();
    arrays_.body = body.data(), arrays_.contacts = contacts.data();
    while (frame_ < kSettled) step();
  }
  double step() {  // [s]
    for (std::size_t i = 0; i < pose_.size(); ++i)
      pose_[i] = hand(static_cast<double>(i) / static_cast<double>(pose_.size()), frame_);
    ++frame_;
    const std::int64_t start = sched::now_ns();
    h6StepMany(workers_.get(), &arrays_);
    return 1e-9 * static_cast<double>(sched::now_ns() - start);
  }

 private:
  static WorkersOf make_workers(unsigned threads) {
    h6WorkersDef def = h6DefaultWorkersDef();
    def.threads = threads;
    return {h6CreateWorkers(&def, nullptr), h6DestroyWorkers};
  }
  WorkersOf workers_;
  std::vector<SessionOf> sessions_;
  std::vector<h6Session*> handles_;
  std::vector<h6Pose> pose_;
  h6StepArrays arrays_ = h6DefaultStepArrays();
  int frame_ = 0;

 public:
  std::vector<std::uint32_t> contacts;
  std::vector<h6BodyState> body;
};

using Make = std::unique_ptr<Peer> (*)(const Task&);

// A peer for each process, each with its share of the sessions: Debian's ODE is built without
// mt_collisions, so two threads of one process would share its caches. Returns poses a second.
double meet_all(const std::vector<std::unique_ptr<Peer>>& peers, unsigned processes,
                const std::vector<h6BodyState>& body, std::size_t rounds) {
  void* const shared = mmap(nullptr, processes * sizeof(double), PROT_READ | PROT_WRITE,
                            MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (shared == MAP_FAILED) return 0;
  double* const took = static_cast<double*>(shared);
  const auto work = [&](unsigned t) {
    const std::size_t begin = body.size() * t / processes, end = body.size() * (t + 1) / processes;
    const std::int64_t start = sched::now_ns();
    for (std::size_t round = 0; round < rounds; ++round)
      for (std::size_t i = begin; i < end; ++i) peers[t]->meet(body[i].pose);
    took[t] = 1e-9 * static_cast<double>(sched::now_ns() - start);
  };
  std::vector<pid_t> others;
  for (unsigned t = 1; t < processes; ++t) {
    others.push_back(fork());
    if (others.back() == 0) work(t), _exit(0);
  }
  work(0);
  bool all = true;
  for (const pid_t other : others) {
    int status = 1;
    all = waitpid(other, &status, 0) == other && status == 0 && all;
  }
  const double longest = *std::max_element(took, took + processes);
  munmap(shared, processes * sizeof(double));
  return all ? static_cast<double>(rounds * body.size()) / longest : 0;
}

double contacts_of(Peer& peer, const std::vector<h6BodyState>& body) {
  std::vector<Contact> all;
  double sum = 0;
  const std::size_t step = std::max<std::size_t>(1, body.size() / 64);
  std::size_t asked = 0;
  for (std::size_t i = 0; i < body.size(); i += step, ++asked) {
    peer.meet(body[i].pose);
    peer.contacts(all);
    sum += static_cast<double>(all.size());
  }
  return sum / static_cast<double>(asked);
}

}  // namespace

Result<std::vector<BatchRow>> compare_batches(const io::Progress& progress) {
  auto scene = io::load_scene(*io::make_scene("peg-in-hole"));
  if (!scene) return scene.failure();
  Task task;
  task.obstacle = io::weld(*(*scene)->scene.bodies[0].field->mesh_data);
  task.part = peg_mesh();
  std::vector<std::vector<std::unique_ptr<Peer>>> peers;
  for (const Make make : {Make(make_ode), Make(make_bullet)}) {
    peers.emplace_back();
    for (int t = 0; t < 2; ++t) peers.back().push_back(make(task));
  }
  std::vector<BatchRow> rows;
  double done = 0;
  for (const std::size_t count : kCounts) {
    Crowd one(**scene, count, 1), two(**scene, count, 2);
    BatchRow ours{"hapsix, whole step", count, {0, 0}, 0};
    std::vector<BatchRow> theirs;
    for (const auto& peer : peers)
      theirs.push_back({peer[0]->name(), count, {0, 0}, contacts_of(*peer[0], one.body)});
    for (int turn = 0; turn < kTurns; ++turn) {
      const std::size_t steps = std::max<std::size_t>(1, 20000 / count);
      for (Crowd* crowd : {&one, &two}) {
        double took = 0;
        for (std::size_t i = 0; i < steps; ++i) took += crowd->step();
        double& best = ours.per_second[crowd == &two];
        best = std::max(best, static_cast<double>(steps * count) / took);
      }
      for (std::size_t k = 0; k < peers.size(); ++k)
        for (const unsigned cores : {1u, 2u}) {
          const std::vector<h6BodyState> some(one.body.begin(),
                                              one.body.begin() + std::min<long>(count, 1024));
          double& best = theirs[k].per_second[cores - 1];
          // A session has no part of its own for two processes to share.
          const unsigned used = std::min<unsigned>(cores, static_cast<unsigned>(some.size()));
          best = std::max(
              best, meet_all(peers[k], used, some, std::max<std::size_t>(1, 256 / some.size())));
        }
      progress("batch", done += 1.0 / (kTurns * std::size(kCounts)));
    }
    for (const std::uint32_t c : one.contacts)
      ours.contacts += static_cast<double>(c) / static_cast<double>(count);
    rows.push_back(ours);
    rows.insert(rows.end(), theirs.begin(), theirs.end());
  }
  return rows;
}

}  // namespace h6::peers
