// SPDX-License-Identifier: Apache-2.0
// hapsix.hpp: handles own, move and let go; spans show what the C functions give; a failure throws
// its sentence and code. And what arguments_test.cpp leaves of wrong arguments, from outside.
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <regex>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "hapsix/batch.h"
#include "hapsix/hapsix.hpp"
#include "hapsix/io.h"
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
    CHECK(touching.gradient(0).z == doctest::Approx(1));
    CHECK(touching.torque_direction(0).z == 0);  // the push turns nothing about its own axis
    CHECK(touching.point()[0] == 0);
    CHECK(touching.field_body()[0] == 0);
    CHECK(hapsix::overlaps(moved).empty());
    CHECK(hapsix::contacts(moved, 7).size() == 0);
  }
  CHECK(heap.bytes == 0);
}

TEST_CASE("each accessor of contacts shows a column of its own, in every row") {
  h6Contacts c{};
  const float** const to[15] = {&c.depth, &c.nx, &c.ny, &c.nz, &c.gx, &c.gy,     &c.gz,  &c.rx,
                                &c.ry,    &c.rz, &c.tx, &c.ty, &c.tz, &c.weight, &c.load};
  float r[15][2];
  for (int column = 0; column < 15; ++column) {
    for (int i = 0; i < 2; ++i) r[column][i] = static_cast<float>(10 * column + i);
    *to[column] = r[column];
  }
  const std::uint32_t point[2] = {7, 8};
  const std::int32_t field_body[2] = {5, 6};
  c.count = 2, c.point = point, c.field_body = field_body;
  const hapsix::Contacts all(c);
  REQUIRE(all.size() == 2);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto shows = [&](h6Vec3 row, int first) {
      return row.x == r[first][i] && row.y == r[first + 1][i] && row.z == r[first + 2][i];
    };
    CHECK((all.depth()[i] == r[0][i] && all.weight()[i] == r[13][i] && all.load()[i] == r[14][i]));
    CHECK((shows(all.normal(i), 1) && shows(all.gradient(i), 4)));
    CHECK((shows(all.arm(i), 7) && shows(all.torque_direction(i), 10)));
    CHECK((all.point()[i] == point[i] && all.field_body()[i] == field_body[i]));
  }
  CHECK(all.column(all.columns.tz)[1] == r[12][1]);
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

TEST_CASE(
    "a span is of any array or container of its rows, not of others and no loose temporary one") {
  using Numbers = std::vector<int>;
  CHECK(std::is_convertible_v<Numbers&, hapsix::span<int>>);
  CHECK(std::is_convertible_v<const Numbers&, hapsix::span<const int>>);
  CHECK(std::is_convertible_v<Numbers, hapsix::span<const int>>);
  CHECK(std::is_convertible_v<hapsix::span<int>, hapsix::span<const int>>);
  CHECK_FALSE(std::is_convertible_v<Numbers, hapsix::span<int>>);
  CHECK_FALSE(std::is_convertible_v<const Numbers&, hapsix::span<int>>);
  CHECK_FALSE(std::is_convertible_v<int, hapsix::span<int>>);
  CHECK_FALSE(std::is_convertible_v<std::vector<long>&, hapsix::span<int>>);
  int rows[3] = {1, 2, 3};
  const hapsix::span<int> all(rows);
  all[2] = 7;
  CHECK((all.size() == 3 && all.front() == 1 && all.back() == 7 && rows[2] == 7));
  CHECK(std::vector<int>(all.begin(), all.end()) == std::vector<int>{1, 2, 7});
  CHECK(all.first(2).size() == 2);
  CHECK(all.subspan(1).data() == rows + 1);
  CHECK(hapsix::span<int>().empty());
}

TEST_CASE("spans and rows of no object are empty, and a handle of nothing throws") {
  CHECK(hapsix::contacts(nullptr, 0).depth().empty());
  CHECK(hapsix::overlaps(nullptr).empty());
  std::vector<h6FrameRecord> room(2);
  CHECK(hapsix::read_records(nullptr, room).empty());
  CHECK_THROWS_AS(hapsix::create_session(nullptr, {}, {}), hapsix::Error);
  const hapsix::Workers none;
  CHECK((none.get() == nullptr && h6WorkerThreads(none) == 0));
}

