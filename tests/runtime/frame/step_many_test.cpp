// SPDX-License-Identifier: Apache-2.0
// Many sessions in one call: each has the bits that it has alone, whatever steps beside it.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "hapsix/batch.h"
#include "tests/support/ball_in_bowl.h"

using namespace h6::test;

namespace {

struct DestroySession {
  void operator()(h6Session* s) const { h6DestroySession(s); }
};
struct DestroyWorkers {
  void operator()(h6Workers* w) const { h6DestroyWorkers(w); }
};
using Session = std::unique_ptr<h6Session, DestroySession>;
using Workers = std::unique_ptr<h6Workers, DestroyWorkers>;

Workers workers(unsigned threads, const h6Tasks& tasks = {}) {
  h6WorkersDef def = h6DefaultWorkersDef();
  def.threads = threads, def.tasks = tasks;
  h6Error error{};
  Workers made(h6CreateWorkers(&def, &error));
  REQUIRE_MESSAGE(made, error.message);
  return made;
}

// Sessions of one model that begin in different places, and columns for all of them.
struct Crowd {
  std::vector<Session> sessions;
  std::vector<h6Session*> handles;
  std::vector<h6Pose> pose, command_pose;
  std::vector<h6Velocity> velocity;
  std::vector<h6Wrench> wrench, command;
  std::vector<std::uint32_t> buttons, causes, contacts;
  std::vector<h6BodyState> body;
  std::vector<h6Status> status;
  std::vector<double> depth, voxels;
  std::vector<std::uint64_t> hash;
  h6StepArrays arrays = h6DefaultStepArrays();

