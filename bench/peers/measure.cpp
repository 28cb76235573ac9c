// SPDX-License-Identifier: Apache-2.0
#include "bench/peers/measure.h"

#include <time.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bench/peers/exact.h"
#include "hapsix/vector.h"

namespace h6::peers {
namespace {

constexpr std::size_t kChunk = 200;  // poses of one peer before the next one has its turn
constexpr std::size_t kWarmUp = 8;   // poses before those, not timed
constexpr double kSlow = 8e-3;       // [s] a pose; slower peers get every eighth
constexpr std::size_t kStride = 8;
constexpr double kQuick = 5e-4;  // [s] a pose; only quicker peers have more than one round
constexpr int kRounds = 3;       // of fast peers
constexpr double kDoubt = 2e-3;  // [voxel] samples of 16 bits may differ from floats
constexpr double kDeep = 0.05;   // [voxel] contacts this deep must be found

using Poses = std::vector<h6Pose>;

// CPU time of this thread: other work on the machine interrupts long poses more often than short
// ones, which would flatter the quick [s].
double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double timed(Peer& peer, const h6Pose& pose) {
  const double begin = cpu_seconds();
  peer.meet(pose);
  return cpu_seconds() - begin;
}

struct Runner {
  std::unique_ptr<Peer> peer;
  std::size_t stride = 1;
  int rounds = 1;
  std::vector<double> path, shuffled, path_search, shuffled_search;  // [us]
};

// Whether both found the same points, apart from those so near to the surface that rounding
// decides.
bool same_points(const Task& task, const h6Pose& pose, const Peer& engine, const Peer& brute) {
  std::vector<int> count(task.points.size());
  for (const std::uint32_t i : *engine.inside()) ++count[i];
  for (const std::uint32_t i : *brute.inside()) count[i] += 2;
  std::vector<double> at, distance;
  for (std::size_t i = 0; i < count.size(); ++i) {
    if (count[i] == 0 || count[i] == 3) continue;
    const h6Vec3 p = place(pose, task.points[i]);
    at.insert(at.end(), {p.x, p.y, p.z});
  }
  distance.resize(at.size() / 3);
  h6SampleField(task.scene->model.get(), task.scene->bodies[0].field, at.data(), distance.size(),
                distance.data(), nullptr, nullptr);
  return std::all_of(distance.begin(), distance.end(),
                     [&](double d) { return std::fabs(d) <= kDoubt * task.field.voxel_size; });
}

Outcome contacts_are_right(const Task& task, Peer& engine, Peer& brute, std::size_t* compared) {
  for (const Poses* poses : {&task.path, &task.shuffled})
    for (std::size_t i = 0; i < poses->size(); ++i, ++*compared) {
      const h6Pose& pose = (*poses)[i];
      engine.meet(pose), brute.meet(pose);
      if (!same_points(task, pose, engine, brute))
        return Failure{task.name + ", pose " + std::to_string(i) +
                       ": the engine's contacts are not those of brute force"};
    }
  return Done{};
}

// Every peer in turn on a few poses, so that all get the machine at the same speed.
void time_all(std::vector<Runner>& runners, const Poses& poses, bool path,
              const io::Progress& progress) {
  for (std::size_t from = 0; from < poses.size(); from += kChunk)
    for (Runner& r : runners) {
      progress(path ? "path order" : "random order",
               static_cast<double>(from) / static_cast<double>(poses.size()));
      for (int round = 0; round < r.rounds; ++round) {
        for (std::size_t i = from < kWarmUp ? 0 : from - kWarmUp; i < from; i += r.stride)
          r.peer->meet(poses[i]);
        for (std::size_t i = from; i < std::min(poses.size(), from + kChunk); i += r.stride) {
          (path ? r.path : r.shuffled).push_back(1e6 * timed(*r.peer, poses[i]));
          if (r.peer->search_seconds() >= 0)
            (path ? r.path_search : r.shuffled_search).push_back(1e6 * r.peer->search_seconds());
        }
      }
    }
}

double degrees(const h6Vec3& a, const h6Vec3& b) {
  return 180 / std::numbers::pi * std::acos(std::clamp(dot(a, b), -1.0, 1.0));
}

// What a peer found at poses in path order, against the truth on its surface.
void compare(const Task& task, const std::vector<Summary>& found, const std::vector<Summary>& truth,
             std::size_t stride, Row& row) {
  const double voxel = task.field.voxel_size;
  std::vector<double> contacts, depth, direction, depth_change, direction_change;
  double missed = 0, deep = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    contacts.push_back(static_cast<double>(found[i].contacts));
    const Summary& exact = truth[i * stride];
    if (exact.deepest > kDeep * voxel) ++deep, missed += found[i].contacts == 0;
    if (exact.contacts > 0 && found[i].contacts > 0) {
      depth.push_back(std::fabs(found[i].deepest - exact.deepest) / voxel);
      direction.push_back(degrees(found[i].push, exact.push));
    }
    if (stride > 1 || i == 0) continue;
    depth_change.push_back(std::fabs(found[i].deepest - found[i - 1].deepest) / voxel);
    if (found[i].contacts > 0 && found[i - 1].contacts > 0)
      direction_change.push_back(degrees(found[i].push, found[i - 1].push));
  }
  row.poses = found.size();
  row.contacts = quantiles(contacts).p50;
  row.depth = quantiles(depth), row.direction = quantiles(direction);
  row.missed = deep > 0 ? missed / deep : 0;
  row.depth_change = quantiles(depth_change), row.direction_change = quantiles(direction_change);
}

std::vector<Summary> findings(const Task& task, Peer& peer, std::size_t stride) {
  std::vector<Summary> out;
  std::vector<Contact> contacts;
  for (std::size_t i = 0; i < task.path.size(); i += stride) {
    peer.meet(task.path[i]);
    peer.contacts(contacts);
    out.push_back(sum_up(contacts));
  }
  return out;
}

}  // namespace

