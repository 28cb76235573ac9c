// SPDX-License-Identifier: Apache-2.0
#include "io/run/through_watch.h"

#include <algorithm>
#include <cstdio>

#include "hapsix/vector.h"

namespace h6::cli {
namespace {

constexpr std::size_t kMostMoments = 1 << 19;  // 70 MB

// The shell's pose in the field's frame.
h6Pose relative(const h6Pose& shell, const h6Pose& field) {
  const h6Quat back = conjugate(field.q);
  return {rotate(back, shell.p - field.p), product(back, shell.q)};
}

bool finite(const h6Pose& pose) {
  const h6Vec3& p = pose.p;
  const h6Quat& q = pose.q;
  return std::isfinite(p.x + p.y + p.z + q.w + q.x + q.y + q.z);
}

}  // namespace

ThroughWatch::ThroughWatch(const io::LoadedScene& loaded) : loaded_(loaded) {
  const std::vector<h6BodyDef>& bodies = loaded.bodies;
  for (std::size_t a = 0; a < bodies.size(); ++a)
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      if (a == b || bodies[a].fixed || bodies[a].shell < 0 || bodies[b].field < 0) continue;
      // Of two moving bodies the engine takes the shell of the first.
      if (b < a && !bodies[b].fixed && bodies[b].shell >= 0 && bodies[a].field >= 0) continue;
      add_pair(a, b);
    }
}

ThroughWatch::Moves ThroughWatch::moves(std::size_t body, int& hand) const {
  hand = -1;
  if (loaded_.bodies[body].fixed) return Moves::fixed;
  for (std::size_t h = 0; h < loaded_.hands.size() && hand < 0; ++h)
    if (loaded_.hands[h].body == static_cast<int>(body)) hand = static_cast<int>(h);
  return hand < 0 ? Moves::alone : Moves::with_hand;
}

std::string ThroughWatch::not_computed(std::size_t shell, std::size_t field,
                                       const std::string& why) const {
  return "whether '" + loaded_.scene.bodies[shell].name + "' passed through '" +
         loaded_.scene.bodies[field].name + "' was not computed: " + why;
}

void ThroughWatch::add_pair(std::size_t a, std::size_t b) {
  const auto name = [&](std::size_t body) { return "'" + loaded_.scene.bodies[body].name + "'"; };
  const auto left_out = [&](const std::string& why) {
    left_out_.push_back(not_computed(a, b, why));
  };
  int shell_hand, field_hand;
  for (const auto& [body, hand] : {std::pair{a, &shell_hand}, std::pair{b, &field_hand}})
    if (moves(body, *hand) == Moves::alone)
      return left_out(name(body) + " moves without a hand, so a run does not keep its poses");
  const auto field = static_cast<std::size_t>(loaded_.bodies[b].field);
  if (!loaded_.field_meshes[field]) return left_out("its field is a file and names no mesh");
  const io::FieldMesh& mesh = *loaded_.field_meshes[field];
  const double voxel = loaded_.field_voxels[field];
  const auto& points = loaded_.shell_points[static_cast<std::size_t>(loaded_.bodies[a].shell)];
  io::PopThroughSearch search(loaded_.model.get(), loaded_.bodies[b].field, voxel, mesh, points);
  const double step = search.step();
  pairs_.push_back({a, b, shell_hand, field_hand, voxel, step, std::move(search), {}});
}

void ThroughWatch::frame(const h6FrameRecord& r) {
  for (Pair& pair : pairs_) {
    const auto pose = [&](std::size_t body, int hand) {
      return hand < 0 ? loaded_.bodies[body].pose : r.body[hand].pose;
    };
    const Moment now = {r.report.frame, r.time, pose(pair.shell, pair.shell_hand),
                        pose(pair.field, pair.field_hand)};
    if (!finite(now.shell) || !finite(now.field)) continue;
    if (!pair.moments.empty()) {
      const Moment& last = pair.moments.back();
      if (pair.search.motion(relative(last.shell, last.field), relative(now.shell, now.field)) <
          pair.step)
        continue;
    }
    if (pair.moments.size() == kMostMoments) {
      for (std::size_t i = 0; i < kMostMoments / 2; ++i) pair.moments[i] = pair.moments[2 * i];
      pair.moments.resize(kMostMoments / 2);
      pair.step *= 2;
    }
    pair.moments.push_back(now);
  }
}

// Judges a copy of the pair, so that a run may be judged while it goes on.
Result<std::optional<PopThrough>> ThroughWatch::judge(Pair pair,
                                                      const io::Progress& progress) const {
  const std::vector<Moment>& moments = pair.moments;
  for (std::size_t i = 0; i < moments.size(); ++i) {
    if (progress && i % 64 == 0 &&
        !progress("looking for points that passed through",
                  static_cast<double>(i) / static_cast<double>(moments.size())))
      return Failure{"interrupted"};
    const auto seen = pair.search.look(relative(moments[i].shell, moments[i].field));
    if (!seen) return seen.failure();
    if (!*seen) continue;
    const io::PoppedPoint& popped = **seen;
    const Moment& crossed = moments[popped.crossed];
    PopThrough found;
    found.frame = crossed.frame, found.time = crossed.time, found.free_time = moments[i].time;
    found.body = loaded_.scene.bodies[pair.shell].name;
    found.obstacle = loaded_.scene.bodies[pair.field].name;
    found.point = popped.point, found.triangle = popped.triangle;
    const io::Mesh& mesh =
        loaded_.field_meshes[static_cast<std::size_t>(loaded_.bodies[pair.field].field)]->mesh();
    if (!mesh.part.empty() && mesh.part[popped.triangle] >= 0)
      found.part = mesh.part_names[static_cast<std::size_t>(mesh.part[popped.triangle])];
    found.place = place(crossed.field, popped.place);
    return std::optional<PopThrough>(found);
  }
  return std::optional<PopThrough>();
}

PopThroughReport ThroughWatch::judge(const io::Progress& progress) const {
  PopThroughReport out;
  out.left_out = left_out_;
  const io::Progress asked = [&](const std::string& what, double done) {
    out.interrupted = out.interrupted || (progress && !progress(what, done));
    return !out.interrupted;
  };
  for (const Pair& pair : pairs_) {
    const auto found = judge(pair, asked);
    if (!found)
      out.left_out.push_back(not_computed(pair.shell, pair.field, found.error()));
    else if (*found && (!out.first || (*found)->free_time < out.first->free_time))
      out.first = *found;
  }
  if (out.interrupted) {  // half a search would say something else each time
    out.first.reset(), out.left_out = left_out_;
    for (const Pair& pair : pairs_)
      out.left_out.push_back(not_computed(pair.shell, pair.field, "interrupted"));
    return out;
  }
  if (progress && !pairs_.empty()) progress("looking for points that passed through", 1);
  return out;
}

std::string sentence(const PopThrough& p) {
  char at[200];
  std::snprintf(at, sizeof at,
                "at %.3f s (frame %llu) point %u of '%.60s' passed through triangle %u", p.time,
                static_cast<unsigned long long>(p.frame), p.point, p.body.c_str(), p.triangle);
  const std::string part = p.part.empty() || p.part == p.obstacle ? "" : " (" + p.part + ")";
  char end[80];
  std::snprintf(end, sizeof end, " and was free behind it at %.3f s", p.free_time);
  return at + (" of '" + p.obstacle + "'") + part + end;
}

}  // namespace h6::cli
