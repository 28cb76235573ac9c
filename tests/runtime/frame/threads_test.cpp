// SPDX-License-Identifier: Apache-2.0
// Any number of threads, and of a program's own tasks, gives the same bits.
#include <doctest/doctest.h>

#include <array>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/ball_in_bowl.h"

using namespace h6::test;

namespace {

// A program that makes a thread for every task.
h6Tasks thread_tasks() {
  return {[](void*, void (*task)(void*), void* context) -> void* {
            return new std::thread(task, context);
          },
          [](void*, void* handle) {
            auto* thread = static_cast<std::thread*>(handle);
            thread->join();
            delete thread;
          },
          nullptr};
}

struct Hash {
  std::uint64_t state;
  std::uint32_t contacts;
  double depth, force;
  bool operator==(const Hash&) const = default;
};

template <class Scene>
std::vector<Hash> run(Scene& scene, int frames) {
  scene.open();
  std::vector<Hash> out;
  for (int i = 0; i < frames; ++i) {
    const h6DeviceSample sample = scene.sample(i);
    h6DeviceCommand command;
    h6Step(scene.session, &sample, &command);
    const h6FrameReport r = h6GetFrame(scene.session);
    out.push_back({r.state_hash, r.contacts, r.max_depth, command.wrench.force.x});
  }
  return out;
}

void check_threads(h6Method method, int points, std::uint32_t least, int frames, int tasks_frames) {
  CAPTURE(std::string(h6MethodName(method)));
  BallInBowl one(1, points);
  one.def.contact.method = method;
  one.def.contact.friction = 0.2;
  const std::vector<Hash> want = run(one, frames);
  std::uint32_t most = 0;
  for (const Hash& h : want) most = std::max(most, h.contacts);
  CHECK(most > least);
  for (const unsigned threads : {2u, 3u, 4u, 8u}) {
    CAPTURE(threads);
    BallInBowl many(threads, points);
    many.def.contact = one.def.contact;
    CHECK(run(many, frames) == want);
  }
  BallInBowl own(4, points);
  own.def.contact = one.def.contact;
  own.def.tasks = thread_tasks();
  const std::vector<Hash> got = run(own, tasks_frames);
  CHECK(std::equal(got.begin(), got.end(), want.begin()));
}

}  // namespace

TEST_CASE("1, 2, 3, 4 and 8 threads, and a program's own, give the same bits: one body") {
  for (const h6Method method : {H6_METHOD_FIRM, H6_METHOD_GAUSS6, H6_METHOD_ROBUST})
    check_threads(method, 30000, 300, 80, 30);
}

TEST_CASE("the same with thousands of contacts, where every loop is shared") {
  check_threads(H6_METHOD_FIRM, 150000, 4096, 40, 20);
}
