// SPDX-License-Identifier: Apache-2.0
// loops.cpp - the net work of the contacts over random closed loops.
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>

#include "io/experiments/probe.h"

namespace h6::cli {
namespace {

constexpr int kLoopSteps = 3000, kWaves = 3;
constexpr double kLoopTurn = 0.03;  // size of the turns [rad]

// Motion along the six directions: a random Fourier series of three waves in each.
class Loop {
 public:
  // `size`: of the translations [m].
  Loop(std::size_t index, const h6Vec3& size) {
    std::mt19937_64 engine(index + 1);
    const double most[6] = {size.x, size.y, size.z, kLoopTurn, kLoopTurn, kLoopTurn};
    for (int d = 0; d < 6; ++d)
      for (int w = 0; w < kWaves; ++w)
        for (double& factor : factors_[d][w])
          factor = most[d] * (static_cast<double>(engine() >> 11) * 0x1p-52 - 1) / (w + 1);
  }
  // u = 0 .. 1 is once around.
  h6Pose at(const h6Vec3& centre, double u) const {
    double way[6] = {};
    for (int d = 0; d < 6; ++d)
      for (int w = 0; w < kWaves; ++w) {
        const double angle = 2 * std::numbers::pi * (w + 1) * u;
        way[d] += factors_[d][w][0] * std::cos(angle) + factors_[d][w][1] * std::sin(angle);
      }
    return {centre + h6Vec3{way[0], way[1], way[2]}, turn_by({way[3], way[4], way[5]})};
  }

 private:
  double factors_[6][kWaves][2];
};

// A body that a hand leads without a coupling: the hand feels the whole wrench, friction included.
class Lead {
 public:
  Lead(const io::LoadedScene& loaded, const MethodColumn& method) {
    h6SessionDef def = loaded.session_def();
    method.apply(def.contact);
    def.contact.damping = 0;
    def.contact.fit = H6_FIT_TIGHT;
    def.gravity = {};
    h6HandDef hand = h6DefaultHandDef();
    hand.body = 1;
    hand.coupling.mode = H6_COUPLING_DIRECT;
    def.hands = &hand, def.hand_count = 1;
    session_.reset(h6CreateSession(loaded.model.get(), &def, nullptr));
  }
  explicit operator bool() const { return session_ != nullptr; }
  h6Wrench at(const h6Pose& pose) {
    h6DeviceSample sample{};
    sample.pose = pose;
    h6DeviceCommand command{};
    h6Step(session_.get(), &sample, &command);
    return command.wrench;
  }