  // `w`: the sessions are made for these workers.
  Crowd(BallInBowl& scene, std::size_t count, h6Workers* w = nullptr) {
    scene.def.workers = w;
    for (std::size_t i = 0; i < count; ++i) {
      scene.bodies[1].pose.p.x = 0.01 * kMm * static_cast<double>(i);
      sessions.emplace_back(h6CreateSession(scene.model.handle, &scene.def, nullptr));
      REQUIRE(sessions.back());
      handles.push_back(sessions.back().get());
    }
    const std::size_t hands = scene.def.hand_count, rows = hands * count;
    pose.resize(rows), command_pose.resize(rows), velocity.resize(rows), wrench.resize(rows);
    command.resize(rows), buttons.resize(rows), causes.resize(rows), body.resize(rows);
    contacts.resize(count), status.resize(count), depth.resize(count), voxels.resize(count);
    hash.resize(count);
    arrays.sessions = handles.data(), arrays.count = count;
    arrays.hands = static_cast<std::uint32_t>(hands);
    arrays.pose = pose.data(), arrays.velocity = velocity.data(), arrays.wrench = wrench.data();
    arrays.buttons = buttons.data(), arrays.command = command.data();
    arrays.command_pose = command_pose.data(), arrays.causes = causes.data();
    arrays.body = body.data(), arrays.status = status.data(), arrays.contacts = contacts.data();
    arrays.max_depth = depth.data(), arrays.max_depth_voxels = voxels.data();
    arrays.state_hash = hash.data();
  }
  // Another sample for each row: rows follow the scene's hand at different times.
  void sample(const BallInBowl& scene, int frame) {
    for (std::size_t row = 0; row < pose.size(); ++row) {
      const h6DeviceSample s = scene.sample(frame + 7 * static_cast<int>(row));
      pose[row] = s.pose, wrench[row] = s.wrench, buttons[row] = s.buttons;
      velocity[row] = {{0.01 * static_cast<double>(row), 0, 0}, {0, 0, 0.1}};
    }
  }
};

// Steps each session by itself, as a program would without h6StepMany.
h6Status step_alone(Crowd& crowd, std::size_t i, std::uint32_t steps) {
  const std::size_t hands = crowd.arrays.hands;
  std::vector<h6DeviceSample> samples(hands, h6DefaultDeviceSample());
  std::vector<h6DeviceCommand> commands(hands);
  for (std::size_t h = 0; h < hands; ++h) {
    samples[h].pose = crowd.pose[hands * i + h];
    samples[h].velocity = crowd.velocity[hands * i + h];
    samples[h].wrench = crowd.wrench[hands * i + h];
    samples[h].buttons = crowd.buttons[hands * i + h];
  }
  h6Status status = 0;
  for (std::uint32_t k = 0; k < steps; ++k)
    status |= h6Step(crowd.handles[i], samples.data(), commands.data());
  for (std::size_t h = 0; h < hands; ++h) {
    const std::size_t row = hands * i + h;
    crowd.command[row] = commands[h].wrench, crowd.command_pose[row] = commands[h].pose;
    crowd.causes[row] = commands[h].causes;
    crowd.body[row] = h6GetBody(crowd.handles[i], 1);
  }
  const h6FrameReport report = h6GetFrame(crowd.handles[i]);
  crowd.status[i] = status, crowd.contacts[i] = report.contacts, crowd.depth[i] = report.max_depth;
  crowd.voxels[i] = report.max_depth_voxels, crowd.hash[i] = report.state_hash;
  return status;
}

template <class T>
bool same(const std::vector<T>& a, const std::vector<T>& b) {
  if (a.size() != b.size()) return false;
  return a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}
void check_same(const Crowd& a, const Crowd& b) {
  REQUIRE(same(a.hash, b.hash));
  CHECK(same(a.command, b.command));
  CHECK(same(a.command_pose, b.command_pose));
  CHECK(same(a.body, b.body));
  CHECK(same(a.causes, b.causes));
  CHECK(same(a.status, b.status));
  CHECK(same(a.contacts, b.contacts));
  CHECK(same(a.depth, b.depth));
  CHECK(same(a.voxels, b.voxels));
}

// `lent`: the sessions share the scratch of the workers.
void check_crowd(h6Workers* w, std::uint32_t hands, std::uint32_t steps, bool lent = false) {
  BallInBowl scene(1, 2000);
  const std::vector<h6HandDef> both(hands, scene.hand);
  scene.def.hands = both.data(), scene.def.hand_count = hands;
  scene.def.contact.friction = 0.2;
  scene.def.max_contacts = 1000;
  Crowd together(scene, 37, lent ? w : nullptr), alone(scene, 37);
  together.arrays.steps = steps;
  std::uint32_t most = 0;
  for (int frame = 0; frame < 25; ++frame) {
    together.sample(scene, frame), alone.sample(scene, frame);
    const h6Status all = h6StepMany(w, &together.arrays);
    h6Status want = 0;
    for (std::size_t i = 0; i < alone.handles.size(); ++i) want |= step_alone(alone, i, steps);
    CHECK(all == want);
    check_same(together, alone);
    most = std::max(most, *std::max_element(together.contacts.begin(), together.contacts.end()));
  }
  if (hands > 0) CHECK(most > 20);  // else nothing moves
}

}  // namespace

TEST_CASE("each session of a crowd has the bits that it has alone, on any number of threads") {
  check_crowd(nullptr, 1, 1);
  for (const unsigned threads : {1u, 2u, 3u, 8u}) {
    CAPTURE(threads);
    check_crowd(workers(threads).get(), 1, 1);
  }
  check_crowd(workers(2).get(), 2, 1);
  check_crowd(workers(2).get(), 1, 5);
  check_crowd(workers(2).get(), 0, 2);
  CHECK(h6WorkerThreads(workers(0).get()) >= 1);
  CHECK(h6WorkerThreads(workers(3).get()) == 3);
}

TEST_CASE("sessions that share the scratch of their workers have the bits that they have alone") {
  for (const unsigned threads : {1u, 2u, 3u, 8u}) {
    CAPTURE(threads);
    check_crowd(workers(threads).get(), 1, 1, true);
  }
  check_crowd(workers(2).get(), 2, 3, true);
}