// ---- wrong arguments ----------------------------------------------------------------------------

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Held {
  hapsix::Model model =
      hapsix::Model::make([](h6Error* e) { return floor_and_tip(h6DefaultModelDef(), e); });
  hapsix::Session session = hapsix::Session::make(
      [this](h6Error* e) { return hold_tip(model, h6DefaultSessionDef(), e); });
};

}  // namespace

TEST_CASE("a number that names nothing has no name, and a name that nothing has gives no number") {
  for (const int odd : {-1, 99, INT32_MAX, INT32_MIN}) {
    CHECK(h6StageName(static_cast<h6Stage>(odd)) == nullptr);
    CHECK(h6CauseName(static_cast<h6Cause>(odd)) == nullptr);
    CHECK(h6DeviceStateName(static_cast<h6DeviceState>(odd)) == nullptr);
    CHECK(h6MethodName(static_cast<h6Method>(odd)) == nullptr);
  }
  CHECK(h6StageName(H6_STAGE_COUNT) == nullptr);
  CHECK(h6CauseName(H6_CAUSE_COUNT) == nullptr);
  CHECK(h6DeviceStateName(H6_DEVICE_STATE_COUNT) == nullptr);
  CHECK(h6MethodName(H6_METHOD_COUNT) == nullptr);
  for (const h6Status odd : {0u, 3u, 1u << 14, 1u << 31, UINT32_MAX})
    CHECK(h6StatusName(odd) == nullptr);
  h6Method method = H6_METHOD_CLUSTER;
  std::uint32_t pieces = 7;
  CHECK(h6MethodFromName(nullptr, &method, &pieces) == -1);
  const std::string too_long(100000, '+');
  for (const char* odd :
       {"", "+", "firm+", "firm++", "firmer", "FIRM", " firm", "+facing", too_long.c_str()})
    CHECK(h6MethodFromName(odd, &method, &pieces) == -1);
  CHECK((method == H6_METHOD_CLUSTER && pieces == 7));
  CHECK(h6MethodFromName("firm", nullptr, nullptr) == 0);
}

TEST_CASE("a sentence or a handler that is NULL is left out") {
  std::vector<std::string> lines;
  h6SetLogHandler(
      [](void* user, h6LogLevel, const char* sentence) {
        static_cast<std::vector<std::string>*>(user)->push_back(sentence);
      },
      &lines);
  h6Log(H6_LOG_NOTE, nullptr), h6Log(static_cast<h6LogLevel>(99), "odd level");
  h6SetLogHandler(nullptr, &lines);
  h6Log(H6_LOG_WARNING, "to nobody");
  CHECK(lines == std::vector<std::string>{"odd level"});
  static int asked;
  asked = 0;
  h6SetAssertHandler([](const char*, const char*, int) { return ++asked, 0; });
  CHECK(h6AssertFailed(nullptr, nullptr, -1) == 0);
  CHECK(asked == 1);
  h6SetAssertHandler(nullptr);
}

TEST_CASE("a field is not sampled where there is none, or without room, and no bits are written") {
  const Held held;
  const double place[3] = {4e-3, 4e-3, 5e-3};
  double distance = 7, gradient[3] = {7, 7, 7};
  std::uint8_t exact = 7;
  for (const std::int32_t odd : {-1, 1, INT32_MAX, INT32_MIN})
    CHECK(h6SampleField(held.model, odd, place, 1, &distance, gradient, &exact) == -1);
  CHECK(h6SampleField(nullptr, 0, place, 1, &distance, gradient, &exact) == -1);
  CHECK(h6SampleField(held.model, 0, nullptr, 1, &distance, gradient, &exact) == -1);
  CHECK(h6SampleField(held.model, 0, nullptr, SIZE_MAX, &distance, gradient, &exact) == -1);
  CHECK(h6SampleField(held.model, 0, place, 1, nullptr, gradient, &exact) == -1);
  CHECK(h6SampleField(held.model, 0, nullptr, 0, nullptr, nullptr, nullptr) == 0);
  CHECK((distance == 7 && gradient[2] == 7 && exact == 7));
  CHECK(h6SampleField(held.model, 0, place, 1, &distance, nullptr, nullptr) == 0);
  CHECK(distance == doctest::Approx(1e-3));
  for (const double odd : {std::nan(""), kInfinity, -kInfinity, 1e300}) {
    const double nowhere[3] = {4e-3, odd, 5e-3};
    CHECK(h6SampleField(held.model, 0, nowhere, 1, &distance, gradient, &exact) == 0);
    CHECK(exact == 0);
  }
}