 private:
  SessionPtr session_;
};

// The contacts' net work over a loop, 0 where nothing touches.
struct NetWork {
  double of_range = 0;  // divided by the greatest difference of work on the way
  double of_way = 0;    // divided by the force times the way; negative where work is taken
};

// The body's frame is at its centre of mass.
NetWork net_work(const io::LoadedScene& loaded, const MethodColumn& method, const Loop& loop,
                 const h6Vec3& centre) {
  Lead lead(loaded, method);
  if (!lead) return {};
  double work = 0, least = 0, most = 0, dragged = 0;
  h6Pose last = loop.at(centre, 0);
  h6Wrench f0 = lead.at(last);
  for (int i = 1; i <= kLoopSteps; ++i) {
    const h6Pose next = loop.at(centre, static_cast<double>(i) / kLoopSteps);
    const h6Wrench f1 = lead.at(next);
    work += 0.5 * dot(f0.force + f1.force, next.p - last.p) +
            0.5 * dot(f0.torque + f1.torque, turn(last.q, next.q));
    least = std::min(least, work), most = std::max(most, work);
    dragged += 0.5 * norm(f0.force + f1.force) * norm(next.p - last.p);
    last = next, f0 = f1;
  }
  return most > least ? NetWork{work / (most - least), work / dragged} : NetWork{};
}

struct Place {
  const char* name;
  io::Scene scene;
  h6Vec3 centre, size;  // of the loops [m]
};

std::vector<Place> places() {
  const io::Mesh hole = io::block_with_hole(15 * kMm, 50 * kMm, 6.2 * kMm, 48 * kMm, 256);
  io::PointCloud peg;
  io::add_cylinder_side(peg, 6 * kMm, 10 * kMm, 38, 20);
  const h6Vec3 over = {2 * kMm, 2 * kMm, 0.3 * kMm}, inside = {0.3 * kMm, 0.3 * kMm, 3 * kMm};
  std::vector<Place> out;
  out.push_back({"box on a plane",
                 turned_scene("plane", plate(-40 * kMm, 40 * kMm), bottom(20, 20)),
                 {0, 0, 4.8 * kMm},
                 over});
  out.push_back(
      {"box on a ridge", turned_scene("ridge", ridge(), bottom(20, 20)), {0, 0, 4.8 * kMm}, over});
  out.push_back({"peg in a hole", turned_scene("hole", hole, peg), {0, 0, -25 * kMm}, inside});
  return out;
}

}  // namespace

Study study_loops(const std::vector<MethodColumn>& columns, const Console& console,
                  std::size_t loops) {
  Study out;
  out.title = "Random closed loops";
  out.about =
      "A hand without a coupling leads a body around " + std::to_string(loops) +
      " random closed loops in six dimensions, at most some 0.6 voxels "
      "deep: a box of 20 mm (400 points) on a plane and on a ridge of 4 mm radius, and a peg of 6 "
      "mm (760 points) in a hole of 6.2. The fields' lattices are turned by 0.75 rad against the "
      "surfaces. The table gives the contacts' net work over a loop, friction included, relative "
      "to the range of work on the way: the root mean square over the loops of what they make, of "
      "what they take, the most that they make, and what they take relative to the force times the "
      "way, which is how a coefficient of friction would feel. A conservative force gives 0.";
  std::vector<Place> all = places();
  std::vector<std::vector<NetWork>> found(all.size() * columns.size(), std::vector<NetWork>(loops));
  std::vector<std::unique_ptr<io::LoadedScene>> scenes;
  for (Place& place : all) {
    auto loaded = io::load_scene(std::move(place.scene));
    if (!loaded) return out;
    scenes.push_back(std::move(*loaded));
  }
  std::vector<std::function<void()>> jobs;
  for (std::size_t at = 0; at < found.size(); ++at)
    for (std::size_t i = 0; i < loops; ++i)
      jobs.push_back([&, at, i] {
        const Place& place = all[at / columns.size()];
        found[at][i] = net_work(*scenes[at / columns.size()], columns[at % columns.size()],
                                Loop(i, place.size), place.centre);
      });
  run_jobs(jobs, console, "loops");
  out.table = head("surface", columns);
  for (std::size_t at = 0; at < found.size(); ++at) {
    const std::string name = all[at / columns.size()].name;
    if (at % columns.size() == 0) out.table.push_back({name});
    double made = 0, taken = 0, most = 0, most_made = 0, felt = 0;
    for (const auto& [w, of_way] : found[at]) {
      (w > 0 ? made : taken) += w * w / static_cast<double>(loops);
      most = std::max(most, std::fabs(w)), most_made = std::max(most_made, w);
      felt += of_way < 0 ? of_way * of_way / static_cast<double>(loops) : 0;
    }
    const double rms = std::sqrt(made + taken);
    made = std::sqrt(made), taken = std::sqrt(taken), felt = std::sqrt(felt);
    out.table.back().push_back(number(made, 3) + ", " + number(taken, 3) + ", " +
                               number(most_made, 3) + ", " + number(felt, 3));
    out.json[name][columns[at % columns.size()].name] = {
        {"rms", rms}, {"most", most}, {"made", made}, {"taken", taken}, {"felt", felt}};
  }
  return out;
}

}  // namespace h6::cli