TEST_CASE("sessions of all sizes and rules share one scratch, which grows with them") {
  const Workers w = workers(2);
  std::vector<std::unique_ptr<BallInBowl>> scenes;
  std::vector<Crowd> together, alone;
  const h6Method methods[] = {H6_METHOD_GLOBAL, H6_METHOD_CLUSTER, H6_METHOD_FIRM,
                              H6_METHOD_GAUSS6, H6_METHOD_SERIES,  H6_METHOD_ROBUST};
  int points = 100;
  for (const h6Method method : methods) {
    scenes.push_back(std::make_unique<BallInBowl>(1, points));
    scenes.back()->def.contact.method = method;
    scenes.back()->def.max_contacts = static_cast<std::size_t>(points);
    alone.emplace_back(*scenes.back(), 5);
    together.emplace_back(*scenes.back(), 5, w.get());
    points = points < 3000 ? 3 * points : 200;
    for (int frame = 0; frame < 12; ++frame)  // the larger leave their rows to the smaller
      for (std::size_t k = 0; k < scenes.size(); ++k) {
        together[k].sample(*scenes[k], frame), alone[k].sample(*scenes[k], frame);
        h6StepMany(w.get(), &together[k].arrays);
        for (std::size_t i = 0; i < 5; ++i) step_alone(alone[k], i, 1);
        check_same(together[k], alone[k]);
      }
  }
}

TEST_CASE("a session of workers steps with them only, and takes less memory") {
  BallInBowl scene(1, 2000);
  static std::size_t taken;
  scene.def.allocator = {[](void*, std::size_t bytes, std::size_t alignment) {
                           taken += bytes;
                           return std::aligned_alloc(alignment, bytes);
                         },
                         [](void*, void* memory, std::size_t) { std::free(memory); }, nullptr};
  scene.def.max_contacts = 1000;
  const Workers w = workers(2), other = workers(2);
  taken = 0;
  const Crowd own(scene, 2);
  const std::size_t whole = taken;
  taken = 0;
  Crowd crowd(scene, 2, w.get());
  CHECK(2 * taken < whole);
  crowd.sample(scene, 3);
  for (h6Workers* wrong : {static_cast<h6Workers*>(nullptr), other.get()}) {
    CHECK(h6StepMany(wrong, &crowd.arrays) == H6_OUTPUT_FAULT);
    CHECK(crowd.status[0] == H6_OUTPUT_FAULT);
  }
  const h6DeviceSample sample = scene.sample(3);
  CHECK(h6Step(crowd.handles[0], &sample, nullptr) == H6_OUTPUT_FAULT);
  h6Device device = h6DefaultDevice();
  h6Error error{};
  CHECK(h6StartLoop(crowd.handles[0], &device, nullptr, &error) == nullptr);
  CHECK(std::string(error.message).find("workers") != std::string::npos);
  CHECK(h6GetFrame(crowd.handles[0]).state_hash == 0);
  CHECK((h6StepMany(w.get(), &crowd.arrays) & H6_OUTPUT_FAULT) == 0);
  CHECK(h6GetFrame(crowd.handles[0]).state_hash != 0);
  CHECK(h6RestartFit(crowd.handles[0], &error));
  scene.def.workers = w.get(), scene.def.threads = 2;
  CHECK(h6CreateSession(scene.model.handle, &scene.def, &error) == nullptr);
  CHECK(std::string(error.message).find("threads is 2") != std::string::npos);
}

