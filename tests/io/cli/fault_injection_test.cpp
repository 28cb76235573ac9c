// SPDX-License-Identifier: Apache-2.0
// Injects faults of devices, threads and processes. This process plays the device, so it receives
// every command and every stop, even the last ones of an engine that dies.
//
// The engine runs in a child process, in real time. A busy machine can hold it up until its
// watchdog acts: the force then ends at zero as it should, only for another cause.
#include <doctest/doctest.h>

#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <new>
#include <string>
#include <thread>
#include <vector>

#include "hapsix/hapsix.h"
#include "tests/support/box_on_floor.h"
#include "tests/support/reports.h"

#if defined(__SANITIZE_THREAD__)
// One test makes the engine exit while its loop runs, so that its thread still exists at the exit.
extern "C" const char* __tsan_default_options() { return "report_thread_leaks=0"; }
#endif

using namespace h6::test;

namespace {

constexpr double kRating = 20, kRate = 2000;  // force limit [N], slew limit [N/s]

using Clock = std::chrono::steady_clock;

double now_seconds() {
  return std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
}
void pause_ms(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

// Faults that this process wants from the engine's process, in shared memory.
struct Wishes {
  std::atomic<bool> freeze{false}, no_number{false}, unplugged{false};
  std::atomic<double> shift{0};        // shift of the pose [m]
  std::atomic<int> stall_ms{0};        // one stall in read; if < 0, it lasts until this is 0 again
  std::atomic<int> write_stall_ms{0};  // one stall in write, after the command
  std::atomic<bool> arm{false}, crash{false}, exits{false}, destroys{false};
};

// A message from the engine's process: a command, a stop or a report.
struct Packet {
  enum Kind : int { kWrite, kStop, kReport } kind;
  double sent;  // [s]
  h6Vec3 force;
  h6Cause cause;  // the latched cause, in a report
  std::uint32_t causes;
};

// ---- the engine's process ----------------------------------------------------------------------

struct Driver {
  Wishes* wishes;
  int wire;
  std::uint32_t sequence = 0;

  void send(const Packet& packet) const {
    (void)!::send(wire, &packet, sizeof packet, MSG_NOSIGNAL);
  }

  h6Device device() {
    h6Device d{};
    d.self = this;
    d.capabilities.max_force = kRating, d.capabilities.max_torque = 2;
    d.capabilities.max_force_rate = kRate;
    d.read = [](void* self, double, h6DeviceSample* out) {
      auto& me = *static_cast<Driver*>(self);
      Wishes& w = *me.wishes;
      const int stall = w.stall_ms.load();
      if (stall > 0) {
        w.stall_ms.store(0);
        pause_ms(stall);
      }
      while (w.stall_ms.load() < 0) pause_ms(1);
      if (w.unplugged.load()) return -1;
      if (!w.freeze.load()) ++me.sequence;
      *out = hand_at(pose(w.shift.load(), 0, 3 * mm));  // 2 mm below the floor
      out->sequence = me.sequence;
      if (w.no_number.load()) out->pose.p.x = NAN;
      return 0;
    };
    d.write = [](void* self, double, const h6DeviceCommand* c) {
      static_cast<Driver*>(self)->send(
          {Packet::kWrite, now_seconds(), c->wrench.force, c->cause, c->causes});
      const int stall = static_cast<Driver*>(self)->wishes->write_stall_ms.exchange(0);
      if (stall > 0) pause_ms(stall);
      return 0;
    };
    d.stop = [](void* self) {
      static_cast<Driver*>(self)->send({Packet::kStop, now_seconds(), {}, H6_CAUSE_NONE, 0});
    };
    return d;
  }
};

// A signal handler as a program would have it: it halts every loop.
void on_signal(int number) {
  h6HaltAll();
  signal(number, SIG_DFL);
  raise(number);
}

[[noreturn]] void run_engine(Wishes& wishes, int wire) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  for (const int number : {SIGTERM, SIGINT, SIGSEGV, SIGABRT}) signal(number, on_signal);
  Driver driver{&wishes, wire};
  BoxOnFloor scene;
  scene.def.contact.method = H6_METHOD_NONE;
  scene.hand.safety.soft_start = 0.04;
  scene.hand.coupling.stiffness = 1e4;
  scene.hand.coupling.max_depth_voxels = 20;
  scene.hand.coupling.max_force = 5;
  h6Session* session = h6CreateSession(scene.model.handle, &scene.def, nullptr);
  if (!session) _exit(3);
  h6LoopDef def = h6DefaultLoopDef();
  def.realtime = false;
  const h6Device device = driver.device();
  h6Loop* loop = h6StartLoop(session, &device, &def, nullptr);
  if (!loop) _exit(4);
  for (;;) {
    pause_ms(1);
    if (wishes.arm.exchange(false)) h6ArmLoop(loop);
    if (wishes.crash.load()) {
      // Write to a protected page. A sanitizer would catch a null pointer first.
      void* const page = mmap(nullptr, 4096, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
      *static_cast<volatile int*>(page) = 1;
    }
    if (wishes.exits.load()) std::exit(0);
    if (wishes.destroys.load()) {
      h6RequestStop(loop);
      const h6LoopReport report = h6::test::joined(loop);
      h6DestroyLoop(loop);
      driver.send({Packet::kReport, now_seconds(), {}, report.fault, 0});
      _exit(0);
    }
  }
}

// ---- the device's process: this one ------------------------------------------------------------

class Rig {
 public:
  Rig() {
    void* shared =
        mmap(nullptr, sizeof(Wishes), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    REQUIRE(shared != MAP_FAILED);
    wishes = new (shared) Wishes;
    int ends[2];
    REQUIRE(socketpair(AF_UNIX, SOCK_SEQPACKET, 0, ends) == 0);
    std::fflush(nullptr);  // else the child prints the buffered text again
    pid_ = fork();
    REQUIRE(pid_ >= 0);
    if (pid_ == 0) {
      close(ends[0]);
      run_engine(*wishes, ends[1]);
    }
    close(ends[1]);
    wire_ = ends[0];
  }
  ~Rig() {
    if (pid_ > 0) kill(pid_, SIGKILL), waitpid(pid_, nullptr, 0);
    close(wire_);
    munmap(wishes, sizeof(Wishes));
  }
  Rig(const Rig&) = delete;
  Rig& operator=(const Rig&) = delete;

  Wishes* wishes;
  std::vector<Packet> heard;

  // Listens until the condition holds. Returns false if it does not hold in time.
  bool until(const std::function<bool()>& holds, double seconds = 120) {
    for (const double end = now_seconds() + seconds; now_seconds() < end;) {
      listen();
      if (holds()) return true;
      pause_ms(1);
    }
    return holds();
  }
  void listen() {
    Packet packet;
    while (recv(wire_, &packet, sizeof packet, MSG_DONTWAIT) == sizeof packet)
      heard.push_back(packet);
  }
  // The force that the device renders, from the last message [N].
  double force() const { return heard.empty() ? 0 : norm(heard.back().force); }
  bool full() const { return force() > 4.9; }
  // Waits until the engine pushes with full force. If the machine was too slow for the watchdog, it
  // arms the engine again.
  void push() {
    for (int tries = 0; tries < 100; ++tries) {
      if (until([&] { return full() && heard.size() > 50; }, 0.5)) return;
      wishes->arm.store(true);
    }
    FAIL("no force");
  }
  // Does the same after a latched fault.
  void push_again() {
    wishes->arm.store(true);
    push();
  }
  // said() looks only at messages after the last mark().
  void mark() {
    listen();
    from_ = heard.size();
  }
  bool said(h6Cause cause) const {
    for (std::size_t i = from_; i < heard.size(); ++i)
      if (heard[i].causes >> cause & 1u) return true;
    return false;
  }
  bool held_up() const { return said(H6_CAUSE_WATCHDOG) || said(H6_CAUSE_LATE); }
  bool for_a_while(const std::function<bool()>& holds, double seconds = 0.06) {
    for (const double end = now_seconds() + seconds; now_seconds() < end;) {
      listen();
      if (!holds()) return false;
      pause_ms(1);
    }
    return true;
  }
  // Checks that the fault takes the force to zero for this cause, and that it stays there.
  void ends_at_zero(h6Cause cause) {
    CAPTURE(h6CauseName(cause));
    CHECK(until([&] { return force() == 0 && (said(cause) || held_up()); }));
    CHECK(for_a_while([&] { return force() == 0; }));
    check_limits();
  }
  void check_limits() const {
    h6Vec3 last{};
    for (const Packet& p : heard) {
      if (p.kind == Packet::kReport) continue;
      REQUIRE(norm(p.force) <= kRating);
      // The force may grow only at the slew limit.
      REQUIRE(norm(p.force) - norm(last) <= kRate * 1e-3 * (1 + 1e-9));
      last = p.force;
    }
  }
  void send(int number) const { kill(pid_, number); }
  int wait() {
    int status = 0;
    waitpid(pid_, &status, 0);
    pid_ = -1;
    listen();
    return WIFSIGNALED(status) ? -WTERMSIG(status) : WEXITSTATUS(status);
  }
  // Checks that the engine stopped the device as its last message.
  void last_word_is_nothing() {
    REQUIRE(!heard.empty());
    CHECK(heard.back().kind == Packet::kStop);
    CHECK(force() == 0);
    check_limits();
  }

 private:
  pid_t pid_ = -1;
  int wire_ = -1;
  std::size_t from_ = 0;
};

}  // namespace

TEST_CASE("a frozen device: zero, latched, until it lives and is armed again") {
  Rig rig;
  rig.push();
  rig.mark();
  rig.wishes->freeze = true;
  rig.ends_at_zero(H6_CAUSE_FROZEN);
  rig.wishes->freeze = false;
  CHECK(rig.for_a_while([&] { return rig.force() == 0; }));
  rig.push_again();
}

TEST_CASE("poses that are no numbers: zero, latched, until armed") {
  Rig rig;
  rig.push();
  rig.mark();
  rig.wishes->no_number = true;
  rig.ends_at_zero(H6_CAUSE_BAD_SAMPLE);
  rig.wishes->no_number = false;
  CHECK(rig.for_a_while([&] { return rig.force() == 0; }));
  rig.push_again();
}

TEST_CASE("a pose that jumps by 50 mm: zero at once, then a soft start") {
  Rig rig;
  rig.push();
  rig.mark();
  rig.wishes->shift = 0.05;
  CHECK(rig.until([&] { return rig.said(H6_CAUSE_POSE_JUMP) || rig.held_up(); }));
  for (const Packet& p : rig.heard)
    if (p.cause == H6_CAUSE_POSE_JUMP) CHECK(norm(p.force) == 0);
  CHECK(rig.until([&] { return rig.said(H6_CAUSE_SOFT_START) || rig.held_up(); }));
  rig.push();
  rig.check_limits();
}

TEST_CASE("unplugged: zero at once; plugged in again: zero until armed") {
  Rig rig;
  rig.push();
  rig.mark();
  rig.wishes->unplugged = true;
  rig.ends_at_zero(H6_CAUSE_DEVICE_LOST);
  rig.wishes->unplugged = false;
  CHECK(rig.for_a_while([&] { return rig.force() == 0; }));
  rig.push_again();
}

TEST_CASE("a stall of 5 ms costs some force, which comes back") {
  Rig rig;
  rig.push();
  rig.mark();
  rig.wishes->stall_ms = 5;
  CHECK(rig.until([&] { return rig.said(H6_CAUSE_LATE); }));
  rig.push();
  rig.check_limits();
}

TEST_CASE("a stall of 200 ms: the watchdog stops the device meanwhile, latched, until armed") {
  Rig rig;
  rig.push();
  rig.mark();
  rig.wishes->stall_ms = 200;
  CHECK(rig.until([&] { return rig.heard.back().kind == Packet::kStop; }));
  rig.ends_at_zero(H6_CAUSE_WATCHDOG);
  CHECK(rig.said(H6_CAUSE_LATE));
  rig.push_again();
}

TEST_CASE("a device that takes a command and holds the thread for 200 ms: stopped, latched") {
  Rig rig;
  rig.push();
  rig.mark();
  rig.wishes->write_stall_ms = 200;
  CHECK(rig.until([&] { return rig.heard.back().kind == Packet::kStop; }));
  rig.ends_at_zero(H6_CAUSE_WATCHDOG);
  rig.push_again();
}

TEST_CASE("the haptic thread hangs for good: the watchdog alone keeps the device at zero") {
  Rig rig;
  rig.push();
  rig.mark();
  rig.wishes->stall_ms = -1;
  CHECK(rig.until([&] { return rig.heard.back().kind == Packet::kStop; }));
  CHECK(rig.for_a_while([&] { return rig.heard.back().kind == Packet::kStop; }));
  rig.wishes->stall_ms = 0;  // the thread runs on, but the force must stay zero
  CHECK(rig.until([&] { return rig.heard.back().kind == Packet::kWrite; }));
  CHECK(rig.for_a_while([&] { return rig.force() == 0; }));
  CHECK(rig.said(H6_CAUSE_WATCHDOG));
  rig.check_limits();
}

TEST_CASE("SIGTERM, SIGSEGV, SIGABRT from outside: the last word is a stop") {
  for (const int number : {SIGTERM, SIGSEGV, SIGABRT}) {
    CAPTURE(number);
    Rig rig;
    rig.push();
    rig.send(number);
    CHECK(rig.wait() == -number);
    rig.last_word_is_nothing();
  }
}

TEST_CASE("a crash in the program itself: the last word is a stop") {
  Rig rig;
  rig.push();
  rig.wishes->crash = true;
  CHECK(rig.wait() == -SIGSEGV);
  rig.last_word_is_nothing();
}

TEST_CASE("exit in the middle of a loop: the last word is a stop") {
  Rig rig;
  rig.push();
  rig.wishes->exits = true;
  CHECK(rig.wait() == 0);
  rig.last_word_is_nothing();
}

TEST_CASE("a loop that ends: stopped, and only then joined") {
  Rig rig;
  rig.push();
  rig.wishes->destroys = true;
  CHECK(rig.wait() == 0);
  REQUIRE(rig.heard.back().kind == Packet::kReport);
  rig.heard.pop_back();
  rig.last_word_is_nothing();
}