Quantiles quantiles(std::vector<double> v) {
  if (v.empty()) return {};
  std::sort(v.begin(), v.end());
  const auto at = [&](double p) { return v[static_cast<std::size_t>(p * double(v.size() - 1))]; };
  return {at(0.5), at(0.99)};
}

Result<TaskReport> measure(const Task& task, const io::Progress& progress) {
  TaskReport out;
  out.name = task.name, out.about = task.about;
  out.part_triangles = task.part.triangles.size();
  out.obstacle_triangles = task.obstacle.triangles.size();
  out.points = task.points.size();
  out.voxel = task.field.voxel_size, out.offset = task.field.offset;

  std::vector<Runner> runners;
  for (const auto make : {make_engine, make_ode, make_fcl, make_bullet, make_nanovdb, make_openvdb,
                          make_reference, make_embree}) {
    Runner& r = runners.emplace_back();
    r.peer = make(task);
  }
  Peer& brute = *runners[5].peer;
  progress("contacts", 0);
  if (Outcome right = contacts_are_right(task, *runners[0].peer, brute, &out.compared); !right)
    return right.failure();
  for (Runner& r : runners) {
    r.peer->meet(task.path[0]);
    const double took = timed(*r.peer, task.path[task.path.size() / 2]);
    if (took > kSlow) r.stride = kStride;
    if (took < kQuick) r.rounds = kRounds;
  }
  time_all(runners, task.path, true, progress);
  time_all(runners, task.shuffled, false, progress);

  progress("truth", 0);
  const Exact exact(task);
  std::vector<Summary> on_field, on_triangles;
  std::vector<Contact> sampled;
  for (const h6Pose& pose : task.path) {
    brute.meet(pose);
    brute.contacts(sampled);
    const Exact::Truth truth = exact.at(pose, *brute.inside(), sampled);
    on_field.push_back(truth.on_field), on_triangles.push_back(truth.on_triangles);
  }
  for (Runner& r : runners) {
    progress(r.peer->name(), 0);
    Row& row = out.rows.emplace_back();
    row.peer = r.peer->name();
    row.path = quantiles(r.path), row.shuffled = quantiles(r.shuffled);
    compare(task, findings(task, *r.peer, r.stride), r.peer->on_field() ? on_field : on_triangles,
            r.stride, row);
    if (r.path_search.empty()) continue;
    Row search = row;
    search.peer = "hapsix, its search alone";
    search.path = quantiles(r.path_search), search.shuffled = quantiles(r.shuffled_search);
    out.rows.push_back(search);
  }
  for (const bool field : {true, false}) {
    Row& row = out.truth.emplace_back();
    row.peer = field ? "exact, field's surface" : "exact, triangles";
    const std::vector<Summary>& truth = field ? on_field : on_triangles;
    compare(task, truth, truth, 1, row);
  }
  return out;
}

}  // namespace h6::peers