TEST_CASE("while workers step, no session is made for them, and without memory none is") {
  BallInBowl scene(1, 2000);
  struct Inner {
    BallInBowl& scene;
    h6Workers* workers = nullptr;
    h6Error error{};
    bool refit = true;
    h6Session* session = nullptr;
  } inner{scene};
  const h6Tasks tasks{
      [](void* user, void (*)(void*), void*) -> void* {  // inside the call
        Inner& self = *static_cast<Inner*>(user);
        self.scene.def.workers = self.workers;
        h6DestroySession(h6CreateSession(self.scene.model.handle, &self.scene.def, &self.error));
        self.refit = h6RestartFit(self.session, nullptr);
        return nullptr;
      },
      [](void*, void*) {}, &inner};
  const Workers w = workers(2, tasks);
  Crowd crowd(scene, 3, w.get());
  inner.workers = w.get(), inner.session = crowd.handles[2];
  crowd.sample(scene, 0);
  CHECK((h6StepMany(w.get(), &crowd.arrays) & H6_OUTPUT_FAULT) == 0);
  CHECK(inner.error.code == H6_ERROR_BUSY);
  CHECK_FALSE(inner.refit);

  // Workers whose memory is at its end, once before and once after they were made.
  bool some = false;
  h6WorkersDef def = h6DefaultWorkersDef();
  def.allocator = {[](void* user, std::size_t bytes, std::size_t alignment) {
                     return *static_cast<bool*>(user) ? std::aligned_alloc(alignment, bytes)
                                                      : nullptr;
                   },
                   [](void*, void* memory, std::size_t) { std::free(memory); }, &some};
  h6Error error{};
  CHECK(h6CreateWorkers(&def, &error) == nullptr);
  CHECK(error.code == H6_ERROR_MEMORY);
  some = true;
  const Workers poor(h6CreateWorkers(&def, nullptr));
  REQUIRE(poor);
  some = false;
  scene.def.workers = poor.get();
  error = {};
  CHECK(h6CreateSession(scene.model.handle, &scene.def, &error) == nullptr);
  CHECK(error.code == H6_ERROR_MEMORY);
}

TEST_CASE("a program's own tasks step sessions too") {
  const h6Tasks threads{[](void*, void (*task)(void*), void* context) -> void* {
                          return new std::thread(task, context);
                        },
                        [](void*, void* handle) {
                          auto* thread = static_cast<std::thread*>(handle);
                          thread->join();
                          delete thread;
                        },
                        nullptr};
  check_crowd(workers(3, threads).get(), 1, 1);
}

TEST_CASE("columns that are NULL are at rest, or are not written") {
  BallInBowl scene(1, 2000);
  Crowd full(scene, 3), bare(scene, 3);
  full.sample(scene, 5), bare.sample(scene, 5);
  std::fill(full.velocity.begin(), full.velocity.end(), h6Velocity{});
  std::fill(full.wrench.begin(), full.wrench.end(), h6Wrench{});
  std::fill(full.buttons.begin(), full.buttons.end(), 0u);
  const h6StepArrays all = bare.arrays;
  bare.arrays = h6DefaultStepArrays();
  bare.arrays.sessions = all.sessions, bare.arrays.count = all.count, bare.arrays.pose = all.pose;
  bare.arrays.state_hash = all.state_hash;
  for (int i = 0; i < 10; ++i) h6StepMany(nullptr, &full.arrays), h6StepMany(nullptr, &bare.arrays);
  CHECK(same(full.hash, bare.hash));
  CHECK(bare.command[0].force.x == 0);
}

TEST_CASE("a session that cannot step is refused, and the others step") {
  BallInBowl scene(1, 2000);
  Crowd crowd(scene, 4), alone(scene, 4);
  BallInBowl two(1, 2000);
  const std::vector<h6HandDef> both(2, two.hand);
  two.def.hands = both.data(), two.def.hand_count = 2;
  Crowd other(two, 1);
  const Workers w = workers(2);
  crowd.sample(scene, 3), alone.sample(scene, 3);
  crowd.handles[0] = nullptr, crowd.handles[2] = other.handles[0];
  crowd.command[0] = crowd.command[2] = {{1, 1, 1}, {1, 1, 1}};
  h6Device device = h6DefaultDevice();
  device.capabilities.frame_time = true;
  device.read = [](void*, double, h6DeviceSample* out) {
    return *out = h6DefaultDeviceSample(), 0;
  };
  device.write = [](void*, double, const h6DeviceCommand*) { return 0; };
  h6LoopDef loop_def = h6DefaultLoopDef();
  loop_def.realtime = false;
  h6Error error{};
  h6Loop* loop = h6StartLoop(crowd.handles[3], &device, &loop_def, &error);
  REQUIRE_MESSAGE(loop, error.message);
  CHECK((h6StepMany(w.get(), &crowd.arrays) & H6_OUTPUT_FAULT) != 0);
  h6RequestStop(loop), h6JoinLoop(loop, nullptr), h6DestroyLoop(loop);
  step_alone(alone, 1, 1);
  CHECK(crowd.hash[1] == alone.hash[1]);
  for (const std::size_t i : {0u, 2u, 3u}) {
    CAPTURE(i);
    CHECK(crowd.status[i] == H6_OUTPUT_FAULT);
    CHECK(crowd.hash[i] == 0);
    CHECK(crowd.command[i].force.x == 0);
  }
  CHECK(h6GetFrame(other.handles[0]).state_hash == 0);  // it did not step
}

