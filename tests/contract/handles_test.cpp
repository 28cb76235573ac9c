// SPDX-License-Identifier: Apache-2.0
// hapsix.hpp: handles own, move and let go; spans show what the C functions give; a failure throws
// its sentence and code.
#include <doctest/doctest.h>

#include <string>
#include <utility>
#include <vector>

#include "hapsix/io.h"
// After io.h, for its handles.
#include "hapsix/hapsix.hpp"
#include "runtime/examples/floor.h"

namespace {

// Counts what an object holds of memory, to see it let go.
struct Heap {
  std::size_t bytes = 0;
  h6Allocator allocator() {
    h6Allocator a{};
    a.user = this;
    a.allocate = [](void* user, std::size_t bytes, std::size_t alignment) {
      static_cast<Heap*>(user)->bytes += bytes;
      return ::operator new(bytes, std::align_val_t(alignment));
    };
    a.release = [](void* user, void* memory, std::size_t bytes) {
      static_cast<Heap*>(user)->bytes -= bytes;
      ::operator delete(memory, std::align_val_t(64));
    };
    return a;
  }
};

}  // namespace

TEST_CASE("handles let go of what they hold, also after a move") {
  Heap heap;
  {
    h6ModelDef def = h6DefaultModelDef();
    def.allocator = heap.allocator();
    hapsix::Model model =
        hapsix::Model::make([&](h6Error* error) { return floor_and_tip(def, error); });
    h6SessionDef session_def = h6DefaultSessionDef();
    session_def.allocator = heap.allocator();
    hapsix::Session session =
        hapsix::Session::make([&](h6Error* error) { return hold_tip(model, session_def, error); });
    CHECK(heap.bytes > 0);
    hapsix::Session moved = std::move(session);
    CHECK(session.get() == nullptr);
    h6DeviceSample in = h6DefaultDeviceSample();
    in.pose.p = {4e-3, 4e-3, 3e-3};
    h6DeviceCommand out;
    for (int i = 0; i < 200; ++i) h6Step(moved, &in, &out);  // the C function takes the handle
    CHECK(out.wrench.force.z > 0.5);
    const hapsix::Contacts touching = hapsix::contacts(moved, 1);
    REQUIRE(touching.size() == 1);
    CHECK(touching.depth()[0] > 0);
    CHECK(touching.normal(0).z == doctest::Approx(1));
    CHECK(touching.point()[0] == 0);
    CHECK(touching.field_body()[0] == 0);
    CHECK(hapsix::overlaps(moved).empty());
    CHECK(hapsix::contacts(moved, 7).size() == 0);
  }
  CHECK(heap.bytes == 0);
}

TEST_CASE("a handle that cannot be made throws the sentence and the code") {
  hapsix::Model model =
      hapsix::Model::make([](h6Error* error) { return floor_and_tip(h6DefaultModelDef(), error); });
  h6BodyDef body = h6DefaultBodyDef();
  body.shell = 5;
  try {
    hapsix::create_session(model, {&body, 1}, {});
    FAIL("a session with a shell that does not exist was made");
  } catch (const hapsix::Error& e) {
    CHECK(std::string(e.what()).find("shell 5") != std::string::npos);
    CHECK(e.code == H6_ERROR_ARGUMENT);
  }
  CHECK_THROWS_AS(hapsix::start_loop(nullptr, {}), hapsix::Error);
  CHECK_THROWS_AS(
      hapsix::Mesh::make([](h6Error* e) { return h6ReadMesh("/no/such.stl", H6_METRES, e); }),
      hapsix::Error);
}

TEST_CASE("records of a loop come as the part of the room that was filled") {
  hapsix::Model model =
      hapsix::Model::make([](h6Error* error) { return floor_and_tip(h6DefaultModelDef(), error); });
  hapsix::Session session = hapsix::Session::make(
      [&](h6Error* error) { return hold_tip(model, h6DefaultSessionDef(), error); });
  h6Device device = h6DefaultDevice();
  device.read = [](void*, double, h6DeviceSample* out) {
    *out = h6DefaultDeviceSample();
    return 0;
  };
  device.write = [](void*, double, const h6DeviceCommand*) { return 0; };
  device.stop = [](void*) {};
  h6LoopDef def = h6DefaultLoopDef();
  def.virtual_time = true, def.duration = 0.05, def.ring_frames = 100;
  const hapsix::Loop loop = hapsix::start_loop(session, {&device, 1}, def);
  h6LoopReport report;
  h6JoinLoop(loop, &report);
  CHECK(report.frames == 50);
  std::vector<h6FrameRecord> room(64);
  const auto rows = hapsix::read_records(loop, room);
  REQUIRE(rows.size() == 50);
  CHECK(rows.back().report.frame == 49);
  CHECK(hapsix::read_records(loop, room).empty());
}