TEST_CASE("records, reports and views of nothing are zeros, and room that is NULL is not written") {
  const Held held;
  const h6DeviceSample sample = h6DefaultDeviceSample();
  h6DeviceCommand command;
  h6Step(held.session, &sample, &command), h6Step(held.session, &sample, nullptr);
  h6FrameRecord row;
  const auto empty = [&row] { return row.report.frame == 0 && row.report.state_hash == 0; };
  h6GetRecord(held.session, &sample, &command, &row);
  CHECK_FALSE(empty());
  h6GetRecord(nullptr, &sample, &command, &row);
  CHECK(empty());
  row.report.frame = 7, h6GetRecord(held.session, nullptr, &command, &row);
  CHECK(empty());
  row.report.frame = 7, h6GetRecord(held.session, &sample, nullptr, &row);
  CHECK(empty());
  h6GetRecord(held.session, &sample, &command, nullptr);
  h6HandSafety safety;
  for (const std::int32_t odd : {-1, 1, INT32_MAX}) {
    safety.state = H6_LOST;
    h6GetSafety(held.session, odd, &safety);
    CHECK(safety.state == H6_ABSENT);
  }
  h6GetSafety(nullptr, 0, &safety), h6GetSafety(held.session, 0, nullptr);
  CHECK(safety.state == H6_ABSENT);
  h6LoopReport report;
  report.frames = 7;
  h6JoinLoop(nullptr, &report), h6JoinLoop(nullptr, nullptr);
  CHECK(report.frames == 0);
}

TEST_CASE("a loop's room that is NULL is not written, and a wild pace is the usual one") {
  const Held held;
  h6Device device = h6DefaultDevice();
  h6LoopDef def = h6DefaultLoopDef();
  def.virtual_time = true, def.realtime = false, def.duration = 0.05, def.view_contacts = 10;
  h6Error error{};
  CHECK(h6StartLoop(held.session, nullptr, &def, &error) == nullptr);
  CHECK(error.code == H6_ERROR_ARGUMENT);
  CHECK(h6StartLoop(held.session, &device, &def, nullptr) == nullptr);  // it has no functions
  device.read = [](void*, double, h6DeviceSample* out) {
    *out = h6DefaultDeviceSample();
    return 0;
  };
  device.write = [](void*, double, const h6DeviceCommand*) { return 0; };
  for (const double wild : {std::nan(""), kInfinity, -1.0}) {
    h6LoopDef odd = def;
    odd.duration = wild;
    CHECK(h6StartLoop(held.session, &device, &odd, &error) == nullptr);
    CHECK(error.code == H6_ERROR_RANGE);
  }
  for (std::size_t h6LoopDef::*count :
       {&h6LoopDef::ring_frames, &h6LoopDef::ring_inputs, &h6LoopDef::view_contacts}) {
    h6LoopDef odd = def;
    odd.*count = SIZE_MAX;
    CHECK(h6StartLoop(held.session, &device, &odd, nullptr) == nullptr);
  }
  const hapsix::Loop loop = hapsix::start_loop(held.session, {&device, 1}, def);
  for (const double wild : {std::nan(""), kInfinity, -1.0}) h6SetPace(loop, wild);
  CHECK(h6ChangeSession(loop, nullptr, &error) == nullptr);
  CHECK(error.code == H6_ERROR_ARGUMENT);
  CHECK(h6ReadRecords(loop, nullptr, SIZE_MAX) == 0);
  CHECK(h6ReadRecordsWithBends(loop, nullptr, nullptr, SIZE_MAX) == 0);
  CHECK_FALSE(h6ReadView(loop, nullptr));
  h6JoinLoop(loop, nullptr);
  std::vector<h6FrameRecord> rows(50);
  CHECK(h6ReadRecords(loop, rows.data(), 0) == 0);
  CHECK(h6ReadRecords(loop, rows.data(), SIZE_MAX) == 50);  // all that there are
}