TEST_CASE("a second call with the same workers is refused while the first runs") {
  BallInBowl scene(1, 2000);
  Crowd first(scene, 3), second(scene, 3);
  // The program's tasks are asked for inside the first call.
  struct Inner {
    Crowd& crowd;
    h6Workers* workers = nullptr;
    h6Status status = 0;
  } inner{second};
  const h6Tasks tasks{[](void* user, void (*)(void*), void*) -> void* {
                        Inner& self = *static_cast<Inner*>(user);
                        self.status = h6StepMany(self.workers, &self.crowd.arrays);
                        return nullptr;
                      },
                      [](void*, void*) {}, &inner};
  const Workers w = workers(2, tasks);
  inner.workers = w.get();
  first.sample(scene, 0), second.sample(scene, 0);
  std::fill(second.status.begin(), second.status.end(), 77u);
  CHECK((h6StepMany(w.get(), &first.arrays) & H6_OUTPUT_FAULT) == 0);
  CHECK(inner.status == H6_OUTPUT_FAULT);
  CHECK(second.status[0] == 77);  // nothing was written
  CHECK(first.hash[0] != 0);
  CHECK(h6GetFrame(second.handles[0]).state_hash == 0);
}

TEST_CASE("wrong arguments of a call on many sessions are refused") {
  BallInBowl scene(1, 2000);
  Crowd crowd(scene, 2);
  const Workers w = workers(2);
  CHECK(h6StepMany(w.get(), nullptr) == H6_OUTPUT_FAULT);
  const auto refuses = [&](auto change) {
    h6StepArrays arrays = crowd.arrays;
    change(arrays);
    CHECK(h6StepMany(w.get(), &arrays) == H6_OUTPUT_FAULT);
    CHECK(h6StepMany(nullptr, &arrays) == H6_OUTPUT_FAULT);
    CHECK(h6GetFrame(crowd.handles[0]).state_hash == 0);
  };
  refuses([](h6StepArrays& a) { a.sessions = nullptr; });
  refuses([](h6StepArrays& a) { a.count = SIZE_MAX; });
  refuses([](h6StepArrays& a) { a.pose = nullptr; });
  refuses([](h6StepArrays& a) { a.steps = 0; });
  refuses([](h6StepArrays& a) { a.hands = UINT32_MAX; });
  refuses([](h6StepArrays& a) { a.reserved[3] = 1; });
  h6StepArrays none = h6DefaultStepArrays();
  CHECK(h6StepMany(w.get(), &none) == 0);
  h6WorkersDef def = h6DefaultWorkersDef();
  h6Error error{};
  def.threads = 65;
  CHECK(h6CreateWorkers(&def, &error) == nullptr);
  CHECK(error.code == H6_ERROR_RANGE);
  def.threads = 1, def.reserved[0] = 1;
  CHECK(h6CreateWorkers(&def, &error) == nullptr);
  CHECK(h6WorkerThreads(nullptr) == 0);
  h6DestroyWorkers(nullptr);
  // A hand that is not finite is a bad sample of one session.
  crowd.sample(scene, 0);
  crowd.pose[1].p.x = std::nan("");
  CHECK((h6StepMany(w.get(), &crowd.arrays) & H6_HAND_NOT_FINITE) != 0);
  CHECK((crowd.status[0] & H6_HAND_NOT_FINITE) == 0);
}
