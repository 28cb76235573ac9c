// SPDX-License-Identifier: Apache-2.0
// A viewer sees a running loop and may change its settings and pace.
#include <doctest/doctest.h>
#include <sys/mman.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "hapsix/hapsix.h"
#include "tests/support/box_on_floor.h"

using namespace h6::test;

namespace {

// A block held 2 mm below a floor's surface by its hand.
struct Scene : BoxOnFloor {
  Scene() {
    hand.coupling.max_force = 20;  // at any stiffness of the contacts
    open();
  }
  static h6Device device() {
    h6Device d{};
    d.capabilities.max_force = 20, d.capabilities.max_torque = 2;
    d.read = [](void*, double t, h6DeviceSample* out) {
      *out = hand_at(pose(0, 0, (5.2 - 2 * std::min(1.0, 10 * t)) * mm));
      return 0;
    };
    d.write = [](void*, double, const h6DeviceCommand*) { return 0; };
    d.stop = [](void*) {};
    return d;
  }
};

struct Running {
  h6Device device = Scene::device();
  h6Loop* loop;
  explicit Running(Scene& scene, std::size_t view_contacts = 4096) {
    h6LoopDef def = h6DefaultLoopDef();
    def.duration = 0;
    def.realtime = false;
    def.view_contacts = view_contacts;
    def.ring_frames = 20000;  // this thread may be starved for seconds
    loop = h6StartLoop(scene.session, &device, &def, nullptr);
    REQUIRE(loop);
  }
  ~Running() { h6DestroyLoop(loop); }
  // The newest view at or after `time`; valid until the next call.
  h6LoopView view_after(double time) const {
    h6LoopView view{};
    for (int i = 0; i < 30000; ++i) {
      if (h6ReadView(loop, &view) && view.time >= time) return view;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    FAIL("no view within 30 s");
    return view;
  }
  // The time of the last recorded frame, `time` or later.
  double goes_on_until(double time) const {
    h6FrameRecord row{};
    for (int i = 0; i < 30000 && row.time < time; ++i) {
      while (h6ReadRecords(loop, &row, 1) != 0) {
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    REQUIRE(row.time >= time);
    return row.time;
  }
};

}  // namespace

TEST_CASE("a viewer sees the poses and contacts of a frame") {
  Scene scene;
  const Running run(scene);
  const h6LoopView view = run.view_after(0.4);
  REQUIRE(view.body_count == 2);
  REQUIRE(view.contact_count > 100);
  CHECK(view.row_count == view.contact_count);
  CHECK(view.bodies[1].p.z < 5 * mm);
  for (std::size_t i = 0; i < view.row_count; ++i) {
    const h6ViewContact& c = view.contacts[i];
    // Each lies on the block's bottom, under the floor by its depth, and is pushed up.
    CHECK(std::fabs(c.position[2] + c.depth) < 2e-5);
    CHECK(std::fabs(c.position[0]) <= 10.001 * mm);
    CHECK(std::fabs(c.normal[2] - 1) < 1e-3);
    CHECK(c.shell_body == 1);
    CHECK(c.field_body == 0);
    CHECK(c.weight > 0);
  }
}

TEST_CASE("where there are more contacts than rows, rows come from all regions") {
  Scene scene;
  const Running run(scene, 20);
  const h6LoopView view = run.view_after(0.4);
  CHECK(view.contact_count > 100);
  CHECK(view.row_count <= 20);
  CHECK(view.row_count >= 10);
  float low = 1, high = -1;
  for (std::size_t i = 0; i < view.row_count; ++i) {
    low = std::min(low, view.contacts[i].position[0]);
    high = std::max(high, view.contacts[i].position[0]);
  }
  CHECK(high - low > 10 * mm);
}

TEST_CASE("a viewer that stands still costs the loop no frame, and then sees the newest one") {
  Scene scene;
  const Running run(scene);
  (void)run.view_after(0.05);
  const double reached = run.goes_on_until(0.35);
  h6LoopView view{};
  REQUIRE(h6ReadView(run.loop, &view));
  CHECK(view.time > reached - 0.02);
  const std::uint64_t frame = view.frame;
  CHECK(run.view_after(view.time + 0.01).frame > frame);
}

TEST_CASE("without room for contacts there is nothing to see") {
  Scene scene;
  const Running run(scene, 0);
  std::this_thread::sleep_for(std::chrono::milliseconds(30));
  h6LoopView view;
  CHECK(!h6ReadView(run.loop, &view));
}

TEST_CASE("another session goes on where the previous one was, with its own settings") {
  Scene scene;
  Running run(scene);
  const double before = run.view_after(0.5).bodies[1].p.z;
  h6SessionDef softer = scene.def;
  softer.contact.stiffness = h6StiffnessFor(scene.model.handle, &scene.def) / 10;
  h6Session* next = h6CreateSession(scene.model.handle, &softer, nullptr);
  REQUIRE(next);
  std::vector<h6FrameRecord> rows(2000);
  (void)h6ReadRecords(run.loop, rows.data(), rows.size());
  h6Session* old = h6ChangeSession(run.loop, next, nullptr);
  CHECK(old == scene.session);
  scene.session = next;
  h6DestroySession(old);
  const double time = run.view_after(0).time;
  const h6LoopView view = run.view_after(time + 0.2);
  // A tenth of the contacts' stiffness, the same hand.
  CHECK(5 * mm - view.bodies[1].p.z > 4 * (5 * mm - before));
  // No frame was left out and nothing jumped.
  const std::size_t n = h6ReadRecords(run.loop, rows.data(), rows.size());
  REQUIRE(n > 100);
  for (std::size_t i = 1; i < n; ++i) {
    CHECK(rows[i].report.frame == rows[i - 1].report.frame + 1);
    CHECK(std::fabs(rows[i].body[0].pose.p.z - rows[i - 1].body[0].pose.p.z) < 0.1 * mm);
  }
}

TEST_CASE("a session of another model is refused, and nothing changes") {
  Scene scene, other;
  Running run(scene);
  h6Error error{};
  CHECK(h6ChangeSession(run.loop, other.session, &error) == nullptr);
  CHECK(std::string(error.message).find("same model") != std::string::npos);
  h6SessionDef faster = scene.def;
  faster.rate = 2000;
  h6Session* next = h6CreateSession(scene.model.handle, &faster, nullptr);
  CHECK(h6ChangeSession(run.loop, next, &error) == nullptr);
  h6DestroySession(next);
  const h6LoopView view = run.view_after(0);
  CHECK(run.view_after(view.time + 0.02).frame > view.frame);
}

TEST_CASE("a loop that has ended takes no session") {
  Scene scene;
  Running run(scene);
  h6RequestStop(run.loop);
  h6JoinLoop(run.loop, nullptr);
  h6Session* next = h6CreateSession(scene.model.handle, &scene.def, nullptr);
  CHECK(h6ChangeSession(run.loop, next, nullptr) == nullptr);
  h6DestroySession(next);
}

// A device whose reads hang while they are told to.
struct Hanging {
  std::atomic<bool> hangs{true}, reads{false};
  h6Device device = Scene::device();
  Hanging() {
    device.self = this;
    device.read = [](void* self, double, h6DeviceSample* out) {
      Hanging& h = *static_cast<Hanging*>(self);
      for (h.reads = true; h.hangs;) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      *out = hand_at(pose(0, 0, 5.2 * mm));
      return 0;
    };
  }
  // A loop of this session that hangs in its first frame.
  h6Loop* start(h6Session* session) {
    h6LoopDef def = h6DefaultLoopDef();
    def.realtime = false;
    h6Loop* const loop = h6StartLoop(session, &device, &def, nullptr);
    REQUIRE(loop);
    while (!reads) std::this_thread::yield();
    return loop;
  }
};

TEST_CASE("a session is not taken over while a device hangs, and the caller gets it back") {
  Scene scene;
  Hanging hanging;
  h6Loop* const loop = hanging.start(scene.session);
  h6Session* next = h6CreateSession(scene.model.handle, &scene.def, nullptr);
  h6Error error{};
  CHECK(h6ChangeSession(loop, next, &error) == nullptr);
  CHECK(error.code == H6_ERROR_BUSY);
  hanging.hangs = false;
  h6Session* old = h6ChangeSession(loop, next, &error);
  CHECK(old == scene.session);  // it was free to be offered again
  h6DestroyLoop(loop);
  scene.session = next;
  h6DestroySession(old);
}

TEST_CASE("a caller whose turn comes late still has its whole time for a frame") {
  Scene scene;
  Hanging hanging;
  h6Loop* const loop = hanging.start(scene.session);
  h6Session* next[] = {h6CreateSession(scene.model.handle, &scene.def, nullptr),
                       h6CreateSession(scene.model.handle, &scene.def, nullptr)};
  h6Error error[2]{};
  h6Session* before[2]{};
  std::thread first([&] { before[0] = h6ChangeSession(loop, next[0], &error[0]); });
  std::this_thread::sleep_for(std::chrono::milliseconds(800));
  std::thread second([&] { before[1] = h6ChangeSession(loop, next[1], &error[1]); });
  first.join();  // after 2 s; the turn is the second's, who has waited for 1.2 s
  std::this_thread::sleep_for(std::chrono::milliseconds(1200));
  hanging.hangs = false;
  second.join();
  CHECK(before[0] == nullptr);
  CHECK(error[0].code == H6_ERROR_BUSY);
  CHECK_MESSAGE(before[1] == scene.session, error[1].message);
  h6DestroyLoop(loop);
  for (h6Session* session : next) h6DestroySession(session);
}

TEST_CASE("a caller compares a session with a loop's without a look at the loop's") {
  // Another thread may join the loop and destroy its session at any time. Here the session cannot
  // be read meanwhile: a look at it is a crash.
  struct Pages {
    std::vector<std::pair<void*, std::size_t>> all;
    void protect(int how) const {
      for (const auto& [memory, bytes] : all) REQUIRE(mprotect(memory, bytes, how) == 0);
    }
  } pages;
  Scene scene;
  h6SessionDef paged = scene.def;
  paged.threads = 1;
  paged.allocator.user = &pages;
  paged.allocator.allocate = [](void* user, std::size_t bytes, std::size_t) -> void* {
    void* const memory =
        mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) return nullptr;
    static_cast<Pages*>(user)->all.push_back({memory, bytes});
    return memory;
  };
  paged.allocator.release = [](void* user, void* memory, std::size_t bytes) {
    auto& all = static_cast<Pages*>(user)->all;
    all.erase(std::find(all.begin(), all.end(), std::pair(memory, bytes)));
    munmap(memory, bytes);
  };
  h6Session* const session = h6CreateSession(scene.model.handle, &paged, nullptr);
  REQUIRE(session);
  const Pages of_session = pages;
  h6SessionDef faster = scene.def;
  faster.rate = 2000;
  h6Session* const next = h6CreateSession(scene.model.handle, &faster, nullptr);
  REQUIRE(next);
  Hanging hanging;
  h6Loop* const loop = hanging.start(session);
  of_session.protect(PROT_NONE);
  h6Error error{};
  CHECK(h6ChangeSession(loop, next, &error) == nullptr);
  of_session.protect(PROT_READ | PROT_WRITE);
  CHECK(std::string(error.message).find("same model") != std::string::npos);
  hanging.hangs = false;
  h6DestroyLoop(loop);
  h6DestroySession(session), h6DestroySession(next);
}

TEST_CASE("in a pause time stands still; in slow motion devices see the time of the frames") {
  Scene scene;
  Running run(scene);
  (void)run.view_after(0.1);
  h6SetPace(run.loop, 0);
  std::vector<h6FrameRecord> rows(20000);
  // The last frame may be on its way, for long where the loop is starved.
  int quiet = 0;
  for (int i = 0; i < 300 && quiet < 5; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    quiet = h6ReadRecords(run.loop, rows.data(), rows.size()) == 0 ? quiet + 1 : 0;
  }
  CHECK(quiet == 5);
  h6SetPace(run.loop, 0.25);
  const auto start = std::chrono::steady_clock::now();
  std::size_t n = 0;
  while (n < 50) n += h6ReadRecords(run.loop, rows.data() + n, 50 - n);
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  CHECK(seconds >
        0.15);  // 50 frames at a quarter of the pace take 0.2 s; less only if it ran ahead
  for (std::size_t i = 1; i < n; ++i)
    CHECK(std::fabs(rows[i].time - rows[i - 1].time - 1e-3) < 1e-9);
}