TEST_CASE("workers that cannot be are not made, and a call without arrays steps nothing") {
  h6WorkersDef def = h6DefaultWorkersDef();
  h6Error error{};
  for (const std::uint32_t wild : {65u, UINT32_MAX}) {
    def.threads = wild;
    CHECK(h6CreateWorkers(&def, &error) == nullptr);
    CHECK(error.code == H6_ERROR_RANGE);
    CHECK(h6CreateWorkers(&def, nullptr) == nullptr);
  }
  CHECK(h6WorkerThreads(nullptr) == 0);
  h6DestroyWorkers(nullptr);
  const Held held;
  h6Session* const session = held.session;
  const h6Pose pose = h6DefaultDeviceSample().pose;
  h6Status status = 7;
  h6StepArrays arrays = h6DefaultStepArrays();
  arrays.sessions = &session, arrays.count = 1, arrays.pose = &pose, arrays.status = &status;
  const auto refused = [](h6StepArrays a, auto change) {
    change(a);
    return h6StepMany(nullptr, &a) == H6_OUTPUT_FAULT;
  };
  CHECK(h6StepMany(nullptr, nullptr) == H6_OUTPUT_FAULT);
  CHECK(refused(arrays, [](h6StepArrays& a) { a.sessions = nullptr; }));
  CHECK(refused(arrays, [](h6StepArrays& a) { a.pose = nullptr; }));
  CHECK(refused(arrays, [](h6StepArrays& a) { a.count = SIZE_MAX; }));
  CHECK(refused(arrays, [](h6StepArrays& a) { a.hands = UINT32_MAX; }));
  CHECK(refused(arrays, [](h6StepArrays& a) { a.steps = 0; }));
  CHECK(status == 7);
  CHECK(h6GetFrame(session).state_hash == 0);
  h6Session* const nobody = nullptr;
  arrays.sessions = &nobody;
  CHECK(h6StepMany(nullptr, &arrays) == H6_OUTPUT_FAULT);
  CHECK(status == H6_OUTPUT_FAULT);
}

TEST_CASE("every function of the contract with an argument stands in a test of wrong arguments") {
  namespace fs = std::filesystem;
  const fs::path root = fs::path(__FILE__).parent_path().parent_path().parent_path();
  const auto text_of = [&](const fs::path& file) {
    std::ifstream in(root / file);
    REQUIRE_MESSAGE(in, file);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  std::string tests = text_of("tests/runtime/frame/arguments_test.cpp");
  // In these files they are the last part.
  for (const char* file :
       {"tests/contract/handles_test.cpp", "tests/io/api/bends_contract_test.cpp",
        "tests/io/api/io_contract_test.cpp"}) {
    const std::string text = text_of(file);
    const std::size_t first = text.find("\n// ---- wrong arguments");
    REQUIRE(first != std::string::npos);
    tests += text.substr(first);
  }
  std::vector<fs::path> headers{"io/api/hapsix/io.h"};
  for (const auto& entry : fs::directory_iterator(root / "runtime/include/hapsix"))
    headers.push_back(fs::relative(entry.path(), root));
  static const std::regex declared(R"(\nH6_API[^;(]*\b(h6[A-Z]\w*)\s*\((?!void\)))");
  std::size_t functions = 0;
  for (const fs::path& header : headers) {
    const std::string text = text_of(header);
    for (std::sregex_iterator it(text.begin(), text.end(), declared), end; it != end; ++it) {
      const std::string name = (*it)[1];
      ++functions;
      CHECK_MESSAGE(std::regex_search(tests, std::regex("\\b" + name + "\\(")), name);
    }
  }
  CHECK(functions > 90);
}
